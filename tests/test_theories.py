"""The other theories: against the paper's own number, closed forms, mpmath and each other."""

import math

import mpmath
import numpy as np
import pytest
from scipy.integrate import quad

from mbma_tables import InputError, OutOfRangeError, Surface, contact, theories

YANG_PERSSON = Surface.named("yang-persson")
SPHERES, FULL, LIGHT = theories.GreenwoodWilliamson(), theories.Persson(), theories.Persson("simplified")


def separation(surface, load, theory=FULL):
    return theory.mean_separation_at(surface, "pressure", np.asarray(load))


def relative(value, expected):
    return np.max(np.abs(np.asarray(value) / np.asarray(expected) - 1))


def printed_separation(hurst, zeta_1, slope, load, digits):
    """u/h_rms of Eq. (19) as printed, with q0 = 1 and h_rms = slope, by nested quadrature.

    Only exp(-(w p0)^2) at q1 is taken out, since mpmath's tolerance is absolute.
    """
    with mpmath.workdps(digits):
        H, z, h, p0 = (mpmath.mpf(x) for x in (hurst, zeta_1, slope, load))
        gamma = mpmath.mpf("0.42")
        scale = H / mpmath.pi * h**2 / (1 - z ** (-2 * H))

        def w(q):
            power = 2 - 2 * H
            m2 = mpmath.pi * scale * (mpmath.log(q) if H == 1 else (q**power - 1) / power)
            return 1 / mpmath.sqrt(m2)

        base = (w(z) * p0) ** 2

        def inner(w_q):
            span = mpmath.log1p(80 / (w_q * p0) ** 2) / 2

            def integrand(t):  # p' = p0 exp(t)
                x = w_q * p0 * mpmath.exp(t)
                return (gamma + 3 * (1 - gamma) * mpmath.erf(x) ** 2) * mpmath.exp(base - x * x)

            return mpmath.quad(integrand, mpmath.linspace(0, span, int(span / 3) + 2))

        def outer(v):  # q = exp(exp(v))
            log_q = mpmath.exp(v)
            q = mpmath.exp(log_q)
            return q**2 * scale * q ** (-2 - 2 * H) * w(q) * inner(w(q)) * q * log_q

        top = mpmath.log(mpmath.log(z))
        low = max(top + mpmath.log(base / (base + 80)) - 2, -mpmath.mpf(90))
        pieces = mpmath.linspace(low, top, int((top - low) / 3) + 2)
        return float(mpmath.sqrt(mpmath.pi) * mpmath.exp(-base) * mpmath.quad(outer, pieces) / h)


# printed_separation(..., digits=25), up to two minutes each; the last two are computed here
PRINTED = [
    (0.3, 4, 0.2, 2.0, 7.12986115868634175e-24),
    (0.3, 4, 0.1, 1e-8, 6.7802122365389193113),
    (0.3, 1e6, 0.01, 2.0, 0.075266609870544353997),
    (0.5, 1e4, 0.05, 1e-5, 4.986113896081679742),
    (0.8, 216, 0.18125, 2.0, 4.894496884608888166e-8),
    (0.8, 216, 0.18125, 1e-8, 7.6679623952348966113),
    (1.0, 4, 0.3, 2.0, 1.695791671698073388e-17),
    (1.0, 1e6, 0.05, 1e-3, 1.8002462214981889954),
    (0.3, 4, 0.2, 2.0, None),
    (0.9, 10, 0.3, 1.0, None),
]


@pytest.mark.parametrize(("hurst", "zeta_1", "slope", "load", "expected"), PRINTED)
def test_full_double_integral_equals_mpmath(hurst, zeta_1, slope, load, expected):
    known = expected or printed_separation(hurst, zeta_1, slope, load, digits=16)
    assert relative(separation(Surface(hurst, slope, slope * zeta_1, 1.0, 3.0), load), known) < 1e-11


def test_simplified_force_of_the_yang_persson_case():
    """The value that follows from Eqs. (20, 21); the paper reads 3.5e-4 off its figure."""
    force = LIGHT.answer(YANG_PERSSON, 3 * YANG_PERSSON.h_rms).pressure
    assert force == pytest.approx(3.64e-4, rel=1e-3)


@pytest.mark.parametrize("hurst", [0.3, 0.8, 1.0])
def test_simplified_is_the_light_load_limit_of_full(hurst):
    """Up to the four digits of 4.047 they are one: at light load the constant of (21b) follows from (19)."""
    surface = Surface(hurst, 0.1, 20.0, 1.0, 3.0)
    expected = quad(lambda x: math.erf(x) ** 2 * math.exp(-x * x) / x, 0, 7, epsabs=0, epsrel=1e-12)[0]
    constant = math.exp(3 * 0.58 / 0.42 * expected - np.euler_gamma / 2)
    assert constant == pytest.approx(4.047, rel=1e-3)
    # the next term is of first order in the load
    u = separation(surface, [1e-13, 1e-15], LIGHT)
    full, simplified = (theory.answer(surface, u).pressure for theory in (FULL, LIGHT))
    assert relative(full / simplified, constant / 4.047) < 1e-9


def test_persson_area_limits():
    surface = Surface(np.array([0.4, 0.8, 1.0]), 0.1, 50.0, 1.0, 3.0)
    light = 1e-9 * surface.rms_gradient
    kappa = FULL.area_at(surface, light) / light * surface.rms_gradient
    assert relative(kappa, math.sqrt(8 / math.pi)) < 1e-10
    assert np.all(FULL.area_at(surface, 0.0) == 0)
    assert relative(FULL.area_at(surface, 10 * surface.rms_gradient), 1.0) < 1e-10


def test_greenwood_williamson_equals_mpmath():
    d = 1.2345
    with mpmath.workdps(30):
        s = YANG_PERSSON
        sigma = mpmath.sqrt((1 - mpmath.mpf("0.8968") / s.alpha) * s.m0)
        density = s.m4 / (6 * mpmath.pi * mpmath.sqrt(3) * s.m2)
        radius = 3 * mpmath.sqrt(mpmath.pi) / (8 * mpmath.sqrt(s.m4))

        def mean(power):
            def integrand(z):
                return (z - d) ** power * mpmath.npdf(z, 0, sigma)

            return mpmath.quad(integrand, [d, d + 1, d + 3, d + 8, d + 20])

        force = mpmath.mpf(4) / 3 * density * mpmath.sqrt(radius) * mean(1.5)
        area = mpmath.pi * density * radius * mean(1)
    found = contact(YANG_PERSSON, separation=d, theory="greenwood_williamson", E_star=2.5)
    assert relative(found.pressure, 2.5 * float(force)) < 1e-11
    assert relative(found.area, float(area)) < 1e-11
    assert found.mean_separation == (3 + d) / 2


def test_greenwood_williamson_deep_and_far():
    """Deep, every summit is a Hertz contact of depth -d; far, A/F rises like sqrt(d)."""
    s = YANG_PERSSON
    deep = SPHERES.answer(s, (s.h_max - 1e6) / 2)
    expected = 4 / 3 * s.summit_density * math.sqrt(s.summit_radius) * 1e9
    assert relative(deep.pressure, expected) < 1e-10
    assert relative(deep.area, math.pi * s.summit_density * s.summit_radius * 1e6) < 1e-10
    x = 36.0
    far = SPHERES.answer(s, (s.h_max + x * s.summit_sigma) / 2)
    # F_1/F_{3/2} -> sqrt(x)/Gamma(5/2), the next term below 3/x^2
    ratio = (far.area / far.pressure) * 4 / (3 * math.pi) / np.sqrt(s.summit_radius / s.summit_sigma)
    assert relative(ratio, math.sqrt(x) / math.gamma(2.5)) < 3 / x**2
    assert SPHERES.answer(s, 31.5).pressure == 0


def test_out_of_range_names_the_entries():
    with pytest.raises(OutOfRangeError, match="infinite at zero load"):
        separation(YANG_PERSSON, 0.0)
    with pytest.raises(OutOfRangeError, match="lambda") as caught:
        separation(YANG_PERSSON, [1e-3, 3.0], LIGHT)
    assert caught.value.mask.tolist() == [False, True]
    for theory, bad in ((FULL, 0.0), (FULL, -1.0), (LIGHT, -1e-3)):
        with pytest.raises(OutOfRangeError, match="mean_separation"):
            theory.answer(YANG_PERSSON, bad)
    with pytest.raises(OutOfRangeError, match="normal numbers") as caught:
        FULL.answer(YANG_PERSSON, [1.0, 1e4])
    assert caught.value.mask.tolist() == [False, True]
    with pytest.raises(InputError, match="method"):
        theories.Persson("exact")


def test_extreme_loads_stay_numbers():
    light = separation(YANG_PERSSON, [1e-300, 1e-150])
    assert relative(separation(YANG_PERSSON, [1e-300, 1e-150], LIGHT), light) < 1e-4
    assert separation(YANG_PERSSON, 1e300) == 0
    # p0/Y about which exp(-(p0/Y)^2) is no normal number any more
    vanishing = separation(YANG_PERSSON, math.sqrt(YANG_PERSSON.m2) * np.linspace(25.0, 28.0, 31))
    assert (np.diff(vanishing) <= 0).all()
    assert vanishing[0] > 0 == vanishing[-1]
    loads = np.array([1e-290, 1e-100, 1e-10, 1.0, 10.0])
    assert relative(FULL.answer(YANG_PERSSON, separation(YANG_PERSSON, loads)).pressure, loads) < 1e-9
