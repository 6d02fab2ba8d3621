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
from generate.pages import cost_distances
from generate.pages.cost_islands import island_rows
from generate.pages.cost_totals import total_rows
from generate.pages.page import Measured, panels, svg, table, to_csv
from mbma_tables.scenes.costs import UNIT, Costs, Distance, Row, read_costs, read_distances
from mbma_tables.theories import THEORIES

METHODS = {"classical": "classical iteration", "exact": "Newton (exact)"}
LIBRARIES = ("numpy", "scipy")
SHOWN_RTOLS = ("1e-02", "1e-05", "1e-08")
HEAD = """\
# What accuracy costs, measured by python -m generate pages cost; docs/cost.md says how. Costs are times over that of a
# fixed piece of work in the same run; the row of island model unit has its seconds.
"""


def study() -> bytes:
    """Every measurement, in a few minutes, as tables/cost.csv."""
    seconds = [timing.measure(lambda: None)[1]]
    rows = island_rows()
    seconds.append(timing.measure(lambda: None)[1])
    rows += total_rows()
    # the least: other processes can only add
    unit = min(*seconds, timing.measure(lambda: None)[1])
    facts = {"machine": platform.machine()} | {name: metadata.version(name) for name in LIBRARIES}
    head = f"{HEAD}# {json.dumps(facts | {'python': platform.python_version()})}\n"
    lines = (
        [*row[:3], *("" if x is None else f"{x:.4g}" for x in row[3:])]
        for row in (Row(UNIT, "seconds", "both", None, unit), *rows)
    )
    return to_csv(head, Row._fields, lines)


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
    islands = [row for row in known if row.what.startswith(("island", "nodes=", "rings="))]
    gaps = [row for row in known if row.quantity == "both" and row.what == "gap"]
    # a law's errors go with the price of evaluating it
    lookup = costs.of("law", "lookup") / costs.seconds
    laws = [row for row in known if row.island_model == "universal" and row.what == "law"]
    gaps += [Row("law", row.variant.replace("law", "lookup"), "both", row.error, lookup, 0) for row in laws]
    return {"one island": islands, "one gap of a surface": gaps}


def method(row: Row) -> str:
    """What a row is called on the page."""
    return METHODS.get(row.island_model, row.island_model)


def family(row: Row) -> str:
    """The series that a point of the figure belongs to."""
    return f"{method(row)}, by nodes" if row.island_model == "exact" and row.what.startswith("nodes=") else method(row)


def rows_table(rows: Iterable[Row], front: Sequence[Row] = ()) -> str:
    """Rows with their errors, costs and counts; those of the front are marked."""
    cells = []
    for row in rows:
        error = "" if row.error is None else f"{row.error:.1e}"
        numbers = ["" if x is None else f"{x:.3g}" for x in (row.cost, row.evaluations)]
        cells.append([method(row), row.variant, error, *numbers, "front" if row in front else ""])
    return table(["method", "variant", "largest error", "cost", "evaluations", ""], cells)


def ranked(rows: Sequence[Row]) -> str:
    """Decades that rows span, and a table of the front and a few tolerances; the file has all."""
    pairs = [[getattr(row, name) for row in rows] for name in ("cost", "error")]
    time, error = (math.log10(max(values) / min(values)) for values in pairs)
    front = pareto_front(rows)
    shown = [row for row in rows if row in front or "rtol=" not in row.variant or row.variant[-5:] in SHOWN_RTOLS]
    return f"They span {time:.1f} decades of time and {error:.1f} of error.\n\n{rows_table(shown, front)}"


def single_table(costs: Costs) -> str:
    """Time of force or area alone over that of both, by island model, over all tolerances."""
    both = {(row.island_model, row.variant): row.cost for row in costs.rows if row.quantity == "both"}
    ratios: dict[str, dict[str, list[float]]] = {}
    for row in costs.rows:
        if row.quantity != "both" and row.what == "gap":
            of_island_model = ratios.setdefault(method(row), {"pressure": [], "area": []})
            of_island_model[row.quantity].append(row.cost / both[row.island_model, row.variant])
    cells = [
        [island_model, *(f"{min(own):.2f} to {max(own):.2f}" for own in found.values())]
        for island_model, found in ratios.items()
    ]
    return table(["method", "pressure alone", "area alone"], cells)


def parts_of(costs: Costs, distances: Sequence[Distance]) -> dict[str, str]:
    """The measured blocks of the page."""
    names = ("import", "call", "law", "profile", "lookup", "invert")
    # of several tolerances the tightest, which is listed last
    once = {
        (row.island_model, row.what): row
        for row in costs.rows
        if (row.what in names and row.quantity == "both") or row.what == "invert" or row.island_model in THEORIES
    }
    return {
        "unit": f"Here the fixed work took {1e6 * costs.seconds:.0f} us, on one core.",
        **{name: ranked(rows) for name, rows in zip(("islands", "totals"), groups(costs).values(), strict=True)},
        "once": rows_table(list(once.values())),
        "alone": single_table(costs),
        "distances": cost_distances.to_table(distances, costs.seconds),
    }


def draw(costs: Costs) -> bytes:
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
    return svg(figure)


def measure() -> Measured:
    """The measured blocks of the page, and its files."""
    data = {"cost.csv": study(), "distance.csv": cost_distances.file_of(cost_distances.study())}
    # the page shows what the files hold, rounded as it is there
    with tempfile.TemporaryDirectory() as folder:
        paths = {name: pathlib.Path(folder, name) for name in data}
        for name, path in paths.items():
            path.write_bytes(data[name])
        costs, distances = read_costs(paths["cost.csv"]), read_distances(paths["distance.csv"])
    files = {f"tables/{name}": content for name, content in data.items()}
    figures = {"cost": draw(costs), "distance": cost_distances.draw(distances, costs.seconds)}
    return parts_of(costs, distances), files | {f"docs/figures/{name}.svg": drawn for name, drawn in figures.items()}
