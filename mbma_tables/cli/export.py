"""`mbma export`: contact laws for other codes, laws as data, and the whole model as source code."""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mbma_tables.bodies.materials import tangential_ratio
from mbma_tables.cli import options
from mbma_tables.common.arguments import require_name
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import MAX_BYTES, read_file, write_file
from mbma_tables.common.progress import echo
from mbma_tables.design.scenes.specimen import Specimen
from mbma_tables.export.targets import (
    OPTIONS,
    Target,
    require_quantity,
    targets,
    write_files,
)
from mbma_tables.export.text import written_by

if TYPE_CHECKING:
    from mbma_tables.export.law_table import LawTable

DEFAULTS = {"variant": "reported", "check": False}


class _Export(click.Command):
    """The command, whose help lists the targets."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        formatter.write_paragraph()
        formatter.write_text(f"Targets: {', '.join(targets())}.")


@click.command(
    "export",
    cls=_Export,
    short_help="A contact law, or the whole model, for other codes.",
)
@click.argument("target", metavar="TARGET")
@click.option(
    "--out",
    required=True,
    type=click.Path(path_type=Path),
    help="File to write; a folder for source code.",
)
@options.optional_specimen_options
@options.file_options
@click.option(
    "--conductivity",
    type=float,
    help="k_s = 2 k1 k2/(k1 + k2): conductance against pressure, or as well.",
)
@click.option(
    "--conductivity-unit",
    help="Unit of k_s, such as mW/(mm K); conductance is in that over length.",
)
@click.option(
    "--nu",
    "kappa",
    type=float,
    callback=lambda _, __, nu: None if nu is None else float(tangential_ratio(nu)),
    help="Poisson's ratio of both bodies: tangential stiffness against pressure, or as well.",
)
@click.option(
    "--friction",
    type=float,
    help="Coefficient for friction cards, whose stiffness before slip needs --nu.",
)
@click.option(
    "--direction",
    metavar="x|y|DEGREES",
    help="Of leakage of a map; else the mean of both axes.",
)
@options.theory_option
@options.hardness_option
@options.variant_option
@click.option(
    "--table",
    help="Of the whole model: FILE.nc of a universal table, in place of the shipped one.",
)
@click.option(
    "--check",
    is_flag=True,
    help="Of the whole model: build it and replay its conformance points.",
)
def export_command(target: str, out: Path, asked: dict[str, Any], **values: Any) -> None:
    """Write TARGET to a file.

    Solvers and data take a surface, a modulus and units, and so do laws as code (-law),
    subroutines of solvers (abaqus-uinter, abaqus-gapcon, calculix-gapcon), and an FMU of
    FMI 2 (fmu); c is the whole model as code, of the paper's variants reported and printed.

    Example: mbma export calculix --surface concrete --E-star 13.3MPa --out law.inp
    """
    require_name("target", target, targets())
    given = {
        name: value
        for name, value in values.items()
        if value is not None and value != DEFAULTS.get(name)
    } | asked
    kind = targets()[target]
    code = target in targets("CODE")
    _refuse_unused(kind, given, code)
    if "direction" in given and "leakage" not in given:
        raise InputError("--direction is of leakage: add --leakage or leave it out")
    if code:
        _export_code(out, values["variant"], values["table"], "check" in given)
        return
    specimen = _checked_specimen(given.pop("specimen", None))
    if kind.units is not None:
        specimen = specimen.in_units(*kind.units)
    file_name = None if str(out) == "-" else out
    named, line_of_name = kind.place_of_name(given.pop("name", None), file_name)
    law: dict[str, Any] = {
        name: getattr(specimen, name) for name in ("surface", "E_star", "stress_unit")
    }
    law["made_by"] = (*line_of_name, *_inputs(), written_by(_context().obj[1:]))
    if kind.rows:
        files = kind.files(_rows(kind, law | given), **named)
    else:
        files = kind.files(**law, **given, **named)
    show_written(kind, out, files)


def _context() -> click.Context:
    return click.get_current_context()


def _refuse_unused(kind: Target, given: Mapping[str, Any], code: bool) -> None:
    """Refuse options without effect."""
    words = {"specimen": "the surface", "kappa": "--nu"}
    taken = kind.takes if code else kind.takes | {"specimen", "name"}
    unused = [
        words.get(name, f"--{name.replace('_', '-')}")
        for name in sorted(given)
        if name not in taken
    ]
    if unused:
        raise InputError(
            f"without effect on {kind.name}: leave {' and '.join(unused)} out"
        )


def _checked_specimen(specimen: Specimen | None) -> Specimen:
    if specimen is None:
        raise InputError(
            "one surface is needed: see the options --surface, --file, --map, --hurst"
        )
    if specimen.E_star is None:
        raise InputError("a modulus is needed: --E-star, or all of --E1 --nu1 --E2 --nu2")
    return specimen


def _inputs() -> Iterator[str]:
    """Lines of a header with the files that were read, and their digests."""
    asked = _context().params
    inputs = [asked[key] for key in ("file", "map") if asked[key]]
    for path in [path for path in inputs if path.suffix == ".toml"]:
        table = tomllib.loads(read_file(path, MAX_BYTES).decode()).get("surface", {})
        inputs += [path.parent / table["map"]] if "map" in table else []
    for path in inputs:
        digest = hashlib.sha256(read_file(path, MAX_BYTES)).hexdigest()
        yield f"input {path}: sha256 {digest}"


def show_written(kind: Target, out: Path, files: Mapping[str, bytes]) -> None:
    """Write the files of a target and print their paths; to standard output the first one alone."""
    if str(out) == "-":
        write_first(kind, files[""])
        return
    for path in write_files(out, files):
        echo(path)


def write_first(kind: Target, content: bytes) -> None:
    """Write the first file of a target to standard output, and name those that are left out.

    Raises
    ------
    InputError
        Where the first file needs the others.
    """
    beside = ", ".join(f"NAME{end}" for end in kind.beside)
    if not kind.alone:
        raise InputError(
            f"{kind.name} is several files, of which the first needs {beside}: --out FILE writes all"
        )
    write_file(Path("-"), content)
    if beside:
        echo(f"left out: {beside}; --out FILE writes all", err=True)


def _rows(target: Target, asked: dict[str, Any]) -> LawTable | list[LawTable]:
    """Rows of each quantity; requested pressures at which they are not valid are reported."""
    heat = (
        "solid_conductance"
        if asked.keys() & {"conductivity", "conductivity_unit"}
        else target.quantity
    )
    leakage = asked.pop("leakage", False)
    names = asked.pop("quantity", ["leakage" if leakage else heat])
    for name in names:
        require_quantity(name)
    if len(names) > 1 and not target.several:
        raise InputError(f"{target.name} has one quantity a file: give one of {names}")
    laws = []
    for name in names:
        of_others: set[str] = set()
        for other in names:
            of_others |= OPTIONS.get(other, set())
        of_others -= OPTIONS.get(name, set())
        own = {key: value for key, value in asked.items() if key not in of_others}
        laws.append(_rows_of(target, name, own))
    return laws[0] if len(laws) == 1 else laws


def _rows_of(target: Target, quantity: str, asked: dict[str, Any]) -> LawTable:
    from mbma_tables.export.rows.law_rows import describe_law

    asked = asked | {"quantity": quantity, "most_rows": target.most.get(quantity)}
    # of Lethe, whose numbers do not depend on the conductivity
    if target.quantity == "solid_conductance":
        asked = {"conductivity": 1.0, "conductivity_unit": "W/(m K)"} | asked
    law = describe_law(**asked)
    if "pressures" not in asked:
        return law
    rows = law.behaviour or law
    for line in rows.comments:
        # a limit below the smallest requested pressure does not matter
        below = line.startswith("not valid below") and rows.y_name == "pressure"
        if line.startswith("not valid") and not (
            below and float(line.split("p = ")[1].split()[0]) <= rows.floor
        ):
            echo(line, err=True)
    return law


def _export_code(folder: Path, variant: str, table: str | None, check: bool) -> None:
    from mbma_tables.export.model import c_code

    for path in c_code.write_code(folder, variant, table):
        echo(path)
    if check:
        found = c_code.check(folder)
        for kind, largest in found.largest.items():
            echo(
                f"{kind}: {found.points[kind]} points, largest relative difference {largest:.1e}"
            )
        if found.failed:
            raise InputError(
                f"the check failed: {found.failed} answers are beyond their tolerance or were refused"
            )


@click.command("explore", short_help="A page to explore a surface in a browser.")
@click.option(
    "--out",
    required=True,
    type=click.Path(path_type=Path),
    help="The page, such as explorer.html.",
)
@options.specimen_options
@click.option(
    "--theory",
    metavar="mbma|calibrated|persson",
    help="Drawn first; mbma with a --variant, else calibrated.",
)
@options.variant_option
@options.hardness_option
def explore_command(
    out: Path,
    specimen: Specimen,
    theory: str | None,
    variant: str,
    hardness: float | str | None,
) -> None:
    """Write a page with sliders for the surface, its modulus, theory and variant, or a pasted spectrum.

    One file that needs neither a server nor a network: force, area, stiffness and
    conductance against gap or pressure.

    Example: mbma explore --surface concrete --E-star 13.3MPa --out explorer.html
    """
    from mbma_tables.export.page.explorer import explorer_page

    stress = specimen.stress_unit
    title = specimen.title
    page = explorer_page(
        specimen.surface, specimen.E_star, stress, theory, variant, title, hardness
    )
    write_file(out, page.encode())
    if str(out) != "-":
        echo(out)
