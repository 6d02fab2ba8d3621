"""Gaps at which a value that falls with the gap (a force, an area) is as wanted: Newton's method in brackets.

y = ln u - ln(1 - u/end) is nearly straight in the logarithm of the value at either end of contact, so steps are of y.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray

SETTLED = 1e-7  # of a logarithm, before the last step, whose miss would be about its square
SETTLED_STEP = 1e-4  # of y, which is large where values hardly change
SETTLED_BOTH = 1e-14  # of its product with the step before, where slopes are not known
FARTHEST = 40.0  # step of y
DISTINCT = 8.9e-16  # relative, of gaps that rounding leaves distinct


def _places(u: FloatArray, value: FloatArray, steep: FloatArray, end: FloatArray) -> FloatArray:
    """Rows of ln value, y, and the derivative of y by that logarithm."""
    rest = 1 - u / end
    return np.array([np.log(value), np.log(u / rest), -value / (steep * u * rest)])


def _through(places: FloatArray, goal: FloatArray) -> FloatArray:
    """y at a goal by the polynomial through places, (3, places, n), and their rates, by divided differences."""
    x, found = places[0].repeat(2, axis=0), places[1, 0]
    difference, product = places[1].repeat(2, axis=0), 1.0
    for order in range(1, len(x)):
        difference = (difference[1:] - difference[:-1]) / (x[order:] - x[:-order])
        if order == 1:
            difference[::2] = places[2]
        product = product * (goal - x[order - 1])
        found = found + product * difference[0]
    return np.asarray(found)


def _middle(low: FloatArray, high: FloatArray) -> FloatArray:
    apart = np.where((high > 2 * low) & (low > 0), np.sqrt(low) * np.sqrt(high), 0.5 * (low + high))
    return np.where(high == np.inf, 2 * low, apart)


class Search:
    """Gaps that are looked for, from values at places in order from last contact on.

    These are rows of one column for all, or of one for each. `exact`: `steep`, -dvalue/du, is that of the values; else
    it is about right, and differences are used. `end` is the last gap with contact, which may be infinite.
    """

    def __init__(
        self, seen: FloatArray, exact: bool, wanted: FloatArray, end: FloatArray, low: FloatArray, high: FloatArray
    ) -> None:
        self.exact, self.wanted, self.end = exact, wanted, end
        # the branch of first contact: the first place, coming from there, at which enough is reached
        reached, count = seen[1] >= wanted, seen.shape[1]
        number = np.where(reached.any(axis=0), reached.argmax(axis=0), count) + np.arange(-2, 2)[:, None]
        column = np.arange(wanted.size) if seen.shape[2] == wanted.size else 0
        u, value, steep = seen[:, number.clip(0, count - 1), column]
        inside, goal = (number >= 0) & (number < count), np.log(wanted)
        self.low, self.high = np.where(inside[2], u[2], low), np.where(inside[1], u[1], high)
        known = inside & (value > 0) & (value < np.inf)
        around = np.where(known, _places(u, value, steep, end), np.nan)
        (_, light, heavy, _), y, _ = around
        nearer = known[2] & ~(goal - light <= heavy - goal)
        self.before: FloatArray = np.where(nearer, around[:, 2], around[:, 1])
        x0, y0, rate = self.before
        straight = y[1] + (goal - light) / (heavy - light) * (y[2] - y[1])
        found = np.where(heavy > light, straight, y0 + rate * (goal - x0))
        if exact:
            curved = _through(around, goal)
            rises = (around[0, 1:] > around[0, :-1]).all(axis=0)
            good = rises & (curved <= y[1]) & (curved >= y[2])
            found = np.where(good, curved, found)
        ratio = np.exp(y0 + np.minimum(np.maximum(found - y0, -FARTHEST), FARTHEST))
        gap = ratio / (1 + ratio / end)
        self.gap = np.where((gap > self.low) & (gap < self.high), gap, _middle(self.low, self.high))

    def step(self, left: NDArray[np.intp], value: FloatArray, steep: FloatArray) -> NDArray[np.intp]:
        """A step of the gaps numbered `left`, to which values belong, by the cubic through these and those before."""
        u, end, miss = self.gap[left], self.end[left], np.log(value / self.wanted[left])
        here = x, y, rate = _places(u, value, steep, end)
        x0, y0, rate0 = self.before[:, left]
        low, high = np.where(miss > 0, u, self.low[left]), np.where(miss > 0, self.high[left], u)
        apart, straight = x - x0, -miss * rate
        mean = (y - y0) / apart
        # slopes that are not exact are scaled to the straight line through both
        scale = 1.0 if self.exact else 2 * mean / (rate + rate0)
        second = (scale * rate - mean) / apart
        third = (second - (mean - scale * rate0) / apart) / apart
        curved, by_both = miss * miss * (third * (apart - miss) + second), -miss * scale * rate
        other = np.where(mean < 0, -mean * miss, straight)
        cubic = np.where(np.abs(curved) <= 0.5 * np.abs(by_both), by_both + curved, other)
        step = np.where(np.isfinite(apart) & (apart != 0), cubic, straight)
        following = u * np.exp(np.minimum(np.maximum(step, -FARTHEST), FARTHEST))
        following = following / (1 + (following - u) / end)
        near = (np.abs(miss) <= SETTLED) & (np.abs(step) <= SETTLED_STEP)
        if not self.exact:
            near &= np.abs(miss * apart) <= SETTLED_BOTH
        held = np.where((following > low) & (following < high), following, _middle(low, high))
        gap = np.where(near, np.minimum(np.maximum(following, low), high), held)
        gap[np.isnan(miss) | ~(u > 0)] = np.nan
        self.gap[left], self.low[left], self.high[left], self.before[:, left] = gap, low, high, here
        return np.asarray(left[~(near | (high - low <= DISTINCT * high) | (gap == u) | np.isnan(gap))])
