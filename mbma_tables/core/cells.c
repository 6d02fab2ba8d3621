/* Tables of any function: sums of products of Chebyshev polynomials on the boxes of a tree.
 *
 * A tree halves the range, one axis at a time, until the function is accurately a polynomial on each box. Points are
 * sorted by the halves that they are in on the way down, and those of one box are answered side by side, so that no
 * branch depends on a point; a point's value does not depend on the others. Slopes are those of the polynomial. Nothing
 * here relies on the tree's numbers being right: places outside the arrays are refused.
 */
#include "elementary.h"
#include "four.h"
#include "mbma.h"

enum {
    WIDTH = 8,      /* points of one cell that are answered side by side */
    ROWS = 4,       /* of coefficients, likewise */
    NUMBERS = 6144, /* coordinates of the points that are sorted by their cells at a time */
    POINTS = 3072,  /* these points at most */
    WAITING = 13    /* boxes, each with at least as many points as what is answered before it: log2 of POINTS */
};

/* x inside the range of an axis, or NaN where the axis does not answer. */
MBMA_INLINE double inside(const mbma_axis *axis, double x) {
    double other = NAN;
    if (axis->outside == MBMA_PERIODIC) {
        const double period = axis->high - axis->low;
        other = mbma_held(x - period * floor((x - axis->low) / period), axis->low, axis->high);
    } else if (axis->outside == MBMA_NEAREST) {
        other = mbma_held(x, axis->low, axis->high);
    }
    other = fabs(x) < INFINITY ? other : NAN;
    return x >= axis->low && x <= axis->high ? x : other;
}

/* Coordinates on which the boxes are halved, those of one axis after the other; NaN where the axis does not answer. */
static void fill_places(const mbma_cell_table *t, size_t n, const double *restrict x, double *restrict places) {
    for (size_t a = 0; a < t->axes; a++, places += n) {
        const mbma_axis axis = t->axis[a];
        for (size_t k = 0; k < n; k++)
            places[k] = inside(&axis, x[k * t->axes + a]);
        for (size_t k = 0; axis.is_log && k < n; k++)
            places[k] = places[k] == places[k] ? mbma_log(places[k] + axis.offset) : NAN;
    }
}

/* A box of the tree with its ends, and which of the points in order are in it. */
typedef struct {
    size_t number, begin, end;
    double low[MBMA_MAX_AXES], high[MBMA_MAX_AXES];
} box;

/* Whether a box is halved; boxes come after those that they are halves of, so that the way down ends. */
static bool is_halved(const mbma_cell_table *t, size_t number) {
    const int32_t axis = t->branches[2 * number], next = t->branches[2 * number + 1];
    return axis >= 0 && (size_t)axis < t->axes && next > 0 && (size_t)next > number && (size_t)next + 1 < t->boxes;
}

/* Points below a middle before the others, without a branch; how many there are. */
static size_t part_points(const double *places, double middle, uint16_t *points, size_t count, uint16_t *spare) {
    size_t lower = 0, upper = 0;
    for (size_t k = 0; k < count; k++) {
        const uint16_t point = points[k];
        const bool above = places[point] >= middle;
        points[lower] = spare[upper] = point;
        upper += above, lower += !above;
    }
    memcpy(points + lower, spare, upper * sizeof *points);
    return lower;
}

/* A box becomes one of its halves that has points, and if the other has some too, that is left in `other`. */
static bool halve(const mbma_cell_table *t, const double *places, size_t step, uint16_t *order, uint16_t *spare,
                  box *now, box *other) {
    const size_t axis = (size_t)t->branches[2 * now->number], count = now->end - now->begin;
    const double middle = t->middles[now->number];
    const size_t lower = part_points(places + axis * step, middle, order + now->begin, count, spare);
    const bool is_upper = lower < count - lower ? lower > 0 : lower == count;
    box halves[2] = {*now, *now};
    for (size_t upper = 0; upper < 2; upper++)
        halves[upper].number = (size_t)t->branches[2 * now->number + 1] + upper;
    halves[0].high[axis] = halves[1].low[axis] = middle;
    halves[0].end = halves[1].begin = now->begin + lower;
    /* the one with fewer points first, so that few boxes wait */
    *now = halves[!is_upper], *other = halves[is_upper];
    return lower > 0 && lower < count;
}

/* A cell, and at points in it Chebyshev polynomials along each axis with their slopes. */
typedef struct {
    size_t axes, terms[MBMA_MAX_AXES], stride[MBMA_MAX_AXES]; /* coefficients from one term to the next */
    const double *coefficients;
    size_t size; /* coefficients of an output */
    double value[MBMA_MAX_AXES][MBMA_MAX_TERMS][WIDTH], slope[MBMA_MAX_AXES][MBMA_MAX_TERMS][WIDTH];
} cell_of_points;

/* The polynomials of a box; false where there are none, or their numbers do not fit the table. */
static bool open_cell(const mbma_cell_table *t, size_t number, cell_of_points *found) {
    const int32_t cell = t->branches[2 * number + 1];
    if (t->branches[2 * number] != MBMA_POLYNOMIAL || cell < 0 || (size_t)cell >= t->cells)
        return false;
    size_t size = 1;
    for (size_t a = t->axes; a-- > 0;) {
        const int32_t terms = t->terms[(size_t)cell * t->axes + a];
        if (terms < 1 || terms > MBMA_MAX_TERMS)
            return false;
        found->terms[a] = (size_t)terms, found->stride[a] = size;
        size *= (size_t)terms;
    }
    const int64_t start = t->starts[cell];
    if (start < 0 || size > t->coefficient_count || (size_t)start > t->coefficient_count ||
        t->coefficient_count - (size_t)start < size * t->outputs)
        return false;
    found->axes = t->axes, found->size = size, found->coefficients = t->coefficients + (size_t)start;
    return true;
}

/* Polynomials of an axis, and their slopes by it, at coordinates of WIDTH points. */
static void fill_polynomials(cell_of_points *cell, size_t a, double low, double rate, const double *place,
                             bool slopes) {
    double(*const value)[WIDTH] = cell->value[a], (*const slope)[WIDTH] = cell->slope[a];
    double twice[WIDTH];
    for (size_t l = 0; l < WIDTH; l++) {
        const double y = (place[l] - low) * rate - 1.0;
        twice[l] = 2.0 * y;
        value[0][l] = 1.0, value[1][l] = y;
        slope[0][l] = 0.0, slope[1][l] = rate;
    }
    for (size_t k = 2; k < cell->terms[a]; k++)
        for (size_t l = 0; l < WIDTH; l++)
            value[k][l] = mbma_fma(twice[l], value[k - 1][l], -value[k - 2][l]);
    for (size_t k = 2; slopes && k < cell->terms[a]; k++)
        for (size_t l = 0; l < WIDTH; l++)
            slope[k][l] = 2.0 * rate * value[k - 1][l] + mbma_fma(twice[l], slope[k - 1][l], -slope[k - 2][l]);
}

/* A number for each of WIDTH points. */
typedef struct {
    four low, high;
} numbers;

MBMA_INLINE numbers numbers_of(const double row[WIDTH]) {
    const numbers found = {four_of(row), four_of(row + 4)};
    return found;
}
MBMA_INLINE numbers plus_product(numbers sum, numbers a, const double row[WIDTH]) {
    sum.low = fma44(a.low, four_of(row), sum.low), sum.high = fma44(a.high, four_of(row + 4), sum.high);
    return sum;
}
MBMA_INLINE void numbers_to(double row[WIDTH], numbers a) { four_to(row, a.low), four_to(row + 4, a.high); }

/* Sums along the last axis of some rows of coefficients; `rows` is a constant of the caller, so that loops over it
 * vanish and a polynomial is read once for all rows. */
MBMA_INLINE void sums_of_rows(const double (*polynomials)[WIDTH], size_t terms, const double *c, const size_t rows,
                              numbers *sums) {
    static const double none[WIDTH] = {0.0};
    for (size_t r = 0; r < rows; r++)
        sums[r] = numbers_of(none);
    for (size_t j = 0; j < terms; j++) {
        const numbers at = numbers_of(polynomials[j]);
        for (size_t r = 0; r < rows; r++) {
            sums[r].low = fma4(at.low, c[r * terms + j], sums[r].low);
            sums[r].high = fma4(at.high, c[r * terms + j], sums[r].high);
        }
    }
}

/* Sums over the last two axes, of which `sum` gets so many rows more: values, and slopes by rows and by columns. */
MBMA_INLINE void add_rows(const cell_of_points *cell, size_t i, const double *c, const size_t rows, const bool slopes,
                          numbers sum[3]) {
    const size_t a = cell->axes - 2, columns = cell->terms[a + 1];
    numbers sums[ROWS];
    sums_of_rows(cell->value[a + 1], columns, c, rows, sums);
    for (size_t r = 0; r < rows; r++)
        sum[0] = plus_product(sum[0], sums[r], cell->value[a][i + r]);
    for (size_t r = 0; slopes && r < rows; r++)
        sum[1] = plus_product(sum[1], sums[r], cell->slope[a][i + r]);
    if (!slopes)
        return;
    sums_of_rows(cell->slope[a + 1], columns, c, rows, sums);
    for (size_t r = 0; r < rows; r++)
        sum[2] = plus_product(sum[2], sums[r], cell->value[a][i + r]);
}

/* The sum of products over the last two axes, and behind it its slopes by both if they are asked for. */
MBMA_INLINE void sum_of_plane(const cell_of_points *cell, const double *c, const bool slopes, double *found) {
    static const double none[WIDTH] = {0.0};
    const size_t a = cell->axes - 2, columns = cell->terms[a + 1];
    numbers sum[3] = {numbers_of(none), numbers_of(none), numbers_of(none)};
    size_t i = 0;
    for (; i + ROWS <= cell->terms[a]; i += ROWS)
        add_rows(cell, i, c + i * columns, ROWS, slopes, sum);
    for (; i + 2 <= cell->terms[a]; i += 2)
        add_rows(cell, i, c + i * columns, 2, slopes, sum);
    if (i < cell->terms[a])
        add_rows(cell, i, c + i * columns, 1, slopes, sum);
    for (size_t k = 0; k < (slopes ? 3 : 1); k++)
        numbers_to(found + k * WIDTH, sum[k]);
}

static void add_products(double *restrict sum, const double *a, const double *b) {
    numbers_to(sum, plus_product(numbers_of(sum), numbers_of(a), b));
}

/* The sum of products over the axes from `a` on, and behind it its slopes by them if they are asked for. */
static void sum_of(const cell_of_points *cell, size_t a, const double *c, bool slopes, double *restrict found) {
    if (a + 2 == cell->axes && slopes) {
        sum_of_plane(cell, c, true, found);
        return;
    }
    if (a + 2 == cell->axes) {
        sum_of_plane(cell, c, false, found);
        return;
    }
    const size_t inner = slopes ? cell->axes - a - 1 : 0;
    for (size_t k = 0; k < (slopes ? inner + 2 : 1) * WIDTH; k++)
        found[k] = 0.0;
    for (size_t i = 0; i < cell->terms[a]; i++, c += cell->stride[a]) {
        double part[(1 + MBMA_MAX_AXES) * WIDTH];
        if (a + 1 == cell->axes)
            for (size_t l = 0; l < WIDTH; l++)
                part[l] = *c;
        else
            sum_of(cell, a + 1, c, slopes, part);
        add_products(found, part, cell->value[a][i]);
        if (slopes)
            add_products(found + WIDTH, part, cell->slope[a][i]);
        for (size_t k = 1; k <= inner; k++)
            add_products(found + (k + 1) * WIDTH, part + k * WIDTH, cell->value[a][i]);
    }
}

/* What a slope by a coordinate is times to be one by x. */
static double by_x(const mbma_axis *axis, double x) {
    if (axis->outside == MBMA_NEAREST && !(x >= axis->low && x <= axis->high))
        return 0.0;
    return axis->is_log ? 1.0 / (inside(axis, x) + axis->offset) : 1.0;
}

/* Arrays of mbma_cell_answers from some point on. */
typedef struct {
    const double *x;
    double *values, *slopes, *errors;
    int64_t *cells;
} answers;

static void refuse(const mbma_cell_table *t, const answers *to, size_t k) {
    to->cells[k] = -1;
    for (size_t f = 0; f < t->outputs; f++)
        to->values[k * t->outputs + f] = to->errors[k * t->outputs + f] = NAN;
    for (size_t f = 0; to->slopes && f < t->outputs * t->axes; f++)
        to->slopes[k * t->outputs * t->axes + f] = NAN;
}

/* One output at up to WIDTH points of a cell, whose numbers are `points`. */
static void answer(const mbma_cell_table *t, const cell_of_points *cell, size_t f, const uint16_t *points, size_t count,
                   const answers *to) {
    double found[(1 + MBMA_MAX_AXES) * WIDTH], scale[WIDTH];
    sum_of(cell, 0, cell->coefficients + f * cell->size, to->slopes != NULL, found);
    for (size_t l = 0; l < WIDTH; l++)
        scale[l] = 1.0;
    for (size_t l = 0; t->is_exponential[f] && l < WIDTH; l++)
        found[l] = scale[l] = mbma_exp(found[l]);
    for (size_t l = 0; l < count; l++) {
        const size_t at = points[l] * t->outputs + f;
        to->values[at] = found[l];
        to->errors[at] = t->errors[(size_t)to->cells[points[l]] * t->outputs + f];
        for (size_t a = 0; to->slopes && a < t->axes; a++)
            to->slopes[at * t->axes + a] =
                found[(1 + a) * WIDTH + l] * (scale[l] * by_x(&t->axis[a], to->x[points[l] * t->axes + a]));
    }
}

/* All outputs at points in one box; how many of them the table has no answer at. */
static size_t answer_box(const mbma_cell_table *t, const box *in, const double *places, size_t step,
                         const uint16_t *order, const answers *to) {
    cell_of_points cell;
    if (!open_cell(t, in->number, &cell)) {
        for (size_t k = in->begin; k < in->end; k++)
            refuse(t, to, order[k]);
        return in->end - in->begin;
    }
    for (size_t k = in->begin; k < in->end; k += WIDTH) {
        const size_t count = in->end - k < WIDTH ? in->end - k : WIDTH;
        for (size_t a = 0; a < t->axes; a++) {
            double place[WIDTH];
            /* points that there are not repeat the last one */
            for (size_t l = 0; l < WIDTH; l++)
                place[l] = places[a * step + order[k + (l < count ? l : count - 1)]];
            fill_polynomials(&cell, a, in->low[a], 2.0 / (in->high[a] - in->low[a]), place, to->slopes != NULL);
        }
        for (size_t l = 0; l < count; l++)
            to->cells[order[k + l]] = t->branches[2 * in->number + 1];
        for (size_t f = 0; f < t->outputs; f++)
            answer(t, &cell, f, order + k, count, to);
    }
    return 0;
}

/* Some points, sorted by the boxes that they are in on the way down; how many the table has no answer at. */
static size_t answer_block(const mbma_cell_table *t, size_t n, const answers *to) {
    double places[NUMBERS];
    uint16_t order[POINTS], spare[POINTS];
    box now = {0, 0, 0, {0.0}, {0.0}}, waiting[WAITING];
    fill_places(t, n, to->x, places);
    for (size_t k = 0; k < n; k++) {
        bool good = t->boxes > 0;
        for (size_t a = 0; a < t->axes; a++)
            good &= places[a * n + k] == places[a * n + k];
        order[now.end] = (uint16_t)k, now.end += good;
        if (!good)
            refuse(t, to, k);
    }
    for (size_t a = 0; a < t->axes; a++)
        now.low[a] = t->axis[a].first, now.high[a] = t->axis[a].last;
    size_t bad = n - now.end, count = 0;
    for (bool going = now.end > 0; going;) {
        if (is_halved(t, now.number)) {
            count += halve(t, places, n, order, spare, &now, &waiting[count]);
            continue;
        }
        bad += answer_box(t, &now, places, n, order, to);
        going = count > 0;
        if (going)
            now = waiting[--count];
    }
    return bad;
}

size_t mbma_cell_answers(const mbma_cell_table *table, size_t n, const double *x, double *restrict values,
                         double *restrict slopes, double *restrict errors, int64_t *restrict cells) {
    const size_t block = NUMBERS / (table->axes < 2 ? 2 : table->axes);
    size_t bad = 0;
    for (size_t first = 0; first < n; first += block) {
        const size_t of_values = first * table->outputs;
        double *const of_slopes = slopes ? slopes + of_values * table->axes : NULL;
        const answers to = {x + first * table->axes, values + of_values, of_slopes, errors + of_values, cells + first};
        bad += answer_block(table, n - first < block ? n - first : block, &to);
    }
    return bad;
}
