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

/* Two functions of four axes by their tensor spline of degree 3 over equally spaced nodes. `places` is (4, n), positions
 * along the axes from 0 to nodes - 1; `coefficients` those of cardinal B-splines, (nodes[0] + 2, ..., nodes[3] + 2, 2);
 * `out` is (2, n), or with slopes (10, n): f, its derivatives along the axes, g, its derivatives. */
size_t mbma_spline4(size_t n, const double *places, const double *coefficients, const int64_t *nodes, int slopes,
                    double *out);

/* Bands of the paper's four numbers, by zeta_u/zeta_d - 1 and (1.25/zeta_d)^(4 - 2 H), finite for every zeta_d. `out` is
 * (4, n): mu = 8/3 D sigma sqrt(2 R_u R_d); sigma zeta_d^H; F_hat zeta_d^(1 + H) per Phi_F, A_hat zeta_d^2 per Phi_A. */
size_t mbma_four_numbers(size_t n, const double *spread, const double *sphere, const double *hurst,
                         double density_divisor, int summit_sigma, double *out);

/* ---- newton.c: exact islands ------------------------------------------------------------------------------------ */

/* ---- law.c: contact laws ---------------------------------------------------------------------------------------- */

/* ---- calibrated.c: the law calibrated on boundary elements, by its table ------------------------------------------ */

/* ---- spectrum_laws.c: Persson's theory and the calibrated law of a spectrum --------------------------------------- */

/* ---- hardness.c: contact with a hardness -------------------------------------------------------------------------- */

#ifdef __cplusplus
}
#endif

#endif
