/* Tables of any function: sums of products of Chebyshev polynomials on the boxes of a tree.
 *
 * A tree halves the range, one axis at a time, until the function is accurately a polynomial on each box. A lookup goes
 * down the tree and evaluates one polynomial; its slopes are those of the polynomial. Nothing here relies on the tree's
 * numbers being right: places outside the arrays are refused.
 */
#include "elementary.h"
#include "mbma.h"

/* Chebyshev polynomials of one axis at a place in its box, and their slopes by the axis. */
typedef struct {
    size_t terms;   /* of the last axis with the zeros behind them */
    size_t stride;  /* coefficients from one term to the next */
    double value[MBMA_MAX_TERMS], slope[MBMA_MAX_TERMS];
} basis;

static void fill_basis(basis *b, double x, double rate, bool slopes) {
    b->value[0] = 1.0, b->slope[0] = 0.0;
    if (b->terms > 1)
        b->value[1] = x, b->slope[1] = rate;
    for (size_t k = 2; k < b->terms; k++)
        b->value[k] = mbma_fma(2.0 * x, b->value[k - 1], -b->value[k - 2]);
    for (size_t k = 2; slopes && k < b->terms; k++)
        b->slope[k] = 2.0 * rate * b->value[k - 1] + mbma_fma(2.0 * x, b->slope[k - 1], -b->slope[k - 2]);
}

/* The sum over the last two axes, row by row; `columns` is a constant of the caller, so that loops over them vanish. */
MBMA_INLINE double sum_of_rows(const basis *b, const double *c, double *slopes, const size_t columns) {
    double row[MBMA_MAX_TERMS] = {0.0}, slope_row[MBMA_MAX_TERMS] = {0.0};
    for (size_t i = 0; i < b[0].terms; i++, c += columns)
        for (size_t j = 0; j < columns; j++)
            row[j] = mbma_fma(b[0].value[i], c[j], row[j]);
    if (slopes) {
        c -= b[0].terms * columns;
        for (size_t i = 0; i < b[0].terms; i++, c += columns)
            for (size_t j = 0; j < columns; j++)
                slope_row[j] = mbma_fma(b[0].slope[i], c[j], slope_row[j]);
        slopes[0] = dot(slope_row, b[1].value, columns);
        slopes[1] = dot(row, b[1].slope, columns);
    }
    return dot(row, b[1].value, columns);
}

static double sum_of_plane(const basis *b, const double *c, double *slopes) {
    switch (b[1].terms) {
    case 4:
        return sum_of_rows(b, c, slopes, 4);
    case 12:
        return sum_of_rows(b, c, slopes, 12);
    case 8:
        return sum_of_rows(b, c, slopes, 8);
    default:
        return sum_of_rows(b, c, slopes, b[1].terms);
    }
}

/* The sum over all axes, and its slopes by each of them unless `slopes` is NULL. */
static double sum_of_products(const basis *b, size_t axes, const double *c, double *slopes) {
    if (axes == 1) {
        if (slopes)
            slopes[0] = dot(b[0].slope, c, b[0].terms);
        return dot(b[0].value, c, b[0].terms);
    }
    if (axes == 2)
        return sum_of_plane(b, c, slopes);
    double value = 0.0, inner[MBMA_MAX_AXES];
    for (size_t a = 0; slopes && a < axes; a++)
        slopes[a] = 0.0;
    for (size_t i = 0; i < b[0].terms; i++) {
        const double part = sum_of_products(b + 1, axes - 1, c + i * b[0].stride, slopes ? inner : NULL);
        value = mbma_fma(b[0].value[i], part, value);
        if (!slopes)
            continue;
        slopes[0] = mbma_fma(b[0].slope[i], part, slopes[0]);
        for (size_t a = 1; a < axes; a++)
            slopes[a] = mbma_fma(b[0].value[i], inner[a - 1], slopes[a]);
    }
    return value;
}

/* The coordinate of an axis on which the boxes are halved; NaN where the axis does not answer. `by_x` is its slope. */
static double coordinate(const mbma_axis *axis, double x, double *by_x) {
    *by_x = 1.0;
    if (!(x >= axis->low && x <= axis->high)) {
        const double period = axis->high - axis->low;
        if (!(fabs(x) < INFINITY) || axis->outside == MBMA_REFUSED)
            return NAN;
        if (axis->outside == MBMA_PERIODIC)
            x = mbma_held(x - period * floor((x - axis->low) / period), axis->low, axis->high);
        else
            x = mbma_held(x, axis->low, axis->high), *by_x = 0.0;
    }
    if (!axis->is_log)
        return x;
    *by_x /= x + axis->offset;
    return mbma_log(x + axis->offset);
}

/* Down the tree to the box of coordinates t; its ends are left in `low` and `high`. The number of its polynomial, or
 * `t->cells` where there is none. */
static size_t cell_at(const mbma_cell_table *t, const double *coordinates, double *low, double *high) {
    size_t box = 0;
    while (box < t->boxes) {
        const int32_t axis = t->branches[2 * box], next = t->branches[2 * box + 1];
        if (axis < 0)
            return axis == MBMA_POLYNOMIAL && next >= 0 && (size_t)next < t->cells ? (size_t)next : t->cells;
        /* boxes come after those that they are halves of, so that the way ends */
        if ((size_t)axis >= t->axes || next < 0 || (size_t)next <= box)
            break;
        const double middle = t->middles[box];
        const bool upper = coordinates[axis] >= middle;
        *(upper ? &low[axis] : &high[axis]) = middle;
        box = (size_t)next + upper;
    }
    return t->cells;
}

/* One point: values, slopes or NULL, bounds on the errors and the cell; false where the table has no answer. */
static bool answer(const mbma_cell_table *t, const double *x, double *values, double *slopes, double *errors,
                   int64_t *found) {
    double place[MBMA_MAX_AXES], by_x[MBMA_MAX_AXES], low[MBMA_MAX_AXES], high[MBMA_MAX_AXES];
    for (size_t a = 0; a < t->axes; a++) {
        place[a] = coordinate(&t->axis[a], x[a], &by_x[a]);
        if (place[a] != place[a])
            return false;
        low[a] = t->axis[a].first, high[a] = t->axis[a].last;
    }
    const size_t cell = cell_at(t, place, low, high);
    if (cell >= t->cells)
        return false;
    *found = (int64_t)cell;
    basis b[MBMA_MAX_AXES];
    size_t size = 1;
    for (size_t a = t->axes; a-- > 0;) {
        const int32_t terms = t->terms[cell * t->axes + a];
        if (terms < 1 || terms > MBMA_MAX_TERMS)
            return false;
        const double rate = 2.0 / (high[a] - low[a]);
        b[a].terms = (size_t)terms, b[a].stride = size;
        fill_basis(&b[a], (place[a] - low[a]) * rate - 1.0, rate, slopes != NULL);
        for (; a + 1 == t->axes && b[a].terms % MBMA_LANES; b[a].terms++)
            b[a].value[b[a].terms] = b[a].slope[b[a].terms] = 0.0;
        size *= b[a].terms;
    }
    const int64_t start = t->starts[cell];
    if (start < 0 || size > t->coefficient_count || (size_t)start > t->coefficient_count ||
        t->coefficient_count - (size_t)start < size * t->outputs)
        return false;
    for (size_t f = 0; f < t->outputs; f++) {
        double *const by_axis = slopes ? slopes + f * t->axes : NULL;
        values[f] = sum_of_products(b, t->axes, t->coefficients + (size_t)start + f * size, by_axis);
        const double scale = t->is_exponential[f] ? mbma_exp(values[f]) : 1.0;
        values[f] = t->is_exponential[f] ? scale : values[f];
        for (size_t a = 0; slopes && a < t->axes; a++)
            by_axis[a] *= scale * by_x[a];
        errors[f] = t->errors[cell * t->outputs + f];
    }
    return true;
}

size_t mbma_cell_answers(const mbma_cell_table *table, size_t n, const double *x, double *restrict values,
                         double *restrict slopes, double *restrict errors, int64_t *restrict cells) {
    const size_t slopes_of_one = table->outputs * table->axes;
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        double *const by_axes = slopes ? slopes + k * slopes_of_one : NULL;
        if (answer(table, x + k * table->axes, values + k * table->outputs, by_axes, errors + k * table->outputs,
                   &cells[k]))
            continue;
        bad++;
        cells[k] = -1;
        for (size_t f = 0; f < table->outputs; f++)
            values[k * table->outputs + f] = errors[k * table->outputs + f] = NAN;
        for (size_t f = 0; slopes && f < slopes_of_one; f++)
            by_axes[f] = NAN;
    }
    return bad;
}
