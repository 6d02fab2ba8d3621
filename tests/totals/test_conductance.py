"""Conductivities and conductance: closed values and refusals."""

import math

import numpy as np
import pytest

from mbma_tables import OutOfRangeError, Surface
from mbma_tables.totals.conductance import conductance, cooper_mikic_yovanovich, mean_conductivity, mikic


def test_mean_conductivity_is_harmonic_and_conductance_is_per_stiffness():
    # a body that conducts without limit leaves twice the other
    for given, expected in (((50.0, 200.0), 80.0), ((3.0, 3.0), 3.0), ((7.0, 1e300), 14.0), ((1e300, 7.0), 14.0)):
        found = mean_conductivity(*given)
        assert found == pytest.approx(expected, rel=1e-15, abs=0)
        assert np.shape(found) == ()
    found = mean_conductivity([[1.0], [2.0]], [1.0, 4.0, 6.0])
    np.testing.assert_allclose(found, [[1, 1.6, 12 / 7], [4 / 3, 8 / 3, 3]], rtol=1e-15)
    assert conductance(6.0, 5.0, 4.0) == pytest.approx(7.5, rel=1e-15, abs=0)
    assert np.shape(conductance(6.0, 5.0, 4.0)) == ()
    found = conductance([0.0, 1.0, 3.0], [[2.0], [8.0]], 4.0)
    np.testing.assert_allclose(found, [[0, 0.5, 1.5], [0, 2, 6]], rtol=1e-15)


@pytest.mark.parametrize("bad", [0.0, -2.0, math.nan, [1.0, 0.0], [1.0, -1e-300]])
def test_conductivities_and_moduli_are_positive(bad):
    for call, name in (
        (lambda: mean_conductivity(bad, 1.0), "k1"),
        (lambda: mean_conductivity(1.0, bad), "k2"),
        (lambda: conductance(1.0, bad, 1.0), "k_s"),
        (lambda: conductance(1.0, 1.0, bad), "E_star"),
    ):
        with pytest.raises(OutOfRangeError, match=f"^{name} must be") as caught:
            call()
        assert caught.value.mask.shape == np.shape(bad)
        assert caught.value.mask.sum() == 1


def test_correlations_follow_the_models_they_were_fitted_to():
    # Gaussian heights cut at a multiple of sigma: spots of the truncated area, elastic ones of half of it
    cut = np.linspace(2, 4.75, 200)
    area = np.array([math.erfc(c / math.sqrt(2)) / 2 for c in cut])
    spots = np.exp(-(cut**2) / 2) / (2 * math.sqrt(2 * math.pi))
    joint = Surface(hurst=0.8, q0=6e3, q1=6e5, h_rms=1e-6, h_max=3.5e-6)
    slope = math.sqrt(2 * joint.m2 / math.pi)
    plastic = slope / joint.h_rms * spots / (1 - np.sqrt(area)) ** 1.5
    found = cooper_mikic_yovanovich(joint, area * 1e9, 1.0, 1e11, 1e9)
    np.testing.assert_allclose(found, plastic, rtol=0.016)
    # the older power law leaves the model at small pressures
    assert (1.45 * area**0.985 * slope / joint.h_rms / plastic).min() == pytest.approx(0.72, abs=0.005)
    cut, area, spots = cut[area > 2e-6], area[area > 2e-6], spots[area > 2e-6]
    elastic = slope / joint.h_rms * spots / math.sqrt(2) / (1 - np.sqrt(area / 2)) ** 1.5
    found = mikic(joint, area / 2 * slope * 1e11 / math.sqrt(2), 1.0, 1e11)
    np.testing.assert_allclose(found, elastic, rtol=0.043)
