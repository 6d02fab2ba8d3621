"""The calibrated law's table: ln F_G over Hurst exponent, zeta_1 and mean separation, and errors against simulations.

F_G is the force of `mbma_tables.calibrated` on a surface without end. The end at h_max and the area are closed forms,
applied here. Below the table's least separation full contact rules, F^2 linear in ln u; above its largest ln F is
linear in u.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import pathlib
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.calibrated import Constants
from mbma_tables.compiled import CONTRACT, jitable, njit
from mbma_tables.elementary import exp, expm1, log
from mbma_tables.errors import TableFileError
from mbma_tables.files import shipped_file
from mbma_tables.tablefiles.interpolate import PART, Eight, Six, cell, patch_lanes, quintic
from mbma_tables.tablefiles.netcdf import HDF5_LOCK, read_sealed

NAME = "calibrated.nc"
AXES = ("hurst", "log_zeta_1", "log_separation")
QUANTITIES = ("area", "force", "stiffness")
MAX_STEPS = 100
CLOSE = 1e-9  # of ln F: the next miss would be about the square of this one
ONE_BY_ONE = 16  # forces up to which plain numbers cost less than numpy
SMALL = 256  # separations up to which numpy answers, without a compiler
MIN_SHARED = 32  # separations a surface from which its coefficients in ln u are worth summing
TINY = 1e-300
MAX_LOG_SEPARATION = 690.0  # -ln u at which full contact is taken as reached

_FAST = {"contract", "reassoc"}


def covers(covered: FloatArray, hurst: FloatArray, log_zeta_1: FloatArray) -> Any:
    """Which surfaces lie between the first and last H and ln zeta_1 in the first rows of `covered`."""
    inside = True
    for (low, high), x in zip(covered[:2], (hurst, log_zeta_1), strict=True):
        inside = inside & (x >= low) & (x <= high)
    return inside


@dataclasses.dataclass(frozen=True, eq=False)
class Table:
    """The shipped table in memory.

    Attributes
    ----------
    first, step : numpy.ndarray, shape (3,)
        Of the equally spaced nodes along `AXES`.
    covered : numpy.ndarray, shape (3, 2)
        First and last that are answered.
    coefficients : numpy.ndarray
        Quintic B-splines of ln F_G in single precision, the last axis with two zeros more.
    constants : Constants
        Of the law.
    error : float
        Largest relative error of force against the law's own quadrature, at held-out points.
    scatter : dict
        By theory: ln of root mean squares of ln(theory/simulation), shape (3, bins), rows `QUANTITIES`.
    log_area : numpy.ndarray, shape (bins,)
        ln of the contact fractions that they belong to.
    """

    first: FloatArray
    step: FloatArray
    covered: FloatArray
    coefficients: FloatArray
    constants: Constants
    error: float
    scatter: dict[str, FloatArray]
    log_area: FloatArray

    def covers(self, hurst: FloatArray, log_zeta_1: FloatArray) -> Any:
        """Which surfaces lie inside the table."""
        return covers(self.covered, hurst, log_zeta_1)

    def fill(self, surfaces: FloatArray, owner: NDArray[np.intp], u: FloatArray) -> FloatArray:
        """Force, area and -dF/du, shape (3, n), of separations u [h_rms] on the surfaces `owner`; see `fill`."""
        if u.size <= SMALL:
            return self._few(surfaces[owner], u)
        out = np.empty((3, u.size))
        fill(self.coefficients, self.numbers, surfaces, owner, u, out)
        return out

    def separations(self, surfaces: FloatArray, owner: NDArray[np.intp], force: FloatArray) -> FloatArray:
        """Mean separations [h_rms] at forces F/(A0 E* g) > 0; NaN where they lie beyond the table."""
        if force.size <= SMALL:
            if force.size <= ONE_BY_ONE:
                curves = {row: self._curve(surfaces[row]) for row in owner.tolist()}
                each = zip(owner.tolist(), force.tolist(), strict=True)
                return np.array([_separation(curves[row], math.log(surfaces[row, 3]), wanted) for row, wanted in each])
            return self._few_separations(surfaces[owner], force)
        out = np.empty(force.size)
        fill_separation(self.coefficients, self.numbers, surfaces, owner, force, out)
        return out

    def _line(self, surface: FloatArray) -> FloatArray:
        """Coefficients in ln u of one surface."""
        (hurst, log_zeta, *_), numbers, shape = surface.tolist(), self.numbers.tolist(), self.coefficients.shape
        i, x = _cell_of((hurst - numbers[0]) * numbers[3], shape[0] - 5)
        j, y = _cell_of((log_zeta - numbers[1]) * numbers[4], shape[1] - 5)
        patch = self.coefficients[i : i + 6, j : j + 6]
        line: FloatArray = np.einsum("abk,a,b->k", patch, quintic(x), quintic(y))
        return line

    def _curve(self, surface: FloatArray) -> Callable[[float], tuple[float, float]]:
        """ln F_G of one surface and its derivative as a function of ln u, one number: numpy takes longer."""
        line, numbers, last = self._line(surface).tolist(), self.numbers.tolist(), self.coefficients.shape[2] - 7

        def at(log_u: float) -> tuple[float, float]:
            k, z = _cell_of((log_u - numbers[2]) * numbers[5], last)
            value, rate = quintic_at(polynomial_of(line, k), z)
            return beyond_of(value, rate * numbers[5], log_u, numbers, last)

        return at

    def _log_gaussian(self, own: FloatArray) -> Callable[[FloatArray], Any]:
        """ln F_G and its derivative as a function of ln u in numpy."""
        if len(own) == 1:
            curve = self._curve(own[0])

            def one(log_u: FloatArray) -> FloatArray:
                return np.array(curve(float(log_u[0])))[:, None]

            return one
        if len(own) and (own[:, :2] == own[0, :2]).all():
            line = self._line(own[0])

            def six_at(k: NDArray[np.intp]) -> Any:
                return line[k + np.arange(6)[:, None]]
        else:
            sizes = np.array(self.coefficients.shape[:2]) - 5
            places = np.clip((own[:, :2] - self.first[:2]) / self.step[:2], 0.0, sizes)
            cells = np.minimum(places.astype(np.intp), sizes - 1)
            (i, j), (x, y) = cells.T, map(quintic, (places - cells).T)
            a, b, c = (n[..., None] for n in np.ogrid[:6, :6, :6])

            def six_at(k: NDArray[np.intp]) -> Any:
                return np.einsum("abcn,an,bn->cn", self.coefficients[i + a, j + b, k + c], x, y)

        last = self.coefficients.shape[2] - 7
        low, high = self.first[2], self.first[2] + last * self.step[2]

        def at(log_u: FloatArray) -> tuple[FloatArray, FloatArray]:
            place = np.clip((log_u - low) / self.step[2], 0.0, last)
            k = np.minimum(place.astype(np.intp), last - 1)
            value, rate = quintic_at(polynomial_of(six_at(k), 0), place - k)
            rate = rate / self.step[2]
            growth, below = np.expm1(np.maximum(log_u - high, 0.0)), np.minimum(log_u - low, 0.0)
            square = np.where(below < 0, 1.0 + 2.0 * rate * below, 1.0)
            return value + rate * growth + 0.5 * np.log(square), rate * (growth + 1.0) / square

        return at

    @np.errstate(under="ignore")
    def _few(self, own: FloatArray, u: FloatArray) -> FloatArray:
        """`fill` in numpy."""
        from scipy.special import erf

        light, h_max = own[:, 2], own[:, 3]
        held, log_gaussian = np.minimum(np.maximum(u, TINY), h_max), self._log_gaussian(own)
        value, rate = log_gaussian(np.log(held))
        endless, end = np.exp(value), log_gaussian(np.log(h_max))[0]
        force = -endless * np.expm1(end - value)
        t = force / self.constants.area_t0
        out = np.array([force, erf(force * np.sqrt(2 * (1 + t) / (light + t))), -rate * endless / held])
        out[:, u >= h_max] = 0.0
        out[:, u <= 0] = np.array([[np.inf], [1.0], [np.inf]])
        return out

    @np.errstate(under="ignore")
    def _few_separations(self, own: FloatArray, force: FloatArray) -> FloatArray:
        """`fill_separation` in numpy."""
        log_gaussian = self._log_gaussian(own)
        high, low = np.log(own[:, 3]), np.full(force.size, -MAX_LOG_SEPARATION)
        end = log_gaussian(high)[0]
        rise, x = np.logaddexp(0.0, np.log(force) - end), high - 0.5
        beyond = end + rise > log_gaussian(low)[0]
        done = beyond
        for _ in range(MAX_STEPS):
            value, rate = log_gaussian(x)
            miss = (value - end) - rise
            low, high = np.where(miss > 0, x, low), np.where(miss > 0, high, x)
            following = x - miss / rate
            near = np.abs(miss) <= CLOSE
            inside = (low < following) & (following < high)
            following = np.where(inside, following, np.where(near, np.clip(following, low, high), 0.5 * (low + high)))
            x, done = np.where(done, x, following), done | near | (high - low <= 2e-16)
            if done.all():
                break
        return np.where(beyond, np.nan, np.exp(x))

    @functools.cached_property
    def numbers(self) -> FloatArray:
        """What the compiled functions need: first and inverse step of each axis, and area_t0."""
        return np.array([*self.first, *(1 / self.step), self.constants.area_t0])

    def standard_deviation(self, theory: str, quantity: str, area: FloatArray) -> FloatArray:
        """Root mean square of ln(theory/simulation) at contact fractions; NaN where not known."""
        if theory not in self.scatter:
            return np.full(np.shape(area), np.nan)
        return np.asarray(np.exp(at_contact(self.log_area, self.scatter[theory][QUANTITIES.index(quantity)], area)))


def _cell_of(place: float, cells: int) -> tuple[int, float]:
    """Cell number and place in it, taken at the ends of the table beyond them."""
    held = min(max(place, 0.0), float(cells))
    first = min(int(held), cells - 1)
    return first, held - first


def _separation(curve: Callable[[float], tuple[float, float]], log_end: float, force: float) -> float:
    """`fill_separation` of one number."""
    x, low, high, end = log_end - 0.5, -MAX_LOG_SEPARATION, log_end, curve(log_end)[0]
    rise = rise_of(math.log(force) - end)
    if end + rise > curve(low)[0]:
        return math.nan
    for _ in range(MAX_STEPS):
        x, low, high, done = newton_step(x, low, high, *curve(x), end, rise)
        if done:
            break
    return math.exp(x)


def at_contact(log_area: FloatArray, row: FloatArray, area: FloatArray) -> FloatArray:
    """Numbers known at some contact fractions at others; NaN above the last one with a number."""
    known = np.isfinite(row)
    with np.errstate(divide="ignore"):
        return np.interp(np.log(area), log_area[known], row[known], right=None if known[-1] else np.nan)


def load(path: pathlib.Path) -> Table:
    """Read a table file.

    Raises
    ------
    TableFileError
        Where it is damaged or is another file.
    """
    import netCDF4

    body = read_sealed(path)
    with HDF5_LOCK, netCDF4.Dataset(path.name, memory=body) as data:
        if getattr(data, "mbma_kind", None) != "calibrated":
            raise TableFileError(f"{path}: is no table of the calibrated law")
        data.set_auto_mask(False)
        covered = np.array([data[name].getncattr("covered") for name in AXES])
        values = {name: np.array(variable[...]) for name, variable in data.variables.items()}
        constants = Constants(*(float(data.getncattr(f"law_{f.name}")) for f in dataclasses.fields(Constants)))
        names, error = data.getncattr("theories").split(), float(data.getncattr("largest_error_force"))
    axes = [values[name] for name in AXES]
    return Table(
        np.array([axis[0] for axis in axes]),
        np.array([(axis[-1] - axis[0]) / (axis.size - 1) for axis in axes]),
        covered,
        np.pad(values["spline"].astype(np.float32), ((0, 0), (0, 0), (0, 2))),
        constants,
        error,
        {name: np.log(values["stated_scatter"][k]) for k, name in enumerate(names)},
        np.log(values["contact"]),
    )


@functools.cache
def shipped() -> Table:
    """The shipped table, read once."""
    return load(shipped_file(NAME))


@functools.cache
def shipped_part(group: str) -> tuple[dict[str, FloatArray], dict[str, Any]]:
    """Variables and attributes of a group of the shipped file, read once."""
    import netCDF4

    path = shipped_file(NAME)
    body = read_sealed(path)
    with HDF5_LOCK, netCDF4.Dataset(path.name, memory=body) as data:
        data.set_auto_mask(False)
        if group not in data.groups:
            raise TableFileError(f"{path}: has no group {group!r}, only {sorted(data.groups)}")
        part = data[group]
        variables = {name: np.array(variable[...]) for name, variable in part.variables.items()}
        return variables, {name: part.getncattr(name) for name in part.ncattrs()}


@njit(cache=True, fastmath=_FAST, error_model="numpy")
def eight_of(c: FloatArray, numbers: FloatArray, hurst: float, log_zeta: float, k: int) -> Eight:
    """Coefficients k to k + 7 in ln u of one surface."""
    i, x = cell((hurst - numbers[0]) * numbers[3], c.shape[0] - 4)
    j, y = cell((log_zeta - numbers[1]) * numbers[4], c.shape[1] - 4)
    start = (i * c.shape[1] + j) * c.shape[2] + k
    eight: Eight = patch_lanes(c.reshape(-1), start, c.shape[1] * c.shape[2], c.shape[2], quintic(x), quintic(y))
    return eight


@jitable
def polynomial_of(c: Any, first: int) -> Six:
    """The quintic in z of a cell from its six coefficients of B-splines, which begin at `first`."""
    c0, c1, c2, c3, c4, c5 = c[first], c[first + 1], c[first + 2], c[first + 3], c[first + 4], c[first + 5]
    return (
        (c0 + 26.0 * c1 + 66.0 * c2 + 26.0 * c3 + c4) * PART,
        (-c0 - 10.0 * c1 + 10.0 * c3 + c4) * (5.0 * PART),
        (c0 + 2.0 * c1 - 6.0 * c2 + 2.0 * c3 + c4) * (10.0 * PART),
        (-c0 + 2.0 * c1 - 2.0 * c3 + c4) * (10.0 * PART),
        (c0 - 4.0 * c1 + 6.0 * c2 - 4.0 * c3 + c4) * (5.0 * PART),
        (-c0 + 5.0 * c1 - 10.0 * c2 + 10.0 * c3 - 5.0 * c4 + c5) * PART,
    )


@njit(cache=True, error_model="numpy")
def cells_of(c: FloatArray, numbers: FloatArray, surfaces: FloatArray) -> FloatArray:
    """Quintics in all cells of ln u, shape (surfaces, cells, 6): for many separations of few surfaces."""
    cells = np.empty((surfaces.shape[0], c.shape[2] - 7, 6))
    for row in range(cells.shape[0]):
        for k in range(cells.shape[1]):
            if k % 3 == 0:
                eight = eight_of(c, numbers, surfaces[row, 0], surfaces[row, 1], min(k, cells.shape[1] - 1))
            # three cells have eight coefficients between them
            own = polynomial_of(eight, k % 3)
            for n in range(6):
                cells[row, k, n] = own[n]
    return cells


@jitable
def quintic_at(p: Any, z: Any) -> tuple[Any, Any]:
    """A quintic and its derivative."""
    value = p[0] + z * (p[1] + z * (p[2] + z * (p[3] + z * (p[4] + z * p[5]))))
    return value, p[1] + z * (2.0 * p[2] + z * (3.0 * p[3] + z * (4.0 * p[4] + z * 5.0 * p[5])))


@jitable
def beyond_of(value: Any, rate: Any, log_u: Any, numbers: Any, last: Any) -> tuple[Any, Any]:
    """ln F_G and its derivative by ln u beyond an end of the table, from those at the end."""
    beyond, below = log_u - (numbers[2] + last / numbers[5]), log_u - numbers[2]
    if beyond > 0.0:
        growth = math.expm1(beyond)
        return value + rate * growth, rate * (growth + 1.0)
    if below < 0.0:
        square = 1.0 + 2.0 * rate * below
        return value + 0.5 * math.log(square), rate / square
    return value, rate


@njit(cache=True, fastmath=_FAST, error_model="numpy")
def _log_gaussian(
    c: FloatArray, numbers: FloatArray, surfaces: FloatArray, cells: FloatArray, row: int, log_u: float
) -> tuple[float, float]:
    """ln F_G and d ln F_G/d ln u; from `cells` where there are any."""
    last = c.shape[2] - 7.0
    k, z = cell(min(max((log_u - numbers[2]) * numbers[5], 0.0), last), c.shape[2] - 6)
    if cells.shape[0] > 0:
        value, rate = quintic_at(cells[row, k], z)
    else:
        value, rate = quintic_at(polynomial_of(eight_of(c, numbers, surfaces[row, 0], surfaces[row, 1], k), 0), z)
    return beyond_of(value, rate * numbers[5], log_u, numbers, last)


@njit(cache=True, fastmath=_FAST, error_model="numpy", forceinline=True)
def _log_gaussian_twice(
    c: FloatArray, numbers: FloatArray, hurst: float, log_zeta: float, log_u: float, log_end: float
) -> tuple[float, float, float]:
    """ln F_G, its derivative by ln u and ln F_G(h_max) of a surface that is asked once: its weights serve both."""
    last = c.shape[2] - 7.0
    k, z = cell(min(max((log_u - numbers[2]) * numbers[5], 0.0), last), c.shape[2] - 6)
    m, t = cell(min(max((log_end - numbers[2]) * numbers[5], 0.0), last), c.shape[2] - 6)
    i, x = cell((hurst - numbers[0]) * numbers[3], c.shape[0] - 4)
    j, y = cell((log_zeta - numbers[1]) * numbers[4], c.shape[1] - 4)
    wx, wy = quintic(x), quintic(y)
    flat, row, start = c.reshape(-1), c.shape[1] * c.shape[2], (i * c.shape[1] + j) * c.shape[2]
    near = patch_lanes(flat, start + k, row, c.shape[2], wx, wy)
    far = patch_lanes(flat, start + m, row, c.shape[2], wx, wy)
    value, rate = quintic_at(polynomial_of(near, 0), z)
    end, end_rate = quintic_at(polynomial_of(far, 0), t)
    value, rate = beyond_of(value, rate * numbers[5], log_u, numbers, last)
    return value, rate, beyond_of(end, end_rate * numbers[5], log_end, numbers, last)[0]


@njit(cache=True, error_model="numpy")
def _prepared(c: FloatArray, numbers: FloatArray, surfaces: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Cells, empty where there are too few separations for them, and ln F_G(h_max) of each surface."""
    few = count < MIN_SHARED * surfaces.shape[0]
    cells = cells_of(c, numbers, surfaces[:0] if few else surfaces)
    ends = np.empty(surfaces.shape[0])
    for row in range(ends.size):
        ends[row] = _log_gaussian(c, numbers, surfaces, cells, row, math.log(surfaces[row, 3]))[0]
    return cells, ends


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", forceinline=True)
def _answer(value: float, rate: float, end: float, u: float) -> tuple[float, float]:
    """Force and stiffness of ln F_G, its derivative, and ln F_G(h_max); without cancellation."""
    endless = exp(value)
    return -endless * expm1(end - value), -rate * endless / u


@njit(cache=True, fastmath=CONTRACT, error_model="numpy")
def _run(cells: FloatArray, numbers: FloatArray, end: float, h_max: float, u: FloatArray, out: FloatArray) -> None:
    """Force and stiffness of separations of one surface inside the table, in a loop that vectorises."""
    first, rate, last = numbers[2], numbers[5], cells.shape[0] - 1
    for n in range(u.size):
        held = min(max(u[n], TINY), h_max)
        place = (log(held) - first) * rate
        k = min(max(int(place), 0), last)
        z = place - k
        value, slope = quintic_at(cells[k], z)
        out[0, n], out[2, n] = _answer(value, slope * rate, end, held)


@njit(cache=True, nogil=True, error_model="numpy")
def fill(c: FloatArray, numbers: FloatArray, surfaces: FloatArray, owner: Any, u: FloatArray, out: FloatArray) -> None:
    """Force, area and -dF/du of mean separations u [h_rms] into the columns of `out`.

    `surfaces` has a row of Hurst exponent, ln zeta_1, s0 and h_max/h_rms for each surface, `owner` its number for
    each separation.
    """
    single = u.size < MIN_SHARED * surfaces.shape[0]
    cells, ends = _prepared(c, numbers, surfaces[:0] if single else surfaces, u.size)
    low, high = math.exp(numbers[2]), math.exp(numbers[2] + (c.shape[2] - 7.0) / numbers[5])
    begin = 0
    while begin < u.size and not single:
        row, stop = owner[begin], begin + 1
        while stop < u.size and owner[stop] == row:
            stop += 1
        _run(cells[row], numbers, ends[row], surfaces[row, 3], u[begin:stop], out[:, begin:stop])
        begin = stop
    for n in range(u.size):
        row = owner[n]
        light, h_max = surfaces[row, 2], surfaces[row, 3]
        if u[n] >= h_max:
            out[0, n] = out[1, n] = out[2, n] = 0.0
            continue
        if u[n] <= 0.0:
            out[0, n], out[1, n], out[2, n] = np.inf, 1.0, np.inf
            continue
        if single:
            log_u, log_end = math.log(u[n]), math.log(h_max)
            value, slope, end = _log_gaussian_twice(c, numbers, surfaces[row, 0], surfaces[row, 1], log_u, log_end)
            out[0, n], out[2, n] = _answer(value, slope, end, u[n])
        elif not low < u[n] < high:
            value, slope = _log_gaussian(c, numbers, surfaces, cells, row, math.log(u[n]))
            out[0, n], out[2, n] = _answer(value, slope, ends[row], u[n])
        t = out[0, n] / numbers[6]
        out[1, n] = math.erf(out[0, n] * math.sqrt(2.0 * (1.0 + t) / (light + t)))


@jitable
def rise_of(log_ratio: Any) -> Any:
    """ln(1 + F/F_G(h_max)) by the logarithm of that ratio, which itself may be out of range."""
    return max(log_ratio, 0.0) + math.log1p(math.exp(-abs(log_ratio)))


@jitable
def newton_step(x: Any, low: Any, high: Any, value: Any, rate: Any, end: Any, rise: Any) -> tuple[Any, Any, Any, Any]:
    """The next ln u, its bracket, and whether it is the last, from ln F_G and its derivative at x."""
    # in ln(F + F_G(h_max)), which is smooth to the end
    miss = (value - end) - rise
    if miss > 0.0:
        low = x
    else:
        high = x
    following = x - miss / rate
    near = abs(miss) <= CLOSE
    if not low < following < high:
        following = min(max(following, low), high) if near else 0.5 * (low + high)
    return following, low, high, near or high - low <= 2e-16


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def fill_separation(
    c: FloatArray, numbers: FloatArray, surfaces: FloatArray, owner: Any, force: FloatArray, out: FloatArray
) -> None:
    """Mean separations [h_rms] at forces F/(A0 E* g) > 0: Newton's method in ln u, in a bracket; NaN if beyond it."""
    cells, ends = _prepared(c, numbers, surfaces, force.size)
    for n in range(force.size):
        row = owner[n]
        end, high, low = ends[row], math.log(surfaces[row, 3]), -MAX_LOG_SEPARATION
        rise = rise_of(math.log(force[n]) - end)
        if not end + rise <= _log_gaussian(c, numbers, surfaces, cells, row, low)[0]:
            out[n] = np.nan
            continue
        x = high - 0.5
        for _ in range(MAX_STEPS):
            value, rate = _log_gaussian(c, numbers, surfaces, cells, row, x)
            x, low, high, done = newton_step(x, low, high, value, rate, end, rise)
            if done:
                break
        out[n] = math.exp(x)
