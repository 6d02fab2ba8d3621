"""What accuracy costs: docs/cost.md, its data and figures, every time a ratio to one fixed piece of work."""

from __future__ import annotations

import csv
import io
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
from generate.pages.page import svg, table
from mbma_tables.scenes.costs import UNIT, Costs, Distance, Row, read_costs, read_distances
from mbma_tables.theories import THEORIES

METHODS = {"classical": "classical iteration", "exact": "Newton (exact)"}
LIBRARIES = ("numpy", "scipy")
SHOWN_RTOLS = ("1e-02", "1e-05", "1e-08")
HEAD = """\
# What accuracy costs, measured by python -m generate pages cost; docs/cost.md says how. Costs are times over that of a
# fixed piece of work in the same run; the row of tier unit has its seconds.
"""


def to_csv(rows: Sequence[Row]) -> str:
    """The rows as text."""
    versions = {name: metadata.version(name) for name in LIBRARIES} | {"python": platform.python_version()}
    text = io.StringIO()
    text.write(HEAD)
    text.write(f"# {json.dumps({'machine': platform.machine()} | versions)}\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(Row._fields)
    for row in rows:
        numbers = ("" if number is None else f"{number:.4g}" for number in (row.error, row.cost, row.evaluations))
        writer.writerow((row.tier, row.variant, row.quantity, *numbers))
    return text.getvalue()


def study() -> list[Row]:
    """Every measurement, in a few minutes."""
    seconds = [timing.measure(lambda: None)[1]]
    rows = island_rows()
    seconds.append(timing.measure(lambda: None)[1])
    rows += total_rows()
    # the least: what else the machine does can only add
    unit = min(*seconds, timing.measure(lambda: None)[1])
    return [Row(UNIT, "seconds", "both", None, unit), *rows]


def pareto_front(rows: Sequence[Row]) -> list[Row]:
    """The rows that none is better than in both cost and error, cheapest first."""
    front: list[Row] = []
    for row in sorted(rows, key=lambda row: (row.cost, row.error or 0.0)):
        if not front or (row.error or 0.0) < (front[-1].error or 0.0):
            front.append(row)
    return front


def islands_of(costs: Costs) -> list[Row]:
    """Rows of one island, with an error to go with the cost."""
    return [row for row in costs.rows if row.error is not None and row.what.startswith(("island", "nodes=", "rings="))]


def totals_of(costs: Costs) -> list[Row]:
    """Rows of one gap; a law's errors go with the price of evaluating it."""
    rows = [row for row in costs.rows if row.quantity == "both" and row.what == "gap" and row.error is not None]
    lookup = costs.of("law", "lookup") / costs.seconds
    laws = [row for row in costs.rows if row.tier == "universal" and row.what == "law"]
    return rows + [Row("law", row.variant.replace("law", "lookup"), "both", row.error, lookup, 0) for row in laws]


def family(row: Row) -> str:
    """The series that a point belongs to."""
    name = METHODS.get(row.tier, row.tier)
    return f"{name}, by nodes" if row.tier == "exact" and row.what.startswith("nodes=") else name


def number(value: float | None) -> str:
    """A number of a table."""
    return "" if value is None else f"{value:.3g}"


def rows_table(rows: Iterable[Row], front: Sequence[Row] = ()) -> str:
    """Rows with their errors, costs and counts; those of the front are marked."""
    cells = [
        [
            METHODS.get(row.tier, row.tier),
            row.variant,
            "" if row.error is None else f"{row.error:.1e}",
            number(row.cost),
            number(row.evaluations),
            "front" if row in front else "",
        ]
        for row in rows
    ]
    return table(["what", "asked", "largest error", "cost", "evaluations", ""], cells)


def spans(rows: Sequence[Row]) -> str:
    """Decades between the smallest and the largest cost and error."""
    costs, errors = ([getattr(row, name) for row in rows] for name in ("cost", "error"))
    time, error = (math.log10(max(v) / min(v)) for v in (costs, errors))
    return f"{time:.1f} decades of time and {error:.1f} of error"


def shown(rows: Sequence[Row], front: Sequence[Row]) -> list[Row]:
    """What the page shows of many tolerances: a few of them, and the front; the file has all."""
    return [row for row in rows if row in front or "rtol=" not in row.variant or row.variant[-5:] in SHOWN_RTOLS]


def single_table(costs: Costs) -> str:
    """Time of force or area alone over that of both, by tier, over all tolerances."""
    both = {(row.tier, row.variant): row.cost for row in costs.rows if row.quantity == "both"}
    ratios: dict[str, dict[str, list[float]]] = {}
    for row in costs.rows:
        if row.quantity != "both" and row.what == "gap":
            of_tier = ratios.setdefault(METHODS.get(row.tier, row.tier), {"force": [], "area": []})
            of_tier[row.quantity].append(row.cost / both[row.tier, row.variant])
    cells = [[tier, *(f"{min(own):.2f} to {max(own):.2f}" for own in found.values())] for tier, found in ratios.items()]
    return table(["what", "force alone", "area alone"], cells)


def parts_of(costs: Costs, distances: Sequence[Distance]) -> dict[str, str]:
    """The measured parts of the page."""
    islands, totals = islands_of(costs), totals_of(costs)
    names = ("import", "call", "law", "profile", "lookup", "invert")
    # of several tolerances the tightest, which stands last
    once = {
        (row.tier, row.what): row
        for row in costs.rows
        if (row.what in names and row.quantity == "both") or row.what == "invert" or row.tier in THEORIES
    }
    fronts = [pareto_front(rows) for rows in (islands, totals)]
    return {
        "unit": f"Here the fixed work took {1e6 * costs.seconds:.0f} us, on one core.",
        "islands": f"They span {spans(islands)}.\n\n{rows_table(shown(islands, fronts[0]), fronts[0])}",
        "totals": f"They span {spans(totals)}.\n\n{rows_table(shown(totals, fronts[1]), fronts[1])}",
        "once": rows_table(list(once.values())),
        "alone": single_table(costs),
        "distances": cost_distances.to_table(distances, costs.seconds),
    }


def draw(costs: Costs) -> bytes:
    """The figure: error against cost, islands and totals, as an SVG file."""
    from matplotlib.figure import Figure

    groups = {"one island": islands_of(costs), "one gap of a surface": totals_of(costs)}
    names = list(dict.fromkeys(family(row) for rows in groups.values() for row in rows))
    styles: dict[str, Any] = {
        name: {"color": f"C{k % 10}", "marker": "osD^vP*Xh<>d"[k % 12]} for k, name in enumerate(names)
    }
    figure = Figure(figsize=(9, 4.8), dpi=100, layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    handles: dict[str, Any] = {}
    for panel, (title, rows) in zip(panels, groups.items(), strict=True):
        for name in names:
            chosen = [row for row in rows if family(row) == name]
            if chosen:
                x, y = [row.cost for row in chosen], [row.error for row in chosen]
                (handles[name],) = panel.loglog(x, y, ls="none", ms=5, **styles[name])
        front = pareto_front(rows)
        x, y = [row.cost for row in front], [row.error for row in front]
        (handles["Pareto front"],) = panel.step(x, y, "k-", lw=1, where="post", zorder=0)
        panel.set(xlabel="time / fixed piece of work", title=title)
        panel.grid(alpha=0.3)
    panels[0].set_ylabel("largest relative error")
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4, fontsize=8)
    return svg(figure)


def measure() -> tuple[dict[str, str], dict[str, bytes]]:
    """The measured parts of the page, and its files."""
    data = {"cost.csv": to_csv(study()).encode()}
    data["distance.csv"] = cost_distances.to_csv(cost_distances.study()).encode()
    # the page shows what the files hold, rounded as it is there
    with tempfile.TemporaryDirectory() as folder:
        for name, content in data.items():
            (pathlib.Path(folder) / name).write_bytes(content)
        costs = read_costs(pathlib.Path(folder) / "cost.csv")
        distances = read_distances(pathlib.Path(folder) / "distance.csv")
    files = {f"tables/{name}": content for name, content in data.items()}
    files |= {"docs/figures/cost.svg": draw(costs)}
    files |= {"docs/figures/distance.svg": cost_distances.draw(distances, costs.seconds)}
    return parts_of(costs, distances), files
