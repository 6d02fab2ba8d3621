/* A table of a function from its netCDF file; docs/tutorials/functions.md has the commands. */
#ifndef READ_TABLE_H
#define READ_TABLE_H

#include "mbma.h"

typedef struct {
    mbma_cell_table cells;                /* what mbma_cell_answers of mbma.h looks up */
    double *output_numbers;               /* (outputs, 3): exponential or not, relative error or not, least */
    size_t points;                        /* that the file has to replay, */
    double *conformance_x, *exact;        /* (points, axes), and what the function gives there, (points, outputs) */
} read_table;

/* NULL, or what is wrong with the file; a table that was read is freed by `read_table_free`. */
const char *read_table_open(const char *path, read_table *table);
void read_table_free(read_table *table);

/* The bound on the absolute error of an output whose value and stored error `mbma_cell_answers` gave. */
double read_table_bound(const read_table *table, size_t output, double value, double error);

/* The largest error at the points to replay over its bound, which is at most 1. */
double read_table_selftest(const read_table *table);

#endif
