"""The island model of the four-parameter table: F_hat and A_hat as functions of the paper's numbers, from one file."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.common.arguments import FloatArray, broadcast_shape, finite_array, require
from mbma_tables.common.display import Displayed, Variable
from mbma_tables.common.errors import InputError, OutOfRangeError
from mbma_tables.common.plots import draw_lines
from mbma_tables.core import core, in_blocks
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.four_numbers import SPHERE_FLOOR, Coordinates, band_fields, to_axes
from mbma_tables.islands.height_integrals import height_integral
from mbma_tables.models import SOLVER, IslandAnswer, check_outside
from mbma_tables.surfaces.variants import get_variant
from mbma_tables.tablefiles.schema import TableContent, error_cell

RAW = ("delta_over_h_rms", "zeta_d", "zeta_u", "hurst")
STEP = 1e-5  # relative step of a raw number or of the spread; the error of central differences is its square
BLOCK = 1 << 15  # islands between two checks for Ctrl-C


def _broadcast(*values: ArrayLike) -> tuple[tuple[int, ...], list[FloatArray]]:
    """The common shape of the four raw numbers, and the numbers broadcast to it."""
    given = {name: finite_array(name, value) for name, value in zip(RAW, values, strict=True)}
    shape = broadcast_shape(**given)
    return shape, [np.ascontiguousarray(np.broadcast_to(array, shape)) for array in given.values()]


def at_places(coefs: FloatArray, places: FloatArray, slopes: bool = False) -> FloatArray:
    """Two cubic functions of four axes, (2, entries), at positions in node units, (4, entries); NaN beyond the axes.

    With `slopes` the values come with derivatives by the positions, (2, 5, entries).
    """
    nodes, given = np.array(coefs.shape[:4]) - 2, np.ascontiguousarray(places, dtype=float)
    out = np.empty((2, 5, given.shape[1]) if slopes else (2, given.shape[1]))
    core.spline4(given, np.ascontiguousarray(coefs), nodes, slopes, out)
    return out


@dataclasses.dataclass(frozen=True, eq=False)
class Lookup:
    """F_hat = F^i q0/(E* s), A_hat = A^i q0^2/eta and the bound on their relative error, arrays of one shape.

    `F_by` and `A_by` hold derivatives by the four raw numbers, if requested. Unpacks to the first three.
    """

    F_hat: Any
    A_hat: Any
    error: Any
    F_by: dict[str, Any] | None = None
    A_by: dict[str, Any] | None = None

    def __iter__(self) -> Iterator[Any]:
        return iter((self.F_hat, self.A_hat, self.error))


class Island4dModel(Displayed):
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
        self._error: FloatArray = content.local_error.max(axis=-1)

    def _facts(self) -> dict[str, str]:
        return self.content.facts()

    def _variables(self) -> dict[str, Variable]:
        names = tuple(axis.name for axis in self.content.axes)
        axes = {axis.name: Variable(axis.values, "1", axis.long_name, (axis.name,)) for axis in self.content.axes}
        fields = {name: row for name, row in self.content.auxiliary.items() if row[0] == names}
        return axes | {
            name: Variable(values, "1", about["long_name"], names) for name, (_, values, about) in fields.items()
        }

    def _figure(self) -> Any:
        delta = np.geomspace(0.05, 2.0, 60)
        found = {hurst: self.lookup(delta, 3.0, 20.0, hurst, outside="nan").F_hat for hurst in (0.5, 0.7, 0.9)}
        return draw_lines({f"H = {hurst}": (delta, F) for hurst, F in found.items()}, "delta/h_rms", "F_hat")

    def lookup(
        self,
        delta_over_h_rms: ArrayLike,
        zeta_d: ArrayLike,
        zeta_u: ArrayLike,
        hurst: ArrayLike,
        outside: str = "raise",
        derivatives: bool = False,
        parallel: bool = False,
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
        derivatives : bool
            Whether to compute derivatives by the four numbers; these come from the table alone.
        parallel : bool
            Whether to use all cores, for large batches.

        Raises
        ------
        InputError, OutOfRangeError
        """
        check_outside(outside)
        if derivatives and outside == "exact":
            raise InputError("derivatives come from the table: outside must be 'raise' or 'nan' with them")
        shape, raw = _broadcast(delta_over_h_rms, zeta_d, zeta_u, hurst)
        if outside != "raise":
            require("hurst", raw[3], (raw[3] > 0) & (raw[3] <= 1), "in (0, 1]")
            require("zeta_d", raw[1], raw[1] > 1, "above 1")
        else:
            self._refuse_ends(raw[3], raw[1])
        require("zeta_u", raw[2], raw[2] > raw[1], "above zeta_d")
        delta, low, high, H = (array.ravel() for array in raw)
        place = to_axes(delta, low, high, H, self.variant)
        inside = self._covers(place)
        if outside == "raise":
            self._refuse(place, inside, shape)
        phi, error = self._answer(place, inside, outside, parallel)
        F_hat, A_hat = place.force * phi[0], place.area * phi[1]
        by: tuple[dict[str, Any] | None, ...] = (None, None)
        if derivatives:
            slopes = self._log_slopes(place, inside, (delta, low, high, H))
            by = tuple(
                {name: (hat * slopes[name][number]).reshape(shape)[()] for name in RAW}
                for number, hat in enumerate((F_hat, A_hat))
            )
        F_hat, A_hat, error = (a.reshape(shape)[()] for a in (F_hat, A_hat, error))
        return Lookup(F_hat, A_hat, error, *by)

    def status(
        self, delta_over_h_rms: ArrayLike, zeta_d: ArrayLike, zeta_u: ArrayLike, hurst: ArrayLike
    ) -> tuple[NDArray[np.int8], ...]:
        """Where islands lie on the axes X, spread, sphere and hurst: -1 below, 0 inside, 1 above.

        Islands below the spread are computed to first order in mu; there are none below the axis sphere.
        """
        shape, raw = _broadcast(delta_over_h_rms, zeta_d, zeta_u, hurst)
        delta, low, high, H = (array.ravel() for array in raw)
        place = to_axes(delta, low, high, H, self.variant)
        return tuple(axis.side(x.reshape(shape)) for axis, x in zip(self.content.axes, place, strict=False))

    def of_islands(self, islands: Mapping[str, FloatArray], outside: str = "raise") -> IslandAnswer:
        """Phi_F and Phi_A of islands, through their band and not through mu; `outside` as in `lookup`."""
        shape = np.shape(islands["X"])
        X, width, zeta_d, hurst, mu = (
            np.ascontiguousarray(islands[name], dtype=float).ravel() for name in ("X", "width", "zeta_d", "hurst", "mu")
        )
        sphere = (SPHERE_FLOOR / zeta_d) ** (4 - 2 * hurst)
        place = Coordinates(X, np.expm1(width), sphere, hurst, mu, *np.ones((3, X.size)))
        inside = self._covers(place)
        if outside == "raise":
            self._refuse_ends(islands["hurst"], islands["zeta_d"])
            self._refuse(place, inside, shape)
        phi, error = self._answer(place, inside, outside, parallel=False)
        return IslandAnswer(phi[0].reshape(shape), phi[1].reshape(shape), error.reshape(shape))

    def _covers(self, place: Coordinates) -> NDArray[np.bool_]:
        # below the first spread by the expansion about the rigid sphere
        covered = [
            (x <= axis.high) & ((x >= axis.low) | (axis is self._spread))
            for axis, x in zip(self.content.axes, place, strict=False)
        ]
        return np.asarray(np.all(covered, axis=0))

    def _refuse_ends(self, hurst: FloatArray, zeta_d: FloatArray) -> None:
        """Reject islands that the axes hurst and sphere do not cover."""
        low, high = self._hurst.low, self._hurst.high
        require("hurst", hurst, (hurst >= low) & (hurst <= high), f"in [{low:g}, {high:g}]")
        require("zeta_d", zeta_d, zeta_d >= SPHERE_FLOOR, f"at least {SPHERE_FLOOR:g}")

    def _refuse(self, place: Coordinates, inside: NDArray[np.bool_], shape: tuple[int, ...]) -> None:
        """Raise an error with the first axis whose range an island leaves."""
        if inside.all():
            return
        spread, X = place.spread.reshape(shape), place.X.reshape(shape)
        require("zeta_u/zeta_d - 1", spread, spread <= self._spread.high, f"at most {self._spread.high:g}")
        low, high = self._X.low, self._X.high
        require("X", X, (low <= X) & (high >= X), f"in [{low:g}, {high:g}]")
        raise OutOfRangeError("islands outside the table's axes", ~inside.reshape(shape))

    def _answer(
        self, place: Coordinates, inside: NDArray[np.bool_], outside: str, parallel: bool
    ) -> tuple[FloatArray, FloatArray]:
        """(Phi_F, Phi_A) and the bound on their error, outside the table by the requested rule."""
        if inside.all():
            phi = greenwood_tripp.rigid_sphere(place.X, place.mu) * np.exp(self.log_ratio(place, parallel))
            return phi, self.error(place)
        phi, error = np.full((2, inside.size), np.nan), np.full(inside.size, np.nan)
        if inside.any():
            phi[:, inside], error[inside] = self._answer(place.some(inside), inside[inside], outside, parallel)
        if outside == "exact":
            *phi[:, ~inside], error[~inside] = SOLVER.answer(place.X[~inside], place.mu[~inside])
        return phi, error

    def _positions(self, place: Coordinates) -> FloatArray:
        inside = (place.X, np.maximum(place.spread, self._spread.low), place.sphere, place.hurst)
        return np.stack([axis.position(x) for axis, x in zip(self.content.axes, inside, strict=True)])

    def _share(self, place: Coordinates) -> FloatArray:
        """mu over mu at the least spread, below it; 1 elsewhere."""
        low = self._spread.low
        edge = band_fields(np.maximum(place.spread, low), place.sphere, place.hurst, self.variant)[0]
        return np.where(place.spread < low, place.mu / edge, 1.0)

    def log_ratio(self, place: Coordinates, parallel: bool = False) -> FloatArray:
        """log(Phi/Phi_rigid) inside the table or below its spread, shape (2, entries)."""
        out = np.empty((2, place.X.size))
        places = self._positions(place)

        def fill(block: slice) -> None:
            out[:, block] = at_places(self.content.coefficients, places[:, block])

        in_blocks(fill, place.X.size, BLOCK, (os.cpu_count() or 1) if parallel else 1)
        return np.asarray(out * self._share(place))

    def error(self, place: Coordinates) -> FloatArray:
        """Bound on the relative error of both functions."""
        every = zip(self.content.axes, self._error.shape, self._positions(place), strict=True)
        return np.asarray(self._error[tuple(error_cell(axis, count, p) for axis, count, p in every)])

    def _moving(self, raw: Any, below: NDArray[np.bool_]) -> FloatArray:
        """Variables of log F_hat and log A_hat: positions on the axes, log(mu), X, logarithms of both scales."""
        delta, zeta_d, zeta_u, hurst = raw
        at = to_axes(delta, zeta_d, zeta_u, hurst, self.variant)
        places, log_mu = self._positions(at), np.log(at.mu)
        # below the table the logarithm depends on mu only
        places[1] = np.where(below, 0.0, places[1])
        return np.stack([*places, log_mu, at.X, np.log(at.force) + log_mu, np.log(at.area)])

    def _log_slopes(self, place: Coordinates, inside: NDArray[np.bool_], raw: Any) -> dict[str, FloatArray]:
        """Derivatives of log F_hat and log A_hat by the raw numbers, each (2, entries); NaN outside."""
        kept, raw = place.some(inside), [number[inside] for number in raw]
        below = kept.spread < self._spread.low
        out = at_places(self.content.coefficients, self._positions(kept), slopes=True) * self._share(kept)
        rigid = [n * height_integral(n - 1, -kept.X) / height_integral(n, -kept.X) for n in (2.5, 2.0)]
        by = np.concatenate([out[:, 1:], np.where(below, out[:, :1], 0.0), np.stack(rigid)[:, None]], axis=1)
        found = {name: np.full((2, inside.size), np.nan) for name in RAW}
        for number, name in enumerate(RAW):
            # the spread follows the ends of a narrow band closely, X the other two, down to their last bit
            width = kept.spread if name in ("zeta_d", "zeta_u") else kept.sigma
            step = np.maximum(STEP * raw[number] * np.minimum(1.0, width), np.spacing(raw[number]))
            high, low = ([*raw[:number], raw[number] + move, *raw[number + 1 :]] for move in (step, -step))
            # over the step as rounded
            change = (self._moving(high, below) - self._moving(low, below)) / (high[number] - low[number])
            found[name][:, inside] = change[6:] + (by * change[:6]).sum(axis=1)
        return found
