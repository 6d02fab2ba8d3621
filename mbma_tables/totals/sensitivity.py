"""Totals through the universal table with their derivatives in the gap and in the surface, in one compiled pass.

F/(A0 E* q0 s) and A/A0 are functions of four numbers: H, log(zeta_1), reach = (h_max - d)/h_rms and top = h_max/h_rms.
The last two enter through the Gaussian and the upper limit, in closed form. H and zeta_1 enter through an island's
geometry, differenced centrally where it is cheap, and through the table's own slopes in X and mu.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import njit
from mbma_tables.models.universal_kernel import OK, UNRESOLVED, Axes, universal_phi, universal_slopes
from mbma_tables.totals.intervals import MOST_INTERVALS, approach_at, error_of, first_intervals, halve, rule_for
from mbma_tables.totals.kernel import Constants, island_node, jacobian_below, surface_constants

STEP = 1e-5  # of H and log(zeta_1): central differences err by its square, about 1e-10
SHARE = 3e-4  # of the way to the floor of zeta_u, where eta rises like a sixth root
BY_HURST, BY_LOG_ZETA, BY_REACH, BY_TOP = range(4)
Numbers = tuple[float, float, float, float, float, bool, bool]
Four = tuple[Constants, Constants, Constants, Constants]


@njit(cache=True, error_model="numpy")
def _integrand(
    x: float,
    floor_d: bool,
    floor_u: bool,
    reach: float,
    top: float,
    surface: Constants,
    flags: tuple[bool, bool],
    table: FloatArray,
    errors: FloatArray,
    axes: Axes,
) -> tuple[int, float, float]:
    """Status and the integrands of force and area over x = delta/h_rms, without K1."""
    X, mu, per_F, per_A, h_d, D_d, sigma_d = island_node(x, floor_d, floor_u, surface, flags[0], flags[1])
    status, phi_F, phi_A, _ = universal_phi(X, mu, table, errors, axes)
    height = ((top - (reach - x)) * surface[2] - h_d) / sigma_d
    weight = D_d * math.exp(-0.5 * height * height) / (math.sqrt(2.0 * math.pi) * sigma_d) * surface[2]
    return status, per_F * phi_F * weight, per_A * phi_A * weight


@njit(cache=True, error_model="numpy")
def _rule(
    low: float,
    high: float,
    floor_d: bool,
    floor_u: bool,
    reach: float,
    top: float,
    surface: Constants,
    near: Four,
    rates: tuple[float, float],
    flags: tuple[bool, bool],
    table: FloatArray,
    errors: FloatArray,
    axes: Axes,
    sums: FloatArray,
) -> tuple[int, float, float, int]:
    """Kronrod sums of force, area and their four partial derivatives into `sums` (2, 5); status, errors, nodes."""
    scale, room = surface[12], surface[2]
    nodes, kronrod, gauss = rule_for(low, high, floor_d)
    half, centre = 0.5 * (high - low), 0.5 * (high + low)
    gauss_force = gauss_area = doubt = 0.0
    sums[:] = 0.0
    for k in range(nodes.size):
        x, stretch = approach_at(centre + half * nodes[k], floor_d, scale)
        X, mu, per_F, per_A, h_d, D_d, sigma_d = island_node(x, floor_d, floor_u, surface, flags[0], flags[1])
        status, phi_F, F_X, F_mu, phi_A, A_X, A_mu, error = universal_slopes(X, mu, table, errors, axes)
        if status != OK:
            return status, math.nan, math.nan, nodes.size
        doubt = max(doubt, error)
        above = top - (reach - x)
        height = (above * room - h_d) / sigma_d
        weight = D_d * math.exp(-0.5 * height * height) / (math.sqrt(2.0 * math.pi) * sigma_d)
        weight *= room * stretch * half
        f, g = per_F * phi_F * weight, per_A * phi_A * weight
        gauss_force += gauss[k] * f
        gauss_area += gauss[k] * g
        f *= kronrod[k]
        g *= kronrod[k]
        sums[0, 0] += f
        sums[1, 0] += g
        tilt = height * room / sigma_d
        sums[0, 1 + BY_REACH] += tilt * f
        sums[1, 1 + BY_REACH] += tilt * g
        for number in range(2):
            up, down = near[2 * number], near[2 * number + 1]
            X_p, mu_p, F_p, A_p, h_p, D_p, s_p = island_node(x, floor_d, floor_u, up, flags[0], flags[1])
            X_m, mu_m, F_m, A_m, h_m, D_m, s_m = island_node(x, floor_d, floor_u, down, flags[0], flags[1])
            height_p, height_m = (above * up[2] - h_p) / s_p, (above * down[2] - h_m) / s_m
            # x is held, so the density is per h_rms: room (h_rms/s) is part of it
            common = math.log(D_p * up[2] * s_m / (D_m * down[2] * s_p)) - 0.5 * (height_p - height_m) * (
                height_p + height_m
            )
            by_X, by_mu = X_p - X_m, math.log(mu_p / mu_m)
            sums[0, 1 + number] += f * (math.log(F_p / F_m) + common + F_X * by_X + F_mu * by_mu) * rates[number]
            sums[1, 1 + number] += g * (math.log(A_p / A_m) + common + A_X * by_X + A_mu * by_mu) * rates[number]
    sums[0, 1 + BY_TOP] = -sums[0, 1 + BY_REACH]
    sums[1, 1 + BY_TOP] = -sums[1, 1 + BY_REACH]
    if not (sums[0, 0] > 0.0 and sums[1, 0] > 0.0):
        return OK, 0.0, doubt, nodes.size
    return OK, error_of(sums[0, 0], gauss_force, sums[1, 0], gauss_area), doubt, nodes.size


@njit(cache=True, error_model="numpy", nogil=True)
def total_with_slopes(
    reach: float,
    top: float,
    rtol: float,
    surface: Constants,
    near: Four,
    rates: tuple[float, float],
    printed: bool,
    flags: tuple[bool, bool],
    table: FloatArray,
    errors: FloatArray,
    axes: Axes,
    out: FloatArray,
) -> tuple[int, float, int]:
    """Status, error bound and islands; `out` (2, 5) receives force and area and their partial derivatives."""
    out[:] = 0.0
    if not reach > 0.0:
        return OK, 0.0, 0
    kink_d, kink_u = surface[10], surface[11]
    K1 = jacobian_below(surface, printed, flags[0])
    bounds = np.empty((MOST_INTERVALS, 2))
    parts = np.empty((MOST_INTERVALS, 2, 5))
    own = np.empty(MOST_INTERVALS)
    floors = np.empty((MOST_INTERVALS, 2), dtype=np.bool_)
    fresh = np.ones(MOST_INTERVALS, dtype=np.bool_)
    count = first_intervals(reach, kink_d, kink_u, surface[12], bounds, floors)
    islands = 0
    doubt = 0.0
    while True:
        out[:] = 0.0
        force_error = area_error = 0.0
        for k in range(count):
            if fresh[k]:
                status, own[k], table_error, nodes = _rule(
                    bounds[k, 0], bounds[k, 1], floors[k, 0], floors[k, 1],
                    reach, top, surface, near, rates, flags, table, errors, axes, parts[k],
                )  # fmt: skip
                islands += nodes
                if status != OK:
                    return status, math.nan, islands
                if not floors[k, 0]:
                    parts[k] *= K1
                doubt = max(doubt, table_error)
                fresh[k] = False
            out += parts[k]
            force_error += own[k] * parts[k, 0, 0]
            area_error += own[k] * parts[k, 1, 0]
        force, area = out[0, 0], out[1, 0]
        if not (force > 0.0 and area > 0.0):
            return OK, 0.0, islands
        if force_error <= rtol * force and area_error <= rtol * area:
            break
        present = count
        for k in range(present):
            share = present * own[k]
            if parts[k, 0, 0] * share > rtol * force or parts[k, 1, 0] * share > rtol * area:
                if count == MOST_INTERVALS:
                    return UNRESOLVED, math.nan, islands
                halve(k, count, bounds, floors)
                fresh[k] = True
                count += 1
    # the upper limit moves with reach, the kink and K1 with H and zeta_1
    status, f, g = _integrand(reach, reach > kink_d, reach > kink_u, reach, top, surface, flags, table, errors, axes)
    if status != OK:
        return status, math.nan, islands
    edge = 1.0 if reach > kink_d else K1
    out[0, 1 + BY_REACH] += edge * f
    out[1, 1 + BY_REACH] += edge * g
    for number in range(2):
        up, down = near[2 * number], near[2 * number + 1]
        if kink_d < reach:
            status, f, g = _integrand(kink_d, True, kink_d > kink_u, reach, top, surface, flags, table, errors, axes)
            if status != OK:
                return status, math.nan, islands
            moved = (K1 - 1.0) * (up[10] - down[10]) * rates[number]
            out[0, 1 + number] += f * moved
            out[1, 1 + number] += g * moved
        if not printed:
            change = (
                math.log(jacobian_below(up, printed, flags[0]) / jacobian_below(down, printed, flags[0]))
                * rates[number]
            )
            for k in range(count):
                if not floors[k, 0]:
                    out[0, 1 + number] += change * parts[k, 0, 0]
                    out[1, 1 + number] += change * parts[k, 1, 0]
    return OK, max(force_error / force, area_error / area) + doubt, islands


@njit(cache=True, error_model="numpy")
def neighbours(hurst: float, zeta_1: float, reading: Numbers) -> tuple[Four, tuple[float, float]]:
    """Constants of the surfaces a step of H and of log(zeta_1) up and down, and 1 over twice the steps."""
    step = min(STEP, SHARE * math.log(zeta_1 / reading[4]))
    factor = math.exp(step)
    around = (
        surface_constants(hurst + STEP, zeta_1, reading),
        surface_constants(hurst - STEP, zeta_1, reading),
        surface_constants(hurst, zeta_1 * factor, reading),
        surface_constants(hurst, zeta_1 / factor, reading),
    )
    return around, (0.5 / STEP, 1.0 / math.log(zeta_1 * factor / (zeta_1 / factor)))


@njit(cache=True, error_model="numpy", nogil=True)
def fill_totals_with_slopes(
    hurst: FloatArray,
    zeta_1: FloatArray,
    reach: FloatArray,
    top: FloatArray,
    rtol: float,
    reading: Numbers,
    printed: bool,
    table: FloatArray,
    errors: FloatArray,
    axes: Axes,
    status: NDArray[np.int64],
    out: FloatArray,
    bound: FloatArray,
) -> int:
    """`total_with_slopes` of each pair into `out` (pairs, 2, 5) and `bound`; returns the islands evaluated."""
    islands = 0
    surface = surface_constants(hurst[0], zeta_1[0], reading)
    near, rates = neighbours(hurst[0], zeta_1[0], reading)
    for k in range(reach.size):
        if k > 0 and (hurst[k] != hurst[k - 1] or zeta_1[k] != zeta_1[k - 1]):
            surface = surface_constants(hurst[k], zeta_1[k], reading)
            near, rates = neighbours(hurst[k], zeta_1[k], reading)
        status[k], bound[k], own = total_with_slopes(
            reach[k], top[k], rtol, surface, near, rates, printed, (reading[5], reading[6]), table, errors, axes, out[k]
        )
        islands += own
    return islands
