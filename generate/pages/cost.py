"""docs/cost.md: what accuracy costs, every time a ratio to one fixed piece of work; its data and figures."""

from __future__ import annotations

import io
import json
import math
import platform
from importlib import metadata
from typing import Any

import pandas as pd

from generate import timing
from generate.pages import cost_distances, cost_rows
from generate.pages.distances import HUES
from generate.pages.page import Measured, duration, panels, percent, table, to_csv
from mbma_tables.scenes.costs import UNIT, Row
from mbma_tables.theories import THEORIES

METHODS = {"classical": "classical iteration", "exact": "Newton (exact)"}
ONCE = ("import", "call", "law", "profile", "lookup", "invert")
SHOWN_RTOLS = ("1e-02", "1e-05", "1e-08")
HEAD = """\
# What accuracy costs, measured by python -m generate pages cost; docs/cost.md says how. Costs are times over that of a
# fixed piece of work in the same run; the row of island model unit has its seconds.
"""
SHAPES = {"MBMA": "o", "calibrated": "s", "Persson": "^", "G-W": "v"}
DEVIATIONS = ["area_light", "area_deep", "force_light", "force_deep"]


def study() -> bytes:
    """Every measurement of tables/cost.csv, in a few minutes."""
    seconds, rows = [timing.measure(lambda: None)[1]], list[Row]()
    for part in (cost_rows.island_rows, cost_rows.total_rows):
        rows += part()
        seconds.append(timing.measure(lambda: None)[1])
    facts = {"machine": platform.machine()} | {name: metadata.version(name) for name in ("numpy", "scipy")}
    head = f"{HEAD}# {json.dumps(facts | {'python': platform.python_version()})}\n"
    # the least: other processes can only add
    return to_csv(head, pd.DataFrame([Row(UNIT, "seconds", "both", None, min(seconds)), *rows]), "%.4g")


def read(content: bytes) -> pd.DataFrame:
    """Rows of a file of costs, with what was measured and what the page calls the method."""
    rows = pd.read_csv(io.BytesIO(content), comment="#")
    rows["what"] = rows["variant"].str.partition(" rtol=")[0]
    rows["method"] = rows["island_model"].replace(METHODS)
    return rows


def pareto_front(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows that none is better than in both cost and error, cheapest first."""
    rows = rows.sort_values(["cost", "error"])
    return rows[rows["error"] < rows["error"].cummin().shift(fill_value=math.inf)]


def groups(rows: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Rows of one island and of one gap, with an error to go with the cost."""
    known = rows[rows["error"].notna()]
    laws = known[(known["island_model"] == "universal") & (known["what"] == "law")].copy()
    # a law's errors go with the price of evaluating it
    lookup = rows[(rows["variant"] == "lookup") & (rows["quantity"] == "both")]["cost"].iloc[0]
    laws[["method", "cost", "evaluations"]] = "law", lookup, 0.0
    laws["variant"] = laws["variant"].str.replace("law", "lookup")
    gaps = known[(known["quantity"] == "both") & (known["what"] == "gap")]
    own = known[known["what"].str.startswith(("island", "nodes=", "rings="))]
    return {"one island": own, "one gap of a surface": pd.concat([gaps, laws])}


def rows_table(rows: pd.DataFrame, front: Any = ()) -> str:
    """Rows with their errors, costs and counts; those of the front are marked."""
    columns = ["method", "variant", "error", "cost", "evaluations"]
    lines = [
        [name, variant, *(None if math.isnan(v) else v for v in values), "front" if index in front else ""]
        for index, name, variant, *values in rows[columns].itertuples()
    ]
    return table("method | variant | largest error | cost | evaluations | ", lines, "{} | {} | {:.1e} | {:.3g}")


def ranked(rows: pd.DataFrame) -> str:
    """Decades that rows span, and a table of the front and a few tolerances; the file has all."""
    time, error = (math.log10(rows[name].max() / rows[name].min()) for name in ("cost", "error"))
    front, named = pareto_front(rows).index, rows["variant"]
    shown = rows.index.isin(front) | ~named.str.contains("rtol=") | named.str.endswith(SHOWN_RTOLS)
    return f"They span {time:.1f} decades of time and {error:.1f} of error.\n\n{rows_table(rows[shown], front)}"


def parts_of(rows: pd.DataFrame, distances: pd.DataFrame) -> dict[str, str]:
    """The measured blocks of the page."""
    seconds = rows["cost"][rows["island_model"] == UNIT].iloc[0]
    both = rows["quantity"] == "both"
    listed = (rows["what"].isin(ONCE) & both) | (rows["what"] == "invert") | rows["island_model"].isin(THEORIES)
    keys = ["island_model", "what"]
    # of several tolerances the tightest, which is listed last, where the first stands
    once = rows[listed].groupby(keys, sort=False).tail(1).set_index(keys)
    once = once.loc[list(rows[listed].drop_duplicates(keys)[keys].itertuples(index=False, name=None))]
    alone = rows[~both & (rows["what"] == "gap")].merge(rows[both], on=["island_model", "variant"])
    alone["cost_x"] /= alone["cost_y"]
    found = alone.groupby(["method_x", "quantity_x"], sort=False)["cost_x"].agg(["min", "max"])
    cells = [
        [name, *(tuple(found.loc[name, what]) for what in ("pressure", "area"))] for name in alone["method_x"].unique()
    ]
    lines = [
        [row.theory, row.way, duration(row.cost * seconds), duration(row.once * seconds) if row.once else ""]
        + [percent(getattr(row, name), "%") for name in DEVIATIONS]
        + ["" if row.reached_deep > 0.995 else f"{row.reached_light:.0%}, {row.reached_deep:.0%}"]
        for row in distances.itertuples()
    ]
    kinds = " | ".join(f"{what}, {ends}" for what in ("area", "force") for ends in ("1-10%", "10-97%"))
    return {
        "unit": f"Here the fixed work took {1e6 * seconds:.0f} us, on one core.",
        **{name: ranked(own) for name, own in zip(("islands", "totals"), groups(rows).values(), strict=True)},
        "once": rows_table(once.reset_index()),
        "alone": table("method | pressure alone | area alone", cells, "{} | {:.2f} to {:.2f}"),
        "distances": table(f"theory | method | time per point | time per surface | {kinds} | reached", lines),
    }


def draw(costs: pd.DataFrame) -> Any:
    """Error against cost, of islands and of totals."""
    own, handles = groups(costs), dict[str, Any]()
    for rows in own.values():
        by_nodes = (rows["island_model"] == "exact") & rows["what"].str.startswith("nodes=")
        rows["family"] = rows["method"].where(~by_nodes, rows["method"] + ", by nodes")
    names = pd.concat(own.values())["family"].unique()
    figure, axes = panels(1, 2, (9, 4.8), sharey=True)
    for panel, (title, rows) in zip(axes, own.items(), strict=True):
        for k, name in enumerate(names):
            chosen = rows[rows["family"] == name]
            if len(chosen):
                style: dict[str, Any] = {"color": f"C{k % 10}", "marker": "osD^vP*Xh<>d"[k % 12], "ls": "none", "ms": 5}
                (handles[name],) = panel.loglog(chosen["cost"], chosen["error"], **style)
        front = pareto_front(rows)
        (handles["Pareto front"],) = panel.step(front["cost"], front["error"], "k-", lw=1, where="post", zorder=0)
        panel.set(xlabel="time / fixed piece of work", title=title)
        panel.grid(alpha=0.3)
    axes[0].set_ylabel("largest relative error")
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4, fontsize=8)
    return figure


def draw_distances(rows: pd.DataFrame, seconds: float) -> Any:
    """Deviation against time: area above, force below, light contact left, deep contact right."""
    figure, axes = panels(2, 2, (9, 7.4), sharex=True, sharey=True)
    for panel, name in zip(axes.flat, DEVIATIONS, strict=True):
        for theory, colour in (HUES | {cost_distances.SIMULATED: "C5"}).items():
            marker = next((shape for start, shape in SHAPES.items() if theory.startswith(start)), "*")
            own = rows[rows["theory"] == theory]
            x, y = own["cost"] * seconds, 100 * own[name]
            panel.loglog(x, y, marker, color=colour, ls="none", ms=6, label=theory)
            for way, a, b in zip(own["way"], x, y, strict=True):
                if theory == cost_distances.SIMULATED and way.endswith("cold"):
                    panel.annotate(way.split()[0], (a, b), (4, 3), textcoords="offset points", fontsize=7)
        panel.grid(alpha=0.3)
    for panel, title in zip(axes[0], ("1-10% contact", "10-97% contact"), strict=True):
        panel.set_title(title)
    axes[0, 0].set_ylabel("area at equal force, rms distance [%]")
    axes[1, 0].set_ylabel("force at equal separation, rms distance [%]")
    for panel in axes[1]:
        panel.set(xlabel="processor time a point [s]", xlim=(1e-8, 1e3))
    figure.legend(*axes[0, 0].get_legend_handles_labels(), fontsize="small", loc="outside lower center", ncols=5)
    return figure


def page_of(costs: bytes, distances: bytes) -> Measured:
    """The measured blocks and the figures from the content of both files, rounded as it is there."""
    rows, others = read(costs), pd.read_csv(io.BytesIO(distances), comment="#")
    seconds = rows["cost"][rows["island_model"] == UNIT].iloc[0]
    figures = {"cost": draw(rows), "distance": draw_distances(others, seconds)}
    return parts_of(rows, others), {f"docs/figures/{name}.svg": figure for name, figure in figures.items()}


def measure() -> Measured:
    """The measured blocks of the page, and its files."""
    files = {"tables/cost.csv": study()}
    files["tables/distance.csv"] = to_csv(cost_distances.HEAD, pd.DataFrame(cost_distances.study()), "%.4g")
    parts, figures = page_of(*files.values())
    return parts, figures | files
