"""One surface, one gap, in one compiled pass: adaptive Gauss-Kronrod quadrature over delta (Eqs. 44-50).

F/(A0 E* q0 s) and A/A0 are functions of H, log(zeta_1), (h_max - d)/h_rms and h_max/h_rms, and so are their
derivatives. The last two enter through the Gaussian and the upper limit, in closed form. No work space is shared.

Below the floor of zeta_d the approach is mapped by x = scale sinh(t)^2, a power at 0 and geometric beyond the boundary
layer; above it the integrand is little more than a Gaussian of x, and x itself serves.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import REORDER, njit
from mbma_tables.elementary import exp, expm1
from mbma_tables.models.universal_kernel import OK, UNRESOLVED, Table, universal_phi
from mbma_tables.surfaces.readings import PRINTED, ReadingNumbers
from mbma_tables.totals.gauss_kronrod import GAUSS_21, GAUSS_31, KRONROD_21, KRONROD_31, NODES_21, NODES_31
from mbma_tables.totals.kernel import (
    ROOT_TWO_PI,
    SurfaceConstants,
    island_density,
    island_height,
    island_node,
    m2_slopes,
    node_slopes,
    surface_constants,
)

MAX_INTERVALS = 200
ERROR, NOT_YET = 4, -1.0  # of an interval's row: where its relative error stands, and what stands there before
WORK = 13  # rows of numbers at the nodes of a rule
NARROW = 2.5  # in h_rms: above the floor of zeta_d, the smaller rule resolves a Gaussian this wide to 1e-8
LEAST = -700.0  # of exponents: below it a Gaussian is nothing
SAFETY = 4.0  # a Kronrod sum errs by at most 3 (difference to Gauss)^1.5, seen over random surfaces: 4^1.5 = 8
SAFETY_BELOW, PAPER_FLOOR = 400.0, PRINTED.floor_d  # the same of a reading with a lower floor of zeta_d

# columns of force and area: the total, its derivatives, and what of it lies below the floor of zeta_d; over nodes,
# derivatives are by H at given e = zeta_1^(-2H), and by log(e)
BY_HURST, BY_LOG_ZETA, BY_COMPRESSION, BY_PEAK, BELOW_KINK = range(1, 6)
COLUMNS, BY_LOG_E = 6, BY_LOG_ZETA

# one node more than the rule has, so that loops over them end with a whole vector
PADDED_31 = np.append(NODES_31, 0.0)


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
def first_intervals(compression: float, surface: SurfaceConstants, pieces: FloatArray) -> int:
    """Fill rows, as `Interval` and NOT_YET, with the pieces of [0, compression] between the kinks; count."""
    kink_d, kink_u, scale = surface.kink_d, surface.kink_u, surface.map_scale
    edges = (0.0, min(kink_d, kink_u, compression), min(max(kink_d, kink_u), compression), compression)
    count = 0
    for piece in range(3):
        low, high = edges[piece], edges[piece + 1]
        if high > low:
            middle = 0.5 * (low + high)
            if not middle > kink_d:
                low, high = math.asinh(math.sqrt(low / scale)), math.asinh(math.sqrt(high / scale))
            pieces[count, 0], pieces[count, 1], pieces[count, ERROR] = low, high, NOT_YET
            pieces[count, 2], pieces[count, 3] = middle > kink_d, middle > kink_u
            count += 1
    return count


@njit(cache=True, error_model="numpy")
def rule_for(interval: Interval) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Nodes, perhaps one too many, Kronrod weights and Gauss weights on [-1, 1] for an interval."""
    if interval.floor_d and interval.high - interval.low < NARROW:
        return NODES_21, KRONROD_21, GAUSS_21
    return PADDED_31, KRONROD_31, GAUSS_31


@njit(cache=True, error_model="numpy")
def safety_of(floor_d: float) -> float:
    """What differences to the Gauss rule are multiplied by, for a reading's floor of zeta_d."""
    return SAFETY if floor_d >= PAPER_FLOOR else SAFETY_BELOW


@njit(cache=True, fastmath=REORDER, error_model="numpy")
def fill_nodes(interval: Interval, gap: Gap, surface: SurfaceConstants, slopes: Any, out: FloatArray) -> None:
    """X, mu, what force and area add per Phi_F and Phi_A, and how both rise with the compression, as rows.

    Then, with `slopes`, `node_slopes` by H and by log(e). A loop over the nodes of an interval that vectorises: no
    branch, no call.
    """
    low, high, floor_d, floor_u = interval
    nodes = rule_for(interval)[0]
    half, centre = 0.5 * (high - low), 0.5 * (high + low)
    rms_over_s, scale = surface.rms_over_s, surface.map_scale
    for k in range(nodes.size):
        t = centre + half * nodes[k]
        # sinh and cosh by expm1: exponentials would cancel at small t
        more = expm1(t)
        rise = 0.5 * (more + more / (more + 1.0))
        steep = scale * rise * (more + 1.0 + 1.0 / (more + 1.0))
        x, stretch = (t, 1.0) if floor_d else (scale * rise * rise, steep)
        node = island_node(x, floor_d, floor_u, surface)
        height = island_height(x, node.h_d, node.sigma_d, gap, rms_over_s)
        share = -0.5 * height * height
        # d(delta/s) = rms_over_s dx
        weight = node.D_d / (ROOT_TWO_PI * node.sigma_d) * rms_over_s * stretch * half
        weight *= exp(share) if share > LEAST else 0.0
        out[0, k], out[1, k] = node.X, node.mu
        out[2, k], out[3, k] = node.force * weight, node.area * weight
        out[4, k] = height * rms_over_s / node.sigma_d
        if slopes is not None:
            out[5, k], out[6, k], out[7, k], out[8, k] = node_slopes(True, height, floor_d, floor_u, node, surface)
            out[9, k], out[10, k], out[11, k], out[12, k] = node_slopes(False, height, floor_d, floor_u, node, surface)


@njit(cache=True, fastmath=REORDER, error_model="numpy")
def _rule(
    interval: Interval,
    gap: Gap,
    surface: SurfaceConstants,
    slopes: Any,
    table: Table,
    work: FloatArray,
    part: FloatArray,
) -> tuple[int, float, float, int]:
    """One Kronrod rule over an interval: its sums, with K1, into `part`, see `total`; `work` is written over.

    Returns a status, the relative error of the sums, that of the table, and the nodes.
    """
    _, kronrod, gauss = rule_for(interval)
    count = kronrod.size
    fill_nodes(interval, gap, surface, slopes, work)
    for column in range(part.shape[1]):
        part[0, column] = part[1, column] = 0.0
    force = area = gauss_force = gauss_area = table_error = 0.0
    for k in range(count):
        status, phi_F, F_X, F_mu, phi_A, A_X, A_mu, error = universal_phi(work[0, k], work[1, k], table, slopes)
        if status != OK:
            return status, math.nan, math.nan, count
        f, g = work[2, k] * phi_F, work[3, k] * phi_A
        force += kronrod[k] * f
        area += kronrod[k] * g
        gauss_force += gauss[k] * f
        gauss_area += gauss[k] * g
        table_error = max(table_error, error)
        if slopes is not None:
            for row, phi, by_X, by_mu in ((0, phi_F, F_X, F_mu), (1, phi_A, A_X, A_mu)):
                share, own = kronrod[k] * work[2 + row, k], part[row]
                own[BY_COMPRESSION] += share * phi * work[4, k]
                own[BY_HURST] += share * (phi * work[7 + row, k] + by_X * work[5, k] + by_mu * work[6, k])
                own[BY_LOG_E] += share * (phi * work[11 + row, k] + by_X * work[9, k] + by_mu * work[10, k])
    part[0, 0], part[1, 0] = force, area
    for row in range(2):
        for column in range(part.shape[1]):
            part[row, column] *= 1.0 if interval.floor_d else surface.jacobian
        if slopes is not None:
            part[row, BELOW_KINK] = 0.0 if interval.floor_d else part[row, 0]
    if not (force > 0.0 and area > 0.0):
        return OK, 0.0, table_error, count
    # of both sums: both integrands resolve alike, and one may agree by chance
    difference = max(abs(gauss_force / force - 1.0), abs(gauss_area / area - 1.0))
    return OK, min(difference, (safety_of(surface.reading.floor_d) * difference) ** 1.5), table_error, count


@njit(cache=True, error_model="numpy")
def total(
    gap: Gap, rtol: float, surface: SurfaceConstants, slopes: Any, table: Table, out: FloatArray
) -> tuple[int, float, int]:
    """Integrate over the approaches at a gap to `rtol`; status, bound on the relative error, islands evaluated.

    `out` receives F/(A0 E* q0 s) and A/A0, one row each, with sums for their derivatives (2, COLUMNS) where `slopes` is
    True, without (2, 1) where it is None: the code of each is compiled by itself.
    """
    islands = 0
    pieces, parts = np.empty((MAX_INTERVALS, 5)), np.empty((MAX_INTERVALS, 2, out.shape[1]))
    work = np.empty((WORK, PADDED_31.size))
    count = first_intervals(gap.compression, surface, pieces)
    table_error = 0.0
    while True:
        for k in range(count):
            if pieces[k, ERROR] == NOT_YET:
                interval = Interval(pieces[k, 0], pieces[k, 1], pieces[k, 2] > 0.0, pieces[k, 3] > 0.0)
                status, pieces[k, ERROR], known, nodes = _rule(interval, gap, surface, slopes, table, work, parts[k])
                islands += nodes
                if status != OK:
                    return status, math.nan, islands
                table_error = max(table_error, known)
        for column in range(out.shape[1]):
            out[0, column] = out[1, column] = 0.0
        force_error = area_error = 0.0
        for k in range(count):
            for row in range(2):
                for column in range(out.shape[1]):
                    out[row, column] += parts[k, row, column]
            force_error += parts[k, 0, 0] * pieces[k, ERROR]
            area_error += parts[k, 1, 0] * pieces[k, ERROR]
        force, area = out[0, 0], out[1, 0]
        empty = not (force > 0.0 and area > 0.0)
        if empty or (force_error <= rtol * force and area_error <= rtol * area):
            break
        present = count
        for k in range(present):
            share = present * pieces[k, ERROR]
            if parts[k, 0, 0] * share > rtol * force or parts[k, 1, 0] * share > rtol * area:
                if count == MAX_INTERVALS:
                    return UNRESOLVED, math.nan, islands
                # the second half becomes number `count`
                middle = 0.5 * (pieces[k, 0] + pieces[k, 1])
                pieces[count, 0], pieces[count, 1], pieces[k, 1] = middle, pieces[k, 1], middle
                pieces[count, 2], pieces[count, 3] = pieces[k, 2], pieces[k, 3]
                pieces[k, ERROR] = pieces[count, ERROR] = NOT_YET
                count += 1
    if empty:
        return OK, 0.0, islands
    # no less than was asked for: sums of an interval may agree by chance
    return OK, max(force_error / force, area_error / area, rtol) + table_error, islands


@njit(cache=True, error_model="numpy")
def _integrand(x: float, gap: Gap, surface: SurfaceConstants, table: Table) -> tuple[int, tuple[float, float]]:
    """Status and the integrands of force and area over x = delta/h_rms, at the floor of zeta_d or next to it."""
    floor_d = x >= surface.kink_d
    node = island_node(x, floor_d, x > surface.kink_u, surface)
    status, phi_F, _, _, phi_A, _, _, _ = universal_phi(node.X, node.mu, table, None)
    height = island_height(x, node.h_d, node.sigma_d, gap, surface.rms_over_s)
    weight = island_density(height, node.D_d, node.sigma_d) * surface.rms_over_s
    return status, (node.force * phi_F * weight, node.area * phi_A * weight)


@njit(cache=True, error_model="numpy")
def _end_slopes(gap: Gap, surface: SurfaceConstants, table: Table, out: FloatArray) -> int:
    """Turn sums over nodes into derivatives: the ends of the integral move, as do K1 and `eta_factor`; a status."""
    H, e, L = surface.hurst, surface.e, surface.log_zeta_1
    # the upper limit moves with the compression, the kink with H and zeta_1
    status, edge = _integrand(gap.compression, gap, surface, table)
    at_kink = (0.0, 0.0)
    K1 = 1.0 if gap.compression > surface.kink_d else surface.jacobian
    if status == OK and surface.kink_d < gap.compression:
        status, at_kink = _integrand(surface.kink_d, gap, surface, table)
    jump = 0.5 * (surface.jacobian - 1.0) / (surface.root_floor_d * surface.slope_d)
    kink_by_hurst = -2.0 * surface.log_floor_d * (e + surface.root_floor_d * surface.root_floor_d)
    # eta_factor goes with m2^(-1/3)
    m2_by_hurst, m2_by_log_zeta = m2_slopes(H, L)
    for row in range(2):
        by_hurst = out[row, BY_HURST] + jump * kink_by_hurst * at_kink[row]
        by_log_e = out[row, BY_LOG_E] - jump * e * at_kink[row] + surface.jacobian_by_e * out[row, BELOW_KINK]
        share = out[row, 0] / 3.0 if row == 1 else 0.0
        out[row, BY_HURST] = by_hurst - 2.0 * L * by_log_e - share * m2_by_hurst
        out[row, BY_LOG_ZETA] = -2.0 * H * by_log_e - share * m2_by_log_zeta
        out[row, BY_PEAK] = -out[row, BY_COMPRESSION]
        out[row, BY_COMPRESSION] += K1 * edge[row]
    return status


@njit(cache=True, error_model="numpy", nogil=True)
def fill_totals(
    given: Any,
    rtol: float,
    reading: ReadingNumbers,
    printed: bool,
    table: Table,
    slopes: Any,
    status: NDArray[np.int64],
    out: FloatArray,
    bound: FloatArray,
) -> int:
    """`total`, with derivatives where `slopes` is True, of each of the pairs given; returns the islands.

    Given are `Pairs`; filled, where a gap touches, `status`, `out` (pairs, 2, columns), the `bound` on the
    relative error.
    """
    islands = 0
    hurst, zeta_1, compression, peak = given
    surface = surface_constants(hurst[0], zeta_1[0], reading, printed)
    for k in range(hurst.size):
        if k > 0 and (hurst[k] != hurst[k - 1] or zeta_1[k] != zeta_1[k - 1]):
            surface = surface_constants(hurst[k], zeta_1[k], reading, printed)
        gap, sums = Gap(compression[k], peak[k]), out[k]
        if gap.compression > 0.0:
            status[k], bound[k], count = total(gap, rtol, surface, slopes, table, sums)
            islands += count
            if slopes is not None and sums[0, 0] > 0.0 and sums[1, 0] > 0.0:
                status[k] = _end_slopes(gap, surface, table, sums)
    return islands
