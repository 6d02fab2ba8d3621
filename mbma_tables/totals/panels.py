"""Panels of islands' approaches: polynomials through their islands, the errors of these, and sums over islands at gaps.

Of an island at a gap of compression c = (h_max - d)/h_rms, force and area count as weight exp(-(shift - rate c)^2/2).
"""

from __future__ import annotations

import functools
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray

COUNTS = ((0.3, 8), (math.inf, 16))  # nodes of a panel by its width over delta
MORE = 4  # gaps of a panel than nodes
CHECKS = np.array([1e-4, 0.5, 1 - 1e-4])  # places where polynomials miss most
SPREAD = np.linspace(0, 1, 9)  # gaps that a panel is checked at, from it to the last
TOPS = 8  # and those at which a Gaussian has its top in it
BETWEEN = 2.0  # times more is missed at gaps between them
HIGH = 6.0  # of sigma_d: islands beyond carry less than 1e-7
LEAST = 1e-100  # share of a panel that a gap cuts
FAR = 1e150  # height of an island that is not there
# of delta, in which force, area, number of islands and Hertz area begin
POWERS = np.array([5 / 2, 7 / 3, 0, 2])[:, None, None]

Sums = tuple[FloatArray, FloatArray]  # what `_sums` gives


class Rule(NamedTuple):
    """Of panels with n nodes at places in [0, 1]: from the low to the high end delta rises like place^power.

    Matrices take values at the nodes to those at other places.
    """

    power: int
    nodes: FloatArray
    weights: FloatArray
    seen: FloatArray  # nodes and CHECKS, at which islands are answered
    reach: FloatArray  # places of gaps, which are Chebyshev points of the panel
    checks: FloatArray  # (3, n)
    halves: FloatArray  # (2 n, n), at the nodes of both halves
    inside: FloatArray  # (gaps n, n), at the nodes of the part below each gap
    ends: FloatArray  # (gaps, n), at the gaps
    series: FloatArray  # (gaps, gaps), values at the gaps to a Chebyshev series
    to_series: FloatArray  # (n, n), values at the nodes to one

    def approach(self, low: FloatArray, high: FloatArray, places: FloatArray) -> FloatArray:
        """Approaches at places, (panels, places)."""
        return np.asarray(low[:, None] + (high - low)[:, None] * places**self.power)

    def measure(self, width: FloatArray, places: FloatArray, rows: int) -> FloatArray:
        """What weights are multiplied by in integrals over places of panels so wide, (rows or 1, panels, places)."""
        if self.power == 1:
            return width[None, :, None]
        lead = (width[:, None] * places**self.power) ** POWERS[:rows]
        return np.asarray(self.power * width[:, None] * places ** (self.power - 1) * lead)


@functools.cache
def rule_of(n: int, power: int) -> Rule:
    """The rule with n nodes; power is 2 in the panel from 0, and 1 else."""
    x, weights = np.polynomial.legendre.leggauss(n)
    nodes, points = (1 + x) / 2, chebyshev.chebpts1(n + MORE)
    to_series: Any = np.linalg.inv(chebyshev.chebvander(x, n - 1))
    reach = ((1 + points) / 2) ** (1 / power)
    halves = np.concatenate([nodes, 1 + nodes]) / 2
    places = (CHECKS, halves, np.outer(reach, nodes).ravel(), reach)
    checks, halves, inside, ends = (chebyshev.chebvander(2 * at - 1, n - 1) @ to_series for at in places)
    series: Any = np.linalg.inv(chebyshev.chebvander(points, points.size - 1))
    return Rule(
        power, nodes, weights / 2, np.append(nodes, CHECKS), reach, checks, halves, inside, ends, series, to_series
    )


class Panels(NamedTuple):
    """Panels of one rule; in the one from 0, weights lack the powers of delta that they begin with."""

    rule: Rule
    low: FloatArray
    high: FloatArray
    fields: FloatArray  # weights of force, area and so on, shift and rate of heights at the nodes, (rows, panels, n)

    def some(self, chosen: Any) -> Panels:
        """Those at these places."""
        return Panels(self.rule, self.low[chosen], self.high[chosen], np.ascontiguousarray(self.fields[:, chosen]))


Group = tuple[Panels, NDArray[np.intp]]  # panels of one rule, and their places among all


class Nodes(NamedTuple):
    """Islands at the nodes of panels."""

    panel: NDArray[np.intp]
    weights: FloatArray  # (nodes, rows)
    shift: FloatArray
    rate: FloatArray

    def some(self, chosen: Any) -> Nodes:
        """Those at these places."""
        return Nodes(*(field[chosen] for field in self))


def missed_by(panels: Panels, true: FloatArray, last: float) -> FloatArray:
    """Bound on the relative error of panels: of what they interpolate, against islands, and of their sums."""
    rule, low, high, fields = panels
    missed = fields @ rule.checks.T - true
    # what underflows is right
    own = true[:-2]
    relative = np.abs(np.divide(missed[:-2], own, out=np.zeros_like(own), where=own > 0)).max(axis=(0, 2))
    # heights count where the Gaussian does: near the gap of its top
    at = np.clip(true[-2] / true[-1], high[:, None], last)
    turned = (np.abs(missed[-2] - missed[-1] * at) + HIGH * np.abs(missed[-1]) / true[-1]).max(axis=1)
    # sums over whole panels, relative to the largest of the panel
    spread = low[:, None] + (last - low)[:, None] * SPREAD
    # where Gaussians are narrow no such gap may meet one: gaps at which one has its top in the panel
    tops = (fields[-2] / fields[-1])[:, :: max(1, rule.nodes.size // TOPS)]
    c = np.clip(np.concatenate([spread, tops], axis=1), high[:, None], last)[..., None]

    def squares(at: FloatArray) -> FloatArray:
        heights = at[-2][:, None, :] - at[-1][:, None, :] * c
        return np.asarray(heights * heights)

    def sums(at: FloatArray, far: FloatArray, places: FloatArray, weights: FloatArray) -> FloatArray:
        force = at[0] * rule.measure(high - low, places, 1)[0] * weights
        # in units of the panel's largest, so that nothing underflows
        return np.asarray((np.exp(0.5 * (least - far)) @ force[..., None])[..., 0])

    finer = fields @ rule.halves.T
    coarse_far, fine_far = squares(fields), squares(finer)
    least = fine_far.min(axis=(1, 2), keepdims=True)
    fine = sums(finer, fine_far, np.concatenate([rule.nodes, 1 + rule.nodes]) / 2, np.tile(rule.weights / 2, 2))
    off = np.abs(sums(fields, coarse_far, rule.nodes, rule.weights) - fine).max(axis=1)
    return np.asarray(relative + HIGH * turned + BETWEEN * off / fine.max(axis=1))


def _sums(heights: FloatArray, weights: FloatArray, turned: FloatArray) -> Sums:
    """ln of sums over islands at each gap, and of weights times heights over it, (rows, gaps).

    `weights` and `turned`, weights times rates, are (nodes, rows) or (rows, gaps, nodes).
    """
    squares = heights * heights
    least = squares.min(axis=-1)
    # the least of all is taken out, so that sums cannot underflow
    gaussian = np.exp(0.5 * (least[:, None] - squares))
    sides = (gaussian, weights), (gaussian * heights, turned)
    found, slopes = [(g @ w).T if w.ndim == 2 else np.einsum("gn,rgn->rg", g, w) for g, w in sides]
    return np.log(found) - least / 2, slopes / found


def _cut(rule: Rule, width: FloatArray, c: FloatArray, reach: FloatArray, inside: FloatArray, ends: FloatArray) -> Sums:
    """`_sums` over the part of a panel so wide that is below each gap, by the fields inside and at the gap."""
    rows = len(ends) - 2
    shares = rule.measure(width, reach[:, None] * rule.nodes, rows) * (reach[:, None] * rule.weights)
    weights = inside[:-2] * shares
    logs, slopes = _sums(inside[-2] - inside[-1] * c[:, None], weights, weights * inside[-1])
    # the island at the gap itself
    own = ends[:-2] if rule.power == 1 else ends[:-2] * c ** POWERS[:rows, 0]
    height = ends[-2] - ends[-1] * c
    return logs, slopes + own * np.exp(-0.5 * height * height - logs)


def sums_at(c: FloatArray, own: NDArray[np.intp], groups: list[Group], nodes: Nodes) -> Sums:
    """`_sums` at a few gaps in panels `own`; groups of panels are at places among all."""
    found = np.empty((2, nodes.weights.shape[1], c.size))
    for (rule, low, high, fields), rank in groups:
        mine, which = np.nonzero(own[:, None] == rank)
        if mine.size:
            width = (high - low)[which]
            # at a panel's end the island at the gap counts, and nothing else
            reach = np.maximum((c[mine] - low[which]) / width, LEAST) ** (1 / rule.power)
            places = reach[:, None] * np.append(rule.nodes, 1.0)
            basis = chebyshev.chebvander(2 * places - 1, rule.nodes.size - 1) @ rule.to_series
            at = np.einsum("gji,rgi->rgj", basis, fields[:, which])
            found[..., mine] = _cut(rule, width, c[mine], reach, at[..., :-1], at[..., -1])
    # and over all panels below
    heights = np.where(nodes.panel < own[:, None], nodes.shift - nodes.rate * c[:, None], FAR)
    below, by_gap = _sums(heights, nodes.weights, nodes.weights * nodes.rate[:, None])
    logs = np.logaddexp(found[0], below)
    return logs, found[1] * np.exp(found[0] - logs) + by_gap * np.exp(below - logs)
