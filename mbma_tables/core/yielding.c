/* Contact whose pressure cannot exceed a hardness p_m, from the elastic contact of the same surface;
 * docs/yield.md has the equations.
 *
 * Forces are over A0 E* g with g the rms gradient, eta = p_m/(E* g), heights and mean gaps over h_rms.
 * The stress in a contact diffuses with magnification (Persson, J. Chem. Phys. 115, 3840, 2001)
 * between walls at 0 and at p_m; its variance in units of p_m^2 is 2 tau.
 */
#include "elementary.h"
#include "heights.h"
#include "mbma.h"

#define IMAGES 0.06     /* tau below which images converge faster than a series */
#define TERMS 10        /* and one, of the series */
#define SHARPEST 1e-200 /* least tau */
#define NARROW 3e-3     /* half-width over which a difference goes by powers */
#define SEEN 6.0        /* above which erfc is below rounding of 1 */
#define LEAST_GAP 1e-300 /* mean gap at which all heights lie above the level */
#define MOST_LEVEL 9.0  /* above, the mean gap is the level itself */
/* the shares of heights and of elastic contact join as this power of their odds: by 0.1% where one is
 * half the other */
#define SHARPNESS 8.0
#define NEGLIGIBLE 1e-17       /* part of the larger one's odds that does not change its last digit */
#define FULLEST (1.0 - 1e-12)  /* largest share of elastic contact, whose odds are finite */
/* larger values give the same force */
#define MOST_ETA 1e100
#define MOST_RATIO 1e300
#define MOST_STEPS 60 /* of Newton's method, which needs fewer than ten */
#define MOST_TERMS 200 /* of a series in powers of at most 1/2, which needs about fifty */

#define ROOT_HALF 0.70710678118654752440
#define ROOT_TWO 1.41421356237309504880
#define ROOT_PI 1.77245385090551602730
#define ROOT_TWO_PI 2.50662827463100050242

/* the standard normal density, and the share of numbers below d */
static double density(double d) { return exp(-0.5 * d * d) / ROOT_TWO_PI; }
static double share_below(double d) { return 0.5 * erfc(-d * ROOT_HALF); }

/* ---- inverse functions ------------------------------------------------------------------------- */

/* x > 0 with erfc(x) = share, of share < 1 that is no smaller than LEAST_GAP. The logarithm is concave,
 * and erfc(x) < exp(-x^2), so that Newton's method comes from above. */
static double inverse_erfc(double share) {
    const double log_share = log(share);
    double x = sqrt(-log_share);
    for (int step = 0; step < MOST_STEPS; step++) {
        const double value = erfc(x), slope = -2.0 / ROOT_PI * exp(-x * x) / value;
        const double change = (log(value) - log_share) / slope;
        x -= change;
        if (!(fabs(change) > 1e-9 * x))
            break;
    }
    return x;
}

/* x with erf(x) = share; erf is concave and at most 2 x/sqrt(pi), so that Newton's method comes from
 * below. Infinite at 1, NaN beyond [0, 1]. */
static double inverse_erf(double share) {
    if (!(share >= 0.0 && share <= 1.0))
        return NAN;
    if (share == 1.0)
        return INFINITY;
    if (share > 0.5)
        return inverse_erfc(1.0 - share);
    double x = 0.5 * ROOT_PI * share;
    for (int step = 0; step < MOST_STEPS; step++) {
        const double change = (share - erf(x)) * 0.5 * ROOT_PI * exp(x * x);
        x += change;
        if (!(fabs(change) > 1e-9 * x))
            break;
    }
    return x;
}

/* d above which this share of Gaussian heights lies */
static double level_of_share(double share) {
    if (share > 0.5)
        return share < 1.0 ? -ROOT_TWO * inverse_erfc(2.0 * (1.0 - share)) : share > 1.0 ? NAN : -INFINITY;
    return share == 0.5 ? 0.0 : ROOT_TWO * inverse_erfc(2.0 * share);
}

/* The level d of Gaussian heights whose mean gap below it, d Phi(d) + phi(d), is u: Halley's method in
 * ln u from polynomials that err by 0.02. */
static double gaussian_level(double u) {
    const double gap = mbma_held(u, LEAST_GAP, MOST_LEVEL), log_gap = log(gap);
    if (u != u)
        return NAN;
    double d;
    if (gap < 1.0 / ROOT_TWO_PI) {
        const double w = sqrt(1.0 - log_gap - 0.91893853320467274178);
        d = ((((-1.0143944e-06 * w + 8.3822234e-05) * w + -0.0026956985) * w + 0.042932028) * w + -1.7761781) * w + 1.7342894;
    } else {
        const double w = 1.0 / (1.0 + gap);
        d = gap + (((3.0551076 * w + -6.6076778) * w + 3.0286633) * w + -0.49670935) * w + 0.0265812;
    }
    for (int step = 0; step < 4; step++) {
        const double mean = whole(1, -d), rate = share_below(d) / mean;
        const double miss = log(mean) - log_gap, bend = density(d) / mean - rate * rate;
        const double change = miss / (rate - 0.5 * miss * bend / rate);
        d -= change;
        if (!(fabs(change) > 1e-5))
            break;
    }
    return d + mbma_max(u - MOST_LEVEL, 0.0);
}

size_t mbma_gaussian_levels(size_t n, const double *u, double *level) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        level[k] = gaussian_level(u[k]);
        bad += level[k] != level[k];
    }
    return bad;
}

/* A share of the nominal area and its derivative by the mean gap. */
typedef struct {
    double share, slope;
} bearing;

/* The highest point of Gaussian heights, and its level. */
typedef struct {
    double last, level;
} highest;

/* Most calls have one highest point, whose level is found once. */
static highest highest_at(double last, highest known) {
    if (last == known.last)
        return known;
    const highest found = {last, last < INFINITY ? gaussian_level(last) : last};
    return found;
}

/* The share of Gaussian heights above the level of a mean gap. */
static bearing gaussian_bearing(double u, highest end) {
    const double d = gaussian_level(u), below = share_below(d), all = share_below(end.level);
    const double above = end.level > 0.0 ? share_below(-d) - share_below(-end.level) : all - below;
    const double steep = u <= LEAST_GAP ? -INFINITY : -density(d) / below;
    const bearing none = {NAN, NAN}, found = {mbma_max(above, 0.0) / all, u >= end.last ? 0.0 : steep / all};
    return d == d && end.level == end.level ? found : none;
}

static const highest UNKNOWN = {NAN, NAN};

size_t mbma_bearing_shares(size_t n, const double *u, const double *last, double *share, double *slope) {
    highest end = UNKNOWN;
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        end = highest_at(last[k], end);
        const bearing found = gaussian_bearing(u[k], end);
        share[k] = found.share;
        slope[k] = found.slope;
        bad += found.share != found.share;
    }
    return bad;
}

/* ---- diffusion between walls ------------------------------------------------------------------- */

/* erfc(centre - half) - erfc(centre + half); by powers where that would cancel */
static double difference(double centre, double half) {
    if (!(half * mbma_max(centre, 1.0) < NARROW))
        return erfc(centre - half) - erfc(centre + half);
    const double a = half * half * centre * centre, b = half * half;
    const double series = 1.0 + (2.0 * a - b) / 3.0 + (a * (2.0 / 3.0 * a - 2.0 * b) + 0.5 * b * b) / 5.0;
    return 4.0 / ROOT_PI * half * exp(-centre * centre) * series;
}

/* x + 2/pi sum_n sign^n sin(n pi x) exp(-n^2 pi^2 tau)/n */
static double series_of_walls(double x, double tau, double sign) {
    const double first = exp(-MBMA_PI * MBMA_PI * tau), twice = 2.0 * sign * cos(MBMA_PI * x);
    double before = 0.0, sine = sign * sin(MBMA_PI * x), total = 0.0;
    /* exp(-n^2 pi^2 tau) by the odd powers between the squares */
    double odd = first, factor = first;
    for (int n = 1; n < TERMS; n++) {
        const double next = twice * sine - before;
        total += sine * factor / n;
        before = sine;
        sine = next;
        odd *= first * first;
        factor *= odd;
    }
    return x + 2.0 / MBMA_PI * total;
}

/* Share of a diffusion from x, between walls at 0 and 1, after a variance of 2 tau: what is not absorbed
 * at 0, or with a negative sign what is absorbed at 1; reach is x/sqrt(4 tau). */
static double diffused(double x, double tau, double sign, double reach) {
    if (!(x >= 0.0 && x <= 1.0 && tau >= 0.0))
        return NAN;
    if (tau >= IMAGES)
        return series_of_walls(x, tau, sign);
    const double over = 0.5 / sqrt(mbma_max(tau, SHARPEST));
    if (sign < 0.0)
        return difference(over, reach) + difference(3.0 * over, reach);
    return erf(reach) + (2.0 * over - reach < SEEN ? difference(2.0 * over, reach) : 0.0);
}

size_t mbma_diffused(size_t n, const double *x, const double *tau, double sign, double *share) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        share[k] = diffused(x[k], tau[k], sign, x[k] * (0.5 / sqrt(mbma_max(tau[k], SHARPEST))));
        bad += share[k] != share[k];
    }
    return bad;
}

/* ---- contact with a hardness ------------------------------------------------------------------- */

/* A/A0, or its yielded part, by e, erf(e) being the elastic A/A0 at the same force */
static double area_at(double force, double elastic_area, double eta, double power, double scale, int yielded) {
    const double e = inverse_erf(elastic_area);
    if (!(force >= 0.0 && force < INFINITY && e >= 0.0 && eta > 0.0))
        return NAN;
    const double x = mbma_min(force / eta, 1.0);
    if (!(x > 0.0))
        return !yielded && force > 0.0 ? elastic_area : 0.0;
    if (!(e < INFINITY))
        return yielded ? (double)(x == 1.0) : 1.0;
    /* tau of the elastic contact and of the hardness alone */
    const double half = 0.5 * x / e, elastic = half * half, limit = 0.125 / (scale * sqrt(eta));
    const double small = mbma_min(elastic, limit), large = mbma_max(elastic, limit);
    const double joint = exp(log1p(exp(power * log(small / large))) / (2.0 * power));
    const double reach = (elastic < limit ? e : 0.5 * x / sqrt(limit)) * joint;
    const double share = diffused(x, small / (joint * joint), yielded ? -1.0 : 1.0, reach);
    /* without rounding */
    return yielded ? mbma_max(mbma_min(share, x), 0.0) : mbma_min(mbma_max(share, x), 1.0);
}

size_t mbma_yielding_areas(size_t n, const double *force, const double *elastic_area, const double *eta,
                           const mbma_hardness_law *law, int yielded, double *area) {
    const double power = yielded ? law->yield_power : law->area_power;
    const double scale = yielded ? law->yield_scale : law->area_scale;
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const double elastic = elastic_area[k], most = mbma_max(elastic, 1.0);
        const double share = area_at(force[k], elastic > 1.0 ? 1.0 : elastic, eta[k], power, scale, yielded);
        area[k] = yielded ? share : share * most;
        bad += area[k] != area[k];
    }
    return bad;
}

/* The share of heights above the level, or what the elastic contact covers without yielding, of which the
 * odds of the larger count, without a kink where they are equal. */
static bearing joined(bearing heights, double elastic, double stiffness, double eta) {
    const double unyielded = -expm1(-2.0 * eta * eta);
    const double covered = mbma_min(unyielded * erf(ROOT_TWO * elastic), FULLEST);
    const double by_gap = -unyielded * sqrt(8.0 / MBMA_PI) * exp(-2.0 * elastic * elastic) * stiffness;
    const double log_odds = log(heights.share / (1.0 - heights.share));
    const double log_covered = log(covered / (1.0 - covered));
    const double excess = exp(SHARPNESS * (log_covered - log_odds));
    if (!(excess > NEGLIGIBLE) || heights.share == 1.0)
        return heights;
    const double of_larger = mbma_max(log_odds, log_covered);
    const double log_sum = of_larger + log1p(mbma_min(excess, 1.0 / excess)) / SHARPNESS;
    const double share = 1.0 / (1.0 + exp(-log_sum));
    const double covered_rate = by_gap / (covered * (1.0 - covered));
    const double heights_rate = heights.slope / (heights.share * (1.0 - heights.share));
    const double rate =
        excess < INFINITY ? covered_rate + (heights_rate - covered_rate) / (1.0 + excess) : covered_rate;
    const bearing both = {share, share * (1.0 - share) * rate};
    return both;
}

/* F and -dF/du: the power mean of exponent -n of the elastic force and eta Q */
static void force_at(double elastic, double stiffness, bearing heights, double eta, const mbma_hardness_law *law,
                     double *force, double *steep) {
    const double cap = mbma_min(eta, MOST_ETA);
    const bearing Q = joined(heights, elastic, stiffness, cap);
    const double level = eta < INFINITY ? eta * Q.share : INFINITY, small = mbma_min(elastic, level);
    *force = *steep = NAN;
    if (elastic != elastic || level != level || !(eta > 0.0))
        return;
    *force = *steep = small;
    /* without contact the force is zero */
    if (!(small > 0.0))
        return;
    const double n = law->force_light + law->force_eta * cap + law->force_share * Q.share;
    /* an infinite force has no weight */
    const double gain = log(mbma_min(mbma_max(elastic, level) / small, MOST_RATIO));
    const double power = exp(-n * gain), weight = power / (1.0 + power);
    /* ln F lies so much below that of the smaller; derivatives by the elastic force, and by Q */
    const double lower = log1p(power) / n;
    const double by_elastic = elastic <= level ? 1.0 - weight : weight;
    const double by_level = (1.0 - by_elastic) / Q.share + law->force_share * (lower + weight * gain) / n;
    const double of_elastic = elastic < INFINITY ? by_elastic * stiffness / elastic : 0.0;
    const double of_level = by_level > 0.0 ? by_level * Q.slope : 0.0;
    *force = small * exp(-lower);
    *steep = *force * (of_elastic - of_level);
}

size_t mbma_yielding_forces(size_t n, const double *elastic, const double *stiffness, const double *share,
                            const double *slope, const double *eta, const mbma_hardness_law *law, double *force,
                            double *steep) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const bearing heights = {share[k], slope[k]};
        force_at(elastic[k], stiffness[k], heights, eta[k], law, &force[k], &steep[k]);
        bad += force[k] != force[k] || steep[k] != steep[k];
    }
    return bad;
}

size_t mbma_yielding_at_gaps(size_t n, const double *elastic, const double *stiffness, const double *u,
                             const double *last, const double *eta, const mbma_hardness_law *law, double *force,
                             double *steep) {
    highest end = UNKNOWN;
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        end = highest_at(last[k], end);
        force_at(elastic[k], stiffness[k], gaussian_bearing(u[k], end), eta[k], law, &force[k], &steep[k]);
        bad += force[k] != force[k] || steep[k] != steep[k];
    }
    return bad;
}

size_t mbma_frozen_factors(size_t n, const double *eta, const mbma_hardness_law *law, double *factor) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        factor[k] = 1.0 + law->frozen * exp(-eta[k] / law->frozen_eta);
        bad += factor[k] != factor[k];
    }
    return bad;
}

/* ---- what follows from the stiffness of a small unloading --------------------------------------- */

size_t mbma_tangential_ratios(size_t n, const double *nu, const double *share, double *kappa) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        kappa[k] = (1.0 - nu[k] * share[k]) / (1.0 - nu[k]);
        bad += kappa[k] != kappa[k];
    }
    return bad;
}

size_t mbma_tangential_stiffnesses(size_t n, const double *stiffness, const double *kappa, double *tangential) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        tangential[k] = stiffness[k] / kappa[k];
        bad += tangential[k] != tangential[k];
    }
    return bad;
}

size_t mbma_solid_conductances(size_t n, const double *stiffness, const double *k_s, const double *E_star,
                               double *conductance) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        conductance[k] = k_s[k] / E_star[k] * stiffness[k];
        bad += conductance[k] != conductance[k];
    }
    return bad;
}

size_t mbma_yielding_planes(size_t n, const double *u, const double *load, const double *eta,
                            const mbma_hardness_law *law, double *gap) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const double x = load[k];
        double flattened = x <= 1.0 ? 0.0 : NAN;
        /* phi(d) - d x, the mean height above the level */
        if (x > LEAST_GAP && x <= 1.0)
            flattened = x < 1.0 ? whole(1, level_of_share(x)) : INFINITY;
        gap[k] = u[k] - flattened * exp(-(law->plane_eta - law->plane_load * x) * eta[k]);
        bad += gap[k] != gap[k];
    }
    return bad;
}

/* ---- after a larger pressure -------------------------------------------------------------------- */

/* s = p/p0 is the pressure over the largest one, and [1 - (1-s)^a]^b the stiffness, or the area, of
 * flattened spots over that at s = 1, with 0 < b < 1. */
static double flattened(double s, double a, double b) {
    return s >= 0.0 && s <= 1.0 ? pow(-expm1(a * log1p(-s)), b) : NAN;
}

/* B_x(p, q)/x^p, the incomplete beta function: sum_n (1-q)_n/n! x^n/(p+n), for x up to 1/2 */
static double beta_series(double p, double q, double x) {
    double factor = 1.0, sum = 1.0 / p;
    for (int n = 1; n < MOST_TERMS; n++) {
        factor *= (n - q) / n * x;
        const double term = factor / (p + n);
        sum += term;
        if (!(fabs(term) > NEGLIGIBLE * fabs(sum)))
            break;
    }
    return sum;
}

/* Integral of (1-t)^(order-1)/[1 - (1-t)^a]^b over t from s to 1: B_x(order/a, 1-b)/a with x = (1-s)^a */
static double moment(double s, double a, double b, int order) {
    const double p = order / a, q = 1.0 - b, y = -expm1(a * log1p(-s)), x = 1.0 - y;
    if (x <= 0.5)
        return pow(1.0 - s, order) * beta_series(p, q, x) / a;
    const double all = pow(0.5, p) * beta_series(p, q, 0.5) + pow(0.5, q) * beta_series(q, p, 0.5);
    return (all - pow(y, q) * beta_series(q, p, y)) / a;
}

/* Integral of t/[1 - (1-t)^a]^b over t from 0 to s. For small s the series of both its parts, of 1 and of
 * 1 - t, are subtracted term by term, as they agree in the first. */
static double flat_energy(double s, double a, double b) {
    const double q = 1.0 - b, y = -expm1(a * log1p(-s));
    if (y > 0.5)
        return moment(0.0, a, b, 1) - moment(0.0, a, b, 2) - moment(s, a, b, 1) + moment(s, a, b, 2);
    double one = 1.0, rest = 1.0, sum = 0.0;
    for (int n = 1; n < MOST_TERMS; n++) {
        one *= (n - 1.0 / a) / n * y;
        rest *= (n - 2.0 / a) / n * y;
        const double term = (one - rest) / (q + n);
        sum += term;
        if (!(fabs(term) > NEGLIGIBLE * fabs(sum)))
            break;
    }
    return pow(y, q) * sum / a;
}

size_t mbma_flat_energies(size_t n, const double *s, const double *power, const double *exponent, double *energy) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const double a = power[k], b = exponent[k];
        const int good = s[k] >= 0.0 && s[k] <= 1.0 && a > 0.0 && a < INFINITY && b >= 0.0 && b < 1.0;
        energy[k] = good ? flat_energy(s[k], a, b) : NAN;
        bad += energy[k] != energy[k];
    }
    return bad;
}

size_t mbma_flat_spots(size_t n, const double *yielded, const double *area, const mbma_spots_law *law, double *weight,
                       double *power, double *exponent) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const double load = log(mbma_held(area[k], law->least_area, law->most_area) / law->area);
        const double rest = 1.0 - yielded[k];
        const double steep = law->power + law->power_elastic * rest + law->power_area * load;
        const double logit = law->exponent + law->exponent_elastic * rest + law->exponent_area * load;
        weight[k] = pow(yielded[k], law->weight);
        power[k] = 1.0 + exp(steep);
        exponent[k] = 1.0 / (1.0 + exp(-logit));
        bad += weight[k] != weight[k] || power[k] != power[k] || exponent[k] != exponent[k];
    }
    return bad;
}

size_t mbma_unloaded_stiffnesses(size_t n, const double *s, const double *elastic, const double *weight,
                                 const double *power, const double *exponent, double *ratio) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const double w = weight[k], flat = flattened(s[k], power[k], exponent[k]);
        ratio[k] = s[k] == 0.0 ? 0.0 : 1.0 / ((1.0 - w) / elastic[k] + w / flat);
        bad += ratio[k] != ratio[k];
    }
    return bad;
}

size_t mbma_unloaded_areas(size_t n, const double *s, const double *elastic, const double *weight, const double *power,
                           const double *exponent, double *ratio) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const double w = weight[k], flat = flattened(s[k], power[k], exponent[k]);
        ratio[k] = s[k] == 0.0 ? 0.0 : pow(elastic[k], 1.0 - w) * pow(flat, w);
        bad += ratio[k] != ratio[k];
    }
    return bad;
}

size_t mbma_unloaded_gaps(size_t n, const double *s, const double *elastic, const double *depth, const double *weight,
                          const double *power, const double *exponent, double *raised) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const double w = weight[k], share = s[k];
        const double flat = share >= 0.0 && share <= 1.0 ? moment(share, power[k], exponent[k], 1) : NAN;
        raised[k] = (1.0 - w) * elastic[k] + w * flat * depth[k];
        bad += raised[k] != raised[k];
    }
    return bad;
}

size_t mbma_unloaded_flows(size_t n, const double *before, const double *raised, const double *u, double opening,
                           double *flow) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const double gap = u[k], aperture = cbrt(before[k]) + opening * raised[k];
        const double open = gap * gap * gap * mbma_wide_gap(gap);
        /* channels of a contact that was blocked are not known */
        flow[k] = before[k] > 0.0 ? mbma_min(aperture * aperture * aperture, open) : NAN;
        bad += flow[k] != flow[k];
    }
    return bad;
}
