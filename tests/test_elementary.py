"""Elementary functions of the core's loops against fifty digits."""

import mpmath
import numpy as np
import pytest

from mbma_tables.core import core

CASES = {
    "exp": np.concatenate([np.linspace(-700, 700, 2001), np.linspace(-1, 1, 501)]),
    "expm1": np.concatenate([np.linspace(-700, 700, 2001), np.linspace(-2, 2, 1001), np.geomspace(1e-300, 1, 300)]),
    "log": np.concatenate([np.geomspace(2.3e-308, 1e308, 2001), np.linspace(0.5, 2, 1001), 1 + np.geomspace(1e-15, 1)]),
    "log1p": np.concatenate(
        [np.geomspace(1e-300, 1e300, 2001), np.linspace(-0.999, 3, 1001), -np.geomspace(1e-300, 0.9)]
    ),
}


def of_core(name, x):
    """One of the core's elementary functions of an array."""
    values = np.asarray(x, float)
    out = np.empty_like(values)
    core.elementary(list(CASES).index(name), values, out)
    return out


@pytest.mark.parametrize("name", CASES)
def test_within_1e_15(name):
    exact = getattr(mpmath, name)
    with mpmath.workdps(50):
        for x, found in zip(CASES[name].tolist(), of_core(name, CASES[name]).tolist(), strict=True):
            right = exact(mpmath.mpf(x))
            assert abs(found - right) <= 1e-15 * abs(right), x


def test_exponentials_beyond_their_range_are_those_at_its_end():
    low, least, high, most, none = of_core("exp", [-1e300, -700.0, 1e300, 700.0, np.nan])
    assert low == least > 0
    assert high == most < np.inf
    # NaN is not passed on: an index that is made from it stays inside
    assert none == least
    assert of_core("expm1", [-1e300]) == -1
