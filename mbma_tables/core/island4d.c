/* Islands by the paper's four numbers: their place on the axes of a table, and force and area by its splines (26-40).
 *
 * Axes are X, how deep; spread, zeta_u/zeta_d - 1; sphere, (floor/zeta_d)^(4 - 2H); and H. Powers of zeta_d cancel in what
 * depends on the band of roughness alone, so that it stays finite for every zeta_d.
 */
#include "four.h"
#include "heights.h"
#include "island.h"
#include "quintic.h"

enum { CHUNK = 128, AXES = 4, FUNCTIONS = 2, ROW = FUNCTIONS * QUINTIC_ORDER, FOURS = ROW / 4 };

#define MOST_WIDTH 700.0 /* of (4 - 2H) ln(zeta_u/zeta_d), whose exponential is finite */

/* expm1(p)/p, and 1 at 0 */
MBMA_INLINE double growth(double p) {
    const double power = fabs(p) > NO_POWER ? p : NO_POWER;
    return mbma_expm1(power) / power;
}

/* A band of roughness: mu, and in powers of zeta_d sigma zeta_d^H, force zeta_d^(1 + H) and area zeta_d^2; NaN where a
 * number is not one of a band. */
typedef struct {
    double sigma;
    scales scale;
} band;

MBMA_INLINE band band_of(double spread, double sphere, double hurst, const mbma_variant *v) {
    const double power = 4.0 - 2.0 * hurst, width = mbma_log1p(spread);
    const bool good = spread > 0.0 && sphere >= 0.0 && fabs(power * width) < MOST_WIDTH;
    const double inverse = sphere * mbma_exp(-power * mbma_log(MBMA_SPHERE_FLOOR));
    const double g0 = growth(-2.0 * hurst * width), g2 = growth((2.0 - 2.0 * hurst) * width);
    const double g4 = growth(power * width);
    const double D = 0.75 * (g4 / g2) / v->density_divisor;
    /* alpha = 1.5 g0 g4/g2^2 (3), grouped so that nothing overflows */
    const double narrowness = g2 / g0 * (g2 / g4);
    const double part = v->summit_sigma ? 1.0 - BROADENING / 1.5 * narrowness : 1.0;
    const double rate = 0.75 * hurst / power, top = mbma_expm1(power * width) + 1.0;
    const double R_d = RADIUS / sqrt(rate * (1.0 - inverse)), R_u = RADIUS / sqrt(rate * (top - inverse));
    band found;
    found.sigma = good ? sqrt(part * (2.0 * hurst * width * g0)) : NAN;
    found.scale = scales_of(D, found.sigma, R_d, R_u);
    if (!(found.scale.mu > 0.0))
        found.sigma = found.scale.mu = found.scale.force = found.scale.area = NAN;
    return found;
}

size_t mbma_island_bands(size_t n, const double *spread, const double *sphere, const double *hurst,
                         const mbma_variant *variant, double *restrict mu, double *restrict sigma,
                         double *restrict force, double *restrict area) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const band found = band_of(spread[k], sphere[k], hurst[k], variant);
        mu[k] = found.scale.mu, sigma[k] = found.sigma;
        force[k] = found.scale.force, area[k] = found.scale.area;
    }
    for (size_t k = 0; k < n; k++)
        bad += mu[k] != mu[k];
    return bad;
}

size_t mbma_island_places(size_t n, const double *approach, const double *zeta_d, const double *zeta_u,
                          const double *hurst, const mbma_variant *variant, double *restrict X,
                          double *restrict spread, double *restrict sphere, double *restrict mu,
                          double *restrict sigma, double *restrict force, double *restrict area) {
    size_t bad = 0;
    for (size_t begin = 0; begin < n; begin += CHUNK) {
        const size_t end = begin + CHUNK < n ? begin + CHUNK : n;
        /* to the last digit, since X is the small difference of two products */
        for (size_t k = begin; k < end; k++)
            X[k] = pow(zeta_d[k], hurst[k]);
        for (size_t k = begin; k < end; k++) {
            const double wide = X[k], low = zeta_d[k];
            spread[k] = (zeta_u[k] - low) / low;
            sphere[k] = mbma_exp((4.0 - 2.0 * hurst[k]) * mbma_log(MBMA_SPHERE_FLOOR / low));
            const band found = band_of(spread[k], sphere[k], hurst[k], variant);
            X[k] = (approach[k] * wide - 1.0) / found.sigma;
            mu[k] = found.scale.mu;
            sigma[k] = found.sigma;
            force[k] = found.scale.force / (low * wide);
            area[k] = found.scale.area / (low * low);
        }
    }
    for (size_t k = 0; k < n; k++)
        bad += X[k] != X[k];
    return bad;
}

/* Where an island is in a table: the first of the coefficients that reach it, its places in the cell, the bound there. */
typedef struct {
    const float *corner;
    double z[AXES], error;
} spot_in_table;

/* Coefficients from one to the next along the first three axes. */
typedef struct {
    size_t block, plane, row;
} strides;

MBMA_INLINE strides strides_of(const mbma_island_table *t) {
    const size_t row = FUNCTIONS * (t->cells[3] + 5), plane = row * (t->cells[2] + 5);
    const strides found = {plane * (t->cells[1] + 5), plane, row};
    return found;
}

/* By positions on the axes in units of nodes. */
MBMA_INLINE spot_in_table spot_in(const mbma_island_table *t, const double position[AXES], strides by) {
    spot_in_table found;
    size_t cell[AXES], number = 0;
    for (int axis = 0; axis < AXES; axis++) {
        cell[axis] = quintic_cell(position[axis], t->cells[axis], &found.z[axis]);
        number = number * t->cells[axis] + cell[axis];
    }
    found.corner = t->coefficients + cell[0] * by.block + cell[1] * by.plane + cell[2] * by.row + cell[3] * FUNCTIONS;
    found.error = (double)t->errors[number];
    return found;
}

/* The logarithms of Phi_F and Phi_A over those of a rigid sphere: sums of coefficients by their B-splines. */
MBMA_INLINE void log_ratios(const spot_in_table *spot, strides by, double found[FUNCTIONS]) {
    static const double NOTHING[4] = {0.0};
    const four nothing = four_of(NOTHING);
    double w[AXES][QUINTIC_COLUMNS], sums[ROW];
    four sum[FOURS], part[FOURS];
    for (int axis = 0; axis < AXES; axis++)
        quintic_weights(spot->z[axis], w[axis]);
    for (int l = 0; l < FOURS; l++)
        sum[l] = nothing;
    for (size_t i = 0; i < QUINTIC_ORDER; i++)
        for (size_t j = 0; j < QUINTIC_ORDER; j++) {
            const float *at = spot->corner + i * by.block + j * by.plane;
            for (int l = 0; l < FOURS; l++)
                part[l] = nothing;
            for (size_t k = 0; k < QUINTIC_ORDER; k++, at += by.row)
                for (int l = 0; l < FOURS; l++)
                    part[l] = fma4(four_of_floats(at + 4 * l), w[2][k], part[l]);
            for (int l = 0; l < FOURS; l++)
                sum[l] = fma4(part[l], w[0][i] * w[1][j], sum[l]);
        }
    memcpy(sums, sum, sizeof sums);
    for (size_t f = 0; f < FUNCTIONS; f++) {
        double value = 0.0;
        for (size_t m = 0; m < QUINTIC_ORDER; m++)
            value = mbma_fma(w[3][m], sums[FUNCTIONS * m + f], value);
        found[f] = value / (QUINTIC_UNIT * QUINTIC_UNIT * QUINTIC_UNIT * QUINTIC_UNIT);
    }
}

/* Up to CHUNK islands: the same steps for all of them, of which those without tables are vectorised. */
static void fill_answers(const mbma_island_table *t, size_t n, const double *X, const double *spread,
                         const double *sphere, const double *hurst, const double *mu, double *restrict phi_F,
                         double *restrict phi_A, double *restrict error) {
    const strides by = strides_of(t);
    const double lowest = t->low[1];
    double position[AXES][CHUNK], ratio[FUNCTIONS][CHUNK], part[CHUNK];
    spot_in_table spot[CHUNK];
    for (size_t k = 0; k < n; k++) {
        position[0][k] = (mbma_log(X[k] + t->offset) - t->first[0]) * t->rate[0];
        position[1][k] = (mbma_log(mbma_max(spread[k], lowest)) - t->first[1]) * t->rate[1];
        position[2][k] = (sphere[k] - t->first[2]) * t->rate[2];
        position[3][k] = (hurst[k] - t->first[3]) * t->rate[3];
        part[k] = 1.0;
    }
    for (size_t k = 0; k < n; k++) {
        const double place[AXES] = {position[0][k], position[1][k], position[2][k], position[3][k]};
        spot[k] = spot_in(t, place, by);
        error[k] = spot[k].error;
        /* below the first spread the logarithms are proportional to mu */
        if (spread[k] < lowest)
            part[k] = mu[k] / band_of(lowest, sphere[k], hurst[k], &t->variant).scale.mu;
    }
    for (size_t k = 0; k < n; k++) {
        double found[FUNCTIONS];
        log_ratios(&spot[k], by, found);
        ratio[0][k] = found[0], ratio[1][k] = found[1];
    }
    for (size_t k = 0; k < n; k++) {
        double rigid[FUNCTIONS];
        const bool inside = X[k] >= t->low[0] && X[k] <= t->high[0] && spread[k] > 0.0 && spread[k] <= t->high[1] &&
                            sphere[k] >= t->low[2] && sphere[k] <= t->high[2] && hurst[k] >= t->low[3] &&
                            hurst[k] <= t->high[3] && mu[k] >= 0.0;
        const double sums = ratio[0][k] + ratio[1][k]; /* NaN, which mbma_exp does not keep */
        const double good = inside && sums == sums ? 0.0 : NAN;
        rigid_sphere(X[k], mu[k], rigid);
        phi_F[k] = rigid[0] * mbma_exp(part[k] * ratio[0][k]) + good;
        phi_A[k] = rigid[1] * mbma_exp(part[k] * ratio[1][k]) + good;
        error[k] += good;
    }
}

size_t mbma_island_answers(size_t n, const double *X, const double *spread, const double *sphere, const double *hurst,
                           const double *mu, const mbma_island_table *t, double *restrict phi_F,
                           double *restrict phi_A, double *restrict error) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k += CHUNK)
        fill_answers(t, n - k < CHUNK ? n - k : (size_t)CHUNK, X + k, spread + k, sphere + k, hurst + k, mu + k, phi_F + k,
                     phi_A + k, error + k);
    for (size_t k = 0; k < n; k++)
        bad += error[k] != error[k];
    return bad;
}

mbma_status mbma_island_lookup(const mbma_island_table *t, double approach, double zeta_d, double zeta_u, double hurst,
                               double out[3]) {
    double X, spread, sphere, mu, sigma, force, area;
    mbma_island_places(1, &approach, &zeta_d, &zeta_u, &hurst, &t->variant, &X, &spread, &sphere, &mu, &sigma, &force,
                       &area);
    const size_t bad = mbma_island_answers(1, &X, &spread, &sphere, &hurst, &mu, t, &out[0], &out[1], &out[2]);
    out[0] *= force;
    out[1] *= area;
    if (!bad)
        return MBMA_OK;
    if (!(fabs(X) < INFINITY))
        return MBMA_INVALID;
    if (!(hurst >= t->low[3] && hurst <= t->high[3]))
        return MBMA_HURST_OUTSIDE;
    if (!(sphere >= t->low[2] && sphere <= t->high[2]))
        return MBMA_ZETA_D_OUTSIDE;
    if (!(spread <= t->high[1]))
        return MBMA_SPREAD_ABOVE;
    return X < t->low[0] ? MBMA_X_BELOW : X > t->high[0] ? MBMA_X_ABOVE : MBMA_OUTSIDE;
}
