"""The command group `mbma tables`: which tables there are, what their files say, whether they are sound."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from mbma_tables.common.errors import InputError
from mbma_tables.common.progress import echo


def _path(name: str) -> Path:
    """A table by kind, or a file."""
    from mbma_tables.models.tables import shipped
    from mbma_tables.tablefiles.schema import KINDS

    if name in KINDS:
        return shipped(name)
    if not Path(name).exists():
        raise InputError(f"no table and no file is called {name!r}: the tables are {' and '.join(KINDS)}")
    return Path(name)


@click.group("tables", no_args_is_help=False)
def tables_group() -> None:
    """List, describe and check tables."""


@tables_group.command("list")
@click.option("--json", "as_json", is_flag=True, help="One JSON object instead of lines.")
def list_command(as_json: bool) -> None:
    """Kind, size, nodes and largest held-out error of the shipped tables."""
    from mbma_tables.tablefiles.netcdf import read_table
    from mbma_tables.tablefiles.schema import KINDS

    rows: list[dict[str, Any]] = []
    for kind in KINDS:
        path = _path(kind)
        content = read_table(path, kind)
        rows.append(
            {
                "kind": kind,
                "path": str(path),
                "bytes": path.stat().st_size,
                "size": content.size,
                "variant": content.attributes["variant"],
                "data_version": content.attributes["data_version"],
                "largest_error": {f: content.attributes[f"largest_error_{f}"] for f in ("F", "A")},
            }
        )
    if as_json:
        echo(json.dumps({"tables": rows}, indent=2))
        return
    for row in rows:
        errors = ", ".join(f"{f} {error:.2g}" for f, error in row["largest_error"].items())
        echo(
            f"{row['kind']}: {row['size']}; variant {row['variant']}; largest held-out error {errors}; "
            f"{row['bytes']} bytes; data {row['data_version']}; {row['path']}"
        )


@tables_group.command("info")
@click.argument("table")
@click.option("--json", "as_json", is_flag=True, help="One JSON object instead of lines.")
def info_command(table: str, as_json: bool) -> None:
    """Axes and attributes of TABLE (a kind or a file)."""
    from mbma_tables.tablefiles.netcdf import read_table
    from mbma_tables.tablefiles.schema import KINDS, UNIVERSAL

    content = read_table(_path(table), table if table in KINDS else None)
    axes = {axis.name: {**axis.attributes(), "nodes": axis.nodes} for axis in content.axes}
    if as_json:
        echo(json.dumps({"axes": axes, "attributes": content.attributes}, indent=2))
        return
    for name, attributes in axes.items():
        # the universal table has cells, not nodes
        nodes = "" if content.kind == UNIVERSAL else f", {attributes['nodes']} nodes, {attributes['position_formula']}"
        echo(f"axis {name}: {attributes['long_name']}, {attributes['first']:g} to {attributes['last']:g}{nodes}")
    for name, value in content.attributes.items():
        echo(f"{name}: {value}")


@tables_group.command("verify")
@click.argument("tables", nargs=-1)
@click.option("--json", "as_json", is_flag=True, help="One JSON object instead of lines.")
def verify_command(tables: tuple[str, ...], as_json: bool) -> None:
    """Check hashes and conformance points of TABLES (kinds or files; all shipped ones if none is named).

    The conformance points are answered by the table and by the exact solver, and compared with the stored answers.
    """
    from mbma_tables.models.tables import verify
    from mbma_tables.tablefiles.schema import KINDS

    verdicts = [verify(_path(t), t if t in KINDS else None) for t in tables or KINDS]
    if as_json:
        echo(json.dumps({"tables": [v._asdict() for v in verdicts]}, indent=2))
        return
    for v in verdicts:
        found = f"within {v.solver_error:.1e}" if v.solver_error else "identical to the last bit"
        echo(
            f"{v.path}: hashes match; {v.points} conformance points: table within {v.table_error:.1e}, "
            f"exact solver {found}"
        )
