/* Contact whose pressure cannot exceed a hardness, from the elastic contact of the same surface.
 *
 * Lengths are in h_rms, forces in A0 E* g with g the rms gradient, hardnesses as eta = p_m/(E* g). The law is in
 * mbma_tables/laws/hardness.py: force is closed between the elastic force and the bearing curve.
 *
 * SPDX-License-Identifier: BSD-3-Clause. Copyright (c) 2026, mbma_tables contributors.
 */
#include "elementary.h"
#include "mbma.h"

#define MOST_ETA 1e100 /* what is larger leaves the same force */
#define MOST_RATIO 1e300

size_t mbma_capped_force(size_t n, const double *elastic, const double *stiffness, const double *share,
                         const double *slope, const double *eta, double light, double by_eta, double by_share,
                         double *__restrict force, double *__restrict steepness) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const double own = elastic[k], Q = share[k], steep = stiffness[k], cap = eta[k], level = slope[k];
        /* NaN where an argument is; where nothing yields the level has no part */
        const double product = cap * Q, bound = cap > 0.0 ? product : NAN, full = cap == INFINITY ? cap : bound;
        const double unknown = own == own ? full : NAN, small = mbma_min(own, full), large = mbma_max(own, full);
        const double exponent = light + by_eta * mbma_min(cap, MOST_ETA) + by_share * Q;
        /* a force without bound has no weight, and what does not touch no force */
        const double quotient = large / small, ratio = small > 0.0 ? quotient : 1.0;
        const double gain = mbma_log(mbma_min(ratio, MOST_RATIO)), weight_over = mbma_exp(-exponent * gain);
        const double power = large < INFINITY ? weight_over : 0.0, weight = power / (1.0 + power);
        /* ln F lies so much below that of the smaller; derivatives by the exponent, by the elastic force, and by Q */
        const double lower = mbma_log1p(power) / exponent, by_exponent = (lower + weight * gain) / exponent;
        const double by_elastic = own <= full ? 1.0 - weight : weight;
        const double by_level = (1.0 - by_elastic) / Q + by_share * by_exponent, rising = by_level * level;
        const double falling = by_elastic * steep / own, falls = own < INFINITY ? falling : 0.0;
        const double rate = falls - (by_level > 0.0 ? rising : 0.0), met = small * mbma_exp(-lower);
        const double value = small > 0.0 ? met : 0.0, slopes = small > 0.0 ? value * rate : 0.0;
        force[k] = unknown == unknown ? value : NAN;
        steepness[k] = unknown == unknown ? slopes : NAN;
        bad += force[k] != force[k];
    }
    return bad;
}
