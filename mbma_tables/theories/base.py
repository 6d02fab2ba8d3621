"""The interface of theories, with defaults for what has no closed form.

These are the elastic energy, and the gap at a given load or area (`theories.inversion`).
"""

from __future__ import annotations

import abc
import dataclasses
import functools
import reprlib
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import (
    FloatArray,
    describe_entries,
    entries_at,
    require,
    rows,
    spread,
)
from mbma_tables.common.errors import ConvergenceError, InputError, OutOfRangeError
from mbma_tables.common.shared import frozen
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.theories import inversion, tested
from mbma_tables.theories.evidence import shipped_deviations
from mbma_tables.theories.inversion import FEW_LOOKS, LOOKS, Curve, Indices

PACKAGE = "mbma_tables."
UNSAMPLED = (
    "what several scans or the sampling error of traces add to the scatter is known for "
    "theory='calibrated' only"
)
ROUNDING = 4 * float(np.finfo(float).eps)  # relative, of gaps beside the ends of a domain


# the domain of theories that answer at every mean separation, which broadcasts
EVERYWHERE = frozen((np.asarray(0.0), np.asarray(np.inf)))


class TheoryAnswer(NamedTuple):
    """Arrays of the shape that surface and mean separation broadcast to."""

    pressure: FloatArray  # F/(A0 E*)
    area: FloatArray  # A/A0
    stiffness: FloatArray  # -d(F/(A0 E*))/du [1/length]
    # bound on the relative numerical error of force and area, against the theory itself
    error: FloatArray


class Gaps(NamedTuple):
    """Both separations of contacts [length], and what a theory found with them."""

    separation: FloatArray  # d
    mean_separation: FloatArray  # u
    lighter: Any = None  # from `Theory.at_force`, where gaps were found at forces


class Solved(NamedTuple):
    """Contacts at known gaps, and what the theory found beside them."""

    pressure: Any  # in the unit of the modulus
    area: Any
    error: Any
    islands: int | None = None  # number of islands evaluated
    answer: TheoryAnswer | None = None
    loaded: Any = None  # with a hardness, a `theories.yielding.theory.Loaded`
    pressure_slope: Any = None  # derivatives by the separation, of sums over islands
    area_slope: Any = None


class Compression(NamedTuple):
    """Force and area of a theory as functions of the compression h_max - d, for a law."""

    end: float  # largest compression [length]
    # rows of F/(A0 E*) and A/A0 at x, compressions over `end`
    values: Callable[[FloatArray], FloatArray]
    kinks: tuple[float, ...]  # x at which derivatives jump
    layer: float  # x below which `powers` of x lead in force and area
    powers: tuple[float, float]
    error: float  # bound on the relative error of the values
    leverage: float  # error of slopes over F/x per error of values


@runtime_checkable
class UserTheory(Protocol):
    """The minimal interface that `contact` requires of a theory."""

    @property
    def name(self) -> str:
        """Name of the theory in results."""

    def answer(
        self, surface: AnySurface, mean_separation: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """F/(A0 E*) and A/A0 at mean separations u [length] of the surface's broadcast shape."""


def _with_four_fields(answer: Callable[..., Any]) -> Callable[..., TheoryAnswer]:
    """An `answer` of a user's subclass whose results are checked to be those of a `Theory`."""

    @functools.wraps(answer)
    def checked(
        theory: Theory, surface: AnySurface, mean_separation: FloatArray
    ) -> TheoryAnswer:
        fields = answer(theory, surface, mean_separation)
        if not isinstance(fields, tuple | list) or len(fields) != len(
            TheoryAnswer._fields
        ):
            raise InputError(
                f"theory {theory.name!r}, a Theory, must answer a TheoryAnswer of pressure, "
                "area, stiffness and error; one that knows pressure and area alone is no "
                f"subclass of Theory, got {reprlib.repr(fields)}"
            )
        return TheoryAnswer(*fields)

    return checked


class Theory(abc.ABC):
    """A theory, with quantities derived from its forces.

    One with options is a frozen dataclass, whose fields are the options: they make its text,
    its equality and its pickle.
    """

    name: str
    # one line of advice; origin of its numbers, if not a shipped file
    advice = ""
    origin = ""
    # what answers are beyond its table of islands, where it has one: one of `OUTSIDE` of MBMA
    outside = "raise"
    rtol = 1e-8  # relative error that its laws aim at
    least_rtol = 0.0  # relative error below which its laws do not aim without being asked
    looks = LOOKS  # initial gaps of an inversion, for one surface
    looks_of_batch = FEW_LOOKS  # and for each of a batch
    reached = 0.0  # relative amount by which a wanted value may exceed the largest
    bends_in_area = False  # whether at its `bends` only the area is not smooth
    # whether force vanishes at u = h_max; else its Gaussian heights are unbounded
    ends_at_h_max = True
    # whether it goes by the heights of a map, where a surface has them, and not by a spectrum
    takes_heights = False
    # whether flow through its contacts was compared with simulations that yield
    has_yielded_flow = False
    # whether it simulates a map, and can do so anew with a hardness
    presses_anew = False

    def __init_subclass__(cls, **options: Any) -> None:
        """Check what the `answer` of a user's subclass returns, which all else unpacks."""
        super().__init_subclass__(**options)
        if "answer" in vars(cls) and not cls.__module__.startswith(PACKAGE):
            cls.answer = _with_four_fields(cls.answer)  # type: ignore[method-assign]

    @property
    def options(self) -> dict[str, Any]:
        """Its options by name."""
        if not dataclasses.is_dataclass(self):
            return {}
        return {
            field.name: getattr(self, field.name) for field in dataclasses.fields(self)
        }

    @property
    def changed_options(self) -> dict[str, Any]:
        """Those that differ from their defaults."""
        try:
            by_default = type(self)().options
        except TypeError:  # some options have no default
            by_default = {}
        return {
            name: value
            for name, value in self.options.items()
            if name not in by_default or np.any(value != by_default[name])
        }

    def __repr__(self) -> str:
        if not dataclasses.is_dataclass(self):
            return super().__repr__()
        texts = [f"{name}={value!r}" for name, value in self.changed_options.items()]
        return f"{type(self).__name__}({', '.join(texts)})"

    def __getstate__(self) -> dict[str, Any]:
        # without what was computed from the options
        return self.options if dataclasses.is_dataclass(self) else vars(self)

    @property
    def variant_name(self) -> str:
        """Name of its variant of the paper in results, if it has any."""
        return ""

    @property
    def island_model_name(self) -> str:
        """Name of its island model in results, if it has one."""
        return ""

    @abc.abstractmethod
    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Pressure, area and stiffness at mean separations u [length]."""

    def solved(self, surface: AnySurface, gaps: Gaps, modulus: FloatArray) -> Solved:
        """Contacts at known gaps."""
        answer = self.answer(surface, gaps.mean_separation)
        return solved_by(answer, modulus)

    def surface_of(self, surface: AnySurface) -> AnySurface:
        """The surface that its answers are of: the given one, unless it chooses a cut-off."""
        return surface

    def departures(self, surface: AnySurface) -> tuple[str, ...]:
        """Reasons why a measured surface violates the theory's assumptions.

        Or why it differs from the surfaces that were tested.
        """
        found = surface.departures()
        return (*found, UNSAMPLED) if surface.scans else found

    def scatter_name(self, surface: AnySurface) -> str:
        """Name under which its scatter against boundary elements is stored."""
        return self.name

    def by_heights(self, surface: AnySurface) -> bool:
        """Whether it goes by all heights of the surface's map."""
        has_heights = isinstance(surface, MeasuredSurface) and surface.bearing is not None
        return self.takes_heights and has_heights

    @property
    def elastic(self) -> Theory:
        """The theory of the elastic contact, if this one includes yielding."""
        return self

    def at(self, shape: tuple[int, ...], place: Indices) -> Theory:
        """The theory at flat indices of a broadcast shape, if it contains arrays."""
        return self

    def area_at(self, surface: AnySurface, pressure: FloatArray) -> FloatArray:
        """A/A0 at a force over A0 E*."""
        u, _ = self.inverted(surface, "pressure", pressure)
        return self.answer(surface, u).area

    def heights(self, surface: AnySurface) -> Any:
        """End of the Gaussian heights over h_rms, or a map's `BearingCurve`; for a hardness."""
        if not self.ends_at_h_max:
            return np.inf
        return np.asarray(surface.h_max) / np.asarray(surface.h_rms)

    def interval(
        self, surface: AnySurface, quantity: str = "pressure"
    ) -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] between which "pressure" or "area" decreases.

        By default these are full compression and last contact. No contact and no law asks a
        theory for an answer beyond them, unless its `domain` is wider.
        """
        h_max = np.asarray(surface.h_max, dtype=float)
        high = h_max if self.ends_at_h_max else np.full_like(h_max, np.inf)
        return np.zeros_like(h_max), high

    def branch(
        self, surface: AnySurface, quantity: str, wanted: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] between which values on a batch are searched for.

        By default those of `interval`; a theory may give a part that is known to reach
        `wanted` and costs less to find.
        """
        return self.interval(surface, quantity)

    def force_near(self, surface: AnySurface, pressure: FloatArray) -> FloatArray | None:
        """Mean separations [length] at forces over A0 E*, NaN where there are none, if that takes no search."""
        return None

    def looks_near(
        self,
        surface: AnySurface,
        quantity: str,
        wanted: FloatArray,
        first: FloatArray,
        farthest: FloatArray,
    ) -> FloatArray | None:
        """Initial gaps of a search on a batch, from `farthest` to `first`, where it is known near which gaps values are."""
        return None

    def highest(self, surface: AnySurface) -> FloatArray:
        """Mean separation of first contact [length], where contact ends: h_max, of surfaces that did not yield."""
        return np.asarray(surface.h_max, dtype=float)

    def unloads(self, surface: AnySurface, mean_separation: FloatArray) -> Any:
        """Mask of contacts that a larger pressure came before, and yielding with it."""
        return np.zeros(np.shape(mean_separation), bool)

    def domain(self, surface: AnySurface) -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] between which the theory answers.

        By default those of `interval`; bodies farther apart than h_max do not touch where
        contact ends there.
        """
        low, high = self.interval(surface)
        if self.ends_at_h_max:
            high = np.where(high < np.asarray(surface.h_max), high, np.inf)
        return low, high

    def bends(self, surface: AnySurface) -> FloatArray:
        """Mean separations [length], two at most, at which derivatives of force or area jump.

        Rows for a batch.
        """
        return np.empty(0)

    def reasons(
        self, surface: AnySurface, answer: TheoryAnswer, mean_separation: FloatArray
    ) -> Mapping[str, NDArray[np.bool_]]:
        """Reasons why results lie outside the tested range of the theory, each with a mask."""
        by_heights = self.by_heights(surface)
        name = self.scatter_name(surface)
        reasons = tested.untested(surface, answer.area, by_heights, name)
        if self.ends_at_h_max:
            return reasons
        beyond = mean_separation > np.asarray(surface.h_max)
        text = (
            "u is above h_max, where the surface has no contact "
            "but the theory's heights are unbounded"
        )
        return {text: beyond, **reasons}

    def evidence(self, surface: AnySurface) -> str:
        """What valid contacts of such a surface were compared with, in one line."""
        name = self.scatter_name(surface)
        if name not in shipped_deviations().log_rms:
            return f"the scatter that theory {self.name!r} states"
        by_map = self.by_heights(surface)
        return tested.evidence(name, tested.BY_MAP if by_map else tested.BY_SPECTRUM)

    def scatter(self, surface: AnySurface, quantity: str, area: FloatArray) -> FloatArray:
        """Standard deviation of ln of a quantity against simulations, at A/A0 = `area`.

        "pressure" at given u, "area" at given F, "stiffness" -dF/du at given F; with a
        hardness also "unloading_stiffness", that of the frozen contact at given F. Root
        mean squares of ln(theory/simulation), with the simulations in the calibrated law's
        file; NaN if not known, as for surfaces unlike those.
        """
        shape = np.broadcast_shapes(np.shape(area), surface.shape)
        if self.departures(surface):
            return np.full(shape, np.nan)
        deviations = shipped_deviations()
        scatter = deviations.standard_deviation(
            self.scatter_name(surface), quantity, area
        )
        scatter = np.broadcast_to(scatter, shape)
        compared = tested.is_compared(surface, self.scatter_name(surface))
        return np.where(compared, scatter, np.nan)

    def wide_scatter(self, surface: AnySurface, quantity: str) -> FloatArray:
        """The part of its scatter that is of bands wider than those of all comparisons."""
        return np.zeros(surface.shape)

    def law_curves(self, surface: AnySurface, rtol: float) -> Compression | None:
        """Curves for the law of one surface to a relative error; None: it is fitted to answers."""
        return None

    def provenance(self) -> tuple[str, ...]:
        """Lines on the shipped tables that it reads, for the headers of files."""
        return ()

    def reasons_of_flow(self) -> tuple[str, ...]:
        """Reasons why flow through its gaps is not valid, whatever the surface."""
        return ()

    def gaps(self) -> Any:
        """Of a simulated map, the theory that knows the flow through its gaps."""
        return None

    def open_gaps(
        self, surface: AnySurface, mean_separation: FloatArray, area: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Shares of the nominal area and gaps there [length], rising on a last axis.

        Of elastic contacts of these mean separations and areas; by default by `gap_law`.
        """
        from mbma_tables.theories.gap_law import open_gaps

        return open_gaps(mean_separation, area, surface.alpha, surface.h_rms)

    def energy(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        """Elastic energy over A0 E* [length], the integral of F/(A0 E*) from u to last contact."""
        u = np.asarray(mean_separation, dtype=float)
        return self.work_between(surface, u, self.interval(surface)[1])

    def work_between(self, surface: AnySurface, u: FloatArray, end: Any) -> FloatArray:
        """Integral of F/(A0 E*) from mean separations u to `end` [length], zero beyond it."""
        from scipy.integrate import tanhsinh

        shape = u.shape
        last_contact = np.broadcast_to(end, shape)
        first = np.minimum(u, last_contact)
        # from bend to bend, across which no rule converges
        bends = [np.clip(bend, first, last_contact) for bend in self.bends(surface)]
        edges = np.sort([first, *bends, last_contact], axis=0)

        def force(x: FloatArray, place: FloatArray) -> FloatArray:
            """F/(A0 E*) of the entries that the integrator has not finished."""
            theory = self.at(shape, place)
            return theory.answer(select(surface, shape, place), x).pressure

        place = np.arange(float(u.size)).reshape(shape)
        integral = tanhsinh(
            force,
            edges[:-1],
            edges[1:],
            args=(place,),
            rtol=1e-9,
            # error estimates on coarser intervals may be too small by chance
            minlevel=4,
        )
        if not integral.success.all():
            unresolved = ~integral.success.all(axis=0)
            raise unfinished(unresolved, "the elastic energy")
        return np.asarray(integral.integral.sum(axis=0))

    def curve(self, surface: AnySurface, quantity: str) -> Curve:
        """Unchecked force or area by mean separation for inversions.

        Its results are the value, nearly its -d/du or NaN, and whether that is exact.
        """

        def values(u: FloatArray) -> tuple[FloatArray, FloatArray, bool]:
            pressure, area, stiffness, _ = self.answer(surface, u)
            return curve_values(quantity, pressure, area, stiffness)

        return values

    def at_force(
        self, surface: AnySurface, pressure: FloatArray
    ) -> tuple[FloatArray, Any]:
        """Mean separations u at forces over A0 E*, and with them what `solved` can use."""
        return self.mean_separation_at(surface, "pressure", pressure), None

    def mean_separation_at(
        self, surface: AnySurface, quantity: str, wanted: FloatArray
    ) -> FloatArray:
        """Mean separation u [length] at a wanted "pressure" (over A0 E*) or "area".

        At zero it is h_max.

        Raises
        ------
        OutOfRangeError
            If the branch of first contact does not reach it.
        """
        u, missed = self.inverted(surface, quantity, np.asarray(wanted, dtype=float))
        if missed.any():
            raise unfinished(missed, f"the separation at this {quantity}")
        return u

    @np.errstate(all="ignore")
    def inverted(
        self, surface: AnySurface, quantity: str, wanted: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """`mean_separation_at`, and a mask where rounding of u excludes the value."""
        if surface.shape:
            first, last = self.branch(surface, quantity, wanted)
        else:
            first, last = self.interval(surface, quantity)
        end = surface.h_max if self.ends_at_h_max else np.inf
        (goal, ends, low, high), shape = rows(wanted, end, first, last)
        if not self.ends_at_h_max:
            goals = goal.reshape(shape)
            allowed = f"positive: there is no last contact in theory {self.name!r}"
            require(quantity, goals, goals != 0, allowed)

        curve = self.curve(surface, quantity)

        def curve_of(places: Indices) -> Curve:
            theory = self.at(shape, places)
            part = select(surface, shape, places) if surface.shape else surface
            is_whole = theory is self and part is surface
            return curve if is_whole else theory.curve(part, quantity)

        # without a last contact from 12 h_rms on, which 2e-33 of Gaussian heights exceed
        farthest = last if self.ends_at_h_max else np.minimum(last, 12.0 * surface.h_rms)
        looks = None
        if surface.shape:
            looks = self.looks_near(surface, quantity, wanted, first, farthest)
        if looks is None:
            count = self.looks_of_batch if surface.shape else self.looks
            shares = inversion.shares(count).reshape(-1, *[1] * len(shape))
            looks = np.asarray(first + (farthest - first) * shares)
        samples, exact = inversion.sampled(curve, looks, shape)

        # goals beyond the value at the smallest gap, whose answer is that gap or an error
        at_end = goal > samples[1][-1].ravel()
        if at_end.any():
            at_end = self._at_full_compression(
                surface, quantity, first, goal.reshape(shape)
            ).ravel()

        search = inversion.Search(samples, exact, goal, ends, low, high)
        missed = search.run(curve_of, (goal > 0) & ~at_end)
        u = np.where(at_end, low, search.gap)
        u = np.where(goal == 0, high, u)
        return u.reshape(shape), missed.reshape(shape)

    def _at_full_compression(
        self,
        surface: AnySurface,
        quantity: str,
        first: FloatArray,
        wanted: FloatArray,
    ) -> NDArray[np.bool_]:
        """Where a wanted value is the largest that the theory reaches; an error beyond it."""
        full = self.answer(surface, first)
        largest = np.broadcast_to(getattr(full, quantity), wanted.shape)
        beyond = wanted > largest * (1 + self.reached)
        if beyond.any():
            reached = describe_entries(largest, beyond)
            raise OutOfRangeError(
                f"{quantity} must be at most what theory {self.name!r} reaches on this "
                f"surface ({reached}), got {describe_entries(wanted, beyond)}",
                beyond,
            )
        return np.asarray(wanted >= largest)


def solved_by(answer: TheoryAnswer, modulus: FloatArray, loaded: Any = None) -> Solved:
    """Contacts of an answer over E*, in the unit of the modulus."""
    return Solved(
        pressure=(modulus * answer.pressure)[()],
        area=answer.area[()],
        error=spread(answer.error, np.shape(answer.pressure))[()],
        answer=answer,
        loaded=loaded,
    )


def require_domain(
    theory: Theory,
    surface: AnySurface,
    name: str,
    gap: FloatArray,
    mean_separation: FloatArray,
) -> None:
    """Reject gaps beyond the `domain` of a theory; `name` is that of the gaps as given."""
    low, high = theory.domain(surface)
    # ends that are no round numbers are met but for the rounding of a separation
    slack = ROUNDING * np.asarray(surface.h_max)
    above = mean_separation >= low - slack
    below = mean_separation <= high + slack
    if (above & below).all():
        return
    for inside, end, meaning in ((above, low, "at least"), (below, high, "at most")):
        ends = describe_entries(np.broadcast_to(end, np.shape(inside)), ~inside)
        allowed = f"where theory {theory.name!r} is defined, u {meaning} {ends}"
        require(name, gap, inside, allowed)


def curve_values(
    quantity: str, pressure: FloatArray, area: FloatArray, stiffness: FloatArray
) -> tuple[FloatArray, FloatArray, bool]:
    """Results of a `Curve` of "pressure" or "area" from those of a theory."""
    if quantity == "pressure":
        return pressure, stiffness, True
    # area increases nearly as force does
    return area, area * stiffness / pressure, False


def select(surface: AnySurface, shape: tuple[int, ...], place: Indices) -> AnySurface:
    """The surfaces of a batch, broadcast to `shape`, at flat indices."""
    if surface.shape == ():
        return surface
    chosen = np.asarray(place).astype(np.intp)
    numbers = [entries_at(number, shape, chosen) for number in surface.numbers().values()]
    return surface.with_numbers(*numbers).taken_from(surface, shape, chosen)


def unfinished(failed: NDArray[np.bool_], what: str) -> ConvergenceError:
    """The error for entries without a solution."""
    count = int(failed.sum())
    return ConvergenceError(f"{what} was not found for {count} entries", failed)
