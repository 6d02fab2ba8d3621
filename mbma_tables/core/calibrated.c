/* The law calibrated on boundary elements, by quintic splines over the numbers of a surface and a third axis.
 *
 * Sums over the first two axes are made in the same order for one entry and for all cells of the third axis, so that
 * answers do not depend on what is asked beside them.
 */
#include <float.h>

#include "elementary.h"
#include "mbma.h"

enum { CHUNK = 128, COLUMNS = 8, MOST_STEPS = 100 };

#define LEAST 1e-300                /* u that counts as none */
#define LEAST_LOG_SEPARATION -690.0 /* ln u at which full contact counts as reached */
#define CLOSE 1e-9                  /* of ln F: the next miss would be about the square of this one */

/* The six cardinal quintic B-splines that reach a cell, at u in [0, 1] of it. */
MBMA_INLINE void quintic(double u, double w[6]) {
    const double v = 1.0 - u, u2 = u * u, v2 = v * v, part = 1.0 / 120.0;
    w[0] = v2 * v2 * v * part;
    w[1] = mbma_fma(u, mbma_fma(u, mbma_fma(u, mbma_fma(u, mbma_fma(u, 5.0, -20.0), 20.0), 20.0), -50.0), 26.0) * part;
    w[2] = mbma_fma(u2, mbma_fma(u2, mbma_fma(u, -10.0, 30.0), -60.0), 66.0) * part;
    w[3] = mbma_fma(v2, mbma_fma(v2, mbma_fma(v, -10.0, 30.0), -60.0), 66.0) * part;
    w[4] = mbma_fma(v, mbma_fma(v, mbma_fma(v, mbma_fma(v, mbma_fma(v, 5.0, -20.0), 20.0), 20.0), -50.0), 26.0) * part;
    w[5] = u2 * u2 * u * part;
}

/* From coefficients of B-splines to those of powers. */
MBMA_INLINE void to_powers(const double c[6], double p[6]) {
    const double part = 1.0 / 120.0, outer = c[0] + c[4], inner = c[1] + c[3];
    p[0] = mbma_fma(66.0, c[2], mbma_fma(26.0, inner, outer)) * part;
    p[1] = mbma_fma(10.0, c[3] - c[1], c[4] - c[0]) * (5.0 * part);
    p[2] = mbma_fma(-6.0, c[2], mbma_fma(2.0, inner, outer)) * (10.0 * part);
    p[3] = mbma_fma(2.0, c[1] - c[3], c[4] - c[0]) * (10.0 * part);
    p[4] = mbma_fma(6.0, c[2], mbma_fma(-4.0, inner, outer)) * (5.0 * part);
    p[5] = mbma_fma(10.0, c[3] - c[2], mbma_fma(5.0, c[1] - c[4], c[5] - c[0])) * part;
}

MBMA_INLINE double power_value(const double p[6], double z) {
    return mbma_fma(mbma_fma(mbma_fma(mbma_fma(mbma_fma(p[5], z, p[4]), z, p[3]), z, p[2]), z, p[1]), z, p[0]);
}

MBMA_INLINE double power_slope(const double p[6], double z) {
    const double high = mbma_fma(mbma_fma(5.0 * p[5], z, 4.0 * p[4]), z, 3.0 * p[3]);
    return mbma_fma(mbma_fma(high, z, 2.0 * p[2]), z, p[1]);
}

static bool covers(const mbma_spline *s, double hurst, double log_zeta_1) {
    return s->low[0] <= hurst && hurst <= s->high[0] && s->low[1] <= log_zeta_1 && log_zeta_1 <= s->high[1];
}

/* A chunk of entries: surfaces, and places on the third axis. Each step has a loop of its own, which vectorises. */
typedef struct {
    size_t count, owner[CHUNK];
    double x[CHUNK], value[CHUNK], slope[CHUNK]; /* along the third axis, held at its ends */
    int32_t cell[3][CHUNK];
    double z[3][CHUNK], w[2][6][CHUNK], p[6][CHUNK];
} chunk;

static size_t chunk_of(size_t n) { return n < (size_t)CHUNK ? n : (size_t)CHUNK; }

/* Cells of an axis, and places z in [0, 1] of them; beyond the axis at its end, and NaN at the first. */
static void find_places(const mbma_spline *s, chunk *c, int axis, const double *x) {
    for (size_t n = 0; n < c->count; n++) {
        const double at = mbma_held((x[n] - s->first[axis]) * s->rate[axis], 0.0, (double)s->cells[axis]);
        c->cell[axis][n] = (int32_t)mbma_min(at, (double)s->cells[axis] - 1.0);
        c->z[axis][n] = at - c->cell[axis][n];
    }
}

/* Where surfaces lie, by which sums are weighted. */
static void weigh(const mbma_spline *s, const mbma_surfaces *surfaces, chunk *c) {
    for (int axis = 0; axis < 2; axis++) {
        const double *const given = axis == 0 ? surfaces->hurst : surfaces->log_zeta_1;
        double x[CHUNK];
        for (size_t n = 0; n < c->count; n++)
            x[n] = given[c->owner[n]];
        find_places(s, c, axis, x);
        for (size_t n = 0; n < c->count; n++) {
            double w[6];
            quintic(c->z[axis][n], w);
            for (int m = 0; m < 6; m++)
                c->w[axis][m][n] = w[m];
        }
    }
}

/* Sums over the first two axes for the coefficients that reach a cell of the third, and two more. */
static void patch(const mbma_spline *s, const chunk *c, size_t n, size_t cell, double sums[COLUMNS]) {
    const size_t row = s->cells[2] + 5, plane = (s->cells[1] + 5) * row;
    const float *at = s->coefficients + (size_t)c->cell[0][n] * plane + (size_t)c->cell[1][n] * row + cell;
    double total[COLUMNS] = {0.0}, b[6];
    for (int m = 0; m < 6; m++)
        b[m] = c->w[1][m][n];
    for (int m = 0; m < 6; m++, at += plane)
        for (size_t k = 0; k < COLUMNS; k++) {
            double sum = b[0] * (double)at[k];
            for (size_t j = 1; j < 6; j++)
                sum = mbma_fma(b[j], (double)at[j * row + k], sum);
            total[k] = mbma_fma(c->w[0][m][n], sum, total[k]);
        }
    memcpy(sums, total, sizeof total);
}

/* Values and slopes of the spline. */
static void look_up(const mbma_spline *s, const mbma_surfaces *surfaces, chunk *c) {
    const bool direct = surfaces->pieces == NULL;
    if (direct)
        weigh(s, surfaces, c);
    find_places(s, c, 2, c->x);
    for (size_t n = 0; n < c->count; n++) {
        const size_t cell = (size_t)c->cell[2][n];
        double sums[COLUMNS];
        if (direct)
            patch(s, c, n, cell, sums);
        const double *const six = direct ? sums : surfaces->pieces + (c->owner[n] * s->cells[2] + cell) * 6;
        for (int m = 0; m < 6; m++)
            c->p[m][n] = six[m];
    }
    for (size_t n = 0; n < c->count; n++) {
        double given[6], p[6];
        for (int m = 0; m < 6; m++)
            p[m] = given[m] = c->p[m][n];
        if (direct)
            to_powers(given, p);
        c->value[n] = power_value(p, c->z[2][n]);
        c->slope[n] = power_slope(p, c->z[2][n]) * s->rate[2];
    }
}

size_t mbma_spline_pieces(const mbma_spline *s, const mbma_surfaces *surfaces, double *pieces) {
    size_t bad = 0;
    chunk c;
    c.count = 1;
    for (size_t k = 0; k < surfaces->count; k++) {
        const bool good = covers(s, surfaces->hurst[k], surfaces->log_zeta_1[k]);
        c.owner[0] = k;
        weigh(s, surfaces, &c);
        for (size_t cell = 0; cell < s->cells[2]; cell++, pieces += 6) {
            double sums[COLUMNS];
            patch(s, &c, 0, cell, sums);
            to_powers(sums, pieces);
            for (int m = 0; m < 6 && !good; m++)
                pieces[m] = NAN;
        }
        bad += !good;
    }
    return bad;
}

MBMA_INLINE double last_of(const mbma_spline *s) { return s->first[2] + (double)s->cells[2] / s->rate[2]; }

/* Beyond the ends of the third axis: below, full contact rules, F^2 linear in ln u; above, ln F is linear in u. */
MBMA_INLINE void continued(const mbma_spline *s, double log_u, double *value, double *rate) {
    const double beyond = mbma_expm1(mbma_max(log_u - last_of(s), 0.0));
    const double square = mbma_fma(2.0 * *rate, mbma_min(log_u - s->first[2], 0.0), 1.0);
    *value = mbma_fma(*rate, beyond, *value) + 0.5 * mbma_log(square);
    *rate = *rate * (beyond + 1.0) / square;
}

/* ln F of surfaces without end. */
static void log_forces(const mbma_spline *s, const mbma_surfaces *surfaces, chunk *c) {
    const double first = s->first[2], last = last_of(s);
    double low = last, high = first;
    look_up(s, surfaces, c);
    for (size_t n = 0; n < c->count; n++)
        low = mbma_min(low, c->x[n]), high = mbma_max(high, c->x[n]);
    if (low < first || high > last)
        for (size_t n = 0; n < c->count; n++)
            continued(s, c->x[n], &c->value[n], &c->slope[n]);
}

/* ---- the calibrated law ------------------------------------------------------------------------------------------ */

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

MBMA_INLINE double light_factor(const mbma_calibrated_table *t, double alpha) {
    return mbma_min(mbma_fma(t->area_slope, mbma_log(alpha / 10.0), t->area_s0), 1.0);
}

MBMA_INLINE double area_at(double force, double s0, double t0) {
    const double t = force / t0;
    return mbma_erf(force * sqrt(2.0 * (1.0 + t) / (s0 + t)));
}

/* The next entries, and what these are asked; of no such surface, the first one and NaN. */
static void take(const mbma_surfaces *surfaces, const int64_t *owner, const double *given, size_t n, chunk *c,
                 double asked[CHUNK]) {
    c->count = chunk_of(n);
    for (size_t k = 0; k < c->count; k++) {
        const bool known = (uint64_t)owner[k] < surfaces->count;
        c->owner[k] = known ? (size_t)owner[k] : 0;
        asked[k] = known ? given[k] : NAN;
    }
}

size_t mbma_spline_values(const mbma_spline *s, const mbma_surfaces *surfaces, size_t n, const int64_t *owner,
                          const double *x, double *restrict value, double *restrict slope) {
    size_t bad = 0;
    for (size_t begin = 0; begin < n; begin += CHUNK) {
        chunk c;
        take(surfaces, owner + begin, x + begin, n - begin, &c, c.x);
        look_up(s, surfaces, &c);
        for (size_t k = 0; k < c.count; k++) {
            const size_t own = c.owner[k];
            const bool good = c.x[k] == c.x[k] &&
                              (surfaces->pieces || covers(s, surfaces->hurst[own], surfaces->log_zeta_1[own]));
            value[begin + k] = good ? c.value[k] : NAN;
            slope[begin + k] = good ? c.slope[k] : NAN;
            bad += !good;
        }
    }
    return bad;
}

size_t mbma_calibrated_ends(const mbma_calibrated_table *t, const mbma_surfaces *surfaces, double *ends) {
    size_t bad = 0;
    for (size_t begin = 0; begin < surfaces->count; begin += CHUNK) {
        const double *H = surfaces->hurst + begin, *L = surfaces->log_zeta_1 + begin, *h_max = surfaces->h_max + begin;
        double s0[CHUNK], gradient;
        chunk c;
        c.count = chunk_of(surfaces->count - begin);
        for (size_t n = 0; n < c.count; n++) {
            c.owner[n] = begin + n;
            s0[n] = light_factor(t, self_affine(H[n], L[n], &gradient));
            c.x[n] = mbma_log(mbma_max(h_max[n], LEAST));
        }
        log_forces(&t->log_force, surfaces, &c);
        for (size_t n = 0; n < c.count; n++, ends += 2) {
            const bool good = covers(&t->log_force, H[n], L[n]) && h_max[n] >= LEAST;
            ends[0] = good ? s0[n] : NAN;
            ends[1] = good ? c.value[n] : NAN;
            bad += !good;
        }
    }
    return bad;
}

size_t mbma_calibrated_contact(const mbma_calibrated_table *t, const mbma_surfaces *surfaces, size_t n,
                               const int64_t *owner, const double *u, double *restrict force, double *restrict area,
                               double *restrict stiffness) {
    size_t bad = 0;
    for (size_t begin = 0; begin < n; begin += CHUNK) {
        double gap[CHUNK], h_max[CHUNK], s0[CHUNK], end[CHUNK], held[CHUNK];
        chunk c;
        take(surfaces, owner + begin, u + begin, n - begin, &c, gap);
        for (size_t k = 0; k < c.count; k++) {
            h_max[k] = surfaces->h_max[c.owner[k]];
            s0[k] = surfaces->ends[2 * c.owner[k]];
            end[k] = surfaces->ends[2 * c.owner[k] + 1];
            held[k] = mbma_held(gap[k], LEAST, h_max[k]);
            c.x[k] = mbma_log(held[k]);
        }
        log_forces(&t->log_force, surfaces, &c);
        for (size_t k = 0; k < c.count; k++) {
            const double value = c.value[k], endless = value < -700.0 ? 0.0 : mbma_exp(value);
            /* without cancellation */
            const double load = -endless * mbma_expm1(end[k] - value), share = area_at(load, s0[k], t->area_t0);
            const double known = gap[k] == gap[k] && end[k] == end[k] ? 0.0 : NAN;
            const double touching = gap[k] >= h_max[k] ? 0.0 : 1.0;
            const bool full = gap[k] <= 0.0;
            force[begin + k] = (full ? INFINITY : touching * load) + known;
            area[begin + k] = (full ? 1.0 : touching * share) + known;
            stiffness[begin + k] = (full ? INFINITY : touching * (-c.slope[k] * endless / held[k])) + known;
        }
    }
    for (size_t k = 0; k < n; k++)
        bad += force[k] != force[k];
    return bad;
}

/* Newton's method in ln(F + F at h_max), which is smooth to the end, in a bracket. */
typedef struct {
    size_t entry;
    double goal, low, high; /* of ln F without end; of ln u */
} search;

size_t mbma_calibrated_separation(const mbma_calibrated_table *t, const mbma_surfaces *surfaces, size_t n,
                                  const int64_t *owner, const double *force, double *u) {
    size_t bad = 0;
    for (size_t begin = 0; begin < n; begin += CHUNK) {
        double asked[CHUNK], *const out = u + begin;
        search left[CHUNK];
        size_t searched = 0;
        chunk c;
        take(surfaces, owner + begin, force + begin, n - begin, &c, asked);
        for (size_t k = 0; k < c.count; k++)
            c.x[k] = LEAST_LOG_SEPARATION;
        log_forces(&t->log_force, surfaces, &c);
        for (size_t k = 0; k < c.count; k++) {
            const size_t own = c.owner[k];
            const double end = surfaces->ends[2 * own + 1], over = mbma_log(mbma_max(asked[k], DBL_MIN)) - end;
            const double goal = end + (mbma_max(over, 0.0) + mbma_log1p(mbma_exp(-fabs(over))));
            out[k] = NAN;
            if (asked[k] > 0.0 && goal <= c.value[k]) {
                const search one = {k, goal, LEAST_LOG_SEPARATION, mbma_log(surfaces->h_max[own])};
                /* ln F is about -3 u at light loads */
                c.x[searched] = mbma_log(mbma_held(-0.3 * goal, 1e-3, 0.99 * surfaces->h_max[own]));
                c.owner[searched] = own;
                left[searched++] = one;
            } else
                bad++;
        }
        for (int step = 0; step < MOST_STEPS && searched > 0; step++) {
            c.count = searched;
            searched = 0;
            log_forces(&t->log_force, surfaces, &c);
            for (size_t k = 0; k < c.count; k++) {
                search one = left[k];
                const double x = c.x[k], miss = c.value[k] - one.goal, following = x - miss / c.slope[k];
                const bool near = fabs(miss) <= CLOSE;
                *(miss > 0.0 ? &one.low : &one.high) = x;
                const double middle = near ? mbma_held(following, one.low, one.high) : 0.5 * (one.low + one.high);
                c.x[searched] = following > one.low && following < one.high ? following : middle;
                if (near || one.high - one.low <= 2e-16) {
                    out[one.entry] = mbma_exp(c.x[searched]);
                } else {
                    c.owner[searched] = c.owner[k];
                    left[searched++] = one;
                }
            }
        }
        bad += searched;
    }
    return bad;
}
