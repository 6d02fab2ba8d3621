"""The sum over islands (Eqs. 44-49): for any island model in numpy, for the universal table in the core.

The rules of the adaptive quadrature are QUADPACK's (Piessens, de Doncker-Kapenga, Ueberhuber and Kahaner 1983). scipy's
adaptive rules work on one integral, or refine a batch together to an absolute tolerance; here each integral has its own
interval, is refined on its own and is judged by its own value.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray, spread
from mbma_tables.common.errors import ConvergenceError, InputError, OutOfRangeError
from mbma_tables.core import OK, REASONS, UNRESOLVED, core, in_blocks
from mbma_tables.islands.geometry import floor_offset, geometry
from mbma_tables.models import AREA, BOTH, FORCE, AnyModel, answer_islands, exact_model
from mbma_tables.models.universal import UniversalModel
from mbma_tables.surfaces.surface import Surface
from mbma_tables.surfaces.variants import Variant
from mbma_tables.totals.island import scale_area, scale_force

QUADRATURE_SHARE = 0.9  # of the requested tolerance; a table's own error comes on top
SUM_SHARE = 0.5  # where islands are solved to a share of it
BLOCK = 256  # pairs between two checks for interrupts
STRETCH = 8.0  # scale of the approach's map, in boundary layers zeta_1^(-H), as in the core
# of force and area with their derivatives: value, by hurst, ln(zeta_1), compression, peak
COLUMNS, BY_COMPRESSION = 5, 3


Integrand = Callable[[NDArray[np.intp], FloatArray], FloatArray]
# nodes on [-1, 1], Kronrod weights, and Gauss weights, zero where that rule has no node
NODES, KRONROD, GAUSS = np.empty((3, 31))
core.kronrod(NODES, KRONROD, GAUSS)
BATCH = 2048  # intervals evaluated together: bounds the memory, not the work
DEPTH = 64  # halvings of an interval before giving up
MOST = 1000  # intervals of an integral before giving up
LEAST = 1e-290  # smallest integrals; smaller ones have lost digits to underflow


class Integrals(NamedTuple):
    """Values and relative error estimates, shape (integrals, components), and the points evaluated."""

    value: FloatArray
    error: FloatArray
    evaluations: int


def _apply_rule(
    integrand: Integrand, owner: NDArray[np.intp], low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Kronrod sums and error estimates of each interval, shape (intervals, components)."""
    half = (high - low) / 2
    points = (low + high)[:, None] / 2 + half[:, None] * NODES
    values = integrand(owner, points) * half[:, None, None]
    kronrod = np.einsum("kic,i->kc", values, KRONROD)
    gauss = np.einsum("kic,i->kc", values, GAUSS)
    spread = np.einsum("kic,i->kc", np.abs(values - kronrod[:, None, :] / 2), KRONROD)
    difference = np.abs(kronrod - gauss)
    # QUADPACK's estimate: the difference belongs to the Gauss rule, Kronrod's own error is far smaller
    ratio = np.divide(difference, spread, out=np.zeros_like(spread), where=spread > 0)
    return kronrod, np.where(spread > 0, spread * np.minimum(1, 200 * ratio) ** 1.5, difference)


def integrate(
    integrand: Integrand, owner: NDArray[np.intp], low: FloatArray, high: FloatArray, count: int, rtol: float
) -> Integrals:
    """Integrate `count` positive integrands, each over its own intervals.

    Parameters
    ----------
    integrand : callable
        ``integrand(owner, points)`` with `owner` (n,) and `points` (n, 31) gives (n, 31, components).
    owner : (n,) int array
        Which integral an interval belongs to, 0 ... count - 1.
    low, high : (n,) arrays
        The intervals: break points, and a suitable initial subdivision.
    count : int
        Number of integrals; one that owns no interval is 0.
    rtol : float
        Relative tolerance, met by the estimates of every component of every integral.

    Returns
    -------
    Integrals

    Raises
    ------
    ConvergenceError
        Where `DEPTH` halvings, or `MOST` intervals, did not suffice; `mask` is true for these integrals.
    """
    if owner.size == 0:
        # one component represents all
        nothing = np.zeros((count, 1))
        return Integrals(nothing, nothing, 0)
    evaluations, kept = 0, list[Any]()
    fresh: list[Any] = [owner, low, high]
    for _ in range(DEPTH):
        batches = [[part[k : k + BATCH] for part in fresh] for k in range(0, fresh[0].size, BATCH)]
        fresh += map(np.concatenate, zip(*(_apply_rule(integrand, *batch) for batch in batches), strict=True))
        evaluations += fresh[0].size * NODES.size
        kept = [np.concatenate(both) for both in zip(kept, fresh, strict=True)] if kept else fresh
        owner, low, high, value, error = kept
        sums: Any = [np.stack([np.bincount(owner, x, count) for x in part.T], axis=1) for part in (value, error)]
        total, bound = sums
        relative = np.divide(bound, total, out=np.zeros_like(bound), where=total > 0)
        unfinished = np.asarray(((relative > rtol) & (total > LEAST)).any(axis=1))
        if not unfinished.any():
            return Integrals(total, relative, evaluations)
        # an interval is halved where it has more than its even share of the error allowed
        counts = np.bincount(owner, minlength=count)
        if (counts[unfinished] > MOST).any():
            break
        leaves = counts[owner, None]
        split = unfinished[owner] & (error * leaves > rtol * total[owner]).any(axis=1)
        middle = (low[split] + high[split]) / 2
        halves = (low[split], middle), (middle, high[split])
        fresh = [np.tile(owner[split], 2), *map(np.concatenate, halves)]
        kept = [part[~split] for part in kept]
    raise ConvergenceError(
        f"quadrature did not reach {rtol:.1e} for {int(unfinished.sum())} of {count} integrals", unfinished
    )


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
        """The pairs at these indices."""
        return Pairs(*(field[chosen] for field in self))


class Totals(NamedTuple):
    """F/(A0 E* q0 s) and A/A0 of pairs, the bound on their relative error, and the islands evaluated.

    If one of the two was not requested, it contains the other, or NaN.
    """

    force: FloatArray
    area: FloatArray
    error: FloatArray
    islands: int


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


def sum_islands(
    pairs: Pairs, variant: Variant, model: AnyModel, rtol: float, outside: str = "raise", which: int = BOTH
) -> Totals:
    """Totals by any island model: adaptive quadrature of a batch of pairs to `rtol`."""
    count = pairs.compression.size
    kink_d, kink_u = kinks(pairs.hurst, pairs.zeta_1, variant)
    worst_island = np.zeros(count)
    # as in the core: approach = scale sinh(t)^2 up to the floor of zeta_d, and from there on as it is
    scale = STRETCH * pairs.zeta_1**-pairs.hurst
    turn = np.arcsinh(np.sqrt(kink_d / scale))
    h_rms = np.sqrt(-np.expm1(-2 * pairs.hurst * np.log(pairs.zeta_1)))  # over s

    def integrand(owner: NDArray[np.intp], t: FloatArray) -> FloatArray:
        own = pairs.some((owner, None))
        own_scale, own_turn, own_kink, rms_over_s = (f[owner, None] for f in (scale, turn, kink_d, h_rms))
        curved = np.minimum(t, own_turn)
        approach = np.where(t < own_turn, own_scale * np.sinh(curved) ** 2, own_kink + (t - own_turn))
        stretch = np.where(t < own_turn, own_scale * np.sinh(2 * curved), 1.0)
        g = geometry(approach, own.hurst, own.zeta_1, variant)
        try:
            phi = answer_islands(model, g | {"hurst": np.broadcast_to(own.hurst, t.shape)}, outside, which)
        except (ConvergenceError, OutOfRangeError) as fault:
            failed = np.isin(np.arange(count), owner if fault.mask is None else owner[fault.mask.any(axis=1)])
            raise type(fault)(f"an island failed: {fault}", failed) from fault
        with np.errstate(invalid="ignore"):
            np.maximum.at(worst_island, owner, phi.error.max(axis=1))
        # z'/sigma_d (41); z_max is counted down from h_max, so nothing cancels at first contact
        height = ((own.peak - (own.compression - approach)) * rms_over_s - g["h_d"]) / g["sigma_d"]
        weight = island_density(height, g["D_d"], g["sigma_d"]) * rms_over_s * stretch
        weight *= np.where(approach < own_kink, jacobian_below(rms_over_s, variant), 1.0)
        parts = {FORCE: scale_force(g) * phi.phi_F, AREA: scale_area(g) * phi.phi_A}
        return np.stack([part * weight for name, part in parts.items() if which in (name, BOTH)], axis=-1)

    compression = np.maximum(pairs.compression, 0)
    edges = [np.minimum(k, compression) for k in (kink_d, kink_u)]
    breaks = np.sort(np.stack([np.zeros(count), *edges, compression]), axis=0)
    grid = np.arcsinh(np.sqrt(np.minimum(breaks, kink_d) / scale)) + np.maximum(breaks - kink_d, 0.0)
    low, high = grid[:-1], grid[1:]
    owner = np.broadcast_to(np.arange(count), low.shape)
    filled = high > low
    found = integrate(integrand, owner[filled], low[filled], high[filled], count, rtol)
    error = found.error.max(axis=1) + worst_island
    return Totals(found.value[:, 0], found.value[:, -1], error, found.evaluations)


def totals_of(
    model: AnyModel, pairs: Pairs, variant: Variant, rtol: float, outside: str = "raise", which: int = BOTH,
    workers: int = 1,
) -> Totals:  # fmt: skip
    """Totals by an island model, with the method for its class; exceptions have a mask of the pairs.

    `workers` threads share the pairs of the universal table.
    """
    if not isinstance(model, UniversalModel):
        return sum_islands(pairs, variant, model, SUM_SHARE * rtol, outside, which)
    out, error, islands, missing = sums_by_table(model, pairs, variant, rtol, outside, workers, slopes=False)
    force, area = out[:, :, 0].T
    if missing.size and outside == "exact":
        try:
            found = sum_islands(pairs.some(missing), variant, exact_model(rtol), SUM_SHARE * rtol, which=which)
        except ConvergenceError as fault:
            fault.mask = np.isin(np.arange(error.size), missing[fault.mask])
            raise
        force[missing], area[missing], error[missing] = found[:3]
        islands += found.islands
    return Totals(force, area, error, islands)


def sums_by_table(
    model: AnyModel, pairs: Pairs, variant: Variant, rtol: float, outside: str, workers: int, slopes: bool = True
) -> tuple[FloatArray, FloatArray, int, NDArray[np.intp]]:
    """Totals, (pairs, 2, COLUMNS or 1) with or without derivatives, the bound on their error, and the islands.

    Also returns the pairs that the table does not cover, whose totals are NaN.
    """
    if not isinstance(model, UniversalModel):
        raise InputError(f"derivatives come from island model 'universal', {model.name!r} has none")
    if slopes and outside == "exact":
        raise InputError("derivatives come from the universal table: outside must be 'raise' or 'nan' with them")
    count, numbers = pairs.compression.size, variant.numbers
    status, bound = np.empty(count, np.uint8), np.empty(count)
    out = np.empty((count, 2, COLUMNS if slopes else 1))

    def fill(block: slice) -> int:
        islands = np.zeros(1, np.int64)
        own = *pairs.some(block), QUADRATURE_SHARE * rtol, numbers, *model.cells, int(slopes)
        core.totals(*own, out[block], bound[block], status[block], islands)
        return int(islands[0])

    islands = sum(in_blocks(fill, count, BLOCK, workers))
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
