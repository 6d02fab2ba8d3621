"""Adaptive Gauss-Kronrod quadrature of one compiled total: its intervals, their map, and how they are refined.

Below the floor of zeta_d the approach is mapped by x = scale sinh(t)^2, a power at 0 and geometric beyond the boundary
layer; above it the integrand is little more than a Gaussian of x, and x itself serves.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import njit
from mbma_tables.elementary import expm1
from mbma_tables.models.universal_kernel import OK, UNRESOLVED
from mbma_tables.totals.gauss_kronrod import GAUSS_21, GAUSS_31, KRONROD_21, KRONROD_31, NODES_21, NODES_31

MAX_INTERVALS = 200
WORK = 13  # rows of numbers at the nodes of a rule
STRETCH = 8.0  # the map's scale in boundary layers zeta_1^(-H): fewest nodes over random surfaces
NARROW = 2.5  # in h_rms: above the floor of zeta_d, the smaller rule resolves a Gaussian this wide to 1e-8
SAFETY = 4.0  # a Kronrod sum errs by at most 3 (difference to Gauss)^1.5, seen over random surfaces: 4^1.5 = 8

Bools = NDArray[np.bool_]


class Gap(NamedTuple):
    """A gap of a surface in units of h_rms."""

    compression: float  # (h_max - d)/h_rms
    peak: float  # h_max/h_rms


class Interval(NamedTuple):
    """An interval of the mapped approach, and whether zeta_d and zeta_u are at their floors in it."""

    low: float
    high: float
    floor_d: bool
    floor_u: bool


@njit(cache=True, error_model="numpy")
def to_angle(x: float, scale: float) -> float:
    """The t at which scale sinh(t)^2 is x."""
    return math.asinh(math.sqrt(x / scale))


@njit(cache=True, error_model="numpy")
def first_intervals(
    compression: float, kink_d: float, kink_u: float, scale: float, bounds: FloatArray, floors: Bools
) -> int:
    """Fill `bounds` and `floors` (of zeta_d, zeta_u) with the pieces of [0, compression] between the kinks; count."""
    edges = (0.0, min(kink_d, kink_u, compression), min(max(kink_d, kink_u), compression), compression)
    count = 0
    for piece in range(3):
        low, high = edges[piece], edges[piece + 1]
        if high > low:
            middle = 0.5 * (low + high)
            floors[count, 0], floors[count, 1] = middle > kink_d, middle > kink_u
            if not floors[count, 0]:
                low, high = to_angle(low, scale), to_angle(high, scale)
            bounds[count, 0], bounds[count, 1] = low, high
            count += 1
    return count


@njit(cache=True, error_model="numpy")
def halve(interval: int, count: int, bounds: FloatArray, floors: Bools) -> None:
    """Cut an interval in two; the second half becomes number `count`."""
    middle = 0.5 * (bounds[interval, 0] + bounds[interval, 1])
    bounds[count, 0], bounds[count, 1] = middle, bounds[interval, 1]
    bounds[interval, 1] = middle
    floors[count, 0], floors[count, 1] = floors[interval, 0], floors[interval, 1]


@njit(cache=True, error_model="numpy")
def rule_for(interval: Interval) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Nodes, Kronrod weights and Gauss weights on [-1, 1] for an interval."""
    if interval.floor_d and interval.high - interval.low < NARROW:
        return NODES_21, KRONROD_21, GAUSS_21
    return NODES_31, KRONROD_31, GAUSS_31


@njit(cache=True, error_model="numpy", forceinline=True)
def approach_at(t: float, straight: bool, scale: float) -> tuple[float, float]:
    """X = delta/h_rms and dx/dt at a node."""
    # sinh and cosh by expm1: exponentials would cancel at small t
    more = expm1(t)
    rise = 0.5 * (more + more / (more + 1.0))
    steep = scale * rise * (more + 1.0 + 1.0 / (more + 1.0))
    return (t, 1.0) if straight else (scale * rise * rise, steep)


@njit(cache=True, error_model="numpy")
def error_of(force: float, gauss_force: float, area: float, gauss_area: float) -> float:
    """Relative error of both Kronrod sums: both integrands resolve alike, and one may agree by chance."""
    difference = max(abs(gauss_force / force - 1.0), abs(gauss_area / area - 1.0))
    error: float = min(difference, (SAFETY * difference) ** 1.5)
    return error


# compiled as part of its callers: `rule` is one of their functions
@njit(inline="always", error_model="numpy")
def refine(
    rule: Any, which: int, gap: Gap, rtol: float, surface: Any, near: Any, table: Any, out: FloatArray
) -> tuple[int, float, int]:
    """Integrate over the approaches at a gap to `rtol`; status, bound on the relative error, islands evaluated.

    ``rule(which, interval, gap, surface, near, table, work, part)`` puts its Kronrod sums into `part`, shaped like
    `out`: a row for force and one for area, whose first column is the integral with K1. It may use `work`. It returns
    a status, the relative error of the sums, that of the table, and the nodes.
    """
    islands = 0
    bounds = np.empty((MAX_INTERVALS, 2))
    parts = np.empty((MAX_INTERVALS, 2, out.shape[1]))
    errors, work = np.empty(MAX_INTERVALS), np.empty((WORK, NODES_31.size))
    floors = np.empty((MAX_INTERVALS, 2), dtype=np.bool_)
    fresh = np.ones(MAX_INTERVALS, dtype=np.bool_)
    count = first_intervals(gap.compression, surface.kink_d, surface.kink_u, surface.map_scale, bounds, floors)
    table_error = 0.0
    while True:
        force = area = force_error = area_error = 0.0
        for k in range(count):
            if fresh[k]:
                interval = Interval(bounds[k, 0], bounds[k, 1], floors[k, 0], floors[k, 1])
                status, errors[k], own_error, nodes = rule(which, interval, gap, surface, near, table, work, parts[k])
                islands += nodes
                if status != OK:
                    return status, math.nan, islands
                table_error = max(table_error, own_error)
                fresh[k] = False
            force += parts[k, 0, 0]
            area += parts[k, 1, 0]
            force_error += parts[k, 0, 0] * errors[k]
            area_error += parts[k, 1, 0] * errors[k]
        empty = not (force > 0.0 and area > 0.0)
        if empty or (force_error <= rtol * force and area_error <= rtol * area):
            break
        present = count
        for k in range(present):
            share = present * errors[k]
            if parts[k, 0, 0] * share > rtol * force or parts[k, 1, 0] * share > rtol * area:
                if count == MAX_INTERVALS:
                    return UNRESOLVED, math.nan, islands
                halve(k, count, bounds, floors)
                fresh[k] = True
                count += 1
    for row in range(2):
        for column in range(out.shape[1]):
            total = 0.0
            for k in range(count):
                total += parts[k, row, column]
            out[row, column] = total
    if empty:
        return OK, 0.0, islands
    return OK, max(force_error / force, area_error / area) + table_error, islands
