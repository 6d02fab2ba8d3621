"""Total force and area of a surface at a gap: the sum over its contact islands (Eqs. 42-50).

In units of s and 1/q0,

    F/(A0 E* q0 s) = integral_0^((h_max - d)/s) F_hat D_d K1 G d(delta/s),
    G = exp(-z'^2/2 sigma_d^2)/(sqrt(2 pi) sigma_d),   z' = (d + delta)/s - h_d (41),

and A/A0 likewise.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray, grouped, spread
from mbma_tables.common.errors import ConvergenceError, MbmaError, OutOfRangeError
from mbma_tables.common.interrupts import in_blocks
from mbma_tables.core import OK, UNRESOLVED, core
from mbma_tables.islands.island_models import AnyModel, RigidModel, exact_model
from mbma_tables.islands.variants import Variant
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.surface import MeasuredSurface, Surface
from mbma_tables.tables.island4d import Island4dModel
from mbma_tables.tables.universal import UniversalModel
from mbma_tables.theories.base import Solved
from mbma_tables.theories.mbma.island import islands_of, loads_of
from mbma_tables.theories.mbma.profile import (
    Shape,
    profile,
    shape_of,
    source_of,
    spectra_of,
)

QUADRATURE_SHARE = 0.9  # of the requested tolerance; a table's own error comes on top
BLOCK = 256  # pairs between two checks for interrupts
# most surfaces evaluated by profiles, in numpy; of more surfaces, those with enough gaps
# each for this to cost less
FEW_SURFACES = 16
MANY_GAPS = 300
LEAST = 1e-290  # sums below which the digits that are lost count
KEPT = 1024  # spectra of batches of sums of power laws
SUBNORMAL = float(np.finfo(float).smallest_subnormal)


class Sums(NamedTuple):
    """Options of the sum over islands, as for `contact`."""

    model: AnyModel
    variant: Variant
    rtol: float
    outside: str = "raise"


def totals_at(
    surface: AnySurface,
    gap: FloatArray,
    how: Sums,
    modulus: Any = 1.0,
    slopes: bool = False,
) -> Solved:
    """Force and area, perhaps with their slopes, at separations d >= -h_max.

    The separations have the surface's broadcast shape. The error is a bound on that of
    quadrature and islands, relative to the island model.
    """
    shape = gap.shape
    depth = np.asarray(surface.h_max - gap)
    # the unit of stress of the islands (Section 1), E* q0 s; of a measured surface, E*
    stress = modulus * surface.q0 * surface.s if isinstance(surface, Surface) else modulus
    # of sums of power laws that of their samples, whose profiles are summed
    height: Any = surface.h_rms
    if not isinstance(surface, Surface | MeasuredSurface):
        heights = [float(each.h_rms) for each in spectra_of(surface)]
        height = np.reshape(heights, surface.shape)
    try:
        rows, islands = _sums(surface, depth, np.asarray(depth / height), how, slopes)
    except (ConvergenceError, OutOfRangeError) as fault:
        if fault.mask is not None:
            fault.mask = fault.mask.reshape(shape)
        raise
    _add_error_of_underflow(rows)
    force = rows[0].reshape(shape)
    area_sum = rows[1].reshape(shape)
    error = rows[-1].reshape(shape)
    pressure = force * stress
    is_cover = how.variant.addition == "cover"
    area = how.variant.area_of(area_sum) if is_cover else area_sum
    if not slopes:
        return Solved(pressure[()], area[()], error[()], islands)

    # by the compression (h_max - d)/h_rms in the sums
    pressure_slope = stress * (-rows[2].reshape(shape) / height)
    area_slope = -rows[3].reshape(shape) / height
    if is_cover:
        # dA = exp(-sum) dsum
        area_slope = area_slope * np.exp(-area_sum)
    return Solved(
        pressure[()],
        area[()],
        error[()],
        islands,
        pressure_slope=pressure_slope[()],
        area_slope=area_slope[()],
    )


def _add_error_of_underflow(rows: FloatArray) -> None:
    """Add to the errors, the last row, those of nearly vanishing sums, which have few digits."""
    force = rows[0]
    area = rows[1]
    error = rows[-1]
    least = np.minimum(force, area)
    if least.min() >= LEAST:
        return
    tiny = (least < LEAST) & (np.maximum(force, area) > 0)
    if tiny.any():
        of_rounding = SUBNORMAL / least[tiny].clip(SUBNORMAL)
        error[tiny] = np.minimum(error[tiny] + of_rounding, 1.0)


def _entries_by_surface(
    surface: AnySurface, shape: tuple[int, ...], places: NDArray[np.intp]
) -> tuple[list[Shape], list[tuple[int, NDArray[np.intp]]]]:
    """The surfaces of a batch as arguments of `profile`, and the places of each one's entries."""
    shapes: list[Shape]
    if isinstance(surface, Surface):
        peak = surface.h_max / surface.h_rms
        numbers = np.array([surface.hurst, surface.zeta_1, peak])
        rows = numbers.reshape(3, -1).T.tolist()
        shapes = [(hurst, zeta_1, height) for hurst, zeta_1, height in rows]
    else:
        shapes = [*spectra_of(surface)]
    if len(shapes) == 1:
        return shapes, [(0, places)]
    owner = np.arange(len(shapes)).reshape(surface.shape)
    owner = np.broadcast_to(owner, shape).ravel()[places]
    return shapes, [(k, places[mine]) for k, mine in grouped(owner)]


def _by_profiles(
    surface: AnySurface,
    compression: FloatArray,
    places: NDArray[np.intp],
    model: AnyModel,
    how: Sums,
    rows: FloatArray,
) -> tuple[int, NDArray[np.intp], Exception | None]:
    """Fill in rows of sums and errors at flat places by profiles of islands.

    Returns the number of islands, the places left out, and why.
    """
    shapes, groups = _entries_by_surface(surface, compression.shape, places)
    gaps = compression.ravel()
    rtol = QUADRATURE_SHARE * how.rtol
    islands = 0
    left = [places[:0]]
    why: Exception | None = None
    # numbers of surfaces, places, and where a profile may end
    pending = [(k, mine, math.inf) for k, mine in groups if mine.size]
    while pending:
        k, mine, last = pending.pop()
        try:
            of_surface = profile(shapes[k], model, how.variant, rtol, last=last)
        except (ConvergenceError, OutOfRangeError) as fault:
            if last < math.inf or isinstance(model, UniversalModel):
                left.append(mine)
                why = fault
                continue
            # one by one: a model need not have deeper islands than those of the gap
            for n, place in enumerate(mine):
                pending.append((k, mine[n : n + 1], float(gaps[place])))
            continue
        is_covered = gaps[mine] <= of_surface.end
        if not is_covered.all():
            left.append(mine[~is_covered])
            mine = mine[is_covered]
        islands += of_surface.islands
        # usually all gaps are of one surface and in contact, and slices are faster
        chosen: Any = slice(None) if mine.size == gaps.size else mine
        rows[-1, chosen] = of_surface.error
        rows[:-1, chosen] = of_surface.totals(gaps[chosen], slopes=len(rows) > 3)
    return islands, np.sort(np.concatenate(left)), why


def by_table(
    surface: Surface,
    compression: FloatArray,
    places: NDArray[np.intp],
    model: UniversalModel | Island4dModel,
    how: Sums,
    rows: FloatArray,
) -> tuple[int, NDArray[np.intp]]:
    """The same by a table, gap by gap; the number of islands, and places left out."""
    shape = compression.shape
    peak = surface.h_max / surface.h_rms
    arguments = [
        spread(field, shape).ravel()[places]
        for field in (surface.hurst, surface.zeta_1, compression, peak)
    ]
    bound = np.empty(places.size)
    status = np.empty(places.size, np.uint8)
    # force and area, each with its slope
    sums = np.empty((places.size, 2, 2))
    call = core.totals
    table: tuple[Any, ...]
    if isinstance(model, UniversalModel):
        table = model.cells
    else:
        call = core.island_totals
        table = model.core_table
    options = QUADRATURE_SHARE * how.rtol, how.variant.numbers, *table

    def fill(block: slice) -> int:
        count = np.zeros(1, np.int64)
        call(
            *(argument[block] for argument in arguments),
            *options,
            sums[block],
            bound[block],
            status[block],
            count,
        )
        return int(count[0])

    islands = sum(in_blocks(fill, places.size, BLOCK))
    unresolved = places[status == UNRESOLVED]
    if unresolved.size:
        mask = np.isin(np.arange(compression.size), unresolved)
        raise ConvergenceError("quadrature did not reach its tolerance", mask)
    rows[-1, places] = bound
    # rows are force, area and, where they are wanted, both slopes
    wanted = sums[:, :, : len(rows) // 2]
    rows[:-1, places] = wanted.T.reshape(len(rows) - 1, -1)
    return islands, places[status != OK]


def _sums(
    surface: AnySurface,
    depth: FloatArray,
    compression: FloatArray,
    how: Sums,
    slopes: bool,
) -> tuple[FloatArray, int]:
    """Force, area, perhaps slopes of both by the compression, and their error as rows.

    With the number of islands. By profiles of islands; of many surfaces by a table gap by
    gap.
    """
    size = depth.size
    rows = np.zeros((5 if slopes else 3, size))
    left = np.flatnonzero(compression > 0)
    islands = 0
    why: Exception | None = None
    ranges = ""
    table = how.model if isinstance(how.model, UniversalModel | Island4dModel) else None
    has_table = isinstance(surface, Surface) and table is not None

    few = max(FEW_SURFACES, size // MANY_GAPS)
    if not has_table or math.prod(surface.shape) <= few:
        islands, left, why = _by_profiles(
            surface, compression, left, how.model, how, rows
        )
    # gap by gap, where profiles were not made, or end
    if left.size and isinstance(surface, Surface) and table is not None:
        more, left = by_table(surface, compression, left, table, how, rows)
        islands += more
        why = None
        ranges = _ranges(table)
    if left.size and how.outside == "exact":
        exact = exact_model(how.rtol)
        more, left, why = _by_profiles(surface, compression, left, exact, how, rows)
        islands += more
    if left.size and (how.outside != "nan" or isinstance(why, ConvergenceError)):
        raise _not_covered(surface, depth, left, how.model, ranges, why)
    rows[:, left] = np.nan
    return rows, islands


def _ranges(table: UniversalModel | Island4dModel) -> str:
    """What a table covers, for the message of an error."""
    texts = []
    for axis in table.content.axes:
        low = "" if axis.name == "mu" else f"{axis.low:g} <= "
        texts.append(f"{low}{axis.name} <= {axis.high:g}")
    return f" ({', '.join(texts)})"


def _not_covered(
    surface: AnySurface,
    depth: FloatArray,
    left: NDArray[np.intp],
    model: AnyModel,
    ranges: str,
    why: Exception | None,
) -> MbmaError:
    """The error for entries whose islands lie outside of a model, of the kind of `why`."""
    numbers = {"h_max - d": depth}
    if isinstance(surface, Surface):
        numbers |= {"hurst": surface.hurst, "zeta_1": surface.zeta_1}
    first = []
    for name, number in numbers.items():
        entry = spread(number, depth.shape).ravel()[left[0]]
        first.append(f"{name} = {entry:g}")
    cause = f" ({why})" if why else ""
    message = (
        f"islands of {left.size} of {depth.size} entries lie outside of island model "
        f"{model.name!r}{ranges}, the first at {', '.join(first)}; outside='exact' solves "
        f"these{cause}"
    )
    mask = np.isin(np.arange(depth.size), left)
    if isinstance(why, ConvergenceError):
        return ConvergenceError(message, mask)
    return OutOfRangeError(message, mask)


def distribution(
    surface: AnySurface,
    gap: FloatArray,
    points: int,
    how: Sums,
    of_summits: bool = False,
) -> dict[str, FloatArray]:
    """Islands of one surface at gaps d, shape (n,): their number, and how they are distributed (Eqs. 40, 42).

    Approaches `delta` are `points` up to the deepest, graded towards first contact, with
    the `force` over E* and `area` of an island there, their `error`, and by gap and
    approach the `density`; `number` is per nominal area. With `of_summits` all of a
    summit's area is in contact, eta = 1.
    """
    shape = shape_of(surface)
    h_rms = float(surface.h_rms)
    depth = np.asarray(surface.h_max - gap) / h_rms
    source = source_of(shape, how.variant)
    deepest = max(float(depth.max()), 0.0)
    fraction = np.linspace(0, 1, points + 1)[1:]
    stretched = fraction * np.arcsinh(np.sqrt(deepest / source.layer))
    delta = source.layer * np.sinh(stretched) ** 2
    # where no gap touches there is no distribution
    number = np.zeros(depth.size)
    density = np.zeros((depth.size, delta.size))
    force, area, error = np.zeros((3, delta.size))
    if deepest > 0:
        # islands are counted without an island model
        counted = profile(shape, RigidModel(), how.variant, how.rtol, rows=3)
        groups, s, q0 = islands_of(surface, delta * h_rms, how.variant)
        number[depth > 0] = counted.totals(depth[depth > 0])[2] * q0**2
        force, area, error = loads_of(how.model, groups, s, q0, how.outside)
        error = np.maximum(error, counted.error)
        if of_summits:
            area = area / groups["eta"]
        shift, rate = source.heights(groups, delta)
        spread_of_heights = source.density(groups, delta, shift - rate * depth[:, None])
        # no island approaches further than the highest one
        is_reached = delta <= depth[:, None]
        density = np.where(is_reached, spread_of_heights, 0.0) * q0**2 / s
    return {
        "number": number,
        "density": density,
        "delta": delta * h_rms,
        "force": force,
        "area": area,
        "error": error,
    }
