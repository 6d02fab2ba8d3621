"""Geometry of islands and bands of four numbers at fifty digits and more, and their limits."""

import dataclasses
import math

import mpmath
import mpmath as mp
import numpy as np
import pytest
from catalogue import random_surfaces

from generate.exact_geometry import DIGITS, divisor, exact_island
from mbma_tables import OutOfRangeError, Surface, greenwood_tripp, island
from mbma_tables.islands.geometry import FIELDS, geometry
from mbma_tables.islands.variants import PRINTED, REPORTED, VARIANTS
from mbma_tables.surfaces.spectrum import BROADENING
from mbma_tables.tables.island4d import band_fields


def one_geometry(approach, hurst, zeta_1, variant):
    arrays = np.broadcast_arrays(
        *(np.asarray(value, dtype=float) for value in (approach, hurst, zeta_1))
    )
    return geometry(*(np.array(array) for array in arrays), variant)


@pytest.mark.parametrize("name", VARIANTS)
def test_against_sixty_digits(name):
    surfaces = random_surfaces(700, seed=len(name), hurst=(0.05, 1))
    hurst = surfaces.hurst
    zeta_1 = surfaces.zeta_1
    hurst = np.where(np.arange(700) % 23 == 5, math.nextafter(1, 0), hurst)
    approach = 10 ** np.random.default_rng(len(name)).uniform(-12, 1, 700)
    found = one_geometry(approach, hurst, zeta_1, VARIANTS[name])
    worst = dict.fromkeys(FIELDS, 0.0)
    for k, arguments in enumerate(zip(approach, hurst, zeta_1, strict=True)):
        exact = exact_island(*arguments, divisor(name))
        with mp.workdps(DIGITS):
            for field in FIELDS:
                scale = max(1, abs(exact[field])) if field == "X" else abs(exact[field])
                error = float(abs(mp.mpf(float(found[field][k])) - exact[field]) / scale)
                worst[field] = max(worst[field], error)
    assert max(worst.values()) <= 1e-12, worst


def test_switches_of_a_variant():
    plain = one_geometry([0.3], 0.7, 300.0, PRINTED)
    level = one_geometry([0.3], 0.7, 300.0, dataclasses.replace(PRINTED, offset=False))
    heights = one_geometry(
        [0.3], 0.7, 300.0, dataclasses.replace(PRINTED, summit_sigma=False)
    )
    assert level["h_d"] == 0
    assert level["X"] * plain["sigma"] == pytest.approx(
        plain["X"] * plain["sigma"] + plain["h_d"], rel=1e-15, abs=0
    )
    m0 = plain["h_u"] ** 2 - plain["h_d"] ** 2
    assert heights["sigma"] ** 2 == pytest.approx(-m0, rel=1e-13, abs=0)


def exact(spread, sphere, hurst, summits):
    """What the core answers, by moments as Eq. (7) has them over [1, zeta_d] and [zeta_d, zeta_u], at zeta_d."""
    spread, sphere, H = (mpmath.mpf(x) for x in (spread, sphere, hurst))
    p = 4 - 2 * H
    zeta_d = mpmath.mpf(1.25) * sphere ** (-1 / p)
    zeta_u = zeta_d * (1 + spread)

    def moment(order, low, high):
        power = order - 2 * H
        share = {0: 2, 2: 1, 4: mpmath.mpf(3) / 4}[order]
        return (
            share
            * H
            * (
                mpmath.log(high / low)
                if power == 0
                else (high**power - low**power) / power
            )
        )

    m0, m2, m4 = (moment(order, zeta_d, zeta_u) for order in (0, 2, 4))
    D = m4 / m2 / REPORTED.density_divisor
    sigma = mpmath.sqrt(
        (1 - (mpmath.mpf(BROADENING) * m2**2 / (m0 * m4) if summits else 0)) * m0
    )
    R_d, R_u = (
        3 * mpmath.sqrt(mpmath.pi) / 8 / mpmath.sqrt(moment(4, 1, zeta))
        for zeta in (zeta_d, zeta_u)
    )
    mu = 8 * D * sigma * mpmath.sqrt(2 * R_u * R_d) / 3
    force = sigma * mpmath.sqrt(2 * R_d * sigma)
    area = 2 * mpmath.pi * D * R_u * R_d * sigma**2
    return mu, sigma * zeta_d**H, force * zeta_d ** (1 + H), area * zeta_d**2


@pytest.mark.parametrize("summits", [False, True])
def test_bands_at_fifty_digits(summits):
    rng = np.random.default_rng(7)
    given = np.stack(
        [
            10 ** rng.uniform(-15, 4, 60),
            10 ** rng.uniform(-9, 0, 60),
            rng.uniform(0.05, 1, 60),
        ]
    )
    given[2, :10] = 1.0
    out = band_fields(*given, dataclasses.replace(REPORTED, summit_sigma=summits))
    with mpmath.workdps(60):
        for row, found in zip(given.T, out.T, strict=True):
            right = [float(x) for x in exact(*row, summits)]
            np.testing.assert_allclose(found, right, rtol=5e-15)


def test_spheres_without_end_are_finite():
    out = band_fields(np.array([1e-3, 1.0]), np.zeros(2), np.array([0.8, 1.0]), REPORTED)
    near = band_fields(
        np.array([1e-3, 1.0]), np.full(2, 1e-30), np.array([0.8, 1.0]), REPORTED
    )
    np.testing.assert_allclose(out, near, rtol=1e-15)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, -1.0, 1e308, -1e308])
@pytest.mark.parametrize("position", range(3))
def test_what_is_no_band_is_nan(bad, position):
    given = [np.full(3, x) for x in (0.5, 0.3, 0.8)]
    given[position][1] = bad
    out = band_fields(*given, REPORTED)
    assert np.isnan(out[:, 1]).all()
    assert np.isfinite(out[:, ::2]).all()


@pytest.fixture(scope="module")
def surface():
    return Surface(0.8, 0.18125, 0.18125 * 216, 1.3, 3.9)


@pytest.mark.parametrize("variant", ["reported", "printed"])
def test_units(surface, variant):
    for approach in (1e-9, 0.02, 0.7, 8.0):
        found = island(surface, approach * surface.h_rms, variant=variant)
        exact = exact_island(approach, surface.hurst, surface.zeta_1, divisor(variant))
        # the unit of height and of length that the paper's geometry is in
        s = surface.s
        length = 1 / surface.q0
        units = {
            "R_d": length**2 / s,
            "R_u": length**2 / s,
            "D": length**-2,
            "sigma": s,
            "h_d": s,
        }
        for name in ("zeta_d", "zeta_u", "eta", "X", "mu", *units):
            known = float(exact[name]) * units.get(name, 1.0)
            assert getattr(found, name) == pytest.approx(known, rel=2e-12, abs=0), name


@pytest.mark.parametrize("variant", ["reported", "printed"])
def test_force_and_area(surface, variant):
    delta = np.array([1e-6, 0.1, 1.0, 6.0])
    found = island(surface, delta, variant=variant, E_star=7.0)
    solved = greenwood_tripp.solve(found.X, found.mu, rtol=1e-12)
    L = np.sqrt(2 * found.R_d * found.sigma)
    force = 7.0 * found.sigma * L * solved.phi_F
    area = found.eta * math.pi * found.D * found.R_u * found.sigma * L**2 * solved.phi_A
    assert np.abs(found.force / force - 1).max() <= 1e-9
    assert np.abs(found.area / area - 1).max() <= 1e-9
    assert (np.abs(found.force / force - 1) <= found.error).all()
    assert found.variant == variant
    assert found.island_model == "universal"


@pytest.mark.parametrize("delta", [0.0, -1.0, [1.0, -0.5]])
def test_no_approach(surface, delta):
    with pytest.raises(OutOfRangeError, match="delta must be positive") as caught:
        island(surface, delta)
    assert caught.value.mask.shape == np.shape(delta)
    assert caught.value.mask.sum() == 1


def test_a_band_that_ends_at_the_floor_of_zeta_u_is_refused():
    own = dataclasses.replace(PRINTED, name="own", floor_u=3.5)
    with pytest.raises(OutOfRangeError, match=r"q1/q0 must be greater than 3\.5"):
        island(Surface(0.8, 1.0, 3.5, 1.0, 3.0), 1.0, variant=own)
    assert (
        island(
            Surface(0.8, 1.0, math.nextafter(3.5, 4), 1.0, 3.0), 1.0, variant=own
        ).force
        > 0
    )


@pytest.mark.parametrize("approach", [1e-150, 1e-160, 1e-200, 1e-300])
def test_vanishing_approach_is_answered_or_refused(surface, approach):
    room = surface.h_rms / surface.s
    limit = (room - 4 / 9) / (
        math.sqrt(1 - 0.8968 / 1.5) * math.sqrt(16 / 81 - room**2 / 441)
    )
    try:
        found = island(surface, approach * surface.h_rms)
    except OutOfRangeError:
        return
    assert abs(found.X / limit - 1) <= 1e-12
