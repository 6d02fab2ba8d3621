"""Band moments against 50 digits, over bands of any width; from moments to the band and back."""

import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mbma_tables import OutOfRangeError, Surface
from mbma_tables.surfaces import spectrum

MOMENTS = {"hurst": 0.7, "m0": 0.071, "m2": 0.27, "m4": 62.0, "h_max": 1.1}
HURSTS = [1e-3, 0.05, 0.3, 0.5, 0.8, math.nextafter(1, 0), 1.0]


def exact_moment(order, hurst, start, log_ratio):
    """m_n over [za, za exp(log_ratio)], from 2 H integral zeta^(n-1-2H) d zeta times the mean of cos^n."""
    with mp.workdps(50):
        h, za, width = mp.mpf(hurst), mp.mpf(start), mp.mpf(log_ratio)
        power = order - 2 * h
        angular = {0: mp.mpf(1), 2: mp.mpf(1) / 2, 4: mp.mpf(3) / 8}[order]
        growth = mp.expm1(power * width) / power if power != 0 else width
        return 2 * h * angular * za**power * growth


def relative(found, exact):
    with mp.workdps(50):
        return float(abs(mp.mpf(float(found)) / exact - 1))


@pytest.mark.parametrize("order", [0, 2, 4])
def test_band_moments(order):
    """Between any ends to 2e-14, of whole surfaces to 1e-14."""
    rng = np.random.default_rng(order)
    start = 10 ** rng.uniform(0, 7, 300)
    zeta_1 = np.tile([math.nextafter(3, 4), 3.01, 10.0, 216.0, 1e4, 1e6, 1e8], len(HURSTS))
    hurst, start, end, allowed = (
        np.append(*parts)
        for parts in (
            (rng.uniform(0.01, 1, 300), np.repeat(HURSTS, 7)),
            (start, np.ones(zeta_1.size)),
            (start * (1 + 10 ** rng.uniform(-3, 1, 300)), zeta_1),
            (np.full(300, 2e-14), np.full(zeta_1.size, 1e-14)),
        )
    )
    found = spectrum.band_moment(order, hurst, start, end)
    for k in range(found.size):
        with mp.workdps(50):
            width = mp.log(mp.mpf(float(end[k])) / mp.mpf(float(start[k])))
        assert relative(found[k], exact_moment(order, hurst[k], start[k], width)) <= allowed[k]


@pytest.mark.parametrize("hurst", HURSTS)
def test_alpha(hurst):
    for width in (1e-12, 1e-6, 1e-3, 0.01, 0.1, 1.0, 3.0, 10.0, math.log(1e8)):
        with mp.workdps(50):
            m0, m2, m4 = (exact_moment(order, hurst, 1, width) for order in (0, 2, 4))
            exact = m0 * m4 / m2**2
        assert relative(spectrum.alpha_of(hurst, width), exact) <= 2e-14
    # of a band without width
    for width in (0.0, 1e-300, 1e-15):
        assert spectrum.alpha_of(hurst, width) == pytest.approx(1.5, rel=1e-14, abs=0)


@settings(deadline=None)
@given(
    hurst=st.floats(0.05, 1),
    log_zeta=st.floats(math.log(3.01), math.log(9.9e7)),
    q0=st.floats(1e-6, 1e6),
    h_rms=st.floats(1e-6, 1e3),
)
def test_moments_give_the_surface_back(hurst, log_zeta, q0, h_rms):
    first = Surface(hurst, q0, q0 * math.exp(log_zeta), h_rms, 3 * h_rms)
    again = Surface.from_moments(hurst=hurst, m0=first.m0, m2=first.m2, m4=first.m4, h_max=first.h_max)
    # the moments come back to rounding; zeta_1 as well as alpha fixes it
    for name in ("m0", "m2", "m4"):
        assert getattr(again, name) == pytest.approx(getattr(first, name), rel=1e-12, abs=0)
    assert again.zeta_1 == pytest.approx(first.zeta_1, rel=1e-11, abs=0)
    assert again.q0 == pytest.approx(first.q0, rel=1e-11, abs=0)
    assert again.h_rms == pytest.approx(first.h_rms, rel=1e-14, abs=0)


def test_no_band_has_this_alpha():
    with pytest.raises(OutOfRangeError, match="alpha") as caught:
        Surface.from_moments(hurst=0.7, m0=1.0, m2=1.0, m4=[10.0, 1.0, 1.5, 1e12], h_max=1.0)
    assert caught.value.mask.tolist() == [False, True, True, True]
