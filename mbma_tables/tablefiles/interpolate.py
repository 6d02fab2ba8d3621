"""Compiled evaluation of uniform tensor splines: two functions at once, value or value and gradient.

Positions are in node units, 0 ... n - 1. Nothing is shared or kept: any thread may call any of these.

Four axes are summed eight doubles at a time, four coefficients of two functions each. numba leaves LLVM's vectoriser
of straight-line code off, so that a sum over eight neighbours would run one by one; two intrinsics spell it out.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import Instruction, jitable, njit

Six = tuple[Any, Any, Any, Any, Any, Any]
Four = tuple[Any, Any, Any, Any]
Eight = tuple[float, float, float, float, float, float, float, float]
Ten = tuple[float, float, float, float, float, float, float, float, float, float]

_FAST = {"contract", "reassoc"}
ZERO = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

LANES = 8
PART = 1.0 / 120.0  # of quintic B-splines; products are faster than quotients


def _load_lanes(typing_context: Any, array: Any, offset: Any) -> Any:
    """Eight neighbours of a flat, contiguous array of doubles, from `offset` on."""
    from llvmlite import ir
    from numba import types
    from numba.np.arrayobj import make_array

    vector = ir.VectorType(ir.DoubleType(), LANES)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = make_array(signature.args[0])(context, builder, arguments[0]).data
        start = builder.gep(data, [arguments[1]], inbounds=True)
        loaded = builder.load(builder.bitcast(start, vector.as_pointer()))
        # doubles, not vectors, are what numpy aligns
        loaded.align = 8
        return _to_tuple(context, builder, signature, loaded)

    return types.UniTuple(types.float64, LANES)(array, offset), generate


def _add_lanes(typing_context: Any, total: Any, weight: Any, lanes: Any) -> Any:
    """``total + weight * lanes``, lane by lane."""
    from llvmlite import ir
    from numba import types

    width, place = ir.VectorType(ir.DoubleType(), LANES), ir.IntType(32)

    def to_vector(builder: Any, values: Any) -> Any:
        vector = ir.Constant(width, ir.Undefined)
        for n in range(LANES):
            vector = builder.insert_element(vector, builder.extract_value(values, n), place(n))
        return vector

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        spread = ir.Constant(width, ir.Undefined)
        for n in range(LANES):
            spread = builder.insert_element(spread, arguments[1], place(n))
        product = builder.fmul(spread, to_vector(builder, arguments[2]), flags=("contract",))
        vector = builder.fadd(to_vector(builder, arguments[0]), product, flags=("contract",))
        return _to_tuple(context, builder, signature, vector)

    return types.UniTuple(types.float64, LANES)(total, weight, lanes), generate


def _patch_lanes(
    typing_context: Any, array: Any, offset: Any, row: Any, step: Any, across: Any, along: Any
) -> Any:  # fmt: skip
    """Sum of ``across[a] along[b]`` times the eight neighbours from ``offset + a row + b step`` on."""
    from llvmlite import ir
    from numba import types
    from numba.np.arrayobj import make_array

    double, place = ir.VectorType(ir.DoubleType(), LANES), ir.IntType(32)
    single = array.dtype == types.float32
    vector = ir.VectorType(ir.FloatType(), LANES) if single else double

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = make_array(signature.args[0])(context, builder, arguments[0]).data

        def spread(weights: Any, n: int) -> Any:
            lane = builder.insert_element(
                ir.Constant(double, ir.Undefined), builder.extract_value(weights, n), place(0)
            )
            return builder.shuffle_vector(
                lane, ir.Constant(double, ir.Undefined), ir.Constant(ir.VectorType(place, LANES), [0] * LANES)
            )

        def add(total: Any, weight: Any, lanes: Any) -> Any:
            product = builder.fmul(weight, lanes, flags=("contract",))
            return product if total is None else builder.fadd(total, product, flags=("contract",))

        inner = [spread(arguments[5], n) for n in range(len(along))]
        total, start = None, arguments[1]
        for a in range(len(across)):
            rowwise, at = None, start
            for weight in inner:
                pointer = builder.gep(data, [at], inbounds=True)
                lanes = builder.load(builder.bitcast(pointer, vector.as_pointer()))
                # numbers, not vectors, are what numpy aligns
                lanes.align = 4 if single else 8
                rowwise = add(rowwise, weight, builder.fpext(lanes, double) if single else lanes)
                at = builder.add(at, arguments[3])
            total = add(total, spread(arguments[4], a), rowwise)
            start = builder.add(start, arguments[2])
        return _to_tuple(context, builder, signature, total)

    result = types.UniTuple(types.float64, LANES)
    return result(array, types.intp, types.intp, types.intp, across, along), generate


def _to_tuple(context: Any, builder: Any, signature: Any, vector: Any) -> Any:
    from llvmlite import ir
    from numba.core.imputils import impl_ret_untracked

    lanes = ir.Constant(context.get_value_type(signature.return_type), ir.Undefined)
    for n in range(LANES):
        lanes = builder.insert_value(lanes, builder.extract_element(vector, ir.IntType(32)(n)), n)
    return impl_ret_untracked(context, builder, signature.return_type, lanes)


def _plain_patch(array: Any, start: int, row: int, step: int, across: Any, along: Any) -> tuple[float, ...]:
    places = start + row * np.arange(len(across))[:, None] + step * np.arange(len(along))
    lanes = array[places[:, :, None] + np.arange(LANES)].astype(float)
    return tuple(np.einsum("i,j,ijk", across, along, lanes))


# numba calls the definitions with a typing context in front
load_lanes: Any = Instruction(_load_lanes, lambda array, offset: tuple(array[offset : offset + LANES]))
add_lanes: Any = Instruction(
    _add_lanes,
    lambda total, weight, lanes: tuple(a + weight * b for a, b in zip(total, lanes, strict=True)),
)
patch_lanes: Any = Instruction(_patch_lanes, _plain_patch)


@jitable
def quintic(u: Any) -> Six:
    """The six cardinal quintic B-splines that reach the cell, at u in [0, 1] of it."""
    v = 1.0 - u
    u2, v2 = u * u, v * v
    u5, v5 = u2 * u2 * u, v2 * v2 * v
    # interior pieces by their own polynomials, the fourth and fifth as mirror images
    w1 = (26.0 + u * (-50.0 + u * (20.0 + u * (20.0 + u * (-20.0 + 5.0 * u))))) * PART
    w2 = (66.0 + u2 * (-60.0 + u2 * (30.0 - 10.0 * u))) * PART
    w3 = (66.0 + v2 * (-60.0 + v2 * (30.0 - 10.0 * v))) * PART
    w4 = (26.0 + v * (-50.0 + v * (20.0 + v * (20.0 + v * (-20.0 + 5.0 * v))))) * PART
    return v5 * PART, w1, w2, w3, w4, u5 * PART


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
    wx, wy, wz = cubic(u), cubic(v), cubic(w)
    flat = c.reshape(-1)
    row = 2 * c.shape[3]
    total = ZERO
    for a in range(4):
        for b in range(4):
            start = 2 * ((((i + a) * c.shape[1] + j + b) * c.shape[2] + k) * c.shape[3] + m)
            plane = add_lanes(ZERO, wz[0], load_lanes(flat, start))
            plane = add_lanes(plane, wz[1], load_lanes(flat, start + row))
            plane = add_lanes(plane, wz[2], load_lanes(flat, start + 2 * row))
            plane = add_lanes(plane, wz[3], load_lanes(flat, start + 3 * row))
            total = add_lanes(total, wx[a] * wy[b], plane)
    return _last_axis(cubic(s), total)


@njit(cache=True, fastmath=_FAST, error_model="numpy")
def gradient_4d(c: FloatArray, x: float, y: float, z: float, t: float) -> Ten:
    """Values and derivatives of both functions: f, f_x, f_y, f_z, f_t, then g and its own."""
    i, u = cell(x, c.shape[0] - 2)
    j, v = cell(y, c.shape[1] - 2)
    k, w = cell(z, c.shape[2] - 2)
    m, s = cell(t, c.shape[3] - 2)
    wx, wy, wz, wt = cubic(u), cubic(v), cubic(w), cubic(s)
    sx, sy, sz = cubic_slope(u), cubic_slope(v), cubic_slope(w)
    flat = c.reshape(-1)
    row = 2 * c.shape[3]
    total = by_x = by_y = by_z = ZERO
    for a in range(4):
        for b in range(4):
            start = 2 * ((((i + a) * c.shape[1] + j + b) * c.shape[2] + k) * c.shape[3] + m)
            l0, l1 = load_lanes(flat, start), load_lanes(flat, start + row)
            l2, l3 = load_lanes(flat, start + 2 * row), load_lanes(flat, start + 3 * row)
            plane = add_lanes(add_lanes(ZERO, wz[0], l0), wz[1], l1)
            plane = add_lanes(add_lanes(plane, wz[2], l2), wz[3], l3)
            slope = add_lanes(add_lanes(ZERO, sz[0], l0), sz[1], l1)
            slope = add_lanes(add_lanes(slope, sz[2], l2), sz[3], l3)
            total = add_lanes(total, wx[a] * wy[b], plane)
            by_x = add_lanes(by_x, sx[a] * wy[b], plane)
            by_y = add_lanes(by_y, wx[a] * sy[b], plane)
            by_z = add_lanes(by_z, wx[a] * wy[b], slope)
    f, g = _last_axis(wt, total)
    fx, gx = _last_axis(wt, by_x)
    fy, gy = _last_axis(wt, by_y)
    fz, gz = _last_axis(wt, by_z)
    ft, gt = _last_axis(cubic_slope(s), total)
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
