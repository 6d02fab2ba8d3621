"""Intervals of a compiled total: where its integrand breaks, what they are mapped by, and the rules applied to them.

Below the floor of zeta_d the approach is mapped by x = scale sinh(t)^2, a power at 0 and geometric beyond the boundary
layer; above it the integrand is little more than a Gaussian of x, and x itself serves.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import njit
from mbma_tables.totals.gauss_kronrod import GAUSS as GAUSS_21
from mbma_tables.totals.gauss_kronrod import KRONROD as KRONROD_21
from mbma_tables.totals.gauss_kronrod import NODES as NODES_21

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
NODES_31 = np.concatenate((-_NODES[:-1], _NODES[::-1]))
KRONROD_31 = np.concatenate((_WEIGHTS[:-1], _WEIGHTS[::-1]))
GAUSS_31 = np.zeros(31)
GAUSS_31[1:15:2] = _GAUSS[:-1]
GAUSS_31[15] = _GAUSS[-1]
GAUSS_31[17:30:2] = _GAUSS[-2::-1]


MOST_INTERVALS = 200
STRETCH = 8.0  # the map's scale in boundary layers zeta_1^(-H): fewest nodes over random surfaces
SMALL_ANGLE = 0.01  # below it sinh goes through its own function
NARROW = 2.5  # in h_rms: above the floor of zeta_d, the smaller rule resolves a Gaussian this wide to 1e-8
SAFETY = 4.0  # a Kronrod sum errs by at most 3 (difference to Gauss)^1.5, seen over random surfaces: 4^1.5 = 8

Bools = NDArray[np.bool_]


@njit(cache=True, error_model="numpy")
def to_angle(x: float, scale: float) -> float:
    """The t at which scale sinh(t)^2 is x."""
    return math.asinh(math.sqrt(x / scale))


@njit(cache=True, error_model="numpy")
def first_intervals(reach: float, kink_d: float, kink_u: float, scale: float, bounds: FloatArray, floors: Bools) -> int:
    """Fill `bounds` and `floors` (of zeta_d, zeta_u) with the pieces of [0, reach] between the kinks; their count."""
    edges = (0.0, min(kink_d, kink_u, reach), min(max(kink_d, kink_u), reach), reach)
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
def rule_for(low: float, high: float, straight: bool) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Nodes, Kronrod weights and Gauss weights on [-1, 1] for an interval."""
    if straight and high - low < NARROW:
        return NODES_21, KRONROD_21, GAUSS_21
    return NODES_31, KRONROD_31, GAUSS_31


@njit(cache=True, error_model="numpy")
def approach_at(t: float, straight: bool, scale: float) -> tuple[float, float]:
    """X = delta/h_rms and dx/dt at a node."""
    if straight:
        return t, 1.0
    grown = math.exp(t)
    shrunk = 1.0 / grown
    # below SMALL_ANGLE the exponentials would cancel
    rise = 0.5 * (grown - shrunk) if t > SMALL_ANGLE else math.sinh(t)
    return scale * rise * rise, scale * rise * (grown + shrunk)


@njit(cache=True, error_model="numpy")
def error_of(force: float, gauss_force: float, area: float, gauss_area: float) -> float:
    """Relative error of both Kronrod sums: both integrands resolve alike, and one may agree by chance."""
    difference = max(abs(gauss_force / force - 1.0), abs(gauss_area / area - 1.0))
    error: float = min(difference, (SAFETY * difference) ** 1.5)
    return error
