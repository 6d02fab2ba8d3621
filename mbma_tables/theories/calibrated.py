"""The law calibrated on boundary elements as a theory: self-affine surfaces by its table, others by the law itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, grouped, require, spread
from mbma_tables.laws.calibrated import TESTED_AREA, Law, force_at_area, light_factor, self_affine_law
from mbma_tables.laws.calibrated import area as law_area
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.spectral import PRESSED
from mbma_tables.surfaces.surface import MeasuredSurface, Surface
from mbma_tables.theories import calibrated_table
from mbma_tables.theories.protocol import Theory, TheoryAnswer

if TYPE_CHECKING:
    from mbma_tables.theories.calibrated_curves import OwnLaw

TESTED_HURST, TESTED_ZETA_1 = 0.2, 128.0
# h_max/h_rms: simulated up to 5.5, beyond which separation and stiffness change by 0.1% at most from 0.1% contact on
TESTED_HEIGHTS = (2.5, 8.0)
NEAREST = 0.95  # of h_max: where the certificate of the table ends
TAIL = 3.0, 0.9  # u/h_rms from which the table's error grows, and how fast: exp(0.9 (u/h_rms - 3))
# standard deviations that come on top of what is stated for Gaussian maps, of maps without `departures` and of others;
# of docs/data/machined.nc, where so many leave 70% within one and 93.5% within two
MAP_SCATTER = {"area": (0.038, 0.075), "pressure": (0.046, 0.13), "stiffness": (0.13, 0.21)}
ROUNDING = 1e-14  # what a separation loses beside h_max


def _own_law(surface: MeasuredSurface) -> OwnLaw:
    # what maps need of scipy takes long to import
    from mbma_tables.theories.calibrated_curves import own_law

    return own_law(surface)


def _error(stated: Any, nearer: float, share: FloatArray) -> FloatArray:
    """Relative error at shares of h_max; nearer to it than NEAREST force is a small difference, which loses digits."""
    near = (share > NEAREST) & (share < 1)
    error = np.array(np.broadcast_to(stated, share.shape))
    error[near] = nearer * error[near] + ROUNDING / (1 - share[near])
    return error


class Places:
    """A batch of surfaces and numbers that broadcast with it, flat."""

    def __init__(self, surface: Surface, value: ArrayLike) -> None:
        self.shape = np.broadcast_shapes(np.shape(value), surface.shape)
        self.flat = np.ascontiguousarray(spread(np.asarray(value, float), self.shape)).ravel()
        hurst = np.asarray(surface.hurst, float).ravel()
        zeta_1, h_rms = np.asarray(surface.zeta_1, float).ravel(), np.asarray(surface.h_rms, float).ravel()
        self.columns = np.array([hurst, np.log(zeta_1), np.asarray(surface.h_max, float).ravel() / h_rms])
        number = np.arange(hurst.size).reshape(surface.shape)
        self.owner = np.ascontiguousarray(spread(number, self.shape)).ravel()
        self.h_rms = h_rms[self.owner] if hurst.size > 1 else h_rms
        gradient = np.asarray(surface.rms_gradient, float).ravel()
        self.gradient = gradient[self.owner] if hurst.size > 1 else gradient

    def covered(self, table: calibrated_table.Table) -> Any:
        """Whether the table holds each surface, up to its last contact."""
        return table.covers(*self.columns[:2]) & (self.columns[2] <= np.exp(table.covered[2, 1]))

    def outside(self, mask: Any) -> list[tuple[int, Any]]:
        """Surfaces that have entries under a mask, with these."""
        chosen = np.flatnonzero(mask)
        return [(row, chosen[mine]) for row, mine in grouped(self.owner[chosen])]

    def law(self, row: int) -> Law:
        """The law of one surface."""
        hurst, log_zeta, heights = self.columns[:, row]
        return self_affine_law(float(hurst), float(np.exp(log_zeta)), float(heights))


def area_concerns(area: FloatArray) -> dict[str, Any]:
    """Contact fractions that were not simulated, or hardly."""
    low, high = TESTED_AREA
    return {f"A/A0 is below {low:g}": (area > 0) & (area < low), f"A/A0 is above {high:g}": area > high}


class Calibrated(Theory):
    """Persson's energy integral with cover and weight calibrated on boundary elements.

    Self-affine surfaces are answered by its table, those outside of it (H below 0.1, zeta_1 above 1e5,
    h_max above 8 h_rms) by the law's
    quadrature. A surface that is its own spectrum is answered by that; where its heights were
    measured, they decide the separation, and where they were measured as a map, its tops and valleys the area, too.
    """

    name = "calibrated"

    def interval(self, surface: AnySurface, quantity: str = "pressure") -> tuple[FloatArray, FloatArray]:
        """From full contact, or where a map's curve ends before, to last contact."""
        low, high = super().interval(surface, quantity)
        return (np.asarray(_own_law(surface).end) if isinstance(surface, MeasuredSurface) else low), high

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness at mean separations u [length]; without bound at u = 0."""
        if isinstance(surface, MeasuredSurface):
            gap = np.asarray(mean_separation, float)
            require("mean_separation", gap, gap >= 0, "at least 0")
            (pressure, area, stiffness), own_error = _own_law(surface).answer(gap)
            error = _error(own_error, 1.0, gap / np.asarray(surface.h_max))
            return TheoryAnswer(pressure, area, stiffness, error)
        assert isinstance(surface, Surface)
        table, places = calibrated_table.shipped(), Places(surface, mean_separation)
        u = places.flat / places.h_rms
        require("mean_separation", places.flat.reshape(places.shape), u.reshape(places.shape) >= 0, "at least 0")
        out = table.fill(places.columns, places.owner, u)
        for row, mine in places.outside(~places.covered(table)[places.owner]):
            out[:, mine] = places.law(row).contact(u[mine])
        out[0] *= places.gradient
        out[2] *= places.gradient
        out[2] /= places.h_rms
        pressure, area, stiffness = out.reshape(3, *places.shape)
        share = (u / places.columns[2][places.owner]).reshape(places.shape)
        start, rate = TAIL
        stated = table.error * np.exp(rate * np.clip(u - start, 0, TESTED_HEIGHTS[1] - start)).reshape(places.shape)
        return TheoryAnswer(pressure, area, stiffness, _error(stated, 2.0, share))

    def mean_separation_at(self, surface: AnySurface, quantity: str, wanted: FloatArray) -> FloatArray:
        """Mean separation u [length] at a force over A0 E* or an area below 1; h_max at zero."""
        if isinstance(surface, MeasuredSurface):
            return _own_law(surface).mean_separation(quantity, np.asarray(wanted, float))
        assert isinstance(surface, Surface)
        table, places = calibrated_table.shipped(), Places(surface, wanted)
        if quantity == "area":
            light = np.broadcast_to(light_factor(surface.alpha), places.shape)
            loads = force_at_area(places.flat.reshape(places.shape), light).ravel()
        else:
            loads = places.flat / places.gradient
        # zero load is last contact
        u, loaded, covered = np.full(loads.size, np.inf), loads > 0, places.covered(table)[places.owner]
        some = np.flatnonzero(covered & loaded)
        u[some] = table.separations(places.columns, places.owner[some], loads[some])
        for row, mine in places.outside(~covered & loaded):
            u[mine] = places.law(row).separation(np.maximum(loads[mine], 1e-300))
        require(quantity, np.broadcast_to(wanted, places.shape), ~np.isnan(u).reshape(places.shape), "less: u is 0")
        return np.asarray(np.minimum((u * places.h_rms).reshape(places.shape), surface.h_max))

    def area_at(self, surface: AnySurface, pressure: FloatArray) -> FloatArray:
        """A/A0 at a force over A0 E*, but for a map in closed form."""
        if isinstance(surface, MeasuredSurface):
            return _own_law(surface).area(np.asarray(pressure, float))
        return law_area(
            pressure / np.asarray(surface.rms_gradient), surface.alpha, calibrated_table.shipped().constants
        )

    def bearing_share(self, surface: AnySurface, mean_separation: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Share of heights above the level whose mean gap is u, and its derivative: measured heights, or Gaussian."""
        heights = _own_law(surface).heights if isinstance(surface, MeasuredSurface) else None
        if heights is None:
            return super().bearing_share(surface, mean_separation)
        share, slope = heights(np.asarray(mean_separation) / np.asarray(surface.h_rms))
        return share, slope / np.asarray(surface.h_rms)

    def concerns(self, surface: AnySurface, answer: TheoryAnswer, mean_separation: FloatArray) -> dict[str, Any]:
        """Reasons for which answers lie outside what boundary elements have tested."""
        if isinstance(surface, MeasuredSurface):
            law = _own_law(surface)
            straight = np.zeros(answer.area.shape, dtype=bool)
            if law.curve is not None:
                straight |= law.curve.straight(np.asarray(mean_separation) / law.h_rms)
            text = "the map's tops and valleys contradict each other: one stiffness stands for a range of forces"
            return {text: straight & (answer.area >= TESTED_AREA[0])} | area_concerns(answer.area)
        assert isinstance(surface, Surface)
        heights = np.asarray(surface.h_max / surface.h_rms)
        reasons = {
            f"the Hurst exponent is below {TESTED_HURST:g}": np.asarray(surface.hurst) < TESTED_HURST * (1 - 1e-9),
            f"zeta_1 is above {TESTED_ZETA_1:g}": np.asarray(surface.zeta_1) > TESTED_ZETA_1 * (1 + 1e-9),
            f"h_max/h_rms is outside {TESTED_HEIGHTS}": (heights < TESTED_HEIGHTS[0]) | (heights > TESTED_HEIGHTS[1]),
        }
        found = {text: np.broadcast_to(mask, answer.area.shape) for text, mask in reasons.items()}
        return found | area_concerns(answer.area)

    def departures(self, surface: AnySurface) -> tuple[str, ...]:
        """Why a measured surface is not like those that boundary elements have tested."""
        return surface.departures(by_map=self.scatter_name(surface) != self.name)

    def scatter(self, surface: AnySurface, quantity: str, area: FloatArray) -> FloatArray:
        """As of any theory; of maps with what comes on top of that of Gaussian ones."""
        if self.scatter_name(surface) == self.name:
            return super().scatter(surface, quantity, area)
        assert isinstance(surface, MeasuredSurface)
        if surface.outside(PRESSED):
            return np.full(np.shape(area), np.nan)
        stated = calibrated_table.shipped().standard_deviation(self.scatter_name(surface), quantity, area)
        return np.hypot(stated, MAP_SCATTER[quantity][bool(self.departures(surface))])

    def scatter_name(self, surface: AnySurface) -> str:
        """With a map at hand scatter is much smaller."""
        by_map = isinstance(surface, MeasuredSurface) and surface.bearing is not None
        return f"{self.name}_map" if by_map else self.name
