"""`python -m generate boundary_elements`: run the campaign, or gather what there is of it into one file."""

from __future__ import annotations

import functools
import pathlib
import shutil
from collections.abc import Callable, Sequence

import click
from tqdm import tqdm

from generate.boundary_elements.capped import simulate_capped, solve_flow
from generate.boundary_elements.collect import dataset
from generate.boundary_elements.design import Task, campaign
from generate.boundary_elements.solve import simulate, simulate_to
from generate.boundary_elements.surfaces import Recipe
from generate.calibrated_file import write_part
from generate.workers import Pool, attempts, executor

SOLVERS = {"elastic": simulate, "hardness": simulate_capped, "leakage": solve_flow}


def run(
    tasks: Sequence[Task], folder: pathlib.Path, pool: Pool = None, solve: Callable[[Recipe, str], str] = simulate_to
) -> None:
    """Solve what `folder` does not hold yet, one file a surface; no pool: here, one after the other.

    Surfaces that fail are left out until the end, then named.
    """
    folder.mkdir(parents=True, exist_ok=True)
    missing = [task.recipe for task in tasks if not (folder / f"{task.recipe.name}.npz").exists()]
    # a terminal may have no columns
    width, done, failures = shutil.get_terminal_size().columns, len(tasks) - len(missing), list[str]()
    with tqdm(total=len(tasks), initial=done, desc="surfaces", unit="surface", ncols=width, disable=None) as bar:
        for _, finish in attempts(pool, solve, {recipe.name: (recipe, str(folder)) for recipe in missing}):
            try:
                finish()
            except RuntimeError as fault:
                failures.append(str(fault))
            bar.update()
    if failures:
        raise RuntimeError(f"{len(failures)} of {len(missing)} surfaces failed: {failures[0]}")


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--of", "kind", type=click.Choice(list(SOLVERS)), default="elastic", show_default=True)
@click.option("--folder", type=click.Path(path_type=pathlib.Path), help="One file a surface.  [default: its kind]")
@click.option(
    "--collect", "target", type=click.Path(path_type=pathlib.Path), help="Write into this netCDF file, no runs."
)
@click.option("--points", type=click.IntRange(64), default=1024, show_default=True, help="Largest grid to run.")
@click.option("--workers", type=click.IntRange(1), default=1, show_default=True, help="Processes.")
@click.option("--scheduler", help="Address of a dask scheduler, whose workers see this checkout and the folder.")
def boundary_elements(
    kind: str,
    folder: pathlib.Path | None,
    target: pathlib.Path | None,
    points: int,
    workers: int,
    scheduler: str | None,
) -> None:
    """Solve random surfaces by boundary elements (Tamaas, the extra `simulate`): four hours on two cores.

    Of hardness, a solver of its own caps pressures at seven hardnesses: half an hour, no Tamaas. Of leakage, Reynolds'
    equation is solved on the gaps: half an hour.

    Stopped and called again, it goes on where it was. Small grids come first, every kind of surface in turn.
    """
    folder = folder or pathlib.Path("boundary_elements", kind)
    tasks = [task for task in campaign(kind) if task.recipe.points <= points]
    if target is not None:
        data = dataset(tasks, folder, kind)
        write_part(target, data, kind)
        click.echo(f"{target}: {data.sizes['surface']} of {len(tasks)} surfaces, {target.stat().st_size} bytes")
        return
    with executor(workers, scheduler) as pool:
        run(tasks, folder, pool, functools.partial(simulate_to, solve=SOLVERS[kind]))
