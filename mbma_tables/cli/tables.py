"""The command group `mbma tables`: which tables there are, what their files say, whether they are sound."""

from __future__ import annotations

from pathlib import Path

import click


def _path(name: str) -> Path:
    """A table by kind, or a file."""
    from mbma_tables.models.tables import shipped
    from mbma_tables.tablefiles.schema import KINDS

    return shipped(name) if name in KINDS else Path(name)


@click.group("tables")
def tables_group() -> None:
    """List, describe and check tables."""


@tables_group.command("list")
def list_command() -> None:
    """Kind, size, nodes and largest held-out error of the shipped tables."""
    from mbma_tables.tablefiles.netcdf import read_table
    from mbma_tables.tablefiles.schema import KINDS

    # all before the first line, so that a failure leaves nothing printed
    for kind, content in [(kind, read_table(_path(kind), kind)) for kind in KINDS]:
        path, facts = _path(kind), content.attributes
        nodes = " x ".join(f"{axis.nodes} {axis.name}" for axis in content.axes)
        errors = ", ".join(f"{f} {facts[f'largest_error_{f}']:.2g}" for f in ("F", "A"))
        click.echo(
            f"{kind}: {nodes}; reading {facts['reading']}; largest held-out error {errors}; "
            f"{path.stat().st_size} bytes; data {facts['data_version']}; {path}"
        )


@tables_group.command("info")
@click.argument("table")
def info_command(table: str) -> None:
    """Axes and attributes of TABLE (a kind or a file)."""
    from mbma_tables.tablefiles.netcdf import read_table
    from mbma_tables.tablefiles.schema import KINDS

    content = read_table(_path(table), table if table in KINDS else None)
    for axis in content.axes:
        click.echo(
            f"axis {axis.name}: {axis.long_name}, {axis.low:g} to {axis.high:g}, {axis.nodes} nodes, {axis.formula()}"
        )
    for name, value in content.attributes.items():
        click.echo(f"{name}: {value}")


@tables_group.command("verify")
@click.argument("tables", nargs=-1)
def verify_command(tables: tuple[str, ...]) -> None:
    """Check hashes and conformance points of TABLES (kinds or files; all shipped ones if none is named).

    The conformance points are answered by the table and by the exact solver, and compared with the stored answers.
    """
    from mbma_tables.models.verify import verify
    from mbma_tables.tablefiles.schema import KINDS

    # all before the first line, so that a failure leaves nothing printed
    for v in [verify(_path(t), t if t in KINDS else None) for t in tables or KINDS]:
        found = f"within {v.solver_error:.1e}" if v.solver_error else "identical to the last bit"
        click.echo(
            f"{v.path}: hashes match; {v.points} conformance points: table within {v.table_error:.1e}, "
            f"exact solver {found}"
        )
