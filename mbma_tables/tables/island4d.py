"""The island model of the four-parameter table: F_hat and A_hat as functions of the paper's numbers, from one file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import (
    FloatArray,
    answered,
    broadcast_shape,
    filled,
    finite_array,
    require,
)
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.common.shared import shared_property
from mbma_tables.core import core
from mbma_tables.islands.island_models import SOLVER, IslandAnswer, check_outside
from mbma_tables.islands.variants import Variant, get_variant
from mbma_tables.tables.grids import OfTable, on_grid
from mbma_tables.tables.schema import Axis, TableContent

if TYPE_CHECKING:
    import xarray as xr

# zeta_d at the end of the axis `sphere`, below the paper's floor of 1.5; as in mbma.h
SPHERE_FLOOR = 1.25


def band_fields(
    spread: FloatArray, sphere: FloatArray, hurst: FloatArray, variant: Variant
) -> FloatArray:
    """(mu, sigma zeta_d^H, F_hat zeta_d^(1+H) per Phi_F, A_hat zeta_d^2 per Phi_A), stacked first.

    All are finite for every zeta_d, because its powers cancel; NaN unless zeta_u > zeta_d.
    """
    given = spread, sphere, hurst
    return np.array(answered(core.island_bands, given, 4, variant.numbers))


class Coordinates(NamedTuple):
    """Islands in the four-parameter table: coordinates in the order of its axes, and derived quantities."""

    X: FloatArray
    spread: FloatArray
    sphere: FloatArray
    hurst: FloatArray
    mu: FloatArray
    sigma: FloatArray  # times zeta_d^H
    force: FloatArray  # F_hat per Phi_F, sigma sqrt(2 R_d sigma)
    area: FloatArray  # A_hat per Phi_A, 2 pi D R_u R_d sigma^2


def to_axes(
    delta_over_h_rms: FloatArray,
    zeta_d: FloatArray,
    zeta_u: FloatArray,
    hurst: FloatArray,
    variant: Variant,
) -> Coordinates:
    """Table coordinates of the paper's four numbers; NaN unless zeta_u > zeta_d."""
    given = delta_over_h_rms, zeta_d, zeta_u, hurst
    X, spread, sphere, *others = answered(core.island_places, given, 7, variant.numbers)
    return Coordinates(X, spread, sphere, np.broadcast_to(hurst, X.shape), *others)


def core_table(
    axes: Sequence[Axis],
    coefficients: FloatArray,
    local_error: FloatArray,
    variant: Variant,
) -> tuple[Any, ...]:
    """A table in the core's format, `mbma_island_table` of mbma.h: coefficients, errors, cells, numbers and variant."""
    numbers = [
        [axis.start for axis in axes],
        [1 / axis.step for axis in axes],
        [axis.low for axis in axes],
        [axis.high for axis in axes],
    ]
    return (
        np.ascontiguousarray(coefficients, np.float32).ravel(),
        np.ascontiguousarray(local_error.max(axis=-1), np.float32).ravel(),
        np.array([axis.nodes - 1 for axis in axes], np.int64),
        np.append(np.ravel(numbers), axes[0].offset),
        variant.numbers,
    )


class Lookup(NamedTuple):
    """F_hat = F^i q0/(E* s), A_hat = A^i q0^2/eta and the bound on their relative error, arrays of one shape."""

    F_hat: Any
    A_hat: Any
    error: Any


class Island4dModel(OfTable):
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
        super().__init__(content)
        self.variant = get_variant(content.attributes["variant"])
        self._X, self._spread, _, self._hurst = content.axes

    @shared_property
    def core_table(self) -> tuple[Any, ...]:
        """The table in the core's format, see `core_table`."""
        own = self.content
        return core_table(own.axes, own.coefficients, own.local_error, self.variant)

    @shared_property
    def _one(self) -> Any:
        """Of one island of four floats its lookup, None outside the table and for other types."""
        return core.Table(*self.core_table).at

    def lookup(
        self,
        delta: ArrayLike,
        zeta_d: ArrayLike,
        zeta_u: ArrayLike,
        hurst: ArrayLike,
        outside: str = "raise",
    ) -> Lookup:
        """F_hat and A_hat of islands given by the paper's four numbers.

        Parameters
        ----------
        delta : array_like
            delta/h_rms, the approach of the island; h_rms is that for infinite zeta_1,
            so that it is Delta + zeta_d^(-H).
        zeta_d, zeta_u : array_like
            Magnifications of Eqs. (27) and (30), 1 < zeta_d < zeta_u.
        hurst : array_like
            Hurst exponent.
        outside : {"raise", "exact", "nan"}
            For islands that the table does not cover: an error, the exact solver, or NaN.
            Combinations with zeta_u <= zeta_d are no islands: NaN for "nan", else an error.

        Returns
        -------
        Lookup
            F_hat in E* s/q0, A_hat in eta/q0^2 and the bound on their relative error, numbers
            or arrays of the arguments' common shape.

        Raises
        ------
        InputError
            For what is not finite, not real, or not broadcastable.
        OutOfRangeError
            For islands outside the table, unless `outside` says otherwise.

        Examples
        --------
        >>> from mbma_tables import open_table
        >>> table = open_table("island4d")
        >>> found = table.lookup(delta=[0.9, 1.0], zeta_d=3.0, zeta_u=20.0, hurst=0.8)
        >>> found.F_hat.shape, bool((found.error < 1e-4).all())
        ((2,), True)
        """
        check_outside(outside)
        one = self._one(delta, zeta_d, zeta_u, hurst)
        if one is not None:
            return Lookup._make(map(np.float64, one))
        named = {
            "delta": delta,
            "zeta_d": zeta_d,
            "zeta_u": zeta_u,
            "hurst": hurst,
        }
        given = {name: finite_array(name, value) for name, value in named.items()}
        shape = broadcast_shape(**given)
        approach, low, high, H = (
            np.ascontiguousarray(np.broadcast_to(array, shape))
            for array in given.values()
        )
        if outside != "raise":
            require("hurst", H, (H > 0) & (H <= 1), "in (0, 1]")
            require("zeta_d", low, low > 1, "above 1")
        else:
            self._refuse_ends(H, low)
        if outside != "nan":
            ordered = "above zeta_d (outside='nan' leaves NaN there)"
            require("zeta_u", high, high > low, ordered)
        place = to_axes(
            approach.ravel(), low.ravel(), high.ravel(), H.ravel(), self.variant
        )
        phi_F, phi_A, error = self._answer(place, outside, shape)
        return Lookup(
            *(
                row.reshape(shape)[()]
                for row in (place.force * phi_F, place.area * phi_A, error)
            )
        )

    def to_dataset(
        self,
        delta: ArrayLike,
        zeta_d: ArrayLike,
        zeta_u: ArrayLike,
        hurst: ArrayLike,
        outside: str = "nan",
    ) -> xr.Dataset:
        """F_hat, A_hat and the bound on their error on a grid.

        Parameters
        ----------
        delta, zeta_d, zeta_u, hurst : array_like
            The axes, each a number or of one dimension; as in `lookup`.
        outside : {"nan", "raise", "exact"}
            As in `lookup`; the attribute `outside` of the Dataset states it.

        Returns
        -------
        xarray.Dataset
            F_hat, A_hat and error, of shape (delta, zeta_d, zeta_u, hurst).

        Raises
        ------
        InputError, OutOfRangeError

        Examples
        --------
        >>> from mbma_tables import open_table
        >>> table = open_table("island4d")
        >>> grid = table.to_dataset([0.9, 1.0], zeta_d=3.0, zeta_u=[20, 30], hurst=0.8)
        >>> dict(grid.sizes)
        {'delta': 2, 'zeta_d': 1, 'zeta_u': 2, 'hurst': 1}
        """
        check_outside(outside)
        axes = {"delta": delta, "zeta_d": zeta_d, "zeta_u": zeta_u, "hurst": hurst}
        return on_grid(self.content, axes, self.lookup, outside)

    def of_islands(
        self, islands: Mapping[str, FloatArray], outside: str = "raise"
    ) -> IslandAnswer:
        """Phi_F and Phi_A of islands, through their band and not through mu; `outside` as in `lookup`."""
        shape = np.shape(islands["X"])
        X, width, zeta_d, hurst, mu = (
            np.ascontiguousarray(islands[name], dtype=float).ravel()
            for name in ("X", "width", "zeta_d", "hurst", "mu")
        )
        sphere = (SPHERE_FLOOR / zeta_d) ** (4 - 2 * hurst)
        if outside == "raise":
            self._refuse_ends(islands["hurst"], islands["zeta_d"])
        place = Coordinates(X, np.expm1(width), sphere, hurst, mu, *np.ones((3, X.size)))
        return IslandAnswer(
            *(row.reshape(shape) for row in self._answer(place, outside, shape))
        )

    def _refuse_ends(self, hurst: FloatArray, zeta_d: FloatArray) -> None:
        """Reject islands that the axes hurst and sphere do not cover."""
        low = self._hurst.low
        high = self._hurst.high
        require(
            "hurst", hurst, (hurst >= low) & (hurst <= high), f"in [{low:g}, {high:g}]"
        )
        require("zeta_d", zeta_d, zeta_d >= SPHERE_FLOOR, f"at least {SPHERE_FLOOR:g}")

    def _answer(
        self, place: Coordinates, outside: str, shape: tuple[int, ...]
    ) -> FloatArray:
        """Rows of Phi_F, Phi_A and the bound on their error, outside the table by the requested rule.

        Below the table's spread log(Phi/Phi_rigid) is proportional to mu.
        """
        given = *place[:4], place.mu
        out = filled(core.island_answers, given, 3, *self.core_table)
        missing = np.isnan(out[2])
        if not missing.any():
            return out
        if outside == "raise":
            spread = place.spread.reshape(shape)
            X = place.X.reshape(shape)
            require(
                "zeta_u/zeta_d - 1",
                spread,
                spread <= self._spread.high,
                f"at most {self._spread.high:g}",
            )
            require(
                "X",
                X,
                (self._X.low <= X) & (self._X.high >= X),
                f"in [{self._X.low:g}, {self._X.high:g}]",
            )
            raise OutOfRangeError(
                "islands outside the table's axes", missing.reshape(shape)
            )
        if outside == "exact":
            out[:, missing] = SOLVER.answer(place.X[missing], place.mu[missing])
        return out
