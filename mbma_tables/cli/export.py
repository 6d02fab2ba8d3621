"""`mbma export`: contact laws for other codes, laws as data, and the whole model as source code."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mbma_tables.cli.options import (
    hardness_option,
    optional_specimen_options,
    quantity_option,
    reading_option,
    specimen_options,
    theory_option,
)
from mbma_tables.cli.progress import echo
from mbma_tables.errors import InputError
from mbma_tables.export import CODE, DATA, SOLVERS
from mbma_tables.files import write_file
from mbma_tables.scenes.specimen import Specimen

if TYPE_CHECKING:
    from mbma_tables.export.law_rows import LawTable

NAMED = ("calculix", "abaqus", "modelica")


@click.command("export", short_help="A contact law, or the whole model, for other codes.")
@click.argument("target", type=click.Choice([*SOLVERS, *DATA, *CODE]))
@click.option("--out", required=True, type=click.Path(path_type=Path), help="File to write; a folder for source code.")
@optional_specimen_options
@click.option("--rows", type=int, help="How many rows; else as few as --rtol needs.")
@click.option("--rtol", type=float, help="Largest relative error of linear interpolation; 1e-3 by default.")
@quantity_option("--largest-overclosure", help="Where the rows end; else at full compression.")
@click.option("--conductivity", type=float, help="k_s = 2 k1 k2/(k1 + k2): conductance against pressure instead.")
@click.option("--conductivity-unit", help="Unit of k_s, such as mW/(mm K); conductance is in that over length.")
@click.option(
    "--pressures", metavar="X:X", help="Smallest and largest pressure: where the error holds, and the rows end."
)
@click.option("--name", help="Of the interaction or table: calculix, abaqus, modelica.")
@click.option("--exponential", is_flag=True, help="For calculix: Persson's exponential law instead of rows.")
@theory_option
@hardness_option
@reading_option
@click.option("--check", is_flag=True, help="Of source code: build it and replay its conformance points.")
def export_command(
    target: str,
    out: Path,
    specimen: Specimen | None,
    name: str | None,
    exponential: bool,
    theory: str,
    reading: str,
    check: bool,
    **law_options: Any,
) -> None:
    """Write TARGET to a file.

    Solvers and data take a surface, a modulus and units; c, fortran and javascript are the whole model as code.

    Example: mbma export calculix --surface concrete --E-star 13.3MPa --out law.inp
    """
    given = {option: value for option, value in law_options.items() if value is not None}
    named = {"name": name} if name is not None else {}
    if target in CODE:
        if theory != "mbma":
            raise InputError(f"source code is of the MBMA model: leave --theory out, got {theory!r}")
        _refuse(f"{target} is the whole model", given | named | {"surface": specimen} | {"exponential": exponential})
        _export_code(target, out, reading, check)
        return
    if check:
        raise InputError(f"--check replays points in source code; {target} has none to replay")
    if specimen is None:
        raise InputError("one surface is needed: see the options --surface, --file, --map, --hurst")
    if specimen.E_star is None:
        raise InputError("a modulus is needed: --E-star, or --E1 --nu1 and, unless the other body is rigid, --E2 --nu2")
    if target not in NAMED:
        _refuse(f"{target} has no name to choose", named)
    from mbma_tables.export import solvers

    if exponential:
        if target != "calculix":
            raise InputError(f"--exponential is a law of calculix, not of {target}")
        own = {"theory": theory != "mbma", "reading": reading != "reported"}
        _refuse("--exponential is Persson's law in two numbers", given | own)
        text = solvers.exponential(specimen.surface, specimen.E_star, stress_unit=specimen.stress_unit, **named)
        _write({out: text.encode()})
        return
    from mbma_tables.export.law_rows import describe_law

    if "pressures" in given:
        given["pressures"] = _pressures(given["pressures"])
    law = describe_law(
        specimen.surface,
        specimen.E_star,
        stress_unit=specimen.stress_unit,
        quantity="pressure" if "conductivity" not in given else "conductance",
        reading=reading,
        theory=theory,
        **given,
    )
    if target in SOLVERS:
        files = {out: getattr(solvers, target)(law, **named).encode()}
    else:
        files = _data_files(target, out, law)
    _write(files)


def _write(files: Mapping[Path, bytes]) -> None:
    for path, content in files.items():
        write_file(path, content)
        if str(path) != "-":
            echo(path)


def _refuse(why: str, given: Mapping[str, Any]) -> None:
    """Refuse options that would be without effect."""
    useless = [f"--{option.replace('_', '-')}" for option, value in given.items() if value not in (None, False)]
    if useless:
        raise InputError(f"{why}: leave {' and '.join(useless)} out")


def _pressures(text: str) -> tuple[float | str, ...]:
    ends = text.split(":")
    if len(ends) != 2:
        raise InputError(f"--pressures must be like 0.1:100 or 0.1MPa:100MPa, got {text!r}")
    return tuple(ends)


def _data_files(target: str, out: Path, law: LawTable) -> dict[Path, bytes]:
    from mbma_tables.export import data

    if target == "matlab":
        if out.suffix != ".mat":
            raise InputError(f"--out of matlab must be NAME.mat, got {out.name!r}")
        return {out.with_suffix(".m"): data.matlab_reader(law, out.stem), out: data.to_matlab(law)}
    return {out: getattr(data, f"to_{target}")(law)}


def _export_code(target: str, folder: Path, reading: str, check: bool) -> None:
    from mbma_tables.export import code

    for path in code.write_code(target, folder, reading):
        echo(path)
    if check:
        found = code.check(target, folder)
        if not found.ran:
            raise InputError(f"not checked: {found.reason}")
        for kind, largest in found.largest.items():
            echo(f"{kind}: {found.points[kind]} points, largest relative difference {largest:.1e}")
        if found.reason:
            raise InputError(f"the check failed: {found.reason}")


@click.command("explore", short_help="A page to explore a surface in a browser.")
@click.option("--out", required=True, type=click.Path(path_type=Path), help="The page, such as explorer.html.")
@specimen_options
@click.option("--theory", metavar="mbma|calibrated|persson", help="Drawn first; calibrated for a map, else mbma.")
@reading_option
def explore_command(out: Path, specimen: Specimen, theory: str | None, reading: str) -> None:
    """Write a page with sliders for the surface, its modulus, theory and reading, or a pasted spectrum.

    One file that needs neither a server nor a network: force, area, stiffness and conductance against gap or pressure.

    Example: mbma explore --surface concrete --E-star 13.3MPa --out explorer.html
    """
    from mbma_tables.export.explorer import explorer_page

    page = explorer_page(specimen.surface, specimen.E_star, specimen.stress_unit, theory, reading, specimen.title)
    _write({out: page.encode()})
