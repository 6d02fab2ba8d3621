"""Any theory with a hardness: its elastic answer goes through `mbma_tables.hardness`.

Force at a mean gap is closed between the elastic force and the bearing curve; area is that at equal force, with
pressures capped at the hardness. u is the mean gap, points that yield flattened.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables import hardness as law
from mbma_tables.arguments import FloatArray, describe_entries, finite_array, require
from mbma_tables.errors import ConvergenceError, OutOfRangeError
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.hardness_table import shipped
from mbma_tables.theories.protocol import Theory, TheoryAnswer

TESTED_ETA = 0.025  # p_m/(E* g) down to which boundary elements were solved
STEPS = 200
START = 4.0  # exponent that joins both limits of u
SETTLED = 1e-7  # of ln F, before the last step
MIN_DEPTH = 4 * np.finfo(float).eps  # relative, of separations that rounding leaves distinct
LOWEST = 1e-300
MAX_LEVEL = 37.0  # of heights over h_rms above which shares are no normal numbers


class State(NamedTuple):
    """What yielding adds to force and area; arrays of the broadcast shape."""

    yielded: FloatArray  # share of the contact area
    incremental_stiffness: FloatArray  # -dF/du of the frozen contact over A0 E* [1/length]
    plane_separation: FloatArray  # gap between mean planes [length]


def checked_hardness(hardness: ArrayLike) -> FloatArray:
    """Hardnesses as positive numbers; infinity means that nothing yields."""
    values = np.asarray(hardness)
    infinite = np.isposinf(values) if values.dtype.kind in "fiu" else False
    given = finite_array("hardness", np.where(infinite, 1.0, values) if np.any(infinite) else hardness)
    require("hardness", given, given > 0, "positive, or infinite where nothing yields")
    return np.where(infinite, np.inf, given)


class Yielding(Theory):
    """A theory whose pressures cannot exceed a hardness.

    Parameters
    ----------
    theory : Theory
        The elastic one.
    hardness : array_like
        p_m/E*; broadcasts with surfaces and separations. Where it is infinite, answers are the elastic theory's own.
    """

    def __init__(self, theory: Theory, hardness: ArrayLike) -> None:
        self._elastic, self.hardness = theory, checked_hardness(hardness)
        self.name, self.ends_at_h_max = theory.name, theory.ends_at_h_max

    def departures(self, surface: AnySurface) -> tuple[str, ...]:
        """As of the elastic theory."""
        return self._elastic.departures(surface)

    def scatter_name(self, surface: AnySurface) -> str:
        """The elastic theory's."""
        return self._elastic.scatter_name(surface)

    @property
    def elastic(self) -> Theory:
        """The theory of the elastic contact."""
        return self._elastic

    def at(self, shape: tuple[int, ...], place: Any) -> Theory:
        """With the hardnesses at flat places of a broadcast shape."""
        if self.hardness.ndim == 0:
            return self
        chosen = np.broadcast_to(self.hardness, shape).ravel()[np.asarray(place).astype(np.intp)]
        return Yielding(self.elastic, chosen)

    def _capped(
        self, surface: AnySurface, u: FloatArray, elastic: TheoryAnswer
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Force and loading stiffness over A0 E*, eta and rms gradient."""
        gradient = np.asarray(surface.rms_gradient)
        eta = self.hardness / gradient
        share, slope = self.elastic.bearing_share(surface, u)
        force, by_elastic, by_share = law.force(elastic.force / gradient, share, eta)
        with np.errstate(invalid="ignore", divide="ignore"):
            rate = np.where(elastic.force > 0, by_elastic * elastic.stiffness / elastic.force, 0.0)
            # where the elastic force has no bound it has no weight
            rate = np.where(np.isfinite(elastic.force), rate, 0.0) - by_share * slope
            stiffness = np.where(force > 0, force * gradient * rate, 0.0)
        return force * gradient, stiffness, eta, gradient

    def bends(self, surface: AnySurface) -> FloatArray:
        """Where derivatives of the elastic force jump."""
        return self.elastic.bends(surface)

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and the loading curve's stiffness at mean separations u [length]."""
        u = np.asarray(mean_separation, dtype=float)
        elastic = self.elastic.answer(surface, u)
        if np.isinf(self.hardness).all():
            return elastic
        force, stiffness, eta, gradient = self._capped(surface, u, elastic)
        area = law.area(force / gradient, self._elastic_area(surface, force, elastic), eta)
        # both of the elastic errors, force and area at that force, may add up
        capped = TheoryAnswer(force, area, stiffness, 2 * elastic.error)
        return TheoryAnswer(
            *(np.where(np.isinf(self.hardness), one, other) for one, other in zip(elastic, capped, strict=True))
        )

    def _elastic_area(self, surface: AnySurface, force: FloatArray, elastic: TheoryAnswer) -> FloatArray:
        """A/A0 of the elastic contact at equal force; 0 without force."""
        # where nothing yields or touches, a force that the theory is sure to reach
        needed = (force > 0) & ~np.isinf(self.hardness)
        return np.where(needed, self.elastic.area_at(surface, np.where(needed, force, elastic.force)), 0.0)

    def state(self, surface: AnySurface, mean_separation: FloatArray, answer: TheoryAnswer) -> State:
        """What yielding adds at mean separations u, where `answer` is this theory's."""
        u = np.asarray(mean_separation, dtype=float)
        elastic = self.elastic.answer(surface, u)
        gradient, h_rms = np.asarray(surface.rms_gradient), np.asarray(surface.h_rms)
        eta, force = self.hardness / gradient, answer.force / gradient
        with np.errstate(invalid="ignore"):
            share = law.yielded_area(force, self._elastic_area(surface, answer.force, elastic), eta) / answer.area
            planes = h_rms * law.plane_separation(u / h_rms, force / eta, eta)
            frozen = elastic.stiffness * law.frozen_factor(eta)
        bound = np.isinf(self.hardness)
        return State(
            np.where(bound | (answer.area == 0), 0.0, share),
            np.where(bound, elastic.stiffness, frozen),
            np.where(bound, u, planes),
        )

    def bearing_share(self, surface: AnySurface, mean_separation: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The elastic theory's."""
        return self.elastic.bearing_share(surface, mean_separation)

    def interval(self, surface: AnySurface, quantity: str = "force") -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] between which the elastic force falls, and Gaussian heights end in numbers."""
        low, high = self.elastic.interval(surface, "force")
        return low, np.minimum(high, MAX_LEVEL * np.asarray(surface.h_rms))

    def mean_separation_at(self, surface: AnySurface, quantity: str, wanted: FloatArray) -> FloatArray:
        """Mean separation u [length] at which "force" (over A0 E*) or "area" has a wanted value.

        Raises
        ------
        OutOfRangeError
            For pressures above the hardness, or that the elastic theory does not reach.
        """
        if np.isinf(self.hardness).all():
            return self.elastic.mean_separation_at(surface, quantity, wanted)
        shape = np.broadcast_shapes(np.shape(wanted), surface.shape, self.hardness.shape)
        given = np.broadcast_to(np.asarray(wanted, dtype=float), shape)
        if quantity == "area":
            return super().mean_separation_at(surface, quantity, given)
        cap = np.broadcast_to(self.hardness, shape)
        if (given > cap).any():
            raise OutOfRangeError(
                f"pressure must be at most the hardness, F/(A0 E*) at most {describe_entries(cap, given > cap)}; got "
                f"{describe_entries(given, given > cap)}",
                given > cap,
            )
        return self._separation(surface, given)

    def _separation(self, surface: AnySurface, force: FloatArray) -> FloatArray:
        """Newton's method in a bracket: u lies below the elastic contact's, and the start is close."""
        shape = force.shape
        h_max, h_rms = np.asarray(surface.h_max, float), np.asarray(surface.h_rms, float)
        low, high = (np.broadcast_to(end, shape) for end in self.interval(surface))
        above = np.broadcast_to(self.elastic.mean_separation_at(surface, "force", force), shape)
        free, full = force == 0, force >= self.hardness
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            gap = law.gaussian_gap(np.clip(force / self.hardness, 0.0, 1.0)) * h_rms
            # below either limit alone; where both are equal by about a sixth
            k = START * (1 + self.hardness / np.asarray(surface.rms_gradient))
            near = np.minimum(above, gap)
            u = near * (1 + (near / np.maximum(above, gap)) ** k) ** (-1 / k)
            bottom, top = np.maximum(low, LOWEST), np.array(above)
            u = np.clip(u, bottom, top * (1 - MIN_DEPTH))
            goal = np.log(force)
            done = free | full
            for self.count in range(STEPS):
                elastic = self.elastic.answer(surface, u)
                found, stiffness, _, _ = self._capped(surface, u, elastic)
                miss = np.log(found) - goal
                bottom, top = np.where(miss > 0, u, bottom), np.where(miss > 0, top, u)
                # in ln u - ln(h_max - u): straight at either end of contact
                stretch = u * (h_max - u) / h_max if self.ends_at_h_max else u
                step = miss * found / (stiffness * stretch)
                if self.ends_at_h_max:
                    ratio = u / (h_max - u) * np.exp(np.clip(step, -40.0, 40.0))
                    following = h_max * ratio / (1 + ratio)
                else:
                    following = u * np.exp(np.clip(step, -40.0, 40.0))
                outside = ~((following > bottom) & (following < top))
                middle = np.where(top > 2 * bottom, np.sqrt(bottom * top), (bottom + top) / 2)
                following = np.where(outside, middle, following)
                # the next miss would be the square of this one
                near = np.abs(miss) <= SETTLED
                u, done = np.where(near & ~done & ~outside, following, u), done | near
                done = done | (top - bottom <= MIN_DEPTH * top) | (following == u)
                u = np.where(done, u, following)
                if done.all():
                    break
            else:
                raise ConvergenceError(f"no separation was found for {int((~done).sum())} pressures", ~done)
        return np.where(free, high, np.where(full, low, u))

    def scatter(self, surface: AnySurface, area: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Standard deviations of ln F at given u and of ln A at given F against boundary elements with a hardness."""
        force, contact = self.elastic.scatter(surface, area)
        eta = self.hardness / np.asarray(surface.rms_gradient)
        table = shipped()
        known = [
            table.standard_deviation(self.scatter_name(surface), quantity, eta, area) for quantity in ("force", "area")
        ]
        elastic = eta > table.eta[-1]
        return np.where(elastic, force, known[0]), np.where(elastic, contact, known[1])

    def concerns(self, surface: AnySurface, answer: TheoryAnswer, mean_separation: FloatArray) -> Mapping[str, Any]:
        """The elastic theory's reasons, and hardnesses below those that were simulated."""
        soft = self.hardness / np.asarray(surface.rms_gradient) < TESTED_ETA * (1 - 1e-9)
        return {
            **self.elastic.concerns(surface, answer, mean_separation),
            f"the hardness over E* times the rms gradient is below {TESTED_ETA:g}": np.broadcast_to(
                soft, np.shape(answer.area)
            ),
        }
