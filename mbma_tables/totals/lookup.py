"""One surface, one gap, in one compiled pass: islands by lookup, Gauss-Kronrod over delta (Eqs. 44-50).

The same integral as in `contact`, for the universal table. An island costs a few logarithms and exponentials
instead of a solution; what depends on the surface alone is computed once per surface. No work space is shared.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.islands.geometry import floor_offset
from mbma_tables.models.universal_kernel import OK, UNRESOLVED, Axes, universal_phi
from mbma_tables.surfaces.spectrum import BROADENING, RADIUS, m4_of, summit_rate

# QUADPACK's 31-point Kronrod rule and its 15-point Gauss rule (Piessens et al. 1983), half of each
_NODES = np.array(
    [
        0.998002298693397060285172840152271,
        0.987992518020485428489565718586613,
        0.967739075679139134257347978784337,
        0.937273392400705904307758947710209,
        0.897264532344081900882509656454496,
        0.848206583410427216200648320774217,
        0.790418501442465932967649294817947,
        0.724417731360170047416186054613938,
        0.650996741297416970533735895313275,
        0.570972172608538847537226737253911,
        0.485081863640239680693655740232351,
        0.394151347077563369897207370981045,
        0.299180007153168812166780024266389,
        0.201194093997434522300628303394596,
        0.101142066918717499027074231447392,
        0.0,
    ]
)
_WEIGHTS = np.array(
    [
        0.005377479872923348987792051430128,
        0.015007947329316122538374763075807,
        0.025460847326715320186874001019653,
        0.035346360791375846222037948478360,
        0.044589751324764876608227299373280,
        0.053481524690928087265343147239430,
        0.062009567800670640285139230960803,
        0.069854121318728258709520077099147,
        0.076849680757720378894432777482659,
        0.083080502823133021038289247286104,
        0.088564443056211770647275443693774,
        0.093126598170825321225486872747346,
        0.096642726983623678505179907627589,
        0.099173598721791959332393173484603,
        0.100769845523875595044946662617570,
        0.101330007014791549017374792767493,
    ]
)
_GAUSS = np.array(
    [
        0.030753241996117268354628393577204,
        0.070366047488108124709267416450667,
        0.107159220467171935011869546685869,
        0.139570677926154314447804794511028,
        0.166269205816993933553200860481209,
        0.186161000015562211026800561866423,
        0.198431485327111576456118326443839,
        0.202578241925561272880620199967519,
    ]
)
NODES = np.concatenate((-_NODES[:-1], _NODES[::-1]))
KRONROD = np.concatenate((_WEIGHTS[:-1], _WEIGHTS[::-1]))
GAUSS = np.zeros(31)
GAUSS[1:15:2] = _GAUSS[:-1]
GAUSS[15] = _GAUSS[-1]
GAUSS[17:30:2] = _GAUSS[-2::-1]

MOST_INTERVALS = 200
SMALL_POWER = 0.01  # below these, differences of exponentials go through expm1
SMALL_WIDTH = 0.01
SAFETY = 4.0  # a Kronrod sum errs by at most 3 (difference to Gauss)^1.5, seen over random surfaces: 4^1.5 = 8

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
        math.exp(-hurst * log_zeta_1),
    )


@njit(cache=True, error_model="numpy")
def jacobian_below(surface: Constants, printed: bool, offset: bool) -> float:
    """K1 (47) below the kink."""
    return 1.0 - surface[3] / (1.0 if printed else surface[2]) if printed or offset else 1.0


@njit(cache=True, fastmath=_LOOSE, error_model="numpy")
def island_node(x: float, floor_d: bool, floor_u: bool, surface: Constants, offset: bool, summits: bool) -> Node:
    """(X, mu, F_hat per Phi_F, A^i per Phi_A with eta, h_d, D_d, sigma_d) at delta = x h_rms.

    `floor_d` and `floor_u` say whether zeta_d (27) and zeta_u (30) stand at their floors. The arithmetic of
    `islands.geometry`, rearranged: one logarithm and two exponentials for each end of the band.
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
    # p (zeta^p - 1)/p over [1, zeta_d] and over the band, for p = 4 - 2H and p = 2 - 2H
    top4 = math.exp(p4 * log_d)
    below4 = top4 - 1.0
    if p2 > SMALL_POWER and width > SMALL_WIDTH:
        top2 = math.exp(p2 * log_d)
        below2 = (top2 - 1.0) / p2
        band2 = top2 * (math.exp(p2 * width) - 1.0) / p2
        band4 = top4 * (math.exp(p4 * width) - 1.0)
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
    area = 2.0 * math.pi * eta_factor * np.cbrt(root_b / R_u) * D * both * sigma * sigma
    return (room * x - h_d) / sigma, mu, force, area, h_d, D_d, sigma_d


@njit(cache=True, fastmath=_LOOSE, error_model="numpy")
def _rule(
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
) -> tuple[int, float, float, float, float]:
    """One Kronrod rule over t in [low, high]: status, force, area, their relative error, and the table's."""
    layer, room = surface[12], surface[2]
    half, centre = 0.5 * (high - low), 0.5 * (high + low)
    force = area = gauss_force = gauss_area = doubt = 0.0
    for k in range(31):
        t = centre + half * NODES[k]
        # sinh(t); below SMALL_WIDTH the exponentials would cancel
        grown = math.exp(t)
        shrunk = 1.0 / grown
        rise = 0.5 * (grown - shrunk) if t > SMALL_WIDTH else math.sinh(t)
        x = layer * rise * rise
        X, mu, per_F, per_A, h_d, D_d, sigma_d = island_node(x, floor_d, floor_u, surface, flags[0], flags[1])
        status, phi_F, phi_A, error = universal_phi(X, mu, table, errors, axes)
        if status != OK:
            return status, math.nan, math.nan, math.nan, math.nan
        height = ((top - (reach - x)) * room - h_d) / sigma_d
        # d(delta/s) = room layer 2 sinh cosh dt
        weight = D_d * math.exp(-0.5 * height * height) / (math.sqrt(2.0 * math.pi) * sigma_d)
        weight *= room * layer * rise * (grown + shrunk) * half
        f, g = per_F * phi_F * weight, per_A * phi_A * weight
        force += KRONROD[k] * f
        area += KRONROD[k] * g
        gauss_force += GAUSS[k] * f
        gauss_area += GAUSS[k] * g
        doubt = max(doubt, error)
    if not (force > 0.0 and area > 0.0):
        return OK, force, area, 0.0, doubt
    # both integrands resolve alike, and a chance agreement of one is not one of both
    difference = max(abs(gauss_force / force - 1.0), abs(gauss_area / area - 1.0))
    return OK, force, area, min(difference, (SAFETY * difference) ** 1.5), doubt


@njit(cache=True, error_model="numpy", nogil=True)
def total(
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
    """Status, F/(A0 E* q0 s), A/A0, the bound on their relative error, and the rules applied.

    The gap is (h_max - d)/h_rms = reach.
    """
    if not reach > 0.0:
        return OK, 0.0, 0.0, 0.0, 0
    rules = 0
    layer, kink_d, kink_u = surface[12], surface[10], surface[11]
    bounds = np.empty((MOST_INTERVALS, 2))
    parts = np.empty((MOST_INTERVALS, 3))
    floors = np.empty((MOST_INTERVALS, 2), dtype=np.bool_)
    first, second = min(kink_d, kink_u, reach), min(max(kink_d, kink_u), reach)
    edges = (0.0, first, second, reach)
    count = 0
    doubt = 0.0
    for segment in range(3):
        if edges[segment + 1] > edges[segment]:
            middle = 0.5 * (edges[segment] + edges[segment + 1])
            bounds[count, 0] = math.asinh(math.sqrt(edges[segment] / layer))
            bounds[count, 1] = math.asinh(math.sqrt(edges[segment + 1] / layer))
            floors[count, 0], floors[count, 1] = middle > kink_d, middle > kink_u
            parts[count, 0] = -1.0
            count += 1
    while True:
        force = area = force_error = area_error = 0.0
        for k in range(count):
            if parts[k, 0] < 0.0:
                status, f, g, error, own = _rule(
                    bounds[k, 0], bounds[k, 1], floors[k, 0], floors[k, 1],
                    reach, top, surface, flags, table, errors, axes,
                )  # fmt: skip
                rules += 1
                if status != OK:
                    return status, math.nan, math.nan, math.nan, rules
                K1 = 1.0 if floors[k, 0] else jacobian
                parts[k, 0], parts[k, 1], parts[k, 2] = K1 * f, K1 * g, error
                doubt = max(doubt, own)
            force += parts[k, 0]
            area += parts[k, 1]
            force_error += parts[k, 0] * parts[k, 2]
            area_error += parts[k, 1] * parts[k, 2]
        if not (force > 0.0 and area > 0.0):
            return OK, force, area, 0.0, rules
        if force_error <= rtol * force and area_error <= rtol * area:
            return OK, force, area, max(force_error / force, area_error / area) + doubt, rules
        present = count
        for k in range(present):
            share = present * parts[k, 2]
            if parts[k, 0] * share > rtol * force or parts[k, 1] * share > rtol * area:
                if count == MOST_INTERVALS:
                    return UNRESOLVED, force, area, math.nan, rules
                half = 0.5 * (bounds[k, 0] + bounds[k, 1])
                bounds[count, 0], bounds[count, 1] = half, bounds[k, 1]
                bounds[k, 1] = half
                floors[count, 0], floors[count, 1] = floors[k, 0], floors[k, 1]
                parts[k, 0] = parts[count, 0] = -1.0
                count += 1


@njit(cache=True, error_model="numpy", nogil=True)
def fill_totals(
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
        status[k], out[0, k], out[1, k], out[2, k], rules = total(
            reach[k], top[k], rtol, surface, jacobian, (reading[5], reading[6]), table, errors, axes
        )
        islands += 31 * rules
    return islands
