"""The interface of theories, and what has no closed form: energy, and the separation at a given load or area."""

from __future__ import annotations

import abc
import importlib
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.common.arguments import FloatArray, describe_entries, require, rows
from mbma_tables.common.errors import ConvergenceError, OutOfRangeError
from mbma_tables.common.shared import shared
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories import tested
from mbma_tables.theories.evidence import shipped_deviations

LOOKS, FEW_LOOKS = (
    128,
    8,
)  # initial gaps of an inversion, for one surface and for each of a batch,
LOOKED_AT, FAR = (
    7.0,
    12.0,
)  # range of ln u - ln(h_max - u) for these, and largest u/h_rms without last contact
STEPS, MISSED = (
    200,
    0.5,
)  # of an inversion; largest miss of ln of a value between two adjacent floats u
# last steps of a logarithm (its error is about the square) and of y; product of the last
# two where slopes are not known
SETTLED, SETTLED_STEP, SETTLED_BOTH = 1e-7, 1e-4, 1e-14
FARTHEST = 40.0  # step of y
INTEGRAL_RTOL = 1e-9
# least level for energies: error estimates on coarse intervals may be too small by chance
LEAST_LEVEL = 4
DISTINCT = 8.9e-16  # smallest relative difference of distinct gaps

# values at mean separations, approximately their -d/du, and whether this is exact
Curve = Callable[[FloatArray], tuple[Any, Any, bool]]


class TheoryAnswer(NamedTuple):
    """Arrays of the shape that surface and mean separation broadcast to."""

    pressure: FloatArray  # F/(A0 E*)
    area: FloatArray  # A/A0
    stiffness: FloatArray  # -d(F/(A0 E*))/du [1/length]
    # bound on the relative numerical error of force and area, against the theory itself
    error: FloatArray


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


class Theory(abc.ABC):
    """A theory, with quantities derived from its forces."""

    name: str
    variant_name = island_model_name = (
        ""  # names of its variant of the paper and its island model in results
    )
    advice = origin = (
        ""  # one line of advice; origin of its numbers, if not a shipped file
    )
    looks = LOOKS  # initial gaps of an inversion, for one surface
    reached = 0.0  # relative amount by which a wanted value may exceed the largest
    bends_in_area = False  # whether at its `bends` only the area is not smooth
    # whether force vanishes at u = h_max; else its Gaussian heights are unbounded
    ends_at_h_max = True

    @abc.abstractmethod
    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Pressure, area and stiffness at mean separations u [length]."""

    def departures(self, surface: AnySurface) -> tuple[str, ...]:
        """Reasons why a measured surface violates the theory's assumptions, or differs from those tested."""
        return surface.departures()

    def scatter_name(self, surface: AnySurface) -> str:
        """Name under which its scatter against boundary elements is stored."""
        return self.name

    @property
    def elastic(self) -> Theory:
        """The theory of the elastic contact, if this one includes yielding."""
        return self

    def with_hardness(self, hardness: ArrayLike, E_star: ArrayLike = 1.0) -> Theory:
        """The theory of bodies whose pressure cannot exceed a hardness.

        Parameters
        ----------
        hardness : array_like
            Largest pressure p_m that the softer body supports, positive, in the unit of
            `E_star`; where it is infinite, nothing yields.
        E_star : array_like
            Effective modulus; if it is 1, the hardness is over E*.

        Returns
        -------
        Theory
            A `Yielding` of this theory, or what a subclass makes that knows more of its contacts.

        Examples
        --------
        >>> import numpy as np
        >>> from mbma_tables import Surface
        >>> from mbma_tables.theories import get_theory
        >>> surface = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0)
        >>> metal = get_theory("calibrated").with_hardness(1500.0, E_star=100e3)
        >>> f"{metal.area_at(surface, np.array(3e-4)):.4f}"
        '0.0210'
        """
        # it needs scipy, which takes long to import, and it imports this module
        yielding = importlib.import_module("mbma_tables.theories.yielding.theory")
        with np.errstate(over="ignore"):  # beyond the largest number nothing yields
            wrapped: Theory = yielding.Yielding(
                self, np.asarray(hardness, dtype=float) / E_star
            )
        return wrapped

    def at(self, shape: tuple[int, ...], place: Any) -> Theory:
        """The theory at flat indices of a broadcast shape, if it contains arrays."""
        return self

    def area_at(self, surface: AnySurface, pressure: FloatArray) -> FloatArray:
        """A/A0 at a force over A0 E*."""
        return self.answer(surface, self.inverted(surface, "pressure", pressure)[0]).area

    def heights(self, surface: AnySurface) -> Any:
        """End of the Gaussian heights over h_rms, or a map's own `BearingCurve`; for a hardness."""
        return (
            np.asarray(surface.h_max) / np.asarray(surface.h_rms)
            if self.ends_at_h_max
            else np.inf
        )

    def interval(
        self, surface: AnySurface, quantity: str = "pressure"
    ) -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] between which "pressure" or "area" decreases: full compression and last contact."""
        high = np.asarray(surface.h_max, dtype=float)
        return np.zeros_like(high), high

    def bends(self, surface: AnySurface) -> FloatArray:
        """Mean separations [length], two at most, at which derivatives of force or area jump; as rows for a batch."""
        return np.empty(0)

    def reasons(
        self, surface: AnySurface, answer: TheoryAnswer, mean_separation: FloatArray
    ) -> Mapping[str, Any]:
        """Reasons why results lie outside the tested range of the theory, each with a mask."""
        reasons = tested.untested(surface, answer.area)
        if self.ends_at_h_max:
            return reasons
        beyond = mean_separation > np.asarray(surface.h_max)
        text = "u is above h_max, where the surface has no contact but the theory's heights are unbounded"
        return {text: beyond, **reasons}

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
        scatter = shipped_deviations().standard_deviation(
            self.scatter_name(surface), quantity, area
        )
        return np.where(
            tested.is_compared(surface), np.broadcast_to(scatter, shape), np.nan
        )

    def gaps(self) -> Any:
        """Of a simulated map, the theory that knows the flow through its gaps."""
        return None

    def energy(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        """Elastic energy over A0 E* [length], the integral of F/(A0 E*) from u to last contact."""
        from scipy.integrate import tanhsinh

        u = np.asarray(mean_separation, dtype=float)
        high = np.broadcast_to(self.interval(surface)[1], u.shape)
        low = np.minimum(u, high)
        # from bend to bend, across which no rule converges
        edges = np.sort(
            [low, *(np.clip(bend, low, high) for bend in self.bends(surface)), high],
            axis=0,
        )

        def force(x: FloatArray, place: FloatArray) -> FloatArray:
            return self.at(u.shape, place).answer(select(surface, u.shape, place), x)[0]

        place = np.arange(float(u.size)).reshape(u.shape)
        found = tanhsinh(
            force,
            edges[:-1],
            edges[1:],
            args=(place,),
            rtol=INTEGRAL_RTOL,
            minlevel=LEAST_LEVEL,
        )
        if not found.success.all():
            raise unfinished(~found.success.all(axis=0), "the elastic energy")
        return np.asarray(found.integral.sum(axis=0))

    def curve(self, surface: AnySurface, quantity: str) -> Curve:
        """Unchecked force or area by mean separation for inversions: value, nearly its -d/du or NaN, whether exact."""

        def values(u: FloatArray) -> tuple[Any, Any, bool]:
            found = self.answer(surface, u)
            if quantity == "pressure":
                return found.pressure, found.stiffness, True
            # area increases nearly as force does
            return found.area, found.area * found.stiffness / found.pressure, False

        return values

    def mean_separation_at(
        self, surface: AnySurface, quantity: str, wanted: FloatArray
    ) -> FloatArray:
        """Mean separation u [length] at which "pressure" (over A0 E*) or "area" has a wanted value; h_max at zero.

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
        """`mean_separation_at` by Newton's method in a bracket, and a mask where rounding of u excludes the value."""
        first, last = self.interval(surface, quantity)
        end = surface.h_max if self.ends_at_h_max else np.inf
        (goal, ends, low, high), shape = rows(wanted, end, first, last)
        if not self.ends_at_h_max:
            allowed = f"positive: there is no last contact in theory {self.name!r}"
            require(quantity, goal.reshape(shape), goal.reshape(shape) != 0, allowed)
        near = last if self.ends_at_h_max else np.minimum(last, FAR * surface.h_rms)
        shares = _shares(FEW_LOOKS if surface.shape else self.looks).reshape(
            -1, *[1] * len(shape)
        )
        looked = np.asarray(first + (near - first) * shares)
        curve = self.curve(surface, quantity)
        value, steep, exact = curve(looked)
        # one column of gaps for all entries, or one for each
        seen = np.empty(
            (
                3,
                *(
                    shares.shape
                    if max(looked.size, np.size(value)) == shares.size
                    else (shares.size, *shape)
                ),
            )
        )
        seen[0], seen[1], seen[2] = looked, value, steep
        search = Search(seen.reshape(3, len(shares), -1), exact, goal, ends, low, high)
        at_end = goal > seen[1][-1].ravel()
        if at_end.any():
            largest = np.broadcast_to(
                getattr(self.answer(surface, first), quantity), shape
            )
            wanted = goal.reshape(shape)
            at_end, out = (
                (wanted >= largest).ravel(),
                wanted > largest * (1 + self.reached),
            )
            if out.any():
                raise OutOfRangeError(
                    f"{quantity} must be at most what theory {self.name!r} reaches on this surface "
                    f"({describe_entries(largest, out)}), got {describe_entries(wanted, out)}",
                    out,
                )
        left = np.flatnonzero((goal > 0) & ~at_end)
        for _ in range(STEPS):
            if not left.size:
                break
            theory, own = self.at(shape, left), select(surface, shape, left)
            value, steep, _ = (
                curve
                if theory is self and own is surface
                else theory.curve(own, quantity)
            )(search.gap[left])
            left = search.step(left, value, steep)
        missed = (
            (np.isnan(search.gap) | (np.abs(search.before[0] - np.log(goal)) > MISSED))
            & (goal > 0)
            & ~at_end
        )
        missed[left] = True
        u = np.where(goal == 0, high, np.where(at_end, low, search.gap))
        return u.reshape(shape), missed.reshape(shape)


@shared()
def _shares(count: int) -> FloatArray:
    """Points from 1 to 0, denser at either end."""
    return np.asarray(1 / (1 + np.exp(np.linspace(-LOOKED_AT, LOOKED_AT, count))))


def select(surface: AnySurface, shape: tuple[int, ...], place: Any) -> AnySurface:
    """The surfaces of a batch, broadcast to `shape`, at flat indices."""
    if surface.shape == ():
        return surface
    chosen = np.asarray(place).astype(np.intp)
    numbers = (
        np.broadcast_to(getattr(surface, name), shape).ravel()[chosen]
        for name in surface.parameters
    )
    return surface.with_numbers(*numbers)


def unfinished(failed: NDArray[np.bool_], what: str) -> ConvergenceError:
    """The error for entries without a solution."""
    return ConvergenceError(
        f"{what} was not found for {int(failed.sum())} entries", failed
    )


def _places(
    u: FloatArray, value: FloatArray, steep: FloatArray, end: FloatArray
) -> FloatArray:
    """Rows of ln value, y, and the derivative of y by that logarithm."""
    return np.array(
        [np.log(value), np.log(u / (rest := 1 - u / end)), -value / (steep * u * rest)]
    )


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
    apart = np.where(
        (high > 2 * low) & (low > 0), np.sqrt(low) * np.sqrt(high), 0.5 * (low + high)
    )
    return np.where(high == np.inf, 2 * low, apart)


class Search:
    """Solutions from values at gaps in order from last contact on; differences are used unless `steep` is exact."""

    def __init__(
        self,
        seen: FloatArray,
        exact: bool,
        wanted: FloatArray,
        end: FloatArray,
        low: FloatArray,
        high: FloatArray,
    ) -> None:
        self.exact, self.wanted, self.end = exact, wanted, end
        # the branch of first contact: the first gap from there at which the value is reached
        reached, count = seen[1] >= wanted, seen.shape[1]
        number = (
            np.where(reached.any(axis=0), reached.argmax(axis=0), count)
            + np.arange(-2, 2)[:, None]
        )
        column = np.arange(wanted.size) if seen.shape[2] == wanted.size else 0
        u, value, steep = seen[:, number.clip(0, count - 1), column]
        inside, goal = (number >= 0) & (number < count), np.log(wanted)
        self.low, self.high = (
            np.where(inside[2], u[2], low),
            np.where(inside[1], u[1], high),
        )
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
        self.gap = np.where(
            (gap > self.low) & (gap < self.high), gap, _middle(self.low, self.high)
        )

    def step(
        self, left: NDArray[np.intp], value: FloatArray, steep: FloatArray
    ) -> NDArray[np.intp]:
        """A step of the gaps with indices `left`, by the cubic through their values and the previous ones."""
        u, end, miss = self.gap[left], self.end[left], np.log(value / self.wanted[left])
        here = x, y, rate = _places(u, value, steep, end)
        x0, y0, rate0 = self.before[:, left]
        low, high = (
            np.where(miss > 0, u, self.low[left]),
            np.where(miss > 0, self.high[left], u),
        )
        apart, straight = x - x0, -miss * rate
        mean = (y - y0) / apart
        # slopes that are not exact are scaled to the straight line through both
        scale = 1.0 if self.exact else 2 * mean / (rate + rate0)
        second = (scale * rate - mean) / apart
        third = (second - (mean - scale * rate0) / apart) / apart
        curved, by_both = (
            miss * miss * (third * (apart - miss) + second),
            -miss * scale * rate,
        )
        other = np.where(mean < 0, -mean * miss, straight)
        cubic = np.where(np.abs(curved) <= 0.5 * np.abs(by_both), by_both + curved, other)
        step = np.where(np.isfinite(apart) & (apart != 0), cubic, straight)
        following = u * np.exp(np.minimum(np.maximum(step, -FARTHEST), FARTHEST))
        following = following / (1 + (following - u) / end)
        near = (np.abs(miss) <= SETTLED) & (np.abs(step) <= SETTLED_STEP)
        if not self.exact:
            near &= np.abs(miss * apart) <= SETTLED_BOTH
        held = np.where(
            (following > low) & (following < high), following, _middle(low, high)
        )
        gap = np.where(near, np.minimum(np.maximum(following, low), high), held)
        gap[np.isnan(miss) | ~(u > 0)] = np.nan
        self.gap[left], self.low[left], self.high[left], self.before[:, left] = (
            gap,
            low,
            high,
            here,
        )
        return np.asarray(
            left[~(near | (high - low <= DISTINCT * high) | (gap == u) | np.isnan(gap))]
        )
