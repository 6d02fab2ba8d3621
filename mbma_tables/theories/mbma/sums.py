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
from mbma_tables.common.errors import ConvergenceError, OutOfRangeError
from mbma_tables.common.interrupts import in_blocks
from mbma_tables.core import OK, UNRESOLVED, core
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.surface import Surface
from mbma_tables.theories.mbma.island_models import AnyModel, exact_model
from mbma_tables.theories.mbma.profile import profile
from mbma_tables.theories.mbma.universal import UniversalModel
from mbma_tables.theories.mbma.variants import Variant

QUADRATURE_SHARE = 0.9  # of the requested tolerance; a table's own error comes on top
BLOCK = 256  # pairs between two checks for interrupts
# most surfaces evaluated by profiles, in numpy; of more surfaces, those with enough gaps
# each for this to cost less
FEW_SURFACES, MANY_GAPS = 16, 300
LEAST, SUBNORMAL = 1e-290, float(np.finfo(float).smallest_subnormal)


class Sums(NamedTuple):
    """Options of the sum over islands, as for `contact`."""

    model: AnyModel
    variant: Variant
    rtol: float
    outside: str = "raise"


class Totals(NamedTuple):
    """Force and area of the MBMA model at given separations, with the fields of `Contact`."""

    pressure: Any
    area: Any
    error: Any  # bound on that of quadrature and islands, relative to the island model
    islands: int
    pressure_slope: Any = None  # derivatives by the separation
    area_slope: Any = None


def totals_at(
    surface: AnySurface,
    gap: FloatArray,
    how: Sums,
    modulus: Any = 1.0,
    slopes: bool = False,
) -> Totals:
    """Force and area, perhaps with their slopes, at separations d >= -h_max of the surface's broadcast shape."""
    shape, depth = gap.shape, np.asarray(surface.h_max - gap)
    stress = modulus * surface.q0 * surface.s if isinstance(surface, Surface) else modulus
    try:
        rows, islands = _sums(surface, depth, how, slopes)
    except (ConvergenceError, OutOfRangeError) as fault:
        if fault.mask is not None:
            fault.mask = fault.mask.reshape(shape)
        raise
    force, area, *_, error = rows
    # nearly vanishing values have few digits
    least = np.minimum(force, area)
    if (
        not least.min() >= LEAST
        and (tiny := (least < LEAST) & (np.maximum(force, area) > 0)).any()
    ):
        error[tiny] = np.minimum(
            error[tiny] + SUBNORMAL / least[tiny].clip(SUBNORMAL), 1.0
        )
    by: list[Any] = [-row.reshape(shape) / surface.h_rms for row in rows[2:-1]]
    by[:1] = [stress * slope for slope in by[:1]]
    if how.variant.addition == "cover":
        by[1:] = [
            slope * np.exp(-area.reshape(shape)) for slope in by[1:]
        ]  # dA = exp(-sum) dsum
        area = how.variant.area_of(area)
    pressure, area, error = (
        (force.reshape(shape) * stress)[()],
        area.reshape(shape)[()],
        error.reshape(shape)[()],
    )
    return Totals(pressure, area, error, islands, *(slope[()] for slope in by))


def _by_profiles(
    surface: AnySurface,
    compression: FloatArray,
    places: NDArray[np.intp],
    model: AnyModel,
    how: Sums,
    rows: FloatArray,
) -> tuple[int, NDArray[np.intp], Exception | None]:
    """Fill in rows of sums and errors at flat places by profiles of islands; the islands, places left out, and why."""
    shapes: list[Any] = [surface]
    if isinstance(surface, Surface):
        numbers = np.array([surface.hurst, surface.zeta_1, surface.h_max / surface.h_rms])
        shapes = list(map(tuple, numbers.reshape(3, -1).T.tolist()))
    groups = [(0, places)]
    if len(shapes) > 1:
        number = np.broadcast_to(
            np.arange(len(shapes)).reshape(surface.shape), compression.shape
        ).ravel()[places]
        groups = [(k, places[mine]) for k, mine in grouped(number)]
    islands, left, why, gaps = 0, [places[:0]], None, compression.ravel()
    # numbers of surfaces, places, and where a profile may end
    asked: list[tuple[int, Any, float]] = [
        (k, mine, math.inf) for k, mine in groups if mine.size
    ]
    while asked:
        k, mine, last = asked.pop()
        try:
            kept = profile(
                shapes[k], model, how.variant, QUADRATURE_SHARE * how.rtol, last=last
            )
        except (ConvergenceError, OutOfRangeError) as fault:
            if last < math.inf or isinstance(model, UniversalModel):
                left, why = [*left, mine], fault
            else:
                # one by one: a model need not have deeper islands than those of the gap
                asked += [
                    (k, mine[n : n + 1], float(gaps[place]))
                    for n, place in enumerate(mine)
                ]
            continue
        inside = gaps[mine] <= kept.end
        if not inside.all():
            left.append(mine[~inside])
            mine = mine[inside]
        islands += kept.islands
        # usually all gaps are of one surface and in contact, and slices are faster
        chosen: Any = slice(None) if mine.size == gaps.size else mine
        rows[-1, chosen] = kept.error
        rows[:-1, chosen] = kept.totals(gaps[chosen], len(rows) > 3)
    return islands, np.sort(np.concatenate(left)), why


def by_table(
    surface: Surface,
    compression: FloatArray,
    places: Any,
    model: UniversalModel,
    how: Sums,
    rows: FloatArray,
) -> tuple[int, NDArray[np.intp]]:
    """The same by the universal table, gap by gap."""
    shape, fields = (
        compression.shape,
        (surface.hurst, surface.zeta_1, compression, surface.h_max / surface.h_rms),
    )
    pairs = [spread(field, shape).ravel()[places] for field in fields]
    bound, status, out = (
        np.empty(places.size),
        np.empty(places.size, np.uint8),
        np.empty((places.size, 2, 2)),
    )
    options = QUADRATURE_SHARE * how.rtol, how.variant.numbers, *model.cells

    def fill(block: slice) -> int:
        islands = np.zeros(1, np.int64)
        core.totals(
            *(pair[block] for pair in pairs),
            *options,
            out[block],
            bound[block],
            status[block],
            islands,
        )
        return int(islands[0])

    islands = sum(in_blocks(fill, places.size, BLOCK))
    if (bad := places[status == UNRESOLVED]).size:
        raise ConvergenceError(
            "quadrature did not reach its tolerance",
            np.isin(np.arange(compression.size), bad),
        )
    rows[-1, places] = bound
    rows[:-1, places] = out[:, :, : len(rows) // 2].T.reshape(len(rows) - 1, -1)
    return islands, places[status != OK]


def _sums(
    surface: AnySurface, depth: FloatArray, how: Sums, slopes: bool
) -> tuple[FloatArray, int]:
    """Force, area, perhaps slopes of both by the compression, and their error as rows, and the number of islands.

    By profiles of islands; of many surfaces by the universal table gap by gap.
    """
    size, islands, model, why = depth.size, 0, how.model, None
    compression = np.asarray(depth / surface.h_rms)
    rows, left = np.zeros((5 if slopes else 3, size)), np.flatnonzero(compression > 0)
    tabulated, ranges = (
        isinstance(surface, Surface) and isinstance(model, UniversalModel),
        "",
    )
    if not tabulated or math.prod(surface.shape) <= max(FEW_SURFACES, size // MANY_GAPS):
        islands, left, why = _by_profiles(surface, compression, left, model, how, rows)
    if left.size and isinstance(surface, Surface) and isinstance(model, UniversalModel):
        more, left = by_table(surface, compression, left, model, how, rows)
        X, mu = model.content.axes
        islands, why, ranges = (
            islands + more,
            None,
            f" ({X.low:g} <= X <= {X.high:g}, mu <= {mu.high:g})",
        )
    if left.size and how.outside == "exact":
        more, left, why = _by_profiles(
            surface, compression, left, exact_model(how.rtol), how, rows
        )
        islands += more
    if left.size and (how.outside != "nan" or isinstance(why, ConvergenceError)):
        numbers = {"h_max - d": depth}
        if isinstance(surface, Surface):
            numbers |= {"hurst": surface.hurst, "zeta_1": surface.zeta_1}
        first = (
            f"{name} = {spread(n, depth.shape).ravel()[left[0]]:g}"
            for name, n in numbers.items()
        )
        raise type(why or OutOfRangeError(""))(
            f"islands of {left.size} of {size} entries lie outside of island model {model.name!r}{ranges}, the first "
            f"at {', '.join(first)}; outside='exact' solves these{f' ({why})' if why else ''}",
            np.isin(np.arange(size), left),
        )
    rows[:, left] = np.nan
    return rows, islands
