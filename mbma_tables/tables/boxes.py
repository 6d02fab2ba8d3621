"""Boxes of a table of any function: halved until a function is a polynomial on each, to a tolerance.

A piece of the range grows in rounds. Each round asks for the function at some points, the
Chebyshev nodes and test points of new boxes, or held-out points of the whole piece, and
decides from its values which boxes are done, get more terms, or are halved. What a piece asks
depends on nothing else, so that pieces can be made anywhere, ended and continued.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import UncertifiedError
from mbma_tables.common.shared import shared

PENDING, POLYNOMIAL, NO_ANSWER = -3, -1, -2  # of boxes that are not halved; as in mbma.h
# by the number of axes: terms at first and at most along an axis, test points of a box, and
# how often an axis is halved where the function fails
FIRST_TERMS = {1: 8, 2: 6, 3: 5, 4: 5, 5: 4, 6: 4}
MOST_TERMS = {1: 16, 2: 10, 3: 8, 4: 7, 5: 6, 6: 6}
TESTS = {1: 24, 2: 48, 3: 64, 4: 96, 5: 128, 6: 160}
HALVINGS_AT_FAILURES = {1: 12, 2: 8, 3: 5, 4: 4, 5: 3, 6: 2}
MOST_HALVINGS = (
    36  # of an axis; where the function is still no polynomial, it is not smooth
)
MOST_TRIALS = 3  # of terms in one box
AIM = 0.8  # of the target, for the tests of a box
BOUND = 2.0  # bound over the largest error at the tests of a box
LEAST_BOUND = 0.05  # of the target
TRIMMED = 0.2  # of the target, what terms that are left out may add up to
SLOWEST = 0.98  # ratio of one term to the one before, for estimates of what is left out
MOST_ROUNDS = 8  # of held-out points
REPLAYED = 16  # held-out points of a piece that a file keeps
ROUNDING = 1e-15


@dataclasses.dataclass(frozen=True)
class Aim:
    """How accurate each output is to be; arrays of shape (outputs,)."""

    target: FloatArray
    is_relative: NDArray[np.bool_]
    least: FloatArray  # magnitude below which a relative error is that over `least`
    is_exponential: NDArray[np.bool_]  # the logarithm is stored, its error is relative

    def scale(self, values: FloatArray) -> FloatArray:
        """What errors of stored values are divided by, for values of shape (outputs, ...)."""
        shape = (-1, *(1,) * (values.ndim - 1))
        plain = self.is_relative & ~self.is_exponential
        size = np.maximum(np.abs(values), self.least.reshape(shape))
        with np.errstate(divide="ignore"):
            return np.where(plain.reshape(shape), size, 1.0)


@shared(64)
def nodes(terms: int) -> FloatArray:
    """Chebyshev nodes in [-1, 1]."""
    return np.asarray(-np.cos(np.pi * (np.arange(terms) + 0.5) / terms))


@shared(64)
def fit(terms: int) -> FloatArray:
    """The matrix from values at the nodes to coefficients."""
    angles = np.pi * (np.arange(terms)[:, None]) * (np.arange(terms)[::-1] + 0.5) / terms
    matrix = 2.0 / terms * np.cos(angles)
    matrix[0] *= 0.5
    return np.asarray(matrix)


@shared(64)
def tests(axes: int) -> FloatArray:
    """Test points of a box in [-1, 1], denser at its faces, shape (points, axes)."""
    from scipy.stats import qmc

    places = qmc.Halton(axes, scramble=True, seed=20260101).random(TESTS[axes])
    return np.asarray(-np.cos(np.pi * places))


def grid_of(terms: tuple[int, ...]) -> FloatArray:
    """The nodes of a box in [-1, 1], shape (points, axes), the last axis fastest."""
    grids = np.meshgrid(*map(nodes, terms), indexing="ij")
    return np.stack([grid.ravel() for grid in grids], axis=-1)


def coefficients_of(values: FloatArray) -> FloatArray:
    """Chebyshev coefficients from values at the nodes, shape (outputs, *terms)."""
    for axis in range(1, values.ndim):
        matrix = fit(values.shape[axis])
        values = np.moveaxis(np.tensordot(matrix, values, (1, axis)), 0, axis)
    return np.ascontiguousarray(values)


def value_at(coefficients: FloatArray, places: FloatArray) -> FloatArray:
    """The polynomials at places in [-1, 1], shape (outputs, points)."""
    count, axes = places.shape
    last = chebyshev.chebvander(places[:, -1], coefficients.shape[-1] - 1)
    sums = coefficients @ last.T  # (outputs, terms of the other axes, points)
    for axis in range(axes - 2, -1, -1):
        terms = coefficients.shape[axis + 1]
        basis = chebyshev.chebvander(places[:, axis], terms - 1)
        sums = np.einsum("...kp,pk->...p", sums, basis)
    return np.asarray(sums).reshape(len(coefficients), count)


def sizes_along(coefficients: FloatArray, axis: int) -> FloatArray:
    """How large the terms of an axis are together: (outputs, terms)."""
    others = tuple(a for a in range(1, coefficients.ndim) if a != axis + 1)
    return np.asarray(2.0 * np.sqrt((coefficients**2).sum(axis=others)))


def left_out(sizes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Estimate of the terms that follow, and the ratio of one to the next, of each output.

    Sizes are taken to fall geometrically; those of even or odd functions vanish by turns.
    """
    terms = sizes.shape[-1]
    if terms == 1:
        return np.full(len(sizes), np.inf), np.full(len(sizes), SLOWEST)
    last = sizes[:, -2:].max(axis=-1)
    first = sizes[:, 1:3].max(axis=-1) if terms > 3 else sizes[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (last / first) ** (1 / max(terms - 3, 1))
    ratio = np.clip(np.nan_to_num(ratio, nan=0.0), 1e-3, SLOWEST)
    return last * ratio / (1 - ratio), ratio


@dataclasses.dataclass
class Box:
    """A box of the range, in coordinates on which boxes are halved."""

    low: FloatArray
    high: FloatArray
    halvings: NDArray[np.int64]  # since the whole range, by axis
    terms: tuple[int, ...]
    axis: int = PENDING
    child: int = -1  # number of the lower half
    trials: int = 0
    coefficients: FloatArray | None = None
    error: FloatArray | None = None  # bound, by output
    missed: float = (
        0.0  # largest error over its target, of what it is a half of if it is one
    )

    def at(self, places: FloatArray) -> FloatArray:
        """Coordinates at places in [-1, 1]."""
        middle, half = 0.5 * (self.low + self.high), 0.5 * (self.high - self.low)
        return np.asarray(np.clip(middle + half * places, self.low, self.high))

    def halves(self, axis: int, terms: tuple[int, ...]) -> list[Box]:
        """Its lower and its upper half along an axis, with terms to begin with."""
        halvings = self.halvings.copy()
        halvings[axis] += 1
        lower_end, upper_start = self.high.copy(), self.low.copy()
        lower_end[axis] = upper_start[axis] = 0.5 * (self.low[axis] + self.high[axis])
        return [
            Box(self.low, lower_end, halvings, terms),
            Box(upper_start, self.high, halvings.copy(), terms),
        ]

    def place(self, points: FloatArray) -> FloatArray:
        """Inverse of `at`."""
        return np.asarray((2 * points - self.low - self.high) / (self.high - self.low))


def middle_of(boxes: list[Box], box: Box) -> float:
    """Where a box of a tree is halved; 0 for one that is not."""
    return float(boxes[box.child].high[box.axis]) if box.axis >= 0 else 0.0


def cells_at(boxes: list[Box], points: FloatArray) -> NDArray[np.int64]:
    """Numbers of the boxes of points that are not halved; the first box is the whole range."""
    axis = np.array([box.axis for box in boxes])
    child = np.array([box.child for box in boxes])
    middles = np.array([middle_of(boxes, box) for box in boxes])
    found = np.zeros(len(points), dtype=np.int64)
    going = np.arange(len(points))
    while going.size:
        going = going[axis[found[going]] >= 0]
        box = found[going]
        found[going] = child[box] + (points[going, axis[box]] >= middles[box])
    return found


class Piece:
    """A part of the range that grows on its own.

    Parameters
    ----------
    whole : Box
        The part.
    aim : Aim
    held_out : int
        Points on which it is checked, new ones in each round.
    seed : int
        Of these points.
    marks : bool
        Whether boxes in which the function has no value are left without an answer.
    most : int
        Coefficients of all its outputs, at most.
    """

    def __init__(
        self,
        whole: Box,
        aim: Aim,
        held_out: int,
        seed: int,
        marks: bool,
        most: int,
    ) -> None:
        self.aim, self.held_out, self.seed, self.marks = aim, held_out, seed, marks
        self.most = most
        axes = whole.low.size
        first = (FIRST_TERMS[axes],) * axes
        self.boxes = [dataclasses.replace(whole, terms=first)]
        self.round = 0  # of held-out points; 0 while boxes are pending
        self.errors: FloatArray | None = None  # at held-out points, once it is done
        self.excess = 0  # held-out points, of all rounds, above the bound of their box
        # the first held-out points with a value, and what is stored there, to replay
        self.replayed = np.empty((0, axes)), np.empty((0, len(aim.target)))

    @property
    def axes(self) -> int:
        """Number of axes."""
        return self.boxes[0].low.size

    @property
    def pending(self) -> list[Box]:
        """Boxes whose function values are to be asked next."""
        return [box for box in self.boxes if box.axis == PENDING]

    @property
    def is_done(self) -> bool:
        """Whether all boxes meet the target on held-out points."""
        return self.errors is not None

    @property
    def size(self) -> int:
        """Number of coefficients."""
        sizes = [b.coefficients.size for b in self.boxes if b.coefficients is not None]
        return sum(sizes)

    def points(self) -> FloatArray:
        """Where the function is asked next, shape (points, axes)."""
        pending = self.pending
        if not pending:
            from scipy.stats import qmc

            places = qmc.Halton(self.axes, seed=self.seed + self.round)
            return self.boxes[0].at(2 * places.random(self.held_out) - 1)
        parts = []
        for box in pending:
            parts += [box.at(grid_of(box.terms)), box.at(tests(self.axes))]
        return np.concatenate(parts)

    def take(self, values: FloatArray) -> None:
        """Go on with the values at `points`, shape (points, outputs); NaN where there is none."""
        stored = values.T.copy()
        some = self.aim.is_exponential
        stored[some] = np.log(stored[some])
        pending = self.pending
        if not pending:
            self._check(self.points(), stored)
            return
        start = 0
        for box in pending:
            end = start + math.prod(box.terms)
            last = end + TESTS[self.axes]
            self._decide(box, stored[:, start:end], stored[:, end:last])
            start = last
        if self.size > self.most:
            raise UncertifiedError(
                f"{self.most} coefficients do not reach the target{self._left()}; ask for a "
                "larger one, a smaller range, or set max_coefficients"
            )

    def _left(self) -> str:
        """What is left to do, as a part of a sentence; after all pending boxes were decided."""
        missing = self.pending
        if not missing:
            return f", which takes {self.size} in this part of the range"
        worst = max(box.missed for box in missing)
        return (
            f": in this part of the range {len(missing)} of {len(self.boxes)} boxes miss "
            f"it, by up to {worst:.2g} times"
        )

    def _decide(self, box: Box, at_nodes: FloatArray, at_tests: FloatArray) -> None:
        """Whether a box is done, gets more terms, or is halved."""
        together = np.concatenate([at_nodes, at_tests], axis=1)
        if not np.isfinite(together).all():
            self._decide_without_values(box, together)
            return
        box.trials += 1
        series = coefficients_of(at_nodes.reshape(-1, *box.terms))
        scale = self.aim.scale(together).min(axis=1)
        scale_at_tests = self.aim.scale(at_tests)
        error = np.abs(value_at(series, tests(self.axes)) - at_tests) / scale_at_tests
        worst = error.max(axis=1)
        box.missed = float((worst / self.aim.target).max())
        aim = AIM * self.aim.target + ROUNDING * np.abs(together).max(axis=1) / scale
        tails, ratios = np.empty((2, self.axes, len(scale)))
        for axis in range(self.axes):
            tail, ratios[axis] = left_out(sizes_along(series, axis))
            tails[axis] = tail / scale
        if (worst <= aim).all() and (tails.sum(axis=0) <= aim).all():
            self._finish(box, series, at_tests, scale)
            return
        excess = (tails / aim).max(axis=1)  # by axis
        more = self._more_terms(box, tails, ratios, aim)
        few = more != box.terms and max(more) <= MOST_TERMS[self.axes]
        if few and box.trials < MOST_TRIALS:
            box.terms = more
            return
        terms = tuple(min(t, MOST_TERMS[self.axes]) for t in more)
        self._halve(box, int(excess.argmax()), terms)

    def _more_terms(
        self, box: Box, tails: FloatArray, ratios: FloatArray, aim: FloatArray
    ) -> tuple[int, ...]:
        """Terms along each axis for which what is left out meets the aim."""
        with np.errstate(divide="ignore"):
            short = np.log(tails * self.axes / aim) / -np.log(ratios)
        more = np.ceil(np.clip(short.max(axis=1), 0, 99)).astype(int)
        return tuple(int(t + m) for t, m in zip(box.terms, more, strict=True))

    def _finish(
        self, box: Box, series: FloatArray, at_tests: FloatArray, scale: FloatArray
    ) -> None:
        """Keep a box with the terms that it needs, and a bound on its errors."""
        allowed = TRIMMED * self.aim.target * scale
        for axis in range(self.axes):
            sizes = sizes_along(series, axis)
            behind = np.cumsum(sizes[:, ::-1], axis=1)[:, ::-1]
            needed = np.flatnonzero((behind > allowed[:, None]).any(axis=0))
            count = int(needed.max(initial=0)) + 1
            series = np.take(series, np.arange(count), axis=axis + 1)
        error = np.abs(value_at(series, tests(self.axes)) - at_tests)
        worst = (error / self.aim.scale(at_tests)).max(axis=1)
        rounding = ROUNDING * np.abs(series).reshape(len(series), -1).sum(axis=1)
        box.terms = series.shape[1:]
        box.coefficients = np.ascontiguousarray(series)
        box.error = BOUND * worst + LEAST_BOUND * self.aim.target + rounding / scale
        box.axis = POLYNOMIAL

    def _decide_without_values(self, box: Box, values: FloatArray) -> None:
        """Halve a box in which the function has no value somewhere, or leave it without an answer."""
        limit = HALVINGS_AT_FAILURES[self.axes]
        axis = int(box.halvings.argmin())
        if np.isnan(values).any(axis=0).all() or box.halvings[axis] >= limit:
            box.axis = NO_ANSWER
            return
        self._halve(box, axis, (FIRST_TERMS[self.axes],) * self.axes)

    def _halve(self, box: Box, axis: int, terms: tuple[int, ...]) -> None:
        """Replace a box by its halves along an axis."""
        box.coefficients = box.error = None
        if box.halvings[axis] >= MOST_HALVINGS:
            if not self.marks:
                raise UnsmoothError(box.at(np.zeros(self.axes)))
            box.axis = NO_ANSWER
            return
        box.axis, box.child = axis, len(self.boxes)
        halves = box.halves(axis, terms)
        for half in halves:
            half.missed = box.missed
        self.boxes += halves

    def _check(self, points: FloatArray, stored: FloatArray) -> None:
        """Errors at held-out points; boxes that miss the target are halved."""
        owners = cells_at(self.boxes, points)
        errors = np.full(stored.shape, np.nan)
        scale = self.aim.scale(stored)
        again = False
        for number in np.unique(owners):
            box = self.boxes[number]
            mine = np.flatnonzero(owners == number)
            if box.axis == NO_ANSWER or box.coefficients is None or box.error is None:
                continue
            exact = stored[:, mine]
            found = value_at(box.coefficients, box.place(points[mine]))
            errors[:, mine] = np.abs(found - exact) / scale[:, mine]
            worst = np.nan_to_num(errors[:, mine], nan=np.inf).max(axis=1)
            if (worst > self.aim.target).any():
                again = True
                sizes = [
                    left_out(sizes_along(box.coefficients, axis))[0].max()
                    for axis in range(self.axes)
                ]
                self._halve(box, int(np.argmax(sizes)), box.terms)
                continue
            self.excess += int((errors[:, mine] > box.error[:, None]).any(axis=0).sum())
            box.error = np.maximum(box.error, 1.5 * worst)
        self.round += 1
        if not again:
            self.errors = errors.T
            some = np.flatnonzero(np.isfinite(errors).all(axis=0))[:REPLAYED]
            self.replayed = points[some], stored.T[some]
        elif self.round >= MOST_ROUNDS:
            raise UncertifiedError(
                f"after {MOST_ROUNDS} rounds of {self.held_out} held-out points the target "
                "is still missed: the function is not smooth"
            )

    def state(self) -> dict[str, Any]:
        """All that it has found so far, as arrays."""
        boxes = self.boxes
        answered = [box for box in boxes if box.axis == POLYNOMIAL]
        found: dict[str, Any] = {
            "low": np.array([box.low for box in boxes]),
            "high": np.array([box.high for box in boxes]),
            "halvings": np.array([box.halvings for box in boxes]),
            "terms": np.array([box.terms for box in boxes]),
            "axis": np.array([box.axis for box in boxes]),
            "child": np.array([box.child for box in boxes]),
            "trials": np.array([box.trials for box in boxes]),
            "coefficients": np.concatenate(
                [np.empty(0), *(b.coefficients.ravel() for b in answered)]  # type: ignore[union-attr]
            ),
            "error": np.array([b.error for b in answered]),
            "round": np.array([self.round, self.excess]),
            "replayed_points": self.replayed[0],
            "replayed_values": self.replayed[1],
        }
        return found | ({} if self.errors is None else {"errors": self.errors})

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from what `state` returned."""
        names = ("low", "high", "halvings", "terms", "axis", "child", "trials")
        self.boxes = [
            Box(low, high, halvings, tuple(map(int, terms)), int(a), int(c), int(t))
            for low, high, halvings, terms, a, c, t in zip(
                *(state[name] for name in names), strict=True
            )
        ]
        start, number, outputs = 0, 0, len(self.aim.target)
        for box in self.boxes:
            if box.axis == POLYNOMIAL:
                end = start + outputs * math.prod(box.terms)
                part = state["coefficients"][start:end]
                box.coefficients = part.reshape(outputs, *box.terms)
                box.error = state["error"][number]
                start, number = end, number + 1
        self.round, self.excess = map(int, state["round"])
        self.errors = state.get("errors")
        self.replayed = state["replayed_points"], state["replayed_values"]


class UnsmoothError(UncertifiedError):
    """A place at which the function is not smooth, in coordinates on which boxes are halved."""

    def __init__(self, place: FloatArray) -> None:
        super().__init__("the function is not smooth")
        self.place = place
