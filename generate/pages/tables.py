"""docs/tables.md: content of the shipped files, and one lookup in each, step by step."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from generate.pages.page import Measured, panels, table
from generate.tables.island4d import evaluate
from mbma_tables.islands.four_numbers import to_axes
from mbma_tables.islands.height_integrals import height_integral
from mbma_tables.models.tables import shipped
from mbma_tables.models.universal import fractions_of_mu
from mbma_tables.surfaces.variants import get_variant
from mbma_tables.tablefiles.netcdf import read_table
from mbma_tables.tablefiles.schema import CELL_EDGES, ISLAND4D, KINDS, UNIVERSAL, TableContent, error_cell

EXAMPLE = 40  # the conformance point that is worked through
LEAST_DRAWN = 1e-3  # mu


def numbers(*values: float, form: str = ".12e") -> str:
    """Numbers with commas."""
    return ", ".join(f"{value:{form}}" for value in values)


def example(content: TableContent, rows: dict[str, str]) -> str:
    """The steps of a lookup, and what is stored of it."""
    points = content.conformance
    for what in ("table", "exact"):
        rows[f"stored {what}_F, {what}_A"] = numbers(*(points[f"{what}_{f}"][EXAMPLE] for f in "FA"))
    rows["tolerance"] = numbers(points["tolerance"][EXAMPLE], form=".2e")
    return f"Conformance point {EXAMPLE} (counted from 0):\n\n" + table("step | number", rows.items())


def universal(content: TableContent) -> tuple[dict[str, str], Any]:
    """Cells of the universal table and a lookup in one, and a figure of the bound on its error."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import LogNorm

    ends, (X_axis, mu_axis) = np.stack([content.auxiliary[name][1] for name in CELL_EDGES]), content.axes
    X_low, X_high, mu_low, mu_high = ends
    first, widths = mu_low == 0, X_high - X_low
    most = np.diff(np.flatnonzero(np.append(first, True))).max()
    octaves = np.median(np.log2(mu_high[~first] / mu_low[~first]))
    rows = [
        ["X", f"{X_axis.low:g} to {X_axis.high:g}", f"{first.sum()} strips, {widths.min():g} to {widths.max():g} wide"],
        ["mu", f"{mu_axis.low:g} to {mu_axis.high:g}", f"1 to {most} cells a strip"],
        ["first cell of a strip", "from 0", f"to {mu_high[first].min():g} at least"],
        ["other cells", "", f"{octaves:.2g} octaves of mu, half of them longer"],
    ]
    X, mu = (float(content.conformance[name][EXAMPLE]) for name in ("X", "mu"))
    cell = int(np.flatnonzero((X_low <= X) & (X_high >= X) & (mu_low <= mu) & (mu_high >= mu))[0])
    x = (2 * X - X_low[cell] - X_high[cell]) / widths[cell]
    a, b, c, d = fractions_of_mu(mu_low[cell], mu_high[cell])
    y = (a * mu + b) / (c * mu + d)
    sums = chebyshev.chebval2d(x, y, content.coefficients[cell])
    steps = {
        "X, mu": f"{X!r}, {mu!r}",
        "cell": str(cell),
        "X_low, X_high, mu_low, mu_high": numbers(*ends[:, cell], form=".10g"),
        "x, y": numbers(x, y, form=".12f"),
        "first row of chebyshev_F": numbers(*content.coefficients[cell, 0, :, 0], form=".6e"),
        "Phi_F = mu times the sum of chebyshev_F": numbers(mu * sums[0]),
        "Phi_A = the sum of chebyshev_A": numbers(sums[1]),
        "error_F, error_A": numbers(*content.local_error[cell], form=".2e"),
    }
    bottom = np.maximum(mu_low, LEAST_DRAWN)
    corners = np.stack([X_low, bottom, X_high, bottom, X_high, mu_high, X_low, mu_high], axis=-1).reshape(-1, 4, 2)
    figure, plots = panels(1, 2, (9, 3.6), sharey=True)
    norm = LogNorm(content.local_error.min(), content.local_error.max())
    for plot, errors, name in zip(plots, content.local_error.T, (r"$\Phi_F$", r"$\Phi_A$"), strict=True):
        image = PolyCollection(list(corners), array=errors)
        image.set(norm=norm, edgecolor="white", linewidth=0.2, rasterized=True)
        plot.add_collection(image)
        title = f"bound on the relative error of {name}"
        plot.set(yscale="log", xlim=(X_low[0], 12), ylim=(LEAST_DRAWN, mu_high[-1]), xlabel="X", title=title)
    plots[0].set_ylabel(r"$\mu$")
    figure.colorbar(image, ax=plots)
    return {"cells": table(" | range | cells", rows), UNIVERSAL: example(content, steps)}, figure


def island4d(content: TableContent) -> dict[str, str]:
    """Axes of the four-parameter table, and a lookup in it."""
    rows = []
    for axis in content.axes:
        shifted = f"{axis.name} + {axis.offset:g}" if axis.offset else axis.name
        t = f"log({shifted})" if axis.transform == "log" else shifted
        rows.append([axis.name, axis.long_name, t, axis.low, axis.high, axis.nodes])
    raw = {name: content.conformance[name][[EXAMPLE]] for name in ("delta_over_h_rms", "zeta_d", "zeta_u", "hurst")}
    place = to_axes(**raw, variant=get_variant(content.attributes["variant"]))
    X, mu, spread, sphere, sigma = (float(a[0]) for a in (place.X, place.mu, place.spread, place.sphere, place.sigma))
    coordinates = zip(content.axes, (X, spread, sphere, float(raw["hurst"][0])), strict=True)
    positions = [float(axis.position(x)) for axis, x in coordinates]
    g = evaluate(content.coefficients, [np.array([p]) for p in positions])[0]
    F_52, F_2 = (float(height_integral(n, -X)) for n in (2.5, 2.0))
    steps = {name: repr(float(value[0])) for name, value in raw.items()} | {
        "spread, sphere": numbers(spread, sphere),
        "sigma, mu, X": f"{numbers(sigma, mu)}, {X:.12f}",
        "F_hat/Phi_F = S sqrt(2 R_d S)": numbers(float(place.force[0])),
        "A_hat/Phi_A = 2 pi D R_u R_d S^2": numbers(float(place.area[0])),
    }
    where: tuple[int, ...] = ()
    for axis, p, count in zip(content.axes, positions, content.local_error.shape, strict=False):
        node, where = min(int(p), axis.nodes - 2), (*where, int(error_cell(axis, count, p)))
        steps[f"position, cell and u on {axis.name}"] = f"{p:.12f}, {node}, {p - node:.12f}"
    bounds = numbers(*content.local_error[where], form=".2e")
    steps |= {
        "g_F, g_A": numbers(*g),
        "F_5/2(-X), F_2(-X)": numbers(F_52, F_2),
        "Phi_F = exp(g_F) pi mu F_5/2(-X)/5": numbers(math.exp(g[0]) * math.pi * mu * F_52 / 5),
        "Phi_A = exp(g_A) pi F_2(-X)/2": numbers(math.exp(g[1]) * math.pi * F_2 / 2),
        "cell of the error field, error_F, error_A there": f"{where}, {bounds}",
    }
    header = "axis | what it is | equally spaced in | first | last | nodes"
    return {"axes": table(header, rows, "{} | {} | {} | {:g}"), ISLAND4D: example(content, steps)}


def measure() -> Measured:
    """The measured blocks of the page, and its figure."""
    contents, rows = {kind: read_table(shipped(kind), kind) for kind in KINDS}, []
    for (kind, content), f in itertools.product(contents.items(), "FA"):
        names = (f"largest_error_{f}", f"p99_error_{f}", f"median_error_{f}", f"visited_largest_error_{f}")
        size = shipped(kind).stat().st_size / 1e6
        rows.append([kind, content.size, size, f, *(content.attributes[name] for name in names)])
    header = "table | cells or nodes | file | of | largest error | 99% below | half below | largest at islands"
    parts, figure = universal(contents[UNIVERSAL])
    parts |= {"sizes": table(header, rows, "{} | {} | {:.2f} MB | {} | {:.1e}")} | island4d(contents[ISLAND4D])
    return parts, {"docs/figures/tables_universal_error.svg": figure}
