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

/* ln F_G at ln F, by Newton's method for -ln r, from below since the function is concave. */
MBMA_INLINE double mbma_endless(double log_force, double end) {
    const double over = log_force - end;
    double y = over < 0.0 ? mbma_exp(mbma_max(over, -700.0) / 1.5) : mbma_max(over, 1.0), more = 0.0;
    for (int step = 0; step < 6; step++) {
        const double r = mbma_exp(-mbma_min(y, 700.0)), left = -mbma_expm1(-mbma_min(y, 700.0));
        more = mbma_log1p(r) - 1.5 * mbma_log(left);
        y += (over - y + more) / (1.0 + 1.5 * r / left + r / (1.0 + r));
    }
    return over < 0.0 ? end + y : log_force + more;
}

#endif
