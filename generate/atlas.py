"""The stability atlas (``python -m generate atlas``): corners of parameter space, drawn in docs/stability.md."""

from __future__ import annotations

import pathlib
import time
from typing import Any

import click
import numpy as np

from generate import atlas_cases as cases
from generate.atlas_cases import Tally
from generate.pages import png
from mbma_tables.arguments import FloatArray
from mbma_tables.whole_files import write_files

PAGE, FIGURE = pathlib.Path("stability.md"), pathlib.Path("figures") / "stability.png"
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
    write_files({path: png(figure, dpi=110)}, make_folders=True)


def _row(tally: Tally) -> str:
    largest = "-" if np.isnan(tally.largest) else f"{tally.largest:.1e}"
    counts = (tally.tried, tally.refused, tally.not_finite, tally.warned)
    return f"| {tally.name} | {' | '.join(map(str, counts))} | {largest} | {tally.bound_broken} |"


def page(tallies: list[Tally], worst: list[dict[str, object]], kinds: list[tuple[str, bool]]) -> str:
    """The text of the page."""
    rows = "\n".join(_row(tally) for tally in tallies)
    broken = "\n".join(f"- {case}" for case in worst[:20]) or "None."
    listed = "\n".join(f"| {name} | {'same' if held else '**differs**'} |" for name, held in kinds)
    return f"""# Stability

`python -m generate atlas` evaluates the corners of parameter space and draws this page. White in the maps is a typed
refusal in the lower row, and no number (NaN or an arithmetic error) in the upper one.

![maps of relative error]({FIGURE.as_posix()})

| corners | tried | refused | not finite | warnings | largest error of answers | answers beyond their own bound |
| --- | --- | --- | --- | --- | --- | --- |
{rows}

- Islands: X from -40 to 1e4, mu from 0 and 1e-300 to 1e12, against mpmath at {cases.DIGITS} digits below
  mu = {cases.RIGID_MU:g} and elsewhere against the solver at {cases.ISLAND_TRUTH:g}; where that is refused too, no
  error is counted. The rigid tier is compared with the elastic truth, which it does not claim to meet.
- Geometry: delta/h_rms from 1e-12 to 30, zeta_1 from 3.0000001 to 1e8, H from 0.05 to one ulp below 1 and 1, both
  readings, against 60 digits; the maps are of H = {cases.MAP_HURST:g}. Of X, mu, eta, D_d, sigma_d and R_u the worst.
- Totals: H from 0.05 to 1, zeta_1 from 3.0000001 to 1e8, h_max - d from 1e-12 h_rms to full compression, both readings,
  at rtol 1e-8 against the exact tier at {cases.TOTAL_TRUTH:g}.

Totals beyond their own bound:

{broken}

## Arguments

| given | answer |
| --- | --- |
{listed}
"""


@click.command()
@click.option("--out", type=click.Path(path_type=pathlib.Path, file_okay=False), default="docs", show_default=True)
def main(out: pathlib.Path) -> None:
    """Evaluate the corners; write the page and its figure."""
    started = time.perf_counter()
    island_tallies, island_maps = cases.islands()
    geometry_tallies, geometry_maps = cases.island_geometry()
    total_tallies, worst = cases.totals()
    draw(geometry_maps, island_maps, out / FIGURE)
    tallies = [*island_tallies, *geometry_tallies, *total_tallies]
    write_files({out / PAGE: page(tallies, worst, list(cases.arguments())).encode()})
    for tally in tallies:
        click.echo(_row(tally))
    click.echo(f"{out / PAGE}; {time.perf_counter() - started:.0f} s")


if __name__ == "__main__":
    main()
