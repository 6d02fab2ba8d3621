"""Total force and area of a surface at a gap: the sum over its contact islands (Eqs. 42-50).

In units of s and 1/q0,

    F/(A0 E* q0 s) = integral_0^((h_max - d)/s) F_hat D_d K1 G d(delta/s),
    G = exp(-z'^2/2 sigma_d^2)/(sqrt(2 pi) sigma_d),   z' = (d + delta)/s - h_d (41),

and A/A0 likewise.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray, grouped, spread
from mbma_tables.common.errors import ConvergenceError, InputError, OutOfRangeError
from mbma_tables.core import OK, REASONS, UNRESOLVED, core, in_blocks
from mbma_tables.models import AnyModel, exact_model
from mbma_tables.models.universal import UniversalModel
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.surface import Surface
from mbma_tables.surfaces.variants import Variant
from mbma_tables.totals.profile import profile

QUADRATURE_SHARE = 0.9  # of the requested tolerance; a table's own error comes on top
BLOCK = 256  # pairs between two checks for interrupts
# of force and area with their derivatives: value, by hurst, ln(zeta_1), compression, peak
COLUMNS, BY_COMPRESSION = 5, 3
# most surfaces evaluated by profiles, in numpy; of more surfaces, those with enough gaps each for this to cost less
FEW_SURFACES, MANY_GAPS = 16, 300
LEAST, SUBNORMAL = 1e-290, float(np.finfo(float).smallest_subnormal)


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


class Totals(NamedTuple):
    """Force and area of the MBMA model at given separations, with the fields of `Contact`.

    `error` bounds that of quadrature and islands, relative to the island model. Derivatives on a surface given by a
    spectrum are by the separation only.
    """

    pressure: Any
    area: Any
    error: Any
    islands: int
    pressure_by: dict[str, Any] | None = None
    area_by: dict[str, Any] | None = None


def totals_at(
    surface: AnySurface, gap: FloatArray, how: Sums, modulus: Any = 1.0, derivatives: bool | str = False
) -> Totals:
    """Force and area at separations d >= -h_max of the surface's broadcast shape; `derivatives` "separation" alone."""
    shape, variant = gap.shape, how.variant
    depth = np.asarray(surface.h_max - gap)
    pressure_by = area_by = None
    stress = modulus * surface.q0 * surface.s if isinstance(surface, Surface) else modulus
    try:
        if isinstance(surface, Surface) and derivatives is True:
            pairs = Pairs.of(surface, depth)
            columns, error, islands, _ = sums_by_table(how.model, pairs, how, how.outside)
            pressure, area = columns[:, 0, 0], columns[:, 1, 0]
            pressure_by, area_by = _by_parameter(surface, columns.reshape((*shape, *columns.shape[1:])), pairs, stress)
        else:
            (pressure, area, *slopes, error), islands = _sums(surface, depth, how, bool(derivatives))
            if derivatives:
                force_slope, area_slope = (slope.reshape(shape) / surface.h_rms for slope in slopes)
                pressure_by, area_by = {"separation": -stress * force_slope}, {"separation": -area_slope}
    except (ConvergenceError, OutOfRangeError) as fault:
        if fault.mask is not None:
            fault.mask = fault.mask.reshape(shape)
        raise
    # nearly vanishing values have few digits
    least = np.minimum(pressure, area)
    if not least.min() >= LEAST and (tiny := (least < LEAST) & (np.maximum(pressure, area) > 0)).any():
        error[tiny] = np.minimum(error[tiny] + SUBNORMAL / least[tiny].clip(SUBNORMAL), 1.0)
    if variant.addition == "cover":
        if area_by is not None:
            kept = np.exp(-area.reshape(shape))  # dA = exp(-sum) dsum
            area_by = {name: (slope * kept)[()] for name, slope in area_by.items()}
        area = variant.area_of(area)
    pressure = (pressure.reshape(shape) * stress)[()]
    return Totals(pressure, area.reshape(shape)[()], error.reshape(shape)[()], islands, pressure_by, area_by)


def _by_profiles(
    surface: AnySurface, compression: FloatArray, places: NDArray[np.intp], model: AnyModel, how: Sums, rows: FloatArray
) -> tuple[int, NDArray[np.intp], Exception | None]:
    """Fill in rows of sums and errors at flat places by profiles of islands; the islands, places left out, and why."""
    shapes: list[Any] = [surface]
    if isinstance(surface, Surface):
        numbers = np.array([surface.hurst, surface.zeta_1, surface.h_max / surface.h_rms])
        shapes = list(map(tuple, numbers.reshape(3, -1).T.tolist()))
    groups = [(0, places)]
    if len(shapes) > 1:
        number = np.broadcast_to(np.arange(len(shapes)).reshape(surface.shape), compression.shape).ravel()[places]
        groups = [(k, places[mine]) for k, mine in grouped(number)]
    islands, left, why, gaps = 0, [places[:0]], None, compression.ravel()
    # numbers of surfaces, places, and where a profile may end
    asked: list[tuple[int, Any, float]] = [(k, mine, math.inf) for k, mine in groups if mine.size]
    while asked:
        k, mine, last = asked.pop()
        try:
            kept = profile(shapes[k], model, how.variant, QUADRATURE_SHARE * how.rtol, last=last)
        except (ConvergenceError, OutOfRangeError) as fault:
            if last < math.inf or isinstance(model, UniversalModel):
                left, why = [*left, mine], fault
            else:
                # one by one: a model need not have deeper islands than those of the gap
                asked += [(k, mine[n : n + 1], float(gaps[place])) for n, place in enumerate(mine)]
            continue
        inside = gaps[mine] <= kept.end
        if not inside.all():
            left.append(mine[~inside])
            mine = mine[inside]
        islands += kept.islands
        # usually all gaps are of one surface and in contact, and slices are faster
        chosen: Any = slice(None) if mine.size == gaps.size else mine
        rows[-1, chosen] = kept.error
        rows[:-1, chosen] = kept.totals(gaps[chosen], len(rows) > 3, how.workers)
    return islands, np.sort(np.concatenate(left)), why


def _sums(surface: AnySurface, depth: FloatArray, how: Sums, slopes: bool) -> tuple[FloatArray, int]:
    """Force, area, perhaps slopes of both by the compression, and their error as rows, and the number of islands.

    By profiles of islands; of many surfaces by the universal table gap by gap.
    """
    size, islands, model, why = depth.size, 0, how.model, None
    compression = np.asarray(depth / surface.h_rms)
    rows, left = np.zeros((5 if slopes else 3, size)), np.flatnonzero(compression > 0)
    by_table = isinstance(surface, Surface) and isinstance(model, UniversalModel)
    if not by_table or math.prod(surface.shape) <= max(FEW_SURFACES, size // MANY_GAPS):
        islands, left, why = _by_profiles(surface, compression, left, model, how, rows)
    if by_table and left.size:
        assert isinstance(surface, Surface)
        outside, every = "nan" if how.outside == "exact" else how.outside, Pairs.of(surface, depth)
        found, bound, more, missing = sums_by_table(model, every, how, outside, slopes)
        rows[-1, left] = bound[left]
        rows[:-1, left] = found[left][:, :, [0, BY_COMPRESSION] if slopes else [0]].T.reshape(len(rows) - 1, -1)
        islands, left = islands + more, np.intersect1d(left, missing)
    if left.size and how.outside == "exact":
        more, left, why = _by_profiles(surface, compression, left, exact_model(how.rtol), how, rows)
        islands += more
    if left.size and (how.outside != "nan" or isinstance(why, ConvergenceError)):
        raise type(why or OutOfRangeError(""))(
            f"islands of {left.size} of {size} entries lie outside of island model {model.name!r}, the first at "
            f"h_max - d = {depth.ravel()[left[0]]:g}; outside='exact' solves these{f' ({why})' if why else ''}",
            np.isin(np.arange(size), left),
        )
    rows[:, left] = np.nan
    return rows, islands


def sums_by_table(
    model: AnyModel, pairs: Pairs, how: Sums, outside: str, slopes: bool = True
) -> tuple[FloatArray, FloatArray, int, NDArray[np.intp]]:
    """Totals by the universal table gap by gap, (pairs, 2, COLUMNS or 1), bounds on their errors, and the islands.

    Also returns the pairs that the table does not cover, whose totals are NaN.
    """
    if not isinstance(model, UniversalModel):
        raise InputError(f"derivatives come from island model 'universal', {model.name!r} has none")
    if slopes and outside == "exact":
        raise InputError("derivatives come from the universal table: outside must be 'raise' or 'nan' with them")
    count = pairs.compression.size
    status, bound = np.empty(count, np.uint8), np.empty(count)
    out = np.empty((count, 2, COLUMNS if slopes else 1))

    def fill(block: slice) -> int:
        islands = np.zeros(1, np.int64)
        own = *pairs.some(block), QUADRATURE_SHARE * how.rtol, how.variant.numbers, *model.cells, int(slopes)
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


def _by_parameter(
    surface: Surface, sums: FloatArray, pairs: Pairs, stress: FloatArray
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Chain rule from H, log(zeta_1), compression and peak to the gap and the surface's own parameters."""
    shape = sums.shape[:-2]
    hurst, zeta_1, compression, peak = (field.reshape(shape) for field in pairs)
    h_rms, q0, q1 = surface.h_rms, surface.q0, surface.q1
    # log(s/h_rms) by H and by log(zeta_1): (h_rms/s)^2 = 1 - zeta_1^(-2H)
    power = -2 * hurst * np.log(zeta_1)
    lift = np.exp(power) / np.expm1(power)

    def slopes(number: int, scale: Any) -> dict[str, Any]:
        value, by_H, by_zeta, by_compression, by_peak = np.moveaxis(sums[..., number, :], -1, 0)
        # force carries q0 s
        own = np.zeros_like(value) if number else value
        by_H, by_zeta = by_H + own * lift * np.log(zeta_1), by_zeta + own * lift * hurst
        by_h_rms = (own - compression * by_compression - peak * by_peak) / h_rms
        found = {"separation": -by_compression / h_rms, "hurst": by_H, "q0": (own - by_zeta) / q0, "q1": by_zeta / q1}
        found |= {"h_rms": by_h_rms, "h_max": (by_compression + by_peak) / h_rms}
        return {name: (scale * slope)[()] for name, slope in found.items()}

    return slopes(0, stress), slopes(1, 1.0)
