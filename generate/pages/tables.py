"""The measured parts of docs/tables.md, and its figures."""

from __future__ import annotations

import math
import pathlib
from collections.abc import Iterable, Sequence

import numpy as np

from generate.pages.page import png, pyplot, table
from generate.tables.configuration import load
from generate.tables.schemes import LARGEST_ZETA_D, POINTS, SIZES, Row, compare
from mbma_tables.islands.four_numbers import hat_scales, to_axes
from mbma_tables.islands.height_integrals import height_integral
from mbma_tables.models.tables import shipped
from mbma_tables.surfaces.readings import get_reading
from mbma_tables.tablefiles.netcdf import read_table
from mbma_tables.tablefiles.schema import ISLAND4D, KINDS, UNIVERSAL, TableContent, error_cell

PAGE = pathlib.Path(__file__).parents[2] / "docs" / "tables.md"
EXAMPLE = {UNIVERSAL: 40, ISLAND4D: 40}  # conformance points worked through


def sizes() -> str:
    """What the shipped files hold, as they say themselves."""
    rows = []
    for kind in KINDS:
        content = read_table(shipped(kind), kind)
        said = content.attributes
        nodes = " x ".join(f"{axis.nodes} {axis.name}" for axis in content.axes)
        total = math.prod(axis.nodes for axis in content.axes)
        for f in ("F", "A"):
            errors = [f"{said[name]:.1e}" for name in (f"largest_error_{f}", f"p99_error_{f}", f"median_error_{f}")]
            errors.append(f"{said[f'visited_largest_error_{f}']:.1e}")
            size = f"{shipped(kind).stat().st_size / 1e6:.2f} MB"
            rows.append([kind, f"{nodes} = {total}", size, f, *errors])
    header = ["table", "nodes", "file", "of", "largest error", "99% below", "half below", "largest where surfaces go"]
    return table(header, rows)


def axes() -> str:
    """The axes of the shipped files."""
    rows = []
    for kind in KINDS:
        for axis in read_table(shipped(kind), kind).axes:
            shifted = f"{axis.name} + {axis.offset:g}" if axis.offset else axis.name
            t = f"log({shifted})" if axis.transform == "log" else shifted
            rows.append([kind, axis.name, axis.long_name, t, f"{axis.low:g}", f"{axis.high:g}", str(axis.nodes)])
    return table(["table", "axis", "what it is", "equally spaced in", "first", "last", "nodes"], rows)


def _lookup_steps(content: TableContent, coordinates: Sequence[float], X: float, mu: float) -> list[list[str]]:
    """Rows of a worked example from the coordinates of the axes to Phi_F and Phi_A."""
    from generate.tables.build import evaluate

    rows, positions = [], []
    for axis, x in zip(content.axes, coordinates, strict=True):
        p = float(axis.position(x))
        cell = min(int(p), axis.nodes - 2)
        positions.append(np.array([p]))
        rows.append([f"position, cell and u on {axis.name}", f"{p:.12f}, {cell}, {p - cell:.12f}"])
    g = evaluate(content.coefficients, positions)[0]
    F_52, F_2 = (float(height_integral(n, np.array([-X]))[0]) for n in (2.5, 2.0))
    rows += [
        ["g_F, g_A", f"{g[0]:.12e}, {g[1]:.12e}"],
        ["F_5/2(-X), F_2(-X)", f"{F_52:.12e}, {F_2:.12e}"],
        ["Phi_F = exp(g_F) pi mu F_5/2(-X)/5", f"{math.exp(g[0]) * math.pi * mu * F_52 / 5:.12e}"],
        ["Phi_A = exp(g_A) pi F_2(-X)/2", f"{math.exp(g[1]) * math.pi * F_2 / 2:.12e}"],
    ]
    cells = tuple(
        int(error_cell(axis, count, p[0]))
        for axis, count, p in zip(content.axes, content.local_error.shape, positions, strict=False)
    )
    bounds = ", ".join(f"{bound:.2e}" for bound in content.local_error[cells])
    rows.append(["cell of the error field, error_F, error_A there", f"{cells}, {bounds}"])
    return rows


def _stored(content: TableContent, point: int) -> list[list[str]]:
    points = content.conformance
    return [
        ["stored table_F, table_A", ", ".join(f"{points[f'table_{f}'][point]:.12e}" for f in "FA")],
        ["stored exact_F, exact_A", ", ".join(f"{points[f'exact_{f}'][point]:.12e}" for f in "FA")],
        ["tolerance", f"{points['tolerance'][point]:.2e}"],
    ]


def example_universal() -> str:
    """One conformance point of the universal table, step by step."""
    content, point = read_table(shipped(UNIVERSAL), UNIVERSAL), EXAMPLE[UNIVERSAL]
    X, mu = (float(content.conformance[name][point]) for name in ("X", "mu"))
    rows = [["X, mu", f"{X!r}, {mu!r}"], *_lookup_steps(content, (X, mu), X, mu), *_stored(content, point)]
    return f"Conformance point {point} (counted from 0):\n\n" + table(["step", "number"], rows)


def example_island4d() -> str:
    """One conformance point of the four-parameter table, step by step."""
    content, point = read_table(shipped(ISLAND4D), ISLAND4D), EXAMPLE[ISLAND4D]
    names = ("delta_over_h_rms", "zeta_d", "zeta_u", "hurst")
    raw = [np.atleast_1d(content.conformance[name][point]) for name in names]
    reading = get_reading(content.attributes["reading"])
    place = to_axes(raw[0], raw[1], raw[2], raw[3], reading)
    X, mu, spread, sphere, sigma = (float(a[0]) for a in (place.X, place.mu, place.spread, place.sphere, place.sigma))
    hurst = float(raw[3][0])
    scale_F, scale_A = (float(s[0]) for s in hat_scales(place.spread, raw[1], raw[3], place.sigma, reading))
    rows = [[name, repr(float(value[0]))] for name, value in zip(names, raw, strict=True)]
    rows += [
        ["spread, sphere", f"{spread:.12e}, {sphere:.12e}"],
        ["sigma, mu, X", f"{sigma:.12e}, {mu:.12e}, {X:.12f}"],
        *_lookup_steps(content, (X, spread, sphere, hurst), X, mu),
        ["F_hat/Phi_F = S sqrt(2 R_d S)", f"{scale_F:.12e}"],
        ["A_hat/Phi_A = 2 pi D R_u R_d S^2", f"{scale_A:.12e}"],
        *_stored(content, point),
    ]
    return f"Conformance point {point} (counted from 0):\n\n" + table(["step", "number"], rows)


def comparison_table(rows: Iterable[Row]) -> str:
    """Largest errors of the schemes at equal size."""
    header = ["spread from", "nodes", "held on", "cubic, box", "cubic, visited", "quintic, box", "quintic, visited"]
    return table(
        header,
        [
            [f"{r.least:g}", f"{r.nodes} = {' x '.join(map(str, r.shape))}", r.scheme, *(f"{e:.1e}" for e in r.errors)]
            for r in rows
        ],
    )


def draw(rows: Sequence[Row]) -> dict[str, bytes]:
    """The two figures of the page, as PNG files of 900 pixels' width."""
    from matplotlib import colors

    plt = pyplot()

    leasts = sorted({row.least for row in rows}, reverse=True)
    figure, panels = plt.subplots(
        1, len(leasts), figsize=(9, 3.6), dpi=100, layout="constrained", sharey=True, squeeze=False
    )
    for panel, least in zip(panels[0], leasts, strict=True):
        for number, scheme in enumerate(dict.fromkeys(row.scheme for row in rows)):
            own = [row for row in rows if row.least == least and row.scheme == scheme]
            nodes = [row.nodes for row in own]
            for first, degree, dashes in ((0, "cubic", "-"), (2, "quintic", "--")):
                worst = [max(row.errors[first : first + 2]) for row in own]
                panel.loglog(nodes, worst, "o" + dashes, color=f"C{number}", ms=4, label=f"{scheme}; {degree}")
        panel.set(xlabel="nodes", title=f"spread from {least:g}")
        panel.grid(alpha=0.3)
    panels[0][0].set_ylabel("largest relative error, held-out points")
    figure.legend(*panels[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8)
    files = {"docs/figures/tables_comparison.png": png(figure)}

    content = read_table(shipped(UNIVERSAL), UNIVERSAL)
    edges = [
        axis.coordinate(np.linspace(0, axis.nodes - 1, cells + 1))
        for axis, cells in zip(content.axes, content.local_error.shape, strict=False)
    ]
    figure, panels = plt.subplots(1, 2, figsize=(9, 3.6), dpi=100, layout="constrained", sharey=True)
    low, high = content.local_error.min(), content.local_error.max()
    for panel, number, name in zip(panels, (0, 1), (r"$\Phi_F$", r"$\Phi_A$"), strict=True):
        field = content.local_error[..., number].T
        image = panel.pcolormesh(edges[0], edges[1], field, norm=colors.LogNorm(low, high), rasterized=True)
        panel.set(yscale="log", xlabel="X", title=f"bound on the relative error of {name}")
    panels[0].set_ylabel(r"$\mu$")
    figure.colorbar(image, ax=panels)
    return files | {"docs/figures/tables_universal_error.png": png(figure)}


def comparison_text(rows: Sequence[Row]) -> str:
    """The comparison with what was compared."""
    said = load(ISLAND4D)
    return (
        f"Each error is the larger of those of F and A, the largest over {POINTS // 2} points of the box in X, spread, "
        f"zeta_d (1.5 to {LARGEST_ZETA_D:g}) and H, and over {POINTS // 2} islands of random surfaces (reading "
        f"{said.reading}).\n\n" + comparison_table(rows)
    )


def measure() -> tuple[dict[str, str], dict[str, bytes]]:
    """The measured parts of the page, and its figures."""
    rows = compare(max(SIZES))
    parts = {
        "sizes": sizes(),
        "axes": axes(),
        "universal": example_universal(),
        "island4d": example_island4d(),
        "comparison": comparison_text(rows),
    }
    return parts, draw(rows)
