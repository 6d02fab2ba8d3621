"""The loops of `panels` compiled, for who compiles anyway: force and area alone, every island summed one by one."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import REORDER, njit
from mbma_tables.elementary import exp
from mbma_tables.totals.panels import BETWEEN, COUNTS, HIGH, MORE, SPREAD, TOPS, Group, Nodes, Panels, Rule

TAIL_SHARE = 2.0  # of the last two coefficients, for all that follow: they fall by 2 at least, and count twice
SLOPES = 0.1  # of their relative error counts
MANY = 1000  # islands below, from which those far below are summed by series of TERMS
FAR_ERROR = 5e-11  # of such a series, or they are summed after all
STRETCH, TERMS = 0.1, 12  # of the compression, or of h_rms, that one such series covers


Below = tuple[FloatArray, FloatArray, FloatArray]  # weights, shift and rate of islands


@njit(cache=True, fastmath=REORDER, error_model="numpy", forceinline=True)
def _times(matrix: FloatArray, row: int, values: FloatArray) -> float:
    """A row of a matrix times values."""
    total = 0.0
    for k in range(values.size):
        total += matrix[row, k] * values[k]
    return total


@njit(cache=True, fastmath=REORDER, error_model="numpy", forceinline=True)
def _leads(delta: float) -> tuple[float, float]:
    """Powers of delta that weights of force and area lack in the panel that begins at 0."""
    return delta * delta * math.sqrt(delta), delta * delta * np.cbrt(delta)


@njit(cache=True, fastmath=REORDER, error_model="numpy")
def _sum_at(gap: float, least: float, islands: Below, begin: int, stop: int, out: FloatArray) -> None:
    """Add to `out` force, area and their slopes by the gap of islands begin:stop, times exp(least/2)."""
    weights, shift, rate = islands
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
def _least(gap: float, islands: Below, begin: int, stop: int, least: float) -> float:
    """About the least square of a height of islands begin:stop at a gap, at most `least`."""
    _, shift, rate = islands
    # neighbours differ by far less than exponentials reach
    for k in range(begin, stop, 4):
        height = shift[k] - rate[k] * gap
        least = min(least, height * height)
    return least


@njit(cache=True, fastmath=REORDER, error_model="numpy")
def _fill_far(
    low: float, high: float, below: Below, stop: int, points: FloatArray, series: FloatArray, out: FloatArray
) -> float:
    """Series of ln(F), ln(A) and their slopes over compressions in [low, high], of islands below; their error."""
    values, sums = np.empty((4, points.size)), np.empty(4)
    for k in range(points.size):
        c = 0.5 * (low + high + (high - low) * points[k])
        least = _least(c, below, 0, stop, math.inf)
        sums.fill(0.0)
        _sum_at(c, least, below, 0, stop, sums)
        values[0, k], values[1, k] = math.log(sums[0]) - 0.5 * least, math.log(sums[1]) - 0.5 * least
        values[2, k], values[3, k] = sums[2] / sums[0], sums[3] / sums[1]
    for row in range(4):
        for k in range(points.size):
            out[row, k] = _times(series, k, values[row])
    last = points.size - 1
    error: float = TAIL_SHARE * max(
        abs(out[0, last]) + abs(out[0, last - 1]), abs(out[1, last]) + abs(out[1, last - 1])
    )
    return error


@njit(cache=True, fastmath=REORDER, error_model="numpy", forceinline=True)
def _series_at(series: FloatArray, x: float) -> float:
    """A Chebyshev series at x in [-1, 1]."""
    before, term = 1.0, x
    total: float = series[0]
    for k in range(1, series.size):
        total += series[k] * term
        before, term = term, 2.0 * x * term - before
    return total


@njit(cache=True, fastmath=REORDER, error_model="numpy", nogil=True)
def fill_sums(
    low: FloatArray,
    high: FloatArray,
    rule: Rule,
    inside: FloatArray,
    ends: FloatArray,
    below: Below,
    stops: NDArray[np.intp],
    points: FloatArray,
    series: FloatArray,
    out: FloatArray,
) -> float:
    """ln(F), ln(A) and slopes by ln(c) at the gaps of panels, (4, panels, gaps), by fields `inside` and at the gaps.

    `below` are weights, shift and rate of all islands in order, of which the first `stops` lie below each panel. Those
    far below many narrow panels are summed by a series in c, whose error is returned.
    """  # fmt: skip
    power, count = rule.power, rule.nodes.size
    own, sums = (np.empty((2, count)), np.empty(count), np.empty(count)), np.empty(4)
    far, error, begin, start, until = np.zeros((4, points.size)), 0.0, 0, 0.0, 0.0
    for panel in range(low.size):
        width, stop = high[panel] - low[panel], stops[panel]
        if high[panel] > until:
            # as many panels as make both sums equal work
            many = min(panel + int(math.sqrt(low.size)), low.size - 1)
            begin, start, until = 0, low[panel], min(low[panel] + STRETCH * min(low[panel], 1.0), high[many])
            if stop > MANY and high[panel] <= until:
                begin = stop
                missed = _fill_far(start, until, below, begin, points, series, far)
                begin, error = (begin, max(error, missed)) if missed <= FAR_ERROR else (0, error)
        for gap in range(rule.reach.size):
            reach = rule.reach[gap]
            c = low[panel] + width * reach**power
            share, first = reach * width, gap * count
            for k in range(count):
                weight = share * rule.weights[k]
                own[0][0, k], own[0][1, k] = weight * inside[0, panel, first + k], weight * inside[1, panel, first + k]
                own[1][k], own[2][k] = inside[2, panel, first + k], inside[3, panel, first + k]
            if power > 1:
                for k in range(count):
                    place = reach * rule.nodes[k]
                    lead_F, lead_A = _leads(width * place * place)
                    own[0][0, k] *= 2.0 * place * lead_F
                    own[0][1, k] *= 2.0 * place * lead_A
            least = _least(c, below, begin, stop, _least(c, own, 0, count, math.inf))
            sums.fill(0.0)
            if begin > 0:
                x = (2.0 * c - start - until) / (until - start)
                log_F, log_A = _series_at(far[0], x), _series_at(far[1], x)
                least = min(least, -2.0 * log_F)
                sums[0], sums[1] = math.exp(log_F + 0.5 * least), math.exp(log_A + 0.5 * least)
                sums[2], sums[3] = sums[0] * _series_at(far[2], x), sums[1] * _series_at(far[3], x)
            _sum_at(c, least, own, 0, count, sums)
            _sum_at(c, least, below, begin, stop, sums)
            # the island at the gap itself
            height = ends[2, panel, gap] - ends[3, panel, gap] * c
            share = exp(0.5 * (least - height * height))
            lead_F, lead_A = _leads(c) if power > 1 else (1.0, 1.0)
            sums[2] += share * lead_F * ends[0, panel, gap]
            sums[3] += share * lead_A * ends[1, panel, gap]
            begun = math.log(c) if power > 1 else 0.0
            out[0, panel, gap] = math.log(sums[0]) - 0.5 * least - 3.5 * begun
            out[1, panel, gap] = math.log(sums[1]) - 0.5 * least - 10.0 / 3.0 * begun
            out[2, panel, gap] = c * sums[2] / sums[0]
            out[3, panel, gap] = c * sums[3] / sums[1]
    return error


@njit(cache=True, fastmath=REORDER, error_model="numpy", nogil=True)
def fill_totals(compression: FloatArray, edges: FloatArray, series: FloatArray, out: FloatArray) -> None:
    """`Profile.totals` of force and area."""
    for k in range(compression.size):
        c = compression[k]
        first, last = 0, edges.size - 1
        while last - first > 1:
            middle = (first + last) // 2
            first, last = (middle, last) if edges[middle] <= c else (first, middle)
        low, high = edges[first], edges[first + 1]
        x = (2.0 * c - low - high) / (high - low)
        force, area = _series_at(series[first, 0], x), _series_at(series[first, 1], x)
        lead = c * c * c if first == 0 else 1.0
        out[0, k] = math.exp(force) * (lead * math.sqrt(c) if first == 0 else 1.0)
        out[1, k] = math.exp(area) * (lead * np.cbrt(c) if first == 0 else 1.0)


@njit(cache=True, fastmath=REORDER, error_model="numpy", nogil=True)
def fill_missed(
    fields: FloatArray,
    true: FloatArray,
    low: FloatArray,
    high: FloatArray,
    last: float,
    power: int,
    nodes: FloatArray,
    weights: FloatArray,
    checks: FloatArray,
    halves: FloatArray,
    gaps: FloatArray,
    out: FloatArray,
) -> None:
    """`panels.missed_by`; `gaps` are places between a panel and `last`."""
    count, tops = nodes.size, TOPS
    finer, coarse = np.empty((3, 2 * count)), np.empty(count)
    for panel in range(low.size):
        width = high[panel] - low[panel]
        relative = turned = 0.0
        for k in range(checks.shape[0]):
            for row in range(2):
                if true[row, panel, k] > 0.0:
                    off = _times(checks, k, fields[row, panel]) / true[row, panel, k] - 1.0
                    relative = max(relative, abs(off))
            shift, rate = true[2, panel, k], true[3, panel, k]
            at = min(max(shift / rate, high[panel]), last)
            off_shift = _times(checks, k, fields[2, panel]) - shift
            off_rate = _times(checks, k, fields[3, panel]) - rate
            turned = max(turned, abs(off_shift - off_rate * at) + HIGH * abs(off_rate) / rate)
        for k in range(2 * count):
            finer[0, k] = 0.5 * weights[k % count] * _times(halves, k, fields[0, panel])
            finer[1, k], finer[2, k] = _times(halves, k, fields[2, panel]), _times(halves, k, fields[3, panel])
        for k in range(count):
            coarse[k] = weights[k] * fields[0, panel, k]
        if power > 1:
            for k in range(2 * count):
                place = 0.5 * (nodes[k] if k < count else 1.0 + nodes[k - count])
                finer[0, k] *= 2.0 * place * _leads(width * place * place)[0]
            for k in range(count):
                coarse[k] *= 2.0 * nodes[k] * _leads(width * nodes[k] * nodes[k])[0]
        most, off = 0.0, 0.0
        least = math.inf
        for turn in range(2):
            for k in range(gaps.size + tops):
                if k < gaps.size:
                    c = low[panel] + (last - low[panel]) * gaps[k]
                else:
                    node = (k - gaps.size) * (count // tops)
                    c = fields[2, panel, node] / fields[3, panel, node]
                c = min(max(c, high[panel]), last)
                if turn == 0:
                    least = _least(c, (finer, finer[1], finer[2]), 0, 2 * count, least)
                    continue
                fine = rough = 0.0
                for j in range(2 * count):
                    height = finer[1, j] - finer[2, j] * c
                    fine += finer[0, j] * exp(0.5 * (least - height * height))
                for j in range(count):
                    height = fields[2, panel, j] - fields[3, panel, j] * c
                    rough += coarse[j] * exp(0.5 * (least - height * height))
                most, off = max(most, fine), max(off, abs(rough - fine))
        out[panel] = relative + HIGH * turned + BETWEEN * off / most


@functools.cache
def _far_rule() -> tuple[FloatArray, FloatArray]:
    points = chebyshev.chebpts1(TERMS)
    to_series: Any = np.linalg.inv(chebyshev.chebvander(points, TERMS - 1))
    return points, to_series


def series_of(groups: list[Group], nodes: Nodes) -> tuple[FloatArray, FloatArray]:
    """`Profile.series` of panels, and their errors."""
    points, to_series = _far_rule()
    below = np.ascontiguousarray(nodes.weights.T), nodes.shift, nodes.rate
    count = sum(rank.size for _, rank in groups)
    made, tails = np.zeros((count, 4, COUNTS[-1][1] + MORE)), np.empty(count)
    for (rule, low, high, fields), rank in groups:
        values, stops = np.empty((4, rank.size, rule.reach.size)), np.searchsorted(nodes.panel, rank)
        inside, ends = fields @ rule.inside.T, fields @ rule.ends.T
        missed = fill_sums(low, high, rule, inside, ends, below, stops, points, to_series, values)
        found = values @ rule.series.T
        made[rank, :, : rule.reach.size] = np.moveaxis(found, 0, 1)
        own = np.abs(found[:, :, -2:]).sum(axis=-1)
        own[2:] *= SLOPES / np.abs(values[2:]).max(axis=-1)
        tails[rank] = missed + TAIL_SHARE * own.max(axis=0)
    return made, tails


def missed_by(panels: Panels, true: FloatArray, last: float) -> FloatArray:
    """`panels.missed_by`."""
    rule, low, high, fields = panels
    out, given = np.empty(low.size), (rule.power, rule.nodes, rule.weights, rule.checks, rule.halves)
    fill_missed(fields, np.ascontiguousarray(true), low, high, last, *given, SPREAD, out)
    return out
