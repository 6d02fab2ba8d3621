/* Exact islands (Eqs. 34, 36, 37): height integrals, Newton's method, and the damped iteration of the paper.
 *
 * Newton's unknown is the sphere's deformation w at the Gauss nodes. The residual w - a A p(w) is monotone, so full
 * steps from w = 0 converge; its Jacobian 1 + a A D, D = -dp/dw, is solved in the symmetric form 1 + s A s,
 * s = sqrt(a D). Vectors over the nodes are values times the roots of the weights.
 *
 * SPDX-License-Identifier: BSD-3-Clause. Copyright (c) 2026, mbma_tables contributors.
 */
#include "elementary.h"
#include "height_coefficients.h"
#include "mbma.h"

enum {
    LANES = 4,          /* numbers of a vector */
    RUNS = 4,           /* vectors at once */
    LEAST_NODES = 8,    /* of a basis */
    TOGETHER = 4,       /* neighbouring modes of which the largest counts, for single ones may vanish */
    MAX_STEPS = 200,    /* of Newton's method, which takes up to about 40 */
    MAX_WIDENINGS = 20, /* of the radius; one was the most seen */
    QUARTERINGS = 10    /* of the interval that holds the radius */
};
#define COARSE_TOLERANCE 1e-4
#define MIN_COARSE_RATIO 1.5 /* a rough solution first, where the basis is larger than its by this factor */
#define ROUNDING 1e-14
#define TINY 1e-300
#define NEGLIGIBLE 1e-17     /* a relative effect of the deformation below which the sphere is rigid */
#define MAX_DEFORMATION 1e12 /* one this large is divergence */

/* ---- height integrals F_n, named by twice n ---- */

enum { HALF = 1, ONE, THREE_HALVES, TWO, FIVE_HALVES };

/* F_n = polynomial(t) base^n weight fade, of which the last product alone can underflow. */
typedef struct {
    size_t piece;
    double t, base, weight, fade;
} spot;

/* Pieces are polynomials in 1/x^2 below -8, in x up to 0, and in 1/(x + 1) beyond, exp(-x^2/2)/(x + 1) taken out. */
MBMA_INLINE spot spot_of(double x) {
    static const double SCALE[8] = {128.0, 1.0, 1.0, 1.0, 1.0, 4.0, 1.0 / 0.15, 2.0 / (0.2 - 1.0 / 41.0)};
    static const double SHIFT[8] = {
        -1.0, 7.0, 5.0, 3.0, 1.0, -3.0, -0.35 / 0.15, -(0.2 + 1.0 / 41.0) / (0.2 - 1.0 / 41.0)};
    const bool deep = x < -8.0;
    /* beyond 40 F_n is 0; of x < 0 the weight is 1 */
    const double light = mbma_held(x, 0.0, 41.0), head = (double)(float)light, tail = light - head;
    const double inverse = 1.0 / (deep ? x * x : light + 1.0), v = deep ? 1.0 : inverse;
    const double square = light * light;
    /* what rounding took from the square, for exp is steep */
    const double lost = ((head * head - square) + 2.0 * head * tail) + tail * tail;
    spot at;
    at.piece = (size_t)((x >= -8.0) + (x >= -6.0) + (x >= -4.0) + (x >= -2.0) + (x >= 0.0) + (x >= 1.0) + (x >= 4.0));
    at.t = mbma_fma(SCALE[at.piece], deep || x >= 0.0 ? inverse : x, SHIFT[at.piece]);
    at.base = deep ? -x : v;
    at.fade = mbma_exp(-0.25 * square);
    at.weight = mbma_fma(-0.5 * lost, v, v) * at.fade;
    return at;
}

MBMA_INLINE double integral(int64_t twice_n, spot at) {
    const double *const row = MBMA_HEIGHT[twice_n - 1][at.piece];
    double value = row[18], power = twice_n % 2 ? sqrt(at.base) : 1.0;
    for (int k = 17; k >= 0; k--)
        value = mbma_fma(value, at.t, row[k]);
    for (int k = 0; k < twice_n / 2; k++)
        power *= at.base;
    return value * (power * at.weight) * at.fade;
}

size_t mbma_height_integrals(int64_t twice_n, size_t n, const double *x, double *out) {
    const bool known = twice_n >= HALF && twice_n <= FIVE_HALVES;
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const bool good = known && isfinite(x[k]);
        out[k] = good ? integral(twice_n, spot_of(x[k])) : NAN;
        bad += good ? 0 : 1;
    }
    return bad;
}

/* a^2 with all but `share` of the area on a rigid sphere inside rho < a. */
static double extent_squared(double X, double mu, double share) {
    const spot deepest = spot_of(-X);
    /* elasticity takes up to a factor mu F_{3/2} of the force away from the middle, little from the edge */
    const double softening = 1.0 / sqrt(sqrt(1.0 + mu * integral(THREE_HALVES, deepest)));
    const double target = integral(TWO, deepest) * (share * softening);
    double low = -X, high = mbma_max(-X, 0.0) + 1.0;
    /* beyond 38 F underflows */
    while (high < 38.0 && integral(TWO, spot_of(high)) > target) {
        low = high;
        high += 2.0;
    }
    for (int k = 0; k < QUARTERINGS; k++) {
        const double step = 0.25 * (high - low);
        int above = 0;
        for (int quarter = 1; quarter < 4; quarter++)
            above += integral(TWO, spot_of(low + quarter * step)) > target;
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
        bad += good ? 0 : 1;
    }
    return bad;
}

/* ---- sums in one order on every processor ---- */

#if defined(__GNUC__)
typedef double lanes __attribute__((vector_size(8 * LANES)));
#else
typedef double lanes[LANES];
#endif

/* sum += factor times the LANES numbers from `a` on */
MBMA_INLINE void add_scaled(lanes *sum, double factor, const double *a) {
    lanes x, z;
    memcpy(&x, a, sizeof x);
    memcpy(&z, sum, sizeof z);
    for (int l = 0; l < LANES; l++)
        z[l] = mbma_fma(factor, x[l], z[l]);
    memcpy(sum, &z, sizeof z);
}

/* sum += the LANES products from `a` and `b` on */
MBMA_INLINE void add_products(lanes *sum, const double *a, const double *b) {
    lanes x, y, z;
    memcpy(&x, a, sizeof x);
    memcpy(&y, b, sizeof y);
    memcpy(&z, sum, sizeof z);
    for (int l = 0; l < LANES; l++)
        z[l] = mbma_fma(x[l], y[l], z[l]);
    memcpy(sum, &z, sizeof z);
}

static double dot(const double *a, const double *b, size_t n) {
    lanes even = {0.0}, odd = {0.0};
    double rest = 0.0;
    size_t k = 0;
    for (; k + 2 * LANES <= n; k += 2 * LANES) {
        add_products(&even, a + k, b + k);
        add_products(&odd, a + k + LANES, b + k + LANES);
    }
    if (k + LANES <= n) {
        add_products(&even, a + k, b + k);
        k += LANES;
    }
    for (; k < n; k++)
        rest = mbma_fma(a[k], b[k], rest);
    return (((even[0] + odd[0]) + (even[2] + odd[2])) + ((even[1] + odd[1]) + (even[3] + odd[3]))) + rest;
}

/* Columns of a row are summed in runs of LANES, where the last of them overlap rather than leave a rest. */
MBMA_INLINE void runs_from(size_t first, size_t n, size_t at[RUNS]) {
    for (size_t r = 0; r < RUNS; r++)
        at[r] = first + (r + 1) * LANES <= n ? first + r * LANES : n - LANES;
}

/* out = sum over j of factors[j] times row j of n numbers */
static void combine(size_t count, const double *factors, const double *rows, size_t n, double *out) {
    for (size_t first = 0; first < n; first += RUNS * LANES) {
        size_t at[RUNS];
        lanes sums[RUNS] = {{0.0}};
        runs_from(first, n, at);
        for (size_t j = 0; j < count; j++)
            for (size_t r = 0; r < RUNS; r++)
                add_scaled(&sums[r], factors[j], rows + j * n + at[r]);
        for (size_t r = 0; r < RUNS; r++)
            memcpy(out + at[r], &sums[r], sizeof sums[r]);
    }
}

/* z becomes (1 + s A s)^-1 z, by 1 + s A s = U^T D U, ones on the diagonal of U, whose rows `m` receives, and `d` D. */
static void solve_symmetric(const double *A, const double *s, size_t n, double *m, double *d, double *factors,
                            double *z) {
    for (size_t i = 0; i < n; i++) {
        double inverse = 0.0;
        for (size_t j = 0; j < i; j++)
            factors[j] = -d[j] * m[j * n + i];
        for (size_t first = i; first < n; first += RUNS * LANES) {
            size_t at[RUNS];
            lanes sums[RUNS];
            runs_from(first, n, at);
            for (size_t r = 0; r < RUNS; r++)
                for (size_t l = 0; l < LANES; l++)
                    sums[r][l] = s[i] * A[i * n + at[r] + l] * s[at[r] + l];
            for (size_t j = 0; j < i; j++)
                for (size_t r = 0; r < RUNS; r++)
                    add_scaled(&sums[r], factors[j], m + j * n + at[r]);
            if (first == i) {
                double run[LANES];
                memcpy(run, &sums[0], sizeof run);
                d[i] = 1.0 + run[i - at[0]];
                inverse = 1.0 / d[i];
            }
            for (size_t r = 0; r < RUNS; r++) {
                for (size_t l = 0; l < LANES; l++)
                    sums[r][l] *= inverse;
                memcpy(m + i * n + at[r], &sums[r], sizeof sums[r]);
            }
        }
        z[i] = (z[i] + dot(factors, z, i)) * inverse;
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

/* Step until the relative error of the pressure is below `tolerance`. Returns the error that the last step leaves, the
 * square of its relative change of pressure; NaN where MAX_STEPS did not suffice. */
static double newton_steps(island *of, const mbma_basis *b, double tolerance, double *w) {
    const size_t n = b->nodes;
    const double a = sqrt(of->squared);
    for (int step = 0; step < MAX_STEPS && isfinite(w[0]); step++) {
        double largest = 0.0, change = 0.0;
        for (size_t i = 0; i < n; i++) {
            const spot at = spot_of(of->squared * b->v[i] - of->X + w[i] / b->root_weights[i]);
            const double three_halves = integral(THREE_HALVES, at);
            of->p[i] = 0.5 * three_halves * b->root_weights[i];
            of->s[i] = sqrt(0.75 * of->mu * a * integral(HALF, at));
            largest = mbma_max(largest, three_halves);
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

/* Begin with a rough solution on few nodes, carried over by its Legendre modes. */
static void coarse_start(island *of, const mbma_basis *coarse, const mbma_basis *fine) {
    const size_t few = coarse->nodes;
    for (size_t k = 0; k < few; k++)
        of->rough[k] = 0.0;
    if (!(newton_steps(of, coarse, COARSE_TOLERANCE, of->rough) <= COARSE_TOLERANCE))
        return;
    for (size_t k = 0; k < few; k++)
        of->covered[k] = dot(coarse->modes + k * few, of->rough, few);
    combine(few, of->covered, fine->modes, fine->nodes, of->w);
}

/* Pressure over mu and area of contact at the nodes. */
static void fill_profile(island *of, const mbma_basis *b) {
    for (size_t i = 0; i < b->nodes; i++) {
        const spot at = spot_of(of->squared * b->v[i] - of->X + of->w[i] / b->root_weights[i]);
        of->p[i] = 0.5 * integral(THREE_HALVES, at) * b->root_weights[i];
        of->covered[i] = integral(ONE, at) * b->root_weights[i];
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
    const size_t n = b->nodes;
    if (!isfinite(of->X) || !isfinite(of->mu) || of->mu < 0.0 || n < LEAST_NODES)
        return MBMA_INVALID;
    const spot deepest = spot_of(-of->X);
    const double area_0 = integral(TWO, deepest);
    of->squared = area_0 > TINY ? extent_squared(of->X, of->mu, 0.03 * rtol) : 1.0;
    for (size_t i = 0; i < n; i++)
        of->w[i] = 0.0;
    if (of->mu * integral(HALF, deepest) * (1.0 + of->squared) < NEGLIGIBLE) {
        /* the rigid sphere, the limit as mu goes to 0 */
        phi[0] = of->mu * (MBMA_PI / 5.0 * integral(FIVE_HALVES, deepest));
        phi[1] = MBMA_PI / 2.0 * area_0;
        phi[2] = area_0 > 0.0 ? ROUNDING : 0.0;
        fill_profile(of, b);
        return MBMA_OK;
    }
    if (coarse->nodes >= LEAST_NODES && (double)n >= MIN_COARSE_RATIO * (double)coarse->nodes)
        coarse_start(of, coarse, b);
    for (int widened = 0; widened <= MAX_WIDENINGS; widened++) {
        const double left = newton_steps(of, b, 0.01 * rtol, of->w);
        if (!isfinite(left))
            return MBMA_UNRESOLVED;
        fill_profile(of, b);
        const double force = dot(of->p, b->root_weights, n), area = dot(of->covered, b->root_weights, n);
        const spot edge = spot_of(of->squared - of->X + of->w[n - 1] / b->root_weights[n - 1]);
        /* what lies outside a, for pressure and area as they decay over a rigid sphere */
        const double cut = mbma_max(integral(FIVE_HALVES, edge) / (5.0 * force), integral(TWO, edge) / (2.0 * area)) /
                           of->squared;
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
        bad += good ? 0 : 1;
        for (size_t i = 0, at = k * nodes; i < nodes && rho != NULL; i++, at++) {
            const double squared = of.squared * fine->v[i], root = fine->root_weights[i];
            rho[at] = good ? sqrt(squared) : NAN;
            pressure[at] = good ? mu[k] * of.p[i] / root : NAN;
            gap[at] = good ? squared - X[k] + of.w[i] / root : NAN;
        }
    }
    return bad;
}

/* ---- the damped iteration of Greenwood and Tripp ---- */

mbma_status mbma_damped_steps(double X, double mu, double a, double damping, double tolerance, int64_t most,
                              size_t rings, const double *matrix, double *w, double *p, double phi[2],
                              int64_t *steps) {
    const double width = a / (double)rings;
    mbma_status status = MBMA_UNRESOLVED;
    bool within = true;
    *steps = 0;
    while (*steps < most && within && status == MBMA_UNRESOLVED) {
        double largest = 0.0, scale = 0.0;
        for (size_t i = 0; i < rings; i++) {
            const double rho = width * ((double)i + 0.5);
            p[i] = 0.5 * mu * integral(THREE_HALVES, spot_of(rho * rho - X + w[i])); /* (36) */
        }
        for (size_t i = 0; i < rings; i++) {
            const double change = damping * (a * dot(matrix + i * rings, p, rings) - w[i]);
            w[i] += change;
            largest = mbma_max(largest, fabs(change));
            scale = mbma_max(scale, fabs(w[i]));
        }
        ++*steps;
        within = scale < MAX_DEFORMATION;
        if (within && largest <= tolerance * damping * scale)
            status = MBMA_OK;
    }
    phi[0] = phi[1] = 0.0;
    for (size_t i = 0; i < rings; i++) {
        const double rho = width * ((double)i + 0.5);
        const spot at = spot_of(rho * rho - X + w[i]);
        p[i] = 0.5 * mu * integral(THREE_HALVES, at);
        phi[0] += 2.0 * MBMA_PI * width * rho * p[i];
        phi[1] += 2.0 * MBMA_PI * width * rho * integral(ONE, at);
    }
    if (within && isfinite(phi[0] + phi[1]))
        return status;
    phi[0] = phi[1] = NAN;
    return MBMA_UNRESOLVED;
}
