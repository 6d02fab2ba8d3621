/* Height integrals F_n(x) = integral_x^inf (z - x)^n phi(z) dz (36, 38), phi the standard normal density. */
#ifndef MBMA_HEIGHTS_H
#define MBMA_HEIGHTS_H

#include "elementary.h"
#include "height_coefficients.h"

/* F_n = height_polynomial(t) base^n weight fade; only the last product can underflow. */
typedef struct {
    size_t piece;
    double t, base, weight, fade;
} spot;

/* Pieces are polynomials in 1/(x + 1) from 0 on, exp(-x^2/2)/(x + 1) taken out, in 1/x^2 below -8, and else in x. */
MBMA_INLINE spot spot_of(double x) {
    static const double SCALE[8] = {4.0, 1.0 / 0.15, 2.0 / (0.2 - 1.0 / 41.0), 128.0, 1.0, 1.0, 1.0, 1.0};
    static const double SHIFT[8] = {
        -3.0, -0.35 / 0.15, -(0.2 + 1.0 / 41.0) / (0.2 - 1.0 / 41.0), -1.0, 7.0, 5.0, 3.0, 1.0};
    const bool deep = x < -8.0;
    const int above = (x >= 1.0) + (x >= 4.0), below = 3 + (x >= -8.0) + (x >= -6.0) + (x >= -4.0) + (x >= -2.0);
    /* beyond 40 F_n is 0; of x < 0 the weight is 1 */
    const double light = mbma_held(x, 0.0, 41.0), head = (double)(float)light, tail = light - head;
    const double inverse = 1.0 / (deep ? x * x : light + 1.0), v = deep ? 1.0 : inverse;
    const double square = light * light;
    /* rounding error of the square, since exp is steep */
    const double lost = ((head * head - square) + 2.0 * head * tail) + tail * tail;
    spot at;
    at.piece = (size_t)(x < 0.0 ? below : above);
    at.t = mbma_fma(SCALE[at.piece], deep || x >= 0.0 ? inverse : x, SHIFT[at.piece]);
    at.base = deep ? -x : v;
    at.fade = mbma_exp(-0.25 * square);
    at.weight = mbma_fma(-0.5 * lost, v, v) * at.fade;
    return at;
}

MBMA_INLINE double height_polynomial(const double row[20], double t) {
    double value = row[19];
    for (int k = 18; k >= 0; k--)
        value = mbma_fma(value, t, row[k]);
    return value;
}

typedef struct {
    double half, three_halves, five_halves;
} halves;

/* F_{1/2}, F_{3/2} and F_{5/2}, where the third of them is that of 3/2 F_{1/2} = F_{5/2} + x F_{3/2} without a
 * difference. */
MBMA_INLINE halves halves_of(double x) {
    const spot at = spot_of(x);
    const double root = sqrt(at.base) * at.weight, light = mbma_held(x, 0.0, 41.0);
    const double three = height_polynomial(MBMA_HEIGHT_HALVES[0][at.piece], at.t) * (root * at.base);
    const double power = x < 0.0 ? 1.0 : at.base * at.base;
    const double other = height_polynomial(MBMA_HEIGHT_HALVES[1][at.piece], at.t) * (root * power);
    const double half = x < 0.0 ? other : (other + light * three) / 1.5;
    const halves found = {half * at.fade, three * at.fade, (x < 0.0 ? 1.5 * other - x * three : other) * at.fade};
    return found;
}

/* F_1 or F_2; F_1(x) = F_1(-x) - x, F_2(x) = 1 + x^2 - F_2(-x). */
static double whole(int n, double x) {
    const spot at = spot_of(fabs(x));
    const double power = n == 1 ? at.base : at.base * at.base;
    const double value = height_polynomial(MBMA_HEIGHT_WHOLE[n - 1][at.piece], at.t) * (power * at.weight) * at.fade;
    return !(x < 0.0) ? value : n == 1 ? value - x : 1.0 + x * x - value;
}

/* Phi_F and Phi_A of a sphere that does not deform, the limit of both as mu goes to 0: (mu/2) pi F_{5/2}(-X)/(5/2) and
 * pi F_2(-X)/2. */
MBMA_INLINE void rigid_sphere(double X, double mu, double phi[2]) {
    phi[0] = mu * (MBMA_PI / 5.0 * halves_of(-X).five_halves);
    phi[1] = MBMA_PI / 2.0 * whole(2, -X);
}

#endif
