/* The core's functions as functions of a list of arguments, for `binding.c` and for tests without
 * Python.
 *
 * Sizes of arrays are checked here, and once a call whatever the loops use as a number of a node, a
 * cell or a record without a check of their own. Of all other values, NaN and infinities included,
 * the core makes results or a status.
 */
#ifndef MBMA_CALLS_H
#define MBMA_CALLS_H

#include "elementary.h"
#include "mbma.h"
#include "spectra.h"

enum { MOST_ARGUMENTS = 24 };

/* An argument: a number, or the items of an array; `items` is NULL where None was given. */
typedef struct {
    double real;
    int64_t whole;
    void *items;
    size_t count;
} argument;

/* How many doubles a structure has. */
#define WORDS(type) (sizeof(type) / sizeof(double))

/* A sum of no more than two such numbers does not overflow. */
#define MODEST (INT64_C(1) << 62)
static bool is_modest(int64_t number) { return -MODEST < number && number < MODEST; }

/* ---- elementary.h ---- */

enum { ELEMENTARY_EXP, ELEMENTARY_EXPM1, ELEMENTARY_LOG, ELEMENTARY_LOG1P, ELEMENTARY_ERF };

static double elementary_at(int64_t which, double x) {
    switch (which) {
    case ELEMENTARY_EXP:
        return mbma_exp(x);
    case ELEMENTARY_EXPM1:
        return mbma_expm1(x);
    case ELEMENTARY_LOG:
        return mbma_log(x);
    case ELEMENTARY_LOG1P:
        return mbma_log1p(x);
    default:
        return mbma_erf(x);
    }
}

/* Elementary functions of an array, for their test against mpmath. */
static bool do_elementary(const argument *a, long long *answer) {
    enum { WHICH, X, VALUES };
    const double *const x = a[X].items;
    double *const values = a[VALUES].items;
    for (size_t k = 0; k < a[X].count; k++)
        values[k] = elementary_at(a[WHICH].whole, x[k]);
    *answer = 0;
    return true;
}

/* ---- totals.c ---- */

/* The universal table is three arguments. */
enum { TABLE_CELLS, TABLE_PLACES, TABLE_NUMBERS, TABLE_ARGUMENTS };
#define TABLE "D J D6 "

/* The third of them. */
typedef struct {
    double X_low, X_high, X_rate, mu_high, first_bucket, buckets;
} table_numbers;

/* A bucket of mu is the number that its leading 15 bits make (`BUCKET_BITS` of phi.h). */
static const double BUCKETS_OF_ALL_FLOATS = 65536.0;

/* Whether every strip of X in the range has a place, from which on there is one for each bucket of
 * mu, and whether these are numbers of cells. */
static bool is_table(const argument *table) {
    const table_numbers *const numbers = table[TABLE_NUMBERS].items;
    const int32_t *const places = table[TABLE_PLACES].items;
    const size_t all_places = table[TABLE_PLACES].count;
    const size_t count = all_places < INT32_MAX ? all_places : INT32_MAX;
    const size_t cells = table[TABLE_CELLS].count / WORDS(mbma_cell);
    const double strips = (numbers->X_high - numbers->X_low) * numbers->X_rate;
    /* false if one of them is NaN */
    const bool strips_fit = fabs(numbers->X_low) < INFINITY && numbers->X_rate > 0.0 &&
                            strips >= 0.0 && strips < (double)count;
    const bool buckets_fit = fabs(numbers->first_bucket) < BUCKETS_OF_ALL_FLOATS &&
                             numbers->buckets >= 1.0 && numbers->buckets < (double)count;
    if (!strips_fit || !buckets_fit)
        return false;

    /* first are the places where the buckets of each strip begin, then the cells of all buckets */
    const size_t starts = (size_t)strips + 1;
    const size_t buckets = (size_t)numbers->buckets;
    if (starts + buckets > count)
        return false;
    const uint32_t first_start = (uint32_t)starts;
    const uint32_t room_for_starts = (uint32_t)(count - buckets - starts);
    const uint32_t cell_count = (uint32_t)(cells < INT32_MAX ? cells : INT32_MAX);

    /* without a branch, so that this is vectorised; negative places are large ones here */
    uint32_t wrong = 0;
    for (size_t k = 0; k < starts; k++)
        wrong |= (uint32_t)((uint32_t)places[k] - first_start > room_for_starts);
    for (size_t k = starts; k < count; k++)
        wrong |= (uint32_t)((uint32_t)places[k] >= cell_count);
    return wrong == 0;
}

static mbma_cells cells_of(const argument *table) {
    const table_numbers *const numbers = table[TABLE_NUMBERS].items;
    return (mbma_cells){
        .cells = table[TABLE_CELLS].items,
        .places = table[TABLE_PLACES].items,
        .X_low = numbers->X_low,
        .X_high = numbers->X_high,
        .X_rate = numbers->X_rate,
        .mu_high = numbers->mu_high,
        .first_bucket = (int64_t)numbers->first_bucket,
        .buckets = (int64_t)numbers->buckets,
    };
}

/* A variant as an argument. */
typedef struct {
    double density_divisor, beta, phi, floor_d, floor_u, offset, summit_sigma, printed;
} variant_numbers;

static mbma_variant variant_of(const argument *a) {
    const variant_numbers *const numbers = a->items;
    return (mbma_variant){
        .density_divisor = numbers->density_divisor,
        .beta = numbers->beta,
        .phi = numbers->phi,
        .floor_d = numbers->floor_d,
        .floor_u = numbers->floor_u,
        .offset = numbers->offset != 0.0,
        .summit_sigma = numbers->summit_sigma != 0.0,
        .printed = numbers->printed != 0.0,
    };
}

static bool do_phi(const argument *a, long long *answer) {
    enum { X, MU, TABLE_AT, ROWS = TABLE_AT + TABLE_ARGUMENTS, STATUS };
    if (!is_table(&a[TABLE_AT]))
        return false;
    const mbma_cells cells = cells_of(&a[TABLE_AT]);
    *answer = (long long)mbma_phi(a[X].count, a[X].items, a[MU].items, &cells, a[ROWS].items,
                                  a[STATUS].items);
    return true;
}

static bool do_totals(const argument *a, long long *answer) {
    enum { HURST, ZETA_1, COMPRESSION, PEAK, RTOL, VARIANT, TABLE_AT };
    enum { TOTALS = TABLE_AT + TABLE_ARGUMENTS, ERROR, STATUS, ISLANDS };
    if (!is_table(&a[TABLE_AT]))
        return false;
    const mbma_variant variant = variant_of(&a[VARIANT]);
    const mbma_cells cells = cells_of(&a[TABLE_AT]);
    *answer = (long long)mbma_totals(a[HURST].count, a[HURST].items, a[ZETA_1].items,
                                     a[COMPRESSION].items, a[PEAK].items, a[RTOL].real, &variant,
                                     &cells, a[TOTALS].items, a[ERROR].items, a[STATUS].items,
                                     a[ISLANDS].items);
    return true;
}

static bool do_covered_areas(const argument *a, long long *answer) {
    enum { SUM, AREA };
    *answer = (long long)mbma_covered_areas(a[SUM].count, a[SUM].items, a[AREA].items);
    return true;
}

static bool do_island_geometry(const argument *a, long long *answer) {
    enum { APPROACH, HURST, ZETA_1, VARIANT, ISLAND };
    if (a[ISLAND].count != WORDS(mbma_island))
        return false;
    const mbma_variant variant = variant_of(&a[VARIANT]);
    *answer = mbma_island_geometry(a[APPROACH].real, a[HURST].real, a[ZETA_1].real, &variant,
                                   a[ISLAND].items);
    return true;
}

/* ---- island4d.c ---- */

/* A table of islands by four numbers is five arguments. */
enum { ISLAND_COEFFICIENTS, ISLAND_ERRORS, ISLAND_CELLS, ISLAND_NUMBERS, ISLAND_VARIANT };
enum { ISLAND_TABLE_ARGUMENTS = ISLAND_VARIANT + 1, ISLAND_AXES = 4 };
#define ISLAND_TABLE "F F L4 D17 D8 "

/* The fourth of them, by axis. */
typedef struct {
    double first[ISLAND_AXES], rate[ISLAND_AXES], low[ISLAND_AXES], high[ISLAND_AXES], offset;
} island_table_numbers;

/* Cells of an axis, of which the product of four does not overflow. */
enum { MOST_ISLAND_CELLS = 10000 };

static bool is_island_table(const argument *table) {
    const int64_t *const cells = table[ISLAND_CELLS].items;
    /* along each axis 5 more than cells, of two functions */
    size_t coefficients = 2, errors = 1;
    for (int axis = 0; axis < ISLAND_AXES; axis++) {
        if (cells[axis] < 1 || cells[axis] > MOST_ISLAND_CELLS)
            return false;
        coefficients *= (size_t)(cells[axis] + 5);
        errors *= (size_t)cells[axis];
    }
    return table[ISLAND_COEFFICIENTS].count == coefficients && table[ISLAND_ERRORS].count == errors;
}

static mbma_island_table island_table_of(const argument *table) {
    const int64_t *const cells = table[ISLAND_CELLS].items;
    const island_table_numbers *const numbers = table[ISLAND_NUMBERS].items;
    mbma_island_table found = {
        .coefficients = table[ISLAND_COEFFICIENTS].items,
        .errors = table[ISLAND_ERRORS].items,
        .offset = numbers->offset,
        .variant = variant_of(&table[ISLAND_VARIANT]),
    };
    for (int axis = 0; axis < ISLAND_AXES; axis++) {
        found.cells[axis] = (size_t)cells[axis];
        found.first[axis] = numbers->first[axis];
        found.rate[axis] = numbers->rate[axis];
        found.low[axis] = numbers->low[axis];
        found.high[axis] = numbers->high[axis];
    }
    return found;
}

static bool do_island_bands(const argument *a, long long *answer) {
    enum { SPREAD, SPHERE, HURST, VARIANT, MU, SIGMA, FORCE, AREA };
    const mbma_variant variant = variant_of(&a[VARIANT]);
    *answer = (long long)mbma_island_bands(a[SPREAD].count, a[SPREAD].items, a[SPHERE].items,
                                           a[HURST].items, &variant, a[MU].items, a[SIGMA].items,
                                           a[FORCE].items, a[AREA].items);
    return true;
}

static bool do_island_places(const argument *a, long long *answer) {
    enum { APPROACH, ZETA_D, ZETA_U, HURST, VARIANT, X, SPREAD, SPHERE, MU, SIGMA, FORCE, AREA };
    const mbma_variant variant = variant_of(&a[VARIANT]);
    *answer = (long long)mbma_island_places(a[APPROACH].count, a[APPROACH].items, a[ZETA_D].items,
                                            a[ZETA_U].items, a[HURST].items, &variant, a[X].items,
                                            a[SPREAD].items, a[SPHERE].items, a[MU].items,
                                            a[SIGMA].items, a[FORCE].items, a[AREA].items);
    return true;
}

static bool do_island_answers(const argument *a, long long *answer) {
    enum { X, SPREAD, SPHERE, HURST, MU, TABLE_AT };
    enum { PHI_F = TABLE_AT + ISLAND_TABLE_ARGUMENTS, PHI_A, ERROR };
    if (!is_island_table(&a[TABLE_AT]))
        return false;
    const mbma_island_table table = island_table_of(&a[TABLE_AT]);
    *answer = (long long)mbma_island_answers(a[X].count, a[X].items, a[SPREAD].items,
                                             a[SPHERE].items, a[HURST].items, a[MU].items, &table,
                                             a[PHI_F].items, a[PHI_A].items, a[ERROR].items);
    return true;
}

static bool do_island_totals(const argument *a, long long *answer) {
    enum { HURST, ZETA_1, COMPRESSION, PEAK, RTOL, VARIANT, TABLE_AT };
    enum { TOTALS = TABLE_AT + ISLAND_TABLE_ARGUMENTS, ERROR, STATUS, ISLANDS };
    if (!is_island_table(&a[TABLE_AT]))
        return false;
    const mbma_variant variant = variant_of(&a[VARIANT]);
    const mbma_island_table table = island_table_of(&a[TABLE_AT]);
    *answer = (long long)mbma_island_totals(a[HURST].count, a[HURST].items, a[ZETA_1].items,
                                            a[COMPRESSION].items, a[PEAK].items, a[RTOL].real,
                                            &variant, &table, mbma_island_answers, a[TOTALS].items,
                                            a[ERROR].items, a[STATUS].items, a[ISLANDS].items);
    return true;
}

/* ---- cells.c ---- */

/* Whether coefficients end with those of the last cell. */
static bool coefficients_end(size_t count, size_t cells, size_t axes, size_t outputs,
                             const int64_t *starts, const int32_t *terms) {
    if (cells == 0)
        return count == 0;
    size_t size = outputs;
    for (size_t k = 0; k < axes; k++) {
        const int32_t of_axis = terms[(cells - 1) * axes + k];
        if (of_axis < 1 || of_axis > MBMA_MAX_TERMS)
            return false;
        size *= (size_t)of_axis;
    }
    const int64_t start = starts[cells - 1];
    return start >= 0 && (size_t)start <= count && count - (size_t)start == size;
}

/* The first arguments of functions of a table: its axes, outputs, tree and polynomials. */
enum { CELL_AXES, CELL_EXPONENTIAL, CELL_BRANCHES, CELL_MIDDLES, CELL_STARTS, CELL_TERMS };
enum { CELL_COEFFICIENTS = CELL_TERMS + 1, CELL_BOUNDS, CELL_X };
#define CELL_TABLE "D J J D L J D D "

/* The table of these arguments, whose axes are written to `axis`; false where they do not fit together. */
static bool is_cell_table(const argument *a, mbma_axis *axis, mbma_cell_table *table) {
    enum { AXIS_NUMBERS = 7, LOW = 0, HIGH, OFFSET, FIRST, LAST, IS_LOG, OUTSIDE };
    const size_t axes = a[CELL_AXES].count / AXIS_NUMBERS, outputs = a[CELL_EXPONENTIAL].count;
    const size_t cells = a[CELL_STARTS].count;
    if (axes < 1 || axes > MBMA_MAX_AXES || a[CELL_AXES].count != axes * AXIS_NUMBERS ||
        outputs < 1)
        return false;
    if (a[CELL_BRANCHES].count != 2 * a[CELL_MIDDLES].count ||
        a[CELL_TERMS].count != cells * axes || a[CELL_BOUNDS].count != cells * outputs)
        return false;
    if (!coefficients_end(a[CELL_COEFFICIENTS].count, cells, axes, outputs, a[CELL_STARTS].items,
                          a[CELL_TERMS].items))
        return false;
    const double *const numbers = a[CELL_AXES].items;
    for (size_t k = 0; k < axes; k++) {
        const double *const of_axis = numbers + k * AXIS_NUMBERS;
        axis[k] = (mbma_axis){
            .low = of_axis[LOW],
            .high = of_axis[HIGH],
            .offset = of_axis[OFFSET],
            .first = of_axis[FIRST],
            .last = of_axis[LAST],
            .is_log = of_axis[IS_LOG] == 1.0,
            .outside = of_axis[OUTSIDE] == 1.0   ? MBMA_NEAREST
                       : of_axis[OUTSIDE] == 2.0 ? MBMA_PERIODIC
                                                 : MBMA_REFUSED,
        };
    }
    *table = (mbma_cell_table){
        .axes = axes,
        .outputs = outputs,
        .boxes = a[CELL_MIDDLES].count,
        .cells = cells,
        .coefficient_count = a[CELL_COEFFICIENTS].count,
        .axis = axis,
        .is_exponential = a[CELL_EXPONENTIAL].items,
        .branches = a[CELL_BRANCHES].items,
        .terms = a[CELL_TERMS].items,
        .starts = a[CELL_STARTS].items,
        .middles = a[CELL_MIDDLES].items,
        .coefficients = a[CELL_COEFFICIENTS].items,
        .errors = a[CELL_BOUNDS].items,
    };
    return true;
}

static bool do_cell_answers(const argument *a, long long *answer) {
    enum { VALUES = CELL_X + 1, WITH_SLOPES, SLOPES, ERRORS, CELLS };
    mbma_axis axis[MBMA_MAX_AXES];
    mbma_cell_table table;
    if (!is_cell_table(a, axis, &table))
        return false;
    const size_t n = a[CELL_X].count / table.axes, values = n * table.outputs;
    if (a[CELL_X].count != n * table.axes || a[VALUES].count != values ||
        a[ERRORS].count != values || a[CELLS].count != n)
        return false;
    const bool slopes = a[WITH_SLOPES].whole != 0;
    if (a[SLOPES].count != (slopes ? values * table.axes : 0))
        return false;
    *answer = (long long)mbma_cell_answers(&table, n, a[CELL_X].items, a[VALUES].items,
                                           slopes ? a[SLOPES].items : NULL, a[ERRORS].items,
                                           a[CELLS].items);
    return true;
}

static bool do_cell_inverse(const argument *a, long long *answer) {
    enum { OUTPUT = CELL_BOUNDS + 1, AXIS, RISES, GUESS, WANTED, X, SLOPES, ERRORS, CELLS };
    mbma_axis axis[MBMA_MAX_AXES];
    mbma_cell_table table;
    if (!is_cell_table(a, axis, &table))
        return false;
    const size_t n = a[WANTED].count, guesses = table.boxes * (2 * table.axes + 1);
    const bool has_guess = a[GUESS].count > 0;
    if (a[OUTPUT].whole < 0 || (size_t)a[OUTPUT].whole >= table.outputs || a[AXIS].whole < 0 ||
        (size_t)a[AXIS].whole >= table.axes || (has_guess && a[GUESS].count != guesses) ||
        a[X].count != n * table.axes || a[SLOPES].count != n || a[ERRORS].count != n ||
        a[CELLS].count != n)
        return false;
    const mbma_cell_inverse_of of = {
        .output = (size_t)a[OUTPUT].whole,
        .axis = (size_t)a[AXIS].whole,
        .rises = a[RISES].whole != 0,
        .guess = has_guess ? a[GUESS].items : NULL,
    };
    *answer = (long long)mbma_cell_inverse(&table, n, &of, a[WANTED].items, a[X].items,
                                           a[SLOPES].items, a[ERRORS].items, a[CELLS].items);
    return true;
}

/* ---- profile.c ---- */

enum { PANEL_RULES = 3, PANEL_PLACES = MBMA_PANEL_NODES + MBMA_PANEL_CHECKS };
enum { SERIES_TERMS = 2 * MBMA_PANEL_GAPS };

/* Panels as arguments: the rules as one array; kinds, low and high ends and fields of panels, and
 * how many rows these have. */
enum { RULES, KINDS, LOW, HIGH, FIELDS, ROWS_OF_FIELDS, PANEL_ARGUMENTS };
#define PANELS "D Ln Dn Dn D i "

static bool are_panels(const argument *a) {
    const size_t panels = a[KINDS].count;
    const mbma_panel_rule *const rules = a[RULES].items;
    const uint64_t *const kinds = a[KINDS].items;
    const int64_t rows = a[ROWS_OF_FIELDS].whole;
    if (a[RULES].count != PANEL_RULES * WORDS(mbma_panel_rule))
        return false;
    if (rows < 2 || rows > MBMA_PANEL_ROWS)
        return false;
    /* beside its rows a field has shift and rate */
    if (a[FIELDS].count != (size_t)(rows + 2) * panels * PANEL_PLACES)
        return false;

    const double most_nodes = MBMA_PANEL_NODES;
    const double most_gaps = MBMA_PANEL_GAPS;
    for (int k = 0; k < PANEL_RULES; k++) {
        const bool nodes_fit = rules[k].count >= 1.0 && rules[k].count <= most_nodes;
        /* the error of a series is estimated from its last four terms, those of two gaps */
        const bool gaps_fit = rules[k].gaps >= 2.0 && rules[k].gaps <= most_gaps;
        if (!nodes_fit || !gaps_fit)
            return false;
    }
    for (size_t k = 0; k < panels; k++)
        if (kinds[k] >= PANEL_RULES)
            return false;
    return true;
}

static bool do_profile_islands(const argument *a, long long *answer) {
    enum { X, PEAK, HURST, ZETA_1, VARIANT, TABLE_AT };
    enum { ISLANDS = TABLE_AT + TABLE_ARGUMENTS, ERROR };
    if (!is_table(&a[TABLE_AT]))
        return false;
    const mbma_variant variant = variant_of(&a[VARIANT]);
    const mbma_cells cells = cells_of(&a[TABLE_AT]);
    *answer = mbma_profile_islands(a[X].count, a[X].items, a[PEAK].real, a[HURST].real,
                                   a[ZETA_1].real, &variant, &cells, a[ISLANDS].items,
                                   a[ERROR].items);
    return true;
}

static bool do_profile_missed(const argument *a, long long *answer) {
    enum { LAST = PANEL_ARGUMENTS, ERROR };
    if (!are_panels(a))
        return false;
    mbma_profile_missed(a[RULES].items, a[KINDS].count, a[KINDS].items, a[LOW].items, a[HIGH].items,
                        a[FIELDS].items, (int)a[ROWS_OF_FIELDS].whole, a[LAST].real,
                        a[ERROR].items);
    *answer = 0;
    return true;
}

static bool do_profile_series(const argument *a, long long *answer) {
    enum { SERIES = PANEL_ARGUMENTS, ERROR, WEIGHTS, SHIFT, RATE, STOPS };
    if (!are_panels(a))
        return false;
    const size_t panels = a[KINDS].count;
    const size_t rows = (size_t)a[ROWS_OF_FIELDS].whole;
    const size_t islands = a[SHIFT].count;
    if (a[SERIES].count != panels * rows * SERIES_TERMS || a[STOPS].count != panels + 1)
        return false;
    if (islands != panels * MBMA_PANEL_NODES || a[WEIGHTS].count != rows * islands)
        return false;

    const mbma_nodes nodes = {
        .size = (int64_t)islands,
        .weights = a[WEIGHTS].items,
        .shift = a[SHIFT].items,
        .rate = a[RATE].items,
    };
    mbma_profile_series(a[RULES].items, panels, a[KINDS].items, a[LOW].items, a[HIGH].items,
                        a[FIELDS].items, (int)rows, a[SERIES].items, a[ERROR].items, &nodes,
                        a[STOPS].items);
    *answer = 0;
    return true;
}

static bool do_profile_totals(const argument *a, long long *answer) {
    enum { COMPRESSION, EDGES, SERIES, ROWS, WITH_SLOPES, TOTALS };
    const bool with_slopes = a[WITH_SLOPES].whole != 0;
    if (a[EDGES].count < 2 || a[ROWS].whole < 1 || a[ROWS].whole > MBMA_PANEL_ROWS)
        return false;
    const size_t panels = a[EDGES].count - 1;
    const size_t rows = (size_t)a[ROWS].whole;
    const size_t rows_of_totals = with_slopes ? 2 * rows : rows;
    if (a[SERIES].count != panels * rows * SERIES_TERMS)
        return false;
    if (a[TOTALS].count != a[COMPRESSION].count * rows_of_totals)
        return false;
    mbma_profile_totals(a[COMPRESSION].count, a[COMPRESSION].items, panels, a[EDGES].items,
                        a[SERIES].items, (int)rows, with_slopes, a[TOTALS].items);
    *answer = 0;
    return true;
}

/* ---- newton.c ---- */

/* A basis is four arguments: nodes, roots of the weights, modes and the half-space's matrix. */
enum { BASIS_NODES, BASIS_ROOT_WEIGHTS, BASIS_MODES, BASIS_MATRIX, BASIS_ARGUMENTS };

static mbma_basis basis_of(const argument *basis) {
    return (mbma_basis){
        .nodes = basis[BASIS_NODES].count,
        .v = basis[BASIS_NODES].items,
        .root_weights = basis[BASIS_ROOT_WEIGHTS].items,
        .modes = basis[BASIS_MODES].items,
        .matrix = basis[BASIS_MATRIX].items,
    };
}

/* The work space of more nodes than these would be of terabytes. */
#define MOST_BASIS_NODES (1 << 20)

static bool do_height_integrals(const argument *a, long long *answer) {
    enum { TWICE_N, X, INTEGRALS };
    *answer = (long long)mbma_height_integrals(a[TWICE_N].whole, a[X].count, a[X].items,
                                               a[INTEGRALS].items);
    return true;
}

static bool do_islands_work(const argument *a, long long *answer) {
    const int64_t nodes = a[0].whole;
    if (nodes < 0 || nodes >= MOST_BASIS_NODES)
        return false;
    *answer = MBMA_ISLANDS_WORK(nodes);
    return true;
}

static bool do_solve_islands(const argument *a, long long *answer) {
    enum { X, MU, RTOL, FINE, COARSE = FINE + BASIS_ARGUMENTS };
    enum { PHI = COARSE + BASIS_ARGUMENTS, STEPS, STATUS, RHO, PRESSURE, GAP, WORK };
    const mbma_basis fine = basis_of(&a[FINE]);
    const mbma_basis coarse = basis_of(&a[COARSE]);
    /* profiles are written all three or not at all */
    if (a[PRESSURE].count != a[RHO].count || a[GAP].count != a[RHO].count)
        return false;
    if (a[WORK].count < MBMA_ISLANDS_WORK(fine.nodes))
        return false;
    *answer = (long long)mbma_solve_islands(a[X].count, a[X].items, a[MU].items, a[RTOL].real,
                                            &fine, &coarse, a[PHI].items, a[STEPS].items,
                                            a[STATUS].items, a[RHO].items, a[PRESSURE].items,
                                            a[GAP].items, a[WORK].items);
    return true;
}

static bool do_island_extents(const argument *a, long long *answer) {
    enum { X, MU, SHARE, SQUARED };
    *answer = (long long)mbma_island_extents(a[X].count, a[X].items, a[MU].items, a[SHARE].real,
                                             a[SQUARED].items);
    return true;
}

/* ---- law.c ---- */

/* Whether a block is that of a law, in which numbers of records are between the first and the last
 * one. */
static bool is_law(const argument *block) {
    const mbma_law law = mbma_law_open(block->items, block->count);
    if (law.head == NULL)
        return false;
    const size_t words_of_rows = (size_t)law.head->first_word - WORDS(mbma_law_head);
    const size_t rows = words_of_rows / WORDS(mbma_law_row);
    bool modest = true;
    for (size_t k = 0; k < rows; k++)
        modest = modest && is_modest(law.rows[k].base);
    return modest;
}

/* Whether a whole number is that of a quantity that has an inverse. */
static bool has_inverse(int64_t which) { return which == MBMA_FORCE || which == MBMA_AREA; }

static bool is_inverse(const argument *inverse) {
    if (inverse->count < WORDS(mbma_inverse))
        return false;
    const size_t words_of_more_records = inverse->count - WORDS(mbma_inverse);
    return words_of_more_records % WORDS(mbma_inverse_record) == 0 &&
           is_modest(((const mbma_inverse *)inverse->items)->first_bucket);
}

/* Records of an inverse, whose structure holds the first one. */
static size_t records_of(const argument *inverse) {
    return (inverse->count - WORDS(mbma_inverse)) / WORDS(mbma_inverse_record) + 1;
}

static bool do_law_fill(const argument *a, long long *answer) {
    enum { SEPARATION, LAW, FORCE, AREA, STIFFNESS, AREA_SLOPE, ENERGY };
    if (!is_law(&a[LAW]))
        return false;
    const mbma_law law = mbma_law_open(a[LAW].items, a[LAW].count);
    *answer = (long long)mbma_law_fill(a[SEPARATION].count, a[SEPARATION].items, &law,
                                       a[FORCE].items, a[AREA].items, a[STIFFNESS].items,
                                       a[AREA_SLOPE].items, a[ENERGY].items);
    return true;
}

static bool do_inverse_nodes(const argument *a, long long *answer) {
    enum { WANTED, LAW, QUANTITY, END, X, SIDE };
    if (!is_law(&a[LAW]) || !has_inverse(a[QUANTITY].whole))
        return false;
    const mbma_law law = mbma_law_open(a[LAW].items, a[LAW].count);
    *answer = (long long)mbma_inverse_nodes(a[WANTED].count, a[WANTED].items, &law,
                                            (mbma_quantity)a[QUANTITY].whole, a[END].real,
                                            a[X].items, a[SIDE].items);
    return true;
}

static bool do_law_invert(const argument *a, long long *answer) {
    enum { WANTED, LAW, INVERSE, QUANTITY, SEPARATION, AREA, STIFFNESS };
    if (!is_law(&a[LAW]) || !is_inverse(&a[INVERSE]) || !has_inverse(a[QUANTITY].whole))
        return false;
    const mbma_law law = mbma_law_open(a[LAW].items, a[LAW].count);
    *answer = (long long)mbma_law_invert(a[WANTED].count, a[WANTED].items, &law, a[INVERSE].items,
                                         records_of(&a[INVERSE]), (mbma_quantity)a[QUANTITY].whole,
                                         a[SEPARATION].items, a[AREA].items, a[STIFFNESS].items);
    return true;
}

/* ---- calibrated.c ---- */

/* First in all calls: a spline, which is coefficients, numbers and cells of each axis; of surfaces
 * Hurst exponents and ln zeta_1. Then their h_max, ends and pieces, or None. */
enum {
    COEFFICIENTS,
    SPLINE_NUMBERS,
    SPLINE_CELLS,
    SURFACES_HURST,
    SURFACES_LOG_ZETA_1,
    SURFACES_H_MAX,
    SURFACES_ENDS,
    SURFACES_PIECES,
    SURFACES_ARGUMENTS
};
#define SPLINE "F D13 L3 Dn Dn "

/* The second of them; ends of the range by axis. */
typedef struct {
    double first[3], rate[3], hurst_low, hurst_high, log_zeta_1_low, log_zeta_1_high;
    double area_s0, area_slope, area_t0;
} spline_numbers;

/* Cells of an axis, of which the product of three does not overflow. */
enum { MOST_CELLS = 100000 };

/* Coefficients of the powers 0 to 5 for each cell of the third axis and each surface. */
static size_t words_of_pieces(const argument *a) {
    const int64_t *const cells = a[SPLINE_CELLS].items;
    return a[SURFACES_HURST].count * 6 * (size_t)cells[2];
}

static bool fits_spline(const argument *a) {
    const int64_t *const cells = a[SPLINE_CELLS].items;
    /* along each axis 5 more than cells, and two more in all */
    size_t coefficients = 1;
    for (int axis = 0; axis < 3; axis++) {
        if (cells[axis] < 1 || cells[axis] > MOST_CELLS)
            return false;
        coefficients *= (size_t)(cells[axis] + 5);
    }
    coefficients += 2;
    /* with pieces, coefficients are not read */
    if (a[SURFACES_PIECES].items != NULL)
        return a[SURFACES_PIECES].count == words_of_pieces(a);
    return a[COEFFICIENTS].count >= coefficients;
}

static mbma_spline spline_of(const argument *a) {
    const int64_t *const cells = a[SPLINE_CELLS].items;
    const spline_numbers *const numbers = a[SPLINE_NUMBERS].items;
    mbma_spline spline = {
        .coefficients = a[COEFFICIENTS].items,
        .low = {numbers->hurst_low, numbers->log_zeta_1_low},
        .high = {numbers->hurst_high, numbers->log_zeta_1_high},
    };
    for (int axis = 0; axis < 3; axis++) {
        spline.cells[axis] = (size_t)cells[axis];
        spline.first[axis] = numbers->first[axis];
        spline.rate[axis] = numbers->rate[axis];
    }
    return spline;
}

static mbma_calibrated_table calibrated_of(const argument *a) {
    const spline_numbers *const numbers = a[SPLINE_NUMBERS].items;
    return (mbma_calibrated_table){
        .log_force = spline_of(a),
        .area_s0 = numbers->area_s0,
        .area_slope = numbers->area_slope,
        .area_t0 = numbers->area_t0,
    };
}

static mbma_surfaces surfaces_of(const argument *a) {
    return (mbma_surfaces){
        .count = a[SURFACES_HURST].count,
        .hurst = a[SURFACES_HURST].items,
        .log_zeta_1 = a[SURFACES_LOG_ZETA_1].items,
        .h_max = a[SURFACES_H_MAX].items,
        .ends = a[SURFACES_ENDS].items,
        .pieces = a[SURFACES_PIECES].items,
    };
}

static bool do_spline_pieces(const argument *a, long long *answer) {
    enum { PIECES = SURFACES_ARGUMENTS };
    if (!fits_spline(a) || a[SURFACES_PIECES].items != NULL)
        return false;
    if (a[PIECES].count != words_of_pieces(a))
        return false;
    const mbma_spline spline = spline_of(a);
    const mbma_surfaces surfaces = surfaces_of(a);
    *answer = (long long)mbma_spline_pieces(&spline, &surfaces, a[PIECES].items);
    return true;
}

static bool do_calibrated_ends(const argument *a, long long *answer) {
    enum { ENDS = SURFACES_ARGUMENTS };
    if (!fits_spline(a))
        return false;
    const mbma_calibrated_table table = calibrated_of(a);
    const mbma_surfaces surfaces = surfaces_of(a);
    *answer = (long long)mbma_calibrated_ends(&table, &surfaces, a[ENDS].items);
    return true;
}

static bool do_calibrated_contact(const argument *a, long long *answer) {
    enum { OWNER = SURFACES_ARGUMENTS, SEPARATION, FORCE, AREA, STIFFNESS };
    if (!fits_spline(a) || a[SURFACES_HURST].count == 0)
        return false;
    const mbma_calibrated_table table = calibrated_of(a);
    const mbma_surfaces surfaces = surfaces_of(a);
    *answer = (long long)mbma_calibrated_contact(&table, &surfaces, a[OWNER].count, a[OWNER].items,
                                                 a[SEPARATION].items, a[FORCE].items,
                                                 a[AREA].items, a[STIFFNESS].items);
    return true;
}

static bool do_calibrated_separation(const argument *a, long long *answer) {
    enum { OWNER = SURFACES_ARGUMENTS, FORCE, SEPARATION };
    if (!fits_spline(a) || a[SURFACES_HURST].count == 0)
        return false;
    const mbma_calibrated_table table = calibrated_of(a);
    const mbma_surfaces surfaces = surfaces_of(a);
    *answer = (long long)mbma_calibrated_separation(&table, &surfaces, a[OWNER].count,
                                                    a[OWNER].items, a[FORCE].items,
                                                    a[SEPARATION].items);
    return true;
}

/* The constants of a table of flow stand in the place of those of the calibrated law. */
static bool do_contact_flows(const argument *a, long long *answer) {
    enum { OWNER = SURFACES_ARGUMENTS, GAP, AREA, FLOW };
    if (!fits_spline(a) || a[SURFACES_HURST].count == 0)
        return false;
    const spline_numbers *const numbers = a[SPLINE_NUMBERS].items;
    const mbma_flow_table table = {
        .log_factor = spline_of(a),
        .threshold = numbers->area_s0,
        .obstruction = numbers->area_slope,
    };
    const mbma_surfaces surfaces = surfaces_of(a);
    *answer = (long long)mbma_contact_flows(&table, &surfaces, a[OWNER].count, a[OWNER].items,
                                            a[GAP].items, a[AREA].items, a[FLOW].items);
    return true;
}

static bool do_flow_areas(const argument *a, long long *answer) {
    enum { AREA, YIELDED, LAW, ELASTIC };
    *answer = (long long)mbma_flow_areas(a[AREA].count, a[AREA].items, a[YIELDED].items,
                                         a[LAW].items, a[ELASTIC].items);
    return true;
}

static bool do_self_affine(const argument *a, long long *answer) {
    enum { HURST, LOG_ZETA_1, ALPHA, GRADIENT };
    *answer = (long long)mbma_self_affine(a[HURST].count, a[HURST].items, a[LOG_ZETA_1].items,
                                          a[ALPHA].items, a[GRADIENT].items);
    return true;
}

/* ---- spectrum_laws.c ---- */

/* What a law of a spectrum needs beside its waves. */
typedef struct {
    double gradient, alpha;
    mbma_law_constants constants;
    double h_max;
} spectrum_numbers;

static bool do_words_of_spectrum_law(const argument *a, long long *answer) {
    (void)a;
    *answer = WORDS(mbma_spectrum_law);
    return true;
}

static bool do_spectrum_waves(const argument *a, long long *answer) {
    enum { Q, C, X, VARIANCE, BELOW, FACTS };
    *answer = (long long)mbma_spectrum_waves(a[Q].count, a[Q].items, a[C].items, a[X].count,
                                             a[X].items, a[VARIANCE].items, a[BELOW].items,
                                             a[FACTS].items);
    return true;
}

static bool do_spectrum_law_of(const argument *a, long long *answer) {
    enum { X, VARIANCE, BELOW, NUMBERS, WORK, LAW };
    if (a[LAW].count != WORDS(mbma_spectrum_law))
        return false;
    const spectrum_numbers *const numbers = a[NUMBERS].items;
    const mbma_waves waves = {
        .count = a[X].count,
        .x = a[X].items,
        .variance = a[VARIANCE].items,
        .below = a[BELOW].items,
        .gradient = numbers->gradient,
        .alpha = numbers->alpha,
    };
    *answer = mbma_spectrum_law_of(&waves, &numbers->constants, numbers->h_max, a[WORK].items,
                                   a[LAW].items);
    return true;
}

static bool do_spectrum_law_contact(const argument *a, long long *answer) {
    enum { LAW, SEPARATION, FORCE, AREA, STIFFNESS };
    if (a[LAW].count != WORDS(mbma_spectrum_law))
        return false;
    *answer = (long long)mbma_spectrum_law_contact(a[LAW].items, a[SEPARATION].count,
                                                   a[SEPARATION].items, a[FORCE].items,
                                                   a[AREA].items, a[STIFFNESS].items);
    return true;
}

static bool do_spectrum_law_separation(const argument *a, long long *answer) {
    enum { LAW, FORCE, WHOLE, SEPARATION, SLOPE };
    if (a[LAW].count != WORDS(mbma_spectrum_law))
        return false;
    *answer = (long long)mbma_spectrum_law_separation(a[LAW].items, a[FORCE].count, a[FORCE].items,
                                                      a[WHOLE].whole != 0, a[SEPARATION].items,
                                                      a[SLOPE].items);
    return true;
}

/* ---- spectra.c ---- */

/* The inner integral is three arguments: polynomials and slopes of each cell, and numbers. */
enum { INNER_POLYNOMIALS, INNER_SLOPES, INNER_NUMBERS, INNER_ARGUMENTS };
#define INNER "D D D3 "

/* The third of them. */
typedef struct {
    double first, rate, narrowness;
} inner_numbers;

static bool is_inner(const argument *inner) {
    const size_t count = inner[INNER_POLYNOMIALS].count;
    return count > 0 && count % MBMA_INNER_TERMS == 0 &&
           count <= MBMA_INNER_TERMS * MBMA_MOST_INNER_CELLS &&
           inner[INNER_SLOPES].count == count;
}

static mbma_inner inner_of(const argument *inner) {
    const inner_numbers *const numbers = inner[INNER_NUMBERS].items;
    return (mbma_inner){
        .cells = inner[INNER_POLYNOMIALS].count / MBMA_INNER_TERMS,
        .first = numbers->first,
        .rate = numbers->rate,
        .narrowness = numbers->narrowness,
        .polynomials = inner[INNER_POLYNOMIALS].items,
        .slopes = inner[INNER_SLOPES].items,
    };
}

static bool do_words_of_spectrum_numbers(const argument *a, long long *answer) {
    (void)a;
    *answer = WORDS(mbma_spectrum_numbers);
    return true;
}

static bool do_most_wave_words(const argument *a, long long *answer) {
    (void)a;
    *answer = 3 * MBMA_MOST_WAVES;
    return true;
}

static bool do_spectra_of(const argument *a, long long *answer) {
    enum { ALPHA, H_MAX, LAWS, CONSTANTS, INNER_AT };
    enum { WAVES = INNER_AT + INNER_ARGUMENTS, NUMBERS };
    const size_t surfaces = a[ALPHA].count;
    if (surfaces == 0 || !is_inner(&a[INNER_AT]))
        return false;
    const size_t parts = a[LAWS].count / surfaces / MBMA_PART_NUMBERS;
    if (a[LAWS].count != surfaces * parts * MBMA_PART_NUMBERS || parts > MBMA_MOST_PARTS ||
        a[NUMBERS].count != surfaces * WORDS(mbma_spectrum_numbers))
        return false;
    const mbma_inner inner = inner_of(&a[INNER_AT]);
    *answer = (long long)mbma_spectra_of(surfaces, parts, a[LAWS].items, a[ALPHA].items,
                                         a[H_MAX].items, a[CONSTANTS].items, &inner,
                                         a[WAVES].count, a[WAVES].items, a[NUMBERS].items);
    return true;
}

/* First in these calls: waves and numbers of surfaces, and t0 of areas. */
enum { SPECTRA_WAVES, SPECTRA_NUMBERS, SPECTRA_T0, SPECTRA_INNER };
enum { SPECTRA_ARGUMENTS = SPECTRA_INNER + INNER_ARGUMENTS };
#define SPECTRA "D D d " INNER

static bool are_spectra(const argument *a) {
    const size_t surfaces = a[SPECTRA_NUMBERS].count / WORDS(mbma_spectrum_numbers);
    return surfaces > 0 && is_inner(&a[SPECTRA_INNER]) &&
           a[SPECTRA_NUMBERS].count == surfaces * WORDS(mbma_spectrum_numbers);
}

static mbma_spectra spectra_of(const argument *a) {
    const size_t surfaces = a[SPECTRA_NUMBERS].count / WORDS(mbma_spectrum_numbers);
    return (mbma_spectra){
        .count = surfaces,
        .words = a[SPECTRA_WAVES].count,
        .waves = a[SPECTRA_WAVES].items,
        .numbers = a[SPECTRA_NUMBERS].items,
        .area_t0 = a[SPECTRA_T0].real,
    };
}

static bool do_spectra_contact(const argument *a, long long *answer) {
    enum { OWNER = SPECTRA_ARGUMENTS, SEPARATION, FORCE, AREA, STIFFNESS };
    if (!are_spectra(a))
        return false;
    const mbma_spectra spectra = spectra_of(a);
    const mbma_inner inner = inner_of(&a[SPECTRA_INNER]);
    *answer = (long long)mbma_spectra_contact(&spectra, &inner, a[OWNER].count, a[OWNER].items,
                                              a[SEPARATION].items, a[FORCE].items,
                                              a[AREA].items, a[STIFFNESS].items);
    return true;
}

static bool do_spectra_separation(const argument *a, long long *answer) {
    enum { OWNER = SPECTRA_ARGUMENTS, FORCE, SEPARATION };
    if (!are_spectra(a))
        return false;
    const mbma_spectra spectra = spectra_of(a);
    const mbma_inner inner = inner_of(&a[SPECTRA_INNER]);
    *answer = (long long)mbma_spectra_separation(&spectra, &inner, a[OWNER].count, a[OWNER].items,
                                                 a[FORCE].items, a[SEPARATION].items);
    return true;
}

static bool do_spectra_energy(const argument *a, long long *answer) {
    enum { RULE = SPECTRA_ARGUMENTS, OWNER, SEPARATION, ENERGY };
    if (!are_spectra(a) || a[RULE].count != 2 * MBMA_ENERGY_NODES)
        return false;
    const mbma_spectra spectra = spectra_of(a);
    const mbma_inner inner = inner_of(&a[SPECTRA_INNER]);
    *answer = (long long)mbma_spectra_energy(&spectra, &inner, a[RULE].items, a[OWNER].count,
                                             a[OWNER].items, a[SEPARATION].items,
                                             a[ENERGY].items);
    return true;
}

static bool do_gap_flow(const argument *a, long long *answer) {
    enum { ALPHA, LAWS, CONSTANTS, INNER_AT };
    enum { FLOW = INNER_AT + INNER_ARGUMENTS, RULE, OWNER, LOAD, FACTOR };
    const size_t surfaces = a[ALPHA].count;
    if (surfaces == 0 || !is_inner(&a[INNER_AT]))
        return false;
    const size_t parts = a[LAWS].count / surfaces / MBMA_PART_NUMBERS;
    if (a[LAWS].count != surfaces * parts * MBMA_PART_NUMBERS || parts > MBMA_MOST_PARTS ||
        a[RULE].count != 2 * MBMA_FLOW_NODES)
        return false;
    const mbma_inner inner = inner_of(&a[INNER_AT]);
    *answer = (long long)mbma_gap_flow(surfaces, parts, a[LAWS].items, a[ALPHA].items,
                                       a[CONSTANTS].items, &inner, a[FLOW].items, a[RULE].items,
                                       a[OWNER].count, a[OWNER].items, a[LOAD].items,
                                       a[FACTOR].items);
    return true;
}

/* ---- yielding.c ---- */

static bool do_gaussian_levels(const argument *a, long long *answer) {
    enum { GAP, LEVEL };
    *answer = (long long)mbma_gaussian_levels(a[GAP].count, a[GAP].items, a[LEVEL].items);
    return true;
}

static bool do_bearing_shares(const argument *a, long long *answer) {
    enum { GAP, LAST, SHARE, SLOPE };
    *answer = (long long)mbma_bearing_shares(a[GAP].count, a[GAP].items, a[LAST].items,
                                             a[SHARE].items, a[SLOPE].items);
    return true;
}

static bool do_diffused(const argument *a, long long *answer) {
    enum { X, TAU, SIGN, SHARE };
    *answer = (long long)mbma_diffused(a[X].count, a[X].items, a[TAU].items, a[SIGN].real,
                                       a[SHARE].items);
    return true;
}

static bool do_yielding_forces(const argument *a, long long *answer) {
    enum { ELASTIC, STIFFNESS, SHARE, SLOPE, ETA, LAW, FORCE, STEEP };
    *answer = (long long)mbma_yielding_forces(
        a[ELASTIC].count, a[ELASTIC].items, a[STIFFNESS].items, a[SHARE].items, a[SLOPE].items,
        a[ETA].items, a[LAW].items, a[FORCE].items, a[STEEP].items);
    return true;
}

static bool do_yielding_at_gaps(const argument *a, long long *answer) {
    enum { ELASTIC, STIFFNESS, GAP, LAST, ETA, LAW, FORCE, STEEP };
    *answer = (long long)mbma_yielding_at_gaps(
        a[ELASTIC].count, a[ELASTIC].items, a[STIFFNESS].items, a[GAP].items, a[LAST].items,
        a[ETA].items, a[LAW].items, a[FORCE].items, a[STEEP].items);
    return true;
}

static bool do_yielding_areas(const argument *a, long long *answer) {
    enum { FORCE, ELASTIC, ETA, LAW, YIELDED, AREA };
    *answer = (long long)mbma_yielding_areas(a[FORCE].count, a[FORCE].items, a[ELASTIC].items,
                                             a[ETA].items, a[LAW].items, a[YIELDED].whole != 0,
                                             a[AREA].items);
    return true;
}

static bool do_frozen_factors(const argument *a, long long *answer) {
    enum { ETA, LAW, FACTOR };
    *answer = (long long)mbma_frozen_factors(a[ETA].count, a[ETA].items, a[LAW].items,
                                             a[FACTOR].items);
    return true;
}

static bool do_tangential_ratios(const argument *a, long long *answer) {
    enum { NU, SHARE, KAPPA };
    *answer = (long long)mbma_tangential_ratios(a[NU].count, a[NU].items, a[SHARE].items,
                                                a[KAPPA].items);
    return true;
}

static bool do_tangential_stiffnesses(const argument *a, long long *answer) {
    enum { STIFFNESS, KAPPA, TANGENTIAL };
    *answer = (long long)mbma_tangential_stiffnesses(a[STIFFNESS].count, a[STIFFNESS].items,
                                                     a[KAPPA].items, a[TANGENTIAL].items);
    return true;
}

static bool do_solid_conductances(const argument *a, long long *answer) {
    enum { STIFFNESS, K_S, E_STAR, CONDUCTANCE };
    *answer = (long long)mbma_solid_conductances(a[STIFFNESS].count, a[STIFFNESS].items,
                                                 a[K_S].items, a[E_STAR].items,
                                                 a[CONDUCTANCE].items);
    return true;
}

static bool do_yielding_planes(const argument *a, long long *answer) {
    enum { GAP, LOAD, ETA, LAW, PLANES };
    *answer = (long long)mbma_yielding_planes(a[GAP].count, a[GAP].items, a[LOAD].items,
                                              a[ETA].items, a[LAW].items, a[PLANES].items);
    return true;
}

static bool do_flat_spots(const argument *a, long long *answer) {
    enum { YIELDED, AREA, LAW, WEIGHT, POWER, EXPONENT };
    *answer = (long long)mbma_flat_spots(a[YIELDED].count, a[YIELDED].items, a[AREA].items, a[LAW].items,
                                         a[WEIGHT].items, a[POWER].items, a[EXPONENT].items);
    return true;
}

static bool do_flat_energies(const argument *a, long long *answer) {
    enum { S, POWER, EXPONENT, ENERGY };
    *answer = (long long)mbma_flat_energies(a[S].count, a[S].items, a[POWER].items,
                                            a[EXPONENT].items, a[ENERGY].items);
    return true;
}

static bool do_unloaded_stiffnesses(const argument *a, long long *answer) {
    enum { S, ELASTIC, WEIGHT, POWER, EXPONENT, RATIO };
    *answer = (long long)mbma_unloaded_stiffnesses(a[S].count, a[S].items, a[ELASTIC].items,
                                                   a[WEIGHT].items, a[POWER].items,
                                                   a[EXPONENT].items, a[RATIO].items);
    return true;
}

static bool do_unloaded_areas(const argument *a, long long *answer) {
    enum { S, ELASTIC, WEIGHT, POWER, EXPONENT, RATIO };
    *answer = (long long)mbma_unloaded_areas(a[S].count, a[S].items, a[ELASTIC].items,
                                             a[WEIGHT].items, a[POWER].items, a[EXPONENT].items,
                                             a[RATIO].items);
    return true;
}

static bool do_unloaded_gaps(const argument *a, long long *answer) {
    enum { S, ELASTIC, DEPTH, WEIGHT, POWER, EXPONENT, RAISED };
    *answer = (long long)mbma_unloaded_gaps(a[S].count, a[S].items, a[ELASTIC].items,
                                            a[DEPTH].items, a[WEIGHT].items, a[POWER].items,
                                            a[EXPONENT].items, a[RAISED].items);
    return true;
}

static bool do_unloaded_flows(const argument *a, long long *answer) {
    enum { BEFORE, RAISED, GAP, OPENING, FLOW };
    *answer = (long long)mbma_unloaded_flows(a[BEFORE].count, a[BEFORE].items, a[RAISED].items,
                                             a[GAP].items, a[OPENING].real, a[FLOW].items);
    return true;
}

/* ---- all functions ---- */

/* Names of the functions `do_...`, which return whether the sizes and numbers of their arguments
 * fit, and the kinds of these arguments, one word each. A word begins with a letter:
 *
 *     d  a double               i  a whole number
 *     D  doubles to be read     w  doubles to be written
 *     L  int64 to be read       l  int64 to be written
 *     J  int32 to be read       b  bytes to be written
 *     F  floats to be read
 *
 * After that of an array may follow `?` if it may be None, and its size: a product of a number and
 * of the letters k, m and n, each of which is the size of the first array that has it. */
#define FUNCTIONS(FN) \
    FN(elementary, "i Dn wn") \
    FN(phi, "Dn Dn " TABLE "w3n b?n") \
    FN(totals, "Dn Dn Dn Dn d D8 " TABLE "w4n wn bn l1") \
    FN(covered_areas, "Dn wn") \
    FN(island_geometry, "d d d D8 w") \
    FN(island_bands, "Dn Dn Dn D8 wn wn wn wn") \
    FN(island_places, "Dn Dn Dn Dn D8 wn wn wn wn wn wn wn") \
    FN(island_answers, "Dn Dn Dn Dn Dn " ISLAND_TABLE "wn wn wn") \
    FN(island_totals, "Dn Dn Dn Dn d D8 " ISLAND_TABLE "w4n wn bn l1") \
    FN(cell_answers, CELL_TABLE "D w i w w l") \
    FN(cell_inverse, CELL_TABLE "i i i D D w w w l") \
    FN(profile_islands, "Dn d d d D8 " TABLE "w4n w1") \
    FN(profile_missed, PANELS "d wn") \
    FN(profile_series, PANELS "w wn w wm wm l") \
    FN(profile_totals, "D D D i i w") \
    FN(height_integrals, "i Dn wn") \
    FN(islands_work, "i") \
    FN(solve_islands, "Dn Dn d Dk Dk Dkk Dkk Dm Dm Dmm Dmm w3n ln bn w?nk w?nk w?nk w") \
    FN(island_extents, "Dn Dn d wn") \
    FN(law_fill, "Dn D w?n w?n w?n w?n w?n") \
    FN(inverse_nodes, "Dn D i d wn wn") \
    FN(law_invert, "Dn D D i wn w?n w?n") \
    FN(spline_pieces, SPLINE "D D D w") \
    FN(calibrated_ends, SPLINE "Dn D D w2n") \
    FN(calibrated_contact, SPLINE "Dn D2n D Lm Dm wm wm wm") \
    FN(calibrated_separation, SPLINE "Dn D2n D Lm Dm wm") \
    FN(contact_flows, SPLINE "D D D Lm Dm Dm wm") \
    FN(flow_areas, "Dn Dn D7 wn") \
    FN(self_affine, "Dn Dn wn wn") \
    FN(words_of_spectrum_law, "") \
    FN(spectrum_waves, "Dn Dn wm wm wm w4") \
    FN(spectrum_law_of, "Dn Dn Dn D10 w3n w") \
    FN(spectrum_law_contact, "D Dn wn wn wn") \
    FN(spectrum_law_separation, "D Dn i wn wn") \
    FN(words_of_spectrum_numbers, "") \
    FN(most_wave_words, "") \
    FN(spectra_of, "Dn Dn D D7 " INNER "w w") \
    FN(spectra_contact, SPECTRA "Ln Dn wn wn wn") \
    FN(spectra_separation, SPECTRA "Ln Dn wn") \
    FN(spectra_energy, SPECTRA "D Ln Dn wn") \
    FN(gap_flow, "D D D7 " INNER "D2 D Ln Dn wn") \
    FN(gaussian_levels, "Dn wn") \
    FN(bearing_shares, "Dn Dn wn wn") \
    FN(diffused, "Dn Dn d wn") \
    FN(yielding_forces, "Dn Dn Dn Dn Dn D11 wn wn") \
    FN(yielding_at_gaps, "Dn Dn Dn Dn Dn D11 wn wn") \
    FN(yielding_areas, "Dn Dn Dn D11 i wn") \
    FN(frozen_factors, "Dn D11 wn") \
    FN(tangential_ratios, "Dn Dn wn") \
    FN(tangential_stiffnesses, "Dn Dn wn") \
    FN(solid_conductances, "Dn Dn Dn wn") \
    FN(yielding_planes, "Dn Dn Dn D11 wn") \
    FN(flat_spots, "Dn Dn D10 wn wn wn") \
    FN(flat_energies, "Dn Dn Dn wn") \
    FN(unloaded_stiffnesses, "Dn Dn Dn Dn Dn wn") \
    FN(unloaded_areas, "Dn Dn Dn Dn Dn wn") \
    FN(unloaded_gaps, "Dn Dn Dn Dn Dn Dn wn") \
    FN(unloaded_flows, "Dn Dn Dn d wn")

#endif
