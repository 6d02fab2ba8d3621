"""Theories and their laws: against other ways to the same numbers, monotone, inverted, in every form."""

import functools
import math

import numpy as np
import pytest
from helpers import Springs, refusals, with_slopes
from scipy.integrate import quad

from mbma_tables import ConvergenceError, InputError, OutOfRangeError, Surface, contact_law
from mbma_tables.theories import THEORIES, GreenwoodWilliamson, Mbma, Persson, get_theory

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
    "theory", [name for name in THEORIES if name != "mbma"] + OBJECTS, ids=lambda t: getattr(t, "name", t)
)


@functools.cache
def law_of(theory, surface=SURFACE, rtol=1e-8):
    return contact_law(surface, rtol=rtol, E_star=MODULUS, theory=theory)


def places(law, seed, count=400):
    """Mean separations of the law, most of them between 1% and 99% of h_max, some near its ends."""
    low = (law.h_max + law.lowest) / 2
    high = law.h_max if law.highest == math.inf else min(2 * law.h_max, (law.h_max + law.highest) / 2)
    u = np.random.default_rng(seed).uniform(max(low, 0.01 * law.h_max), high, count)
    return np.sort(np.append(u, [low * 1.001 + 1e-4 * law.h_max, high - 1e-5 * law.h_max]))


@each
@pytest.mark.parametrize("surface", [SURFACE, STEEP, FINE], ids=["usual", "steep", "fine"])
@pytest.mark.parametrize("rtol", [1e-4, 1e-8])
def test_within_its_bound_of_the_theory(theory, surface, rtol):
    law, chosen = law_of(theory, surface, rtol), get_theory(theory)
    u = places(law, 1)
    true = chosen.answer(surface, u)
    own = np.nan_to_num(true.error).max()
    assert law.error <= max(rtol, 0.1 * own) + own + 1e-15
    for found, wanted in ((law.pressure(u) / MODULUS, true.pressure), (law.area(u), true.area)):
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
        assert slope(separation=d) == pytest.approx(
            (value(separation=d - step) - value(separation=d + step)) / (2 * step), rel=1e-6
        )
    end = law.h_max if law.highest == math.inf else law.highest
    for gap, energy in zip(d, law.energy(separation=d), strict=True):
        work = quad(lambda d: law.pressure(separation=d), gap, min(end, gap + 60), epsabs=0, epsrel=1e-9, limit=400)[0]
        assert energy == pytest.approx(work / 2, rel=1e-6)
    # over the mean separation, which moves half as far
    u = (law.h_max + d) / 2
    assert law.energy(separation=d) == pytest.approx(MODULUS * get_theory(theory).energy(SURFACE, u), rel=1e-6)


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
    assert law.separation(pressure=0.0) == law.h_max
    assert law.pressure(separation=[law.h_max, 2 * law.h_max]).tolist() == [0, 0]
    assert law.energy(separation=law.h_max) == law.stiffness(separation=law.h_max) == 0
    tiny = law.separation(pressure=1e-12)
    assert law.pressure(separation=tiny) == pytest.approx(1e-12, rel=1e-5)
    endless = contact_law(SURFACE, theory="persson")
    assert endless.pressure(2 * endless.h_max) > 0
    for asked in ({"pressure": 0.0}, {"pressure": 1e-60}, {"area": 1.0}, {"pressure": -1.0}):
        with pytest.raises(OutOfRangeError):
            endless.separation(**asked)
    with pytest.raises(OutOfRangeError, match="where the theory ends"):
        endless.pressure(0.0)
    with pytest.raises(OutOfRangeError, match="where the law ends"):
        endless.pressure(100 * endless.h_max)


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
    law = contact_law(surface)
    assert law.theory == "mbma"
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
    lambda asked: contact_law(**({"surface": SURFACE} | asked)),
    ({"theory": "persson", "island_model": "exact"}, "island_model: options of theory 'mbma'"),
    ({"theory": "persson", "rtol": 1e-10}, "rtol"),
    ({"theory": "persson", "surface": Surface([0.5, 0.8], 0.2, 40.0, 1.0, 3.0)}, "one surface, got a batch"),
    ({"theory": Negative()}, "no positive force and area"),
    ({"theory": Noisy()}, "theory 'cones': the law needs more than .* use a larger rtol"),
    error=(InputError, ConvergenceError),
)


def test_noise_is_met_by_a_larger_tolerance():
    assert contact_law(SURFACE, rtol=1e-3, theory=Noisy()).error < 2e-3


BATCH = Surface(hurst=[0.3, 0.7, 0.9], q0=1.0, q1=[1000.0, 60.0, 216.0], h_rms=1.0, h_max=[3.0, 3.0, 3.5])


def test_mbma_ends_where_its_force_turns():
    low = Mbma().interval(BATCH)[0]
    law = contact_law(Surface(0.3, 1.0, 1000.0, 1.0, 3.0))
    assert law.turning_point is not None
    assert low[0] == pytest.approx((3.0 + law.turning_point) / 2, abs=1e-5)
    assert (low[1:] == 0).all()


def test_a_users_own_object_is_a_theory():
    theory = get_theory(Springs())
    u = np.array([0.5, 2.0])
    found = theory.answer(SURFACE, u)
    assert found.stiffness == pytest.approx(3 / SURFACE.h_rms * found.pressure, rel=1e-8)
    assert theory.mean_separation_at(SURFACE, "pressure", found.pressure) == pytest.approx(u, rel=1e-10)
    work = (found.pressure - np.exp(-3 * SURFACE.h_max / SURFACE.h_rms)) * SURFACE.h_rms / 3
    assert theory.energy(SURFACE, u) == pytest.approx(work, rel=1e-8)


@pytest.mark.parametrize("wrong", ["perssons", 3, None, Springs, object()])
def test_what_is_no_theory_is_refused(wrong):
    with pytest.raises(InputError, match="theory must be one of"):
        get_theory(wrong)
