/* Islands of a self-affine surface at an approach, for loops to inline (Section 3.2 of the paper).
 *
 * Lengths are in units of 1/q0, heights of s or h_rms; zeta_d^(-2H) = e + a and zeta_u^(-2H) = e + b with
 * e = zeta_1^(-2H). A moment over [1, zeta] is m2 = H (zeta^p - 1)/p with p = 2 - 2H, m4 = (3/4) H (zeta^p - 1)/p with
 * p = 4 - 2H, and Nayak's parameter is alpha = m0 m4/m2^2 (3, 7).
 */
#ifndef MBMA_ISLAND_H
#define MBMA_ISLAND_H

#include "elementary.h"
#include "mbma.h"

#define BROADENING 0.8968           /* summit variance is (1 - BROADENING/alpha) m0 (2) */
#define RADIUS 0.66467019408956848  /* 3 sqrt(pi)/8: summit radius is RADIUS/sqrt(m4) (2) */
#define ROOT_TWO_PI 2.50662827463100050
#define NO_POWER 1e-100             /* for p = 0 */
#define STRETCH 8.0                 /* scale of the approach's map, in boundary layers zeta_1^(-H) */

/* Constants of a surface for its islands. */
typedef struct {
    double e;                    /* zeta_1^(-2H) */
    double rms_over_s;           /* h_rms/s = sqrt(1 - e) */
    double slope_d, slope_u;     /* sqrt(a) and sqrt(b) per x = delta/h_rms below the floors (27, 30) */
    double root_floor_d, root_floor_u, offset_floor_u; /* sqrt(a), sqrt(b) and b at the floors */
    double log_floor_d, log_floor_u, eta_factor;
    double kink_d, kink_u;       /* x at which zeta_d and zeta_u reach their floors */
    double map_scale;
    double jacobian;             /* K1 (47) below kink_d */
    double p2, p4, over_p2, over_2H, rate, tilt, density, radius;
    double offset;               /* 1, or 0 without h_d */
} surface;

/* How far the roughness of a band is from a smooth sphere, mu (32), and force and area of the island per Phi_F (40) and per
 * Phi_A and eta, of its summits' density and standard deviation and of the radii of sphere and summits. */
typedef struct {
    double mu, force, area;
} scales;

MBMA_INLINE scales scales_of(double D, double sigma, double R_d, double R_u) {
    const double both = R_u * R_d;
    const scales found = {8.0 / 3.0 * D * sigma * sqrt(2.0 * both), sigma * sqrt(2.0 * R_d * sigma),
                          2.0 * MBMA_PI * D * both * sigma * sigma};
    return found;
}

/* An island; force and area are those per Phi_F and Phi_A. */
typedef struct {
    double X, mu, force, area, h_d, D_d, sigma_d;
    double narrowness, count; /* 1/sigma_d; islands by x, times exp(-height^2/2) (44) */
    double sigma, log_d, width, eta, R_d, R_u, D;
} island;

/* floor^(-2H) - zeta_1^(-2H) without cancellation */
MBMA_INLINE double floor_offset(double hurst, double zeta_1, double floor) {
    return exp(-2.0 * hurst * log(zeta_1)) * expm1(2.0 * hurst * log1p((zeta_1 - floor) / floor));
}

MBMA_INLINE surface surface_of(double hurst, double zeta_1, const mbma_variant *v) {
    const double L = log(zeta_1);
    surface s;
    s.e = exp(-2.0 * hurst * L);
    s.rms_over_s = sqrt(-expm1(-2.0 * hurst * L));
    s.slope_d = 4.0 / 3.0 * v->beta;
    s.slope_u = v->phi / (1.0 + v->phi) * s.rms_over_s;
    s.root_floor_d = sqrt(floor_offset(hurst, zeta_1, v->floor_d));
    s.offset_floor_u = floor_offset(hurst, zeta_1, v->floor_u);
    s.root_floor_u = sqrt(s.offset_floor_u);
    s.log_floor_d = log(v->floor_d);
    s.log_floor_u = log(v->floor_u);
    s.kink_d = s.root_floor_d / s.slope_d;
    s.kink_u = s.root_floor_u / s.slope_u;
    s.map_scale = STRETCH * exp(-hurst * L);
    s.p2 = hurst != 1.0 ? 2.0 - 2.0 * hurst : NO_POWER;
    s.p4 = 4.0 - 2.0 * hurst;
    s.over_p2 = 1.0 / s.p2;
    s.over_2H = 0.5 / hurst;
    s.rate = 0.75 / s.p4;
    s.tilt = v->summit_sigma ? BROADENING * hurst / s.rate : 0.0;
    s.density = s.rate / v->density_divisor;
    s.radius = RADIUS / sqrt(s.rate * hurst);
    s.offset = v->offset ? 1.0 : 0.0;
    /* the factor of eta (39) that depends on the surface alone: all its summits */
    const double grown2 = expm1(s.p2 * L) / (s.p2 * L), grown4 = expm1(s.p4 * L) / (s.p4 * L);
    const double D = 0.75 * grown4 / grown2 / v->density_divisor, R = RADIUS / sqrt(0.75 * hurst * L * grown4);
    s.eta_factor = 0.75 * cbrt(MBMA_PI * D) * pow(1.5 * R, 2.0 / 3.0) / cbrt(v->phi);
    const double below = 1.0 - s.slope_d / (v->printed ? 1.0 : s.rms_over_s);
    s.jacobian = v->printed || v->offset ? below : 1.0;
    return s;
}

/* The island at delta = x h_rms; `floor_d` and `floor_u` are true if zeta_d (27) and zeta_u (30) are at their floors,
 * and are constants wherever this is inlined, so that it has no branch. */
MBMA_INLINE island island_at(double x, bool floor_d, bool floor_u, const surface *s) {
    island n;
    const double root_a = floor_d ? s->root_floor_d : s->slope_d * x;
    const double root_b = floor_u ? s->root_floor_u : s->slope_u * x;
    const double a = root_a * root_a;
    const double b = floor_u ? s->offset_floor_u : root_b * root_b;
    /* both shrink with x below the floors, where the difference of squares would cancel */
    const double m0 = floor_u ? a - b : (root_a - root_b) * (root_a + root_b);
    const double top = s->e + a;
    /* only the width needs its relative digits */
    n.log_d = floor_d ? s->log_floor_d : -mbma_log(top) * s->over_2H;
    n.width = mbma_log1p(m0 / (s->e + b)) * s->over_2H;
    /* zeta_d^p, (zeta_d^p - 1)/p and (zeta_u^p - zeta_d^p)/p for p = 2 - 2H; for 4 - 2H without the division */
    const double square = mbma_exp(2.0 * n.log_d);
    const double top4 = square * square * top;
    const double below4 = top4 - 1.0;
    const double below2 = mbma_expm1(s->p2 * n.log_d) * s->over_p2;
    const double top2 = mbma_fma(s->p2, below2, 1.0);
    const double band2 = top2 * mbma_expm1(s->p2 * n.width) * s->over_p2;
    const double band4 = top4 * mbma_expm1(s->p4 * n.width);
    const double over_band2 = 1.0 / band2, over_below2 = 1.0 / below2;
    n.D = s->density * band4 * over_band2;
    n.D_d = s->density * below4 * over_below2;
    n.sigma = sqrt(m0 - s->tilt * band2 * (band2 / band4));
    n.sigma_d = sqrt(1.0 - top - s->tilt * below2 * (below2 / below4));
    n.R_d = s->radius / sqrt(below4);
    n.R_u = s->radius / sqrt(below4 + band4);
    n.narrowness = 1.0 / n.sigma_d;
    n.count = n.D_d * n.narrowness * (s->rms_over_s / ROOT_TWO_PI);
    n.h_d = s->offset * root_a;
    const scales scale = scales_of(n.D, n.sigma, n.R_d, n.R_u);
    n.mu = scale.mu;
    n.force = scale.force;
    n.eta = s->eta_factor * mbma_exp(mbma_log(root_b / n.R_u) * (1.0 / 3.0)); /* (39) */
    n.area = scale.area * n.eta;
    n.X = (s->rms_over_s * x - n.h_d) / n.sigma;
    return n;
}

/* z'/sigma_d (41) of an island whose top is at `peak` over h_rms */
MBMA_INLINE double height_of(double peak, const island *n, const surface *s) {
    return (peak * s->rms_over_s - n->h_d) * n->narrowness;
}

#endif
