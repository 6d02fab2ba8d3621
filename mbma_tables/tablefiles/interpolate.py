"""Compiled evaluation of uniform tensor splines: two functions at once, value or value and gradient.

Positions are in node units, 0 ... n - 1. Nothing is shared or kept: any thread may call any of these.

Four axes are summed eight doubles at a time, four coefficients of two functions each. numba leaves LLVM's vectoriser
of straight-line code off, so that a sum over eight neighbours would run one by one; an intrinsic spells it out.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import Instruction, Lanes, jitable, njit

Four = tuple[Any, Any, Any, Any]
Eight = tuple[float, float, float, float, float, float, float, float]
Ten = tuple[float, float, float, float, float, float, float, float, float, float]

_FAST = {"contract", "reassoc"}

LANES = 8


def _patch_lanes(
    typing_context: Any, array: Any, offset: Any, row: Any, step: Any, across: Any, along: Any
) -> Any:  # fmt: skip
    """Sum of ``across[a] along[b]`` times the eight neighbours from ``offset + a row + b step`` on."""
    from numba import types
    from numba.np.arrayobj import make_array

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data, flags = make_array(signature.args[0])(context, builder, arguments[0]).data, ("contract",)
        outer, inner = (
            [Lanes(builder, builder.extract_value(given, n), flags) for n in range(len(kind))]
            for given, kind in ((arguments[4], across), (arguments[5], along))
        )
        total: Any = None
        start = arguments[1]
        for weight in outer:
            rowwise: Any = None
            at = start
            for own in inner:
                product = Lanes.load(builder, data, at, LANES, flags) * own
                rowwise = product if rowwise is None else rowwise + product
                at = builder.add(at, arguments[3])
            total = rowwise * weight if total is None else total + rowwise * weight
            start = builder.add(start, arguments[2])
        return context.make_tuple(builder, signature.return_type, [total[n].value for n in range(LANES)])

    result = types.UniTuple(types.float64, LANES)
    return result(array, types.intp, types.intp, types.intp, across, along), generate


def _plain_patch(array: Any, start: int, row: int, step: int, across: Any, along: Any) -> tuple[float, ...]:
    places = start + row * np.arange(len(across))[:, None] + step * np.arange(len(along))
    lanes = array[places[:, :, None] + np.arange(LANES)].astype(float)
    return tuple(np.einsum("i,j,ijk", across, along, lanes))


patch_lanes: Any = Instruction(_patch_lanes, _plain_patch)


@jitable
def cubic(u: Any) -> Four:
    """The four cardinal cubic B-splines that reach the cell, at u in [0, 1] of it."""
    v = 1.0 - u
    u2, v2 = u * u, v * v
    return v2 * v / 6.0, 2.0 / 3.0 - u2 * (1.0 - 0.5 * u), 2.0 / 3.0 - v2 * (1.0 - 0.5 * v), u2 * u / 6.0


@jitable
def cubic_slope(u: Any) -> Four:
    """Derivatives of `cubic` by u."""
    v = 1.0 - u
    return -0.5 * v * v, u * (1.5 * u - 2.0), -v * (1.5 * v - 2.0), 0.5 * u * u


@njit(cache=True, error_model="numpy")
def cell(position: float, nodes: int) -> tuple[int, float]:
    """Cell number and place in it; the last node belongs to the last cell."""
    first = min(int(position), nodes - 2)
    return first, position - first


@njit(cache=True, fastmath=_FAST, error_model="numpy")
def _last_axis(w: Four, lanes: Eight) -> tuple[float, float]:
    """Both functions from the sums over the other axes: four coefficients of two functions each."""
    return (
        w[0] * lanes[0] + w[1] * lanes[2] + w[2] * lanes[4] + w[3] * lanes[6],
        w[0] * lanes[1] + w[1] * lanes[3] + w[2] * lanes[5] + w[3] * lanes[7],
    )


@njit(cache=True, fastmath=_FAST, error_model="numpy")
def value_4d(c: FloatArray, x: float, y: float, z: float, t: float) -> tuple[float, float]:
    """Both functions of a cubic table, `c` of shape (n1 + 2, n2 + 2, n3 + 2, n4 + 2, 2), C-contiguous."""
    i, u = cell(x, c.shape[0] - 2)
    j, v = cell(y, c.shape[1] - 2)
    k, w = cell(z, c.shape[2] - 2)
    m, s = cell(t, c.shape[3] - 2)
    wx, wy, wz, wt = cubic(u), cubic(v), cubic(w), cubic(s)
    flat, row = c.reshape(-1), 2 * c.shape[3]
    f = g = 0.0
    for a in range(4):
        start = 2 * ((((i + a) * c.shape[1] + j) * c.shape[2] + k) * c.shape[3] + m)
        one, two = _last_axis(wt, patch_lanes(flat, start, c.shape[2] * row, row, wy, wz))
        f += wx[a] * one
        g += wx[a] * two
    return f, g


@njit(cache=True, fastmath=_FAST, error_model="numpy")
def gradient_4d(c: FloatArray, x: float, y: float, z: float, t: float) -> Ten:
    """Values and derivatives of both functions: f, f_x, f_y, f_z, f_t, then g and its own."""
    i, u = cell(x, c.shape[0] - 2)
    j, v = cell(y, c.shape[1] - 2)
    k, w = cell(z, c.shape[2] - 2)
    m, s = cell(t, c.shape[3] - 2)
    wx, wy, wz, wt = cubic(u), cubic(v), cubic(w), cubic(s)
    sx, sy, sz, st = cubic_slope(u), cubic_slope(v), cubic_slope(w), cubic_slope(s)
    flat, row = c.reshape(-1), 2 * c.shape[3]
    plane = c.shape[2] * row
    f = fx = fy = fz = ft = g = gx = gy = gz = gt = 0.0
    for a in range(4):
        start = 2 * ((((i + a) * c.shape[1] + j) * c.shape[2] + k) * c.shape[3] + m)
        lanes = patch_lanes(flat, start, plane, row, wy, wz)
        one, two = _last_axis(wt, lanes)
        f, fx, g, gx = f + wx[a] * one, fx + sx[a] * one, g + wx[a] * two, gx + sx[a] * two
        one, two = _last_axis(wt, patch_lanes(flat, start, plane, row, sy, wz))
        fy, gy = fy + wx[a] * one, gy + wx[a] * two
        one, two = _last_axis(wt, patch_lanes(flat, start, plane, row, wy, sz))
        fz, gz = fz + wx[a] * one, gz + wx[a] * two
        one, two = _last_axis(st, lanes)
        ft, gt = ft + wx[a] * one, gt + wx[a] * two
    return f, fx, fy, fz, ft, g, gx, gy, gz, gt


@njit(cache=True, nogil=True)
def fill_4d(c: FloatArray, places: FloatArray, out: FloatArray) -> None:
    """`value_4d` of each column of `places` (4, entries) into the columns of `out` (2, entries)."""
    for k in range(places.shape[1]):
        out[0, k], out[1, k] = value_4d(c, places[0, k], places[1, k], places[2, k], places[3, k])


@njit(cache=True, nogil=True)
def fill_gradient_4d(c: FloatArray, places: FloatArray, out: FloatArray) -> None:
    """`gradient_4d` of each column of `places` (4, entries) into the columns of `out` (10, entries)."""
    for k in range(places.shape[1]):
        both = gradient_4d(c, places[0, k], places[1, k], places[2, k], places[3, k])
        for row in range(10):
            out[row, k] = both[row]
