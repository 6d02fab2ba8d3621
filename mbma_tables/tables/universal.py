"""The island model of the universal table: Phi_F and Phi_A over (X, mu)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from mbma_tables.common.arguments import (
    FloatArray,
    broadcast_shape,
    finite_array,
    require,
)
from mbma_tables.common.errors import TableFileError
from mbma_tables.common.interrupts import in_blocks
from mbma_tables.common.shared import shared_property
from mbma_tables.core import core
from mbma_tables.islands.island_models import (
    OUTSIDE,
    SOLVER,
    IslandAnswer,
    check_outside,
)
from mbma_tables.tables.grids import OfTable, on_grid
from mbma_tables.tables.schema import BUCKET_BITS, CELL_EDGES, X_STEPS, TableContent

if TYPE_CHECKING:
    import xarray as xr

BLOCK = 1 << 16  # islands between two checks for Ctrl-C
TERMS = 8  # terms of each polynomial along each axis
RECORD = 8 + 2 * TERMS**2  # doubles of a cell, `mbma_cell` of mbma.h


class Ranged:
    """A model of X and mu in `ranges`; points outside raise an error, are solved exactly, or give NaN."""

    ranges: Mapping[str, tuple[float, float]]
    holds = ""  # further text of the error beside a range

    def _rows(self, X: FloatArray, mu: FloatArray) -> FloatArray:
        """Phi_F, Phi_A and error of flat arguments, (3, entries); NaN outside the ranges."""
        raise NotImplementedError

    def answer(
        self, X: ArrayLike, mu: ArrayLike, *, outside: str = "raise"
    ) -> IslandAnswer:
        """Phi_F and Phi_A with a bound on their relative error.

        Parameters
        ----------
        X, mu : array_like
            The arguments of Phi; they broadcast.
        outside : {"raise", "exact", "nan"}
            Where X or mu is not covered: an error, the exact solver, or NaN.
        """
        check_outside(outside)
        given = {"X": finite_array("X", X), "mu": finite_array("mu", mu)}
        for name, array in given.items() if outside == "raise" else ():
            low, high = self.ranges[name]
            require(
                name,
                array,
                (array >= low) & (array <= high),
                f"in [{low:g}, {high:g}]{self.holds}",
            )
        require("mu", given["mu"], given["mu"] >= 0, "at least 0")
        shape = broadcast_shape(**given)
        flat_X, flat_mu = (
            np.ascontiguousarray(np.broadcast_to(a, shape)).ravel()
            for a in given.values()
        )
        out = self._rows(flat_X, flat_mu)
        missing = np.isnan(out[2])
        if outside == "exact" and missing.any():
            out[:, missing] = SOLVER.answer(flat_X[missing], flat_mu[missing])
        return IslandAnswer(*(row.reshape(shape)[()] for row in out))

    def of_islands(
        self, islands: Mapping[str, FloatArray], outside: str = "raise"
    ) -> IslandAnswer:
        """Phi_F and Phi_A of islands."""
        return self.answer(islands["X"], islands["mu"], outside=outside)


class UniversalModel(OfTable, Ranged):
    """Phi_F and Phi_A from a universal table.

    Parameters
    ----------
    content : TableContent
        A table of kind "universal"; `open_table` reads one.

    Examples
    --------
    >>> from mbma_tables import open_table
    >>> table = open_table("universal")
    >>> round(float(table.answer(2.0, [0.1, 10.0]).phi_F[1]), 4)
    4.5589
    """

    name = "universal"

    def __init__(self, content: TableContent) -> None:
        super().__init__(content)
        self._X, self._mu = content.axes
        self.ranges = {"X": (self._X.low, self._X.high), "mu": (0.0, self._mu.high)}

    @shared_property
    def _one(self) -> Any:
        """Of one island of two floats its answer, None outside the table and for other types."""
        return core.Table(*self.cells).at

    def answer(
        self, X: ArrayLike, mu: ArrayLike, *, outside: str = "raise"
    ) -> IslandAnswer:
        """Phi_F, Phi_A and the bound on their relative error, see `Ranged.answer`."""
        one = self._one(X, mu)
        if one is None or outside not in OUTSIDE:
            return super().answer(X, mu, outside=outside)
        return IslandAnswer._make(map(np.float64, one))

    def to_dataset(self, X: ArrayLike, mu: ArrayLike, outside: str = "nan") -> xr.Dataset:
        """phi_F, phi_A and the bound on their error on a grid, as an xarray Dataset.

        Parameters
        ----------
        X, mu : array_like
            The axes, each a number or of one dimension.
        outside : {"nan", "raise", "exact"}
            As in `answer`; the attribute `outside` of the Dataset states it.

        Raises
        ------
        InputError, OutOfRangeError

        Examples
        --------
        >>> from mbma_tables import open_table
        >>> grid = open_table("universal").to_dataset(X=[0.0, 2.0], mu=[0.1, 1.0, 10.0])
        >>> dict(grid.sizes)
        {'X': 2, 'mu': 3}
        """
        check_outside(outside)
        return on_grid(self.content, {"X": X, "mu": mu}, self.answer, outside)

    def _rows(self, X: FloatArray, mu: FloatArray) -> FloatArray:
        out = np.empty((X.size, 3))
        in_blocks(
            lambda block: core.phi(X[block], mu[block], *self.cells, out[block], None),
            X.size,
            BLOCK,
        )
        return out.T

    @shared_property
    def cells(self) -> tuple[FloatArray, NDArray[np.int32], FloatArray]:
        """The table in the core's format, `mbma_cells` of mbma.h: cells, indices and numbers."""
        X_low, X_high, mu_low, mu_high = (
            self.content.auxiliary[name][1] for name in CELL_EDGES
        )
        count = X_low.size
        # doubles on lines of the cache, eight each
        memory = np.zeros(RECORD * count + TERMS)
        start = -(memory.ctypes.data // 8) % TERMS
        records = memory[start : start + RECORD * count].reshape(count, RECORD)
        records[:, 0] = self.content.local_error.max(axis=-1)
        records[:, 1], records[:, 2] = 0.5 * (X_low + X_high), 2 / (X_high - X_low)
        records[:, 3:7] = fractions_of_mu(mu_low, mu_high).T
        rows = (chebyshev.cheb2poly(row) for row in np.eye(TERMS))
        powers = np.array([np.pad(row, (0, TERMS - row.size)) for row in rows])
        # the functions, then powers of mu, then of X
        by_X = np.einsum("cijf,ip->cfjp", self.content.coefficients, powers)
        records[:, 8:] = np.einsum("cfjp,jq->cfqp", by_X, powers).reshape(count, -1)

        first, last = (
            int(bits >> BUCKET_BITS)
            for bits in np.array([mu_high.min(), self._mu.high]).view(np.int64)
        )
        # the bucket below the first edge contains all smaller values
        buckets = ((np.arange(first - 1, last + 1)) << BUCKET_BITS).view(float)
        buckets[0] = 0.0
        lows, firsts = np.unique(X_low, return_index=True)
        steps = np.arange(int((self._X.high - self._X.low) * X_STEPS) + 1)
        strips = (
            np.searchsorted(lows, self._X.low + (steps + 0.5) / X_STEPS, side="right") - 1
        )
        places = [steps.size + buckets.size * np.minimum(strips, lows.size - 1)]
        strip_cells = np.split(np.arange(count), firsts[1:])
        places += [
            own[np.searchsorted(mu_low[own], buckets, side="right") - 1]
            for own in strip_cells
        ]
        ends = self._X.low, self._X.high, float(X_STEPS), self._mu.high
        numbers = np.array([*ends, first - 1, buckets.size], dtype=float)
        starts = places[0]
        cells = np.concatenate(places[1:])
        # the core does not look whether places lie inside the table
        if not (
            cells.min() >= 0
            and cells.max() < count
            and starts.max() + buckets.size <= steps.size + cells.size
        ):
            raise TableFileError(
                "the cells of the universal table do not cover its range"
            )
        return records.reshape(-1), np.concatenate(places).astype(np.int32), numbers


def fractions_of_mu(low: FloatArray, high: FloatArray) -> FloatArray:
    """(a, b, c, d) of y = (a mu + b)/(c mu + d), which goes from -1 at `low` to 1 at `high`, in the rows.

    Between two powers of mu a fraction is nearly its logarithm; a cell that begins at 0 has
    y linear in mu.
    """
    middle = np.sqrt(low * high)
    slope = (np.sqrt(high) + np.sqrt(low)) / (np.sqrt(high) - np.sqrt(low))
    linear = low == 0
    rows = [
        np.where(linear, 2 / high, slope),
        np.where(linear, -1.0, -slope * middle),
        ~linear,
        middle + linear,
    ]
    return np.array(rows, dtype=float)
