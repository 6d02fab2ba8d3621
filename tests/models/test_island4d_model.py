"""`Island4dModel` against islands of surfaces by geometry and solver, and at every edge."""

import math

import numpy as np
import pytest
from small_tables import small_table

from mbma_tables import OutOfRangeError, greenwood_tripp
from mbma_tables.islands.four_numbers import SPHERE_FLOOR, to_axes
from mbma_tables.models.island4d import Island4dModel
from mbma_tables.models.tables import open_table
from mbma_tables.surfaces.variants import REPORTED
from mbma_tables.tablefiles.schema import ISLAND4D


@pytest.fixture(scope="module")
def small():
    return Island4dModel(small_table(ISLAND4D))


def test_the_shipped_table_over_the_whole_box():
    model = open_table("island4d")
    rng = np.random.default_rng(31)
    hurst = rng.uniform(0.3, 1.0, 600)
    zeta_d = SPHERE_FLOOR * 10 ** rng.uniform(0, 4, 600)
    zeta_u = zeta_d * (1 + 10 ** rng.uniform(-12, math.log10(2499), 600))
    X = rng.uniform(0.501, 25.9, 600)
    sigma = to_axes(np.ones(600), zeta_d, zeta_u, hurst, REPORTED).sigma
    delta = (X * sigma + 1) * zeta_d**-hurst
    place = to_axes(delta, zeta_d, zeta_u, hurst, REPORTED)
    # where X cannot be had from delta to six digits there is nothing to compare
    kept = (np.abs(place.X / X - 1) < 1e-6) & (place.X > 0.5) & (place.X < 26)
    assert kept.sum() > 400
    solved = greenwood_tripp.solve(place.X[kept], place.mu[kept], rtol=1e-11)
    found_F, found_A, bound = model.lookup(*(a[kept] for a in (delta, zeta_d, zeta_u, hurst)))
    error_F = np.abs(found_F / (place.force[kept] * solved.phi_F) - 1)
    error_A = np.abs(found_A / (place.area[kept] * solved.phi_A) - 1)
    assert np.maximum(error_F, error_A).max() < 1e-3
    assert np.mean(np.maximum(error_F, error_A) <= bound) > 0.995


def inside(small, count, seed):
    """Raw numbers of islands inside the small table, and their X."""
    rng = np.random.default_rng(seed)
    X_axis, spread_axis, _, hurst_axis = small.content.axes
    hurst = rng.uniform(hurst_axis.low, hurst_axis.high, count)
    zeta_d = SPHERE_FLOOR * 10 ** rng.uniform(0, 2, count)
    zeta_u = zeta_d * (1 + 10 ** rng.uniform(-3, np.log10(0.99 * spread_axis.high), count))
    X = rng.uniform(X_axis.low + 0.01, X_axis.high - 0.01, count)
    sigma = to_axes(np.ones(count), zeta_d, zeta_u, hurst, REPORTED).sigma
    return (X * sigma + 1) * zeta_d**-hurst, zeta_d, zeta_u, hurst


def test_broadcasting_scalars_and_input(small):
    raw = inside(small, 6, 33)
    one = small.lookup(*(float(a[0]) for a in raw))
    assert all(np.ndim(x) == 0 for x in one)
    many = small.lookup(*raw)
    np.testing.assert_array_equal([x[0] for x in many], list(one))
    grid = small.lookup(np.array([[1.5], [1.6], [1.7]]), 2.0, [20.0, 21.0], 0.7)
    assert all(x.shape == (3, 2) for x in grid)
    np.testing.assert_array_equal([x[2, 1] for x in grid], list(small.lookup(1.7, 2.0, 21.0, 0.7)))
    copies = [a.copy() for a in raw]
    for a in raw:
        a.setflags(write=False)
    small.lookup(*raw)
    np.testing.assert_array_equal(raw, copies)


def test_edges_to_the_last_bit(small):
    delta, zeta_d, zeta_u = 1.5, 2.0, 20.0
    for hurst in (0.3, 1.0):
        small.lookup(delta, zeta_d, zeta_u, hurst)
    for hurst in (np.nextafter(0.3, 0), np.nextafter(1.0, 2)):
        with pytest.raises(OutOfRangeError, match=r"hurst must be in \[0\.3, 1\]"):
            small.lookup(delta, zeta_d, zeta_u, hurst)
    small.lookup(delta, SPHERE_FLOOR, zeta_u, 0.7)
    with pytest.raises(OutOfRangeError, match=r"zeta_d must be at least 1\.25"):
        small.lookup(delta, np.nextafter(SPHERE_FLOOR, 0), zeta_u, 0.7)
    # 2 * 101 is exact, so is the spread of 100
    small.lookup(3.0, 2.0, 202.0, 0.7)
    with pytest.raises(OutOfRangeError, match="zeta_u/zeta_d - 1 must be at most 100"):
        small.lookup(3.0, 2.0, np.nextafter(202.0, 300), 0.7)
    # one bit apart, at X = 5
    sigma = to_axes(*(np.array([v]) for v in (1.0, 2.0, np.nextafter(2.0, 3), 0.7)), REPORTED).sigma[0]
    small.lookup(2.0**-0.7 * (1 + 5 * sigma), 2.0, np.nextafter(2.0, 3), 0.7)
    for top in (2.0, 1.9):
        with pytest.raises(OutOfRangeError, match="zeta_u must be above zeta_d"):
            small.lookup(delta, 2.0, top, 0.7)


@pytest.mark.parametrize(
    ("position", "bad"), [(0, 0.1), (0, 1e3), (0, -1.0), (1, 1.0), (1, -3.0), (2, 1e6), (2, 1.0), (3, 0.1), (3, 1.2)]
)
def test_what_is_out_of_range_is_marked(small, position, bad):
    raw = [1.5, 2.0, 20.0, 0.7]
    raw[position] = [[raw[position], bad], [raw[position], bad]]
    with pytest.raises(OutOfRangeError) as caught:
        small.lookup(*raw)
    np.testing.assert_array_equal(caught.value.mask, [[False, True], [False, True]])
