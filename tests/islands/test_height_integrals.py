"""F_n against 40-digit parabolic cylinder functions, and where scipy's own fail."""

import math
import warnings

import mpmath as mp
import numpy as np
import pytest

from mbma_tables import InputError
from mbma_tables.islands.height_integrals import ORDERS, height_integral

EDGES = [-8.0, -6.0, -4.0, -2.0, 0.0, 1.0, 4.0]  # where the pieces meet


def reference(n: float, x: float) -> mp.mpf:
    with mp.workdps(40):
        order, at = mp.mpf(n), mp.mpf(float(x))
        scale = mp.gamma(order + 1) / mp.sqrt(2 * mp.pi)
        return scale * mp.exp(-at * at / 4) * mp.pcfu(order + mp.mpf(1) / 2, at)


def relative_errors(n: float, x: np.ndarray, values: np.ndarray) -> np.ndarray:
    with mp.workdps(40):
        return np.array([float(abs(mp.mpf(float(v)) / reference(n, a) - 1)) for a, v in zip(x, values, strict=True)])


def test_reference_is_the_integral():
    for n, x in ((0.5, -3.0), (1.5, 0.7), (2.5, 6.0)):
        with mp.workdps(30):
            direct = mp.quad(
                lambda z, n=n, x=x: (z - x) ** n * mp.npdf(z), [x, x + 1, x + 3, x + 8, x + 20], maxdegree=10
            )
            assert abs(direct / reference(n, x) - 1) < 1e-15


@pytest.mark.parametrize("n", ORDERS)
def test_accuracy_and_independence_of_neighbours(n):
    rng = np.random.default_rng(round(2 * n))
    edges = [*EDGES, *np.nextafter(EDGES, -np.inf), *np.nextafter(EDGES, np.inf)]
    near = np.concatenate([-(10 ** rng.uniform(0, 6, 120)), rng.uniform(-9, 10, 250), edges, [-1e6, 10.0]])
    for x, allowed in ((near, 1e-13), (np.append(rng.uniform(10, 37, 150), 37.0), 5e-13)):
        found = height_integral(n, x)
        assert relative_errors(n, x, found).max() <= allowed
        np.testing.assert_array_equal(found, [height_integral(n, at) for at in x])
        np.testing.assert_array_equal(found[1::3], height_integral(n, x[1::3]))


@pytest.mark.parametrize("n", ORDERS)
def test_smooth_underflow(n):
    x = np.linspace(37, 45, 4001)
    with warnings.catch_warnings(), np.errstate(all="raise"):
        warnings.simplefilter("error")
        values = height_integral(n, x)
        far = height_integral(n, [math.nextafter(40, 41), 1e3, 1e8, 1e300])
    assert (np.diff(values) <= 0).all()
    assert (values[x <= 38] > 0).all()
    assert (values[x > 40] == 0).all()
    assert (far == 0).all()
    # a subnormal number is right to half of the smallest one, beside its own rounding
    subnormal = x[(values < 2.3e-308) & (x < 39)][::40]
    for at, value in zip(subnormal, height_integral(n, subnormal), strict=True):
        true = reference(n, at)
        assert abs(mp.mpf(float(value)) - true) <= 5e-13 * true + 2 * mp.mpf(5e-324)


@pytest.mark.parametrize("n", [0, 3, 0.7, -0.5, math.nan])
def test_unknown_order(n):
    with pytest.raises(InputError, match="n must be one of"):
        height_integral(n, 0.0)
