/* The compiled core of mbma_tables: contact of rough surfaces by the magnification-based multi-asperity (MBMA) model.
 *
 * Numbers and arrays in, numbers and status out. No function allocates, keeps state, reads or writes files, or sets
 * errno; any thread may call any of them. Functions on arrays return how many entries are not MBMA_OK; the results of
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
    MBMA_OK = 0,             /* the results are valid */
    MBMA_X_BELOW = 1,        /* X is below the range of the table */
    MBMA_X_ABOVE = 2,        /* X is above the range of the table */
    MBMA_MU_ABOVE = 3,       /* mu is above the range of the table */
    MBMA_UNRESOLVED = 4,     /* a quadrature or an iteration did not reach its tolerance */
    MBMA_INVALID = 5,        /* an argument is NaN, infinite or outside what the model allows */
    MBMA_OUTSIDE = 6,        /* outside what a table or a law covers */
    MBMA_SPREAD_ABOVE = 7,   /* zeta_u/zeta_d - 1 is above the range of the table */
    MBMA_ZETA_D_OUTSIDE = 8, /* zeta_d is outside the range of the table, which depends on H */
    MBMA_HURST_OUTSIDE = 9   /* H is outside the range of the table */
} mbma_status;

/* ---- totals.c: islands by the universal table, and force and area of surfaces ------------------------------------ */

/* A cell: a bound on the relative error, x = (X - centre) rate, y = (mu top_mu + top)/(mu bottom_mu + bottom), and
 * Phi_F/mu and Phi_A as sums of c[j][i] x^i y^j. */
typedef struct {
    double error, centre, rate, top_mu, top, bottom_mu, bottom, unused;
    double force[8][8], area[8][8];
} mbma_cell;

/* The table. The cell of (X, mu) is places[places[(X - X_low) X_rate] + (bits of mu >> 49) - first_bucket]: first are
 * the places where the buckets of strips, equal steps of X, begin. */
typedef struct {
    const mbma_cell *cells;
    const int32_t *places;
    double X_low, X_high, X_rate, mu_high;
    int64_t first_bucket, buckets;
} mbma_cells;

/* Rows of Phi_F, Phi_A and the bound on their relative error (34-40); `status`, one for each entry, may be NULL. */
size_t mbma_phi(size_t n, const double *X, const double *mu, const mbma_cells *cells, double *out, uint8_t *status);

#define MBMA_MAX_ZETA_1 1e8
#define MBMA_MIN_APPROACH 1e-140 /* squares of numbers of this order do not underflow */

/* Variant of the paper's equations: summit density is m4/(density_divisor m2) (2); beta (B.6) and phi (28); floors of
 * zeta_d (27) and zeta_u (30); whether islands are offset by h_d below z_max (35), whether sigma is the summits' (32),
 * and whether K1 is as printed in (47). */
typedef struct {
    double density_divisor, beta, phi, floor_d, floor_u;
    int offset, summit_sigma, printed;
} mbma_variant;

/* An island (Section 3.2) in units of s and 1/q0; width is ln(zeta_u/zeta_d). */
typedef struct {
    double zeta_d, zeta_u, R_d, R_u, D, sigma, h_d, h_u, eta, X, mu, D_d, sigma_d, width;
} mbma_island;

/* The island at delta = approach h_rms, approach >= MBMA_MIN_APPROACH. */
int mbma_island_geometry(double approach, double hurst, double zeta_1, const mbma_variant *variant, mbma_island *out);

/* A/A0 of islands that overlap at random, from the sum of their areas over A0. */
size_t mbma_covered_areas(size_t n, const double *sum, double *area);

/* F/(A0 E* q0 s), A/A0 and after each its derivative by the compression, `out` (n, 2, 2), of surfaces and gaps: hurst in
 * (0, 1], zeta_1 = q1/q0, compression (h_max - d)/h_rms and peak h_max/h_rms. `error` bounds the relative error, of
 * quadrature to `rtol` and of the table; `islands` counts those looked up. */
size_t mbma_totals(size_t n, const double *hurst, const double *zeta_1, const double *compression, const double *peak,
                   double rtol, const mbma_variant *variant, const mbma_cells *cells, double *out, double *error,
                   uint8_t *status, int64_t *islands);

/* ---- island4d.c: islands by the paper's four numbers -------------------------------------------------------------- */

#define MBMA_SPHERE_FLOOR 1.25 /* zeta_d at the end of the axis `sphere`, below the paper's floor of 1.5 */

/* ln(Phi/Phi of a rigid sphere) as quintic B-splines on equally spaced nodes over ln(X + offset), ln(spread), sphere and
 * H, `coefficients` of F and A side by side, along each axis 5 more than cells; and for each cell a bound on the relative
 * error. Here X = (delta - h_d)/sigma is how deep an island is, spread = zeta_u/zeta_d - 1 and sphere =
 * (MBMA_SPHERE_FLOOR/zeta_d)^(4 - 2H). */
typedef struct {
    const float *coefficients, *errors;
    size_t cells[4];
    double first[4], rate[4]; /* first node and nodes in 1, of the numbers above */
    double low[4], high[4];   /* of X, spread, sphere and H, between which islands are answered */
    double offset;            /* of X */
    mbma_variant variant;     /* for which the table was made */
} mbma_island_table;

/* Of bands of roughness: mu (32), sigma zeta_d^H, and force and area per Phi_F and Phi_A (40), times zeta_d^(1 + H) and
 * zeta_d^2, in units of E* s/q0 and eta/q0^2. */
size_t mbma_island_bands(size_t n, const double *spread, const double *sphere, const double *hurst,
                         const mbma_variant *variant, double *mu, double *sigma, double *force, double *area);

/* Places of islands on the table's axes, mu, sigma zeta_d^H, and force and area per Phi_F and Phi_A. `approach` is delta/h_rms read at
 * zeta_1 without bound; 1 < zeta_d < zeta_u. */
size_t mbma_island_places(size_t n, const double *approach, const double *zeta_d, const double *zeta_u,
                          const double *hurst, const mbma_variant *variant, double *X, double *spread, double *sphere,
                          double *mu, double *sigma, double *force, double *area);

/* Phi_F, Phi_A and the bound on their relative error at places of the axes. Spreads below the first are answered to
 * first order in mu. */
size_t mbma_island_answers(size_t n, const double *X, const double *spread, const double *sphere, const double *hurst,
                           const double *mu, const mbma_island_table *table, double *phi_F, double *phi_A,
                           double *error);

/* F_hat = F^i q0/(E* s), A_hat = A^i q0^2/eta and the bound on their relative error, of one island; the status says which
 * of the table's axes does not reach it. */
mbma_status mbma_island_lookup(const mbma_island_table *table, double approach, double zeta_d, double zeta_u,
                               double hurst, double out[3]);

/* As mbma_totals, with the islands of a table of four numbers; `answers` is mbma_island_answers. */
typedef size_t mbma_island_function(size_t n, const double *X, const double *spread, const double *sphere,
                                    const double *hurst, const double *mu, const mbma_island_table *table,
                                    double *phi_F, double *phi_A, double *error);
size_t mbma_island_totals(size_t n, const double *hurst, const double *zeta_1, const double *compression,
                          const double *peak, double rtol, const mbma_variant *variant, const mbma_island_table *table,
                          mbma_island_function *answers, double *out, double *error, uint8_t *status,
                          int64_t *islands);

/* ---- cells.c: tables of any function ------------------------------------------------------------------------------ */

enum { MBMA_MAX_AXES = 6, MBMA_MAX_TERMS = 24 };
enum { MBMA_REFUSED = 0, MBMA_NEAREST = 1, MBMA_PERIODIC = 2 }; /* what an axis answers outside its range */
enum { MBMA_POLYNOMIAL = -1, MBMA_NO_ANSWER = -2 };             /* boxes that are not halved */

/* An axis: its range, and that of the coordinate on which boxes are halved, x or ln(x + offset). */
typedef struct {
    double low, high, offset, first, last;
    int is_log, outside;
} mbma_axis;

/* Boxes, of which the first is the whole range: the axis at whose `middle` a box is halved and the number of its lower
 * half, which the upper follows; or MBMA_POLYNOMIAL and the number of a cell, or MBMA_NO_ANSWER. A cell has its terms
 * along each axis, where its coefficients start, those of one output after the other with the last axis fastest, and a
 * bound on the error of each output, relative for those whose logarithm is stored (`is_exponential`). */
typedef struct {
    size_t axes, outputs, boxes, cells, coefficient_count;
    const mbma_axis *axis;
    const int32_t *is_exponential, *branches, *terms;
    const int64_t *starts;
    const double *middles, *coefficients, *errors;
} mbma_cell_table;

/* Outputs at points, `x` (n, axes): `values` (n, outputs), unless NULL `slopes` (n, outputs, axes), and `errors`
 * (n, outputs); NaN where the table has no answer. `cells` (n) are the numbers of the cells, -1 where there is none. */
size_t mbma_cell_answers(const mbma_cell_table *table, size_t n, const double *x, double *values, double *slopes,
                         double *errors, int64_t *cells);

/* What is solved for: an output that rises, or falls, along an axis everywhere. `guess` may be NULL; for each box that
 * is halved along the axis it has a polynomial that is close to the stored output at the middle: what the coordinates
 * of all axes are times, then their squares, then a constant. */
typedef struct {
    size_t output, axis;
    int rises;
    const double *guess;
} mbma_cell_inverse_of;

enum { MBMA_NO_CELL = -1, MBMA_NOT_REACHED = -2 }; /* in place of numbers of cells */

/* Where an output is `wanted` (n): column `axis` of `x` (n, axes) is written, the others are read. `slopes` (n) are
 * those of the output by x there, so that the bound on the error of x is that of the output over the slope, and `errors`
 * (n) as of mbma_cell_answers; NaN where the table has no answer or does not reach the output, as `cells` (n) say, and
 * how many these are. */
size_t mbma_cell_inverse(const mbma_cell_table *table, size_t n, const mbma_cell_inverse_of *of, const double *wanted,
                         double *x, double *slopes, double *errors, int64_t *cells);

/* ---- profile.c: one surface at many gaps ------------------------------------------------------------------------ */

enum { MBMA_PANEL_NODES = 16, MBMA_PANEL_CHECKS = 3, MBMA_PANEL_GAPS = 10, MBMA_PANEL_ROWS = 4 };

/* Of panels of the approach with `count` nodes at places in [0, 1], over which delta rises like place^power. Matrices
 * take values at the nodes, their rows, to those at checks between the nodes, nodes of both halves, nodes of the part
 * below each of `gaps` gaps, and the gaps; and values and slopes at the gaps to a Chebyshev series, by both, or by the
 * slopes and the mean of the values. There are rules for the panel from 0, for others, and for narrow ones. */
typedef struct {
    double power, count, gaps; /* whole numbers */
    double nodes[16], weights[16], reach[11];
    double checks[16][3], halves[16][32], inside[16][176], ends[16][10], series[20][20], integrated[20][20];
} mbma_panel_rule;

/* Islands as they count in sums: weights (rows, size), shift and rate of heights. */
typedef struct {
    int64_t size;
    double *weights, *shift, *rate;
} mbma_nodes;

/* Weights of force and area, shift and rate of heights of a self-affine surface's islands at approaches x = delta/h_rms,
 * (4, n); the worst status, and the largest error of the table. */
int mbma_profile_islands(size_t n, const double *x, double peak, double hurst, double zeta_1,
                         const mbma_variant *variant, const mbma_cells *cells, double *out, double *error);

/* Bounds on the relative error of panels [low, high] by rules `kind` up to the compression `last`. `fields` holds weights
 * of force, area and perhaps number of islands and Hertz area, then shift and rate, (rows + 2, panels, nodes + checks);
 * in the panel from 0 weights lack the power of delta that they begin with. */
void mbma_profile_missed(const mbma_panel_rule *rules, size_t panels, const int64_t *kind, const double *low,
                         const double *high, const double *fields, int rows, double last, double *error);

/* Series of the logarithm of each row's sum over each panel, (panels, rows, 20), and their errors; the islands, and how
 * many lie below each panel and in all. */
void mbma_profile_series(const mbma_panel_rule *rules, size_t panels, const int64_t *kind, const double *low,
                         const double *high, const double *fields, int rows, double *series, double *error,
                         const mbma_nodes *islands, int64_t *stops);

/* The sums at compressions, (rows, n), and with `slopes` their derivatives by it below; NaN beyond the last panel. */
void mbma_profile_totals(size_t n, const double *compression, size_t panels, const double *edges, const double *series,
                         int rows, int slopes, double *out);

/* ---- newton.c: exact islands ------------------------------------------------------------------------------------ */

/* F_n(x) = integral_x^inf (z - x)^n phi(z) dz, phi the standard normal density, of twice_n = 1, 2, 3, 4 or 5. */
size_t mbma_height_integrals(int64_t twice_n, size_t n, const double *x, double *out);

/* Gauss nodes v = (rho/a)^2 on [0, 1], 8 or more, and the half-space in them (37), for vectors of values times
 * `root_weights`: row k of `modes` gives the k-th orthonormal Legendre coefficient, and w = a matrix p. */
typedef struct {
    size_t nodes;
    const double *v, *root_weights, *modes, *matrix;
} mbma_basis;

#define MBMA_ISLANDS_WORK(nodes) ((nodes) * ((nodes) + 9))

/* Newton's method (34)-(37): `phi` (n, 3) receives Phi_F, Phi_A and an estimate of their relative error, which the
 * caller checks, `steps` the steps; profiles (n, nodes) where `rho` is not NULL. `coarse` is the small basis of the
 * first guess, `work` space for MBMA_ISLANDS_WORK numbers. */
size_t mbma_solve_islands(size_t n, const double *X, const double *mu, double rtol, const mbma_basis *fine,
                          const mbma_basis *coarse, double *phi, int64_t *steps, uint8_t *status, double *rho,
                          double *pressure, double *gap, double *work);

/* a^2 of the disc rho < a that holds all but `share` of the area of an island. */
size_t mbma_island_extents(size_t n, const double *X, const double *mu, double share, double *squared);

/* ---- law.c: contact laws ---------------------------------------------------------------------------------------- */

/* A contact law holds one surface's force and area as polynomials of the gap, of which there are three coordinates: the
 * separation d, from h_max at first contact to -h_max; the mean separation u = (h_max + d)/2; and the overclosure
 * c = h_max - u, from 0 at first contact.
 *
 * A law is one block of 8-byte words: head, rows, records. With x = (h_max + s d) scale, s the sign that the head gives
 * for this side of d = 0, the exponent of x picks a row, the row a record, and with t = (x - centre) rate
 *
 *     record number = (bits of x >> shift) + base + kinks passed,    q = -s scale rate,    -dF/dd = q dF/dt,
 *     F = sum_k force[k] t^k,    A = sum_k area[k] t^k,    2 E = energy + sum_k force[k] t^(k+1)/(k+1)/q.
 *
 * Below x = low the first record holds: F is t^power_force times its polynomial, and A likewise.
 */
enum { MBMA_LAW_DEGREE = 8, MBMA_INVERSE_DEGREE = 5 };

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

/* The parts of a block of so many words, which must outlive the law; `head` is NULL where they do not fit together. */
mbma_law mbma_law_open(const void *block, size_t words);

/* One quantity at a separation, or at an overclosure, which keeps its digits next to first contact; NaN outside. */
double mbma_law_at(const mbma_law *law, mbma_quantity what, double d);
double mbma_law_at_overclosure(const mbma_law *law, mbma_quantity what, double c);

/* Force (area) at an overclosure, and its derivative by that. */
double mbma_law_and_slope(const mbma_law *law, mbma_quantity which, double c, double *by_c);

/* The quantities in the order of mbma_quantity, as far as their arrays are not NULL. */
size_t mbma_law_fill(size_t n, const double *d, const mbma_law *law, double *force, double *area, double *stiffness,
                     double *area_slope, double *energy);

/* The overclosure between two at which force (area) has a value, where it rises from one to the other. */
double mbma_law_overclosure(const mbma_law *law, mbma_quantity which, double wanted, double low, double high);

/* The inverse of force or area: guesses of x in four buckets an octave of its value, which bits of the value pick. */
typedef struct {
    double centre, rate, side;
    double x[MBMA_INVERSE_DEGREE + 1];
} mbma_inverse_record;

typedef struct {
    double least, low, high, turn; /* values: the law's least, ends of the buckets, that at d = 0 where s turns */
    int64_t first_bucket;
    double end;                     /* d, where force or area turns down */
    mbma_inverse_record records[1]; /* and more */
} mbma_inverse;

/* x, and s there, at values of force or area, down to the separation `end`: nodes of an inverse that is to be made. */
size_t mbma_inverse_nodes(size_t n, const double *wanted, const mbma_law *law, mbma_quantity which, double end,
                          double *x, double *side);

/* Separations at forces (areas), by an inverse of so many records, with area and stiffness there where their arrays are
 * not NULL. */
size_t mbma_law_invert(size_t n, const double *wanted, const mbma_law *law, const mbma_inverse *inverse, size_t count,
                       mbma_quantity which, double *d, double *area, double *stiffness);

/* Flow coefficient of the gaps at separations: `flow` is a block like that of a law, with the conductance in place of
 * force; bodies farther apart than it reaches are u^3 (1 - 1.5/(u^2/h_rms^2 + 4)). `by_c` may be NULL, or get dK/dc. */
double mbma_law_flow(const mbma_law *flow, double h_max, double h_rms, double d, double *by_c);

/* ---- calibrated.c: the law calibrated on boundary elements, by its table ------------------------------------------ */

/* Quintic B-splines on equally spaced nodes over Hurst exponent, ln zeta_1 and a third axis, which runs fastest. Along
 * each axis there are 5 coefficients more than cells; two more of any value follow the last one. */
typedef struct {
    const float *coefficients;
    size_t cells[3];
    double first[3], rate[3]; /* first node, and nodes in 1 */
    double low[2], high[2];   /* of Hurst exponent and ln zeta_1, between which surfaces are answered */
} mbma_spline;

/* The calibrated law: forces F over A0 E* g with g the rms gradient; mean separations u and other heights over h_rms.
 * `mbma_ended` of elementary.h has how forces end at h_max. */
typedef struct {
    mbma_spline log_force;               /* of a surface without end, over ln u */
    double area_s0, area_slope, area_t0; /* A/A0 = erf(F sqrt(2 (1 + t)/(s0 + t))), t = F/t0; s0 at Nayak's alpha 10 */
} mbma_calibrated_table;

/* Surfaces that entries of calls share, at least one: h_max and two numbers each by mbma_calibrated_ends for the
 * calibrated law alone; pieces by mbma_spline_pieces, or NULL, as where these and slopes are made. */
typedef struct {
    size_t count;
    const double *hurst, *log_zeta_1, *h_max, *ends, *pieces;
} mbma_surfaces;

/* Nayak's alpha of self-affine surfaces, and their rms gradient over q0 h_rms. */
size_t mbma_self_affine(size_t n, const double *hurst, const double *log_zeta_1, double *alpha, double *gradient);

/* Six coefficients for each cell of the third axis and each surface, by which calls give the same bits in less time;
 * worth making from about 40 entries a surface on. */
size_t mbma_spline_pieces(const mbma_spline *spline, const mbma_surfaces *surfaces, double *pieces);

/* s0 of each surface, and ln F at its h_max. */
size_t mbma_calibrated_ends(const mbma_calibrated_table *table, const mbma_surfaces *surfaces, double *ends);

/* Force, area and -dF/du at mean separations; `owner` has the number of each entry's surface, from 0. */
size_t mbma_calibrated_contact(const mbma_calibrated_table *table, const mbma_surfaces *surfaces, size_t n,
                               const int64_t *owner, const double *u, double *force, double *area, double *stiffness);

/* Areas at forces. */
size_t mbma_calibrated_areas(const mbma_calibrated_table *table, const mbma_surfaces *surfaces, size_t n,
                             const int64_t *owner, const double *force, double *area);

/* Mean separations at forces > 0. */
size_t mbma_calibrated_separation(const mbma_calibrated_table *table, const mbma_surfaces *surfaces, size_t n,
                                  const int64_t *owner, const double *force, double *u);

/* Flow through gaps: ln R of the spline over the odds ln A/(threshold A0 - A); A is obstructed as A^obstruction. */
typedef struct {
    mbma_spline log_factor;
    double threshold, obstruction;
} mbma_flow_table;

/* Flow coefficients k = u^3 (1 - 1.5/(u^2 + 4)) R over h_rms^3, and 0 from A/A0 = threshold on, at mean gaps over h_rms and
 * contact fractions; `pieces` of the surfaces may be those of any spectrum. */
size_t mbma_contact_flows(const mbma_flow_table *table, const mbma_surfaces *surfaces, size_t n, const int64_t *owner,
                          const double *u, const double *area, double *flow);

/* Constants of flow, fitted to boundary elements; docs/leakage.md has the equations. */
typedef struct {
    double threshold, obstruction, prefactor, exponent, yielded_threshold, yielded_exponent, yielded_power;
} mbma_flow_law;

/* A/A0 of the elastic contacts that obstruct flow as contacts do of which a share is at its hardness. */
size_t mbma_flow_areas(size_t n, const double *area, const double *yielded, const mbma_flow_law *law,
                       double *elastic);

/* ---- spectrum_laws.c: Persson's theory and the calibrated law of a spectrum --------------------------------------- */

/* A spectrum as a quadrature rule: wavenumbers x rising, over any one, q0; shares of h_rms^2, of sum 1, and of g^2 of
 * wavenumbers below; g over q0 h_rms; Nayak's alpha. F is over A0 E* g, mean separations u and h_max over h_rms. */
typedef struct {
    size_t count;
    const double *x, *variance, *below;
    double gradient, alpha;
} mbma_waves;

/* Area as in the calibrated law's table, s0 = 1 being Persson's; W = a P + b P^3 + (1 - a - b) P^16, a linear in the
 * spectrum's narrowness, b cubic; forces fall by exp(-tail (1 - narrowness) u^3). */
typedef struct {
    double area_s0, area_slope, area_t0, weight, weight_slope, cubic, tail;
} mbma_law_constants;

enum { MBMA_ORDER = 12, MBMA_MOST_PANELS = 120 };

/* A prepared law. */
typedef struct {
    double s0, t0, tail, h_max, end; /* end: ln F at h_max of a surface without end */
    double shift, lightest[2];       /* of ln F; u where panels begin, and its slope */
    uint64_t panels;
    double edge[MBMA_MOST_PANELS + 1], p[MBMA_MOST_PANELS][MBMA_ORDER];
} mbma_spectrum_law;

/* A quadrature rule for power laws between samples: q rising [1/length], a repeated one is a jump; C not negative
 * [length^4], both as in h_rms^2 = 2 pi integral C q dq. Returns the number of wavenumbers, 0 for an invalid spectrum;
 * they are written if `most` suffices, and their reference values to `facts`: g over q0 h_rms, q0 the first q where
 * C is not zero, Nayak's alpha, h_rms [length], g. */
size_t mbma_spectrum_waves(size_t count, const double *q, const double *C, size_t most, double *x, double *variance,
                           double *below, double facts[4]);

/* Prepares the law of a spectrum on surfaces that end at h_max, which may be infinite; `work` has room for three
 * numbers per wavenumber. */
mbma_status mbma_spectrum_law_of(const mbma_waves *waves, const mbma_law_constants *constants, double h_max,
                                 double *work, mbma_spectrum_law *law);

/* Force, area and -dF/du at mean separations. */
size_t mbma_spectrum_law_contact(const mbma_spectrum_law *law, size_t n, const double *u, double *force, double *area,
                                 double *stiffness);

/* Mean separations at forces > 0, 0 at forces that leave none, and du/d ln F of the solution; without `whole` of
 * a surface without end, before the tail's factor. */
size_t mbma_spectrum_law_separation(const mbma_spectrum_law *law, size_t n, const double *force, int whole, double *u,
                                    double *slope);

/* ---- yielding.c: contact whose pressure cannot exceed a hardness ----------------------------------------------------- */

/* Constants fitted to boundary elements; docs/yield.md has the equations. Powers and scales of the contact area and of
 * its yielded part; exponent of the force; stiffness of the frozen contact; flattening of yielded points. */
typedef struct {
    double area_power, area_scale, yield_power, yield_scale, force_light, force_eta, force_share, frozen, frozen_eta,
        plane_eta, plane_load;
} mbma_hardness_law;

/* Levels of Gaussian heights at mean gaps below them, over h_rms. */
size_t mbma_gaussian_levels(size_t n, const double *u, double *level);

/* Shares of Gaussian heights above the levels of mean gaps, and their derivatives by the gap; heights end at `last`, which
 * may be infinite. */
size_t mbma_bearing_shares(size_t n, const double *u, const double *last, double *share, double *slope);

/* Shares of a diffusion from x between walls at 0 and 1, after a variance of 2 tau: not absorbed at 0, or with a negative
 * sign absorbed at 1. */
size_t mbma_diffused(size_t n, const double *x, const double *tau, double sign, double *share);

/* Forces over A0 E* g and their -d/du, with eta = p_m/(E* g), from the elastic ones at the same mean gap, the share of
 * heights above its level and the derivative of that. */
size_t mbma_yielding_forces(size_t n, const double *elastic, const double *stiffness, const double *share,
                            const double *slope, const double *eta, const mbma_hardness_law *law, double *force,
                            double *steep);

/* The same of Gaussian heights that end at `last`, at mean gaps u. */
size_t mbma_yielding_at_gaps(size_t n, const double *elastic, const double *stiffness, const double *u,
                             const double *last, const double *eta, const mbma_hardness_law *law, double *force,
                             double *steep);

/* A/A0, or its yielded part, at forces, from the elastic areas at these; above 1 only where those are. */
size_t mbma_yielding_areas(size_t n, const double *force, const double *elastic_area, const double *eta,
                           const mbma_hardness_law *law, int yielded, double *area);

/* Stiffness of the contact frozen as it is, by which it unloads first, over the elastic -dF/du at the same mean gap. */
size_t mbma_frozen_factors(size_t n, const double *eta, const mbma_hardness_law *law, double *factor);

/* kappa, normal over tangential stiffness before slip, (1 - nu c)/(1 - nu), of Poisson's ratio and c, which is 1/2 of
 * isotropic surfaces; and tangential stiffness from that of a small unloading. */
size_t mbma_tangential_ratios(size_t n, const double *nu, const double *share, double *kappa);
size_t mbma_tangential_stiffnesses(size_t n, const double *stiffness, const double *kappa, double *tangential);

/* Conductance of solid spots, from the stiffness of a small unloading, the mean conductivity and E*. */
size_t mbma_solid_conductances(size_t n, const double *stiffness, const double *k_s, const double *E_star,
                               double *conductance);

/* Gaps between mean planes at mean gaps and loads F/(p_m A0), over h_rms: less the flattening of yielded points. */
size_t mbma_yielding_planes(size_t n, const double *u, const double *load, const double *eta,
                            const mbma_hardness_law *law, double *gap);

/* A contact below the largest pressure p0 that it was under, at s = p/p0: elastic unloading of flattened spots with a weight
 * w, and of the surface without yielding; docs/yield.md has the equations. w, a and b depend on the yielded share of the
 * contact at p0 and on its area, A/A0, which counts between `least_area` and `most_area`. */
typedef struct {
    double weight, power, power_elastic, power_area, exponent, exponent_elastic, exponent_area, area, least_area,
        most_area;
} mbma_spots_law;

size_t mbma_flat_spots(size_t n, const double *yielded, const double *area, const mbma_spots_law *law, double *weight,
                       double *power, double *exponent);

/* Energy that unloading of flattened spots from s gives back, over p0^2/K0: the integral of s over [1 - (1-s)^a]^b from 0,
 * a = power > 0 and 0 <= b = exponent < 1. */
size_t mbma_flat_energies(size_t n, const double *s, const double *power, const double *exponent, double *energy);

/* Stiffness and area over those at p0, by the elastic ones at the same pressures over those at p0. */
size_t mbma_unloaded_stiffnesses(size_t n, const double *s, const double *elastic, const double *weight,
                                 const double *power, const double *exponent, double *ratio);
size_t mbma_unloaded_areas(size_t n, const double *s, const double *elastic, const double *weight, const double *power,
                           const double *exponent, double *ratio);

/* Mean gaps less that at p0, by `elastic`, that difference of the elastic contact times its stiffness at p0 over that of
 * unloading there, and `depth`, p0 over the latter. */
size_t mbma_unloaded_gaps(size_t n, const double *s, const double *elastic, const double *depth, const double *weight,
                          const double *power, const double *exponent, double *raised);

/* Flow coefficients over h_rms^3 at mean gaps u, `raised` above those under the largest pressure, where the coefficients
 * were `before`: the aperture opens as `opening` times the mean gap. NaN where flow was blocked. */
size_t mbma_unloaded_flows(size_t n, const double *before, const double *raised, const double *u, double opening,
                           double *flow);

#ifdef __cplusplus
}
#endif

#endif
