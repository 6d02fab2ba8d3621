"""docs/cost.md: error, and deviation from simulation, against time, as `python -m generate cost` measured them."""

import math
import re
from typing import Any

import numpy as np
import pandas as pd

from generate.calibrated_file import rms
from generate.distances import DEEP, HUES, LOW, THEORIES
from generate.files import ROOT, dataset, read_csv
from generate.machined.evaluation import TITLES
from generate.page import Measured, panels, printed
from mbma_tables.scenes.plan import shipped_costs

METHODS = {"classical": "classical iteration", "exact": "Newton (exact)"}
GAUGES = {
    "area_light": "contact area at a given pressure",
    "force_light": "pressure at a given gap",
}
# simulations of a map, timed in docs/lookup.md, by what their columns of the data set begin with
OWN = ("corrected", "simulated")
COLOURS = (
    dict(zip(THEORIES, HUES, strict=True))
    | {"boundary elements": "C5"}
    | {TITLES[form]: "C8" for form in OWN}
)


def pareto_front(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows that none is better than in both cost and error, cheapest first."""
    rows = rows.sort_values(["cost", "error"])
    return rows[rows["error"] < rows["error"].cummin().shift(fill_value=math.inf)]


def groups(rows: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Rows of one island and of one gap with an error, and the method of each."""
    what = rows["variant"].str.partition(" rtol=")[0]
    rows = rows.assign(method=rows["island_model"].replace(METHODS))
    rows.loc[
        (rows["island_model"] == "exact") & what.str.startswith("nodes="), "method"
    ] += ", by nodes"
    both = rows["error"].notna() & (rows["quantity"] == "both")
    laws = rows[both & (rows["island_model"] == "universal") & (what == "law")]
    # a law's errors go with the price of evaluating it
    laws = laws.assign(
        method="law",
        cost=rows["cost"][(what == "lookup") & (rows["quantity"] == "both")].iloc[0],
    )
    own = rows[both & what.str.match("island|nodes=|rings=")]
    return {
        "one island": own,
        "one gap of a surface": pd.concat([rows[both & (what == "gap")], laws]),
    }


def draw(costs: pd.DataFrame) -> Any:
    figure, axes = panels(1, 2, (9, 4.8), sharey=True)
    own, handles = groups(costs), dict[str, Any]()
    marks = dict(
        zip(pd.concat(own.values())["method"].unique(), "osD^vP*Xh<>d", strict=False)
    )
    for panel, (title, rows) in zip(axes, own.items(), strict=True):
        for k, (name, mark) in enumerate(marks.items()):
            chosen = rows[rows["method"] == name]
            if len(chosen):
                style: dict[str, Any] = {
                    "color": f"C{k % 10}",
                    "marker": mark,
                    "ls": "none",
                    "ms": 5,
                }
                (handles[name],) = panel.loglog(chosen["cost"], chosen["error"], **style)
        front = pareto_front(rows)
        (handles["Pareto front"],) = panel.step(
            front["cost"], front["error"], "k-", lw=1, where="post", zorder=0
        )
        panel.set(xlabel="time / fixed piece of work", title=title)
        panel.grid(alpha=0.3)
    axes[0].set_ylabel("largest relative error")
    figure.legend(
        handles.values(), handles.keys(), loc="outside lower center", ncols=4, fontsize=8
    )
    return figure


def gauge_rows(distances: pd.DataFrame) -> pd.DataFrame:
    """Microseconds a point, and percent of deviation at 1-10% contact, of theories and of the library's simulations."""
    # rigid islands are not the model
    cold = distances[~distances["way"].str.contains("continued|rigid")].reset_index(
        drop=True
    )
    rows = cold.assign(us=1e6 * cold["cost"] * shipped_costs().seconds)
    data, benchmarks = (
        dataset("machined"),
        (ROOT / "docs" / "lookup.md").read_text(encoding="utf-8"),
    )
    for form in OWN:
        timed = re.search(
            rf"256 x 256, periodic: {TITLES[form]}.* \| ([\d.]+) s \|", benchmarks
        )
        assert timed is not None
        seen = (
            (data.area >= LOW) & (data.area <= DEEP) & (data[f"{form}_valid"] > 0)
        ).values
        off = (
            (data[f"{form}_mean_separation"] - data.mean_separation)
            * data.stiffness
            / data.pressure
        )
        errors = np.log(data[f"{form}_area"] / data.area).values[seen], off.values[seen]
        rows.loc[len(rows), ["theory", "us", *GAUGES]] = [
            TITLES[form],
            1e6 * float(timed[1]),
            *map(rms, errors),
        ]
    return rows.assign(
        **{name: 100 * np.expm1(rows[name].astype(float)) for name in GAUGES}
    )


def draw_gauge(rows: pd.DataFrame) -> Any:
    """Deviation from boundary elements against time: a line joins the ways to evaluate a theory."""
    figure, axes = panels(2, 1, (9, 9.2), sharex=True)
    for panel, (name, title) in zip(axes, GAUGES.items(), strict=True):
        for (theory, colour), mark in zip(COLOURS.items(), "osD^vP*Xh<>d", strict=True):
            own = rows[(rows["theory"] == theory) & rows[name].notna()].sort_values("us")
            panel.loglog(
                own["us"], own[name], f"{mark}-", color=colour, ms=6, label=theory
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
    costs, distances = (
        read_csv(ROOT / "tables" / f"{name}.csv") for name in ("cost", "distance")
    )
    figures = {
        "docs/figures/cost.svg": draw(costs),
        "docs/figures/gauge.svg": draw_gauge(gauge_rows(distances)),
    }
    return {
        "costs": printed("mbma cost"),
        "distances": printed("mbma cost --distance"),
    }, figures
