/* The lookup in the universal table, for loops to inline. */
#ifndef MBMA_PHI_H
#define MBMA_PHI_H

#include "eight.h"
#include "mbma.h"

#define BUCKET_BITS 49 /* 3 bits of the mantissa of mu: 8 buckets an octave */

typedef struct {
    double value, by_x, by_y;
} gradient;

/* The sum of row[k] x^k by halves; and its derivative, which is not computed if unused. */
MBMA_INLINE gradient along_x(eight row, double x) {
    const double x2 = x * x, x3 = 4.0 * x * x2;
    const four high = HIGH_FOUR(row), sum = fma4(high, x2 * x2, LOW_FOUR(row));
    const two upper = HIGH_TWO(sum), whole = fma2(upper, x2, LOW_TWO(sum));
    const two slope = fma2(upper, 2.0 * x, fma2(HIGH_TWO(high), x3 * x2, LOW_TWO(high) * x3));
    const gradient found = {mbma_fma(whole[1], x, whole[0]), whole[1] + mbma_fma(slope[1], x, slope[0]), 0.0};
    return found;
}

/* The polynomial of a cell at x and y; slopes that are not used are not computed. */
MBMA_INLINE gradient polynomial(const double c[8][8], double x, double y) {
    eight slope = eight_of(c[7]), value = fma8(slope, y, eight_of(c[6]));
    for (int k = 5; k >= 0; k--) {
        slope = fma8(slope, y, value);
        value = fma8(value, y, eight_of(c[k]));
    }
    gradient found = along_x(value, x);
    found.by_y = along_x(slope, x).value;
    return found;
}

/* Phi_F and Phi_A of an island, and their derivatives. */
typedef struct {
    int status;
    double error, value[2], by_X[2], by_mu[2];
} phi;

MBMA_INLINE phi phi_at(const mbma_cells *t, double X, double mu) {
    if (!(X >= t->X_low && X <= t->X_high && mu <= t->mu_high && mu >= 0.0)) {
        const phi none = {!(X == X && mu >= 0.0) ? MBMA_INVALID : X < t->X_low ? MBMA_X_BELOW :
                          X > t->X_high ? MBMA_X_ABOVE : MBMA_MU_ABOVE, NAN, {NAN, NAN}, {NAN, NAN}, {NAN, NAN}};
        return none;
    }
    int64_t bucket = (mbma_bits(mu) >> BUCKET_BITS) - t->first_bucket;
    bucket = bucket < 0 ? 0 : bucket < t->buckets ? bucket : t->buckets - 1;
    const mbma_cell *const c = &t->cells[t->places[t->places[(int64_t)((X - t->X_low) * t->X_rate)] + bucket]];
    const double bottom = mbma_fma(mu, c->bottom_mu, c->bottom), over = 1.0 / bottom;
    const double x = (X - c->centre) * c->rate, y = mbma_fma(mu, c->top_mu, c->top) * over;
    const double by_mu = (c->top_mu * c->bottom - c->top * c->bottom_mu) * (over * over);
    const gradient F = polynomial(c->force, x, y), A = polynomial(c->area, x, y);
    const phi found = {MBMA_OK, c->error, {mu * F.value, A.value}, {mu * F.by_x * c->rate, A.by_x * c->rate},
                       {mbma_fma(mu * F.by_y, by_mu, F.value), A.by_y * by_mu}};
    return found;
}

#endif
