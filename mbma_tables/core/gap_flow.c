/* Flow through the gaps of many spectra by an effective medium of gaps: what
 * `contacts/quantities/effective_medium.py` computes of one spectrum, which states the theory.
 */
#include "spectrum_sums.h"

enum { BANDS = 64, ROOM = BANDS + MBMA_WAVE_CHUNK, GAPS = 32, MOST_ROOTS = 60 };

#define NO_SLOPE 1e-12  /* share of the squared gradient that the last bands hold at least */
#define NO_COVER 1e-8   /* share of the surface between two magnifications: the mean gap of
                         * fewer is a difference of two means that is mostly rounding */
#define NEAREST 1e-4    /* least distance of A/A0 to the threshold */
#define REACH 8.0       /* of gaps around their mean, over the rms height above a band */
#define FULL 1e8        /* F at which contact is full */
#define CLOSE_GAP 3e-3  /* of ln F: the error of a gap is about the square of this one */
#define CLOSE_FLOW 1e-9 /* of ln k */

/* Bands of a spectrum, graded towards both ends: shares of h_rms^2 and g^2, and x times the first;
 * those of all shorter waves, and with these over x in place of times. */
typedef struct {
    size_t count;
    double variance[BANDS], slope[BANDS], wave[BANDS];
    double above[BANDS + 1], waves_above[BANDS + 1], lengths_above[BANDS + 1], below[BANDS + 1];
    double gradient; /* of all, over q0 h_rms */
} bands;

/* Integral of C q^(order + 1) dq between places ln(q/q0). */
static double moment_between(const sum_of_parts *s, int order, double low, double high) {
    double sum = 0.0;
    for (size_t k = 0; k < s->count; k++) {
        const part *const own = &s->parts[k];
        const double start = mbma_max(low, own->start), width = mbma_min(high, own->end) - start;
        if (width > 0.0)
            sum += own->content * mbma_exp(own->power * (start - own->start) + order * start) *
                   width * growth((own->power + order) * width);
    }
    return sum;
}

static bool fill_bands(const sum_of_parts *s, bands *b) {
    const double last = s->edge[s->edges - 1];
    double totals[2] = {0.0, 0.0}, left;
    size_t count = 0;
    for (size_t k = 0; k < BANDS; k++) {
        const double low = last * 0.5 * (1.0 - cos(MBMA_PI * (double)k / (double)BANDS));
        const double high = last * 0.5 * (1.0 - cos(MBMA_PI * (double)(k + 1) / (double)BANDS));
        const double variance = moment_between(s, 0, low, high);
        if (!(variance > 0.0))
            continue;
        b->variance[count] = variance;
        b->slope[count] = moment_between(s, 2, low, high);
        b->wave[count] = moment_between(s, 1, low, high);
        totals[0] += variance;
        totals[1] += b->slope[count++];
    }
    if (!(count > 0 && totals[0] < INFINITY && totals[1] > 0.0 && totals[1] < INFINITY))
        return false;
    left = b->slope[count - 1];
    while (count > 1 && !(left > NO_SLOPE * totals[1]))
        left += b->slope[--count - 1];
    b->count = count;
    b->gradient = sqrt(totals[1] / totals[0]);
    b->above[count] = b->waves_above[count] = b->lengths_above[count] = b->below[0] = 0.0;
    for (size_t k = 0; k < count; k++) {
        b->variance[k] /= totals[0];
        b->slope[k] /= totals[1];
        b->wave[k] /= totals[0];
        b->below[k + 1] = b->below[k] + b->slope[k];
    }
    b->below[count] = 1.0;
    for (size_t k = count; k-- > 0;) {
        b->above[k] = b->above[k + 1] + b->variance[k];
        b->waves_above[k] = b->waves_above[k + 1] + b->wave[k];
        b->lengths_above[k] = b->lengths_above[k + 1] + b->variance[k] * b->variance[k] / b->wave[k];
    }
    return true;
}

/* Mean gap [h_rms], times the share `cover` that touches at longer waves, of the bands from one on,
 * which carry a load there. */
static double mean_gap(const bands *b, size_t first, double load, const mbma_law_constants *c,
                       const mbma_inner *inner, own_sum *sum, mbma_spectrum_numbers *numbers,
                       double *taken) {
    double place[ROOM], fall[ROOM], share[ROOM];
    const double left = 1.0 - b->below[first], spread2 = b->above[first];
    /* of these bands, lengths over their rms height and forces over their gradient */
    const double gradient = sqrt(left) * b->gradient / sqrt(spread2);
    size_t count = b->count - first;
    numbers->narrowness = spread2 * spread2 / (b->waves_above[first] * b->lengths_above[first]);
    numbers->tail = c->tail * (1.0 - numbers->narrowness);
    for (size_t k = 0; k < count; k++) {
        const size_t band = first + k;
        const double middle = 0.5 * (b->below[band] + b->below[band + 1]);
        const double below = (middle - b->below[first]) / left;
        place[k] = (-0.5 * mbma_log(below) - inner->first) * inner->rate;
        fall[k] = mbma_max(1.0 / below - 1.0, 0.0);
        share[k] = b->wave[band] / spread2 / (4.0 * gradient * sqrt(below));
    }
    for (; count % CHUNK != 0; count++) {
        place[count] = place[count - 1];
        fall[count] = share[count] = 0.0;
    }
    numbers->count = (double)count;
    numbers->first = 0.0;
    open_sum(sum, inner, numbers, place);
    sum->fall = fall;
    sum->share = share;
    return separation_at(sum, mbma_log(load / sqrt(left)), CLOSE_GAP, taken) * sqrt(spread2);
}

/* Gaps of a spectrum at a load: their shares of the surface, and cubes. */
typedef struct {
    size_t count;
    double area, mean; /* A/A0 and mean gap, of all */
    double volume, smallest, largest; /* sum of shares times gaps; cubes */
    double share[BANDS * GAPS], cube[BANDS * GAPS];
} gap_list;

static double cover_at(double load, double s0, double t0) {
    const double F = mbma_min(load, FULL), over = F / t0;
    return mbma_erf(F * sqrt(2.0 * (1.0 + over) / (s0 + over)));
}

/* Gaps that open between two magnifications: a share of the surface, their mean and rms height. */
static void add_gaps(double share, double mean, double spread, const double *node,
                     const double *weight, gap_list *list) {
    const double centre = mean / spread;
    /* nodes in the root of t are denser where gaps vanish */
    const double low = sqrt(mbma_max(centre - REACH, 0.0)), high = sqrt(centre + REACH);
    const double half = 0.5 * (high - low), unit = 2.0 * share * half / sqrt(2.0 * MBMA_PI);
    const double cube = spread * spread * spread;
    double gaps[GAPS], *const shares = list->share + list->count, *const cubes = list->cube + list->count;
    for (size_t k = 0; k < GAPS; k++) {
        const double root = low + half * (1.0 + node[k]), t = root * root;
        const double nearer = t - centre, farther = t + centre;
        const double density = mbma_exp(-0.5 * nearer * nearer) + mbma_exp(-0.5 * farther * farther);
        shares[k] = unit * weight[k] * root * density;
        cubes[k] = t * t * t * cube;
        gaps[k] = shares[k] * t;
    }
    for (size_t k = 0; k < GAPS; k++)
        list->volume += gaps[k] * spread;
    /* nodes rise */
    list->smallest = mbma_min(list->smallest, cubes[0]);
    list->largest = mbma_max(list->largest, cubes[GAPS - 1]);
    list->count += GAPS;
}

static void fill_gaps(const bands *b, double load, double alpha, const mbma_law_constants *c,
                      const mbma_inner *inner, const double *node, const double *weight,
                      gap_list *list) {
    const double s0 = mbma_min(c->area_s0 + c->area_slope * log(alpha / 10.0), 1.0);
    mbma_spectrum_numbers numbers = {0.0, 0.0, 0.0, s0, 0.0, INFINITY, -INFINITY, 0.0, 0.0};
    own_sum sum;
    double cover[BANDS + 1], mean[BANDS + 1], taken = 0.0;
    list->count = 0;
    list->volume = 0.0;
    list->smallest = INFINITY;
    list->largest = 0.0;
    for (size_t k = 0; k <= b->count; k++)
        cover[k] = cover_at(k > 0 ? load / sqrt(b->below[k]) : FULL, s0, c->area_t0);
    mean[b->count] = 0.0;
    for (size_t k = 0; k < b->count; k++) {
        /* where no gap opens, before and after, the mean is not asked for */
        const bool opens = cover[k] - cover[k + 1] > NO_COVER;
        const bool opened = k > 0 && cover[k - 1] - cover[k] > NO_COVER;
        const bool asked = k == 0 || opens || opened;
        mean[k] = asked ? mean_gap(b, k, load / cover[k], c, inner, &sum, &numbers, &taken) : 0.0;
    }
    list->area = cover[b->count];
    list->mean = mean[0];
    for (size_t k = 0; k < b->count; k++) {
        const double share = cover[k] - cover[k + 1];
        const double open = mbma_max(mean[k] * cover[k] - mean[k + 1] * cover[k + 1], 0.0);
        if (share > NO_COVER)
            add_gaps(share, open / share, sqrt(0.5 * (b->above[k] + b->above[k + 1])), node, weight,
                     list);
    }
}

/* sum of share (h^3 - k)/(h^3 + k), and its derivative by ln k, in eight lanes. */
static double balance(const gap_list *list, double k, double *slope) {
    double sum[LANES] = {0.0}, steep[LANES] = {0.0};
    for (size_t begin = 0; begin < list->count; begin += GAPS) {
        const double *const share = list->share + begin, *const cube = list->cube + begin;
        double value[GAPS], change[GAPS];
        for (size_t l = 0; l < GAPS; l++) {
            const double part = k / (cube[l] + k);
            value[l] = share[l] * (1.0 - 2.0 * part);
            change[l] = share[l] * (part * (1.0 - part));
        }
        for (size_t l = 0; l < GAPS; l += LANES)
            for (size_t lane = 0; lane < LANES; lane++) {
                sum[lane] += value[l + lane];
                steep[lane] += change[l + lane];
            }
    }
    *slope = -2.0 * total_of(steep);
    return total_of(sum);
}

/* ln k of the effective medium by Newton's method in a bracket. */
static double log_conductance(const gap_list *list, double blocked) {
    double low = log(list->smallest), high = log(list->largest), slope;
    double x = 3.0 * log(list->mean);
    x = x > low && x < high ? x : 0.5 * (low + high);
    for (int step = 0; step < MOST_ROOTS; step++) {
        const double miss = balance(list, mbma_exp(x), &slope) - blocked;
        const double following = x - miss / slope;
        *(miss > 0.0 ? &low : &high) = x;
        if (fabs(following - x) <= CLOSE_FLOW)
            return following;
        x = following > low && following < high ? following : 0.5 * (low + high);
    }
    return x;
}

/* ln R: ln k over that of gaps without contact of the same mean. */
static double log_factor(const gap_list *list, const mbma_flow_constants *flow) {
    const double area = mbma_min(list->area, flow->threshold - NEAREST);
    const double blocked = (1.0 - flow->threshold) * exp(flow->obstruction * log(area / flow->threshold));
    const double wide = 1.0 - 1.5 / (list->mean * list->mean + 4.0);
    return log_conductance(list, blocked) - 3.0 * log(list->volume) - log(wide);
}

size_t mbma_gap_flow(size_t surfaces, size_t parts, const double *laws, const double *alpha,
                     const mbma_law_constants *constants, const mbma_inner *inner,
                     const mbma_flow_constants *flow, const double *rule, size_t n,
                     const int64_t *owner, const double *load, double *factor) {
    int64_t opened = -1;
    size_t bad = 0;
    bool good = false;
    bands b;
    gap_list list;
    for (size_t k = 0; k < n; k++) {
        factor[k] = NAN;
        if ((uint64_t)owner[k] < surfaces && owner[k] != opened) {
            sum_of_parts s;
            opened = owner[k];
            good = read_parts(parts, laws + MBMA_PART_NUMBERS * parts * (size_t)opened, &s) &&
                   fill_bands(&s, &b);
        }
        if (good && owner[k] == opened && load[k] > 0.0 && load[k] < FULL && alpha[opened] > 0.0) {
            fill_gaps(&b, load[k], alpha[opened], constants, inner, rule, rule + GAPS, &list);
            factor[k] = list.count == 0            ? NAN
                        : list.area < flow->threshold ? log_factor(&list, flow)
                                                      : -INFINITY;
        }
        bad += factor[k] != factor[k];
    }
    return bad;
}
