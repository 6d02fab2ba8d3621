"""Gauss-Kronrod rules, and adaptive quadrature of many integrals at once, to a relative tolerance each.

The rules are QUADPACK's (Piessens, de Doncker-Kapenga, Ueberhuber and Kahaner 1983). scipy's adaptive rules work on
one integral, or refine a batch together to an absolute tolerance; here each integral has its own interval, is refined
on its own and is judged by its own value.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.core import core


def _rule(count: int) -> FloatArray:
    """Nodes on [-1, 1], Kronrod weights, and Gauss weights, zero where that rule has no node."""
    rule = np.empty((3, count))
    core.kronrod(count, *rule)
    return rule


NODES_21, KRONROD_21, GAUSS_21 = _rule(21)

BATCH = 2048  # intervals evaluated together: bounds the memory, not the work
DEPTH = 64  # halvings of an interval before giving up
MOST = 1000  # intervals of an integral before giving up
LEAST = 1e-290  # of integrals: smaller ones have lost digits that no halving brings back

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
        Where `DEPTH` halvings, or `MOST` intervals, did not suffice; `mask` is true for these integrals.
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
        unfinished = np.asarray(((relative > rtol) & (total > LEAST)).any(axis=1))
        if not unfinished.any():
            return Integrals(total, relative, evaluations)
        # an interval is halved where it has more than its even share of the error allowed
        counts = np.bincount(owner, minlength=count)
        if (counts[unfinished] > MOST).any():
            break
        leaves = counts[owner, None]
        split = unfinished[owner] & (error * leaves > rtol * total[owner]).any(axis=1)
        middle = (low[split] + high[split]) / 2
        halves = (low[split], middle), (middle, high[split])
        fresh = [np.tile(owner[split], 2), *map(np.concatenate, halves)]
        kept = [part[~split] for part in kept]
    raise ConvergenceError(
        f"quadrature did not reach {rtol:.1e} for {int(unfinished.sum())} of {count} integrals", unfinished
    )
