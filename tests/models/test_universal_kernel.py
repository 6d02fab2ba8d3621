"""The shipped tables' kernels: honest bounds on many fresh points, slopes, one bit pattern."""

import math

import numpy as np
import pytest
from helpers import difference_weights

from mbma_tables import InputError, OutOfRangeError, greenwood_tripp
from mbma_tables.islands.geometry import geometry
from mbma_tables.models.tables import open_table, universal_model
from mbma_tables.surfaces.variants import REPORTED


def scattered(count, seed, low=1e-8):
    """Fresh points over the table: X even, mu even in its logarithm."""
    X_axis, mu_axis = universal_model().content.axes
    rng = np.random.default_rng(seed)
    X = rng.uniform(X_axis.low, X_axis.high, count)
    return X, 10 ** rng.uniform(math.log10(low), math.log10(mu_axis.high), count)


def error_of(found, solved):
    return np.maximum(np.abs(found.phi_F / solved.phi_F - 1), np.abs(found.phi_A / solved.phi_A - 1))


def test_no_bound_is_exceeded_nor_much_wider_than_the_error_on_20000_points():
    X, mu = scattered(20_000, seed=60)
    found = universal_model().answer(X, mu)
    error, bound = error_of(found, greenwood_tripp.solve(X, mu, rtol=1e-12)), found.error
    assert (error <= bound).all()
    assert error.max() <= bound.max() <= 1e-9
    ratio = bound / np.maximum(error, np.finfo(float).eps)
    # where interpolation shows above rounding
    visible = error > 1e-13
    assert visible.mean() > 0.8
    assert np.median(ratio[visible]) <= 30
    assert np.median(ratio) <= 30


def test_island4d_over_what_surfaces_visit():
    rng = np.random.default_rng(61)
    count = 20_000
    hurst = rng.uniform(0.3, 1, count)
    zeta_1 = 10 ** rng.uniform(math.log10(3.001), 4, count)
    g = geometry(10 ** rng.uniform(-6, 1, count), hurst, zeta_1, REPORTED)
    found = open_table("island4d").of_islands(g | {"hurst": hurst})
    error = error_of(found, greenwood_tripp.solve(g["X"], g["mu"], rtol=1e-10))
    assert (error > found.error).mean() < 1e-3
    assert error.max() <= 1e-3
    assert found.error.max() <= 1e-3
    # far inside the rigid limit a table has next to no error to state
    visible = error > 1e-10
    assert visible.mean() > 0.5
    assert np.median((found.error / error)[visible]) <= 100


def test_slopes_against_the_solver():
    X, mu = scattered(300, seed=62, low=1e-7)
    X_axis, mu_axis = universal_model().content.axes
    X, mu = np.clip(X, X_axis.low + 0.1, X_axis.high - 0.1), np.minimum(mu, 0.9 * mu_axis.high)
    value, by_X, by_mu = universal_model().slopes(X, mu)
    offsets = np.arange(-3.0, 4)
    weights = difference_weights(offsets)
    in_X = greenwood_tripp.solve(X[:, None] + 1e-2 * offsets, mu[:, None], rtol=1e-12)
    in_mu = greenwood_tripp.solve(X[:, None], mu[:, None] * (1 + 1e-2 * offsets), rtol=1e-12)
    plain = universal_model().answer(X, mu)
    for name in ("phi_F", "phi_A"):
        for by, moved, unit in ((by_X, in_X, 1.0), (by_mu, in_mu, mu)):
            true = getattr(moved, name) @ weights / (1e-2 * unit)
            allowed = 1e-6 * np.maximum(np.abs(true), getattr(value, name) / unit)
            assert (np.abs(getattr(by, name) - true) <= allowed).all()
        np.testing.assert_allclose(getattr(value, name), getattr(plain, name), rtol=1e-13)
    np.testing.assert_array_equal(value.error, plain.error)


def test_parallel_gives_the_same_bits():
    X, mu = scattered(50_000, seed=63, low=1e-14)
    serial, parallel = universal_model().answer(X, mu), universal_model().answer(X, mu, parallel=True)
    for name in ("phi_F", "phi_A", "error"):
        np.testing.assert_array_equal(getattr(serial, name), getattr(parallel, name))
    X[77] = 1e3
    with pytest.raises(OutOfRangeError) as caught:
        universal_model().answer(X, mu, parallel=True)
    assert caught.value.mask.sum() == 1
    assert caught.value.mask[77]


def test_where_arguments_lie():
    model = universal_model()
    X_axis, mu_axis = model.content.axes
    in_X, in_mu = model.status([X_axis.low - 1, 0.0, X_axis.high + 1], [[0.0], [1.0], [2 * mu_axis.high]])
    assert in_X.tolist() == [-1, 0, 1]
    assert in_mu.tolist() == [[0], [0], [1]]
    assert model.status(0.0, 1.0) == (0, 0)
    with pytest.raises(InputError, match="mu must be finite"):
        model.status(0.0, math.nan)
    for method in (model.answer, model.slopes):
        with pytest.raises(OutOfRangeError, match=r"X must be in \[-6\.25, 41\], got 50 at \(1,\)"):
            method([0.0, 50.0], 1.0)
        with pytest.raises(InputError, match="do not broadcast"):
            method([0.0, 1.0], [1.0, 2.0, 3.0])
