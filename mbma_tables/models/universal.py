"""Island models that look up a table: over (X, mu), and over the paper's four numbers."""

from __future__ import annotations

import functools
import os
import pathlib
import threading
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import FloatArray, broadcast_shape, finite_array, require
from mbma_tables.errors import InputError
from mbma_tables.files import shipped_file
from mbma_tables.islands import greenwood_tripp
from mbma_tables.models import universal_kernel
from mbma_tables.models.island4d import Island4dModel
from mbma_tables.models.protocol import EXACT_RTOL, OUTSIDE, IslandAnswer, TwoNumberModel
from mbma_tables.models.universal_kernel import Axes
from mbma_tables.tablefiles.interpolate import fill_2d
from mbma_tables.tablefiles.netcdf import read_table
from mbma_tables.tablefiles.schema import ISLAND4D, UNIVERSAL, TableContent, error_cell

__all__ = ["Island4dModel", "UniversalModel", "island4d_model", "open_table", "shipped", "universal_model"]


TINY = 1e-200  # stands for mu = 0 where a slope is asked for


class UniversalModel(TwoNumberModel):
    """Phi_F and Phi_A from a universal table.

    Parameters
    ----------
    content : TableContent
        A table of kind "universal".
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
        """Phi_F and Phi_A with the bound that the table's certificate gives.

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
        out = np.empty((3, flat_X.size))
        status = np.empty(flat_X.size, dtype=np.int64)
        fill = universal_kernel.fill_phi_parallel if parallel else universal_kernel.fill_phi
        fill(flat_X, flat_mu, *self.kernel, status, out)
        missing = status != universal_kernel.OK
        if outside == "exact" and missing.any():
            solved = greenwood_tripp.solve(flat_X[missing], flat_mu[missing], rtol=EXACT_RTOL)
            out[:, missing] = solved.phi_F, solved.phi_A, solved.error
        return IslandAnswer(*(row.reshape(shape)[()] for row in out))

    def slopes(self, X: ArrayLike, mu: ArrayLike) -> tuple[IslandAnswer, IslandAnswer, IslandAnswer]:
        """Answers, and their derivatives by X and by mu, in one pass; the errors are those of the answers."""
        flat_X, flat_mu, shape = self._inside(X, mu)
        out = np.empty((7, flat_X.size))
        # slopes at mu = 0 are those a hair above it: the kernel's are by log(mu)
        flat_mu = np.where(flat_mu == 0, TINY, flat_mu)
        universal_kernel.fill_slopes(flat_X, flat_mu, *self.kernel, np.empty(flat_X.size, dtype=np.int64), out)
        force, F_X, F_mu, area, A_X, A_mu, error = (row.reshape(shape)[()] for row in out)
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
    def kernel(self) -> tuple[FloatArray, FloatArray, Axes]:
        """Coefficients, error field and axes as the compiled totals take them."""
        X, mu = self._X, self._mu
        field = np.ascontiguousarray(self.content.local_error.max(axis=-1))
        cells = (field.shape[0] / (X.nodes - 1), field.shape[1] / (mu.nodes - 1))
        axes = (X.low, X.high, X.offset, X.start, 1 / X.step, mu.low, mu.high, mu.start, 1 / mu.step, *cells)
        return self.content.coefficients, field, axes

    def error(self, X: FloatArray, mu: FloatArray) -> FloatArray:
        """Bound on the relative error of both functions at flat arguments."""
        field = self.kernel[1]
        lowest = np.maximum(mu, self._mu.low)
        places = (
            error_cell(axis, cells, axis.position(x))
            for axis, cells, x in zip((self._X, self._mu), field.shape, (X, lowest), strict=True)
        )
        bound: FloatArray = field[tuple(places)] + universal_kernel.SECOND_ORDER
        return bound


def shipped(kind: str) -> pathlib.Path:
    """Where the table of that kind stands."""
    return shipped_file(f"{kind}.nc")


_OPENING = threading.Lock()


@functools.lru_cache(maxsize=8)
def _opened(kind: str, path: pathlib.Path, state: tuple[int, ...]) -> UniversalModel | Island4dModel:
    content = read_table(path, kind)
    return UniversalModel(content) if kind == UNIVERSAL else Island4dModel(content)


def _identity(path: os.PathLike[str] | str) -> tuple[pathlib.Path, tuple[int, ...]]:
    """Which file that is, and which of those that stood there one after the other."""
    file = pathlib.Path(path).resolve()
    try:
        status = file.stat()
    except OSError:
        return file, ()  # reading says what is wrong
    return file, (status.st_ino, status.st_size, status.st_mtime_ns)


def _open_once(kind: str, path: os.PathLike[str] | str | None) -> UniversalModel | Island4dModel:
    """A table of that kind, opened once whichever thread asks first; a file that was replaced, anew."""
    with _OPENING:
        return _opened(kind, shipped(kind), ()) if path is None else _opened(kind, *_identity(path))


def universal_model(path: os.PathLike[str] | str | None = None) -> UniversalModel:
    """The universal model of the shipped table, or of a file; opened once while the file stays the same."""
    model = _open_once(UNIVERSAL, path)
    assert isinstance(model, UniversalModel)
    return model


def island4d_model(path: os.PathLike[str] | str | None = None) -> Island4dModel:
    """The four-parameter model of the shipped table, or of a file; opened once while the file stays the same."""
    model = _open_once(ISLAND4D, path)
    assert isinstance(model, Island4dModel)
    return model


def open_table(table: os.PathLike[str] | str = UNIVERSAL) -> UniversalModel | Island4dModel:
    """A table by kind ("universal", "island4d": the shipped ones, opened once) or from a file.

    Raises
    ------
    TableFileError
        Where the file cannot be used; the message says why and what to do.
    """
    if table == UNIVERSAL:
        return universal_model()
    if table == ISLAND4D:
        return island4d_model()
    content = read_table(table)
    return UniversalModel(content) if content.kind == UNIVERSAL else Island4dModel(content)
