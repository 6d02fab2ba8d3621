"""`mbma export`: contact laws for other codes, laws as data, and the whole model as source code."""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mbma_tables.cli import options
from mbma_tables.common.arguments import require_name
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import MAX_BYTES, read_file, write_file
from mbma_tables.common.progress import echo
from mbma_tables.export.targets import AGAINST, Target, targets, write_files
from mbma_tables.export.text import written_by
from mbma_tables.materials import tangential_ratio
from mbma_tables.scenes.specimen import Specimen

if TYPE_CHECKING:
    from mbma_tables.export.law_table import LawTable

DEFAULTS = {"variant": "reported", "leakage": False, "check": False}


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
@click.option(
    "--rows", type=int, help="Number of rows of a table; else as few as --rtol needs."
)
@click.option(
    "--rtol",
    type=float,
    help="Largest relative error of linear interpolation; 1e-3 by default.",
)
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
@options.quantity_option(
    "--friction-pressure", help="At which that stiffness holds; else amid --pressures."
)
@click.option(
    "--leakage",
    is_flag=True,
    help="Flow coefficient of the gaps: rows of it alone, laws as code with it.",
)
@click.option(
    "--direction",
    metavar="x|y|DEGREES",
    help="Of leakage of a map; else the mean of both axes.",
)
@click.option(
    "--quantity",
    type=click.Choice([*AGAINST]),
    help="Of the rows; by default that which TARGET takes.",
)
@click.option(
    "--peklenik",
    type=float,
    help="Of a film: length of the roughness along x over that along y.",
)
@click.option(
    "--pressures",
    metavar="X:X",
    help="Smallest and largest pressure: where the error holds, and the rows end.",
)
@click.option("--name", help="Of the interaction, table, functions or module.")
@click.option(
    "--binaries",
    type=click.Choice(["here", "all", "none"]),
    help="In an FMU: for this platform, for all by zig, or none.",
)
@options.theory_option
@options.hardness_option
@options.variant_option
@click.option(
    "--check",
    is_flag=True,
    help="Of the whole model: build it and replay its conformance points.",
)
def export_command(target: str, out: Path, **values: Any) -> None:
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
    }
    kind = targets()[target]
    code = target in targets("CODE")
    words = {"specimen": "the surface", "kappa": "--nu"}
    taken = kind.takes if code else kind.takes | {"specimen"}
    if unused := [
        words.get(name, f"--{name.replace('_', '-')}")
        for name in given
        if name not in taken
    ]:
        raise InputError(f"without effect on {target}: leave {' and '.join(unused)} out")
    if "direction" in given and "leakage" not in given:
        raise InputError("--direction is of leakage: add --leakage or leave it out")
    if code:
        _export_code(out, values["variant"], "check" in given)
        return
    specimen: Specimen | None = given.pop("specimen", None)
    if specimen is None:
        raise InputError(
            "one surface is needed: see the options --surface, --file, --map, --hurst"
        )
    if specimen.E_star is None:
        raise InputError("a modulus is needed: --E-star, or all of --E1 --nu1 --E2 --nu2")
    if kind.units is not None:
        specimen = specimen.in_units(*kind.units)
    if kind.end and out.suffix != kind.end:
        raise InputError(f"--out of {target} must be NAME{kind.end}, got {out.name!r}")
    joint: dict[str, Any] = {
        name: getattr(specimen, name) for name in ("surface", "E_star", "stress_unit")
    }
    ctx = click.get_current_context()
    inputs = [ctx.params[key] for key in ("file", "map") if ctx.params[key]]
    for path in [path for path in inputs if path.suffix == ".toml"]:
        table = tomllib.loads(read_file(path, MAX_BYTES).decode()).get("surface", {})
        inputs += [path.parent / table["map"]] if "map" in table else []
    digests = (
        f"input {path}: sha256 {hashlib.sha256(read_file(path, MAX_BYTES)).hexdigest()}"
        for path in inputs
    )
    joint["made_by"] = *digests, written_by(ctx.obj[1:])
    if kind.rows:
        name = (
            {"name": out.stem}
            if kind.end
            else {"name": given.pop("name")}
            if "name" in given
            else {}
        )
        files = kind.files(_rows(kind, joint | given), **name)
    else:
        files = kind.files(**joint, **given)
    show_written(out, files)


def show_written(out: Path, files: Mapping[str, bytes]) -> None:
    """Write the files of a target and print their paths; to standard output the first one alone."""
    if str(out) == "-":
        write_file(out, files[""])
        return
    for path in write_files(out, files):
        echo(path)


def _rows(target: Target, asked: dict[str, Any]) -> LawTable:
    """Rows of a law; requested pressures at which it is not valid are reported."""
    from mbma_tables.export.law_rows import describe_law

    heat = (
        "conductance"
        if asked.keys() & {"conductivity", "conductivity_unit"}
        else target.quantity
    )
    asked.setdefault("quantity", "leakage" if asked.pop("leakage", False) else heat)
    asked["most_rows"] = target.most.get(asked["quantity"])
    if target.quantity == "conductance":  # its numbers do not depend on the conductivity
        asked = {"conductivity": 1.0, "conductivity_unit": "W/(m K)"} | asked
    if "pressures" not in asked:
        return describe_law(**asked)
    asked["pressures"] = tuple(str(asked["pressures"]).split(":"))
    if len(asked["pressures"]) != 2:
        raise InputError(
            f"--pressures must be like 0.1:100 or 0.1MPa:100MPa, got {':'.join(asked['pressures'])!r}"
        )
    law = describe_law(**asked)
    rows = law.behaviour or law
    for line in rows.comments:
        # a limit below the smallest requested pressure does not matter
        below = line.startswith("not valid below") and rows.y_name == "pressure"
        if line.startswith("not valid") and not (
            below and float(line.split("p = ")[1].split()[0]) <= rows.floor
        ):
            echo(line, err=True)
    return law


def _export_code(folder: Path, variant: str, check: bool) -> None:
    from mbma_tables.export import c_code

    for path in c_code.write_code(folder, variant):
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
    from mbma_tables.export.explorer import explorer_page

    stress = specimen.stress_unit
    title = specimen.title
    page = explorer_page(
        specimen.surface, specimen.E_star, stress, theory, variant, title, hardness
    )
    write_file(out, page.encode())
    if str(out) != "-":
        echo(out)
