"""Closed forms of the island functions and of total force and area, with their certificates.

Made by `python -m generate formulas`; do not edit.
"""

# fmt: off
# numpy's ufuncs return Any
# mypy: disable-error-code="no-any-return"

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from numpy import exp, log, pi, sqrt, where

from mbma_tables.arguments import FloatArray


class Certificate(NamedTuple):
    """Relative errors of one function on points that no fit saw, and its number of fitted coefficients."""

    coefficients: int
    largest: float
    median: float
    points: int
    worst_at: dict[str, float]


def pocket_phi_F(X: FloatArray, mu: FloatArray) -> FloatArray:
    """Phi_F, pocket form: within 0.0371."""
    w = 1/(X + 3)
    p_F = w*(w*(w*(w*(404.3 - 406.9*w) - 101.9) - 1.906) - 7.687)
    rigid_F = (1/5)*pi*(X + 3)**(5/2)*exp(p_F)
    u_F = 1/(X + 1.67)
    y_F = 0.0166*mu*(X + 1.67)
    t_F = log(y_F + 1)
    z_F = 1/(sqrt(y_F) + 1)
    log_Q_F = (
        3.29*u_F*z_F - 4.92*u_F - 7.14e-05*u_F*t_F*t_F*t_F*t_F*t_F + 0.25*z_F + 0.189*(z_F*z_F*z_F) +
        23.0*(u_F*u_F*u_F*u_F*u_F*u_F)
    )
    return mu*rigid_F/((3/20)*sqrt(2)*pi*mu*(X + 1)*exp(log_Q_F) + 1)


def pocket_phi_A(X: FloatArray, mu: FloatArray) -> FloatArray:
    """Phi_A, pocket form: within 0.0317."""
    w = 1/(X + 3)
    p_A = w*(w*(w*(w*(379.0 - 338.47*w) - 115.67) + 1.7768) - 6.2766)
    rigid_A = (1/2)*pi*(X + 3)**2*exp(p_A)
    u_A = 1/(X + 4.24)
    y_A = 0.0311*mu*(X + 4.24)
    z_A = 1/(sqrt(y_A) + 1)
    v_A = log(0.979*mu*sqrt(u_A) + 1)
    log_Q_A = (
        -0.0001849*u_A*v_A*v_A*v_A*v_A + 0.2543*v_A + 47.27*z_A*(u_A*u_A) - 38.91*u_A*u_A - 0.3145*z_A*z_A -
        4219.0*u_A*u_A*u_A*u_A*u_A*z_A*z_A*z_A + 13.91*(u_A*u_A*u_A*u_A*u_A*u_A)
    )
    return rigid_A/((1/3)*2**(1/3)*pi**(2/3)*mu*(X + 1)*exp(log_Q_A)/(mu*(X + 1) + 1)**(1/3) + 1)


def standard_phi_F(X: FloatArray, mu: FloatArray) -> FloatArray:
    """Phi_F, standard form: within 0.00164."""
    w = 1/(X + 3)
    p_F = w*(w*(w*(w*(w*(w*(6264.7*w - 8610.2) + 4223.7) - 822.91) + 63.132) - 12.175) - 7.4721)
    rigid_F = (1/5)*pi*(X + 3)**(5/2)*exp(p_F)
    u_F = 1/(X + 5.02)
    y_F = 0.234*mu*(X + 5.02)
    t_F = log(y_F + 1)
    z_F = 1/(sqrt(y_F) + 1)
    v_F = log(1.25*mu*sqrt(u_F) + 1)
    log_Q_F = (
        -0.93573*u_F*v_F + 0.21852*u_F*z_F - 1.6649*u_F + 0.0045288*u_F*(t_F*t_F*t_F) - 1.0907*u_F*z_F*z_F*z_F +
        0.00024878*u_F*(v_F*v_F*v_F*v_F) - 2.5226e-05*u_F*t_F*t_F*t_F*t_F*t_F + 0.24817*z_F +
        182.17*z_F*(u_F*u_F*u_F*u_F) - 0.33617*u_F*u_F - 0.1832*u_F*u_F*v_F*v_F + 70.644*(u_F*u_F)*(z_F*z_F) -
        69.621*u_F*u_F*z_F*z_F*z_F + 0.5966*(z_F*z_F) - 0.33826*z_F*z_F*z_F - 1142.9*u_F*u_F*u_F*u_F +
        0.016675*(t_F*t_F*t_F*t_F*t_F)*(u_F*u_F*u_F*u_F*u_F*u_F) - 12691.0*u_F*u_F*u_F*u_F*u_F*z_F*z_F +
        11081.0*(u_F*u_F*u_F*u_F*u_F)*(z_F*z_F*z_F) + 21274.0*(u_F*u_F*u_F*u_F*u_F*u_F)
    )
    return mu*rigid_F/((3/20)*sqrt(2)*pi*mu*(X + 1)*exp(log_Q_F) + 1)


def standard_phi_A(X: FloatArray, mu: FloatArray) -> FloatArray:
    """Phi_A, standard form: within 0.00768."""
    w = 1/(X + 3)
    p_A = w*(w*(w*(w*(w*(w*(6056.0*w - 9136.5) + 5056.8) - 1192.8) + 117.26) - 14.285) - 5.8993)
    rigid_A = (1/2)*pi*(X + 3)**2*exp(p_A)
    u_A = 1/(X + 3.22)
    y_A = 0.589*mu*(X + 3.22)
    t_A = log(y_A + 1)
    z_A = 1/(sqrt(y_A) + 1)
    v_A = log(1.51*mu*sqrt(u_A) + 1)
    log_Q_A = (
        16.02*u_A*z_A - 1.743*u_A - 28.84*u_A*z_A*z_A - 0.003347*u_A*t_A*t_A*t_A + 0.2406*v_A - 0.5935*z_A +
        7.182*z_A*(u_A*u_A) - 558.5*z_A*u_A*u_A*u_A*u_A*u_A - 16.9*u_A*u_A + 78.03*(u_A*u_A)*(z_A*z_A*z_A) +
        0.001228*(v_A*v_A) - 0.05628*z_A*z_A + 1.166*(z_A*z_A*z_A) - 7.966*u_A*u_A*u_A*u_A + 7.555e-05*(v_A*v_A*v_A*v_A)
        + 1.13e-05*(t_A*t_A*t_A*t_A*t_A)*(u_A*u_A) - 9.138e-05*t_A*t_A*t_A*t_A*t_A*u_A*u_A*u_A*u_A*u_A +
        930.1*(u_A*u_A*u_A*u_A*u_A)*(z_A*z_A) - 1747.0*u_A*u_A*u_A*u_A*u_A*z_A*z_A*z_A + 591.1*(u_A*u_A*u_A*u_A*u_A*u_A)
    )
    return rigid_A/((1/3)*2**(1/3)*pi**(2/3)*mu*(X + 1)*exp(log_Q_A)/(mu*(X + 1) + 1)**(1/3) + 1)


def long_phi_F(X: FloatArray, mu: FloatArray) -> FloatArray:
    """Phi_F, long form: within 0.00054."""
    w = 1/(X + 3)
    p_F = (
        w*(w*(w*(w*(w*(w*(w*(w*(202680.3 - 116676.09*w) - 139391.11) + 47261.94) - 8071.9332) + 724.69922) - 40.764531)
        - 9.090187) - 7.4943273)
    )
    rigid_F = (1/5)*pi*(X + 3)**(5/2)*exp(p_F)
    u_F = 1/(X + 2.0)
    y_F = 1.0*mu*(X + 2.0)
    t_F = log(y_F + 1)
    z_F = 1/(sqrt(y_F) + 1)
    v_F = log(3.0*mu*sqrt(u_F) + 1)
    log_Q_F = (
        -0.118296*t_F*u_F - 3.01064*t_F*u_F*u_F*u_F*u_F*u_F - 0.263905*u_F*v_F + 3.80004*u_F*z_F - 0.836377*u_F -
        0.0619324*u_F*v_F*v_F - 20.2772*u_F*z_F*z_F - 3.85487e-05*u_F*t_F*t_F*t_F + 0.00635397*u_F*(v_F*v_F*v_F) +
        19.8987*u_F*(z_F*z_F*z_F) - 0.000379636*u_F*v_F*v_F*v_F*v_F + 3.9305e-06*u_F*(t_F*t_F*t_F*t_F*t_F) +
        1.53774*v_F*(u_F*u_F) + 0.484979*z_F + 50.6236*z_F*(u_F*u_F) - 225.267*z_F*u_F*u_F*u_F +
        411.195*z_F*(u_F*u_F*u_F*u_F) - 325.948*z_F*u_F*u_F*u_F*u_F*u_F - 10.7045*u_F*u_F + 33.8306*(u_F*u_F)*(z_F*z_F)
        - 0.0163792*u_F*u_F*v_F*v_F*v_F - 102.576*u_F*u_F*z_F*z_F*z_F + 0.925984*(z_F*z_F) +
        0.0154324*(t_F*t_F*t_F)*(u_F*u_F*u_F*u_F*u_F*u_F) - 22.121*u_F*u_F*u_F + 310.16*(u_F*u_F*u_F)*(z_F*z_F*z_F) +
        0.00050287*(u_F*u_F*u_F)*(v_F*v_F*v_F*v_F) - 1.16559*z_F*z_F*z_F + 0.00155839*(t_F*t_F*t_F*t_F)*(u_F*u_F) +
        0.00513046*(t_F*t_F*t_F*t_F)*(u_F*u_F*u_F*u_F*u_F) + 166.302*(u_F*u_F*u_F*u_F) - 162.134*u_F*u_F*u_F*u_F*z_F*z_F
        - 429.543*u_F*u_F*u_F*u_F*z_F*z_F*z_F - 3.19737e-05*t_F*t_F*t_F*t_F*t_F*u_F*u_F -
        0.000104206*t_F*t_F*t_F*t_F*t_F*u_F*u_F*u_F*u_F - 0.000601264*t_F*t_F*t_F*t_F*t_F*u_F*u_F*u_F*u_F*u_F*u_F -
        279.441*u_F*u_F*u_F*u_F*u_F + 277.261*(u_F*u_F*u_F*u_F*u_F)*(z_F*z_F) +
        180.761*(u_F*u_F*u_F*u_F*u_F)*(z_F*z_F*z_F) + 174.525*(u_F*u_F*u_F*u_F*u_F*u_F)
    )
    return mu*rigid_F/((3/20)*sqrt(2)*pi*mu*(X + 1)*exp(log_Q_F) + 1)


def long_phi_A(X: FloatArray, mu: FloatArray) -> FloatArray:
    """Phi_A, long form: within 0.000718."""
    w = 1/(X + 3)
    p_A = (
        w*(w*(w*(w*(w*(w*(w*(w*(283024.13 - 151141.2*w) - 214699.54) + 83691.155) - 17683.969) + 2076.1419) - 145.64022)
        - 3.8642267) - 6.0454312)
    )
    rigid_A = (1/2)*pi*(X + 3)**2*exp(p_A)
    u_A = 1/(X + 3.0)
    y_A = 0.5*mu*(X + 3.0)
    t_A = log(y_A + 1)
    z_A = 1/(sqrt(y_A) + 1)
    v_A = log(3.0*mu*sqrt(u_A) + 1)
    log_Q_A = (
        2.702999*t_A*u_A - 63.31776*t_A*u_A*u_A*u_A + 268.1615*t_A*(u_A*u_A*u_A*u_A*u_A*u_A) + 3.809611*u_A*v_A +
        15.52818*u_A*z_A - 7.687747*u_A - 0.5328182*u_A*t_A*t_A - 0.7197839*u_A*v_A*v_A - 11.14794*u_A*z_A*z_A -
        0.0263022*u_A*t_A*t_A*t_A + 0.08046351*u_A*(v_A*v_A*v_A) + 9.137597*u_A*(z_A*z_A*z_A) +
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
        4654.55*u_A*u_A*u_A*u_A*u_A*u_A
    )
    return rigid_A/((1/3)*2**(1/3)*pi**(2/3)*mu*(X + 1)*exp(log_Q_A)/(mu*(X + 1) + 1)**(1/3) + 1)


def totals_force(
    d_over_h_rms: FloatArray, h_max_over_h_rms: FloatArray, zeta_1: FloatArray, hurst: FloatArray
) -> FloatArray:
    """Force over E* q0 h_rms, closed totals: within 0.0906."""
    r = -d_over_h_rms + h_max_over_h_rms
    k = (9/4)*sqrt(-zeta_1**(-2*hurst) + (3/2)**(-2*hurst))
    t = (1/3)*log(r*zeta_1**hurst + 1) - 1
    q = 1/(r*zeta_1**hurst + 1)
    b = r - 1
    c = (4/3)*h_max_over_h_rms - 5
    z = log(zeta_1)/log(10) - 2
    y = -2/5 + 2/sqrt(zeta_1)
    h = 4*hurst - 3
    g = (1/4)*d_over_h_rms + 1/4
    s = (d_over_h_rms + 0.3)/sqrt((d_over_h_rms + 0.3)**2 + 1)
    near = (
        0.3167*b*c + 0.3111*b*h + 1.672*b*q*z + 0.2061*b*z + 0.1205*b*(c*c) - 0.1783*c*t + 0.4069*c*z - 0.03422*c*h*h -
        0.1913*c*z*z + 0.9973*h*z + 0.8729*h + 0.09798*h*(z*z) - 5.555*q + 2.255*q*(b*b) - 0.8067*t*z + 4.663*t +
        4.567*z + 3.404*z*(q*q) - 1/2*(h_max_over_h_rms - 4/9*r)**2 + (7/2)*log(r/(r*zeta_1**hurst + 1)) + 7.558 +
        0.5068*(b*b) - 0.177*b*b*b + 0.1134*(z*z*z)
    )
    far = (
        -0.09048*g*h*z - 0.2673*g*h - 0.07731*g*s*h*h - 2.691*g*y - 2.489*g - 1.026*g*s*s*s - 0.2339*h*s*z - 0.3641*h*z
        - 0.4084*h - 0.2491*h*s*s - 0.2267*h*s*s*s + 0.1932*s*z - 1.067*s - 1.388*y - 1.691*y*g*g*s*s - 0.221*y*h*h +
        0.1644*z*(s*s*s*s) - 2.241 - 1/8*(d_over_h_rms + sqrt(2 + d_over_h_rms*d_over_h_rms))**2
    )
    log_total = where(k < r, far, near)
    return exp(log_total)


def totals_area(
    d_over_h_rms: FloatArray, h_max_over_h_rms: FloatArray, zeta_1: FloatArray, hurst: FloatArray
) -> FloatArray:
    """A/A0, closed totals: within 0.0968."""
    r = -d_over_h_rms + h_max_over_h_rms
    k = (9/4)*sqrt(-zeta_1**(-2*hurst) + (3/2)**(-2*hurst))
    t = (1/3)*log(r*zeta_1**hurst + 1) - 1
    q = 1/(r*zeta_1**hurst + 1)
    b = r - 1
    c = (4/3)*h_max_over_h_rms - 5
    z = log(zeta_1)/log(10) - 2
    y = -2/5 + 2/sqrt(zeta_1)
    h = 4*hurst - 3
    g = (1/4)*d_over_h_rms + 1/4
    s = (d_over_h_rms + 0.3)/sqrt((d_over_h_rms + 0.3)**2 + 1)
    near = (
        0.305*b*c + 0.399*b*h + 4.98*b*q*z + 4.18*b*q + 0.114*b*z + 0.101*b*(c*c) - 0.0546*c*h*t + 0.0935*c*t*z -
        0.188*c*t + 0.364*c*z - 0.219*c*z*z - 0.377*h*t + 1.41*h*z + 1.5*h + 5.31*q*z + 2.42*q*(b*b) - 0.416*t*z +
        4.84*t + 3.53*z - 1/2*(h_max_over_h_rms - 4/9*r)**2 + (10/3)*log(r/(r*zeta_1**hurst + 1)) + 5.79 + 0.542*(b*b) -
        0.215*b*b*b - 4.94*q*q*q*q
    )
    far = (
        -0.281*g*h*s*s - 2.58*g - 0.56*g*s*s*s*s*s - 0.231*h*s*z - 0.138*h*s + 0.106*h - 0.234*h*s*s + 0.989*h*(y*y) -
        1.2*s*y - 1.69*s*y*g*g - 1.17*s - 0.0654*z + 0.558*z*(g*g)*(s*s) - 2.81 - 1/8*(d_over_h_rms + sqrt(2 +
        d_over_h_rms*d_over_h_rms))**2 - 2.28*g*g*y*y - 0.106*h*h*s*s - 0.238*z*z
    )
    log_total = where(k < r, far, near)
    return exp(log_total)


FUNCTIONS: dict[str, dict[str, Callable[..., FloatArray]]] = {
    "pocket": {"phi_F": pocket_phi_F, "phi_A": pocket_phi_A},
    "standard": {"phi_F": standard_phi_F, "phi_A": standard_phi_A},
    "long": {"phi_F": long_phi_F, "phi_A": long_phi_A},
    "totals": {"force": totals_force, "area": totals_area},
}

RANGES: dict[str, dict[str, tuple[float, float]]] = {
    "pocket": {"X": (0.8, 25.0), "mu": (0.0, 2000.0)},
    "standard": {"X": (0.0, 25.0), "mu": (0.0, 2000.0)},
    "long": {"X": (0.0, 25.0), "mu": (0.0, 2000.0)},
    "totals": {"d_over_h_rms": (-4.5, 4.5), "h_max_over_h_rms": (3.0, 4.5), "zeta_1": (10.0, 1000.0), "hurst": (0.5,
        1.0), "area": (1e-06, 1.0)},
}

CERTIFICATES: dict[str, dict[str, Certificate]] = {
    "pocket": {"phi_F": Certificate(coefficients=8, largest=0.0371, median=0.00521, points=20000, worst_at={"X": 8.571,
        "mu": 30.85}), "phi_A": Certificate(coefficients=10, largest=0.0317, median=0.00305, points=20000,
        worst_at={"X": 0.8, "mu": 2000.0})},
    "standard": {"phi_F": Certificate(coefficients=23, largest=0.00164, median=0.000384, points=20000, worst_at={"X":
        0.0, "mu": 0.6372}), "phi_A": Certificate(coefficients=23, largest=0.00768, median=0.00201, points=20000,
        worst_at={"X": 6.16, "mu": 0.06695})},
    "long": {"phi_F": Certificate(coefficients=43, largest=0.00054, median=0.000138, points=20000, worst_at={"X":
        0.3042, "mu": 0.5951}), "phi_A": Certificate(coefficients=53, largest=0.000718, median=0.000205, points=20000,
        worst_at={"X": 8.683, "mu": 26.31})},
    "totals": {"force": Certificate(coefficients=40, largest=0.0906, median=0.0272, points=46081,
        worst_at={"d_over_h_rms": 3.328, "h_max_over_h_rms": 3.718, "zeta_1": 1000.0, "hurst": 0.5917}), "area":
        Certificate(coefficients=40, largest=0.0968, median=0.0329, points=46081, worst_at={"d_over_h_rms": 2.999,
        "h_max_over_h_rms": 4.5, "zeta_1": 615.1, "hurst": 1.0})},
}
