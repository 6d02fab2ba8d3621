/* Force and area of a surface at a gap: adaptive Gauss-Kronrod quadrature over the approaches of its islands (44-50).
 *
 * Below the floor of zeta_d the approach is mapped by x = scale sinh(t)^2, a power at 0 and geometric beyond the
 * boundary layer; above it the integrand is nearly a Gaussian of x, and x itself is used.
 */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("no-thread-jumps") /* which adds branches that prevent vectorisation of the loop over nodes */
#endif
#include "island.h"
#include "phi.h"

size_t mbma_phi(size_t n, const double *X, const double *mu, const mbma_cells *cells, double *out, uint8_t *status) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const phi found = phi_at(cells, X[k], mu[k]);
        out[3 * k] = found.value[0], out[3 * k + 1] = found.value[1], out[3 * k + 2] = found.error;
        bad += found.status != MBMA_OK;
        if (status)
            status[k] = (uint8_t)found.status;
    }
    return bad;
}

enum { MAX_INTERVALS = 200 };

#define LEAST (-700.0) /* of exponents: below it a Gaussian is negligible */

/* A Kronrod sum errs by at most 3 (difference to Gauss)^1.5, seen over random surfaces: 4^1.5 = 8. With a lower floor
 * of zeta_d than the paper's the difference has a larger factor. */
#define PAPER_FLOOR 1.5
#define SAFETY 4.0
#define SAFETY_BELOW 400.0

/* The whole rule, nodes filled up with 0 to whole vectors. */
enum { COUNT = 31, MOST_NODES = 32 };
typedef struct {
    double nodes[MOST_NODES], kronrod[MOST_NODES], gauss[MOST_NODES];
} rule;

/* A surface and gap, the settings of its sums, and the number of evaluations. */
typedef struct {
    surface s;
    double compression, peak; /* (h_max - d)/h_rms and h_max/h_rms */
    double safety, table_error;
    int64_t islands;
    /* the universal table; or one of four numbers, its function, and the Hurst exponent */
    const mbma_cells *cells;
    const mbma_island_table *table;
    mbma_island_function *answers;
    double hurst;
    rule r;
} gap;

/* An interval of the mapped approach, whether zeta_d and zeta_u are at their floors in it, and its sums. */
typedef struct {
    double low, high, error;
    bool floor_d, floor_u, known;
    double sums[2][2]; /* of force and area: value, and derivative by the compression */
} interval;

/* Numbers at the nodes of a rule: X, mu, logarithms of zeta_d and of zeta_u/zeta_d, what force and area add per Phi_F and
 * Phi_A, and how both rise with the compression. */
typedef struct {
    double X[MOST_NODES], mu[MOST_NODES], log_d[MOST_NODES], width[MOST_NODES];
    double weight[2][MOST_NODES], rise[MOST_NODES];
} at_nodes;

/* A loop over the nodes of an interval that vectorises: the floors are constants, nothing is called. */
MBMA_INLINE void fill_nodes(bool floor_d, bool floor_u, const interval *p, const rule *restrict r, const gap *g,
                            at_nodes *restrict out) {
    const double half = 0.5 * (p->high - p->low), centre = 0.5 * (p->high + p->low), scale = g->s.map_scale;
    for (int k = 0; k < MOST_NODES; k++) {
        const double t = mbma_fma(half, r->nodes[k], centre);
        /* sinh and cosh by expm1: exponentials would cancel at small t */
        const double more = mbma_expm1(t), inverse = 1.0 / (more + 1.0), rise = 0.5 * (more + more * inverse);
        const double x = floor_d ? t : scale * rise * rise;
        const double stretch = floor_d ? half : half * scale * rise * (more + 1.0 + inverse);
        const island n = island_at(x, floor_d, floor_u, &g->s);
        /* z_max is counted down from h_max, so nothing cancels at first contact */
        const double height = height_of(g->peak - (g->compression - x), &n, &g->s);
        const double exponent = -0.5 * height * height, gaussian = mbma_exp(exponent);
        const double weight = n.count * stretch * (exponent > LEAST ? gaussian : 0.0);
        out->X[k] = n.X;
        out->mu[k] = n.mu;
        out->log_d[k] = n.log_d;
        out->width[k] = n.width;
        out->weight[0][k] = n.force * weight;
        out->weight[1][k] = n.area * weight;
        out->rise[k] = height * g->s.rms_over_s * n.narrowness;
    }
}

/* Phi_F and Phi_A of islands, and the largest error of the table so far. */
static int look_up(gap *g, size_t n, const at_nodes *at, double values[2][MOST_NODES]) {
    if (!g->table) {
        for (size_t k = 0; k < n; k++) {
            const phi found = phi_at(g->cells, at->X[k], at->mu[k]);
            if (found.status != MBMA_OK)
                return found.status;
            g->table_error = mbma_max(g->table_error, found.error);
            values[0][k] = found.value[0];
            values[1][k] = found.value[1];
        }
        return MBMA_OK;
    }
    double spread[MOST_NODES], sphere[MOST_NODES], hurst[MOST_NODES], error[MOST_NODES];
    for (size_t k = 0; k < n; k++) {
        spread[k] = mbma_expm1(at->width[k]);
        sphere[k] = mbma_exp((4.0 - 2.0 * g->hurst) * (mbma_log(MBMA_SPHERE_FLOOR) - at->log_d[k]));
        hurst[k] = g->hurst;
    }
    if (g->answers(n, at->X, spread, sphere, hurst, at->mu, g->table, values[0], values[1], error))
        return MBMA_OUTSIDE;
    for (size_t k = 0; k < n; k++)
        g->table_error = mbma_max(g->table_error, error[k]);
    return MBMA_OK;
}

/* The pieces of [0, compression] between the kinks; their number. */
static int first_intervals(const gap *g, interval *intervals) {
    const double first = mbma_min(g->s.kink_d, g->s.kink_u), second = mbma_max(g->s.kink_d, g->s.kink_u);
    const double edges[4] = {0.0, mbma_min(first, g->compression), mbma_min(second, g->compression), g->compression};
    int count = 0;
    for (int k = 0; k < 3; k++) {
        const double low = edges[k], high = edges[k + 1], middle = 0.5 * (low + high);
        interval p = {low, high, 0.0, middle > g->s.kink_d, middle > g->s.kink_u, false, {{0.0}}};
        if (!p.floor_d) {
            p.low = asinh(sqrt(low / g->s.map_scale));
            p.high = asinh(sqrt(high / g->s.map_scale));
        }
        if (high > low)
            intervals[count++] = p;
    }
    return count;
}

/* One Kronrod rule over an interval: its sums, with K1 (47), and their relative error. */
static int apply_rule(interval *p, gap *g) {
    const rule *const r = &g->r;
    double sums[2][2] = {{0.0}}, gauss[2] = {0.0}, values[2][MOST_NODES];
    at_nodes at;
    /* loops of their own for compilers, with constants */
    if (p->floor_d && p->floor_u)
        fill_nodes(true, true, p, r, g, &at);
    else if (p->floor_d)
        fill_nodes(true, false, p, r, g, &at);
    else if (p->floor_u)
        fill_nodes(false, true, p, r, g, &at);
    else
        fill_nodes(false, false, p, r, g, &at);
    g->islands += COUNT;
    const int status = look_up(g, COUNT, &at, values);
    if (status != MBMA_OK)
        return status;
    for (int k = 0; k < COUNT; k++) {
        for (int q = 0; q < 2; q++) {
            const double term = at.weight[q][k] * values[q][k], share = r->kronrod[k] * at.weight[q][k];
            sums[q][0] = mbma_fma(r->kronrod[k], term, sums[q][0]);
            gauss[q] = mbma_fma(r->gauss[k], term, gauss[q]);
            sums[q][1] += share * values[q][k] * at.rise[k];
        }
    }
    /* the larger of both: both integrands are resolved alike, and one may agree by chance */
    const double difference = mbma_max(fabs(gauss[0] / sums[0][0] - 1.0), fabs(gauss[1] / sums[1][0] - 1.0));
    const double scaled = g->safety * difference;
    p->error = sums[0][0] > 0.0 && sums[1][0] > 0.0 ? mbma_min(difference, scaled * sqrt(scaled)) : 0.0;
    p->known = true;
    for (int q = 0; q < 2; q++)
        for (int c = 0; c < 2; c++)
            p->sums[q][c] = sums[q][c] * (p->floor_d ? 1.0 : g->s.jacobian);
    return MBMA_OK;
}

/* Integrates over the approaches to `rtol`. */
static int total(gap *g, double rtol, double sums[2][2], double *bound) {
    interval intervals[MAX_INTERVALS];
    int count = first_intervals(g, intervals);
    g->table_error = 0.0;
    for (;;) {
        double errors[2] = {0.0};
        memset(sums, 0, 2 * sizeof *sums);
        for (int k = 0; k < count; k++) {
            interval *const p = &intervals[k];
            const int status = p->known ? MBMA_OK : apply_rule(p, g);
            if (status != MBMA_OK)
                return status;
            for (int q = 0; q < 2; q++) {
                for (int c = 0; c < 2; c++)
                    sums[q][c] += p->sums[q][c];
                errors[q] += p->sums[q][0] * p->error;
            }
        }
        const double force = sums[0][0], area = sums[1][0];
        *bound = 0.0;
        if (!(force > 0.0 && area > 0.0))
            return MBMA_OK;
        if (errors[0] <= rtol * force && errors[1] <= rtol * area) {
            /* at least the requested one: sums of an interval may agree by chance */
            *bound = mbma_max(mbma_max(errors[0] / force, errors[1] / area), rtol) + g->table_error;
            return MBMA_OK;
        }
        const int present = count;
        for (int k = 0; k < present; k++) {
            interval *const p = &intervals[k];
            const double share = present * p->error;
            if (!(p->sums[0][0] * share > rtol * force || p->sums[1][0] * share > rtol * area))
                continue;
            if (count == MAX_INTERVALS)
                return MBMA_UNRESOLVED;
            p->known = false;
            intervals[count] = *p;
            p->high = intervals[count++].low = 0.5 * (p->low + p->high);
        }
        if (count == present) /* for NaN, for example in rtol */
            return MBMA_UNRESOLVED;
    }
}

/* What the upper limit adds to the derivatives by the compression: the integrands of force and area there. */
static int add_ends(gap *g, double sums[2][2]) {
    const surface *const s = &g->s;
    const island n = island_at(g->compression, g->compression >= s->kink_d, g->compression > s->kink_u, s);
    double values[2][MOST_NODES];
    at_nodes at;
    at.X[0] = n.X, at.mu[0] = n.mu, at.log_d[0] = n.log_d, at.width[0] = n.width;
    const int status = look_up(g, 1, &at, values);
    if (status != MBMA_OK)
        return status;
    const double height = height_of(g->peak, &n, s), K1 = g->compression > s->kink_d ? 1.0 : s->jacobian;
    const double weight = n.count * exp(-0.5 * height * height);
    sums[0][1] += K1 * (n.force * values[0][0] * weight);
    sums[1][1] += K1 * (n.area * values[1][0] * weight);
    return MBMA_OK;
}

/* QUADPACK's Gauss-Kronrod rule of 31 nodes (Piessens, de Doncker-Kapenga, Ueberhuber and Kahaner 1983), which is
 * symmetric: nodes from 1 to 0. Every second one, from the second on, is also a Gauss node. */
static const struct {
    double nodes[16], kronrod[16], gauss[8];
} HALF = {
    {0.9980022986933971, 0.9879925180204854, 0.9677390756791391, 0.937273392400706, 0.8972645323440819,
     0.8482065834104272, 0.790418501442466, 0.7244177313601701, 0.650996741297417, 0.5709721726085388,
     0.4850818636402397, 0.3941513470775634, 0.29918000715316884, 0.20119409399743451, 0.1011420669187175, 0.0},
    {0.005377479872923349, 0.015007947329316122, 0.02546084732671532, 0.03534636079137585, 0.04458975132476488,
     0.05348152469092809, 0.06200956780067064, 0.06985412131872826, 0.07684968075772038, 0.08308050282313302,
     0.08856444305621176, 0.09312659817082532, 0.09664272698362368, 0.09917359872179196, 0.10076984552387559,
     0.10133000701479154},
    {0.03075324199611727, 0.07036604748810812, 0.10715922046717194, 0.13957067792615432, 0.16626920581699392,
     0.1861610000155622, 0.19843148532711158, 0.2025782419255613}};

/* The whole rule; Gauss weights are zero at nodes of Kronrod's alone. */
static rule whole_rule(void) {
    rule r = {{0.0}, {0.0}, {0.0}};
    for (int k = 0; k < COUNT; k++) {
        const bool upper = 2 * k >= COUNT;
        const int own = upper ? COUNT - 1 - k : k;
        r.nodes[k] = upper ? HALF.nodes[own] : -HALF.nodes[own];
        r.kronrod[k] = HALF.kronrod[own];
        r.gauss[k] = own % 2 ? HALF.gauss[own / 2] : 0.0;
    }
    return r;
}

/* Totals by the tables of `settings`. */
static size_t fill_totals(const gap *settings, size_t n, const double *hurst, const double *zeta_1,
                          const double *compression, const double *peak, double rtol, const mbma_variant *v,
                          double *out, double *error, uint8_t *status, int64_t *islands) {
    double own_hurst = NAN, own_zeta_1 = NAN;
    size_t bad = 0;
    gap g = *settings;
    g.safety = v->floor_d >= PAPER_FLOOR ? SAFETY : SAFETY_BELOW;
    g.r = whole_rule();
    for (size_t k = 0; k < n; k++) {
        double sums[2][2] = {{0.0}};
        int found = MBMA_OK;
        error[k] = 0.0;
        g.compression = compression[k];
        g.peak = peak[k];
        g.hurst = hurst[k];
        if (!(hurst[k] > 0.0 && hurst[k] <= 1.0 && zeta_1[k] > v->floor_u && zeta_1[k] <= MBMA_MAX_ZETA_1 &&
              fabs(g.compression) < INFINITY && g.peak > 0.0 && g.peak < INFINITY))
            found = MBMA_INVALID;
        else if (g.compression > 0.0) {
            if (hurst[k] != own_hurst || zeta_1[k] != own_zeta_1)
                g.s = surface_of(own_hurst = hurst[k], own_zeta_1 = zeta_1[k], v);
            found = total(&g, rtol, sums, &error[k]);
            if (found == MBMA_OK && sums[0][0] > 0.0 && sums[1][0] > 0.0)
                found = add_ends(&g, sums);
        }
        for (size_t c = 0; c < 4; c++)
            if (!(fabs(sums[c / 2][c % 2]) < INFINITY) && found == MBMA_OK)
                found = MBMA_UNRESOLVED;
        for (size_t c = 0; c < 4; c++)
            out[4 * k + c] = found == MBMA_OK ? sums[c / 2][c % 2] : NAN;
        error[k] = found == MBMA_OK ? error[k] : NAN;
        status[k] = (uint8_t)found;
        bad += found != MBMA_OK;
    }
    *islands = g.islands;
    return bad;
}

size_t mbma_totals(size_t n, const double *hurst, const double *zeta_1, const double *compression, const double *peak,
                   double rtol, const mbma_variant *v, const mbma_cells *cells, double *out, double *error,
                   uint8_t *status, int64_t *islands) {
    gap g;
    memset(&g, 0, sizeof g);
    g.cells = cells;
    return fill_totals(&g, n, hurst, zeta_1, compression, peak, rtol, v, out, error, status, islands);
}

size_t mbma_island_totals(size_t n, const double *hurst, const double *zeta_1, const double *compression,
                          const double *peak, double rtol, const mbma_variant *v, const mbma_island_table *table,
                          mbma_island_function *answers, double *out, double *error, uint8_t *status,
                          int64_t *islands) {
    gap g;
    memset(&g, 0, sizeof g);
    g.table = table;
    g.answers = answers;
    return fill_totals(&g, n, hurst, zeta_1, compression, peak, rtol, v, out, error, status, islands);
}

int mbma_island_geometry(double approach, double hurst, double zeta_1, const mbma_variant *v, mbma_island *out) {
    static const mbma_island NONE = {NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN};
    *out = NONE;
    if (!(approach >= MBMA_MIN_APPROACH && approach < INFINITY && hurst > 0.0 && hurst <= 1.0 &&
          zeta_1 > v->floor_u && zeta_1 <= MBMA_MAX_ZETA_1))
        return MBMA_INVALID;
    const surface s = surface_of(hurst, zeta_1, v);
    const bool floor_u = approach >= s.kink_u;
    const island n = island_at(approach, approach >= s.kink_d, floor_u, &s);
    const double zeta_d = exp(n.log_d);
    const mbma_island found = {zeta_d, zeta_d * exp(n.width), n.R_d, n.R_u, n.D, n.sigma, n.h_d,
                               floor_u ? s.root_floor_u : s.slope_u * approach, n.eta, n.X, n.mu, n.D_d, n.sigma_d,
                               n.width};
    *out = found;
    return MBMA_OK;
}

size_t mbma_covered_areas(size_t n, const double *sum, double *area) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        area[k] = -mbma_expm1(-sum[k]);
        bad += area[k] != area[k];
    }
    return bad;
}
