/* Islands by the paper's four numbers: the spline of the four-number table. */
#include "eight.h"
#include "mbma.h"

#define BEYOND 1e-9 /* of a cell: largest rounding error of a place beyond the ends of its axis */

typedef struct {
    int64_t cell;
    double value[4], slope[4]; /* cardinal cubic B-splines that reach the cell, and their derivatives */
} weights;

/* Of a place inside [0, nodes - 1]; the last node belongs to the last cell. */
MBMA_INLINE weights weights_at(double place, int64_t nodes) {
    const int64_t whole = (int64_t)place, cell = whole < nodes - 2 ? whole : nodes - 2;
    const double u = place - (double)cell, v = 1.0 - u, u2 = u * u, v2 = v * v;
    const weights found = {
        cell,
        {v2 * v / 6.0, 2.0 / 3.0 - u2 * (1.0 - 0.5 * u), 2.0 / 3.0 - v2 * (1.0 - 0.5 * v), u2 * u / 6.0},
        {-0.5 * v2, u * (1.5 * u - 2.0), -v * (1.5 * v - 2.0), 0.5 * u2}};
    return found;
}

/* Both functions from the sums over the other axes: four coefficients of two functions each. */
MBMA_INLINE void last_axis(const double *w, eight sums, double *f, double *g) {
    double lanes[8];
    memcpy(lanes, &sums, sizeof lanes);
    *f = mbma_fma(w[0], lanes[0], w[1] * lanes[2]) + mbma_fma(w[2], lanes[4], w[3] * lanes[6]);
    *g = mbma_fma(w[0], lanes[1], w[1] * lanes[3]) + mbma_fma(w[2], lanes[5], w[3] * lanes[7]);
}

size_t mbma_spline4(size_t n, const double *places, const double *coefficients, const int64_t *nodes, int slopes,
                    double *out) {
    static const double ZEROS[8] = {0};
    const int64_t row = 2 * (nodes[3] + 2), plane = row * (nodes[2] + 2), cube = plane * (nodes[1] + 2);
    const size_t count = slopes ? 5 : 1; /* of each function */
    const eight none = eight_of(ZEROS);
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        weights w[4];
        bool inside = true;
        for (size_t axis = 0; axis < 4; axis++) {
            const double place = places[axis * n + k], last = (double)(nodes[axis] - 1);
            inside = inside && place >= -BEYOND && place <= last + BEYOND;
            w[axis] = weights_at(mbma_held(place, 0.0, last), nodes[axis]);
        }
        const int64_t corner = w[0].cell * cube + w[1].cell * plane + w[2].cell * row + 2 * w[3].cell;
        const double *const start = coefficients + corner;
        eight value = none, by_x = none, by_y = none, by_z = none;
        for (int a = 0; a < 4; a++) {
            eight over_y = none, slope_y = none, slope_z = none;
            for (int b = 0; b < 4; b++) {
                const double *const from = start + a * cube + b * plane;
                eight over_z = none, steep_z = none;
                for (int c = 0; c < 4; c++) {
                    const eight neighbours = eight_of(from + c * row);
                    over_z = fma8(neighbours, w[2].value[c], over_z);
                    steep_z = fma8(neighbours, w[2].slope[c], steep_z);
                }
                over_y = fma8(over_z, w[1].value[b], over_y);
                slope_y = fma8(over_z, w[1].slope[b], slope_y);
                slope_z = fma8(steep_z, w[1].value[b], slope_z);
            }
            value = fma8(over_y, w[0].value[a], value);
            by_x = fma8(over_y, w[0].slope[a], by_x);
            by_y = fma8(slope_y, w[0].value[a], by_y);
            by_z = fma8(slope_z, w[0].value[a], by_z);
        }
        const eight sums[5] = {value, by_x, by_y, by_z, value};
        for (size_t m = 0; m < count; m++) {
            double found[2];
            last_axis(m < 4 ? w[3].value : w[3].slope, sums[m], &found[0], &found[1]);
            out[m * n + k] = inside ? found[0] : NAN;
            out[(count + m) * n + k] = inside ? found[1] : NAN;
        }
        bad += !inside;
    }
    return bad;
}
