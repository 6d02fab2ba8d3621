"""Constants of the scatter of answers on maps, fitted to the campaign, and how many errors they cover when left out.

Each form states a standard deviation with a few constants, the same for all maps::

    simulated, corrected   one for each contact area of the truth, times a power of the map's sensitivity
    calibrated             root of s^2 + c^2, s that of Gaussian maps, one c for maps that are valid and one for others

They cover 70% of errors once and 97.5% twice. `left_out` states for each family what the others give.
"""

from typing import Any

import numpy as np
import xarray as xr

from generate.machined.errors import errors, seen
from generate.machined.makers import FAMILIES
from mbma_tables.common.arguments import FloatArray
from mbma_tables.theories.calibrated import MAP_SCATTER
from mbma_tables.theories.simulated import POWER, TYPICAL

ONCE, TWICE = 0.70, 0.975


def reached(ratio: FloatArray) -> float:
    """Factor of stated standard deviations after which they cover as many errors as they should."""
    return float(max(np.quantile(ratio, ONCE), np.quantile(ratio, TWICE) / 2))


def valid_errors(data: xr.Dataset, form: str, quantity: str) -> tuple[FloatArray, Any]:
    """Errors, and which of them count where valid, (surfaces, loads, axes)."""
    own = data[f"{form}_{'flow_' if quantity == 'flow' else ''}valid"].values > 0.5
    kept: Any = seen(data, form, quantity)
    return errors(data, form, quantity), kept & own[..., None]


def of_sensitivity(data: xr.Dataset, form: str) -> FloatArray:
    """The factor by which the scatter of each surface differs from that of a typical one."""
    return np.asarray((data[f"{form}_sensitivity"].max("load").values / TYPICAL) ** POWER)


def by_area(data: xr.Dataset, form: str, quantity: str, rows: Any) -> FloatArray:
    """One constant for each load of the truth: as many errors of surfaces of these numbers are covered."""
    error, kept = valid_errors(data, form, quantity)
    error = error / of_sensitivity(data, form)[:, None, None]
    found = [np.abs(error[rows, k][kept[rows, k]]) for k in range(error.shape[1])]
    return np.array([reached(own) if own.size else np.nan for own in found])


def calibrated(data: xr.Dataset, quantity: str, rows: Any) -> FloatArray:
    """Constants of maps that are valid, and of others."""
    error = np.abs(errors(data, "calibrated", quantity))[..., 0]
    kept, stated = seen(data, "calibrated", quantity)[..., 0], of_gaussian(data, quantity)
    valid = data.calibrated_valid.values > 0.5
    found = []
    for one in (valid, ~valid):
        own = rows[:, None] & kept & one & np.isfinite(stated)
        trials = np.geomspace(1e-3, 1.0, 400)
        factors = [reached(error[own] / np.hypot(stated[own], trial)) for trial in trials]
        found.append(trials[np.argmax(np.array(factors) <= 1)])
    return np.array(found)


def of_gaussian(data: xr.Dataset, quantity: str) -> FloatArray:
    """The part of the calibrated law's scatter that is not fitted here."""
    valid = data.calibrated_valid.values > 0.5
    added = np.where(valid, *MAP_SCATTER[quantity])
    stated = data[f"calibrated_{quantity}_scatter"].values
    return np.asarray(np.sqrt(np.maximum(stated**2 - added**2, 0.0)))


def scatter(data: xr.Dataset, form: str, quantity: str, rows: Any) -> FloatArray:
    """Standard deviations of all surfaces, (surfaces, loads), by constants fitted to those of a mask."""
    if form == "calibrated" and quantity != "flow":
        valid, other = calibrated(data, quantity, rows)
        added = np.where(data.calibrated_valid.values > 0.5, valid, other)
        return np.asarray(np.hypot(of_gaussian(data, quantity), added))
    return by_area(data, form, quantity, np.flatnonzero(rows)) * of_sensitivity(data, form)[:, None]


def left_out(data: xr.Dataset, form: str, quantity: str) -> dict[str, FloatArray]:
    """Errors of each family, where valid, over the standard deviations that the other families give.

    Of the calibrated law over those that other maps give, since one family alone is valid.
    """
    error, kept = valid_errors(data, form, quantity)
    families = data.family.values
    parts = data.surface.values if form == "calibrated" else families
    found: dict[str, list[FloatArray]] = {family: [] for family in FAMILIES}
    for part in np.unique(parts):
        own = kept & (parts == part)[:, None, None]
        if own.any():
            ratio = np.abs(error) / scatter(data, form, quantity, parts != part)[..., None]
            found[families[parts == part][0]].append(ratio[own & np.isfinite(ratio)])
    return {family: np.concatenate([np.empty(0), *each]) for family, each in found.items()}
