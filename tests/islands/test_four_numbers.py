"""Bands of the paper's four numbers against plain formulas at fifty digits, and from numbers that are none."""

import dataclasses

import mpmath
import numpy as np
import pytest

from mbma_tables.islands.four_numbers import band_fields
from mbma_tables.surfaces.spectrum import BROADENING
from mbma_tables.surfaces.variants import REPORTED


def exact(spread, sphere, hurst, summits):
    """What the core answers, by moments as Eq. (7) has them over [1, zeta_d] and [zeta_d, zeta_u], at zeta_d."""
    spread, sphere, H = (mpmath.mpf(x) for x in (spread, sphere, hurst))
    p = 4 - 2 * H
    zeta_d = mpmath.mpf(1.25) * sphere ** (-1 / p)
    zeta_u = zeta_d * (1 + spread)

    def moment(order, low, high):
        power = order - 2 * H
        share = {0: 2, 2: 1, 4: mpmath.mpf(3) / 4}[order]
        return share * H * (mpmath.log(high / low) if power == 0 else (high**power - low**power) / power)

    m0, m2, m4 = (moment(order, zeta_d, zeta_u) for order in (0, 2, 4))
    D = m4 / m2 / REPORTED.density_divisor
    sigma = mpmath.sqrt((1 - (mpmath.mpf(BROADENING) * m2**2 / (m0 * m4) if summits else 0)) * m0)
    R_d, R_u = (3 * mpmath.sqrt(mpmath.pi) / 8 / mpmath.sqrt(moment(4, 1, zeta)) for zeta in (zeta_d, zeta_u))
    mu = 8 * D * sigma * mpmath.sqrt(2 * R_u * R_d) / 3
    force, area = sigma * mpmath.sqrt(2 * R_d * sigma), 2 * mpmath.pi * D * R_u * R_d * sigma**2
    return mu, sigma * zeta_d**H, force * zeta_d ** (1 + H), area * zeta_d**2


@pytest.mark.parametrize("summits", [False, True])
def test_bands_at_fifty_digits(summits):
    rng = np.random.default_rng(7)
    given = np.stack([10 ** rng.uniform(-15, 4, 60), 10 ** rng.uniform(-9, 0, 60), rng.uniform(0.05, 1, 60)])
    given[2, :10] = 1.0
    out = band_fields(*given, dataclasses.replace(REPORTED, summit_sigma=summits))
    with mpmath.workdps(60):
        for row, found in zip(given.T, out.T, strict=True):
            right = [float(x) for x in exact(*row, summits)]
            np.testing.assert_allclose(found, right, rtol=5e-15)


def test_spheres_without_end_are_finite():
    out = band_fields(np.array([1e-3, 1.0]), np.zeros(2), np.array([0.8, 1.0]), REPORTED)
    near = band_fields(np.array([1e-3, 1.0]), np.full(2, 1e-30), np.array([0.8, 1.0]), REPORTED)
    np.testing.assert_allclose(out, near, rtol=1e-15)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, -1.0, 1e308, -1e308])
@pytest.mark.parametrize("position", range(3))
def test_what_is_no_band_is_nan(bad, position):
    given = [np.full(3, x) for x in (0.5, 0.3, 0.8)]
    given[position][1] = bad
    out = band_fields(*given, REPORTED)
    assert np.isnan(out[:, 1]).all()
    assert np.isfinite(out[:, ::2]).all()
