"""docs/cost.md: error, and deviation from simulation, against time, as `python -m generate cost` measured them."""

from __future__ import annotations

import math
from typing import Any

import pandas as pd

from generate.cost_distances import SIMULATED
from generate.distances import HUES
from generate.files import ROOT, read_csv
from generate.page import Measured, panels, printed
from mbma_tables.scenes.costs import shipped_costs

METHODS = {"classical": "classical iteration", "exact": "Newton (exact)"}
SHAPES = {"MBMA": "o", "calibrated": "s", "Persson": "^", "G-W": "v"}
DEVIATIONS = ("area_light", "area_deep", "force_light", "force_deep")


def pareto_front(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows that none is better than in both cost and error, cheapest first."""
    rows = rows.sort_values(["cost", "error"])
    return rows[rows["error"] < rows["error"].cummin().shift(fill_value=math.inf)]


def groups(rows: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Rows of one island and of one gap with an error, and the method of each."""
    what = rows["variant"].str.partition(" rtol=")[0]
    rows = rows.assign(method=rows["island_model"].replace(METHODS))
    rows.loc[(rows["island_model"] == "exact") & what.str.startswith("nodes="), "method"] += ", by nodes"
    both = rows["error"].notna() & (rows["quantity"] == "both")
    laws = rows[both & (rows["island_model"] == "universal") & (what == "law")]
    # a law's errors go with the price of evaluating it
    laws = laws.assign(method="law", cost=rows["cost"][(what == "lookup") & (rows["quantity"] == "both")].iloc[0])
    own = rows[both & what.str.match("island|nodes=|rings=")]
    return {"one island": own, "one gap of a surface": pd.concat([rows[both & (what == "gap")], laws])}


def draw(costs: pd.DataFrame) -> Any:
    """Error against cost, of islands and of totals."""
    figure, axes = panels(1, 2, (9, 4.8), sharey=True)
    own, handles = groups(costs), dict[str, Any]()
    marks = dict(zip(pd.concat(own.values())["method"].unique(), "osD^vP*Xh<>d", strict=False))
    for panel, (title, rows) in zip(axes, own.items(), strict=True):
        for k, (name, mark) in enumerate(marks.items()):
            chosen = rows[rows["method"] == name]
            if len(chosen):
                style: dict[str, Any] = {"color": f"C{k % 10}", "marker": mark, "ls": "none", "ms": 5}
                (handles[name],) = panel.loglog(chosen["cost"], chosen["error"], **style)
        front = pareto_front(rows)
        (handles["Pareto front"],) = panel.step(front["cost"], front["error"], "k-", lw=1, where="post", zorder=0)
        panel.set(xlabel="time / fixed piece of work", title=title)
        panel.grid(alpha=0.3)
    axes[0].set_ylabel("largest relative error")
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4, fontsize=8)
    return figure


def draw_distances(rows: pd.DataFrame) -> Any:
    """Deviation against time: area above, force below, light contact left, deep contact right."""
    figure, axes = panels(2, 2, (9, 7.4), sharex=True, sharey=True)
    for panel, name in zip(axes.flat, DEVIATIONS, strict=True):
        for theory, colour in (HUES | {SIMULATED: "C5"}).items():
            marker = next((shape for start, shape in SHAPES.items() if theory.startswith(start)), "*")
            own = rows[rows["theory"] == theory]
            x, y = own["cost"] * shipped_costs().seconds, 100 * own[name]
            panel.loglog(x, y, marker, color=colour, ls="none", ms=6, label=theory)
            for way, a, b in zip(own["way"], x, y, strict=True):
                if theory == SIMULATED and way.endswith("cold"):
                    panel.annotate(way.split()[0], (a, b), (4, 3), textcoords="offset points", fontsize=7)
        panel.grid(alpha=0.3)
        panel.set_xlim(1e-8, 1e3)
    for k, title in enumerate(("1-10% contact", "10-97% contact")):
        axes[0, k].set_title(title)
        axes[1, k].set_xlabel("processor time a point [s]")
    axes[0, 0].set_ylabel("area at equal force, rms distance [%]")
    axes[1, 0].set_ylabel("force at equal separation, rms distance [%]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), fontsize="small", loc="outside lower center", ncols=5)
    return figure


def measure() -> Measured:
    """What `mbma cost` prints, and the figures."""
    costs, distances = (read_csv(ROOT / "tables" / f"{name}.csv") for name in ("cost", "distance"))
    figures = {"docs/figures/cost.svg": draw(costs), "docs/figures/distance.svg": draw_distances(distances)}
    return {"costs": printed("mbma cost"), "distances": printed("mbma cost --distance")}, figures
