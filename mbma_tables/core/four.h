/* Four doubles at once, for loops to inline. */
#ifndef MBMA_FOUR_H
#define MBMA_FOUR_H

#include "elementary.h"

/* fma4(a, y, b) is a y + b, which compilers do not vectorise by themselves here. */
#if defined(__FMA__)
#include <immintrin.h>
typedef __m256d four;
MBMA_INLINE four four_of(const double *row) { return _mm256_loadu_pd(row); }
MBMA_INLINE four four_of_floats(const float *row) { return _mm256_cvtps_pd(_mm_loadu_ps(row)); }
MBMA_INLINE four fma4(four a, double y, four b) { return _mm256_fmadd_pd(a, _mm256_set1_pd(y), b); }
#else
typedef struct {
    double lane[4];
} four;
MBMA_INLINE four four_of(const double *row) {
    four found;
    memcpy(&found, row, sizeof found);
    return found;
}
MBMA_INLINE four four_of_floats(const float *row) {
    const four found = {{(double)row[0], (double)row[1], (double)row[2], (double)row[3]}};
    return found;
}
MBMA_INLINE four fma4(four a, double y, four b) {
    for (int i = 0; i < 4; i++)
        b.lane[i] = mbma_fma(a.lane[i], y, b.lane[i]);
    return b;
}
#endif

#endif
