"""Sums over islands by the universal table, gap by gap in the core, and what all sums need (Eqs. 42-47)."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray, spread
from mbma_tables.common.errors import ConvergenceError, InputError, OutOfRangeError
from mbma_tables.core import OK, REASONS, UNRESOLVED, core, in_blocks
from mbma_tables.islands.geometry import floor_offset
from mbma_tables.models import AnyModel
from mbma_tables.models.universal import UniversalModel
from mbma_tables.surfaces.surface import Surface
from mbma_tables.surfaces.variants import Variant

QUADRATURE_SHARE = 0.9  # of the requested tolerance; a table's own error comes on top
BLOCK = 256  # pairs between two checks for interrupts
# of force and area with their derivatives: value, by hurst, ln(zeta_1), compression, peak
COLUMNS, BY_COMPRESSION = 5, 3


class Sums(NamedTuple):
    """Options of the sum over islands, as for `contact`."""

    model: AnyModel
    variant: Variant
    rtol: float
    outside: str = "raise"
    workers: int = 1


class Pairs(NamedTuple):
    """Flat (surface, gap) pairs in units of h_rms and 1/q0."""

    hurst: FloatArray
    zeta_1: FloatArray
    compression: FloatArray  # (h_max - d)/h_rms
    peak: FloatArray  # h_max/h_rms

    @classmethod
    def of(cls, surface: Surface, depth: FloatArray) -> Pairs:
        """The pairs of a surface, or a batch, at h_max - d = `depth` [length], of the shape that both broadcast to."""
        scaled = depth / surface.h_rms, surface.h_max / surface.h_rms
        return cls(*(spread(f, depth.shape).flatten() for f in (surface.hurst, surface.zeta_1, *scaled)))

    def some(self, chosen: Any) -> Pairs:
        """The pairs at these indices."""
        return Pairs(*(field[chosen] for field in self))


def island_density(height: Any, D_d: Any, sigma_d: Any) -> Any:
    """Islands per nominal area and delta/s (42, 43), without K1."""
    return D_d * np.exp(-0.5 * height * height) / (math.sqrt(2.0 * math.pi) * sigma_d)


def jacobian_below(rms_over_s: Any, variant: Variant) -> Any:
    """K1 below the kink, by (47) or (46)."""
    printed = variant.jacobian == "printed"
    return 1.0 - 4.0 / 3.0 * variant.beta / (1.0 if printed else rms_over_s) if printed or variant.offset else 1.0


def kinks(hurst: Any, zeta_1: Any, variant: Variant) -> tuple[Any, Any]:
    """delta/h_rms at which zeta_d (27) and zeta_u (30) reach their floors; arrays of one shape."""
    rms_over_s = np.sqrt(-np.expm1(-2 * hurst * np.log(zeta_1)))
    slope_d, slope_u = 4 / 3 * variant.beta, variant.phi / (1 + variant.phi) * rms_over_s
    at_d, at_u = (np.sqrt(floor_offset(hurst, zeta_1, floor)) for floor in (variant.floor_d, variant.floor_u))
    return (at_d / slope_d)[()], (at_u / slope_u)[()]


def sums_by_table(
    model: AnyModel, pairs: Pairs, how: Sums, outside: str, slopes: bool = True
) -> tuple[FloatArray, FloatArray, int, NDArray[np.intp]]:
    """Totals, (pairs, 2, COLUMNS or 1) with or without derivatives, the bound on their error, and the islands.

    Also returns the pairs that the table does not cover, whose totals are NaN.
    """
    if not isinstance(model, UniversalModel):
        raise InputError(f"derivatives come from island model 'universal', {model.name!r} has none")
    if slopes and outside == "exact":
        raise InputError("derivatives come from the universal table: outside must be 'raise' or 'nan' with them")
    count, numbers = pairs.compression.size, how.variant.numbers
    status, bound = np.empty(count, np.uint8), np.empty(count)
    out = np.empty((count, 2, COLUMNS if slopes else 1))

    def fill(block: slice) -> int:
        islands = np.zeros(1, np.int64)
        own = *pairs.some(block), QUADRATURE_SHARE * how.rtol, numbers, *model.cells, int(slopes)
        core.totals(*own, out[block], bound[block], status[block], islands)
        return int(islands[0])

    islands = sum(in_blocks(fill, count, BLOCK, how.workers))
    if (status == UNRESOLVED).any():
        raise ConvergenceError("quadrature did not reach its tolerance", status == UNRESOLVED)
    missing = np.flatnonzero(status != OK)
    if missing.size and outside == "raise":
        first = int(missing[0])
        X, mu = model.content.axes
        raise OutOfRangeError(
            f"islands of {missing.size} of {count} entries lie outside the universal table "
            f"({X.low:g} <= X <= {X.high:g}, mu <= {mu.high:g}), the first at hurst = {pairs.hurst[first]:g}, "
            f"zeta_1 = {pairs.zeta_1[first]:g}, (h_max - d)/h_rms = {pairs.compression[first]:g} "
            f"({REASONS[int(status[first])]}); outside='exact' solves these",
            status != OK,
        )
    return out, bound, islands, missing
