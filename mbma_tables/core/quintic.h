/* Quintic cardinal B-splines on equally spaced nodes, for loops to inline. */
#ifndef MBMA_QUINTIC_H
#define MBMA_QUINTIC_H

#include "elementary.h"

enum { QUINTIC_ORDER = 6, QUINTIC_COLUMNS = 8 };

#define QUINTIC_UNIT 120.0 /* sum of the weights of a place */

/* The six B-splines that reach a cell, times QUINTIC_UNIT: rows by powers of the place in [0, 1] of it. */
static const double QUINTIC[QUINTIC_ORDER][QUINTIC_COLUMNS] = {
    {1.0, 26.0, 66.0, 26.0, 1.0},    {-5.0, -50.0, 0.0, 50.0, 5.0},
    {10.0, 20.0, -60.0, 20.0, 10.0}, {-10.0, 20.0, 0.0, -20.0, 10.0},
    {5.0, -20.0, 30.0, -20.0, 5.0},  {-1.0, 5.0, -10.0, 10.0, -5.0, 1.0}};

/* The cell of a position in units of nodes, and the place z in [0, 1] of it; beyond the cells at their end, and NaN in
 * the first. */
MBMA_INLINE size_t quintic_cell(double position, size_t cells, double *z) {
    const double at = mbma_held(position, 0.0, (double)cells);
    const int64_t cell = (int64_t)mbma_min(at, (double)cells - 1.0);
    *z = at - (double)cell;
    return (size_t)cell;
}

/* Weights of the coefficients from that of the cell's number on, times QUINTIC_UNIT; the last two are 0. */
MBMA_INLINE void quintic_weights(double z, double weights[QUINTIC_COLUMNS]) {
    for (int m = 0; m < QUINTIC_COLUMNS; m++) {
        const double high = mbma_horner(QUINTIC[5][m], z, QUINTIC[4][m], QUINTIC[3][m], QUINTIC[2][m], QUINTIC[1][m]);
        weights[m] = mbma_fma(high, z, QUINTIC[0][m]);
    }
}

#endif
