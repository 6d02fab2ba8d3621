"""`mbma export`: contact laws for other codes, laws as data, and the whole model as source code."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mbma_tables.cli import options
from mbma_tables.common.arguments import nearest
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import write_file
from mbma_tables.common.progress import echo
from mbma_tables.export import CODE, DATA, FMUS, GRAPHS, LAWS, SOLVERS, SUBROUTINES
from mbma_tables.scenes.specimen import Specimen

if TYPE_CHECKING:
    from mbma_tables.export.law_rows import LawTable

LAW_OPTIONS = frozenset({"specimen", "theory", "variant", "hardness", "conductivity", "conductivity_unit"})
ROW_OPTIONS = {"rows", "rtol", "largest_overclosure", "pressures", "leakage"}
OPTIONS = {
    **dict.fromkeys((*SOLVERS, *DATA), LAW_OPTIONS | ROW_OPTIONS),
    **dict.fromkeys(("calculix", "abaqus", "modelica"), LAW_OPTIONS | ROW_OPTIONS | {"name"}),
    **dict.fromkeys((*LAWS, *FMUS, *GRAPHS), LAW_OPTIONS | {"name", "leakage"}),
    **dict.fromkeys(SUBROUTINES, LAW_OPTIONS | {"name"}),
    **dict.fromkeys(CODE, frozenset({"variant", "check"})),
    "calculix --exponential": frozenset({"specimen", "name", "exponential"}),
}
TARGETS = (*SOLVERS, *DATA, *LAWS, *FMUS, *GRAPHS, *CODE)
DEFAULTS = {"variant": "reported", "exponential": False, "leakage": False, "check": False}


class _Target(click.Choice[str]):
    """One of the targets; of a mistaken one the nearest is told."""

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        if value not in self.choices:
            self.fail(f"no target is called {value!r}: {nearest(value, self.choices)}", param, ctx)
        return value


@click.command(
    "export", short_help="A contact law, or the whole model, for other codes.", epilog=f"Targets: {', '.join(TARGETS)}."
)
@click.argument("target", metavar="TARGET", type=_Target(TARGETS))
@click.option("--out", required=True, type=click.Path(path_type=Path), help="File to write; a folder for source code.")
@options.optional_specimen_options
@click.option("--rows", type=int, help="How many rows of a table; else as few as --rtol needs.")
@click.option("--rtol", type=float, help="Largest relative error of linear interpolation; 1e-3 by default.")
@options.quantity_option("--largest-overclosure", help="Where the rows end; else at full compression.")
@click.option("--conductivity", type=float, help="k_s = 2 k1 k2/(k1 + k2): conductance against pressure, or as well.")
@click.option("--conductivity-unit", help="Unit of k_s, such as mW/(mm K); conductance is in that over length.")
@click.option("--leakage", is_flag=True, help="Flow coefficient of the gaps: rows of it alone, laws as code with it.")
@click.option(
    "--pressures", metavar="X:X", help="Smallest and largest pressure: where the error holds, and the rows end."
)
@click.option("--name", help="Of the interaction, table, functions or module.")
@click.option("--exponential", is_flag=True, help="For calculix: Persson's exponential law instead of rows.")
@options.theory_option
@options.hardness_option
@options.variant_option
@click.option("--check", is_flag=True, help="Of the whole model: build it and replay its conformance points.")
def export_command(target: str, out: Path, **values: Any) -> None:
    """Write TARGET to a file.

    Solvers and data take a surface, a modulus and units, and so do laws as code (-law), subroutines of solvers
    (abaqus-uinter, abaqus-gapcon, calculix-gapcon), an FMU of FMI 2 (fmu) or 3 (fmu3), and onnx; c, fortran and
    javascript are the whole model as code, of the paper's variants reported and printed.

    Example: mbma export calculix --surface concrete --E-star 13.3MPa --out law.inp
    """
    given = {name: value for name, value in values.items() if value is not None and value != DEFAULTS.get(name)}
    _refuse_unused(target, given)
    if target in CODE:
        _export_code(target, out, values["variant"], "check" in given)
        return
    specimen: Specimen | None = given.pop("specimen", None)
    if specimen is None:
        raise InputError("one surface is needed: see the options --surface, --file, --map, --hurst")
    if specimen.E_star is None:
        raise InputError("a modulus is needed: --E-star, or all of --E1 --nu1 --E2 --nu2")
    joint = {"surface": specimen.surface, "E_star": specimen.E_star, "stress_unit": specimen.stress_unit}
    _write(_law_files(target, out, joint, given))


def _write(files: Mapping[Path, bytes]) -> None:
    for path, content in files.items():
        write_file(path, content)
        if str(path) != "-":
            echo(path)


def _refuse_unused(target: str, given: Mapping[str, Any]) -> None:
    """Refuse options that would be without effect."""
    kind = f"{target} --exponential" if "exponential" in given else target
    taken = OPTIONS.get(kind, OPTIONS[target])
    unused = [
        "the surface" if name == "specimen" else f"--{name.replace('_', '-')}" for name in given if name not in taken
    ]
    if unused:
        raise InputError(f"without effect on {kind if kind in OPTIONS else target}: leave {' and '.join(unused)} out")


def _law_files(target: str, out: Path, joint: dict[str, Any], given: dict[str, Any]) -> dict[Path, bytes]:
    """What is written of one surface's law, by its files."""
    from mbma_tables.export import fmu, law_code, law_languages, onnx, solvers
    from mbma_tables.export.law_rows import describe_law

    if target in LAWS:
        files = {out: law_code.law_text(target, **joint, **given).encode()}
        beside = law_languages.LANGUAGES[target].beside
        if beside and str(out) == "-":
            raise InputError(f"{target} is two files: --out must be that of the first")
        if beside:
            files[out.with_name(f"{out.stem}_c.c")] = law_code.law_text(beside, **joint, **given).encode()
        return files
    if target in FMUS:
        return {out: fmu.fmu(target, **joint, **given)}
    if target in GRAPHS:
        return {out: onnx.onnx(**joint, **given)}
    named = {"name": given.pop("name")} if "name" in given else {}
    if given.pop("exponential", False):
        return {out: solvers.exponential(**joint, **named).encode()}
    if "pressures" in given:
        given["pressures"] = _pressures(given["pressures"])
    heat = "conductance" if given.keys() & {"conductivity", "conductivity_unit"} else "pressure"
    quantity = "leakage" if given.pop("leakage", False) else heat
    law = describe_law(**joint, quantity=quantity, **given)
    if "pressures" in given:
        _warn(law)
    if target in SOLVERS:
        return {out: getattr(solvers, target)(law, **named).encode()}
    return _data_files(target, out, law)


def _warn(law: LawTable) -> None:
    """Tell of pressures asked for at which the law is not valid."""
    rows = law.behaviour or law
    for line in rows.comments:
        # a limit below the smallest pressure asked for does not matter
        below = line.startswith("not valid below") and rows.y_name == "pressure"
        if line.startswith("not valid") and not (below and float(line.split("p = ")[1].split()[0]) <= rows.floor):
            echo(line, err=True)


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


def _export_code(target: str, folder: Path, variant: str, check: bool) -> None:
    from mbma_tables.export import code

    for path in code.write_code(target, folder, variant):
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
@options.specimen_options
@click.option("--theory", metavar="mbma|calibrated|persson", help="Drawn first; calibrated for a map, else mbma.")
@options.variant_option
def explore_command(out: Path, specimen: Specimen, theory: str | None, variant: str) -> None:
    """Write a page with sliders for the surface, its modulus, theory and variant, or a pasted spectrum.

    One file that needs neither a server nor a network: force, area, stiffness and conductance against gap or pressure.

    Example: mbma explore --surface concrete --E-star 13.3MPa --out explorer.html
    """
    from mbma_tables.export.explorer import explorer_page

    page = explorer_page(specimen.surface, specimen.E_star, specimen.stress_unit, theory, variant, specimen.title)
    _write({out: page.encode()})
