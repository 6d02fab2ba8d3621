"""What a theory is: anything that answers a surface and a mean separation with pressure, area and stiffness.

MBMA, Persson's theory, Greenwood and Williamson's and the law calibrated on boundary elements are theories, and so is a
user's own object with a `name` and an ``answer(surface, mean_separation)``. What a theory has not in closed form
(stiffness, energy, the separation at a given load) follows from its forces here.
"""

from __future__ import annotations

import abc
import functools
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray, describe_entries, require, rows
from mbma_tables.common.errors import ConvergenceError, OutOfRangeError
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories import calibrated_table
from mbma_tables.theories.differences import differences
from mbma_tables.theories.gaps import Search

LOOKS, FEW_LOOKS = 128, 8  # gaps at which an inversion begins, of one surface and of each of a batch,
LOOKED_AT = 7.0  # from where to where, of ln u - ln(h_max - u),
FAR = 12.0  # and up to which u/h_rms where contact has no end
STEPS = 200
MISSED = 0.5  # of ln of a value that lies between two numbers u
ENERGY_RTOL = 1e-9
LEAST_LEVEL = 4  # of the rule of energies, whose estimate of its error may vanish by chance where it is coarse
SCAN = 49  # compressions at which a law is looked at for a turning point

# values at mean separations, about -d/du of them, and whether that is exact
Curve = Callable[[FloatArray], tuple[Any, Any, bool]]


class TheoryAnswer(NamedTuple):
    """Arrays of the shape that surface and mean separation broadcast to."""

    pressure: FloatArray  # F/(A0 E*)
    area: FloatArray  # A/A0
    stiffness: FloatArray  # -d(F/(A0 E*))/du [1/length]
    error: FloatArray  # bound on the relative numerical error of force and area, against the theory itself


@runtime_checkable
class UserTheory(Protocol):
    """The least that `contact` needs of a theory."""

    @property
    def name(self) -> str:
        """What results call it."""

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> tuple[FloatArray, FloatArray]:
        """F/(A0 E*) and A/A0 at mean separations u [length] of the surface's broadcast shape."""


class Theory(abc.ABC):
    """A theory, and what follows from its forces."""

    name: str
    variant_name = island_model_name = ""  # what results call its variant of the paper and its island model
    advice = ""  # one line beside each answer
    origin = ""  # what its numbers were found of, where that is no shipped file
    reached = 0.0  # by how much, relatively, a wanted value may be more than the largest
    ends_at_h_max = True  # whether force vanishes at u = h_max; else its Gaussian heights have no end

    @abc.abstractmethod
    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Pressure, area and stiffness at mean separations u [length]."""

    def departures(self, surface: AnySurface) -> tuple[str, ...]:
        """Why a measured surface is not one that the theory is of, or was tested on."""
        return surface.departures()

    def scatter_name(self, surface: AnySurface) -> str:
        """Under which its distance from boundary elements is stated."""
        return self.name

    @property
    def elastic(self) -> Theory:
        """The theory of the elastic contact, where this one goes beyond it."""
        return self

    def at(self, shape: tuple[int, ...], place: Any) -> Theory:
        """The theory at flat places of a broadcast shape, where it holds arrays of its own."""
        return self

    def area_at(self, surface: AnySurface, pressure: FloatArray) -> FloatArray:
        """A/A0 at a force over A0 E*."""
        return self.answer(surface, self.inverted(surface, "pressure", pressure)[0]).area

    def heights(self, surface: AnySurface) -> Any:
        """Where the Gaussian heights end over h_rms, or a map's own `laws.hardness.BearingCurve`; for a hardness."""
        return np.asarray(surface.h_max) / np.asarray(surface.h_rms) if self.ends_at_h_max else np.inf

    def bearing_share(self, surface: AnySurface, mean_separation: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Share of heights above the level whose mean gap is u, and its derivative by u."""
        # needed with a hardness alone
        from mbma_tables.laws import hardness

        h_rms, heights = np.asarray(surface.h_rms), self.heights(surface)
        x = np.asarray(mean_separation) / h_rms
        share, slope = heights(x) if callable(heights) else hardness.bearing_share(x, heights)
        return share, slope / h_rms

    def interval(self, surface: AnySurface, quantity: str = "pressure") -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] between which "pressure" or "area" falls: full compression and last contact."""
        high = np.asarray(surface.h_max, dtype=float)
        return np.zeros_like(high), high

    def bends(self, surface: AnySurface) -> FloatArray:
        """Mean separations [length], two at most, at which derivatives of force or area jump; rows of a batch's."""
        return np.empty(0)

    def reasons(self, surface: AnySurface, answer: TheoryAnswer, mean_separation: FloatArray) -> Mapping[str, Any]:
        """Reasons for which answers lie outside what the theory was tested for, each with a mask."""
        if self.ends_at_h_max:
            return {}
        beyond = mean_separation > np.asarray(surface.h_max)
        return {"u is above h_max, where the surface has no contact and the theory's heights have no end": beyond}

    def scatter(self, surface: AnySurface, quantity: str, area: FloatArray) -> FloatArray:
        """Standard deviation of ln of a quantity against simulations, at A/A0 = `area`.

        "pressure" at given u, "area" at given F, "stiffness" -dF/du at given F, with a hardness that of the frozen
        contact. Root mean squares of ln(theory/simulation), of the boundary elements in the calibrated law's file; NaN
        where they are not known, as on surfaces unlike those.
        """
        if self.departures(surface):
            return np.full(np.broadcast_shapes(np.shape(area), surface.shape), np.nan)
        return calibrated_table.shipped().standard_deviation(self.scatter_name(surface), quantity, area)

    def flow(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray | None:
        """Flow coefficient [length^3] along both axes, shape (2, ...), of simulated gaps, if there are any."""
        return None

    def flow_trust(
        self, surface: AnySurface, mean_separation: FloatArray, area: FloatArray
    ) -> tuple[FloatArray, dict[str, Any]] | None:
        """Standard deviation of ln of that flow, and reasons against it with their masks."""
        return None

    def energy(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        """Elastic energy over A0 E* [length], the integral of F/(A0 E*) from u to last contact."""
        from scipy.integrate import tanhsinh

        u = np.asarray(mean_separation, dtype=float)
        high = np.broadcast_to(self.interval(surface)[1], u.shape)
        low = np.minimum(u, high)
        # from bend to bend, across which no rule converges
        edges = np.sort([low, *(np.clip(bend, low, high) for bend in self.elastic.bends(surface)), high], axis=0)
        found = tanhsinh(
            lambda x, place: self.at(u.shape, place).answer(select(surface, u.shape, place), x).pressure,
            edges[:-1],
            edges[1:],
            args=(np.arange(float(u.size)).reshape(u.shape),),  # of one type with x
            rtol=ENERGY_RTOL,
            minlevel=LEAST_LEVEL,
        )
        if not found.success.all():
            raise unfinished(~found.success.all(axis=0), "the elastic energy")
        return np.asarray(found.integral.sum(axis=0))

    def slopes(self, surface: AnySurface, mean_separation: FloatArray) -> tuple[dict[str, FloatArray], ...] | None:
        """Derivatives of force and of area by "mean_separation" and the surface's parameters, if in closed form."""
        return None

    def looks(self, surface: AnySurface) -> int:
        """At how many gaps of each surface an inversion begins."""
        return LOOKS if surface.shape == () else FEW_LOOKS

    def curve(self, surface: AnySurface, quantity: str) -> Curve:
        """What inversions work on: unchecked force or area of a surface against mean separations.

        With each value, about -d/du of it, NaN where that is not known; and whether it is exact.
        """

        def values(u: FloatArray) -> tuple[Any, Any, bool]:
            found = self.answer(surface, u)
            if quantity == "pressure":
                return found.pressure, found.stiffness, True
            # area rises nearly as force does
            return found.area, found.area * found.stiffness / found.pressure, False

        return values

    def mean_separation_at(self, surface: AnySurface, quantity: str, wanted: FloatArray) -> FloatArray:
        """Mean separation u [length] at which "pressure" (over A0 E*) or "area" has a wanted value; h_max at zero.

        Raises
        ------
        OutOfRangeError
            Where the branch of first contact does not reach it.
        """
        u, missed = self.inverted(surface, quantity, np.asarray(wanted, dtype=float))
        if missed.any():
            raise unfinished(missed, f"the separation at this {quantity}")
        return u

    @np.errstate(all="ignore")
    def inverted(self, surface: AnySurface, quantity: str, wanted: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """As `mean_separation_at`, by Newton's method in a bracket, and where rounding of u leaves no such value."""
        first, last = self.interval(surface, quantity)
        end = surface.h_max if self.ends_at_h_max else np.inf
        (goal, ends, low, high), shape = rows(wanted, end, first, last)
        if not self.ends_at_h_max:
            allowed = f"positive: contact has no end in theory {self.name!r}"
            require(quantity, goal.reshape(shape), goal.reshape(shape) != 0, allowed)
        near = last if self.ends_at_h_max else np.minimum(last, FAR * surface.h_rms)
        shares = _shares(self.looks(surface)).reshape(-1, *[1] * len(shape))
        looked = np.asarray(first + (near - first) * shares)
        curve = self.curve(surface, quantity)
        value, steep, exact = curve(looked)
        # one column of places for all, or one for each
        seen = np.empty(
            (3, *(shares.shape if max(looked.size, np.size(value)) == shares.size else (shares.size, *shape)))
        )
        seen[0], seen[1], seen[2] = looked, value, steep
        search = Search(seen.reshape(3, len(shares), -1), exact, goal, ends, low, high)
        at_end = goal > seen[1][-1].ravel()
        if at_end.any():
            at_end = self._at_end(surface, quantity, goal, first, shape)
        left = np.flatnonzero((goal > 0) & ~at_end)
        for _ in range(STEPS):
            if not left.size:
                break
            theory, own = self.at(shape, left), select(surface, shape, left)
            value, steep, _ = (curve if theory is self and own is surface else theory.curve(own, quantity))(
                search.gap[left]
            )
            left = search.step(left, value, steep)
        missed = (np.isnan(search.gap) | (np.abs(search.before[0] - np.log(goal)) > MISSED)) & (goal > 0) & ~at_end
        missed[left] = True
        u = np.where(goal == 0, high, np.where(at_end, low, search.gap))
        return u.reshape(shape), missed.reshape(shape)

    def _at_end(
        self, surface: AnySurface, quantity: str, goal: FloatArray, first: FloatArray, shape: Any
    ) -> NDArray[np.bool_]:
        """Which of the wanted values are the largest one; more is refused."""
        largest = np.broadcast_to(getattr(self.answer(surface, first), quantity), shape)
        wanted = goal.reshape(shape)
        out = wanted > largest * (1 + self.reached)
        if out.any():
            raise OutOfRangeError(
                f"{quantity} must be at most what theory {self.name!r} reaches on this surface "
                f"({describe_entries(largest, out)}), got {describe_entries(wanted, out)}",
                out,
            )
        return np.asarray(wanted >= largest).ravel()


@functools.cache
def _shares(count: int) -> FloatArray:
    """Places from 1 to 0, closer together at either end."""
    return np.asarray(1 / (1 + np.exp(np.linspace(-LOOKED_AT, LOOKED_AT, count))))


def select(surface: AnySurface, shape: tuple[int, ...], place: Any) -> AnySurface:
    """The surfaces of a batch, broadcast to `shape`, at flat places."""
    if surface.shape == ():
        return surface
    chosen = np.asarray(place).astype(np.intp)
    numbers = (np.broadcast_to(getattr(surface, name), shape).ravel()[chosen] for name in surface.parameters)
    return surface.with_numbers(*numbers)


def unfinished(failed: NDArray[np.bool_], what: str) -> ConvergenceError:
    """The error of entries that were not found."""
    return ConvergenceError(f"{what} was not found for {int(failed.sum())} entries", failed)


def answer_where_finite(theory: Theory, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
    """A theory's answers at mean separations u, shape (n,), on one surface; NaN where it has no finite force."""
    u = np.asarray(mean_separation, dtype=float)
    places = np.arange(u.size)
    fields = np.full((4, u.size), np.nan)
    while places.size:
        try:
            with np.errstate(all="ignore"):
                found = theory.answer(surface, u[places])
        except OutOfRangeError as fault:
            if fault.mask is None or np.shape(fault.mask) != places.shape or not np.any(fault.mask):
                raise
            places = places[~np.asarray(fault.mask)]
        else:
            fields[:, places] = np.where(np.isfinite(found.pressure), found, np.nan)
            break
    return TheoryAnswer(*fields)


class Wrapped(Theory):
    """A user's theory, its stiffness by numerical differentiation."""

    def departures(self, surface: AnySurface) -> tuple[str, ...]:
        """None: its author decides."""
        return ()

    def __init__(self, theory: UserTheory) -> None:
        self.name = theory.name
        self._theory = theory

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness at mean separations u [length]; the error is not known."""
        u = np.asarray(mean_separation, dtype=float)
        found = self._theory.answer(surface, u)
        pressure, area = (np.array(np.broadcast_to(part, u.shape), dtype=float) for part in found)

        def force_at(k: Any, x: FloatArray) -> FloatArray:
            return np.asarray(self._theory.answer(select(surface, u.shape, k), u.ravel()[k] + x)[0], dtype=float)[None]

        step = 0.01 * np.broadcast_to(np.asarray(surface.h_rms), u.shape).ravel()
        slope, _ = differences(force_at, step, np.zeros(u.size), np.zeros((1, u.size)))
        return TheoryAnswer(pressure, area, -slope[0].reshape(u.shape), np.full(u.shape, np.nan))

    def looks(self, surface: AnySurface) -> int:
        """Few: an answer may take long."""
        return FEW_LOOKS

    def curve(self, surface: AnySurface, quantity: str) -> Curve:
        """Force or area alone."""

        def values(u: FloatArray) -> tuple[Any, Any, bool]:
            found = np.asarray(self._theory.answer(surface, u)[int(quantity == "area")], dtype=float)
            return np.broadcast_to(found, u.shape), np.full(u.shape, np.nan), False

        return values
