"""`mbma tables`: make tables, export and verify their files; and `mbma cache`, stored simulations."""

import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click

from mbma_tables.cli.options import json_option, work_options
from mbma_tables.common import cache
from mbma_tables.common.arguments import nearest
from mbma_tables.common.errors import InputError, TableFileError
from mbma_tables.common.files import write_file
from mbma_tables.common.netcdf import OWN, OWN_REMEDY, holds_own
from mbma_tables.common.progress import echo
from mbma_tables.common.workers import part_of
from mbma_tables.tables.function_table import KIND as FUNCTION
from mbma_tables.tables.function_table import REMEDY as OF_FUNCTIONS
from mbma_tables.tables.function_table import FunctionTable
from mbma_tables.tables.members import RULES
from mbma_tables.tables.reader import read_any
from mbma_tables.tables.schema import KINDS

FAITHFUL = 1e-6  # relative, of an own table's curves at the loads they go through


def place_of(name: str) -> tuple[Path, str | None]:
    """Path and kind of a table; for a file, whose kind is unknown, None."""
    from mbma_tables.tables.open import shipped

    if name not in KINDS and not Path(name).exists():
        raise InputError(
            f"no table and no file is called {name!r}: the tables are {' and '.join(KINDS)}"
        )
    return (shipped(name), name) if name in KINDS else (Path(name), None)


def print_facts(content: Any, lines: Iterable[str], as_json: bool) -> None:
    """Print facts as JSON, or lines of text."""
    echo(json.dumps(content, indent=2) if as_json else "\n".join(lines))


@click.group("tables", no_args_is_help=False)
def tables_group() -> None:
    """Make, describe and check tables."""


def _verified(table: str) -> tuple[dict[str, Any], str]:
    """What a check of a table found, and a line of it."""
    from mbma_tables.tables.open import verify

    if holds_own(table):
        import numpy as np

        from mbma_tables.theories import BoundaryElements

        theory = BoundaryElements.from_netcdf(table)
        answer = theory.answer(theory.surface, theory.rows[2])
        error = float(np.abs(np.array(answer[:2]) / theory.rows[:2] - 1).max())
        loads = theory.rows.shape[1]
        if not error <= FAITHFUL:
            raise TableFileError(
                f"{table}: its curves miss its simulated loads by {error:.1e}; {OWN_REMEDY}"
            )
        found: dict[str, Any] = {
            "path": table,
            "kind": OWN,
            "points": loads,
            "table_error": error,
        }
        return (
            found,
            f"{table}: hashes match; {loads} simulated loads: curves within {error:.1e}",
        )
    path, kind = place_of(table)
    if kind is None and isinstance(contents := read_any(path), FunctionTable):
        points, excess = contents.replayed()
        if not excess <= 1:
            raise TableFileError(
                f"{table}: at a conformance point its error is {excess:.3g} times its bound; {OF_FUNCTIONS}"
            )
        return (
            {
                "path": table,
                "kind": FUNCTION,
                "points": points,
                "error_over_bound": excess,
            },
            f"{table}: hashes match; {points} conformance points: values of its function "
            f"within {excess:.2g} of the bounds",
        )
    v = verify(path, kind)
    solver = (
        f"within {v.solver_error:.1e}" if v.solver_error else "identical to the last bit"
    )
    text = f"{v.path}: hashes match; {v.points} conformance points: table within {v.table_error:.1e}, exact solver "
    return v._asdict(), text + solver


def _read_aloud(forecast: Any) -> str:
    return (
        f"{forecast.points} points, {forecast.islands} islands to solve: about "
        f"{forecast.seconds:.0f} s and {forecast.bytes / 1e6:.1f} MB"
    )


@tables_group.command("make")
@click.argument("kind", metavar="{universal|island4d|MODULE:FUNCTION}")
@click.option(
    "--config",
    type=click.Path(path_type=Path),
    help="TOML file: changes the shipped configuration of a kind, or has the axes of a "
    "function; --example prints one.",
)
@click.option("--target", type=float, help="Largest error on held-out points.")
@click.option("--out", type=click.Path(path_type=Path), help="File to write.")
@click.option(
    "--workers",
    type=click.IntRange(1),
    default=os.cpu_count() or 1,
    show_default=True,
    help="Processes.",
)
@click.option("--example", is_flag=True, help="Print a configuration with every key.")
@click.option(
    "--dry-run", is_flag=True, help="Print points, time and size; make nothing."
)
@click.option(
    "--resume", is_flag=True, help="Of a function: go on with a run that ended early."
)
@work_options("Of a function: ")
def make_command(
    kind: str,
    config: Path | None,
    target: float | None,
    out: Path | None,
    workers: int,
    example: bool,
    dry_run: bool,
    **of_function: Any,
) -> None:
    """Make a table of a KIND of islands, or of any function of 1 to 6 numbers.

    Islands are those of two numbers (universal) or of the paper's four (island4d); a
    function is one of a Python module, such as my_model:force. The table is certified on
    points that no node saw and written whole, or not at all.

    Example: mbma tables make island4d --target 1e-3 --out mine.nc
    """
    from mbma_tables.tables import make

    if kind not in KINDS and ":" not in kind:
        raise InputError(
            f"KIND is {', '.join(KINDS)}, or a function as module:function, got {kind!r}; "
            f"{nearest(kind, KINDS)}"
        )
    if example:
        echo(make.example(kind), nl=False)
        return
    if ":" in kind:
        _make_of_function(kind, config, target, out, workers, dry_run, **of_function)
        return
    given = [name for name, value in of_function.items() if value]
    if given:
        name = given[0].replace("_", "-")
        raise InputError(f"--{name} is for tables of functions, got KIND {kind}")
    from mbma_tables.tables.configuration import load

    configuration = load(kind, config, target)
    if dry_run:
        echo(_read_aloud(make.forecast(configuration, workers)))
        return
    if out is None:
        raise InputError("--out must name the file to write, such as --out mine.nc")
    content = make.make_table(configuration, out, workers)
    echo(make.summary(out, content))


def _make_of_function(
    reference: str,
    config: Path | None,
    target: float | None,
    out: Path | None,
    workers: int,
    dry_run: bool,
    resume: bool,
    part: str | None,
    scheduler: str | None,
    local_cluster: int | None,
) -> None:
    from mbma_tables.tables import make_function
    from mbma_tables.tables.make import check_place

    if config is None:
        raise InputError(
            "--config must name a TOML file with the axes of the function; --example prints one"
        )
    wanted = make_function.load(config, reference, target)
    if dry_run:
        echo(make_function.forecast(wanted))
        return
    if out is None:
        raise InputError("--out must name the file to write, such as --out mine.nc")
    check_place(out)
    table = make_function.make(
        wanted, out, workers, resume, part_of(part), scheduler, local_cluster
    )
    if table is None:
        echo(f"part {part}: its pieces are in {make_function.folder_of(out)}")
        return
    echo(f"{out}: {table!r}")


@tables_group.command("export")
@click.argument("language", metavar="{c|fortran|javascript|matlab|python}")
@click.argument("table", type=click.Path(path_type=Path))
@click.option("--name", default="table", show_default=True, help="Of the function.")
@click.option("--member", help="Of a table with members: one, in place of its value.")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path(),
    help="Folder of the files; default: this one.",
)
def export_command(
    language: str, table: Path, name: str, member: str | None, out: Path
) -> None:
    """Write TABLE, a file made of a function, as source code: an evaluator and the table as data.

    Each has a self-test; islands are exported by `mbma export c --table`.

    Example: mbma tables export c mine.nc --name force
    """
    from mbma_tables.export.model.function_code import function_code
    from mbma_tables.export.text import written_by
    from mbma_tables.tables.function_table import FunctionTable
    from mbma_tables.tables.open import open_table

    opened = open_table(table)
    if not isinstance(opened, FunctionTable):
        raise InputError(
            f"{table} holds islands: `mbma export c --table {table}` writes them as C"
        )
    arguments = [language, str(table), "--name", name]
    if member is not None:
        opened = opened.member(member)
        arguments += ["--member", member]
    command = written_by(arguments, "tables export")
    for file, text in function_code(opened, language, name, command).items():
        write_file(out / file, text.encode(), make_folders=True)
        echo(out / file)


@tables_group.command("merge")
@click.argument("out", type=click.Path(path_type=Path))
@click.argument("parts", nargs=-1, type=click.Path(path_type=Path))
@click.option(
    "--members",
    "rule",
    type=click.Choice([*RULES]),
    help="PARTS are tables, and members of OUT by this rule.",
)
@click.option(
    "--name",
    "names",
    multiple=True,
    help="Of a member, once for each; default: those of their functions.",
)
def merge_command(
    out: Path, parts: tuple[Path, ...], rule: str | None, names: tuple[str, ...]
) -> None:
    """Make the table OUT of pieces that were made in parts, in the folders PARTS (default: OUT.pieces).

    With --members PARTS are tables of functions with the same axes and outputs, and become
    members of one table.

    Example: mbma tables merge mine.nc
    """
    from mbma_tables.tables import make_function
    from mbma_tables.tables.make import check_place

    check_place(out)
    if rule is not None:
        from mbma_tables.tables.merged_members import merge_members

        echo(f"{out}: {merge_members(out, parts, rule, names)!r}")
        return
    if names:
        raise InputError("--name is of members: --members says by which rule")
    folders = list(parts) or [make_function.folder_of(out)]
    files = [folder for folder in folders if folder.is_file()]
    if files:
        raise InputError(
            f"{files[0]} is a file: pieces are in folders; --members merges tables as members"
        )
    table = make_function.merge(out, folders)
    echo(f"{out}: {table!r}")


@tables_group.command("verify")
@click.argument("tables", nargs=-1)
@json_option("lines")
def verify_command(tables: tuple[str, ...], as_json: bool) -> None:
    """Check hashes and conformance points of TABLES (kinds or files; all shipped ones if none is named).

    The conformance points are answered by the table and by the exact solver, and compared
    with the stored answers; of a table of your own surface the simulated loads are. A
    table of a function is compared with the values of its function that it keeps.
    """
    verdicts, lines = zip(*map(_verified, tables or KINDS), strict=True)
    print_facts({"tables": verdicts}, lines, as_json)


@click.command("cache", short_help="Simulations that are kept.")
@click.option("--clear", is_flag=True, help="Remove them all.")
@json_option("a line")
def cache_command(clear: bool, as_json: bool) -> None:
    """Folder in which loads and flows of simulated maps are stored, number of files, and their size.

    The environment variable MBMA_TABLES_CACHE names another folder; "off" disables the
    cache. When it exceeds 1 GiB, the files used longest ago are removed.

    Example: mbma cache --clear
    """
    place = cache.folder()
    removed = cache.trim(0) if clear else 0
    kept = cache.files()
    size = sum(stat.st_size for _, stat in kept)
    facts = {
        "folder": None if place is None else str(place),
        "files": len(kept),
        "bytes": size,
        "removed": removed,
    }
    line = f"{place}: {len(kept)} files, {size} bytes" + (
        f"; {removed} removed" if clear else ""
    )
    print_facts(
        facts,
        [f"nothing is kept: {cache.VARIABLE} is off" if place is None else line],
        as_json,
    )
