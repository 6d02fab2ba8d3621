/*
 * Closed forms of the MBMA model.
 * Made by `python -m generate formulas`; do not edit.
 */
#include <math.h>

double mbma_pocket_phi_F(double X, double mu);
double mbma_pocket_phi_A(double X, double mu);
double mbma_standard_phi_F(double X, double mu);
double mbma_standard_phi_A(double X, double mu);
double mbma_long_phi_F(double X, double mu);
double mbma_long_phi_A(double X, double mu);
double mbma_totals_force(double d_over_h_rms, double h_max_over_h_rms, double zeta_1, double hurst);
double mbma_totals_area(double d_over_h_rms, double h_max_over_h_rms, double zeta_1, double hurst);

/* Phi_F, pocket form: within 0.037. */
double mbma_pocket_phi_F(double X, double mu) {
    const double w = 1.0/(X + 3);
    const double rigid_F = (1.0/5.0)*3.141592653589793*pow(X + 3, 5.0/2.0)*exp(w*(w*(w*(w*(404.3 - 406.9*w) - 101.9) -
        1.906) - 7.687));
    const double u_F = 1.0/(X + 1.67);
    const double y_F = 0.0166*mu*(X + 1.67);
    const double t_F = log(y_F + 1);
    const double z_F = 1.0/(sqrt(y_F) + 1);
    const double log_Q_F = 3.29*u_F*z_F - 4.92*u_F - 7.14e-05*u_F*t_F*t_F*t_F*t_F*t_F + 0.25*z_F + 0.189*(z_F*z_F*z_F) +
        23.0*(u_F*u_F*u_F*u_F*u_F*u_F);
    return mu*rigid_F/((3.0/20.0)*sqrt(2)*3.141592653589793*mu*(X + 1)*exp(log_Q_F) + 1);
}

/* Phi_A, pocket form: within 0.0317. */
double mbma_pocket_phi_A(double X, double mu) {
    const double w = 1.0/(X + 3);
    const double rigid_A = (1.0/2.0)*3.141592653589793*pow(X + 3, 2)*exp(w*(w*(w*(w*(379.0 - 338.47*w) - 115.67) +
        1.7768) - 6.2766));
    const double u_A = 1.0/(X + 4.24);
    const double y_A = 0.0311*mu*(X + 4.24);
    const double z_A = 1.0/(sqrt(y_A) + 1);
    const double v_A = log(0.979*mu*sqrt(u_A) + 1);
    const double log_Q_A = -0.0001849*u_A*v_A*v_A*v_A*v_A + 0.2543*v_A + 47.27*z_A*(u_A*u_A) - 38.91*u_A*u_A -
        0.3145*z_A*z_A - 4219.0*u_A*u_A*u_A*u_A*u_A*z_A*z_A*z_A + 13.91*(u_A*u_A*u_A*u_A*u_A*u_A);
    return rigid_A/((1.0/3.0)*cbrt(2)*pow(3.141592653589793, 2.0/3.0)*mu*(X + 1)*exp(log_Q_A)/cbrt(mu*(X + 1) + 1) + 1);
}

/* Phi_F, standard form: within 0.00163. */
double mbma_standard_phi_F(double X, double mu) {
    const double w = 1.0/(X + 3);
    const double rigid_F = (1.0/5.0)*3.141592653589793*pow(X + 3, 5.0/2.0)*exp(w*(w*(w*(w*(w*(w*(6264.7*w - 8610.2) +
        4223.7) - 822.91) + 63.132) - 12.175) - 7.4721));
    const double u_F = 1.0/(X + 5.02);
    const double y_F = 0.234*mu*(X + 5.02);
    const double t_F = log(y_F + 1);
    const double z_F = 1.0/(sqrt(y_F) + 1);
    const double v_F = log(1.25*mu*sqrt(u_F) + 1);
    const double log_Q_F = -0.93573*u_F*v_F + 0.21852*u_F*z_F - 1.6649*u_F + 0.0045288*u_F*(t_F*t_F*t_F) -
        1.0907*u_F*z_F*z_F*z_F + 0.00024878*u_F*(v_F*v_F*v_F*v_F) - 2.5226e-05*u_F*t_F*t_F*t_F*t_F*t_F + 0.24817*z_F +
        182.17*z_F*(u_F*u_F*u_F*u_F) - 0.33617*u_F*u_F - 0.1832*u_F*u_F*v_F*v_F + 70.644*(u_F*u_F)*(z_F*z_F) -
        69.621*u_F*u_F*z_F*z_F*z_F + 0.5966*(z_F*z_F) - 0.33826*z_F*z_F*z_F - 1142.9*u_F*u_F*u_F*u_F +
        0.016675*(t_F*t_F*t_F*t_F*t_F)*(u_F*u_F*u_F*u_F*u_F*u_F) - 12691.0*u_F*u_F*u_F*u_F*u_F*z_F*z_F +
        11081.0*(u_F*u_F*u_F*u_F*u_F)*(z_F*z_F*z_F) + 21274.0*(u_F*u_F*u_F*u_F*u_F*u_F);
    return mu*rigid_F/((3.0/20.0)*sqrt(2)*3.141592653589793*mu*(X + 1)*exp(log_Q_F) + 1);
}

/* Phi_A, standard form: within 0.00767. */
double mbma_standard_phi_A(double X, double mu) {
    const double w = 1.0/(X + 3);
    const double rigid_A = (1.0/2.0)*3.141592653589793*pow(X + 3, 2)*exp(w*(w*(w*(w*(w*(w*(6056.0*w - 9136.5) + 5056.8)
        - 1192.8) + 117.26) - 14.285) - 5.8993));
    const double u_A = 1.0/(X + 3.22);
    const double y_A = 0.589*mu*(X + 3.22);
    const double t_A = log(y_A + 1);
    const double z_A = 1.0/(sqrt(y_A) + 1);
    const double v_A = log(1.51*mu*sqrt(u_A) + 1);
    const double log_Q_A = 16.02*u_A*z_A - 1.743*u_A - 28.84*u_A*z_A*z_A - 0.003347*u_A*t_A*t_A*t_A + 0.2406*v_A -
        0.5935*z_A + 7.182*z_A*(u_A*u_A) - 558.5*z_A*u_A*u_A*u_A*u_A*u_A - 16.9*u_A*u_A + 78.03*(u_A*u_A)*(z_A*z_A*z_A)
        + 0.001228*(v_A*v_A) - 0.05628*z_A*z_A + 1.166*(z_A*z_A*z_A) - 7.966*u_A*u_A*u_A*u_A +
        7.555e-05*(v_A*v_A*v_A*v_A) + 1.13e-05*(t_A*t_A*t_A*t_A*t_A)*(u_A*u_A) -
        9.138e-05*t_A*t_A*t_A*t_A*t_A*u_A*u_A*u_A*u_A*u_A + 930.1*(u_A*u_A*u_A*u_A*u_A)*(z_A*z_A) -
        1747.0*u_A*u_A*u_A*u_A*u_A*z_A*z_A*z_A + 591.1*(u_A*u_A*u_A*u_A*u_A*u_A);
    return rigid_A/((1.0/3.0)*cbrt(2)*pow(3.141592653589793, 2.0/3.0)*mu*(X + 1)*exp(log_Q_A)/cbrt(mu*(X + 1) + 1) + 1);
}

/* Phi_F, long form: within 0.00054. */
double mbma_long_phi_F(double X, double mu) {
    const double w = 1.0/(X + 3);
    const double rigid_F = (1.0/5.0)*3.141592653589793*pow(X + 3, 5.0/2.0)*exp(w*(w*(w*(w*(w*(w*(w*(w*(202680.34 -
        116676.11*w) - 139391.14) + 47261.952) - 8071.9361) + 724.69962) - 40.764562) - 9.0901859) - 7.4943273));
    const double u_F = 1.0/(X + 2.0);
    const double y_F = 1.0*mu*(X + 2.0);
    const double t_F = log(y_F + 1);
    const double z_F = 1.0/(sqrt(y_F) + 1);
    const double v_F = log(3.0*mu*sqrt(u_F) + 1);
    const double log_Q_F = -0.1182956*t_F*u_F - 3.010622*t_F*u_F*u_F*u_F*u_F*u_F - 0.2639048*u_F*v_F + 3.800041*u_F*z_F
        - 0.8363774*u_F - 0.06193243*u_F*v_F*v_F - 20.27718*u_F*z_F*z_F - 3.855107e-05*u_F*t_F*t_F*t_F +
        0.00635397*u_F*(v_F*v_F*v_F) + 19.89874*u_F*(z_F*z_F*z_F) - 0.0003796363*u_F*v_F*v_F*v_F*v_F +
        3.930511e-06*u_F*(t_F*t_F*t_F*t_F*t_F) + 1.537735*v_F*(u_F*u_F) + 0.4849792*z_F + 50.62365*z_F*(u_F*u_F) -
        225.2668*z_F*u_F*u_F*u_F + 411.1951*z_F*(u_F*u_F*u_F*u_F) - 325.9477*z_F*u_F*u_F*u_F*u_F*u_F - 10.7045*u_F*u_F +
        33.83061*(u_F*u_F)*(z_F*z_F) - 0.01637919*u_F*u_F*v_F*v_F*v_F - 102.5756*u_F*u_F*z_F*z_F*z_F +
        0.9259836*(z_F*z_F) + 0.01543225*(t_F*t_F*t_F)*(u_F*u_F*u_F*u_F*u_F*u_F) - 22.12101*u_F*u_F*u_F +
        310.1599*(u_F*u_F*u_F)*(z_F*z_F*z_F) + 0.000502866*(u_F*u_F*u_F)*(v_F*v_F*v_F*v_F) - 1.165586*z_F*z_F*z_F +
        0.001558396*(t_F*t_F*t_F*t_F)*(u_F*u_F) + 0.005130465*(t_F*t_F*t_F*t_F)*(u_F*u_F*u_F*u_F*u_F) +
        166.3015*(u_F*u_F*u_F*u_F) - 162.134*u_F*u_F*u_F*u_F*z_F*z_F - 429.5438*u_F*u_F*u_F*u_F*z_F*z_F*z_F -
        3.197385e-05*t_F*t_F*t_F*t_F*t_F*u_F*u_F - 0.0001042054*t_F*t_F*t_F*t_F*t_F*u_F*u_F*u_F*u_F -
        0.0006012633*t_F*t_F*t_F*t_F*t_F*u_F*u_F*u_F*u_F*u_F*u_F - 279.4415*u_F*u_F*u_F*u_F*u_F +
        277.261*(u_F*u_F*u_F*u_F*u_F)*(z_F*z_F) + 180.7619*(u_F*u_F*u_F*u_F*u_F)*(z_F*z_F*z_F) +
        174.5251*(u_F*u_F*u_F*u_F*u_F*u_F);
    return mu*rigid_F/((3.0/20.0)*sqrt(2)*3.141592653589793*mu*(X + 1)*exp(log_Q_F) + 1);
}

/* Phi_A, long form: within 0.000717. */
double mbma_long_phi_A(double X, double mu) {
    const double w = 1.0/(X + 3);
    const double rigid_A = (1.0/2.0)*3.141592653589793*pow(X + 3, 2)*exp(w*(w*(w*(w*(w*(w*(w*(w*(283024.129 -
        151141.205*w) - 214699.537) + 83691.1561) - 17683.9696) + 2076.14192) - 145.64022) - 3.86422657) - 6.04543123));
    const double u_A = 1.0/(X + 3.0);
    const double y_A = 0.5*mu*(X + 3.0);
    const double t_A = log(y_A + 1);
    const double z_A = 1.0/(sqrt(y_A) + 1);
    const double v_A = log(3.0*mu*sqrt(u_A) + 1);
    const double log_Q_A = 2.702992*t_A*u_A - 63.31759*t_A*u_A*u_A*u_A + 268.1592*t_A*(u_A*u_A*u_A*u_A*u_A*u_A) +
        3.809611*u_A*v_A + 15.52813*u_A*z_A - 7.687722*u_A - 0.5328178*u_A*t_A*t_A - 0.7197837*u_A*v_A*v_A -
        11.14796*u_A*z_A*z_A - 0.02630217*u_A*t_A*t_A*t_A + 0.08046358*u_A*(v_A*v_A*v_A) + 9.137649*u_A*(z_A*z_A*z_A) +
        0.008110603*u_A*(t_A*t_A*t_A*t_A) - 0.01113996*u_A*v_A*v_A*v_A*v_A - 0.0002514784*u_A*t_A*t_A*t_A*t_A*t_A +
        0.1158525*v_A - 4.095109*v_A*u_A*u_A - 0.228938*z_A + 233.3309*z_A*(u_A*u_A) - 1411.911*z_A*u_A*u_A*u_A +
        4693.552*z_A*(u_A*u_A*u_A*u_A*u_A) - 4.698441*t_A*t_A*u_A*u_A*u_A + 7.863811*(t_A*t_A)*(u_A*u_A*u_A*u_A*u_A) +
        32.86029*(t_A*t_A)*(u_A*u_A*u_A*u_A*u_A*u_A) - 88.83575*u_A*u_A + 4.020744*(u_A*u_A)*(v_A*v_A) -
        235.456*u_A*u_A*z_A*z_A - 28.29096*u_A*u_A*z_A*z_A*z_A - 0.03251852*u_A*u_A*v_A*v_A*v_A*v_A +
        0.03479263*(v_A*v_A) - 0.3867141*z_A*z_A + 605.9974*(u_A*u_A*u_A) + 2166.437*(u_A*u_A*u_A)*(z_A*z_A) -
        570.3582*u_A*u_A*u_A*z_A*z_A*z_A - 0.005135242*v_A*v_A*v_A + 0.3400994*(z_A*z_A*z_A) +
        0.5740653*(t_A*t_A*t_A*t_A)*(u_A*u_A*u_A*u_A) - 2.593164*t_A*t_A*t_A*t_A*u_A*u_A*u_A*u_A*u_A*u_A -
        1270.737*u_A*u_A*u_A*u_A - 3979.108*u_A*u_A*u_A*u_A*z_A*z_A + 2330.241*(u_A*u_A*u_A*u_A)*(z_A*z_A*z_A) +
        0.0002993667*(v_A*v_A*v_A*v_A) + 0.002885019*(t_A*t_A*t_A*t_A*t_A)*(u_A*u_A) -
        0.01963707*t_A*t_A*t_A*t_A*t_A*u_A*u_A*u_A*u_A - 0.09416464*t_A*t_A*t_A*t_A*t_A*u_A*u_A*u_A*u_A*u_A +
        0.3054985*(t_A*t_A*t_A*t_A*t_A)*(u_A*u_A*u_A*u_A*u_A*u_A) + 2873.197*(u_A*u_A*u_A*u_A*u_A) +
        96.50691*(u_A*u_A*u_A*u_A*u_A)*(z_A*z_A) - 1849.583*u_A*u_A*u_A*u_A*u_A*z_A*z_A*z_A -
        4654.546*u_A*u_A*u_A*u_A*u_A*u_A;
    return rigid_A/((1.0/3.0)*cbrt(2)*pow(3.141592653589793, 2.0/3.0)*mu*(X + 1)*exp(log_Q_A)/cbrt(mu*(X + 1) + 1) + 1);
}

/* Force over E* q0 h_rms, closed totals: within 0.0847. */
double mbma_totals_force(double d_over_h_rms, double h_max_over_h_rms, double zeta_1, double hurst) {
    const double r = -d_over_h_rms + h_max_over_h_rms;
    const double k = (9.0/4.0)*sqrt(-pow(zeta_1, -2*hurst) + pow(3.0/2.0, -2*hurst));
    const double t = (1.0/3.0)*log(r*pow(zeta_1, hurst) + 1) - 1;
    const double q = 1.0/(r*pow(zeta_1, hurst) + 1);
    const double b = r - 1;
    const double c = 1.3333333333333333*h_max_over_h_rms - 5.0;
    const double z = 0.4347826086956522*log(zeta_1) - 2;
    const double y = -0.4 + 2/sqrt(zeta_1);
    const double h = 4*hurst - 3;
    const double g = 0.27027027027027023*d_over_h_rms + 0.27027027027027023;
    const double s = (d_over_h_rms + 0.3)/sqrt(pow(d_over_h_rms + 0.3, 2) + 1);
    const double near_force = 0.32176*b*c + 0.2389*b*h + 0.27296*b*z + 0.10731*b*(c*c) - 0.19086*c*t + 0.39331*c*z -
        0.056368*c*h*h - 0.17071*c*z*z + 0.92532*h*z + 0.85616*h + 0.1764*h*(z*z) - 0.44556*q*t*z - 3.1941*q -
        0.31025*q*h*h - 1.0045*t*z + 4.935*t + 4.6326*z - 0.27419*z*b*b - 1.0/2.0*pow(h_max_over_h_rms - 4.0/9.0*r, 2) +
        (7.0/2.0)*log(r/(r*pow(zeta_1, hurst) + 1)) + 7.3977 + 0.65258*(b*b) - 0.21732*b*b*b + 0.16651*(z*z*z);
    const double far_force = 1.2447*g*h - 1.3539*g*h*s*s - 1.2425*g*s*y - 2.8596*g*y - 2.2214*g - 0.074573*g*h*h -
        0.29492*h*s*z - 0.42444*h*s - 0.37303*h*z - 0.67921*h + 0.095282*s*z - 1.1399*s - 1.2573*y - 0.18586*y*h*h +
        0.18486*z*(g*g) - 2.2241 - 1.0/8.0*pow(d_over_h_rms + sqrt(2 + d_over_h_rms*d_over_h_rms), 2) - 0.43076*g*g -
        0.57615*s*s*s*s*s*s;
    return exp(((k - r < 0) ? (    far_force ) : (    near_force )));
}

/* A/A0, closed totals: within 0.0921. */
double mbma_totals_area(double d_over_h_rms, double h_max_over_h_rms, double zeta_1, double hurst) {
    const double r = -d_over_h_rms + h_max_over_h_rms;
    const double k = (9.0/4.0)*sqrt(-pow(zeta_1, -2*hurst) + pow(3.0/2.0, -2*hurst));
    const double t = (1.0/3.0)*log(r*pow(zeta_1, hurst) + 1) - 1;
    const double q = 1.0/(r*pow(zeta_1, hurst) + 1);
    const double b = r - 1;
    const double c = 1.3333333333333333*h_max_over_h_rms - 5.0;
    const double z = 0.4347826086956522*log(zeta_1) - 2;
    const double y = -0.4 + 2/sqrt(zeta_1);
    const double h = 4*hurst - 3;
    const double g = 0.27027027027027023*d_over_h_rms + 0.27027027027027023;
    const double s = (d_over_h_rms + 0.3)/sqrt(pow(d_over_h_rms + 0.3, 2) + 1);
    const double near_area = -1.26*b*c*q + 0.279*b*c + 0.294*b*h + 9.36*b*q*t + 0.185*b*z + 0.136*b*(c*c) - 0.132*c*h -
        1.31*c*q + 0.198*c*z - 0.108*c*z*z + 1.33*h*z + 1.31*h - 5.62*q + 2.22*q*(b*b*b) - 0.425*t*z + 4.51*t + 3.57*z -
        0.0797*z*h*h - 1.0/2.0*pow(h_max_over_h_rms - 4.0/9.0*r, 2) + (10.0/3.0)*log(r/(r*pow(zeta_1, hurst) + 1)) +
        6.03 + 0.58*(b*b) + 6.39*(b*b)*(q*q) - 12.4*q*q - 0.356*b*b*b;
    const double far_area = -0.173*g*h*s*s + 0.867*g*s - 2.33*g*y - 1.95*g*y*s*s*s - 1.3*g*s*s*s - 1.83*g*s*s*s*s -
        0.222*h*s*z - 0.198*h*s + 0.108*h - 0.262*h*s*s + 1.05*h*(y*y) + 0.101*s*z - 1.97*s + 0.685*y*z + 0.565*y - 3.29
        - 1.0/8.0*pow(d_over_h_rms + sqrt(2 + d_over_h_rms*d_over_h_rms), 2) - 0.149*g*g*h*h;
    return exp(((k - r < 0) ? (    far_area ) : (    near_area )));
}
