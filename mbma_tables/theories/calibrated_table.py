"""The calibrated law's table: ln F_G over Hurst exponent, zeta_1 and mean separation, and errors against simulations.

F_G is the force of `mbma_tables.calibrated` on a surface without end. The end at h_max and the area are closed forms,
applied here. Below the table's least separation full contact rules, F^2 linear in ln u; above its largest ln F is
linear in u.
"""

from __future__ import annotations

import dataclasses
import functools
import pathlib
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.calibrated import Constants
from mbma_tables.compiled import in_blocks
from mbma_tables.errors import TableFileError
from mbma_tables.files import shipped_file
from mbma_tables.tablefiles.interpolate import fill_along, fill_pieces, polynomial_of, quintic, quintic_at, tiled
from mbma_tables.tablefiles.netcdf import HDF5_LOCK, read_sealed

NAME = "calibrated.nc"
AXES = ("hurst", "log_zeta_1", "log_separation")
QUANTITIES = ("area", "force", "stiffness")
BLOCK = 8192  # numbers answered at a time, which a processor's cache holds
SMALL = 256  # places up to which numpy answers, without a compiler
FEW, MIN_SHARED = 8, 256  # surfaces up to which, and places a surface from which, its polynomials are worth making
KEPT = 64  # surfaces whose polynomials are kept
MAX_STEPS = 100
CLOSE = 1e-9  # of ln F: the next miss would be about the square of this one
TINY = 1e-300
MAX_LOG_SEPARATION = 690.0  # -ln u at which full contact is taken as reached
TO_POWERS = np.array(polynomial_of(np.eye(6))).T  # of B-splines in a cell

Owners = NDArray[np.intp]
Along = Callable[[Owners, FloatArray], tuple[FloatArray, FloatArray]]


@dataclasses.dataclass(frozen=True, eq=False)
class SurfaceSpline:
    """Quintic B-splines over Hurst exponent, ln zeta_1 and a last axis.

    Attributes
    ----------
    first, step : numpy.ndarray, shape (3,)
        Of the equally spaced nodes along the axes.
    covered : numpy.ndarray, shape (3, 2) or (2, 2)
        First and last that are answered.
    coefficients : numpy.ndarray
    """

    first: FloatArray
    step: FloatArray
    covered: FloatArray
    coefficients: FloatArray

    @functools.cached_property
    def cells(self) -> Any:
        """Their number along each axis."""
        return np.array(self.coefficients.shape) - 5

    @functools.cached_property
    def tiles(self) -> Any:
        """Coefficients as `fill_along` takes them."""
        return tiled(self.coefficients)

    @functools.cached_property
    def last(self) -> float:
        """Where the last axis ends."""
        return float(self.first[2] + self.cells[2] * self.step[2])

    def covers(self, hurst: FloatArray, log_zeta_1: FloatArray) -> Any:
        """Which surfaces lie inside the table."""
        (low, high), (start, stop) = self.covered[:2]
        return (low <= hurst) & (hurst <= high) & (start <= log_zeta_1) & (log_zeta_1 <= stop)

    def along(self, surfaces: FloatArray, count: int) -> Along:
        """Value and derivative along the last axis, held at its ends, of numbers of surfaces and places there.

        Columns of `surfaces` begin with H and ln zeta_1; `count` is how many numbers will be asked at a time.
        """
        alike = all(bool((x[-1:] == x[:1]).all() and (x == x[:1]).all()) for x in surfaces[:2])
        own = surfaces[:, :1] if alike else surfaces
        shared = own.shape[1] <= FEW or count >= MIN_SHARED * own.shape[1]
        pieces = self._pieces(own) if shared else np.empty((0, 0, 0))
        low, rate, number = self.first[2], 1 / self.step, int(self.cells[2])

        def compiled(owner: Owners, x: FloatArray) -> Any:
            found = np.empty((2, x.size // max(owner.size, 1), owner.size))
            if shared:
                number_of = np.zeros_like(owner) if alike else owner
                fill_pieces(pieces, low, rate[2], number_of, x.reshape(found.shape[1:]), found)
            else:
                places = x.reshape(found.shape[1:])
                fill_along(self.tiles, number, self.first, rate, own, owner, places, found)
            return found.reshape(2, *x.shape)

        def plain(owner: Owners, x: FloatArray) -> Any:
            place = np.minimum(np.maximum((x - low) * rate[2], 0.0), number)
            k = np.minimum(place.astype(np.intp), number - 1)
            six = pieces[0 if alike else owner, k] if shared else self._piece(own[:, owner], k)
            value, slope = quintic_at([six[..., m] for m in range(6)], place - k)
            return value, slope * rate[2]

        return plain if count <= SMALL else compiled

    def _placed(self, surfaces: FloatArray) -> tuple[Any, Any]:
        """Cells of surfaces along H and ln zeta_1, and places in them, shape (2, surfaces)."""
        sizes = self.cells[:2, None]
        places = np.clip((surfaces[:2] - self.first[:2, None]) / self.step[:2, None], 0.0, sizes)
        cells = np.minimum(places.astype(np.intp), sizes - 1)
        return cells, places - cells

    def _piece(self, surfaces: FloatArray, cell: Owners) -> FloatArray:
        """Quintics in cells of the last axis, shape (..., surfaces, 6)."""
        (i, j), (x, y) = self._placed(surfaces)
        a, b, c = (steps[(...,) + (None,) * cell.ndim] for steps in np.ogrid[:6, :6, :6])
        six = np.einsum("abc...n,an,bn->...nc", self.coefficients[i + a, j + b, cell + c], quintic(x), quintic(y))
        return np.asarray(six @ TO_POWERS)

    def _pieces(self, surfaces: FloatArray) -> FloatArray:
        """Quintics in all cells of the last axis, shape (surfaces, cells, 6)."""
        return np.stack([_pieces_of(self, *one) for one in surfaces[:2].T.tolist()])


@functools.lru_cache(KEPT)
def _pieces_of(table: SurfaceSpline, hurst: float, log_zeta_1: float) -> FloatArray:
    """Those of one surface, kept for calls one by one."""
    (i, j), (x, y) = (part[:, 0].tolist() for part in table._placed(np.array([[hurst], [log_zeta_1]])))
    line = np.einsum("abk,a,b->k", table.coefficients[i : i + 6, j : j + 6], quintic(x), quintic(y))
    return np.asarray(line[np.arange(table.cells[2])[:, None] + np.arange(6)] @ TO_POWERS)


@dataclasses.dataclass(frozen=True, eq=False)
class Table(SurfaceSpline):
    """The shipped table in memory: ln F_G, in single precision.

    Attributes
    ----------
    constants : Constants
        Of the law.
    error : float
        Largest relative error of force against the law's own quadrature, at held-out points.
    scatter : dict
        By theory: ln of root mean squares of ln(theory/simulation), shape (3, bins), rows `QUANTITIES`.
    log_area : numpy.ndarray, shape (bins,)
        ln of the contact fractions that they belong to.
    """

    constants: Constants
    error: float
    scatter: dict[str, FloatArray]
    log_area: FloatArray

    def _log_gaussian(self, surfaces: FloatArray, count: int) -> Along:
        """ln F_G and its derivative by ln u, for `count` numbers at a time."""
        inside, low, high = self.along(surfaces, count), self.first[2], self.last

        def curve(owner: Owners, log_u: FloatArray) -> tuple[FloatArray, FloatArray]:
            value, rate = inside(owner, log_u)
            if not low <= log_u.min() <= log_u.max() <= high:
                growth, square = np.expm1(np.maximum(log_u - high, 0)), 1 + 2 * rate * np.minimum(log_u - low, 0)
                value, rate = value + rate * growth + np.log(square) / 2, rate * (growth + 1) / square
            return value, rate

        return curve

    @np.errstate(under="ignore")
    def fill(self, surfaces: FloatArray, owner: Owners, u: FloatArray) -> FloatArray:
        """Force, area and -dF/du, shape (3, n), of mean separations u [h_rms].

        `surfaces` has a column of Hurst exponent, ln zeta_1, s0 and h_max/h_rms for each surface, `owner` its number
        for each separation.
        """
        from scipy.special import erf

        curve, out = self._log_gaussian(surfaces, u.size), np.empty((3, u.size))

        def fill(block: slice) -> None:
            own, gap, (force, area, stiffness) = owner[block], u[block], out[:, block]
            light, h_max = surfaces[2][own], surfaces[3][own]
            held = np.minimum(np.maximum(gap, TINY), h_max)
            (value, end), (rate, _) = curve(own, np.log([held, h_max]))
            lost = -np.exp(value)
            # without cancellation
            np.multiply(lost, np.expm1(end - value), out=force)
            t = force / self.constants.area_t0
            erf(force * np.sqrt(2 * (1 + t) / (light + t)), out=area)
            np.divide(rate * lost, held, out=stiffness)
            if not ((gap > 0) & (gap < h_max)).all():
                out[:, block][:, gap >= h_max] = 0.0
                out[:, block][:, gap <= 0] = np.array([[np.inf], [1.0], [np.inf]])

        in_blocks(fill, u.size, BLOCK)
        return out

    @np.errstate(under="ignore")
    def separations(self, surfaces: FloatArray, owner: Owners, force: FloatArray) -> FloatArray:
        """Mean separations [h_rms] at forces F/(A0 E* g) > 0; NaN where they lie beyond the table."""
        curve, out = self._log_gaussian(surfaces, force.size), np.empty(force.size)
        nodes = self.first[2] + self.step[2] * np.arange(self.cells[2])

        def fill(block: slice) -> None:
            own = owner[block]
            high, low = np.log(surfaces[3][own]), np.full(own.size, -MAX_LOG_SEPARATION)
            end, most = curve(own, np.array([high, low]))[0]
            # Newton's method in ln(F + F_G(h_max)), which is smooth to the end, in a bracket
            rise, x = np.logaddexp(0.0, np.log(force[block]) - end), high - 0.5
            if surfaces.shape[1] == 1:
                x = np.minimum(np.interp(-(end + rise), -self._pieces(surfaces)[0, :, 0], nodes), high)
            beyond = done = end + rise > most
            for _ in range(MAX_STEPS):
                value, rate = curve(own, x)
                miss = (value - end) - rise
                low, high = np.where(miss > 0, x, low), np.where(miss > 0, high, x)
                following, near = x - miss / rate, np.abs(miss) <= CLOSE
                held = np.where(near, np.clip(following, low, high), 0.5 * (low + high))
                following = np.where((low < following) & (following < high), following, held)
                x, done = np.where(done, x, following), done | near | (high - low <= 2e-16)
                if done.all():
                    break
            out[block] = np.where(beyond, np.nan, np.exp(x))

        in_blocks(fill, force.size, BLOCK)
        return out

    def standard_deviation(self, theory: str, quantity: str, area: FloatArray) -> FloatArray:
        """Root mean square of ln(theory/simulation) at contact fractions; NaN where not known."""
        if theory not in self.scatter:
            return np.full(np.shape(area), np.nan)
        return np.asarray(np.exp(at_contact(self.log_area, self.scatter[theory][QUANTITIES.index(quantity)], area)))


def at_contact(log_area: FloatArray, row: FloatArray, area: FloatArray) -> FloatArray:
    """Numbers known at some contact fractions at others; NaN above the last one with a number."""
    known = np.isfinite(row)
    with np.errstate(divide="ignore"):
        return np.interp(np.log(area), log_area[known], row[known], right=None if known[-1] else np.nan)


def nodes_of(axes: list[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """First node and step of axes."""
    return np.array([axis[0] for axis in axes]), np.array([(axis[-1] - axis[0]) / (axis.size - 1) for axis in axes])


def _read(path: pathlib.Path, group: str = "") -> tuple[dict[str, FloatArray], dict[str, Any], dict[str, Any]]:
    """Variables and attributes of a file of the calibrated law, or of a group of it, and what its axes cover."""
    import netCDF4

    body = read_sealed(path)
    with HDF5_LOCK, netCDF4.Dataset(path.name, memory=body) as data:
        if getattr(data, "mbma_kind", None) != "calibrated":
            raise TableFileError(f"{path}: is no table of the calibrated law")
        if group and group not in data.groups:
            raise TableFileError(f"{path}: has no group {group!r}, only {sorted(data.groups)}")
        data.set_auto_mask(False)
        part = data[group] if group else data
        covered = {name: x.getncattr("covered") for name, x in part.variables.items() if "covered" in x.ncattrs()}
        return {name: np.array(x[...]) for name, x in part.variables.items()}, part.__dict__, covered


def load(path: pathlib.Path) -> Table:
    """Read a table file.

    Raises
    ------
    TableFileError
        Where it is damaged or is another file.
    """
    values, facts, covered = _read(path)
    return Table(
        *nodes_of([values[name] for name in AXES]),
        np.array([covered[name] for name in AXES]),
        values["spline"],
        Constants(*(float(facts[f"law_{field.name}"]) for field in dataclasses.fields(Constants))),
        float(facts["largest_error_force"]),
        dict(zip(facts["theories"].split(), np.log(values["stated_scatter"]), strict=True)),
        np.log(values["contact"]),
    )


@functools.cache
def shipped() -> Table:
    """The shipped table, read once."""
    return load(shipped_file(NAME))


@functools.cache
def shipped_part(group: str) -> tuple[dict[str, FloatArray], dict[str, Any]]:
    """Variables and attributes of a group of the shipped file, read once."""
    return _read(shipped_file(NAME), group)[:2]
