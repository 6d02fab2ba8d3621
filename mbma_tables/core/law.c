/* Contact laws: quantities at a gap, the gap at a force or area, and leakage. */
#include "elementary.h"
#include "mbma.h"

enum { CHUNK = 256, STEPS = 200, INVERSE_BITS = 2 };
enum { RECORD = sizeof(mbma_law_record) / sizeof(double) };
static const double SURE = 3e-6;     /* step, in half records, below which another would change nothing */
static const double EPSILON = 4e-16; /* steps that another would not shorten */

mbma_law mbma_law_open(const void *block, size_t words) {
    const size_t begin = sizeof(mbma_law_head) / sizeof(double);
    const mbma_law_head *const head = (const mbma_law_head *)block;
    const mbma_law none = {NULL, NULL, NULL, 0};
    if (block == NULL || words < begin || head->first_word < (int64_t)begin || (uint64_t)head->first_word >= words)
        return none;
    const size_t first = (size_t)head->first_word;
    const int64_t rows = (int64_t)((first - begin) / 2);
    /* every x is held in [low, high], whose exponents are those of the rows */
    if ((words - first) % RECORD != 0 || head->minus_rows < 0 || head->minus_rows > rows || head->exponent < 0 ||
        !(head->low >= 0.0 && head->low <= head->high && head->high < 2.0) ||
        head->exponent > mbma_bits(head->low) >> 52 ||
        (mbma_bits(head->high) >> 52) - head->exponent >= rows - head->minus_rows)
        return none;
    const mbma_law law = {head, (const mbma_law_row *)(const void *)(head + 1),
                          (const mbma_law_record *)(const void *)((const double *)block + first),
                          (int64_t)((words - first) / RECORD) - 1};
    return law;
}

/* Position of a gap in a law: its record, t, q = -s scale rate, and t/q. */
typedef struct {
    const mbma_law_record *record;
    double t, q, beyond;
} place;

MBMA_INLINE double side_of(const mbma_law_head *head, double d) { return d < 0.0 ? head->minus : head->plus; }

/* x of a separation */
MBMA_INLINE double depth(const mbma_law_head *head, double d) {
    return (head->h_max + side_of(head, d) * d) * head->scale;
}

MBMA_INLINE place place_in(const mbma_law_head *head, const mbma_law_record *record, double x, double side) {
    const double beyond = x - record->centre;
    const place found = {record, beyond * record->rate, -side * head->scale * record->rate,
                         -side * beyond * (1.0 / head->scale)};
    return found;
}

MBMA_INLINE int64_t number_held(int64_t number, int64_t last) {
    const int64_t most = number < last ? number : last;
    return most > 0 ? most : 0;
}

/* The record of a gap whose x is known better than its d, from `low` on. */
MBMA_INLINE int64_t number_of(const mbma_law *law, double x, double d) {
    const mbma_law_head *const head = law->head;
    const int64_t bits = mbma_bits(x);
    const mbma_law_row *const row = &law->rows[(bits >> 52) - head->exponent + (d < 0.0 ? head->minus_rows : 0)];
    return number_held((bits >> (row->shift & 63)) + row->base + (d * head->kink_sign > head->kink) +
                           (d * head->kink_sign_2 > head->kink_2),
                       law->last);
}

/* Its place; below `low` that of `low`. */
MBMA_INLINE place place_of(const mbma_law *law, double x, double d) {
    const double inside = mbma_held(x, law->head->low, law->head->high);
    return place_in(law->head, &law->records[number_of(law, inside, d)], inside, side_of(law->head, d));
}

/* A polynomial, its derivative, and half of the second; unused values are not computed. */
typedef struct {
    double value, slope, bend;
} taylor;

MBMA_INLINE taylor polynomial(const double *c, double t) {
    taylor at = {c[MBMA_LAW_DEGREE], 0.0, 0.0};
    for (int k = MBMA_LAW_DEGREE - 1; k >= 0; k--) {
        at.bend = mbma_fma(at.bend, t, at.slope);
        at.slope = mbma_fma(at.slope, t, at.value);
        at.value = mbma_fma(at.value, t, c[k]);
    }
    return at;
}

MBMA_INLINE bool of_area(mbma_quantity what) { return what == MBMA_AREA || what == MBMA_AREA_SLOPE; }

MBMA_INLINE taylor taylor_of(mbma_quantity what, const mbma_law_record *record, double t) {
    return polynomial(of_area(what) ? record->area : record->force, t);
}

/* Sum of c[k] t^k/(power + k); even and odd k separately, as independent sums. */
MBMA_INLINE double integral(const double *c, double t, double power) {
    const double square = t * t;
    double even = c[MBMA_LAW_DEGREE] * (1.0 / (power + (double)MBMA_LAW_DEGREE)), odd = 0.0;
    for (int k = MBMA_LAW_DEGREE - 1; k > 0; k -= 2) {
        odd = mbma_fma(odd, square, c[k] * (1.0 / (power + k)));
        even = mbma_fma(even, square, c[k - 1] * (1.0 / (power + k - 1)));
    }
    return mbma_fma(t, odd, even);
}

/* A quantity of t^power times the polynomial. */
MBMA_INLINE double quantity_at(mbma_quantity what, place p, double power) {
    const bool plain = power == 0.0;
    const double t = p.t;
    if (what == MBMA_ENERGY) {
        const double beyond = plain ? p.beyond : pow(t, power) * p.beyond;
        return 0.5 * mbma_fma(beyond, integral(p.record->force, t, 1.0 + power), p.record->energy);
    }
    const taylor at = taylor_of(what, p.record, t);
    if (what == MBMA_FORCE || what == MBMA_AREA)
        return plain ? at.value : pow(t, power) * at.value;
    if (what == MBMA_CURVATURE) {
        const double last = power * (power - 1.0) * at.value;
        const double more = 2.0 * t * (at.bend * t + power * at.slope);
        return 4.0 * p.q * p.q * (plain ? 2.0 * at.bend : pow(t, power - 2.0) * (more + last));
    }
    const double slope = (plain ? at.slope : pow(t, power - 1.0) * (t * at.slope + power * at.value)) * p.q;
    return what == MBMA_STIFFNESS ? 2.0 * slope : slope;
}

static double at_place(const mbma_law *law, mbma_quantity what, double x, double d) {
    const mbma_law_head *const head = law->head;
    if (!(head->lowest <= d && d <= head->highest))
        return (double)NAN;
    if (!(x < head->low))
        return quantity_at(what, place_of(law, x, d), 0.0);
    const double power = of_area(what) ? head->power_area : head->power_force;
    return x <= 0.0 && head->ends ? 0.0 : quantity_at(what, place_in(head, law->records, x, head->plus), power);
}

double mbma_law_at(const mbma_law *law, mbma_quantity what, double d) {
    return at_place(law, what, depth(law->head, d), d);
}

/* x of an overclosure and its separation, without cancellation next to first contact */
MBMA_INLINE double depth_of_overclosure(const mbma_law_head *head, double c, double d) {
    return side_of(head, d) < 0.0 ? 2.0 * c * head->scale : depth(head, d);
}

double mbma_law_at_overclosure(const mbma_law *law, mbma_quantity what, double c) {
    const double d = law->head->h_max - 2.0 * c;
    return law->head->ends && c <= 0.0 ? 0.0 : at_place(law, what, depth_of_overclosure(law->head, c, d), d);
}

double mbma_law_and_slope(const mbma_law *law, mbma_quantity which, double c, double *by_c) {
    const bool area = which == MBMA_AREA;
    *by_c = mbma_law_at_overclosure(law, area ? MBMA_AREA_SLOPE : MBMA_STIFFNESS, c) * (area ? 2.0 : 1.0);
    return mbma_law_at_overclosure(law, which, c);
}

/* Places of a chunk of gaps, by member. */
typedef struct {
    const mbma_law_record *record[CHUNK];
    double t[CHUNK], q[CHUNK], beyond[CHUNK];
} places;

/* Force or area and its slope at places, as far as they are wanted. */
MBMA_INLINE void fill_pair(mbma_quantity which, const places *at, size_t n, double *value, double *slope) {
    for (size_t k = 0; k < n && slope; k++) {
        const taylor found = taylor_of(which, at->record[k], at->t[k]);
        if (value)
            value[k] = found.value;
        slope[k] = (which == MBMA_AREA ? 1.0 : 2.0) * (found.slope * at->q[k]);
    }
    for (size_t k = 0; k < n && value && !slope; k++)
        value[k] = taylor_of(which, at->record[k], at->t[k]).value;
}

size_t mbma_law_fill(size_t n, const double *d, const mbma_law *law, double *force, double *area, double *stiffness,
                     double *area_slope, double *energy) {
    const mbma_law_head head = *law->head;
    double *const out[] = {force, area, stiffness, area_slope, energy};
    size_t all_bad = 0;
    places at;
    for (size_t first = 0; first < n; first += CHUNK) {
        const size_t some = n - first < (size_t)CHUNK ? n - first : (size_t)CHUNK;
        const double *const gap = d + first;
        size_t bad = 0, below = 0;
        for (size_t k = 0; k < some; k++) {
            const double x = depth(&head, gap[k]);
            const place p = place_of(law, x, gap[k]);
            at.record[k] = p.record, at.t[k] = p.t, at.q[k] = p.q, at.beyond[k] = p.beyond;
            bad += !(head.lowest <= gap[k] && gap[k] <= head.highest);
            below += x < head.low;
        }
        fill_pair(MBMA_FORCE, &at, some, force ? force + first : NULL, stiffness ? stiffness + first : NULL);
        fill_pair(MBMA_AREA, &at, some, area ? area + first : NULL, area_slope ? area_slope + first : NULL);
        for (size_t k = 0; k < some && energy; k++) {
            const mbma_law_record *const record = at.record[k];
            energy[first + k] = 0.5 * mbma_fma(at.beyond[k], integral(record->force, at.t[k], 1.0), record->energy);
        }
        /* no branch above: entries of the first record, and outside the law, are corrected here */
        for (size_t k = 0; k < some && bad + below > 0; k++)
            if (!(depth(&head, gap[k]) >= head.low && head.lowest <= gap[k] && gap[k] <= head.highest))
                for (int what = MBMA_FORCE; what <= MBMA_ENERGY; what++)
                    if (out[what])
                        out[what][first + k] = mbma_law_at(law, (mbma_quantity)what, gap[k]);
        all_bad += bad;
    }
    return all_bad;
}

double mbma_law_overclosure(const mbma_law *law, mbma_quantity which, double wanted, double low, double high) {
    const bool ends = law->head->ends != 0;
    const double first = low, last = high;
    double c = 0.5 * (low + high), before = (double)INFINITY;
    if (!(wanted > 0.0))
        return low;
    for (int n = 0; n < STEPS; n++) {
        double slope;
        const double value = mbma_law_and_slope(law, which, c, &slope);
        *(value < wanted ? &low : &high) = c;
        /* Newton's on the logarithm: loads range over many decades, where contact ends as powers of c */
        const double step = value * log(wanted / value) / slope, next = ends ? c * exp(step / c) : c + step;
        if (slope > 0.0 && fabs(next - c) <= EPSILON * (ends ? c : law->head->h_max)) {
            c = mbma_held(next, low, high);
            break;
        }
        /* steps that do not halve may oscillate forever */
        const bool good = slope > 0.0 && low < next && next < high && fabs(next - c) <= 0.5 * before;
        const double follows = good ? next : 0.5 * (low + high);
        if (follows == c || follows == low || follows == high)
            break;
        before = fabs(follows - c);
        c = follows;
    }
    /* the best of these; ends may be full compression or first contact */
    const double tried[] = {c, first, last};
    double best = c, least = (double)INFINITY;
    for (int k = 0; k < 3; k++) {
        const double missed = fabs(mbma_law_at_overclosure(law, which, tried[k]) - wanted);
        if (missed < least)
            best = tried[k], least = missed;
    }
    return best;
}

/* The same from first contact, or where the law begins, down to the separation `end`. */
static double overclosure(const mbma_law *law, mbma_quantity which, double wanted, double end) {
    const mbma_law_head *const head = law->head;
    const double low = head->ends ? 0.0 : 0.5 * (head->h_max - head->highest);
    return mbma_law_overclosure(law, which, wanted, low, 0.5 * (head->h_max - end));
}

size_t mbma_inverse_nodes(size_t n, const double *wanted, const mbma_law *law, mbma_quantity which, double end,
                          double *x, double *side) {
    for (size_t k = 0; k < n; k++) {
        const double c = overclosure(law, which, wanted[k], end), d = law->head->h_max - 2.0 * c;
        x[k] = depth_of_overclosure(law->head, c, d);
        side[k] = side_of(law->head, d);
    }
    return 0;
}

/* Each by a polynomial and one step of third order; iteration finds those for which one step may not be enough. Loops
 * of their own find records, which vectorises, and keep more entries in flight. */
size_t mbma_law_invert(size_t n, const double *wanted, const mbma_law *law, const mbma_inverse *inverse, size_t count,
                       mbma_quantity which, double *d, double *area, double *stiffness) {
    const mbma_law_head head = *law->head;
    const mbma_inverse of = *inverse;
    const double width = 1.0 / head.scale;
    size_t bad = 0;
    for (size_t first = 0, some; first < n; first += some) {
        const mbma_inverse_record *guesses[CHUNK];
        const double *const y0 = wanted + first;
        double guessed[CHUNK], *const found = d + first;
        bool unsure = false;
        places at;
        some = n - first < (size_t)CHUNK ? n - first : (size_t)CHUNK;
        for (size_t k = 0; k < some; k++) {
            const double inside = mbma_held(y0[k], of.low, of.high);
            const int64_t number = (mbma_bits(inside) >> (52 - INVERSE_BITS)) - of.first_bucket + (inside > of.turn);
            guesses[k] = &inverse->records[number_held(number, (int64_t)count - 1)];
            at.t[k] = (inside - guesses[k]->centre) * guesses[k]->rate;
        }
        for (size_t k = 0; k < some; k++) {
            double x = guesses[k]->x[MBMA_INVERSE_DEGREE];
            for (int j = MBMA_INVERSE_DEGREE - 1; j >= 0; j--)
                x = mbma_fma(x, at.t[k], guesses[k]->x[j]);
            at.beyond[k] = mbma_held(x, head.low, head.high);
            guessed[k] = (at.beyond[k] * width - head.h_max) * guesses[k]->side;
        }
        for (size_t k = 0; k < some; k++) {
            const place p = place_of(law, at.beyond[k], guessed[k]);
            at.record[k] = p.record, at.t[k] = p.t, at.q[k] = p.q;
        }
        for (size_t k = 0; k < some; k++) {
            const mbma_law_record *const record = at.record[k];
            const double t = at.t[k], q = at.q[k];
            const taylor y = taylor_of(which, record, t);
            const double per_slope = 1.0 / y.slope, newton = (y0[k] - y.value) * per_slope;
            const double step = newton - y.bend * per_slope * newton * newton;
            const bool sure = fabs(step) < SURE && y0[k] >= of.low && y0[k] <= of.high;
            unsure |= !sure;
            found[k] = sure ? mbma_max(guessed[k] - step / q, of.end) : (double)NAN;
            if (area)
                area[first + k] = polynomial(record->area, t + step).value;
            if (stiffness) {
                const taylor force = which == MBMA_AREA ? polynomial(record->force, t) : y;
                stiffness[first + k] = 2.0 * (force.slope + 2.0 * force.bend * step) * q;
            }
        }
        for (size_t k = 0; unsure && k < some; k++)
            if (isnan(found[k])) {
                const bool good = of.least <= y0[k] && y0[k] <= of.high;
                bad += !good;
                if (good)
                    found[k] = mbma_max(head.h_max - 2.0 * overclosure(law, which, y0[k], of.end), of.end);
                if (area)
                    area[first + k] = mbma_law_at(law, MBMA_AREA, found[k]);
                if (stiffness)
                    stiffness[first + k] = mbma_law_at(law, MBMA_STIFFNESS, found[k]);
            }
    }
    return bad;
}

double mbma_law_flow(const mbma_law *flow, double h_max, double h_rms, double d, double *by_c) {
    const double u = 0.5 * (h_max + d), v = u / h_rms * (u / h_rms), w = v + 4.0;
    const bool open = d > flow->head->highest && d < (double)INFINITY;
    if (by_c)
        *by_c = open ? -3.0 * u * u * (1.0 - 1.5 / w + v / (w * w)) : mbma_law_at(flow, MBMA_STIFFNESS, d);
    return open ? u * u * u * mbma_wide_gap(u / h_rms) : mbma_law_at(flow, MBMA_FORCE, d);
}
