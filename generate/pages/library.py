"""Measured parts of README.md and of pages on the library itself.

Architecture, tables, theories, closed forms.
"""

from __future__ import annotations

import ast
import collections
import itertools
import math
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import sympy

from benchmarks.import_circles import import_graph
from generate.boundary_elements.evidence import evidence
from generate.distances import pocket_errors
from generate.files import ROOT, read_csv
from generate.page import Cell, Measured, as_error, duration, panels, table
from generate.pages.ideas import ideas
from mbma_tables import Surface, contact
from mbma_tables.common.plots import draw_compression, theory_label
from mbma_tables.design.scenes.plan import shipped_costs
from mbma_tables.tables.open import shipped
from mbma_tables.tables.picture import draw_errors
from mbma_tables.tables.reader import read_table
from mbma_tables.tables.schema import ISLAND4D, KINDS, UNIVERSAL, TableContent
from mbma_tables.theories import THEORIES, Mbma
from mbma_tables.theories.mbma.closed_form_certificates import CERTIFICATES, RANGES
from mbma_tables.theories.mbma.closed_forms import FUNCTIONS, ClosedForm

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BOX = {"boxstyle": "square,pad=0.4", "facecolor": "#e8eef7", "edgecolor": "#4a6fa5"}
RIGHT = 0.83  # edge of the boxes
SHARED = {"common", "core"}  # what every room uses: no arrows
# a held-out spectrum: kind, H, zeta_1, wavelengths a side, shape
SHOWN = ("self_affine", 0.7, 24.0, 5, 0.0)
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
    "near": r"\mathrm{near}",
    "far": r"\mathrm{far}",
    "pressure": r"\mathrm{pressure}",
    "area": r"\mathrm{area}",
}


def rooms() -> tuple[dict[str, set[str]], dict[str, str]]:
    """What each folder, or module at the top, imports of the others.

    And what is written in its box.
    """
    graph: dict[str, set[str]] = collections.defaultdict(set)
    lines: collections.Counter[str] = collections.Counter()
    titles = {}
    imports, files = import_graph(ROOT / "mbma_tables")
    for name, others in imports.items():
        room = name.split(".")[1]
        text = files[name].read_text(encoding="utf-8")
        lines[room] += len(text.splitlines())
        graph[room] |= {other.split(".")[1] for other in others} - {room}
        # the module itself, or the package's __init__
        if name.count(".") == 1:
            titles[room] = _title(text)
    del graph["__main__"]
    for path in (ROOT / "mbma_tables/core").glob("*.[ch]"):
        lines["core"] += len(path.read_text().splitlines())
    texts = {}
    for room in graph:
        texts[room] = f"{room:<11}{titles[room]:<72}{lines[room]:>6,}"
    return graph, texts


def _title(source: str) -> str:
    """The first line of a module's docstring, as plain text."""
    docstring = ast.get_docstring(ast.parse(source)) or ""
    first_line = docstring.split("\n")[0]
    return first_line.rstrip(".").replace("`", "")


def architecture() -> Measured:
    """The rooms as boxes, with arrows to those that are imported.

    Less the arrows that follow from others.
    """
    graph, texts = rooms()
    # all that a room reaches, by way of others too
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
        below_others = [below[other] for other in graph[room]]
        direct = graph[room] - set().union(*below_others) - SHARED
        for down in map(order.index, sorted(direct)):
            style = {
                "arrowstyle": "-|>",
                "color": "#555555",
                # long arrows bend less, so that they stay beside the boxes
                "connectionstyle": f"arc3,rad={-0.15 - 0.4 / (y - down)}",
            }
            axes.annotate("", (RIGHT, down + 0.12), (RIGHT, y - 0.12), arrowprops=style)
    return {"ideas": ideas()}, {"docs/figures/architecture.svg": figure}


def tables() -> Measured:
    contents = {kind: read_table(shipped(kind), kind) for kind in KINDS}
    figure = draw_errors(contents[UNIVERSAL])
    parts = {
        "sizes": _sizes(contents),
        "accuracy": _accuracy(contents),
        "axes": _axes(contents[ISLAND4D]),
    }
    return parts, {"docs/figures/tables_universal_error.svg": figure}


def _sizes(contents: dict[str, TableContent]) -> str:
    """Sizes and errors of force and area, of each table."""
    rows: list[list[Cell]] = []
    for (kind, content), quantity in itertools.product(contents.items(), "FA"):
        megabytes = shipped(kind).stat().st_size / 1e6
        errors = [
            content.attributes[f"median_error_{quantity}"],
            content.attributes[f"p99_error_{quantity}"],
            content.attributes[f"visited_largest_error_{quantity}"],
        ]
        rows.append([kind, content.size, megabytes, quantity, *errors])
    header = (
        "table | cells or nodes | file | errors of | half below | 99% below"
        " | largest at islands of surfaces"
    )
    return table(header, rows, "{} | {} | {:.2f} MB | {} | {:.1e}")


def _cell_of(page: str, row: str, column: int) -> str:
    """A number that another program wrote into a table of a page, by the first cell of its row."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    found: list[str] = re.findall(rf"^\| {re.escape(row)} \|.*$", text, re.MULTILINE)
    (line,) = found
    return line.split("|")[column + 1].strip()


def _accuracy(contents: dict[str, TableContent]) -> str:
    """Bounds and largest errors of lookups and of contacts, each with its comparison and command."""
    lookups = {
        UNIVERSAL: "Phi_F and Phi_A of an island",
        ISLAND4D: "F_hat and A_hat of an island",
    }
    corners = "`python -m generate pages guarantees`"
    million = "1,000,000"
    rows: list[list[Cell]] = []
    for kind, quantity in lookups.items():
        content = contents[kind]
        bound = f"{np.max(content.local_error):.2e}"
        seen = max(content.attributes[f"largest_error_{of}"] for of in "FA")
        solved = f"the solver on twice the nodes, at {content.attributes['certificate_points']:,} points"
        rows.append(
            [quantity, kind, solved, bound, f"{seen:.1e}", f"`mbma tables show {kind}`"]
        )
        if kind == UNIVERSAL:
            of_corner = _cell_of("guarantees.md", f"islands by {kind}", 5)
            extreme = "40 digits, or the solver at 1e-11, at extreme islands"
            rows.append([quantity, kind, extreme, bound, of_corner, corners])
        else:
            of_many = _cell_of("tables.md", million, 1)
            others = f"lookups in `{UNIVERSAL}`, at {million} islands"
            rows.append(
                [
                    quantity,
                    kind,
                    others,
                    bound,
                    of_many,
                    "`python -m benchmarks surrogates`",
                ]
            )
    rtol = Mbma().rtol
    for kind in lookups:
        stated = f"{rtol:.0e}, the default `rtol`" if kind == UNIVERSAL else "its `error`"
        of_corner = _cell_of("guarantees.md", f"totals by {kind}", 5)
        exact = "the same sums of exact islands at 1e-10, for extreme surfaces and gaps"
        rows.append(
            ["pressure and area of a surface", kind, exact, stated, of_corner, corners]
        )
    share = _cell_of("guarantees.md", "`error` of MBMA, against exact islands", 4)
    rows.append(
        [
            "pressure and area of a surface",
            UNIVERSAL,
            "the same sums of exact islands, for random surfaces, gaps and `rtol`",
            "its `error`",
            f"{share} of its `error`",
            "`python -m generate audit`",
        ]
    )
    header = "quantity | table | compared with | bound | largest error seen | command"
    return table(header, rows)


def _axes(content: TableContent) -> str:
    rows: list[list[Cell]] = []
    for axis in content.axes:
        shifted = f"{axis.name} + {axis.offset:g}" if axis.offset else axis.name
        spaced_in = f"log({shifted})" if axis.transform == "log" else shifted
        rows.append(
            [axis.name, axis.long_name, spaced_in, axis.low, axis.high, axis.nodes]
        )
    header = "axis | what it is | equally spaced in | first | last | nodes"
    return table(header, rows, "{} | {} | {} | {:g}")


def _where(condition: sympy.Basic, a: sympy.Expr, b: sympy.Expr) -> sympy.Piecewise:
    """numpy's `where`, in steps of closed forms."""
    return sympy.Piecewise((a, condition), (b, True))


def expressions(function: ClosedForm) -> dict[str, sympy.Expr]:
    """The steps of a closed form as sympy expressions.

    Their whole numbers and fractions are exact.
    """
    names = (*function.arguments, *function.steps)
    meanings: dict[str, object] = {name: sympy.Symbol(name) for name in names}
    meanings |= {"pow": sympy.Pow, "where": _where}
    exact = {}
    for name, text in function.steps.items():
        with_pi = text.replace(repr(math.pi), "pi")
        whole = re.sub(r"\b(\d+)\.0\b", r"\1", with_pi)
        exact[name] = sympy.sympify(whole, locals=meanings)
    return exact


def latex_steps(function: ClosedForm) -> Iterator[str]:
    """One equation a step, in the order in which they are evaluated.

    Polynomials are without Horner's brackets.
    """
    _, is_island, letter = function.result.partition("phi_")
    latex = dict(LATEX)
    if is_island:
        latex |= {"log_Q": rf"\ln Q_{letter}", "rigid": f"R_{letter}"}
        latex |= {name: f"{name}_{{{letter}}}" for name in "pytzuv"}
    names = {sympy.Symbol(name): text for name, text in latex.items()}
    for name, value in expressions(function).items():
        is_polynomial = len(value.free_symbols) == 1 and value.is_polynomial()
        shown = value.expand() if is_polynomial else value
        equation = sympy.Eq(sympy.Symbol(name), shown, evaluate=False)
        yield sympy.latex(
            equation, symbol_names=names, ln_notation=True, fold_frac_powers=True
        )


def formula() -> Measured:
    header = "pocket law | median error | 90% of errors below | largest | surfaces"
    forms = "{} | {:.2g}% | {:.2g}% | {:.2g}% | {}"
    parts = {
        "certificates": _certificates(),
        "laws": table(header, pocket_errors(), forms),
        "ranges": _ranges(),
    }
    for form in ("pocket", "standard", "totals"):
        steps: list[str] = []
        for function in FUNCTIONS[form].values():
            steps += latex_steps(function)
        # steps that functions of a form share are printed once
        distinct = dict.fromkeys(steps)
        parts[form] = "\n\n".join(f"$${step}$$" for step in distinct)
    return parts, {}


def _certificates() -> str:
    rows: list[list[Cell]] = []
    for form, results in CERTIFICATES.items():
        for result, certificate in results.items():
            place = certificate.worst_at.items()
            worst = ", ".join(f"{name} = {value:g}" for name, value in place)
            errors = (certificate.largest, certificate.median)
            rows.append([form, result, certificate.coefficients, *errors, worst])
    header = "form | function | coefficients | largest error | median | worst at"
    return table(header, rows, "{} | {} | {} | {:g} | {:.2g}")


def _ranges() -> str:
    """Ranges of the arguments of each closed form, as a list."""
    lines = []
    for form, limits in RANGES.items():
        texts = []
        for name, (low, high) in limits.items():
            texts.append(f"`{low:g} <= {name} <= {high:g}`")
        lines.append(f"- {form}: {', '.join(texts)}")
    return "\n".join(lines)


def picture() -> Figure:
    """Force against separation and area against force by three theories.

    Simulated surfaces are dots.
    """
    simulated = [one for one in evidence() if one.node == SHOWN]
    hurst = float(SHOWN[1])
    zeta_1 = float(SHOWN[2])
    h_max = float(np.mean([one.h_max for one in simulated]))
    surface = Surface(hurst, 1.0, zeta_1, 1.0, h_max)
    loads = LOADS * surface.rms_gradient
    u = contact(surface, pressure=loads, theory="calibrated").mean_separation
    curves = []
    for theory in ("calibrated", "mbma", "persson"):
        curve = contact(surface, mean_separation=u, theory=theory).curve()
        named = {
            axis: line._replace(name=theory_label(theory)) for axis, line in curve.items()
        }
        # three bands would hide one another
        if theory != "calibrated":
            named = {axis: line._replace(scatter=None) for axis, line in named.items()}
        curves.append(named)
    title = (
        f"H = {hurst:g}, q1/q0 = {zeta_1:g}: a spectrum that no constant was fitted to"
    )
    figure = draw_compression(curves, title)
    by_gap, by_force = figure.axes
    for line in (*by_gap.lines, *by_force.lines):
        line.set_marker("")

    simulated_u = np.concatenate([one.u for one in simulated])
    force = np.concatenate([one.force for one in simulated])
    area = np.concatenate([one.area for one in simulated])
    pressure = force * surface.rms_gradient
    by_gap.plot(simulated_u, pressure, "k.", label="boundary elements")
    by_force.plot(pressure, area, "k.")
    by_gap.legend()
    return figure


def readme() -> Measured:
    measured = read_csv(ROOT / "tables" / "distance.csv")
    distances = {(row.theory, row.way): row for row in measured.itertuples()}
    rows = []
    for key, what in ROWS.items():
        row = distances[key]
        area = f"{as_error(row.area_light)} / {as_error(row.area_deep)}"
        force = f"{as_error(row.force_light)} / {as_error(row.force_deep)}"
        rows.append([what, area, force, duration(row.cost * shipped_costs().seconds)])
    header = (
        "theory | error of area at given pressure"
        " | error of pressure at given separation | time per point"
    )
    return {"theories": table(header, rows)}, {"docs/figures/first.svg": picture()}


def theories() -> Measured:
    road = Surface.named("concrete")
    rows: list[list[Cell]] = []
    for pressure, name in itertools.product(PRESSURES, THEORIES):
        pressed = contact(road, pressure=pressure, theory=name)
        row: list[Cell] = [
            pressure,
            f"`{name}`",
            float(pressed.mean_separation / road.h_rms),
            float(100 * pressed.area),
            float(pressed.stiffness * road.h_rms / pressure),
            "yes" if pressed.valid else "no",
            float(pressed.scatter) if np.isfinite(pressed.scatter) else "not known",
        ]
        rows.append(row)
    header = (
        "F/(A0 E*) | theory | u/h_rms | A/A0 [%] | stiffness h_rms/F | valid"
        " | scatter of ln F"
    )
    forms = "{:g} | {} | {:.3g} | {:.3g} | {:.3g} | {} | {:.2g}"
    return {"answers": table(header, rows, forms)}, {}
