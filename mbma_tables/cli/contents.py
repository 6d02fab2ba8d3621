"""`mbma tables show | sample | plot`: what a table's file contains, its numbers and its errors."""

import dataclasses
import functools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import click

from mbma_tables.cli.format import Report
from mbma_tables.cli.options import (
    PICTURES,
    Output,
    json_option,
    numbers_option,
    output_options,
)
from mbma_tables.cli.tables import place_of, print_facts
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import write_file, written_bytes
from mbma_tables.common.netcdf import holds_own, opened, read_own
from mbma_tables.islands.island_models import OUTSIDE
from mbma_tables.tables.function_table import FunctionTable
from mbma_tables.tables.reader import REMEDY, read_any
from mbma_tables.tables.schema import UNIVERSAL, TableContent

# beginnings of the names of attributes, by what they are about; others describe the table
ABOUT = {
    "schema": ("mbma_kind", "format_version", "Conventions", "spline_degree"),
    "certificate": (
        *("target", "certificate", "largest_", "p99_", "median_", "visited_", "members"),
        *("error_field", "conformance", "out_of_range"),
    ),
    "provenance": (
        *("variant", "data_version", "history", "source", "references", "licence"),
        *("versions", "configuration", "function", "values_sha256", "attributes_sha256"),
        *("hashes", "seal"),
    ),
}
DESCRIPTION = "description"


def _read(table: str) -> TableContent | FunctionTable:
    """The contents of a table of islands or of a function, by its kind or file."""
    return read_any(*place_of(table))


def _variables(path: Path) -> dict[str, dict[str, Any]]:
    """Dimensions, shape, range, units and meaning of each variable of a file."""
    described = {}
    with opened(path, REMEDY.format("KIND")) as dataset:
        dataset.set_auto_maskandscale(False)
        for name, variable in dataset.variables.items():
            values = variable[...]
            described[name] = {
                "dimensions": list(variable.dimensions),
                "shape": list(variable.shape),
                "smallest": float(values.min()),
                "largest": float(values.max()),
                "units": variable.units,
                "long_name": variable.long_name,
            }
    return described


def _contents(table: str) -> tuple[dict[str, Any], list[str], dict[str, Any]]:
    """Axes, a line of each, and attributes; of a table of a surface there are no axes."""
    if holds_own(table):
        return {}, [], read_own(table)[1]
    found = _read(table)
    axes: dict[str, Any] = {}
    if isinstance(found, FunctionTable):
        for axis in found.axes:
            axes[axis.name] = dataclasses.asdict(axis)
        return axes, [*map(_line_of_axis, axes.values())], found.attributes
    lines = []
    for side in found.axes:
        axes[side.name] = {**side.attributes(), "nodes": side.nodes}
        line = f"axis {side.name}: {side.long_name}, {side.low:g} to {side.high:g}"
        # the universal table has cells, not nodes
        if found.kind != UNIVERSAL:
            line += f", {side.nodes} nodes, {side.formula()}"
        lines.append(line)
    return axes, lines, found.attributes


def _line_of_axis(axis: Mapping[str, Any]) -> str:
    """An axis of a function."""
    meaning = axis["meaning"] or "an argument of the function"
    offset = f" + {axis['offset']:g}" if axis["offset"] else ""
    spaced = (
        f"log({axis['name']}{offset})" if axis["transform"] == "log" else axis["name"]
    )
    return (
        f"axis {axis['name']}: {meaning}, {axis['low']:g} to {axis['high']:g} "
        f"[{axis['unit']}], cells in {spaced}, outside: {axis['outside']}"
    )


def _line_of_variable(name: str, variable: Mapping[str, Any]) -> str:
    """A variable of a file."""
    sizes = zip(variable["dimensions"], variable["shape"], strict=True)
    over = ", ".join(f"{dimension} {size}" for dimension, size in sizes)
    return (
        f"variable {name} ({over}): {variable['long_name']}, {variable['smallest']:g} to "
        f"{variable['largest']:g} [{variable['units']}]"
    )


def _section_of(name: str) -> str:
    """The section of an attribute."""
    for section, beginnings in ABOUT.items():
        if name.startswith(beginnings):
            return section
    return DESCRIPTION


def _sections(attributes: Mapping[str, Any]) -> Iterator[tuple[str, list[str]]]:
    """Sections and their lines, in the order of `ABOUT`."""
    for section in (*ABOUT, DESCRIPTION):
        names = [name for name in attributes if _section_of(name) == section]
        yield section, [f"{name}: {attributes[name]}" for name in names]


@click.command("show")
@click.argument("table")
@json_option("lines")
def show_command(table: str, as_json: bool) -> None:
    """Schema, axes with their transforms, certificate and provenance of TABLE (a kind or a file).

    Example: mbma tables show universal
    """
    path, _ = place_of(table)
    axes, lines_of_axes, attributes = _contents(table)
    variables = _variables(path)
    lines = []
    for section, entries in _sections(attributes):
        lines += ["", f"{section.upper()}", *entries]
        if section == "schema":
            for name, entry in variables.items():
                lines.append(_line_of_variable(name, entry))
            lines += ["", "AXES", *lines_of_axes] if lines_of_axes else []
    facts = {"variables": variables, "axes": axes, "attributes": attributes}
    print_facts(facts, lines[1:], as_json)


@click.command("plot")
@click.argument("table")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    required=True,
    help="Picture to write: FILE.png, .svg or .pdf.",
)
def plot_command(table: str, out: Path) -> None:
    """Draw the bound on the error of TABLE (a kind or a file) over its grid.

    Of more than two axes the first two are drawn, with the largest bound over the others.

    Example: mbma tables plot universal --out error.svg
    """
    if out.suffix not in PICTURES:
        raise InputError(f"--out must end with one of {', '.join(PICTURES)}, got {out}")
    from mbma_tables.common.plots import to_picture
    from mbma_tables.tables.picture import draw_errors

    write_file(out, to_picture(draw_errors(_read(table)), out.suffix[1:]))


def _axes_at(texts: tuple[str, ...]) -> dict[str, list[float]]:
    """Axes of a function, by name, of texts NAME=NUMBER[,NUMBER]."""
    axes: dict[str, list[float]] = {}
    for text in texts:
        name, equals, numbers = text.partition("=")
        try:
            axes[name] = [float(number) for number in numbers.split(",")]
        except ValueError:
            equals = ""
        if not equals:
            raise InputError(f"--at must be NAME=NUMBER[,NUMBER], got {text!r}")
    return axes


def _given(
    found: Any, axes: dict[str, list[float] | None], at: tuple[str, ...]
) -> dict[str, list[float]]:
    """The numbers along each axis of a table, those that it takes and no others."""
    given = {name: values for name, values in axes.items() if values is not None}
    if isinstance(found, FunctionTable):
        if given:
            raise InputError(
                f"a table of a function takes --at NAME=NUMBER, got {', '.join(given)}"
            )
        return _axes_at(at)
    needed = ("X", "mu") if found.name == UNIVERSAL else tuple(axes)[:4]
    if set(given) != set(needed) or at:
        raise InputError(
            f"a table of kind {found.name} takes {', '.join(needed)}, "
            f"got {', '.join([*given, *at]) or 'none'}"
        )
    return given


@click.command("sample")
@click.argument("table")
@numbers_option("--delta", help="Approach over h_rms, of a table of four numbers,")
@numbers_option("--zeta-d", help="lower magnification,")
@numbers_option("--zeta-u", help="upper magnification,")
@numbers_option("--hurst", help="and Hurst exponent.")
@numbers_option("--X", "X", help="Depth, of a table of two numbers,")
@numbers_option("--mu", help="and stiffness of the roughness.")
@click.option(
    "--at",
    multiple=True,
    metavar="NAME=NUMBER[,NUMBER]",
    help="An axis of a table of a function; once for each.",
)
@click.option(
    "--outside",
    type=click.Choice(OUTSIDE),
    default="raise",
    show_default=True,
    help="Where a table of islands has none: an error, the exact solver, or NaN.",
)
@output_options
def sample_command(
    table: str,
    output: Output,
    outside: str,
    at: tuple[str, ...],
    **axes: list[float] | None,
) -> None:
    """Results and error of TABLE (a kind or a file) at all combinations of the numbers.

    Combinations with zeta_u <= zeta_d are no islands, and NaN with --outside nan.
    With --out FILE.nc it is a netCDF file.

    Example: mbma tables sample universal --X 1,2 --mu 0.1
    """
    from mbma_tables.tables.open import open_table

    path, kind = place_of(table)
    found = open_table(kind or path)
    given = _given(found, axes, at)
    if isinstance(found, FunctionTable):
        dataset = found.to_dataset(**given)
        # bounds are in the units of what they bound
        units = {str(name): dataset[name].attrs["units"] for name in dataset.variables}
        facts = {"table": table, "function": found.attributes["function"]}
    else:
        dataset = found.to_dataset(**given, outside=outside)
        units = {"error": "relative"}
        version = found.content.attributes["data_version"]
        facts = {"table": table, "data_version": version}
    if output.out is not None and output.out.suffix == ".nc":
        write = functools.partial(dataset.to_netcdf, engine="netcdf4")
        write_file(output.out, written_bytes("sample.nc", write))
        return
    columns = dataset.to_dataframe(dim_order=list(dataset.dims)).reset_index()
    values = {str(name): columns[name].to_numpy() for name in columns}
    Report("tables sample", f"values of {table}", [], facts, values, units).write(output)
