"""From moments to the band and back."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mbma_tables import InputError, OutOfRangeError, Surface

GOOD = {"hurst": 0.7, "m0": 0.071, "m2": 0.27, "m4": 62.0, "h_max": 1.1}


@settings(deadline=None)
@given(
    hurst=st.floats(0.05, 1),
    log_zeta=st.floats(math.log(3.01), math.log(9.9e7)),
    q0=st.floats(1e-6, 1e6),
    h_rms=st.floats(1e-6, 1e3),
)
def test_round_trip(hurst, log_zeta, q0, h_rms):
    first = Surface(hurst, q0, q0 * math.exp(log_zeta), h_rms, 3 * h_rms)
    again = Surface.from_moments(hurst=hurst, m0=first.m0, m2=first.m2, m4=first.m4, h_max=first.h_max)
    # the moments come back to rounding; zeta_1 as well as alpha fixes it
    for name in ("m0", "m2", "m4"):
        assert getattr(again, name) == pytest.approx(getattr(first, name), rel=1e-12, abs=0)
    assert again.zeta_1 == pytest.approx(first.zeta_1, rel=1e-11, abs=0)
    assert again.q0 == pytest.approx(first.q0, rel=1e-11, abs=0)
    assert again.h_rms == pytest.approx(first.h_rms, rel=1e-14, abs=0)


def test_batches_equal_loops():
    hurst, m4 = np.array([[0.6], [0.7]]), np.array([40.0, 62.0, 90.0])
    batch = Surface.from_moments(hurst=hurst, m0=0.071, m2=0.27, m4=m4, h_max=1.1)
    assert batch.shape == (2, 3)
    for i in range(2):
        for j in range(3):
            one = Surface.from_moments(**{**GOOD, "hurst": hurst[i, 0], "m4": m4[j]})
            assert batch.q0[i, j] == one.q0
            assert batch.q1[i, j] == one.q1


@pytest.mark.parametrize("alpha", [1.0, 1.5, 1e12])
def test_no_band_has_this_alpha(alpha):
    with pytest.raises(OutOfRangeError, match="alpha"):
        Surface.from_moments(hurst=0.7, m0=1.0, m2=1.0, m4=alpha, h_max=1.0)


def test_the_mask_has_the_shape_of_the_arguments():
    with pytest.raises(OutOfRangeError, match="alpha") as caught:
        Surface.from_moments(hurst=0.7, m0=1.0, m2=1.0, m4=[10.0, 1.0, 20.0], h_max=1.0)
    assert caught.value.mask.tolist() == [False, True, False]


@pytest.mark.parametrize("name", GOOD)
@pytest.mark.parametrize("value", [math.nan, math.inf, [], "rough", -1.0, 0.0])
def test_bad_argument(name, value):
    with pytest.raises(InputError, match=name):
        Surface.from_moments(**{**GOOD, name: value})


def test_shapes_that_do_not_broadcast():
    with pytest.raises(InputError, match="do not broadcast"):
        Surface.from_moments(**{**GOOD, "m0": [0.07, 0.08], "m2": [0.2, 0.3, 0.4]})
