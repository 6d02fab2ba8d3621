"""Flow coefficient of contacts: the contact factor R of self-affine surfaces from a table, and its scatter.

The table holds ln R of `laws.effective_medium` over Hurst exponent, ln zeta_1 and ln A/(Ac - A). Below the smallest
tabulated contact ln R is proportional to A^m, as the obstruction is; above the largest R is a power of Ac - A.
"""

import dataclasses
import functools
import math
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.core import core, in_blocks
from mbma_tables.laws.calibrated import Spectrum
from mbma_tables.laws.effective_medium import FlowConstants, contact_factor, wide_gap
from mbma_tables.theories.calibrated_table import Owners, SurfaceSpline, known_at, nodes_of, shipped_part

GROUP = "leakage"
AXES = ("hurst", "log_zeta_1", "log_odds")
COVERED = np.array([[0.1, 1.0], [math.log(3.0), math.log(1e5)]])  # H and ln zeta_1, where the error was measured
FEW = 8192  # entries per block, so that a block fits into the processor's cache
LEAST = 1e-300  # smaller contact fractions count as zero
OWN_NODES = 64  # contact fractions at which a spectrum's own factor is found
KEPT = 64  # spectra whose factors are kept


@dataclasses.dataclass(frozen=True, eq=False)
class FlowTable(SurfaceSpline):
    """The group `leakage` of the shipped file: ln R."""

    constants: FlowConstants
    error: float  # largest error of ln R against the medium itself, at held-out surfaces
    scatter: dict[str, FloatArray]  # by theory: root mean squares of ln(k/simulation)
    contact: FloatArray  # at these contact fractions

    def flow(self, surfaces: FloatArray, owner: Owners, u: FloatArray, area: FloatArray) -> FloatArray:
        """k of mean gaps [h_rms] and contact fractions; 0 where blocked. Columns of `surfaces`: H, ln zeta_1."""
        given = *self.core_table, *surfaces, None, None, self.shared(surfaces, u.size)
        return _flow(given, owner, u, area)

    def standard_deviation(self, theory: str, area: FloatArray) -> FloatArray:
        """Root mean square of ln(k/simulation) at contact fractions; NaN where not known or blocked."""
        row = self.scatter.get(theory)
        if row is None or not np.isfinite(row).any():
            return np.full(np.shape(area), np.nan)
        return np.where(np.asarray(area) < self.constants.threshold, known_at(self.contact, row, area), np.nan)


@functools.cache
def shipped_flow() -> FlowTable:
    """The shipped table, read once."""
    values, facts = shipped_part(GROUP)
    constants = FlowConstants(*(float(facts[f"flow_{f.name}"]) for f in dataclasses.fields(FlowConstants)))
    return FlowTable(
        *nodes_of([values[name] for name in AXES]),
        COVERED,
        values["spline"],
        (constants.threshold, constants.obstruction, 0.0),
        constants,
        float(facts["largest_error_log_factor"]),
        dict(zip(facts["theories"].split(), values["stated_scatter"], strict=True)),
        values["contact"],
    )


@np.errstate(all="ignore")
def _flow(given: tuple[Any, ...], owner: Owners, u: FloatArray, area: FloatArray) -> FloatArray:
    """u^3 (1 - 1.5/(u^2 + 4)) R, and 0 from A/A0 = threshold on; ln R over ln A/(threshold A0 - A)."""
    numbers, found = given[1], np.empty(u.shape)
    threshold, obstruction, first = numbers[10], numbers[11], numbers[2]
    last = first + given[2][2] / numbers[5]

    def fill(k: slice) -> None:
        # contact fractions of Greenwood and Williamson exceed 1
        a = area[k]
        odds = np.log(np.maximum(a, LEAST) / np.maximum(threshold - a, LEAST))
        value, slope = np.empty((2, odds.size))
        core.spline_values(*given, owner[k], odds, value, slope)
        unknown = np.isnan(u[k]) | np.isnan(value)
        value += slope * np.maximum(odds - last, 0.0)
        log_factor = np.minimum(value * np.exp(obstruction * np.minimum(odds - first, 0.0)), 0.0)
        wide = u[k] * u[k] * u[k] * wide_gap(u[k]) * np.exp(log_factor)
        found[k] = np.where(unknown, np.nan, np.where(a < threshold, wide, 0.0))

    in_blocks(fill, u.size, FEW)
    return found


@functools.lru_cache(KEPT)
def own_factor(spectrum: Spectrum) -> tuple[Any, ...]:
    """ln R over the table's odds of one spectrum, as `core.flow` takes it."""
    from scipy.interpolate import PchipInterpolator

    table = shipped_flow()
    odds, step = np.linspace(table.first[2], table.last, OWN_NODES, retstep=True)
    log_factor = contact_factor(spectrum, table.constants.threshold / (1 + np.exp(-odds)), table.constants)
    cubics = PchipInterpolator(odds, np.minimum.accumulate(np.minimum(log_factor, 0.0))).c[::-1]
    pieces = np.zeros((OWN_NODES - 1, 6))
    pieces[:, :4] = (cubics * step ** np.arange(4)[:, None]).T
    numbers = table.core_table[1].copy()
    numbers[5] = 1 / step
    anything = np.zeros(1)
    return None, numbers, np.array([1, 1, OWN_NODES - 1]), anything, anything, None, None, pieces


def flow_of_spectrum(spectrum: Spectrum, u: FloatArray, area: FloatArray) -> FloatArray:
    """k of mean gaps [h_rms] and contact fractions of one spectrum; 0 where blocked."""
    return _flow(own_factor(spectrum), np.zeros(u.size, np.int64), u, area)
