"""Island models that look up a table: over (X, mu), and over the paper's four numbers."""

from __future__ import annotations

import functools
import os
import pathlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import FloatArray, broadcast_shape, finite_array, require
from mbma_tables.islands.greenwood_tripp import rigid_sphere
from mbma_tables.models import universal_kernel
from mbma_tables.models.protocol import IslandAnswer, TwoNumberModel
from mbma_tables.models.raw import SPHERE_FLOOR, Coordinates, band_fields, hat_scales, to_axes
from mbma_tables.models.universal_kernel import Axes
from mbma_tables.surfaces.readings import get_reading
from mbma_tables.tablefiles.files import read_table
from mbma_tables.tablefiles.interpolate import fill_2d, fill_4d
from mbma_tables.tablefiles.schema import ISLAND4D, UNIVERSAL, Axis, TableContent, error_cell


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

    def answer(self, X: FloatArray, mu: FloatArray, parallel: bool = False) -> IslandAnswer:
        """Phi_F and Phi_A with the bound that the table's certificate gives.

        Parameters
        ----------
        X, mu : array_like
            They broadcast.
        parallel : bool
            Whether to use all cores, for large batches.

        Raises
        ------
        OutOfRangeError
            Where X or mu is not covered.
        """
        flat_X, flat_mu, shape = self._inside(X, mu)
        out = np.empty((3, flat_X.size))
        fill = universal_kernel.fill_phi_parallel if parallel else universal_kernel.fill_phi
        fill(flat_X, flat_mu, *self.kernel, np.empty(flat_X.size, dtype=np.int64), out)
        return IslandAnswer(*(row.reshape(shape)[()] for row in out))

    def slopes(self, X: ArrayLike, mu: ArrayLike) -> tuple[IslandAnswer, IslandAnswer, IslandAnswer]:
        """Answers, and their derivatives by X and by mu, in one pass; the errors are those of the answers."""
        flat_X, flat_mu, shape = self._inside(X, mu)
        out = np.empty((7, flat_X.size))
        universal_kernel.fill_slopes(flat_X, flat_mu, *self.kernel, np.empty(flat_X.size, dtype=np.int64), out)
        force, F_X, F_mu, area, A_X, A_mu, error = (row.reshape(shape)[()] for row in out)
        # the kernel gives logarithmic slopes
        with np.errstate(divide="ignore", invalid="ignore"):
            by_mu = 1 / flat_mu.reshape(shape)[()]
        return (
            IslandAnswer(force, area, error),
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

    def _inside(self, X: ArrayLike, mu: ArrayLike) -> tuple[FloatArray, FloatArray, tuple[int, ...]]:
        """Flat arguments and their common shape, refused where the table does not reach."""
        given_X, given_mu = finite_array("X", X), finite_array("mu", mu)
        low, high = self._X.low, self._X.high
        require("X", given_X, (given_X >= low) & (given_X <= high), f"in [{low:g}, {high:g}]")
        require("mu", given_mu, (given_mu >= 0) & (given_mu <= self._mu.high), f"in [0, {self._mu.high:g}]")
        shape = broadcast_shape(X=given_X, mu=given_mu)
        flat_X, flat_mu = (np.ascontiguousarray(np.broadcast_to(a, shape)).ravel() for a in (given_X, given_mu))
        return flat_X, flat_mu, shape

    @functools.cached_property
    def kernel(self) -> tuple[FloatArray, FloatArray, Axes]:
        """Coefficients, error field and axes as the compiled totals take them."""
        X, mu = self._X, self._mu
        axes = (X.low, X.high, X.offset, X.start, 1 / X.step, mu.low, mu.high, mu.start, 1 / mu.step)
        return self.content.coefficients, np.ascontiguousarray(self.content.local_error.max(axis=-1)), axes

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
    """Where the table of that kind stands: in the package, or in a checkout's `tables` folder."""
    package = pathlib.Path(__file__).parents[1]
    inside = package / "tables" / f"{kind}.nc"
    return inside if inside.exists() else package.parent / "tables" / f"{kind}.nc"


@functools.lru_cache(maxsize=8)
def universal_model(path: os.PathLike[str] | str | None = None) -> UniversalModel:
    """The universal model of the shipped table, or of a file; opened once."""
    return UniversalModel(read_table(path or shipped(UNIVERSAL), UNIVERSAL))


class Island4dModel:
    """F_hat and A_hat by the paper's four numbers, from a four-parameter table and nothing else.

    Parameters
    ----------
    content : TableContent
        A table of kind "island4d".
    """

    name = "island4d"

    def __init__(self, content: TableContent) -> None:
        self.content = content
        self.reading = get_reading(content.attributes["reading"])
        self._X, self._spread, self._sphere, self._hurst = content.axes

    def lookup(
        self, delta_over_h_rms: ArrayLike, zeta_d: ArrayLike, zeta_u: ArrayLike, hurst: ArrayLike
    ) -> tuple[Any, Any, Any]:
        """F_hat = F^i q0/(E* s), A_hat = A^i q0^2/eta and the bound on their relative error.

        Parameters
        ----------
        delta_over_h_rms : array_like
            Approach of the island; h_rms read at zeta_1 without bound, Delta + zeta_d^(-H).
        zeta_d, zeta_u : array_like
            Magnifications of Eqs. (27) and (30), 1.25 <= zeta_d < zeta_u.
        hurst : array_like
            Hurst exponent.

        Raises
        ------
        OutOfRangeError
            Where an argument, or X that follows from them, is not covered.
        """
        given = {
            name: finite_array(name, value)
            for name, value in (
                ("delta_over_h_rms", delta_over_h_rms),
                ("zeta_d", zeta_d),
                ("zeta_u", zeta_u),
                ("hurst", hurst),
            )
        }
        shape = broadcast_shape(**given)
        delta, low, high, H = (np.ascontiguousarray(np.broadcast_to(array, shape)) for array in given.values())
        require("hurst", H, (self._hurst.low <= H) & (self._hurst.high >= H), self._range(self._hurst))
        require("zeta_d", low, low >= SPHERE_FLOOR, f"at least {SPHERE_FLOOR}")
        require("zeta_u", high, high > low, "above zeta_d")
        place = to_axes(delta.ravel(), low.ravel(), high.ravel(), H.ravel(), self.reading)
        self._require_inside(place, shape)
        phi_F, phi_A = rigid_sphere(place.X, place.mu) * np.exp(self.log_ratio(place))
        force, area = hat_scales(place.spread, low.ravel(), place.hurst, place.sigma, self.reading)
        answers = (force * phi_F, area * phi_A, self.error(place))
        F_hat, A_hat, error = (a.reshape(shape)[()] for a in answers)
        return F_hat, A_hat, error

    def _require_inside(self, place: Coordinates, shape: tuple[int, ...]) -> None:
        """Refuse islands beyond the axes; masks in the caller's shape."""
        spread, X = place.spread.reshape(shape), place.X.reshape(shape)
        require("zeta_u/zeta_d - 1", spread, spread <= self._spread.high, f"at most {self._spread.high:g}")
        require("X", X, (self._X.low <= X) & (self._X.high >= X), self._range(self._X))

    def of_islands(self, islands: Mapping[str, FloatArray]) -> IslandAnswer:
        """Phi_F and Phi_A of islands, through their band and not through mu.

        Raises
        ------
        OutOfRangeError
            Where an island is not covered.
        """
        shape = np.shape(islands["X"])
        X, width, zeta_d, hurst, mu = (
            np.ascontiguousarray(islands[name], dtype=float).ravel() for name in ("X", "width", "zeta_d", "hurst", "mu")
        )
        spread = np.expm1(width)
        sphere = (SPHERE_FLOOR / zeta_d) ** (4 - 2 * hurst)
        own, low = islands["hurst"], islands["zeta_d"]
        require("hurst", own, (self._hurst.low <= own) & (self._hurst.high >= own), self._range(self._hurst))
        require("zeta_d", low, low >= SPHERE_FLOOR, f"at least {SPHERE_FLOOR}")
        place = Coordinates(X, spread, sphere, hurst, mu, np.ones_like(X))
        self._require_inside(place, shape)
        phi_F, phi_A = rigid_sphere(X, mu) * np.exp(self.log_ratio(place))
        return IslandAnswer(phi_F.reshape(shape), phi_A.reshape(shape), self.error(place).reshape(shape))

    @staticmethod
    def _range(axis: Axis) -> str:
        return f"in [{axis.low:g}, {axis.high:g}]"

    def _positions(self, place: Coordinates) -> FloatArray:
        inside = (place.X, np.maximum(place.spread, self._spread.low), place.sphere, place.hurst)
        return np.stack([axis.position(x) for axis, x in zip(self.content.axes, inside, strict=True)])

    def log_ratio(self, place: Coordinates) -> FloatArray:
        """log(Phi/Phi_rigid) inside the table or below its spread, shape (2, entries)."""
        out = np.empty((2, place.X.size))
        fill_4d(self.content.coefficients, self._positions(place), out)
        lowest = np.maximum(place.spread, self._spread.low)
        edge = band_fields(lowest, place.sphere, place.hurst, self.reading)[0]
        scaled: FloatArray = out * (place.mu / edge)
        return scaled

    def error(self, place: Coordinates) -> FloatArray:
        """Bound on the relative error of both functions."""
        field = self.content.local_error.max(axis=-1)
        cells = (
            error_cell(axis, count, p)
            for axis, count, p in zip(self.content.axes, field.shape, self._positions(place), strict=True)
        )
        bound: FloatArray = field[tuple(cells)]
        return bound


@functools.lru_cache(maxsize=8)
def island4d_model(path: os.PathLike[str] | str | None = None) -> Island4dModel:
    """The four-parameter model of the shipped table, or of a file; opened once."""
    return Island4dModel(read_table(path or shipped(ISLAND4D), ISLAND4D))


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
