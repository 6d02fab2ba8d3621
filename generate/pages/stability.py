"""The stability atlas (``python -m generate atlas``): corners of parameter space, drawn in docs/stability.md."""

from __future__ import annotations

import pathlib
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import click
import numpy as np

from generate.pages import stability_cases as cases
from generate.pages.page import fill, png
from generate.pages.stability_cases import Tally
from mbma_tables.arguments import FloatArray
from mbma_tables.files import write_file

DOCS = pathlib.Path(__file__).parents[2] / "docs"
PAGE, FIGURE = DOCS / "stability.md", pathlib.Path("figures") / "stability.png"
CORNERS, COUNTS = ("corners", "beyond", "arguments"), ("counts",)  # measured parts of the page: ours, and others'
LEAST, MOST = 1e-16, 1e0  # of the colour scale


def draw(geometry: dict[str, FloatArray], islands: dict[str, FloatArray], path: pathlib.Path) -> None:
    """Maps of error: geometry by the paper's formulas as they stand and by the library, and islands."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import colors, pyplot

    figure, axes = pyplot.subplots(2, 2, figsize=(10, 8), layout="constrained")
    norm = colors.LogNorm(LEAST, MOST)
    colormap = pyplot.get_cmap("viridis").with_extremes(bad="white")
    titles = {"direct": "geometry: the paper's formulas as they stand", "library": "geometry: the library"}
    mesh: Any = None
    for panel, (name, title) in zip(axes[0], titles.items(), strict=True):
        field = np.maximum(geometry[name], LEAST)
        mesh = panel.pcolormesh(cases.BANDS, cases.APPROACHES, field, norm=norm, cmap=colormap, shading="nearest")
        panel.set(xscale="log", yscale="log", xlabel="zeta_1", ylabel="delta/h_rms", title=title)
    places = np.arange(cases.MU_CORNERS.size), np.arange(cases.X_CORNERS.size)
    for panel, tier in zip(axes[1], ("exact", "universal"), strict=True):
        field = np.maximum(islands[tier], LEAST)
        mesh = panel.pcolormesh(*places, field, norm=norm, cmap=colormap, shading="nearest")
        panel.set(xlabel="mu", ylabel="X", title=f"islands: tier {tier} (white: refused)")
        panel.set_xticks(places[0][::4], [f"{mu:.0e}" for mu in cases.MU_CORNERS[::4]], rotation=45)
        panel.set_yticks(places[1][::4], [f"{X:.3g}" for X in cases.X_CORNERS[::4]])
    figure.colorbar(mesh, ax=axes, label="largest relative error")
    write_file(path, png(figure, dpi=110), make_folders=True)


def _row(tally: Tally) -> str:
    largest = "-" if np.isnan(tally.largest) else f"{tally.largest:.1e}"
    counts = (tally.tried, tally.refused, tally.not_finite, tally.warned)
    return f"| {tally.name} | {' | '.join(map(str, counts))} | {largest} | {tally.bound_broken} |"


def corners(tallies: Sequence[Tally]) -> str:
    """The table of what became of all corners."""
    head = (
        "corners | tried | refused | not finite | warnings | largest error of answers | answers beyond their own bound"
    )
    return "\n".join([f"| {head} |", "|" + " --- |" * 7, *map(_row, tallies)])


def arguments(kinds: Iterable[tuple[str, bool]]) -> str:
    """The table of kinds of arguments."""
    rows = (f"| {name} | {'yes' if held else '**no**'} |" for name, held in kinds)
    return "\n".join(["| given | so |", "| --- | --- |", *rows])


def beyond(worst: Sequence[Mapping[str, object]]) -> str:
    """The totals that are beyond their own bound."""
    return "\n".join(f"- {case}" for case in worst[:20]) or "None."


def parts(figure: pathlib.Path) -> dict[str, Callable[[], str]]:
    """Evaluate the corners and draw them; the measured parts of the page."""
    island_tallies, island_maps = cases.islands()
    geometry_tallies, geometry_maps = cases.island_geometry()
    total_tallies, worst = cases.totals()
    draw(geometry_maps, island_maps, figure)
    tallies = [*island_tallies, *geometry_tallies, *total_tallies]
    kinds = list(cases.arguments())
    return {
        "corners": lambda: corners(tallies),
        "beyond": lambda: beyond(worst),
        "arguments": lambda: arguments(kinds),
    }


@click.command()
@click.option("--out", type=click.Path(path_type=pathlib.Path, file_okay=False), default=DOCS, help="Default docs.")
def main(out: pathlib.Path) -> None:
    """Evaluate the corners; write the page with these parts anew, and its figure."""
    started = time.perf_counter()
    page = fill(PAGE.read_text(encoding="utf-8"), parts(out / FIGURE), left=COUNTS)
    write_file(out / PAGE.name, page.encode(), make_folders=True)
    click.echo(f"{out / PAGE.name}; {time.perf_counter() - started:.0f} s")


if __name__ == "__main__":
    main()
