"""Total force and area of a surface at a gap: the sum over its contact islands (Eqs. 44-50).

All properties of an island depend on its approach delta alone; the gap enters through the Gaussian weight and
the upper limit h_max - d. In units of s and 1/q0,

    F/(A0 E* q0 s) = integral_0^((h_max - d)/s) F_hat D_d K1 G d(delta/s),
    G = exp(-z'^2/2 sigma_d^2)/(sqrt(2 pi) sigma_d),   z' = (d + delta)/s - h_d (41),

and A/A0 likewise.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray, grouped
from mbma_tables.common.errors import ConvergenceError, OutOfRangeError
from mbma_tables.models import AREA, BOTH, FORCE, AnyModel
from mbma_tables.models.universal import UniversalModel
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.surface import Surface
from mbma_tables.surfaces.variants import Variant
from mbma_tables.totals.island_sum import BY_COMPRESSION, QUADRATURE_SHARE, Pairs, sums_by_table, totals_of
from mbma_tables.totals.profile import profile

# most surfaces evaluated by profiles, in numpy; of more surfaces, those with enough gaps each for this to cost less
FEW_SURFACES, MANY_GAPS = 16, 300
LEAST, SUBNORMAL = 1e-290, float(np.finfo(float).smallest_subnormal)


@dataclasses.dataclass(frozen=True, eq=False)
class Totals:
    """Force and area of the MBMA model at given separations, with the fields of `Contact`.

    `error` bounds that of quadrature and islands, relative to the island model ("rigid" itself is far from
    elastic islands). Derivatives on a surface given by a spectrum are with respect to the separation only.
    """

    pressure: Any
    area: Any
    error: Any
    islands: int
    pressure_by: dict[str, Any] | None = None
    area_by: dict[str, Any] | None = None


class Sums(NamedTuple):
    """How islands are summed; options as of `contact`."""

    model: AnyModel
    variant: Variant
    rtol: float
    outside: str = "raise"
    workers: int = 1


def totals_at(
    surface: AnySurface,
    gap: FloatArray,
    how: Sums,
    modulus: Any = 1.0,
    derivatives: bool | str = False,
    which: int = BOTH,
) -> Totals:
    """Force and area at separations d >= -h_max of the surface's broadcast shape; `derivatives` "separation" alone."""
    shape, variant = gap.shape, how.variant
    depth = np.asarray(surface.h_max - gap)
    pressure_by = area_by = None
    stress = modulus * surface.q0 * surface.s if isinstance(surface, Surface) else modulus
    try:
        if isinstance(surface, Surface) and derivatives is True:
            pairs = Pairs.of(surface, depth)
            columns, error, islands, _ = sums_by_table(how.model, pairs, variant, how.rtol, how.outside, how.workers)
            pressure, area = columns[:, 0, 0], columns[:, 1, 0]
            pressure_by, area_by = _by_parameter(surface, columns.reshape((*shape, *columns.shape[1:])), pairs, stress)
        else:
            sums, error, islands = _sums(surface, depth, how, which, bool(derivatives))
            pressure, area = sums[:2]
            if derivatives:
                force_slope, area_slope = sums[2:].reshape(2, *shape) / surface.h_rms
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
    return Totals(
        pressure=(pressure.reshape(shape) * stress)[()] if which != AREA else None,
        area=area.reshape(shape)[()] if which != FORCE else None,
        error=error.reshape(shape)[()],
        islands=islands,
        pressure_by=pressure_by if which != AREA else None,
        area_by=area_by if which != FORCE else None,
    )


def _by_profiles(
    surface: AnySurface, depth: FloatArray, how: Sums, sums: FloatArray, error: FloatArray
) -> tuple[int, NDArray[np.intp]]:
    """Fill in sums, perhaps their slopes by the compression, and errors; returns islands, and gaps not computed."""
    compression, islands = np.asarray(depth / surface.h_rms).ravel(), 0
    touching = np.flatnonzero(compression > 0)
    left, groups = [touching[:0]], {0: touching}
    # gaps outside the table are solved one by one
    shapes: list[Any] = [surface]
    outside = how.outside
    if isinstance(surface, Surface):
        numbers = np.array([surface.hurst, surface.zeta_1, surface.h_max / surface.h_rms])
        shapes, outside = list(map(tuple, numbers.reshape(3, -1).T.tolist())), "nan"
    if len(shapes) > 1:
        number = np.broadcast_to(np.arange(len(shapes)).reshape(surface.shape), depth.shape).ravel()[touching]
        groups = {k: touching[mine] for k, mine in grouped(number)}
    for k, places in groups.items():
        if not places.size:
            continue
        try:
            kept = profile(shapes[k], how.model, how.variant, QUADRATURE_SHARE * how.rtol, outside)
        except (ConvergenceError, OutOfRangeError):
            if not isinstance(surface, Surface):
                raise
            left.append(places)
            continue
        inside = compression[places] <= kept.end
        if not inside.all():
            left.append(places[~inside])
            places = places[inside]
        islands += kept.islands
        # usually all gaps are of one surface and in contact, and slices are faster
        chosen: Any = slice(None) if places.size == compression.size else places
        error[chosen] = kept.error
        sums[:, chosen] = kept.totals(compression[chosen], len(sums) > 2, how.workers)
    return islands, np.sort(np.concatenate(left))


def _sums(
    surface: AnySurface, depth: FloatArray, how: Sums, which: int, slopes: bool
) -> tuple[FloatArray, FloatArray, int]:
    """Force, area and perhaps slopes of both by the compression as rows, their error, islands.

    By profiles of islands if there are few surfaces or many gaps for each, else gap by gap.
    """
    size, islands, left = depth.size, 0, np.arange(depth.size)
    sums, error = np.zeros((4 if slopes else 2, size)), np.zeros(size)
    few = math.prod(surface.shape) <= max(FEW_SURFACES, size // MANY_GAPS)
    if not isinstance(surface, Surface) or (isinstance(how.model, UniversalModel) and few):
        islands, left = _by_profiles(surface, depth, how, sums, error)
        if not left.size:
            return sums, error, islands
    if not isinstance(surface, Surface):
        sums[:, left] = error[left] = np.nan
        if how.outside == "raise":
            raise OutOfRangeError(
                f"islands of {left.size} of {size} entries lie outside of island model {how.model.name!r}, the first "
                f"at h_max - d = {depth.ravel()[left[0]]:g}; outside='exact' solves these",
                np.isin(np.arange(size), left),
            )
        return sums, error, islands
    # gap by gap, with errors for each
    rest = Pairs.of(surface, depth)
    rest = rest if left.size == size else rest.some(left)
    options = how.variant, how.rtol, how.outside
    try:
        if slopes:
            columns, error[left], more, _ = sums_by_table(how.model, rest, *options, how.workers)
            sums[:, left] = columns[:, :, [0, BY_COMPRESSION]].T.reshape(4, -1)
        else:
            sums[0, left], sums[1, left], error[left], more = totals_of(how.model, rest, *options, which, how.workers)
    except (ConvergenceError, OutOfRangeError) as fault:
        mask = np.zeros(size, dtype=bool)
        mask[left] = True if fault.mask is None else fault.mask
        fault.mask, fault.args = mask, (str(fault).replace(f"of {left.size} entries", f"of {size} entries"),)
        raise
    return sums, error, islands + more


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
    answers = []
    for number, scale in enumerate((stress, 1.0)):
        value, by_H, by_zeta, by_compression, by_peak = np.moveaxis(sums[..., number, :], -1, 0)
        # force carries q0 s
        own = np.zeros_like(value) if number else value
        by_H, by_zeta = by_H + own * lift * np.log(zeta_1), by_zeta + own * lift * hurst
        found = {
            "separation": -by_compression / h_rms,
            "hurst": by_H,
            "q0": (own - by_zeta) / q0,
            "q1": by_zeta / q1,
            "h_rms": (own - compression * by_compression - peak * by_peak) / h_rms,
            "h_max": (by_compression + by_peak) / h_rms,
        }
        answers.append({name: (scale * slope)[()] for name, slope in found.items()})
    return answers[0], answers[1]
