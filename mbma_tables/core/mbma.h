/* The compiled core of mbma_tables: contact of rough surfaces by the magnification-based multi-asperity (MBMA) model.
 *
 * Numbers and arrays in, numbers and status out. No function allocates, keeps state, reads or writes files, or sets
 * errno; any thread may call any of them. Functions on arrays return how many entries are not MBMA_OK; the answers of
 * these are NaN. Equation numbers are those of Guo, Ma and Zhu, arXiv:1712.06264.
 *
 * SPDX-License-Identifier: BSD-3-Clause. Copyright (c) 2026, mbma_tables contributors.
 */
#ifndef MBMA_H
#define MBMA_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    MBMA_OK = 0,         /* the answers hold */
    MBMA_X_BELOW = 1,    /* X is below the range of the table */
    MBMA_X_ABOVE = 2,    /* X is above the range of the table */
    MBMA_MU_ABOVE = 3,   /* mu is above the range of the table */
    MBMA_UNRESOLVED = 4, /* a quadrature or an iteration did not reach its tolerance */
    MBMA_INVALID = 5,    /* an argument is NaN, infinite or outside what the model allows */
    MBMA_OUTSIDE = 6     /* outside what a table or a law covers */
} mbma_status;

/* ---- phi.c: islands by the universal table ---------------------------------------------------------------------- */

/* ---- totals.c: force and area of surfaces ----------------------------------------------------------------------- */

/* ---- profile.c: one surface at many gaps ------------------------------------------------------------------------ */

/* ---- spline4.c: islands by the four-number table ----------------------------------------------------------------- */

/* ---- newton.c: exact islands ------------------------------------------------------------------------------------ */

/* ---- law.c: contact laws ---------------------------------------------------------------------------------------- */

/* ---- calibrated.c: the law calibrated on boundary elements, by its table ------------------------------------------ */

/* Quintic B-splines on equally spaced nodes over Hurst exponent, ln zeta_1 and a third axis, which runs fastest. Along
 * each axis there are 5 coefficients more than cells; two more of any value follow the last one. */
typedef struct {
    const float *coefficients;
    size_t cells[3];
    double first[3], rate[3]; /* first node, and nodes in 1 */
    double low[2], high[2];   /* of Hurst exponent and ln zeta_1, between which surfaces are answered */
} mbma_spline;

/* The calibrated law: forces F over A0 E* g with g the rms gradient; mean separations u and other heights over h_rms. */
typedef struct {
    mbma_spline log_force;               /* of a surface without end, over ln u */
    double area_s0, area_slope, area_t0; /* A/A0 = erf(F sqrt(2 (1 + t)/(s0 + t))), t = F/t0; s0 at Nayak's alpha 10 */
} mbma_calibrated_table;

/* Flow through gaps of mean u: k = u^3 (1 - 1.5/(u^2 + 4)) R, and 0 from A/A0 = threshold on. */
typedef struct {
    mbma_spline log_factor; /* ln R over ln A/(threshold A0 - A) */
    double threshold, obstruction;
} mbma_flow_table;

/* Surfaces that entries of calls share. */
typedef struct {
    size_t count;
    const double *hurst, *log_zeta_1;
    const double *h_max;  /* of the calibrated law alone, */
    const double *ends;   /* and two numbers each by mbma_calibrated_ends */
    const double *pieces; /* by mbma_spline_pieces; NULL where that does not pay */
} mbma_surfaces;

/* Nayak's alpha of self-affine surfaces, and their rms gradient over q0 h_rms. */
size_t mbma_self_affine(size_t n, const double *hurst, const double *log_zeta_1, double *alpha, double *gradient);

/* A/A0 at forces, by s0 of each and t0. */
size_t mbma_contact_area(size_t n, const double *force, const double *s0, double area_t0, double *area);

/* Six coefficients for each cell of the third axis and each surface. With these, calls give the same bits in less time;
 * they are worth making from about 40 entries a surface on. */
size_t mbma_spline_pieces(const mbma_spline *spline, const mbma_surfaces *surfaces, double *pieces);

/* s0 of each surface, and ln F at its h_max. */
size_t mbma_calibrated_ends(const mbma_calibrated_table *table, const mbma_surfaces *surfaces, double *ends);

/* Force, area and -dF/du at mean separations; `owner` has the number of each entry's surface, from 0. */
size_t mbma_calibrated_contact(const mbma_calibrated_table *table, const mbma_surfaces *surfaces, size_t n,
                               const int64_t *owner, const double *u, double *force, double *area, double *stiffness);

/* Mean separations at forces > 0. */
size_t mbma_calibrated_separation(const mbma_calibrated_table *table, const mbma_surfaces *surfaces, size_t n,
                                  const int64_t *owner, const double *force, double *u);

/* Force over A0 E* q0 h_rms and area, each with its derivatives by u, h_max, Hurst exponent and ln zeta_1: ten numbers
 * an entry, which is of the surface of its own number; 0 < u. */
size_t mbma_calibrated_slopes(const mbma_calibrated_table *table, const mbma_surfaces *surfaces, const double *u,
                              double *out);

/* k at mean gaps over h_rms and at A/A0. With `pieces`, which may be those of any spectrum, nothing else of the
 * surfaces is read. */
size_t mbma_flow(const mbma_flow_table *table, const mbma_surfaces *surfaces, size_t n, const int64_t *owner,
                 const double *u, const double *area, double *k);

/* ---- spectrum_laws.c: Persson's theory and the calibrated law of a spectrum --------------------------------------- */

/* A spectrum as a quadrature rule, wavenumbers rising. Here F is over A0 E* g with g the rms gradient, mean separations u
 * and h_max are over h_rms. */
typedef struct {
    size_t count;
    const double *x;                /* wavenumbers over any one, q0 */
    const double *variance, *below; /* shares of h_rms^2 that sum up to 1, and of g^2 of the waves below */
    double gradient, alpha;         /* g over q0 h_rms, Nayak's parameter */
} mbma_waves;

typedef struct {
    double area_s0, area_slope, area_t0; /* as in the calibrated law's table; s0 = 1 is Persson's area */
    double weight, weight_slope, cubic;  /* W = a P + b P^3 + (1 - a - b) P^16, a linear in the spectrum's narrowness */
    double tail;                         /* forces fall by exp(-tail (1 - narrowness) u^3) */
} mbma_law_constants;

enum { MBMA_ORDER = 12, MBMA_INNER_CELLS = 30, MBMA_MOST_PANELS = 120 };

/* Inner integrals of P, P^3 and P^16, which all laws are made from. */
typedef struct {
    double p[3][MBMA_INNER_CELLS][MBMA_ORDER];
} mbma_inner;

/* A prepared law. */
typedef struct {
    double s0, t0, tail, h_max, end; /* end: ln F at h_max of a surface without end */
    double shift, lightest[2];       /* of ln F; u where panels begin, and its slope */
    uint64_t panels;
    double edge[MBMA_MOST_PANELS + 1], log_u[MBMA_MOST_PANELS + 1];
    double p[MBMA_MOST_PANELS][MBMA_ORDER];
} mbma_spectrum_law;

void mbma_inner_integrals(mbma_inner *inner);

/* A quadrature rule for power laws between samples: q rising [1/length], a repeated one is a jump; C not negative
 * [length^4], both as in h_rms^2 = 2 pi integral C q dq. How many waves it has, 0 if there is no such spectrum; they are
 * written where `most` are enough, and what they belong to in `facts`: g over q0 h_rms with q0 the first q where C is not
 * zero, and Nayak's alpha. */
size_t mbma_spectrum_waves(size_t count, const double *q, const double *C, size_t most, double *x, double *variance,
                           double *below, double facts[2]);

/* Prepares the law of a spectrum on surfaces that end at h_max, which may be infinite; `work` has room for nine numbers
 * a wave. */
mbma_status mbma_spectrum_law_of(const mbma_inner *inner, const mbma_waves *waves, const mbma_law_constants *constants,
                                 double h_max, double *work, mbma_spectrum_law *law);

/* Mean separation and its derivative by ln F of a surface without end, before the tail's factor. */
size_t mbma_spectrum_law_persson(const mbma_spectrum_law *law, size_t n, const double *force, double *u, double *slope);

/* Force, area and -dF/du at mean separations. */
size_t mbma_spectrum_law_contact(const mbma_spectrum_law *law, size_t n, const double *u, double *force, double *area,
                                 double *stiffness);

/* Mean separations at forces > 0; 0 at forces that leave none. */
size_t mbma_spectrum_law_separation(const mbma_spectrum_law *law, size_t n, const double *force, double *u);

/* ---- hardness.c: contact with a hardness -------------------------------------------------------------------------- */

#ifdef __cplusplus
}
#endif

#endif
