"""Flow through the gaps of a contact: Reynolds' equation div(h^3 grad p) = 0 on a grid of gaps.

The grid is periodic, or continued by its mirror images. Finite volumes with the harmonic mean of
h^3 at faces; mean pressure gradients along both axes share one sparse factorisation, in the order
of nested dissection of the grid. Closed gaps are found by labelling connected gaps, not by a small
conductance.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import label
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import splu

from mbma_tables.common.arguments import FloatArray, finite_array, require
from mbma_tables.common.errors import InputError
from mbma_tables.common.interrupts import at_once, interruptible

BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int_]
LEAF = 4  # points along the sides of parts of the grid that are not dissected further
# points of a grid up to which two factorisations at a time fit in memory, 0.3 GB each
AT_ONCE = 2**19


class Faces(NamedTuple):
    """Faces between open points and their next neighbours along one axis."""

    joined: BoolArray  # whether a point of the grid has such a face
    near: IntArray  # numbers of these points,
    far: IntArray  # and of their neighbours
    conductance: FloatArray  # flow per 12 viscosity and pressure difference [length^3]


def open_ways(gap: FloatArray) -> tuple[IntArray, tuple[bool, bool]]:
    """Label of the connected gap at each point, and which axes are open.

    The label is 0 where the gap is closed or leads nowhere. A connected gap leads along an axis of
    the periodic cell where a closed path in it winds around that axis.
    """
    labels, number = label(gap > 0)
    joins = _joins_across_edges(labels, number)
    component = np.zeros(number + 1, int)
    winds = np.zeros((number + 1, 2), bool)
    # periodic cell in which a label is first reached, counted from that of the start
    cell: dict[int, tuple[int, int]] = {}
    for start in range(1, number + 1):
        if start in cell:
            continue
        cell[start] = (0, 0)
        pending = [start]
        while pending:
            here = pending.pop()
            component[here] = start
            for there, dx, dy in joins[here]:
                cell_reached = cell[here][0] + dx, cell[here][1] + dy
                if there not in cell:
                    cell[there] = cell_reached
                    pending.append(there)
                # the same gap reached in two cells: a closed path around the periodic cell
                winds[start] |= np.not_equal(cell_reached, cell[there])
    leads_nowhere = ~winds[component].any(axis=1)
    component[leads_nowhere] = 0
    return component[labels], (bool(winds[:, 0].any()), bool(winds[:, 1].any()))


def _joins_across_edges(
    labels: IntArray, number: int
) -> list[list[tuple[int, int, int]]]:
    """Labels that meet each label across an edge of the periodic cell, with the step in cells."""
    joins: list[list[tuple[int, int, int]]] = [[] for _ in range(number + 1)]
    for axis, (dx, dy) in enumerate(((1, 0), (0, 1))):
        last = np.take(labels, -1, axis).tolist()
        first = np.take(labels, 0, axis).tolist()
        pairs = {pair for pair in zip(last, first, strict=True) if all(pair)}
        for before_edge, after_edge in pairs:
            joins[before_edge].append((after_edge, dx, dy))
            joins[after_edge].append((before_edge, -dx, -dy))
    return joins


def flow_conductance(
    gap: ArrayLike, sizes: tuple[float, float] = (1.0, 1.0)
) -> FloatArray:
    """K [length^3] of flow along both axes of a periodic cell; 0 where blocked.

    The flow per width is K dp/(12 viscosity length).

    Parameters
    ----------
    gap : array_like, shape (n, m)
        Gaps [length], zero in contact.
    sizes : pair of float
        Sides of the cell.

    Returns
    -------
    ndarray, shape (2,)

    Raises
    ------
    InputError, OutOfRangeError
        For gaps that are negative, not finite, or on no grid.

    Examples
    --------
    >>> import numpy as np
    >>> from mbma_tables.theories.simulated.reynolds import flow_conductance
    >>> gap = np.full((8, 8), 2.0)
    >>> gap[:, 3] = 0.0  # a ridge in contact, along the first axis
    >>> flow_conductance(gap).round(3).tolist()
    [7.0, 0.0]
    """
    return flow_tensor(gap, sizes)[:2]


def flow_tensor(
    gap: ArrayLike, sizes: tuple[float, float] = (1.0, 1.0), mirrored: bool = False
) -> FloatArray:
    """K of `flow_conductance` along both axes, and K_xy [length^3].

    The gaps are periodic, or `mirrored`: continued by their mirror images. Flow per width along an axis is K_xx or K_yy times the mean pressure gradient along it,
    and K_xy times that along the other one; images have no K_xy.
    """
    values = _checked(gap)
    if not mirrored:
        K, _ = _solved(values, sizes)
        return np.array([K[0, 0], K[1, 1], K[0, 1]])
    both = [functools.partial(_between_mirrors, values, sizes, axis) for axis in (0, 1)]
    if values.size <= AT_ONCE:
        return np.array([*at_once(both), 0.0])
    return np.array([*(along() for along in both), 0.0])


def flow_and_couette(
    gap: ArrayLike, sizes: tuple[float, float] = (1.0, 1.0)
) -> tuple[FloatArray, FloatArray]:
    """K of `flow_conductance`, and the gap h_c of Couette flow.

    Couette flow is that where a smooth face slides over the rough one. At rest beside the rough face, flow is -h_c U/2 at the speed U along an axis, without a
    mean pressure gradient: the pressure of div(h^3 grad p) = 6 viscosity U dh/dx, by
    reciprocity from that of `flow_conductance`. A shear flow factor (Patir, Cheng, J.
    Lubrication Tech. 101 (1979) 220) is (u - h_c)/h_rms, u the mean gap.
    """
    K, couette = _solved(_checked(gap), sizes)
    return np.diagonal(K).copy(), couette


def _checked(gap: ArrayLike) -> FloatArray:
    values = finite_array("gap", gap)
    if values.ndim != 2:
        raise InputError(f"gap must be a grid, got shape {values.shape}")
    require("gap", values, values >= 0, "at least 0")
    return values


def _faces(
    gap: FloatArray, is_open: BoolArray, steps: list[float], mirrored: bool = False
) -> tuple[IntArray, list[Faces]]:
    """Numbers of open points, -1 where closed, and the faces between these along both axes."""
    number = np.full(gap.shape, -1)
    number[is_open] = np.arange(np.count_nonzero(is_open))
    cubes = gap**3
    faces = []
    for axis in (0, 1):
        next_number = np.roll(number, -1, axis)
        joined = (number >= 0) & (next_number >= 0)
        if mirrored:
            # the last points have no next ones
            np.moveaxis(joined, axis, 0)[-1] = False
        # the harmonic mean; a b/(a + b) would underflow where both are tiny
        next_cubes = np.roll(cubes, -1, axis)
        mean_cube = 2 / (1 / cubes[joined] + 1 / next_cubes[joined])
        conductance = mean_cube * steps[1 - axis] / steps[axis]
        faces.append(Faces(joined, number[joined], next_number[joined], conductance))
    return number, faces


def _steps(gap: FloatArray, sizes: tuple[float, float]) -> list[float]:
    """Distances of neighbouring points along both axes."""
    return [side / points for side, points in zip(sizes, gap.shape, strict=True)]


@functools.lru_cache(4)
def _order(shape: tuple[int, int]) -> IntArray:
    """Points of a periodic grid in the order of nested dissection.

    The last ones are those on the line between two halves, and so on in each half, so that
    little is filled in where points are eliminated in this order.
    """
    number = np.arange(shape[0] * shape[1]).reshape(shape)
    parts: list[IntArray] = []

    def dissect(part: IntArray) -> None:
        if max(part.shape) <= LEAF:
            parts.append(part.ravel())
            return
        long = part if part.shape[0] >= part.shape[1] else part.T
        middle = long.shape[0] // 2
        dissect(long[:middle])
        dissect(long[middle + 1 :])
        parts.append(long[middle])

    # the last row and column are between a periodic grid's cells
    dissect(number[:-1, :-1])
    order = np.concatenate([*parts, number[-1], number[:-1, -1]])
    order.flags.writeable = False
    return order


def _in_order(number: IntArray) -> IntArray:
    """Numbers of open points in the order in which they are eliminated."""
    numbers = number.ravel()[_order(number.shape)]
    return numbers[numbers >= 0]


def _solution(
    faces: list[Faces],
    of_ends: FloatArray | float,
    kept: IntArray,
    flow: FloatArray,
) -> FloatArray:
    """Pressures of the points `kept`, in this order, of which these flow out; others have none.

    `of_ends` are conductances to the ends, on the diagonal.
    """
    near = np.concatenate([along.near for along in faces])
    far = np.concatenate([along.far for along in faces])
    conductance = np.concatenate([along.conductance for along in faces])
    places = np.append(near, far), np.append(far, near)
    matrix = coo_array((-np.append(conductance, conductance), places))
    matrix = matrix - diags_array(matrix.sum(axis=1) - of_ends)
    compressed = matrix.tocsc()[kept][:, kept]

    def solved() -> FloatArray:
        # factors are made and freed in one thread: scipy does not free those of another one
        factors = splu(
            compressed,
            permc_spec="NATURAL",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        return np.asarray(factors.solve(flow[kept]))

    # seconds for a large map
    return interruptible(solved)


def _net(faces: Faces, flow: FloatArray, count: int) -> FloatArray:
    """Flow through faces, summed up by point: out of the near ones, into the far ones."""
    out = np.bincount(faces.near, flow, count)
    return np.asarray(out - np.bincount(faces.far, flow, count), float)


def _couette(gap: FloatArray, axis: int, joined: BoolArray) -> FloatArray:
    """Gap of Couette flow at faces: mean of h^-2 over mean of h^-3 of both sides, without overflow."""
    near_gap = gap[joined]
    far_gap = np.roll(gap, -1, axis)[joined]
    wider = np.maximum(near_gap, far_gap)
    ratio = np.minimum(near_gap, far_gap) / wider
    return np.asarray(wider * ratio * (1 + ratio**2) / (1 + ratio**3))


def _solved(gap: FloatArray, sizes: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """K of a periodic cell, shape (2, 2), and h_c along both axes."""
    owner, along = open_ways(gap)
    if not any(along):
        return np.zeros((2, 2)), np.zeros(2)
    steps = _steps(gap, sizes)
    number, faces = _faces(gap, owner > 0, steps)
    count = int(np.count_nonzero(owner))
    # net flow out of points, by a uniform pressure gradient and by sliding, along both axes
    forces = np.zeros((count, 2))
    carried = np.zeros((count, 2))
    # flow through all faces, by a uniform pressure gradient and by sliding
    uniform = np.zeros(2)
    mean = np.zeros(2)
    for axis, along_axis in enumerate(faces):
        conductance = along_axis.conductance
        carried_gap = _couette(gap, axis, along_axis.joined) * steps[1 - axis]
        carried[:, axis] = _net(along_axis, carried_gap, count)
        mean[axis] = carried_gap.sum() * steps[axis]
        forces[:, axis] = _net(along_axis, conductance, count) * steps[axis]
        uniform[axis] = conductance.sum() * steps[axis] ** 2
    # pressure is free by a constant in each connected gap: one point of each has none
    _, first_points = np.unique(owner[owner > 0], return_index=True)
    free = _in_order(number)
    free = free[~np.isin(free, first_points)]
    pressure = _solution(faces, 0.0, free, forces)
    area = sizes[0] * sizes[1]
    K = (np.diag(uniform) - forces[free].T @ pressure) / area
    couette = (mean - np.sum(carried[free] * pressure, axis=0)) / area
    return np.where(np.outer(along, along), K, 0.0), np.where(along, couette, 0.0)


def _between_mirrors(gap: FloatArray, sizes: tuple[float, float], axis: int) -> float:
    """K along an axis of gaps continued by their mirror images, between the mirrors at its ends."""
    labels, _ = label(gap > 0)
    # gaps that reach both ends
    through = np.intersect1d(labels.take(0, axis), labels.take(-1, axis))
    is_open = np.isin(labels, np.setdiff1d(through, 0))
    if not is_open.any():
        return 0.0
    steps = _steps(gap, sizes)
    number, faces = _faces(gap, is_open, steps, mirrored=True)
    count = int(np.count_nonzero(is_open))
    # conductances of points to the first and to the last end
    ends = []
    for side in (0, -1):
        number_at_end = np.take(number, side, axis)
        open_at_end = number_at_end >= 0
        gap_at_end = np.take(gap, side, axis)[open_at_end]
        # half a step from a mirror, where pressure is that of the end
        half = 2 * gap_at_end**3 * steps[1 - axis] / steps[axis]
        ends.append(np.bincount(number_at_end[open_at_end], half, count).astype(float))
    first_end, last_end = ends
    order = _in_order(number)
    pressure = _solution(faces, first_end + last_end, order, last_end)
    return float(first_end[order] @ pressure * sizes[axis] / sizes[1 - axis])
