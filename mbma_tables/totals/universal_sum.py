"""Totals through the universal table: the compiled pass, and what happens outside the table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import ConvergenceError, InputError, OutOfRangeError
from mbma_tables.islands.greenwood_tripp import TIGHTEST
from mbma_tables.models import ExactModel
from mbma_tables.models.protocol import BOTH
from mbma_tables.models.universal import UniversalModel
from mbma_tables.models.universal_kernel import OK, REASONS, UNRESOLVED
from mbma_tables.surfaces.readings import Reading
from mbma_tables.totals import kernel as lookup
from mbma_tables.totals.island_sum import sum_islands
from mbma_tables.totals.pairs import Pairs

QUADRATURE_SHARE = 0.9  # of the tolerance asked for; a table's own error comes on top


def _refused(
    status: NDArray[np.int64], pairs: Pairs, model: UniversalModel, outside: str, shape: tuple[int, ...]
) -> NDArray[np.intp]:
    """Pairs that the table does not cover, or an error about them."""
    if (status == UNRESOLVED).any():
        raise ConvergenceError("quadrature did not reach its tolerance", status == UNRESOLVED)
    missing = np.flatnonzero(status != OK)
    if missing.size and outside == "raise":
        first = int(missing[0])
        X, mu = model.content.axes
        raise OutOfRangeError(
            f"islands of {missing.size} of {status.size} entries lie outside the universal table "
            f"({X.low:g} <= X <= {X.high:g}, mu <= {mu.high:g}), the first at hurst = {pairs.hurst[first]:g}, "
            f"zeta_1 = {pairs.zeta_1[first]:g}, (h_max - d)/h_rms = {pairs.reach[first]:g} "
            f"({REASONS[status[first]]}); outside='exact' solves these",
            (status != OK).reshape(shape),
        )
    return missing


def look_up(
    pairs: Pairs,
    reading: Reading,
    model: UniversalModel,
    rtol: float,
    outside: str,
    shape: tuple[int, ...],
    which: int = BOTH,
) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    """F/(A0 E* q0 s), A/A0, the bound on their error and the islands evaluated, through the universal table.

    Of the two, the one that `which` leaves out is not told.
    """
    status = np.empty(pairs.reach.size, dtype=np.int64)
    out = np.empty((3, pairs.reach.size))
    islands = lookup.fill_totals(
        which,
        pairs.hurst,
        pairs.zeta_1,
        pairs.reach,
        pairs.top,
        QUADRATURE_SHARE * rtol,
        reading.numbers,
        reading.jacobian == "printed",
        *model.kernel,
        status,
        out,
    )
    missing = _refused(status, pairs, model, outside, shape)
    if missing.size and outside == "exact":
        try:
            solver = ExactModel(max(0.1 * rtol, TIGHTEST))
            *found, more = sum_islands(pairs.some(missing), reading, solver, 0.5 * rtol, which=which)
        except ConvergenceError as fault:
            mask = np.zeros(status.size, dtype=bool)
            mask[missing[fault.mask]] = True
            raise ConvergenceError(str(fault), mask) from fault
        out[:, missing] = found
        islands += more
    return out[0], out[1], out[2], islands


def look_up_slopes(
    pairs: Pairs, reading: Reading, model: UniversalModel, rtol: float, outside: str, shape: tuple[int, ...]
) -> tuple[FloatArray, FloatArray, int]:
    """Totals and partial derivatives (pairs, 2, 5), see `sensitivity`; their bound; the islands evaluated."""
    from mbma_tables.totals import sensitivity

    if outside == "exact":
        raise InputError("derivatives come from the universal table: outside must be 'raise' or 'nan' with them")
    status = np.empty(pairs.reach.size, dtype=np.int64)
    out = np.empty((pairs.reach.size, 2, 5))
    bound = np.empty(pairs.reach.size)
    islands = sensitivity.fill_totals_with_slopes(
        pairs.hurst,
        pairs.zeta_1,
        pairs.reach,
        pairs.top,
        QUADRATURE_SHARE * rtol,
        reading.numbers,
        reading.jacobian == "printed",
        *model.kernel,
        status,
        out,
        bound,
    )
    out[_refused(status, pairs, model, outside, shape)] = np.nan
    return out, bound, islands
