"""The command group `mbma tables`: which tables there are, what they say of themselves, whether they are sound."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from mbma_tables.tablefiles.schema import TableContent


def _path(name: str) -> Path:
    """A table by kind, or a file."""
    from mbma_tables.models.tables import shipped
    from mbma_tables.tablefiles.schema import KINDS

    return shipped(name) if name in KINDS else Path(name)


def _names(given: tuple[str, ...]) -> tuple[str, ...]:
    from mbma_tables.tablefiles.schema import KINDS

    return given or KINDS


def _warn(stale: str | None) -> None:
    if stale is not None:
        click.echo(f"mbma: warning: {stale}", err=True)


def _open(path: Path, kind: str | None = None) -> TableContent:
    """A checked table; one line on stderr where it is stale."""
    from mbma_tables.tablefiles.netcdf import check_table

    content, stale = check_table(path, kind)
    _warn(stale)
    return content


@click.group("tables")
def tables_group() -> None:
    """The tables that stand ready: list, info, verify."""


@tables_group.command("list")
@click.option("--json", "as_json", is_flag=True, help="One JSON object instead of lines.")
def list_command(as_json: bool) -> None:
    """Kind, size, nodes and largest held-out error of the shipped tables."""
    from mbma_tables.tablefiles.schema import KINDS

    rows: list[dict[str, Any]] = []
    for kind in KINDS:
        path = _path(kind)
        content = _open(path, kind)
        rows.append(
            {
                "kind": kind,
                "path": str(path),
                "bytes": path.stat().st_size,
                "nodes": {axis.name: axis.nodes for axis in content.axes},
                "reading": content.attributes["reading"],
                "data_version": content.attributes["data_version"],
                "largest_error": {f: content.attributes[f"largest_error_{f}"] for f in ("F", "A")},
            }
        )
    if as_json:
        click.echo(json.dumps({"tables": rows}, indent=2))
        return
    for row in rows:
        nodes = " x ".join(f"{count} {name}" for name, count in row["nodes"].items())
        errors = ", ".join(f"{f} {error:.2g}" for f, error in row["largest_error"].items())
        click.echo(
            f"{row['kind']}: {nodes}; reading {row['reading']}; largest held-out error {errors}; "
            f"{row['bytes']} bytes; data {row['data_version']}; {row['path']}"
        )


@tables_group.command("info")
@click.argument("table")
@click.option("--json", "as_json", is_flag=True, help="One JSON object instead of lines.")
def info_command(table: str, as_json: bool) -> None:
    """What TABLE (a kind or a file) says of itself."""
    from mbma_tables.tablefiles.schema import KINDS

    content = _open(_path(table), table if table in KINDS else None)
    axes = {axis.name: {**axis.attributes(), "nodes": axis.nodes} for axis in content.axes}
    if as_json:
        click.echo(json.dumps({"axes": axes, "attributes": content.attributes}, indent=2))
        return
    for name, attributes in axes.items():
        click.echo(
            f"axis {name}: {attributes['long_name']}, {attributes['first']:g} to {attributes['last']:g}, "
            f"{attributes['nodes']} nodes, {attributes['position_formula']}"
        )
    for name, value in content.attributes.items():
        click.echo(f"{name}: {value}")


@tables_group.command("verify")
@click.argument("tables", nargs=-1)
@click.option("--resolve", type=click.IntRange(0), default=0, help="Solve this many conformance points anew.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object instead of lines.")
def verify_command(tables: tuple[str, ...], resolve: int, as_json: bool) -> None:
    """Check hashes and conformance points of TABLES (kinds or files; all shipped ones if none is named)."""
    import dataclasses

    from mbma_tables.models.verify import verify
    from mbma_tables.tablefiles.schema import KINDS

    verdicts = [verify(_path(t), t if t in KINDS else None, resolve) for t in _names(tables)]
    if as_json:
        shown = [{**dataclasses.asdict(v), "identical": v.identical} for v in verdicts]
        click.echo(json.dumps({"tables": shown}, indent=2))
    for verdict in verdicts:
        _warn(verdict.stale)
        if as_json:
            continue
        line = f"{verdict.path}: hashes match; conformance points within {verdict.conformance_error:.1e}"
        if verdict.resolved:
            reason = "processor or library version" if verdict.stale is None else "version of the solver"
            found = (
                "identical to the bit"
                if verdict.identical
                else f"equal within {verdict.resolved_error:.1e} (another {reason})"
            )
            line += f"; {verdict.resolved} solved anew: {found}"
        click.echo(line)
