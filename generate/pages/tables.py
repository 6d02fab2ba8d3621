"""docs/tables.md: sizes, errors and axes of the shipped files, and a figure of the universal table's error bound."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from generate.pages.page import Measured, panels, table
from mbma_tables.models.tables import shipped
from mbma_tables.tablefiles.netcdf import read_table
from mbma_tables.tablefiles.schema import CELL_EDGES, ISLAND4D, KINDS, UNIVERSAL, TableContent

LEAST_DRAWN = 1e-3  # mu


def draw(content: TableContent) -> Any:
    """Bound on the relative error of the universal table over X and mu."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import LogNorm

    X_low, X_high, mu_low, mu_high = (content.auxiliary[name][1] for name in CELL_EDGES)
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
    return figure


def measure() -> Measured:
    """The measured blocks of the page, and its figure."""
    contents, sizes, axes = {kind: read_table(shipped(kind), kind) for kind in KINDS}, [], []
    for (kind, content), f in itertools.product(contents.items(), "FA"):
        names = (f"largest_error_{f}", f"p99_error_{f}", f"median_error_{f}", f"visited_largest_error_{f}")
        size = shipped(kind).stat().st_size / 1e6
        sizes.append([kind, content.size, size, f, *(content.attributes[name] for name in names)])
    for axis in contents[ISLAND4D].axes:
        shifted = f"{axis.name} + {axis.offset:g}" if axis.offset else axis.name
        t = f"log({shifted})" if axis.transform == "log" else shifted
        axes.append([axis.name, axis.long_name, t, axis.low, axis.high, axis.nodes])
    header = "table | cells or nodes | file | of | largest error | 99% below | half below | largest at islands"
    parts = {"sizes": table(header, sizes, "{} | {} | {:.2f} MB | {} | {:.1e}")}
    header = "axis | what it is | equally spaced in | first | last | nodes"
    parts["axes"] = table(header, axes, "{} | {} | {} | {:g}")
    return parts, {"docs/figures/tables_universal_error.svg": draw(contents[UNIVERSAL])}
