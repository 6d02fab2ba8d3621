"""Island models that look up a table: over (X, mu), and over the paper's four numbers."""

from __future__ import annotations

import functools
import os
import pathlib
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import FloatArray, broadcast_shape, finite_array, require
from mbma_tables.islands.greenwood_tripp import rigid_sphere
from mbma_tables.models.protocol import IslandAnswer
from mbma_tables.models.raw import SPHERE_FLOOR, Coordinates, band_fields, hat_scales, to_axes
from mbma_tables.surfaces.readings import get_reading
from mbma_tables.tablefiles.files import read_table
from mbma_tables.tablefiles.interpolate import fill_2d, fill_4d
from mbma_tables.tablefiles.schema import ISLAND4D, UNIVERSAL, Axis, TableContent, error_cell

SECOND_ORDER = 1e-12  # what the expansion about the rigid sphere leaves below mu = 1e-8


class UniversalModel:
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

    def answer(self, X: FloatArray, mu: FloatArray) -> IslandAnswer:
        """Phi_F and Phi_A with the bound that the table's certificate gives.

        Raises
        ------
        OutOfRangeError
            Where X or mu is not covered.
        """
        shape = np.shape(X)
        flat_X, flat_mu = (np.ascontiguousarray(a, dtype=float).ravel() for a in (X, mu))
        low, high = self._X.low, self._X.high
        require("X", flat_X, (flat_X >= low) & (flat_X <= high), f"in [{low:g}, {high:g}]")
        require("mu", flat_mu, flat_mu <= self._mu.high, f"at most {self._mu.high:g}")
        force, area = rigid_sphere(flat_X, flat_mu) * np.exp(self.log_ratio(flat_X, flat_mu))
        return IslandAnswer(force.reshape(shape), area.reshape(shape), self.error(flat_X, flat_mu).reshape(shape))

    def error(self, X: FloatArray, mu: FloatArray) -> FloatArray:
        """Bound on the relative error of both functions at flat arguments."""
        field = self.content.local_error.max(axis=-1)
        lowest = np.maximum(mu, self._mu.low)
        places = (
            error_cell(axis, cells, axis.position(x))
            for axis, cells, x in zip((self._X, self._mu), field.shape, (X, lowest), strict=True)
        )
        bound: FloatArray = field[tuple(places)] + SECOND_ORDER
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
        delta, low, high, H = (np.broadcast_to(array, shape).ravel() for array in given.values())
        require("hurst", H, (self._hurst.low <= H) & (self._hurst.high >= H), self._range(self._hurst))
        require("zeta_d", low, low >= SPHERE_FLOOR, f"at least {SPHERE_FLOOR}")
        require("zeta_u", high, high > low, "above zeta_d")
        place = to_axes(delta, low, high, H, self.reading)
        spread, X = place.spread, place.X
        require("zeta_u/zeta_d - 1", spread, spread <= self._spread.high, f"at most {self._spread.high:g}")
        require("X", X, (self._X.low <= X) & (self._X.high >= X), self._range(self._X))
        phi_F, phi_A = rigid_sphere(X, place.mu) * np.exp(self.log_ratio(place))
        force, area = hat_scales(spread, low, H, place.sigma, self.reading)
        answers = (force * phi_F, area * phi_A, self.error(place))
        F_hat, A_hat, error = (a.reshape(shape)[()] for a in answers)
        return F_hat, A_hat, error

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
