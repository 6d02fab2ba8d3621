/* Exact islands by the damped iteration of Greenwood and Tripp (Eqs. 34, 36, 37), the paper's, on rings of equal width.
 *
 * SPDX-License-Identifier: BSD-3-Clause. Copyright (c) 2026, mbma_tables contributors.
 */
#include "eight.h"
#include "heights.h"
#include "mbma.h"

#define MAX_DEFORMATION 1e12 /* one this large is divergence */

mbma_status mbma_damped_steps(double X, double mu, double a, double damping, double tolerance, int64_t most,
                              size_t rings, const double *matrix, double *w, double *p, double phi[2],
                              int64_t *steps) {
    const double width = a / (double)rings;
    mbma_status status = MBMA_UNRESOLVED;
    for (*steps = 0;; ++*steps) {
        double largest = 0.0, scale = 0.0;
        for (size_t i = 0; i < rings; i++) {
            const double rho = width * ((double)i + 0.5);
            p[i] = 0.5 * mu * halves_of(rho * rho - X + w[i]).three_halves; /* (36) */
        }
        if (*steps >= most || status == MBMA_OK)
            break;
        for (size_t i = 0; i < rings; i++) {
            const double change = damping * (a * dot(matrix + i * rings, p, rings) - w[i]);
            w[i] += change;
            largest = mbma_max(largest, fabs(change));
            scale = mbma_max(scale, fabs(w[i]));
        }
        if (!(scale < MAX_DEFORMATION)) {
            ++*steps;
            phi[0] = phi[1] = NAN;
            return MBMA_UNRESOLVED;
        }
        if (largest <= tolerance * damping * scale)
            status = MBMA_OK;
    }
    phi[0] = phi[1] = 0.0;
    for (size_t i = 0; i < rings; i++) {
        const double rho = width * ((double)i + 0.5), ring = 2.0 * MBMA_PI * width * rho;
        phi[0] += ring * p[i];
        phi[1] += ring * whole(1, rho * rho - X + w[i]);
    }
    if (isfinite(phi[0] + phi[1]))
        return status;
    phi[0] = phi[1] = NAN;
    return MBMA_UNRESOLVED;
}
