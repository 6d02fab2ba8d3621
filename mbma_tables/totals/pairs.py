"""Pairs of a surface and a gap, and the heights and density of islands, for sums over any island model."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from mbma_tables.arguments import FloatArray, spread
from mbma_tables.surfaces.surface import Surface

STRETCH = 8.0  # scale of the approach's map, in boundary layers zeta_1^(-H), as in the core


class Pairs(NamedTuple):
    """Flat (surface, gap) pairs in units of h_rms and 1/q0."""

    hurst: FloatArray
    zeta_1: FloatArray
    compression: FloatArray  # (h_max - d)/h_rms
    peak: FloatArray  # h_max/h_rms

    @classmethod
    def of(cls, surface: Surface, depth: FloatArray) -> Pairs:
        """Of a surface, or a batch, at h_max - d = `depth` [length], of the shape that both broadcast to."""
        scaled = depth / surface.h_rms, surface.h_max / surface.h_rms
        return cls(*(spread(f, depth.shape).flatten() for f in (surface.hurst, surface.zeta_1, *scaled)))

    def some(self, chosen: Any) -> Pairs:
        """The pairs at these places."""
        return Pairs(*(field[chosen] for field in self))


def island_height(x: Any, h_d: Any, sigma_d: Any, gap: Any, rms_over_s: Any) -> Any:
    """z'/sigma_d (41) at x = delta/h_rms; z_max is counted down from h_max, so nothing cancels at first contact."""
    return ((gap.peak - (gap.compression - x)) * rms_over_s - h_d) / sigma_d


def island_density(height: Any, D_d: Any, sigma_d: Any) -> Any:
    """Islands per nominal area and delta/s (42, 43), without K1."""
    return D_d * np.exp(-0.5 * height * height) / (math.sqrt(2.0 * math.pi) * sigma_d)


def jacobian_below(rms_over_s: Any, beta: float, printed: bool, offset: bool) -> Any:
    """K1 (47) below the kink, or what (46) gives."""
    return 1.0 - 4.0 / 3.0 * beta / (1.0 if printed else rms_over_s) if printed or offset else 1.0
