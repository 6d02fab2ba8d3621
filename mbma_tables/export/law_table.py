"""Rows of a law, common to all files of rows, and their choice by the error of linear interpolation.

Linear interpolation over a step h has an error of about h^2 y''/8. Rows are spaced so that
this is the same fraction of y everywhere above a floor, and are then moved by half of it,
so that the error has both signs; the last row stays on the curve, because a solver has no
rows beyond it.
"""

from __future__ import annotations

import bisect
import dataclasses
import re
from collections.abc import Mapping
from decimal import ROUND_CEILING, Context
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mbma_tables.common.arguments import FloatArray, number_in, whole_number_in
from mbma_tables.common.display import Displayed, Variable, shown
from mbma_tables.common.errors import InputError
from mbma_tables.common.plots import draw_line

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# the table of `flow_factors`, which is of several quantities
FILM = "film"
MIN_ROWS = 3
MAX_ROWS = 5000
DIGITS = 10  # of rows, which are shorter to read; files hold exactly these
ROUNDS = 40  # rounds of making the errors of chords equal
LAST = 1.5  # the last chord's error counts so much more, as its last row is not moved


@dataclasses.dataclass(frozen=True, repr=False)
class LawTable(Displayed):
    """Rows of a contact law, ready to be written."""

    x: FloatArray  # overclosure, or pressure: zero, then rising
    y: FloatArray  # rising from zero; or flow, which falls, to zero where contact blocks it
    x_name: str
    y_name: str
    x_unit: str
    y_unit: str
    # relative, of linear interpolation between rows as written, where y is above `floor`
    largest_error: float
    comments: tuple[str, ...]  # notes for the reader of the file
    theory: str  # whose law it is
    floor: float = 0.0  # value below which errors are relative to it
    behaviour: LawTable | None = (
        None  # the pressure of the same joint, with its conductance
    )
    more: Mapping[str, tuple[FloatArray, str]] = dataclasses.field(
        default_factory=dict
    )  # other columns, their units
    # of the joint; of friction the coefficient, and `stick`, the shear stress over
    # displacement before slip, at one pressure, `stick_pressure`
    facts: Mapping[str, tuple[float, str]] = dataclasses.field(default_factory=dict)

    @property
    def quantity(self) -> str:
        """See `describe_law`."""
        return FILM if self.x_name == "mean_separation" else self.y_name

    @property
    def title(self) -> str:
        """Columns with their units against the first one."""
        first, *others = (f"{name} [{unit}]" for name, (_, unit) in self.columns.items())
        return f"{', '.join(others)} against {first}"

    @property
    def columns(self) -> dict[str, tuple[FloatArray, str]]:
        """All columns by their names, with their units."""
        return {
            self.x_name: (self.x, self.x_unit),
            self.y_name: (self.y, self.y_unit),
            **self.more,
        }

    def _facts(self) -> dict[str, str]:
        columns = {
            name: shown(values, unit) for name, (values, unit) in self.columns.items()
        }
        return columns | {
            "rows": str(self.x.size),
            "theory": self.theory,
            "largest error": shown(self.largest_error),
        }

    def _variables(self) -> dict[str, Variable]:
        dims = (self.x_name,)
        return {
            name: Variable(values, unit, name, dims)
            for name, (values, unit) in self.columns.items()
        }

    def _figure(self) -> Figure:
        labels = (
            f"{name} [{unit}]"
            for name, unit in ((self.x_name, self.x_unit), (self.y_name, self.y_unit))
        )
        return draw_line(self.x[1:], self.y[1:], *labels)


class Curve(NamedTuple):
    """A column that a program finds in a file of rows, against the first one."""

    name: str
    x: FloatArray
    y: FloatArray
    # largest relative difference from the law's rows that the file states or that its
    # fields allow
    rtol: float = 0.0


def titled(text: str) -> list[str]:
    """Names of the columns after the first, by the line of a header that has them.

    That line is like "area [1], stiffness [MPa/mm] against pressure [MPa]".
    """
    found = re.search(r"^\W*(\w+ \[.*\]) against \w+ \[", text, re.M)
    if found is None:
        raise InputError("the header has no line of the columns' names")
    return re.findall(r"(\w+) \[.*?\](?:, |$)", found[1])


def chosen_rows(
    fine_x: FloatArray,
    fine_y: FloatArray,
    floor: float,
    rows: int | None,
    rtol: float | None,
    evenly: bool = False,
    jump: bool = False,
    most_rows: int | None = None,
) -> tuple[FloatArray, FloatArray, float]:
    """Rows of a curve given on fine points, as written to a file, and their largest relative error above `floor`.

    Where a program holds `most_rows` alone and neither their number nor their error is
    asked for, there are that many where fewer do not reach the usual error.
    """
    # with a jump the first two fine points are rows
    begin = fine_x[:1], fine_y[:1]
    if jump:
        fine_x = fine_x[1:]
        fine_y = fine_y[1:]
    if rows is not None and rtol is not None:
        raise InputError("rows and rtol are both given: give one of them")

    def with_rows(count: int) -> tuple[FloatArray, FloatArray, float]:
        count -= jump
        places = (
            np.linspace(fine_x[0], fine_x[-1], count)
            if evenly
            else spread(fine_x, fine_y, count, floor)
        )
        x = rounded(places)
        y = np.interp(x, fine_x, fine_y)
        y = rounded(y if evenly else balanced(x, y, fine_x, fine_y, floor))
        x[-1], y[-1] = _not_below(fine_x[-1]), _not_below(fine_y[-1])
        kept = fine_y > floor
        error = float(np.abs(np.interp(fine_x[kept], x, y) / fine_y[kept] - 1).max())
        return (
            (np.append(begin[0], x), np.append(begin[1], y), error)
            if jump
            else (x, y, error)
        )

    if rows is not None:
        x, y, error = with_rows(whole_number_in("rows", rows, MIN_ROWS, MAX_ROWS))
    else:
        asked = number_in("rtol", 1e-3 if rtol is None else rtol, 1e-7, 0.5)
        # the error falls with the number of rows
        fewest = bisect.bisect_left(
            range(MAX_ROWS + 1), -asked, MIN_ROWS, key=lambda count: -with_rows(count)[2]
        )
        if most_rows is not None and fewest > most_rows:
            if rtol is not None:
                raise InputError(
                    f"rtol = {asked:g} needs {fewest} rows, and the program keeps {most_rows}: take a larger rtol, a "
                    f"shorter range of pressures, or rows={most_rows}"
                )
            fewest = most_rows
        if fewest > MAX_ROWS:
            raise InputError(
                f"rtol = {asked:g} needs more than {MAX_ROWS} rows under linear interpolation"
            )
        x, y, error = with_rows(fewest)
    if (np.diff(x) <= 0).any():
        raise InputError(
            "rows are too close to be told apart: take fewer rows, or a larger smallest pressure"
        )
    return x, y, error


def rounded(values: FloatArray) -> FloatArray:
    """Numbers as written to a file."""
    return np.array([float(f"{value:.{DIGITS}g}") for value in values])


def _not_below(value: float) -> float:
    """A number as written to a file, rounded up so that rows reach it, unless it equals one up to rounding."""
    return float(
        Context(prec=DIGITS, rounding=ROUND_CEILING).create_decimal(
            float(value) * (1 - 1e-13)
        )
    )


def spread(x: FloatArray, y: FloatArray, count: int, floor: float) -> FloatArray:
    """Places of `count` rows along x whose chords have equal errors relative to max(y, floor), by iteration."""

    def cut(
        filled: FloatArray, along: FloatArray
    ) -> FloatArray:  # places between which `filled` grows equally
        inner: FloatArray = np.interp(
            np.linspace(filled[0], filled[-1], count), filled, along
        )[1:-1]
        return np.concatenate([x[:1], inner, x[-1:]])

    scale = np.maximum(y, floor)
    # logarithmic in y above the floor to begin with, linear below
    filled = np.concatenate(
        [[0.0], np.cumsum(np.abs(np.diff(y)) / scale[1:])]
    ) + np.linspace(0, 3, x.size)
    places = cut(filled, x)
    best = np.inf
    found = places
    for _ in range(ROUNDS):
        chords = np.interp(places, x, y)
        step = np.clip(np.searchsorted(places, x, side="right") - 1, 0, count - 2)
        error = np.zeros(count - 1)
        np.maximum.at(error, step, np.abs(np.interp(x, places, chords) - y) / scale)
        error[-1] *= LAST
        if error.max() < best:
            best = error.max()
            found = places
        # the error of a chord falls like the square of its length
        root = np.sqrt(error + 1e-3 * error.max())
        places = cut(np.concatenate([[0.0], np.cumsum(root)]), places)
    return found


def balanced(
    x: FloatArray, y: FloatArray, fine_x: FloatArray, fine_y: FloatArray, floor: float
) -> FloatArray:
    """Rows moved by half of the error of the chords beside them, which halves the largest error."""
    scale = np.maximum(fine_y, floor)
    over = (np.interp(fine_x, x, y) - fine_y) / scale
    step = np.clip(np.searchsorted(x, fine_x, side="right") - 1, 0, x.size - 2)
    high = np.zeros(x.size - 1)
    low = np.zeros(x.size - 1)
    np.maximum.at(high, step, over)
    np.minimum.at(low, step, over)
    middle = (high + low) / 2
    beside = np.concatenate([[middle[0]], (middle[1:] + middle[:-1]) / 2, [middle[-1]]])
    moved = np.maximum(y - beside * np.maximum(y, floor), 0.0)
    moved[0], moved[-1] = y[0], y[-1]
    # pressure increases and leakage decreases; conductance may decrease where the model's
    # stiffness jumps
    for keeps, accumulated in (
        (np.greater_equal, np.maximum),
        (np.less_equal, np.minimum),
    ):
        if keeps(np.diff(fine_y), 0).all():
            moved = accumulated.accumulate(moved)
    return np.asarray(moved)
