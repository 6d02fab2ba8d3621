"""`python -m generate machined`: press maps as machines make them, or gather what there is of them into one file."""

from __future__ import annotations

import functools
import pathlib
from typing import Any, cast

import click

from generate.boundary_elements.design import Task
from generate.boundary_elements.run import run
from generate.boundary_elements.solve import simulate_to
from generate.machined.makers import FAMILIES, Part
from generate.machined.solve import solved

NUMBERS = 5  # parts of each family


def parts() -> list[Part]:
    """Every part, families in turn, so that stopping early leaves a balanced set."""
    return [Part(family, number) for number in range(NUMBERS) for family in FAMILIES]


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--folder", type=click.Path(path_type=pathlib.Path), default="machined", show_default=True)
@click.option("--workers", type=click.IntRange(1), default=1, show_default=True, help="Processes.")
def machined(folder: pathlib.Path, workers: int) -> None:
    """Press maps of machined surfaces by boundary elements (Tamaas): a quarter of an hour on two cores.

    Stopped and called again, it goes on where it was.
    """
    from generate.tables.commands import executor

    tasks: list[Any] = [Task(cast(Any, part), "") for part in parts()]
    with executor(workers, None) as pool:
        run(tasks, folder, pool, functools.partial(simulate_to, solve=cast(Any, solved)))
