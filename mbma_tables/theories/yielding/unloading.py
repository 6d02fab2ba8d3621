"""A yielded contact below the largest pressure that it was under: unloading and reloading; docs/unloading.md.

p0 is the largest pressure, s = p/p0, K the stiffness at constant contact area, that of
unloading, and K0, A0, u0 are those at p0. Unloading is elastic, of a surface whose yielded
points stay flat. Its compliance is the mean of that of the same surface without yielding,
K_e(p), and of flattened spots, by a weight w that grows with the share y of the area at p0
that yielded: ::

    K0/K    = (1 - w) K_e(p0)/K_e(p) + w/[1 - (1-s)^a]^b
    A/A0    = [A_e(p)/A_e(p0)]^(1-v) [1 - (1-s)^c]^(v d)
    u - u0  = (1 - w) [u_e(p) - u_e(p0)] K_e(p0)/K0 + w (p0/K0) int_s^1 [1 - (1-t)^a]^-b dt

Without yielding w is 0, and the contact goes back the way it came.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize.elementwise import find_root
from scipy.special import beta, betainc

from mbma_tables.common.arguments import FloatArray, require
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.base import Gaps, Solved, Theory, TheoryAnswer, select, solved_by
from mbma_tables.theories.yielding.theory import Yielding

# pressure over the rms gradient that stands for a largest one that is not needed
ANY_PRESSURE = 1e-3


@dataclasses.dataclass(frozen=True)
class Constants:
    """The law's constants, fitted to boundary elements by `python -m generate unloading --fit`."""

    weight: float = 1.2  # power of y in w
    power: float = 1.75  # a and b of flattened spots,
    exponent: float = 0.8
    area_weight: float = 0.6  # power of y in v
    area_power: float = 2.2  # c and d of flattened spots
    area_exponent: float = 0.77


CONSTANTS = Constants()


def flattened(s: FloatArray, power: float, exponent: float) -> FloatArray:
    """[1 - (1-s)^a]^b, a stiffness or an area of flattened spots over that at s = 1."""
    return np.asarray((1 - (1 - s) ** power) ** exponent)


def lift(s: FloatArray, power: float, exponent: float) -> FloatArray:
    """Integral of 1/`flattened` from s to 1."""
    return _moment(s, power, exponent, 1)


def energy(s: FloatArray, power: float, exponent: float) -> FloatArray:
    """Integral of t/`flattened` over t from 0 to s."""
    parts = [_moment(end, power, exponent, order) for order in (1, 2) for end in (0.0, s)]
    return np.asarray(parts[0] - parts[1] - parts[2] + parts[3])


def _moment(s: ArrayLike, power: float, exponent: float, order: int) -> FloatArray:
    """Integral of (1-t)^(order - 1)/`flattened` over t from s to 1."""
    first = order / power
    whole = beta(first, 1 - exponent) / power
    return np.asarray(whole * betainc(first, 1 - exponent, (1 - np.asarray(s)) ** power))


class Peak(NamedTuple):
    """The contact under its largest pressure; forces over A0 E*, lengths of the surface."""

    pressure: FloatArray
    mean_separation: FloatArray
    area: FloatArray
    stiffness: FloatArray  # at constant contact area
    yielded: FloatArray  # share of the area
    flattening: FloatArray  # u less the gap of the mean planes
    # of the elastic contact at the same pressure
    elastic: TheoryAnswer
    elastic_separation: FloatArray

    @property
    def remembered(self) -> Any:
        """Mask of entries that yielded."""
        return np.isfinite(self.mean_separation)

    @property
    def weight(self) -> FloatArray:
        return np.asarray(self.yielded**CONSTANTS.weight)

    @property
    def area_weight(self) -> FloatArray:
        return np.asarray(self.yielded**CONSTANTS.area_weight)

    def separation(self, elastic_separation: FloatArray, s: FloatArray) -> FloatArray:
        """Mean separation where that of the elastic contact at the same pressure is known."""
        c = CONSTANTS
        moved = elastic_separation - self.elastic_separation
        spots = lift(s, c.power, c.exponent) * self.pressure
        compliance = (1 - self.weight) * moved * self.elastic.stiffness
        return np.asarray(
            self.mean_separation + (compliance + self.weight * spots) / self.stiffness
        )


class Unloaded(NamedTuple):
    """Contacts below their largest pressure, as `theories.yielding.theory.Loaded` has those of loading."""

    answer: TheoryAnswer
    yielded: FloatArray
    unloading_stiffness: FloatArray
    plane_separation: FloatArray


class Unloading(Theory):
    """A theory with a hardness after a largest pressure; heavier contacts are those of first loading.

    Parameters
    ----------
    loading : Yielding
        The theory of first loading.
    largest : array_like
        The largest pressure over E*; 0 where there was none.
    """

    elastic: Any = None

    def __init__(self, loading: Yielding, largest: ArrayLike) -> None:
        self.loading = loading
        self.largest = np.asarray(largest, dtype=float)
        self.elastic, self.hardness = loading.elastic, loading.hardness
        self.name, self.ends_at_h_max = loading.name, loading.ends_at_h_max
        self._bound: tuple[Any, Any] = None, None

    def at(self, shape: tuple[int, ...], place: Any) -> Theory:
        chosen = np.asarray(place).astype(np.intp)
        largest = self.largest
        if largest.ndim:
            largest = np.broadcast_to(largest, shape).ravel()[chosen]
        loading: Any = self.loading.at(shape, place)
        return type(self)(loading, largest)

    def provenance(self) -> tuple[str, ...]:
        return self.loading.provenance()

    def reasons_of_flow(self) -> tuple[str, ...]:
        return self.loading.reasons_of_flow()

    def gaps(self) -> Any:
        return self.loading.gaps()

    @property
    def _loaded_before(self) -> Any:
        """Mask of entries with a pressure before and a hardness."""
        return (self.largest > 0) & np.isfinite(self.hardness)

    def peak(self, surface: AnySurface) -> Peak:
        """The contact under the largest pressure, calculated once for a surface.

        Its mean separation is infinite where nothing yielded: all contacts are then those of
        first loading.
        """
        if self._bound[0] is not surface:
            self._bound = surface, self._peak(surface)
        found: Peak = self._bound[1]
        return found

    def _peak(self, surface: AnySurface) -> Peak:
        loading = self.loading
        over = self.largest > self.hardness
        if over.any():
            raise OutOfRangeError("the largest pressure must be at most the hardness", over)
        gradient = np.asarray(surface.rms_gradient)
        small = np.minimum(ANY_PRESSURE * gradient, ANY_PRESSURE * self.hardness)
        pressure = np.where(self._loaded_before, self.largest, small)
        u, lighter = loading.at_force(surface, pressure)
        loaded = loading.loaded(surface, u, lighter)
        v = self.elastic.mean_separation_at(surface, "pressure", pressure)
        yielded = np.where(self._loaded_before, loaded.yielded, 0.0)
        return Peak(
            pressure,
            np.where(yielded > 0, u, np.inf),
            loaded.answer.area,
            loaded.unloading_stiffness,
            yielded,
            u - loaded.plane_separation,
            self.elastic.answer(surface, v),
            v,
        )

    def _ends(self, surface: AnySurface) -> tuple[FloatArray, FloatArray]:
        """Mean separations of the elastic contact and of this one, where contact ends."""
        peak = self.peak(surface)
        last = self.loading.interval(surface)[1]
        force = self.elastic.answer(surface, last).pressure
        return last, peak.separation(last, np.minimum(force / peak.pressure, 1.0))

    def highest(self, surface: AnySurface) -> FloatArray:
        """Mean separation of first contact with the residual shape [length]."""
        if not self.ends_at_h_max:
            return super().highest(surface)
        own = self._ends(surface)[1]
        return np.where(self.peak(surface).remembered, own, super().highest(surface))

    def interval(
        self, surface: AnySurface, quantity: str = "pressure"
    ) -> tuple[FloatArray, FloatArray]:
        low, high = self.loading.interval(surface, quantity)
        remembered = self.peak(surface).remembered
        return low, np.where(remembered, self._ends(surface)[1], high)

    def domain(self, surface: AnySurface) -> tuple[FloatArray, FloatArray]:
        low, high = self.loading.domain(surface)
        return low, high if self.ends_at_h_max else self.interval(surface)[1]

    def bends(self, surface: AnySurface) -> FloatArray:
        """Mean separations at which the branches meet, and where the elastic theory bends."""
        peak = self.peak(surface)
        at_loading = np.asarray(self.loading.bends(surface))
        elastic = np.asarray(self.elastic.bends(surface))
        if surface.shape or not peak.remembered.all():
            return at_loading
        met = peak.mean_separation[None]
        on_branch = elastic[elastic > peak.elastic_separation]
        s = self.elastic.answer(surface, on_branch).pressure / peak.pressure
        return np.concatenate(
            [
                at_loading[at_loading < peak.mean_separation],
                np.asarray(met),
                peak.separation(on_branch, s),
            ]
        )

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        answer: TheoryAnswer = self.loaded(surface, mean_separation).answer
        return answer

    def solved(self, surface: AnySurface, gaps: Gaps, modulus: FloatArray) -> Solved:
        loaded = self.loaded(surface, gaps.mean_separation, gaps.lighter)
        return solved_by(loaded.answer, modulus, loaded)

    def loaded(
        self, surface: AnySurface, mean_separation: FloatArray, lighter: Any = None
    ) -> Unloaded:
        """Contacts at mean separations u [length]; `lighter` are those of the elastic contact at the same forces."""
        u = np.asarray(mean_separation, dtype=float)
        peak = self.peak(surface)
        below = u >= peak.mean_separation
        deepest = np.minimum(u, peak.mean_separation)
        first = self.loading.loaded(surface, deepest)
        v = self._elastic_separation(surface, u) if lighter is None else lighter
        branch = self._branch(surface, peak, np.maximum(v, peak.elastic_separation), u)
        fields = [
            np.where(below, one, other)
            for one, other in zip(branch.answer, first.answer, strict=True)
        ]
        return Unloaded(
            TheoryAnswer(*fields),
            *(
                np.where(below, getattr(branch, name), getattr(first, name))
                for name in Unloaded._fields[1:]
            ),
        )

    @np.errstate(divide="ignore", invalid="ignore")
    def _branch(
        self, surface: AnySurface, peak: Peak, v: FloatArray, u: FloatArray
    ) -> Unloaded:
        """Contacts of the branch, by mean separations v of the elastic contact at the same forces."""
        c = CONSTANTS
        elastic = self.elastic.answer(surface, v)
        s = np.minimum(elastic.pressure / peak.pressure, 1.0)
        compliance = (1 - peak.weight) * peak.elastic.stiffness / elastic.stiffness
        compliance = compliance + peak.weight / flattened(s, c.power, c.exponent)
        stiffness = np.where(s > 0, peak.stiffness / compliance, 0.0)
        spots = flattened(s, c.area_power, c.area_exponent)
        shrunk = elastic.area / peak.elastic.area
        area = peak.area * shrunk ** (1 - peak.area_weight) * spots**peak.area_weight
        error = 2 * elastic.error
        answer = TheoryAnswer(s * peak.pressure, np.where(s > 0, area, 0.0), stiffness, error)
        yielded = np.where(s > 0, peak.yielded, 0.0)
        return Unloaded(answer, yielded, stiffness, u - peak.flattening)

    def _elastic_separation(self, surface: AnySurface, u: FloatArray) -> FloatArray:
        """Mean separations of the elastic contact at the forces of contacts at u."""
        peak = self.peak(surface)
        last, own_last = self._ends(surface)
        shape = np.broadcast_shapes(u.shape, np.shape(last), np.shape(own_last))
        first = np.broadcast_to(peak.elastic_separation, shape)
        wanted = np.clip(u, peak.mean_separation, own_last)
        wanted = np.broadcast_to(np.where(peak.remembered, wanted, -np.inf), shape)

        def missed(v: FloatArray, place: FloatArray) -> FloatArray:
            part: Any = self.at(shape, place)
            own = select(surface, shape, place)
            whole = own is surface and part.largest.ndim == 0
            peak_of_part = peak if whole else part.peak(own)
            force = part.elastic.answer(own, v).pressure
            s = np.minimum(force / peak_of_part.pressure, 1.0)
            goal = wanted.ravel()[place.astype(np.intp)]
            return np.asarray(peak_of_part.separation(v, s) - goal)

        place = np.arange(float(wanted.size)).reshape(shape)
        inside = np.isfinite(wanted) & (wanted > peak.mean_separation) & (wanted < own_last)
        bracket = first, np.broadcast_to(np.where(inside, last, first), shape)
        found = find_root(missed, bracket, args=(place,)).x
        ends = np.where(wanted >= own_last, last, first)
        return np.where(inside, found, ends)

    def at_force(self, surface: AnySurface, pressure: FloatArray) -> tuple[FloatArray, Any]:
        """Mean separations u at forces over A0 E*, and those of the elastic contact."""
        peak = self.peak(surface)
        heavy = (pressure >= peak.pressure) | ~peak.remembered
        v = self.elastic.mean_separation_at(surface, "pressure", pressure)
        s = np.minimum(pressure / peak.pressure, 1.0)
        u = peak.separation(v, s)
        if heavy.any():
            at_least = np.where(heavy, pressure, peak.pressure)
            u = np.where(heavy, self.loading.at_force(surface, at_least)[0], u)
        return u, v

    def mean_separation_at(
        self, surface: AnySurface, quantity: str, wanted: FloatArray
    ) -> FloatArray:
        if quantity == "pressure":
            return self.at_force(surface, np.asarray(wanted, dtype=float))[0]
        return super().mean_separation_at(surface, quantity, wanted)

    def inverted(
        self, surface: AnySurface, quantity: str, wanted: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        if quantity == "pressure":
            u = self.at_force(surface, wanted)[0]
            return u, np.zeros(u.shape, bool)
        return super().inverted(surface, quantity, wanted)

    def energy(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        """Energy over A0 E* [length] that unloading gives back, at most that at the largest pressure."""
        c = CONSTANTS
        u = np.asarray(mean_separation, dtype=float)
        peak = self.peak(surface)
        require(
            "mean_separation",
            u,
            np.broadcast_to(u >= peak.mean_separation * (1 - 1e-9), u.shape),
            "at least that under the largest pressure, above which the contact yields",
        )
        v = np.maximum(self._elastic_separation(surface, u), peak.elastic_separation)
        s = np.minimum(self.elastic.answer(surface, v).pressure / peak.pressure, 1.0)
        spots = peak.pressure**2 * energy(s, c.power, c.exponent)
        elastic = self.elastic.energy(surface, v) * peak.elastic.stiffness
        return ((1 - peak.weight) * elastic + peak.weight * spots) / peak.stiffness
