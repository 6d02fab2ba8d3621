"""docs/cost.md, its figure and the README's table, from measured costs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from generate.pages.page import png, table
from mbma_tables.scenes.costs import GAPS, HELD_OUT, Costs, Row, pareto_front

BRUTE_FORCE = "boundary_elements"
METHODS = {"classical": "classical iteration", "exact": "Newton (exact)"}
# F_5/2 and F_2 of an island, one quantity alone and both; the exact tier solves for both at once
HEIGHT_INTEGRALS = {"universal": (1, 2), "rigid": (1, 2), "island4d": (2, 2)}
CAPTION = (
    "Largest relative error on held-out islands (left) and surfaces (right) against time, in units of the fixed work. "
    "Black line: the Pareto front, what nothing beats in both. Grey: boundary elements, on others' machine."
)
RERUN = "    python -m generate cost"


def is_island(row: Row) -> bool:
    """Whether the cost is that of one island, with an error to go with it."""
    return row.error is not None and row.what.startswith(("island", "nodes=", "rings="))


def totals_of(costs: Costs) -> list[Row]:
    """Rows of one gap; a law's errors go with the price of a lookup in it."""
    rows = [
        row
        for row in costs.measured
        if row.quantity == "both" and row.error is not None and row.what.startswith(("gap", "order="))
    ]
    lookup = costs.units("law", "lookup")
    laws = [row for row in costs.measured if row.tier == "universal" and row.what == "law"]
    return rows + [Row("law", row.variant.replace("law", "lookup"), "both", row.error, lookup, 0) for row in laws]


def family(row: Row) -> str:
    """The series that a point belongs to."""
    scheme = next((word for word in ("linear", "cubic", "nodes=", "order=") if word in row.what), "")
    name = METHODS.get(row.tier, row.tier)
    if row.tier == "exact" and scheme:
        return f"{name}, by nodes"
    if row.tier == "universal" and scheme == "order=":
        return "universal, fixed orders"
    if row.tier == "island4d" and is_island(row):
        return f"{name}, {'linear' if scheme == 'linear' else 'cubic'}"
    return name


def front_of(rows: Sequence[Row]) -> list[Row]:
    """The Pareto front, cheapest first."""
    chosen = pareto_front([row.cost for row in rows], [row.error or 0.0 for row in rows])
    return [rows[k] for k in chosen]


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
    """Decades between the least and the largest cost and error."""
    costs, errors = ([getattr(row, name) for row in rows] for name in ("cost", "error"))
    time, error = (math.log10(max(v) / min(v)) for v in (costs, errors))
    return f"{time:.1f} decades of time, {error:.1f} of error"


def single_table(costs: Costs) -> str:
    """Force or area alone against both, by tier and tolerance; empty where it was not measured."""
    both = {(row.tier, row.variant): row for row in costs.measured if row.quantity == "both"}
    cells = []
    for row in costs.measured:
        beside = both.get((row.tier, row.variant))
        if row.quantity == "both" or row.what != "gap" or beside is None:
            continue
        counts = [number(r.evaluations) for r in (row, beside)]
        counts += [
            number(r.evaluations * k) if r.evaluations and k else ""
            for r, k in zip((row, beside), HEIGHT_INTEGRALS.get(row.tier, (0, 0)), strict=True)
        ]
        cells.append([row.tier, row.variant, row.quantity, f"{row.cost / beside.cost:.2f}", *counts])
    if not cells:
        return ""
    header = ["tier", "asked", "alone", "time over that of both", "islands a gap", "for both"]
    return table([*header, "height integrals a gap", "for both"], cells)


def readme_table(costs: Costs) -> str:
    """The front of totals and the dearest baseline, for the README."""
    totals, islands = totals_of(costs), [row for row in costs.measured if is_island(row)]
    cells = []
    for what, rows in (("a gap", totals), ("an island", islands)):
        for row in front_of(rows):
            cost = f"{1e6 * row.cost * costs.seconds:.3g} us"
            cells.append(
                [what, METHODS.get(row.tier, row.tier), row.variant, f"{row.error:.0e}", number(row.cost), cost]
            )
    classical = [row for row in islands if row.tier == "classical"]
    for row in sorted(classical, key=lambda row: row.error or 0.0)[:1]:
        spent = f"{1e6 * row.cost * costs.seconds:.3g} us"
        cells.append(["an island", METHODS[row.tier], row.variant, f"{row.error:.0e}", number(row.cost), spent])
    return table(["of", "what", "asked", "largest error", "cost", "that is"], cells)


def page(costs: Costs) -> str:
    """The whole page."""
    islands = [row for row in costs.measured if is_island(row)]
    totals = totals_of(costs)
    once = [
        row
        for row in costs.measured
        if row.what in ("import", "open", "call", "law", "profile", "lookup", "invert")
        or row.tier in ("greenwood_williamson", "persson")
    ]
    others = [row for row in costs.measured if row.tier == BRUTE_FORCE]
    alone = single_table(costs)
    parts = [
        "# What accuracy costs",
        "Everything here that can answer, its error and its time. Made by",
        RERUN,
        "which writes this page, its figure and `tables/cost.csv`, in a few minutes. The data ship with the library; "
        "`mbma cost` prints them, and `mbma cost --calibrate` times the fixed work and each tier on the machine "
        "at hand and keeps the factors for the planner.",
        "A cost is a time over that of one fixed piece of work in the same run: the sum of scipy's `erfcx` at 32768 "
        f"points between -5 and 5, {1e6 * costs.seconds:.0f} us where this page was made, on one core. The two are "
        "timed in turns, and the median ratio is taken.",
        "An error is the largest relative error of force and area against the exact tier on twice its nodes, over "
        f"islands and over {len(HELD_OUT)} surfaces that made no table and no formula. The classical iteration is "
        "measured on some of the islands only, Newton on more; its meshes are made beforehand and not timed.",
        f"![{CAPTION}](figures/cost.png)",
        CAPTION,
        "## Islands",
        f"Over all of them {spans(islands)}. Evaluations are of the height integrals: F_3/2, for pressures, where an "
        "island is solved; F_5/2 and F_2 where it is looked up.",
        rows_table(islands, front_of(islands)),
        "## Totals",
        f"One of {GAPS} gaps of a surface, from -h_max/2 to h_max, in one call; evaluations are islands a gap. "
        f"Over all of them {spans(totals)}. `order=n` is Gauss-Legendre with n nodes between two kinks and no estimate "
        "of its error, on the library's own integrand, in place of the adaptive rule. A lookup is in a law that was "
        "made at that tolerance; making it is in the next table.",
        rows_table(totals, front_of(totals)),
        "## Once a process, a table, a call, a surface",
        "`import`: first use in a new process after `import mbma_tables, numpy`, compiled code in its cache. `open`: a "
        "table opened and checked in a warm one. `call`: what a call costs besides its gaps. `law`: making a law.",
        rows_table(once),
        "## Force only",
        '`contact(..., quantities=("force",))` beside the same call for both. The solver finds force and area in one '
        "solution, and the four-parameter table looks both up, so that there one alone saves little.",
        alone or "Force alone was not measured: `contact` has no keyword for it, so that it costs what both do.",
        "## Brute force",
        "Boundary elements (512 x 512 grid, one load, one surface; the data of [fidelity](fidelity.md)): seconds on "
        "the machine of those who ran them, over this machine's fixed work, so good for an order of magnitude only. "
        "Their error against this model means nothing: the model has its own against them.",
        rows_table(others),
    ]
    return "\n\n".join(parts) + "\n"


def draw(costs: Costs) -> bytes:
    """The figure: error against cost, islands and totals, as a PNG file."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    islands = [row for row in costs.measured if is_island(row)]
    totals = totals_of(costs)
    names = list(dict.fromkeys(map(family, [*islands, *totals])))
    styles: dict[str, Any] = {
        name: {"color": f"C{k % 10}", "marker": "osD^vP*Xh<>d"[k % 12]} for k, name in enumerate(names)
    }
    figure, panels = plt.subplots(1, 2, figsize=(9, 4.8), dpi=100, layout="constrained", sharey=True)
    handles: dict[str, Any] = {}
    for panel, rows, title in zip(panels, (islands, totals), ("one island", "one gap of a surface"), strict=True):
        for name in names:
            own = sorted((row for row in rows if family(row) == name), key=lambda row: row.cost)
            if own:
                (handles[name],) = panel.loglog(
                    [r.cost for r in own], [r.error for r in own], ls="none", ms=5, label=name, **styles[name]
                )
        front = front_of(rows)
        (handles["Pareto front"],) = panel.step(
            [row.cost for row in front], [row.error for row in front], "k-", lw=1, where="post", zorder=0
        )
        panel.set(xlabel="time / fixed piece of work", title=title)
        panel.grid(alpha=0.3)
    panels[0].set_ylabel("largest relative error")
    others = np.array([row.cost for row in costs.measured if row.tier == BRUTE_FORCE])
    if others.size:
        panels[1].axvspan(others.min(), others.max(), color="0.85", zorder=0)
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4, fontsize=8)
    return png(figure)
