/* Contact whose pressure cannot exceed a hardness, from the elastic contact of the same surface.
 *
 * Lengths are in h_rms, forces in A0 E* g with g the rms gradient, hardnesses as eta = p_m/(E* g). The law is in
 * mbma_tables/laws/hardness.py: force is closed between the elastic force and the bearing curve.
 *
 * SPDX-License-Identifier: BSD-3-Clause. Copyright (c) 2026, mbma_tables contributors.
 */
#include "elementary.h"
#include "mbma.h"

static size_t count_missing(size_t n, const double *x) {
    size_t missing = 0;
    for (size_t k = 0; k < n; k++)
        missing += x[k] != x[k];
    return missing;
}

#define MOST_ETA 1e100 /* what is larger leaves the same force */
#define MOST_RATIO 1e300

size_t mbma_capped_force(size_t n, const double *elastic, const double *stiffness, const double *share,
                         const double *slope, const double *eta, double light, double by_eta, double by_share,
                         double *__restrict force, double *__restrict steepness) {
    for (size_t k = 0; k < n; k++) {
        const double own = elastic[k], Q = share[k], steep = stiffness[k], cap = eta[k], level = slope[k];
        /* NaN where an argument is; where nothing yields the level has no part */
        const double product = cap * Q, bound = cap > 0.0 ? product : NAN, full = cap == INFINITY ? cap : bound;
        const double unknown = own == own ? full : NAN, small = mbma_min(own, full), large = mbma_max(own, full);
        const double exponent = light + by_eta * mbma_min(cap, MOST_ETA) + by_share * Q;
        /* a force without bound has no weight, and what does not touch no force */
        const double quotient = large / small, ratio = small > 0.0 ? quotient : 1.0;
        const double gain = mbma_log(mbma_min(ratio, MOST_RATIO)), weight_over = mbma_exp(-exponent * gain);
        const double power = large < INFINITY ? weight_over : 0.0, weight = power / (1.0 + power);
        /* ln F lies so much below that of the smaller; derivatives by the exponent, by the elastic force, and by Q */
        const double lower = mbma_log1p(power) / exponent, by_exponent = (lower + weight * gain) / exponent;
        const double by_elastic = own <= full ? 1.0 - weight : weight;
        const double by_level = (1.0 - by_elastic) / Q + by_share * by_exponent, rising = by_level * level;
        const double falling = by_elastic * steep / own, falls = own < INFINITY ? falling : 0.0;
        const double rate = falls - (by_level > 0.0 ? rising : 0.0), met = small * mbma_exp(-lower);
        const double value = small > 0.0 ? met : 0.0, slopes = small > 0.0 ? value * rate : 0.0;
        force[k] = unknown == unknown ? value : NAN;
        steepness[k] = unknown == unknown ? slopes : NAN;
    }
    return count_missing(n, force);
}

/* ---- the gap at a force or an area ---- */

#define SETTLED 1e-7          /* of a logarithm, before the last step, whose miss would be about its square */
#define SETTLED_STEP 1e-4     /* of y, which is large where values hardly change */
#define SETTLED_BOTH 1e-14    /* of its product with the step before, where slopes are not known */
#define FARTHEST 40.0         /* step of y */
enum { AROUND = 4 };           /* places from which a step begins */
#define DISTINCT 8.881784e-16 /* relative, of gaps that rounding leaves distinct */

/* A place of the curve: ln of its value, y = ln u - ln(end - u), in which it is straight at either end of contact, and
 * the derivative of y by that logarithm. */
typedef struct {
    double value, y, rate;
} place;

static place place_of(double u, double value, double steep, double end) {
    const double rest = 1.0 - u / end;
    const place found = {log(value), log(u / rest), -value / (steep * u * rest)};
    return found;
}

static double gap_of(double y, double end) {
    const double ratio = exp(y);
    return ratio / (1.0 + ratio / end);
}

/* The step of y from a place to a value by the cubic through it and another, slopes scaled to the straight line through
 * both unless they are exact. */
static double step_to(double value, place from, place other, bool exact) {
    const double way = value - from.value, apart = from.value - other.value, mean = (from.y - other.y) / apart;
    const double scale = exact ? 1.0 : 2.0 * mean / (from.rate + other.rate), rate = scale * from.rate;
    const double second = (rate - mean) / apart, third = (second - (mean - scale * other.rate) / apart) / apart;
    const double straight = rate * way, curved = way * way * mbma_fma(third, way + apart, second);
    if (fabs(curved) <= 0.5 * fabs(straight))
        return straight + curved;
    return mean < 0.0 ? mean * way : from.rate * way;
}

static double middle(double low, double high) {
    if (high == INFINITY)
        return 2.0 * low;
    return high > 2.0 * low && low > 0.0 ? sqrt(low) * sqrt(high) : 0.5 * (low + high);
}

/* y at a value by the polynomial through places of different values and their rates, by divided differences. */
static double through(double value, const place *known, int n) {
    double d[2 * AROUND], over[AROUND][AROUND];
    for (int i = 0; i < n; i++) {
        d[2 * i] = d[2 * i + 1] = known[i].y;
        for (int j = 0; j < i; j++)
            over[i][j] = 1.0 / (known[i].value - known[j].value);
    }
    for (int order = 1; order < 2 * n; order++)
        for (int i = 2 * n - 1; i >= order; i--)
            d[i] = order == 1 && i % 2 ? known[i / 2].rate : (d[i] - d[i - 1]) * over[i / 2][(i - order) / 2];
    double y = d[2 * n - 1];
    for (int i = 2 * n - 2; i >= 0; i--)
        y = mbma_fma(y, value - known[i / 2].value, d[i]);
    return y;
}

size_t mbma_gap_start(size_t n, size_t m, size_t columns, const double *u, const double *value, const double *steep,
                      int exact, const double *wanted, const double *end, double *state) {
    for (size_t k = 0; k < n; k++) {
        double *const gap = state + k, *const low = gap + n, *const high = low + n, *const kept = high + n;
        const size_t column = columns == n ? k : 0;
        /* the branch of first contact: the first place, coming from there, at which enough is reached */
        size_t i = 0;
        while (i < m && !(value[i * columns + column] >= wanted[k]))
            i++;
        if (i < m)
            *low = u[i * columns + column];
        if (i > 0)
            *high = u[(i - 1) * columns + column];
        /* places around it whose values rise, and how many of them lie before it */
        place known[AROUND];
        int count = 0, before = 0;
        for (size_t at = i > AROUND / 2 ? i - AROUND / 2 : 0; at < m && at < i + AROUND / 2; at++) {
            const size_t own = at * columns + column;
            if (!(value[own] > 0.0 && value[own] < INFINITY))
                continue;
            known[count] = place_of(u[own], value[own], steep[own], end[k]);
            if (count == 0 || known[count].value > known[count - 1].value) {
                before += at < i;
                count++;
            }
        }
        const double goal = log(wanted[k]);
        place from = {NAN, NAN, NAN};
        if (count > 0) {
            const bool inside = before > 0 && before < count;
            const place *const light = &known[before > 0 ? before - 1 : 0], *const heavy = light + 1;
            from = inside && heavy->value - goal < goal - light->value ? *heavy : *light;
            double y = from.y + from.rate * (goal - from.value);
            if (inside) {
                const double way = (goal - light->value) / (heavy->value - light->value);
                const double straight = light->y + way * (heavy->y - light->y);
                y = exact ? through(goal, known, count) : straight;
                if (!(y <= light->y && y >= heavy->y))
                    y = straight;
            }
            *gap = gap_of(from.y + mbma_held(y - from.y, -FARTHEST, FARTHEST), end[k]);
        }
        if (!(*gap > *low && *gap < *high))
            *gap = middle(*low, *high);
        kept[0] = from.value;
        kept[n] = from.y;
        kept[2 * n] = from.rate;
    }
    return count_missing(n, state);
}

size_t mbma_gap_step(size_t n, const double *value, const double *steep, int exact, const int64_t *places, size_t total,
                     const double *wanted, const double *end, double *state, uint8_t *left) {
    size_t missed = 0;
    for (size_t k = 0; k < n; k++) {
        left[k] = 0;
        if (!(places[k] >= 0 && (uint64_t)places[k] < total)) {
            missed++;
            continue;
        }
        const size_t own = (size_t)places[k];
        double *const gap = state + own, *const low = gap + total, *const high = low + total;
        double *const kept = high + total;
        const double u = *gap, miss = log(value[k] / wanted[own]);
        const place at = place_of(u, value[k], steep[k], end[own]);
        if (miss != miss || !(u > 0.0)) {
            *gap = NAN;
            missed++;
            continue;
        }
        *(miss > 0.0 ? low : high) = u;
        const place before = {kept[0], kept[total], kept[2 * total]};
        const bool known = before.y == before.y && before.value != at.value && fabs(at.value) < INFINITY;
        /* the miss itself has more digits than the difference of logarithms */
        const place here = {0.0, at.y, at.rate}, other = {before.value - at.value, before.y, before.rate};
        const double step = known ? step_to(-miss, here, other, exact != 0) : -miss * at.rate;
        double following = u * exp(mbma_held(step, -FARTHEST, FARTHEST));
        following /= 1.0 + (following - u) / end[own];
        const bool known_well = exact || fabs(miss * (before.value - at.value)) <= SETTLED_BOTH;
        const bool near = fabs(miss) <= SETTLED && fabs(step) <= SETTLED_STEP && known_well;
        if (near)
            following = mbma_held(following, *low, *high);
        else if (!(following > *low && following < *high))
            following = middle(*low, *high);
        left[k] = !(near || *high - *low <= DISTINCT * *high || following == u);
        *gap = following;
        kept[0] = at.value;
        kept[total] = at.y;
        kept[2 * total] = at.rate;
    }
    return missed;
}
