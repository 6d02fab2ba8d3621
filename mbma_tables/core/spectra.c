/* Sums over wavenumbers of many spectra; `spectra.h` has what they are, `spectrum_laws.c` the
 * theory.
 */
#include "spectrum_sums.h"

enum { NODES = 8 };

#define FARTHEST 1e80         /* u at which there is no force */
#define FINEST (1.0 / 256.0)  /* panel of ln g at the shortest waves, which carry heavy loads */
#define WIDEST 0.8            /* panel of ln g */
#define BEGINNING 2e-18       /* part of a spectrum's width in which g rises to 1e-9 */
#define DEEP 0.05             /* g, below which few nodes suffice where shares of u are small */
#define LIGHTEST -600.0       /* ln F, below which there is no energy */
#define CLOSED 1.3            /* ln F beyond which the gaps left have no energy */
#define MOST_CHANGE 6.0       /* of ln of the spectrum in a panel */

/* ---- wavenumbers ---- */

/* Gauss's rules of 2, 4, 6 and 8 nodes on [-1, 1], nodes and weights; nodes beyond have no weight. */
typedef struct {
    int count;
    double node[NODES], weight[NODES];
} gauss_rule;

static const gauss_rule RULES[] = {
    {2, {-0.5773502691896257, 0.5773502691896257}, {1.0, 1.0}},
    {4,
     {-0.8611363115940526, -0.33998104358485626, 0.33998104358485626, 0.8611363115940526},
     {0.34785484513745385, 0.6521451548625461, 0.6521451548625461, 0.34785484513745385}},
    {6,
     {-0.932469514203152, -0.6612093864662645, -0.2386191860831969, 0.2386191860831969,
      0.6612093864662645, 0.932469514203152},
     {0.1713244923791704, 0.3607615730481386, 0.467913934572691, 0.467913934572691,
      0.3607615730481386, 0.1713244923791704}},
    {8,
     {-0.9602898564975363, -0.7966664774136267, -0.525532409916329, -0.1834346424956498,
      0.1834346424956498, 0.525532409916329, 0.7966664774136267, 0.9602898564975363},
     {0.1012285362903763, 0.2223810344533745, 0.3137066458778873, 0.362683783378362,
      0.362683783378362, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763}}};

/* The parts between two of these places, from a place t on: C q^2 there and its power. */
typedef struct {
    size_t count;
    double t, content[MBMA_MOST_PARTS], power[MBMA_MOST_PARTS], steepest;
} local_parts;

static local_parts parts_from(const sum_of_parts *s, size_t segment, double t) {
    const double middle = 0.5 * (s->edge[segment] + s->edge[segment + 1]);
    local_parts found;
    found.count = 0;
    found.t = t;
    found.steepest = 0.0;
    for (size_t k = 0; k < s->count; k++) {
        const part *const own = &s->parts[k];
        if (!(own->start < middle && middle < own->end))
            continue;
        found.content[found.count] = own->content * mbma_exp(own->power * (t - own->start));
        found.power[found.count++] = own->power;
        found.steepest = mbma_max(found.steepest, fabs(own->power));
    }
    return found;
}

/* Integral of C q^(order + 1) dq over a width. */
static double integral(const local_parts *here, int order, double width) {
    double sum = 0.0;
    for (size_t k = 0; k < here->count; k++)
        sum += here->content[k] * growth((here->power[k] + order) * width);
    return sum * width * mbma_exp(order * here->t);
}

/* Moments 0, 2 and 4 but for a common factor. */
static void moments_of(const sum_of_parts *s, double moments[3]) {
    moments[0] = moments[1] = moments[2] = 0.0;
    for (size_t k = 0; k + 1 < s->edges; k++) {
        const local_parts here = parts_from(s, k, s->edge[k]);
        for (int m = 0; m < 3; m++)
            moments[m] += integral(&here, 2 * m, s->edge[k + 1] - s->edge[k]);
    }
}

/* Width of the panel that begins here, where `before` of the squared gradient `whole` is below:
 * ln g rises by 1 at most, by less towards the shortest waves, and nothing else changes much. */
static double panel_width(const local_parts *here, double left, double before, double whole) {
    if (before <= 0.0)
        return BEGINNING * mbma_min(left, 1.0);
    const double to_end = -0.5 * mbma_log(mbma_min(before / whole, 1.0));
    const double rise = mbma_max(mbma_min(0.6 * to_end, WIDEST), FINEST);
    const double wanted = before * mbma_expm1(2.0 * rise);
    double rate = 0.0, bent = 0.0;
    for (size_t k = 0; k < here->count; k++) {
        rate += here->content[k];
        bent += here->content[k] * (here->power[k] + 2.0);
    }
    const double straight = wanted / (rate * mbma_exp(2.0 * here->t));
    bent = bent / rate * straight;
    double width = straight * (bent > 1e-8 ? mbma_log1p(bent) / bent : 1.0);
    width = mbma_min(mbma_min(width, MOST_CHANGE / (here->steepest + 1.0)), left);
    while (integral(here, 2, width) > 1.5 * wanted)
        width *= 0.6;
    return left - width < 0.1 * width ? left : width;
}

/* The rule of a panel by the share of u that it has, and g at its end. */
static const gauss_rule *rule_for(double share, double g) {
    if (g > DEEP || share > 1e-3)
        return &RULES[3];
    return &RULES[share > 1e-5 ? 2 : share > 1e-7 ? 1 : 0];
}

/* Sums over wavenumbers on the way. */
typedef struct {
    double mean, inverse, variance, shares, shares_log_g;
} wave_sums;

/* Where wavenumbers are written to. */
typedef struct {
    const mbma_inner *inner;
    size_t count;
    wave_sums sums;
    double place[MBMA_MOST_WAVES], fall[MBMA_MOST_WAVES], share[MBMA_MOST_WAVES];
} wave_list;

/* Wavenumbers of a panel; `before` of the squared gradient is below it, and all is moments[1]. */
static void add_panel(const local_parts *here, double width, double before,
                      const double moments[3], const gauss_rule *rule, wave_list *list) {
    const double unit = 0.25 / sqrt(moments[0] * moments[1]), x0 = mbma_exp(here->t);
    /* g rises like the root of t */
    const double low = sqrt(here->t), high = sqrt(here->t + width);
    double rise[NODES], variance[NODES], below[NODES], content[NODES] = {0.0}, risen[NODES] = {0.0};
    double *const place = list->place + list->count, *const fall = list->fall + list->count;
    double *const share = list->share + list->count;
    for (int k = 0; k < NODES; k++) {
        const double root = 0.5 * (low + high + (high - low) * rule->node[k]);
        rise[k] = mbma_held(root * root - here->t, 0.0, width);
        variance[k] = root * (high - low) * rule->weight[k];
    }
    for (size_t part = 0; part < here->count; part++) {
        const double power = here->power[part], at_start = here->content[part];
        for (int k = 0; k < NODES; k++) {
            content[k] = mbma_fma(at_start, mbma_exp(power * rise[k]), content[k]);
            risen[k] += at_start * rise[k] * growth((power + 2.0) * rise[k]);
        }
    }
    for (int k = 0; k < NODES; k++) {
        below[k] = mbma_fma(risen[k], x0 * x0, before) / moments[1];
        variance[k] *= content[k];
    }
    for (int k = 0; k < rule->count; k++) {
        const double x = x0 * mbma_exp(rise[k]), log_g = 0.5 * mbma_log(below[k]);
        place[k] = (-log_g - list->inner->first) * list->inner->rate;
        fall[k] = mbma_max(1.0 / below[k] - 1.0, 0.0);
        share[k] = x * variance[k] * unit / sqrt(below[k]);
        list->sums.mean += variance[k] * x;
        list->sums.inverse += variance[k] / x;
        list->sums.variance += variance[k];
        list->sums.shares += share[k];
        list->sums.shares_log_g += share[k] * log_g;
    }
    list->count += (size_t)rule->count;
}

/* All wavenumbers of one surface; false where there is no room. */
static bool fill_waves(const sum_of_parts *s, const double moments[3], wave_list *list) {
    const double unit = sqrt(moments[0] * moments[1]);
    double before = 0.0;
    for (size_t segment = 0; segment + 1 < s->edges; segment++) {
        const double end = s->edge[segment + 1];
        double t = s->edge[segment];
        while (t < end) {
            const local_parts here = parts_from(s, segment, t);
            if (here.count == 0)
                break; /* a gap in the spectrum */
            const double width = panel_width(&here, end - t, before, moments[1]);
            const double after = before + integral(&here, 2, width), g = sqrt(after / moments[1]);
            const double share = (g - sqrt(before / moments[1])) * moments[1] / unit * mbma_exp(-t);
            const gauss_rule *const rule = rule_for(share, g);
            if (!(after > before) || list->count + NODES > MBMA_MOST_WAVES)
                return false;
            add_panel(&here, width, before, moments, rule, list);
            before = after;
            t = width < end - t ? t + width : end;
        }
    }
    /* what fills the last chunk has no share */
    for (; list->count > 0 && list->count % CHUNK != 0; list->count++) {
        list->place[list->count] = list->place[list->count - 1];
        list->fall[list->count] = list->share[list->count] = 0.0;
    }
    return list->count > 0;
}

/* ---- contacts ---- */

/* ln F at a mean separation before the tail's factor by Newton's method, and d ln u/d ln F. */
static double log_force_at(own_sum *s, double u, double *slope) {
    const double log_u = mbma_log(u);
    double low = NO_FORCE, high = HEAVIEST;
    /* light loads, and those at which the sum ends like a Gaussian */
    const double light = (s->numbers->light_end - u) / s->numbers->light;
    double x = mbma_min(light, 0.5 * mbma_log(mbma_max(-0.5 * log_u, 0.01)));
    x = mbma_min(x, HEAVIEST);
    for (int step = 0; step < MOST_STEPS; step++) {
        const double found = log_u_of(s, x, slope), miss = found - log_u;
        /* u is nearly linear in ln F at light loads, ln u in F^2 at heavy ones */
        const double change = u > 0.3 ? mbma_expm1(-miss) : -miss, following = x + change / *slope;
        *(miss > 0.0 ? &low : &high) = x;
        if (fabs(following - x) <= CLOSE)
            return following;
        const double middle = low > NO_FORCE ? 0.5 * (low + high) : x - 1.0;
        x = following > low && following < high ? following : middle;
    }
    return x;
}

/* Numbers of a surface from its wavenumbers; `end` is still to be found. */
static mbma_spectrum_numbers numbers_of(const wave_list *list, double first, double alpha,
                                        double h_max, const mbma_law_constants *c) {
    const mbma_inner *const inner = list->inner;
    const wave_sums *const sums = &list->sums;
    const double narrowness = sums->variance * sums->variance / (sums->mean * sums->inverse);
    const double less = narrowness - inner->narrowness;
    /* the inner integral is linear in ln y at its first place: in the middle of the cell, and by ln y */
    const double value = mbma_fma(less, inner->slopes[0], inner->polynomials[0]);
    const double slope = 2.0 * inner->rate * mbma_fma(less, inner->slopes[1], inner->polynomials[1]);
    const double middle = inner->first + 0.5 / inner->rate;
    const mbma_spectrum_numbers found = {
        .count = (double)list->count,
        .first = first,
        .narrowness = narrowness,
        .s0 = mbma_min(c->area_s0 + c->area_slope * log(alpha / 10.0), 1.0),
        .tail = c->tail * (1.0 - narrowness),
        .h_max = h_max,
        .end = -INFINITY,
        .light = mbma_max(-slope * sums->shares, 1e-300),
        .light_end = sums->shares * (value - slope * middle) - slope * sums->shares_log_g,
    };
    return found;
}

/* Wavenumbers of one surface's parts; false where they are no spectrum. */
static bool resolve(size_t parts, const double *laws, const mbma_inner *inner, wave_list *list) {
    static const wave_sums NOTHING = {0.0, 0.0, 0.0, 0.0, 0.0};
    sum_of_parts s;
    double moments[3];
    list->inner = inner;
    list->count = 0;
    list->sums = NOTHING;
    if (!read_parts(parts, laws, &s))
        return false;
    moments_of(&s, moments);
    return moments[0] > 0.0 && moments[1] > 0.0 && moments[1] < INFINITY &&
           fill_waves(&s, moments, list);
}

size_t mbma_spectra_of(size_t n, size_t parts, const double *laws, const double *alpha,
                       const double *h_max, const mbma_law_constants *constants,
                       const mbma_inner *inner, size_t words, double *waves,
                       mbma_spectrum_numbers *numbers) {
    static const mbma_spectrum_numbers NONE = {0.0, 0.0, NAN, NAN, NAN, NAN, NAN, NAN, NAN};
    size_t bad = 0, used = 0;
    wave_list list;
    own_sum own;
    for (size_t k = 0; k < n; k++) {
        bool good = h_max[k] > 0.0 && alpha[k] > 0.0 &&
                    resolve(parts, laws + MBMA_PART_NUMBERS * parts * k, inner, &list) &&
                    used + 3 * list.count <= words;
        numbers[k] = NONE;
        if (good) {
            const size_t row = list.count, bytes = row * sizeof(double);
            numbers[k] = numbers_of(&list, (double)used, alpha[k], h_max[k], constants);
            memcpy(waves + used, list.place, bytes);
            memcpy(waves + used + row, list.fall, bytes);
            memcpy(waves + used + 2 * row, list.share, bytes);
            used += 3 * row;
        }
        if (good && h_max[k] < FARTHEST) {
            double slope;
            open_sum(&own, inner, &numbers[k], waves);
            numbers[k].end = log_force_at(&own, h_max[k], &slope) - tail_at(&own, h_max[k]);
            good = numbers[k].end == numbers[k].end;
        }
        if (!good)
            numbers[k].count = 0.0;
        bad += !good;
    }
    return bad;
}

/* Whether the surface of an entry is another one than before; it is opened then. */
static bool open_owner(const mbma_spectra *spectra, const mbma_inner *inner, int64_t owner,
                       int64_t *opened, own_sum *own) {
    if (!((uint64_t)owner < spectra->count))
        return false;
    const mbma_spectrum_numbers *const numbers = &spectra->numbers[owner];
    const double words = (double)spectra->words;
    const bool inside = numbers->count > 0.0 && numbers->first >= 0.0 && numbers->count <= words &&
                        numbers->first <= words - 3.0 * numbers->count;
    if (!inside || (size_t)numbers->count % CHUNK != 0)
        return false;
    if (owner != *opened)
        open_sum(own, inner, numbers, spectra->waves);
    *opened = owner;
    return true;
}

size_t mbma_spectra_contact(const mbma_spectra *spectra, const mbma_inner *inner, size_t n,
                            const int64_t *owner, const double *u, double *force, double *area,
                            double *stiffness) {
    int64_t opened = -1;
    size_t bad = 0;
    own_sum own;
    for (size_t k = 0; k < n; k++) {
        const bool good = open_owner(spectra, inner, owner[k], &opened, &own) && u[k] == u[k];
        const double known = good ? 0.0 : NAN, gap = u[k];
        force[k] = stiffness[k] = (gap <= 0.0 ? INFINITY : 0.0) + known;
        area[k] = (gap <= 0.0 ? 1.0 : 0.0) + known;
        if (good && gap > 0.0 && gap < own.numbers->h_max && gap <= FARTHEST) {
            double slope, steep;
            const double value = log_force_at(&own, gap, &slope) - tail_at(&own, gap);
            const double endless = exp(value), F = endless * mbma_ended(own.numbers->end - value, &steep);
            const double over = F / spectra->area_t0;
            force[k] = F;
            area[k] = mbma_erf(F * sqrt(2.0 * (1.0 + over) / (own.numbers->s0 + over)));
            stiffness[k] = (3.0 * tail_at(&own, gap) / gap - 1.0 / (slope * gap)) * endless * steep;
        }
        bad += force[k] != force[k];
    }
    return bad;
}

size_t mbma_spectra_separation(const mbma_spectra *spectra, const mbma_inner *inner, size_t n,
                               const int64_t *owner, const double *force, double *u) {
    int64_t opened = -1;
    size_t bad = 0;
    own_sum own;
    for (size_t k = 0; k < n; k++) {
        const bool good = open_owner(spectra, inner, owner[k], &opened, &own) && force[k] > 0.0;
        double taken = 0.0;
        u[k] = NAN;
        if (good) {
            const double goal = mbma_endless(log(force[k]), own.numbers->end);
            u[k] = mbma_min(separation_at(&own, goal, 100.0 * CLOSE, &taken), own.numbers->h_max);
        }
        bad += u[k] != u[k];
    }
    return bad;
}

/* Integral of force from u to h_max. Over the force F without end, before the tail's factor, u is
 * a sum over wavenumbers, so that no node needs an inversion. Forces begin like the power 1.5 of
 * what F is above that at h_max, and change by orders of magnitude; over the fourth root of that
 * difference they are smooth. */
static double energy_at(own_sum *s, double u, const double *rule) {
    const mbma_spectrum_numbers *const numbers = s->numbers;
    const double h_max = numbers->h_max;
    double slope, sum = 0.0;
    const double high = u > 0.0 ? mbma_min(log_force_at(s, u, &slope), CLOSED) : CLOSED;
    const double begin = h_max < FARTHEST ? numbers->end + tail_at(s, h_max) : -INFINITY;
    const double least = mbma_exp(mbma_max(begin, LIGHTEST)), width = mbma_exp(high) - least;
    for (size_t k = 0; k < MBMA_ENERGY_NODES; k++) {
        const double place = 0.5 * (1.0 + rule[k]), cube = place * place * place;
        const double force = mbma_fma(width * cube, place, least), x = mbma_log(force);
        const double gap = mbma_exp(log_u_of(s, x, &slope)), tail = tail_at(s, gap);
        double steep;
        const double share = mbma_exp(-tail) * mbma_ended(numbers->end + tail - x, &steep);
        sum -= rule[MBMA_ENERGY_NODES + k] * cube * share * gap * slope;
    }
    return 2.0 * sum * width;
}

size_t mbma_spectra_energy(const mbma_spectra *spectra, const mbma_inner *inner,
                           const double *rule, size_t n, const int64_t *owner, const double *u,
                           double *energy) {
    int64_t opened = -1;
    size_t bad = 0;
    own_sum own;
    for (size_t k = 0; k < n; k++) {
        const bool good = open_owner(spectra, inner, owner[k], &opened, &own) && u[k] >= 0.0;
        energy[k] = good ? 0.0 : NAN;
        if (good && u[k] < mbma_min(own.numbers->h_max, FARTHEST))
            energy[k] = energy_at(&own, u[k], rule);
        bad += energy[k] != energy[k];
    }
    return bad;
}
