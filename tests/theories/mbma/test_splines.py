"""Spline coefficients and their evaluation against scipy, polynomials, and arithmetic at 50 digits."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline, NdBSpline, make_interp_spline

from generate.splines import coefficients, padding
from generate.tables.island4d import error_cells
from mbma_tables.common.table_schema import Axis, error_cell
from mbma_tables.theories.mbma.island4d import spline_of

SHAPE = (8, 7, 6, 5)


def node_values(shape, seed=1):
    rng = np.random.default_rng(seed)
    grid = np.meshgrid(*(np.linspace(0, 2, n) for n in shape), indexing="ij")
    smooth = np.stack([np.sin(sum(grid)), np.exp(-grid[0] * grid[1])], axis=-1)
    return smooth + 0.3 * rng.standard_normal((*shape, 2))


def by_scipy(values, degree, axes):
    knots = []
    for axis in range(axes):
        one = make_interp_spline(
            np.arange(values.shape[axis]), values, k=degree, axis=axis
        )
        knots.append(one.t)
        values = np.moveaxis(one.c, 0, axis) if one.c.shape != values.shape else one.c
    return NdBSpline(tuple(knots), values, degree)


def random_positions(shape, count, seed=2):
    rng = np.random.default_rng(seed)
    corners = np.stack(
        np.meshgrid(*([0.0, n - 1.0] for n in shape), indexing="ij"), -1
    ).reshape(-1, len(shape))
    inside = rng.uniform(0, 1, (count, len(shape))) * (np.array(shape) - 1)
    on_nodes = np.floor(rng.uniform(0, 1, (count, len(shape))) * np.array(shape))
    return [
        np.ascontiguousarray(column)
        for column in np.concatenate([corners, inside, on_nodes]).T
    ]


def test_tensor_splines_are_those_of_scipy():
    values = node_values(SHAPE)
    coefs = coefficients(values, 3, 4)
    spline = by_scipy(values, 3, 4)
    assert coefs.shape == (*(n + 2 for n in SHAPE), 2)
    positions = random_positions(SHAPE, 500)
    points = np.stack(positions, axis=-1)
    np.testing.assert_allclose(
        spline_of(coefs)(points),
        spline(points),
        rtol=1e-11,
        atol=1e-11 * np.abs(values).max(),
    )


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
    np.testing.assert_allclose(
        BSpline(knots, coefs, degree)(places), expected, rtol=1e-11, atol=1e-11
    )


@st.composite
def axes(draw):
    transform = draw(st.sampled_from(["linear", "log"]))
    offset = draw(st.floats(0, 20))
    if transform == "log":
        first = 10 ** draw(st.floats(-9, 2))
        low = first - offset
        high = first * (1 + 10 ** draw(st.floats(-1, 12))) - offset
    else:
        low = draw(st.floats(-50, 50))
        high = low + 10 ** draw(st.floats(-2, 4))
    return Axis(
        "x", "a coordinate", transform, offset, low, high, draw(st.integers(2, 400))
    )


@given(axes(), st.floats(0, 1))
def test_positions_and_coordinates_are_inverse_and_as_the_formula_says(axis, share):
    last = axis.nodes - 1
    # rounding of t, and of x, counted in steps
    rounding = (
        max(abs(axis.start), abs(axis.start + last * axis.step)) / axis.step + axis.nodes
    )
    assert (
        (axis.coordinate(0), axis.coordinate(last))
        == (axis.values[0], axis.values[-1])
        == (axis.low, axis.high)
    )
    assert axis.values.shape == (axis.nodes,)
    assert (np.diff(axis.values) > 0).all()
    assert axis.position(axis.low) == 0
    assert abs(axis.position(axis.high) - last) <= 8e-16 * (rounding - 1)
    position = share * last
    x = axis.coordinate(position)
    assert axis.low <= x <= axis.high or 0 < position < last
    scale = 1 / (x + axis.offset) if axis.transform == "log" else 1.0
    of_x = (abs(x) + axis.offset) * scale / axis.step
    assert abs(axis.position(x) - position) <= 1e-15 * (rounding + of_x)
    name, _, right = axis.formula().partition(" = ")
    assert name == "position"
    stated = eval(right, {"__builtins__": {}}, {"log": math.log, "x": float(x)})
    assert abs(stated - axis.position(x)) <= 1e-15 * rounding


@given(axes(), st.floats(0, 1))
def test_error_cells_cover_the_axis_evenly(axis, share):
    cells = error_cells(axis)
    assert 1 <= cells <= 32
    position = share * (axis.nodes - 1)
    cell = int(error_cell(axis, cells, position))
    width = (axis.nodes - 1) / cells
    assert cell == cells - 1 or position < (cell + 1) * width * (1 + 1e-12)
    assert position >= cell * width * (1 - 1e-12)
    assert error_cell(axis, cells, 0.0) == 0
    assert error_cell(axis, cells, axis.nodes - 1.0) == cells - 1
