/* A table of a function from its netCDF file, by libnetcdf and cells.c of `mbma tables export c`. */
#include <math.h>
#include <netcdf.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "read_table.h"

/* The doubles of a variable, and the length of its first dimension; NULL where there is no such variable. */
static double *doubles(int file, const char *name, size_t *rows, size_t *count) {
    int variable, dims, dimension[NC_MAX_VAR_DIMS];
    nc_type type;
    if (nc_inq_varid(file, name, &variable) || nc_inq_var(file, variable, NULL, &type, &dims, dimension, NULL) ||
        type != NC_DOUBLE || dims < 1 || dims > 2)
        return NULL;
    *count = 1;
    for (int k = 0; k < dims; k++) {
        size_t length;
        if (nc_inq_dimlen(file, dimension[k], &length) || length < 1)
            return NULL;
        if (k == 0)
            *rows = length;
        *count *= length;
    }
    double *numbers = malloc(*count * sizeof *numbers);
    if (numbers && nc_get_var_double(file, variable, numbers)) {
        free(numbers);
        return NULL;
    }
    return numbers;
}

static int32_t *whole(const double *numbers, size_t count) {
    int32_t *found = malloc(count * sizeof *found);
    for (size_t k = 0; found && k < count; k++)
        found[k] = fabs(numbers[k]) < 2e9 ? (int32_t)numbers[k] : -2;
    return found;
}

static mbma_axis *axes_of(const double *numbers, size_t axes) {
    mbma_axis *found = malloc(axes * sizeof *found);
    for (size_t a = 0; found && a < axes; a++, numbers += 7)
        found[a] = (mbma_axis){numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5] > 0.0,
                               (int)numbers[6]};
    return found;
}

/* Where the coefficients of each cell start, those of one cell after the other. */
static bool fill_starts(mbma_cell_table *t, size_t count) {
    int64_t *starts = malloc(t->cells * sizeof *starts);
    t->starts = starts, t->coefficient_count = count;
    size_t start = 0;
    for (size_t cell = 0; starts && cell < t->cells; cell++) {
        size_t size = t->outputs;
        for (size_t a = 0; a < t->axes; a++) {
            const int32_t terms = t->terms[cell * t->axes + a];
            if (terms < 1 || terms > MBMA_MAX_TERMS)
                return false;
            size *= (size_t)terms;
        }
        if (size > count - start)
            return false;
        starts[cell] = (int64_t)start;
        start += size;
    }
    return starts && start == count;
}

enum { AXES, OUTPUTS, BRANCHES, MIDDLES, TERMS, COEFFICIENTS, ERRORS, POINTS, EXACT, VARIABLES };
static const char *const NAMES[VARIABLES] = {"axis_numbers", "output_numbers", "branches",      "middles", "terms",
                                             "coefficients", "errors",         "conformance_x", "conformance_exact"};

/* Whether the variables have the shapes that belong together. */
static bool fit_together(const size_t *rows, const size_t *count) {
    const size_t axes = rows[AXES], outputs = rows[OUTPUTS], boxes = rows[BRANCHES], cells = rows[TERMS];
    return axes <= MBMA_MAX_AXES && count[AXES] == 7 * axes && count[OUTPUTS] == 3 * outputs &&
           count[BRANCHES] == 2 * boxes && count[MIDDLES] == boxes && count[TERMS] == axes * cells &&
           count[ERRORS] == outputs * cells && count[POINTS] == axes * rows[POINTS] &&
           count[EXACT] == outputs * rows[POINTS];
}

static bool fill(read_table *table, double **v, const size_t *rows, const size_t *count) {
    int32_t *const exponential = malloc(rows[OUTPUTS] * sizeof *exponential);
    table->cells = (mbma_cell_table){.axes = rows[AXES],
                                     .outputs = rows[OUTPUTS],
                                     .boxes = rows[BRANCHES],
                                     .cells = rows[TERMS],
                                     .axis = axes_of(v[AXES], rows[AXES]),
                                     .is_exponential = exponential,
                                     .branches = whole(v[BRANCHES], count[BRANCHES]),
                                     .terms = whole(v[TERMS], count[TERMS]),
                                     .middles = v[MIDDLES],
                                     .coefficients = v[COEFFICIENTS],
                                     .errors = v[ERRORS]};
    table->output_numbers = v[OUTPUTS];
    table->points = rows[POINTS];
    table->conformance_x = v[POINTS], table->exact = v[EXACT];
    mbma_cell_table *const t = &table->cells;
    if (!exponential || !t->axis || !t->branches || !t->terms)
        return false;
    for (size_t f = 0; f < t->outputs; f++)
        exponential[f] = v[OUTPUTS][3 * f] > 0.0;
    return fill_starts(t, count[COEFFICIENTS]);
}

const char *read_table_open(const char *path, read_table *table) {
    double *v[VARIABLES] = {NULL};
    size_t rows[VARIABLES], count[VARIABLES];
    int file;
    memset(table, 0, sizeof *table);
    if (nc_open(path, NC_NOWRITE, &file))
        return "is no netCDF file that can be read";
    bool good = true;
    for (int k = 0; k < VARIABLES; k++)
        good = (v[k] = doubles(file, NAMES[k], &rows[k], &count[k])) != NULL && good;
    nc_close(file);
    if (good && fit_together(rows, count)) {
        good = fill(table, v, rows, count);
        free(v[AXES]), free(v[BRANCHES]), free(v[TERMS]);
        if (good)
            return NULL;
        read_table_free(table);
        return "has polynomials that do not fit together, or there is no memory";
    }
    for (int k = 0; k < VARIABLES; k++)
        free(v[k]);
    return "is no table of a function";
}

void read_table_free(read_table *table) {
    const mbma_cell_table *t = &table->cells;
    const void *const owned[] = {t->axis,         t->is_exponential, t->branches,           t->terms,
                                 t->starts,       t->middles,        t->coefficients,       t->errors,
                                 table->output_numbers, table->conformance_x, table->exact};
    for (size_t k = 0; k < sizeof owned / sizeof owned[0]; k++)
        free((void *)(uintptr_t)owned[k]);
    memset(table, 0, sizeof *table);
}

double read_table_bound(const read_table *table, size_t output, double value, double error) {
    const double *numbers = table->output_numbers + 3 * output;
    if (numbers[0] > 0.0)
        return fabs(value) * expm1(error);
    return numbers[1] > 0.0 ? error * fmax(fabs(value), numbers[2]) / (1.0 - fmin(error, 0.5)) : error;
}

double read_table_selftest(const read_table *table) {
    const mbma_cell_table *t = &table->cells;
    double worst = 0.0;
    for (size_t k = 0; k < table->points; k++) {
        double values[64], errors[64];
        int64_t cell;
        if (t->outputs > 64 || mbma_cell_answers(t, 1, table->conformance_x + k * t->axes, values, NULL, errors, &cell))
            return INFINITY;
        for (size_t f = 0; f < t->outputs; f++) {
            const double off = fabs(values[f] - table->exact[k * t->outputs + f]);
            worst = fmax(worst, off / read_table_bound(table, f, values[f], errors[f]));
        }
    }
    return worst;
}
