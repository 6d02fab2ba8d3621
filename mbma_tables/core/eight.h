/* Eight doubles at once, and their halves: fma8(a, y, b) is a y + b, and so on. All implementations round identically
 * on processors with an fma. */
#ifndef MBMA_EIGHT_H
#define MBMA_EIGHT_H

#include "elementary.h"

typedef double two __attribute__((vector_size(16))); /* which every processor of 64 bits has */
#if defined(__FMA__)
#include <immintrin.h>
typedef __m256d four;
#define fma2(a, y, b) _mm_fmadd_pd(a, _mm_set1_pd(y), b)
#define fma4(a, y, b) _mm256_fmadd_pd(a, _mm256_set1_pd(y), b)
#define LOW_TWO(a) _mm256_castpd256_pd128(a)
#define HIGH_TWO(a) _mm256_extractf128_pd(a, 1)
MBMA_INLINE four four_of(const double *row) { return _mm256_loadu_pd(row); }
#else
#if defined(__ARM_FEATURE_FMA)
#define fma2(a, y, b) (two){mbma_fma((a)[0], y, (b)[0]), mbma_fma((a)[1], y, (b)[1])}
#else
#define fma2(a, y, b) ((a) * (y) + (b))
#endif
typedef struct {
    two low, high;
} four;
#define LOW_TWO(a) (a).low
#define HIGH_TWO(a) (a).high
MBMA_INLINE four fma4(four a, double y, four b) {
    const four found = {fma2(a.low, y, b.low), fma2(a.high, y, b.high)};
    return found;
}
MBMA_INLINE four four_of(const double *row) {
    four found;
    memcpy(&found, row, sizeof found);
    return found;
}
#endif

#if defined(__AVX512F__)
typedef __m512d eight;
/* masks of all lanes: without them GCC warns of unset values in its own headers */
#define LOW_FOUR(a) _mm512_maskz_extractf64x4_pd(0xFF, a, 0)
#define HIGH_FOUR(a) _mm512_maskz_extractf64x4_pd(0xFF, a, 1)
MBMA_INLINE eight eight_of(const double *row) { return _mm512_loadu_pd(row); }
MBMA_INLINE eight fma8(eight a, double y, eight b) { return _mm512_fmadd_pd(a, _mm512_set1_pd(y), b); }
#else
typedef struct {
    four low, high;
} eight;
#define LOW_FOUR(a) (a).low
#define HIGH_FOUR(a) (a).high
MBMA_INLINE eight eight_of(const double *row) {
    const eight found = {four_of(row), four_of(row + 4)};
    return found;
}
MBMA_INLINE eight fma8(eight a, double y, eight b) {
    const eight found = {fma4(a.low, y, b.low), fma4(a.high, y, b.high)};
    return found;
}
#endif

/* a . b in eight lanes */
MBMA_INLINE double dot(const double *restrict a, const double *restrict b, size_t n) {
    double s[8] = {0.0};
    size_t k = 0;
    for (; k + 8 <= n; k += 8)
        for (size_t l = 0; l < 8; l++)
            s[l] = mbma_fma(a[k + l], b[k + l], s[l]);
    for (size_t l = 0; k + l < n; l++)
        s[l] = mbma_fma(a[k + l], b[k + l], s[l]);
    return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
}

#endif
