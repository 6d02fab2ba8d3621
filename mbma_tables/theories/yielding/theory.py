"""Any theory with a hardness: its elastic result is corrected by `mbma_tables.theories.yielding.formulas`."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.common.arguments import FloatArray, entries_at
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.common.shared import shared
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories import tested
from mbma_tables.theories.base import (
    Gaps,
    Solved,
    Theory,
    TheoryAnswer,
    solved_by,
    unfinished,
)
from mbma_tables.theories.evidence import known_at, shipped_part
from mbma_tables.theories.inversion import FEW_LOOKS, Curve
from mbma_tables.theories.yielding import formulas as law

GROUP = "hardness"  # group of the calibrated laws' file
QUANTITIES = ("area", "yielded", "pressure", "unloading_stiffness")
REACHED = 1e-9  # relative, of forces at full compression
HEAVIEST = 1e6  # F/(A0 E* g) above which areas are those of full contact
# u/h_rms of contacts that count as full, and u of those of surfaces that end at h_max
CLOSED = 1e-9
LEAST = 1e-300
MANY = 200  # most hardnesses for which inversions use as many gaps as without
ROUNDING = 1e-9  # relative, of numbers beside the ends of ranges
# nominal pressure over the hardness from which the bulk yields: D. Tabor, The Hardness of
# Metals (1951), the hardness of a metal is three times its yield stress
BULK_YIELD = 1 / 3
FROZEN_ERROR = (
    0.05  # of the stiffness of a frozen contact, root mean square (docs/yield.md)
)
# hardness over E* times the rms gradient from which less than 1e-5 of the contact yields, up
# to the heaviest contacts that are valid, so that the loading curve is the elastic one
ELASTIC_ETA = 4.0
MAX_LEVEL = 37.0  # heights over h_rms above which shares underflow


class Scatter(NamedTuple):
    """Errors of contacts with a hardness against boundary elements, from the calibrated laws' file."""

    eta: FloatArray  # p_m/(E* g), rising
    log_area: FloatArray  # ln of contact fractions
    rms: dict[
        str, FloatArray
    ]  # of ln(theory/simulation), by theory; rows `QUANTITIES`, hardnesses, contact fractions
    weight: dict[
        str, FloatArray
    ]  # d ln of force and of area by d ln of the elastic one; hardnesses, contact fractions

    def _at(self, rows: FloatArray, eta: FloatArray, area: FloatArray) -> FloatArray:
        """Errors at hardnesses and contact fractions; constant beyond those simulated."""
        shape = np.broadcast_shapes(np.shape(eta), np.shape(area))
        with np.errstate(divide="ignore"):
            log_area = np.log(np.broadcast_to(area, shape))
        values = np.array([known_at(self.log_area, row, log_area) for row in rows])
        y = np.interp(
            np.log(np.broadcast_to(eta, shape)),
            np.log(self.eta),
            np.arange(self.eta.size),
        )
        below = np.minimum(y.astype(int), self.eta.size - 2)
        columns = np.indices(shape, sparse=True)
        low, high = (values[(row, *columns)] for row in (below, below + 1))
        return np.asarray(low + (high - low) * (y - below))

    def standard_deviation(
        self,
        theory: str,
        quantity: str,
        eta: FloatArray,
        area: FloatArray,
        elastic: FloatArray,
    ) -> FloatArray:
        """Standard deviation of ln(theory/simulation), or from those of the `elastic` theory and the law; else NaN."""
        row = QUANTITIES.index(quantity)
        own = self.rms.get(theory)
        if own is not None and np.isfinite(own[row]).any():
            found = self._at(own[row], eta, area)
        elif quantity not in self.weight:
            found = np.full(np.broadcast_shapes(np.shape(eta), np.shape(area)), np.nan)
        else:
            passed_on = elastic * self._at(self.weight[quantity], eta, area)
            found = np.hypot(passed_on, self._at(self.rms["elastic"][row], eta, area))
        return np.where((eta > self.eta[-1]) | np.isnan(elastic), elastic, found)


@shared()
def shipped() -> Scatter:
    """The errors in the shipped file, read once."""
    variables, attributes = shipped_part(GROUP)
    known = zip(
        str(attributes["theories"]).split(), variables["stated_scatter"], strict=True
    )
    weights = dict(zip(("area", "pressure"), variables["elastic_weight"], strict=True))
    return Scatter(variables["eta"], np.log(variables["contact"]), dict(known), weights)


def elastic_scatter(
    theory: Theory, surface: AnySurface, quantity: str, area: FloatArray
) -> FloatArray:
    """Standard deviation of an elastic theory, whose unloading stiffness is that of loading."""
    return theory.scatter(
        surface, "stiffness" if quantity == "unloading_stiffness" else quantity, area
    )


@dataclasses.dataclass(frozen=True, eq=False)
class Loaded:
    """A loaded contact that yields: its result, with quantities derived from it and from the elastic contact."""

    u: FloatArray  # [length]
    h_rms: FloatArray
    eta: FloatArray  # p_m/(E* g)
    load: FloatArray  # F/(A0 E* g)
    answer: TheoryAnswer  # result for loading
    elastic: TheoryAnswer  # of the elastic contact at u
    elastic_area: FloatArray  # A/A0 of the elastic contact at equal force

    @property
    def yielded(self) -> FloatArray:
        """Share of the contact area at the hardness."""
        with np.errstate(invalid="ignore"):
            share = (
                law.area(self.load, self.elastic_area, self.eta, yielded=True)
                / self.answer.area
            )
        return np.where(np.isinf(self.eta) | (self.answer.area == 0), 0.0, share)

    @property
    def unloading_stiffness(self) -> FloatArray:
        """-dF/du of the frozen contact over A0 E* [1/length]."""
        return np.asarray(self.elastic.stiffness * law.frozen_factor(self.eta))

    @property
    def plane_separation(self) -> FloatArray:
        """Gap between mean planes [length]."""
        with np.errstate(invalid="ignore"):
            planes = self.h_rms * law.plane_separation(
                self.u / self.h_rms, self.load / self.eta, self.eta
            )
        return np.where(np.isinf(self.eta), self.u, planes)


class Yielding(Theory):
    """A theory whose pressures cannot exceed a hardness; u is the mean gap, points that yield flattened.

    Parameters
    ----------
    theory : Theory
        The elastic one.
    hardness : array_like
        p_m/E*, positive; broadcasts with surfaces and separations. Where it is infinite,
        nothing yields.
    """

    elastic: Any = None

    def __init__(self, theory: Theory, hardness: ArrayLike) -> None:
        self.elastic, self.hardness, self.reached = (
            theory,
            np.asarray(hardness, dtype=float),
            REACHED,
        )
        self.name, self.ends_at_h_max = theory.name, theory.ends_at_h_max
        self.looks = FEW_LOOKS if self.hardness.size > MANY else theory.looks
        # whether the elastic area at a force needs no separation
        self.knows_areas = type(theory).area_at is not Theory.area_at
        self._bound: tuple[Any, Any] = None, None

    def at(self, shape: tuple[int, ...], place: Any) -> Theory:
        if self.hardness.ndim == 0:
            return self
        return type(self)(self.elastic, entries_at(self.hardness, shape, place))

    def _eta(self, surface: AnySurface) -> FloatArray:
        """p_m/(E* g)."""
        with np.errstate(over="ignore"):
            return np.asarray(self.hardness / np.asarray(surface.rms_gradient))

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and the loading curve's stiffness at mean separations u [length]."""
        return self.loaded(surface, mean_separation).answer

    def solved(self, surface: AnySurface, gaps: Gaps, modulus: FloatArray) -> Solved:
        """Contacts at gaps; `lighter` are those of the elastic contact at the same forces."""
        loaded = self.loaded(surface, gaps.mean_separation, gaps.lighter)
        return solved_by(loaded.answer, modulus, loaded)

    def provenance(self) -> tuple[str, ...]:
        lines: tuple[str, ...] = self.elastic.provenance()
        return lines

    def reasons_of_flow(self) -> tuple[str, ...]:
        reasons: tuple[str, ...] = self.elastic.reasons_of_flow()
        return reasons

    def loaded(
        self,
        surface: AnySurface,
        mean_separation: FloatArray,
        lighter: FloatArray | None = None,
    ) -> Loaded:
        """The answer at mean separations u [length]; `lighter` are those of the elastic contact at the same forces."""
        u = np.asarray(mean_separation, dtype=float)
        h_rms = np.asarray(surface.h_rms)
        at_force: Any = None
        if lighter is None:
            elastic = self.elastic.answer(surface, u)
        else:
            both = self.elastic.answer(surface, np.stack([u, lighter]))
            elastic, (_, at_force, *_) = (
                TheoryAnswer(*(part[k] for part in both)) for k in range(2)
            )
        eta, closed = self._closed(surface)
        gradient = np.asarray(surface.rms_gradient)
        endless = np.isinf(self.hardness)
        if endless.all():
            return Loaded(
                u, h_rms, eta, elastic.pressure / gradient, elastic, elastic, elastic.area
            )
        pressure, stiffness = closed(u, elastic.pressure, elastic.stiffness)
        if at_force is None:
            needed = (pressure > 0) & ~endless
            # without yielding or contact, a force that the theory certainly reaches
            known = np.minimum(
                np.where(needed, pressure, elastic.pressure),
                np.where(needed, HEAVIEST, 1.0) * gradient,
            )
            at_force = np.where(needed, self.elastic.area_at(surface, known), 0.0)
        # both of the elastic errors, force and area at that force, may add up
        area = law.area(pressure / gradient, at_force, eta)
        capped = TheoryAnswer(pressure, area, stiffness, 2 * elastic.error)
        if endless.any():
            capped = TheoryAnswer(
                *(
                    np.where(endless, one, other)
                    for one, other in zip(elastic, capped, strict=True)
                )
            )
        return Loaded(
            u, h_rms, eta, capped.pressure / gradient, capped, elastic, at_force
        )

    def _closed(self, surface: AnySurface) -> Any:
        """p_m/(E* g), and the force over A0 E* and its -d/du between the elastic ones and the bearing curve."""
        # one assignment, as threads share a contact
        bound = self._bound
        if bound[0] is not surface:
            eta = self._eta(surface)
            sizes = np.asarray(surface.h_rms), np.asarray(surface.rms_gradient), eta
            closed = functools.partial(law.closed, self.elastic.heights(surface), *sizes)
            self._bound = bound = surface, (eta, closed)
        return bound[1]

    def interval(
        self, surface: AnySurface, quantity: str = "pressure"
    ) -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] between which the elastic force falls, and Gaussian heights end in numbers."""
        low, high = self.elastic.interval(surface, "pressure")
        h_rms = np.asarray(surface.h_rms)
        # at u = 0, the full contact with a hardness, some theories have infinite force
        low = np.maximum(low, LEAST if self.ends_at_h_max else CLOSED * h_rms)
        return low, np.minimum(high, MAX_LEVEL * h_rms)

    def domain(self, surface: AnySurface) -> tuple[FloatArray, FloatArray]:
        """That of the elastic theory."""
        domain: tuple[FloatArray, FloatArray] = self.elastic.domain(surface)
        return domain

    def curve(self, surface: AnySurface, quantity: str) -> Curve:
        """Force without the area, which is computed from it."""
        if quantity != "pressure":
            return super().curve(surface, quantity)
        elastic = self.elastic.curve(surface, quantity)
        closed = self._closed(surface)[1]

        def values(u: FloatArray) -> tuple[Any, Any, bool]:
            pressure, steep, exact = elastic(u)
            return *closed(u, pressure, steep), exact

        return values

    def inverted(
        self, surface: AnySurface, quantity: str, wanted: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """As of any theory; no force is beyond the hardness."""
        shape = self._refuse(quantity, wanted)
        return super().inverted(surface, quantity, np.broadcast_to(wanted, shape))

    def looks_near(
        self,
        surface: AnySurface,
        quantity: str,
        wanted: FloatArray,
        first: FloatArray,
        farthest: FloatArray,
    ) -> FloatArray | None:
        """Where the elastic force or that of the heights alone is the wanted one, which is at most twice their power mean."""
        near = (
            self.elastic.force_near(surface, wanted) if quantity == "pressure" else None
        )
        if near is None:
            return None
        heights = self.elastic.heights(surface)
        level = law.gap_of_share(wanted / self.hardness, heights)
        near = np.fmin(near, level * np.asarray(surface.h_rms))
        # numbers, and between those of the search
        middle = 0.5 * (first + farthest)
        inside = (near > first) & (near < farthest)
        return np.stack(np.broadcast_arrays(np.where(inside, near, middle), first))

    def _refuse(self, quantity: str, wanted: FloatArray) -> tuple[int, ...]:
        """The shape of entries, whose pressures are at most the hardness."""
        over = np.asarray(wanted > self.hardness)
        if quantity == "pressure" and over.any():
            raise OutOfRangeError("pressure must be at most the hardness", over)
        return over.shape

    def bends(self, surface: AnySurface) -> FloatArray:
        """The elastic bends; those of the area alone are where the force is that of the elastic bend."""
        elastic = np.asarray(self.elastic.bends(surface))
        if not self.elastic.bends_in_area:
            return elastic
        # the area is that of the elastic contact at the same force
        force = self.elastic.answer(surface, elastic).pressure
        # forces beyond the hardness are not reached
        reached = (force > 0) & (force < self.hardness)
        at_force = self.inverted(surface, "pressure", np.where(reached, force, 0.0))[0]
        return np.where(reached, at_force, elastic)

    def gaps(self) -> Any:
        return self.elastic.gaps()

    def at_force(
        self, surface: AnySurface, pressure: FloatArray
    ) -> tuple[FloatArray, FloatArray | None]:
        """Mean separations u at forces over A0 E*, and `lighter` of `loaded` where areas need that."""
        elastic = np.isinf(self.hardness).all()
        if self.knows_areas or elastic:
            asked: Theory = self.elastic if elastic else super()  # type: ignore[assignment]
            return asked.mean_separation_at(surface, "pressure", pressure), None
        shape = np.broadcast_shapes(pressure.shape, surface.shape, self.hardness.shape)
        cap = np.reshape(
            self.hardness, (1,) * (len(shape) - self.hardness.ndim) + self.hardness.shape
        )
        both = Yielding(self.elastic, np.stack([cap, np.full(cap.shape, np.inf)]))
        u, missed = both.inverted(
            surface, "pressure", np.broadcast_to(pressure, (2, *shape))
        )
        if missed[0].any():
            raise unfinished(missed[0], "the separation at this pressure")
        return u[0], u[1]

    def evidence(self, surface: AnySurface) -> str:
        """That of the elastic contact, and with a hardness."""
        elastic: str = self.elastic.evidence(surface)
        name = self.elastic.scatter_name(surface)
        ranges = tested.ranges_with_hardness(name)
        if np.isinf(self.hardness).all() or not ranges:
            return elastic
        found = tested.evidence(name, ranges, tested.WITH_HARDNESS)
        return f"{elastic}; with a hardness {found}"

    def scatter(self, surface: AnySurface, quantity: str, area: FloatArray) -> FloatArray:
        """Standard deviation against boundary elements with a hardness.

        That of the calibrated law is measured; for others that of the elastic theory is
        propagated and combined with that of the hardness law. NaN if the elastic theory's
        is not known, and for an unloading stiffness that was not measured. "stiffness", the
        slope of the loading curve, was not compared with simulations: NaN, but where
        nothing yields.
        """
        elastic = elastic_scatter(self.elastic, surface, quantity, area)
        eta = self._eta(surface)
        if quantity == "stiffness":
            return np.where(eta >= ELASTIC_ETA, elastic, np.nan)
        measured = shipped()
        found = measured.standard_deviation(
            self.elastic.scatter_name(surface), quantity, eta, area, elastic
        )
        # was measured on bands to 1:128; that of the elastic theory has the wider ones
        like = "stiffness" if quantity == "unloading_stiffness" else quantity
        wide = self.elastic.wide_scatter(surface, like)
        return np.where(eta > measured.eta[-1], found, np.hypot(found, wide))

    def reasons(
        self,
        surface: AnySurface,
        answer: TheoryAnswer,
        mean_separation: FloatArray,
    ) -> Mapping[str, Any]:
        # the frozen contact is at least as stiff as that of loading, in which yielded
        # points give way
        elastic = self.elastic.answer(surface, np.asarray(mean_separation, dtype=float))
        unloading = elastic.stiffness * law.frozen_factor(self._eta(surface))
        softer = answer.stiffness > unloading * (1 + FROZEN_ERROR)
        text = (
            "unloading would be softer than loading here, since the theory's force and the heights of the "
            "surface disagree: theory='calibrated'"
        )
        elastic_reasons = self.elastic.reasons(surface, answer, mean_separation)
        return {**elastic_reasons, **self._of_hardness(surface, answer), text: softer}

    def _of_hardness(self, surface: AnySurface, answer: TheoryAnswer) -> dict[str, Any]:
        """Reasons why contacts with this hardness were not tested, each with a mask."""
        shape = np.shape(answer.area)
        eta = self._eta(surface)
        # a pressure that the whole face bears is the stress of the bulk
        bulk = answer.pressure > BULK_YIELD * self.hardness * (1 + ROUNDING)
        bulk_text = (
            "the nominal pressure is above a third of the hardness, which is about the yield stress: the bulk "
            "of the softer body yields, not its asperities alone; at most hardness/3 is covered"
        )
        name = self.elastic.scatter_name(surface)
        return {
            **tested.untested_with_hardness(surface, name, answer.area, eta),
            bulk_text: np.broadcast_to(bulk, shape),
        }
