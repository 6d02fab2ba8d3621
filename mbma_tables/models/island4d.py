"""The island model of the four-parameter table: F_hat and A_hat as functions of the paper's numbers, from one file."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.common.arguments import FloatArray, broadcast_shape, finite_array, require
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.core import in_blocks
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.four_numbers import SPHERE_FLOOR, Coordinates, band_fields, to_axes
from mbma_tables.models import SOLVER, IslandAnswer, check_outside
from mbma_tables.surfaces.variants import get_variant
from mbma_tables.tablefiles.schema import TableContent, error_cell

BLOCK = 1 << 15  # islands between two checks for Ctrl-C


def spline_of(coefficients: FloatArray) -> Any:
    """Cubic functions of four axes, of positions in units of nodes, (entries, 4); NaN beyond the axes."""
    from scipy.interpolate import NdBSpline

    knots = tuple(np.arange(count + 4) - 3.0 for count in coefficients.shape[:4])
    return NdBSpline(knots, coefficients, 3, extrapolate=False)


class Lookup(NamedTuple):
    """F_hat = F^i q0/(E* s), A_hat = A^i q0^2/eta and the bound on their relative error, arrays of one shape."""

    F_hat: Any
    A_hat: Any
    error: Any


class Island4dModel:
    """F_hat and A_hat by the paper's four numbers, from a four-parameter table alone.

    Parameters
    ----------
    content : TableContent
        A table of kind "island4d"; `open_table` reads one.

    Examples
    --------
    >>> from mbma_tables import open_table
    >>> F_hat, A_hat, error = open_table("island4d").lookup(1.0, 3.0, 20.0, 0.8)
    >>> f"{F_hat:.3f}"
    '0.353'
    """

    name = "island4d"

    def __init__(self, content: TableContent) -> None:
        self.content = content
        self.variant = get_variant(content.attributes["variant"])
        self._X, self._spread, _, self._hurst = content.axes
        self._spline = spline_of(content.coefficients)
        self._error: FloatArray = content.local_error.max(axis=-1)

    def __repr__(self) -> str:
        return f"Island4dModel({self.content.describe()})"

    def lookup(
        self,
        delta_over_h_rms: ArrayLike,
        zeta_d: ArrayLike,
        zeta_u: ArrayLike,
        hurst: ArrayLike,
        outside: str = "raise",
    ) -> Lookup:
        """F_hat and A_hat of islands given by the paper's four numbers.

        Parameters
        ----------
        delta_over_h_rms : array_like
            Approach of the island; with h_rms that for infinite zeta_1, Delta + zeta_d^(-H).
        zeta_d, zeta_u : array_like
            Magnifications of Eqs. (27) and (30), 1 < zeta_d < zeta_u.
        hurst : array_like
            Hurst exponent.
        outside : {"raise", "exact", "nan"}
            For islands that the table does not cover: an error, the exact solver, or NaN.
        """
        check_outside(outside)
        named = {"delta_over_h_rms": delta_over_h_rms, "zeta_d": zeta_d, "zeta_u": zeta_u, "hurst": hurst}
        given = {name: finite_array(name, value) for name, value in named.items()}
        shape = broadcast_shape(**given)
        delta, low, high, H = (np.ascontiguousarray(np.broadcast_to(array, shape)) for array in given.values())
        if outside != "raise":
            require("hurst", H, (H > 0) & (H <= 1), "in (0, 1]")
            require("zeta_d", low, low > 1, "above 1")
        else:
            self._refuse_ends(H, low)
        require("zeta_u", high, high > low, "above zeta_d")
        place = to_axes(delta.ravel(), low.ravel(), high.ravel(), H.ravel(), self.variant)
        phi, error = self._answer(place, outside, shape)
        return Lookup(*(row.reshape(shape)[()] for row in (place.force * phi[0], place.area * phi[1], error)))

    def of_islands(self, islands: Mapping[str, FloatArray], outside: str = "raise") -> IslandAnswer:
        """Phi_F and Phi_A of islands, through their band and not through mu; `outside` as in `lookup`."""
        shape = np.shape(islands["X"])
        X, width, zeta_d, hurst, mu = (
            np.ascontiguousarray(islands[name], dtype=float).ravel() for name in ("X", "width", "zeta_d", "hurst", "mu")
        )
        sphere = (SPHERE_FLOOR / zeta_d) ** (4 - 2 * hurst)
        if outside == "raise":
            self._refuse_ends(islands["hurst"], islands["zeta_d"])
        place = Coordinates(X, np.expm1(width), sphere, hurst, mu, *np.ones((3, X.size)))
        phi, error = self._answer(place, outside, shape)
        return IslandAnswer(phi[0].reshape(shape), phi[1].reshape(shape), error.reshape(shape))

    def _refuse_ends(self, hurst: FloatArray, zeta_d: FloatArray) -> None:
        """Reject islands that the axes hurst and sphere do not cover."""
        low, high = self._hurst.low, self._hurst.high
        require("hurst", hurst, (hurst >= low) & (hurst <= high), f"in [{low:g}, {high:g}]")
        require("zeta_d", zeta_d, zeta_d >= SPHERE_FLOOR, f"at least {SPHERE_FLOOR:g}")

    def _answer(self, place: Coordinates, outside: str, shape: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
        """(Phi_F, Phi_A) and the bound on their error, outside the table by the requested rule."""
        # below the first spread by the expansion about the rigid sphere
        inside: NDArray[np.bool_] = np.all(
            [
                (x <= axis.high) & ((x >= axis.low) | (axis is self._spread))
                for axis, x in zip(self.content.axes, place, strict=False)
            ],
            axis=0,
        )
        if outside == "raise" and not inside.all():
            spread, X = place.spread.reshape(shape), place.X.reshape(shape)
            require("zeta_u/zeta_d - 1", spread, spread <= self._spread.high, f"at most {self._spread.high:g}")
            low, high = self._X.low, self._X.high
            require("X", X, (low <= X) & (high >= X), f"in [{low:g}, {high:g}]")
            raise OutOfRangeError("islands outside the table's axes", ~inside.reshape(shape))
        phi, error = np.full((2, inside.size), np.nan), np.full(inside.size, np.nan)
        if inside.any():
            phi[:, inside], error[inside] = self._inside(Coordinates(*(field[inside] for field in place)))
        if outside == "exact":
            *phi[:, ~inside], error[~inside] = SOLVER.answer(place.X[~inside], place.mu[~inside])
        return phi, error

    def _inside(self, place: Coordinates) -> tuple[FloatArray, FloatArray]:
        """The same inside the table or below its spread, where log(Phi/Phi_rigid) is proportional to mu."""
        low = self._spread.low
        held = place.X, np.maximum(place.spread, low), place.sphere, place.hurst
        places = np.stack([axis.position(x) for axis, x in zip(self.content.axes, held, strict=True)])
        # an end may be missed by rounding
        places = np.clip(places, 0, [[axis.nodes - 1] for axis in self.content.axes])
        cells = [error_cell(*every) for every in zip(self.content.axes, self._error.shape, places, strict=True)]
        blocks = in_blocks(lambda block: self._spline(places[:, block].T).T, place.X.size, BLOCK)
        log_ratio = np.concatenate(blocks, axis=1)
        edge = band_fields(held[1], place.sphere, place.hurst, self.variant)[0]
        log_ratio *= np.where(place.spread < low, place.mu / edge, 1.0)
        rigid = greenwood_tripp.rigid_sphere(place.X, place.mu)
        return rigid * np.exp(log_ratio), np.asarray(self._error[tuple(cells)])
