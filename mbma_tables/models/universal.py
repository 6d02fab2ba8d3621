"""The island model of the universal table: Phi_F and Phi_A over (X, mu)."""

from __future__ import annotations

import functools
import os
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.arguments import FloatArray, broadcast_shape, finite_array, require
from mbma_tables.compiled import in_blocks
from mbma_tables.errors import InputError
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.height_integrals import integrals
from mbma_tables.models import universal_kernel
from mbma_tables.models.protocol import BOTH, EXACT_RTOL, OUTSIDE, IslandAnswer
from mbma_tables.models.universal_kernel import Axes, Table
from mbma_tables.tablefiles.interpolate import fill_2d, quintic
from mbma_tables.tablefiles.schema import TableContent

TINY = 1e-200  # replaces mu = 0 where a slope is asked for
BLOCK = 1 << 16  # islands between two looks for Ctrl-C
SMALL = 1 << 13  # islands up to which numpy answers, without a compiler


class UniversalModel:
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
    >>> value, by_X, by_mu = table.slopes(2.0, 0.1)
    >>> round(float(by_X.phi_A), 4)
    5.1162
    """

    name = "universal"

    def __init__(self, content: TableContent) -> None:
        self.content = content
        self._X, self._mu = content.axes

    def log_ratio(self, X: FloatArray, mu: FloatArray) -> FloatArray:
        """log(Phi/Phi_rigid) at flat arguments inside the table or below its mu, shape (2, entries)."""
        out = np.empty((2, X.size))
        lowest = np.maximum(mu, self._mu.low)
        fill_2d(self.content.coefficients, self._X.position(X), self._mu.position(lowest), out)
        return out * (np.minimum(mu, self._mu.low) / self._mu.low)

    def answer(self, X: ArrayLike, mu: ArrayLike, parallel: bool = False, *, outside: str = "raise") -> IslandAnswer:
        """Phi_F and Phi_A with the error bound that the table states.

        Parameters
        ----------
        X, mu : array_like
            They broadcast.
        parallel : bool
            Whether to use all cores, for large batches.
        outside : {"raise", "exact", "nan"}
            Where X or mu is not covered: an error, the exact solver, or NaN.

        Raises
        ------
        InputError, OutOfRangeError
        """
        if outside not in OUTSIDE:
            raise InputError(f"outside must be one of {OUTSIDE}, got {outside!r}")
        flat_X, flat_mu, shape = self._inside(X, mu, outside == "raise")
        out = np.empty((flat_X.size, 3))
        status = np.empty(flat_X.size, dtype=np.int64)

        def fill(block: slice) -> None:
            universal_kernel.fill_phi(flat_X[block], flat_mu[block], self.kernel, status[block], out[block])

        if flat_X.size <= SMALL:
            self._fill_small(flat_X, flat_mu, status, out)
        else:
            in_blocks(fill, flat_X.size, BLOCK, (os.cpu_count() or 1) if parallel else 1)
        missing = status != universal_kernel.OK
        if outside == "exact" and missing.any():
            solved = greenwood_tripp.solve(flat_X[missing], flat_mu[missing], rtol=EXACT_RTOL)
            out[missing] = np.stack([solved.phi_F, solved.phi_A, solved.error], axis=-1)
        return IslandAnswer(*(column.reshape(shape)[()] for column in out.T))

    def _fill_small(self, X: FloatArray, mu: FloatArray, status: NDArray[np.int64], out: FloatArray) -> None:
        """`universal_kernel.fill_phi` in numpy."""
        axes, c, errors = self.kernel.axes, self.kernel.coefficients, self.kernel.errors
        status[:] = np.select(
            [axes.X_low > X, axes.X_high < X, mu > axes.mu_high],
            [universal_kernel.X_BELOW, universal_kernel.X_ABOVE, universal_kernel.MU_ABOVE],
        )
        out[:] = np.nan
        good = status == universal_kernel.OK
        x, m = X[good], mu[good]
        inside = np.maximum(m, axes.mu_low)
        cells, weights = [], []
        places = (
            (np.log(x + axes.X_offset) - axes.X_start) * axes.X_rate,
            (np.log(inside) - axes.mu_start) * axes.mu_rate,
        )
        for place, size in zip(places, c.shape, strict=False):
            first = np.minimum(place.astype(np.intp), size - 6)
            cells.append(first)
            weights.append(quintic(place - first))
        logs = np.zeros((x.size, 2))
        for a, across in enumerate(weights[0]):
            row = sum(along[:, None] * c[cells[0] + a, cells[1] + b] for b, along in enumerate(weights[1]))
            logs += across[:, None] * row
        log_F, log_A = logs.T * (m / inside)
        parts = (
            np.clip((place * rate).astype(np.intp), 0, size - 1)
            for place, rate, size in zip(places, (axes.X_cells, axes.mu_cells), errors.shape, strict=True)
        )
        phi_F = np.pi / 5 * m * integrals(2.5, -x) * np.exp(log_F)
        phi_A = np.pi / 2 * integrals(2.0, -x) * np.exp(log_A)
        out[good] = np.stack([phi_F, phi_A, errors[tuple(parts)] + universal_kernel.SECOND_ORDER], axis=-1)

    def of_islands(self, islands: Mapping[str, FloatArray], outside: str = "raise", which: int = BOTH) -> IslandAnswer:
        """Phi_F and Phi_A of islands, both: one costs what both do."""
        return self.answer(islands["X"], islands["mu"], outside=outside)

    def slopes(self, X: ArrayLike, mu: ArrayLike) -> tuple[IslandAnswer, IslandAnswer, IslandAnswer]:
        """Answers, and their derivatives by X and by mu, in one pass; the errors are those of the answers."""
        flat_X, flat_mu, shape = self._inside(X, mu)
        out = np.empty((flat_X.size, 7))
        status = np.empty(flat_X.size, dtype=np.int64)
        # the kernel's slopes are by log(mu): at mu = 0, those just above it
        flat_mu = np.where(flat_mu == 0, TINY, flat_mu)

        def fill(block: slice) -> None:
            universal_kernel.fill_slopes(flat_X[block], flat_mu[block], self.kernel, status[block], out[block])

        in_blocks(fill, flat_X.size, BLOCK)
        force, F_X, F_mu, area, A_X, A_mu, error = (column.reshape(shape)[()] for column in out.T)
        by_mu = 1 / flat_mu.reshape(shape)[()]
        return (
            IslandAnswer(np.where(flat_mu.reshape(shape) == TINY, 0.0, force)[()], area, error),
            IslandAnswer(force * F_X, area * A_X, error),
            IslandAnswer(force * F_mu * by_mu, area * A_mu * by_mu, error),
        )

    def status(self, X: ArrayLike, mu: ArrayLike) -> tuple[Any, Any]:
        """Where arguments lie on each axis: -1 below, 0 inside, 1 above. Below in mu is answered, to first order."""
        places = []
        for axis, value in zip((self._X, self._mu), (X, mu), strict=True):
            x = finite_array(axis.name, value)
            places.append(((x > axis.high).astype(np.int8) - (x < axis.low).astype(np.int8))[()])
        return places[0], places[1]

    def _inside(
        self, X: ArrayLike, mu: ArrayLike, refuse: bool = True
    ) -> tuple[FloatArray, FloatArray, tuple[int, ...]]:
        """Flat arguments and their common shape, refused where the table does not reach."""
        given_X, given_mu = finite_array("X", X), finite_array("mu", mu)
        low, high = self._X.low, self._X.high
        if refuse:
            require("X", given_X, (given_X >= low) & (given_X <= high), f"in [{low:g}, {high:g}]")
            require("mu", given_mu, (given_mu >= 0) & (given_mu <= self._mu.high), f"in [0, {self._mu.high:g}]")
        require("mu", given_mu, given_mu >= 0, "at least 0")
        shape = broadcast_shape(X=given_X, mu=given_mu)
        flat_X, flat_mu = (np.ascontiguousarray(np.broadcast_to(a, shape)).ravel() for a in (given_X, given_mu))
        return flat_X, flat_mu, shape

    @functools.cached_property
    def kernel(self) -> Table:
        """The table as compiled code takes it."""
        X, mu = self._X, self._mu
        field = np.ascontiguousarray(self.content.local_error.max(axis=-1))
        cells = (field.shape[0] / (X.nodes - 1), field.shape[1] / (mu.nodes - 1))
        axes = Axes(X.low, X.high, X.offset, X.start, 1 / X.step, mu.low, mu.high, mu.start, 1 / mu.step, *cells)
        return Table(self.content.coefficients, field, axes)
