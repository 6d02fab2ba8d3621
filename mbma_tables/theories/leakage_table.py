"""Flow conductance of contacts: the contact factor's table of self-affine surfaces, and its scatter.

The table holds ln R of `mbma_tables.leakage` over Hurst exponent, ln zeta_1 and ln A/(Ac - A). Below its least contact
ln R goes as A^m, as what obstructs; above its largest it is linear in the odds: R is a power of Ac - A.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable

import numpy as np
from scipy.interpolate import PchipInterpolator

from mbma_tables.arguments import FloatArray
from mbma_tables.calibrated import Spectrum
from mbma_tables.compiled import in_blocks
from mbma_tables.leakage import FlowConstants, contact_factor, wide_gap
from mbma_tables.theories.calibrated_table import BLOCK, Owners, SurfaceSpline, nodes_of, shipped_part

GROUP = "leakage"
AXES = ("hurst", "log_zeta_1", "log_odds")
COVERED = np.array([[0.1, 1.0], [math.log(3.0), math.log(1e5)]])  # H and ln zeta_1, where the error was measured
OWN_NODES = 64  # contact fractions at which a spectrum's own factor is found
KEPT = 64  # spectra whose factors are kept


@dataclasses.dataclass(frozen=True, eq=False)
class FlowTable(SurfaceSpline):
    """The group `leakage` of the shipped file: ln R.

    Attributes
    ----------
    constants : FlowConstants
    error : float
        Largest error of ln R against the medium itself, at held-out surfaces.
    scatter : dict
        By theory: root mean squares of ln(k/simulation).
    contact : numpy.ndarray
        Contact fractions that they belong to.
    """

    constants: FlowConstants
    error: float
    scatter: dict[str, FloatArray]
    contact: FloatArray

    def flow(self, surfaces: FloatArray, owner: Owners, u: FloatArray, area: FloatArray) -> FloatArray:
        """k of mean gaps [h_rms] and contact fractions; 0 where blocked. Columns of `surfaces`: H, ln zeta_1."""
        log_factor, out = self.along(surfaces, u.size), np.empty(u.size)

        def fill(block: slice) -> None:
            own = functools.partial(log_factor, owner[block])
            out[block] = conductance(own, self.first[2], self.last, u[block], area[block])

        in_blocks(fill, u.size, BLOCK)
        return out

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
    return FlowTable(
        *nodes_of([values[name] for name in AXES]),
        COVERED,
        values["spline"],
        FlowConstants(*(float(facts[f"flow_{f.name}"]) for f in dataclasses.fields(FlowConstants))),
        float(facts["largest_error_log_factor"]),
        dict(zip(facts["theories"].split(), values["stated_scatter"], strict=True)),
        values["contact"],
    )


def conductance(
    log_factor: Callable[[FloatArray], tuple[FloatArray, FloatArray]],
    first: float,
    last: float,
    u: FloatArray,
    area: FloatArray,
) -> FloatArray:
    """k of mean gaps [h_rms] and contact fractions from ln R and its slope by odds, held beyond `first` and `last`."""
    constants = shipped_flow().constants
    left = np.maximum(constants.threshold - area, 1e-300)  # areas of Greenwood and Williamson exceed 1
    with np.errstate(divide="ignore"):
        odds = np.log(area / left)
    value, slope = log_factor(odds)
    value += slope * np.maximum(odds - last, 0.0)
    value *= np.exp(constants.obstruction * np.minimum(odds - first, 0.0))
    return np.where(area < constants.threshold, u * u * u * wide_gap(u) * np.exp(np.minimum(value, 0.0)), 0.0)


@functools.lru_cache(KEPT)
def own_factor(spectrum: Spectrum) -> tuple[PchipInterpolator, FloatArray]:
    """ln R over the table's odds of one spectrum, and its slope beyond."""
    table = shipped_flow()
    low, high = table.first[2], table.last
    odds = np.linspace(low, high, OWN_NODES)
    log_factor = contact_factor(spectrum, table.constants.threshold / (1 + np.exp(-odds)), table.constants)
    found = PchipInterpolator(odds, np.minimum.accumulate(np.minimum(log_factor, 0.0)))
    return found, found(high, 1)


@functools.lru_cache(KEPT)
def self_affine(hurst: float, log_zeta_1: float) -> Spectrum:
    """The spectrum of a self-affine surface outside the table."""
    return Spectrum.self_affine(hurst, math.exp(log_zeta_1))


def flow_of_spectrum(spectrum: Spectrum, u: FloatArray, area: FloatArray) -> FloatArray:
    """k of mean gaps [h_rms] and contact fractions of one spectrum; 0 where blocked."""
    log_factor, slope = own_factor(spectrum)
    first, last = log_factor.x[[0, -1]]
    return conductance(lambda odds: (log_factor(np.clip(odds, first, last)), slope), first, last, u, area)
