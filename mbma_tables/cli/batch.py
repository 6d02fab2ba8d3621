"""The commands `mbma batch`, many surfaces of a CSV file, and `mbma sensitivity`, one whose numbers vary."""

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from mbma_tables.cli import options
from mbma_tables.cli.commands import COLUMNS
from mbma_tables.cli.format import Report, shown_unit, to_json
from mbma_tables.cli.options import LOADS
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import read_file
from mbma_tables.common.progress import doing, echo
from mbma_tables.scenes.specimen import MATERIAL, NUMBERS, Specimen, from_tables
from mbma_tables.surfaces.self_affine import PARAMETERS
from mbma_tables.surfaces.surface import Surface

MAX_BYTES = 64 * 2**20
MAX_COLUMNS, MAX_ROWS, MAX_CELL = 100, 1_000_000, 1000  # limits of a file of surfaces; letters of a cell
OF_MAPS = ("dx", "dy", "detrend", "short_cutoff", "long_cutoff", "s_filter", "l_filter")


@click.command("batch", short_help="Many surfaces from a CSV file.")
@click.argument("file", metavar="SURFACES.csv", type=click.Path(path_type=Path))
@options.load_options(options.quantity_option)
@options.quantity_option(
    "--E-star", "E_star", help="Effective modulus of lines that name none; without one forces are over E*."
)
@options.length_unit()
@options.stress_unit_option
@options.theory_options
@options.output_options
def batch_command(
    file: Path,
    loads: dict[str, Any],
    E_star: Any,
    length_unit: str | None,
    stress_unit: str | None,
    model: options.Model,
    output: options.Output,
) -> None:
    """Contact for each line of SURFACES.csv, one row each.

    Its header names a surface's numbers as the options of `mbma contact` do, "surface" for named ones, "map" for files
    of maps with their dx, dy, detrend, cut-offs and filters, moduli (E_star, or E1, nu1, E2, nu2), and separation,
    mean_separation, pressure or area where these are not options; a column "name" is repeated. Cells are numbers,
    perhaps with their unit, "0.8um". Files are relative to SURFACES.csv.

    Example: mbma batch surfaces.csv --pressure 1MPa --theory calibrated --csv --out answers.csv
    """
    from mbma_tables.answers.contact import contact

    try:
        lines = list(_lines(file))
    except csv.Error as fault:
        raise InputError(f"{file} cannot be read: {fault}") from None
    given = {name for _, row in lines for name in row if name in LOADS} | set(loads)
    if len(given) != 1:
        raise InputError("one of separation, mean_separation, pressure and area is needed, as an option or a column")
    (load,) = given
    names, specimens, values = [], [], []
    units = length_unit, stress_unit
    for count, (number, row) in enumerate(lines):
        doing(f"batch: line {count} of {len(lines)}")
        try:
            specimen = _specimen(row, E_star, *units, file.parent)
            units = units[0] or specimen.surface.unit, units[1] or specimen.stress_unit
            if load not in loads and load not in row:
                raise InputError(f"{load} is missing")
            values.append(specimen.units.number(load, row.get(load, loads.get(load))))
        except InputError as fault:
            raise InputError(f"{file}, line {number}: {fault}") from None
        names.append(row.get("name", row.get("surface", row.get("map", f"line {number}"))))
        specimens.append(specimen)
    if len({specimen.units for specimen in specimens}) > 1:
        raise InputError(f"{file}: some lines have units and some do not: give --length-unit and --stress-unit")
    first, surfaces = specimens[0], [specimen.surface for specimen in specimens]
    moduli = [1.0 if specimen.E_star is None else specimen.E_star for specimen in specimens]
    doing(f"batch of {len(lines)} lines")
    keywords, fields = model.keywords(first), (*COLUMNS[:-1], "stiffness", "scatter", "valid", "error")
    found: dict[str, Any] = {"name": names}
    if all(isinstance(surface, Surface) for surface in surfaces):
        numbers: dict[str, Any] = {name: [getattr(surface, name) for surface in surfaces] for name in PARAMETERS}
        answer = contact(Surface(**numbers, unit=surfaces[0].unit), **keywords | {"E_star": moduli, load: values})
        found |= {name: getattr(answer, name) for name in fields}
    else:
        # one after the other: maps make no batch
        rows = zip(surfaces, moduli, values, strict=True)
        each = [contact(surface, **keywords | {"E_star": modulus, load: at}) for surface, modulus, at in rows]
        answer, found["theory"] = each[0], [one.theory for one in each]
        found |= {name: [getattr(one, name) for one in each] for name in fields}
    made = f"theory {', theory '.join(dict.fromkeys(found.get('theory', [answer.theory])))}"
    notes = [
        f"{made}, rtol {model.rtol:g}" if answer.theory == "mbma" else made,
        "scatter: of ln force at a separation, by simulations",
    ]
    facts = {"theory": answer.theory, "variant": answer.variant or None, "island_model": answer.island_model or None}
    shown = {name: shown_unit(name, first.units) for name in found}
    Report("batch", file.name, notes, facts, found, shown).write(output)


def _lines(file: Path) -> Any:
    """Number and filled cells of each line below the header."""
    text = read_file(file, MAX_BYTES).decode("utf-8-sig", "replace")
    for what, count, most in (
        ("columns", text.partition("\n")[0].count(",") + 1, MAX_COLUMNS),
        ("lines", text.count("\n"), MAX_ROWS),
    ):
        if count > most:
            raise InputError(f"{file}: {count} {what}, more than {most}")
    rows = csv.DictReader(io.StringIO(text, newline=""))
    known = {"name", "surface", "map", *OF_MAPS, *NUMBERS, *MATERIAL, *LOADS}
    names = [name.strip() for name in rows.fieldnames or ()]
    if repeated := sorted({name for name in names if names.count(name) > 1}):
        raise InputError(f"{file}: more than one column {', '.join(repeated)}")
    if unknown := [name for name in names if name not in known]:
        raise InputError(f"{file}: unknown columns {', '.join(unknown)}; there are {', '.join(sorted(known))}")
    empty = True
    for row in rows:
        if None in row:
            raise InputError(f"{file}, line {rows.line_num}: more cells than the header has")
        cells = {name.strip(): cell.strip() for name, cell in row.items() if cell and cell.strip()}
        if long := [name for name, cell in cells.items() if len(cell) > MAX_CELL]:
            raise InputError(f"{file}, line {rows.line_num}, column {long[0]}: more than {MAX_CELL} letters")
        if cells:
            empty = False
            yield rows.line_num, cells
    if empty:
        raise InputError(f"{file} has no line of a surface below its header")


def _specimen(row: Mapping[str, str], E_star: Any, length: str | None, stress: str | None, folder: Path) -> Specimen:
    surface: dict[str, Any] = {name: row[name] for name in ("map", *OF_MAPS, *NUMBERS) if name in row}
    surface |= {"name": row["surface"]} if "surface" in row else {}
    material = {name: row[name] for name in MATERIAL if name in row}
    material = material or ({} if E_star is None else {"E_star": E_star})
    tables = {"surface": surface | {"length_unit": length}, "material": material | {"stress_unit": stress}}
    return from_tables(tables, folder, "").in_units(length, stress)


@click.command("sensitivity", short_help="Sensitivity of results to each parameter.")
@options.load_options(options.quantity_option)
@options.specimen_options
@options.theory_options
@options.json_option("a table")
def sensitivity_command(loads: dict[str, Any], specimen: Specimen, model: options.Model, as_json: bool) -> None:
    """d ln(result)/d ln(parameter) of force, area, stiffness and conductance, the given quantity held fixed.

    Parameters are the surface's five numbers, or those of a drawing; of a map or a spectrum the scales of its heights
    and lengths, h_max, cut-offs and the exponent of an extrapolation.

    Example: mbma sensitivity --surface concrete --E-star 13.3MPa -p 100kPa
    """
    from mbma_tables.answers.sensitivity import sensitivity

    model = model.of(specimen.surface)
    found = sensitivity(specimen.surface, **loads, E_star=specimen.modulus, **model._asdict())
    units = {name: shown_unit(name, found.units) for name in (*found.parameters, *found.answers)}
    if as_json:
        echo(to_json(vars(found) | {"theory": model.theory, "units": units}))
        return
    here = ", ".join(f"{name} {value:.6g} {units[name]}".removesuffix(" -") for name, value in found.answers.items())
    echo(f"mbma sensitivity: {specimen.title}, theory {model.theory}\nhere: {here}\n\n{found}")
