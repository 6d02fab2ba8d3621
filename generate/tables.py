"""`python -m generate tables`: make the tables and the coefficients of the height integrals."""

import os
import pathlib

import click

from generate.files import ROOT
from mbma_tables.common.errors import InputError
from mbma_tables.tables.configuration import MIN_SHIPPED_POINTS, Configuration, load
from mbma_tables.tables.make import KINDS, make_table, summary

TABLES = ROOT / "tables"


@click.command()
@click.argument("what", type=click.Choice([*KINDS, "heights", "all"]))
@click.option(
    "--config",
    type=click.Path(path_type=pathlib.Path),
    help="TOML file that changes the shipped configuration.",
)
@click.option("--target", type=float, help="Largest relative error on held-out points.")
@click.option(
    "--out",
    type=click.Path(path_type=pathlib.Path),
    help="File (for all: folder); default tables/.",
)
@click.option(
    "--workers",
    type=click.IntRange(1),
    default=os.cpu_count() or 1,
    show_default=True,
    help="Processes.",
)
def tables(
    what: str,
    config: pathlib.Path | None,
    target: float | None,
    out: pathlib.Path | None,
    workers: int,
) -> None:
    """Make a table, the coefficients of the height integrals (heights), or all of them in order."""
    if what in ("all", "heights") and (config is not None or target is not None):
        raise InputError("--config and --target belong to one table")
    chosen = dict[pathlib.Path, Configuration]()
    for own in (load(kind, config, target) for kind in KINDS if what in (kind, "all")):
        path = out if out and what != "all" else (out or TABLES) / f"{own.kind}.nc"
        # the shipped folder takes only what is certified on enough points
        if (
            path.resolve().parent == TABLES.resolve()
            and own.certificate_points < MIN_SHIPPED_POINTS
        ):
            raise InputError(
                f"certificate_points must be at least {MIN_SHIPPED_POINTS} for a table in {TABLES}, "
                f"got {own.certificate_points}; give another place with --out"
            )
        chosen[path] = own
    if what in ("all", "heights"):
        from generate import height_coefficients

        height_coefficients.main()
    for path, configuration in chosen.items():
        if what == "all":
            path.parent.mkdir(parents=True, exist_ok=True)
        click.echo(summary(path, make_table(configuration, path, workers)))
