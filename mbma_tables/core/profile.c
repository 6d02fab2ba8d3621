/* One surface at many gaps: its islands are looked up once, at the nodes of panels of the approach, and sums over them
 * at some gaps of each panel make Chebyshev series of the logarithms of force and area (44-49).
 *
 * Of an island at a gap of compression c = (h_max - d)/h_rms, what counts is weight exp(-(shift - rate c)^2/2).
 */
#include "island.h"
#include "phi.h"

enum { NODES = MBMA_PANEL_NODES, CHECKS = MBMA_PANEL_CHECKS, PLACES = NODES + CHECKS, GAPS = MBMA_PANEL_GAPS };
enum { TERMS = 2 * GAPS, SPREAD = 9, TOPS = 8, CHUNK = 256, ROWS = MBMA_PANEL_ROWS };

/* of errors of a panel */
static const double AT_ENDS = 1.01;  /* ratio of errors at the ends to those next to them */
static const double BETWEEN = 3.0;   /* times more at gaps between those checked, and past turning points */
static const double HIGH = 6.0;      /* of sigma_d: islands beyond contribute less than 1e-7, if there are others */
static const double LEADS = 20.0;    /* by which exponents of the smallest islands exceed those of others that count */
static const double LEAST_APPROACH = 1e-290;
/* of errors of a series */
static const double TAIL_SHARE = 5.0; /* factor on the last two terms for all omitted ones, which may decrease slowly */
static const double OLDER = 0.25;     /* factor on the two before them, since the last two may be small by chance */
static const double SLOPES = 0.1;     /* of their relative error counts */
static const double THIN = 1e-3;      /* width over gap of panels in which values round to more than slopes change */
static const double LEAST_LOG = -700.0; /* of ln F in subnormal numbers */

/* out = values times the first `rows` rows of a matrix, of whose `stride` columns some count */
MBMA_INLINE void combined(const double *restrict values, const double *restrict matrix, int rows, int columns,
                          int stride, double *restrict out) {
    for (int j = 0; j < columns; j++)
        out[j] = 0.0;
    for (int k = 0; k < rows; k++)
        for (int j = 0; j < columns; j++)
            out[j] = mbma_fma(values[k], matrix[k * stride + j], out[j]);
}

/* The power of the compression that sums begin with: of force, area, number of islands, Hertz area. */
static const double BEGUN[ROWS] = {3.5, 10.0 / 3.0, 1.0, 3.0};

/* Factor missing in the weights at delta in the panel from 0, whose rule has the power 2: delta to one power less. */
static double lead(double power, int row, double delta) {
    const double square = delta * delta;
    return !(power > 1) || row == 2 ? 1.0 : row == 0 ? square * sqrt(delta) : row == 1 ? square * cbrt(delta) : square;
}

/* Derivative of delta over the width of a panel at a place in [0, 1]. */
static double rise(double power, double at) { return power > 1 ? 2.0 * at : 1.0; }

/* Adds to `out` the sums of rows, then their slopes by the compression, of the first islands, times exp(least/2). */
static void add_sums(double c, double least, const mbma_nodes *islands, int rows, int64_t stop, double *out) {
    double share[CHUNK], turned[CHUNK];
    for (int64_t first = 0; first < stop; first += CHUNK) {
        const int64_t count = stop - first < CHUNK ? stop - first : (int64_t)CHUNK;
        const double *const shift = islands->shift + first, *const rate = islands->rate + first;
        for (int64_t k = 0; k < count; k++) {
            const double height = mbma_fma(-rate[k], c, shift[k]);
            share[k] = mbma_exp(0.5 * mbma_fma(-height, height, least));
            turned[k] = share[k] * height * rate[k];
        }
        for (int row = 0; row < rows; row++) {
            out[row] += dot(share, islands->weights + row * islands->size + first, (size_t)count);
            out[rows + row] += dot(turned, islands->weights + row * islands->size + first, (size_t)count);
        }
    }
}

/* About the least square of a height at a gap; neighbours differ by far less than exponentials reach. */
static double least_square(int64_t n, const double *shift, const double *rate, double c) {
    double least = INFINITY;
    for (int64_t k = 0; k < n; k += 4) {
        const double height = mbma_fma(-rate[k], c, shift[k]);
        least = mbma_min(least, height * height);
    }
    return least;
}

/* Chebyshev series at x in [-1, 1], and their derivatives unless `slopes` is NULL. */
MBMA_INLINE void series_at(const double *series, int rows, int terms, double x, double *sums, double *slopes) {
    double before = 1.0, term = x, before_slope = 0.0, slope = 1.0;
    for (int row = 0; row < rows; row++) {
        sums[row] = series[row * terms];
        if (slopes)
            slopes[row] = 0.0;
    }
    /* polynomials of the first kind, and for their derivatives of the second */
    for (int k = 1; k < terms; k++) {
        for (int row = 0; row < rows; row++) {
            sums[row] = mbma_fma(series[row * terms + k], term, sums[row]);
            if (slopes)
                slopes[row] = mbma_fma(k * series[row * terms + k], slope, slopes[row]);
        }
        const double next = mbma_fma(2.0 * x, term, -before), next_slope = mbma_fma(2.0 * x, slope, -before_slope);
        before = term;
        term = next;
        before_slope = slope;
        slope = next_slope;
    }
}

/* Bound on the truncation error of a series. */
static double tail(const double *series, int terms) {
    return TAIL_SHARE * (fabs(series[terms - 1]) + fabs(series[terms - 2]));
}

/* Puts the islands of a panel up to the place `reach` behind `stop` others, by fields at its nodes from `first` on. */
static void place(const mbma_panel_rule *r, double width, double reach, double fields[ROWS + 2][NODES * (GAPS + 1)],
                  int rows, int first, const mbma_nodes *islands, int64_t stop) {
    for (int k = 0; k < r->count; k++) {
        const double at = reach * r->nodes[k], weight = reach * width * r->weights[k] * rise(r->power, at);
        for (int row = 0; row < rows; row++)
            islands->weights[row * islands->size + stop + k] =
                weight * fields[row][first + k] * lead(r->power, row, width * at * at);
        islands->shift[stop + k] = fields[rows][first + k];
        islands->rate[stop + k] = fields[rows + 1][first + k];
    }
}

void mbma_profile_series(const mbma_panel_rule *rules, size_t panels, const int64_t *kind, const double *low,
                         const double *high, const double *fields, int rows, double *series, double *error,
                         const mbma_nodes *islands, int64_t *stops) {
    double inside[ROWS + 2][NODES * (GAPS + 1)], ends[ROWS + 2][GAPS];
    int64_t stop = 0;
    stops[0] = 0;
    memset(series, 0, panels * (size_t)rows * TERMS * sizeof *series);
    for (size_t panel = 0; panel < panels; panel++) {
        const mbma_panel_rule *const r = &rules[kind[panel]];
        const double width = high[panel] - low[panel];
        const int count = (int)r->count, gaps = (int)r->gaps;
        for (int row = 0; row < rows + 2; row++) {
            const double *const own = fields + ((size_t)row * panels + panel) * PLACES;
            combined(own, &r->inside[0][0], count, count * (gaps + 1), NODES * (GAPS + 1), inside[row]);
            combined(own, &r->ends[0][0], count, gaps, GAPS, ends[row]);
        }
        /* at a maximum of force, slopes are as accurate as those of a straight line */
        double steepest[ROWS], values[ROWS][TERMS];
        for (int row = 0; row < rows; row++)
            steepest[row] = 1.0;
        for (int gap = 0; gap < gaps; gap++) {
            const double reach = r->reach[gap], c = low[panel] + width * (r->power > 1 ? reach * reach : reach);
            double sums[2 * ROWS] = {0.0};
            place(r, width, reach, inside, rows, gap * count, islands, stop);
            const double least = least_square(stop + count, islands->shift, islands->rate, c);
            add_sums(c, least, islands, rows, stop + count, sums);
            /* the island at the gap itself */
            const double height = ends[rows][gap] - ends[rows + 1][gap] * c;
            const double share = mbma_exp(0.5 * (least - height * height));
            for (int row = 0; row < rows; row++) {
                const double begun = r->power > 1 ? BEGUN[row] : 0.0;
                sums[rows + row] += share * lead(r->power, row, c) * ends[row][gap];
                const double steep = sums[rows + row] / sums[row];
                steepest[row] = mbma_max(steepest[row], c * fabs(steep));
                values[row][gap] = log(sums[row]) - 0.5 * least - begun * log(c);
                values[row][gaps + gap] = 0.5 * width * (steep - begun / c);
            }
        }
        place(r, width, 1.0, inside, rows, gaps * count, islands, stop);
        stop += count;
        stops[panel + 1] = stop;
        error[panel] = 0.0;
        const bool thin = width < THIN * high[panel];
        for (int row = 0; row < rows; row++) {
            double *const made = series + (panel * (size_t)rows + (size_t)row) * TERMS;
            combined(values[row], thin ? &r->integrated[0][0] : &r->series[0][0], 2 * gaps, 2 * gaps, TERMS, made);
            const double rest = thin ? tail(made, gaps + 1)
                                     : mbma_max(tail(made, 2 * gaps), OLDER * tail(made, 2 * gaps - 2));
            const double leverage = 4.0 * gaps * high[panel] / (width * steepest[row]);
            error[panel] = mbma_max(error[panel], rest * (1.0 + SLOPES * leverage));
        }
    }
}

/* The panel of a compression, by bisection, without unpredictable branches. */
MBMA_INLINE size_t panel_at(double c, size_t panels, const double *edges) {
    size_t first = 0, left = panels;
    while (left > 1) {
        const size_t half = left / 2;
        first += edges[first + half] <= c ? half : 0;
        left -= half;
    }
    return first;
}

void mbma_profile_totals(size_t n, const double *compression, size_t panels, const double *edges, const double *series,
                         int rows, int slopes, double *out) {
    double logs[ROWS][CHUNK], steep[ROWS][CHUNK], value[CHUNK], x[CHUNK], width[CHUNK];
    size_t panel[CHUNK];
    for (size_t start = 0; start < n; start += CHUNK) {
        const double *const c = compression + start;
        const size_t count = n - start < CHUNK ? n - start : CHUNK;
        for (size_t k = 0; k < count; k++) {
            double sums[ROWS], steeps[ROWS];
            panel[k] = panel_at(c[k], panels, edges);
            const double low = edges[panel[k]], high = edges[panel[k] + 1];
            const double *const own = series + panel[k] * (size_t)rows * TERMS;
            width[k] = high - low;
            x[k] = (2.0 * c[k] - low - high) / width[k];
            if (!slopes && rows == 2) /* the most frequent, with constants */
                series_at(own, 2, TERMS, x[k], sums, NULL);
            else
                series_at(own, rows, TERMS, x[k], sums, slopes ? steeps : NULL);
            for (int row = 0; row < rows; row++) {
                logs[row][k] = sums[row];
                steep[row][k] = slopes ? steeps[row] : 0.0;
            }
        }
        for (int row = 0; row < rows; row++) {
            for (size_t k = 0; k < count; k++)
                value[k] = mbma_exp(logs[row][k]);
            for (size_t k = 0; k < count; k++) {
                const bool begins = panel[k] == 0;
                double sum = value[k] * (begins ? c[k] * lead(2.0, row, c[k]) : 1.0);
                /* subnormal numbers, digit by digit */
                if (!(logs[row][k] > LEAST_LOG && sum > 1e-290))
                    sum = exp(logs[row][k] + (begins ? BEGUN[row] * log(c[k]) : 0.0));
                /* beyond the profile, and for NaN, the result is NaN */
                const bool inside = c[k] > 0.0 && x[k] <= 1.0 + 1e-12 * edges[panel[k] + 1] / width[k];
                const double none = c[k] <= 0.0 ? 0.0 : NAN;
                out[(size_t)row * n + start + k] = inside ? sum : none;
                if (slopes)
                    out[(size_t)(rows + row) * n + start + k] =
                        inside ? sum * (2.0 * steep[row][k] / width[k] + (begins ? BEGUN[row] / c[k] : 0.0)) : none;
            }
        }
    }
}

/* Bound on the relative error of one panel: of the interpolated islands, and of its sums. */
static double missed_by(const mbma_panel_rule *r, double low, double high, const double *fields, size_t stride,
                        int rows, double last) {
    double finer[ROWS + 2][2 * NODES], seen[ROWS + 2][CHECKS + 1], fine_weight[2 * NODES], coarse[3][NODES];
    double c[SPREAD + TOPS], least[SPREAD + TOPS];
    const double *const force = fields, *const shift = fields + (size_t)rows * stride, *const rate = shift + stride;
    const double width = high - low;
    const int count = (int)r->count;
    for (int row = 0; row < rows + 2; row++) {
        combined(fields + (size_t)row * stride, &r->checks[0][0], count, CHECKS, CHECKS, seen[row]);
        combined(fields + (size_t)row * stride, &r->halves[0][0], count, 2 * count, 2 * NODES, finer[row]);
    }
    double relative = 0.0, turned = 0.0;
    for (int k = 0; k < CHECKS; k++) {
        for (int row = 0; row < rows; row++) {
            const double known = fields[(size_t)row * stride + NODES + (size_t)k];
            if (known > 0.0) /* underflow to zero is correct here */
                relative = mbma_max(relative, fabs(seen[row][k] / known - 1.0));
        }
        /* heights matter where the Gaussian is large: near the gap of its maximum */
        const double true_shift = shift[NODES + k], true_rate = rate[NODES + k];
        const double at = mbma_held(true_shift / true_rate, high, last);
        const double off_shift = seen[rows][k] - true_shift, off_rate = seen[rows + 1][k] - true_rate;
        const double leading = LEADS / (true_rate * mbma_max(low, LEAST_APPROACH));
        const double highest = mbma_max(mbma_min(true_shift - true_rate * high, leading), HIGH);
        turned = mbma_max(turned, highest * (fabs(off_shift - off_rate * at) + highest * fabs(off_rate) / true_rate));
    }
    /* sums over whole panels, relative to the largest of the panel */
    for (int k = 0; k < 2 * count; k++) {
        const double at = 0.5 * (k < count ? r->nodes[k] : 1.0 + r->nodes[k - count]);
        fine_weight[k] = 0.5 * r->weights[k % count] * finer[0][k] * (rise(r->power, at) * lead(r->power, 0, width * at * at));
    }
    for (int k = 0; k < count; k++) {
        const double at = r->nodes[k];
        coarse[0][k] = r->weights[k] * force[k] * (rise(r->power, at) * lead(r->power, 0, width * at * at));
        coarse[1][k] = shift[k];
        coarse[2][k] = rate[k];
    }
    const mbma_nodes all = {2 * count, fine_weight, finer[rows], finer[rows + 1]};
    const mbma_nodes few = {count, coarse[0], coarse[1], coarse[2]};
    double lowest = INFINITY, most = 0.0, off = 0.0, alone = 0.0;
    for (int k = 0; k < SPREAD + TOPS; k++) {
        double top = low + (last - low) * k / (double)(SPREAD - 1);
        if (k >= SPREAD) {
            /* where Gaussians are narrow no such gap may meet one: gaps at which one has its top in the panel, or where
             * that is beyond the last gap, some of the way back from there */
            const int number = k - SPREAD, node = number * (count / TOPS);
            const double share = number / (double)(TOPS - 1);
            top = shift[node] / rate[node];
            top = top < last ? top : last - (last - high) * 0.25 * share * share * share;
        }
        c[k] = mbma_held(top, high, last);
        least[k] = least_square(2 * count, finer[rows], finer[rows + 1], c[k]);
        lowest = mbma_min(lowest, least[k]);
    }
    for (int k = 0; k < SPREAD + TOPS; k++) {
        double sum[2] = {0.0}, other[2] = {0.0};
        add_sums(c[k], least[k], &all, 1, 2 * count, sum);
        add_sums(c[k], least[k], &few, 1, count, other);
        const double scale = mbma_exp(0.5 * (lowest - least[k]));
        /* up to its own end, the panel from 0 is the only one */
        if (k == 0 && r->power > 1)
            alone = fabs(other[0] / sum[0] - 1.0);
        most = mbma_max(most, scale * sum[0]);
        off = mbma_max(off, scale * fabs(other[0] - sum[0]));
    }
    return AT_ENDS * relative + turned + BETWEEN * mbma_max(alone, off / most);
}

void mbma_profile_missed(const mbma_panel_rule *rules, size_t panels, const int64_t *kind, const double *low,
                         const double *high, const double *fields, int rows, double last, double *error) {
    for (size_t panel = 0; panel < panels; panel++)
        error[panel] = missed_by(&rules[kind[panel]], low[panel], high[panel], fields + panel * PLACES,
                                 panels * PLACES, rows, last);
}

int mbma_profile_islands(size_t n, const double *x, double peak, double hurst, double zeta_1, const mbma_variant *v,
                         const mbma_cells *cells, double *out, double *error) {
    const surface s = surface_of(hurst, zeta_1, v);
    int worst = MBMA_OK;
    *error = 0.0;
    for (size_t k = 0; k < n; k++) {
        const bool floor_d = x[k] >= s.kink_d;
        const island i = island_at(x[k], floor_d, x[k] > s.kink_u, &s);
        const phi found = phi_at(cells, i.X, i.mu);
        const double each = (floor_d ? 1.0 : s.jacobian) * i.count;
        out[k] = i.force * each * found.value[0];
        out[n + k] = i.area * each * found.value[1];
        out[2 * n + k] = height_of(peak + x[k], &i, &s);
        out[3 * n + k] = s.rms_over_s * i.narrowness;
        worst = found.status > worst ? found.status : worst;
        *error = mbma_max(*error, found.error);
    }
    return worst;
}
