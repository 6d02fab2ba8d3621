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

/* A contact law holds one surface's force and area as polynomials of the gap, of which there are three coordinates:
 *
 *     d  separation, from h_max at first contact to -h_max at full compression,
 *     u  mean separation (h_max + d)/2,
 *     c  overclosure h_max - u, from 0 at first contact.
 *
 * A law is one block of 8-byte words: head, rows, records. With x = (h_max + s d) scale, s the sign that the head gives
 * for this side of d = 0, the exponent of x picks a row, the row a record, and with t = (x - centre) rate
 *
 *     record number = (bits of x >> shift) + base + kinks passed,    q = -s scale rate,    -dF/dd = q dF/dt,
 *     F = sum_k force[k] t^k,    A = sum_k area[k] t^k,    2 E = energy + sum_k force[k] t^(k+1)/(k+1)/q.
 *
 * Below x = low the first record holds: F is t^power_force times its polynomial, and A likewise.
 */
enum { MBMA_LAW_DEGREE = 8, MBMA_INVERSE_DEGREE = 5, MBMA_FIT_SAMPLES = 16 };

typedef struct {
    double h_max, scale, low, high;              /* low and high: of x */
    double plus, minus;                          /* s where d >= 0, and below */
    double kink_sign, kink, kink_sign_2, kink_2; /* a kink is passed where kink_sign d > kink */
    double power_force, power_area;              /* of t, in the first record */
    double lowest, highest;                      /* d that the law covers */
    int64_t exponent, minus_rows;                /* of the first row; where the rows of d < 0 begin */
    int64_t first_word, ends;                    /* of the records; whether contact ends at x = 0 */
} mbma_law_head;

typedef struct {
    int64_t shift, base;
} mbma_law_row;

typedef struct {
    double centre, rate;
    double force[MBMA_LAW_DEGREE + 1], area[MBMA_LAW_DEGREE + 1];
    double energy;
} mbma_law_record;

typedef struct {
    const mbma_law_head *head;
    const mbma_law_row *rows;
    const mbma_law_record *records;
    int64_t last; /* number of the last record */
} mbma_law;

typedef enum {
    MBMA_FORCE = 0,      /* F/A0, pressure */
    MBMA_AREA = 1,       /* A/A0 */
    MBMA_STIFFNESS = 2,  /* -dF/du = dF/dc */
    MBMA_AREA_SLOPE = 3, /* -dA/dd = dA/dc / 2 */
    MBMA_ENERGY = 4,     /* integral of F over u to last contact */
    MBMA_CURVATURE = 5   /* d2F/du2 = d2F/dc2 */
} mbma_quantity;

/* The parts of a block of so many words; 0 where they do not fit together. The block must outlive the law. */
int mbma_law_open(const void *block, size_t words, mbma_law *law);

/* One quantity at a separation, or at an overclosure, which keeps its digits next to first contact; NaN outside. */
double mbma_law_at(const mbma_law *law, mbma_quantity what, double d);
double mbma_law_at_overclosure(const mbma_law *law, mbma_quantity what, double c);

/* Force (area) at an overclosure, and its derivative by that. */
double mbma_law_and_slope(const mbma_law *law, mbma_quantity which, double c, double *by_c);

/* The quantities in the order of mbma_quantity, as far as their arrays are not NULL. */
size_t mbma_law_fill(size_t n, const double *d, const mbma_law *law, double *force, double *area, double *stiffness,
                     double *area_slope, double *energy);

/* Numbers of the records that hold at separations, whose x is known better. */
size_t mbma_law_records(size_t n, const double *x, const double *d, const mbma_law *law, int64_t *record);

/* The overclosure between two at which force (area) has a value, where it rises from one to the other. */
double mbma_law_overclosure(const mbma_law *law, mbma_quantity which, double wanted, double low, double high);

/* The inverse of force or area: guesses of x in four buckets an octave of its value, which bits of the value pick. */
typedef struct {
    double least, low, high, turn; /* values: the law's least, ends of the buckets, that at d = 0 where s turns */
    int64_t first_bucket;
    double end; /* d, where force or area turns down */
} mbma_inverse_head;

typedef struct {
    double centre, rate, side;
    double x[MBMA_INVERSE_DEGREE + 1];
} mbma_inverse_record;

typedef struct {
    const mbma_inverse_head *head;
    const mbma_inverse_record *records;
    int64_t last;
} mbma_inverse;

int mbma_inverse_open(const void *block, size_t words, mbma_inverse *inverse);

/* x, and s there, at values of force or area, down to the separation `end`: nodes of an inverse that is to be made. */
size_t mbma_inverse_nodes(size_t n, const double *wanted, const mbma_law *law, mbma_quantity which, double end,
                          double *x, double *side);

/* Separations at forces (areas), with area and stiffness there where their arrays are not NULL. */
size_t mbma_law_invert(size_t n, const double *wanted, const mbma_law *law, const mbma_inverse *inverse,
                       mbma_quantity which, double *d, double *area, double *stiffness);

/* Flow conductance of the gaps at separations: `flow` is a block like that of a law, with the conductance in place of
 * force; bodies farther apart than it reaches are u^3 (1 - 1.5/(u^2/h_rms^2 + 4)). `by_c` may be NULL, or get dK/dc. */
double mbma_law_flow(const mbma_law *flow, double h_max, double h_rms, double d, double *by_c);
size_t mbma_law_flow_fill(size_t n, const double *d, const mbma_law *flow, double h_max, double h_rms, double *out);

/* Records of intervals of x, (n, 2), from force and area at their Chebyshev points, (2, n, 16); behind each record
 * bounds on its errors: of value over F, of slope over F/x, of slope over itself. Matrices as law_pieces.py makes them:
 * series (16, 16), bounds (2, 16), monomials (9, 9). Not OK are intervals with values that are not positive. */
size_t mbma_law_fit(size_t n, const double *ends, const double *found, const double *series, const double *bounds,
                    const double *monomials, double *made);

/* ---- calibrated.c: the law calibrated on boundary elements, by its table ------------------------------------------ */

/* ---- spectrum_laws.c: Persson's theory and the calibrated law of a spectrum --------------------------------------- */

/* ---- hardness.c: contact with a hardness -------------------------------------------------------------------------- */

#ifdef __cplusplus
}
#endif

#endif
