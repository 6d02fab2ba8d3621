/* Exact islands by Newton's method (Eqs. 34, 36, 37).
 *
 * Newton's unknown is the sphere's deformation w at the Gauss nodes. The residual w - a A p(w) is
 * monotone, so full steps from w = 0 converge; its Jacobian 1 + a A D, D = -dp/dw, is solved in the
 * symmetric form 1 + s A s, s = sqrt(a D). Vectors over the nodes are values times the roots of the
 * weights.
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
/* Of the tolerance: for the area outside a, for Newton's steps. */
#define EXTENT_SHARE 0.03
#define NEWTON_SHARE 0.01
/* The contribution outside a is at most the tolerance over this, else a is widened; the error that
 * is stated is the discrete one and that contribution times the safety. */
#define MOST_CUTS 12.0
#define SAFETY 8.0
#define COARSE_TOLERANCE 1e-4
/* A coarse solution comes first if the basis is larger than its basis by this factor. */
#define MIN_COARSE_RATIO 1.5
#define ROUNDING 1e-14
#define TINY 1e-300
/* A relative effect of the deformation below which the sphere is rigid. */
#define NEGLIGIBLE 1e-17

/* F_n(x), n = twice_n/2 (36, 38). */
static double height_integral(int64_t twice_n, double x) {
    if (twice_n % 2 == 0)
        return whole((int)(twice_n / 2), x);
    const halves F = halves_of(x);
    if (twice_n == 1)
        return F.half;
    return twice_n == 3 ? F.three_halves : F.five_halves;
}

size_t mbma_height_integrals(int64_t twice_n, size_t n, const double *x, double *out) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const bool good = twice_n >= 1 && twice_n <= 5 && isfinite(x[k]);
        out[k] = good ? height_integral(twice_n, x[k]) : NAN;
        bad += !good;
    }
    return bad;
}

/* a^2 with all but `share` of the area on a rigid sphere inside rho < a. */
static double extent_squared(double X, double mu, double share) {
    /* elasticity takes up to a factor mu F_{3/2} of the force away from the middle, little from the
     * edge */
    const double softening = 1.0 / sqrt(sqrt(1.0 + mu * halves_of(-X).three_halves));
    const double target = whole(2, -X) * (share * softening);
    /* the bracket of the gap rho^2 - X at the edge; beyond 38 F underflows */
    double low = -X;
    double high = mbma_max(-X, 0.0) + 1.0;
    while (high < 38.0 && whole(2, high) > target) {
        low = high;
        high += 2.0;
    }
    for (int k = 0; k < QUARTERINGS; k++) {
        const double step = 0.25 * (high - low);
        int quarters_above = 0;
        for (int quarter = 1; quarter < 4; quarter++)
            quarters_above += whole(2, low + quarter * step) > target;
        low += quarters_above * step;
        high = low + step;
    }
    return high + X;
}

size_t mbma_island_extents(size_t n, const double *X, const double *mu, double share,
                           double *squared) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const bool good = isfinite(X[k]) && isfinite(mu[k]) && mu[k] >= 0.0 && share > 0.0;
        squared[k] = good ? extent_squared(X[k], mu[k], share) : NAN;
        bad += !good;
    }
    return bad;
}

/* ---- linear algebra, in one order on every processor ---- */

/* Adds the sum of factors[k] times row k of n numbers, from column `first` on, to `out`; in order
 * of k, by four. */
static void add_rows(size_t count, const double *factors, const double *rows, size_t n,
                     size_t first, double *restrict out) {
    size_t k = 0;
    for (; k + 4 <= count; k += 4) {
        const double *const f = factors + k;
        const double *const row_0 = rows + k * n;
        const double *const row_1 = row_0 + n;
        const double *const row_2 = row_1 + n;
        const double *const row_3 = row_2 + n;
        for (size_t j = first; j < n; j++) {
            double sum = mbma_fma(row_0[j], f[0], out[j]);
            sum = mbma_fma(row_1[j], f[1], sum);
            sum = mbma_fma(row_2[j], f[2], sum);
            out[j] = mbma_fma(row_3[j], f[3], sum);
        }
    }
    for (; k < count; k++)
        for (size_t j = first; j < n; j++)
            out[j] = mbma_fma(rows[k * n + j], factors[k], out[j]);
}

/* The sum of factors[k] times row k, alone. */
static void combine(size_t count, const double *factors, const double *rows, size_t n,
                    double *out) {
    memset(out, 0, n * sizeof *out);
    add_rows(count, factors, rows, n, 0, out);
}

/* z becomes (1 + s A s)^-1 z, by 1 + s A s = U^T D U, ones on the diagonal of U; U and D are
 * written to `upper`, by rows, and `pivots`. */
static void solve_symmetric(const double *A, const double *s, size_t n, double *upper,
                            double *pivots, double *factors, double *z) {
    for (size_t i = 0; i < n; i++) {
        double *const row = upper + i * n;
        for (size_t j = i; j < n; j++)
            row[j] = s[i] * A[i * n + j] * s[j];
        /* less what the rows above account for */
        for (size_t k = 0; k < i; k++)
            factors[k] = -pivots[k] * upper[k * n + i];
        add_rows(i, factors, upper, n, i, row);
        pivots[i] = 1.0 + row[i];
        for (size_t j = i; j < n; j++)
            row[j] *= 1.0 / pivots[i];
        /* forward substitution, by the same factors */
        z[i] = (z[i] + dot(factors, z, i)) * (1.0 / pivots[i]);
    }
    /* back substitution */
    for (size_t i = n - 1; i-- > 0;)
        z[i] -= dot(upper + i * n + i + 1, z + i + 1, n - i - 1);
}

/* ---- Newton's method ---- */

/* One island: its numbers, and vectors over the nodes in the caller's work space. */
typedef struct {
    double X, mu, a_squared;
    double *w;                             /* the deformation, Newton's unknown */
    double *p, *covered;                   /* pressure over mu, and area of contact */
    double *coarse_w;                      /* the deformation on the coarse basis */
    double *s, *residual;                  /* sqrt(a D), and a A p(w) - w */
    double *z, *pivots, *factors, *matrix; /* of the linear system */
    int64_t steps;
} island_problem;

/* Parts the work space, MBMA_ISLANDS_WORK numbers. */
static island_problem problem_in(double *work, size_t nodes) {
    island_problem island;
    island.X = NAN;
    island.mu = NAN;
    island.a_squared = NAN;
    island.w = work;
    island.p = work + nodes;
    island.covered = work + 2 * nodes;
    island.coarse_w = work + 3 * nodes;
    island.s = work + 4 * nodes;
    island.residual = work + 5 * nodes;
    island.z = work + 6 * nodes;
    island.pivots = work + 7 * nodes;
    island.factors = work + 8 * nodes;
    island.matrix = work + 9 * nodes;
    island.steps = 0;
    return island;
}

/* The gap at a node (34), negative where the mean planes overlap. */
MBMA_INLINE double gap_at(const island_problem *island, const mbma_basis *b, const double *w,
                          size_t i) {
    return island->a_squared * b->v[i] - island->X + w[i] / b->root_weights[i];
}

/* Step until the relative error of the pressure is below `tolerance`. Returns the error after the
 * last step, the square of its relative change of pressure; NaN where MAX_STEPS did not suffice. */
static double newton_steps(island_problem *island, const mbma_basis *b, double tolerance,
                           double *w) {
    const size_t n = b->nodes;
    const double a = sqrt(island->a_squared);
    double *const s = island->s;
    double *const residual = island->residual;
    double *const z = island->z;
    for (int step = 0; step < MAX_STEPS && isfinite(w[0]); step++) {
        /* pressure (36), whose derivative by the gap is -3/4 F_{1/2} */
        double largest_integral = 0.0;
        for (size_t i = 0; i < n; i++) {
            const halves F = halves_of(gap_at(island, b, w, i));
            island->p[i] = 0.5 * F.three_halves * b->root_weights[i];
            s[i] = sqrt(0.75 * island->mu * a * F.half);
            largest_integral = mbma_max(largest_integral, F.three_halves);
        }
        /* the deformation under it (37) */
        combine(n, island->p, b->matrix, n, residual);
        for (size_t i = 0; i < n; i++) {
            residual[i] = island->mu * a * residual[i] - w[i];
            z[i] = s[i] * residual[i];
        }
        /* (1 + a A D)^-1 r = r - A s (1 + s A s)^-1 s r */
        solve_symmetric(b->matrix, s, n, island->matrix, island->pivots, island->factors, z);
        for (size_t i = 0; i < n; i++)
            z[i] *= s[i];
        double *const correction = island->factors;
        combine(n, z, b->matrix, n, correction);
        double largest_change = 0.0;
        for (size_t i = 0; i < n; i++) {
            const double by = residual[i] - correction[i];
            w[i] += by;
            const double change = s[i] * s[i] * fabs(by) / b->root_weights[i];
            largest_change = mbma_max(largest_change, change);
        }
        island->steps++;
        const double largest_pressure = 0.5 * island->mu * a * largest_integral;
        const double relative = island->mu > 0.0 ? largest_change / largest_pressure : 0.0;
        if (relative * relative <= tolerance)
            return relative * relative;
    }
    return NAN;
}

/* Pressure over mu and area of contact at the nodes. */
static void fill_profile(island_problem *island, const mbma_basis *b) {
    for (size_t i = 0; i < b->nodes; i++) {
        const double gap = gap_at(island, b, island->w, i);
        island->p[i] = 0.5 * halves_of(gap).three_halves * b->root_weights[i];
        island->covered[i] = whole(1, gap) * b->root_weights[i];
    }
}

/* Of neighbouring modes from `first` on. */
static double largest_mode(const mbma_basis *b, const double *vector, size_t first) {
    double largest = 0.0;
    for (size_t k = first; k < first + TOGETHER; k++)
        largest = mbma_max(largest, fabs(dot(b->modes + k * b->nodes, vector, b->nodes)));
    return largest;
}

/* Relative error of a profile's Gauss sum: its modes beyond 2n, extrapolated from n/2 and n. */
static double unresolved(const mbma_basis *b, const double *vector, double sum) {
    const double last = largest_mode(b, vector, b->nodes - TOGETHER);
    const double middle = largest_mode(b, vector, b->nodes / 2 - TOGETHER / 2);
    const double ratio = last / mbma_max(middle, TINY);
    return last * mbma_min(1.0, ratio * ratio) / sum;
}

/* Begin with a coarse solution on few nodes, interpolated by its Legendre modes. */
static void guess(island_problem *island, const mbma_basis *b, const mbma_basis *coarse) {
    const size_t few = coarse->nodes;
    memset(island->coarse_w, 0, few * sizeof *island->coarse_w);
    if (newton_steps(island, coarse, COARSE_TOLERANCE, island->coarse_w) <= COARSE_TOLERANCE) {
        double *const modes = island->covered;
        for (size_t k = 0; k < few; k++)
            modes[k] = dot(coarse->modes + k * few, island->coarse_w, few);
        combine(few, modes, b->modes, b->nodes, island->w);
    }
}

/* Relative contribution outside a, with pressure and area decaying as on a rigid sphere. */
static double cut_off(const island_problem *island, const mbma_basis *b, double force,
                      double area) {
    const size_t last = b->nodes - 1;
    const double edge = island->a_squared - island->X + island->w[last] / b->root_weights[last];
    const double missed_force = halves_of(edge).five_halves / (5.0 * force);
    const double missed_area = whole(2, edge) / (2.0 * area);
    return mbma_max(missed_force, missed_area) / island->a_squared;
}

/* `phi` receives Phi_F, Phi_A and an estimate of their relative error. */
static mbma_status solve(island_problem *island, double rtol, const mbma_basis *b,
                         const mbma_basis *coarse, double phi[3]) {
    const size_t n = b->nodes, few = coarse->nodes;
    const double X = island->X, mu = island->mu;
    if (!isfinite(X) || !isfinite(mu) || mu < 0.0 || n < LEAST_NODES)
        return MBMA_INVALID;

    const halves deepest = halves_of(-X);
    const double area_0 = whole(2, -X);
    island->a_squared = area_0 > TINY ? extent_squared(X, mu, EXTENT_SHARE * rtol) : 1.0;
    memset(island->w, 0, n * sizeof *island->w);
    if (mu * deepest.half * (1.0 + island->a_squared) < NEGLIGIBLE) {
        rigid_sphere(X, mu, phi);
        phi[2] = area_0 > 0.0 ? ROUNDING : 0.0;
        fill_profile(island, b);
        return MBMA_OK;
    }
    if (few >= LEAST_NODES && (double)n >= MIN_COARSE_RATIO * (double)few)
        guess(island, b, coarse);

    for (int widened = 0; widened <= MAX_WIDENINGS; widened++) {
        const double newton_error = newton_steps(island, b, NEWTON_SHARE * rtol, island->w);
        if (!isfinite(newton_error))
            return MBMA_UNRESOLVED;
        fill_profile(island, b);
        const double force = dot(island->p, b->root_weights, n);
        const double area = dot(island->covered, b->root_weights, n);
        const double cut = cut_off(island, b, force, area);
        if (!(MOST_CUTS * cut > rtol)) {
            const double discrete =
                mbma_max(unresolved(b, island->p, force), unresolved(b, island->covered, area));
            /* (38) */
            phi[0] = mu * (MBMA_PI * island->a_squared * force);
            phi[1] = MBMA_PI * island->a_squared * area;
            phi[2] = SAFETY * (discrete + cut) + newton_error + ROUNDING;
            return MBMA_OK;
        }
        /* hard contact lifts the middle more than expected: widen */
        island->a_squared += 1.0;
    }
    return MBMA_UNRESOLVED;
}

size_t mbma_solve_islands(size_t n, const double *X, const double *mu, double rtol,
                          const mbma_basis *fine, const mbma_basis *coarse, double *phi,
                          int64_t *steps, uint8_t *status, double *rho, double *pressure,
                          double *gap, double *work) {
    const size_t nodes = fine->nodes;
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        island_problem island = problem_in(work, nodes);
        double *const answer = phi + 3 * k;
        island.X = X[k];
        island.mu = mu[k];
        mbma_status outcome = solve(&island, rtol, fine, coarse, answer);
        if (outcome == MBMA_OK && !isfinite(answer[0] + answer[1] + answer[2]))
            outcome = MBMA_UNRESOLVED;
        const bool good = outcome == MBMA_OK;
        for (size_t j = 0; j < 3 && !good; j++)
            answer[j] = NAN;
        status[k] = (uint8_t)outcome;
        steps[k] = island.steps;
        bad += !good;
        if (rho == NULL)
            continue;
        /* the profile; w and p are values times the roots of the weights */
        for (size_t i = 0; i < nodes; i++) {
            const size_t at = k * nodes + i;
            rho[at] = good ? sqrt(island.a_squared * fine->v[i]) : NAN;
            pressure[at] = good ? mu[k] * island.p[i] / fine->root_weights[i] : NAN;
            gap[at] = good ? gap_at(&island, fine, island.w, i) : NAN;
        }
    }
    return bad;
}
