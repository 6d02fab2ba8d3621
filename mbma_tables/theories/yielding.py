"""Any theory with a hardness: its elastic answer goes through `mbma_tables.hardness`.

Force at a mean gap is closed between the elastic force and the bearing curve; area is that at equal force, with
pressures capped at the hardness. u is the mean gap, points that yield flattened.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.special import expit, logit, ndtr, ndtri

from mbma_tables import hardness as law
from mbma_tables.arguments import FloatArray, checked_hardness, describe_entries, require
from mbma_tables.bearing_curve import rows
from mbma_tables.core import core
from mbma_tables.errors import ConvergenceError, OutOfRangeError
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.calibrated_table import at_contact, shipped_part
from mbma_tables.theories.protocol import Theory, TheoryAnswer, select

GROUP = "hardness"  # of the calibrated laws' file
QUANTITIES = ("area", "yielded", "force", "stiffness")
TESTED_ETA = 0.025  # p_m/(E* g) down to which boundary elements were solved
STEPS = 200
LOWEST = 1e-300
REACHED = 1e-9  # relative, of forces at full compression
HEAVIEST = 1e6  # F/(A0 E* g) from which on areas are those of full contact
CLOSED = 1e-9  # u/h_rms of contacts that count as full
MANY = 200  # forces on one surface from which on a spline is worth making,
NODE_STEP, BEYOND = 0.1, 16  # its steps in ln F/(p_m A0 - F), those beyond the forces at either end,
MOST_ODDS = 20.0  # and the largest
MIN_DEPTH = 4 * np.finfo(float).eps  # relative, of separations that rounding leaves distinct
MAX_LEVEL = 37.0  # of heights over h_rms above which shares are no normal numbers


class Scatter(NamedTuple):
    """Errors of contacts with a hardness against boundary elements, from the calibrated laws' file."""

    eta: FloatArray  # p_m/(E* g), rising
    log_area: FloatArray  # ln of contact fractions
    rms: dict[str, FloatArray]  # of ln(theory/simulation), by theory; rows `QUANTITIES`, hardnesses, contact fractions
    weight: dict[str, FloatArray]  # d ln of force and of area by d ln of the elastic one; hardnesses, contact fractions

    def _at(self, rows: FloatArray, eta: FloatArray, area: FloatArray) -> FloatArray:
        """At hardnesses and contact fractions, held constant beyond those simulated."""
        shape = np.broadcast_shapes(np.shape(eta), np.shape(area))
        values = np.array([at_contact(self.log_area, row, np.broadcast_to(area, shape)) for row in rows])
        y = np.interp(np.log(np.broadcast_to(eta, shape)), np.log(self.eta), np.arange(self.eta.size))
        below = np.minimum(y.astype(int), self.eta.size - 2)
        low, high = (np.take_along_axis(values, k[None], 0)[0] for k in (below, below + 1))
        return np.asarray(low + (high - low) * (y - below))

    def standard_deviation(
        self, theory: str, quantity: str, eta: FloatArray, area: FloatArray, elastic: FloatArray
    ) -> FloatArray:
        """Of ln of the theory over simulation; where not measured, from that of the `elastic` theory and the law's.

        NaN where neither is known: how much of an error of stiffness a hardness lets through was not measured.
        """
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


@functools.cache
def shipped() -> Scatter:
    """The shipped file's, read once."""
    variables, attributes = shipped_part(GROUP)
    known = zip(str(attributes["theories"]).split(), variables["stated_scatter"], strict=True)
    weights = dict(zip(("area", "force"), variables["elastic_weight"], strict=True))
    return Scatter(variables["eta"], np.log(variables["contact"]), dict(known), weights)


@dataclasses.dataclass(frozen=True, eq=False)
class Loaded:
    """A loaded contact that yields: its answer, and what follows from it and from the elastic contact."""

    u: FloatArray  # [length]
    h_rms: FloatArray
    eta: FloatArray  # p_m/(E* g)
    load: FloatArray  # F/(A0 E* g)
    answer: TheoryAnswer  # of loading
    elastic: TheoryAnswer  # of the elastic contact at u
    elastic_area: FloatArray  # A/A0 of the elastic contact at equal force

    @property
    def yielded(self) -> FloatArray:
        """Share of the contact area at the hardness."""
        with np.errstate(invalid="ignore"):
            share = law.yielded_area(self.load, self.elastic_area, self.eta) / self.answer.area
        return np.where(np.isinf(self.eta) | (self.answer.area == 0), 0.0, share)

    @property
    def incremental_stiffness(self) -> FloatArray:
        """-dF/du of the frozen contact over A0 E* [1/length]."""
        return np.asarray(self.elastic.stiffness * law.frozen_factor(self.eta))

    @property
    def plane_separation(self) -> FloatArray:
        """Gap between mean planes [length]."""
        with np.errstate(invalid="ignore"):
            planes = self.h_rms * law.plane_separation(self.u / self.h_rms, self.load / self.eta, self.eta)
        return np.where(np.isinf(self.eta), self.u, planes)


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

    def stiffer(self, times: FloatArray) -> Theory:
        """With hardnesses that are less of the modulus."""
        return Yielding(self.elastic, self.hardness / times)

    def bends(self, surface: AnySurface) -> FloatArray:
        """Where derivatives of the elastic force jump."""
        return self.elastic.bends(surface)

    def _eta(self, surface: AnySurface) -> FloatArray:
        """p_m/(E* g)."""
        with np.errstate(over="ignore"):
            return np.asarray(self.hardness / np.asarray(surface.rms_gradient))

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and the loading curve's stiffness at mean separations u [length]."""
        return self.loaded(surface, mean_separation).answer

    def loaded(self, surface: AnySurface, mean_separation: FloatArray) -> Loaded:
        """The answer at mean separations u [length], and what more is known there."""
        u, h_rms = np.asarray(mean_separation, dtype=float), np.asarray(surface.h_rms)
        elastic = self.elastic.answer(surface, u)
        gradient = np.asarray(surface.rms_gradient)
        eta = self._eta(surface)
        endless = np.isinf(self.hardness)
        if endless.all():
            return Loaded(u, h_rms, eta, elastic.force / gradient, elastic, elastic, elastic.area)
        share, slope = self.elastic.bearing_share(surface, u)
        load, stiffness = law.force(elastic.force / gradient, elastic.stiffness / gradient, share, slope, eta)
        force = load * gradient
        needed = (force > 0) & ~endless
        # where nothing yields or touches, a force that the theory is sure to reach
        asked = np.where(needed, np.minimum(force, HEAVIEST * gradient), np.minimum(elastic.force, gradient))
        at_force = np.where(needed, self.elastic.area_at(surface, asked), 0.0)
        # both of the elastic errors, force and area at that force, may add up
        capped = TheoryAnswer(force, law.area(load, at_force, eta), stiffness * gradient, 2 * elastic.error)
        if endless.any():
            capped = TheoryAnswer(*(np.where(endless, one, other) for one, other in zip(elastic, capped, strict=True)))
        return Loaded(u, h_rms, eta, capped.force / gradient, capped, elastic, at_force)

    def bearing_share(self, surface: AnySurface, mean_separation: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The elastic theory's."""
        return self.elastic.bearing_share(surface, mean_separation)

    def interval(self, surface: AnySurface, quantity: str = "force") -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] between which the elastic force falls, and Gaussian heights end in numbers."""
        low, high = self.elastic.interval(surface, "force")
        h_rms = np.asarray(surface.h_rms)
        # Persson's theory has no finite force at zero, where a hardness leaves full contact
        low = low if quantity == "force" or self.ends_at_h_max else np.maximum(low, CLOSED * h_rms)
        return low, np.minimum(high, MAX_LEVEL * h_rms)

    def mean_separation_at(self, surface: AnySurface, quantity: str, wanted: FloatArray) -> FloatArray:
        """Mean separation u [length] at which "force" (over A0 E*, below the hardness) or "area" has a wanted value."""
        if np.isinf(self.hardness).all():
            return self.elastic.mean_separation_at(surface, quantity, wanted)
        shape = np.broadcast_shapes(np.shape(wanted), surface.shape, self.hardness.shape)
        given = np.broadcast_to(np.asarray(wanted, dtype=float), shape)
        if quantity == "area":
            return super().mean_separation_at(surface, quantity, given)
        cap = np.broadcast_to(self.hardness, shape)
        if (given > cap).any():
            raise OutOfRangeError("pressure must be at most the hardness", given > cap)
        return self._separation(surface, given)

    def _separation(self, surface: AnySurface, force: FloatArray) -> FloatArray:
        """Newton's method in a bracket."""
        known, state = self._started(surface, force)
        asked = (known[0] > 0) & (known[0] < known[1]) & (known[1] < np.inf)
        left = np.flatnonzero(asked)
        for _ in range(STEPS):
            if not left.size:
                break
            some, elastic = select(surface, force.shape, left), self.elastic.at(force.shape, left)
            found = elastic.answer(some, state[0, left])
            share, slope = elastic.bearing_share(some, state[0, left])
            g = np.asarray(some.rms_gradient)
            load, steep = law.force(found.force / g, found.stiffness / g, share, slope, known[1, left])
            more = np.empty(left.size, dtype=bool)
            core.gap_step(load, steep, 1, left, known[0], known[2], state, more)
            left = left[more]
        missed = asked & np.isnan(state[0])
        missed[left] = True
        if missed.any():
            text = f"no separation was found for {int(missed.sum())} pressures"
            raise ConvergenceError(text, missed.reshape(force.shape))
        low, high = self.interval(surface)
        u, _, above = state[:3].reshape(3, *force.shape)
        u = np.where(force < self.hardness, u, low)
        self._refuse_unreached(surface, force, u)
        return np.where(np.isinf(self.hardness), above, np.where(known[0].reshape(force.shape) > 0, u, high))

    def _started(self, surface: AnySurface, force: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Force, hardness and last gap, and the state of `gap_step`: u lies below the elastic contact's."""
        (low, high), gradient = self.interval(surface), np.asarray(surface.rms_gradient)
        low, end = np.maximum(low, LOWEST), surface.h_max if self.ends_at_h_max else np.inf
        known, _ = rows(force / gradient, self._eta(surface), end)
        log_odds = logit(force / self.hardness)
        some = log_odds[np.abs(log_odds) < MOST_ODDS]
        if not surface.shape and not self.hardness.ndim and some.size >= MANY:
            with contextlib.suppress(OutOfRangeError):  # of all forces it says which
                u = self._along_spline(surface, log_odds, some, (low, high * (1 - MIN_DEPTH), end))
                return known, rows(u, low, high, *3 * [np.nan])[0]
        above = self.elastic.mean_separation_at(surface, "force", force)
        with np.errstate(all="ignore"):
            x = force / self.hardness
            d, numbers = -ndtri(x), law.CONSTANTS.exponent
            density = np.exp(-d * d / 2) / np.sqrt(2 * np.pi)
            gap = np.maximum(d * ndtr(d) + density, LOWEST)
            # powers of u near the elastic contact's and the bearing curve's, joined as forces are
            n = numbers[0] + numbers[1] * self._eta(surface) + numbers[2] * x
            n = n * np.clip(gap * density / (x * (1 - x)), 1.0, 40.0)
            ratio = gap * surface.h_rms / above
            u = above * np.minimum(ratio, 1) * (1 + np.minimum(ratio, 1 / ratio) ** n) ** (-1 / n)
        return known, rows(np.clip(u, low, above * (1 - MIN_DEPTH)), low, above, *3 * [np.nan])[0]

    def _along_spline(self, surface: AnySurface, log_odds: FloatArray, some: FloatArray, ends: Any) -> FloatArray:
        """Separations at ln F/(p_m A0 - F) on one surface, about, by a spline through contacts over `some` of them."""
        low, high, end = ends

        def to_u(y: FloatArray) -> FloatArray:
            return np.asarray(np.exp(y) / (1 + np.exp(y) / end))

        nodes = np.linspace(some.min(), some.max(), min(int(np.ptp(some) / NODE_STEP) + 2, some.size // 4))
        u = self._started(surface, self.hardness * expit(nodes))[1][0]
        require("mean_separation", u, u > low, "positive")
        # in what is straight at either end of contact, and a little beyond the nodes
        y, more = np.log(u / (1 - u / end)), NODE_STEP * np.arange(1, BEYOND)
        y = np.concatenate([y[0] + more[::-1], y, y[-1] - more])
        y = y[(low < to_u(y)) & (to_u(y) < high)]
        g, elastic = np.asarray(surface.rms_gradient), self.elastic.answer(surface, to_u(y))
        bearing, eta = self.elastic.bearing_share(surface, to_u(y)), self._eta(surface)
        load, _ = law.force(elastic.force / g, elastic.stiffness / g, *bearing, eta)
        met = logit(np.clip(load / eta, LOWEST, 1 - np.finfo(float).epsneg))
        rising = np.append(True, np.diff(np.maximum.accumulate(met)) > 0)
        found = CubicSpline(met[rising], y[rising])(np.clip(log_odds, met[0], met[-1]))
        return np.clip(to_u(found), low, high)

    def _refuse_unreached(self, surface: AnySurface, force: FloatArray, u: FloatArray) -> None:
        """Refuse forces that full compression, or the least gap that is a number, does not reach."""
        low = np.broadcast_to(self.interval(surface, "force" if self.ends_at_h_max else "area")[0], u.shape)
        doubtful = (u <= 2 * np.maximum(low, LOWEST)) & np.isfinite(self.hardness)
        if doubtful.any():
            largest = self.answer(surface, np.maximum(u, low)).force
            out = doubtful & (force > largest * (1 + REACHED))
            allowed = f"at most what theory {self.name!r} reaches, {describe_entries(largest, out)}"
            require("force", force, ~out, allowed)

    def scatter(self, surface: AnySurface, area: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Standard deviations of ln F at given u and of ln A at given F against boundary elements with a hardness.

        Those of the calibrated law are measured; others are what the elastic theory's become, and the hardness law's
        own beside it. NaN where the elastic theory's is not known.
        """
        eta, table, name = self._eta(surface), shipped(), self.scatter_name(surface)
        force, contact = self.elastic.scatter(surface, area)
        found = table.standard_deviation(name, "force", eta, area, force)
        return found, table.standard_deviation(name, "area", eta, area, contact)

    def stiffness_scatter(self, surface: AnySurface, area: FloatArray) -> FloatArray:
        """Standard deviation of ln of the frozen contact's stiffness at given F; NaN where it was not measured."""
        eta, elastic = self._eta(surface), self.elastic.stiffness_scatter(surface, area)
        return shipped().standard_deviation(self.scatter_name(surface), "stiffness", eta, area, elastic)

    def concerns(self, surface: AnySurface, answer: TheoryAnswer, mean_separation: FloatArray) -> Mapping[str, Any]:
        """The elastic theory's reasons, and hardnesses below those that were simulated."""
        soft = self._eta(surface) < TESTED_ETA * (1 - 1e-9)
        return {
            **self.elastic.concerns(surface, answer, mean_separation),
            f"the hardness over E* times the rms gradient is below {TESTED_ETA:g}": np.broadcast_to(
                soft, np.shape(answer.area)
            ),
        }
