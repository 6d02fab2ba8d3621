"""One surface, one gap, in one compiled pass: islands by lookup, Gauss-Kronrod over delta (Eqs. 44-50).

The same integral as in `contact`, for the universal table. An island costs a few logarithms and exponentials
instead of a solution; what depends on the surface alone is computed once per surface. No work space is shared.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import njit
from mbma_tables.islands.geometry import floor_offset
from mbma_tables.models.protocol import BOTH, FORCE
from mbma_tables.models.universal_kernel import OK, UNRESOLVED, Axes, universal_one, universal_phi
from mbma_tables.surfaces.spectrum import BROADENING, RADIUS, m4_of, summit_rate
from mbma_tables.totals.intervals import (
    MOST_INTERVALS,
    STRETCH,
    approach_at,
    error_of,
    first_intervals,
    halve,
    rule_for,
)

SMALL_POWER = 0.01  # below these, differences of exponentials go through expm1
SMALL_WIDTH = 0.01

Constants = tuple[float, float, float, float, float, float, float, float, float, float, float, float, float]
Node = tuple[float, float, float, float, float, float, float]


_LOOSE = {"contract", "reassoc", "arcp"}


@njit(cache=True, error_model="numpy")
def surface_constants(
    hurst: float, zeta_1: float, reading: tuple[float, float, float, float, float, bool, bool]
) -> Constants:
    """What an island needs of its surface: powers, floors, eta's factor, and where the floors are reached."""
    divisor, beta, phi, floor_d, floor_u, _, _ = reading
    log_zeta_1 = math.log(zeta_1)
    e = math.exp(-2.0 * hurst * log_zeta_1)
    room = math.sqrt(-math.expm1(-2.0 * hurst * log_zeta_1))
    share_a = 4.0 / 3.0 * beta
    share_b = phi / (1.0 + phi) * room
    root_top_a = math.sqrt(floor_offset(hurst, zeta_1, floor_d))
    root_top_b = math.sqrt(floor_offset(hurst, zeta_1, floor_u))
    m4_all = m4_of(hurst, 0.0, log_zeta_1)
    D_top = summit_rate(hurst, 0.0, log_zeta_1) / divisor
    R_top = RADIUS / math.sqrt(m4_all)
    eta = 0.75 * (math.pi * D_top) ** (1.0 / 3.0) * (1.5 * R_top) ** (2.0 / 3.0) * phi ** (-1.0 / 3.0)
    return (
        hurst,
        e,
        room,
        share_a,
        share_b,
        root_top_a,
        root_top_b,
        math.log(floor_d),
        divisor,
        eta,
        root_top_a / share_a,
        root_top_b / share_b,
        STRETCH * math.exp(-hurst * log_zeta_1),
    )


@njit(cache=True, error_model="numpy")
def jacobian_below(surface: Constants, printed: bool, offset: bool) -> float:
    """K1 (47) below the kink."""
    return 1.0 - surface[3] / (1.0 if printed else surface[2]) if printed or offset else 1.0


@njit(cache=True, fastmath=_LOOSE, error_model="numpy")
def island_node(
    x: float, floor_d: bool, floor_u: bool, surface: Constants, offset: bool, summits: bool, which: int = BOTH
) -> Node:
    """(X, mu, F_hat per Phi_F, A^i per Phi_A with eta, h_d, D_d, sigma_d) at delta = x h_rms.

    `floor_d` and `floor_u` say whether zeta_d (27) and zeta_u (30) stand at their floors. The arithmetic of
    `islands.geometry`, rearranged: one logarithm and one exponential for each end of the band. The area's factor is
    NaN where `which` is FORCE.
    """
    H, e, room, share_a, share_b, top_a, top_b, log_fd, divisor, eta_factor, _, _, _ = surface
    p2, p4, over_2H = 2.0 - 2.0 * H, 4.0 - 2.0 * H, 0.5 / H
    root_a = top_a if floor_d else share_a * x
    root_b = top_b if floor_u else share_b * x
    a, b = root_a * root_a, root_b * root_b
    m0 = (root_a - root_b) * (root_a + root_b)
    # only the width needs its relative digits
    log_d = log_fd if floor_d else -math.log(e + a) * over_2H
    width = math.log1p(m0 / (e + b)) * over_2H
    # p (zeta^p - 1)/p over [1, zeta_d] and over the band, for p = 4 - 2H and p = 2 - 2H; zeta_d^(-2H) = e + a
    square = math.exp(2.0 * log_d)
    top2 = square * (e + a)
    top4 = square * top2
    below4 = top4 - 1.0
    if p2 > SMALL_POWER and width > SMALL_WIDTH:
        # zeta_u/zeta_d, squared, and to the power -2H
        wider = math.exp(2.0 * width)
        shrunk = (e + b) / (e + a)
        below2 = (top2 - 1.0) / p2
        band2 = top2 * (wider * shrunk - 1.0) / p2
        band4 = top4 * (wider * wider * shrunk - 1.0)
    else:
        below2 = math.expm1(p2 * log_d) / p2 if p2 != 0.0 else log_d
        band2 = (1.0 + p2 * below2) * (math.expm1(p2 * width) / p2 if p2 != 0.0 else width)
        band4 = top4 * math.expm1(p4 * width)
    # m2 = H below2, m4 = (3 H/4 p4) below4, alpha = m0 m4/m2^2
    rate = 0.75 / p4
    tilt = BROADENING * H / rate if summits else 0.0
    D = rate / divisor * (band4 / band2)
    D_d = rate / divisor * (below4 / below2)
    sigma = math.sqrt(m0 - tilt * band2 * band2 / band4)
    sigma_d = math.sqrt(1.0 - (e + a) - tilt * below2 * below2 / below4)
    radius = RADIUS / math.sqrt(rate * H)
    R_d = radius / math.sqrt(below4)
    R_u = radius / math.sqrt(below4 + band4)
    h_d = root_a if offset else 0.0
    both = R_u * R_d
    force = sigma * math.sqrt(2.0 * R_d * sigma)
    mu = 8.0 / 3.0 * D * sigma * math.sqrt(2.0 * both)
    area = math.nan
    if which != FORCE:
        area = 2.0 * math.pi * eta_factor * np.cbrt(root_b / R_u) * D * both * sigma * sigma
    return (room * x - h_d) / sigma, mu, force, area, h_d, D_d, sigma_d


@njit(cache=True, fastmath=_LOOSE, error_model="numpy")
def _rule(
    which: int,
    low: float,
    high: float,
    floor_d: bool,
    floor_u: bool,
    reach: float,
    top: float,
    surface: Constants,
    flags: tuple[bool, bool],
    table: FloatArray,
    errors: FloatArray,
    axes: Axes,
) -> tuple[int, float, float, float, float, int]:
    """One Kronrod rule over an interval: status, force, area, their relative error, the table's, and its nodes.

    Where `which` is FORCE or AREA, that one stands in the place of both.
    """
    scale, room = surface[12], surface[2]
    nodes, kronrod, gauss = rule_for(low, high, floor_d)
    half, centre = 0.5 * (high - low), 0.5 * (high + low)
    force = area = gauss_force = gauss_area = doubt = 0.0
    for k in range(nodes.size):
        x, stretch = approach_at(centre + half * nodes[k], floor_d, scale)
        X, mu, per_F, per_A, h_d, D_d, sigma_d = island_node(x, floor_d, floor_u, surface, flags[0], flags[1], which)
        height = ((top - (reach - x)) * room - h_d) / sigma_d
        # d(delta/s) = room dx
        weight = D_d * math.exp(-0.5 * height * height) / (math.sqrt(2.0 * math.pi) * sigma_d) * room * stretch * half
        if which == BOTH:
            status, phi_F, phi_A, error = universal_phi(X, mu, table, errors, axes)
            f, g = per_F * phi_F * weight, per_A * phi_A * weight
        else:
            status, phi, error = universal_one(which, X, mu, table, errors, axes)
            f = g = (per_F if which == FORCE else per_A) * phi * weight
        if status != OK:
            return status, math.nan, math.nan, math.nan, math.nan, nodes.size
        force += kronrod[k] * f
        area += kronrod[k] * g
        gauss_force += gauss[k] * f
        gauss_area += gauss[k] * g
        doubt = max(doubt, error)
    if not (force > 0.0 and area > 0.0):
        return OK, force, area, 0.0, doubt, nodes.size
    return OK, force, area, error_of(force, gauss_force, area, gauss_area), doubt, nodes.size


@njit(cache=True, error_model="numpy", nogil=True)
def total(
    which: int,
    reach: float,
    top: float,
    rtol: float,
    surface: Constants,
    jacobian: float,
    flags: tuple[bool, bool],
    table: FloatArray,
    errors: FloatArray,
    axes: Axes,
) -> tuple[int, float, float, float, int]:
    """Status, F/(A0 E* q0 s), A/A0, the bound on their relative error, and the islands evaluated.

    The gap is (h_max - d)/h_rms = reach. Where `which` is FORCE or AREA, that one stands in the place of both.
    """
    if not reach > 0.0:
        return OK, 0.0, 0.0, 0.0, 0
    islands = 0
    bounds = np.empty((MOST_INTERVALS, 2))
    parts = np.empty((MOST_INTERVALS, 3))
    floors = np.empty((MOST_INTERVALS, 2), dtype=np.bool_)
    fresh = np.ones(MOST_INTERVALS, dtype=np.bool_)
    count = first_intervals(reach, surface[10], surface[11], surface[12], bounds, floors)
    doubt = 0.0
    while True:
        force = area = force_error = area_error = 0.0
        for k in range(count):
            if fresh[k]:
                status, f, g, error, own, nodes = _rule(
                    which, bounds[k, 0], bounds[k, 1], floors[k, 0], floors[k, 1],
                    reach, top, surface, flags, table, errors, axes,
                )  # fmt: skip
                islands += nodes
                if status != OK:
                    return status, math.nan, math.nan, math.nan, islands
                K1 = 1.0 if floors[k, 0] else jacobian
                parts[k, 0], parts[k, 1], parts[k, 2] = K1 * f, K1 * g, error
                fresh[k] = False
                doubt = max(doubt, own)
            force += parts[k, 0]
            area += parts[k, 1]
            force_error += parts[k, 0] * parts[k, 2]
            area_error += parts[k, 1] * parts[k, 2]
        if not (force > 0.0 and area > 0.0):
            return OK, force, area, 0.0, islands
        if force_error <= rtol * force and area_error <= rtol * area:
            return OK, force, area, max(force_error / force, area_error / area) + doubt, islands
        present = count
        for k in range(present):
            share = present * parts[k, 2]
            if parts[k, 0] * share > rtol * force or parts[k, 1] * share > rtol * area:
                if count == MOST_INTERVALS:
                    return UNRESOLVED, force, area, math.nan, islands
                halve(k, count, bounds, floors)
                fresh[k] = True
                count += 1


@njit(cache=True, error_model="numpy", nogil=True)
def fill_totals(
    which: int,
    hurst: FloatArray,
    zeta_1: FloatArray,
    reach: FloatArray,
    top: FloatArray,
    rtol: float,
    reading: tuple[float, float, float, float, float, bool, bool],
    printed: bool,
    table: FloatArray,
    errors: FloatArray,
    axes: Axes,
    status: NDArray[np.int64],
    out: FloatArray,
) -> int:
    """`total` of each pair into the columns of `out` (3, pairs); returns the islands evaluated."""
    islands = 0
    surface = surface_constants(hurst[0], zeta_1[0], reading)
    for k in range(reach.size):
        if k > 0 and (hurst[k] != hurst[k - 1] or zeta_1[k] != zeta_1[k - 1]):
            surface = surface_constants(hurst[k], zeta_1[k], reading)
        jacobian = jacobian_below(surface, printed, reading[5])
        status[k], out[0, k], out[1, k], out[2, k], own = total(
            which, reach[k], top[k], rtol, surface, jacobian, (reading[5], reading[6]), table, errors, axes
        )
        islands += own
    return islands
