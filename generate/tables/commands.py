"""`python -m generate tables`: remake the tables and the coefficients of the height integrals."""

from __future__ import annotations

import contextlib
import os
import pathlib
import shutil
import time
from collections.abc import Iterator

import click

from generate.tables import height_coefficients
from generate.tables.campaign import Campaign, CampaignError, Executor, Workers
from generate.tables.configuration import FEWEST_SHIPPED, Configuration, load
from mbma_tables.errors import InputError

TABLES = pathlib.Path(__file__).parents[2] / "tables"


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
            raise InputError("--scheduler needs dask: pip install 'mbma_tables[distributed]'") from None
        with Workers(workers) as pool:
            yield pool
        return
    with contextlib.ExitStack() as stack:
        if scheduler is None:
            cluster = distributed.LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)
            client = stack.enter_context(distributed.Client(stack.enter_context(cluster)))
        else:
            try:
                client = stack.enter_context(distributed.Client(scheduler))
            except (OSError, ValueError) as fault:
                raise CampaignError(f"no dask scheduler at {scheduler}: {fault}") from None
        try:
            yield client.get_executor()
        except (distributed.KilledWorker, ImportError, RuntimeError) as fault:
            if isinstance(fault, CampaignError):
                raise
            raise CampaignError(
                f"dask: {fault} (scheduler and workers need this checkout on their path); "
                "--resume goes on from the chunks that are done"
            ) from None


def destination(what: str, configuration: Configuration, out: pathlib.Path | None) -> pathlib.Path:
    """Where a table goes; the folder that is shipped takes only what is certified on enough points."""
    own = f"{configuration.kind}.nc"
    path = TABLES / own if out is None else out / own if what == "all" else out
    if path.resolve().parent == TABLES.resolve() and configuration.certificate_points < FEWEST_SHIPPED:
        raise InputError(
            f"certificate_points must be at least {FEWEST_SHIPPED} for a table in {TABLES}, "
            f"got {configuration.certificate_points}; give another place with --out"
        )
    if path.is_dir():
        raise InputError(f"--out must name a file for one table, {path} is a folder")
    return path


def make_table(configuration: Configuration, target: pathlib.Path, executor: Executor | None, resume: bool) -> None:
    """Build, certify and write one table."""
    from generate.tables.build import Kind, UncertifiedError, build
    from generate.tables.island4d import Island4d
    from generate.tables.universal import Universal
    from mbma_tables.tablefiles.netcdf import write_table
    from mbma_tables.tablefiles.schema import UNIVERSAL

    started = time.perf_counter()
    checkpoints = target.parent / f".{target.name}.checkpoints"
    kind: Kind = Universal(configuration) if configuration.kind == UNIVERSAL else Island4d(configuration)
    try:
        content = build(kind, configuration, Campaign(executor, checkpoints, resume))
    except UncertifiedError:
        # another resolution shares no chunks with this one
        shutil.rmtree(checkpoints, ignore_errors=True)
        raise
    write_table(target, content)
    shutil.rmtree(checkpoints, ignore_errors=True)
    shape = " x ".join(f"{axis.nodes} {axis.name}" for axis in content.axes)
    errors = ", ".join(f"{f} {content.attributes[f'largest_error_{f}']:.2e}" for f in ("F", "A"))
    click.echo(f"{target}: {shape}; largest held-out error {errors}; {target.stat().st_size} bytes")
    click.echo(f"errors by axis (F, A): {content.attributes['axis_errors']}", err=True)
    click.echo(f"{time.perf_counter() - started:.1f} s", err=True)


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("what", type=click.Choice(["universal", "island4d", "heights", "all"]))
@click.option(
    "--config", type=click.Path(path_type=pathlib.Path), help="TOML file that changes the shipped configuration."
)
@click.option("--target", type=float, help="Largest relative error on held-out points.")
@click.option(
    "--out", type=click.Path(path_type=pathlib.Path), help="File to write (a folder for all); default tables/."
)
@click.option("--workers", type=click.IntRange(1), default=os.cpu_count() or 1, show_default=True, help="Processes.")
@click.option("--resume", is_flag=True, help="Go on from the chunks that an earlier run finished.")
@click.option(
    "--scheduler", help="Address of a dask scheduler to run on; it and its workers need this checkout on their path."
)
@click.option("--processes", is_flag=True, help="Plain processes even where dask is installed.")
def tables(
    what: str,
    config: pathlib.Path | None,
    target: float | None,
    out: pathlib.Path | None,
    workers: int,
    resume: bool,
    scheduler: str | None,
    processes: bool,
) -> None:
    """Remake the table universal or island4d, the coefficients of the height integrals (heights), or all of it."""
    if what in ("all", "heights") and (config is not None or target is not None):
        raise InputError("--config and --target belong to one table")
    kinds: tuple[str, ...] = {"all": ("universal", "island4d"), "heights": ()}.get(what, (what,))
    configurations = [load(kind, config, target) for kind in kinds]
    paths = [destination(what, configuration, out) for configuration in configurations]
    if what in ("all", "heights"):
        height_coefficients.main()
    with engine(workers, scheduler, processes) as executor:
        for configuration, path in zip(configurations, paths, strict=True):
            path.parent.mkdir(parents=True, exist_ok=True)
            make_table(configuration, path, executor, resume)
