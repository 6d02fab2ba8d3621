/* The lookup in the universal table, for loops to inline. */
#ifndef MBMA_PHI_H
#define MBMA_PHI_H

#include "eight.h"
#include "mbma.h"

#define BUCKET_BITS 49 /* 3 bits of the mantissa of mu: 8 buckets an octave */

/* Of a row of powers of x: along_x(a, x) is the sum of a[k] x^k by halves, derived(a) the row of its derivative. */
#if defined(__FMA__)
/* the last two halvings */
MBMA_INLINE double along_four(__m256d row, double x) {
    const double x2 = x * x;
    const __m128d two = _mm_fmadd_pd(_mm256_extractf128_pd(row, 1), _mm_set1_pd(x2), _mm256_castpd256_pd128(row));
    return mbma_fma(_mm_cvtsd_f64(_mm_unpackhi_pd(two, two)), x, _mm_cvtsd_f64(two));
}
#endif

/* masks of all: without them GCC warns of what its own headers leave unset */
#if defined(__AVX512F__)
MBMA_INLINE double along_x(eight a, double x) {
    const __m256d low = _mm512_maskz_extractf64x4_pd(0xFF, a, 0), high = _mm512_maskz_extractf64x4_pd(0xFF, a, 1);
    return along_four(_mm256_fmadd_pd(high, _mm256_set1_pd((x * x) * (x * x)), low), x);
}
MBMA_INLINE eight derived(eight a) {
    const __m512i next = _mm512_castpd_si512(a), shifted = _mm512_maskz_alignr_epi64(0xFF, next, next, 1);
    return _mm512_mul_pd(_mm512_castsi512_pd(shifted), _mm512_setr_pd(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 0.0));
}
#elif defined(__FMA__)
MBMA_INLINE double along_x(eight a, double x) {
    return along_four(_mm256_fmadd_pd(a.high, _mm256_set1_pd((x * x) * (x * x)), a.low), x);
}
MBMA_INLINE eight derived(eight a) {
    const __m256d low = _mm256_blend_pd(a.low, a.high, 1), high = a.high;
    const eight found = {_mm256_mul_pd(_mm256_permute4x64_pd(low, 0x39), _mm256_setr_pd(1.0, 2.0, 3.0, 4.0)),
                         _mm256_mul_pd(_mm256_permute4x64_pd(high, 0x39), _mm256_setr_pd(5.0, 6.0, 7.0, 0.0))};
    return found;
}
#else
MBMA_INLINE double along_x(eight a, double x) {
    const double x2 = x * x, x4 = x2 * x2;
    const pair p = PAIR_FMA(a.at[2], x4, a.at[0]), q = PAIR_FMA(a.at[3], x4, a.at[1]), r = PAIR_FMA(q, x2, p);
    return mbma_fma(r[1], x, r[0]);
}
MBMA_INLINE eight derived(eight a) {
    const eight found = {{{a.at[0][1], 2.0 * a.at[1][0]}, {3.0 * a.at[1][1], 4.0 * a.at[2][0]},
                          {5.0 * a.at[2][1], 6.0 * a.at[3][0]}, {7.0 * a.at[3][1], 0.0}}};
    return found;
}
#endif

/* The polynomial of a cell at x and y, by pairs of rows, which wait less than one after the other. */
MBMA_INLINE double polynomial(const double c[8][8], double x, double y) {
    const double y2 = y * y;
    const eight low = fma8(fma8(row_of(c[3]), y, row_of(c[2])), y2, fma8(row_of(c[1]), y, row_of(c[0])));
    const eight high = fma8(fma8(row_of(c[7]), y, row_of(c[6])), y2, fma8(row_of(c[5]), y, row_of(c[4])));
    return along_x(fma8(high, y2 * y2, low), x);
}

typedef struct {
    double value, by_x, by_y;
} gradient;

/* The same with its derivatives by x and by y. */
MBMA_INLINE gradient polynomial_gradient(const double c[8][8], double x, double y) {
    eight slope = row_of(c[7]), value = fma8(slope, y, row_of(c[6]));
    for (int k = 5; k >= 0; k--) {
        slope = fma8(slope, y, value);
        value = fma8(value, y, row_of(c[k]));
    }
    const gradient found = {along_x(value, x), along_x(derived(value), x), along_x(slope, x)};
    return found;
}

typedef struct {
    int status;
    double force, area, error, force_by_X, force_by_mu, area_by_X, area_by_mu;
} phi;

/* Phi_F and Phi_A of an island; derivatives, where asked for, else 0. */
MBMA_INLINE phi phi_at(const mbma_cells *t, double X, double mu, bool slopes) {
    phi found = {MBMA_OK, NAN, NAN, NAN, NAN, NAN, NAN, NAN};
    if (!(X >= t->X_low && X <= t->X_high && mu <= t->mu_high && mu >= 0.0)) {
        found.status = !(X == X && mu >= 0.0) ? MBMA_INVALID : X < t->X_low ? MBMA_X_BELOW :
                       X > t->X_high ? MBMA_X_ABOVE : MBMA_MU_ABOVE;
        return found;
    }
    int64_t bucket = (mbma_bits(mu) >> BUCKET_BITS) - t->first_bucket;
    bucket = bucket < 0 ? 0 : bucket < t->buckets ? bucket : t->buckets - 1;
    const mbma_cell *const c = &t->cells[t->places[t->places[(int64_t)((X - t->X_low) * t->X_rate)] + bucket]];
    const double bottom = mbma_fma(mu, c->bottom_mu, c->bottom), over = 1.0 / bottom;
    const double x = (X - c->centre) * c->rate, y = mbma_fma(mu, c->top_mu, c->top) * over;
    found.error = c->error;
    if (!slopes) {
        found.force = mu * polynomial(c->force, x, y);
        found.area = polynomial(c->area, x, y);
        return found;
    }
    const double by_mu = (c->top_mu * c->bottom - c->top * c->bottom_mu) * (over * over);
    const gradient F = polynomial_gradient(c->force, x, y), A = polynomial_gradient(c->area, x, y);
    found.force = mu * F.value;
    found.area = A.value;
    found.force_by_X = mu * F.by_x * c->rate;
    found.force_by_mu = mbma_fma(mu * F.by_y, by_mu, F.value);
    found.area_by_X = A.by_x * c->rate;
    found.area_by_mu = A.by_y * by_mu;
    return found;
}

#endif
