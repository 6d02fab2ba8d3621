"""Geometry of islands against 60 digits, and its limits."""

import dataclasses
import math

import mpmath as mp
import numpy as np
import pytest
from catalogue import random_surfaces

from generate.tables.exact_geometry import DIGITS, divisor, exact_island
from mbma_tables.islands.geometry import FIELDS, geometry
from mbma_tables.surfaces.variants import PRINTED, REPORTED, VARIANTS


def one_geometry(approach, hurst, zeta_1, variant):
    arrays = np.broadcast_arrays(*(np.asarray(value, dtype=float) for value in (approach, hurst, zeta_1)))
    return geometry(*(np.array(array) for array in arrays), variant)


@pytest.mark.parametrize("name", VARIANTS)
def test_against_sixty_digits(name):
    surfaces = random_surfaces(700, seed=len(name), hurst=(0.05, 1))
    hurst, zeta_1 = surfaces.hurst, surfaces.zeta_1
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


def test_variants_differ_by_the_density_alone():
    printed, reported = (one_geometry([0.01, 0.5, 4.0], 0.7, 300.0, r) for r in (PRINTED, REPORTED))
    for field in ("D", "D_d", "mu"):
        assert np.abs(reported[field] / printed[field] / math.pi - 1).max() <= 1e-15
    assert np.abs(reported["eta"] / printed["eta"] / math.cbrt(math.pi) - 1).max() <= 1e-15
    for field in set(FIELDS) - {"D", "D_d", "mu", "eta"}:
        assert np.array_equal(reported[field], printed[field])


def test_switches_of_a_variant():
    plain = one_geometry([0.3], 0.7, 300.0, PRINTED)
    level = one_geometry([0.3], 0.7, 300.0, dataclasses.replace(PRINTED, offset=False))
    heights = one_geometry([0.3], 0.7, 300.0, dataclasses.replace(PRINTED, summit_sigma=False))
    assert level["h_d"] == 0
    assert level["X"] * plain["sigma"] == pytest.approx(plain["X"] * plain["sigma"] + plain["h_d"], rel=1e-15, abs=0)
    m0 = plain["h_u"] ** 2 - plain["h_d"] ** 2
    assert heights["sigma"] ** 2 == pytest.approx(-m0, rel=1e-13, abs=0)
