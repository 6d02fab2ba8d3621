"""Simulated maps with a hardness, for each hardness anew."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.shared import shared
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.base import Theory, TheoryAnswer
from mbma_tables.theories.simulated import own_map
from mbma_tables.theories.simulated.grids import AREAS
from mbma_tables.theories.simulated.one_map import BoundaryElements
from mbma_tables.theories.simulated.pressing import TOLERANCE, Press
from mbma_tables.theories.yielding.theory import Yielding, elastic_scatter
from mbma_tables.theories.yielding.unloading import Peak, Unloading, YieldedContacts

# pressures over the largest at which a residual shape is pressed
UNLOADED = (0.01, 0.03, 0.07, 0.13, 0.22, 0.35, 0.5, 0.65, 0.8, 0.91, 1.0)
KEPT = 8  # hardnesses of maps whose simulations are kept
# standard deviations of ln of a quantity, by `python -m generate machined`
SCATTER = {"area": 0.010, "pressure": 0.011, "unloading_stiffness": 0.033}


class Plastic(BoundaryElements):
    """The map of a simulated theory pressed to the loads of the same contact areas, p_m/E* = `cap`."""

    of_yielded_gaps = True

    def __init__(self, theory: BoundaryElements, cap: float) -> None:
        known = theory.pressed
        surface = theory.surface
        assert isinstance(known, Press)
        elastic = own_map.law_loads(surface, AREAS)
        loads = ((cap * np.array(AREAS)) ** -2 + elastic**-2) ** -0.5
        press = Press(
            known.heights,
            known.sizes,
            known.gradient,
            TOLERANCE,
            known.mirrored,
            cap,
            left_out=known.left_out,
        )
        force, (area, u, energy, plane, yielded, frozen, height) = press.loads(
            loads, True
        )
        # d(F H_p - U)/dF is the gap of the mean planes, to which what is flattened comes
        flattened = PchipInterpolator(force, u - plane).antiderivative()(force)
        stored = force * height - energy + flattened - force * u
        stored = stored + 2 * np.abs(stored).max()
        super().__init__(
            surface,
            np.array([force, area, u, stored]),
            theory.points,
            press,
            theory.origin,
            theory.grid,
            given=theory.given,
        )
        # yielded share, ln of the frozen stiffness and u less the gap of the mean planes, by ln F
        self._more = PchipInterpolator(
            self.fit.x, np.array([yielded / area, np.log(frozen), u - plane]).T
        )
        # what the heaviest load lacks of the hardness, and its area of full contact; both
        # vanish as this power of u
        self._ends, self._last = (
            np.array([cap, 1.0]),
            np.array([cap - force[-1], 1 - area[-1]]),
        )
        self._power = (
            float(self.fit.stiffness(self.fit.x[-1:])[0]) * u[-1] / (cap - force[-1])
        )

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness; heavier contacts go over to the hardness everywhere."""
        last = self.rows[2, -1]
        inside = super().answer(surface, np.maximum(mean_separation, last))
        left = (mean_separation / last) ** self._power
        beyond = mean_separation < last
        pressure, area = (
            end - rest * left for end, rest in zip(self._ends, self._last, strict=True)
        )
        with np.errstate(all="ignore"):
            steep = self._power * self._last[0] * left / mean_separation
        heavy = pressure, area, steep, inside.error
        return TheoryAnswer(
            *(
                np.where(beyond, one, other)
                for one, other in zip(heavy, inside, strict=True)
            )
        )

    def inverted(
        self, surface: AnySurface, quantity: str, wanted: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        row = 0 if quantity == "pressure" else 1
        end = self.rows[row, -1]
        u, missed = super().inverted(surface, quantity, np.minimum(wanted, end))
        left = np.minimum((self._ends[row] - wanted) / self._last[row], 1.0)
        return np.where(
            wanted > end, self.rows[2, -1] * left ** (1 / self._power), u
        ), missed

    def found(self, mean_separation: FloatArray) -> FloatArray:
        """Force, area, stiffness, error, yielded share, frozen stiffness and gap of the mean planes."""
        answer = self.answer(self.surface, mean_separation)
        x = self.fit.log_force(
            np.clip(mean_separation, self.rows[2, -1], self.rows[2, 0])
        )
        share, frozen, flattened = np.moveaxis(self._more(x), -1, 0)
        touching = answer.pressure > 0
        more = (
            np.where(touching, share, 0.0),
            np.where(touching, np.exp(frozen), 0.0),
            mean_separation - flattened,
        )
        return np.array([*answer, *more])


plastic = shared(KEPT)(Plastic)


@shared(KEPT)
def released(theory: BoundaryElements, cap: float, largest: float) -> BoundaryElements:
    """The map as a load left it, p_m/E* = `cap`, pressed elastically up to that load over A0 E*."""
    known = theory.pressed
    assert isinstance(known, Press)
    shape = known.heights, known.sizes, known.gradient, TOLERANCE, known.mirrored
    residual = Press(*shape, cap, left_out=known.left_out).residual(largest)
    press = Press(residual, *shape[1:], left_out=known.left_out)
    force, rows = press.loads(largest * np.array(UNLOADED), False)
    top = float(residual.max() - residual.mean())
    rows = np.array([force, *rows])
    more = theory.points, press, theory.origin, theory.grid, top
    made = BoundaryElements(theory.surface, rows, *more, given=theory.given)
    made.of_yielded_gaps = True
    return made


def by_entry(
    keys: Sequence[FloatArray],
    simulation: Callable[..., Any],
    ask: Callable[..., Any],
    given: Sequence[ArrayLike],
) -> Any:
    """What simulations answer at entries with their numbers, the keys; rows first."""
    arrays = np.broadcast_arrays(*keys, *given)
    own, values = arrays[: len(keys)], arrays[len(keys) :]
    shape = own[0].shape
    distinct = np.unique(np.stack([key.ravel() for key in own]), axis=1)
    found: Any = None
    for key in distinct.T.tolist():
        mask = np.logical_and.reduce([a == b for a, b in zip(own, key, strict=True)])
        part = np.asarray(ask(simulation(*key), *(value[mask] for value in values)))
        if found is None:
            found = np.empty((*part.shape[:-1], *shape))
        found[..., mask] = part
    return found


class Saturated(Yielding):
    """A simulated map whose pressures cannot exceed a hardness; each takes one or two times the elastic time."""

    elastic: BoundaryElements

    def _each(self, ask: Callable[..., Any], *given: ArrayLike) -> Any:
        """What simulations answer at entries with their hardnesses; rows first."""
        return by_entry([self.hardness], self._simulation, ask, given)

    def is_beyond_reach(self, cap: ArrayLike) -> Any:
        """Mask of hardnesses that no point reaches, were it to bear the heaviest load alone."""
        heaviest = self.elastic.rows[0, -1]
        pressed = self.elastic.pressed
        assert isinstance(pressed, Press)
        return np.asarray(cap) >= heaviest * pressed.heights.size

    def _simulation(self, cap: float) -> Any:
        # the contact is the elastic one, whose stiffness is known better than by a simulation
        # of the frozen contact
        beyond = self.is_beyond_reach(cap)
        return self.elastic if beyond else plastic(self.elastic, cap)

    def loaded(
        self, surface: AnySurface, mean_separation: FloatArray, lighter: Any = None
    ) -> Any:
        """The answer at mean separations u [length], and what follows from the simulation."""

        def ask(own: Any, u: FloatArray) -> Any:
            if isinstance(own, Plastic):
                return own.found(u)
            answer = own.answer(surface, u)
            return [*answer, np.zeros_like(u), answer.stiffness, u]

        found = self._each(ask, mean_separation)
        return YieldedContacts(TheoryAnswer(*found[:4]), *found[4:])

    def at_force(
        self, surface: AnySurface, pressure: FloatArray
    ) -> tuple[FloatArray, None]:
        """Mean separations u at forces over A0 E*."""
        return self.mean_separation_at(surface, "pressure", pressure), None

    def inverted(
        self, surface: AnySurface, quantity: str, wanted: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Mean separation [length] at a pressure over E* or an area; no force is beyond the hardness."""
        self._refuse(quantity, wanted)
        u = self._each(
            lambda own, value: own.inverted(surface, quantity, value)[0], wanted
        )
        return u, np.zeros(u.shape, bool)

    def curve(self, surface: AnySurface, quantity: str) -> Any:
        return Theory.curve(self, surface, quantity)

    def interval(
        self, surface: AnySurface, quantity: str = "pressure"
    ) -> tuple[FloatArray, FloatArray]:
        return self.elastic.interval(surface, quantity)

    def bends(self, surface: AnySurface) -> FloatArray:
        return np.asarray(self._simulation(float(self.hardness)).bends(surface))

    def flow(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        return np.asarray(
            self._each(lambda own, u: own.flow(surface, u), mean_separation)
        )

    def flow_trust(
        self, surface: AnySurface, mean_separation: FloatArray, area: FloatArray
    ) -> tuple[FloatArray, dict[str, Any]]:
        names: list[str] = []

        def ask(own: Any, u: FloatArray, share: FloatArray) -> Any:
            scatter, reasons = own.flow_trust(surface, u, share)
            names[:] = reasons
            return [scatter, *reasons.values()]

        scatter, *masks = self._each(ask, mean_separation, area)
        return scatter, {name: mask > 0 for name, mask in zip(names, masks, strict=True)}

    def reasons(
        self,
        surface: AnySurface,
        answer: TheoryAnswer,
        mean_separation: FloatArray,
    ) -> dict[str, Any]:
        elastic_reasons = self.elastic.reasons(surface, answer, mean_separation)
        return {**elastic_reasons, **self._of_hardness(surface, answer)}

    def gaps(self) -> Any:
        """The simulation at one hardness."""
        return self._simulation(float(self.hardness)) if self.hardness.ndim == 0 else None

    def scatter(self, surface: AnySurface, quantity: str, area: FloatArray) -> FloatArray:
        """Standard deviation against contact at a tolerance of 1e-6.

        "stiffness", the slope of the loading curve, was not compared: NaN, but where no
        point can reach the hardness.
        """
        elastic = elastic_scatter(self.elastic, surface, quantity, area)
        measured = np.hypot(
            elastic, SCATTER.get(quantity, np.nan if quantity == "stiffness" else 0.0)
        )
        return np.where(self.is_beyond_reach(self.hardness), elastic, measured)


class Residuals(Theory):
    """The elastic contacts of a map as largest loads over A0 E* left it, each a simulation of its own."""

    def __init__(self, loading: Saturated, largest: FloatArray) -> None:
        self.loading, self.largest = loading, largest
        self.name, self.ends_at_h_max = loading.name, loading.ends_at_h_max

    def _simulation(self, cap: float, largest: float) -> BoundaryElements:
        loading = self.loading
        if largest == 0 or loading.is_beyond_reach(cap):
            return loading.elastic
        return released(loading.elastic, cap, largest)

    def _each(self, ask: Callable[..., Any], *given: ArrayLike) -> Any:
        keys = [self.loading.hardness, self.largest]
        return by_entry(keys, self._simulation, ask, given)

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        return TheoryAnswer(
            *self._each(lambda own, u: own.answer(surface, u), mean_separation)
        )

    def energy(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        return np.asarray(
            self._each(lambda own, u: own.energy(surface, u), mean_separation)
        )

    def highest(self, surface: AnySurface) -> FloatArray:
        none = np.zeros(())
        return np.asarray(
            self._each(lambda own, _: none + own.highest(surface) + _, none)
        )

    def inverted(
        self, surface: AnySurface, quantity: str, wanted: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        u = self._each(lambda own, x: own.inverted(surface, quantity, x)[0], wanted)
        return u, np.zeros(u.shape, bool)

    def scatter(self, surface: AnySurface, quantity: str, area: FloatArray) -> FloatArray:
        """That of a simulated map, at contacts of its residual shape."""
        return np.asarray(
            self._each(lambda own, x: own.scatter(surface, quantity, x), area)
        )


class UnloadedMap(Unloading):
    """A simulated map with a hardness after a largest pressure: its residual shape, pressed elastically."""

    def __init__(self, loading: Saturated, largest: ArrayLike) -> None:
        super().__init__(loading, largest)
        self.branch_theory = Residuals(loading, self.largest)

    def weights(self, yielded: FloatArray, area: FloatArray) -> tuple[Any, Any]:
        """No spots beside those of the residual shape."""
        none = 0.0 * yielded
        return (none, 1 + none, 0.5 + none), (none, 1 + none, 0.5 + none)

    def _peak(self, surface: AnySurface) -> Peak:
        # frozen and slope of the curve differ by what interpolation leaves
        peak = super()._peak(surface)
        return peak._replace(stiffness=peak.elastic.stiffness)

    def bends(self, surface: AnySurface) -> FloatArray:
        peak, tail = self._curve(surface)
        if np.size(peak.mean_separation) > 1 or not np.all(peak.remembered):
            return self.loading.bends(surface)
        return np.concatenate(
            [np.reshape(each, 1) for each in (peak.mean_separation, tail.first)]
        )

    def _elastic_separation(self, surface: AnySurface, u: FloatArray) -> FloatArray:
        # both curves differ by what interpolation between loads leaves at the largest pressure
        peak, tail = self._curve(surface)
        v = u - peak.mean_separation + peak.elastic_separation
        return np.asarray(np.clip(v, peak.elastic_separation, tail.elastic_separation))

    def scatter(self, surface: AnySurface, quantity: str, area: FloatArray) -> FloatArray:
        peak = self.peak(surface)
        on_branch = peak.remembered & (area < peak.area)
        asked = "pressure" if quantity == "energy" else quantity
        loading = self.loading.scatter(surface, asked, np.asarray(area, dtype=float))
        if not on_branch.any():
            return loading
        name = "stiffness" if asked == "unloading_stiffness" else asked
        # areas of both branches differ by what edges of yielded points take
        own_area = area * peak.elastic.area / peak.area
        own = self.branch_theory.scatter(surface, name, own_area)
        measured = SCATTER.get(
            "unloading_stiffness" if name == "stiffness" else name, 0.0
        )
        return np.where(on_branch, np.hypot(own, measured), loading)

    def gaps(self) -> Any:
        """None: flow through gaps after a larger pressure was not compared."""
        return None
