"""Spline coefficients and their compiled evaluation against scipy, polynomials, and arithmetic at 50 digits."""

import mpmath
import numpy as np
import pytest
from scipy.interpolate import BSpline, NdBSpline, make_interp_spline
from small_tables import at_positions

from mbma_tables.tablefiles import interpolate
from mbma_tables.tablefiles.splines import TAPS, coefficients, padding

WEIGHTS = {3: interpolate.cubic}
SHAPE = (8, 7, 6, 5)


def node_values(shape, seed=1):
    """Smooth values and noise, two components."""
    rng = np.random.default_rng(seed)
    grid = np.meshgrid(*(np.linspace(0, 2, n) for n in shape), indexing="ij")
    smooth = np.stack([np.sin(sum(grid)), np.exp(-grid[0] * grid[1])], axis=-1)
    return smooth + 0.3 * rng.standard_normal((*shape, 2))


def by_scipy(values, degree, axes):
    """The not-a-knot tensor spline of scipy."""
    knots = []
    for axis in range(axes):
        one = make_interp_spline(np.arange(values.shape[axis]), values, k=degree, axis=axis)
        knots.append(one.t)
        values = np.moveaxis(one.c, 0, axis) if one.c.shape != values.shape else one.c
    return NdBSpline(tuple(knots), values, degree)


def random_positions(shape, count, seed=2):
    rng = np.random.default_rng(seed)
    corners = np.stack(np.meshgrid(*([0.0, n - 1.0] for n in shape), indexing="ij"), -1).reshape(-1, len(shape))
    inside = rng.uniform(0, 1, (count, len(shape))) * (np.array(shape) - 1)
    on_nodes = np.floor(rng.uniform(0, 1, (count, len(shape))) * np.array(shape))
    return [np.ascontiguousarray(column) for column in np.concatenate([corners, inside, on_nodes]).T]


def test_tensor_splines_are_those_of_scipy():
    degree, shape = 3, SHAPE
    values = node_values(shape)
    coefs = coefficients(values, degree, len(shape))
    assert coefs.shape == (*(n + degree - 1 for n in shape), 2)
    positions = random_positions(shape, 500)
    found = at_positions(coefs, positions).T
    expected = by_scipy(values, degree, len(shape))(np.stack(positions, axis=-1))
    np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-11 * np.abs(values).max())


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("nodes", [7, 12, 300])
def test_one_axis_against_scipy_and_more_components(degree, nodes):
    rng = np.random.default_rng(nodes)
    values = rng.standard_normal((nodes, 3, 2))
    untouched = values.copy()
    coefs = coefficients(values, degree, 1)
    assert coefs.shape == (nodes + degree - 1, 3, 2)
    np.testing.assert_array_equal(values, untouched)
    # coefficients of cardinal splines are those of a B-spline on uniform knots
    pad = padding(degree)
    knots = np.arange(-degree, nodes + degree, dtype=float)
    assert len(knots) - degree - 1 == len(coefs) == nodes + 2 * pad
    places = np.linspace(0, nodes - 1, 977)
    expected = make_interp_spline(np.arange(nodes), values, k=degree)(places)
    np.testing.assert_allclose(BSpline(knots, coefs, degree)(places), expected, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("degree", [3])
def test_weights_at_fifty_digits(degree):
    value = WEIGHTS[degree]
    with mpmath.workdps(50):
        for number in range(degree + 1):

            def exact(u, order=0, number=number):
                # the cardinal B-spline by divided differences of truncated powers
                x = u + degree - number
                terms = (
                    (-1) ** k * mpmath.binomial(degree + 1, k) * max(x - k, mpmath.mpf(0)) ** (degree - order)
                    for k in range(degree + 2)
                )
                return mpmath.fsum(terms) / mpmath.factorial(degree - order)

            for u in (mpmath.mpf(k) / 17 for k in range(18)):
                # 2/3 is rounded
                assert abs(value(u)[number] - exact(u)) < 1e-16
                if degree == 3:
                    assert abs(interpolate.cubic_slope(u)[number] - exact(u, 1)) < 1e-16
    for u in np.linspace(0, 1, 11):
        assert sum(value(u)) == pytest.approx(1, rel=4e-16, abs=0)
        assert sum(interpolate.cubic_slope(u)) == pytest.approx(0, abs=4e-16)
    np.testing.assert_allclose(value(0.0)[:-1], TAPS[degree], rtol=2e-16)


def test_the_last_node_belongs_to_the_table():
    assert interpolate.cell(9.0, 10) == (8, 1.0)
    assert interpolate.cell(0.0, 10) == (0, 0.0)
    assert interpolate.cell(3.0, 10) == (3, 0.0)
    assert interpolate.cell(np.nextafter(9.0, 10.0), 10)[0] == 8
    values = node_values(SHAPE)
    found = at_positions(coefficients(values, 3, 4), [np.array([n - 1.0]) for n in SHAPE])[:, 0]
    np.testing.assert_allclose(found, values[-1, -1, -1, -1], rtol=0, atol=1e-13 * np.abs(values).max())
