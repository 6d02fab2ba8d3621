"""Gauss-Kronrod rules, and adaptive quadrature of many integrals at once, to a relative tolerance each.

The rules are QUADPACK's (Piessens, de Doncker-Kapenga, Ueberhuber and Kahaner 1983). scipy's adaptive rules work on
one integral, or refine a batch together to an absolute tolerance; here each integral has its own interval, is refined
on its own and is judged by its own value.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import ConvergenceError

# half of each rule, from the end to the middle; the Gauss rule has every other node
_NODES_21 = (
    0.9956571630258081, 0.9739065285171717, 0.9301574913557082, 0.8650633666889845, 0.7808177265864169,
    0.6794095682990244, 0.5627571346686047, 0.4333953941292472, 0.2943928627014602, 0.14887433898163122, 0.0,
)  # fmt: skip
_KRONROD_21 = (
    0.011694638867371874, 0.032558162307964725, 0.054755896574351995, 0.07503967481091996, 0.0931254545836976,
    0.10938715880229764, 0.12349197626206584, 0.13470921731147334, 0.14277593857706009, 0.14773910490133849,
    0.1494455540029169,
)  # fmt: skip
_GAUSS_21 = (
    0.06667134430868814, 0.1494513491505806, 0.21908636251598204, 0.26926671930999635, 0.29552422471475287,
)  # fmt: skip
_NODES_31 = (
    0.9980022986933971, 0.9879925180204854, 0.9677390756791391, 0.937273392400706, 0.8972645323440819,
    0.8482065834104272, 0.790418501442466, 0.7244177313601701, 0.650996741297417, 0.5709721726085388,
    0.4850818636402397, 0.3941513470775634, 0.29918000715316884, 0.20119409399743451, 0.1011420669187175, 0.0,
)  # fmt: skip
_KRONROD_31 = (
    0.005377479872923349, 0.015007947329316122, 0.02546084732671532, 0.03534636079137585, 0.04458975132476488,
    0.05348152469092809, 0.06200956780067064, 0.06985412131872826, 0.07684968075772038, 0.08308050282313302,
    0.08856444305621176, 0.09312659817082532, 0.09664272698362368, 0.09917359872179196, 0.10076984552387559,
    0.10133000701479154,
)  # fmt: skip
_GAUSS_31 = (
    0.03075324199611727, 0.07036604748810812, 0.10715922046717194, 0.13957067792615432, 0.16626920581699392,
    0.1861610000155622, 0.19843148532711158, 0.2025782419255613,
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


class Integrals(NamedTuple):
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
    integrand: Integrand, owner: NDArray[np.intp], low: FloatArray, high: FloatArray, count: int, rtol: float
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
    evaluations, kept = 0, list[Any]()
    fresh: list[Any] = [owner, low, high]
    for _ in range(DEPTH):
        batches = [[part[k : k + BATCH] for part in fresh] for k in range(0, fresh[0].size, BATCH)]
        fresh += map(np.concatenate, zip(*(_apply_rule(integrand, *batch) for batch in batches), strict=True))
        evaluations += fresh[0].size * NODES_21.size
        kept = [np.concatenate(both) for both in zip(kept, fresh, strict=True)] if kept else fresh
        owner, low, high, value, error = kept
        sums: Any = [np.stack([np.bincount(owner, x, count) for x in part.T], axis=1) for part in (value, error)]
        total, bound = sums
        relative = np.divide(bound, total, out=np.zeros_like(bound), where=total > 0)
        unfinished = np.asarray((relative > rtol).any(axis=1))
        if not unfinished.any():
            return Integrals(total, relative, evaluations)
        # an interval is halved where it has more than its even share of the error allowed
        leaves = np.bincount(owner, minlength=count)[owner, None]
        split = unfinished[owner] & (error * leaves > rtol * total[owner]).any(axis=1)
        middle = (low[split] + high[split]) / 2
        halves = (low[split], middle), (middle, high[split])
        fresh = [np.tile(owner[split], 2), *map(np.concatenate, halves)]
        kept = [part[~split] for part in kept]
    raise ConvergenceError(
        f"quadrature did not reach {rtol:.1e} for {int(unfinished.sum())} of {count} integrals", unfinished
    )
