/* Islands by the paper's four numbers: the spline of the four-number table. */
#include "eight.h"
#include "mbma.h"

#define BEYOND 1e-9 /* of a cell: largest rounding error of a place beyond the ends of its axis */

typedef struct {
    int64_t cell;
    double value[4]; /* cardinal cubic B-splines that reach the cell */
} weights;

/* Of a place inside [0, nodes - 1]; the last node belongs to the last cell. */
MBMA_INLINE weights weights_at(double place, int64_t nodes) {
    const int64_t whole = (int64_t)place, cell = whole < nodes - 2 ? whole : nodes - 2;
    const double u = place - (double)cell, v = 1.0 - u, u2 = u * u, v2 = v * v;
    return (weights){
        cell, {v2 * v / 6.0, 2.0 / 3.0 - u2 * (1.0 - 0.5 * u), 2.0 / 3.0 - v2 * (1.0 - 0.5 * v), u2 * u / 6.0}};
}

size_t mbma_spline4(size_t n, const double *places, const double *coefficients, const int64_t *nodes, double *out) {
    static const double ZEROS[8] = {0};
    const int64_t row = 2 * (nodes[3] + 2), plane = row * (nodes[2] + 2), cube = plane * (nodes[1] + 2);
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        weights w[4];
        bool inside = true;
        for (size_t axis = 0; axis < 4; axis++) {
            const double place = places[axis * n + k], last = (double)(nodes[axis] - 1);
            inside = inside && place >= -BEYOND && place <= last + BEYOND;
            w[axis] = weights_at(mbma_held(place, 0.0, last), nodes[axis]);
        }
        const double *const start = coefficients + w[0].cell * cube + w[1].cell * plane + w[2].cell * row + 2 * w[3].cell;
        eight value = eight_of(ZEROS);
        for (int a = 0; a < 4; a++) {
            eight over_y = eight_of(ZEROS);
            for (int b = 0; b < 4; b++) {
                const double *const from = start + a * cube + b * plane;
                eight over_z = eight_of(ZEROS);
                for (int c = 0; c < 4; c++)
                    over_z = fma8(eight_of(from + c * row), w[2].value[c], over_z);
                over_y = fma8(over_z, w[1].value[b], over_y);
            }
            value = fma8(over_y, w[0].value[a], value);
        }
        /* along the last axis, four coefficients of both functions */
        const double *const last = w[3].value;
        double lanes[8];
        memcpy(lanes, &value, sizeof lanes);
        for (size_t f = 0; f < 2; f++) {
            const double found = mbma_fma(last[0], lanes[f], last[1] * lanes[2 + f]) +
                                 mbma_fma(last[2], lanes[4 + f], last[3] * lanes[6 + f]);
            out[f * n + k] = inside ? found : NAN;
        }
        bad += !inside;
    }
    return bad;
}
