"""Flow through the gaps of a contact: Reynolds' equation div(h^3 grad p) = 0 on a periodic grid of gaps.

Finite volumes with the harmonic mean of h^3 at faces; mean pressure gradients along both
axes share one sparse factorisation. Closed gaps are found by labelling connected gaps, not
by a small conductance.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import label
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import splu

from mbma_tables.common.arguments import FloatArray, finite_array, require
from mbma_tables.common.errors import InputError
from mbma_tables.common.interrupts import interruptible


def open_ways(gap: FloatArray) -> tuple[np.ndarray, tuple[bool, bool]]:
    """Label of the connected gap at each point, 0 where closed or leading nowhere, and which axes are open.

    A connected gap leads along an axis of the periodic cell where a closed path in it winds
    around that axis.
    """
    labels, number = label(gap > 0)
    joins: list[list[tuple[int, int, int]]] = [[] for _ in range(number + 1)]
    for axis, (dx, dy) in enumerate(((1, 0), (0, 1))):
        last, first = labels.take(-1, axis).tolist(), labels.take(0, axis).tolist()
        for a, b in {(a, b) for a, b in zip(last, first, strict=True) if a and b}:
            joins[a].append((b, dx, dy))
            joins[b].append((a, -dx, -dy))
    component = np.zeros(number + 1, int)
    winds = np.zeros((number + 1, 2), bool)
    place: dict[int, tuple[int, int]] = {}
    for start in range(1, number + 1):
        if start in place:
            continue
        place[start], heap = (0, 0), [start]
        while heap:
            here = heap.pop()
            component[here] = start
            for there, dx, dy in joins[here]:
                met = place[here][0] + dx, place[here][1] + dy
                if there not in place:
                    place[there] = met
                    heap.append(there)
                # the same gap reached in two cells: a closed path around the periodic cell
                winds[start] |= np.not_equal(met, place[there])
    component[~winds[component].any(axis=1)] = 0
    return component[labels], (bool(winds[:, 0].any()), bool(winds[:, 1].any()))


def flow_conductance(
    gap: ArrayLike, sizes: tuple[float, float] = (1.0, 1.0)
) -> FloatArray:
    """K [length^3] of flow per width K dp/(12 viscosity length) along both axes of a periodic cell; 0 where blocked.

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
    """K of `flow_conductance` along both axes, and K_xy [length^3], of gaps that may be continued by mirror images.

    Flow per width along an axis is K_xx or K_yy times the mean pressure gradient along it,
    and K_xy times that along the other one; images have no K_xy.
    """
    values = _checked(gap)
    if not mirrored:
        K = _solved(values, sizes)[0]
        return np.array([K[0, 0], K[1, 1], K[0, 1]])
    return np.array([*(_between_mirrors(values, sizes, axis) for axis in (0, 1)), 0.0])


def flow_and_couette(
    gap: ArrayLike, sizes: tuple[float, float] = (1.0, 1.0)
) -> tuple[FloatArray, FloatArray]:
    """K of `flow_conductance`, and the gap h_c that Couette flow sees where a smooth face slides over the rough one.

    At rest beside the rough face, flow is -h_c U/2 at the speed U along an axis, without a
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
    gap: FloatArray, open_: Any, sizes: tuple[float, float], mirrored: bool = False
) -> tuple[np.ndarray, list[float], list[tuple[Any, Any, Any, FloatArray]]]:
    """Numbers of open points, steps, and for each axis: points with an open neighbour, both numbers, conductance."""
    steps = [side / points for side, points in zip(sizes, gap.shape, strict=True)]
    number, cubes, faces = np.full(gap.shape, -1), gap**3, []
    number[open_] = np.arange(np.count_nonzero(open_))
    for axis in (0, 1):
        beside = np.roll(number, -1, axis)
        joined = (number >= 0) & (beside >= 0)
        if mirrored:
            joined[(-1, slice(None)) if axis == 0 else (slice(None), -1)] = False
        # a b/(a + b) would underflow where both are tiny
        face = (
            2
            / (1 / cubes[joined] + 1 / np.roll(cubes, -1, axis)[joined])
            * steps[1 - axis]
            / steps[axis]
        )
        faces.append((joined, number[joined], beside[joined], face))
    return number, steps, faces


def _factors(faces: list[tuple[Any, Any, Any, FloatArray]], more: Any, free: Any) -> Any:
    """Factors of the matrix of faces, `more` on its diagonal, without the rows that are not `free`."""
    i, j, face = (np.concatenate([own[k] for own in faces]) for k in (1, 2, 3))
    matrix = coo_array((-np.append(face, face), (np.append(i, j), np.append(j, i))))
    matrix = matrix - diags_array(matrix.sum(axis=1) - more)
    kept = matrix.tocsc() if free is None else matrix.tocsc()[free][:, free]
    # seconds for a large map
    return interruptible(
        lambda: splu(
            kept,
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    )


def _solved(gap: FloatArray, sizes: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """K of a periodic cell, shape (2, 2), and h_c along both axes."""
    owner, along = open_ways(gap)
    if not any(along):
        return np.zeros((2, 2)), np.zeros(2)
    _, steps, faces = _faces(gap, owner > 0, sizes)
    count = np.count_nonzero(owner)
    forces, carried = np.zeros((2, count, 2))
    uniform, mean = np.zeros((2, 2))
    for axis, (joined, i, j, face) in enumerate(faces):
        one, other = gap[joined], np.roll(gap, -1, axis)[joined]
        wider, ratio = (
            np.maximum(one, other),
            np.minimum(one, other) / np.maximum(one, other),
        )
        couette = wider * ratio * (1 + ratio**2) / (1 + ratio**3) * steps[1 - axis]
        carried[:, axis] = np.bincount(i, couette, count) - np.bincount(j, couette, count)
        mean[axis] = couette.sum() * steps[axis]
        forces[:, axis] = (
            np.bincount(i, face, count) - np.bincount(j, face, count)
        ) * steps[axis]
        uniform[axis] = face.sum() * steps[axis] ** 2
    # pressure is free by a constant in each connected gap
    free = np.delete(np.arange(count), np.unique(owner[owner > 0], return_index=True)[1])
    pressure = _factors(faces, 0.0, free).solve(forces[free])
    area = sizes[0] * sizes[1]
    found = (np.diag(uniform) - forces[free].T @ pressure) / area
    couette = (mean - np.sum(carried[free] * pressure, axis=0)) / area
    return np.where(np.outer(along, along), found, 0.0), np.where(along, couette, 0.0)


def _between_mirrors(gap: FloatArray, sizes: tuple[float, float], axis: int) -> float:
    """K along an axis of gaps continued by their mirror images, between the mirrors at its ends."""
    labels, _ = label(gap > 0)
    open_ = np.isin(
        labels,
        np.setdiff1d(np.intersect1d(labels.take(0, axis), labels.take(-1, axis)), 0),
    )
    if not open_.any():
        return 0.0
    number, steps, faces = _faces(gap, open_, sizes, True)
    ends: list[Any] = []
    for side in (0, -1):
        # half a step from a mirror, where pressure is that of the end
        own = number.take(side, axis)
        half = 2 * np.take(gap, side, axis)[own >= 0] ** 3 * steps[1 - axis] / steps[axis]
        ends.append(np.bincount(own[own >= 0], half, np.count_nonzero(open_)))
    pressure = _factors(faces, ends[0] + ends[1], None).solve(ends[1])
    return float(ends[0] @ pressure * sizes[axis] / sizes[1 - axis])
