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

/* Phi_F, pocket form: within 0.0371. */
double mbma_pocket_phi_F(double X, double mu) {
    const double w = 1.0/(X + 3);
    const double p_F = w*(w*(w*(w*(404.3 - 406.9*w) - 101.9) - 1.906) - 7.687);
    const double rigid_F = (1.0/5.0)*3.141592653589793*pow(X + 3, 5.0/2.0)*exp(p_F);
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
    const double p_A = w*(w*(w*(w*(379.0 - 338.47*w) - 115.67) + 1.7768) - 6.2766);
    const double rigid_A = (1.0/2.0)*3.141592653589793*pow(X + 3, 2)*exp(p_A);
    const double u_A = 1.0/(X + 4.24);
    const double y_A = 0.0311*mu*(X + 4.24);
    const double z_A = 1.0/(sqrt(y_A) + 1);
    const double v_A = log(0.979*mu*sqrt(u_A) + 1);
    const double log_Q_A = -0.0001849*u_A*v_A*v_A*v_A*v_A + 0.2543*v_A + 47.27*z_A*(u_A*u_A) - 38.91*u_A*u_A -
        0.3145*z_A*z_A - 4219.0*u_A*u_A*u_A*u_A*u_A*z_A*z_A*z_A + 13.91*(u_A*u_A*u_A*u_A*u_A*u_A);
    return rigid_A/((1.0/3.0)*cbrt(2)*pow(3.141592653589793, 2.0/3.0)*mu*(X + 1)*exp(log_Q_A)/cbrt(mu*(X + 1) + 1) + 1);
}

/* Phi_F, standard form: within 0.00164. */
double mbma_standard_phi_F(double X, double mu) {
    const double w = 1.0/(X + 3);
    const double p_F = w*(w*(w*(w*(w*(w*(6264.7*w - 8610.2) + 4223.7) - 822.91) + 63.132) - 12.175) - 7.4721);
    const double rigid_F = (1.0/5.0)*3.141592653589793*pow(X + 3, 5.0/2.0)*exp(p_F);
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

/* Phi_A, standard form: within 0.00768. */
double mbma_standard_phi_A(double X, double mu) {
    const double w = 1.0/(X + 3);
    const double p_A = w*(w*(w*(w*(w*(w*(6056.0*w - 9136.5) + 5056.8) - 1192.8) + 117.26) - 14.285) - 5.8993);
    const double rigid_A = (1.0/2.0)*3.141592653589793*pow(X + 3, 2)*exp(p_A);
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
    const double p_F = w*(w*(w*(w*(w*(w*(w*(w*(202680.3 - 116676.09*w) - 139391.11) + 47261.94) - 8071.9332) +
        724.69922) - 40.764531) - 9.090187) - 7.4943273);
    const double rigid_F = (1.0/5.0)*3.141592653589793*pow(X + 3, 5.0/2.0)*exp(p_F);
    const double u_F = 1.0/(X + 2.0);
    const double y_F = 1.0*mu*(X + 2.0);
    const double t_F = log(y_F + 1);
    const double z_F = 1.0/(sqrt(y_F) + 1);
    const double v_F = log(3.0*mu*sqrt(u_F) + 1);
    const double log_Q_F = -0.118296*t_F*u_F - 3.01064*t_F*u_F*u_F*u_F*u_F*u_F - 0.263905*u_F*v_F + 3.80004*u_F*z_F -
        0.836377*u_F - 0.0619324*u_F*v_F*v_F - 20.2772*u_F*z_F*z_F - 3.85487e-05*u_F*t_F*t_F*t_F +
        0.00635397*u_F*(v_F*v_F*v_F) + 19.8987*u_F*(z_F*z_F*z_F) - 0.000379636*u_F*v_F*v_F*v_F*v_F +
        3.9305e-06*u_F*(t_F*t_F*t_F*t_F*t_F) + 1.53774*v_F*(u_F*u_F) + 0.484979*z_F + 50.6236*z_F*(u_F*u_F) -
        225.267*z_F*u_F*u_F*u_F + 411.195*z_F*(u_F*u_F*u_F*u_F) - 325.948*z_F*u_F*u_F*u_F*u_F*u_F - 10.7045*u_F*u_F +
        33.8306*(u_F*u_F)*(z_F*z_F) - 0.0163792*u_F*u_F*v_F*v_F*v_F - 102.576*u_F*u_F*z_F*z_F*z_F + 0.925984*(z_F*z_F) +
        0.0154324*(t_F*t_F*t_F)*(u_F*u_F*u_F*u_F*u_F*u_F) - 22.121*u_F*u_F*u_F + 310.16*(u_F*u_F*u_F)*(z_F*z_F*z_F) +
        0.00050287*(u_F*u_F*u_F)*(v_F*v_F*v_F*v_F) - 1.16559*z_F*z_F*z_F + 0.00155839*(t_F*t_F*t_F*t_F)*(u_F*u_F) +
        0.00513046*(t_F*t_F*t_F*t_F)*(u_F*u_F*u_F*u_F*u_F) + 166.302*(u_F*u_F*u_F*u_F) - 162.134*u_F*u_F*u_F*u_F*z_F*z_F
        - 429.543*u_F*u_F*u_F*u_F*z_F*z_F*z_F - 3.19737e-05*t_F*t_F*t_F*t_F*t_F*u_F*u_F -
        0.000104206*t_F*t_F*t_F*t_F*t_F*u_F*u_F*u_F*u_F - 0.000601264*t_F*t_F*t_F*t_F*t_F*u_F*u_F*u_F*u_F*u_F*u_F -
        279.441*u_F*u_F*u_F*u_F*u_F + 277.261*(u_F*u_F*u_F*u_F*u_F)*(z_F*z_F) +
        180.761*(u_F*u_F*u_F*u_F*u_F)*(z_F*z_F*z_F) + 174.525*(u_F*u_F*u_F*u_F*u_F*u_F);
    return mu*rigid_F/((3.0/20.0)*sqrt(2)*3.141592653589793*mu*(X + 1)*exp(log_Q_F) + 1);
}

/* Phi_A, long form: within 0.000718. */
double mbma_long_phi_A(double X, double mu) {
    const double w = 1.0/(X + 3);
    const double p_A = w*(w*(w*(w*(w*(w*(w*(w*(283024.13 - 151141.2*w) - 214699.54) + 83691.155) - 17683.969) +
        2076.1419) - 145.64022) - 3.8642267) - 6.0454312);
    const double rigid_A = (1.0/2.0)*3.141592653589793*pow(X + 3, 2)*exp(p_A);
    const double u_A = 1.0/(X + 3.0);
    const double y_A = 0.5*mu*(X + 3.0);
    const double t_A = log(y_A + 1);
    const double z_A = 1.0/(sqrt(y_A) + 1);
    const double v_A = log(3.0*mu*sqrt(u_A) + 1);
    const double log_Q_A = 2.702999*t_A*u_A - 63.31776*t_A*u_A*u_A*u_A + 268.1615*t_A*(u_A*u_A*u_A*u_A*u_A*u_A) +
        3.809611*u_A*v_A + 15.52818*u_A*z_A - 7.687747*u_A - 0.5328182*u_A*t_A*t_A - 0.7197839*u_A*v_A*v_A -
        11.14794*u_A*z_A*z_A - 0.0263022*u_A*t_A*t_A*t_A + 0.08046351*u_A*(v_A*v_A*v_A) + 9.137597*u_A*(z_A*z_A*z_A) +
        0.008110612*u_A*(t_A*t_A*t_A*t_A) - 0.01113995*u_A*v_A*v_A*v_A*v_A - 0.0002514788*u_A*t_A*t_A*t_A*t_A*t_A +
        0.1158525*v_A - 4.095103*v_A*u_A*u_A - 0.2289378*z_A + 233.3311*z_A*(u_A*u_A) - 1411.913*z_A*u_A*u_A*u_A +
        4693.561*z_A*(u_A*u_A*u_A*u_A*u_A) - 4.698431*t_A*t_A*u_A*u_A*u_A + 7.863849*(t_A*t_A)*(u_A*u_A*u_A*u_A*u_A) +
        32.86004*(t_A*t_A)*(u_A*u_A*u_A*u_A*u_A*u_A) - 88.83575*u_A*u_A + 4.020746*(u_A*u_A)*(v_A*v_A) -
        235.4572*u_A*u_A*z_A*z_A - 28.28981*u_A*u_A*z_A*z_A*z_A - 0.03251855*u_A*u_A*v_A*v_A*v_A*v_A +
        0.03479262*(v_A*v_A) - 0.3867149*z_A*z_A + 605.9977*(u_A*u_A*u_A) + 2166.446*(u_A*u_A*u_A)*(z_A*z_A) -
        570.3672*u_A*u_A*u_A*z_A*z_A*z_A - 0.00513524*v_A*v_A*v_A + 0.3401002*(z_A*z_A*z_A) +
        0.5740654*(t_A*t_A*t_A*t_A)*(u_A*u_A*u_A*u_A) - 2.593164*t_A*t_A*t_A*t_A*u_A*u_A*u_A*u_A*u_A*u_A -
        1270.736*u_A*u_A*u_A*u_A - 3979.136*u_A*u_A*u_A*u_A*z_A*z_A + 2330.272*(u_A*u_A*u_A*u_A)*(z_A*z_A*z_A) +
        0.0002993666*(v_A*v_A*v_A*v_A) + 0.00288502*(t_A*t_A*t_A*t_A*t_A)*(u_A*u_A) -
        0.01963705*t_A*t_A*t_A*t_A*t_A*u_A*u_A*u_A*u_A - 0.09416472*t_A*t_A*t_A*t_A*t_A*u_A*u_A*u_A*u_A*u_A +
        0.3054986*(t_A*t_A*t_A*t_A*t_A)*(u_A*u_A*u_A*u_A*u_A*u_A) + 2873.193*(u_A*u_A*u_A*u_A*u_A) +
        96.5359*(u_A*u_A*u_A*u_A*u_A)*(z_A*z_A) - 1849.622*u_A*u_A*u_A*u_A*u_A*z_A*z_A*z_A -
        4654.55*u_A*u_A*u_A*u_A*u_A*u_A;
    return rigid_A/((1.0/3.0)*cbrt(2)*pow(3.141592653589793, 2.0/3.0)*mu*(X + 1)*exp(log_Q_A)/cbrt(mu*(X + 1) + 1) + 1);
}

/* Force over E* q0 h_rms, closed totals: within 0.0906. */
double mbma_totals_force(double d_over_h_rms, double h_max_over_h_rms, double zeta_1, double hurst) {
    const double r = -d_over_h_rms + h_max_over_h_rms;
    const double k = (9.0/4.0)*sqrt(-pow(zeta_1, -2*hurst) + pow(3.0/2.0, -2*hurst));
    const double t = (1.0/3.0)*log(r*pow(zeta_1, hurst) + 1) - 1;
    const double q = 1.0/(r*pow(zeta_1, hurst) + 1);
    const double b = r - 1;
    const double c = (4.0/3.0)*h_max_over_h_rms - 5;
    const double z = log(zeta_1)/log(10) - 2;
    const double y = -2.0/5.0 + 2/sqrt(zeta_1);
    const double h = 4*hurst - 3;
    const double g = (1.0/4.0)*d_over_h_rms + 1.0/4.0;
    const double s = (d_over_h_rms + 0.3)/sqrt(pow(d_over_h_rms + 0.3, 2) + 1);
    const double near = 0.3167*b*c + 0.3111*b*h + 1.672*b*q*z + 0.2061*b*z + 0.1205*b*(c*c) - 0.1783*c*t + 0.4069*c*z -
        0.03422*c*h*h - 0.1913*c*z*z + 0.9973*h*z + 0.8729*h + 0.09798*h*(z*z) - 5.555*q + 2.255*q*(b*b) - 0.8067*t*z +
        4.663*t + 4.567*z + 3.404*z*(q*q) - 1.0/2.0*pow(h_max_over_h_rms - 4.0/9.0*r, 2) +
        (7.0/2.0)*log(r/(r*pow(zeta_1, hurst) + 1)) + 7.558 + 0.5068*(b*b) - 0.177*b*b*b + 0.1134*(z*z*z);
    const double far = -0.09048*g*h*z - 0.2673*g*h - 0.07731*g*s*h*h - 2.691*g*y - 2.489*g - 1.026*g*s*s*s -
        0.2339*h*s*z - 0.3641*h*z - 0.4084*h - 0.2491*h*s*s - 0.2267*h*s*s*s + 0.1932*s*z - 1.067*s - 1.388*y -
        1.691*y*g*g*s*s - 0.221*y*h*h + 0.1644*z*(s*s*s*s) - 2.241 - 1.0/8.0*pow(d_over_h_rms + sqrt(2 +
        d_over_h_rms*d_over_h_rms), 2);
    const double log_total = ((k < r) ? (    far ) : (    near ));
    return exp(log_total);
}

/* A/A0, closed totals: within 0.0968. */
double mbma_totals_area(double d_over_h_rms, double h_max_over_h_rms, double zeta_1, double hurst) {
    const double r = -d_over_h_rms + h_max_over_h_rms;
    const double k = (9.0/4.0)*sqrt(-pow(zeta_1, -2*hurst) + pow(3.0/2.0, -2*hurst));
    const double t = (1.0/3.0)*log(r*pow(zeta_1, hurst) + 1) - 1;
    const double q = 1.0/(r*pow(zeta_1, hurst) + 1);
    const double b = r - 1;
    const double c = (4.0/3.0)*h_max_over_h_rms - 5;
    const double z = log(zeta_1)/log(10) - 2;
    const double y = -2.0/5.0 + 2/sqrt(zeta_1);
    const double h = 4*hurst - 3;
    const double g = (1.0/4.0)*d_over_h_rms + 1.0/4.0;
    const double s = (d_over_h_rms + 0.3)/sqrt(pow(d_over_h_rms + 0.3, 2) + 1);
    const double near = 0.305*b*c + 0.399*b*h + 4.98*b*q*z + 4.18*b*q + 0.114*b*z + 0.101*b*(c*c) - 0.0546*c*h*t +
        0.0935*c*t*z - 0.188*c*t + 0.364*c*z - 0.219*c*z*z - 0.377*h*t + 1.41*h*z + 1.5*h + 5.31*q*z + 2.42*q*(b*b) -
        0.416*t*z + 4.84*t + 3.53*z - 1.0/2.0*pow(h_max_over_h_rms - 4.0/9.0*r, 2) + (10.0/3.0)*log(r/(r*pow(zeta_1,
        hurst) + 1)) + 5.79 + 0.542*(b*b) - 0.215*b*b*b - 4.94*q*q*q*q;
    const double far = -0.281*g*h*s*s - 2.58*g - 0.56*g*s*s*s*s*s - 0.231*h*s*z - 0.138*h*s + 0.106*h - 0.234*h*s*s +
        0.989*h*(y*y) - 1.2*s*y - 1.69*s*y*g*g - 1.17*s - 0.0654*z + 0.558*z*(g*g)*(s*s) - 2.81 -
        1.0/8.0*pow(d_over_h_rms + sqrt(2 + d_over_h_rms*d_over_h_rms), 2) - 2.28*g*g*y*y - 0.106*h*h*s*s - 0.238*z*z;
    const double log_total = ((k < r) ? (    far ) : (    near ));
    return exp(log_total);
}
