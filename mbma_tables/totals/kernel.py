"""One surface, one gap, in one compiled pass: islands from the universal table, Gauss-Kronrod over delta (Eqs. 44-50).

An island costs a few logarithms and exponentials instead of a solution, over all nodes of a rule in one loop; what
depends on the surface alone is computed once per surface. No work space is shared.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import REORDER, jitable, njit
from mbma_tables.elementary import exp, expm1, log, log1p
from mbma_tables.islands.geometry import floor_offset
from mbma_tables.models.protocol import BOTH
from mbma_tables.models.universal_kernel import OK, Table, universal_one, universal_phi
from mbma_tables.surfaces.readings import ReadingNumbers
from mbma_tables.surfaces.spectrum import BROADENING, RADIUS, m4_of, summit_rate
from mbma_tables.surfaces.surface import Surface
from mbma_tables.totals.intervals import STRETCH, Gap, Interval, approach_at, error_of, refine, rule_for

TINY = 1e-100  # for a power of 0
LEAST = -700.0  # of exponents: below it a Gaussian is nothing
ROOT_TWO_PI = math.sqrt(2.0 * math.pi)


class Pairs(NamedTuple):
    """Flat (surface, gap) pairs in units of h_rms and 1/q0."""

    hurst: FloatArray
    zeta_1: FloatArray
    rms_over_s: FloatArray  # h_rms/s = sqrt(1 - zeta_1^(-2H))
    compression: FloatArray  # (h_max - d)/h_rms
    peak: FloatArray  # h_max/h_rms
    layer: FloatArray  # approach at which zeta_d leaves zeta_1, zeta_1^(-H)

    @classmethod
    def of(cls, surface: Surface, depth: FloatArray) -> Pairs:
        """Of a surface, or a batch, at h_max - d = `depth` [length], of the shape that both broadcast to."""

        def flat(field: Any) -> FloatArray:
            array = np.asarray(field, dtype=float)
            # copies, since numba compiles again for arrays that cannot be written
            return np.full(depth.size, array) if array.ndim == 0 else np.broadcast_to(array, depth.shape).flatten()

        hurst, zeta_1 = flat(surface.hurst), flat(surface.zeta_1)
        return cls(
            hurst=hurst,
            zeta_1=zeta_1,
            rms_over_s=flat(surface.h_rms / surface.s),
            compression=flat(depth / surface.h_rms),
            peak=flat(surface.h_max / surface.h_rms),
            layer=np.exp(-hurst * np.log(zeta_1)),
        )

    def some(self, chosen: Any) -> Pairs:
        """The pairs at these places."""
        return Pairs(*(field[chosen] for field in self))


class SurfaceConstants(NamedTuple):
    """What islands need of their surface, in units of h_rms, s and 1/q0; a and b are zeta^(-2H) - zeta_1^(-2H)."""

    hurst: float
    e: float  # zeta_1^(-2H)
    rms_over_s: float  # h_rms/s = sqrt(1 - e)
    slope_d: float  # sqrt(a) per x = delta/h_rms below the floor of zeta_d (27)
    slope_u: float  # sqrt(b) per x below the floor of zeta_u (30)
    root_floor_d: float  # sqrt(a) at the floor of zeta_d
    root_floor_u: float  # sqrt(b) at the floor of zeta_u
    offset_floor_u: float  # b there
    log_floor_d: float
    density_divisor: float
    eta_factor: float
    kink_d: float  # x at which zeta_d reaches its floor
    kink_u: float  # x at which zeta_u reaches its floor
    map_scale: float
    jacobian: float  # K1 (47) below kink_d
    offset: bool
    summit_sigma: bool


class Node(NamedTuple):
    """An island at a node of the quadrature."""

    X: float
    mu: float
    force: float  # F^i per Phi_F
    area: float  # A^i per Phi_A
    h_d: float
    D_d: float
    sigma_d: float


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


@njit(cache=True, error_model="numpy")
def surface_constants(hurst: float, zeta_1: float, reading: ReadingNumbers, printed: bool) -> SurfaceConstants:
    """The constants of a surface; `printed` is of the reading's Jacobian."""
    phi = reading.phi
    log_zeta_1 = math.log(zeta_1)
    rms_over_s = math.sqrt(-math.expm1(-2.0 * hurst * log_zeta_1))
    slope_d = 4.0 / 3.0 * reading.beta
    slope_u = phi / (1.0 + phi) * rms_over_s
    root_floor_d = math.sqrt(floor_offset(hurst, zeta_1, reading.floor_d))
    root_floor_u = math.sqrt(floor_offset(hurst, zeta_1, reading.floor_u))
    D_top = summit_rate(hurst, 0.0, log_zeta_1) / reading.density_divisor
    R_top = RADIUS / math.sqrt(m4_of(hurst, 0.0, log_zeta_1))
    return SurfaceConstants(
        hurst,
        math.exp(-2.0 * hurst * log_zeta_1),
        rms_over_s,
        slope_d,
        slope_u,
        root_floor_d,
        root_floor_u,
        floor_offset(hurst, zeta_1, reading.floor_u),
        math.log(reading.floor_d),
        reading.density_divisor,
        0.75 * (math.pi * D_top) ** (1.0 / 3.0) * (1.5 * R_top) ** (2.0 / 3.0) * phi ** (-1.0 / 3.0),
        root_floor_d / slope_d,
        root_floor_u / slope_u,
        STRETCH * math.exp(-hurst * log_zeta_1),
        jacobian_below(rms_over_s, reading.beta, printed, reading.offset),
        reading.offset,
        reading.summit_sigma,
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
    band2 = (1.0 + p2 * below2) * expm1(p2 * width) / p2
    band4 = top4 * expm1(p4 * width)
    # m2 = H below2, m4 = (3 H/4 p4) below4, alpha = m0 m4/m2^2
    rate = 0.75 / p4
    tilt = BROADENING * H / rate if surface.summit_sigma else 0.0
    D = rate / surface.density_divisor * (band4 / band2)
    D_d = rate / surface.density_divisor * (below4 / below2)
    sigma = math.sqrt(m0 - tilt * band2 * band2 / band4)
    sigma_d = math.sqrt(1.0 - (e + a) - tilt * below2 * below2 / below4)
    radius = RADIUS / math.sqrt(rate * H)
    R_d = radius / math.sqrt(below4)
    R_u = radius / math.sqrt(below4 + band4)
    h_d = root_a if surface.offset else 0.0
    both = R_u * R_d
    force = sigma * math.sqrt(2.0 * R_d * sigma)
    mu = 8.0 / 3.0 * D * sigma * math.sqrt(2.0 * both)
    eta = surface.eta_factor * exp(log(root_b / R_u) * (1.0 / 3.0))
    area = 2.0 * math.pi * eta * D * both * sigma * sigma
    return Node((surface.rms_over_s * x - h_d) / sigma, mu, force, area, h_d, D_d, sigma_d)


@njit(cache=True, fastmath=REORDER, error_model="numpy")
def fill_nodes(interval: Interval, gap: Gap, surface: SurfaceConstants, out: FloatArray) -> int:
    """X, mu, what force and area add per Phi_F and Phi_A, and how both rise with the compression, as rows.

    Of the nodes of an interval, whose number is returned.
    A loop that vectorises: no branch, no call.
    """
    low, high, floor_d, floor_u = interval
    nodes = rule_for(interval)[0]
    half, centre = 0.5 * (high - low), 0.5 * (high + low)
    rms_over_s = surface.rms_over_s
    for k in range(nodes.size):
        x, stretch = approach_at(centre + half * nodes[k], floor_d, surface.map_scale)
        node = island_node(x, floor_d, floor_u, surface)
        height = island_height(x, node.h_d, node.sigma_d, gap, rms_over_s)
        share = -0.5 * height * height
        # d(delta/s) = rms_over_s dx
        weight = node.D_d / (ROOT_TWO_PI * node.sigma_d) * rms_over_s * stretch * half
        weight *= exp(share) if share > LEAST else 0.0
        out[0, k], out[1, k] = node.X, node.mu
        out[2, k], out[3, k] = node.force * weight, node.area * weight
        out[4, k] = height * rms_over_s / node.sigma_d
    return nodes.size


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
    surface = surface_constants(hurst, zeta_1, reading, printed)
    rms_over_s, worst, largest = surface.rms_over_s, OK, 0.0
    for k in range(x.size):
        floor_d = x[k] >= surface.kink_d
        node = island_node(x[k], floor_d, x[k] > surface.kink_u, surface)
        status, phi_F, phi_A, error = universal_phi(node.X, node.mu, table)
        worst, largest = max(worst, status), max(largest, error)
        each = (1.0 if floor_d else surface.jacobian) * rms_over_s * node.D_d / (ROOT_TWO_PI * node.sigma_d)
        out[0, k], out[1, k] = node.force * phi_F * each, node.area * phi_A * each
        out[2, k] = ((peak + x[k]) * rms_over_s - node.h_d) / node.sigma_d
        out[3, k] = rms_over_s / node.sigma_d
    return worst, largest


@njit(cache=True, fastmath=REORDER, error_model="numpy")
def _rule(
    which: int,
    interval: Interval,
    gap: Gap,
    surface: SurfaceConstants,
    near: None,
    table: Table,
    work: FloatArray,
    part: FloatArray,
) -> tuple[int, float, float, int]:
    """One Kronrod rule over an interval, see `refine`. Where `which` is FORCE or AREA, that one is both rows."""
    _, kronrod, gauss = rule_for(interval)
    count = fill_nodes(interval, gap, surface, work)
    force = area = gauss_force = gauss_area = table_error = 0.0
    for k in range(count):
        if which == BOTH:
            status, phi_F, phi_A, error = universal_phi(work[0, k], work[1, k], table)
            f, g = work[2, k] * phi_F, work[3, k] * phi_A
        else:
            status, phi, error = universal_one(which, work[0, k], work[1, k], table)
            f = g = work[2 + which, k] * phi
        if status != OK:
            return status, math.nan, math.nan, count
        force += kronrod[k] * f
        area += kronrod[k] * g
        gauss_force += gauss[k] * f
        gauss_area += gauss[k] * g
        table_error = max(table_error, error)
    K1 = 1.0 if interval.floor_d else surface.jacobian
    part[0, 0], part[1, 0] = K1 * force, K1 * area
    if not (force > 0.0 and area > 0.0):
        return OK, 0.0, table_error, count
    return OK, error_of(force, gauss_force, area, gauss_area), table_error, count


@njit(cache=True, error_model="numpy", nogil=True)
def total(
    which: int, gap: Gap, rtol: float, surface: SurfaceConstants, table: Table
) -> tuple[int, float, float, float, int]:
    """Status, F/(A0 E* q0 s), A/A0, the bound on their relative error, and the islands evaluated.

    Where `which` is FORCE or AREA, that one is given as both.
    """
    if not gap.compression > 0.0:
        return OK, 0.0, 0.0, 0.0, 0
    out = np.full((2, 1), math.nan)
    status, error, islands = refine(_rule, which, gap, rtol, surface, None, table, out)
    return status, out[0, 0], out[1, 0], error, islands


@njit(cache=True, error_model="numpy", nogil=True)
def fill_totals(
    which: int,
    given: Any,
    rtol: float,
    reading: ReadingNumbers,
    printed: bool,
    table: Table,
    status: NDArray[np.int64],
    out: FloatArray,
) -> int:
    """`total` of each of the `Pairs` given into the rows of `out` (pairs, 3); returns the islands evaluated."""
    islands = 0
    # a plain tuple, which a call from Python passes on faster
    pairs = Pairs(*given)
    hurst, zeta_1 = pairs.hurst, pairs.zeta_1
    surface = surface_constants(hurst[0], zeta_1[0], reading, printed)
    for k in range(hurst.size):
        if k > 0 and (hurst[k] != hurst[k - 1] or zeta_1[k] != zeta_1[k - 1]):
            surface = surface_constants(hurst[k], zeta_1[k], reading, printed)
        gap = Gap(pairs.compression[k], pairs.peak[k])
        status[k], out[k, 0], out[k, 1], out[k, 2], count = total(which, gap, rtol, surface, table)
        islands += count
    return islands
