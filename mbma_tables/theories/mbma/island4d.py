"""The island model of the four-parameter table: F_hat and A_hat as functions of the paper's numbers, from one file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import (
    FloatArray,
    broadcast_shape,
    finite_array,
    require,
)
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.common.interrupts import in_blocks
from mbma_tables.common.table_schema import TableContent, error_cell
from mbma_tables.surfaces.spectrum import BROADENING, RADIUS
from mbma_tables.theories.mbma import greenwood_tripp
from mbma_tables.theories.mbma.island_models import SOLVER, IslandAnswer, check_outside
from mbma_tables.theories.mbma.variants import Variant, get_variant

MOST_WIDTH = (
    700.0  # largest (4 - 2H) ln(zeta_u/zeta_d), so that its exponential is finite
)
SPHERE_FLOOR = (
    1.25  # zeta_d at the end of the axis `sphere`, below the paper's floor of 1.5
)
BLOCK = 1 << 15  # islands between two checks for Ctrl-C


def band_fields(
    spread: FloatArray, sphere: FloatArray, hurst: FloatArray, variant: Variant
) -> FloatArray:
    """(mu, sigma zeta_d^H, F_hat zeta_d^(1+H) per Phi_F, A_hat zeta_d^2 per Phi_A), stacked first.

    Arrays of one shape. All are finite for every zeta_d, because its powers cancel; NaN
    unless zeta_u > zeta_d.
    """
    from scipy.special import exprel

    with np.errstate(all="ignore"):
        power = 4 - 2 * hurst
        width = np.log1p(spread)
        # zeta_d^(-p), and integrals of r^(order - 2H - 1) over the band and its width
        inverse = sphere * SPHERE_FLOOR**-power
        growth = [exprel((k - 2 * hurst) * width) for k in (0, 2, 4)]
        D = 0.75 * (growth[2] / growth[1]) / variant.density_divisor
        # alpha = 1.5 g0 g4/g2^2, Eq. (3), grouped so that nothing overflows
        narrowness = growth[1] / growth[0] * (growth[1] / growth[2])
        share = 1 - (BROADENING / 1.5 * narrowness if variant.summit_sigma else 0.0)
        sigma = np.sqrt(share * (2 * hurst * width * growth[0]))
        scale = 0.75 * hurst / power
        top = np.exp(power * width)
        R_d, R_u = (RADIUS / np.sqrt(scale * (end - inverse)) for end in (1.0, top))
        mu = 8 / 3 * D * sigma * np.sqrt(2 * R_u * R_d)
        found = np.array(
            [
                mu,
                sigma,
                sigma * np.sqrt(2 * R_d * sigma),
                2 * np.pi * D * R_u * R_d * sigma**2,
            ]
        )
        good = (
            (spread > 0) & (sphere >= 0) & (np.abs(power * width) < MOST_WIDTH) & (mu > 0)
        )
    return np.where(good, found, np.nan)


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
    """Table coordinates of the paper's four numbers, flat arrays with zeta_u > zeta_d."""
    spread = (zeta_u - zeta_d) / zeta_d
    sphere = (SPHERE_FLOOR / zeta_d) ** (4 - 2 * hurst)
    mu, sigma, force, area = band_fields(spread, sphere, hurst, variant)
    wide = zeta_d**hurst
    X = (delta_over_h_rms * wide - 1) / sigma
    return Coordinates(
        X, spread, sphere, hurst, mu, sigma, force / (zeta_d * wide), area / zeta_d**2
    )


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
        named = {
            "delta_over_h_rms": delta_over_h_rms,
            "zeta_d": zeta_d,
            "zeta_u": zeta_u,
            "hurst": hurst,
        }
        given = {name: finite_array(name, value) for name, value in named.items()}
        shape = broadcast_shape(**given)
        delta, low, high, H = (
            np.ascontiguousarray(np.broadcast_to(array, shape))
            for array in given.values()
        )
        if outside != "raise":
            require("hurst", H, (H > 0) & (H <= 1), "in (0, 1]")
            require("zeta_d", low, low > 1, "above 1")
        else:
            self._refuse_ends(H, low)
        require("zeta_u", high, high > low, "above zeta_d")
        place = to_axes(delta.ravel(), low.ravel(), high.ravel(), H.ravel(), self.variant)
        phi_F, phi_A, error = self._answer(place, outside, shape)
        return Lookup(
            *(
                row.reshape(shape)[()]
                for row in (place.force * phi_F, place.area * phi_A, error)
            )
        )

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
        axes = self.content.axes
        low = self._spread.low
        held = place.X, np.maximum(place.spread, low), place.sphere, place.hurst
        inside = np.all(
            [
                (x >= axis.low) & (x <= axis.high)
                for axis, x in zip(axes, held, strict=True)
            ],
            axis=0,
        )
        if outside == "raise" and not inside.all():
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
                "islands outside the table's axes", ~inside.reshape(shape)
            )
        out = np.full((3, inside.size), np.nan)
        if inside.any():
            X, spread, sphere, hurst = given = [x[inside] for x in held]
            # an end may be missed by rounding
            places = np.stack(
                [
                    np.clip(axis.position(x), 0, axis.nodes - 1)
                    for axis, x in zip(axes, given, strict=True)
                ]
            )
            cells = [
                error_cell(*every)
                for every in zip(axes, self._error.shape, places, strict=True)
            ]
            blocks = in_blocks(
                lambda block: self._spline(places[:, block].T).T, X.size, BLOCK
            )
            mu = place.mu[inside]
            edge = band_fields(spread, sphere, hurst, self.variant)[0]
            log_ratio = np.concatenate(blocks, axis=1) * np.where(
                place.spread[inside] < low, mu / edge, 1.0
            )
            out[:2, inside] = greenwood_tripp.rigid_sphere(X, mu) * np.exp(log_ratio)
            out[2, inside] = self._error[tuple(cells)]
        if outside == "exact":
            out[:, ~inside] = SOLVER.answer(place.X[~inside], place.mu[~inside])
        return out
