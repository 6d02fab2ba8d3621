"""`Surface`: its properties against the spectrum itself, units, batches, bad input."""

import dataclasses
import math

import numpy as np
import pytest
import scipy.integrate
import xarray as xr

from mbma_tables import OutOfRangeError, Surface

GOOD = {"hurst": 0.8, "q0": 0.5, "q1": 100.0, "h_rms": 0.2, "h_max": 0.6}


def integral(surface, order):
    """2 pi <cos^n> integral C q^(1+n) dq over the band (Eq. 7), in log q."""
    angular = {0: 1, 2: 1 / 2, 4: 3 / 8}[order]
    found, _ = scipy.integrate.quad(
        lambda x: surface.power_spectrum(math.exp(x)) * math.exp((2 + order) * x),
        math.log(surface.q0) * (1 + 1e-15),
        math.log(surface.q1) * (1 - 1e-15),
        epsabs=0,
        epsrel=1e-12,
        limit=200,
    )
    return 2 * math.pi * angular * found


@pytest.mark.parametrize(("hurst", "zeta_1"), [(0.1, 1e5), (0.5, 3.01), (0.8, 216.0), (1.0, 1e3)])
def test_moments_are_those_of_the_power_spectrum(hurst, zeta_1):
    surface = Surface(hurst, 0.37, 0.37 * zeta_1, 0.21, 0.7)
    m0, m2, m4 = (integral(surface, order) for order in (0, 2, 4))
    # the gradient has two components
    found = (surface.h_rms**2, surface.m0, surface.m2, surface.m4, surface.rms_gradient**2)
    assert found == pytest.approx((m0, m0, m2, m4, 2 * m2), rel=1e-10, abs=0)
    assert surface.s == pytest.approx(0.21 / math.sqrt(1 - zeta_1 ** (-2 * hurst)), rel=1e-15, abs=0)
    assert surface.shape == ()
    assert all(isinstance(getattr(surface, name), float) for name in ("hurst", "q0", "h_max", "m2", "summit_density"))


def test_summits_are_nayaks():
    surface = Surface(**GOOD)
    m0, m2, m4 = (integral(surface, order) for order in (0, 2, 4))
    alpha = m0 * m4 / m2**2
    assert surface.alpha == pytest.approx(alpha, rel=1e-9, abs=0)
    assert surface.summit_density == pytest.approx(m4 / m2 / (6 * math.pi * math.sqrt(3)), rel=1e-9, abs=0)
    assert surface.summit_radius == pytest.approx(3 * math.sqrt(math.pi) / (8 * math.sqrt(m4)), rel=1e-9, abs=0)
    assert surface.summit_sigma == pytest.approx(math.sqrt((1 - 0.8968 / alpha) * m0), rel=1e-9, abs=0)


def test_power_spectrum_ends_with_the_band():
    surface = Surface(**GOOD)
    assert surface.power_spectrum([0.499, 100.1]).tolist() == [0.0, 0.0]
    assert (surface.power_spectrum([0.5, 100.0]) > 0).all()
    ratio = surface.power_spectrum(1.0) / surface.power_spectrum(2.0)
    assert ratio == pytest.approx(2**3.6, rel=1e-14, abs=0)
    batch = Surface([0.5, 0.8], 0.5, 100.0, 0.2, 0.6)
    assert batch.power_spectrum([[1.0], [2.0], [3.0]]).shape == (3, 2)


def test_a_surface_does_not_change():
    h_rms = np.array([0.1, 0.2])
    surface = Surface(0.8, 0.5, 100.0, h_rms, 0.6)
    h_rms[0] = 5.0
    assert surface.h_rms.tolist() == [0.1, 0.2]
    with pytest.raises(ValueError, match="read-only"):
        surface.h_rms[0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        surface.h_rms = 1.0


def test_prints_plain_numbers():
    assert repr(Surface(**GOOD)) == "Surface(hurst=0.8, q0=0.5, q1=100.0, h_rms=0.2, h_max=0.6)"
    assert repr(Surface(**{**GOOD, "hurst": [0.5, 0.8]})).startswith("Surface(hurst=array([0.5, 0.8]), q0=array(")
    labelled = Surface(**{**GOOD, "hurst": xr.DataArray([0.5, 0.8], dims="site")})
    assert repr(labelled).startswith("Surface(hurst=<DataArray {'site': 2}>, q0=0.5,")


@pytest.mark.parametrize(
    ("name", "value"),
    [("hurst", 0.0), ("hurst", -0.1), ("hurst", 1.01)]
    + [(name, value) for name in ("q0", "q1", "h_rms", "h_max") for value in (0.0, -1.0)],
)
def test_out_of_range(name, value):
    with pytest.raises(OutOfRangeError, match=f"^{name} must be") as caught:
        Surface(**{**GOOD, name: [GOOD[name], value]})
    assert caught.value.mask.tolist() == [False, True]


@pytest.mark.parametrize("zeta_1", [0.5, 1.0, 3.0, 1.0001e8])
def test_band_out_of_range(zeta_1):
    assert Surface(1.0, 1.0, [math.nextafter(3, 4), 1e8], 0.2, 0.6).zeta_1[1] == 1e8
    with pytest.raises(OutOfRangeError, match=r"^q1/q0 must be") as caught:
        Surface(0.8, 1.0, [200.0, zeta_1], 0.2, 0.6)
    assert caught.value.mask.tolist() == [False, True]
