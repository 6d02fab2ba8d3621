/* The law calibrated on boundary elements, by quintic splines over the numbers of a surface and a third axis.
 *
 * Sums over the first two axes are made in the same order for one entry and for all cells of the third axis, so that
 * results do not depend on the other entries of a call.
 */
#include <float.h>

#include "elementary.h"
#include "mbma.h"
#include "quintic.h"

enum { CHUNK = 128, MOST_STEPS = 100 };

#define LEAST 1e-300                /* smaller u count as zero */
#define LEAST_LOG_SEPARATION -690.0 /* ln u at which full contact counts as reached */
#define CLOSE 1e-9                  /* of ln F: the next error would be about the square of this one */

static bool covers(const mbma_spline *s, double hurst, double log_zeta_1) {
    return s->low[0] <= hurst && hurst <= s->high[0] && s->low[1] <= log_zeta_1 && log_zeta_1 <= s->high[1];
}

/* The cell of an axis, and the place z in [0, 1] of it; beyond the axis at its end, and NaN at the first. */
MBMA_INLINE size_t cell_of(const mbma_spline *s, int axis, double x, double *z) {
    return quintic_cell((x - s->first[axis]) * s->rate[axis], s->cells[axis], z);
}

/* A surface's polynomials: made before, or sums over the first two axes by weights w from a corner on. */
typedef struct {
    const double *pieces;
    const float *corner;
    double w[2][QUINTIC_COLUMNS];
} own_spline;

MBMA_INLINE own_spline own_of(const mbma_spline *s, const mbma_surfaces *surfaces, size_t k) {
    own_spline own = {NULL, s->coefficients, {{0.0}}};
    if (surfaces->pieces) {
        own.pieces = surfaces->pieces + k * s->cells[2] * 6;
        return own;
    }
    const size_t row = s->cells[2] + 5, strides[2] = {(s->cells[1] + 5) * row, row};
    for (int axis = 0; axis < 2; axis++) {
        double z;
        own.corner += strides[axis] * cell_of(s, axis, axis == 0 ? surfaces->hurst[k] : surfaces->log_zeta_1[k], &z);
        quintic_weights(z, own.w[axis]);
    }
    return own;
}

/* Coefficients of powers of z in a cell of the third axis, from sums for the B-splines that reach it, and two more. */
MBMA_INLINE void fill_powers(const mbma_spline *s, const own_spline *own, size_t cell, double p[6]) {
    const size_t row = s->cells[2] + 5, plane = (s->cells[1] + 5) * row;
    const float *at = own->corner + cell;
    double sums[QUINTIC_COLUMNS] = {0.0};
    if (own->pieces) {
        memcpy(p, own->pieces + cell * 6, 6 * sizeof *p);
        return;
    }
    for (int m = 0; m < 6; m++, at += plane)
        for (size_t k = 0; k < QUINTIC_COLUMNS; k++) {
            double sum = own->w[1][0] * (double)at[k];
            for (size_t j = 1; j < 6; j++)
                sum = mbma_fma(own->w[1][j], (double)at[j * row + k], sum);
            sums[k] = mbma_fma(own->w[0][m], sum, sums[k]);
        }
    const double part = 1.0 / (QUINTIC_UNIT * QUINTIC_UNIT * QUINTIC_UNIT), outer = sums[0] + sums[4], inner = sums[1] + sums[3];
    p[0] = mbma_fma(66.0, sums[2], mbma_fma(26.0, inner, outer)) * part;
    p[1] = mbma_fma(10.0, sums[3] - sums[1], sums[4] - sums[0]) * (5.0 * part);
    p[2] = mbma_fma(-6.0, sums[2], mbma_fma(2.0, inner, outer)) * (10.0 * part);
    p[3] = mbma_fma(2.0, sums[1] - sums[3], sums[4] - sums[0]) * (10.0 * part);
    p[4] = mbma_fma(6.0, sums[2], mbma_fma(-4.0, inner, outer)) * (5.0 * part);
    p[5] = mbma_fma(10.0, sums[3] - sums[2], mbma_fma(5.0, sums[1] - sums[4], sums[5] - sums[0])) * part;
}

/* The spline and its slope at a place of the third axis, held at its ends. */
MBMA_INLINE double value_at(const mbma_spline *s, const own_spline *own, double x, double *slope) {
    double z, p[6];
    fill_powers(s, own, cell_of(s, 2, x, &z), p);
    *slope = mbma_horner(5.0 * p[5], z, 4.0 * p[4], 3.0 * p[3], 2.0 * p[2], p[1]) * s->rate[2];
    return mbma_fma(mbma_horner(p[5], z, p[4], p[3], p[2], p[1]), z, p[0]);
}

size_t mbma_spline_pieces(const mbma_spline *s, const mbma_surfaces *surfaces, double *pieces) {
    size_t bad = 0;
    for (size_t k = 0; k < surfaces->count; k++) {
        const bool good = covers(s, surfaces->hurst[k], surfaces->log_zeta_1[k]);
        const own_spline own = own_of(s, surfaces, k);
        for (size_t cell = 0; cell < s->cells[2]; cell++, pieces += 6) {
            fill_powers(s, &own, cell, pieces);
            for (int m = 0; m < 6 && !good; m++)
                pieces[m] = NAN;
        }
        bad += !good;
    }
    return bad;
}

/* The number of an entry's surface; the first if there is none, with NaN as the result. */
MBMA_INLINE size_t held_owner(const mbma_surfaces *surfaces, int64_t owner) {
    return (uint64_t)owner < surfaces->count ? (size_t)owner : 0;
}

/* ---- flow through the gaps --------------------------------------------------------------------------------------- */

#define LEAST_AREA 1e-300 /* smaller contact fractions count as zero */

/* Below the table ln R is in proportion to A^obstruction, above it R is a power of threshold - A/A0. */
MBMA_INLINE double flow_at(const mbma_flow_table *t, const own_spline *own, double u, double area) {
    const mbma_spline *const s = &t->log_factor;
    const double first = s->first[2], last = first + (double)s->cells[2] / s->rate[2];
    const double odds = mbma_log(mbma_max(area, LEAST_AREA) / mbma_max(t->threshold - area, LEAST_AREA));
    double slope, value = value_at(s, own, odds, &slope);
    value = mbma_fma(slope, mbma_max(odds - last, 0.0), value);
    value *= mbma_exp(t->obstruction * mbma_min(odds - first, 0.0));
    return area < t->threshold ? u * u * u * mbma_wide_gap(u) * mbma_exp(mbma_min(value, 0.0)) : 0.0;
}

size_t mbma_contact_flows(const mbma_flow_table *t, const mbma_surfaces *surfaces, size_t n, const int64_t *owner,
                          const double *u, const double *area, double *restrict flow) {
    const mbma_spline *const s = &t->log_factor;
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const size_t mine = held_owner(surfaces, owner[k]);
        const own_spline own = own_of(s, surfaces, mine);
        const bool good = u[k] == u[k] && area[k] == area[k] && (uint64_t)owner[k] < surfaces->count &&
                          (own.pieces || covers(s, surfaces->hurst[mine], surfaces->log_zeta_1[mine]));
        const double found = flow_at(t, &own, u[k], area[k]);
        flow[k] = good ? found : NAN;
        bad += !good;
    }
    return bad;
}

size_t mbma_flow_areas(size_t n, const double *area, const double *yielded, const mbma_flow_law *law,
                       double *elastic) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const double growth = pow(yielded[k], law->yielded_power);
        const double threshold = law->threshold + law->yielded_threshold * growth;
        const double bent = pow(area[k] / threshold, law->yielded_exponent * growth);
        elastic[k] = area[k] * (law->threshold / threshold) * bent;
        bad += elastic[k] != elastic[k];
    }
    return bad;
}

/* ---- the calibrated law ------------------------------------------------------------------------------------------ */

/* ln F of a surface without end, and its slope. Beyond the ends of the third axis: below, as near full contact, F^2
 * linear in ln u; above, ln F is linear in u. */
MBMA_INLINE double log_force(const mbma_spline *s, const own_spline *own, double log_u, double *slope) {
    const double first = s->first[2], last = first + (double)s->cells[2] / s->rate[2];
    const double value = value_at(s, own, log_u, slope);
    if (log_u >= first && log_u <= last)
        return value;
    const double rate = *slope, beyond = mbma_expm1(mbma_max(log_u - last, 0.0));
    const double square = mbma_fma(2.0 * rate, mbma_min(log_u - first, 0.0), 1.0);
    *slope = rate * (beyond + 1.0) / square;
    return mbma_fma(rate, beyond, value) + 0.5 * mbma_log(square);
}

/* Nayak's alpha and the rms gradient over q0 h_rms, from moments of x^-2H, x^(2 - 2H) and x^(4 - 2H) over ln x: each is
 * (exp(p) - 1)/p, and p may be 0. */
MBMA_INLINE double self_affine(double hurst, double log_zeta_1, double *gradient) {
    const double given = (2.0 - 2.0 * hurst) * log_zeta_1, twice = 2.0 * log_zeta_1;
    const double p2 = fabs(given) > 1e-30 ? given : 1e-30, p0 = -hurst * twice, p4 = given + twice;
    const double m0 = mbma_expm1(p0), m2 = mbma_expm1(p2), m4 = mbma_expm1(p4);
    *gradient = sqrt(m2 * p0 / (p2 * m0));
    return 1.5 * (m0 * m4 * p2 * p2) / (m2 * m2 * p0 * p4);
}

size_t mbma_self_affine(size_t n, const double *hurst, const double *log_zeta_1, double *alpha, double *gradient) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const bool good = hurst[k] > 0.0 && hurst[k] <= 1.0 && log_zeta_1[k] > 1e-9 && log_zeta_1[k] < 100.0;
        alpha[k] = good ? self_affine(hurst[k], log_zeta_1[k], &gradient[k]) : NAN;
        gradient[k] = good ? gradient[k] : NAN;
        bad += !good;
    }
    return bad;
}

size_t mbma_calibrated_ends(const mbma_calibrated_table *t, const mbma_surfaces *surfaces, double *ends) {
    const double *const H = surfaces->hurst, *const L = surfaces->log_zeta_1, *const h_max = surfaces->h_max;
    size_t bad = 0;
    for (size_t k = 0; k < surfaces->count; k++) {
        double gradient;
        const double light = mbma_log(self_affine(H[k], L[k], &gradient) / 10.0);
        ends[2 * k] = mbma_min(mbma_fma(t->area_slope, light, t->area_s0), 1.0);
        ends[2 * k + 1] = mbma_log(mbma_max(h_max[k], LEAST));
    }
    for (size_t k = 0; k < surfaces->count; k++) {
        const own_spline own = own_of(&t->log_force, surfaces, k);
        double slope;
        ends[2 * k + 1] = log_force(&t->log_force, &own, ends[2 * k + 1], &slope);
        if (!(covers(&t->log_force, H[k], L[k]) && h_max[k] >= LEAST)) {
            ends[2 * k] = ends[2 * k + 1] = NAN;
            bad++;
        }
    }
    return bad;
}

/* A/A0 at a force. */
MBMA_INLINE double area_at(const mbma_calibrated_table *t, double s0, double force) {
    const double over = force / t->area_t0;
    return mbma_erf(force * sqrt(2.0 * (1.0 + over) / (s0 + over)));
}

size_t mbma_calibrated_areas(const mbma_calibrated_table *t, const mbma_surfaces *surfaces, size_t n,
                             const int64_t *owner, const double *force, double *restrict area) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const double s0 = surfaces->ends[2 * held_owner(surfaces, owner[k])];
        const bool good = force[k] >= 0.0 && force[k] < INFINITY && (uint64_t)owner[k] < surfaces->count && s0 == s0;
        area[k] = good ? area_at(t, s0, force[k]) : NAN;
        bad += !good;
    }
    return bad;
}

size_t mbma_calibrated_contact(const mbma_calibrated_table *t, const mbma_surfaces *surfaces, size_t n,
                               const int64_t *owner, const double *u, double *restrict force, double *restrict area,
                               double *restrict stiffness) {
    size_t bad = 0;
    for (size_t begin = 0; begin < n; begin += CHUNK) {
        const size_t count = n - begin < (size_t)CHUNK ? n - begin : (size_t)CHUNK;
        double gap[CHUNK], h_max[CHUNK], s0[CHUNK], end[CHUNK], held[CHUNK], log_u[CHUNK], log_F[CHUNK], slope[CHUNK];
        for (size_t k = 0; k < count; k++) {
            const size_t mine = held_owner(surfaces, owner[begin + k]);
            gap[k] = (uint64_t)owner[begin + k] < surfaces->count ? u[begin + k] : NAN;
            h_max[k] = surfaces->h_max[mine], s0[k] = surfaces->ends[2 * mine], end[k] = surfaces->ends[2 * mine + 1];
        }
        for (size_t k = 0; k < count; k++)
            log_u[k] = mbma_log(held[k] = mbma_held(gap[k], LEAST, h_max[k]));
        for (size_t k = 0; k < count; k++) {
            const own_spline own = own_of(&t->log_force, surfaces, held_owner(surfaces, owner[begin + k]));
            log_F[k] = log_force(&t->log_force, &own, log_u[k], &slope[k]);
        }
        for (size_t k = 0; k < count; k++) {
            const double endless = log_F[k] < -700.0 ? 0.0 : mbma_exp(log_F[k]);
            double steep;
            const double load = endless * mbma_ended(end[k] - log_F[k], &steep), share = area_at(t, s0[k], load);
            const double known = gap[k] == gap[k] && end[k] == end[k] ? 0.0 : NAN;
            const double touching = gap[k] >= h_max[k] ? 0.0 : 1.0;
            const bool full = gap[k] <= 0.0;
            force[begin + k] = (full ? INFINITY : touching * load) + known;
            area[begin + k] = (full ? 1.0 : touching * share) + known;
            stiffness[begin + k] = (full ? INFINITY : touching * (-slope[k] * endless * steep / held[k])) + known;
        }
    }
    for (size_t k = 0; k < n; k++)
        bad += force[k] != force[k];
    return bad;
}

/* Newton's method in ln F of a surface without end, which is smooth to the end, over ln u in a bracket; NaN beyond that. */
size_t mbma_calibrated_separation(const mbma_calibrated_table *t, const mbma_surfaces *surfaces, size_t n,
                                  const int64_t *owner, const double *force, double *u) {
    size_t bad = 0;
    for (size_t begin = 0; begin < n; begin += CHUNK) {
        const size_t count = n - begin < (size_t)CHUNK ? n - begin : (size_t)CHUNK;
        double goal[CHUNK], end[CHUNK], low[CHUNK], high[CHUNK], x[CHUNK];
        bool done[CHUNK];
        size_t left = count;
        for (size_t k = 0; k < count; k++) {
            const size_t mine = held_owner(surfaces, owner[begin + k]);
            end[k] = surfaces->ends[2 * mine + 1];
            low[k] = LEAST_LOG_SEPARATION;
            high[k] = surfaces->h_max[mine];
        }
        for (size_t k = 0; k < count; k++) {
            const double F = force[begin + k];
            goal[k] = mbma_endless(mbma_log(mbma_max(F, DBL_MIN)), end[k]);
            high[k] = mbma_log(high[k]);
            /* ln F is about -3 u at light loads */
            x[k] = mbma_min(mbma_log(mbma_max(-0.3 * goal[k], 1e-3)), high[k] - 0.01);
            u[begin + k] = NAN;
            done[k] = !(F > 0.0 && end[k] == end[k] && fabs(goal[k]) < INFINITY && (uint64_t)owner[begin + k] < surfaces->count);
        }
        /* steps of all entries together, which are independent */
        for (int step = 0; step < MOST_STEPS && left > 0; step++) {
            left = 0;
            for (size_t k = 0; k < count; k++) {
                if (done[k])
                    continue;
                const own_spline own = own_of(&t->log_force, surfaces, held_owner(surfaces, owner[begin + k]));
                double slope;
                const double miss = log_force(&t->log_force, &own, x[k], &slope) - goal[k];
                const double following = x[k] - miss / slope;
                *(miss > 0.0 ? &low[k] : &high[k]) = x[k];
                done[k] = fabs(miss) <= CLOSE;
                const double middle = done[k] ? mbma_held(following, low[k], high[k]) : 0.5 * (low[k] + high[k]);
                x[k] = following > low[k] && following < high[k] ? following : middle;
                if (done[k])
                    u[begin + k] = mbma_exp(x[k]);
                left += !done[k];
            }
        }
        for (size_t k = 0; k < count; k++)
            bad += u[begin + k] != u[begin + k];
    }
    return bad;
}
