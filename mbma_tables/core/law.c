/* Contact laws: quantities at a gap, the gap at a force or area, leakage, and the fit of a law's polynomials. */
#include <math.h>
#include <string.h>

#include "elementary.h"
#include "mbma.h"

enum { CHUNK = 256, STEPS = 200, KEPT = MBMA_LAW_DEGREE + 1, INVERSE_BITS = 2 };
static const double SURE = 3e-6;     /* steps, in halves of a record, after which another would change nothing */
static const double EPSILON = 4e-16; /* steps that another would not shorten */
static const double NARROW = 1e-7;   /* relative width of an interval that is too narrow to tell its errors */

int mbma_law_open(const void *block, size_t words, mbma_law *law) {
    const size_t head_words = sizeof(mbma_law_head) / sizeof(double), row_words = 2;
    const size_t record_words = sizeof(mbma_law_record) / sizeof(double);
    const mbma_law_head *const head = (const mbma_law_head *)block;
    memset(law, 0, sizeof *law);
    if (block == NULL || words < head_words || head->first_word < (int64_t)head_words || head->minus_rows < 0 ||
        (uint64_t)head->first_word >= words || (words - (size_t)head->first_word) % record_words != 0)
        return 0;
    const int64_t rows = (head->first_word - (int64_t)head_words) / (int64_t)row_words;
    /* every x is held in [low, high], whose exponents are those of the rows */
    if (!(head->low >= 0.0 && head->low <= head->high && head->high < 2.0) || head->minus_rows > rows ||
        head->exponent > mbma_bits(head->low) >> 52 || head->exponent < 0 ||
        (mbma_bits(head->high) >> 52) - head->exponent >= rows - head->minus_rows)
        return 0;
    law->head = head;
    law->rows = (const mbma_law_row *)(const void *)(head + 1);
    law->records = (const mbma_law_record *)(const void *)((const double *)block + head->first_word);
    law->last = (int64_t)((words - (size_t)head->first_word) / record_words) - 1;
    return 1;
}

/* Where a gap is in a law: its record, t, q = -s scale rate, and t/q. */
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

/* The record of a gap whose x is known better than its d, from `low` on. */
MBMA_INLINE int64_t number_of(const mbma_law *law, double x, double d) {
    const mbma_law_head *const head = law->head;
    const int64_t bits = mbma_bits(x);
    const mbma_law_row *const row = &law->rows[(bits >> 52) - head->exponent + (d < 0.0 ? head->minus_rows : 0)];
    const int64_t number = (bits >> (row->shift & 63)) + row->base + (d * head->kink_sign > head->kink) +
                           (d * head->kink_sign_2 > head->kink_2);
    const int64_t most = number < law->last ? number : law->last;
    return most > 0 ? most : 0;
}

/* Its place; below `low` that of `low`. */
MBMA_INLINE place place_of(const mbma_law *law, double x, double d) {
    const double inside = mbma_held(x, law->head->low, law->head->high);
    return place_in(law->head, &law->records[number_of(law, inside, d)], inside, side_of(law->head, d));
}

/* A polynomial, its derivative, and half of the second; what is not used is not computed. */
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

/* Sum of c[k] t^k/(power + k); even and odd k apart, whose sums do not wait for each other. */
MBMA_INLINE double integral(const double *c, double t, double power) {
    const double square = t * t;
    double even = c[MBMA_LAW_DEGREE] * (1.0 / (power + (double)MBMA_LAW_DEGREE)), odd = 0.0;
    for (int k = MBMA_LAW_DEGREE - 1; k > 0; k -= 2) {
        odd = mbma_fma(odd, square, c[k] * (1.0 / (power + k)));
        even = mbma_fma(even, square, c[k - 1] * (1.0 / (power + k - 1)));
    }
    return mbma_fma(t, odd, even);
}

MBMA_INLINE bool of_area(mbma_quantity what) { return what == MBMA_AREA || what == MBMA_AREA_SLOPE; }

/* A quantity of t^power times the polynomial. */
MBMA_INLINE double quantity_at(mbma_quantity what, place p, double power) {
    const bool plain = power == 0.0;
    const double t = p.t;
    if (what == MBMA_ENERGY) {
        const double beyond = plain ? p.beyond : pow(t, power) * p.beyond;
        return 0.5 * mbma_fma(beyond, integral(p.record->force, t, 1.0 + power), p.record->energy);
    }
    const taylor at = polynomial(of_area(what) ? p.record->area : p.record->force, t);
    if (what == MBMA_FORCE || what == MBMA_AREA)
        return plain ? at.value : pow(t, power) * at.value;
    if (what == MBMA_CURVATURE) {
        const double last = power * (power - 1.0) * at.value;
        const double more = 2.0 * t * (at.bend * t + power * at.slope);
        const double bend = plain ? 2.0 * at.bend : pow(t, power - 2.0) * (more + last);
        return 4.0 * p.q * p.q * bend;
    }
    const double slope = (plain ? at.slope : pow(t, power - 1.0) * (t * at.slope + power * at.value)) * p.q;
    return what == MBMA_STIFFNESS ? 2.0 * slope : slope;
}

/* The same below `low`. */
static double in_first_record(const mbma_law *law, mbma_quantity what, double x) {
    const mbma_law_head *const head = law->head;
    if (x <= 0.0 && head->ends)
        return 0.0;
    const double power = of_area(what) ? head->power_area : head->power_force;
    return quantity_at(what, place_in(head, law->records, x, head->plus), power);
}

MBMA_INLINE double at(const mbma_law *law, mbma_quantity what, double x, double d) {
    if (!(law->head->lowest <= d && d <= law->head->highest))
        return (double)NAN;
    return x < law->head->low ? in_first_record(law, what, x) : quantity_at(what, place_of(law, x, d), 0.0);
}

static double at_place(const mbma_law *law, mbma_quantity what, double x, double d) {
    switch (what) {
    case MBMA_FORCE: return at(law, MBMA_FORCE, x, d);
    case MBMA_AREA: return at(law, MBMA_AREA, x, d);
    case MBMA_STIFFNESS: return at(law, MBMA_STIFFNESS, x, d);
    case MBMA_AREA_SLOPE: return at(law, MBMA_AREA_SLOPE, x, d);
    case MBMA_ENERGY: return at(law, MBMA_ENERGY, x, d);
    case MBMA_CURVATURE: return at(law, MBMA_CURVATURE, x, d);
    }
    return (double)NAN;
}

double mbma_law_at(const mbma_law *law, mbma_quantity what, double d) {
    return at_place(law, what, depth(law->head, d), d);
}

/* x of an overclosure and its separation, with all digits next to first contact */
MBMA_INLINE double depth_of_overclosure(const mbma_law_head *head, double c, double d) {
    return side_of(head, d) < 0.0 ? 2.0 * c * head->scale : depth(head, d);
}

double mbma_law_at_overclosure(const mbma_law *law, mbma_quantity what, double c) {
    const double d = law->head->h_max - 2.0 * c;
    return law->head->ends && c <= 0.0 ? 0.0 : at_place(law, what, depth_of_overclosure(law->head, c, d), d);
}

double mbma_law_and_slope(const mbma_law *law, mbma_quantity which, double c, double *by_c) {
    const mbma_law_head *const head = law->head;
    const double d = head->h_max - 2.0 * c, x = depth_of_overclosure(head, c, d);
    *by_c = 0.0;
    if (head->ends && c <= 0.0)
        return 0.0;
    if (!(head->low <= x && head->lowest <= d && d <= head->highest)) {
        *by_c = which == MBMA_AREA ? 2.0 * at_place(law, MBMA_AREA_SLOPE, x, d) : at_place(law, MBMA_STIFFNESS, x, d);
        return at_place(law, which, x, d);
    }
    const place p = place_of(law, x, d);
    const taylor found = polynomial(which == MBMA_AREA ? p.record->area : p.record->force, p.t);
    *by_c = 2.0 * (found.slope * p.q);
    return found.value;
}

/* Places of a chunk of gaps, by member. */
typedef struct {
    const mbma_law_record *record[CHUNK];
    double t[CHUNK], q[CHUNK], beyond[CHUNK];
} places;

/* A value and its slope at each place, as far as they are wanted; the slope times a factor. */
MBMA_INLINE void fill_pair(mbma_quantity what, const places *at, size_t n, double *value, double factor,
                           double *slope) {
    if (slope == NULL) {
        for (size_t k = 0; k < n && value != NULL; k++) {
            const mbma_law_record *const record = at->record[k];
            value[k] = polynomial(what == MBMA_AREA ? record->area : record->force, at->t[k]).value;
        }
        return;
    }
    for (size_t k = 0; k < n; k++) {
        const mbma_law_record *const record = at->record[k];
        const taylor found = polynomial(what == MBMA_AREA ? record->area : record->force, at->t[k]);
        if (value != NULL)
            value[k] = found.value;
        slope[k] = factor * (found.slope * at->q[k]);
    }
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
        fill_pair(MBMA_FORCE, &at, some, force ? force + first : NULL, 2.0, stiffness ? stiffness + first : NULL);
        fill_pair(MBMA_AREA, &at, some, area ? area + first : NULL, 1.0, area_slope ? area_slope + first : NULL);
        for (size_t k = 0; k < some && energy != NULL; k++) {
            const mbma_law_record *const record = at.record[k];
            energy[first + k] = 0.5 * mbma_fma(at.beyond[k], integral(record->force, at.t[k], 1.0), record->energy);
        }
        /* no branch above: entries of the first record, and outside the law, are mended here */
        for (size_t k = 0; k < some && bad + below > 0; k++)
            if (!(depth(&head, gap[k]) >= head.low && head.lowest <= gap[k] && gap[k] <= head.highest))
                for (int what = MBMA_FORCE; what <= MBMA_ENERGY; what++)
                    if (out[what] != NULL)
                        out[what][first + k] = mbma_law_at(law, (mbma_quantity)what, gap[k]);
        all_bad += bad;
    }
    return all_bad;
}

size_t mbma_law_records(size_t n, const double *x, const double *d, const mbma_law *law, int64_t *record) {
    const mbma_law_head *const head = law->head;
    for (size_t k = 0; k < n; k++)
        record[k] = x[k] < head->low ? 0 : number_of(law, mbma_held(x[k], head->low, head->high), d[k]);
    return 0;
}

double mbma_law_overclosure(const mbma_law *law, mbma_quantity which, double wanted, double low, double high) {
    const bool ends = law->head->ends != 0;
    const double ends_of[] = {low, high};
    double c = 0.5 * (low + high), before = (double)INFINITY;
    if (!(wanted > 0.0))
        return low;
    for (int n = 0; n < STEPS; n++) {
        double slope;
        const double value = mbma_law_and_slope(law, which, c, &slope);
        if (value < wanted)
            low = c;
        else
            high = c;
        /* Newton's on the logarithm: loads range over many decades, where contact ends as powers of c */
        const double step = value * log(wanted / value) / slope, next = ends ? c * exp(step / c) : c + step;
        if (slope > 0.0 && fabs(next - c) <= EPSILON * (ends ? c : law->head->h_max)) {
            c = mbma_held(next, low, high);
            break;
        }
        /* steps that do not halve may go to and fro for ever */
        const bool good = slope > 0.0 && low < next && next < high && fabs(next - c) <= 0.5 * before;
        const double follows = good ? next : 0.5 * (low + high);
        before = fabs(follows - c);
        if (follows == c || follows == low || follows == high)
            break;
        c = follows;
    }
    /* the best of these; ends may be full compression or first contact */
    double best = c, missed = fabs(mbma_law_at_overclosure(law, which, c) - wanted);
    for (int k = 0; k < 2; k++) {
        const double other = fabs(mbma_law_at_overclosure(law, which, ends_of[k]) - wanted);
        if (other < missed)
            best = ends_of[k], missed = other;
    }
    return best;
}

/* The same from first contact, or where the law begins, down to the separation `end`. */
static double overclosure(const mbma_law *law, mbma_quantity which, double wanted, double end) {
    const mbma_law_head *const head = law->head;
    const double low = head->ends ? 0.0 : 0.5 * (head->h_max - head->highest);
    return mbma_law_overclosure(law, which, wanted, low, 0.5 * (head->h_max - end));
}

int mbma_inverse_open(const void *block, size_t words, mbma_inverse *inverse) {
    const size_t head_words = sizeof(mbma_inverse_head) / sizeof(double);
    const size_t record_words = sizeof(mbma_inverse_record) / sizeof(double);
    memset(inverse, 0, sizeof *inverse);
    if (block == NULL || words < head_words + record_words || (words - head_words) % record_words != 0)
        return 0;
    inverse->head = (const mbma_inverse_head *)block;
    inverse->records = (const mbma_inverse_record *)(const void *)(inverse->head + 1);
    inverse->last = (int64_t)((words - head_words) / record_words) - 1;
    return 1;
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

/* Each by a polynomial and one step of third order; iteration finds those for which one step may not be enough. Loops of
 * their own find records, which vectorises, and keep more entries in flight. */
MBMA_INLINE size_t invert(const mbma_law *law, const mbma_inverse *inverse, mbma_quantity which, bool more, size_t n,
                          const double *wanted, double *gap, double *area, double *stiffness) {
    const mbma_law_head head = *law->head;
    const mbma_inverse_head of = *inverse->head;
    const mbma_inverse_record *guesses[CHUNK];
    double width = 1.0 / head.scale, guessed[CHUNK], d[CHUNK], by_area[CHUNK], by_force[CHUNK];
    places at;
    size_t bad = 0, unsure = 0;
    for (size_t k = 0; k < n; k++) {
        const double inside = mbma_held(wanted[k], of.low, of.high);
        const int64_t number = (mbma_bits(inside) >> (52 - INVERSE_BITS)) - of.first_bucket + (inside > of.turn);
        const int64_t most = number < inverse->last ? number : inverse->last;
        guesses[k] = &inverse->records[most > 0 ? most : 0];
        at.t[k] = (inside - guesses[k]->centre) * guesses[k]->rate;
    }
    for (size_t k = 0; k < n; k++) {
        double x = guesses[k]->x[MBMA_INVERSE_DEGREE];
        for (int j = MBMA_INVERSE_DEGREE - 1; j >= 0; j--)
            x = mbma_fma(x, at.t[k], guesses[k]->x[j]);
        at.beyond[k] = mbma_held(x, head.low, head.high);
        guessed[k] = (at.beyond[k] * width - head.h_max) * guesses[k]->side;
    }
    for (size_t k = 0; k < n; k++) {
        const place p = place_of(law, at.beyond[k], guessed[k]);
        at.record[k] = p.record, at.t[k] = p.t, at.q[k] = p.q;
    }
    for (size_t k = 0; k < n; k++) {
        const mbma_law_record *const record = at.record[k];
        const double t = at.t[k], q = at.q[k];
        const taylor y = polynomial(which == MBMA_AREA ? record->area : record->force, t);
        const double per_slope = 1.0 / y.slope, first = (wanted[k] - y.value) * per_slope;
        const double step = first - y.bend * per_slope * first * first;
        const bool sure = fabs(step) < SURE && wanted[k] >= of.low && wanted[k] <= of.high;
        unsure += !sure;
        d[k] = sure ? mbma_max(guessed[k] - step / q, of.end) : (double)NAN;
        if (!more)
            continue;
        by_area[k] = polynomial(record->area, t + step).value;
        const taylor force = which == MBMA_AREA ? polynomial(record->force, t) : y;
        by_force[k] = 2.0 * (force.slope + 2.0 * force.bend * step) * q;
    }
    for (size_t k = 0; unsure > 0 && k < n; k++)
        if (isnan(d[k])) {
            if (of.least <= wanted[k] && wanted[k] <= of.high)
                d[k] = mbma_max(head.h_max - 2.0 * overclosure(law, which, wanted[k], of.end), of.end);
            else
                bad++;
            by_area[k] = mbma_law_at(law, MBMA_AREA, d[k]);
            by_force[k] = mbma_law_at(law, MBMA_STIFFNESS, d[k]);
        }
    memcpy(gap, d, n * sizeof *d);
    if (area != NULL)
        memcpy(area, by_area, n * sizeof *area);
    if (stiffness != NULL)
        memcpy(stiffness, by_force, n * sizeof *stiffness);
    return bad;
}

size_t mbma_law_invert(size_t n, const double *wanted, const mbma_law *law, const mbma_inverse *inverse,
                       mbma_quantity which, double *d, double *area, double *stiffness) {
    size_t bad = 0;
    for (size_t first = 0; first < n; first += CHUNK) {
        const size_t some = n - first < (size_t)CHUNK ? n - first : (size_t)CHUNK;
        double *const own_area = area ? area + first : NULL;
        double *const own_stiffness = stiffness ? stiffness + first : NULL;
/* each with its own constants to the compiler */
#define INVERT(which, more) invert(law, inverse, which, more, some, wanted + first, d + first, own_area, own_stiffness)
        if (which == MBMA_AREA)
            bad += area || stiffness ? INVERT(MBMA_AREA, true) : INVERT(MBMA_AREA, false);
        else
            bad += area || stiffness ? INVERT(MBMA_FORCE, true) : INVERT(MBMA_FORCE, false);
#undef INVERT
    }
    return bad;
}

double mbma_law_flow(const mbma_law *flow, double h_max, double h_rms, double d, double *by_c) {
    const double u = 0.5 * (h_max + d), v = u / h_rms * (u / h_rms), w = v + 4.0;
    if (d > flow->head->highest && d < (double)INFINITY) {
        if (by_c != NULL)
            *by_c = -3.0 * u * u * (1.0 - 1.5 / w + v / (w * w));
        return u * u * u * (1.0 - 1.5 / w);
    }
    if (by_c != NULL)
        *by_c = mbma_law_at(flow, MBMA_STIFFNESS, d);
    return mbma_law_at(flow, MBMA_FORCE, d);
}

size_t mbma_law_flow_fill(size_t n, const double *d, const mbma_law *flow, double h_max, double h_rms, double *out) {
    size_t bad = mbma_law_fill(n, d, flow, out, NULL, NULL, NULL, NULL);
    for (size_t k = 0; k < n && bad > 0; k++)
        if (d[k] > flow->head->highest && d[k] < (double)INFINITY) {
            out[k] = mbma_law_flow(flow, h_max, h_rms, d[k], NULL);
            bad--;
        }
    return bad;
}

size_t mbma_law_fit(size_t n, const double *ends, const double *found, const double *series, const double *bounds,
                    const double *monomials, double *made) {
    enum { SAMPLES = MBMA_FIT_SAMPLES, RECORD = sizeof(mbma_law_record) / sizeof(double), ROW = RECORD + 3 };
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const double low = ends[2 * k], high = ends[2 * k + 1], half = 0.5 * (high - low), reach = high / half;
        double *const record = made + ROW * k, *const errors = record + RECORD;
        memset(record, 0, ROW * sizeof *record);
        record[0] = 0.5 * (low + high), record[1] = 1.0 / half;
        for (size_t row = 0; row < 2; row++) {
            const double *const values = found + SAMPLES * (n * row + k);
            double *const sums = record + 2 + KEPT * row;
            double terms[SAMPLES] = {0.0}, least = values[0], most = values[0], value = 0.0, slope = 0.0;
            for (size_t i = 0; i < SAMPLES; i++) {
                least = mbma_min(values[i], least), most = mbma_max(values[i], most);
                for (size_t j = 0; j < SAMPLES; j++)
                    terms[j] = mbma_fma(values[i], series[SAMPLES * i + j], terms[j]);
            }
            for (size_t i = 0; i < KEPT; i++)
                for (size_t j = 0; j <= i; j++)
                    sums[j] = mbma_fma(terms[i], monomials[KEPT * i + j], sums[j]);
            for (size_t i = KEPT; i < SAMPLES; i++) {
                value = mbma_fma(fabs(terms[i]), bounds[i], value);
                slope = mbma_fma(fabs(terms[i]), bounds[SAMPLES + i], slope);
            }
            bad += !(least > 0.0 && most < (double)INFINITY && !isnan(value));
            if (high - low > NARROW * low) {
                const double steep = mbma_max(1.0, 0.5 * reach * (most / least - 1.0));
                errors[0] = mbma_max(errors[0], value / least);
                errors[1] = mbma_max(errors[1], slope * reach / least);
                errors[2] = mbma_max(errors[2], slope * reach / least / steep);
            }
        }
    }
    return bad;
}
