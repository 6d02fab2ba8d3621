/* How forces of the calibrated law end at h_max, as a Hertzian contact does: F = F_G (1 - r)^(3/2)/(1 + r) with F_G that
 * of a surface without end, r its value at h_max over that. */
#ifndef MBMA_ENDS_H
#define MBMA_ENDS_H

#include "elementary.h"

/* F/F_G at ln r <= 0, and dF/dF_G. */
MBMA_INLINE double mbma_ended(double log_r, double *slope) {
    /* without cancellation */
    const double left = mbma_max(-mbma_expm1(log_r), 0.0), r = 1.0 - left, root = sqrt(left);
    *slope = root / (1.0 + r) * (left + 1.5 * r + left * r / (1.0 + r));
    return left * root / (1.0 + r);
}

/* ln F_G at ln F. With w = F_G/F_end - 1, F/F_end = sqrt(w^3 (1 + w))/(2 + w): two steps of Newton's method between the
 * logarithms, which are nearly proportional, from a guess within 1%; logarithms of ratios near 1 by their Pade form. */
MBMA_INLINE double mbma_endless(double log_force, double end) {
    const double over = log_force - end, root = mbma_exp(mbma_held(over, -700.0, 40.0) / 1.5);
    double part = sqrt(root + 2.5198421 / sqrt(1.0 + 0.66 * root)), w = part * root; /* 4^(2/3) for light loads */
    for (int step = 0; step < 2; step++, w = part * root) {
        const double square = (2.0 + w) * (2.0 + w), cube = part * part * part * (1.0 + w);
        const double power = 3.0 + w / (1.0 + w) - 2.0 * w / (2.0 + w), half = (cube - square) / (cube + square);
        part *= (power - half) / (power + half);
    }
    const double heavy = 0.5 * mbma_log((2.0 + w) * (2.0 + w) * (1.0 + w) / (w * w * w));
    return over < 0.0 ? end + mbma_log1p(w) : log_force + heavy;
}

#endif
