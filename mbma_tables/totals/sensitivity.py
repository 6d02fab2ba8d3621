"""Totals through the universal table with their derivatives in the gap and in the surface, in one compiled pass.

F/(A0 E* q0 s) and A/A0 are functions of four numbers: H, log(zeta_1), (h_max - d)/h_rms and h_max/h_rms. The last two
enter through the Gaussian and the upper limit, in closed form. H and zeta_1 enter through an island's geometry, whose
derivatives are written out beside `kernel.island_node`, and through the table's own slopes in X and mu.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import REORDER, njit
from mbma_tables.elementary import exp, expm1, log, log1p
from mbma_tables.models.protocol import BOTH
from mbma_tables.models.universal_kernel import OK, Table, universal_phi, universal_slopes
from mbma_tables.surfaces.readings import ReadingNumbers
from mbma_tables.surfaces.spectrum import BROADENING
from mbma_tables.totals.intervals import Gap, Interval, approach_at, error_of, refine, rule_for
from mbma_tables.totals.kernel import (
    TINY,
    Pairs,
    SurfaceConstants,
    fill_nodes,
    island_density,
    island_height,
    island_node,
    surface_constants,
)

# columns of force and area: the total, its derivatives, and what of it lies below the floor of zeta_d
NEAR_ONE = 0.1  # p l below which a difference goes by its series
VALUES = 5  # rows of `kernel.fill_nodes`
BY_HURST, BY_LOG_ZETA, BY_COMPRESSION, BY_PEAK, BELOW_KINK = range(1, 6)
COLUMNS = 6


class Changes(NamedTuple):
    """Derivatives of a surface's constants by H, or by log(zeta_1)."""

    hurst: float
    e: float
    rms: float  # of log(h_rms/s)
    floor_a: float  # of a and b at the floors of zeta_d and zeta_u
    floor_b: float
    eta: float  # of log(eta_factor)
    jacobian: float  # of its logarithm
    kink_d: float


@njit(cache=True, error_model="numpy", forceinline=True)
def _moment(y: float, grown: float) -> float:
    """(y e^y - e^y + 1)/y^2 with `grown` = e^y - 1: the derivative of (e^(p l) - 1)/p by p, over l^2, at y = p l."""
    series = 1.0 / 8.0 + y * (1.0 / 30.0 + y * (1.0 / 144.0 + y * (1.0 / 840.0 + y * (1.0 / 5760.0 + y / 45360.0))))
    series = 0.5 + y * (1.0 / 3.0 + y * series)
    return series if y < NEAR_ONE else (y + (y - 1.0) * grown) / (y * y)


@njit(cache=True, error_model="numpy")
def changes_of(
    by_hurst: bool, zeta_1: float, surface: SurfaceConstants, reading: ReadingNumbers, printed: bool
) -> Changes:
    """The derivatives of a surface's constants."""
    H, e, L = surface.hurst, surface.e, math.log(zeta_1)
    h = 1.0 if by_hurst else 0.0
    d_log = 0.0 if by_hurst else 1.0
    p2, p4 = 2.0 - 2.0 * H if H != 1.0 else TINY, 4.0 - 2.0 * H
    d_e = -2.0 * e * (h * L + d_log * H)
    rms = -0.5 * d_e / (surface.rms_over_s * surface.rms_over_s)
    log_u = math.log(reading.floor_u)
    floor_a = -2.0 * h * surface.log_floor_d * math.exp(-2.0 * H * surface.log_floor_d) - d_e
    floor_b = -2.0 * h * log_u * math.exp(-2.0 * H * log_u) - d_e
    # of the densest summits, m4/m2 and 1/sqrt(m4) over all of the spectrum
    grown, whole = math.expm1(p2 * L), math.expm1(p4 * L)
    top4 = (1.0 + whole) * (p4 * d_log - 2.0 * h * L) / whole
    top2 = ((1.0 + grown) * d_log - 2.0 * h * L * L * _moment(p2 * L, grown)) * p2 / grown
    rate = 2.0 * h / p4
    eta = (rate + top4 - top2) / 3.0 - (rate + h / H + top4) / 3.0
    jacobian = 0.0 if printed else (1.0 - surface.jacobian) / surface.jacobian * rms
    return Changes(
        h, d_e, rms, floor_a, floor_b, eta, jacobian, 0.5 * floor_a / (surface.root_floor_d * surface.slope_d)
    )


@njit(cache=True, fastmath=REORDER, error_model="numpy", forceinline=True)
def _node_changes(
    x: float, gap: Gap, floor_d: bool, floor_u: bool, surface: SurfaceConstants, change: Changes
) -> tuple[float, float, float, float]:
    """Derivatives of X, log(mu), and of the logarithms of what force and area add per Phi_F and Phi_A, at given x.

    `island_node`, line by line.
    """
    H, e, h = surface.hurst, surface.e, change.hurst
    p2, p4, over_2H = 2.0 - 2.0 * H if H != 1.0 else TINY, 4.0 - 2.0 * H, 0.5 / H
    root_a = surface.root_floor_d if floor_d else surface.slope_d * x
    root_b = surface.root_floor_u if floor_u else surface.slope_u * x
    a = root_a * root_a
    b = surface.offset_floor_u if floor_u else root_b * root_b
    m0 = a - b if floor_u else (root_a - root_b) * (root_a + root_b)
    d_a = change.floor_a if floor_d else 0.0
    d_b = change.floor_b if floor_u else 2.0 * b * change.rms
    d_m0 = d_a - d_b
    log_d = surface.log_floor_d if floor_d else -log(e + a) * over_2H
    d_log_d = 0.0 if floor_d else -(change.e + d_a) / (e + a) * over_2H - h * log_d / H
    width = log1p(m0 / (e + b)) * over_2H
    d_width = (d_m0 - m0 * (change.e + d_b) / (e + b)) / (e + a) * over_2H - h * width / H
    square = exp(2.0 * log_d)
    top2 = square * (e + a)
    top4 = square * top2
    below4 = top4 - 1.0
    d_below4 = top4 * (p4 * d_log_d - 2.0 * h * log_d) / below4
    grown = expm1(p2 * log_d)
    below2 = grown / p2
    d_below2 = (top2 * d_log_d - 2.0 * h * log_d * log_d * _moment(p2 * log_d, grown)) / below2
    grown = expm1(p2 * width)
    d_band2 = p2 * d_log_d - 2.0 * h * log_d
    d_band2 += ((1.0 + grown) * d_width - 2.0 * h * width * width * _moment(p2 * width, grown)) * p2 / grown
    band2 = top2 * grown / p2
    grown = expm1(p4 * width)
    band4 = top4 * grown
    d_band4 = p4 * d_log_d - 2.0 * h * log_d + (1.0 + grown) * (p4 * d_width - 2.0 * h * width) / grown
    rate = 0.75 / p4
    d_rate = 2.0 * h / p4
    tilt = BROADENING * H / rate if surface.summit_sigma else 0.0
    d_D = d_rate + d_band4 - d_band2
    d_D_d = d_rate + d_below4 - d_below2
    part = tilt * band2 * band2 / band4
    variance = m0 - part
    d_sigma = 0.5 * (d_m0 - part * (h / H - d_rate + 2.0 * d_band2 - d_band4)) / variance
    part = tilt * below2 * below2 / below4
    variance_d = 1.0 - (e + a) - part
    d_sigma_d = -0.5 * (change.e + d_a + part * (h / H - d_rate + 2.0 * d_below2 - d_below4)) / variance_d
    d_R_d = -0.5 * (d_rate + h / H + d_below4)
    d_R_u = -0.5 * (d_rate + h / H + (below4 * d_below4 + band4 * d_band4) / (below4 + band4))
    h_d = root_a if surface.offset else 0.0
    d_h_d = 0.5 * d_a / root_a if surface.offset else 0.0
    d_root_b = 0.5 * change.floor_b / b if floor_u else change.rms
    d_force = 1.5 * d_sigma + 0.5 * d_R_d
    d_mu = d_D + d_sigma + 0.5 * (d_R_d + d_R_u)
    d_area = change.eta + (d_root_b - d_R_u) / 3.0 + d_D + d_R_u + d_R_d + 2.0 * d_sigma
    sigma, sigma_d, rms = math.sqrt(variance), math.sqrt(variance_d), surface.rms_over_s
    d_X = (rms * change.rms * x - d_h_d) / sigma - (rms * x - h_d) / sigma * d_sigma
    reach = (gap.peak - (gap.compression - x)) * rms
    height = (reach - h_d) / sigma_d
    d_height = (reach * change.rms - d_h_d) / sigma_d - height * d_sigma_d
    # x is held, so the density is per h_rms: h_rms/s is part of it
    common = d_D_d - d_sigma_d + change.rms - height * d_height
    return d_X, d_mu, d_force + common, d_area + common


@njit(cache=True, fastmath=REORDER, error_model="numpy")
def _fill_changes(
    interval: Interval, gap: Gap, surface: SurfaceConstants, by_hurst: Changes, by_zeta: Changes, out: FloatArray
) -> None:
    """`_node_changes` by H and by log(zeta_1) at the nodes of an interval, four rows each, in one loop."""
    low, high, floor_d, floor_u = interval
    nodes = rule_for(interval)[0]
    half, centre = 0.5 * (high - low), 0.5 * (high + low)
    for k in range(nodes.size):
        x, _ = approach_at(centre + half * nodes[k], floor_d, surface.map_scale)
        one = _node_changes(x, gap, floor_d, floor_u, surface, by_hurst)
        other = _node_changes(x, gap, floor_d, floor_u, surface, by_zeta)
        out[0, k], out[1, k], out[2, k], out[3, k] = one
        out[4, k], out[5, k], out[6, k], out[7, k] = other


@njit(cache=True, error_model="numpy")
def _integrand(x: float, gap: Gap, surface: SurfaceConstants, table: Table) -> tuple[int, float, float]:
    """Status and the integrands of force and area over x = delta/h_rms, at the floor of zeta_d or next to it."""
    floor_d = x >= surface.kink_d
    node = island_node(x, floor_d, x > surface.kink_u, surface)
    status, phi_F, phi_A, _ = universal_phi(node.X, node.mu, table)
    height = island_height(x, node.h_d, node.sigma_d, gap, surface.rms_over_s)
    weight = island_density(height, node.D_d, node.sigma_d) * surface.rms_over_s
    return status, node.force * phi_F * weight, node.area * phi_A * weight


@njit(cache=True, error_model="numpy")
def _rule(
    which: int,
    interval: Interval,
    gap: Gap,
    surface: SurfaceConstants,
    near: tuple[Changes, Changes],
    table: Table,
    work: FloatArray,
    part: FloatArray,
) -> tuple[int, float, float, int]:
    """Kronrod sums of force, area and their derivatives over an interval, see `refine`."""
    _, kronrod, gauss = rule_for(interval)
    count = fill_nodes(interval, gap, surface, work)
    _fill_changes(interval, gap, surface, near[0], near[1], work[VALUES:])
    gauss_force = gauss_area = table_error = 0.0
    part[:] = 0.0
    for k in range(count):
        phi = universal_slopes(work[0, k], work[1, k], table)
        if phi.status != OK:
            return phi.status, math.nan, math.nan, count
        table_error = max(table_error, phi.error)
        f, g = work[2, k] * phi.phi_F, work[3, k] * phi.phi_A
        gauss_force += gauss[k] * f
        gauss_area += gauss[k] * g
        f *= kronrod[k]
        g *= kronrod[k]
        part[0, 0] += f
        part[1, 0] += g
        part[0, BY_COMPRESSION] += work[4, k] * f
        part[1, BY_COMPRESSION] += work[4, k] * g
        for number in range(2):
            row = VALUES + 4 * number
            by_X, by_mu = work[row, k], work[row + 1, k]
            part[0, BY_HURST + number] += f * (work[row + 2, k] + phi.F_by_X * by_X + phi.F_by_mu * by_mu)
            part[1, BY_HURST + number] += g * (work[row + 3, k] + phi.A_by_X * by_X + phi.A_by_mu * by_mu)
    part[:, BY_PEAK] = -part[:, BY_COMPRESSION]
    error = 0.0
    if part[0, 0] > 0.0 and part[1, 0] > 0.0:
        error = error_of(part[0, 0], gauss_force, part[1, 0], gauss_area)
    if not interval.floor_d:
        part *= surface.jacobian
        part[:, BELOW_KINK] = part[:, 0]
    return OK, error, table_error, count


@njit(cache=True, error_model="numpy")
def both_changes(
    zeta_1: float, surface: SurfaceConstants, reading: ReadingNumbers, printed: bool
) -> tuple[Changes, Changes]:
    """By H and by log(zeta_1)."""
    return (
        changes_of(True, zeta_1, surface, reading, printed),
        changes_of(False, zeta_1, surface, reading, printed),
    )


@njit(cache=True, error_model="numpy", nogil=True)
def total_with_slopes(
    gap: Gap, rtol: float, surface: SurfaceConstants, near: tuple[Changes, Changes], table: Table, out: FloatArray
) -> tuple[int, float, int]:
    """Status, error bound and islands; `out` (2, COLUMNS) receives force and area and their derivatives."""
    out[:] = 0.0
    compression = gap.compression
    if not compression > 0.0:
        return OK, 0.0, 0
    status, error, islands = refine(_rule, BOTH, gap, rtol, surface, near, table, out)
    if status != OK or not (out[0, 0] > 0.0 and out[1, 0] > 0.0):
        return status, error, islands
    # the upper limit moves with the compression, the kink and K1 with H and zeta_1
    status, f, g = _integrand(compression, gap, surface, table)
    if status != OK:
        return status, math.nan, islands
    edge = 1.0 if compression > surface.kink_d else surface.jacobian
    out[0, BY_COMPRESSION] += edge * f
    out[1, BY_COMPRESSION] += edge * g
    f = g = 0.0
    if surface.kink_d < compression:
        status, f, g = _integrand(surface.kink_d, gap, surface, table)
        if status != OK:
            return status, math.nan, islands
    for number in range(2):
        moved, change = (surface.jacobian - 1.0) * near[number].kink_d, near[number].jacobian
        out[0, BY_HURST + number] += f * moved + change * out[0, BELOW_KINK]
        out[1, BY_HURST + number] += g * moved + change * out[1, BELOW_KINK]
    return OK, error, islands


@njit(cache=True, error_model="numpy", nogil=True)
def fill_totals_with_slopes(
    given: Any,
    rtol: float,
    reading: ReadingNumbers,
    printed: bool,
    table: Table,
    status: NDArray[np.int64],
    out: FloatArray,
    bound: FloatArray,
) -> int:
    """`total_with_slopes` of the `Pairs` given into `out` (pairs, 2, COLUMNS) and `bound`; returns the islands."""
    islands = 0
    # a plain tuple, which a call from Python passes on faster
    pairs = Pairs(*given)
    hurst, zeta_1 = pairs.hurst, pairs.zeta_1
    surface = surface_constants(hurst[0], zeta_1[0], reading, printed)
    near = both_changes(zeta_1[0], surface, reading, printed)
    for k in range(hurst.size):
        if k > 0 and (hurst[k] != hurst[k - 1] or zeta_1[k] != zeta_1[k - 1]):
            surface = surface_constants(hurst[k], zeta_1[k], reading, printed)
            near = both_changes(zeta_1[k], surface, reading, printed)
        gap = Gap(pairs.compression[k], pairs.peak[k])
        status[k], bound[k], count = total_with_slopes(gap, rtol, surface, near, table, out[k])
        islands += count
    return islands
