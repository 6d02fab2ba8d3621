/* The core's functions as a table of their arguments, for `binding.c` and for tests without Python.
 *
 * Sizes of arrays are checked here, and once a call whatever the loops use as a number of a node, a cell or a record
 * without a check of their own. Of all other values, NaN and infinities included, the core makes results or a status.
 */
#ifndef MBMA_CALLS_H
#define MBMA_CALLS_H

#include "elementary.h"
#include "mbma.h"

enum { MOST_ARGUMENTS = 24 };

/* An argument: a number, or the items of an array; `data` is NULL where None was given. */
typedef struct {
    double d;
    int64_t i;
    void *data;
    size_t n;
} argument;

/* Of an argument its items, how many, a double, a whole number; how many doubles a structure has. */
#define P(k) a[k].data
#define N(k) a[k].n
#define X(k) a[k].d
#define I(k) a[k].i
#define WORDS(type) (sizeof(type) / sizeof(double))

/* Elementary functions of an array, for their test against mpmath. */
static size_t elementary(int64_t which, size_t n, const double *x, double *out) {
    for (size_t k = 0; k < n; k++)
        out[k] = which == 0 ? mbma_exp(x[k]) : which == 1 ? mbma_expm1(x[k]) : which == 2 ? mbma_log(x[k])
                 : which == 3 ? mbma_log1p(x[k]) : mbma_erf(x[k]);
    return 0;
}

/* A sum of no more than two such numbers does not overflow. */
#define MODEST (INT64_C(1) << 62)
static bool is_modest(int64_t number) { return -MODEST < number && number < MODEST; }

/* The universal table from three arrays: cells, places, and X_low, X_high, X_rate, mu_high, first_bucket, buckets.
 * Whether every strip of X in the range has a place, from which on there is one for each bucket of mu, and whether
 * these are numbers of cells. */
static bool is_table(const argument *a) {
    const double *const n = P(2), strips = (n[1] - n[0]) * n[2];
    const int32_t *const places = P(1);
    const size_t count = N(1) < INT32_MAX ? N(1) : INT32_MAX, cells = N(0) / WORDS(mbma_cell);
    /* not so if one of them is NaN */
    if (!(fabs(n[0]) < INFINITY && n[2] > 0.0 && strips >= 0.0 && strips < (double)count && fabs(n[4]) < 65536.0 &&
          n[5] >= 1.0 && n[5] < (double)count))
        return false;
    const size_t starts = (size_t)strips + 1, buckets = (size_t)n[5];
    if (starts + buckets > count)
        return false;
    const uint32_t begin = (uint32_t)starts, room = (uint32_t)(count - buckets - starts);
    const uint32_t last = (uint32_t)(cells < INT32_MAX ? cells : INT32_MAX);
    /* without a branch, so that this is vectorised; negative places are large ones here */
    uint32_t wrong = 0;
    for (size_t k = 0; k < starts; k++)
        wrong |= (uint32_t)((uint32_t)places[k] - begin > room);
    for (size_t k = starts; k < count; k++)
        wrong |= (uint32_t)((uint32_t)places[k] >= last);
    return wrong == 0;
}
static mbma_cells cells_of(const argument *a) {
    const double *const n = P(2);
    return (mbma_cells){P(0), P(1), n[0], n[1], n[2], n[3], (int64_t)n[4], (int64_t)n[5]};
}
#define CELLS(k) ((const mbma_cells[]){cells_of(a + (k))})

/* From density_divisor, beta, phi, floor_d, floor_u, offset, summit_sigma, printed. */
static mbma_variant variant_of(const argument *a) {
    const double *const n = a->data;
    return (mbma_variant){n[0], n[1], n[2], n[3], n[4], n[5] != 0.0, n[6] != 0.0, n[7] != 0.0};
}
#define VARIANT(k) ((const mbma_variant[]){variant_of(a + (k))})

enum { PLACES = MBMA_PANEL_NODES + MBMA_PANEL_CHECKS, SERIES_TERMS = 2 * MBMA_PANEL_GAPS };

enum { RULES = 3 };

/* The rules as one array, kinds, low and high ends and fields of panels, and how many rows these have. */
static bool are_panels(const argument *a) {
    const size_t panels = N(1);
    const mbma_panel_rule *const rules = P(0);
    const uint64_t *const kinds = P(1);
    if (N(0) != RULES * WORDS(mbma_panel_rule) || I(5) < 2 || I(5) > MBMA_PANEL_ROWS ||
        N(4) != (size_t)(I(5) + 2) * panels * PLACES)
        return false;
    /* the error of a series is estimated from its last four terms */
    const double most_nodes = MBMA_PANEL_NODES, most_gaps = MBMA_PANEL_GAPS;
    for (int k = 0; k < RULES; k++)
        if (!(rules[k].count >= 1.0 && rules[k].count <= most_nodes && rules[k].gaps >= 2.0 &&
              rules[k].gaps <= most_gaps))
            return false;
    for (size_t k = 0; k < panels; k++)
        if (kinds[k] >= RULES)
            return false;
    return true;
}
#define NODES(k) ((const mbma_nodes[]){{(int64_t)N((k) + 1), P(k), P((k) + 1), P((k) + 2)}})

#define BASIS(k) ((const mbma_basis[]){{N(k), P(k), P((k) + 1), P((k) + 2), P((k) + 3)}})
#define LAW(k) ((const mbma_law[]){mbma_law_open(P(k), N(k))})
/* Whether a block is that of a law, in which numbers of records are held between the first and the last one. */
static bool is_law(const argument *a) {
    const mbma_law law = mbma_law_open(a->data, a->n);
    if (law.head == NULL)
        return false;
    const size_t rows = ((size_t)law.head->first_word - WORDS(mbma_law_head)) / WORDS(mbma_law_row);
    bool modest = true;
    for (size_t k = 0; k < rows; k++)
        modest = modest && is_modest(law.rows[k].base);
    return modest;
}
/* Whether a whole number is that of a quantity that has an inverse. */
static bool has_inverse(int64_t which) { return which == MBMA_FORCE || which == MBMA_AREA; }
/* Records of an inverse, of whose words the first ones are its head. */
#define GUESSES(k) ((N(k) - WORDS(mbma_inverse)) / WORDS(mbma_inverse_record) + 1)
static bool is_inverse(const argument *a) {
    return a->n >= WORDS(mbma_inverse) && (a->n - WORDS(mbma_inverse)) % WORDS(mbma_inverse_record) == 0 &&
           is_modest(((const mbma_inverse *)a->data)->first_bucket);
}

/* First in all calls: coefficients; first nodes, rates, ends of the range, three constants; cells; of surfaces
 * Hurst exponents and ln zeta_1. Then their h_max, ends and pieces, or None. */
#define SPLINE "F D13 L3 Dn Dn "
static bool fits_spline(const argument *a) {
    const int64_t *const c = P(2);
    for (int k = 0; k < 3; k++)
        if (c[k] < 1 || c[k] > 100000)
            return false;
    const size_t coefficients = (size_t)(c[0] + 5) * (size_t)(c[1] + 5) * (size_t)(c[2] + 5) + 2;
    return P(7) ? N(7) == N(3) * 6 * (size_t)c[2] : N(0) >= coefficients;
}
static mbma_spline spline_of(const argument *a) {
    const int64_t *const c = P(2);
    const double *const x = P(1);
    return (mbma_spline){P(0), {(size_t)c[0], (size_t)c[1], (size_t)c[2]}, {x[0], x[1], x[2]}, {x[3], x[4], x[5]},
                         {x[6], x[8]}, {x[7], x[9]}};
}
#define CONSTANT(k) ((const double *)P(1))[10 + (k)]
#define LOG_FORCE ((const mbma_spline[]){spline_of(a)})
#define CALIBRATED ((const mbma_calibrated_table[]){{spline_of(a), CONSTANT(0), CONSTANT(1), CONSTANT(2)}})
#define SURFACES ((const mbma_surfaces[]){{N(3), P(3), P(4), P(5), P(6), P(7)}})

/* Of a law: gradient and alpha, seven constants and h_max. */
#define WAVES ((const mbma_waves[]){{N(0), P(0), P(1), P(2), NUMBER(0), NUMBER(1)}})
#define NUMBER(k) ((const double *)P(3))[k]
#define CONSTANTS \
    ((const mbma_law_constants[]){{NUMBER(2), NUMBER(3), NUMBER(4), NUMBER(5), NUMBER(6), NUMBER(7), NUMBER(8)}})

/* Every function: its name, the kinds of its arguments, what else their sizes must be, and the call. */
#define FUNCTIONS(FN) \
    /* elementary.h */ \
    FN(elementary, "i Dn wn", true, elementary(I(0), N(1), P(1), P(2))) \
    /* totals.c */ \
    FN(phi, "Dn Dn D J D6 w3n b?n", is_table(&a[2]), mbma_phi(N(0), P(0), P(1), CELLS(2), P(5), P(6))) \
    FN(totals, "Dn Dn Dn Dn d D8 D J D6 w4n wn bn l1", is_table(&a[6]), \
       mbma_totals(N(0), P(0), P(1), P(2), P(3), X(4), VARIANT(5), CELLS(6), P(9), P(10), P(11), P(12))) \
    FN(island_geometry, "d d d D8 w", N(4) == WORDS(mbma_island), \
       mbma_island_geometry(X(0), X(1), X(2), VARIANT(3), P(4))) \
    /* profile.c */ \
    FN(profile_islands, "Dn d d d D8 D J D6 w4n w1", is_table(&a[5]), \
       mbma_profile_islands(N(0), P(0), X(1), X(2), X(3), VARIANT(4), CELLS(5), P(8), P(9))) \
    FN(profile_missed, "D Ln Dn Dn D i d wn", are_panels(a), \
       (mbma_profile_missed(P(0), N(1), P(1), P(2), P(3), P(4), (int)I(5), X(6), P(7)), 0)) \
    FN(profile_series, "D Ln Dn Dn D i w wn w wm wm l", \
       are_panels(a) && N(6) == N(1) * (size_t)I(5) * SERIES_TERMS && N(9) == N(1) * MBMA_PANEL_NODES && \
       N(8) == (size_t)I(5) * N(9) && N(11) == N(1) + 1, \
       (mbma_profile_series(P(0), N(1), P(1), P(2), P(3), P(4), (int)I(5), P(6), P(7), NODES(8), P(11)), 0)) \
    FN(profile_totals, "D D D i i w", \
       N(1) > 1 && I(3) > 0 && I(3) <= MBMA_PANEL_ROWS && N(2) == (N(1) - 1) * (size_t)I(3) * SERIES_TERMS && \
       N(5) == N(0) * (size_t)I(3) * (I(4) ? 2 : 1), \
       (mbma_profile_totals(N(0), P(0), N(1) - 1, P(1), P(2), (int)I(3), I(4) != 0, P(5)), 0)) \
    /* newton.c */ \
    FN(height_integrals, "i Dn wn", true, mbma_height_integrals(I(0), N(1), P(1), P(2))) \
    FN(islands_work, "i", I(0) >= 0 && I(0) < 1 << 20, MBMA_ISLANDS_WORK(I(0))) \
    FN(solve_islands, "Dn Dn d Dk Dk Dkk Dkk Dm Dm Dmm Dmm w3n ln bn w?nk w?nk w?nk w", \
       N(15) == N(14) && N(16) == N(14) && N(17) >= MBMA_ISLANDS_WORK(N(3)), \
       mbma_solve_islands(N(0), P(0), P(1), X(2), BASIS(3), BASIS(7), P(11), P(12), P(13), P(14), P(15), P(16), \
                          P(17))) \
    FN(island_extents, "Dn Dn d wn", true, mbma_island_extents(N(0), P(0), P(1), X(2), P(3))) \
    /* law.c */ \
    FN(law_fill, "Dn D w?n w?n w?n w?n w?n", is_law(&a[1]), \
       mbma_law_fill(N(0), P(0), LAW(1), P(2), P(3), P(4), P(5), P(6))) \
    FN(inverse_nodes, "Dn D i d wn wn", is_law(&a[1]) && has_inverse(I(2)), \
       mbma_inverse_nodes(N(0), P(0), LAW(1), (mbma_quantity)I(2), X(3), P(4), P(5))) \
    FN(law_invert, "Dn D D i wn w?n w?n", is_law(&a[1]) && is_inverse(&a[2]) && has_inverse(I(3)), \
       mbma_law_invert(N(0), P(0), LAW(1), P(2), GUESSES(2), (mbma_quantity)I(3), P(4), P(5), P(6))) \
    /* calibrated.c */ \
    FN(spline_pieces, SPLINE "D D D w", fits_spline(a) && !P(7) && N(8) == N(3) * 6 * (size_t)((int64_t *)P(2))[2], \
       mbma_spline_pieces(LOG_FORCE, SURFACES, P(8))) \
    FN(calibrated_ends, SPLINE "Dn D D w2n", fits_spline(a), mbma_calibrated_ends(CALIBRATED, SURFACES, P(8))) \
    FN(calibrated_contact, SPLINE "Dn D2n D Lm Dm wm wm wm", fits_spline(a) && N(3) > 0, \
       mbma_calibrated_contact(CALIBRATED, SURFACES, N(8), P(8), P(9), P(10), P(11), P(12))) \
    FN(calibrated_separation, SPLINE "Dn D2n D Lm Dm wm", fits_spline(a) && N(3) > 0, \
       mbma_calibrated_separation(CALIBRATED, SURFACES, N(8), P(8), P(9), P(10))) \
    FN(spline_values, SPLINE "D D D Lm Dm wm wm", fits_spline(a) && N(3) > 0, \
       mbma_spline_values(LOG_FORCE, SURFACES, N(8), P(8), P(9), P(10), P(11))) \
    FN(self_affine, "Dn Dn wn wn", true, mbma_self_affine(N(0), P(0), P(1), P(2), P(3))) \
    /* spectrum_laws.c */ \
    FN(words_of_spectrum_law, "", true, WORDS(mbma_spectrum_law)) \
    FN(spectrum_waves, "Dn Dn wm wm wm w4", true, mbma_spectrum_waves(N(0), P(0), P(1), N(2), P(2), P(3), P(4), P(5))) \
    FN(spectrum_law_of, "Dn Dn Dn D10 w3n w", N(5) == WORDS(mbma_spectrum_law), \
       mbma_spectrum_law_of(WAVES, CONSTANTS, NUMBER(9), P(4), P(5))) \
    FN(spectrum_law_contact, "D Dn wn wn wn", N(0) == WORDS(mbma_spectrum_law), \
       mbma_spectrum_law_contact(P(0), N(1), P(1), P(2), P(3), P(4))) \
    FN(spectrum_law_separation, "D Dn i wn wn", N(0) == WORDS(mbma_spectrum_law), \
       mbma_spectrum_law_separation(P(0), N(1), P(1), I(2) != 0, P(3), P(4)))

/* A function of arguments: whether their sizes fit, and the result. */
#define DEFINE_CALL(name, kinds, fits, call) \
    static bool do_##name(const argument *a, long long *found) { \
        (void)a; \
        return (fits) && (*found = (long long)(call), true); \
    }
FUNCTIONS(DEFINE_CALL)

#endif
