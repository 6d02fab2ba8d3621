"""Flow through the gaps of a contact: Reynolds' equation div(h^3 grad p) = 0 on a periodic grid of gaps.

Finite volumes with the harmonic mean of h^3 at faces; mean pressure gradients along both axes share one sparse
factorisation. Closed gaps are found by labelling connected gaps, not by a small conductance.
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


def open_ways(gap: FloatArray) -> tuple[np.ndarray, tuple[bool, bool]]:
    """Label of the connected gap at each point, 0 where closed or leading nowhere, and which axes are open.

    A connected gap leads along an axis of the periodic cell where a closed path in it winds around that axis.
    """
    labels, number = label(gap > 0)
    joins: list[list[tuple[int, int, int]]] = [[] for _ in range(number + 1)]
    for axis in (0, 1):
        last, first = labels.take(-1, axis), labels.take(0, axis)
        for a, b in {(int(a), int(b)) for a, b in zip(last, first, strict=True) if a and b}:
            joins[a].append((b, *((1, 0) if axis == 0 else (0, 1))))
            joins[b].append((a, *((-1, 0) if axis == 0 else (0, -1))))
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
    along: Any = winds.any(axis=0)
    return component[labels], (bool(along[0]), bool(along[1]))


def flow_conductance(gap: ArrayLike, sizes: tuple[float, float] = (1.0, 1.0)) -> FloatArray:
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
    >>> from mbma_tables.laws.reynolds import flow_conductance
    >>> gap = np.full((8, 8), 2.0)
    >>> gap[:, 3] = 0.0  # a ridge in contact, along the first axis
    >>> flow_conductance(gap).round(3).tolist()
    [7.0, 0.0]
    """
    return flow_and_couette(gap, sizes)[0]


def flow_and_couette(gap: ArrayLike, sizes: tuple[float, float] = (1.0, 1.0)) -> tuple[FloatArray, FloatArray]:
    """K of `flow_conductance`, and the gap h_c that Couette flow sees where a smooth face slides over the rough one.

    At rest beside the rough face, flow is -h_c U/2 at the speed U along an axis, without a mean pressure gradient: the
    pressure of div(h^3 grad p) = 6 viscosity U dh/dx, by reciprocity from that of `flow_conductance`. A shear flow
    factor (Patir, Cheng, J. Lubrication Tech. 101 (1979) 220) is (u - h_c)/h_rms, u the mean gap.
    """
    gap = finite_array("gap", gap)
    if gap.ndim != 2:
        raise InputError(f"gap must be a grid, got shape {gap.shape}")
    require("gap", gap, gap >= 0, "at least 0")
    owner, along = open_ways(gap)
    if not any(along):
        return np.zeros(2), np.zeros(2)
    steps = [side / points for side, points in zip(sizes, gap.shape, strict=True)]
    number = np.full(gap.shape, -1)
    number[owner > 0] = np.arange(np.count_nonzero(owner))
    cubes = gap**3
    rows, columns, values = [], [], []
    forces, uniform = np.zeros((np.count_nonzero(owner), 2)), np.zeros(2)
    carried, mean = np.zeros_like(forces), np.zeros(2)
    for axis in (0, 1):
        beside, k = np.roll(cubes, -1, axis), np.roll(number, -1, axis)
        joined = (number >= 0) & (k >= 0)
        a, b = cubes[joined], beside[joined]
        # a b/(a + b) would underflow where both are tiny
        face = 2 / (1 / a + 1 / b) * steps[1 - axis] / steps[axis]
        i, j = number[joined], k[joined]
        one, other = gap[joined], np.roll(gap, -1, axis)[joined]
        wider, ratio = np.maximum(one, other), np.minimum(one, other) / np.maximum(one, other)
        couette = wider * ratio * (1 + ratio**2) / (1 + ratio**3) * steps[1 - axis]
        carried[:, axis] = np.bincount(i, couette, len(forces)) - np.bincount(j, couette, len(forces))
        mean[axis] = couette.sum() * steps[axis]
        rows += [i, j]
        columns += [j, i]
        values += [-face, -face]
        forces[:, axis] = np.bincount(i, face, len(forces)) - np.bincount(j, face, len(forces))
        forces[:, axis] *= steps[axis]
        uniform[axis] = face.sum() * steps[axis] ** 2
    matrix = coo_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))))
    matrix = matrix - diags_array(matrix.sum(axis=1))
    # pressure is determined up to a constant in each connected gap
    fixed = np.unique(owner[owner > 0], return_index=True)[1]
    free = np.delete(np.arange(len(forces)), fixed)
    factors = splu(
        matrix.tocsc()[free][:, free],
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    pressure = factors.solve(forces[free])
    found = (uniform - np.sum(forces[free] * pressure, axis=0)) / (sizes[0] * sizes[1])
    couette = (mean - np.sum(carried[free] * pressure, axis=0)) / (sizes[0] * sizes[1])
    return np.where(along, found, 0.0), np.where(along, couette, 0.0)
