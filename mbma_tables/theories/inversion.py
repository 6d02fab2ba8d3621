"""Gaps at which a falling curve reaches wanted values, by Newton's method in a bracket.

The search is in the plane of x = ln(value) and y = ln(u/(1 - u/end)), in which powers of u near
full contact, and of end - u beside last contact, are straight lines. It knows of curves alone,
not of surfaces or theories.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.shared import shared

LOOKS = 128  # initial gaps, for one surface
FEW_LOOKS = 8  # and for each of a batch
LONGEST_STEP = 40.0  # of y, whose exponential is finite

# values at mean separations, approximately their -d/du, and whether this is exact
Curve = Callable[[FloatArray], tuple[FloatArray, FloatArray, bool]]
# flat indices into a broadcast shape; scipy's integrator passes them on as floats
Indices = FloatArray | NDArray[np.integer]


def sampled(
    curve: Curve, gaps: FloatArray, shape: tuple[int, ...]
) -> tuple[FloatArray, bool]:
    """The initial gaps of a search with their values and slopes, (3, gaps, entries).

    Gaps are in order from last contact on; with them, whether the slopes are exact.
    """
    count = len(gaps)
    value, slope, exact = curve(gaps)
    # one column of gaps for all entries, or one for each
    is_shared = max(gaps.size, np.size(value)) == count
    columns = (count, *[1] * len(shape)) if is_shared else (count, *shape)
    samples = np.empty((3, *columns))
    samples[0] = gaps
    samples[1] = value
    samples[2] = slope
    return samples.reshape(3, count, -1), exact


@shared()
def shares(count: int) -> FloatArray:
    """Points from 1 to 0, denser at either end: equal steps of ln u - ln(h_max - u)."""
    # at 7 the outer ones are 0.1% of the interval from its ends
    logits = np.linspace(-7.0, 7.0, count)
    return np.asarray(1 / (1 + np.exp(logits)))


def _places(
    u: FloatArray, value: FloatArray, slope: FloatArray, end: FloatArray
) -> FloatArray:
    """Rows of x = ln value, y, and dy/dx, from `slope`, the value's -d/du."""
    rest = 1 - u / end
    x = np.log(value)
    y = np.log(u / rest)
    rate = -value / (slope * u * rest)
    return np.array([x, y, rate])


def _through(places: FloatArray, goal: FloatArray) -> FloatArray:
    """y at x = goal by the polynomial through places (3, places, n), with their slopes.

    Hermite's interpolation by divided differences, in which each place counts twice.
    """
    x = places[0].repeat(2, axis=0)
    difference = places[1].repeat(2, axis=0)
    y = places[1, 0]
    product = 1.0
    for order in range(1, len(x)):
        span = x[order:] - x[:-order]
        difference = (difference[1:] - difference[:-1]) / span
        if order == 1:
            # the difference of a place and itself is its slope
            difference[::2] = places[2]
        product = product * (goal - x[order - 1])
        y = y + product * difference[0]
    return np.asarray(y)


def _middle(low: FloatArray, high: FloatArray) -> FloatArray:
    """A gap between two others, by their logarithms where these are far apart."""
    geometric = np.sqrt(low) * np.sqrt(high)
    far_apart = (high > 2 * low) & (low > 0)
    middle = np.where(far_apart, geometric, 0.5 * (low + high))
    # without an upper end the gap is doubled
    return np.where(high == np.inf, 2 * low, middle)


class Search:
    """Gaps at which values are reached, from values sampled in order from last contact on.

    Each has a bracket `low` to `high`, a next `gap` to evaluate, and the place `before`, the
    last one evaluated. Slopes that are not `exact` are scaled by differences.
    """

    def __init__(
        self,
        sampled: FloatArray,
        exact: bool,
        wanted: FloatArray,
        end: FloatArray,
        low: FloatArray,
        high: FloatArray,
    ) -> None:
        self.exact = exact
        self.wanted = wanted
        self.end = end

        # the branch of first contact: the first sample from there that reaches the value,
        # the one after it, and two before, one row each, of which some may not exist
        count = sampled.shape[1]
        reaches = sampled[1] >= wanted
        tight = np.where(reaches.any(axis=0), reaches.argmax(axis=0), count)
        number = tight + np.arange(-2, 2)[:, None]
        exists = (number >= 0) & (number < count)
        nearest = number.clip(0, count - 1)
        has_columns = sampled.shape[2] == wanted.size
        column = np.arange(wanted.size) if has_columns else 0
        u, value, slope = sampled[:, nearest, column]
        # rows 1 and 2, which bracket the goal
        self.low = np.where(exists[2], u[2], low)
        self.high = np.where(exists[1], u[1], high)

        usable = exists & (value > 0) & (value < np.inf)
        around = np.where(usable, _places(u, value, slope, end), np.nan)
        x, y, _ = around
        log_goal = np.log(wanted)
        wide_x, tight_x = x[1:3]
        wide_y, tight_y = y[1:3]
        is_nearer_to_wide = log_goal - wide_x <= tight_x - log_goal
        start_at_tight_side = usable[2] & ~is_nearer_to_wide
        self.before: FloatArray = np.where(
            start_at_tight_side, around[:, 2], around[:, 1]
        )

        # the straight line through both sides, or the tangent at one
        x0, y0, slope0 = self.before
        part_of_way = (log_goal - wide_x) / (tight_x - wide_x)
        straight = wide_y + part_of_way * (tight_y - wide_y)
        tangent = y0 + slope0 * (log_goal - x0)
        next_y = np.where(tight_x > wide_x, straight, tangent)
        if exact:
            # a tangent or, through all four, a polynomial of degree 7, where it stays
            # between both sides
            is_between = (tangent <= wide_y) & (tangent >= tight_y)
            next_y = np.where(is_between, tangent, next_y)
            curved = _through(around, log_goal)
            rises = (x[1:] > x[:-1]).all(axis=0)
            is_between = rises & (curved <= wide_y) & (curved >= tight_y)
            next_y = np.where(is_between, curved, next_y)
        step = np.minimum(np.maximum(next_y - y0, -LONGEST_STEP), LONGEST_STEP)
        ratio = np.exp(y0 + step)
        gap = ratio / (1 + ratio / end)
        is_inside = (gap > self.low) & (gap < self.high)
        if not is_inside.all():
            gap = np.where(is_inside, gap, _middle(self.low, self.high))
        self.gap = gap

    def run(
        self, curve_of: Callable[[Indices], Curve], is_wanted: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Steps of Newton's method until `gap` has the gaps that are wanted; where they were missed.

        `curve_of` gives the curve of the entries at flat indices.
        """
        left = np.flatnonzero(is_wanted)
        for _ in range(200):
            if not left.size:
                break
            value, slope, _ = curve_of(left)(self.gap[left])
            left = self.step(left, value, slope)
        # between two adjacent floats u, ln of a steep value may miss its goal
        log_miss = np.abs(self.before[0] - np.log(self.wanted))
        is_wrong = np.isnan(self.gap) | (log_miss > 0.5)
        missed: NDArray[np.bool_] = is_wrong & is_wanted
        missed[left] = True
        return missed

    def step(
        self, left: NDArray[np.intp], value: FloatArray, slope: FloatArray
    ) -> NDArray[np.intp]:
        """A step of the gaps with indices `left`, whose values these are; those still left."""
        u = self.gap[left]
        end = self.end[left]
        miss = np.log(value / self.wanted[left])
        place = _places(u, value, slope, end)
        low = np.where(miss > 0, u, self.low[left])
        high = np.where(miss > 0, self.high[left], u)

        step, apart = self._step_of_y(place, self.before[:, left], miss)
        # the gap there is u exp(step)/(1 + u (exp(step) - 1)/end)
        short_step = np.minimum(np.maximum(step, -LONGEST_STEP), LONGEST_STEP)
        following = u * np.exp(short_step)
        following = following / (1 + (following - u) / end)

        # the error after a step is about its square
        is_settled = (np.abs(miss) <= 1e-7) & (np.abs(step) <= 1e-4)
        if not self.exact:
            # without exact slopes it is about the product of the last two
            is_settled &= np.abs(miss * apart) <= 1e-14
        is_inside = (following > low) & (following < high)
        bracketed = following
        if not is_inside.all():
            bracketed = np.where(is_inside, following, _middle(low, high))
        clipped = np.minimum(np.maximum(following, low), high)
        gap = np.where(is_settled, clipped, bracketed)
        gap[np.isnan(miss) | ~(u > 0)] = np.nan

        self.gap[left] = gap
        self.low[left] = low
        self.high[left] = high
        self.before[:, left] = place
        # a bracket of four roundings holds no distinct gaps
        is_narrow = high - low <= 8.9e-16 * high
        is_done = is_settled | is_narrow | (gap == u) | np.isnan(gap)
        return np.asarray(left[~is_done])

    def _step_of_y(
        self, place: FloatArray, before: FloatArray, miss: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """The step of y, by the cubic through this place and the one before, and their dx."""
        x, y, slope = place
        x0, y0, slope0 = before
        apart = x - x0
        tangent = -miss * slope
        mean = (y - y0) / apart
        # slopes that are not exact are scaled to the straight line through both
        scale = 1.0 if self.exact else 2 * mean / (slope + slope0)
        second = (scale * slope - mean) / apart
        third = (second - (mean - scale * slope0) / apart) / apart
        curved = miss * miss * (third * (apart - miss) + second)
        scaled_tangent = -miss * scale * slope
        # where the cubic bends too much, the straight line through both if it falls
        straight = np.where(mean < 0, -mean * miss, tangent)
        is_nearly_straight = np.abs(curved) <= 0.5 * np.abs(scaled_tangent)
        cubic = np.where(is_nearly_straight, scaled_tangent + curved, straight)
        has_two_places = np.isfinite(apart) & (apart != 0)
        return np.where(has_two_places, cubic, tangent), apart
