"""Constants of the scatter of answers on maps, fitted to the campaign, and how many errors they cover when left out.

Each form states a standard deviation with a few constants, the same for all maps::

    simulated, corrected   one for each contact area of the truth
    calibrated             root of s^2 + c^2, s that of Gaussian maps, one c for maps that are valid and one for others

They cover 70% of errors once and 94.5% twice. `left_out` states for each family what the others give.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from generate.machined.errors import errors, seen
from generate.machined.makers import FAMILIES
from mbma_tables.common.arguments import FloatArray
from mbma_tables.theories.calibrated import MAP_SCATTER

ONCE, TWICE = 0.70, 0.945


def reached(ratio: FloatArray) -> float:
    """Factor of stated standard deviations after which they cover as many errors as they should."""
    return float(max(np.quantile(ratio, ONCE), np.quantile(ratio, TWICE) / 2))


def valid_errors(data: xr.Dataset, form: str, quantity: str) -> tuple[FloatArray, Any]:
    """Errors, and which of them count where valid, (surfaces, loads, axes)."""
    own = data[f"{form}_{'flow_' if quantity == 'flow' else ''}valid"].values > 0.5
    kept: Any = seen(data, form, quantity)
    return errors(data, form, quantity), kept & own[..., None]


def by_area(data: xr.Dataset, form: str, quantity: str, rows: Any) -> FloatArray:
    """One constant for each load of the truth: as many errors of surfaces of these numbers are covered."""
    error, kept = valid_errors(data, form, quantity)
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
    return np.broadcast_to(by_area(data, form, quantity, np.flatnonzero(rows)), data.area.shape)


def left_out(data: xr.Dataset, form: str, quantity: str) -> dict[str, FloatArray]:
    """Errors of each family, where valid, over the standard deviations that the other families give."""
    error, kept = valid_errors(data, form, quantity)
    found = {}
    for family in FAMILIES:
        others = data.family.values != family
        ratio = np.abs(error) / scatter(data, form, quantity, others)[..., None]
        own = kept & ~others[:, None, None] & np.isfinite(ratio)
        found[family] = ratio[own]
    return found
