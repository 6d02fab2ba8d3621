"""Geometry of islands against 60 digits, and its limits."""

import dataclasses
import math

import mpmath as mp
import numpy as np
import pytest
from catalogue import random_surfaces

from generate.tables.exact_geometry import DIGITS, divisor, exact_island
from mbma_tables.islands.geometry import FIELDS, geometry
from mbma_tables.surfaces.readings import PRINTED, READINGS, REPORTED


def one_geometry(approach, hurst, zeta_1, reading):
    arrays = np.broadcast_arrays(*(np.asarray(value, dtype=float) for value in (approach, hurst, zeta_1)))
    return geometry(*(np.array(array) for array in arrays), reading)


@pytest.mark.parametrize("name", READINGS)
def test_against_sixty_digits(name):
    surfaces = random_surfaces(700, seed=len(name), hurst=(0.05, 1))
    hurst, zeta_1 = surfaces.hurst, surfaces.zeta_1
    hurst = np.where(np.arange(700) % 23 == 5, math.nextafter(1, 0), hurst)
    approach = 10 ** np.random.default_rng(len(name)).uniform(-12, 1, 700)
    found = one_geometry(approach, hurst, zeta_1, READINGS[name])
    worst = dict.fromkeys(FIELDS, 0.0)
    for k, arguments in enumerate(zip(approach, hurst, zeta_1, strict=True)):
        exact = exact_island(*arguments, divisor(name))
        with mp.workdps(DIGITS):
            for field in FIELDS:
                scale = max(1, abs(exact[field])) if field == "X" else abs(exact[field])
                error = float(abs(mp.mpf(float(found[field][k])) - exact[field]) / scale)
                worst[field] = max(worst[field], error)
    assert max(worst.values()) <= 1e-12, worst


@pytest.mark.parametrize("hurst", [0.05, 0.3, 0.8, 1.0])
@pytest.mark.parametrize("zeta_1", [3.01, 216.0, 1e8])
def test_shallow_limit(hurst, zeta_1):
    # both ends run into zeta_1: X tends to a constant, mu falls like delta
    room = math.sqrt(-math.expm1(-2 * hurst * math.log(zeta_1)))
    limit = (room - 4 / 9) / (math.sqrt(1 - 0.8968 / 1.5) * math.sqrt(16 / 81 - room**2 / 441))
    found = one_geometry(np.array([1e-150, 1e-100, 1e-50]), hurst, zeta_1, PRINTED)
    assert np.abs(found["X"] / limit - 1).max() <= 1e-13
    assert np.abs(found["mu"] / found["mu"][0] / [1, 1e50, 1e100] - 1).max() <= 1e-13
    assert np.abs(found["eta"] / found["eta"][0] / np.cbrt([1, 1e50, 1e100]) - 1).max() <= 1e-13


def test_floors():
    found = one_geometry([1.0, 5.0, 30.0], 0.8, 216.0, PRINTED)
    assert found["zeta_d"].tolist()[1:] == [1.5, 1.5]
    assert found["zeta_u"].tolist()[2] == 3.0
    assert found["zeta_d"][0] > 1.5
    assert found["zeta_u"][1] > 3.0


def test_readings_differ_by_the_density_alone():
    printed, reported = (one_geometry([0.01, 0.5, 4.0], 0.7, 300.0, r) for r in (PRINTED, REPORTED))
    for field in ("D", "D_d", "mu"):
        assert np.abs(reported[field] / printed[field] / math.pi - 1).max() <= 1e-15
    assert np.abs(reported["eta"] / printed["eta"] / math.cbrt(math.pi) - 1).max() <= 1e-15
    for field in set(FIELDS) - {"D", "D_d", "mu", "eta"}:
        assert np.array_equal(reported[field], printed[field])


def test_switches_of_a_reading():
    plain = one_geometry([0.3], 0.7, 300.0, PRINTED)
    level = one_geometry([0.3], 0.7, 300.0, dataclasses.replace(PRINTED, offset=False))
    heights = one_geometry([0.3], 0.7, 300.0, dataclasses.replace(PRINTED, summit_sigma=False))
    assert level["h_d"] == 0
    assert level["X"] * plain["sigma"] == pytest.approx(plain["X"] * plain["sigma"] + plain["h_d"], rel=1e-15, abs=0)
    m0 = plain["h_u"] ** 2 - plain["h_d"] ** 2
    assert heights["sigma"] ** 2 == pytest.approx(-m0, rel=1e-13, abs=0)
