"""docs/machined.md: errors of answers on maps of machined surfaces by family, and how many their scatter covers."""

import itertools
from typing import Any

import numpy as np
import xarray as xr

from generate.files import dataset
from generate.machined.campaign import FORMS
from generate.machined.coverage import left_out
from generate.machined.errors import QUANTITIES, coverage, errors, seen
from generate.machined.makers import FAMILIES, Part, heights
from generate.page import Measured, panels, table
from mbma_tables.common.arguments import FloatArray

NAMES = {"simulated": "simulation", "law": "law of hardness on the simulated elastic contact"}
SHOWN, THINNED = 1, 6  # number of the map that is drawn of each family, and of its points one in so many


def halves(values: FloatArray) -> str:
    """Median and 90% quantile of magnitudes."""
    return "{:.3f}, {:.3f}".format(*np.quantile(np.abs(values), (0.5, 0.9))) if values.size else ""


def by_family(data: xr.Dataset, form: str) -> str:
    lines = []
    for family in FAMILIES:
        own = data.isel(surface=np.flatnonzero(data.family.values == family))
        cells = [halves(errors(own, form, quantity)[seen(own, form, quantity)]) for quantity in QUANTITIES]
        valid = float(np.mean(own[f"{form}_valid"].values))
        lines.append([f"{family} ({own.sizes['surface']})", *cells, f"{valid:.0%}"])
    return table("family (maps) | ln A | ln F at equal u | ln stiffness | ln flow, A < 20% | valid", lines)


def families_left_out(data: xr.Dataset, form: str) -> str:
    """Shares of errors within one and two standard deviations that other families give."""
    columns = [left_out(data, form, quantity) for quantity in QUANTITIES]
    pooled = [{"all": np.concatenate([*column.values()]), **column} for column in columns]

    def shares(ratio: FloatArray) -> str:
        return f"{np.mean(ratio < 1):.2f}, {np.mean(ratio < 2):.2f} ({ratio.size})" if ratio.size else ""

    rows = [[name, *(shares(column[name]) for column in pooled)] for name in pooled[0]]
    return table("family | area | pressure | stiffness | flow", [row for row in rows if any(row[1:])])


def yielding(data: xr.Dataset) -> str:
    """Errors of simulation and of the law with a hardness: median and 90% quantile, of all maps."""
    area, u, share, frozen = (
        data[f"hard_{name}"].values for name in ("area", "mean_separation", "yielded", "unloading_stiffness")
    )
    slope, lines = data.hard_stiffness.values / data.hard_pressure.values, []
    for (k, eta), (way, name) in itertools.product(enumerate(data.eta.values), enumerate(data.way.values[1:], 1)):
        found = [
            np.log(area[:, way, k] / area[:, 0, k]),
            (u[:, way, k] - u[:, 0, k]) * slope[:, k],
            share[:, way, k] - share[:, 0, k],
            np.log(frozen[:, way, k] / frozen[:, 0, k]),
        ]
        lines.append([f"{eta:g}", NAMES[str(name)], *map(halves, found)])
    return table("p_m/(E* g) | by | ln A | ln F at equal u | yielded share | ln unloading stiffness", lines)


def figure_of(data: xr.Dataset) -> Any:
    """One map of each family, its areas, and their errors."""
    rows = -(-len(FAMILIES) // 2)
    figure, axes = panels(rows, 6, (15, 2.2 * rows), gridspec_kw={"width_ratios": 2 * (1, 1.5, 1.5)})
    places = axes.reshape(-1, 3)
    for spare in places[len(FAMILIES) :].ravel():
        spare.set_axis_off()
    for row, family in zip(places, FAMILIES, strict=False):
        part = Part(family, SHOWN)
        own = data.sel(surface=part.name)
        row[0].imshow(heights(part)[::THINNED, ::THINNED].T, origin="lower", interpolation="none")
        row[0].set(xticks=(), yticks=(), ylabel=family)
        row[1].loglog(own.pressure, own.area, "ko", mfc="none", label="full simulation")
        for form in FORMS:
            row[1].loglog(own.pressure, own[f"{form}_area"], label=form)
            row[2].loglog(own.area, np.abs(np.log(own[f"{form}_area"] / own.area)), ".-", label=form)
        row[1].set(xlim=(3e-5, 0.2), ylim=(2e-3, 1))
        row[2].set(xlim=(2e-3, 1), ylim=(1e-4, 1))
        for one in row[1:]:
            one.minorticks_off()
            one.tick_params(labelbottom=False, labelleft=False)
    places[0, 1].legend(fontsize="x-small")
    places[0, 1].set_title("A/A0")
    places[0, 2].set_title("error of ln A")
    for row in places[len(FAMILIES) - 2 : len(FAMILIES)]:
        for one, label in zip(row[1:], ("pressure  F/(A0 E*)", "A/A0"), strict=True):
            one.set_xlabel(label)
            one.tick_params(labelbottom=True)
    for one in axes[:, 1:3].ravel():
        one.tick_params(labelleft=True)
    return figure


def measure() -> Measured:
    data, lines = dataset("machined"), []
    for form in FORMS:
        for valid, name in ((True, "valid"), (False, "not valid")):
            found = [coverage(data, form, quantity, valid) for quantity in QUANTITIES]
            lines.append([form, name, *(f"{a:.2f}, {b:.2f} ({n})" if n else "" for a, b, n in found)])
    parts = {form: by_family(data, form) for form in FORMS}
    parts |= {f"left_out_{form}": families_left_out(data, form) for form in FORMS}
    parts["yielding"] = yielding(data)
    parts["coverage"] = table("theory | entries | area | pressure | stiffness | flow", lines)
    return parts, {"docs/figures/machined.svg": figure_of(data)}
