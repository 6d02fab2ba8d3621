"""Panels of islands' approaches: polynomials through their islands, the errors of these, and sums over islands at gaps.

Of an island at a gap of compression c = (h_max - d)/h_rms, force and area count as weight exp(-(shift - rate c)^2/2).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray

NODES, FEWER, NARROW = 16, 8, 0.3  # nodes of a panel, and of one whose width is less than NARROW of its approaches
MORE = 4  # terms of a panel's series than nodes
CHECKS = np.array([1e-5, 0.5, 1 - 1e-5])  # places where polynomials miss most
AT_ENDS = 1.01  # times as much at the ends as next to them
SPREAD = np.linspace(0, 1, 9)  # gaps that a panel is checked at, from it to the last
TOPS = 8  # and those at which a Gaussian has its top in it
BEYOND = 0.25 * np.linspace(0, 1, TOPS) ** 3  # shares of the way back from the last gap, where that top is beyond it
BETWEEN = 3.0  # times more is missed at gaps between them, and past turning points, where sums fall
HIGH = 6.0  # of sigma_d: islands beyond carry less than 1e-7, where there are others
LEADS = 20.0  # by which exponents of the smallest islands exceed those of others that still count
TINY = 1e-290  # for an approach of 0
LEAST = 1e-100  # share of a panel that a gap cuts
FAR = 1e150  # height of an island that is not there
# of delta, in which force, area, number of islands and Hertz area begin
POWERS = np.array([5 / 2, 7 / 3, 0, 2])[:, None, None]

Sums = tuple[FloatArray, FloatArray]  # what `_sums` gives


class Rule(NamedTuple):
    """Of panels with n nodes at places in [0, 1]: from the low to the high end delta rises like place^power.

    Matrices take values at the nodes, their rows, to those at other places.
    """

    power: int
    nodes: FloatArray
    weights: FloatArray
    reach: FloatArray  # places of gaps, which are Chebyshev points of the panel, and 1
    checks: FloatArray  # (n, 3)
    halves: FloatArray  # (n, 2 n), at the nodes of both halves
    inside: FloatArray  # (n, (gaps + 1) n), at the nodes of the part below each of them
    ends: FloatArray  # (n, gaps), at the gaps
    series: FloatArray  # (2 gaps, 2 gaps), values and slopes at the gaps to a Chebyshev series
    integrated: FloatArray  # the same by the slopes, of the values their mean alone
    to_series: FloatArray  # (n, n), values at the nodes to one

    def measure(self, width: FloatArray, places: FloatArray, rows: int) -> FloatArray:
        """What weights are multiplied by in integrals over places of panels so wide, (rows or 1, panels, places)."""
        if self.power == 1:
            return width[None, :, None]
        lead = (width[:, None] * places**self.power) ** POWERS[:rows]
        return np.asarray(self.power * width[:, None] * places ** (self.power - 1) * lead)


def _rule(n: int, power: int) -> Rule:
    x, weights = np.polynomial.legendre.leggauss(n)
    nodes, points = (1 + x) / 2, chebyshev.chebpts1((n + MORE) // 2)
    to_series: Any = np.linalg.inv(chebyshev.chebvander(x, n - 1)).T.copy()
    reach, terms = np.append(((1 + points) / 2) ** (1 / power), 1.0), np.eye(2 * points.size)
    places = (CHECKS, np.concatenate([nodes, 1 + nodes]) / 2, np.outer(reach, nodes).ravel(), reach[:-1])
    checks, halves, inside, ends = (to_series @ chebyshev.chebvander(2 * at - 1, n - 1).T for at in places)
    both = [chebyshev.chebval(points, terms), chebyshev.chebval(points, chebyshev.chebder(terms))]
    series: Any = np.linalg.inv(np.concatenate(both, axis=1))
    slopes: Any = np.linalg.inv(both[0][: points.size])
    integrals = chebyshev.chebint(slopes, axis=1)
    integrated = np.zeros_like(series)
    integrated[: points.size, 0], integrated[points.size :, 1 : points.size + 1] = 1 / points.size, integrals[:, 1:]
    return Rule(power, nodes, weights / 2, reach, checks, halves, inside, ends, series, integrated, to_series)


# of the panel from 0, where delta goes with the square of the place, of others, and of narrow ones
RULES = _rule(NODES, 2), _rule(NODES, 1), _rule(FEWER, 1)
COUNTS = np.array([rule.nodes.size for rule in RULES])
# shares of panels at which islands are answered, nodes and then CHECKS, and which of them count
SHARES = np.ones((len(RULES), NODES + CHECKS.size))
for _own, _one in zip(SHARES, RULES, strict=True):
    _own[: _one.nodes.size], _own[NODES:] = _one.nodes**_one.power, CHECKS**_one.power
COUNTED = SHARES < 1


class Panels(NamedTuple):
    """Panels in order; in the one from 0, weights lack the powers of delta that they begin with."""

    kind: NDArray[np.intp]  # number of the rule
    low: FloatArray
    high: FloatArray
    fields: FloatArray  # weights of force, area and so on, shift and rate of heights, (rows, panels, NODES + checks)

    def some(self, chosen: Any) -> Panels:
        """Those at these places."""
        return Panels(
            self.kind[chosen], self.low[chosen], self.high[chosen], np.ascontiguousarray(self.fields[:, chosen])
        )

    def joined(self, other: Panels) -> Panels:
        """These, and after them others."""
        kind, low, high = (np.concatenate(pair) for pair in zip(self[:3], other[:3], strict=True))
        return Panels(kind, low, high, np.concatenate([self.fields, other.fields], axis=1))

    def groups(self) -> list[tuple[Rule, NDArray[np.intp], FloatArray]]:
        """Rules with the places of their panels, and these panels' fields at the rule's nodes."""
        places = [(rule, np.flatnonzero(self.kind == number)) for number, rule in enumerate(RULES)]
        return [(rule, own, self.fields[:, own, : rule.nodes.size]) for rule, own in places if own.size]


class Nodes(NamedTuple):
    """Islands at the nodes of panels, in order, with weights as they count in sums."""

    weights: FloatArray  # (rows, nodes)
    shift: FloatArray
    rate: FloatArray
    stops: NDArray[np.intp]  # how many lie below each panel, and in all


def nodes_of(panels: Panels) -> Nodes:
    """The islands of panels."""
    islands = panels.fields[..., :NODES].copy()
    for rule, own, fields in panels.groups():
        measure = rule.measure((panels.high - panels.low)[own], rule.nodes, len(islands) - 2)
        islands[:-2, own, : rule.nodes.size] = fields[:-2] * measure * rule.weights
    islands = islands[:, COUNTED[panels.kind, :NODES]]
    return Nodes(islands[:-2], islands[-2], islands[-1], np.append(0, COUNTS[panels.kind].cumsum()))


def missed_by(panels: Panels, last: float) -> FloatArray:
    """Bound on the relative error of panels: of what they interpolate, against islands, and of their sums."""
    found = np.empty(panels.low.size)
    for rule, own, fields in panels.groups():
        found[own] = _missed(rule, panels.low[own], panels.high[own], fields, panels.fields[:, own, NODES:], last)
    return found


def _missed(
    rule: Rule, low: FloatArray, high: FloatArray, fields: FloatArray, true: FloatArray, last: float
) -> FloatArray:
    """`missed_by` of panels of one rule."""
    missed = fields @ rule.checks - true
    # what underflows is right
    own = true[:-2]
    relative = np.abs(np.divide(missed[:-2], own, out=np.zeros_like(own), where=own > 0)).max(axis=(0, 2))
    # heights count where the Gaussian does: near the gap of its top
    at = np.clip(true[-2] / true[-1], high[:, None], last)
    highest = np.minimum(true[-2] - true[-1] * high[:, None], LEADS / (true[-1] * np.maximum(low[:, None], TINY)))
    highest = np.maximum(highest, HIGH)
    turned = (highest * (np.abs(missed[-2] - missed[-1] * at) + highest * np.abs(missed[-1]) / true[-1])).max(axis=1)
    # sums over whole panels, relative to the largest of the panel
    spread = low[:, None] + (last - low)[:, None] * SPREAD
    # where Gaussians are narrow no such gap may meet one: gaps at which one has its top in the panel
    tops = (fields[-2] / fields[-1])[:, :: max(1, rule.nodes.size // TOPS)]
    tops = np.where(tops < last, tops, last - (last - high)[:, None] * BEYOND)
    c = np.clip(np.concatenate([spread, tops], axis=1), high[:, None], last)[..., None]

    def squares(at: FloatArray) -> FloatArray:
        heights = at[-2][:, None, :] - at[-1][:, None, :] * c
        return np.asarray(heights * heights)

    def sums(at: FloatArray, far: FloatArray, places: FloatArray, weights: FloatArray) -> FloatArray:
        force = at[0] * rule.measure(high - low, places, 1)[0] * weights
        # in units of the gap's largest, so that nothing underflows
        return np.asarray((np.exp(0.5 * (least - far)) @ force[..., None])[..., 0])

    finer = fields @ rule.halves
    coarse_far, fine_far = squares(fields), squares(finer)
    least = fine_far.min(axis=2, keepdims=True)
    fine = sums(finer, fine_far, np.concatenate([rule.nodes, 1 + rule.nodes]) / 2, np.tile(rule.weights / 2, 2))
    off = np.abs(sums(fields, coarse_far, rule.nodes, rule.weights) - fine)
    scale = np.exp(0.5 * (least.min(axis=1) - least[..., 0]))
    share = (off * scale).max(axis=1) / (fine * scale).max(axis=1)
    if rule.power > 1:
        # up to its own end the panel from 0 is all there is
        share = np.maximum(share, off[:, 0] / fine[:, 0])
    return np.asarray(AT_ENDS * relative + turned + BETWEEN * share)


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


def sums_at(c: FloatArray, own: NDArray[np.intp], panels: Panels, nodes: Nodes) -> Sums:
    """`_sums` at a few gaps in panels `own`."""
    found, islands = np.empty((2, len(nodes.weights), c.size)), np.arange(nodes.shift.size)
    for number, rule in enumerate(RULES):
        mine = np.flatnonzero(panels.kind[own] == number)
        if mine.size:
            _, low, high, fields = panels.some(own[mine])
            # at a panel's end the island at the gap counts, and nothing else
            reach = np.maximum((c[mine] - low) / (high - low), LEAST) ** (1 / rule.power)
            inner = reach[:, None] * np.append(rule.nodes, 1.0)
            basis = chebyshev.chebvander(2 * inner - 1, rule.nodes.size - 1) @ rule.to_series.T
            at = np.einsum("gji,rgi->rgj", basis, fields[..., : rule.nodes.size])
            found[..., mine] = _cut(rule, high - low, c[mine], reach, at[..., :-1], at[..., -1])
    # and over all panels below
    heights = np.where(islands < nodes.stops[own][:, None], nodes.shift - nodes.rate * c[:, None], FAR)
    below, by_gap = _sums(heights, nodes.weights.T, (nodes.weights * nodes.rate).T)
    logs = np.logaddexp(found[0], below)
    return logs, found[1] * np.exp(found[0] - logs) + by_gap * np.exp(below - logs)
