"""Panels of islands' approaches: the rules by which `core` interpolates and sums islands, and arrays of panels."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray
from mbma_tables.core import core

NODES, FEWER, NARROW = 16, 8, 0.3  # nodes of a panel, and of one whose width is less than NARROW of its approaches
GAPS = 10  # of a panel, at most: a series has 2 GAPS terms
CHECKS = np.array([1e-5, 0.5, 1 - 1e-5])  # places where polynomials miss most
# of delta, in which force, area, number of islands and Hertz area begin
POWERS = np.array([5 / 2, 7 / 3, 0, 2])[:, None, None]


def _rule(n: int, power: int) -> tuple[FloatArray, Any]:
    """`mbma_panel_rule` of mbma.h, and the places of its nodes and checks."""
    x, weights = np.polynomial.legendre.leggauss(n)
    nodes, gaps = (1 + x) / 2, (n + 4) // 2
    points, terms = chebyshev.chebpts1(gaps), np.eye(2 * gaps)
    to_series: Any = np.linalg.inv(chebyshev.chebvander(x, n - 1)).T
    reach = np.append(((1 + points) / 2) ** (1 / power), 1.0)
    places = (CHECKS, np.concatenate([nodes, 1 + nodes]) / 2, np.outer(reach, nodes).ravel(), reach[:-1])
    matrices = [to_series @ chebyshev.chebvander(2 * at - 1, n - 1).T for at in places]
    both = [chebyshev.chebval(points, terms), chebyshev.chebval(points, chebyshev.chebder(terms))]
    series: Any = np.linalg.inv(np.concatenate(both, axis=1))
    slopes: Any = np.linalg.inv(both[0][:gaps])
    integrated = np.zeros_like(series)
    integrated[:gaps, 0], integrated[gaps:, 1 : gaps + 1] = 1 / gaps, chebyshev.chebint(slopes, axis=1)[:, 1:]
    vectors: list[tuple[int, ...]] = [(NODES,), (NODES,), (GAPS + 1,)]
    columns = CHECKS.size, 2 * NODES, NODES * (GAPS + 1), GAPS
    shapes = [*vectors, *((NODES, count) for count in columns), (2 * GAPS, 2 * GAPS), (2 * GAPS, 2 * GAPS)]
    held = [np.array([power, n, gaps], float)]
    for part, shape in zip((nodes, weights / 2, reach, *matrices, series, integrated), shapes, strict=True):
        held.append(np.zeros(shape))
        held[-1][tuple(slice(size) for size in part.shape)] = part
    shares = np.ones(NODES + CHECKS.size)
    shares[:n], shares[NODES:] = nodes**power, CHECKS**power
    return np.concatenate([part.ravel() for part in held]), shares


# of the panel from 0, where delta goes with the square of the place, of others, and of narrow ones
_RULES = [_rule(NODES, 2), _rule(NODES, 1), _rule(FEWER, 1)]
RULES = np.concatenate([rule for rule, _ in _RULES])
# shares of panels at which islands are answered, nodes and then CHECKS, and which of them count
SHARES = np.array([shares for _, shares in _RULES])
COUNTED = SHARES < 1


class Panels(NamedTuple):
    """Panels in order; in the one from 0, weights lack the powers of delta that they begin with."""

    kind: NDArray[np.int64]  # number of the rule
    low: FloatArray
    high: FloatArray
    fields: (
        FloatArray  # weights of force, area and so on, shift and rate of heights, (rows + 2, panels, NODES + checks)
    )

    def some(self, chosen: Any) -> Panels:
        """Those at these places."""
        return Panels(
            self.kind[chosen], self.low[chosen], self.high[chosen], np.ascontiguousarray(self.fields[:, chosen])
        )

    def joined(self, other: Panels) -> Panels:
        """These, and after them others."""
        kind, low, high = (np.concatenate(pair) for pair in zip(self[:3], other[:3], strict=True))
        return Panels(kind, low, high, np.concatenate([self.fields, other.fields], axis=1))

    @property
    def rows(self) -> int:
        """How many weights an island has."""
        return len(self.fields) - 2

    def missed(self, last: float) -> FloatArray:
        """Bound on the relative error of each: of what it interpolates, against islands, and of its sums."""
        error = np.empty(self.low.size)
        core.profile_missed(RULES, *self, self.rows, last, error)
        return error

    def series(self) -> tuple[FloatArray, FloatArray, Nodes]:
        """Chebyshev series of ln of each row's sum, (panels, rows, 2 GAPS), their errors, and the islands."""
        count = self.low.size
        series, error = np.empty((count, self.rows, 2 * GAPS)), np.empty(count)
        weights, (shift, rate) = np.zeros((self.rows, NODES * count)), np.zeros((2, NODES * count))
        stops = np.empty(count + 1, np.int64)
        core.profile_series(RULES, *self, self.rows, series, error, weights, shift, rate, stops)
        return series, error, Nodes(weights[:, : stops[-1]], shift[: stops[-1]], rate[: stops[-1]], stops)


class Nodes(NamedTuple):
    """Islands at the nodes of panels, in order, with weights as they count in sums."""

    weights: FloatArray  # (rows, nodes)
    shift: FloatArray
    rate: FloatArray
    stops: NDArray[np.int64]  # how many lie below each panel, and in all
