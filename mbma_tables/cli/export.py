"""`mbma export`: contact laws for other codes, laws as data, and the whole model as source code."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from mbma_tables.cli.options import surface_options
from mbma_tables.cli.sources import read_source
from mbma_tables.errors import InputError
from mbma_tables.export import CODE, DATA, SOLVERS
from mbma_tables.files import write_file


@click.command("export", short_help="A contact law, or the whole model, for other codes.")
@click.argument("target", type=click.Choice([*SOLVERS, *DATA, *CODE]))
@click.option("--out", required=True, type=click.Path(path_type=Path), help="File to write; a folder for source code.")
@surface_options
@click.option("--E-star", "E_star", type=float, help="Effective modulus, in --stress-unit.")
@click.option("--E1", "E1", type=float, help="Instead of --E-star: Young's modulus,")
@click.option("--nu1", "nu1", type=float, help="and Poisson's ratio of one body,")
@click.option("--E2", "E2", type=float, help="Young's modulus of the other,")
@click.option("--nu2", "nu2", type=float, help="and its Poisson's ratio.")
@click.option("--length-unit", help="Unit of the surface's lengths and of the file, such as mm.")
@click.option("--stress-unit", help="Unit of the modulus and of the file, such as MPa.")
@click.option("--rows", type=int, help="How many rows; else as few as --rtol needs.")
@click.option("--rtol", type=float, help="Largest relative error of linear interpolation; 1e-3 by default.")
@click.option("--largest-overclosure", type=float, help="Where the rows end; else at full compression.")
@click.option("--conductivity", type=float, help="k_s = 2 k1 k2/(k1 + k2): conductance against pressure instead.")
@click.option("--conductivity-unit", help="Unit of k_s, such as mW/(mm K); conductance is in that over length.")
@click.option("--exponential", is_flag=True, help="For calculix and abaqus: Persson's exponential law instead of rows.")
@click.option("--pair", default="node-to-surface", show_default=True, help="For calculix: the type of contact pair.")
@click.option("--reading", default="reported", show_default=True, help="Reading of the paper's equations.")
@click.option("--check", is_flag=True, help="Of source code: build it and replay its conformance points.")
def export_command(**given: Any) -> None:
    """Write TARGET to a file.

    Solvers and data take a surface, a modulus and units; c, fortran and javascript are the whole model as code.

    Example: mbma export calculix --surface concrete --E-star 13.3 --length-unit mm --stress-unit MPa --out law.inp
    """
    target, out = given["target"], given["out"]
    if target in CODE:
        _export_code(target, out, given["reading"], given["check"])
        return
    if given["check"]:
        raise InputError(f"--check replays points in source code; {target} has none to replay")
    files = _law_files(target, out, given)
    for path, content in files.items():
        write_file(path, content)
        click.echo(path)


def _export_code(target: str, folder: Path, reading: str, check: bool) -> None:
    from mbma_tables.export import code

    for path in code.write_code(target, folder, reading):
        click.echo(path)
    if check:
        found = code.check(target, folder)
        if not found.ran:
            raise InputError(f"not checked: {found.reason}")
        for kind, largest in found.largest.items():
            click.echo(f"{kind}: {found.points[kind]} points, largest relative difference {largest:.1e}")
        if found.reason:
            raise InputError(f"the check failed: {found.reason}")


def _law_files(target: str, out: Path, given: dict[str, Any]) -> dict[Path, bytes]:
    from mbma_tables.export import data, solvers
    from mbma_tables.export.law_rows import describe_law

    source = read_source(given)
    if source.E_star is None:
        raise InputError("a modulus is needed: --E-star, or --E1 --nu1 and, unless the other body is rigid, --E2 --nu2")
    law = describe_law(
        source.surface,
        source.E_star,
        length_unit=given["length_unit"] or "",
        stress_unit=given["stress_unit"] or "",
        quantity="pressure" if given["conductivity"] is None else "conductance",
        rows=given["rows"],
        rtol=given["rtol"],
        largest_overclosure=given["largest_overclosure"],
        conductivity=given["conductivity"],
        conductivity_unit=given["conductivity_unit"],
        reading=given["reading"],
    )
    if given["exponential"]:
        if target not in ("calculix", "abaqus"):
            raise InputError(f"--exponential is a law of calculix and abaqus, not of {target}")
        return {out: solvers.exponential(source.surface, source.E_star, law.comments).encode()}
    if target in SOLVERS:
        options = {"pair": given["pair"]} if target == "calculix" else {}
        return {out: getattr(solvers, target)(law, **options).encode()}
    if target == "matlab":
        if out.suffix != ".mat":
            raise InputError(f"--out of matlab must be NAME.mat, got {out.name!r}")
        return {out.with_suffix(".m"): data.matlab_reader(law, out.stem), out: data.to_matlab(law)}
    return {out: getattr(data, f"to_{target}")(law)}
