"""Gauss-Kronrod rules, and adaptive quadrature of many integrals at once, to a relative tolerance each.

The rules are QUADPACK's (Piessens, de Doncker-Kapenga, Ueberhuber and Kahaner 1983). scipy's adaptive rules work on
one integral, or refine a batch together to an absolute tolerance; here each integral has its own interval, is refined
on its own and is judged by its own value.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import ConvergenceError

# half of each rule, from the end to the middle; the Gauss rule has every other node
_NODES_21 = (
    0.995657163025808080735527280689003, 0.973906528517171720077964012084452, 0.930157491355708226001207180059508,
    0.865063366688984510732096688423493, 0.780817726586416897063717578345042, 0.679409568299024406234327365114874,
    0.562757134668604683339000099272694, 0.433395394129247190799265943165784, 0.294392862701460198131126603103866,
    0.148874338981631210884826001129720, 0.0,
)  # fmt: skip
_KRONROD_21 = (
    0.011694638867371874278064396062192, 0.032558162307964727478818972459390, 0.054755896574351996031381300244580,
    0.075039674810919952767043140916190, 0.093125454583697605535065465083366, 0.109387158802297641899210590325805,
    0.123491976262065851077958109585166, 0.134709217311473325928054001771707, 0.142775938577060080797094273138717,
    0.147739104901338491374841515972068, 0.149445554002916905664936468389821,
)  # fmt: skip
_GAUSS_21 = (
    0.066671344308688137593568809893332, 0.149451349150580593145863396957658, 0.219086362515982043995534934228163,
    0.269266719309996355091226921569469, 0.295524224714752870173815619188769,
)  # fmt: skip
_NODES_31 = (
    0.998002298693397060285172840152271, 0.987992518020485428489565718586613, 0.967739075679139134257347978784337,
    0.937273392400705904307758947710209, 0.897264532344081900882509656454496, 0.848206583410427216200648320774217,
    0.790418501442465932967649294817947, 0.724417731360170047416186054613938, 0.650996741297416970533735895313275,
    0.570972172608538847537226737253911, 0.485081863640239680693655740232351, 0.394151347077563369897207370981045,
    0.299180007153168812166780024266389, 0.201194093997434522300628303394596, 0.101142066918717499027074231447392,
    0.0,
)  # fmt: skip
_KRONROD_31 = (
    0.005377479872923348987792051430128, 0.015007947329316122538374763075807, 0.025460847326715320186874001019653,
    0.035346360791375846222037948478360, 0.044589751324764876608227299373280, 0.053481524690928087265343147239430,
    0.062009567800670640285139230960803, 0.069854121318728258709520077099147, 0.076849680757720378894432777482659,
    0.083080502823133021038289247286104, 0.088564443056211770647275443693774, 0.093126598170825321225486872747346,
    0.096642726983623678505179907627589, 0.099173598721791959332393173484603, 0.100769845523875595044946662617570,
    0.101330007014791549017374792767493,
)  # fmt: skip
_GAUSS_31 = (
    0.030753241996117268354628393577204, 0.070366047488108124709267416450667, 0.107159220467171935011869546685869,
    0.139570677926154314447804794511028, 0.166269205816993933553200860481209, 0.186161000015562211026800561866423,
    0.198431485327111576456118326443839, 0.202578241925561272880620199967519,
)  # fmt: skip


def _whole(nodes: Sequence[float], kronrod: Sequence[float], gauss: Sequence[float]) -> tuple[FloatArray, ...]:
    """Nodes on [-1, 1], Kronrod weights, and Gauss weights, zero where that rule has no node."""
    spread = np.zeros(len(nodes))
    spread[1::2] = gauss
    return tuple(
        np.concatenate([sign * half[:-1], half[::-1]])
        for sign, half in ((-1.0, np.array(nodes)), (1.0, np.array(kronrod)), (1.0, spread))
    )


NODES_21, KRONROD_21, GAUSS_21 = _whole(_NODES_21, _KRONROD_21, _GAUSS_21)
NODES_31, KRONROD_31, GAUSS_31 = _whole(_NODES_31, _KRONROD_31, _GAUSS_31)

BATCH = 2048  # intervals evaluated together: bounds the memory, not the work
DEPTH = 64  # halvings of an interval before giving up

Integrand = Callable[[NDArray[np.intp], FloatArray], FloatArray]


@dataclasses.dataclass(frozen=True)
class Integrals:
    """Values and relative error estimates, shape (integrals, components), and the points evaluated."""

    value: FloatArray
    error: FloatArray
    evaluations: int


def _apply_rule(
    integrand: Integrand, owner: NDArray[np.intp], low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Kronrod sums and error estimates of each interval, shape (intervals, components)."""
    half = (high - low) / 2
    points = (low + high)[:, None] / 2 + half[:, None] * NODES_21
    values = integrand(owner, points) * half[:, None, None]
    kronrod = np.einsum("kic,i->kc", values, KRONROD_21)
    gauss = np.einsum("kic,i->kc", values, GAUSS_21)
    spread = np.einsum("kic,i->kc", np.abs(values - kronrod[:, None, :] / 2), KRONROD_21)
    difference = np.abs(kronrod - gauss)
    # QUADPACK's estimate: the difference belongs to the Gauss rule, Kronrod's own error is far smaller
    ratio = np.divide(difference, spread, out=np.zeros_like(spread), where=spread > 0)
    return kronrod, np.where(spread > 0, spread * np.minimum(1, 200 * ratio) ** 1.5, difference)


def integrate(
    integrand: Integrand,
    owner: NDArray[np.intp],
    low: FloatArray,
    high: FloatArray,
    count: int,
    rtol: float,
) -> Integrals:
    """Integrate `count` positive integrands, each over the intervals that it owns.

    Parameters
    ----------
    integrand : callable
        ``integrand(owner, points)`` with `owner` (n,) and `points` (n, 21) gives (n, 21, components).
    owner : (n,) int array
        Which integral an interval belongs to, 0 ... count - 1.
    low, high : (n,) arrays
        The intervals: break points, and whatever start suits the integrand.
    count : int
        Number of integrals; one that owns no interval is 0.
    rtol : float
        Relative tolerance, met by the estimates of every component of every integral.

    Returns
    -------
    Integrals

    Raises
    ------
    ConvergenceError
        Where `DEPTH` halvings did not suffice; `mask` says which integrals.
    """
    if owner.size == 0:
        # one component stands for all
        nothing = np.zeros((count, 1))
        return Integrals(nothing, nothing, 0)
    value, error = _evaluate(integrand, owner, low, high)
    evaluations = owner.size * NODES_21.size
    unfinished = np.zeros(count, dtype=bool)
    for _ in range(DEPTH):
        total, bound = (_sum_by_owner(x, owner, count) for x in (value, error))
        relative = np.divide(bound, total, out=np.zeros_like(bound), where=total > 0)
        unfinished = np.asarray((relative > rtol).any(axis=1))
        if not unfinished.any():
            return Integrals(total, relative, evaluations)
        # an interval is halved where it has more than its even share of the error allowed
        leaves = np.bincount(owner, minlength=count)[owner, None]
        split = unfinished[owner] & (error * leaves > rtol * total[owner]).any(axis=1)
        middle = (low[split] + high[split]) / 2
        new_low = np.concatenate([low[split], middle])
        new_high = np.concatenate([middle, high[split]])
        new_owner = np.tile(owner[split], 2)
        new_value, new_error = _evaluate(integrand, new_owner, new_low, new_high)
        evaluations += new_owner.size * NODES_21.size
        keep = ~split
        owner, low, high = (
            np.concatenate([old[keep], new]) for old, new in ((owner, new_owner), (low, new_low), (high, new_high))
        )
        value = np.concatenate([value[keep], new_value])
        error = np.concatenate([error[keep], new_error])
    raise ConvergenceError(
        f"quadrature did not reach {rtol:.1e} for {int(unfinished.sum())} of {count} integrals",
        unfinished,
    )


def _evaluate(
    integrand: Integrand, owner: NDArray[np.intp], low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """`_apply_rule` in batches."""
    parts = [
        _apply_rule(integrand, owner[k : k + BATCH], low[k : k + BATCH], high[k : k + BATCH])
        for k in range(0, owner.size, BATCH)
    ]
    return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])


def _sum_by_owner(values: FloatArray, owner: NDArray[np.intp], count: int) -> FloatArray:
    columns = [np.bincount(owner, column, count) for column in values.T]
    return np.stack(columns, axis=1)
