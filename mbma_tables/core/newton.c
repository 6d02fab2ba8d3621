/* Exact islands by Newton's method (Eqs. 34, 36, 37).
 *
 * Newton's unknown is the sphere's deformation w at the Gauss nodes. The residual w - a A p(w) is monotone, so full
 * steps from w = 0 converge; its Jacobian 1 + a A D, D = -dp/dw, is solved in the symmetric form 1 + s A s,
 * s = sqrt(a D). Vectors over the nodes are values times the roots of the weights.
 *
 * SPDX-License-Identifier: BSD-3-Clause. Copyright (c) 2026, mbma_tables contributors.
 */
#include "heights.h"
#include "mbma.h"

enum {
    LEAST_NODES = 8,    /* of a basis */
    TOGETHER = 4,       /* neighbouring modes; the largest is used, since single ones may vanish */
    MAX_STEPS = 200,    /* of Newton's method, which takes up to about 40 */
    MAX_WIDENINGS = 20, /* changes of the radius; at most one was observed */
    QUARTERINGS = 10    /* of the interval that holds the radius */
};
#define COARSE_TOLERANCE 1e-4
#define MIN_COARSE_RATIO 1.5 /* a coarse solution first, if the basis is larger than its basis by this factor */
#define ROUNDING 1e-14
#define TINY 1e-300
#define NEGLIGIBLE 1e-17 /* a relative effect of the deformation below which the sphere is rigid */

size_t mbma_height_integrals(int64_t twice_n, size_t n, const double *x, double *out) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const bool good = twice_n >= 1 && twice_n <= 5 && isfinite(x[k]);
        const halves of = halves_of(good ? x[k] : 0.0);
        const double found = twice_n == 1 ? of.half : twice_n == 3 ? of.three_halves : of.five_halves;
        out[k] = !good ? NAN : twice_n % 2 ? found : whole((int)(twice_n / 2), x[k]);
        bad += !good;
    }
    return bad;
}

/* a^2 with all but `share` of the area on a rigid sphere inside rho < a. */
static double extent_squared(double X, double mu, double share) {
    /* elasticity takes up to a factor mu F_{3/2} of the force away from the middle, little from the edge */
    const double softening = 1.0 / sqrt(sqrt(1.0 + mu * halves_of(-X).three_halves));
    const double target = whole(2, -X) * (share * softening);
    double low = -X, high = mbma_max(-X, 0.0) + 1.0;
    /* beyond 38 F underflows */
    while (high < 38.0 && whole(2, high) > target) {
        low = high;
        high += 2.0;
    }
    for (int k = 0; k < QUARTERINGS; k++) {
        const double step = 0.25 * (high - low);
        int above = 0;
        for (int quarter = 1; quarter < 4; quarter++)
            above += whole(2, low + quarter * step) > target;
        low += above * step;
        high = low + step;
    }
    return high + X;
}

size_t mbma_island_extents(size_t n, const double *X, const double *mu, double share, double *squared) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const bool good = isfinite(X[k]) && isfinite(mu[k]) && mu[k] >= 0.0 && share > 0.0;
        squared[k] = good ? extent_squared(X[k], mu[k], share) : NAN;
        bad += !good;
    }
    return bad;
}

/* ---- linear algebra, in one order on every processor ---- */

/* Adds the sum of factors[k] times row k of n numbers, from column `first` on, to `out`; in order of k, by four. */
static void add_rows(size_t count, const double *factors, const double *rows, size_t n, size_t first,
                     double *restrict out) {
    size_t k = 0;
    for (; k + 4 <= count; k += 4) {
        const double *const a = rows + k * n, *const b = a + n, *const c = b + n, *const d = c + n, *const f = factors + k;
        for (size_t j = first; j < n; j++)
            out[j] = mbma_fma(d[j], f[3], mbma_fma(c[j], f[2], mbma_fma(b[j], f[1], mbma_fma(a[j], f[0], out[j]))));
    }
    for (; k < count; k++)
        for (size_t j = first; j < n; j++)
            out[j] = mbma_fma(rows[k * n + j], factors[k], out[j]);
}

static void combine(size_t count, const double *factors, const double *rows, size_t n, double *out) {
    memset(out, 0, n * sizeof *out);
    add_rows(count, factors, rows, n, 0, out);
}

/* z becomes (1 + s A s)^-1 z, by 1 + s A s = U^T D U, ones on the diagonal of U, whose rows `m` receives, and `d` D. */
static void solve_symmetric(const double *A, const double *s, size_t n, double *m, double *d, double *factors,
                            double *z) {
    for (size_t i = 0; i < n; i++) {
        double *const row = m + i * n;
        for (size_t j = i; j < n; j++)
            row[j] = s[i] * A[i * n + j] * s[j];
        for (size_t k = 0; k < i; k++)
            factors[k] = -d[k] * m[k * n + i];
        add_rows(i, factors, m, n, i, row);
        d[i] = 1.0 + row[i];
        for (size_t j = i; j < n; j++)
            row[j] *= 1.0 / d[i];
        z[i] = (z[i] + dot(factors, z, i)) * (1.0 / d[i]);
    }
    for (size_t i = n - 1; i-- > 0;)
        z[i] -= dot(m + i * n + i + 1, z + i + 1, n - i - 1);
}

/* ---- Newton's method ---- */

/* One island: its numbers, and the caller's work space. */
typedef struct {
    double X, mu, squared; /* a^2 */
    double *w, *p, *covered, *rough, *s, *residual, *z, *diagonal, *factors, *matrix;
    int64_t steps;
} island;

/* The gap at a node, negative where the mean planes overlap. */
MBMA_INLINE double gap_at(const island *of, const mbma_basis *b, const double *w, size_t i) {
    return of->squared * b->v[i] - of->X + w[i] / b->root_weights[i];
}

/* Step until the relative error of the pressure is below `tolerance`. Returns the error after the last step, the
 * square of its relative change of pressure; NaN where MAX_STEPS did not suffice. */
static double newton_steps(island *of, const mbma_basis *b, double tolerance, double *w) {
    const size_t n = b->nodes;
    const double a = sqrt(of->squared);
    for (int step = 0; step < MAX_STEPS && isfinite(w[0]); step++) {
        double largest = 0.0, change = 0.0;
        for (size_t i = 0; i < n; i++) {
            const halves F = halves_of(gap_at(of, b, w, i));
            of->p[i] = 0.5 * F.three_halves * b->root_weights[i];
            of->s[i] = sqrt(0.75 * of->mu * a * F.half);
            largest = mbma_max(largest, F.three_halves);
        }
        combine(n, of->p, b->matrix, n, of->residual);
        for (size_t i = 0; i < n; i++) {
            of->residual[i] = of->mu * a * of->residual[i] - w[i];
            of->z[i] = of->s[i] * of->residual[i];
        }
        solve_symmetric(b->matrix, of->s, n, of->matrix, of->diagonal, of->factors, of->z);
        for (size_t i = 0; i < n; i++)
            of->z[i] *= of->s[i];
        combine(n, of->z, b->matrix, n, of->factors);
        for (size_t i = 0; i < n; i++) {
            const double by = of->residual[i] - of->factors[i];
            w[i] += by;
            change = mbma_max(change, of->s[i] * of->s[i] * fabs(by) / b->root_weights[i]);
        }
        of->steps++;
        const double relative = of->mu > 0.0 ? change / (0.5 * of->mu * a * largest) : 0.0;
        if (relative * relative <= tolerance)
            return relative * relative;
    }
    return NAN;
}

/* Pressure over mu and area of contact at the nodes. */
static void fill_profile(island *of, const mbma_basis *b) {
    for (size_t i = 0; i < b->nodes; i++) {
        const double gap = gap_at(of, b, of->w, i);
        of->p[i] = 0.5 * halves_of(gap).three_halves * b->root_weights[i];
        of->covered[i] = whole(1, gap) * b->root_weights[i];
    }
}

static double largest_mode(const mbma_basis *b, const double *vector, size_t first) {
    double largest = 0.0;
    for (size_t k = first; k < first + TOGETHER; k++)
        largest = mbma_max(largest, fabs(dot(b->modes + k * b->nodes, vector, b->nodes)));
    return largest;
}

/* Relative error of a profile's Gauss sum: its modes beyond 2n, extrapolated from n/2 and n. */
static double unresolved(const mbma_basis *b, const double *vector, double sum) {
    const double last = largest_mode(b, vector, b->nodes - TOGETHER);
    const double ratio = last / mbma_max(largest_mode(b, vector, b->nodes / 2 - TOGETHER / 2), TINY);
    return last * mbma_min(1.0, ratio * ratio) / sum;
}

/* `phi` receives Phi_F, Phi_A and an estimate of their relative error. */
static mbma_status solve(island *of, double rtol, const mbma_basis *b, const mbma_basis *coarse, double phi[3]) {
    const size_t n = b->nodes, few = coarse->nodes;
    if (!isfinite(of->X) || !isfinite(of->mu) || of->mu < 0.0 || n < LEAST_NODES)
        return MBMA_INVALID;
    const halves deepest = halves_of(-of->X);
    const double area_0 = whole(2, -of->X);
    of->squared = area_0 > TINY ? extent_squared(of->X, of->mu, 0.03 * rtol) : 1.0;
    memset(of->w, 0, n * sizeof *of->w);
    if (of->mu * deepest.half * (1.0 + of->squared) < NEGLIGIBLE) {
        /* the rigid sphere, the limit as mu goes to 0 */
        phi[0] = of->mu * (MBMA_PI / 5.0 * deepest.five_halves);
        phi[1] = MBMA_PI / 2.0 * area_0;
        phi[2] = area_0 > 0.0 ? ROUNDING : 0.0;
        fill_profile(of, b);
        return MBMA_OK;
    }
    if (few >= LEAST_NODES && (double)n >= MIN_COARSE_RATIO * (double)few) {
        /* begin with a coarse solution on few nodes, interpolated by its Legendre modes */
        memset(of->rough, 0, few * sizeof *of->rough);
        if (newton_steps(of, coarse, COARSE_TOLERANCE, of->rough) <= COARSE_TOLERANCE) {
            for (size_t k = 0; k < few; k++)
                of->covered[k] = dot(coarse->modes + k * few, of->rough, few);
            combine(few, of->covered, b->modes, n, of->w);
        }
    }
    for (int widened = 0; widened <= MAX_WIDENINGS; widened++) {
        const double left = newton_steps(of, b, 0.01 * rtol, of->w);
        if (!isfinite(left))
            return MBMA_UNRESOLVED;
        fill_profile(of, b);
        const double force = dot(of->p, b->root_weights, n), area = dot(of->covered, b->root_weights, n);
        /* contribution outside a, with pressure and area decaying as on a rigid sphere */
        const double edge = of->squared - of->X + of->w[n - 1] / b->root_weights[n - 1];
        const double missed = mbma_max(halves_of(edge).five_halves / (5.0 * force), whole(2, edge) / (2.0 * area));
        const double cut = missed / of->squared;
        if (!(12.0 * cut > rtol)) {
            const double discrete = mbma_max(unresolved(b, of->p, force), unresolved(b, of->covered, area));
            phi[0] = of->mu * (MBMA_PI * of->squared * force);
            phi[1] = MBMA_PI * of->squared * area;
            phi[2] = 8.0 * (discrete + cut) + left + ROUNDING;
            return MBMA_OK;
        }
        /* hard contact lifts the middle more than expected: widen */
        of->squared += 1.0;
    }
    return MBMA_UNRESOLVED;
}

size_t mbma_solve_islands(size_t n, const double *X, const double *mu, double rtol, const mbma_basis *fine,
                          const mbma_basis *coarse, double *phi, int64_t *steps, uint8_t *status, double *rho,
                          double *pressure, double *gap, double *work) {
    const size_t nodes = fine->nodes;
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        island of = {X[k], mu[k], NAN, work, work + nodes, work + 2 * nodes, work + 3 * nodes, work + 4 * nodes,
                     work + 5 * nodes, work + 6 * nodes, work + 7 * nodes, work + 8 * nodes, work + 9 * nodes, 0};
        mbma_status found = solve(&of, rtol, fine, coarse, phi + 3 * k);
        if (found == MBMA_OK && !isfinite(phi[3 * k] + phi[3 * k + 1] + phi[3 * k + 2]))
            found = MBMA_UNRESOLVED;
        const bool good = found == MBMA_OK;
        for (size_t j = 0; j < 3 && !good; j++)
            phi[3 * k + j] = NAN;
        status[k] = (uint8_t)found;
        steps[k] = of.steps;
        bad += !good;
        for (size_t i = 0, at = k * nodes; i < nodes && rho != NULL; i++, at++) {
            rho[at] = good ? sqrt(of.squared * fine->v[i]) : NAN;
            pressure[at] = good ? mu[k] * of.p[i] / fine->root_weights[i] : NAN;
            gap[at] = good ? gap_at(&of, fine, of.w, i) : NAN;
        }
    }
    return bad;
}
