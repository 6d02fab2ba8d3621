"""Laws of spectra, self-affine and measured, and what is asked of batches of them."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import FloatArray, require, spread
from mbma_tables.calibrated import CONSTANTS, Constants, Law, Spectrum, force_of
from mbma_tables.surfaces.surface import MeasuredSurface, Surface
from mbma_tables.theories import calibrated_table

TESTED_AREA = (1e-3, 0.97)
LAW_ERROR = 1e-7  # of a measured spectrum's law
KEPT = 256  # spectra and laws of surfaces that are kept while these are asked again


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
        """Whether the table holds each surface."""
        return table.covers(*self.columns[:2])

    def outside(self, mask: Any) -> list[tuple[int, Any]]:
        """Surfaces that have entries under a mask, with these."""
        return [(int(row), np.flatnonzero(mask & (self.owner == row))) for row in np.unique(self.owner[mask])]

    def law(self, row: int) -> Law:
        """The law of one surface."""
        hurst, log_zeta, heights = self.columns[:, row]
        return self_affine_law(float(hurst), float(np.exp(log_zeta)), float(heights))


@functools.lru_cache(KEPT)
def self_affine_law(hurst: float, zeta_1: float, h_max: float | None, constants: Constants = CONSTANTS) -> Law:
    """The law of a self-affine surface, kept while it is asked again."""
    return Law(Spectrum.self_affine(hurst, zeta_1), h_max, constants)


@functools.lru_cache(KEPT)
def spectrum_of(surface: MeasuredSurface) -> Spectrum:
    """The spectrum of a surface."""
    return Spectrum.from_samples(*(np.ascontiguousarray(part, float) for part in (surface.q, surface.C)))


def force_at_area(area: ArrayLike, light: ArrayLike) -> FloatArray:
    """F/(A0 E* g) at A/A0."""
    from scipy.special import erfinv

    share = np.asarray(area, float)
    require("area", share, (share >= 0) & (share < 1), "below 1, which is reached at infinite load")
    return force_of(erfinv(share), light)


def area_concerns(area: FloatArray) -> dict[str, Any]:
    """Contact fractions that were not simulated, or hardly."""
    low, high = TESTED_AREA
    return {
        f"A/A0 is below {low:g}": (area > 0) & (area < low),
        f"A/A0 is above {high:g}": area > high,
    }
