"""Measured parts of README.md and of pages on the library itself: architecture, tables, theories, closed forms."""

import ast
import collections
import dataclasses
import itertools
import math
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import sympy
from matplotlib.colors import LogNorm

from benchmarks.import_circles import import_graph
from generate.boundary_elements.evidence import evidence
from generate.distances import pocket_errors
from generate.files import ROOT
from generate.page import Measured, duration, panels, table
from mbma_tables import Surface, contact
from mbma_tables.common.netcdf import read_table
from mbma_tables.common.plots import draw_compression, theory_label
from mbma_tables.common.table_schema import (
    CELL_EDGES,
    ISLAND4D,
    KINDS,
    UNIVERSAL,
    TableContent,
)
from mbma_tables.scenes.plan import shipped_costs, shipped_distances
from mbma_tables.theories import THEORIES
from mbma_tables.theories.mbma.closed_form_certificates import CERTIFICATES, RANGES
from mbma_tables.theories.mbma.closed_forms import FUNCTIONS, Function
from mbma_tables.theories.mbma.tables import shipped

BOX = {"boxstyle": "square,pad=0.4", "facecolor": "#e8eef7", "edgecolor": "#4a6fa5"}
RIGHT, SHARED = (
    0.83,
    {"common", "core"},
)  # edge of the boxes; what every room uses: no arrows
SHOWN = (
    "self_affine",
    0.7,
    24.0,
    5,
    0.0,
)  # a held-out spectrum: kind, H, zeta_1, wavelengths a side, shape
LOADS = np.geomspace(1e-4, 0.6, 60)  # F/(A0 E* g), g the rms gradient
ROWS = {
    ("calibrated", "law"): '`"calibrated"`: fitted to boundary-element (BEM) simulations',
    ("calibrated, map", "map of 256 x 256"): '`"calibrated"`, from a measured map',
    ("Persson", "law"): '`"persson"`: no fitted constants',
    ("MBMA reported", "law"): '`"mbma"`: the paper\'s model',
    ("boundary elements", "256 x 256, cold"): "for comparison: BEM on 256 x 256 points",
}
PRESSURES = (1e-4, 1e-3, 1e-2)  # over E*
LATEX = {
    "hurst": "H",
    "phi_F": r"\Phi_F",
    "phi_A": r"\Phi_A",
    "log_total": r"\ln T",
    "d_over_h_rms": r"\tilde d",
    "h_max_over_h_rms": r"\tilde h",
    **{name: rf"\mathrm{{{name}}}" for name in ("near", "far", "pressure", "area")},
}


def rooms() -> tuple[dict[str, set[str]], dict[str, str]]:
    """What each folder, or module at the top, imports of the others, and what is written in its box."""
    graph: dict[str, set[str]] = collections.defaultdict(set)
    lines, titles = collections.Counter[str](), {}
    imports, files = import_graph(ROOT / "mbma_tables")
    for name, others in imports.items():
        room = name.split(".")[1]
        text = files[name].read_text(encoding="utf-8")
        lines[room] += len(text.splitlines())
        graph[room] |= {other.split(".")[1] for other in others} - {room}
        if name.count(".") == 1:
            titles[room] = (
                (ast.get_docstring(ast.parse(text)) or "")
                .split("\n")[0]
                .rstrip(".")
                .replace("`", "")
            )
    del graph["__main__"]
    lines["core"] += sum(
        len(path.read_text().splitlines())
        for path in (ROOT / "mbma_tables/core").glob("*.[ch]")
    )
    return graph, {
        room: f"{room:<11}{titles[room]:<72}{lines[room]:>6,}" for room in graph
    }


def architecture() -> Measured:
    """The rooms as boxes, with arrows to those that are imported, less those that follow from others."""
    graph, texts = rooms()
    below = {room: set(others) for room, others in graph.items()}
    for middle, room in itertools.product(graph, graph):
        if middle in below[room]:
            below[room] |= below[middle]
    order = sorted(graph, key=lambda room: (len(below[room]), room))
    figure, axes = panels(1, 1, (7.4, 7.2))
    axes.set(xlim=(0, 1), ylim=(-0.6, len(order) - 0.4), position=(0, 0, 1, 1))
    axes.axis("off")
    for y, room in enumerate(order):
        axes.text(
            0.01, y, texts[room], va="center", family="monospace", fontsize=8, bbox=BOX
        )
        direct = (
            graph[room] - set().union(*(below[other] for other in graph[room])) - SHARED
        )
        for down in map(order.index, sorted(direct)):
            style = {
                "arrowstyle": "-|>",
                "color": "#555555",
                "connectionstyle": f"arc3,rad={-0.15 - 0.4 / (y - down)}",
            }
            axes.annotate("", (RIGHT, down + 0.12), (RIGHT, y - 0.12), arrowprops=style)
    return {}, {"docs/figures/architecture.svg": figure}


def tables() -> Measured:
    contents, sizes, axes = (
        {kind: read_table(shipped(kind), kind) for kind in KINDS},
        [],
        [],
    )
    for (kind, content), f in itertools.product(contents.items(), "FA"):
        names = (
            f"largest_error_{f}",
            f"p99_error_{f}",
            f"median_error_{f}",
            f"visited_largest_error_{f}",
        )
        size = shipped(kind).stat().st_size / 1e6
        sizes.append(
            [kind, content.size, size, f, *(content.attributes[name] for name in names)]
        )
    for axis in contents[ISLAND4D].axes:
        shifted = f"{axis.name} + {axis.offset:g}" if axis.offset else axis.name
        t = f"log({shifted})" if axis.transform == "log" else shifted
        axes.append([axis.name, axis.long_name, t, axis.low, axis.high, axis.nodes])
    header = "table | cells or nodes | file | of | largest error | 99% below | half below | largest at islands"
    parts = {"sizes": table(header, sizes, "{} | {} | {:.2f} MB | {} | {:.1e}")}
    parts["axes"] = table(
        "axis | what it is | equally spaced in | first | last | nodes",
        axes,
        "{} | {} | {} | {:g}",
    )
    return parts, {
        "docs/figures/tables_universal_error.svg": drawn_errors(contents[UNIVERSAL])
    }


def drawn_errors(content: TableContent) -> Any:
    """Bound on the relative error of the universal table over X and mu, at the middles of its cells."""
    X_low, X_high, mu_low, mu_high = (content.auxiliary[name][1] for name in CELL_EDGES)
    figure, plots = panels(1, 2, (9, 3.6), sharey=True)
    norm = LogNorm(content.local_error.min(), content.local_error.max())
    for plot, errors, name in zip(
        plots, content.local_error.T, (r"$\Phi_F$", r"$\Phi_A$"), strict=True
    ):
        middle = (X_low + X_high) / 2, (mu_low + mu_high) / 2
        dots = plot.scatter(*middle, c=errors, s=5, norm=norm, rasterized=True)
        plot.set(
            yscale="log",
            xlim=(X_low[0], 12),
            xlabel="X",
            title=f"bound on the relative error of {name}",
        )
    plots[0].set(ylabel=r"$\mu$", ylim=(1e-3, mu_high[-1]))
    figure.colorbar(dots, ax=plots)
    return figure


def expressions(function: Function) -> dict[str, sympy.Expr]:
    """The steps of a closed form as sympy expressions, their whole numbers and fractions exact."""
    known: dict[str, Any] = {
        name: sympy.Symbol(name) for name in (*function.arguments, *function.steps)
    }
    known |= {
        "pow": sympy.Pow,
        "where": lambda condition, a, b: sympy.Piecewise((a, condition), (b, True)),
    }
    exact = (
        (name, text.replace(repr(math.pi), "pi")) for name, text in function.steps.items()
    )
    return {
        name: sympy.sympify(re.sub(r"\b(\d+)\.0\b", r"\1", text), locals=known)
        for name, text in exact
    }


def latex_steps(function: Function) -> Iterator[str]:
    """One equation a step, in the order in which they are evaluated; polynomials without Horner's brackets."""
    _, is_island, letter = function.result.partition("phi_")
    own = {"log_Q": rf"\ln Q_{letter}", "rigid": f"R_{letter}"} | {
        name: f"{name}_{{{letter}}}" for name in "pytzuv"
    }
    names = {
        sympy.Symbol(name): text
        for name, text in (LATEX | (own if is_island else {})).items()
    }
    for name, value in expressions(function).items():
        shown = (
            value.expand()
            if len(value.free_symbols) == 1 and value.is_polynomial()
            else value
        )
        equation = sympy.Eq(sympy.Symbol(name), shown, evaluate=False)
        yield sympy.latex(
            equation, symbol_names=names, ln_notation=True, fold_frac_powers=True
        )


def formula() -> Measured:
    rows = []
    for form, results in CERTIFICATES.items():
        for result, found in results.items():
            worst = ", ".join(
                f"{name} = {value:g}" for name, value in found.worst_at.items()
            )
            rows.append(
                [form, result, found.coefficients, found.largest, found.median, worst]
            )
    header = "form | function | coefficients | largest error | median | worst at"
    parts = {"certificates": table(header, rows, "{} | {} | {} | {:g} | {:.2g}")}
    header = "pocket law | median error | 90% of errors below | largest | surfaces"
    parts["laws"] = table(
        header, pocket_errors(), "{} | {:.2g}% | {:.2g}% | {:.2g}% | {}"
    )
    parts["ranges"] = "\n".join(
        f"- {form}: {', '.join(f'`{low:g} <= {name} <= {high:g}`' for name, (low, high) in limits.items())}"
        for form, limits in RANGES.items()
    )
    for form in ("pocket", "standard", "totals"):
        # steps that functions of a form share are printed once
        steps = dict.fromkeys(
            line
            for function in FUNCTIONS[form].values()
            for line in latex_steps(function)
        )
        parts[form] = "\n\n".join(f"$${line}$$" for line in steps)
    return parts, {}


def picture() -> Any:
    """Force against separation and area against force by three theories, and simulated surfaces as dots."""
    seen, (_, hurst, zeta_1, *_) = [one for one in evidence() if one.node == SHOWN], SHOWN
    surface = Surface(
        float(hurst), 1.0, float(zeta_1), 1.0, float(np.mean([one.h_max for one in seen]))
    )
    loads, curves = LOADS * surface.rms_gradient, []
    u = contact(surface, pressure=loads, theory="calibrated").mean_separation
    for theory in ("calibrated", "mbma", "persson"):
        # three bands would hide one another
        bands: dict[str, Any] = (
            {} if theory == "calibrated" else {"scatter": None, "area_scatter": None}
        )
        curve = contact(surface, mean_separation=u, theory=theory).curve()
        curves.append(dataclasses.replace(curve, label=theory_label(theory), **bands))
    figure = draw_compression(
        curves,
        f"H = {hurst:g}, q1/q0 = {zeta_1:g}: a spectrum that no constant was fitted to",
    )
    by_gap, by_force = figure.axes
    for line in (*by_gap.lines, *by_force.lines):
        line.set_marker("")
    u, force, area = (
        np.concatenate([getattr(one, name) for one in seen])
        for name in ("u", "force", "area")
    )
    by_gap.plot(u, force * surface.rms_gradient, "k.", label="boundary elements")
    by_force.plot(force * surface.rms_gradient, area, "k.")
    by_gap.legend()
    return figure


def readme() -> Measured:

    def off(*deviations: float) -> str:
        return " / ".join(
            f"{100 * math.expm1(d):.2g}%" if d < 0.5 else f"factor {math.exp(d):.2g}"
            for d in deviations
        )

    known, rows = {(row.theory, row.way): row for row in shipped_distances()}, []
    for row, what in ((known[key], what) for key, what in ROWS.items()):
        cells = off(row.area_light, row.area_deep), off(row.force_light, row.force_deep)
        rows.append([what, *cells, duration(row.cost * shipped_costs().seconds)])
    header = "theory | error of area at given pressure | error of pressure at given separation | time per point"
    return {"theories": table(header, rows)}, {"docs/figures/first.svg": picture()}


def theories() -> Measured:
    road, rows = Surface.named("concrete"), []
    for pressure, name in itertools.product(PRESSURES, THEORIES):
        found = contact(road, pressure=pressure, theory=name)
        numbers = (
            found.mean_separation / road.h_rms,
            100 * found.area,
            found.stiffness * road.h_rms / pressure,
        )
        spread = found.scatter if np.isfinite(found.scatter) else "not known"
        rows.append(
            [pressure, f"`{name}`", *numbers, "yes" if found.valid else "no", spread]
        )
    header = "F/(A0 E*) | theory | u/h_rms | A/A0 [%] | stiffness h_rms/F | valid | scatter of ln F"
    return {
        "answers": table(
            header, rows, "{:g} | {} | {:.3g} | {:.3g} | {:.3g} | {} | {:.2g}"
        )
    }, {}
