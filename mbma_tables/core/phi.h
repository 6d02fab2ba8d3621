/* The lookup in the universal table, for loops to inline. */
#ifndef MBMA_PHI_H
#define MBMA_PHI_H

#include "eight.h"
#include "mbma.h"

#define BUCKET_BITS 49 /* 3 bits of the mantissa of mu: 8 buckets an octave */

/* The polynomial of a cell at x and y; the sum over powers of x by halves. */
MBMA_INLINE double polynomial(const double c[8][8], double x, double y) {
    const double x2 = x * x;
    eight row = eight_of(c[7]);
    for (int k = 6; k >= 0; k--)
        row = fma8(row, y, eight_of(c[k]));
    const four sum = fma4(HIGH_FOUR(row), x2 * x2, LOW_FOUR(row));
    const two whole = fma2(HIGH_TWO(sum), x2, LOW_TWO(sum));
    return mbma_fma(whole[1], x, whole[0]);
}

/* Phi_F and Phi_A of an island. */
typedef struct {
    int status;
    double error, value[2];
} phi;

MBMA_INLINE phi phi_at(const mbma_cells *t, double X, double mu) {
    if (!(X >= t->X_low && X <= t->X_high && mu <= t->mu_high && mu >= 0.0)) {
        const phi none = {!(X == X && mu >= 0.0) ? MBMA_INVALID : X < t->X_low ? MBMA_X_BELOW :
                          X > t->X_high ? MBMA_X_ABOVE : MBMA_MU_ABOVE, NAN, {NAN, NAN}};
        return none;
    }
    int64_t bucket = (mbma_bits(mu) >> BUCKET_BITS) - t->first_bucket;
    bucket = bucket < 0 ? 0 : bucket < t->buckets ? bucket : t->buckets - 1;
    const mbma_cell *const c = &t->cells[t->places[t->places[(int64_t)((X - t->X_low) * t->X_rate)] + bucket]];
    const double over = 1.0 / mbma_fma(mu, c->bottom_mu, c->bottom);
    const double x = (X - c->centre) * c->rate, y = mbma_fma(mu, c->top_mu, c->top) * over;
    const phi found = {MBMA_OK, c->error, {mu * polynomial(c->force, x, y), polynomial(c->area, x, y)}};
    return found;
}

#endif
