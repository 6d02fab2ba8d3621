/* Eight doubles at once: fma8(a, y, b) is a y + b. All three ways of writing it round alike where the processor has an
 * fma. */
#ifndef MBMA_EIGHT_H
#define MBMA_EIGHT_H

#include "elementary.h"

#if defined(__FMA__)
#include <immintrin.h>
#endif

#if defined(__AVX512F__)
typedef __m512d eight;
MBMA_INLINE eight row_of(const double *row) { return _mm512_loadu_pd(row); }
MBMA_INLINE eight fma8(eight a, double y, eight b) { return _mm512_fmadd_pd(a, _mm512_set1_pd(y), b); }
#elif defined(__FMA__)
typedef struct {
    __m256d low, high;
} eight;
MBMA_INLINE eight row_of(const double *row) {
    const eight found = {_mm256_loadu_pd(row), _mm256_loadu_pd(row + 4)};
    return found;
}
MBMA_INLINE eight fma8(eight a, double y, eight b) {
    const __m256d by = _mm256_set1_pd(y);
    const eight found = {_mm256_fmadd_pd(a.low, by, b.low), _mm256_fmadd_pd(a.high, by, b.high)};
    return found;
}
#else
/* two at once, which every processor of 64 bits has */
typedef double pair __attribute__((vector_size(16)));
#if defined(__ARM_FEATURE_FMA)
#define PAIR_FMA(a, y, b) (pair){mbma_fma((a)[0], y, (b)[0]), mbma_fma((a)[1], y, (b)[1])}
#else
#define PAIR_FMA(a, y, b) ((a) * (y) + (b))
#endif
typedef struct {
    pair at[4];
} eight;
MBMA_INLINE eight row_of(const double *row) {
    eight found;
    memcpy(&found, row, sizeof found);
    return found;
}
MBMA_INLINE eight fma8(eight a, double y, eight b) {
    const eight found = {{PAIR_FMA(a.at[0], y, b.at[0]), PAIR_FMA(a.at[1], y, b.at[1]),
                          PAIR_FMA(a.at[2], y, b.at[2]), PAIR_FMA(a.at[3], y, b.at[3])}};
    return found;
}
#endif

#endif
