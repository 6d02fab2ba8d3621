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
    WAITING = 13,   /* boxes, each with at least as many points as what is answered before it: log2 of POINTS */
    NO_AXIS = MBMA_MAX_AXES, /* more than any axis */
    MOST_PASSES = 99 /* over the points of an inverse that are not answered yet */
};
static const double ROUNDED = 1e-15;  /* what rounding leaves of a sum, over its size */
static const double LAST_STEP = 1e-9; /* of a root, over half the width of a cell: the next one is its square */

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

/* Polynomials of the axes, but perhaps of one that is left out, at up to WIDTH points of a box. */
static void fill_points(cell_of_points *cell, const box *in, const double *places, size_t step, const uint16_t *points,
                        size_t count, bool slopes, size_t left_out) {
    for (size_t a = 0; a < cell->axes; a++) {
        double place[WIDTH];
        if (a == left_out)
            continue;
        /* points that there are not repeat the last one */
        for (size_t l = 0; l < WIDTH; l++)
            place[l] = places[a * step + points[l < count ? l : count - 1]];
        fill_polynomials(cell, a, in->low[a], 2.0 / (in->high[a] - in->low[a]), place, slopes);
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
        fill_points(&cell, in, places, step, order + k, count, to->slopes != NULL, NO_AXIS);
        for (size_t l = 0; l < count; l++)
            to->cells[order[k + l]] = t->branches[2 * in->number + 1];
        for (size_t f = 0; f < t->outputs; f++)
            answer(t, &cell, f, order + k, count, to);
    }
    return 0;
}

/* ---- inverses: a box's polynomial becomes one along the axis alone, whose root is found ---- */

/* What is solved for, and of each point of a block: the stored output that is wanted, and the ends between which the
 * coordinate is known to lie. */
typedef struct {
    const mbma_cell_inverse_of *of;
    double sign; /* 1 where the output rises along the axis, -1 where it falls */
    bool by_guess;
    double *places; /* of the axis: where each point is looked for */
    double *goal, *low, *high;
    const double *wanted;
    double *x;
    bool *is_open; /* not answered yet */
} search;

/* Before a box is halved along the axis that is solved for: points go to the half that a guess of the output at the
 * middle points to. */
static void place_by_guess(const mbma_cell_table *t, const box *in, const double *places, size_t step,
                           const uint16_t *order, const search *by) {
    const double *const guess = by->of->guess + in->number * (2 * t->axes + 1), *const curvature = guess + t->axes;
    const double middle = t->middles[in->number];
    for (size_t k = in->begin; k < in->end; k++) {
        const uint16_t point = order[k];
        double value = guess[2 * t->axes];
        for (size_t a = 0; a < t->axes; a++) {
            const double place = places[a * step + point];
            value += a == by->of->axis ? 0.0 : (guess[a] + curvature[a] * place) * place;
        }
        by->places[point] = by->sign * (by->goal[point] - value) >= 0.0 ? middle : -INFINITY;
    }
}

/* Adds sums of some rows of the last axis, which is not the one that is solved for, to the rows of the result. */
MBMA_INLINE void fold_rows(const cell_of_points *cell, size_t axis, size_t term, size_t i, const double *c,
                           const size_t rows, const double *weight, double (*to)[WIDTH]) {
    const size_t level = cell->axes - 2, columns = cell->terms[level + 1];
    numbers sums[ROWS];
    sums_of_rows(cell->value[level + 1], columns, c + i * columns, rows, sums);
    for (size_t r = 0; r < rows; r++) {
        if (level != axis) {
            double product[WIDTH];
            for (size_t l = 0; l < WIDTH; l++)
                product[l] = weight[l] * cell->value[level][i + r][l];
            numbers_to(to[term], plus_product(numbers_of(to[term]), sums[r], product));
        } else {
            numbers_to(to[i + r], plus_product(numbers_of(to[i + r]), sums[r], weight));
        }
    }
}

/* Coefficients along the axis that is solved for at points of a cell, a row for each term: sums of products over the
 * other axes. `weight` has the products of the axes before `level`. */
static void fold(const cell_of_points *cell, size_t level, size_t axis, size_t term, const double *c,
                 const double *weight, double (*to)[WIDTH]) {
    const size_t terms = cell->terms[level];
    if (level + 1 == cell->axes) {
        const numbers factor = numbers_of(weight);
        for (size_t j = 0; j < terms; j++) {
            numbers sum = numbers_of(to[j]);
            sum.low = fma4(factor.low, c[j], sum.low), sum.high = fma4(factor.high, c[j], sum.high);
            numbers_to(to[j], sum);
        }
        return;
    }
    if (level + 2 == cell->axes && axis != level + 1) {
        size_t i = 0;
        for (; i + ROWS <= terms; i += ROWS)
            fold_rows(cell, axis, term, i, c, ROWS, weight, to);
        for (; i < terms; i++)
            fold_rows(cell, axis, term, i, c, 1, weight, to);
        return;
    }
    for (size_t i = 0; i < terms; i++, c += cell->stride[level]) {
        double product[WIDTH];
        for (size_t l = 0; l < WIDTH; l++)
            product[l] = level == axis ? weight[l] : weight[l] * cell->value[level][i][l];
        fold(cell, level + 1, axis, level == axis ? i : term, c, product, to);
    }
}

/* a b + (c - d). */
MBMA_INLINE numbers product_and_difference(numbers a, numbers b, numbers c, numbers d) {
    const numbers found = {fma44(a.low, b.low, minus4(c.low, d.low)), fma44(a.high, b.high, minus4(c.high, d.high))};
    return found;
}

/* A sum of Chebyshev polynomials and its slope at WIDTH numbers, by Clenshaw's recurrence. */
static void sum_along(double (*rows)[WIDTH], size_t terms, const double *y, double *restrict value,
                      double *restrict slope) {
    static const double none[WIDTH] = {0.0};
    double doubled[WIDTH];
    for (size_t l = 0; l < WIDTH; l++)
        doubled[l] = 2.0 * y[l];
    const numbers at = numbers_of(y), twice = numbers_of(doubled), zero = numbers_of(none);
    numbers b = zero, b_next = zero, d = zero, d_next = zero; /* d: half of the slope's */
    for (size_t k = terms; k-- > 1;) {
        const numbers of_slope = product_and_difference(twice, d, b, d_next);
        const numbers of_value = product_and_difference(twice, b, numbers_of(rows[k]), b_next);
        d_next = d, d = of_slope, b_next = b, b = of_value;
    }
    numbers_to(value, product_and_difference(at, b, numbers_of(rows[0]), b_next));
    const numbers rate = product_and_difference(twice, d, b, d_next);
    const numbers whole = {minus4(rate.low, d_next.low), minus4(rate.high, d_next.high)};
    numbers_to(slope, whole);
}

/* A number that is not below another one, for loops that compilers vectorise. */
MBMA_INLINE double larger(double a, double b) { return a > b ? a : b; }

/* Numbers in [low, high] that close in on roots, and the last step of each, by which it is the root or is not yet. */
typedef struct {
    double y[WIDTH], low[WIDTH], high[WIDTH], moved[WIDTH], slope[WIDTH];
} roots;

/* One step to roots: Newton's, or half of the range where that leaves it; the largest step. What is a root stays as it
 * is, so that it does not depend on the numbers beside it. */
static double step_to_roots(const double *goal, double scale, const double *value, const double *slope, roots *at) {
    double largest = 0.0;
    for (size_t l = 0; l < WIDTH; l++) {
        const double y = at->y[l], excess = value[l] - goal[l], rounding = ROUNDED * larger(fabs(goal[l]), scale);
        const double low = excess > 0.0 ? at->low[l] : y, high = excess > 0.0 ? y : at->high[l];
        const double newton = y - excess / slope[l], middle = 0.5 * (low + high);
        double next = newton >= low ? newton : middle;
        next = newton <= high ? next : middle;
        next = fabs(excess) <= rounding ? y : next;
        const bool is_open = at->moved[l] > LAST_STEP;
        at->y[l] = is_open ? next : y, at->slope[l] = is_open ? slope[l] : at->slope[l];
        at->moved[l] = is_open ? fabs(next - y) : 0.0;
        at->low[l] = low, at->high[l] = high;
    }
    for (size_t l = 0; l < WIDTH; l++)
        largest = larger(at->moved[l], largest);
    return largest;
}

/* Where sums that rise with y in [-1, 1] have the values `goal`, which are those at the ends or between them, from
 * numbers y on; by Newton's method within ends that close in, until what the next step leaves is below rounding. */
static void find_roots(double (*rows)[WIDTH], size_t terms, const double *goal, double scale, roots *at) {
    enum { MOST_STEPS = 80 };
    double value[WIDTH], slope[WIDTH];
    for (size_t l = 0; l < WIDTH; l++)
        at->low[l] = -1.0, at->high[l] = 1.0, at->moved[l] = 1.0, at->slope[l] = 0.0;
    for (size_t step = 0; step < MOST_STEPS; step++) {
        sum_along(rows, terms, at->y, value, slope);
        if (step_to_roots(goal, scale, value, slope, at) <= LAST_STEP)
            return;
    }
}

/* An end of a search moves to the end of a cell that the root is beyond, and the next place is Newton's. */
static void move_on(const search *by, uint16_t point, bool is_above, double end, double excess, double slope) {
    double *const low = &by->low[point], *const high = &by->high[point];
    *(is_above ? low : high) = end;
    const double next = end + excess / slope;
    by->places[point] = next > *low && next < *high ? next : 0.5 * (*low + *high);
}

/* The answer at a point: x on the axis, and the slope of the stored output by it there. */
static void answer_inverse(const mbma_cell_table *t, const search *by, uint16_t point, double x, double slope,
                           int32_t cell, const answers *to) {
    const size_t f = by->of->output;
    by->x[point * t->axes + by->of->axis] = x;
    to->slopes[point] = slope * (t->is_exponential[f] ? by->wanted[point] : 1.0);
    to->errors[point] = t->errors[(size_t)cell * t->outputs + f];
    to->cells[point] = cell, by->is_open[point] = false;
}

static void refuse_inverse(const mbma_cell_table *t, const search *by, uint16_t point, int64_t why, const answers *to) {
    by->x[point * t->axes + by->of->axis] = to->slopes[point] = to->errors[point] = NAN;
    to->cells[point] = why, by->is_open[point] = false;
}

/* Up to WIDTH points in a cell, whose rows along the axis are given: answered, or moved to where the root is beyond. */
static void solve_points(const mbma_cell_table *t, const box *in, double (*rows)[WIDTH], size_t terms,
                         const uint16_t *points, size_t count, const search *by, const answers *to) {
    const size_t a = by->of->axis;
    const double scale = t->is_exponential[by->of->output] ? 1.0 : 0.0, width = in->high[a] - in->low[a];
    double ends[2][WIDTH], goal[WIDTH];
    roots at;
    for (size_t k = 0; k < terms; k++)
        for (size_t l = 0; l < WIDTH; l++)
            rows[k][l] *= by->sign;
    for (size_t l = 0; l < WIDTH; l++) {
        ends[0][l] = ends[1][l] = rows[0][l];
        goal[l] = by->sign * by->goal[points[l < count ? l : count - 1]];
    }
    for (size_t k = 1; k < terms; k++)
        for (size_t l = 0; l < WIDTH; l++)
            ends[0][l] += k % 2 ? -rows[k][l] : rows[k][l], ends[1][l] += rows[k][l];
    double within[WIDTH], x[WIDTH], by_place[WIDTH], by_x[WIDTH];
    for (size_t l = 0; l < WIDTH; l++) {
        within[l] = mbma_held(goal[l], ends[0][l], ends[1][l]);
        const double rise = ends[1][l] - ends[0][l];
        at.y[l] = rise > 0.0 ? 2.0 * (within[l] - ends[0][l]) / rise - 1.0 : 0.0;
    }
    find_roots(rows, terms, within, scale, &at);
    const mbma_axis axis = t->axis[a];
    for (size_t l = 0; l < WIDTH; l++) {
        x[l] = in->low[a] + 0.5 * (at.y[l] + 1.0) * width;
        by_place[l] = by_x[l] = 2.0 * at.slope[l] / width;
    }
    for (size_t l = 0; axis.is_log && l < WIDTH; l++) {
        const double shifted = mbma_exp(x[l]);
        x[l] = shifted - axis.offset, by_x[l] /= shifted;
    }
    for (size_t l = 0; l < count; l++) {
        const uint16_t point = points[l];
        const double excess = goal[l] - within[l];
        const bool is_above = excess > 0.0, is_in = fabs(excess) <= 4.0 * ROUNDED * larger(fabs(goal[l]), scale);
        const double end = is_above ? in->high[a] : in->low[a];
        if (!is_in && (is_above ? end < by->high[point] : end > by->low[point]))
            move_on(by, point, is_above, end, excess, by_place[l]);
        else if (!is_in && (is_above ? end == axis.last : end == axis.first))
            refuse_inverse(t, by, point, MBMA_NOT_REACHED, to);
        else
            answer_inverse(t, by, point, mbma_held(x[l], axis.low, axis.high), by->sign * by_x[l],
                           t->branches[2 * in->number + 1], to);
    }
}

/* Points in one box: answered, moved, or without an answer. */
static void solve_box(const mbma_cell_table *t, const box *in, const double *places, size_t step,
                      const uint16_t *order, const search *by, const answers *to) {
    static const double one[WIDTH] = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
    cell_of_points cell;
    const bool is_there = open_cell(t, in->number, &cell);
    for (size_t k = in->begin; !is_there && k < in->end; k++)
        refuse_inverse(t, by, order[k], MBMA_NO_CELL, to);
    for (size_t k = in->begin; is_there && k < in->end; k += WIDTH) {
        const size_t count = in->end - k < WIDTH ? in->end - k : WIDTH, terms = cell.terms[by->of->axis];
        double rows[MBMA_MAX_TERMS][WIDTH];
        /* where a point is looked for along its own axis is no place of it */
        fill_points(&cell, in, places, step, order + k, count, false, by->of->axis);
        memset(rows, 0, terms * sizeof *rows);
        fold(&cell, 0, by->of->axis, 0, cell.coefficients + by->of->output * cell.size, one, rows);
        solve_points(t, in, rows, terms, order + k, count, by, to);
    }
}

/* Points in order, sorted by the boxes that they are in on the way down; how many the table has no answer at. */
static size_t walk(const mbma_cell_table *t, double *places, size_t step, size_t end, uint16_t *order,
                   const search *by, const answers *to) {
    uint16_t spare[POINTS];
    box now = {0, 0, end, {0.0}, {0.0}}, waiting[WAITING];
    for (size_t a = 0; a < t->axes; a++)
        now.low[a] = t->axis[a].first, now.high[a] = t->axis[a].last;
    size_t bad = 0, count = 0;
    for (bool going = end > 0; going;) {
        if (is_halved(t, now.number)) {
            if (by && by->by_guess && (size_t)t->branches[2 * now.number] == by->of->axis)
                place_by_guess(t, &now, places, step, order, by);
            count += halve(t, places, step, order, spare, &now, &waiting[count]);
            continue;
        }
        if (by)
            solve_box(t, &now, places, step, order, by, to);
        else
            bad += answer_box(t, &now, places, step, order, to);
        going = count > 0;
        if (going)
            now = waiting[--count];
    }
    return bad;
}

/* Whether the table has coordinates of a point. */
static bool has_places(const mbma_cell_table *t, const double *places, size_t step, size_t point) {
    bool good = t->boxes > 0;
    for (size_t a = 0; a < t->axes; a++)
        good &= places[a * step + point] == places[a * step + point];
    return good;
}

/* Some points; how many the table has no answer at. */
static size_t answer_block(const mbma_cell_table *t, size_t n, const answers *to) {
    double places[NUMBERS];
    uint16_t order[POINTS];
    size_t end = 0;
    fill_places(t, n, to->x, places);
    for (size_t k = 0; k < n; k++) {
        const bool good = has_places(t, places, n, k);
        order[end] = (uint16_t)k, end += good;
        if (!good)
            refuse(t, to, k);
    }
    return n - end + walk(t, places, n, end, order, NULL, to);
}

/* Inverses at some points: first where the guess points to, then where the last cell did; how many have none. */
static size_t solve_block(const mbma_cell_table *t, size_t n, search *by, const answers *to) {
    double places[NUMBERS], numbers_of_points[NUMBERS];
    uint16_t order[POINTS];
    bool is_open[POINTS];
    const size_t a = by->of->axis;
    const mbma_axis *const axis = &t->axis[a];
    size_t end = 0, bad = 0;
    by->places = places + a * n, by->is_open = is_open;
    by->goal = numbers_of_points, by->low = by->goal + n, by->high = by->low + n;
    for (size_t k = 0; k < n; k++)
        by->x[k * t->axes + a] = axis->low;
    fill_places(t, n, by->x, places);
    for (size_t k = 0; k < n; k++) {
        const double wanted = by->wanted[k];
        const bool is_log = t->is_exponential[by->of->output] != 0, good = has_places(t, places, n, k);
        by->places[k] = 0.5 * (axis->first + axis->last);
        by->low[k] = axis->first, by->high[k] = axis->last, is_open[k] = true;
        by->goal[k] = !is_log ? wanted : wanted > 0.0 ? mbma_log(wanted) : NAN;
        if (!good || !(fabs(by->goal[k]) < INFINITY))
            refuse_inverse(t, by, (uint16_t)k, good ? MBMA_NOT_REACHED : MBMA_NO_CELL, to);
    }
    by->by_guess = by->of->guess != NULL;
    /* each pass leaves half of the range at most where Newton's places are of no use */
    for (size_t pass = 0; pass < MOST_PASSES; pass++, by->by_guess = false) {
        end = 0;
        for (size_t k = 0; k < n; k++)
            order[end] = (uint16_t)k, end += is_open[k];
        if (end == 0)
            break;
        walk(t, places, n, end, order, by, to);
    }
    for (size_t k = 0; k < n; k++) {
        if (is_open[k])
            refuse_inverse(t, by, (uint16_t)k, MBMA_NO_CELL, to);
        bad += to->cells[k] < 0;
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

size_t mbma_cell_inverse(const mbma_cell_table *table, size_t n, const mbma_cell_inverse_of *of, const double *wanted,
                         double *restrict x, double *restrict slopes, double *restrict errors,
                         int64_t *restrict cells) {
    const size_t block = NUMBERS / (table->axes < 3 ? 3 : table->axes);
    size_t bad = 0;
    for (size_t first = 0; first < n; first += block) {
        const answers to = {NULL, NULL, slopes + first, errors + first, cells + first};
        search by = {.of = of, .sign = of->rises ? 1.0 : -1.0};
        by.wanted = wanted + first, by.x = x + first * table->axes;
        bad += solve_block(table, n - first < block ? n - first : block, &by, &to);
    }
    return bad;
}
