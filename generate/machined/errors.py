"""Errors of answers on maps of machined surfaces, from the file of the campaign."""

import numpy as np
import xarray as xr

from mbma_tables.common.arguments import FloatArray

QUANTITIES = ("area", "pressure", "stiffness", "flow")
RANGES = {"calibrated": (0.01, 0.6), "corrected": (0.01, 0.6), "simulated": (0.01, 0.9)}  # A/A0 whose errors are told
FLOW_AREA = 0.2


def errors(data: xr.Dataset, form: str, quantity: str) -> FloatArray:
    """Of ln A and ln stiffness at equal F, of ln F at equal u, of ln flow along both axes, (surfaces, loads, axes)."""
    if quantity == "pressure":
        missed = data[f"{form}_mean_separation"] - data.mean_separation
        found = np.asarray(missed * data.stiffness / data.pressure, float)
        return found.reshape(*found.shape, 1)
    names = ("flow_x", "flow_y") if quantity == "flow" else (quantity,)
    pairs = [(data[f"{form}_{name}"].values, data[name].values) for name in names]
    with np.errstate(all="ignore"):
        ratio = np.stack([np.log(answer / truth) for answer, truth in pairs], axis=-1)
    return np.where(np.isfinite(ratio), ratio, np.nan)


def seen(data: xr.Dataset, form: str, quantity: str) -> FloatArray:
    """Which entries count: of contact areas in range, of flow those where neither is blocked."""
    low, high = RANGES[form] if quantity != "flow" else (0.0, FLOW_AREA)
    inside = (data.area.values > low) & (data.area.values < high)
    return np.asarray(inside[..., None] & np.isfinite(errors(data, form, quantity)))


def coverage(data: xr.Dataset, form: str, quantity: str, valid: bool | None = None) -> tuple[float, float, int]:
    """Shares of errors within one and two stated standard deviations, and their number; of `valid` entries alone."""
    ratio = np.abs(errors(data, form, quantity)) / data[f"{form}_{quantity}_scatter"].values[..., None]
    own = data[f"{form}_{'flow_' if quantity == 'flow' else ''}valid"].values > 0.5
    kept = seen(data, form, quantity) & np.isfinite(ratio)
    if valid is not None:
        kept &= own[..., None] == valid
    ratio = ratio[kept]
    return (*(float(np.mean(ratio < by)) if ratio.size else np.nan for by in (1, 2)), ratio.size)
