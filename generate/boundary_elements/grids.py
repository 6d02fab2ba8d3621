"""`python -m generate grids`: what boundary elements cost and miss on coarser grids of held-out surfaces.

Heights are those of the finest grid at every second, fourth, ... point. A load is solved cold, by an engine made for
it, and continued, from the pressures of the load below. Times are those of the processor, over the fixed piece of work
of docs/cost.md done before and after.
"""

from __future__ import annotations

import csv
import io
import itertools
import pathlib
import time
from collections.abc import Callable, Iterator
from typing import Any

import click
from tqdm import tqdm

from generate.boundary_elements.design import HELD_OUT_SPECTRUM, campaign
from generate.boundary_elements.solve import LOADS, Contact
from generate.boundary_elements.surfaces import Recipe, heights
from generate.timing import fixed_work
from mbma_tables.common.files import write_file
from mbma_tables.laws.bearing_curve import bearing

HERE, TARGET = pathlib.Path("boundary_elements"), pathlib.Path("docs/data/boundary_element_grids.csv")
CHOSEN = ((0.3, 12.0), (0.9, 12.0))  # H and zeta_1 of held-out spectra, their first surfaces
GRIDS = (32, 64, 128, 256, 512, 1024)  # points a side; 60 of the shortest waves
PRESSED = LOADS[::2]
STARTS = ("cold", "continued")
COLUMNS = ("hurst", "zeta_1", "waves", "seed", "points", "start", "force", "area", "mean_separation", "seconds", "cost")
HEAD = """\
# Held-out surfaces of boundary_elements.nc on grids of 32 to 1024 points a side, by python -m generate grids.
# force in A0 E* g, g the rms gradient of the finest grid; area A/A0, corrected for its perimeter; separation in h_rms.
# seconds of the processor a load; cost: those over the fixed piece of work of docs/cost.md, timed before and after.
"""


def surfaces() -> list[Recipe]:
    """The surfaces, as the campaign has them."""
    held = [task.recipe for task in campaign() if task.split == HELD_OUT_SPECTRUM and task.recipe.kind == "self_affine"]
    return [next(one for one in held if (one.hurst, one.zeta_1) == chosen) for chosen in CHOSEN]


def priced(run: Callable[[], Any]) -> tuple[Any, float, float]:
    """What `run` returns, its seconds, and these over the fixed piece of work done before and after."""

    def timed(function: Callable[[], Any]) -> tuple[Any, float]:
        started = time.process_time()
        return function(), time.process_time() - started

    before = min(timed(fixed_work)[1] for _ in range(3))
    found, seconds = timed(run)
    after = min(timed(fixed_work)[1] for _ in range(3))
    return found, seconds, 2 * seconds / (before + after)


def solve(recipe: Recipe, grid: int, finest: int, start: str) -> Iterator[tuple[Any, ...]]:
    """Rows of one surface on one grid."""
    fine = heights(Recipe(recipe.kind, recipe.hurst, recipe.zeta_1, recipe.waves, recipe.seed, finest))
    known = bearing(fine, recipe.sizes)
    surface = (fine / known.gradient)[:: finest // grid, :: finest // grid]
    length = known.h_rms / known.gradient
    engine = Contact(surface, recipe.sizes)
    for force in PRESSED:
        if start == "cold":
            found, *times = priced(lambda force=force: Contact(surface, recipe.sizes).press(force))  # type: ignore[misc]
        else:
            found, *times = priced(lambda force=force: engine.press(force))  # type: ignore[misc]
        node = (recipe.hurst, recipe.zeta_1, recipe.waves, recipe.seed, grid, start, force)
        yield (*node, found["area"], found["mean_separation"] / length, *times)


def to_text(rows: list[tuple[Any, ...]]) -> str:
    """Rows as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows([f"{value:.8g}" if isinstance(value, float) else value for value in row] for row in rows)
    return text.getvalue()


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--folder", type=click.Path(path_type=pathlib.Path), default=HERE, show_default=True, help="One file a grid."
)
@click.option("--out", "target", type=click.Path(path_type=pathlib.Path), default=TARGET, show_default=True)
@click.option("--collect", is_flag=True, help="Write what there is, no runs.")
def grids(folder: pathlib.Path, target: pathlib.Path, collect: bool) -> None:
    """Solve held-out surfaces on ever finer grids, loads cold and continued: half an hour.

    Stopped and called again, it goes on where it was.
    """
    finest, parts = GRIDS[-1], []
    for grid, recipe, start in tqdm(list(itertools.product(GRIDS, surfaces(), STARTS)), disable=None):
        path = folder / f"{recipe.name}_on_{grid}_of_{finest}_{start}.csv"
        if not path.exists():
            if collect:
                continue
            write_file(path, to_text(list(solve(recipe, grid, finest, start))).encode(), make_folders=True)
        parts.append(path.read_text(encoding="utf-8"))
    write_file(target, (HEAD + ",".join(COLUMNS) + "\n" + "".join(parts)).encode())
    click.echo(f"{target}: {sum(part.count(chr(10)) for part in parts)} loads")
