"""The paper's cases have the numbers that it gives for them."""

import math

import pytest

from mbma_tables import InputError, Surface
from mbma_tables.surfaces.cases import CASES

# name: H, zeta_1, q0 h_rms, h_max/h_rms, to the digits known
KNOWN = {
    "yang-persson": (0.8, 216, 6 * math.pi / 1040 * 10, 3),
    "papangelo": (0.8, 64, 2 * math.pi / 100 * 5, 3),
    "challenge": (0.8, 200, 2 * math.pi / 20 * 0.762, 3.7),
    **{f"resolution-{z}": (0.7, z, 0.1, 3) for z in (125, 250, 500, 1000)},
}
ROADS = {
    "concrete": (0.7, 64.8598, 0.538132, 0.071, 0.27, 62.0, 1.1),
    "asphalt": (0.85, 143.8668, 1.734830, 0.091, 2.67, 21000.0, 1.37),
}


def test_every_case_is_checked_here():
    assert set(CASES) == {*KNOWN, *ROADS}


@pytest.mark.parametrize("name", KNOWN)
def test_given_by_its_band(name):
    surface = Surface.named(name)
    found = (surface.hurst, surface.zeta_1, surface.q0 * surface.h_rms, surface.h_max / surface.h_rms)
    assert found == pytest.approx(KNOWN[name], rel=1e-13, abs=0)


@pytest.mark.parametrize("name", ROADS)
def test_given_by_its_moments(name):
    hurst, zeta_1, q0, m0, m2, m4, h_max = ROADS[name]
    surface = Surface.named(name)
    assert (surface.hurst, surface.h_max) == (hurst, h_max)
    assert surface.zeta_1 == pytest.approx(zeta_1, abs=5e-5)
    assert surface.q0 == pytest.approx(q0, abs=5e-7)
    assert (surface.m0, surface.m2, surface.m4) == pytest.approx((m0, m2, m4), rel=1e-12, abs=0)


def test_unknown_name():
    with pytest.raises(InputError, match="no surface is named 'moon'; there are yang-persson"):
        Surface.named("moon")
