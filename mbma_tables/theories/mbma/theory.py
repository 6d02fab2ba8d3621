"""The MBMA model as a theory: totals of its islands at separations d = 2 u - h_max (50), and their range."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, require
from mbma_tables.common.shared import shared_property
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.surface import MeasuredSurface, Surface
from mbma_tables.theories.base import Curve, Theory, TheoryAnswer, select
from mbma_tables.theories.mbma.geometry import kinks
from mbma_tables.theories.mbma.island import check_band
from mbma_tables.theories.mbma.island_models import (
    QUANTITIES,
    AnyModel,
    check_outside,
    island_model_name,
)
from mbma_tables.theories.mbma.profile import profile
from mbma_tables.theories.mbma.sums import QUADRATURE_SHARE, Sums, Totals, totals_at
from mbma_tables.theories.mbma.tables import get_model
from mbma_tables.theories.mbma.variants import NAMED, Variant, get_variant

SCAN = 49  # compressions at which force, area and stiffness are searched for a maximum
POINTS, REFINED = (
    9,
    8,
)  # points of a scan's step, and how often those beside the highest one bound the next

MAX_AREA = 0.1  # above it islands begin to overlap (docs/fidelity.md)


class Mbma(Theory):
    """The MBMA model of one island model and variant.

    Parameters
    ----------
    island model, variant, rtol, outside
        As for `mbma_tables.contact`.
    """

    name = "mbma"
    advice = "theory='calibrated' for stiffness or separation"

    def __init__(
        self,
        island_model: str | AnyModel = "universal",
        variant: str | Variant = "reported",
        rtol: float = 1e-8,
        outside: str = "raise",
    ) -> None:
        check_outside(outside)
        self.island_model, self.variant, self.rtol, self.outside = (
            island_model,
            get_variant(variant),
            rtol,
            outside,
        )
        self.variant_name, self.island_model_name = (
            self.variant.name,
            island_model_name(island_model),
        )

    @shared_property
    def sums(self) -> Sums:
        """The island model as an object, and how its islands are summed."""
        model = get_model(self.island_model, self.rtol, self.variant)
        return Sums(model, self.variant, self.rtol, self.outside)

    @shared_property
    def _scanned(self) -> Mbma:
        """The same theory, but with NaN instead of errors for islands that are not covered."""
        if self.outside != "raise":
            return self
        return Mbma(self.island_model, self.variant, self.rtol, "nan")

    def __reduce__(self) -> tuple[Any, ...]:
        return Mbma, (self.island_model, self.variant, self.rtol, self.outside)

    def totals(
        self,
        surface: AnySurface,
        separation: FloatArray,
        E_star: ArrayLike = 1.0,
        slopes: bool = False,
    ) -> Totals:
        """Force and area at separations d [length] of the surface's broadcast shape."""
        gap = np.asarray(separation, float)
        require(
            "separation",
            gap,
            gap >= -surface.h_max,
            "at least -h_max, where the model ends at full compression",
        )
        if isinstance(surface, Surface):
            check_band(surface, self.variant)
        return totals_at(surface, gap, self.sums, E_star, slopes)

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness at mean separations u [length] from 0 to h_max."""
        u = np.asarray(mean_separation, dtype=float)
        found = self.totals(surface, 2 * u - np.asarray(surface.h_max), slopes=True)
        # du = dd/2
        return TheoryAnswer(
            found.pressure, found.area, -2 * found.pressure_slope, found.error
        )

    def curve(self, surface: AnySurface, quantity: str) -> Curve:
        h_max, which = np.asarray(surface.h_max), QUANTITIES.index(quantity)

        def values(u: FloatArray) -> tuple[Any, Any, bool]:
            found = totals_at(surface, 2 * u - h_max, self.sums, 1.0, slopes=True)
            steep = -2 * found.pressure_slope
            return (
                (found.area, found.area * steep / found.pressure, False)
                if which
                else (found.pressure, steep, True)
            )

        return values

    def bends(self, surface: AnySurface) -> FloatArray:
        """Mean separations [length] at which the largest island reaches the floor of zeta_d, and of zeta_u."""
        if not isinstance(surface, Surface):
            return np.empty(0)
        places = np.array(
            kinks(surface.hurst, surface.zeta_1, self.variant)
        ) * np.asarray(surface.h_rms)
        u = np.asarray(surface.h_max) - places / 2
        return np.asarray(u[u > 0] if surface.shape == () else np.maximum(u, 0))

    def interval(
        self, surface: AnySurface, quantity: str = "pressure"
    ) -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] from where force or area is largest, or the table ends, to first contact."""
        lowest = np.zeros(surface.shape)
        if isinstance(surface, MeasuredSurface):
            # islands up to an approach of 2 h_max make u = 0
            kept = profile(
                surface,
                self.sums.model,
                self.variant,
                QUADRATURE_SHARE * self.rtol,
                self.outside,
            )
            end = float(kept.edges[-1]) / (2 * kept.source.peak)
            lowest = np.asarray(surface.h_max * (1 - end))
        else:
            check_band(surface, self.variant)
        return self._maximum(surface, quantity, lowest), np.asarray(
            surface.h_max, dtype=float
        )

    def softening(self, surface: AnySurface) -> FloatArray:
        """Mean separation [length] below which stiffness falls with compression; NaN where it does not."""
        return self._maximum(surface, "stiffness", np.full(surface.shape, np.nan))

    def scatter_name(self, surface: AnySurface) -> str:
        """Scatter of the variant: only the named ones were compared with boundary elements."""
        name = self.variant.name
        if self.variant not in NAMED.values():
            return f"{self.name}, user-defined variant"
        return self.name if name == "reported" else f"{self.name}_{name}"

    def reasons(
        self, surface: AnySurface, answer: TheoryAnswer, mean_separation: FloatArray
    ) -> dict[str, Any]:
        return {
            **super().reasons(surface, answer, mean_separation),
            f"areas of islands are added without overlap, but A/A0 is above {MAX_AREA:g}": (
                answer.area > MAX_AREA
            )
            & (self.variant.addition == "sum"),
            "stiffness falls with compression here, which no simulation shows": mean_separation
            < self.softening(surface),
        }

    def _maximum(
        self, surface: AnySurface, quantity: str, otherwise: FloatArray
    ) -> FloatArray:
        """Mean separation of the first local maximum of a quantity under compression, or `otherwise`."""
        kind, row = ("pressure", 1) if quantity == "stiffness" else (quantity, 0)
        depth = np.arange(1, SCAN + 1) / SCAN
        h_max = np.asarray(surface.h_max, dtype=float)
        batch = select(
            surface, surface.shape, np.arange(h_max.size).reshape(*surface.shape, 1)
        )
        # entries whose islands are not covered are ignored
        found = self._scanned.curve(batch, kind)(h_max[..., None] * (1 - depth))[row]
        falls = np.diff(np.reshape(found, (-1, SCAN)), axis=-1) < 0
        turns = np.flatnonzero(falls.any(axis=-1))
        result = np.array(otherwise, dtype=float).reshape(-1)
        if turns.size:
            peak, top = falls[turns].argmax(axis=-1), h_max.ravel()[turns]
            curve = self._scanned.curve(select(surface, surface.shape, turns), kind)
            low, high, own = (
                np.maximum(peak, 0.5) / SCAN,
                (peak + 2) / SCAN,
                np.arange(turns.size),
            )
            for _ in range(REFINED):  # scipy.optimize takes 0.3 s to import
                x = np.linspace(low, high, POINTS)
                values = np.nan_to_num(curve(top * (1 - x))[row], nan=-np.inf)
                highest = values.argmax(axis=0).clip(1, POINTS - 2)
                low, high = x[highest - 1, own], x[highest + 1, own]
            result[turns] = top * (1 - (low + high) / 2)
        return result.reshape(surface.shape)
