"""The loops of `panels` compiled, for who compiles anyway: force and area alone, as series of the compression."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import REORDER, njit
from mbma_tables.elementary import exp
from mbma_tables.totals.intervals import LEAST
from mbma_tables.totals.panels import (
    AT_ENDS,
    BETWEEN,
    BEYOND,
    HIGH,
    LEADS,
    MORE,
    NODES,
    RULES,
    SPREAD,
    TINY,
    TOPS,
    Nodes,
    Panels,
    Rule,
)

TAIL_SHARE = 5.0  # of the last two coefficients, for all that follow: they may fall slowly, and slopes err more
OLDER = 0.25  # of the two before them: signs change, and the last two may be small by chance
SLOPES = 0.1  # of their relative error counts
MANY = 1000  # islands below, from which those far below are summed by series of TERMS
FAR_ERROR = 5e-11  # of such a series, or they are summed after all
THIN = 1e-3  # width over gap, of panels in which values round to more than slopes change
BRANCHES = 32  # panels, of more a gap's is looked for by halves
STRETCH, TERMS = 0.06, 8  # of the compression, or of h_rms, that one such series covers
FAR_POINTS = chebyshev.chebpts1(TERMS)
FAR_SERIES: Any = np.linalg.inv(chebyshev.chebvander(FAR_POINTS, TERMS - 1).T)


@njit(cache=True, fastmath=REORDER, error_model="numpy", forceinline=True)
def _combined(values: FloatArray, matrix: FloatArray, out: FloatArray) -> None:
    """Values times the rows of a matrix, a multiple of four."""
    for j in range(matrix.shape[1]):
        out[j] = 0.0
    for k in range(0, matrix.shape[0], 4):
        a, b, c, d = values[k], values[k + 1], values[k + 2], values[k + 3]
        for j in range(matrix.shape[1]):
            out[j] += a * matrix[k, j] + b * matrix[k + 1, j] + c * matrix[k + 2, j] + d * matrix[k + 3, j]


@njit(cache=True, fastmath=REORDER, error_model="numpy", forceinline=True)
def _leads(delta: float) -> tuple[float, float]:
    """Powers of delta that weights of force and area lack in the panel that begins at 0."""
    return delta * delta * math.sqrt(delta), delta * delta * np.cbrt(delta)


@njit(cache=True, fastmath=REORDER, error_model="numpy")
def _sum_at(gap: float, least: float, islands: Nodes, begin: int, stop: int, out: FloatArray) -> None:
    """Add to `out` force, area and their slopes by the gap of islands begin:stop, times exp(least/2)."""
    weights, shift, rate, _ = islands
    force = area = by_force = by_area = 0.0
    for k in range(begin, stop):
        height = shift[k] - rate[k] * gap
        share = exp(0.5 * (least - height * height))
        turned = share * height * rate[k]
        force += share * weights[0, k]
        area += share * weights[1, k]
        by_force += turned * weights[0, k]
        by_area += turned * weights[1, k]
    out[0] += force
    out[1] += area
    out[2] += by_force
    out[3] += by_area


@njit(cache=True, fastmath=REORDER, error_model="numpy", forceinline=True)
def _least(gap: float, islands: Nodes, begin: int, stop: int, least: float) -> float:
    """About the least square of a height of islands begin:stop at a gap, at most `least`."""
    _, shift, rate, _ = islands
    # neighbours differ by far less than exponentials reach
    for k in range(begin, stop, 4):
        height = shift[k] - rate[k] * gap
        least = min(least, height * height)
    return least


@njit(cache=True, fastmath=REORDER, error_model="numpy", forceinline=True)
def _series_at(first: FloatArray, second: FloatArray, x: float) -> tuple[float, float]:
    """Two Chebyshev series at x in [-1, 1]."""
    before, term, one, other = 1.0, x, first[0], second[0]
    for k in range(1, first.size):
        one += first[k] * term
        other += second[k] * term
        before, term = term, 2.0 * x * term - before
    return one, other


@njit(cache=True, fastmath=REORDER, error_model="numpy", forceinline=True)
def _tail(series: FloatArray) -> float:
    """Bound on what a series leaves out."""
    bound: float = TAIL_SHARE * (abs(series[-1]) + abs(series[-2]))
    return bound


@njit(cache=True, fastmath=REORDER, error_model="numpy")
def _fill_far(low: float, high: float, below: Nodes, stop: int, out: FloatArray) -> float:
    """Series of ln(F), ln(A) and their slopes over compressions in [low, high], of islands below; their error."""
    values, sums, begin = np.empty((4, TERMS)), np.empty(4), below.stops[0]
    for k in range(TERMS):
        c = 0.5 * (low + high + (high - low) * FAR_POINTS[k])
        least = _least(c, below, begin, stop, math.inf)
        sums.fill(0.0)
        _sum_at(c, least, below, begin, stop, sums)
        values[0, k], values[1, k] = math.log(sums[0]) - 0.5 * least, math.log(sums[1]) - 0.5 * least
        values[2, k], values[3, k] = sums[2] / sums[0], sums[3] / sums[1]
    for row in range(4):
        _combined(values[row], FAR_SERIES, out[row])
    return max(_tail(out[0]), _tail(out[1]))


@njit(cache=True, fastmath=REORDER, error_model="numpy", forceinline=True)
def _place(rule: Rule, width: float, reach: float, fields: FloatArray, first: int, islands: Nodes, stop: int) -> None:
    """Put the islands of a panel up to the place `reach` behind `stop` others, by fields at its nodes from `first`."""
    for k in range(rule.nodes.size):
        weight = reach * width * rule.weights[k]
        islands.weights[0, stop + k] = weight * fields[0, first + k]
        islands.weights[1, stop + k] = weight * fields[1, first + k]
        islands.shift[stop + k], islands.rate[stop + k] = fields[2, first + k], fields[3, first + k]
    if rule.power > 1:
        for k in range(rule.nodes.size):
            place = reach * rule.nodes[k]
            lead_F, lead_A = _leads(width * place * place)
            islands.weights[0, stop + k] *= 2.0 * place * lead_F
            islands.weights[1, stop + k] *= 2.0 * place * lead_A


@njit(cache=True, fastmath=REORDER, error_model="numpy", nogil=True)
def series_of(panels: Panels) -> tuple[FloatArray, FloatArray, Nodes]:
    """`Profile.series` of panels, their errors, and their islands; those far below many narrow panels by a series."""
    kinds, low, high, fields = panels
    places = 0
    for kind in kinds:
        places += RULES[kind].nodes.size
    islands = Nodes(np.empty((2, places)), np.empty(places), np.empty(places), np.zeros(low.size + 1, dtype=np.intp))
    out, error = np.zeros((low.size, 2, NODES + MORE)), np.empty(low.size)
    most = (NODES + MORE) // 2
    inside, ends, values = np.empty((4, NODES * (most + 1))), np.empty((4, most)), np.empty((2, 2 * most))
    sums, far, steepest = np.empty(4), np.zeros((4, TERMS)), np.empty(2)
    # no literal 0, for which numba would compile everything again
    begin = stop = islands.stops[0]
    missed = start = until = 0.0
    for panel in range(low.size):
        rule, width = RULES[kinds[panel]], high[panel] - low[panel]
        count, gaps = rule.nodes.size, rule.ends.shape[1]
        if high[panel] > until:
            # as many panels as make both sums equal work
            many = high[min(panel + int(math.sqrt(low.size)), low.size - 1)]
            begin, missed, start = 0, 0.0, low[panel]
            until = min(start + STRETCH * min(start, 1.0), many)
            if stop > MANY and high[panel] <= until:
                missed = _fill_far(start, until, islands, stop, far)
                begin, missed = (stop, missed) if missed <= FAR_ERROR else (0, 0.0)
        for row in range(4):
            _combined(fields[row, panel], rule.inside, inside[row])
            _combined(fields[row, panel], rule.ends, ends[row])
        # where force turns, slopes are as good as those of a straight line
        steepest.fill(1.0)
        for gap in range(gaps):
            c = low[panel] + width * rule.reach[gap] ** rule.power
            _place(rule, width, rule.reach[gap], inside, gap * count, islands, stop)
            least = _least(c, islands, begin, stop + count, math.inf)
            sums.fill(0.0)
            if begin > 0:
                x = (2.0 * c - start - until) / (until - start)
                log_F, log_A = _series_at(far[0], far[1], x)
                by_F, by_A = _series_at(far[2], far[3], x)
                least = min(least, -2.0 * log_F)
                sums[0], sums[1] = math.exp(log_F + 0.5 * least), math.exp(log_A + 0.5 * least)
                sums[2], sums[3] = sums[0] * by_F, sums[1] * by_A
            _sum_at(c, least, islands, begin, stop + count, sums)
            # the island at the gap itself
            height = ends[2, gap] - ends[3, gap] * c
            share = exp(0.5 * (least - height * height))
            (lead_F, lead_A), begun = ((1.0, 1.0), (0.0, 0.0)) if rule.power == 1 else (_leads(c), (3.5, 10.0 / 3.0))
            sums[2] += share * lead_F * ends[0, gap]
            sums[3] += share * lead_A * ends[1, gap]
            for row in range(2):
                steep = sums[2 + row] / sums[row]
                steepest[row] = max(steepest[row], c * abs(steep))
                values[row, gap] = math.log(sums[row]) - 0.5 * least - begun[row] * math.log(c)
                values[row, gaps + gap] = 0.5 * width * (steep - begun[row] / c)
        _place(rule, width, 1.0, inside, gaps * count, islands, stop)
        stop += count
        islands.stops[panel + 1] = stop
        error[panel], thin = missed, width < THIN * high[panel]
        for row in range(2):
            made = out[panel, row, : 2 * gaps]
            _combined(values[row], rule.integrated if thin else rule.series, made)
            tail = _tail(made[: gaps + 1]) if thin else max(_tail(made), OLDER * _tail(made[:-2]))
            slopes = 4.0 * gaps * high[panel] / (width * steepest[row])
            error[panel] = max(error[panel], missed + tail * (1.0 + SLOPES * slopes))
    return out, error, islands


@njit(cache=True, fastmath=REORDER, error_model="numpy", nogil=True)
def fill_totals(compression: FloatArray, edges: FloatArray, series: FloatArray, out: FloatArray) -> None:
    """`Profile.totals` of force and area."""
    for k in range(compression.size):
        c, first, last = compression[k], 0, edges.size - 1
        while last - first > BRANCHES:
            middle = (first + last) // 2
            first, last = (middle, last) if edges[middle] <= c else (first, middle)
        # a sum is faster than branches that nothing foretells
        for panel in range(first + 1, last):
            first += edges[panel] <= c
        low, high = edges[first], edges[first + 1]
        x = (2.0 * c - low - high) / (high - low)
        out[0, k], out[1, k] = _series_at(series[first, 0], series[first, 1], x)
    for k in range(compression.size):
        for row in range(2):
            out[row, k] = exp(out[row, k]) if out[row, k] > LEAST else 0.0
    for k in range(compression.size):
        c = compression[k]
        if c < edges[1]:
            out[0, k] *= c * c * c * math.sqrt(c)
            out[1, k] *= c * c * c * np.cbrt(c)


@njit(cache=True, fastmath=REORDER, error_model="numpy", nogil=True)
def missed_by(panels: Panels, last: float) -> FloatArray:
    """`panels.missed_by`."""
    kinds, low, high, fields = panels
    finer, seen, coarse = np.empty((4, 2 * NODES)), np.empty((4, fields.shape[2] - NODES)), np.empty(NODES)
    (c, least), out = np.empty((2, SPREAD.size + TOPS)), np.empty(low.size)
    for panel in range(low.size):
        rule, width = RULES[kinds[panel]], high[panel] - low[panel]
        force, shift, rate = fields[0, panel], fields[2, panel], fields[3, panel]
        nodes, count = rule.nodes, rule.nodes.size
        for row in range(4):
            _combined(fields[row, panel], rule.checks, seen[row])
            _combined(fields[row, panel], rule.halves, finer[row])
        relative = turned = 0.0
        for k in range(seen.shape[1]):
            for row in range(2):
                true = fields[row, panel, NODES + k]
                if true > 0.0:
                    relative = max(relative, abs(seen[row, k] / true - 1.0))
            true_shift, true_rate = shift[NODES + k], rate[NODES + k]
            at = min(max(true_shift / true_rate, high[panel]), last)
            off_shift, off_rate = seen[2, k] - true_shift, seen[3, k] - true_rate
            highest = min(true_shift - true_rate * high[panel], LEADS / (true_rate * max(low[panel], TINY)))
            highest = max(highest, HIGH)
            turned = max(turned, highest * (abs(off_shift - off_rate * at) + highest * abs(off_rate) / true_rate))
        for k in range(count):
            coarse[k] = rule.weights[k] * force[k]
            finer[0, k] *= 0.5 * rule.weights[k]
            finer[0, count + k] *= 0.5 * rule.weights[k]
        if rule.power > 1:
            for k in range(2 * count):
                place = 0.5 * (nodes[k] if k < count else 1.0 + nodes[k - count])
                finer[0, k] *= 2.0 * place * _leads(width * place * place)[0]
            for k in range(count):
                coarse[k] *= 2.0 * nodes[k] * _leads(width * nodes[k] * nodes[k])[0]
        lowest, most, off, alone = math.inf, 0.0, 0.0, 0.0
        for k in range(c.size):
            node = (k - SPREAD.size) * (count // TOPS)
            if k < SPREAD.size:
                top = low[panel] + (last - low[panel]) * SPREAD[k]
            else:
                top = shift[node] / rate[node]
                top = top if top < last else last - (last - high[panel]) * BEYOND[k - SPREAD.size]
            c[k], least[k] = min(max(top, high[panel]), last), math.inf
            for j in range(0, 2 * count, 4):
                height = finer[2, j] - finer[3, j] * c[k]
                least[k] = min(least[k], height * height)
            lowest = min(lowest, least[k])
        for k in range(c.size):
            fine = rough = 0.0
            for j in range(2 * count):
                height = finer[2, j] - finer[3, j] * c[k]
                fine += finer[0, j] * exp(0.5 * (least[k] - height * height))
            for j in range(count):
                height = shift[j] - rate[j] * c[k]
                rough += coarse[j] * exp(0.5 * (least[k] - height * height))
            if k == 0 and rule.power > 1:
                # up to its own end the panel from 0 is all there is
                alone = abs(rough / fine - 1.0)
            scale = exp(0.5 * (lowest - least[k]))
            most, off = max(most, scale * fine), max(off, scale * abs(rough - fine))
        out[panel] = AT_ENDS * relative + turned + BETWEEN * max(alone, off / most)
    return out
