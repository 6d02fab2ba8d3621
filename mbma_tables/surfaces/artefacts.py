"""Artefacts of measurement that a map shows by itself: lost lines, saturation, a bow, one high place.

Each function returns None where there is none. `python -m generate artefacts` measures which are
recognised, and on how many maps without artefacts they are seen.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray

# share of the rows up to which those that repeat the row before are lost lines; more of them
# are a pattern
MOST_LINES = 0.25
MOSTLY = 0.5
# a map is saturated where its highest, or lowest, value is that of more than this share of the
# points, and so many times as frequent as any of the levels next to it
SATURATED = 1e-3
OFTEN = 5.0
LEVELS = 5
# a bow has this share of the height variance, or a smaller one and this many times the mean
# power of polynomials of degrees 3 and 4. So have 5% of 200 machined maps of 64 to 128 points
# a side, whose own waves are as long as they are, and all but 1.5% with a bow of one h_rms
BOW = 0.35
LEAST_BOW = 0.05
BOW_OVER_NEXT = 15.0
# a place on at most this share of the points that rises above all others by so many h_rms
PLACE = 0.01
RISE = 2.0
SMALLEST = 32  # points along a side of a map


@dataclasses.dataclass(frozen=True)
class Artefact:
    """What is doubtful about heights, and what to do.

    Attributes
    ----------
    step : str
        In the provenance, and the name by which it is confirmed.
    seen : str
        What there is.
    remedy : str
        A call that removes it.
    points : int
        Points that it changes.
    """

    step: str
    seen: str
    remedy: str
    points: int


def as_read(measured: Any) -> Iterator[Artefact]:
    """Artefacts of heights before any treatment; undefined points are masked."""
    for found in (_lost_lines(measured), _saturation(measured)):
        if found is not None:
            yield found


def _listed(numbers: Any, most: int = 4) -> str:
    """The first of some numbers."""
    shown = ", ".join(str(number) for number in numbers[:most].tolist())
    return shown + (", ..." if len(numbers) > most else "")


def _lost_lines(measured: Any) -> Artefact | None:
    """Rows or columns that repeat the one before, or are of one value, unlike most others."""
    undefined = np.ma.getmaskarray(measured)
    for axis, name in enumerate(("rows", "columns")):
        lines = np.moveaxis(np.ma.getdata(measured), axis, 0)
        unknown = np.moveaxis(undefined, axis, 0)
        same = ((lines[1:] == lines[:-1]) | unknown[1:] | unknown[:-1]).all(axis=1)
        lost = np.append(False, same) | (np.ptp(lines, axis=1) == 0)
        # lines that are mostly undefined are filled, which is told
        lost &= unknown.mean(axis=1) < MOSTLY
        numbers = np.flatnonzero(lost)
        if not 0 < numbers.size <= MOST_LINES * lost.size:
            continue
        seen = (
            f"{numbers.size} {name} of {lost.size} repeat the one before or have one value "
            f"({_listed(numbers)}), as lines that an instrument lost"
        )
        return Artefact(
            "lost lines", seen, _longest_part(lost, axis), numbers.size * lines.shape[1]
        )
    return None


def _longest_part(lost: Any, axis: int) -> str:
    """A call with the longest part between lost lines, which begins after the line they repeat."""
    ends = np.flatnonzero(np.concatenate([[True], lost, [True]]))
    longest = int(np.argmax(np.diff(ends)))
    first = int(ends[longest])
    last = int(ends[longest + 1]) - 1
    if last - first < SMALLEST:
        return "measure again: no part without them is large enough"
    part = (":, " * axis) + f"{first}:{last}"
    return f"cut out a part without them, Surface.from_map(heights[{part}], ...)"


def clean_part(places: Any) -> str:
    """How to leave out some places: a call with half or a quarter of the map, if one has none."""
    cuts = []
    for count in places.shape:
        middle = count // 2
        cuts.append(
            (
                (":", slice(None)),
                (f":{middle}", slice(middle)),
                (f"{middle}:", slice(middle, None)),
            )
        )
    for (rows, row), (columns, column) in itertools.product(*cuts):
        part = places[row, column]
        if min(part.shape) >= SMALLEST and not part.any():
            return (
                "cut out a part without them, "
                f"Surface.from_map(heights[{rows}, {columns}], ...)"
            )
    return "cut out a part without them, smaller than a quarter of the map"


def _saturation(measured: Any) -> Artefact | None:
    """Many points of exactly the highest or the lowest value, as at the end of a range."""
    levels, counts = np.unique(np.ma.compressed(measured), return_counts=True)
    if levels.size <= LEVELS:
        return None
    for name, end, own in (
        ("highest", levels[-1], counts[::-1]),
        ("lowest", levels[0], counts),
    ):
        points = int(own[0])
        if points > max(SATURATED * measured.size, OFTEN * own[1 : 1 + LEVELS].max()):
            seen = (
                f"{points} points ({points / measured.size:.2g} of all) have exactly the "
                f"{name} value, as at the end of an instrument's range"
            )
            there = clean_part(np.ma.filled(measured == end, False))
            remedy = f"{there}, or measure again with a larger range"
            return Artefact("saturation", seen, remedy, points)
    return None


def bow(heights: FloatArray) -> Artefact | None:
    """A parabola with most of the height variance, or with far more than other long waves.

    `heights` are without their plane.
    """
    bases = [
        np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1, 1, count), 4))[0]
        for count in heights.shape
    ]
    power = (bases[0].T @ heights @ bases[1]) ** 2
    degree = np.add.outer(np.arange(5), np.arange(5))
    of_bow = power[degree == 2]
    share = float(of_bow.sum() / np.sum((heights - heights.mean()) ** 2))
    next_ones = float(power[(degree == 3) | (degree == 4)].mean())
    stands_out = share > LEAST_BOW and of_bow.max() > BOW_OVER_NEXT * next_ones
    if not (share > BOW or stands_out):
        return None
    seen = f"a bow has {share:.0%} of the height variance"
    remedy = (
        "Surface.from_map(..., detrend='quadratic') removes it, detrend='plane' keeps it"
    )
    return Artefact("bow", seen, remedy, heights.size)


def highest_place(heights: FloatArray, periodic: bool) -> Artefact | None:
    """A small place that rises above all others, on which light contacts hang."""
    from scipy.ndimage import label

    top = np.unravel_index(int(np.argmax(heights)), heights.shape)
    # about the middle, so that no edge of a periodic map divides it
    middle = [count // 2 for count in heights.shape]
    moved = heights
    if periodic:
        moved = np.roll(
            heights, [m - t for m, t in zip(middle, top, strict=True)], (0, 1)
        )
    rise = RISE * float(heights.std())
    above = moved > heights.max() - rise
    number = label(above, np.ones((3, 3)))[1]
    points = int(above.sum())
    if number != 1 or points > PLACE * heights.size:
        return None
    seen = (
        f"the highest place, {points} points at heights[{top[0]}, {top[1]}], rises above "
        f"all others by more than {RISE:g} h_rms: light contacts hang on it alone"
    )
    itself = heights > heights.max() - rise
    remedy = clean_part(itself)
    return Artefact("highest place", seen, remedy, points)
