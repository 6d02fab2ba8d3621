"""Areal parameters against closed forms of their definitions."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ndtri
from scipy.stats import norm

from generate.machined.makers import Part, heights
from mbma_tables import InputError
from mbma_tables.surfaces.areal import areal_parameters, core

SHARES = (np.arange(200_000) + 0.5) / 200_000


def gaussian_core():
    """Of the standard normal distribution: the line over the middle 40%, by integrals of its quantiles."""
    moment = quad(lambda p: (p - 0.5) * -ndtri(p), 0.3, 0.7)[0]
    slope = moment / (2 * 0.2**3 / 3)
    half = -slope / 2
    share = norm.sf(half)
    return 2 * half, 2 * (norm.pdf(half) / share - half), share


def test_gaussian_heights():
    found, (Sk, Spk, Smr1) = core(ndtri(SHARES)), gaussian_core()
    assert found["Sk"] == pytest.approx(Sk, rel=1e-3)
    assert found["Spk"] == pytest.approx(Spk, rel=2e-3)
    assert found["Svk"] == pytest.approx(Spk, rel=2e-3)
    assert (found["Smr1"], found["Smr2"]) == (pytest.approx(Smr1, abs=1e-3), pytest.approx(1 - Smr1, abs=1e-3))


def test_even_heights_are_all_core():
    found = core(SHARES * 3.0)
    assert found["Sk"] == pytest.approx(3.0, rel=1e-4)
    assert max(found["Spk"], found["Svk"]) < 1e-4


def test_a_plateau_with_straight_valleys():
    # ratio 0 to 0.8 from 1 to 0.9, then straight down to -3: the curve is two lines
    curve = np.where(SHARES < 0.8, 1 - SHARES / 8, 0.9 - (SHARES - 0.8) * 19.5)
    found = core(curve)
    assert found["Sk"] == pytest.approx(0.125, rel=1e-3)
    assert found["Smr2"] == pytest.approx(0.8, abs=2e-3)
    # the triangle between both lines is one already
    lower = 0.875
    assert found["Svk"] == pytest.approx(2 * np.maximum(lower - curve, 0).mean() / 0.2, rel=0.01)
    assert found["Spk"] < 1e-3


def test_moments_gradient_and_lay():
    x, y = np.meshgrid(np.arange(256.0), 2.0 * np.arange(128), indexing="ij")
    turn = np.radians(30)
    q = 2 * np.pi / 64
    # waves across a lay at 30 degrees, phases over whole periods and more
    values = 0.3 * np.sin(q * (-x * np.sin(turn) + y * np.cos(turn)))
    found = areal_parameters(values, (1.0, 2.0))
    assert found["lay"] == pytest.approx(30, abs=0.5)
    assert found["Sq"] == pytest.approx(0.3 / np.sqrt(2), rel=0.02)
    assert found["Sa"] == pytest.approx(0.3 * 2 / np.pi, rel=0.02)
    assert found["Sku"] == pytest.approx(1.5, rel=0.02)
    assert found["Sdq"] == pytest.approx(0.3 * q / np.sqrt(2), rel=0.02)
    assert found["Sz"] == pytest.approx(0.6, rel=0.01)
    assert found["Sz"] == found["Sp"] + found["Sv"]


def test_honed_surfaces_have_valleys():
    found = areal_parameters(heights(Part("honed", 1)), (1.0, 1.0))
    assert found["Ssk"] < -1
    assert found["Svk"] > 3 * found["Spk"]


def test_what_is_no_map():
    for wrong in (np.zeros((4, 4)), np.ones(5), [[1.0, np.nan], [0.0, 1.0]]):
        with pytest.raises(InputError):
            areal_parameters(wrong, (1.0, 1.0))
