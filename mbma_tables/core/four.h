/* Four doubles at once, for loops to inline. */
#ifndef MBMA_FOUR_H
#define MBMA_FOUR_H

#include "elementary.h"

/* fma4(a, y, b) is a y + b and fma44(a, b, c) is a b + c, which compilers do not vectorise by themselves here. */
#if defined(__FMA__)
#include <immintrin.h>
typedef __m256d four;
MBMA_INLINE four four_of(const double *row) { return _mm256_loadu_pd(row); }
MBMA_INLINE four four_of_floats(const float *row) { return _mm256_cvtps_pd(_mm_loadu_ps(row)); }
MBMA_INLINE four fma4(four a, double y, four b) { return _mm256_fmadd_pd(a, _mm256_set1_pd(y), b); }
MBMA_INLINE four fma44(four a, four b, four c) { return _mm256_fmadd_pd(a, b, c); }
MBMA_INLINE four minus4(four a, four b) { return _mm256_sub_pd(a, b); }
MBMA_INLINE void four_to(double *row, four a) { _mm256_storeu_pd(row, a); }
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
MBMA_INLINE four fma44(four a, four b, four c) {
    for (int i = 0; i < 4; i++)
        c.lane[i] = mbma_fma(a.lane[i], b.lane[i], c.lane[i]);
    return c;
}
MBMA_INLINE four minus4(four a, four b) {
    for (int i = 0; i < 4; i++)
        a.lane[i] -= b.lane[i];
    return a;
}
MBMA_INLINE void four_to(double *row, four a) { memcpy(row, &a, sizeof a); }
#endif

#endif
