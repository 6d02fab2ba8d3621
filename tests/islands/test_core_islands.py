"""Exact islands by the core: invalid numbers, extremes and tolerances."""

import itertools
import math
import warnings

import mpmath as mp
import numpy as np
import pytest
import scipy.special

from mbma_tables import InputError
from mbma_tables.core import core
from mbma_tables.islands.greenwood_tripp import (
    COARSE_NODES,
    ORDERS,
    height_integral,
)
from mbma_tables.islands.half_space import basis

OK = 0
UNRESOLVED = 4
INVALID = 5


def solve(X, mu, nodes, rtol=1e-10):
    X = np.ascontiguousarray(X, dtype=float)
    mu = np.ascontiguousarray(mu, dtype=float)
    phi = np.zeros((X.size, 3))
    steps = np.zeros(X.size, dtype=np.int64)
    status = np.full(X.size, 99, dtype=np.uint8)
    kept = np.zeros((3, X.size, nodes))
    bases = (*basis(nodes), *basis(COARSE_NODES))
    work = np.full(core.islands_work(nodes), np.nan)
    bad = core.solve_islands(X, mu, rtol, *bases, phi, steps, status, *kept, work)
    assert bad == np.count_nonzero(status)
    return phi, steps, status, kept


def test_numbers_that_are_none_are_refused_beside_good_ones():
    X = [1.0, math.nan, math.inf, -math.inf, 1.0, 1.0, 1.0, 1.0, 2.0]
    mu = [1.0, 1.0, 1.0, 1.0, math.nan, math.inf, -math.inf, -1e-300, 1.0]
    phi, steps, status, profiles = solve(X, mu, 24)
    assert status.tolist() == [OK] + [INVALID] * 7 + [OK]
    assert np.isnan(phi[1:8]).all()
    assert np.isnan(profiles[:, 1:8]).all()
    assert (steps[1:8] == 0).all()
    alone = solve([1.0, 2.0], [1.0, 1.0], 24)
    np.testing.assert_array_equal(phi[[0, 8]], alone[0])
    np.testing.assert_array_equal(profiles[:, [0, 8]], alone[3])


EXTREME = [0.0, -0.0, 5e-324, 1e-300, 1e-17, 1.0, 1e6, 1e17, 1e100, 1.7e308]


def test_extremes_end_with_finite_answers_or_a_status():
    X, mu = np.array(
        list(itertools.product([*EXTREME, *(-x for x in EXTREME)], EXTREME))
    ).T
    with np.errstate(all="raise"):
        phi, steps, status, profiles = solve(X, mu, 16)
    good = status == OK
    assert np.isin(status, [OK, UNRESOLVED]).all()
    assert np.isfinite(phi[good]).all()
    assert (phi[good] >= 0).all()
    assert np.isnan(phi[~good]).all()
    assert np.isnan(profiles[:, ~good]).all()
    still = good & (mu < 1e-200) & (np.abs(X) < 1e6)
    expected = np.empty((2, np.count_nonzero(still)))
    for row, twice_n in zip(expected, (5, 4), strict=True):
        core.height_integrals(twice_n, -X[still], row)
    np.testing.assert_allclose(
        phi[still, 0], math.pi / 5 * mu[still] * expected[0], rtol=1e-14, atol=5e-324
    )
    np.testing.assert_allclose(phi[still, 1], math.pi / 2 * expected[1], rtol=1e-14)
    assert steps.max() <= 21 * 200 + 200


@pytest.mark.parametrize("rtol", [math.nan, -1.0, 0.0, 1e-300, math.inf])
def test_a_tolerance_that_cannot_be_met_ends(rtol):
    phi, _, status, _ = solve([-3.0, 2.0, 8.0], [1e-3, 1.0, 1e4], 16, rtol=rtol)
    assert np.isin(status, [OK, UNRESOLVED]).all()
    assert (np.isnan(phi).all(axis=1) == (status != OK)).all()


def test_smooth_pressure_displaces_as_hankel_transforms_say():
    # p = exp(-s^2 rho^2): w(rho) = (sqrt(pi)/s) exp(-z) I_0(z), z = s^2 rho^2/2
    b = basis(48)
    squared = 36.0
    p = np.exp(-squared * b.v)
    w = b.operator @ (p * b.root_weights) / b.root_weights
    known = math.sqrt(math.pi / squared) * scipy.special.ive(0, squared * b.v / 2)
    assert np.abs(w / known - 1).max() <= 1e-13


EDGES = [-8.0, -6.0, -4.0, -2.0, 0.0, 1.0, 4.0]  # where the pieces meet


def reference(n: float, x: float) -> mp.mpf:
    with mp.workdps(40):
        order = mp.mpf(n)
        at = mp.mpf(float(x))
        scale = mp.gamma(order + 1) / mp.sqrt(2 * mp.pi)
        return scale * mp.exp(-at * at / 4) * mp.pcfu(order + mp.mpf(1) / 2, at)


def relative_errors(n: float, x: np.ndarray, values: np.ndarray) -> np.ndarray:
    with mp.workdps(40):
        return np.array(
            [
                float(abs(mp.mpf(float(v)) / reference(n, a) - 1))
                for a, v in zip(x, values, strict=True)
            ]
        )


def test_reference_is_the_integral():
    for n, x in ((0.5, -3.0), (1.5, 0.7), (2.5, 6.0)):
        with mp.workdps(30):
            direct = mp.quad(
                lambda z, n=n, x=x: (z - x) ** n * mp.npdf(z),
                [x, x + 1, x + 3, x + 8, x + 20],
                maxdegree=10,
            )
            assert abs(direct / reference(n, x) - 1) < 1e-15


@pytest.mark.parametrize("n", ORDERS)
def test_accuracy_and_independence_of_neighbours(n):
    rng = np.random.default_rng(round(2 * n))
    edges = [*EDGES, *np.nextafter(EDGES, -np.inf), *np.nextafter(EDGES, np.inf)]
    near = np.concatenate(
        [-(10 ** rng.uniform(0, 6, 120)), rng.uniform(-9, 10, 250), edges, [-1e6, 10.0]]
    )
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
