"""Theories and their laws: against the paper, closed forms, mpmath and each other; monotone, inverted."""

import functools
import math

import mpmath
import numpy as np
import pytest
from helpers import Springs, law_of_names, random_map, refusals, with_slopes
from scipy.integrate import quad

from mbma_tables import (
    Bodies,
    ConvergenceError,
    InputError,
    OutOfRangeError,
    Surface,
    contact,
    contact_law,
    theories,
)
from mbma_tables.theories import THEORIES, GreenwoodWilliamson, Mbma, Persson, resolve

SURFACE = Surface(hurst=0.8, q0=0.2, q1=20.0, h_rms=1.5, h_max=4.8)
STEEP = Surface(hurst=0.35, q0=1.0, q1=1000.0, h_rms=1.0, h_max=3.2)
FINE = Surface(hurst=1.0, q0=1.0, q1=60.0, h_rms=0.01, h_max=0.035)
MODULUS = 30.0


class Cones:
    """A force that ends at h_max and has no bound at u = 0."""

    name = "cones"

    def answer(self, surface, u):
        v = np.asarray(u) / surface.h_max
        with np.errstate(divide="ignore", invalid="ignore"):
            return (1 - v) ** 1.3 * np.exp(-v) / np.sqrt(v), (1 - v) ** 1.2


class Peak:
    """A force that falls again below u = 1, stiffest at u = 2 on a surface of h_max 3."""

    name = "peak"

    def answer(self, surface, u):
        return (3 - u) ** 2 * u, 0.01 * (3 - u)


OBJECTS = [Persson("simplified"), Cones()]
each = pytest.mark.parametrize(
    "theory",
    [name for name in THEORIES if name != "mbma"] + OBJECTS,
    ids=lambda t: getattr(t, "name", t),
)


@functools.cache
def law_of(theory, surface=SURFACE, rtol=1e-8):
    return contact_law(surface, MODULUS, rtol=rtol, theory=theory)


def places(law, seed, count=400):
    """Mean separations of the law, most of them between 1% and 99% of h_max, some near its ends."""
    low = (law.h_max + law.lowest) / 2
    high = (
        law.h_max
        if law.highest == math.inf
        else min(2 * law.h_max, (law.h_max + law.highest) / 2)
    )
    u = np.random.default_rng(seed).uniform(max(low, 0.01 * law.h_max), high, count)
    return np.sort(
        np.append(u, [low * 1.001 + 1e-4 * law.h_max, high - 1e-5 * law.h_max])
    )


@each
@pytest.mark.parametrize(
    "surface", [SURFACE, STEEP, FINE], ids=["usual", "steep", "fine"]
)
@pytest.mark.parametrize("rtol", [1e-4, 1e-8])
def test_within_its_bound_of_the_theory(theory, surface, rtol):
    law = law_of(theory, surface, rtol)
    chosen = resolve(theory)
    u = places(law, 1)
    true = chosen.answer(surface, u)
    own = np.nan_to_num(true.error).max()
    assert law.error <= max(rtol, 0.1 * own) + own + 1e-15
    for found, wanted in (
        (law.pressure(u) / MODULUS, true.pressure),
        (law.area(u), true.area),
    ):
        assert np.abs(found / wanted - 1).max() <= law.error
    if isinstance(chosen, Persson | GreenwoodWilliamson) and rtol == 1e-8:
        assert law.stiffness(u) / MODULUS == pytest.approx(true.stiffness, rel=2e-6)
    assert (law.theory, law.variant, law.island_model) == (chosen.name, "", "")


@each
def test_force_and_stiffness_rise_with_compression(theory):
    law = law_of(theory)
    u = np.linspace(*places(law, 2)[[0, -1]], 3000)[::-1]
    assert (np.diff(law.pressure(u)) > 0).all()
    assert (np.diff(law.stiffness(u)) > 0).all()
    assert law.turning_point is law.area_turning_point is law.softening is None


@each
def test_slopes_and_energy_are_those_of_the_force(theory):
    law = law_of(theory)
    d = 2 * np.array([0.9, 2.0, 3.3, 4.4]) - law.h_max
    step = 1e-4
    for value, slope in with_slopes(law):
        steep = (value(separation=d - step) - value(separation=d + step)) / (2 * step)
        assert slope(separation=d) == pytest.approx(steep, rel=1e-6)
    end = law.h_max if law.highest == math.inf else law.highest
    for gap, energy in zip(d, law.energy(separation=d), strict=True):
        work = quad(
            lambda d: law.pressure(separation=d),
            gap,
            min(end, gap + 60),
            epsabs=0,
            epsrel=1e-9,
            limit=400,
        )[0]
        assert energy == pytest.approx(work / 2, rel=1e-6)
    # over the mean separation, which moves half as far
    u = (law.h_max + d) / 2
    assert law.energy(separation=d) == pytest.approx(
        MODULUS * resolve(theory).energy(SURFACE, u), rel=1e-6
    )


@each
def test_inverses(theory):
    law = law_of(theory)
    u = places(law, 3)
    for name in ("pressure", "area"):
        wanted = getattr(law, name)(u)
        gaps = law.separation(**{name: wanted})
        assert getattr(law, name)(separation=gaps) == pytest.approx(wanted, rel=1e-12)
    found = law.at_pressure(law.pressure(u))
    # rounding of h_max - u limits the depth below first contact
    assert found.mean_separation == pytest.approx(u, abs=1e-12 * law.h_max)
    assert (found.mean_separation == (law.h_max + found.separation) / 2).all()
    assert found.area == pytest.approx(law.area(u), rel=1e-9)
    assert found.stiffness == pytest.approx(law.stiffness(u), rel=1e-6)


def test_no_load_and_no_contact():
    law = contact_law(SURFACE, theory=Cones())
    assert (
        contact_law(SURFACE, rtol=1e-3, theory=Noisy()).error < 2e-3
    )  # a tolerance above the noise
    assert law.separation(pressure=0.0) == law.h_max
    assert law.pressure(separation=[law.h_max, 2 * law.h_max]).tolist() == [0, 0]
    assert law.energy(separation=law.h_max) == law.stiffness(separation=law.h_max) == 0
    tiny = law.separation(pressure=1e-12)
    assert law.pressure(separation=tiny) == pytest.approx(1e-12, rel=1e-5)
    endless = contact_law(SURFACE, theory="persson")
    assert endless.pressure(2 * endless.h_max) > 0
    for asked in (
        {"pressure": 0.0},
        {"pressure": 1e-60},
        {"area": 1.0},
        {"pressure": -1.0},
    ):
        with pytest.raises(OutOfRangeError):
            endless.separation(**asked)
    for u, told in (
        (0.0, "where the theory ends"),
        (100 * endless.h_max, "where the law ends"),
    ):
        with pytest.raises(OutOfRangeError, match=told):
            endless.pressure(u)


def test_a_force_that_turns_and_a_stiffness_that_passes_its_maximum():
    law = contact_law(Surface(0.8, 1.0, 50.0, 1.0, 3.0), theory=Peak())
    # F = (3 - u)^2 u: F' = 0 at u = 1, F'' = 0 at u = 2
    assert law.turning_point == pytest.approx(2 * 1.0 - 3.0, abs=1e-6)
    assert law.area_turning_point is None
    assert law.softening == pytest.approx(2.0, abs=1e-4)
    assert law.separation(pressure=law.pressure(1.5)) == pytest.approx(0.0, abs=1e-10)
    assert law.separation(pressure=law.pressure(0.5)) > law.turning_point
    with pytest.raises(OutOfRangeError, match="where the branch ends"):
        law.separation(pressure=4.1)


@pytest.mark.parametrize("surface", [SURFACE, STEEP, FINE, Surface.named("concrete")])
def test_softening_of_mbma_is_where_its_stiffness_is_largest(surface):
    law = contact_law(surface, theory="mbma")
    assert law.softening == pytest.approx(float(Mbma().softening(surface)), rel=1e-4)
    sides = law.stiffness(law.softening + np.array([-0.05, 0, 0.05]) * law.h_max)
    assert sides[1] > max(sides[0], sides[2])


class Noisy(Cones):
    def answer(self, surface, u):
        force, area = super().answer(surface, u)
        return force * (1 + 1e-5 * np.sin(1e9 * np.asarray(u))), area


class Negative:
    name = "negative"

    def answer(self, surface, u):
        return 1.0 - np.asarray(u), np.ones_like(u)


test_what_is_no_law = refusals(
    lambda asked: law_of_names(**({"surface": SURFACE} | asked)),
    (
        {"theory": object()},
        "theory must be one of",
    ),
    ({"theory": "persson", "rtol": 1e-10}, "rtol"),
    (
        {"theory": "persson", "surface": Surface([0.5, 0.8], 0.2, 40.0, 1.0, 3.0)},
        "one surface, got a batch",
    ),
    ({"theory": Negative()}, "no positive force and area"),
    ({"theory": Noisy()}, "theory 'cones': the law needs more than .* use a larger rtol"),
    error=(InputError, ConvergenceError),
)


def test_mbma_ends_where_its_force_turns():
    batch = Surface(
        hurst=[0.3, 0.7, 0.9],
        q0=1.0,
        q1=[1000.0, 60.0, 216.0],
        h_rms=1.0,
        h_max=[3.0, 3.0, 3.5],
    )
    turn = contact_law(Surface(0.3, 1.0, 1000.0, 1.0, 3.0), theory="mbma").turning_point
    assert Mbma().interval(batch)[0] == pytest.approx(
        np.array([(3.0 + turn) / 2, 0, 0]), abs=1e-5
    )


@pytest.mark.parametrize("variant", ["reported", "printed", "fitted"])
def test_mbma_rises_with_compression_where_it_is_not_searched_for_a_maximum(variant):
    rng = np.random.default_rng(5)
    hurst = rng.uniform(0.05, 1.0, 60)
    zeta_1 = 10 ** rng.uniform(0.8, 4, 60)
    h_max = rng.uniform(1.0, 5.5, 60)
    batch = Surface(hurst, 1.0, zeta_1, 1.0, h_max)
    theory = Mbma(variant=variant, outside="nan")
    wanted = np.full(60, 1e-9)
    first, last = theory.branch(batch, "pressure", wanted)
    gaps = last + (first - last) * np.linspace(0.01, 1, 40)[:, None]
    totals = theory.totals(batch, 2 * gaps - h_max)
    assert (np.diff(totals.pressure, axis=0) > 0).all()
    assert (np.diff(totals.area, axis=0) > 0).all()
    # the maxima, which 200 compressions bracket, are all deeper
    assert (first >= theory.interval(batch)[0]).all()


def test_mbma_is_searched_for_a_maximum_only_for_what_needs_it():
    # pressures near the maximum of the first one and far below those of the others
    batch = Surface([0.3, 0.7, 0.9], 1.0, [1000.0, 60.0, 216.0], 1.0, 3.0)
    theory = Mbma()
    deepest, _ = theory.interval(batch)
    largest = theory.answer(batch, deepest).pressure
    wanted = largest * np.array([0.999, 0.01, 0.01])
    first, _ = theory.branch(batch, "pressure", wanted)
    assert first[0] == pytest.approx(deepest[0], rel=1e-12)
    assert (first[1:] == 1.5).all()
    u = theory.mean_separation_at(batch, "pressure", wanted)
    assert theory.answer(batch, u).pressure == pytest.approx(wanted, rel=1e-9)
    with pytest.raises(OutOfRangeError, match="at most what theory 'mbma' reaches"):
        theory.mean_separation_at(batch, "pressure", largest * np.array([1.01, 0.01, 1]))


def test_a_users_own_object_is_a_theory():
    theory = resolve(Springs())
    u = np.array([0.5, 2.0])
    found = theory.answer(SURFACE, u)
    assert found.stiffness == pytest.approx(3 / SURFACE.h_rms * found.pressure, rel=1e-8)
    assert theory.mean_separation_at(
        SURFACE, "pressure", found.pressure
    ) == pytest.approx(u, rel=1e-10)
    work = (
        (found.pressure - np.exp(-3 * SURFACE.h_max / SURFACE.h_rms)) * SURFACE.h_rms / 3
    )
    assert theory.energy(SURFACE, u) == pytest.approx(work, rel=1e-8)


@pytest.mark.parametrize("wrong", ["perssons", 3, None, Springs, object()])
def test_what_is_no_theory_is_refused(wrong):
    with pytest.raises(InputError, match="theory must be one of"):
        resolve(wrong)


YANG_PERSSON = Surface.named("yang-persson")
SPHERES = theories.GreenwoodWilliamson()
FULL = theories.Persson()
LIGHT = theories.Persson("simplified")


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
                return (gamma + 3 * (1 - gamma) * mpmath.erf(x) ** 2) * mpmath.exp(
                    base - x * x
                )

            return mpmath.quad(integrand, mpmath.linspace(0, span, int(span / 3) + 2))

        def outer(v):  # q = exp(exp(v))
            log_q = mpmath.exp(v)
            q = mpmath.exp(log_q)
            return q**2 * scale * q ** (-2 - 2 * H) * w(q) * inner(w(q)) * q * log_q

        top = mpmath.log(mpmath.log(z))
        low = max(top + mpmath.log(base / (base + 80)) - 2, -mpmath.mpf(90))
        pieces = mpmath.linspace(low, top, int((top - low) / 3) + 2)
        return float(
            mpmath.sqrt(mpmath.pi) * mpmath.exp(-base) * mpmath.quad(outer, pieces) / h
        )


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
    assert (
        relative(separation(Surface(hurst, slope, slope * zeta_1, 1.0, 3.0), load), known)
        < 1e-11
    )


def test_simplified_force_of_the_yang_persson_case():
    """The value that follows from Eqs. (20, 21); the paper reads 3.5e-4 off its figure."""
    force = LIGHT.answer(YANG_PERSSON, 3 * YANG_PERSSON.h_rms).pressure
    assert force == pytest.approx(3.64e-4, rel=1e-3)


@pytest.mark.parametrize("hurst", [0.3, 0.8, 1.0])
def test_simplified_is_the_light_load_limit_of_full(hurst):
    """Up to the four digits of 4.047 they are one: at light load the constant of (21b) follows from (19)."""
    surface = Surface(hurst, 0.1, 20.0, 1.0, 3.0)
    expected = quad(
        lambda x: math.erf(x) ** 2 * math.exp(-x * x) / x, 0, 7, epsabs=0, epsrel=1e-12
    )[0]
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
    found = contact(YANG_PERSSON, 2.5, separation=d, theory="greenwood_williamson")
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
    ratio = (
        (far.area / far.pressure)
        * 4
        / (3 * math.pi)
        / np.sqrt(s.summit_radius / s.summit_sigma)
    )
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
    vanishing = separation(
        YANG_PERSSON, math.sqrt(YANG_PERSSON.m2) * np.linspace(25.0, 28.0, 31)
    )
    assert (np.diff(vanishing) <= 0).all()
    assert vanishing[0] > 0 == vanishing[-1]
    loads = np.array([1e-290, 1e-100, 1e-10, 1.0, 10.0])
    assert (
        relative(
            FULL.answer(YANG_PERSSON, separation(YANG_PERSSON, loads)).pressure, loads
        )
        < 1e-9
    )


@pytest.mark.parametrize("hardness", [0.0264, 0.043, 0.1135])
def test_a_quick_simulation_with_a_hardness_has_a_law(hardness):
    """Its area bends where the force is that of the lightest simulated load, not at that load's separation."""
    heights = random_map(64, 0.03, 0.25, seed=0)
    surface = Surface.from_map(0.5 * heights / np.std(heights), 1.0, periodic=True)
    law = contact_law(surface, Bodies(hardness=hardness), theory="simulated")
    u = np.linspace(0.02, 0.99, 300) * surface.h_max
    found = contact(
        surface, Bodies(hardness=hardness), mean_separation=u, theory="simulated"
    )
    assert np.abs(law.pressure(u) / found.pressure - 1).max() <= law.error
    assert np.abs(law.area(u) / found.area - 1).max() <= law.error
