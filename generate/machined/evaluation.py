"""Errors of answers on maps of machined surfaces, and how many of them the stated scatter covers.

Each form states a standard deviation with a few constants, the same for all maps::

    simulated    one for each contact area of the truth and grid, times a power of the map's
                 sensitivity
    calibrated   root of s^2 + c^2, s that of Gaussian maps, one c for maps that are valid and
                 one for others

They cover 70% of errors once and 97.5% twice. `left_out` states for each family what the others
give.
"""

import itertools
from collections.abc import Iterable

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from sklearn.model_selection import LeaveOneGroupOut

from generate.machined.makers import FAMILIES
from generate.page import table
from mbma_tables.common.arguments import FloatArray
from mbma_tables.theories.calibrated.theory import MAP_SCATTER
from mbma_tables.theories.simulated.one_map import POWER, TYPICAL

# names of theories, by what their columns of the file begin with
TITLES = {
    "calibrated": "calibrated",
    "corrected": "simulated, quick grid",
    "simulated": "simulated, full grid",
}
QUANTITIES = ("area", "pressure", "stiffness", "flow")
# A/A0 between which errors count
RANGES = {"calibrated": (0.01, 0.6), "corrected": (0.01, 0.6), "simulated": (0.01, 0.9)}
FLOW_AREA = 0.2
# shares of errors that one and two standard deviations cover
ONCE = 0.70
TWICE = 0.975


def errors(data: xr.Dataset, form: str, quantity: str) -> FloatArray:
    """Errors of a theory, shape (surfaces, loads, axes).

    They are those of ln A and ln stiffness at equal F, of ln F at equal u, and of ln flow along
    both axes.
    """
    if quantity == "pressure":
        missed = data[f"{form}_mean_separation"] - data.mean_separation
        return np.asarray(missed * data.stiffness / data.pressure, float)[..., None]
    names = ("flow_x", "flow_y") if quantity == "flow" else (quantity,)
    with np.errstate(all="ignore"):
        ratios = [
            np.log(data[f"{form}_{name}"].values / data[name].values) for name in names
        ]
        ratio = np.stack(ratios, axis=-1)
    return np.where(np.isfinite(ratio), ratio, np.nan)


def seen(data: xr.Dataset, form: str, quantity: str) -> NDArray[np.bool_]:
    """Which entries count: of contact areas in range, of flow those where neither is blocked."""
    low, high = RANGES[form] if quantity != "flow" else (0.0, FLOW_AREA)
    inside = (data.area.values > low) & (data.area.values < high)
    return np.asarray(inside[..., None] & np.isfinite(errors(data, form, quantity)))


def valid(data: xr.Dataset, form: str, quantity: str = "area") -> NDArray[np.bool_]:
    name = f"{form}_flow_valid" if quantity == "flow" else f"{form}_valid"
    return np.asarray(data[name].values > 0.5)


def coverage(
    data: xr.Dataset,
    form: str,
    quantity: str,
    of_valid: bool,
) -> tuple[float, float, int]:
    """Shares of errors within one and two stated standard deviations, and their number.

    Of valid answers, or of the others.
    """
    stated = data[f"{form}_{quantity}_scatter"].values[..., None]
    ratio = np.abs(errors(data, form, quantity)) / stated
    chosen = (valid(data, form, quantity) == of_valid)[..., None]
    ratio = ratio[seen(data, form, quantity) & np.isfinite(ratio) & chosen]
    if not ratio.size:
        return np.nan, np.nan, 0
    return float(np.mean(ratio < 1)), float(np.mean(ratio < 2)), ratio.size


def reached(ratio: FloatArray) -> float:
    """Factor of stated standard deviations after which they cover as many errors as they should."""
    return float(max(np.quantile(ratio, ONCE), np.quantile(ratio, TWICE) / 2))


def of_sensitivity(data: xr.Dataset, form: str) -> FloatArray:
    """The factor by which the scatter of each surface and load differs from a typical surface's."""
    sensitivity = data[f"{form}_sensitivity"]
    # a load that a theory refuses has none
    filled = sensitivity.fillna(sensitivity.max("load")).values
    return np.asarray((filled / TYPICAL) ** POWER)


def by_area(
    data: xr.Dataset, form: str, quantity: str, rows: NDArray[np.int_]
) -> FloatArray:
    """One constant for each load of the truth: it covers valid errors of surfaces `rows`."""
    counted = seen(data, form, quantity) & valid(data, form, quantity)[..., None]
    error = np.abs(errors(data, form, quantity)) / of_sensitivity(data, form)[..., None]
    constants = []
    for load in range(error.shape[1]):
        errors_at_load = error[rows, load][counted[rows, load]]
        constants.append(reached(errors_at_load) if errors_at_load.size else np.nan)
    return np.array(constants)


def scatter(
    data: xr.Dataset, form: str, quantity: str, rows: NDArray[np.bool_]
) -> FloatArray:
    """Standard deviations of all surfaces, (surfaces, loads), by constants fitted to `rows`."""
    if form != "calibrated" or quantity == "flow":
        constants = by_area(data, form, quantity, np.flatnonzero(rows))
        return constants * of_sensitivity(data, form)
    of_valid = valid(data, form)
    # the part of Gaussian maps, which is not fitted here: the stated scatter without its constant
    stated_constant = np.where(of_valid, *MAP_SCATTER[quantity])
    rest = data[f"calibrated_{quantity}_scatter"].values ** 2 - stated_constant**2
    gaussian = np.sqrt(np.maximum(rest, 0.0))
    error = np.abs(errors(data, form, quantity))[..., 0]
    counted = rows[:, None] & seen(data, form, quantity)[..., 0]
    trials = np.geomspace(1e-3, 1.0, 400)
    added = np.empty(of_valid.shape)
    for alike in (of_valid, ~of_valid):
        fitted = counted & alike & np.isfinite(gaussian)
        # the smallest constant that covers as many errors as it should
        factors = [
            reached(error[fitted] / np.hypot(gaussian[fitted], trial)) for trial in trials
        ]
        added[alike] = trials[np.argmax(np.array(factors) <= 1)]
    return np.asarray(np.hypot(gaussian, added))


def left_out(data: xr.Dataset, form: str, quantity: str) -> dict[str, FloatArray]:
    """Errors of each family, where valid, over the scatter that the other families give.

    Of the calibrated law over the scatter that other maps give, since one family alone is valid.
    """
    error = np.abs(errors(data, form, quantity))
    counted = seen(data, form, quantity) & valid(data, form, quantity)[..., None]
    families = data.family.values
    parts = data.surface.values if form == "calibrated" else families
    ratios: dict[str, list[FloatArray]] = {family: [] for family in FAMILIES}
    for others, left_out_ones in LeaveOneGroupOut().split(parts, groups=parts):
        is_other, is_left_out = np.zeros((2, len(parts)), dtype=bool)
        is_other[others], is_left_out[left_out_ones] = True, True
        of_part = counted & is_left_out[:, None, None]
        if of_part.any():
            ratio = error / scatter(data, form, quantity, is_other)[..., None]
            family = families[left_out_ones[0]]
            ratios[family].append(ratio[of_part & np.isfinite(ratio)])
    # a family without a valid answer has no ratio
    return {
        family: np.concatenate([np.empty(0), *each]) for family, each in ratios.items()
    }


def halves(values: FloatArray) -> str:
    """Median and 90% quantile of magnitudes."""
    if not values.size:
        return ""
    median, most = np.quantile(np.abs(values), (0.5, 0.9))
    return f"{median:.3f}, {most:.3f}"


def by_family(data: xr.Dataset, form: str) -> str:
    lines = []
    for family in FAMILIES:
        of_family = data.isel(surface=np.flatnonzero(data.family.values == family))
        cells = [f"{family} ({of_family.sizes['surface']})"]
        for quantity in QUANTITIES:
            counted = seen(of_family, form, quantity)
            cells.append(halves(errors(of_family, form, quantity)[counted]))
        cells.append(f"{of_family[f'{form}_valid'].values.mean():.0%}")
        lines.append(cells)
    header = (
        "family (maps) | ln A | ln F at equal u | ln stiffness | ln flow, A < 20% | valid"
    )
    return table(header, lines)


def families_left_out(data: xr.Dataset, form: str) -> str:
    """Shares of errors within one and two standard deviations that other families give."""
    columns = []
    for quantity in QUANTITIES:
        column = left_out(data, form, quantity)
        columns.append({"all": np.concatenate([*column.values()])} | column)
    rows = []
    for name in columns[0]:
        cells = shares(column[name] for column in columns)
        # families without a valid answer are no rows
        if any(cells):
            rows.append([name, *cells])
    return table("family | area | pressure | stiffness | flow", rows)


def shares(ratios: Iterable[FloatArray]) -> list[str]:
    cells = []
    for ratio in ratios:
        if ratio.size:
            cells.append(
                f"{np.mean(ratio < 1):.2f}, {np.mean(ratio < 2):.2f} ({ratio.size})"
            )
        else:
            cells.append("")
    return cells


def yielding(data: xr.Dataset) -> str:
    """Errors of simulation and of the law with a hardness: median and 90% quantile, of all maps."""
    area = data.hard_area.values
    u = data.hard_mean_separation.values
    share = data.hard_yielded.values
    frozen = data.hard_unloading_stiffness.values
    # turns a difference of u into one of ln F
    slope = data.hard_stiffness.values / data.hard_pressure.values
    lines = []
    names = {1: "simulation", 2: "law of hardness on the simulated elastic contact"}
    for (k, eta), (way, name) in itertools.product(
        enumerate(data.eta.values), names.items()
    ):
        deviations = (
            np.log(area[:, way, k] / area[:, 0, k]),
            (u[:, way, k] - u[:, 0, k]) * slope[:, k],
            share[:, way, k] - share[:, 0, k],
            np.log(frozen[:, way, k] / frozen[:, 0, k]),
        )
        lines.append([f"{eta:g}", name, *map(halves, deviations)])
    header = "p_m/(E* g) | by | ln A | ln F at equal u | yielded share | ln unloading stiffness"
    return table(header, lines)


def covered(data: xr.Dataset) -> str:
    """Shares of errors within one and two stated standard deviations, and numbers of errors."""
    rows = []
    for form, of_valid in itertools.product(RANGES, (True, False)):
        cells = [TITLES[form], "valid" if of_valid else "not valid"]
        for quantity in QUANTITIES:
            once, twice, number = coverage(data, form, quantity, of_valid)
            cells.append(f"{once:.2f}, {twice:.2f} ({number})" if number else "")
        rows.append(cells)
    return table("theory | entries | area | pressure | stiffness | flow", rows)
