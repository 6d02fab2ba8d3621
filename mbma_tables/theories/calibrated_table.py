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
from typing import Any

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.calibrated import Constants
from mbma_tables.compiled import njit
from mbma_tables.errors import TableFileError
from mbma_tables.files import shipped_file
from mbma_tables.tablefiles.interpolate import ZERO, Eight, add_lanes, cell, load_lanes, quintic, quintic_slope
from mbma_tables.tablefiles.netcdf import HDF5_LOCK, read_sealed

NAME = "calibrated.nc"
AXES = ("hurst", "log_zeta_1", "log_separation")
QUANTITIES = ("area", "force", "stiffness")
MAX_STEPS = 100
MIN_SHARED = 32  # separations a surface from which its coefficients in ln u are worth summing
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
        Quintic B-splines of ln F_G, the last axis with two zeros more.
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

    @functools.cached_property
    def numbers(self) -> FloatArray:
        """What the compiled functions need: first and inverse step of each axis, and area_t0."""
        return np.array([*self.first, *(1 / self.step), self.constants.area_t0])

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
        np.pad(values["spline"], ((0, 0), (0, 0), (0, 2))),
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
    wx, wy = quintic(x), quintic(y)
    flat = c.reshape(-1)
    total = ZERO
    for a in range(6):
        start = ((i + a) * c.shape[1] + j) * c.shape[2] + k
        for b in range(6):
            total = add_lanes(total, wx[a] * wy[b], load_lanes(flat, start + b * c.shape[2]))
    return total


@njit(cache=True, error_model="numpy")
def lines_of(c: FloatArray, numbers: FloatArray, surfaces: FloatArray) -> FloatArray:
    """All coefficients in ln u of each surface, with zeros behind: for many separations of few surfaces."""
    lines = np.zeros((surfaces.shape[0], c.shape[2] + 8))
    for row in range(surfaces.shape[0]):
        for k in range(0, c.shape[2] - 7, 2):
            eight = eight_of(c, numbers, surfaces[row, 0], surfaces[row, 1], k)
            for n in range(8):
                lines[row, k + n] = eight[n]
    return lines


@njit(cache=True, fastmath=_FAST, error_model="numpy", inline="always")
def _log_gaussian(
    c: FloatArray, numbers: FloatArray, surfaces: FloatArray, lines: FloatArray, row: int, log_u: float
) -> tuple[float, float]:
    """ln F_G and -d ln F_G/d ln u; from `lines` where there are any."""
    nodes = c.shape[2] - 6
    place = min(max((log_u - numbers[2]) * numbers[5], 0.0), nodes - 1.0)
    k, z = cell(place, nodes)
    if lines.shape[0] > 0:
        line = lines[row]
        c0, c1, c2, c3, c4, c5 = line[k], line[k + 1], line[k + 2], line[k + 3], line[k + 4], line[k + 5]
    else:
        c0, c1, c2, c3, c4, c5, _, _ = eight_of(c, numbers, surfaces[row, 0], surfaces[row, 1], k)
    w0, w1, w2, w3, w4, w5 = quintic(z)
    value = w0 * c0 + w1 * c1 + w2 * c2 + w3 * c3 + w4 * c4 + w5 * c5
    w0, w1, w2, w3, w4, w5 = quintic_slope(z)
    rate = w0 * c0 + w1 * c1 + w2 * c2 + w3 * c3 + w4 * c4 + w5 * c5
    rate *= numbers[5]
    beyond = log_u - (numbers[2] + (nodes - 1) / numbers[5])
    below = log_u - numbers[2]
    if beyond > 0.0:
        growth = math.expm1(beyond)
        value, rate = value + rate * growth, rate * (growth + 1.0)
    elif below < 0.0:
        square = 1.0 + 2.0 * rate * below
        value, rate = value + 0.5 * math.log(square), rate / square
    return value, -rate


@njit(cache=True, error_model="numpy")
def _prepared(c: FloatArray, numbers: FloatArray, surfaces: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Lines, empty where there are too few separations for them, and ln F_G(h_max) of each surface."""
    few = count < MIN_SHARED * surfaces.shape[0]
    lines = lines_of(c, numbers, surfaces[:0] if few else surfaces)
    ends = np.empty(surfaces.shape[0])
    for row in range(ends.size):
        h_max = surfaces[row, 3]
        ends[row] = _log_gaussian(c, numbers, surfaces, lines, row, math.log(h_max))[0]
    return lines, ends


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def fill(c: FloatArray, numbers: FloatArray, surfaces: FloatArray, owner: Any, u: FloatArray, out: FloatArray) -> None:
    """Force, area and -dF/du of mean separations u [h_rms] into the columns of `out`.

    `surfaces` has a row of Hurst exponent, ln zeta_1, s0 and h_max/h_rms for each surface, `owner` its number for
    each separation.
    """
    lines, ends = _prepared(c, numbers, surfaces, u.size)
    t0, floors = numbers[6], np.exp(ends)
    for n in range(u.size):
        row = owner[n]
        light, h_max, end = surfaces[row, 2], surfaces[row, 3], ends[row]
        if u[n] >= h_max:
            out[0, n] = out[1, n] = out[2, n] = 0.0
        elif u[n] <= 0.0:
            out[0, n], out[1, n], out[2, n] = np.inf, 1.0, np.inf
        else:
            value, rate = _log_gaussian(c, numbers, surfaces, lines, row, math.log(u[n]))
            endless = math.exp(value)
            excess = value - end
            # where both are close their difference loses digits
            force = endless - floors[row] if excess > 0.01 else -endless * math.expm1(-excess)
            t = force / t0
            out[0, n] = force
            out[1, n] = math.erf(force * math.sqrt(2.0 * (1.0 + t) / (light + t)))
            out[2, n] = rate * endless / u[n]


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def fill_separation(
    c: FloatArray, numbers: FloatArray, surfaces: FloatArray, owner: Any, force: FloatArray, out: FloatArray
) -> None:
    """Mean separations [h_rms] at forces F/(A0 E* g) > 0: Newton's method in ln u, in a bracket; NaN if beyond it."""
    lines, ends = _prepared(c, numbers, surfaces, force.size)
    for n in range(force.size):
        row = owner[n]
        end, high, low = ends[row], math.log(surfaces[row, 3]), -MAX_LOG_SEPARATION
        wanted = force[n] * math.exp(-end)
        if not end + math.log1p(wanted) <= _log_gaussian(c, numbers, surfaces, lines, row, low)[0]:
            out[n] = np.nan
            continue
        x = high - 0.5
        for _ in range(MAX_STEPS):
            value, rate = _log_gaussian(c, numbers, surfaces, lines, row, x)
            # in ln(F + F_G(h_max)), which is smooth to the end
            miss = math.log1p((math.expm1(value - end) - wanted) / (1.0 + wanted))
            if miss > 0.0:
                low = x
            else:
                high = x
            following = x + miss / rate
            if not low < following < high:
                following = 0.5 * (low + high)
            done = abs(following - x) <= 4e-16 * max(1.0, abs(x))
            x = following
            if done or high - low <= 2e-16:
                break
        out[n] = math.exp(x)
