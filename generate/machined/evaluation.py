"""Errors of answers on maps of machined surfaces, constants of their scatter, and how many errors these cover.

Each form states a standard deviation with a few constants, the same for all maps::

    simulated, corrected   one for each contact area of the truth, times a power of the map's sensitivity
    calibrated             root of s^2 + c^2, s that of Gaussian maps, one c for maps that are valid and one for others

They cover 70% of errors once and 97.5% twice. `left_out` states for each family what the others give.
"""

import itertools
from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from generate.machined.makers import FAMILIES
from generate.page import table
from mbma_tables.common.arguments import FloatArray
from mbma_tables.theories.calibrated import MAP_SCATTER
from mbma_tables.theories.simulated import POWER, TYPICAL

QUANTITIES = ("area", "pressure", "stiffness", "flow")
RANGES = {"calibrated": (0.01, 0.6), "corrected": (0.01, 0.6), "simulated": (0.01, 0.9)}  # A/A0 whose errors are told
FLOW_AREA = 0.2
ONCE, TWICE = 0.70, 0.975


def errors(data: xr.Dataset, form: str, quantity: str) -> FloatArray:
    """Of ln A and ln stiffness at equal F, of ln F at equal u, of ln flow along both axes, (surfaces, loads, axes)."""
    if quantity == "pressure":
        missed = data[f"{form}_mean_separation"] - data.mean_separation
        return np.asarray(missed * data.stiffness / data.pressure, float)[..., None]
    names = ("flow_x", "flow_y") if quantity == "flow" else (quantity,)
    with np.errstate(all="ignore"):
        ratio = np.stack([np.log(data[f"{form}_{name}"].values / data[name].values) for name in names], axis=-1)
    return np.where(np.isfinite(ratio), ratio, np.nan)


def seen(data: xr.Dataset, form: str, quantity: str) -> FloatArray:
    """Which entries count: of contact areas in range, of flow those where neither is blocked."""
    low, high = RANGES[form] if quantity != "flow" else (0.0, FLOW_AREA)
    inside = (data.area.values > low) & (data.area.values < high)
    return np.asarray(inside[..., None] & np.isfinite(errors(data, form, quantity)))


def valid(data: xr.Dataset, form: str, quantity: str = "area") -> Any:
    return data[f"{form}_{'flow_' if quantity == 'flow' else ''}valid"].values > 0.5


def coverage(data: xr.Dataset, form: str, quantity: str, of_valid: bool) -> tuple[float, float, int]:
    """Shares of errors within one and two stated standard deviations, and their number; where valid, or elsewhere."""
    ratio = np.abs(errors(data, form, quantity)) / data[f"{form}_{quantity}_scatter"].values[..., None]
    own = (valid(data, form, quantity) == of_valid)[..., None]
    ratio = ratio[seen(data, form, quantity) & np.isfinite(ratio) & own]
    return (*(float(np.mean(ratio < by)) if ratio.size else np.nan for by in (1, 2)), ratio.size)


def reached(ratio: FloatArray) -> float:
    """Factor of stated standard deviations after which they cover as many errors as they should."""
    return float(max(np.quantile(ratio, ONCE), np.quantile(ratio, TWICE) / 2))


def of_sensitivity(data: xr.Dataset, form: str) -> FloatArray:
    """The factor by which the scatter of each surface and load differs from that of a typical surface."""
    sensitivity = data[f"{form}_sensitivity"]
    # a load that a theory refuses has none
    return np.asarray((sensitivity.fillna(sensitivity.max("load")).values / TYPICAL) ** POWER)


def by_area(data: xr.Dataset, form: str, quantity: str, rows: Any) -> FloatArray:
    """One constant for each load of the truth: as many valid errors of surfaces of these numbers are covered."""
    kept: Any = seen(data, form, quantity) & valid(data, form, quantity)[..., None]
    error = np.abs(errors(data, form, quantity)) / of_sensitivity(data, form)[..., None]
    found = [error[rows, k][kept[rows, k]] for k in range(error.shape[1])]
    return np.array([reached(own) if own.size else np.nan for own in found])


def scatter(data: xr.Dataset, form: str, quantity: str, rows: Any) -> FloatArray:
    """Standard deviations of all surfaces, (surfaces, loads), by constants fitted to those of a mask."""
    if form != "calibrated" or quantity == "flow":
        return by_area(data, form, quantity, np.flatnonzero(rows)) * of_sensitivity(data, form)
    own = valid(data, form)
    # the part that is not fitted here
    rest = data[f"calibrated_{quantity}_scatter"].values ** 2 - np.where(own, *MAP_SCATTER[quantity]) ** 2
    gaussian, trials = np.sqrt(np.maximum(rest, 0.0)), np.geomspace(1e-3, 1.0, 400)
    error, added = np.abs(errors(data, form, quantity))[..., 0], np.empty(own.shape)
    for alike in (own, ~own):
        fitted = rows[:, None] & seen(data, form, quantity)[..., 0] & alike & np.isfinite(gaussian)
        factors = [reached(error[fitted] / np.hypot(gaussian[fitted], trial)) for trial in trials]
        added[alike] = trials[np.argmax(np.array(factors) <= 1)]
    return np.asarray(np.hypot(gaussian, added))


def left_out(data: xr.Dataset, form: str, quantity: str) -> dict[str, FloatArray]:
    """Errors of each family, where valid, over the standard deviations that the other families give.

    Of the calibrated law over those that other maps give, since one family alone is valid.
    """
    error, kept = np.abs(errors(data, form, quantity)), seen(data, form, quantity)
    kept = kept & valid(data, form, quantity)[..., None]
    families = data.family.values
    parts = data.surface.values if form == "calibrated" else families
    found: dict[str, list[FloatArray]] = {family: [] for family in FAMILIES}
    for part in np.unique(parts):
        own = kept & (parts == part)[:, None, None]
        if own.any():
            ratio = error / scatter(data, form, quantity, parts != part)[..., None]
            found[families[parts == part][0]].append(ratio[own & np.isfinite(ratio)])
    return {family: np.concatenate([np.empty(0), *each]) for family, each in found.items()}


def halves(values: FloatArray) -> str:
    """Median and 90% quantile of magnitudes."""
    return "{:.3f}, {:.3f}".format(*np.quantile(np.abs(values), (0.5, 0.9))) if values.size else ""


def by_family(data: xr.Dataset, form: str) -> str:
    lines = []
    for family in FAMILIES:
        own = data.isel(surface=np.flatnonzero(data.family.values == family))
        cells = [halves(errors(own, form, quantity)[seen(own, form, quantity)]) for quantity in QUANTITIES]
        lines.append([f"{family} ({own.sizes['surface']})", *cells, f"{own[f'{form}_valid'].values.mean():.0%}"])
    return table("family (maps) | ln A | ln F at equal u | ln stiffness | ln flow, A < 20% | valid", lines)


def families_left_out(data: xr.Dataset, form: str) -> str:
    """Shares of errors within one and two standard deviations that other families give."""
    columns = [left_out(data, form, quantity) for quantity in QUANTITIES]
    pooled = [{"all": np.concatenate([*column.values()])} | column for column in columns]
    rows = [[name, *(shares(column[name] for column in pooled))] for name in pooled[0]]
    return table("family | area | pressure | stiffness | flow", [row for row in rows if any(row[1:])])


def shares(ratios: Iterable[FloatArray]) -> list[str]:
    return [f"{np.mean(r < 1):.2f}, {np.mean(r < 2):.2f} ({r.size})" if r.size else "" for r in ratios]


def yielding(data: xr.Dataset) -> str:
    """Errors of simulation and of the law with a hardness: median and 90% quantile, of all maps."""
    area, u, share, frozen = (
        data[f"hard_{name}"].values for name in ("area", "mean_separation", "yielded", "unloading_stiffness")
    )
    slope, lines = data.hard_stiffness.values / data.hard_pressure.values, []
    names = {1: "simulation", 2: "law of hardness on the simulated elastic contact"}
    for (k, eta), (way, name) in itertools.product(enumerate(data.eta.values), names.items()):
        found = [np.log(each[:, way, k] / each[:, 0, k]) for each in (area, frozen)]
        found[1:1] = (u[:, way, k] - u[:, 0, k]) * slope[:, k], share[:, way, k] - share[:, 0, k]
        lines.append([f"{eta:g}", name, *map(halves, found)])
    return table("p_m/(E* g) | by | ln A | ln F at equal u | yielded share | ln unloading stiffness", lines)


def covered(data: xr.Dataset) -> str:
    """Shares of errors within one and two stated standard deviations, and numbers of errors."""
    rows = []
    for form, (of_valid, name) in itertools.product(RANGES, ((True, "valid"), (False, "not valid"))):
        found = [coverage(data, form, quantity, of_valid) for quantity in QUANTITIES]
        rows.append([form, name, *(f"{a:.2f}, {b:.2f} ({n})" if n else "" for a, b, n in found)])
    return table("theory | entries | area | pressure | stiffness | flow", rows)
