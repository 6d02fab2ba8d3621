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

/* F_n(x) = integral_x^inf (z - x)^n phi(z) dz, phi the standard normal density, of twice_n = 1, 2, 3, 4 or 5. */
size_t mbma_height_integrals(int64_t twice_n, size_t n, const double *x, double *out);

/* Gauss nodes v = (rho/a)^2 on [0, 1] and the half-space in them (37), for vectors of values times `root_weights`. */
typedef struct {
    size_t nodes; /* at least 8 */
    const double *v, *root_weights;
    const double *modes;  /* row k takes a vector to its k-th orthonormal Legendre coefficient */
    const double *matrix; /* w = a matrix p; symmetric and positive definite */
} mbma_basis;

#define MBMA_ISLANDS_WORK(nodes) ((nodes) * ((nodes) + 9))

/* Newton's method (34)-(37): `phi` (n, 3) receives Phi_F, Phi_A and an estimate of their relative error, whose size the
 * caller judges, `steps` the steps; profiles (n, nodes) where `rho` is not NULL. `coarse` is the small basis of the
 * first guess, `work` space for MBMA_ISLANDS_WORK numbers. */
size_t mbma_solve_islands(size_t n, const double *X, const double *mu, double rtol, const mbma_basis *fine,
                          const mbma_basis *coarse, double *phi, int64_t *steps, uint8_t *status, double *rho,
                          double *pressure, double *gap, double *work);

/* a^2 of the disc rho < a that holds all but `share` of the area of an island. */
size_t mbma_island_extents(size_t n, const double *X, const double *mu, double share, double *squared);

/* The damped iteration of Greenwood and Tripp on rings of equal width in rho < a: at most `most` steps on from `w`, to
 * which the pressures p, Phi_F and Phi_A belong. MBMA_OK where it has converged; NaN where it has diverged. */
mbma_status mbma_damped_steps(double X, double mu, double a, double damping, double tolerance, int64_t most,
                              size_t rings, const double *matrix, double *w, double *p, double phi[2],
                              int64_t *steps);

/* ---- law.c: contact laws ---------------------------------------------------------------------------------------- */

/* ---- calibrated.c: the law calibrated on boundary elements, by its table ------------------------------------------ */

/* ---- spectrum_laws.c: Persson's theory and the calibrated law of a spectrum --------------------------------------- */

/* ---- hardness.c: contact with a hardness -------------------------------------------------------------------------- */

#ifdef __cplusplus
}
#endif

#endif
