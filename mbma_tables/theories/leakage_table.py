"""Flow conductance of contacts: the contact factor's table of self-affine surfaces, and its scatter.

The table holds ln R of `mbma_tables.leakage` over Hurst exponent, ln zeta_1 and ln A/(Ac - A). Below its least contact
ln R goes as A^m, as what obstructs; above its largest it is linear in the odds: R is a power of Ac - A.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from mbma_tables.arguments import FloatArray
from mbma_tables.calibrated import Spectrum
from mbma_tables.compiled import njit
from mbma_tables.leakage import FlowConstants, contact_factor
from mbma_tables.tablefiles.interpolate import cell
from mbma_tables.theories.calibrated_table import (
    MIN_SHARED,
    cells_of,
    covers,
    eight_of,
    polynomial_of,
    quintic_at,
    shipped_part,
)

GROUP = "leakage"
AXES = ("hurst", "log_zeta_1", "log_odds")
COVERED = np.array([[0.1, 1.0], [math.log(3.0), math.log(1e5)]])  # H and ln zeta_1, where the error was measured
OWN_NODES = 64  # contact fractions at which a spectrum's own factor is found
KEPT = 64  # spectra whose factors are kept

_FAST = {"contract", "reassoc"}


@dataclasses.dataclass(frozen=True, eq=False)
class FlowTable:
    """The group `leakage` of the shipped file.

    Attributes
    ----------
    coefficients : numpy.ndarray
        Quintic B-splines of ln R, the last axis with two zeros more.
    numbers : numpy.ndarray
        First node and inverse step of each axis, threshold and m.
    covered : numpy.ndarray, shape (2, 2)
        First and last H and ln zeta_1 that are answered from the table.
    constants : FlowConstants
    error : float
        Largest error of ln R against the medium itself, at held-out surfaces.
    scatter : dict
        By theory: root mean squares of ln(k/simulation).
    contact : numpy.ndarray
        Contact fractions that they belong to.
    """

    coefficients: FloatArray
    numbers: FloatArray
    covered: FloatArray
    constants: FlowConstants
    error: float
    scatter: dict[str, FloatArray]
    contact: FloatArray

    def covers(self, hurst: FloatArray, log_zeta_1: FloatArray) -> Any:
        """Which surfaces lie inside the table."""
        return covers(self.covered, hurst, log_zeta_1)

    def standard_deviation(self, theory: str, area: FloatArray) -> FloatArray:
        """Root mean square of ln(k/simulation) at contact fractions; NaN where not known or blocked."""
        row = self.scatter.get(theory)
        if row is None or not np.isfinite(row).any():
            return np.full(np.shape(area), np.nan)
        known = np.isfinite(row)
        beyond = None if known[-1] else np.nan
        found = np.interp(area, self.contact[known], row[known], right=beyond)
        return np.where(np.asarray(area) < self.constants.threshold, found, np.nan)


@functools.cache
def shipped_flow() -> FlowTable:
    """The shipped table, read once."""
    values, facts = shipped_part(GROUP)
    axes = [values[name] for name in AXES]
    numbers = [*(axis[0] for axis in axes), *((axis.size - 1) / (axis[-1] - axis[0]) for axis in axes)]
    constants = FlowConstants(*(float(facts[f"flow_{f.name}"]) for f in dataclasses.fields(FlowConstants)))
    return FlowTable(
        np.pad(values["spline"], ((0, 0), (0, 0), (0, 2))),
        np.array([*numbers, constants.threshold, constants.obstruction]),
        COVERED,
        constants,
        float(facts["largest_error_log_factor"]),
        dict(zip(facts["theories"].split(), values["stated_scatter"], strict=True)),
        values["contact"],
    )


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def fill_flow(
    c: FloatArray,
    numbers: FloatArray,
    surfaces: FloatArray,
    owner: Any,
    u: FloatArray,
    area: FloatArray,
    out: FloatArray,
) -> None:
    """k of mean gaps [h_rms] and contact fractions; 0 where blocked. Rows of `surfaces` begin with H and ln zeta_1."""
    shared = u.size >= MIN_SHARED * surfaces.shape[0]
    cells = cells_of(c, numbers, surfaces if shared else surfaces[:0])
    nodes, threshold = c.shape[2] - 6, numbers[6]
    last = nodes - 1.0
    for n in range(u.size):
        if area[n] >= threshold:
            out[n] = 0.0
            continue
        cube = u[n] ** 3 * (1.0 - 1.5 / (u[n] * u[n] + 4.0))
        odds = area[n] / (threshold - area[n])
        if odds == 0.0:
            out[n] = cube
            continue
        place = (math.log(odds) - numbers[2]) * numbers[5]
        inside = min(max(place, 0.0), last)
        k, z = cell(inside, nodes)
        row = owner[n]
        if shared:
            value, slope = quintic_at(cells[row, k], z)
        else:
            value, slope = quintic_at(polynomial_of(eight_of(c, numbers, surfaces[row, 0], surfaces[row, 1], k), 0), z)
        if place > last:
            value += (place - last) * slope
        elif place < 0.0:
            value *= math.exp(numbers[7] * place / numbers[5])
        out[n] = cube * math.exp(min(value, 0.0))


@functools.lru_cache(KEPT)
def own_factor(spectrum: Spectrum) -> tuple[PchipInterpolator, float]:
    """ln R over the table's odds of one spectrum, and its slope beyond."""
    table = shipped_flow()
    low = table.numbers[2]
    high = low + (table.coefficients.shape[2] - 7) / table.numbers[5]
    odds = np.linspace(low, high, OWN_NODES)
    log_factor = contact_factor(spectrum, table.constants.threshold / (1 + np.exp(-odds)), table.constants)
    found = PchipInterpolator(odds, np.minimum.accumulate(np.minimum(log_factor, 0.0)))
    return found, float(found(high, 1))


@functools.lru_cache(KEPT)
def self_affine(hurst: float, log_zeta_1: float) -> Spectrum:
    """The spectrum of a self-affine surface outside the table."""
    return Spectrum.self_affine(hurst, math.exp(log_zeta_1))


def flow_of_spectrum(spectrum: Spectrum, u: FloatArray, area: FloatArray) -> FloatArray:
    """k of mean gaps [h_rms] and contact fractions of one spectrum; 0 where blocked."""
    constants = shipped_flow().constants
    threshold = constants.threshold
    log_factor, slope = own_factor(spectrum)
    first, last = log_factor.x[[0, -1]]
    left = np.maximum(threshold - area, np.finfo(float).tiny)
    with np.errstate(divide="ignore"):
        odds = np.log(area / left)
    found = log_factor(np.clip(odds, first, last)) + slope * np.maximum(odds - last, 0)
    found *= np.exp(constants.obstruction * np.minimum(odds - first, 0.0))
    return np.where(area < threshold, u**3 * (1 - 1.5 / (u**2 + 4)) * np.exp(found), 0.0)
