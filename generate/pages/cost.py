"""docs/lookup.md: error, and deviation from simulation, against time.

As `python -m generate cost` measured them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import xarray as xr

from generate.calibrated_file import rms
from generate.distances import DEEP, HUES, LOW, THEORIES
from generate.files import ROOT, dataset, read_csv
from generate.machined.evaluation import TITLES
from generate.page import Measured, panels, printed
from mbma_tables.design.scenes.plan import shipped_costs

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

METHODS = {"classical": "classical iteration", "exact": "Newton (exact)"}
GAUGES = {
    "area_light": "contact area at a given pressure",
    "force_light": "pressure at a given gap",
}
# simulations of a map, timed in docs/maps.md, by what their columns of the data set begin with
OWN = ("corrected", "simulated")
COLOURS = {
    **dict(zip(THEORIES, HUES, strict=True)),
    "boundary elements": "C5",
    **{TITLES[form]: "C8" for form in OWN},
}
MARKS = "osD^vP*Xh<>d"


def pareto_front(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows that none is better than in both cost and error, cheapest first."""
    rows = rows.sort_values(["cost", "error"])
    return rows[rows["error"] < rows["error"].cummin().shift(fill_value=math.inf)]


def groups(rows: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Rows of one island and of one gap with an error, and the method of each."""
    what = rows["variant"].str.partition(" rtol=")[0]
    rows = rows.assign(method=rows["island_model"].replace(METHODS))
    is_by_nodes = (rows["island_model"] == "exact") & what.str.startswith("nodes=")
    rows.loc[is_by_nodes, "method"] += ", by nodes"
    is_of_both = rows["quantity"] == "both"  # force and area
    has_error = rows["error"].notna() & is_of_both
    is_law = (rows["island_model"] == "universal") & (what == "law")
    # a law's errors go with the price of evaluating it
    price_of_law = rows["cost"][(what == "lookup") & is_of_both].iloc[0]
    laws = rows[has_error & is_law].assign(method="law", cost=price_of_law)
    return {
        "one island": rows[has_error & what.str.match("island|nodes=|rings=")],
        "one gap of a surface": pd.concat([rows[has_error & (what == "gap")], laws]),
    }


def draw(costs: pd.DataFrame) -> Figure:
    figure, axes = panels(1, 2, (9, 4.8), sharey=True)
    microseconds = 1e6 * costs["cost"] * shipped_costs().seconds
    rows_by_title = groups(costs.assign(cost=microseconds))
    methods = pd.concat(rows_by_title.values())["method"].unique()
    mark_of_method = dict(zip(methods, MARKS, strict=False))
    handles: dict[str, Line2D] = {}
    for panel, (title, rows) in zip(axes, rows_by_title.items(), strict=True):
        handles |= _draw_methods(panel, rows, mark_of_method)
        front = pareto_front(rows)
        (handles["Pareto front"],) = panel.step(
            front["cost"], front["error"], "k-", lw=1, where="post", zorder=0
        )
        panel.set(xlabel="processor time [µs]", title=title)
        panel.grid(alpha=0.3)
    axes[0].set_ylabel("largest relative error")
    figure.legend(
        handles.values(), handles.keys(), loc="outside lower center", ncols=4, fontsize=8
    )
    return figure


def _draw_methods(
    panel: Axes, rows: pd.DataFrame, mark_of_method: Mapping[str, str]
) -> dict[str, Line2D]:
    """Dots of each method; what the legend shows of it."""
    handles = {}
    for number, (name, mark) in enumerate(mark_of_method.items()):
        chosen = rows[rows["method"] == name]
        if not len(chosen):
            continue
        (handles[name],) = panel.loglog(
            chosen["cost"],
            chosen["error"],
            color=f"C{number % 10}",
            marker=mark,
            ls="none",
            ms=5,
        )
    return handles


def gauge_rows(distances: pd.DataFrame) -> pd.DataFrame:
    """Microseconds a point, and percent of deviation at 1-10% contact.

    Of theories and of the library's simulations.
    """
    # rigid islands are not the model
    is_left_out = distances["way"].str.contains("continued|rigid")
    cold = distances[~is_left_out].reset_index(drop=True)
    rows = cold.assign(us=1e6 * cold["cost"] * shipped_costs().seconds)
    machined = dataset("machined")
    page = (ROOT / "docs" / "maps.md").read_text(encoding="utf-8")
    # of one core: contacts, without the flow
    timed = re.search(r"\| 256 x 256 \| yes \| ([\d.]+) s \| ([\d.]+) s \|", page)
    assert timed is not None
    for form, seconds in zip(OWN, timed.groups(), strict=True):
        microseconds = 1e6 * float(seconds)
        deviations = _deviations(machined, form)
        rows.loc[len(rows), ["theory", "us", *GAUGES]] = [
            TITLES[form],
            microseconds,
            *deviations,
        ]
    percentages = {name: 100 * np.expm1(rows[name].astype(float)) for name in GAUGES}
    return rows.assign(**percentages)


def _deviations(machined: xr.Dataset, form: str) -> tuple[float, float]:
    """Root mean squares of ln(theory/simulation) of area and of force, on machined maps."""
    area = machined.area
    is_light = (area >= LOW) & (area <= DEEP) & (machined[f"{form}_valid"] > 0)
    log_area = np.log(machined[f"{form}_area"] / area)
    # the error of the gap as one of the force at the gap
    gap = machined[f"{form}_mean_separation"] - machined.mean_separation
    log_force = gap * machined.stiffness / machined.pressure
    seen = is_light.values
    return rms(log_area.values[seen]), rms(log_force.values[seen])


def draw_gauge(rows: pd.DataFrame) -> Figure:
    """Deviation from boundary elements against time.

    A line joins the ways to evaluate a theory.
    """
    figure, axes = panels(2, 1, (9, 9.2), sharex=True)
    for panel, (name, title) in zip(axes, GAUGES.items(), strict=True):
        for (theory, colour), mark in zip(COLOURS.items(), MARKS, strict=True):
            is_of_theory = (rows["theory"] == theory) & rows[name].notna()
            ways = rows[is_of_theory].sort_values("us")
            panel.loglog(
                ways["us"], ways[name], f"{mark}-", color=colour, ms=6, label=theory
            )
        panel.set_title(f"error of the {title}")
        panel.grid(alpha=0.25)
        panel.yaxis.set_major_formatter("{x:g}%")
    axes[1].set_xlabel("processor time per point [µs]")
    figure.legend(
        *axes[0].get_legend_handles_labels(),
        loc="outside lower center",
        ncols=4,
        fontsize=9,
    )
    return figure


def measure() -> Measured:
    costs = read_csv(ROOT / "tables" / "cost.csv")
    distances = read_csv(ROOT / "tables" / "distance.csv")
    parts = {
        "costs": printed("mbma cost"),
        "distances": printed("mbma cost --distance"),
    }
    return parts, {
        "docs/figures/cost.svg": draw(costs),
        "docs/figures/gauge.svg": draw_gauge(gauge_rows(distances)),
    }
