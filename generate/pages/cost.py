"""docs/cost.md: what accuracy costs, every time a ratio to one fixed piece of work; its data and figures."""

from __future__ import annotations

import json
import math
import pathlib
import platform
import tempfile
from collections.abc import Iterable, Sequence
from importlib import metadata
from typing import Any

from generate import timing
from generate.pages import cost_distances, cost_rows
from generate.pages.distances import HUES
from generate.pages.page import Measured, duration, panels, percent, table, to_csv
from mbma_tables.scenes.costs import UNIT, Costs, Distance, Row, read_costs, read_distances
from mbma_tables.theories import THEORIES

METHODS = {"classical": "classical iteration", "exact": "Newton (exact)"}
ONCE = ("import", "call", "law", "profile", "lookup", "invert")
SHOWN_RTOLS = ("1e-02", "1e-05", "1e-08")
HEAD = """\
# What accuracy costs, measured by python -m generate pages cost; docs/cost.md says how. Costs are times over that of a
# fixed piece of work in the same run; the row of island model unit has its seconds.
"""
SHAPES = {"MBMA": "o", "calibrated": "s", "Persson": "^", "G-W": "v"}


def study() -> bytes:
    """Every measurement of tables/cost.csv, in a few minutes."""
    seconds, rows = [timing.measure(lambda: None)[1]], list[Row]()
    for part in (cost_rows.island_rows, cost_rows.total_rows):
        rows += part()
        seconds.append(timing.measure(lambda: None)[1])
    facts = {"machine": platform.machine()} | {name: metadata.version(name) for name in ("numpy", "scipy")}
    head = f"{HEAD}# {json.dumps(facts | {'python': platform.python_version()})}\n"
    # the least: other processes can only add
    return records(head, [Row(UNIT, "seconds", "both", None, min(seconds)), *rows])


def records(head: str, rows: Sequence[Any]) -> bytes:
    """Named tuples as a CSV file."""
    cells = (["" if v is None else v if isinstance(v, str) else f"{v:.4g}" for v in row] for row in rows)
    return to_csv(head, rows[0]._fields, cells)


def pareto_front(rows: Sequence[Row]) -> list[Row]:
    """The rows that none is better than in both cost and error, cheapest first."""
    front: list[Row] = []
    for row in sorted(rows, key=lambda row: (row.cost, row.error or 0.0)):
        if not front or (row.error or 0.0) < (front[-1].error or 0.0):
            front.append(row)
    return front


def groups(costs: Costs) -> dict[str, list[Row]]:
    """Rows of one island and of one gap, with an error to go with the cost."""
    known = [row for row in costs.rows if row.error is not None]
    own = [row for row in known if row.what.startswith(("island", "nodes=", "rings="))]
    gaps = [row for row in known if row.quantity == "both" and row.what == "gap"]
    # a law's errors go with the price of evaluating it
    lookup = costs.of("law", "lookup") / costs.seconds
    laws = [row for row in known if row.island_model == "universal" and row.what == "law"]
    gaps += [Row("law", row.variant.replace("law", "lookup"), "both", row.error, lookup, 0) for row in laws]
    return {"one island": own, "one gap of a surface": gaps}


def method(row: Row) -> str:
    """What a row is called on the page."""
    return METHODS.get(row.island_model, row.island_model)


def family(row: Row) -> str:
    """The series that a point of the figure belongs to."""
    return f"{method(row)}, by nodes" if row.island_model == "exact" and row.what.startswith("nodes=") else method(row)


def rows_table(rows: Iterable[Row], front: Sequence[Row] = ()) -> str:
    """Rows with their errors, costs and counts; those of the front are marked."""
    cells = (
        [method(row), row.variant, row.error, row.cost, row.evaluations, "front" if row in front else ""]
        for row in rows
    )
    return table("method | variant | largest error | cost | evaluations | ", cells, "{} | {} | {:.1e} | {:.3g}")


def ranked(rows: Sequence[Row]) -> str:
    """Decades that rows span, and a table of the front and a few tolerances; the file has all."""
    pairs = [[getattr(row, name) for row in rows] for name in ("cost", "error")]
    time, error = (math.log10(max(values) / min(values)) for values in pairs)
    front = pareto_front(rows)
    shown = [row for row in rows if row in front or "rtol=" not in row.variant or row.variant[-5:] in SHOWN_RTOLS]
    return f"They span {time:.1f} decades of time and {error:.1f} of error.\n\n{rows_table(shown, front)}"


def alone(costs: Costs) -> str:
    """Time of force or area alone over that of both, by island model, over all tolerances."""
    both = {(row.island_model, row.variant): row.cost for row in costs.rows if row.quantity == "both"}
    ratios: dict[str, dict[str, list[float]]] = {}
    for row in costs.rows:
        if row.quantity != "both" and row.what == "gap":
            own = ratios.setdefault(method(row), {"pressure": [], "area": []})
            own[row.quantity].append(row.cost / both[row.island_model, row.variant])
    cells = ([name, *((min(own), max(own)) for own in found.values())] for name, found in ratios.items())
    return table("method | pressure alone | area alone", cells, "{} | {:.2f} to {:.2f}")


def deviations(rows: Iterable[Distance], seconds: float) -> str:
    """Deviations from boundary elements, and times."""
    lines = [
        [row.theory, row.way, duration(row.cost * seconds), duration(row.once * seconds) if row.once else ""]
        + [percent(v, "%") for v in (row.area_light, row.area_deep, row.force_light, row.force_deep)]
        + ["" if row.reached_deep > 0.995 else f"{row.reached_light:.0%}, {row.reached_deep:.0%}"]
        for row in rows
    ]
    kinds = " | ".join(f"{what}, {ends}" for what in ("area", "force") for ends in ("1-10%", "10-97%"))
    return table(f"theory | method | time per point | time per surface | {kinds} | reached", lines)


def parts_of(costs: Costs, distances: Sequence[Distance]) -> dict[str, str]:
    """The measured blocks of the page."""
    # of several tolerances the tightest, which is listed last
    once = {
        (row.island_model, row.what): row
        for row in costs.rows
        if (row.what in ONCE and row.quantity == "both") or row.what == "invert" or row.island_model in THEORIES
    }
    return {
        "unit": f"Here the fixed work took {1e6 * costs.seconds:.0f} us, on one core.",
        **{name: ranked(rows) for name, rows in zip(("islands", "totals"), groups(costs).values(), strict=True)},
        "once": rows_table(once.values()),
        "alone": alone(costs),
        "distances": deviations(distances, costs.seconds),
    }


def draw(costs: Costs) -> Any:
    """Error against cost, of islands and of totals."""
    own = groups(costs)
    names = list(dict.fromkeys(family(row) for rows in own.values() for row in rows))
    handles: dict[str, Any] = {}
    figure, axes = panels(1, 2, (9, 4.8), sharey=True)
    for panel, (title, rows) in zip(axes, own.items(), strict=True):
        for k, name in enumerate(names):
            chosen = [row for row in rows if family(row) == name]
            if chosen:
                x, y = [row.cost for row in chosen], [row.error for row in chosen]
                style: dict[str, Any] = {"color": f"C{k % 10}", "marker": "osD^vP*Xh<>d"[k % 12], "ls": "none", "ms": 5}
                (handles[name],) = panel.loglog(x, y, **style)
        front = pareto_front(rows)
        x, y = [row.cost for row in front], [row.error for row in front]
        (handles["Pareto front"],) = panel.step(x, y, "k-", lw=1, where="post", zorder=0)
        panel.set(xlabel="time / fixed piece of work", title=title)
        panel.grid(alpha=0.3)
    axes[0].set_ylabel("largest relative error")
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4, fontsize=8)
    return figure


def draw_distances(rows: Sequence[Distance], seconds: float) -> Any:
    """Deviation against time: area above, force below, light contact left, deep contact right."""
    figure, axes = panels(2, 2, (9, 7.4), sharex=True, sharey=True)
    names = ("area_light", "area_deep", "force_light", "force_deep")
    for panel, name in zip(axes.flat, names, strict=True):
        for theory, colour in (HUES | {cost_distances.SIMULATED: "C5"}).items():
            marker = next((shape for start, shape in SHAPES.items() if theory.startswith(start)), "*")
            own = [row for row in rows if row.theory == theory]
            x, y = [row.cost * seconds for row in own], [100 * getattr(row, name) for row in own]
            panel.loglog(x, y, marker, color=colour, ls="none", ms=6, label=theory)
            for row, a, b in zip(own, x, y, strict=True):
                if theory == cost_distances.SIMULATED and row.way.endswith("cold"):
                    panel.annotate(row.way.split()[0], (a, b), (4, 3), textcoords="offset points", fontsize=7)
        panel.grid(alpha=0.3)
    for panel, title in zip(axes[0], ("1-10% contact", "10-97% contact"), strict=True):
        panel.set_title(title)
    axes[0, 0].set_ylabel("area at equal force, rms distance [%]")
    axes[1, 0].set_ylabel("force at equal separation, rms distance [%]")
    for panel in axes[1]:
        panel.set(xlabel="processor time a point [s]", xlim=(1e-8, 1e3))
    figure.legend(*axes[0, 0].get_legend_handles_labels(), fontsize="small", loc="outside lower center", ncols=5)
    return figure


def measure() -> Measured:
    """The measured blocks of the page, and its files."""
    data = {"cost.csv": study(), "distance.csv": records(cost_distances.HEAD, cost_distances.study())}
    # the page shows what the files hold, rounded as it is there
    with tempfile.TemporaryDirectory() as folder:
        for name, content in data.items():
            pathlib.Path(folder, name).write_bytes(content)
        costs = read_costs(pathlib.Path(folder, "cost.csv"))
        distances = read_distances(pathlib.Path(folder, "distance.csv"))
    figures = {"cost": draw(costs), "distance": draw_distances(distances, costs.seconds)}
    files = {f"docs/figures/{name}.svg": figure for name, figure in figures.items()}
    return parts_of(costs, distances), files | {f"tables/{name}": content for name, content in data.items()}
