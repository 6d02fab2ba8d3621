"""A yielded contact below the largest pressure that it was under: unloading and reloading; docs/yield.md.

p0 is the largest pressure, s = p/p0, K the stiffness at constant contact area, that of
unloading, and K0, A0, u0 are those at p0. Unloading is elastic, of a surface whose yielded
points stay flat. Its compliance is the mean of that of the same surface without yielding,
K_e(p), and of flattened spots, by a weight w that grows with the share y of the area at p0
that yielded: ::

    K0/K    = (1 - w) K_e(p0)/K_e(p) + w/[1 - (1-s)^a]^b
    A/A0    = [A_e(p)/A_e(p0)]^(1-v) [1 - (1-s)^c]^(v d)
    u - u0  = (1 - w) [u_e(p) - u_e(p0)] K_e(p0)/K0 + w (p0/K0) int_s^1 [1 - (1-t)^a]^-b dt

Without yielding w is 0, and the contact goes back the way it came. The formulas are the core's,
`yielding.c`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize.elementwise import find_root

from mbma_tables.common.arguments import (
    FloatArray,
    answered,
    entries_at,
    require,
    rows,
)
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.core import core
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories import inversion
from mbma_tables.theories.base import (
    Gaps,
    Solved,
    Theory,
    TheoryAnswer,
    select,
    solved_by,
    unfinished,
)
from mbma_tables.theories.inversion import Curve, Indices
from mbma_tables.theories.yielding.theory import Yielding, elastic_scatter

# pressure over the largest, below which force is a power of the distance to last contact:
# the elastic contact at such forces is within rounding of its last contact
LEAST = 1e-10
# pressure over the rms gradient that stands for a largest one that is not needed
ANY_PRESSURE = 1e-3


# standard deviations of ln(law/boundary elements) on groups of surfaces that the fit left out,
# of ratios to those at p0: by pressures over p0, and by shares of the area that yielded
FRACTIONS = (0.01, 0.03, 0.1, 0.2, 0.3, 0.5, 0.75, 0.9, 1.0)
SHARES = (0.2, 0.65, 0.97)
SCATTER: dict[str, tuple[tuple[float, ...], ...]] = {
    "stiffness": (
        (0.274, 0.201, 0.093, 0.054, 0.047, 0.053, 0.039, 0.020, 0.000),
        (0.242, 0.215, 0.170, 0.109, 0.086, 0.066, 0.043, 0.020, 0.000),
        (0.336, 0.274, 0.188, 0.139, 0.113, 0.063, 0.039, 0.013, 0.000),
    ),
    "area": (
        (0.189, 0.161, 0.076, 0.044, 0.044, 0.051, 0.031, 0.016, 0.000),
        (0.169, 0.125, 0.096, 0.079, 0.054, 0.041, 0.049, 0.025, 0.000),
        (0.149, 0.115, 0.075, 0.058, 0.049, 0.034, 0.019, 0.014, 0.000),
    ),
    "lift": (
        (0.073, 0.046, 0.031, 0.033, 0.035, 0.035, 0.034, 0.034, 0.034),
        (0.070, 0.073, 0.061, 0.051, 0.046, 0.038, 0.028, 0.017, 0.017),
        (0.123, 0.101, 0.076, 0.055, 0.044, 0.033, 0.017, 0.007, 0.007),
    ),
    # over p0^2/K0
    "energy": (
        (0.301, 0.240, 0.134, 0.085, 0.060, 0.041, 0.033, 0.030, 0.030),
        (0.282, 0.237, 0.181, 0.141, 0.114, 0.085, 0.063, 0.053, 0.053),
        (0.397, 0.313, 0.235, 0.180, 0.152, 0.115, 0.077, 0.060, 0.060),
    ),
}
SOFTEST = (
    0.033  # hardness over E* times the rms gradient, of the softest that was unloaded
)
ROUNDING = 1e-9


def ratio_scatter(quantity: str, s: FloatArray, yielded: FloatArray) -> FloatArray:
    """Standard deviation of ln of "stiffness", "area", "lift" or "energy", in numbers of the largest pressure."""
    log_s = np.log(np.clip(s, FRACTIONS[0], 1.0))
    rows = [np.interp(log_s, np.log(FRACTIONS), row) for row in SCATTER[quantity]]
    place = np.interp(yielded, SHARES, range(len(SHARES)))
    below = np.clip(place.astype(int), 0, len(SHARES) - 2)
    stacked = np.stack(np.broadcast_arrays(*rows))
    shape = np.broadcast_shapes(stacked.shape[1:], below.shape)
    stacked = np.broadcast_to(stacked, (len(SHARES), *shape))
    index = np.broadcast_to(below, shape)[None]
    low, high = (np.take_along_axis(stacked, index + k, 0)[0] for k in (0, 1))
    return np.asarray(low + (high - low) * (place - below))


class Spots(NamedTuple):
    """Weight of flattened spots, and a and b of [1 - (1-s)^a]^b, as they depend on a contact.

    With y the share of the area that yielded and l = ln(A0/AREA), the contact area at p0
    within `AREAS`: ::

        w = y^weight
        a = 1 + exp(power + power_elastic (1-y) + power_area l)
        b = 1/(1 + exp(-(exponent + exponent_elastic (1-y) + exponent_area l)))
    """

    weight: float
    power: float
    power_elastic: float
    power_area: float
    exponent: float
    exponent_elastic: float
    exponent_area: float

    def of(
        self, yielded: FloatArray, area: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """w, a and b."""
        found = answered(core.flat_spots, (yielded, area), 3, self.numbers())
        return found[0], found[1], found[2]

    def numbers(self) -> FloatArray:
        """The constants as the core takes them, `mbma_spots_law` of mbma.h."""
        return np.array([*self, AREA, *AREAS])


AREA = 0.05
AREAS = (0.003, 0.5)
# fitted to boundary elements by `python -m generate unloading --fit`
STIFFNESS = Spots(1.127, -0.354, -3.242, -0.159, 1.374, -2.662, 0.163)
CONTACT = Spots(1.043, 0.328, -1.338, -0.024, 1.440, -2.508, -0.144)


def stiffness_ratio(s: ArrayLike, elastic: ArrayLike, *spots: ArrayLike) -> FloatArray:
    """K/K0 by that of the elastic contact, K_e(p)/K_e(p0), and w, a and b."""
    return answered(core.unloaded_stiffnesses, (s, elastic, *spots))[0]


def area_ratio(s: ArrayLike, elastic: ArrayLike, *spots: ArrayLike) -> FloatArray:
    """A/A0 by that of the elastic contact, A_e(p)/A_e(p0), and v, c and d."""
    return answered(core.unloaded_areas, (s, elastic, *spots))[0]


def raised(
    s: ArrayLike, elastic: ArrayLike, depth: ArrayLike, *spots: ArrayLike
) -> FloatArray:
    """u - u0 by the elastic [u_e(p) - u_e(p0)] K_e(p0)/K0, the depth p0/K0, and w, a and b."""
    return answered(core.unloaded_gaps, (s, elastic, depth, *spots))[0]


def energy(s: ArrayLike, power: ArrayLike, exponent: ArrayLike) -> FloatArray:
    """Energy that unloading of flattened spots gives back over p0^2/K0: of t [1 - (1-t)^a]^-b the integral from 0 to s."""
    return answered(core.flat_energies, (s, power, exponent))[0]


class Peak(NamedTuple):
    """The contact under its largest pressure; forces over A0 E*, lengths of the surface."""

    pressure: FloatArray
    mean_separation: FloatArray
    loading: TheoryAnswer
    stiffness: FloatArray  # at constant contact area
    yielded: FloatArray  # share of the area
    flattening: FloatArray  # u less the gap of the mean planes
    remembered: Any  # mask of entries that yielded; others are those of first loading
    # w, a and b of the stiffness and of the area
    spots: tuple[FloatArray, FloatArray, FloatArray]
    area_spots: tuple[FloatArray, FloatArray, FloatArray]
    # of the elastic contact at the same pressure
    elastic: TheoryAnswer
    elastic_separation: FloatArray

    @property
    def area(self) -> FloatArray:
        """A/A0."""
        return self.loading.area

    def at(self, shape: tuple[int, ...], place: Any) -> Peak:
        """The entries at flat indices of a broadcast shape."""
        if np.size(self.mean_separation) == 1:
            return self

        def chosen(value: Any) -> Any:
            if isinstance(value, tuple):
                parts = [chosen(part) for part in value]
                return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
            return entries_at(value, shape, place)

        return Peak(*map(chosen, self))

    def separation(self, elastic_separation: FloatArray, s: FloatArray) -> FloatArray:
        """Mean separation where that of the elastic contact at the same pressure is known."""
        moved = elastic_separation - self.elastic_separation
        elastic = moved * (self.elastic.stiffness / self.stiffness)
        depth = self.pressure / self.stiffness
        return np.asarray(self.mean_separation + raised(s, elastic, depth, *self.spots))

    def distances(self, last: FloatArray, elastic: Curve) -> Curve:
        """Distance from the branch to last contact at `last`, by the elastic separation, of whose force the curve is."""

        def values(v: FloatArray) -> tuple[FloatArray, FloatArray, bool]:
            force, steepness, exact = elastic(v)
            s = np.minimum(force / self.pressure, 1.0)
            # both separations move by the same force
            ratio = stiffness_ratio(s, steepness / self.elastic.stiffness, *self.spots)
            rate = steepness / (self.stiffness * ratio)
            return last - self.separation(v, s), rate, exact

        return values


class Tail(NamedTuple):
    """The lightest contacts, of which force and area are one power of the distance to last contact."""

    first: FloatArray  # mean separation where they begin,
    elastic_separation: FloatArray  # that of the elastic contact at the same force,
    last: FloatArray  # and where contact ends,
    elastic_last: FloatArray  # that of the elastic contact
    pressure: FloatArray  # over A0 E*, at `first`
    area: FloatArray
    power: FloatArray

    def left(self, mean_separation: FloatArray) -> FloatArray:
        """Share of the distance from `first` to last contact that is left."""
        distance = self.last - self.first
        share = (self.last - mean_separation) / np.where(distance > 0, distance, 1.0)
        return np.asarray(np.clip(share, 0.0, 1.0))


class YieldedContacts(NamedTuple):
    """Contacts that yielded: the numbers that `theories.yielding.theory.Loaded` derives by the law."""

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

    # near the largest pressure the branch is no polynomial: 1 - K/K0 goes as (1-s)^a
    least_rtol = 1e-4
    elastic: Any = None

    def __init__(self, loading: Yielding, largest: ArrayLike) -> None:
        self.loading = loading
        self.largest = np.asarray(largest, dtype=float)
        self.elastic, self.hardness = loading.elastic, loading.hardness
        self.name, self.ends_at_h_max = loading.name, loading.ends_at_h_max
        # of the elastic contact that the branch is made from
        self.branch_theory: Theory = loading.elastic
        self._bound: tuple[Any, Any, Any] = None, None, None

    def at(self, shape: tuple[int, ...], place: Any) -> Theory:
        loading: Any = self.loading.at(shape, place)
        if self.largest.ndim == 0:
            return self if loading is self.loading else type(self)(loading, self.largest)
        chosen = np.broadcast_to(self.largest, shape).ravel()
        return type(self)(loading, chosen[np.asarray(place).astype(np.intp)])

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
        """The contact under the largest pressure, calculated once for a surface."""
        found: Peak = self._curve(surface)[0]
        return found

    def tail(self, surface: AnySurface) -> Tail:
        """The lightest contacts, calculated once for a surface."""
        found: Tail = self._curve(surface)[1]
        return found

    def _curve(self, surface: AnySurface) -> tuple[Peak, Tail]:
        # one assignment, as threads share a contact
        bound = self._bound
        if bound[0] is not surface:
            peak = self._peak(surface)
            self._bound = bound = surface, peak, self._tail(surface, peak)
        return bound[1], bound[2]

    def weights(self, yielded: FloatArray, area: FloatArray) -> tuple[Any, Any]:
        """w, a and b of the stiffness and of the area."""
        return STIFFNESS.of(yielded, area), CONTACT.of(yielded, area)

    def _peak(self, surface: AnySurface) -> Peak:
        loading = self.loading
        over = self.largest > self.hardness
        if over.any():
            raise OutOfRangeError(
                "the largest pressure must be at most the hardness", over
            )
        gradient = np.asarray(surface.rms_gradient)
        small = np.minimum(ANY_PRESSURE * gradient, ANY_PRESSURE * self.hardness)
        pressure = np.where(self._loaded_before, self.largest, small)
        u, lighter = loading.at_force(surface, pressure)
        loaded = loading.loaded(surface, u, lighter)
        v = self.branch_theory.mean_separation_at(surface, "pressure", pressure)
        yielded = np.where(self._loaded_before, loaded.yielded, 0.0)
        return Peak(
            pressure,
            u,
            loaded.answer,
            loaded.unloading_stiffness,
            yielded,
            u - loaded.plane_separation,
            yielded > 0,
            *self.weights(yielded, loaded.answer.area),
            self.branch_theory.answer(surface, v),
            v,
        )

    def _tail(self, surface: AnySurface, peak: Peak) -> Tail:
        elastic = self.branch_theory
        pressure = LEAST * peak.pressure
        v = elastic.mean_separation_at(surface, "pressure", pressure)
        first = peak.separation(v, np.asarray(LEAST))
        last, end = first, v
        if self.ends_at_h_max:
            end = np.broadcast_to(elastic.highest(surface), np.shape(v))
            last = peak.separation(end, np.asarray(0.0))
        branch = self._branch(surface, peak, v, first).answer
        power = np.where(last > first, branch.stiffness * (last - first) / pressure, 1.0)
        return Tail(first, v, last, end, branch.pressure, branch.area, power)

    def highest(self, surface: AnySurface) -> FloatArray:
        """Mean separation of first contact with the residual shape [length]."""
        if not self.ends_at_h_max:
            return super().highest(surface)
        last = self.tail(surface).last
        return np.where(self.peak(surface).remembered, last, super().highest(surface))

    def interval(
        self, surface: AnySurface, quantity: str = "pressure"
    ) -> tuple[FloatArray, FloatArray]:
        low, high = self.loading.interval(surface, quantity)
        remembered = self.peak(surface).remembered
        return low, np.where(remembered, self.tail(surface).last, high)

    def domain(self, surface: AnySurface) -> tuple[FloatArray, FloatArray]:
        low, high = self.loading.domain(surface)
        return low, high if self.ends_at_h_max else self.interval(surface)[1]

    def unloads(self, surface: AnySurface, mean_separation: FloatArray) -> Any:
        peak = self.peak(surface)
        return peak.remembered & (mean_separation > peak.mean_separation * (1 + ROUNDING))

    def bends(self, surface: AnySurface) -> FloatArray:
        """Mean separation at which the branches meet, and that of one bend more, if there is any."""
        peak, tail = self._curve(surface)
        bends = np.asarray(self.loading.bends(surface))
        if surface.shape or not peak.remembered.all():
            return bends
        met = np.reshape(peak.mean_separation, 1)
        bends = bends[bends < met]
        elastic = np.asarray(self.branch_theory.bends(surface))
        elastic = elastic[elastic > peak.elastic_separation]
        if elastic.size:
            s = self.branch_theory.answer(surface, elastic).pressure / peak.pressure
            bends = np.concatenate([bends, peak.separation(elastic, s)])
        if self.ends_at_h_max:
            bends = np.concatenate([bends, np.reshape(tail.first, 1)])
        # laws have two bends at most
        return np.concatenate([met, bends[:1]])

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        answer: TheoryAnswer = self.loaded(surface, mean_separation).answer
        return answer

    def solved(self, surface: AnySurface, gaps: Gaps, modulus: FloatArray) -> Solved:
        loaded = self.loaded(surface, gaps.mean_separation, gaps.lighter)
        return solved_by(loaded.answer, modulus, loaded)

    def loaded(
        self, surface: AnySurface, mean_separation: FloatArray, lighter: Any = None
    ) -> YieldedContacts:
        """Contacts at mean separations u [length]; `lighter` are those of the elastic contact at the same forces."""
        u = np.asarray(mean_separation, dtype=float)
        peak = self.peak(surface)
        below = peak.remembered & (u >= peak.mean_separation)
        deepest = np.where(below, peak.mean_separation, u)
        first = self.loading.loaded(surface, deepest)
        if not below.any():
            return self._joined(below, first, first)
        v = self._elastic_separation(surface, u) if lighter is None else lighter
        branch = self._branch(surface, peak, np.maximum(v, peak.elastic_separation), u)
        return self._joined(below, self._light(surface, branch, u), first)

    def _joined(self, below: Any, branch: Any, first: Any) -> YieldedContacts:
        """Contacts of the branch where they are below it, else of first loading."""
        fields = [
            np.where(below, one, other)
            for one, other in zip(branch.answer, first.answer, strict=True)
        ]
        return YieldedContacts(
            TheoryAnswer(*fields),
            *(
                np.where(below, getattr(branch, name), getattr(first, name))
                for name in YieldedContacts._fields[1:]
            ),
        )

    @np.errstate(divide="ignore", invalid="ignore")
    def _branch(
        self, surface: AnySurface, peak: Peak, v: FloatArray, u: FloatArray
    ) -> YieldedContacts:
        """Contacts of the branch, by mean separations v of the elastic contact at the same forces."""
        elastic = self.branch_theory.answer(surface, v)
        s = np.minimum(elastic.pressure / peak.pressure, 1.0)
        steep = elastic.stiffness / peak.elastic.stiffness
        stiffness = peak.stiffness * stiffness_ratio(s, steep, *peak.spots)
        share = elastic.area / peak.elastic.area
        area = peak.area * area_ratio(s, share, *peak.area_spots)
        error = 2 * elastic.error
        answer = TheoryAnswer(s * peak.pressure, area, stiffness, error)
        yielded = np.where(s > 0, peak.yielded, 0.0)
        return YieldedContacts(answer, yielded, stiffness, u - peak.flattening)

    @np.errstate(divide="ignore", invalid="ignore", over="ignore")
    def _light(
        self, surface: AnySurface, branch: YieldedContacts, u: FloatArray
    ) -> YieldedContacts:
        """The branch with its lightest contacts."""
        tail = self.tail(surface)
        light = u > tail.first
        share = tail.left(u) ** tail.power
        pressure = tail.pressure * share
        stiffness = np.where(share > 0, tail.power * pressure / (tail.last - u), 0.0)
        lighter = TheoryAnswer(
            pressure, tail.area * share, stiffness, branch.answer.error
        )
        fields = [
            np.where(light, one, other)
            for one, other in zip(lighter, branch.answer, strict=True)
        ]
        answer = TheoryAnswer(*fields)
        touching = answer.pressure > 0
        return branch._replace(
            answer=answer,
            yielded=np.where(touching, self.peak(surface).yielded, 0.0),
            unloading_stiffness=answer.stiffness,
        )

    @np.errstate(all="ignore")
    def _elastic_separation(self, surface: AnySurface, u: FloatArray) -> FloatArray:
        """Mean separations of the elastic contact at the forces of contacts at u, but the lightest."""
        peak, tail = self._curve(surface)
        inside = peak.remembered & (u > peak.mean_separation) & (u < tail.first)
        beyond = np.where(
            u < tail.first, peak.elastic_separation, tail.elastic_separation
        )
        if not inside.any():
            return beyond
        low, end = peak.elastic_separation, tail.elastic_last
        given = tail.last - u, inside, low, end, tail.last
        (goal, is_wanted, lows, ends, last), shape = rows(*given)
        force = self.branch_theory.curve(surface, "pressure")
        count = self.looks if np.size(low) == 1 else self.looks_of_batch
        whole = peak.distances(tail.last, force)
        shares = inversion.shares(count).reshape(-1, *[1] * len(shape))
        looks = np.asarray(low + (tail.elastic_last - low) * shares)
        samples, exact = inversion.sampled(whole, looks, shape)

        def curve_of(places: Indices) -> Curve:
            theory = self.branch_theory.at(shape, places)
            curve = theory.curve(select(surface, shape, places), "pressure")
            chosen = np.asarray(places).astype(np.intp)
            return peak.at(shape, chosen).distances(last[chosen], curve)

        search = inversion.Search(samples, exact, goal, ends, lows, ends)
        missed = search.run(curve_of, is_wanted > 0)
        if missed.any():
            raise unfinished(missed.reshape(shape), "the elastic contact of a branch")
        return np.where(inside, search.gap.reshape(shape), beyond)

    def at_force(
        self, surface: AnySurface, pressure: FloatArray
    ) -> tuple[FloatArray, Any]:
        """Mean separations u at forces over A0 E*, and those of the elastic contact."""
        peak = self.peak(surface)
        # at the largest pressure both branches meet
        other = pressure != peak.pressure
        heavy = other & ((pressure > peak.pressure) | ~peak.remembered)
        v = peak.elastic_separation
        if other.any():
            v = self.branch_theory.mean_separation_at(surface, "pressure", pressure)
        s = np.minimum(pressure / peak.pressure, 1.0)
        tail = self.tail(surface)
        with np.errstate(divide="ignore"):
            share = (s / LEAST) ** (1 / tail.power)
        light = tail.last - (tail.last - tail.first) * share
        u = np.where(s < LEAST, light, peak.separation(v, s))
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

    def evidence(self, surface: AnySurface) -> str:
        """That of loading."""
        return self.loading.evidence(surface)

    def scatter(self, surface: AnySurface, quantity: str, area: FloatArray) -> FloatArray:
        """That of first loading at the largest pressure, with that of the branch from there.

        "stiffness" is that of reloading, which is the unloading stiffness; "energy" is what
        unloading from a pressure gives back.
        """
        peak = self.peak(surface)
        area = np.asarray(area, dtype=float)
        on_branch = peak.remembered & (area < peak.area)
        if quantity == "energy":
            # heavier contacts give nothing back on this branch, and elastic ones all
            on_branch = peak.remembered
            loading = elastic_scatter(self.elastic, surface, "pressure", area)
        else:
            loading = self.loading.scatter(surface, quantity, area)
        if not on_branch.any():
            return loading
        shape = np.broadcast_shapes(np.shape(area), np.shape(peak.area), surface.shape)
        s = self._pressure_ratio(peak, np.broadcast_to(area, shape))
        if quantity == "pressure":
            branch = self._pressure_scatter(surface, peak, s)
        else:
            name = quantity if quantity in ("area", "energy") else "stiffness"
            asked = quantity if quantity == "area" else "unloading_stiffness"
            first = self.loading.scatter(surface, asked, peak.area)
            branch = np.hypot(first, ratio_scatter(name, s, peak.yielded))
        return np.where(on_branch, branch, loading)

    def _pressure_ratio(self, peak: Peak, area: FloatArray) -> FloatArray:
        """p/p0 at contact areas, as for an elastic area in proportion to the pressure."""
        log_least = np.log(np.asarray(FRACTIONS[0]))
        with np.errstate(divide="ignore"):
            log_area = np.log(area / peak.area)

        def missed(log_s: FloatArray, wanted: FloatArray, *spots: Any) -> FloatArray:
            s = np.exp(log_s)
            return np.asarray(np.log(area_ratio(s, s, *spots)) - wanted)

        given = np.broadcast_arrays(log_area, *peak.area_spots)
        # those of lighter contacts count as those of the lightest
        least = missed(log_least, np.zeros(()), *given[1:])
        wanted = np.maximum(given[0], least)
        found = find_root(missed, (log_least, 0.0), args=(wanted, *given[1:])).x
        return np.asarray(np.exp(np.where(np.isnan(found), log_least, found)))

    @np.errstate(divide="ignore", invalid="ignore")
    def _pressure_scatter(
        self, surface: AnySurface, peak: Peak, s: FloatArray
    ) -> FloatArray:
        """Standard deviation of ln of the pressure at a mean separation."""
        pressure = s * peak.pressure
        v = self.branch_theory.mean_separation_at(surface, "pressure", pressure)
        u = peak.separation(v, s)
        stiffness = self._branch(surface, peak, v, u).answer.stiffness
        at_peak = self.loading.scatter(surface, "pressure", peak.area)
        first = at_peak * peak.pressure / peak.loading.stiffness
        lifted = (u - peak.mean_separation) * ratio_scatter("lift", s, peak.yielded)
        return np.asarray(np.hypot(first, lifted) * stiffness / pressure)

    def reasons(
        self, surface: AnySurface, answer: TheoryAnswer, mean_separation: FloatArray
    ) -> Mapping[str, Any]:
        """Those of first loading, on the branch at the largest pressure; and pressures far below it."""
        peak = self.peak(surface)
        shape = np.shape(answer.pressure)
        below = peak.remembered & (mean_separation >= peak.mean_separation)
        branch = np.broadcast_to(below, shape)
        fields = [
            np.where(branch, one, other)
            for one, other in zip(peak.loading, answer, strict=True)
        ]
        u = np.where(branch, peak.mean_separation, mean_separation)
        reasons = dict(self.loading.reasons(surface, TheoryAnswer(*fields), u))
        least, most = AREAS
        area = f"A/A0 at the largest pressure is outside {least:g} to {most:g}, where unloading was simulated"
        outside = (peak.area < least * (1 - ROUNDING)) | (peak.area > most)
        light = answer.pressure < FRACTIONS[0] * peak.pressure * (1 - ROUNDING)
        eta = np.asarray(self.hardness) / np.asarray(surface.rms_gradient)
        own = {
            area: outside,
            f"the pressure is below {FRACTIONS[0]:g} of the largest one": light,
            f"unloading was simulated from {SOFTEST:g} on of the hardness over E* times "
            "the rms gradient": eta < SOFTEST,
        }
        return reasons | {
            text: branch & mask & (answer.pressure > 0) for text, mask in own.items()
        }

    def energy(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        """Energy over A0 E* [length] that unloading gives back, at most that at the largest pressure."""
        u = np.asarray(mean_separation, dtype=float)
        peak = self.peak(surface)
        unloads = ~peak.remembered | (u >= peak.mean_separation * (1 - ROUNDING))
        require(
            "mean_separation",
            np.broadcast_to(u, np.shape(unloads)),
            unloads,
            "at least that under the largest pressure, above which the contact yields",
        )
        v = np.maximum(self._elastic_separation(surface, u), peak.elastic_separation)
        s = np.minimum(
            self.branch_theory.answer(surface, v).pressure / peak.pressure, 1.0
        )
        tail = self.tail(surface)
        s = np.where(u > tail.first, s * tail.left(u) ** tail.power, s)
        weight, *powers = peak.spots
        flat = weight * peak.pressure**2 * energy(s, *powers)
        elastic = (
            (1 - weight) * self.branch_theory.energy(surface, v) * peak.elastic.stiffness
        )
        found = np.asarray((elastic + flat) / peak.stiffness)
        if np.all(peak.remembered):
            return found
        first = np.where(peak.remembered, self.loading.interval(surface)[1], u)
        return np.where(peak.remembered, found, self.elastic.energy(surface, first))
