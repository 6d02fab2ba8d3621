/* Persson's theory and the calibrated law of any isotropic spectrum, as sums over wavenumbers.
 *
 * With g(x) the rms gradient of wavenumbers below x and y = F g/g(x), each contributes a function of y to the mean
 * separation: u(F) = sum of share I(y), I(y) = integral from y to infinity of dW/y', where W is a polynomial of
 * P = erf(sqrt(2) y). A law keeps ln u + 2 F^2, which is smooth, as polynomials of ln F, F over g(x) of the last one.
 */
#include "elementary.h"
#include "mbma.h"

enum { ORDER = MBMA_ORDER, CELLS = 85, NODES = 12, FEW_NODES = 4, MOST_STEPS = 100 };

#define LOWEST -14.0   /* ln y of the first cell, up to whose end I is linear in ln y, */
#define HIGHEST 3.0    /* and of the last, above which I is below 1e-350 */
#define CELL_RATE 5.0  /* cells in 1 of ln y */
#define SLIGHT 0.1     /* change of y^2 over which four nodes suffice */
#define TINY 2e-12     /* of the last two coefficients; a panel with larger ones is halved */
#define NARROWEST 0.02 /* panel */
#define NOTHING 80.0   /* exp(-80) of the largest part */
#define CLOSE 1e-12    /* of ln F */
#define FARTHEST 1e80  /* u at which there is no force */
#define NARROWNESS 0.65 /* that the slope of W's first coefficient refers to */

/* ln F where panels begin and end; below, u is linear in it, and above below 1e-317. */
static const double EDGES[] = {-48.0, -36.0, -26.0, -22.0, -18.0, -15.0,  -12.0, -10.0, -8.0, -6.75,
                               -5.5,  -4.75, -4.0,  -3.0,  -2.25, -1.875, -1.5,  -1.0,  -0.75, -0.5,
                               -0.25, 0.0,   0.25,  0.5,   0.75,  1.0,    1.25,  1.5,   2.1,  2.95};

static const double ROOT_8_PI = 1.5957691216057308; /* sqrt(8/pi) */

/* Gauss's rules of 4 and 12 nodes on [-1, 1]: positive nodes and their weights. */
static const double FEW[FEW_NODES / 2][2] = {{0.33998104358485626, 0.6521451548625461},
                                             {0.8611363115940526, 0.34785484513745385}};
static const double RULE[NODES / 2][2] = {{0.1252334085114689, 0.24914704581340277},
                                          {0.3678314989981802, 0.2334925365383548},
                                          {0.5873179542866175, 0.20316742672306592},
                                          {0.7699026741943047, 0.16007832854334622},
                                          {0.9041172563704749, 0.10693932599531843},
                                          {0.9815606342467192, 0.04717533638651183}};

/* ---- polynomials through Chebyshev nodes of [-1, 1] -------------------------------------------------------------- */

/* Chebyshev polynomials at their nodes, of which the first are the nodes: a law takes them a thousand times. */
typedef struct {
    double at[ORDER][ORDER];
} chebyshev;

static void fill_chebyshev(chebyshev *T) {
    for (int m = 0; m < ORDER; m++)
        for (int j = 0; j < ORDER; j++)
            T->at[m][j] = cos(m * (MBMA_PI * (j + 0.5) / (double)ORDER));
}

/* Powers from values at the nodes; the last two Chebyshev coefficients estimate the error. */
static double powers_of(const chebyshev *T, const double value[ORDER], double p[ORDER]) {
    double before[ORDER] = {0.0}, term[ORDER] = {1.0}, last[2] = {0.0};
    memset(p, 0, ORDER * sizeof *p);
    for (int m = 0; m < ORDER; m++) {
        double c = 0.0;
        for (int j = 0; j < ORDER; j++)
            c += (m == 0 ? 1.0 : 2.0) / (double)ORDER * T->at[m][j] * value[j];
        last[m % 2] = fabs(c);
        /* the next Chebyshev polynomial is 2 x times this one less the one before */
        for (int j = ORDER - 1; j >= 0; j--) {
            const double next = (m == 0 ? 1.0 : 2.0) * (j > 0 ? term[j - 1] : 0.0) - before[j];
            p[j] += c * term[j];
            before[j] = term[j];
            term[j] = next;
        }
    }
    return last[0] + last[1];
}

/* ---- inner integrals I(y), times exp(2 y^2) ---------------------------------------------------------------------- */

/* From ln y down to another, by steps over which exp(2 y^2) changes by a factor e^4 at most; where it hardly changes
 * between two neighbouring nodes, the rule of few nodes is exact to rounding. */
static double integrated_down(double from, double to, const double weight[3], double inner) {
    const double change = exp(2.0 * from) - exp(2.0 * to);
    const int steps = 1 + (int)(0.5 * change), nodes = change < SLIGHT ? FEW_NODES : NODES;
    for (int step = 0; step < steps; step++) {
        const double high = from + (to - from) * step / steps, low = from + (to - from) * (step + 1) / steps;
        const double end = exp(2.0 * low);
        inner *= mbma_exp(2.0 * (end - exp(2.0 * high)));
        for (int k = 0; k < nodes; k++) {
            const double *rule = change < SLIGHT ? FEW[k / 2] : RULE[k / 2], s = 0.5 * (low + high + (high - low) * (k % 2 ? rule[0] : -rule[0]));
            const double y = mbma_exp(s), P = mbma_erf(1.4142135623730951 * y), P2 = P * P, P4 = P2 * P2, P8 = P4 * P4;
            const double slope = weight[0] + 3.0 * weight[1] * P2 + 16.0 * weight[2] * (P8 * P4) * (P2 * P);
            inner += 0.5 * (high - low) * rule[1] * ROOT_8_PI * mbma_exp(2.0 * (end - y * y)) * slope;
        }
    }
    return inner;
}

static void inner_integral(const chebyshev *T, const double weight[3], double p[CELLS][ORDER]) {
    /* what lies above counts for less than exp(-80) of this */
    double at = HIGHEST + 0.05, own = 0.0, value[ORDER];
    for (int cell = CELLS - 1; cell >= 0; cell--) {
        for (int j = 0; j < ORDER; j++) {
            const double next = LOWEST + (cell + 0.5 * (1.0 + T->at[1][j])) / CELL_RATE;
            value[j] = own = integrated_down(at, next, weight, own);
            at = next;
        }
        (void)powers_of(T, value, p[cell]);
    }
    p[0][1] = -0.5 * ROOT_8_PI / CELL_RATE * weight[0];
    for (int m = 2; m < ORDER; m++)
        p[0][m] = 0.0;
}

/* ---- sums over waves --------------------------------------------------------------------------------------------- */

typedef struct {
    chebyshev T;
    double p[CELLS][ORDER]; /* I of a law's own W */
    size_t count;
    double *log_g, *fall, *share; /* of wavenumbers: ln g(x) and 1/g(x)^2 - 1, in terms of the last one's g(x) */
} wave_sum;

/* ln u + 2 F^2. */
static double sum_at(const wave_sum *w, double log_force) {
    const double square = 2.0 * exp(2.0 * log_force);
    double sum = 0.0;
    for (size_t k = 0; k < w->count; k++) {
        /* wavenumbers in full contact, except the last one */
        if (square * w->fall[k] > NOTHING && k + 1 < w->count)
            continue;
        const double at = mbma_min((log_force - w->log_g[k] - LOWEST) * CELL_RATE, (double)CELLS);
        const int cell = (int)mbma_held(at, 0.0, (double)(CELLS - 1));
        double own = 0.0;
        for (int m = ORDER - 1; m >= 0; m--)
            own = mbma_fma(own, 2.0 * (at - cell) - 1.0, w->p[cell][m]);
        sum = mbma_fma(w->share[k] * mbma_exp(-square * w->fall[k]), own, sum);
    }
    return log(sum);
}

/* Panels from `start` to `end`, halved until polynomials meet the tolerance. */
static bool fill_panels(const wave_sum *w, double start, double end, mbma_spectrum_law *law) {
    while (start < end && law->panels < MBMA_MOST_PANELS) {
        double width = 2.0 * (end - start), value[ORDER], tail;
        do {
            width *= 0.5;
            for (int j = 0; j < ORDER; j++)
                value[j] = sum_at(w, start + 0.5 * width * (1.0 + w->T.at[1][j]));
            tail = powers_of(&w->T, value, law->p[law->panels]);
        } while (tail > TINY && width > NARROWEST);
        start = end - start > width ? start + width : end;
        law->edge[++law->panels] = start;
    }
    return start >= end;
}

/* ln u at ln F in a panel, and its derivative. */
static double log_u_in(const mbma_spectrum_law *law, size_t panel, double log_force, double *slope) {
    const double low = law->edge[panel], rate = 2.0 / (law->edge[panel + 1] - low), t = (log_force - low) * rate - 1.0;
    const double *p = law->p[panel], square = 2.0 * exp(2.0 * log_force);
    double value = p[ORDER - 1], by_t = 0.0;
    for (int m = ORDER - 2; m >= 0; m--) {
        by_t = mbma_fma(by_t, t, value);
        value = mbma_fma(value, t, p[m]);
    }
    *slope = by_t * rate - 2.0 * square;
    return value - square;
}

/* ln F at a mean separation before the tail's factor, by Newton's method in a bracket, and d ln u/d ln F. */
static double log_force_of(const mbma_spectrum_law *law, double u, double *slope) {
    const double log_u = log(u), *edge = law->edge;
    size_t panel = 0;
    if (u >= law->lightest[0]) {
        *slope = law->lightest[1] / u;
        return edge[0] + (u - law->lightest[0]) / law->lightest[1];
    }
    double from = log(law->lightest[0]), to = log_u_in(law, 0, edge[1], slope);
    while (to > log_u && ++panel < law->panels) {
        from = to;
        to = log_u_in(law, panel, edge[panel + 1], slope);
    }
    if (!(log_u >= to))
        return NAN;
    double low = edge[panel], high = edge[panel + 1], x = low + (high - low) * (from - log_u) / (from - to), step;
    for (int k = 0; k < MOST_STEPS; k++) {
        const double miss = log_u_in(law, panel, x, slope) - log_u;
        *(miss > 0.0 ? &low : &high) = x;
        step = -miss / *slope;
        if (fabs(step) <= CLOSE)
            return x + step;
        x = x + step > low && x + step < high ? x + step : 0.5 * (low + high);
    }
    return x;
}

/* u before the tail's factor, and du/d ln F. */
static double separation_of(const mbma_spectrum_law *law, double log_force, double *slope) {
    if (log_force <= law->edge[0]) {
        *slope = law->lightest[1];
        return law->lightest[0] + *slope * (log_force - law->edge[0]);
    }
    *slope = 0.0;
    if (log_force >= law->edge[law->panels])
        return 0.0;
    size_t panel = 0;
    while (panel + 1 < law->panels && law->edge[panel + 1] <= log_force)
        panel++;
    const double u = exp(log_u_in(law, panel, log_force, slope));
    *slope *= u;
    return u;
}

/* Decrease of ln F by the tail's factor. */
static double tail_at(const mbma_spectrum_law *law, double u) { return law->tail * u * u * u; }

mbma_status mbma_spectrum_law_of(const mbma_waves *waves, const mbma_law_constants *c, double h_max, double *work,
                                 mbma_spectrum_law *law) {
    const size_t n = waves->count;
    double mean = 0.0, inverse = 0.0, slope;
    wave_sum w;
    bool good = n > 0 && h_max > 0.0 && waves->gradient > 0.0 && waves->gradient < INFINITY && waves->alpha > 0.0;
    memset(law, 0, sizeof *law);
    w.count = n;
    w.log_g = work;
    w.fall = work + n;
    w.share = work + 2 * n;
    for (size_t k = 0; k < n && good; k++) {
        const double below = waves->below[k], last = waves->below[n - 1];
        good = below > 0.0 && below <= last && last < 1.0 + 1e-9 && waves->x[k] > 0.0 && waves->x[k] < INFINITY &&
               waves->variance[k] >= 0.0 && waves->variance[k] < INFINITY && (k == 0 || below >= waves->below[k - 1]);
        mean += waves->variance[k] * waves->x[k];
        inverse += waves->variance[k] / waves->x[k];
        w.log_g[k] = 0.5 * log(below / last);
        w.fall[k] = (last - below) / below;
        w.share[k] = waves->x[k] * waves->variance[k] / (4.0 * waves->gradient * sqrt(below));
    }
    if (!good)
        return MBMA_INVALID;
    const double narrowness = 1.0 / (mean * inverse), a = c->weight + c->weight_slope * (narrowness - NARROWNESS);
    const double weight[3] = {a, c->cubic, 1.0 - a - c->cubic};
    fill_chebyshev(&w.T);
    inner_integral(&w.T, weight, w.p);
    law->s0 = mbma_min(c->area_s0 + c->area_slope * log(waves->alpha / 10.0), 1.0);
    law->t0 = c->area_t0;
    law->tail = c->tail * (1.0 - narrowness);
    law->h_max = h_max;
    law->shift = 0.5 * log(waves->below[n - 1]);
    law->edge[0] = EDGES[0];
    for (size_t k = 0; k + 1 < sizeof EDGES / sizeof *EDGES; k++)
        good = good && fill_panels(&w, EDGES[k], EDGES[k + 1], law);
    law->lightest[0] = exp(log_u_in(law, 0, law->edge[0], &slope));
    /* without the first power in W, u is constant there */
    law->lightest[1] = fmin(slope * law->lightest[0], -1e-300);
    law->end = h_max < FARTHEST ? log_force_of(law, h_max, &slope) + law->shift - tail_at(law, h_max) : -INFINITY;
    good = good && law->end == law->end && law->lightest[0] > 0.0 && law->lightest[0] < INFINITY;
    law->panels = good ? law->panels : 0;
    return good ? MBMA_OK : MBMA_UNRESOLVED;
}

/* Whether a law was prepared, so that nothing is read beyond its panels. */
static bool is_prepared(const mbma_spectrum_law *law) { return law->panels > 0 && law->panels <= MBMA_MOST_PANELS; }

size_t mbma_spectrum_law_contact(const mbma_spectrum_law *law, size_t n, const double *u, double *force, double *area,
                                 double *stiffness) {
    const bool ready = is_prepared(law);
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const double gap = u[k], known = ready && gap == gap ? 0.0 : NAN;
        force[k] = stiffness[k] = (gap <= 0.0 ? INFINITY : 0.0) + known;
        area[k] = (gap <= 0.0 ? 1.0 : 0.0) + known;
        if (ready && gap > 0.0 && gap < law->h_max && gap <= FARTHEST) {
            double slope;
            const double value = log_force_of(law, gap, &slope) + law->shift - tail_at(law, gap), endless = exp(value);
            double steep;
            const double F = endless * mbma_ended(law->end - value, &steep), over = F / law->t0;
            force[k] = F;
            area[k] = mbma_erf(F * sqrt(2.0 * (1.0 + over) / (law->s0 + over)));
            stiffness[k] = (3.0 * tail_at(law, gap) / gap - 1.0 / (slope * gap)) * endless * steep;
        }
        bad += force[k] != force[k];
    }
    return bad;
}

/* Newton's method for ln F of a surface without end, before the tail's factor ln F + tail. */
static double separation_at(const mbma_spectrum_law *law, double log_force, double end, double tail, double *slope) {
    const double heaviest = law->edge[law->panels];
    const double goal = mbma_endless(log_force, end);
    double low = -800.0, high = heaviest, x = goal - law->shift, u = 0.0;
    *slope = 0.0;
    for (int step = 0; step < MOST_STEPS && goal - law->shift < heaviest; step++) {
        x = x > low && x < high ? x : 0.5 * (low + high);
        u = separation_of(law, x, slope);
        const double miss = x + law->shift - tail * u * u * u - goal, move = -miss / (1.0 - 3.0 * tail * u * u * *slope);
        *(miss > 0.0 ? &high : &low) = x;
        x += move;
        if (fabs(move) <= CLOSE)
            return tail > 0.0 ? separation_of(law, x, slope) : u;
    }
    return u;
}

size_t mbma_spectrum_law_separation(const mbma_spectrum_law *law, size_t n, const double *force, int whole, double *u,
                                    double *slope) {
    const double end = whole ? law->end : -INFINITY, tail = whole ? law->tail : 0.0;
    const bool ready = is_prepared(law);
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const bool good = ready && force[k] > 0.0;
        u[k] = slope[k] = NAN;
        if (good)
            u[k] = mbma_min(separation_at(law, log(force[k]), end, tail, &slope[k]), whole ? law->h_max : INFINITY);
        bad += !good;
    }
    return bad;
}

/* ---- waves of power laws between samples ------------------------------------------------------------------------- */

/* (exp(x) - 1)/x */
static double growth(double x) { return x != 0.0 ? expm1(x) / x : 1.0; }

static bool is_held(const double *q, const double *C, size_t k) {
    return q[k + 1] > q[k] && C[k] > 0.0 && C[k + 1] > 0.0;
}

/* A piece between two samples: where it begins in ln(q/q0), its width, and C q^2 there over C0 q0^2 with its power. */
typedef struct {
    double start, width, content, power;
} piece;

static piece piece_of(const double *q, const double *C, size_t base, size_t k) {
    const double start = log(q[k] / q[base]), width = log1p((q[k + 1] - q[k]) / q[k]);
    /* also if the quotient overflows or is NaN */
    const double rise = fmin(fmax(log(C[k + 1] / C[k]), -750.0), 750.0);
    const piece found = {start, width, C[k] / C[base] * exp(2.0 * start), rise / width + 2.0};
    return found;
}

/* Contribution to the integral of C q^(order + 1) dq from the piece's start up to `rise`. */
static double part_of(const piece *s, int order, double rise) {
    return s->content * exp(order * s->start) * rise * growth((s->power + order) * rise);
}

/* Where the panel that begins at t = ln x ends, and whether few nodes are enough. Panels are graded towards the longest
 * wavelength, where the gradient of longer ones vanishes, and the shortest ones, which matter at heavy loads; in a
 * panel neither the variance nor the gradient changes much. `before` is the gradient's square up to the piece. */
static double panel_end(const piece *s, double t, double last, double before, bool *few) {
    const double first = fmin(last, 1.0), left = last - t, rise = t - s->start, power = fabs(s->power) + 2.0;
    const double low = t > 0.0 ? fmax(t * exp(2.0), first * exp(-40.0)) : first * exp(-40.0);
    /* steps due to rounding, and those in which a jump of the gradient is negligible */
    const double least = 1e-14 * t, finest = least + 1e-13 * s->width;
    double width = fmin(fmin(low - t, 1.0), left > first / 512.0 ? 0.5 * left : left), change = 2.0;
    width = fmin(fmin(width, s->start + s->width - t), 3.0 / power);
    if (t > 0.0)
        do
            change = log((before + part_of(s, 2, rise + width)) / (before + part_of(s, 2, rise)));
        while (change > 2.01 && (width *= 0.5) > finest);
    width = fmax(width, least);
    const double wide = fmax(fmax(width * fmax(1.0, 0.3 * power), change), width / left);
    *few = wide < 0.1;
    return width < s->start + s->width - t ? t + width : s->start + s->width;
}

size_t mbma_spectrum_waves(size_t count, const double *q, const double *C, size_t most, double *x, double *variance,
                           double *below, double facts[4]) {
    double moments[3] = {0.0, 0.0, 0.0}, before = 0.0, total = 0.0, last = 0.0;
    size_t base = 0, waves = 0;
    while (base + 1 < count && !is_held(q, C, base))
        base++;
    for (size_t k = 0; k < count; k++)
        if (!(q[k] > 0.0 && q[k] < INFINITY && C[k] >= 0.0 && C[k] < INFINITY && (k == 0 || q[k] >= q[k - 1])))
            return 0;
    for (size_t k = base; k + 1 < count; k++)
        if (is_held(q, C, k)) {
            const piece own = piece_of(q, C, base, k);
            last = own.start + own.width;
            for (int m = 0; m < 3; m++)
                moments[m] += part_of(&own, 2 * m, own.width);
        }
    facts[0] = sqrt(moments[1] / moments[0]);
    facts[1] = 1.5 * moments[0] * moments[2] / (moments[1] * moments[1]);
    facts[2] = moments[0] > 0.0 ? q[base] * sqrt(C[base]) * sqrt(2.0 * MBMA_PI * moments[0]) : NAN;
    facts[3] = moments[0] > 0.0 ? q[base] * facts[0] * facts[2] : NAN;
    if (!(last > 0.0 && facts[0] > 0.0 && facts[0] < INFINITY && facts[1] > 0.0 && facts[1] < INFINITY))
        return 0;
    for (size_t k = base; k + 1 < count; k++) {
        if (!is_held(q, C, k))
            continue;
        const piece own = piece_of(q, C, base, k);
        for (double t = own.start, end; t < own.start + own.width; t = end) {
            bool few;
            end = panel_end(&own, t, last, before, &few);
            /* nodes in the root of ln x, to which the gradient rises in proportion */
            const double low = sqrt(t), high = sqrt(end);
            const int half = (few ? FEW_NODES : NODES) / 2;
            for (int n = -half; n < half; n++, waves++) {
                const double *const node = few ? FEW[n < 0 ? -1 - n : n] : RULE[n < 0 ? -1 - n : n];
                const double root = 0.5 * (low + high + (high - low) * (n < 0 ? -node[0] : node[0]));
                const double log_x = root * root, rise = fmin(fmax(log_x - own.start, 0.0), own.width);
                if (waves >= most)
                    continue;
                x[waves] = exp(log_x);
                variance[waves] = own.content * exp(own.power * rise) * root * (high - low) * node[1];
                below[waves] = (before + part_of(&own, 2, rise)) / moments[1];
                total += variance[waves];
            }
        }
        before += part_of(&own, 2, own.width);
    }
    for (size_t k = 0; k < waves && waves <= most; k++)
        variance[k] /= total;
    return waves;
}
