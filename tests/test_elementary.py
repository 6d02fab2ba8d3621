"""Elementary functions of compiled loops against fifty digits."""

import mpmath
import numpy as np
import pytest

from mbma_tables import elementary

CASES = {
    "exp": np.concatenate([np.linspace(-700, 700, 2001), np.linspace(-1, 1, 501)]),
    "expm1": np.concatenate([np.linspace(-700, 700, 2001), np.linspace(-2, 2, 1001), np.geomspace(1e-300, 1, 300)]),
    "log": np.concatenate([np.geomspace(2.3e-308, 1e308, 2001), np.linspace(0.5, 2, 1001), 1 + np.geomspace(1e-15, 1)]),
    "log1p": np.concatenate(
        [np.geomspace(1e-300, 1e300, 2001), np.linspace(-0.999, 3, 1001), -np.geomspace(1e-300, 0.9)]
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_within_1e_15(name):
    function, exact = getattr(elementary, name), getattr(mpmath, name)
    with mpmath.workdps(50):
        for x in CASES[name].tolist():
            found, right = function(x), exact(mpmath.mpf(x))
            assert abs(found - right) <= 1e-15 * abs(right), x


def test_exponentials_beyond_their_range_are_those_at_its_end():
    assert elementary.exp(-1e300) == elementary.exp(-700.0) > 0
    assert elementary.exp(1e300) == elementary.exp(700.0) < np.inf
    assert elementary.expm1(-1e300) == -1
