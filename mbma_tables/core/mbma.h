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

/* ---- spectrum_laws.c: Persson's theory and the calibrated law of a spectrum --------------------------------------- */

/* ---- hardness.c: contact with a hardness -------------------------------------------------------------------------- */

#ifdef __cplusplus
}
#endif

#endif
