/* Spectra as sums of power laws, and sums over their wavenumbers, of `spectra.c` and `gap_flow.c`.
 */
#ifndef MBMA_SPECTRUM_SUMS_H
#define MBMA_SPECTRUM_SUMS_H

#include "elementary.h"
#include "spectra.h"

enum {
    TERMS = MBMA_INNER_TERMS,
    MOST_CELLS = MBMA_MOST_INNER_CELLS,
    MOST_STEPS = 60,
    LANES = 8,
    CHUNK = MBMA_WAVE_CHUNK
};

#define HEAVIEST 2.95   /* ln F from which u is below 1e-317 */
#define CLOSE 1e-8      /* of ln F: the next error would be about the square of this one */
#define NO_FORCE -1e300 /* ln F */
#define SPARE_CELLS 16  /* for the following steps of Newton's method */

/* ---- spectra ---- */

/* A part in ln(q/q0): where it begins and ends, C q^2 where it begins, and the power of C q^2. */
typedef struct {
    double start, end, content, power;
} part;

/* A spectrum as parts, and the places where one begins or ends. */
typedef struct {
    size_t count, edges;
    part parts[MBMA_MOST_PARTS];
    double edge[2 * MBMA_MOST_PARTS];
} sum_of_parts;

/* (exp(x) - 1)/x */
MBMA_INLINE double growth(double x) {
    const double safe = fabs(x) > 1e-30 ? x : 1e-30;
    return mbma_expm1(safe) / safe;
}

MBMA_INLINE void insert(double x, size_t *count, double *sorted) {
    size_t k = *count;
    for (size_t other = 0; other < *count; other++)
        if (fabs(sorted[other] - x) <= 1e-14 * (1.0 + fabs(x)))
            return;
    for (; k > 0 && sorted[k - 1] > x; k--)
        sorted[k] = sorted[k - 1];
    sorted[k] = x;
    ++*count;
}

/* Parts of one surface; false where they are no spectrum. */
MBMA_INLINE bool read_parts(size_t count, const double *laws, sum_of_parts *s) {
    double q0 = INFINITY, largest = 0.0;
    s->count = s->edges = 0;
    for (size_t k = 0; k < count; k++) {
        const double *const p = laws + MBMA_PART_NUMBERS * k;
        if (!(p[0] > 0.0 && p[1] < INFINITY && p[2] >= 0.0 && p[2] < INFINITY && p[3] == p[3]))
            return false;
        if (p[2] > 0.0 && p[1] > p[0]) {
            q0 = mbma_min(q0, p[0]);
            largest = mbma_max(largest, p[2] * p[0] * p[0]);
        }
    }
    for (size_t k = 0; k < count; k++) {
        const double *const p = laws + MBMA_PART_NUMBERS * k;
        if (!(p[2] > 0.0 && p[1] > p[0]))
            continue;
        const part own = {log(p[0] / q0), log(p[1] / q0), p[2] * p[0] * p[0] / largest,
                          p[3] + 2.0};
        s->parts[s->count++] = own;
        insert(own.start, &s->edges, s->edge);
        insert(own.end, &s->edges, s->edge);
    }
    return s->count > 0;
}

/* ---- sums ---- */

/* A surface that entries are computed of. Its polynomials are there from a cell on, since light
 * loads alone need those of the first cells. */
typedef struct {
    const mbma_inner *inner;
    const mbma_spectrum_numbers *numbers;
    const double *place, *fall, *share;
    size_t count, first_cell;
    double least_place, p[MOST_CELLS * TERMS];
} own_sum;

MBMA_INLINE void open_sum(own_sum *s, const mbma_inner *inner, const mbma_spectrum_numbers *numbers,
                     const double *waves) {
    s->inner = inner;
    s->numbers = numbers;
    s->count = (size_t)numbers->count;
    s->place = waves + (size_t)numbers->first;
    s->fall = s->place + s->count;
    s->share = s->fall + s->count;
    s->first_cell = inner->cells;
    s->least_place = INFINITY;
    for (size_t k = 0; k < s->count; k++)
        s->least_place = mbma_min(s->least_place, s->place[k]);
}

/* Polynomials of all cells that a force needs. */
MBMA_INLINE void fill_cells(own_sum *s, double from) {
    const mbma_inner *const inner = s->inner;
    const double last = (double)(inner->cells - 1), less = s->numbers->narrowness - inner->narrowness;
    const double first = mbma_held(from + s->least_place, 0.0, last);
    if ((size_t)first >= s->first_cell)
        return;
    const size_t begin = TERMS * (size_t)mbma_max(first - SPARE_CELLS, 0.0);
    for (size_t k = begin; k < s->first_cell * TERMS; k++)
        s->p[k] = mbma_fma(less, inner->slopes[k], inner->polynomials[k]);
    s->first_cell = begin / TERMS;
}

/* The inner integral of some wavenumbers at places among the cells, and its derivative by these. */
MBMA_INLINE void inner_integrals(const own_sum *s, const double *restrict place, double from,
                            double *restrict value, double *restrict slope) {
    const double *const restrict p = s->p;
    const double first = (double)s->first_cell, last = (double)(s->inner->cells - 1);
    int32_t word[CHUNK];
    double t[CHUNK];
    for (size_t k = 0; k < CHUNK; k++) {
        const double at = mbma_min(from + place[k], last + 1.0);
        const double cell = (double)(int32_t)mbma_held(at, first, last);
        word[k] = (int32_t)cell * TERMS;
        t[k] = 2.0 * (at - cell) - 1.0;
    }
    for (size_t k = 0; k < CHUNK; k++) {
        const double c0 = p[word[k]], c1 = p[word[k] + 1], c2 = p[word[k] + 2];
        const double c3 = p[word[k] + 3], c4 = p[word[k] + 4], c5 = p[word[k] + 5];
        slope[k] = 2.0 * mbma_horner(5.0 * c5, t[k], 4.0 * c4, 3.0 * c3, 2.0 * c2, c1);
        value[k] = mbma_fma(mbma_horner(c5, t[k], c4, c3, c2, c1), t[k], c0);
    }
}

/* Sums of eight lanes. */
MBMA_INLINE double total_of(const double sum[LANES]) {
    return ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
}

/* ln u of a surface without end, before the tail's factor, and its derivative by ln F. */
MBMA_INLINE double log_u_of(own_sum *s, double log_force, double *slope) {
    const double square = 2.0 * mbma_exp(2.0 * log_force), rate = s->inner->rate;
    double sum[LANES] = {0.0}, steep[LANES] = {0.0};
    fill_cells(s, log_force * rate);
    for (size_t begin = 0; begin < s->count; begin += CHUNK) {
        const double *const fall = s->fall + begin, *const share = s->share + begin;
        double value[CHUNK], by_place[CHUNK];
        inner_integrals(s, s->place + begin, log_force * rate, value, by_place);
        for (size_t k = 0; k < CHUNK; k++) {
            const double factor = share[k] * mbma_exp(-square * fall[k]);
            const double change = -2.0 * square * fall[k] * value[k];
            by_place[k] = factor * mbma_fma(rate, by_place[k], change);
            value[k] *= factor;
        }
        for (size_t k = 0; k < CHUNK; k += LANES)
            for (size_t l = 0; l < LANES; l++) {
                sum[l] += value[k + l];
                steep[l] += by_place[k + l];
            }
    }
    const double total = total_of(sum);
    *slope = total_of(steep) / total - 2.0 * square;
    return mbma_log(total) - square;
}

/* Decrease of ln F by the tail's factor. */
MBMA_INLINE double tail_at(const own_sum *s, double u) { return s->numbers->tail * u * u * u; }

/* u where ln F before the tail's factor, less what that takes, is `goal`: by Newton's method from a
 * guess of what it takes, which is renewed, until a step of ln F is `close`. */
MBMA_INLINE double separation_at(own_sum *s, double goal, double close, double *taken) {
    double low = -800.0, high = HEAVIEST, u = 0.0, slope, x = mbma_min(goal + *taken, HEAVIEST);
    for (int step = 0; step < MOST_STEPS && goal < HEAVIEST; step++) {
        u = mbma_exp(log_u_of(s, x, &slope));
        const double miss = x - tail_at(s, u) - goal;
        const double move = -miss / (1.0 - 3.0 * tail_at(s, u) * slope);
        *(miss > 0.0 ? &high : &low) = x;
        *taken = x + move - goal;
        /* what is left is of second order */
        if (fabs(move) <= close)
            return u * mbma_exp(slope * move);
        x = x + move > low && x + move < high ? x + move : 0.5 * (low + high);
    }
    return u;
}

#endif
