"""The loops of `panels` compiled, for who compiles anyway: force and area alone, every island summed one by one."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import REORDER, njit
from mbma_tables.elementary import exp
from mbma_tables.totals.panels import BETWEEN, HIGH, SEEN, TOPS, Nodes, Panels


@njit(cache=True, fastmath=REORDER, error_model="numpy", forceinline=True)
def _times(matrix: FloatArray, row: int, values: FloatArray) -> float:
    """A row of a matrix times values."""
    total = 0.0
    for k in range(values.size):
        total += matrix[row, k] * values[k]
    return total


@njit(cache=True, fastmath=REORDER, error_model="numpy", forceinline=True)
def _leads(delta: float, power: int) -> tuple[float, float]:
    """Powers of delta that weights of force and area lack in a panel that begins at 0."""
    return (delta * delta * math.sqrt(delta), delta * delta * np.cbrt(delta)) if power > 1 else (1.0, 1.0)


@njit(cache=True, fastmath=REORDER, error_model="numpy")
def _sum_at(
    gap: float, least: float, weights: FloatArray, shift: FloatArray, rate: FloatArray, stop: int, out: FloatArray
) -> None:
    """Add to `out` force, area and their slopes by the gap of the first `stop` islands, times exp(least/2)."""
    force = area = by_force = by_area = 0.0
    for k in range(stop):
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
def _least(gap: float, shift: FloatArray, rate: FloatArray, stop: int, least: float) -> float:
    """About the least square of a height of the first `stop` islands at a gap, at most `least`."""
    # neighbours differ by far less than exponentials reach
    for k in range(0, stop, 4):
        height = shift[k] - rate[k] * gap
        least = min(least, height * height)
    return least


@njit(cache=True, fastmath=REORDER, error_model="numpy", nogil=True)
def fill_sums(
    low: FloatArray,
    high: FloatArray,
    power: int,
    reach: FloatArray,
    nodes: FloatArray,
    weights: FloatArray,
    inside: FloatArray,
    ends: FloatArray,
    below: tuple[FloatArray, FloatArray, FloatArray],
    stops: NDArray[np.intp],
    out: FloatArray,
) -> None:
    """`panels.sums_of`: of fields `inside` panels below each gap and at the gap (`ends`), and of the islands below.

    These are weights, shift and rate of all islands in order, of which the first `stops` lie below each panel.
    """  # fmt: skip
    count = nodes.size
    own_weights, own, sums = np.empty((2, count)), np.empty((2, count)), np.empty(4)
    for panel in range(low.size):
        width, stop = high[panel] - low[panel], stops[panel]
        for gap in range(reach.size):
            c = low[panel] + width * reach[gap] ** power
            for k in range(count):
                node = gap * count + k
                place = reach[gap] * nodes[k]
                measure = reach[gap] * weights[k] * width * (2.0 * place if power > 1 else 1.0)
                lead_F, lead_A = _leads(width * place * place, power)
                own_weights[0, k] = measure * lead_F * inside[0, panel, node]
                own_weights[1, k] = measure * lead_A * inside[1, panel, node]
                own[0, k] = inside[2, panel, node]
                own[1, k] = inside[3, panel, node]
            least = _least(c, own[0], own[1], count, math.inf)
            least = _least(c, below[1], below[2], stop, least)
            sums[:] = 0.0
            _sum_at(c, least, own_weights, own[0], own[1], count, sums)
            _sum_at(c, least, below[0], below[1], below[2], stop, sums)
            # the island at the gap itself
            height = ends[2, panel, gap] - ends[3, panel, gap] * c
            share = exp(0.5 * (least - height * height))
            lead_F, lead_A = _leads(c, power)
            sums[2] += share * lead_F * ends[0, panel, gap]
            sums[3] += share * lead_A * ends[1, panel, gap]
            begun = math.log(c) if power > 1 else 0.0
            out[0, panel, gap] = math.log(sums[0]) - 0.5 * least - 3.5 * begun
            out[1, panel, gap] = math.log(sums[1]) - 0.5 * least - 10.0 / 3.0 * begun
            out[2, panel, gap] = c * sums[2] / sums[0]
            out[3, panel, gap] = c * sums[3] / sums[1]


@njit(cache=True, fastmath=REORDER, error_model="numpy", nogil=True)
def fill_totals(compression: FloatArray, edges: FloatArray, series: FloatArray, out: FloatArray) -> None:
    """`Profile.totals` of force and area."""
    terms = series.shape[2]
    for k in range(compression.size):
        c = compression[k]
        first, last = 0, edges.size - 1
        while last - first > 1:
            middle = (first + last) // 2
            first, last = (middle, last) if edges[middle] <= c else (first, middle)
        low, high = edges[first], edges[first + 1]
        x = (2.0 * c - low - high) / (high - low)
        before, term = 1.0, x
        force, area = series[first, 0, 0], series[first, 1, 0]
        for j in range(1, terms):
            force += series[first, 0, j] * term
            area += series[first, 1, j] * term
            before, term = term, 2.0 * x * term - before
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
            place = 0.5 * (nodes[k] if k < count else 1.0 + nodes[k - count])
            measure = 0.5 * weights[k % count] * (2.0 * place if power > 1 else 1.0)
            finer[0, k] = measure * _leads(width * place * place, power)[0] * _times(halves, k, fields[0, panel])
            finer[1, k], finer[2, k] = _times(halves, k, fields[2, panel]), _times(halves, k, fields[3, panel])
        for k in range(count):
            measure = weights[k] * (2.0 * nodes[k] if power > 1 else 1.0)
            coarse[k] = measure * _leads(width * nodes[k] * nodes[k], power)[0] * fields[0, panel, k]
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
                    least = _least(c, finer[1], finer[2], 2 * count, least)
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


def sums_of(fresh: list[tuple[Panels, NDArray[np.intp]]], nodes: Nodes) -> list[FloatArray]:
    """`panels.sums_of`."""
    found, below = [], (np.ascontiguousarray(nodes.weights.T), nodes.shift, nodes.rate)
    for (rule, low, high, fields), rank in fresh:
        out, stops = np.empty((4, rank.size, rule.reach.size)), np.searchsorted(nodes.panel, rank)
        inside, ends = fields @ rule.inside.T, fields @ rule.ends.T
        fill_sums(low, high, rule.power, rule.reach, rule.nodes, rule.weights, inside, ends, below, stops, out)
        found.append(out)
    return found


def missed_by(panels: Panels, true: FloatArray, last: float) -> FloatArray:
    """`panels.missed_by`."""
    rule, low, high, fields = panels
    out, given = np.empty(low.size), (rule.power, rule.nodes, rule.weights, rule.checks, rule.halves)
    fill_missed(fields, np.ascontiguousarray(true), low, high, last, *given, np.linspace(0, 1, SEEN), out)
    return out
