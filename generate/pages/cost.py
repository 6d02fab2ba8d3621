"""docs/cost.md: error, and deviation from simulation, against time, as `python -m generate cost` measured them."""

import math
import re
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.ticker import FixedLocator

from generate.boundary_elements.studies import GRIDS
from generate.calibrated_file import rms
from generate.cost_distances import SIMULATED
from generate.distances import DEEP, LOW
from generate.files import ROOT, dataset, read_csv
from generate.page import Measured, panels, printed
from mbma_tables.scenes.plan import shipped_costs

METHODS = {"classical": "classical iteration", "exact": "Newton (exact)"}
GAUGES = {"area_light": "contact area at a given pressure", "force_light": "pressure at a given gap"}
OWN = ("corrected", "simulated")  # theories of a map, timed in docs/lookup.md
# in the gauge: a theory's label, its colour, and the label's place beside the slowest way [points], in both panels
LABELS: dict[str, tuple[Any, ...]] = {
    "calibrated": ("calibrated", "k", (10, 0), (24, -4)),
    "calibrated, map": ("calibrated, of a map", "0.5", (10, 0), (10, 0)),
    "MBMA reported": ("MBMA", "C0", (10, 0), (10, 0)),
    "MBMA, rigid islands": ("MBMA, rigid islands", "C0", (10, -7), (10, -6)),
    "MBMA printed": ("MBMA, printed", "C1", (10, 0), (12, -9)),
    "MBMA fitted": ("MBMA, fitted", "C9", (8, 8), (8, 7)),
    "MBMA cover": ("MBMA, cover", "C4", (8, 7), (8, 8)),
    "Persson": ("Persson", "C3", (-45, 10), (-45, 10)),
    "Persson simplified": ("Persson, simplified", "C6", (-100, -9), (-116, 0)),
    "G-W": ("Greenwood-Williamson", "C2", (10, 2), (-58, -9)),
    SIMULATED: ("boundary elements", "C5", (-108, -9), (-108, -9)),
    "corrected": ("own simulation, corrected", "C8", (8, 5), (-146, -10)),
    "simulated": ("own simulation, simulated", "C8", (8, 2), (8, 6)),
}
ABOVE = ("G-W", SIMULATED)  # the names of ways are above their points
SHORT = {"closed form, area of a force": "formula", "law": "law", "table": "table", "quadrature": "quadrature"}
SHORT |= {"inverse of (19)": "quadrature", "universal": "table", "island4d": "4-D", "formula": "formula"}
SHORT |= {"exact": "exact"} | {f"{points} x {points}, cold": f"{points}²" for points in GRIDS}
TIMES = {10.0**k: f"{10.0**k:g}" for k in range(-2, 3)} | {10.0**k: f"10$^{k}$" for k in range(3, 9)}
TIMES |= {1e3: "1000\n= 1 ms", 1e6: "10$^6$\n= 1 s"}


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


def gauge_rows(distances: pd.DataFrame) -> pd.DataFrame:
    """Microseconds a point, and percent of deviation at 1-10% contact, of theories and of the library's simulations."""
    cold = distances[~distances["way"].str.endswith("continued")].reset_index(drop=True)
    rows = cold.assign(us=1e6 * cold["cost"] * shipped_costs().seconds)
    rows.loc[rows["way"] == "rigid", "theory"] = "MBMA, rigid islands"
    data, benchmarks = dataset("machined"), (ROOT / "docs" / "lookup.md").read_text(encoding="utf-8")
    for theory in OWN:
        timed = re.search(rf"256 x 256, periodic: {theory}.* \| ([\d.]+) s \|", benchmarks)
        assert timed is not None
        seen = (data.area.values >= LOW) & (data.area.values <= DEEP) & (data[f"{theory}_valid"].values > 0)
        off = (data[f"{theory}_mean_separation"] - data.mean_separation) * data.stiffness / data.pressure
        errors = np.log(data[f"{theory}_area"] / data.area).values[seen], off.values[seen]
        rows.loc[len(rows), ["theory", "us", *GAUGES]] = [theory, 1e6 * float(timed[1]), *map(rms, errors)]
    return rows.assign(**{name: 100 * np.expm1(rows[name].astype(float)) for name in GAUGES})


def draw_gauge(rows: pd.DataFrame) -> Any:
    """Deviation from boundary elements against time: a line joins the ways to evaluate a theory."""
    figure, axes = panels(2, 1, (9, 9.2))
    for panel, (name, title) in zip(axes, GAUGES.items(), strict=True):
        for theory, (label, colour, *places) in LABELS.items():
            own = rows[(rows["theory"] == theory) & rows[name].notna()].sort_values("us")
            panel.loglog(own["us"], own[name], "o-", color=colour, lw=2, ms=5)
            place = own[["us", name]].to_numpy(float)[-1]
            options: dict[str, Any] = {"textcoords": "offset points", "color": colour}
            panel.annotate(label, place, places[panel is axes[1]], weight="bold", va="center", fontsize=9, **options)
            for way, at, value in own[["way", "us", name]].itertuples(index=False) if len(own) > 1 else ():
                shift, side = (8, "left") if theory == SIMULATED else (0, "right" if way[:6] == "closed" else "center")
                where = shift, 7 if theory in ABOVE else -9
                panel.annotate(SHORT[way], (at, value), where, ha=side, va="center", fontsize=7, **options)
        panel.set(title=f"error of the {title}", xlim=(6e-3, 1e9), ymargin=0.1)
        panel.grid(alpha=0.25)
        panel.yaxis.set_major_formatter("{x:g}%")
        panel.xaxis.set_major_locator(FixedLocator([*TIMES]))
        panel.xaxis.set_major_formatter(lambda x, _: TIMES[x])
        panel.minorticks_off()
    axes[1].set_xlabel("processor time per point [µs]")
    return figure


def measure() -> Measured:
    """What `mbma cost` prints, and the figures."""
    costs, distances = (read_csv(ROOT / "tables" / f"{name}.csv") for name in ("cost", "distance"))
    figures = {"docs/figures/cost.svg": draw(costs), "docs/figures/gauge.svg": draw_gauge(gauge_rows(distances))}
    return {"costs": printed("mbma cost"), "distances": printed("mbma cost --distance")}, figures
