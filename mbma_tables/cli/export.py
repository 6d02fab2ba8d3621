"""`mbma export`: contact laws for other codes, laws as data, and the whole model as source code."""

from __future__ import annotations

import hashlib
import math
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mbma_tables.bodies.materials import tangential_ratio
from mbma_tables.cli import options
from mbma_tables.cli.options import given_values
from mbma_tables.common.arguments import require_name
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import MAX_BYTES, read_file, write_file
from mbma_tables.common.progress import echo
from mbma_tables.design.specimen import Specimen
from mbma_tables.export.registry import targets
from mbma_tables.export.targets import Options, Target, write_files
from mbma_tables.export.text import written_by

if TYPE_CHECKING:
    from mbma_tables.export.law_table import LawTable
    from mbma_tables.export.request import Subject

DEFAULTS = {"variant": "reported"}


class _Export(options.WithFileOptions):
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
@click.option(
    "--joint",
    type=click.Path(path_type=Path),
    metavar="TOML",
    help="In place of a surface: the file of a joint.",
)
@click.option(
    "--law",
    type=click.Path(path_type=Path),
    metavar="FILE.json",
    help="In place of a surface: rows that `mbma export json` wrote, for other programs.",
)
@options.optional_specimen_options
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
@options.theory_option
@options.hardness_option
@options.largest_pressure_option
@options.variant_option
def export_command(target: str, out: Path, asked: dict[str, Any], **values: Any) -> None:
    """Write TARGET to a file.

    Solvers and data take a surface, a modulus and units, and so do laws as code (-law),
    subroutines of solvers (abaqus-uinter, abaqus-gapcon, calculix-gapcon), and an FMU of
    FMI 2 (fmu); c is the whole model as code, of the paper's variants reported and printed.
    A --table of four numbers is of one variant, and has mbma_lookup_of in place of mbma_phi_of.

    In place of a surface --joint takes the file of a joint, and --law rows that are written.

    Example: mbma export calculix --surface concrete --E-star 13.3MPa --out law.inp

    Example: mbma export abaqus --joint examples/joint.toml --pressures 1MPa:50MPa --out joint.inp
    """
    require_name("target", target, targets())
    kind = targets()[target]
    code = target in targets("CODE")
    surface = values.pop("specimen")
    given = {
        name: value
        for name, value in values.items()
        if value is not None and value != DEFAULTS.get(name)
    } | asked
    sources = [name for name in ("joint", "law") if given.pop(name, None) is not None]
    if given_values(surface) and not sources:
        sources.append("specimen")
    _refuse_unused(kind, [*given, *(sources if code else ())], code)
    if code:
        _export_code(out, values["variant"], **asked)
        return
    subject: Subject | list[LawTable]
    made_by = (*_inputs(), written_by(_context().obj[1:]))
    units: dict[str, Any] = {}
    if sources in (["joint"], ["law"]):
        units = _units_alone(surface, sources[0])
        _refuse_of_surface(given, sources[0])
        subject = (
            _subject_of_joint(values["joint"])
            if sources == ["joint"]
            else _rows_of_file(values["law"])
        )
    elif len(sources) == 2:
        raise InputError("--joint and --law are both given: give one of them")
    else:
        subject = _subject_of_surface(kind, surface, given)
    write_export(subject, target, {**asked, **units, "made_by": made_by}, out)


def _context() -> click.Context:
    return click.get_current_context()


def _word(name: str) -> str:
    """The option of an argument."""
    words = {"specimen": "the surface", "kappa": "--nu", "heat": "--without-heat"}
    return words.get(name, f"--{name.replace('_', '-')}")


def _refuse_unused(kind: Target, given: Iterable[str], code: bool = False) -> None:
    """Refuse options without effect."""
    taken = kind.takes if code else kind.takes | Options.names().keys()
    unused = [_word(name) for name in sorted(given) if name not in taken]
    if unused:
        raise InputError(
            f"without effect on {kind.name}: leave {' and '.join(unused)} out"
        )


def _units_alone(surface: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Units of a file, which are the options of a surface that have a meaning without one."""
    given = given_values(surface)
    units: dict[str, Any] = {}
    for name in ("length_unit", "stress_unit"):
        if name in given:
            units[name] = given.pop(name)
    if given:
        words = " and ".join(_word(name) for name in given)
        raise InputError(f"--{source} has the surface: leave {words} out")
    return units


def _refuse_of_surface(given: Mapping[str, Any], source: str) -> None:
    """Refuse options of a surface's bodies and theory beside a file that has them."""
    bodies = ("conductivity", "conductivity_unit", "kappa", "friction", "hardness")
    names = (*bodies, "largest_pressure", "theory", "variant")
    words = [_word(name) for name in names if name in given]
    if words:
        raise InputError(f"--{source} has its own: leave {' and '.join(words)} out")


def _subject_of_joint(path: Path) -> Subject:
    from mbma_tables.design.joint import Joint

    return Joint.from_toml(path).subject()


def _rows_of_file(path: Path) -> list[LawTable]:
    from mbma_tables.export.rows.data import from_json

    return from_json(read_file(path, MAX_BYTES))


def _subject_of_surface(
    kind: Target, surface: Mapping[str, Any], given: Mapping[str, Any]
) -> Subject:
    """A surface and the bodies that the options describe."""
    from mbma_tables.export.request import Subject, given_heat

    if not given_values(surface):
        raise InputError(
            "one surface is needed: see the options --surface, --file, --map, --hurst; or a --joint, or a --law"
        )
    specimen = options.specimen_of(surface)
    if specimen.E_star is None:
        raise InputError("a modulus is needed: --E-star, or all of --E1 --nu1 --E2 --nu2")
    if kind.units is not None:
        specimen = specimen.in_units(*kind.units)
    numbers = given.get("conductivity"), given.get("conductivity_unit")
    return Subject(
        surface=specimen.surface,
        E_star=specimen.modulus,
        stress_unit=specimen.stress_unit,
        theory=given.get("theory"),
        variant=given.get("variant", "reported"),
        hardness=given.get("hardness", math.inf),
        largest_pressure=given.get("largest_pressure"),
        heat=None if numbers == (None, None) else given_heat(*numbers),
        kappa=given.get("kappa"),
        friction=given.get("friction"),
    )


def _inputs() -> Iterator[str]:
    """Lines of a header with the files that were read, and their digests."""
    asked = _context().params
    inputs = [asked[key] for key in ("file", "map", "joint", "law") if asked[key]]
    for path in [path for path in inputs if path.suffix == ".toml"]:
        table = tomllib.loads(read_file(path, MAX_BYTES).decode()).get("surface", {})
        inputs += [path.parent / table["map"]] if "map" in table else []
    for path in inputs:
        digest = hashlib.sha256(read_file(path, MAX_BYTES)).hexdigest()
        yield f"input {path}: sha256 {digest}"


def write_export(
    subject: Subject | list[LawTable], target: str, given: Mapping[str, Any], out: Path
) -> None:
    """Write a subject for a program, and say at which of the pressures asked for it is not valid."""
    from mbma_tables.export.request import files_of

    require_name("target", target, targets())
    kind = targets()[target]
    if target not in targets("CODE"):
        _refuse_unused(kind, [name for name in given if name not in Options.names()])
    to_screen = str(out) == "-"
    if to_screen:
        require_alone(kind)
    written = files_of(subject, target, given, None if to_screen else out)
    for line in written.doubts:
        echo(line, err=True)
    show_written(kind, out, written.files)


def show_written(kind: Target, out: Path, files: Mapping[str, bytes]) -> None:
    """Write the files of a target and print their paths; to standard output the first one alone."""
    if str(out) == "-":
        write_first(kind, files[""])
        return
    for path in write_files(out, files):
        echo(path)


def write_first(kind: Target, content: bytes) -> None:
    """Write the first file of a target to standard output, and name those that are left out."""
    beside = ", ".join(f"NAME{end}" for end in kind.beside)
    write_file(Path("-"), content)
    if beside:
        echo(f"left out: {beside}; --out FILE writes all", err=True)


def require_alone(kind: Target) -> None:
    """Refuse standard output where the first file of a target needs the others."""
    if not kind.alone:
        beside = ", ".join(f"NAME{end}" for end in kind.beside)
        raise InputError(
            f"{kind.name} is several files, of which the first needs {beside}: --out FILE writes all"
        )


def _export_code(
    folder: Path, variant: str, table: str | None = None, check: bool = False
) -> None:
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
