/* The lookup in the universal table, for loops to inline. */
#ifndef MBMA_PHI_H
#define MBMA_PHI_H

#include "four.h"
#include "mbma.h"

#define BUCKET_BITS 49 /* 3 bits of the mantissa of mu: 8 buckets an octave */

/* The polynomial of a cell at x and y; the sum over powers of x by halves. */
MBMA_INLINE double polynomial(const double c[8][8], double x, double y) {
    const double x2 = x * x;
    four low = four_of(c[7]), high = four_of(c[7] + 4);
    for (int k = 6; k >= 0; k--) {
        low = fma4(low, y, four_of(c[k]));
        high = fma4(high, y, four_of(c[k] + 4));
    }
    const four sum = fma4(high, x2 * x2, low);
    double s[4];
    memcpy(s, &sum, sizeof s);
    return mbma_fma(mbma_fma(s[3], x2, s[1]), x, mbma_fma(s[2], x2, s[0]));
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
