"""Islands of a surface as compiled code takes them: at a node, with their derivatives in H and zeta_1 where asked for.

What depends on the surface alone is computed once per surface; a node costs a few logarithms and exponentials instead
of a solution. `intervals` sums over the nodes.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from mbma_tables.arguments import FloatArray, spread
from mbma_tables.compiled import REORDER, jitable, njit
from mbma_tables.elementary import exp, expm1, log, log1p
from mbma_tables.islands.geometry import floor_offset
from mbma_tables.models.universal_kernel import OK, Table, universal_phi
from mbma_tables.surfaces.readings import ReadingNumbers
from mbma_tables.surfaces.spectrum import BROADENING, RADIUS, m4_of, summit_rate
from mbma_tables.surfaces.surface import Surface

TINY = 1e-100  # for a power of 0
STRETCH = 8.0  # scale of the approach's map, in boundary layers zeta_1^(-H): fewest nodes over random surfaces
NEAR_ONE = 0.1  # p l below which a difference goes by its series
ROOT_TWO_PI = math.sqrt(2.0 * math.pi)


class Pairs(NamedTuple):
    """Flat (surface, gap) pairs in units of h_rms and 1/q0."""

    hurst: FloatArray
    zeta_1: FloatArray
    compression: FloatArray  # (h_max - d)/h_rms
    peak: FloatArray  # h_max/h_rms

    @classmethod
    def of(cls, surface: Surface, depth: FloatArray) -> Pairs:
        """Of a surface, or a batch, at h_max - d = `depth` [length], of the shape that both broadcast to."""
        scaled = depth / surface.h_rms, surface.h_max / surface.h_rms
        # copies, since numba compiles again for arrays that cannot be written
        return cls(*(spread(f, depth.shape).flatten() for f in (surface.hurst, surface.zeta_1, *scaled)))

    def some(self, chosen: Any) -> Pairs:
        """The pairs at these places."""
        return Pairs(*(field[chosen] for field in self))


class SurfaceConstants(NamedTuple):
    """What islands need of their surface, in units of h_rms, s and 1/q0; a and b are zeta^(-2H) - zeta_1^(-2H)."""

    hurst: float
    log_zeta_1: float
    e: float  # zeta_1^(-2H)
    rms_over_s: float  # h_rms/s = sqrt(1 - e)
    slope_d: float  # sqrt(a) per x = delta/h_rms below the floor of zeta_d (27)
    slope_u: float  # sqrt(b) per x below the floor of zeta_u (30)
    root_floor_d: float  # sqrt(a) at the floor of zeta_d
    root_floor_u: float  # sqrt(b) at the floor of zeta_u
    offset_floor_u: float  # b there
    log_floor_d: float
    log_floor_u: float
    eta_factor: float
    kink_d: float  # x at which zeta_d reaches its floor
    kink_u: float  # x at which zeta_u reaches its floor
    map_scale: float
    jacobian: float  # K1 (47) below kink_d
    jacobian_by_e: float  # derivative of its logarithm by log(e)
    reading: ReadingNumbers


class Node(NamedTuple):
    """An island at a node of the quadrature; from `m0` on, what its derivatives need."""

    X: float
    mu: float
    force: float  # F^i per Phi_F
    area: float  # A^i per Phi_A
    h_d: float
    D_d: float
    sigma_d: float
    m0: float
    sigma: float
    b: float
    top: float  # zeta_d^(-2H)
    log_d: float
    width: float
    top2: float  # zeta_d^p
    below2: float  # (zeta_d^p - 1)/p and (zeta_u^p - zeta_d^p)/p, p = 2 - 2H
    band2: float
    top4: float  # for p = 4 - 2H, without the division by p
    below4: float
    band4: float


@jitable
def island_height(x: Any, h_d: Any, sigma_d: Any, gap: Any, rms_over_s: Any) -> Any:
    """z'/sigma_d (41) at x = delta/h_rms; z_max is counted down from h_max, so nothing cancels at first contact."""
    return ((gap.peak - (gap.compression - x)) * rms_over_s - h_d) / sigma_d


@jitable
def island_density(height: Any, D_d: Any, sigma_d: Any) -> Any:
    """Islands per nominal area and delta/s (42, 43), without K1; of numbers or arrays."""
    return D_d * np.exp(-0.5 * height * height) / (math.sqrt(2.0 * math.pi) * sigma_d)


@jitable
def jacobian_below(rms_over_s: Any, beta: float, printed: bool, offset: bool) -> Any:
    """K1 (47) below the kink, or what (46) gives."""
    return 1.0 - 4.0 / 3.0 * beta / (1.0 if printed else rms_over_s) if printed or offset else 1.0


# fastmath=False is said because else numba takes that of whichever caller compiles it first, and bits depend on it
@njit(cache=True, fastmath=False, error_model="numpy")
def surface_constants(hurst: float, zeta_1: float, reading: ReadingNumbers, printed: bool) -> SurfaceConstants:
    """The constants of a surface; `printed` is of the reading's Jacobian."""
    phi = reading.phi
    log_zeta_1 = math.log(zeta_1)
    rms_over_s = math.sqrt(-math.expm1(-2.0 * hurst * log_zeta_1))
    e = math.exp(-2.0 * hurst * log_zeta_1)
    jacobian = jacobian_below(rms_over_s, reading.beta, printed, reading.offset)
    slope_d = 4.0 / 3.0 * reading.beta
    slope_u = phi / (1.0 + phi) * rms_over_s
    root_floor_d = math.sqrt(floor_offset(hurst, zeta_1, reading.floor_d))
    root_floor_u = math.sqrt(floor_offset(hurst, zeta_1, reading.floor_u))
    D_top = summit_rate(hurst, 0.0, log_zeta_1) / reading.density_divisor
    R_top = RADIUS / math.sqrt(m4_of(hurst, 0.0, log_zeta_1))
    return SurfaceConstants(
        hurst,
        log_zeta_1,
        e,
        rms_over_s,
        slope_d,
        slope_u,
        root_floor_d,
        root_floor_u,
        floor_offset(hurst, zeta_1, reading.floor_u),
        math.log(reading.floor_d),
        math.log(reading.floor_u),
        0.75 * (math.pi * D_top) ** (1.0 / 3.0) * (1.5 * R_top) ** (2.0 / 3.0) * phi ** (-1.0 / 3.0),
        root_floor_d / slope_d,
        root_floor_u / slope_u,
        STRETCH * math.exp(-hurst * log_zeta_1),
        jacobian,
        0.0 if printed else 0.5 * (1.0 - 1.0 / jacobian) * e / (rms_over_s * rms_over_s),
        reading,
    )


@njit(cache=True, fastmath=REORDER, error_model="numpy", forceinline=True)
def island_node(x: float, floor_d: bool, floor_u: bool, surface: SurfaceConstants) -> Node:
    """The island at delta = x h_rms; `floor_d`, `floor_u`: whether zeta_d (27), zeta_u (30) are at their floors.

    The arithmetic of `islands.geometry`, rearranged, without a branch but for the floors.
    """
    H, e = surface.hurst, surface.e
    p2, p4, over_2H = 2.0 - 2.0 * H if H != 1.0 else TINY, 4.0 - 2.0 * H, 0.5 / H
    root_a = surface.root_floor_d if floor_d else surface.slope_d * x
    root_b = surface.root_floor_u if floor_u else surface.slope_u * x
    a = root_a * root_a
    b = surface.offset_floor_u if floor_u else root_b * root_b
    # both shrink with x below the floors, where the difference of squares would cancel
    m0 = a - b if floor_u else (root_a - root_b) * (root_a + root_b)
    # only the width needs its relative digits
    log_d = surface.log_floor_d if floor_d else -log(e + a) * over_2H
    width = log1p(m0 / (e + b)) * over_2H
    # p (zeta^p - 1)/p over [1, zeta_d] and over the band, for p = 4 - 2H and p = 2 - 2H; zeta_d^(-2H) = e + a
    square = exp(2.0 * log_d)
    top4 = square * square * (e + a)
    below4 = top4 - 1.0
    below2 = expm1(p2 * log_d) / p2
    top2 = 1.0 + p2 * below2
    band2 = top2 * expm1(p2 * width) / p2
    band4 = top4 * expm1(p4 * width)
    # m2 = H below2, m4 = (3 H/4 p4) below4, alpha = m0 m4/m2^2
    rate = 0.75 / p4
    tilt = BROADENING * H / rate if surface.reading.summit_sigma else 0.0
    D = rate / surface.reading.density_divisor * (band4 / band2)
    D_d = rate / surface.reading.density_divisor * (below4 / below2)
    sigma = math.sqrt(m0 - tilt * band2 * band2 / band4)
    sigma_d = math.sqrt(1.0 - (e + a) - tilt * below2 * below2 / below4)
    radius = RADIUS / math.sqrt(rate * H)
    R_d = radius / math.sqrt(below4)
    R_u = radius / math.sqrt(below4 + band4)
    h_d = root_a if surface.reading.offset else 0.0
    both = R_u * R_d
    force = sigma * math.sqrt(2.0 * R_d * sigma)
    mu = 8.0 / 3.0 * D * sigma * math.sqrt(2.0 * both)
    eta = surface.eta_factor * exp(log(root_b / R_u) * (1.0 / 3.0))
    area = 2.0 * math.pi * eta * D * both * sigma * sigma
    return Node(
        (surface.rms_over_s * x - h_d) / sigma, mu, force, area, h_d, D_d, sigma_d,
        m0, sigma, b, e + a, log_d, width, top2, below2, band2, top4, below4, band4,
    )  # fmt: skip


@njit(cache=True, fastmath=REORDER, error_model="numpy", forceinline=True)
def _moment(p: float, length: float, growth: float) -> float:
    """Integral of l e^(p l) from 0 to `length`, the derivative by p of that of e^(p l), which is `growth`."""
    y = p * length
    series = 1.0 / 8.0 + y * (1.0 / 30.0 + y * (1.0 / 144.0 + y * (1.0 / 840.0 + y * (1.0 / 5760.0 + y / 45360.0))))
    series = 0.5 + y * (1.0 / 3.0 + y * series)
    return length * length * series if y < NEAR_ONE else (length + (y - 1.0) * growth) / p


@njit(cache=True, error_model="numpy")
def m2_slopes(H: float, log_zeta: float) -> tuple[float, float]:
    """Derivatives by H and by log(zeta) of log(m2) over [1, zeta]."""
    p2 = 2.0 - 2.0 * H if H != 1.0 else TINY
    growth = math.expm1(p2 * log_zeta) / p2
    return 1.0 / H - 2.0 * _moment(p2, log_zeta, growth) / growth, p2 + 1.0 / growth


@njit(cache=True, fastmath=REORDER, error_model="numpy", forceinline=True)
def node_slopes(
    by_hurst: bool, height: float, floor_d: bool, floor_u: bool, node: Node, surface: SurfaceConstants
) -> tuple[float, float, float, float]:
    """Derivatives of X, mu and log(force), log(area) with their weights in the totals, the node being held.

    By H at given e = zeta_1^(-2H), or by log(e) at given H; `eta_factor` and K1 are held. Here ``d_D`` is of
    log(D), and so on, but those of e, a, b, m0, h_d, X, height and of logarithms are what they say.
    """
    H, h = surface.hurst, 1.0 if by_hurst else 0.0
    p2, p4, over_2H = 2.0 - 2.0 * H if H != 1.0 else TINY, 4.0 - 2.0 * H, 0.5 / H
    d_e = 0.0 if by_hurst else surface.e
    d_rms = -0.5 * d_e / (surface.rms_over_s * surface.rms_over_s)
    low = surface.e + node.b
    floor_a = -2.0 * surface.log_floor_d * node.top if by_hurst else -d_e
    floor_b = -2.0 * surface.log_floor_u * low if by_hurst else -d_e
    d_a = floor_a if floor_d else 0.0
    d_b = floor_b if floor_u else 2.0 * node.b * d_rms
    d_m0 = d_a - d_b
    log_d, width = node.log_d, node.width
    d_log_d = 0.0 if floor_d else -d_e / node.top * over_2H - h * log_d / H
    d_width = (d_m0 - node.m0 * (d_e + d_b) / low) / node.top * over_2H - h * width / H
    # of the p-th powers at the lower end; of what the band adds, and of what lies below it
    d_end2, d_end4 = p2 * d_log_d - 2.0 * h * log_d, p4 * d_log_d - 2.0 * h * log_d
    grown2, grown4 = node.band2 / node.top2, node.band4 / node.top4
    d_band2 = d_end2 + (1.0 + p2 * grown2) * d_width / grown2
    d_band4 = d_end4 + (1.0 + grown4) * (p4 * d_width - 2.0 * h * width) / grown4
    d_below2 = node.top2 * d_log_d / node.below2
    d_below4 = node.top4 * d_end4 / node.below4
    if by_hurst:
        d_band2 -= 2.0 * _moment(p2, width, grown2) / grown2
        d_below2 -= 2.0 * _moment(p2, log_d, node.below2) / node.below2
    # of summit densities, standard deviations, radii, as in `island_node`
    rate, d_rate = 0.75 / p4, 2.0 * h / p4
    tilt, d_tilt = BROADENING * H / rate if surface.reading.summit_sigma else 0.0, h / H - d_rate
    part, part_d = tilt * node.band2 * node.band2 / node.band4, tilt * node.below2 * node.below2 / node.below4
    d_D, d_D_d = d_rate + d_band4 - d_band2, d_rate + d_below4 - d_below2
    d_sigma = 0.5 * (d_m0 - part * (d_tilt + 2.0 * d_band2 - d_band4)) / (node.sigma * node.sigma)
    d_sigma_d = d_e + d_a + part_d * (d_tilt + 2.0 * d_below2 - d_below4)
    d_sigma_d *= -0.5 / (node.sigma_d * node.sigma_d)
    below4, band4 = node.below4, node.band4
    d_R_d = -0.5 * (d_rate + h / H + d_below4)
    d_R_u = -0.5 * (d_rate + h / H + (below4 * d_below4 + band4 * d_band4) / (below4 + band4))
    d_h_d = 0.5 * d_a / surface.root_floor_d if surface.reading.offset else 0.0
    d_root_b = 0.5 * floor_b / node.b if floor_u else d_rms
    d_X = ((node.X * node.sigma + node.h_d) * d_rms - d_h_d) / node.sigma - node.X * d_sigma
    d_height = ((height * node.sigma_d + node.h_d) * d_rms - d_h_d) / node.sigma_d - height * d_sigma_d
    # delta/h_rms is held, so the density is per h_rms: h_rms/s is part of it
    common = d_D_d - d_sigma_d + d_rms - height * d_height
    d_mu = d_D + d_sigma + 0.5 * (d_R_d + d_R_u)
    d_area = (d_root_b - d_R_u) / 3.0 + d_D + d_R_u + d_R_d + 2.0 * d_sigma
    return d_X, node.mu * d_mu, 1.5 * d_sigma + 0.5 * d_R_d + common, d_area + common


@njit(cache=True, fastmath=REORDER, error_model="numpy", nogil=True)
def fill_fields(
    x: FloatArray,
    peak: float,
    hurst: float,
    zeta_1: float,
    reading: ReadingNumbers,
    printed: bool,
    table: Table,
    out: FloatArray,
) -> tuple[int, float]:
    """What `profile` keeps of islands at approaches: weights of force and area, shift and rate of heights, as rows.

    Returns the status of the worst, and the largest error.
    """
    surface, X, mu = surface_constants(hurst, zeta_1, reading, printed), np.empty(x.size), np.empty(x.size)
    rms_over_s, worst, largest = surface.rms_over_s, OK, 0.0
    for k in range(x.size):
        floor_d = x[k] >= surface.kink_d
        node = island_node(x[k], floor_d, x[k] > surface.kink_u, surface)
        each = (1.0 if floor_d else surface.jacobian) * rms_over_s * node.D_d / (ROOT_TWO_PI * node.sigma_d)
        X[k], mu[k], out[0, k], out[1, k] = node.X, node.mu, node.force * each, node.area * each
        out[2, k] = ((peak + x[k]) * rms_over_s - node.h_d) / node.sigma_d
        out[3, k] = rms_over_s / node.sigma_d
    for k in range(x.size):
        status, phi_F, _, _, phi_A, _, _, error = universal_phi(X[k], mu[k], table, None)
        worst, largest = max(worst, status), max(largest, error)
        out[0, k] *= phi_F
        out[1, k] *= phi_A
    return worst, largest
