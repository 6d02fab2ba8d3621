"""`python -m generate`: make anew what the library ships."""

from __future__ import annotations

import contextlib
import os
import pathlib
import shutil
import sys
import time
from collections.abc import Iterator

import click

from generate import height_coefficients
from generate.campaign import Campaign, CampaignError, Executor, Workers
from generate.configuration import Configuration, load
from mbma_tables.errors import MbmaError

TABLES = pathlib.Path(__file__).parents[1] / "tables"


@contextlib.contextmanager
def engine(workers: int, scheduler: str | None, processes: bool) -> Iterator[Executor | None]:
    """Where chunks run: a dask scheduler, a local dask cluster where dask is installed, or plain processes."""
    if scheduler is None and (processes or workers <= 1):
        if workers <= 1:
            yield None
            return
        with Workers(workers) as pool:
            yield pool
        return
    try:
        import distributed
    except ImportError:
        if scheduler is not None:
            raise click.UsageError("--scheduler needs dask: pip install 'mbma_tables[distributed]'") from None
        with Workers(workers) as pool:
            yield pool
        return
    with contextlib.ExitStack() as stack:
        if scheduler is None:
            cluster = distributed.LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)
            client = stack.enter_context(distributed.Client(stack.enter_context(cluster)))
        else:
            client = stack.enter_context(distributed.Client(scheduler))
        yield client.get_executor()


def make_table(configuration: Configuration, target: pathlib.Path, executor: Executor | None, resume: bool) -> None:
    """Build, certify and write one table."""
    from generate.build import Kind, build
    from generate.island4d import Island4d
    from generate.universal import Universal
    from mbma_tables.tablefiles.files import write_table
    from mbma_tables.tablefiles.schema import UNIVERSAL

    started = time.perf_counter()
    checkpoints = target.parent / f".{target.name}.checkpoints"
    if not resume:
        shutil.rmtree(checkpoints, ignore_errors=True)
    kind: Kind = Universal(configuration) if configuration.kind == UNIVERSAL else Island4d(configuration)
    content = build(kind, configuration, Campaign(executor, checkpoints))
    write_table(target, content)
    shutil.rmtree(checkpoints, ignore_errors=True)
    shape = " x ".join(f"{axis.nodes} {axis.name}" for axis in content.axes)
    errors = ", ".join(f"{f} {content.attributes[f'largest_error_{f}']:.2e}" for f in ("F", "A"))
    click.echo(f"{target}: {shape}; largest held-out error {errors}; {target.stat().st_size} bytes")
    click.echo(f"errors by axis (F, A): {content.attributes['axis_errors']}", err=True)
    click.echo(f"{time.perf_counter() - started:.1f} s", err=True)


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("what", type=click.Choice(["universal", "island4d", "all"]))
@click.option(
    "--config", type=click.Path(path_type=pathlib.Path), help="TOML file that changes the shipped configuration."
)
@click.option("--target", type=float, help="Largest relative error on held-out points.")
@click.option(
    "--out", type=click.Path(path_type=pathlib.Path), help="File to write (a folder for all); default tables/."
)
@click.option("--workers", type=click.IntRange(1), default=os.cpu_count() or 1, show_default=True, help="Processes.")
@click.option("--resume", is_flag=True, help="Go on from the chunks that an earlier run finished.")
@click.option("--scheduler", help="Address of a dask scheduler to run on.")
@click.option("--processes", is_flag=True, help="Plain processes even where dask is installed.")
def main(
    what: str,
    config: pathlib.Path | None,
    target: float | None,
    out: pathlib.Path | None,
    workers: int,
    resume: bool,
    scheduler: str | None,
    processes: bool,
) -> None:
    """Make tables anew: universal, island4d, or all (with the coefficients of the height integrals)."""
    if what == "all" and (config is not None or target is not None):
        raise click.UsageError("--config and --target belong to one table, not to all")
    try:
        kinds = ("universal", "island4d") if what == "all" else (what,)
        chosen = [(kind, load(kind, config, target)) for kind in kinds]
        if what == "all":
            height_coefficients.main()
        with engine(workers, scheduler, processes) as executor:
            for kind, configuration in chosen:
                folder = (out if what == "all" else None) or TABLES
                path = out if out is not None and what != "all" else folder / f"{kind}.nc"
                path.parent.mkdir(parents=True, exist_ok=True)
                make_table(configuration, path, executor, resume)
    except (MbmaError, CampaignError, OSError) as fault:
        click.echo(f"generate: {fault}", err=True)
        sys.exit(2)


if __name__ == "__main__":
    main()
