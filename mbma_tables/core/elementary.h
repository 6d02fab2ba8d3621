/* Elementary functions for loops that vectorise: no branch, no call. Each errs by less than 1e-15 of its value.
 *
 * mbma_fma(a, b, c) is a b + c with one rounding where the processor has that instruction. The core is compiled
 * without contraction, so that it is the only place where roundings depend on the processor: builds that have the
 * instruction give the same bits.
 */
#ifndef MBMA_ELEMENTARY_H
#define MBMA_ELEMENTARY_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
#define restrict __restrict
#endif

#if defined(__GNUC__)
#define MBMA_INLINE static inline __attribute__((always_inline, unused))
#else
#define MBMA_INLINE static inline
#endif

#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
#define mbma_fma(a, b, c) __builtin_fma(a, b, c)
#else
#define mbma_fma(a, b, c) ((a) * (b) + (c))
#endif

#define MBMA_PI 3.14159265358979323846

MBMA_INLINE int64_t mbma_bits(double x) {
    int64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

MBMA_INLINE double mbma_float(int64_t bits) {
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

MBMA_INLINE double mbma_min(double a, double b) { return a < b ? a : b; }
MBMA_INLINE double mbma_max(double a, double b) { return a > b ? a : b; }
/* x held in [low, high]; NaN becomes low, so that indices from it stay inside */
MBMA_INLINE double mbma_held(double x, double low, double high) { return mbma_min(mbma_max(x, low), high); }

/* p x^4 + a x^3 + b x^2 + c x + d by Horner's rule */
MBMA_INLINE double mbma_horner(double p, double x, double a, double b, double c, double d) {
    return mbma_fma(mbma_fma(mbma_fma(mbma_fma(p, x, a), x, b), x, c), x, d);
}

#define MBMA_ROUND 6755399441055744.0 /* 1.5 2^52: adding it rounds to a whole number */
#define MBMA_LN2_HIGH 0.6931471803691238
#define MBMA_LN2_LOW 1.9082149292705877e-10

typedef struct {
    double power, rest; /* exp(x) = power (1 + rest) */
} mbma_reduced;

MBMA_INLINE mbma_reduced mbma_reduce(double x) {
    const double inside = mbma_held(x, -700.0, 700.0);
    const double shifted = mbma_fma(inside, 1.4426950408889634, MBMA_ROUND), power = shifted - MBMA_ROUND;
    const double r = mbma_fma(-power, MBMA_LN2_LOW, mbma_fma(-power, MBMA_LN2_HIGH, inside));
    const double high = mbma_horner(1.0 / 6227020800.0, r, 1.0 / 479001600.0, 1.0 / 39916800.0, 1.0 / 3628800.0,
                                    1.0 / 362880.0);
    const double low = mbma_horner(high, r, 1.0 / 40320.0, 1.0 / 5040.0, 1.0 / 720.0, 1.0 / 120.0);
    const double p = mbma_fma(mbma_fma(mbma_fma(low, r, 1.0 / 24.0), r, 1.0 / 6.0), r, 0.5);
    const mbma_reduced found = {
        mbma_float((int64_t)(UINT64_C(0x3FF0000000000000) + ((uint64_t)mbma_bits(shifted) << 52))),
        mbma_fma(r * r, p, r)};
    return found;
}

/* exp(x); beyond [-700, 700] the value at its end. */
MBMA_INLINE double mbma_exp(double x) {
    const mbma_reduced e = mbma_reduce(x);
    return mbma_fma(e.power, e.rest, e.power);
}

/* exp(x) - 1, likewise. */
MBMA_INLINE double mbma_expm1(double x) {
    const mbma_reduced e = mbma_reduce(x);
    return mbma_fma(e.power, e.rest, e.power - 1.0);
}

/* ln(x) of normal x > 0. */
MBMA_INLINE double mbma_log(double x) {
    const uint64_t bits = (uint64_t)mbma_bits(x);
    /* so many halvings that the rest lies in [sqrt(1/2), sqrt(2)); shifted as unsigned, which every processor does
     * several at a time */
    const uint64_t halvings = ((bits - UINT64_C(0x3FE6A09E667F3BCD) + (UINT64_C(2048) << 52)) >> 52) - 2048;
    const double f = mbma_float((int64_t)(bits - (halvings << 52))) - 1.0;
    const double k = mbma_float((int64_t)((uint64_t)mbma_bits(MBMA_ROUND) + halvings)) - MBMA_ROUND;
    const double s = f / (2.0 + f), z = s * s;
    const double high = mbma_horner(2.0 / 21.0, z, 2.0 / 19.0, 2.0 / 17.0, 2.0 / 15.0, 2.0 / 13.0);
    const double p = mbma_fma(mbma_horner(high, z, 2.0 / 11.0, 2.0 / 9.0, 2.0 / 7.0, 2.0 / 5.0), z, 2.0 / 3.0);
    /* 2 s = f - s f, whose rounding is negligible */
    return mbma_fma(k, MBMA_LN2_HIGH, f - mbma_fma(s, mbma_fma(-z, p, f), -k * MBMA_LN2_LOW));
}

/* ln(1 + x) of x > -1. */
MBMA_INLINE double mbma_log1p(double x) {
    const double u = 1.0 + x;
    /* rounding error of 1 + x */
    return mbma_log(u) + (x - (u - 1.0)) / u;
}

/* erf(x), as 1 - exp(-x G(x)) with a polynomial for G in (x - 5)/(x + 5). */
MBMA_INLINE double mbma_erf(double x) {
    const double a = mbma_min(fabs(x), 6.0), t = 1.5 - 10.0 / (a + 5.0);
    double p = 0.0009578986658192441;
    p = mbma_horner(p, t, 0.004828592382423287, 0.013846723547252188, 0.024690988558762395, 0.0333716398824953);
    p = mbma_horner(p, t, 0.05087222244418428, 0.08061120895418113, 0.11199256666681254, 0.17090247890034505);
    p = mbma_horner(p, t, 0.2708586037313628, 0.38000980758630726, 0.5755591732915837, 0.9152147920778164);
    p = mbma_horner(p, t, 1.2761629053011574, 1.9316582692343824, 3.1912882808115683, 3.7649901910458783);
    return copysign(-mbma_expm1(-a * mbma_fma(p, t, 2.396521719854481)), x);
}

/* a . b in eight lanes */
MBMA_INLINE double dot(const double *restrict a, const double *restrict b, size_t n) {
    double s[8] = {0.0};
    size_t k = 0;
    for (; k + 8 <= n; k += 8)
        for (size_t l = 0; l < 8; l++)
            s[l] = mbma_fma(a[k + l], b[k + l], s[l]);
    for (size_t l = 0; k + l < n; l++)
        s[l] = mbma_fma(a[k + l], b[k + l], s[l]);
    return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
}

/* k/u^3 of Gaussian gaps without contact, at their mean u over h_rms. */
MBMA_INLINE double mbma_wide_gap(double u) { return 1.0 - 1.5 / mbma_fma(u, u, 4.0); }

/* Forces of the calibrated law end at h_max as a Hertzian contact does: F = F_G (1 - r)^(3/2)/(1 + r) with F_G that of a
 * surface without end, r its value at h_max over that. F/F_G at ln r <= 0, and dF/dF_G. */
MBMA_INLINE double mbma_ended(double log_r, double *slope) {
    /* without cancellation */
    const double left = mbma_max(-mbma_expm1(log_r), 0.0), r = 1.0 - left, root = sqrt(left);
    *slope = root / (1.0 + r) * (left + 1.5 * r + left * r / (1.0 + r));
    return left * root / (1.0 + r);
}

/* ln F_G at ln F. With w = F_G/F_end - 1, F/F_end = sqrt(w^3 (1 + w))/(2 + w): two steps of Newton's method between the
 * logarithms, which are nearly proportional, from a guess within 1%; logarithms of ratios near 1 by their Pade form. */
MBMA_INLINE double mbma_endless(double log_force, double end) {
    const double over = log_force - end, root = mbma_exp(mbma_held(over, -700.0, 40.0) / 1.5);
    double part = sqrt(root + 2.5198421 / sqrt(1.0 + 0.66 * root)), w = part * root; /* 4^(2/3) for light loads */
    for (int step = 0; step < 2; step++, w = part * root) {
        const double square = (2.0 + w) * (2.0 + w), cube = part * part * part * (1.0 + w);
        const double power = 3.0 + w / (1.0 + w) - 2.0 * w / (2.0 + w), half = (cube - square) / (cube + square);
        part *= (power - half) / (power + half);
    }
    const double heavy = 0.5 * mbma_log((2.0 + w) * (2.0 + w) * (1.0 + w) / (w * w * w));
    return over < 0.0 ? end + mbma_log1p(w) : log_force + heavy;
}

#endif
