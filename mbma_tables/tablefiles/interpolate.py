"""Compiled evaluation of uniform tensor splines: two functions at once, value or value and gradient.

Positions are in node units, 0 ... n - 1. Nothing is shared or kept: any thread may call any of these.

Four axes are summed eight doubles at a time, four coefficients of two functions each. numba leaves LLVM's vectoriser
of straight-line code off, so that a sum over eight neighbours would run one by one; an intrinsic spells it out.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import CONTRACT, Instruction, Lanes, jitable, njit

Six = tuple[Any, Any, Any, Any, Any, Any]

LANES = 8
TILE = 2 * LANES  # neighbours that hold eight from any of the first eight on, a line of a processor's cache
CHUNK = 128  # entries whose sums are kept, so that the loop over their polynomials vectorises
PART = 1.0 / 120.0  # of quintic B-splines; products are faster than quotients


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
def polynomial_of(c: Any) -> Six:
    """The quintic in a cell from its six coefficients of B-splines."""
    c0, c1, c2, c3, c4, c5 = c
    return (
        (c0 + 26.0 * c1 + 66.0 * c2 + 26.0 * c3 + c4) * PART,
        (-c0 - 10.0 * c1 + 10.0 * c3 + c4) * (5.0 * PART),
        (c0 + 2.0 * c1 - 6.0 * c2 + 2.0 * c3 + c4) * (10.0 * PART),
        (-c0 + 2.0 * c1 - 2.0 * c3 + c4) * (10.0 * PART),
        (c0 - 4.0 * c1 + 6.0 * c2 - 4.0 * c3 + c4) * (5.0 * PART),
        (-c0 + 5.0 * c1 - 10.0 * c2 + 10.0 * c3 - 5.0 * c4 + c5) * PART,
    )


@jitable
def quintic_at(p: Any, z: Any) -> tuple[Any, Any]:
    """A quintic and its derivative."""
    value = p[0] + z * (p[1] + z * (p[2] + z * (p[3] + z * (p[4] + z * p[5]))))
    return value, p[1] + z * (2.0 * p[2] + z * (3.0 * p[3] + z * (4.0 * p[4] + z * 5.0 * p[5])))


@jitable
def _six(rows: Any, n: int) -> Six:
    """A column of six rows."""
    return rows[0, n], rows[1, n], rows[2, n], rows[3, n], rows[4, n], rows[5, n]


@njit(cache=True, error_model="numpy")
def cell(position: float, nodes: int) -> tuple[int, float]:
    """Cell number and place in it; the last node belongs to the last cell."""
    first = min(int(position), nodes - 2)
    return first, position - first


def tiled(c: Any) -> Any:
    """Coefficients (n1, n2, n3) as TILE of them from each eighth of the last axis on, (n1, tiles, n2, TILE)."""
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(c, ((0, 0), (0, 0), (0, TILE))), TILE, axis=2)
    tiles = windows[:, :, ::LANES].transpose(0, 2, 1, 3)
    # from where a line of the cache begins
    memory = np.empty(tiles.size + TILE, c.dtype)
    out = memory[-memory.ctypes.data // c.itemsize % TILE :][: tiles.size].reshape(tiles.shape)
    out[...] = tiles
    return out


@njit(cache=True, error_model="numpy")
def _held(x: float, first: float, rate: float, cells: int) -> tuple[int, float]:
    """Cell number and place in it, of what lies beyond an axis those of its end."""
    return cell(min(max((x - first) * rate, 0.0), float(cells)), cells + 1)


@njit(cache=True, nogil=True, fastmath=CONTRACT, error_model="numpy")
def fill_along(
    tiles: Any,
    cells: int,
    first: FloatArray,
    rate: FloatArray,
    others: FloatArray,
    owner: Any,
    x: FloatArray,
    out: FloatArray,
) -> None:
    """Values and derivatives along the last axis of a quintic table, into `out` (2, places, entries).

    Entries have places x (places, entries) there, in one of `cells`, and on the other axes those in the column `owner`
    of `others`; `tiles` are those of `tiled`. Steps have loops of their own, and all but that over patches vectorise.
    """
    flat, row = tiles.reshape(-1), tiles.shape[1] * tiles.shape[2] * TILE
    weights, lanes, z = np.empty((2, 6, CHUNK)), np.empty((6, CHUNK)), np.empty(CHUNK)
    corner, start = np.empty((2, CHUNK), np.int64), np.empty(CHUNK, np.int64)
    for begin in range(0, x.shape[1], CHUNK):
        count = min(CHUNK, x.shape[1] - begin)
        for m in range(2):
            w = weights[m]
            for n in range(count):
                z[n] = others[m, owner[begin + n]]
            for n in range(count):
                corner[m, n], z[n] = _held(z[n], first[m], rate[m], tiles.shape[2 * m] - 5)
            for n in range(count):
                w[0, n], w[1, n], w[2, n], w[3, n], w[4, n], w[5, n] = quintic(z[n])
        for p in range(x.shape[0]):
            # of one axis, whose loops vectorise
            end = begin + count
            here, values, slopes = x[p, begin:end], out[0, p, begin:end], out[1, p, begin:end]
            for n in range(count):
                k, z[n] = _held(here[n], first[2], rate[2], cells)
                tile = (corner[0, n] * tiles.shape[1] + k // LANES) * tiles.shape[2] + corner[1, n]
                start[n] = tile * TILE + k % LANES
            for n in range(count):
                eight = patch_lanes(flat, start[n], row, TILE, _six(weights[0], n), _six(weights[1], n))
                for m in range(6):
                    lanes[m, n] = eight[m]
            for n in range(count):
                value, slope = quintic_at(polynomial_of(_six(lanes, n)), z[n])
                values[n], slopes[n] = value, slope * rate[2]


@njit(cache=True, nogil=True, fastmath=CONTRACT, error_model="numpy")
def fill_pieces(pieces: FloatArray, first: float, rate: float, owner: Any, x: FloatArray, out: FloatArray) -> None:
    """The same of the quintics of owners, shape (owners, cells, 6)."""
    for p in range(x.shape[0]):
        for n in range(x.shape[1]):
            k, z = _held(x[p, n], first, rate, pieces.shape[1])
            value, slope = quintic_at(pieces[owner[n], k], z)
            out[0, p, n], out[1, p, n] = value, slope * rate
