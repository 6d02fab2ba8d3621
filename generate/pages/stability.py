"""The measured part of docs/stability.md, the stability atlas: corners of parameter space, counted and drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from generate.pages import stability_cases as cases
from generate.pages.page import png, pyplot, table
from generate.pages.stability_cases import Tally
from mbma_tables.arguments import FloatArray

MIN_ERROR, MAX_ERROR = 1e-16, 1e0  # of the colour scale


def draw(geometry: dict[str, FloatArray], islands: dict[str, FloatArray]) -> bytes:
    """Maps of error: geometry by the paper's formulas as printed and by the library, and islands."""
    from matplotlib import colors

    plt = pyplot()
    figure, axes = plt.subplots(2, 2, figsize=(10, 8), layout="constrained")
    norm = colors.LogNorm(MIN_ERROR, MAX_ERROR)
    colormap = plt.get_cmap("viridis").with_extremes(bad="white")
    titles = {"direct": "geometry: the paper's formulas as printed", "library": "geometry: the library"}
    mesh: Any = None
    for panel, (name, title) in zip(axes[0], titles.items(), strict=True):
        field = np.maximum(geometry[name], MIN_ERROR)
        mesh = panel.pcolormesh(cases.BANDS, cases.APPROACHES, field, norm=norm, cmap=colormap, shading="nearest")
        panel.set(xscale="log", yscale="log", xlabel="zeta_1", ylabel="delta/h_rms", title=title)
    places = np.arange(cases.MU_CORNERS.size), np.arange(cases.X_CORNERS.size)
    for panel, tier in zip(axes[1], ("exact", "universal"), strict=True):
        field = np.maximum(islands[tier], MIN_ERROR)
        mesh = panel.pcolormesh(*places, field, norm=norm, cmap=colormap, shading="nearest")
        panel.set(xlabel="mu", ylabel="X", title=f"islands: tier {tier} (white: refused)")
        panel.set_xticks(places[0][::4], [f"{mu:.0e}" for mu in cases.MU_CORNERS[::4]], rotation=45)
        panel.set_yticks(places[1][::4], [f"{X:.3g}" for X in cases.X_CORNERS[::4]])
    figure.colorbar(mesh, ax=axes, label="largest relative error")
    return png(figure, dpi=110)


def corners(tallies: Sequence[Tally]) -> str:
    """The table of all corners."""
    header = ["corners", "tried", "refused", "not finite", "warnings", "largest error of answers", "beyond their bound"]
    rows = []
    for tally in tallies:
        largest = "-" if "rigid" in tally.name else f"{tally.largest:.1e}"
        counts = (tally.tried, tally.refused, tally.not_finite, tally.warned)
        rows.append([tally.name, *map(str, counts), largest, str(tally.beyond)])
    return table(header, rows)


def measure() -> tuple[dict[str, str], dict[str, bytes]]:
    """The measured part of the page, and its figure."""
    island_tallies, island_maps = cases.islands()
    geometry_tallies, geometry_maps = cases.island_geometry()
    parts = {"corners": corners([*island_tallies, *geometry_tallies, *cases.totals()])}
    return parts, {"docs/figures/stability.png": draw(geometry_maps, island_maps)}
