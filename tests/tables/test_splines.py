"""Spline coefficients and their evaluation against scipy, polynomials, and arithmetic at 50 digits."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline, NdBSpline, make_interp_spline

from mbma_tables.common.arguments import filled
from mbma_tables.core import core
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.variants import REPORTED
from mbma_tables.tables.island4d import core_table
from mbma_tables.tables.schema import Axis
from mbma_tables.tables.splines import coefficients, padding

SHAPE = (9, 8, 7, 6)


def node_values(shape, seed=1):
    rng = np.random.default_rng(seed)
    grid = np.meshgrid(*(np.linspace(0, 2, n) for n in shape), indexing="ij")
    smooth = np.stack([np.sin(sum(grid)), np.exp(-grid[0] * grid[1])], axis=-1)
    return smooth + 0.3 * rng.standard_normal((*shape, 2))


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


def test_the_core_evaluates_tensor_splines_as_scipy():
    """At random places and on nodes, edges and corners; Phi over that of a rigid sphere is the exponential."""
    values = 0.3 * node_values(SHAPE)
    coefs = coefficients(values, 5, 4).astype(np.float32).astype(float)
    assert coefs.shape == (*(n + 4 for n in SHAPE), 2)
    knots = tuple(np.arange(n + 10) - 5.0 for n in SHAPE)
    positions = random_positions(SHAPE, 500)
    expected = NdBSpline(knots, coefs, 5)(np.stack(positions, axis=-1))
    ranges = ("log", 3.0, 0.5, 26.0), ("log", 0.0, 1e-8, 2500.0), (0.0, 1.0), (0.3, 1.0)
    axes = [
        Axis("x", "", *(("linear", 0.0, *ends) if len(ends) == 2 else ends), nodes)
        for ends, nodes in zip(ranges, SHAPE, strict=True)
    ]
    cells = tuple(n - 1 for n in SHAPE)
    bounds = np.arange(math.prod(cells), dtype=float).reshape(cells)
    table = core_table(axes, coefs, np.stack([bounds, 0 * bounds], axis=-1), REPORTED)
    places = [axis.coordinate(p) for axis, p in zip(axes, positions, strict=True)]
    mu = np.geomspace(1e-3, 1e3, places[0].size)
    phi_F, phi_A, error = filled(core.island_answers, (*places, mu), 3, *table)
    rigid = greenwood_tripp.rigid_sphere(places[0], mu)
    ratios = np.stack([phi_F, phi_A], axis=-1) / rigid.T
    np.testing.assert_allclose(ratios, np.exp(expected), rtol=1e-11)
    inside = [np.abs(p - np.round(p)) > 1e-9 for p in positions]
    cell = tuple(np.floor(p).astype(int)[np.all(inside, axis=0)] for p in positions)
    np.testing.assert_array_equal(error[np.all(inside, axis=0)], bounds[cell])


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
