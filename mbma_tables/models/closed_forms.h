/* Closed forms of the island functions and of total force and area. Made by `python -m generate formulas`; do not edit.
 *
 * A fitted coefficient that is a whole number is written 23e0, any other whole number 23.0. */
#include <math.h>

double mbma_pocket_phi_F(double X, double mu);
double mbma_pocket_phi_A(double X, double mu);
double mbma_standard_phi_F(double X, double mu);
double mbma_standard_phi_A(double X, double mu);
double mbma_long_phi_F(double X, double mu);
double mbma_long_phi_A(double X, double mu);
double mbma_totals_pressure(double d_over_h_rms, double h_max_over_h_rms, double zeta_1, double hurst);
double mbma_totals_area(double d_over_h_rms, double h_max_over_h_rms, double zeta_1, double hurst);

static double where(int condition, double a, double b) { return condition ? a : b; }

/* Phi_F, pocket form: within 0.0371. */
double mbma_pocket_phi_F(double X, double mu) {
    const double w = 1.0 / (X + 3.0);
    const double p = w * (w * (w * (w * (404.3 - 406.9 * w) - 101.9) - 1.906) - 7.687);
    const double rigid = 1.0 / 5.0 * 3.141592653589793 * pow(X + 3.0, 5.0 / 2.0) * exp(p);
    const double u = 1.0 / (X + 1.67);
    const double y = 0.0166 * mu * (X + 1.67);
    const double t = log(y + 1.0);
    const double z = 1.0 / (sqrt(y) + 1.0);
    const double log_Q = 3.29 * u * z - 4.92 * u - 7.14e-05 * u * t * t * t * t * t + 0.25 * z + 0.189 * (z * z * z) +
        23e0 * (u * u * u * u * u * u);
    return mu * rigid / (3.0 / 20.0 * sqrt(2.0) * 3.141592653589793 * mu * (X + 1.0) * exp(log_Q) + 1.0);
}

/* Phi_A, pocket form: within 0.0317. */
double mbma_pocket_phi_A(double X, double mu) {
    const double w = 1.0 / (X + 3.0);
    const double p = w * (w * (w * (w * (379e0 - 338.47 * w) - 115.67) + 1.7768) - 6.2766);
    const double rigid = 1.0 / 2.0 * 3.141592653589793 * pow(X + 3.0, 2.0) * exp(p);
    const double u = 1.0 / (X + 4.24);
    const double y = 0.0311 * mu * (X + 4.24);
    const double z = 1.0 / (sqrt(y) + 1.0);
    const double v = log(0.979 * mu * sqrt(u) + 1.0);
    const double log_Q = -0.0001849 * u * v * v * v * v + 0.2543 * v + 47.27 * z * (u * u) - 38.91 * u * u - 0.3145 * z
        * z - 4219e0 * u * u * u * u * u * z * z * z + 13.91 * (u * u * u * u * u * u);
    return rigid / (1.0 / 3.0 * pow(2.0, 1.0 / 3.0) * pow(3.141592653589793, 2.0 / 3.0) * mu * (X + 1.0) * exp(log_Q) /
        pow(mu * (X + 1.0) + 1.0, 1.0 / 3.0) + 1.0);
}

/* Phi_F, standard form: within 0.00164. */
double mbma_standard_phi_F(double X, double mu) {
    const double w = 1.0 / (X + 3.0);
    const double p = w * (w * (w * (w * (w * (w * (6264.7 * w - 8610.2) + 4223.7) - 822.91) + 63.132) - 12.175) -
        7.4721);
    const double rigid = 1.0 / 5.0 * 3.141592653589793 * pow(X + 3.0, 5.0 / 2.0) * exp(p);
    const double u = 1.0 / (X + 5.02);
    const double y = 0.234 * mu * (X + 5.02);
    const double t = log(y + 1.0);
    const double z = 1.0 / (sqrt(y) + 1.0);
    const double v = log(1.25 * mu * sqrt(u) + 1.0);
    const double log_Q = -0.93573 * u * v + 0.21852 * u * z - 1.6649 * u + 0.0045288 * u * (t * t * t) - 1.0907 * u * z
        * z * z + 0.00024878 * u * (v * v * v * v) - 2.5226e-05 * u * t * t * t * t * t + 0.24817 * z + 182.17 * z * (u
        * u * u * u) - 0.33617 * u * u - 0.1832 * u * u * v * v + 70.644 * (u * u) * (z * z) - 69.621 * u * u * z * z *
        z + 0.5966 * (z * z) - 0.33826 * z * z * z - 1142.9 * u * u * u * u + 0.016675 * (t * t * t * t * t) * (u * u *
        u * u * u * u) - 12691e0 * u * u * u * u * u * z * z + 11081e0 * (u * u * u * u * u) * (z * z * z) + 21274e0 *
        (u * u * u * u * u * u);
    return mu * rigid / (3.0 / 20.0 * sqrt(2.0) * 3.141592653589793 * mu * (X + 1.0) * exp(log_Q) + 1.0);
}

/* Phi_A, standard form: within 0.00768. */
double mbma_standard_phi_A(double X, double mu) {
    const double w = 1.0 / (X + 3.0);
    const double p = w * (w * (w * (w * (w * (w * (6056e0 * w - 9136.5) + 5056.8) - 1192.8) + 117.26) - 14.285) -
        5.8993);
    const double rigid = 1.0 / 2.0 * 3.141592653589793 * pow(X + 3.0, 2.0) * exp(p);
    const double u = 1.0 / (X + 3.22);
    const double y = 0.589 * mu * (X + 3.22);
    const double t = log(y + 1.0);
    const double z = 1.0 / (sqrt(y) + 1.0);
    const double v = log(1.51 * mu * sqrt(u) + 1.0);
    const double log_Q = 16.02 * u * z - 1.743 * u - 28.84 * u * z * z - 0.003347 * u * t * t * t + 0.2406 * v - 0.5935
        * z + 7.182 * z * (u * u) - 558.5 * z * u * u * u * u * u - 16.9 * u * u + 78.03 * (u * u) * (z * z * z) +
        0.001228 * (v * v) - 0.05628 * z * z + 1.166 * (z * z * z) - 7.966 * u * u * u * u + 7.555e-05 * (v * v * v * v)
        + 1.13e-05 * (t * t * t * t * t) * (u * u) - 9.138e-05 * t * t * t * t * t * u * u * u * u * u + 930.1 * (u * u
        * u * u * u) * (z * z) - 1747e0 * u * u * u * u * u * z * z * z + 591.1 * (u * u * u * u * u * u);
    return rigid / (1.0 / 3.0 * pow(2.0, 1.0 / 3.0) * pow(3.141592653589793, 2.0 / 3.0) * mu * (X + 1.0) * exp(log_Q) /
        pow(mu * (X + 1.0) + 1.0, 1.0 / 3.0) + 1.0);
}

/* Phi_F, long form: within 0.00054. */
double mbma_long_phi_F(double X, double mu) {
    const double w = 1.0 / (X + 3.0);
    const double p = w * (w * (w * (w * (w * (w * (w * (w * (202680.3 - 116676.09 * w) - 139391.11) + 47261.94) -
        8071.9332) + 724.69922) - 40.764531) - 9.090187) - 7.4943273);
    const double rigid = 1.0 / 5.0 * 3.141592653589793 * pow(X + 3.0, 5.0 / 2.0) * exp(p);
    const double u = 1.0 / (X + 2e0);
    const double y = 1e0 * mu * (X + 2e0);
    const double t = log(y + 1.0);
    const double z = 1.0 / (sqrt(y) + 1.0);
    const double v = log(3e0 * mu * sqrt(u) + 1.0);
    const double log_Q = -0.118296 * t * u - 3.01064 * t * u * u * u * u * u - 0.263905 * u * v + 3.80004 * u * z -
        0.836377 * u - 0.0619324 * u * v * v - 20.2772 * u * z * z - 3.85487e-05 * u * t * t * t + 0.00635397 * u * (v *
        v * v) + 19.8987 * u * (z * z * z) - 0.000379636 * u * v * v * v * v + 3.9305e-06 * u * (t * t * t * t * t) +
        1.53774 * v * (u * u) + 0.484979 * z + 50.6236 * z * (u * u) - 225.267 * z * u * u * u + 411.195 * z * (u * u *
        u * u) - 325.948 * z * u * u * u * u * u - 10.7045 * u * u + 33.8306 * (u * u) * (z * z) - 0.0163792 * u * u * v
        * v * v - 102.576 * u * u * z * z * z + 0.925984 * (z * z) + 0.0154324 * (t * t * t) * (u * u * u * u * u * u) -
        22.121 * u * u * u + 310.16 * (u * u * u) * (z * z * z) + 0.00050287 * (u * u * u) * (v * v * v * v) - 1.16559 *
        z * z * z + 0.00155839 * (t * t * t * t) * (u * u) + 0.00513046 * (t * t * t * t) * (u * u * u * u * u) +
        166.302 * (u * u * u * u) - 162.134 * u * u * u * u * z * z - 429.543 * u * u * u * u * z * z * z - 3.19737e-05
        * t * t * t * t * t * u * u - 0.000104206 * t * t * t * t * t * u * u * u * u - 0.000601264 * t * t * t * t * t
        * u * u * u * u * u * u - 279.441 * u * u * u * u * u + 277.261 * (u * u * u * u * u) * (z * z) + 180.761 * (u *
        u * u * u * u) * (z * z * z) + 174.525 * (u * u * u * u * u * u);
    return mu * rigid / (3.0 / 20.0 * sqrt(2.0) * 3.141592653589793 * mu * (X + 1.0) * exp(log_Q) + 1.0);
}

/* Phi_A, long form: within 0.000718. */
double mbma_long_phi_A(double X, double mu) {
    const double w = 1.0 / (X + 3.0);
    const double p = w * (w * (w * (w * (w * (w * (w * (w * (283024.13 - 151141.2 * w) - 214699.54) + 83691.155) -
        17683.969) + 2076.1419) - 145.64022) - 3.8642267) - 6.0454312);
    const double rigid = 1.0 / 2.0 * 3.141592653589793 * pow(X + 3.0, 2.0) * exp(p);
    const double u = 1.0 / (X + 3e0);
    const double y = 0.5 * mu * (X + 3e0);
    const double t = log(y + 1.0);
    const double z = 1.0 / (sqrt(y) + 1.0);
    const double v = log(3e0 * mu * sqrt(u) + 1.0);
    const double log_Q = 2.702999 * t * u - 63.31776 * t * u * u * u + 268.1615 * t * (u * u * u * u * u * u) + 3.809611
        * u * v + 15.52818 * u * z - 7.687747 * u - 0.5328182 * u * t * t - 0.7197839 * u * v * v - 11.14794 * u * z * z
        - 0.0263022 * u * t * t * t + 0.08046351 * u * (v * v * v) + 9.137597 * u * (z * z * z) + 0.008110612 * u * (t *
        t * t * t) - 0.01113995 * u * v * v * v * v - 0.0002514788 * u * t * t * t * t * t + 0.1158525 * v - 4.095103 *
        v * u * u - 0.2289378 * z + 233.3311 * z * (u * u) - 1411.913 * z * u * u * u + 4693.561 * z * (u * u * u * u *
        u) - 4.698431 * t * t * u * u * u + 7.863849 * (t * t) * (u * u * u * u * u) + 32.86004 * (t * t) * (u * u * u *
        u * u * u) - 88.83575 * u * u + 4.020746 * (u * u) * (v * v) - 235.4572 * u * u * z * z - 28.28981 * u * u * z *
        z * z - 0.03251855 * u * u * v * v * v * v + 0.03479262 * (v * v) - 0.3867149 * z * z + 605.9977 * (u * u * u) +
        2166.446 * (u * u * u) * (z * z) - 570.3672 * u * u * u * z * z * z - 0.00513524 * v * v * v + 0.3401002 * (z *
        z * z) + 0.5740654 * (t * t * t * t) * (u * u * u * u) - 2.593164 * t * t * t * t * u * u * u * u * u * u -
        1270.736 * u * u * u * u - 3979.136 * u * u * u * u * z * z + 2330.272 * (u * u * u * u) * (z * z * z) +
        0.0002993666 * (v * v * v * v) + 0.00288502 * (t * t * t * t * t) * (u * u) - 0.01963705 * t * t * t * t * t * u
        * u * u * u - 0.09416472 * t * t * t * t * t * u * u * u * u * u + 0.3054986 * (t * t * t * t * t) * (u * u * u
        * u * u * u) + 2873.193 * (u * u * u * u * u) + 96.5359 * (u * u * u * u * u) * (z * z) - 1849.622 * u * u * u *
        u * u * z * z * z - 4654.55 * u * u * u * u * u * u;
    return rigid / (1.0 / 3.0 * pow(2.0, 1.0 / 3.0) * pow(3.141592653589793, 2.0 / 3.0) * mu * (X + 1.0) * exp(log_Q) /
        pow(mu * (X + 1.0) + 1.0, 1.0 / 3.0) + 1.0);
}

/* Force over E* q0 h_rms, closed totals: within 0.0906. */
double mbma_totals_pressure(double d_over_h_rms, double h_max_over_h_rms, double zeta_1, double hurst) {
    const double r = -d_over_h_rms + h_max_over_h_rms;
    const double k = 9.0 / 4.0 * sqrt(-pow(zeta_1, -2.0 * hurst) + pow(3.0 / 2.0, -2.0 * hurst));
    const double t = 1.0 / 3.0 * log(r * pow(zeta_1, hurst) + 1.0) - 1.0;
    const double q = 1.0 / (r * pow(zeta_1, hurst) + 1.0);
    const double b = r - 1.0;
    const double c = 4.0 / 3.0 * h_max_over_h_rms - 5.0;
    const double z = log(zeta_1) / log(10.0) - 2.0;
    const double y = -2.0 / 5.0 + 2.0 / sqrt(zeta_1);
    const double h = 4.0 * hurst - 3.0;
    const double g = 1.0 / 4.0 * d_over_h_rms + 1.0 / 4.0;
    const double s = (d_over_h_rms + 0.3) / sqrt(pow(d_over_h_rms + 0.3, 2.0) + 1.0);
    const double near = 0.3167 * b * c + 0.3111 * b * h + 1.672 * b * q * z + 0.2061 * b * z + 0.1205 * b * (c * c) -
        0.1783 * c * t + 0.4069 * c * z - 0.03422 * c * h * h - 0.1913 * c * z * z + 0.9973 * h * z + 0.8729 * h +
        0.09798 * h * (z * z) - 5.555 * q + 2.255 * q * (b * b) - 0.8067 * t * z + 4.663 * t + 4.567 * z + 3.404 * z *
        (q * q) - 1.0 / 2.0 * pow(h_max_over_h_rms - 4.0 / 9.0 * r, 2.0) + 7.0 / 2.0 * log(r / (r * pow(zeta_1, hurst) +
        1.0)) + 7.558 + 0.5068 * (b * b) - 0.177 * b * b * b + 0.1134 * (z * z * z);
    const double far = -0.09048 * g * h * z - 0.2673 * g * h - 0.07731 * g * s * h * h - 2.691 * g * y - 2.489 * g -
        1.026 * g * s * s * s - 0.2339 * h * s * z - 0.3641 * h * z - 0.4084 * h - 0.2491 * h * s * s - 0.2267 * h * s *
        s * s + 0.1932 * s * z - 1.067 * s - 1.388 * y - 1.691 * y * g * g * s * s - 0.221 * y * h * h + 0.1644 * z * (s
        * s * s * s) - 2.241 - 1.0 / 8.0 * pow(d_over_h_rms + sqrt(2.0 + d_over_h_rms * d_over_h_rms), 2.0);
    const double log_total = where(k < r, far, near);
    return exp(log_total);
}

/* A/A0, closed totals: within 0.0968. */
double mbma_totals_area(double d_over_h_rms, double h_max_over_h_rms, double zeta_1, double hurst) {
    const double r = -d_over_h_rms + h_max_over_h_rms;
    const double k = 9.0 / 4.0 * sqrt(-pow(zeta_1, -2.0 * hurst) + pow(3.0 / 2.0, -2.0 * hurst));
    const double t = 1.0 / 3.0 * log(r * pow(zeta_1, hurst) + 1.0) - 1.0;
    const double q = 1.0 / (r * pow(zeta_1, hurst) + 1.0);
    const double b = r - 1.0;
    const double c = 4.0 / 3.0 * h_max_over_h_rms - 5.0;
    const double z = log(zeta_1) / log(10.0) - 2.0;
    const double y = -2.0 / 5.0 + 2.0 / sqrt(zeta_1);
    const double h = 4.0 * hurst - 3.0;
    const double g = 1.0 / 4.0 * d_over_h_rms + 1.0 / 4.0;
    const double s = (d_over_h_rms + 0.3) / sqrt(pow(d_over_h_rms + 0.3, 2.0) + 1.0);
    const double near = 0.305 * b * c + 0.399 * b * h + 4.98 * b * q * z + 4.18 * b * q + 0.114 * b * z + 0.101 * b * (c
        * c) - 0.0546 * c * h * t + 0.0935 * c * t * z - 0.188 * c * t + 0.364 * c * z - 0.219 * c * z * z - 0.377 * h *
        t + 1.41 * h * z + 1.5 * h + 5.31 * q * z + 2.42 * q * (b * b) - 0.416 * t * z + 4.84 * t + 3.53 * z - 1.0 / 2.0
        * pow(h_max_over_h_rms - 4.0 / 9.0 * r, 2.0) + 10.0 / 3.0 * log(r / (r * pow(zeta_1, hurst) + 1.0)) + 5.79 +
        0.542 * (b * b) - 0.215 * b * b * b - 4.94 * q * q * q * q;
    const double far = -0.281 * g * h * s * s - 2.58 * g - 0.56 * g * s * s * s * s * s - 0.231 * h * s * z - 0.138 * h
        * s + 0.106 * h - 0.234 * h * s * s + 0.989 * h * (y * y) - 1.2 * s * y - 1.69 * s * y * g * g - 1.17 * s -
        0.0654 * z + 0.558 * z * (g * g) * (s * s) - 2.81 - 1.0 / 8.0 * pow(d_over_h_rms + sqrt(2.0 + d_over_h_rms *
        d_over_h_rms), 2.0) - 2.28 * g * g * y * y - 0.106 * h * h * s * s - 0.238 * z * z;
    const double log_total = where(k < r, far, near);
    return exp(log_total);
}
