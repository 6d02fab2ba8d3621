"""Axes: places and coordinates are inverse of each other, ends are exact, the formula says the same."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from generate.tables.writing import error_cells
from mbma_tables.tablefiles.schema import Axis, error_cell


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
    return Axis("x", "a coordinate", transform, offset, low, high, draw(st.integers(2, 400)))


@given(axes(), st.floats(0, 1))
def test_positions_and_coordinates_are_inverse_and_as_the_formula_says(axis, share):
    last = axis.nodes - 1
    # rounding of t, and of x, counted in steps
    rounding = max(abs(axis.start), abs(axis.start + last * axis.step)) / axis.step + axis.nodes
    assert (axis.coordinate(0), axis.coordinate(last)) == (axis.values[0], axis.values[-1]) == (axis.low, axis.high)
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
