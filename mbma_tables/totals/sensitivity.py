"""Totals through the universal table with their derivatives in the gap and in the surface, in one compiled pass.

F/(A0 E* q0 s) and A/A0 are functions of four numbers: H, log(zeta_1), (h_max - d)/h_rms and h_max/h_rms. The last two
enter through the Gaussian and the upper limit, in closed form. H and zeta_1 enter through an island's geometry,
differenced centrally where it is cheap, and through the table's own slopes in X and mu.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import njit
from mbma_tables.models.protocol import BOTH
from mbma_tables.models.universal_kernel import OK, Table, universal_phi, universal_slopes
from mbma_tables.surfaces.readings import ReadingNumbers
from mbma_tables.totals.intervals import Gap, Interval, approach_at, error_of, refine, rule_for
from mbma_tables.totals.kernel import (
    Pairs,
    SurfaceConstants,
    island_density,
    island_height,
    island_node,
    surface_constants,
)

STEP = 1e-5  # of H and log(zeta_1): central differences err by its square, about 1e-10
SHARE_D, SHARE_U = 0.1, 0.03  # at most, of the way of log(zeta_1) to the floors; to that of zeta_u in narrow steps
FAR = 1000.0  # in changes of b: an island whose a is larger does not notice how near the floor of zeta_u is
# columns of force and area: the total, its derivatives, and what of it lies below the floor of zeta_d
BY_HURST, BY_LOG_ZETA, BY_COMPRESSION, BY_PEAK, BELOW_KINK = range(1, 6)
COLUMNS = 6


class Neighbours(NamedTuple):
    """The surfaces a step of H, of log(zeta_1), and a narrow step of log(zeta_1) up and down.

    At the floor of zeta_u, eta rises like the sixth root of b = floor^(-2H) - zeta_1^(-2H), too steeply to be
    differenced near zeta_1 = floor: neighbours in zeta_1 keep the root of their surface, whose slope has a closed form.
    """

    up: tuple[SurfaceConstants, SurfaceConstants, SurfaceConstants]
    down: tuple[SurfaceConstants, SurfaceConstants, SurfaceConstants]
    rate: tuple[float, float, float]  # 1 over twice the step
    log_eta: tuple[float, float]  # what the difference of log(eta) leaves out at the floor of zeta_u
    narrow_below: float  # delta/h_rms up to which islands at the floor of zeta_u take narrow steps


@njit(cache=True, error_model="numpy")
def neighbours(hurst: float, zeta_1: float, reading: ReadingNumbers, printed: bool) -> Neighbours:
    """The neighbours of a surface."""
    step = min(STEP, SHARE_D * math.log(zeta_1 / reading.floor_d))
    narrow = min(step, SHARE_U * math.log1p((zeta_1 - reading.floor_u) / reading.floor_u))
    high, low = zeta_1 * math.exp(step), zeta_1 / math.exp(step)
    near_high, near_low = zeta_1 * math.exp(narrow), zeta_1 / math.exp(narrow)
    own = surface_constants(hurst, zeta_1, reading, printed, zeta_1)
    above = surface_constants(hurst, high, reading, printed, zeta_1)
    return Neighbours(
        (
            surface_constants(hurst + STEP, zeta_1, reading, printed, zeta_1),
            above,
            surface_constants(hurst, near_high, reading, printed, zeta_1),
        ),
        (
            surface_constants(hurst - STEP, zeta_1, reading, printed, zeta_1),
            surface_constants(hurst, low, reading, printed, zeta_1),
            surface_constants(hurst, near_low, reading, printed, zeta_1),
        ),
        (0.5 / STEP, 1.0 / math.log(high / low), 1.0 / math.log(near_high / near_low)),
        (0.0, hurst * own.e / (3.0 * own.offset_floor_u)),
        math.sqrt(FAR * (above.offset_floor_u - own.offset_floor_u)) / own.slope_d,
    )


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
    near: Neighbours,
    table: Table,
    work: FloatArray,
    part: FloatArray,
) -> tuple[int, float, float, int]:
    """Kronrod sums of force, area and their derivatives over an interval, see `refine`."""
    low, high, floor_d, floor_u = interval
    nodes, kronrod, gauss = rule_for(interval)
    half, centre = 0.5 * (high - low), 0.5 * (high + low)
    rms_over_s = surface.rms_over_s
    gauss_force = gauss_area = table_error = 0.0
    part[:] = 0.0
    for k in range(nodes.size):
        x, stretch = approach_at(centre + half * nodes[k], floor_d, surface.map_scale)
        node = island_node(x, floor_d, floor_u, surface)
        phi = universal_slopes(node.X, node.mu, table)
        if phi.status != OK:
            return phi.status, math.nan, math.nan, nodes.size
        table_error = max(table_error, phi.error)
        height = island_height(x, node.h_d, node.sigma_d, gap, rms_over_s)
        weight = island_density(height, node.D_d, node.sigma_d) * rms_over_s * stretch * half
        f, g = node.force * phi.phi_F * weight, node.area * phi.phi_A * weight
        gauss_force += gauss[k] * f
        gauss_area += gauss[k] * g
        f *= kronrod[k]
        g *= kronrod[k]
        part[0, 0] += f
        part[1, 0] += g
        tilt = height * rms_over_s / node.sigma_d
        part[0, BY_COMPRESSION] += tilt * f
        part[1, BY_COMPRESSION] += tilt * g
        for number in range(2):
            place = 2 if number == 1 and floor_u and x < near.narrow_below else number
            up, down, rate = near.up[place], near.down[place], near.rate[place]
            above, below = island_node(x, floor_d, floor_u, up), island_node(x, floor_d, floor_u, down)
            height_up = island_height(x, above.h_d, above.sigma_d, gap, up.rms_over_s)
            height_down = island_height(x, below.h_d, below.sigma_d, gap, down.rms_over_s)
            # x is held, so the density is per h_rms: h_rms/s is part of it
            common = math.log(above.D_d * up.rms_over_s * below.sigma_d / (below.D_d * down.rms_over_s * above.sigma_d))
            common -= 0.5 * (height_up - height_down) * (height_up + height_down)
            by_X, by_mu = above.X - below.X, math.log(above.mu / below.mu)
            by_F = math.log(above.force / below.force) + common + phi.F_by_X * by_X + phi.F_by_mu * by_mu
            by_A = math.log(above.area / below.area) + common + phi.A_by_X * by_X + phi.A_by_mu * by_mu
            part[0, BY_HURST + number] += f * by_F * rate
            part[1, BY_HURST + number] += g * (by_A * rate + (near.log_eta[number] if floor_u else 0.0))
    part[:, BY_PEAK] = -part[:, BY_COMPRESSION]
    error = 0.0
    if part[0, 0] > 0.0 and part[1, 0] > 0.0:
        error = error_of(part[0, 0], gauss_force, part[1, 0], gauss_area)
    if not floor_d:
        part *= surface.jacobian
        part[:, BELOW_KINK] = part[:, 0]
    return OK, error, table_error, nodes.size


@njit(cache=True, error_model="numpy", nogil=True)
def total_with_slopes(
    gap: Gap, rtol: float, surface: SurfaceConstants, near: Neighbours, table: Table, out: FloatArray
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
        up, down, rate = near.up[number], near.down[number], near.rate[number]
        moved = (surface.jacobian - 1.0) * (up.kink_d - down.kink_d) * rate
        change = math.log(up.jacobian / down.jacobian) * rate
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
    surface = surface_constants(hurst[0], zeta_1[0], reading, printed, zeta_1[0])
    near = neighbours(hurst[0], zeta_1[0], reading, printed)
    for k in range(hurst.size):
        if k > 0 and (hurst[k] != hurst[k - 1] or zeta_1[k] != zeta_1[k - 1]):
            surface = surface_constants(hurst[k], zeta_1[k], reading, printed, zeta_1[k])
            near = neighbours(hurst[k], zeta_1[k], reading, printed)
        gap = Gap(pairs.compression[k], pairs.peak[k])
        status[k], bound[k], count = total_with_slopes(gap, rtol, surface, near, table, out[k])
        islands += count
    return islands
