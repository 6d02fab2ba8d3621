"""`mbma plan`, `mbma run` and `mbma joint`: scenes and joints from TOML files."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mbma_tables.cli.export import write_export
from mbma_tables.cli.format import (
    Report,
    assumption_notes,
    columns_of,
    report_of_quantiles,
    to_json,
    validity_of,
)
from mbma_tables.cli.options import (
    Output,
    WithFileOptions,
    check_plot,
    draws_options,
    face_options,
    json_option,
    numbers_option,
    output_options,
    plot_option,
)
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import MAX_BYTES, read_file, write_file, written_bytes
from mbma_tables.common.progress import echo
from mbma_tables.common.toml_files import read_toml, set_entry, with_settings
from mbma_tables.export.registry import OF_LAWS
from mbma_tables.export.text import written_by
from mbma_tables.surfaces.surface import assumptions

if TYPE_CHECKING:
    from mbma_tables.design.joint import Joint

SUFFIXES = (".nc", ".csv")
toml_file = click.argument("file", type=click.Path(path_type=Path))
settings_option = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="NAME=VALUE",
    help="An entry of the file or in place of one: part_a.Ra='0.25..0.4 um'; may be repeated.",
)


@click.command("plan", short_help="Plan of a scene: steps, errors and computing times.")
@toml_file
@json_option("text")
def plan_command(file: Path, as_json: bool) -> None:
    """Plan of the scene in FILE: steps with the effects that need them, certified errors and measured costs.

    Example: mbma plan examples/scene_joint.toml
    """
    from mbma_tables.design.scenes.scene import Scene

    scene = Scene.from_toml(file)
    if not as_json:
        echo(scene.explain(), nl=False)
        return
    plan = scene.plan()
    content = {
        name: getattr(plan, name)
        for name in ("rtol", "error", "seconds", "left_out", "switched_off")
    }
    content |= {"first_use_seconds": plan.first_use}
    steps = [vars(step) | {"island_model": step.island_model_name} for step in plan.steps]
    echo(to_json(content | {"steps": steps}))


@click.command("run", short_help="Compute a scene.")
@toml_file
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write it to result.nc or result.csv; - for CSV to stdout.",
)
@json_option("a table")
def run_command(file: Path, out: Path | None, as_json: bool) -> None:
    """Compute the scene in FILE, and nothing that it does not ask for.

    CSV and the table hold what is known at gaps; netCDF and JSON hold everything.

    Example: mbma run examples/scene_joint.toml --out joint.nc
    """
    if out is not None and str(out) != "-" and out.suffix not in SUFFIXES:
        raise InputError(f"--out must end with one of {', '.join(SUFFIXES)}, got {out}")
    from mbma_tables.design.scenes.scene import Scene

    found = Scene.from_toml(file).run()
    # the quantities at gaps, or at islands if there are none at gaps
    dims = [field.dims for field in found.variables.values()]
    lines = next((lines for lines in (("gap",), ("island", "node")) if lines in dims), ())
    fields = {
        str(name): field for name, field in found.variables.items() if field.dims == lines
    }
    facts = found.attrs
    made = (
        f"variant {facts['variant']}" if facts["variant"] else f"theory {facts['theory']}"
    )
    error = (
        f"error at most {facts['error']:.2g}"
        if math.isfinite(facts["error"])
        else "error not known"
    )
    notes = [f"{made}, rtol {facts['rtol']:.3g}, {error}"]
    units = {n: f.attrs["units"] for n, f in fields.items()}
    values = {name: field.values for name, field in fields.items()}
    report = Report("run", str(facts["title"]), notes, dict(facts), values, units)
    if out is not None:
        netcdf = out.suffix == ".nc"
        write_file(
            out, written_bytes("scene.nc", lambda path: found.to_netcdf(path, engine="netcdf4"))
            if netcdf else report.to_csv().encode(),
        )  # fmt: skip
    if as_json:
        echo(to_json(found.to_dict()))
    elif out is None:
        echo(report.to_table(), nl=False)


def _flag(name: str) -> str:
    """The option of an argument of `Joint.export`."""
    return "--without-heat" if name == "heat" else f"--{name.replace('_', '-')}"


def _entries(
    file: Path | None, settings: tuple[str, ...], face: dict[str, Any]
) -> dict[str, Any]:
    """Entries of a joint: of a file, of the options of a face, and settings in place of them."""
    if file is not None and face:
        raise InputError(
            f"{', '.join(_flag(name) for name in face)} are of a joint without a file: "
            "--set changes entries of the file"
        )
    entries = {} if file is None else read_toml(file, "joint")
    for name, value in face.items():
        if name == "bodies":
            names = [each.strip() for each in value.split(",")]
            entries[name] = names[0] if len(names) == 1 else names
        else:
            set_entry(
                entries, name if name == "nominal_area" else f"part_a.{name}", value
            )
    if not entries and not settings:
        raise InputError(
            "a joint is needed: its FILE, or --Ra and other numbers of a face with "
            "--nominal-area and --bodies, or --set NAME=VALUE"
        )
    return with_settings(entries, settings)


def _joint(file: Path | None, entries: dict[str, Any]) -> Joint:
    """The joint of entries, which are those of a file or of options."""
    from mbma_tables.design.joint import Joint

    return Joint.from_entries(entries, Path("options") if file is None else file)


def _export_joint(
    file: Path | None, entries: dict[str, Any], out: Path, target: str, **options: Any
) -> None:
    """Write the joint of a file for another program."""
    made_by = [written_by(click.get_current_context().obj[1:], "joint")]
    if file is not None:
        digest = hashlib.sha256(read_file(file, MAX_BYTES)).hexdigest()
        made_by.insert(0, f"input {file}: sha256 {digest}")
    given = {**options, "made_by": tuple(made_by)}
    write_export(_joint(file, entries).subject(), target, given, out)


@click.command("batch", short_help="A joint for each row of a table of designs.")
@click.argument("designs", type=click.Path(path_type=Path, allow_dash=True))
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="FILE",
    required=True,
    help="Write answers.csv, .parquet or .nc; - for CSV to stdout.",
)
@click.option(
    "--file",
    type=click.Path(path_type=Path),
    metavar="TOML",
    help="A joint whose entries all rows have, where no column has them.",
)
@settings_option
@click.option(
    "--quantity",
    "quantities",
    metavar="NAME[,NAME]",
    help="Quantities of the answers; else those with a model uncertainty.",
)
@click.option(
    "--keep",
    metavar="NAME[,NAME]",
    default="",
    help="Columns that are no arguments, to be written as they are.",
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    help="Processes that compute rows.",
)
@click.option(
    "--draws", type=int, help="For each row with ranges; rows then have quantiles."
)
@click.option("--seed", type=int, default=0, help="Of the random numbers.")
def batch_command(
    designs: Path,
    out: Path,
    file: Path | None,
    settings: tuple[str, ...],
    quantities: str | None,
    keep: str,
    workers: int,
    draws: int | None,
    seed: int,
) -> None:
    """Quantities of a joint for each row of the table DESIGNS (.csv, .parquet, .nc).

    Columns are named as entries of a joint's file, with their unit: 'part_a.Ra [um]',
    'bodies.hardness [GPa]', 'nominal_area [cm^2]', and 'pressure [MPa]' or another load. Rows that
    are refused stay in the table, and the column "reason" says why.

    With --draws cells may be ranges, '0.3..0.5' below '[um]' or '0.4 um +- 10%', and rows have
    medians with their quantiles 5% and 95%.

    Example: mbma batch examples/designs.csv --file examples/joint.toml --out answers.csv
    """
    from mbma_tables.design.batch import batch

    entries = {} if file is None else read_toml(file, "joint")
    found = batch(
        designs,
        out,
        common=with_settings(entries, settings),
        quantities=None if quantities is None else quantities.split(","),
        keep=[name for name in keep.split(",") if name],
        path="joint" if file is None else file,
        workers=workers,
        draws=draws,
        seed=seed,
    )
    echo(
        f"mbma batch: {found.rows} rows, {found.refused} of them refused, "
        f"{found.not_valid} not valid",
        err=True,
    )


def _picture(joint: Joint, plot: Path | None) -> bytes:
    """The picture of a joint, if one is asked for."""
    from mbma_tables.common.plots import to_picture

    return b"" if plot is None else to_picture(joint.plot(), plot.suffix[1:])


def _report_of_ranges(
    joint: Joint, pressures: list[Any], title: str, drawn: dict[str, Any]
) -> Report:
    """Medians and quantiles of a joint with ranges, with the shares of its inputs."""
    from mbma_tables.design.uncertainty import LOAD

    found = joint.uncertainty(pressures, **drawn)
    facts = joint.facts()
    assumed = [f"{name} {text}" for name, text in joint.assumed.items()]
    assumed += assumptions(joint.surface)
    notes = [f"{name}: {text}" for name, text in facts.items() if name != "assumed"]
    notes += assumption_notes(assumed)
    if LOAD in found.inputs:
        notes.append(f"{LOAD}: {found.inputs[LOAD].text}")
    return report_of_quantiles(
        "joint", title, notes, {**facts, "assumed": assumed}, found
    )


@click.command(
    "joint",
    cls=WithFileOptions,
    groups=OF_LAWS,
    short_help="Stiffness, area, gap and conductance of two metal parts.",
)
@click.argument("file", type=click.Path(path_type=Path), required=False)
@settings_option
@face_options
@numbers_option(
    "--pressure",
    "-p",
    help="Force over nominal area; plain numbers are in the unit of the modulus, GPa for metals.",
)
@click.option(
    "--force",
    multiple=True,
    metavar="X[UNIT]",
    help="In place of pressures: 40kN, on nominal_area.",
)
@plot_option
@draws_options
@click.option(
    "--export",
    "target",
    metavar="TARGET",
    help="Write for another program: a target of `mbma export`.",
)
@output_options
def joint_command(
    file: Path | None,
    settings: tuple[str, ...],
    face: dict[str, Any],
    pressure: list[float | str] | None,
    force: tuple[str, ...],
    plot: Path | None,
    drawn: dict[str, Any],
    output: Output,
    target: str | None,
    asked: dict[str, Any],
) -> None:
    """Interface laws of the joint in FILE (TOML: bodies, nominal_area, part_a, part_b) at pressures.

    Numbers may be ranges, '0.25..2.5 mm', or means with a deviation, '1.6 um +- 0.2 um':
    the table then has the median of each quantity and its quantiles 5% and 95%, and lines
    above it the shares of inputs. --set changes entries of the file. Without a file, --Ra
    and other numbers are those of one rough face.

    With --export the joint is written for another program instead, with conductance of
    solid spots and gas: any target of `mbma export` that takes a law.

    Example: mbma joint examples/joint.toml --pressure 1MPa,10MPa,50MPa

    Example: mbma joint examples/joint.toml --export abaqus --pressures 1MPa:50MPa --name
    JOINT --out joint.inp

    Example: mbma joint --Ra '1.6 um +- 0.2 um' --hurst 0.8 --longest 0.8mm --shortest 8um
    --nominal-area 4cm^2 --bodies 'steel 1020' --pressure 10MPa

    Example: mbma joint examples/joint.toml --set part_a.longest='0.25..0.8 mm' --pressure 10MPa
    """
    entries = _entries(file, settings, face)
    if target is not None:
        if pressure or force or plot is not None or output.as_json or output.as_csv:
            raise InputError(
                "--export writes the joint: leave --pressure, --force, --plot, --json and --csv out"
            )
        if output.out is None:
            raise InputError("--export needs --out, the file to write")
        _export_joint(file, entries, output.out, target, **asked)
        return
    if asked:
        raise InputError(
            f"{', '.join(_flag(name) for name in asked)} belong to --export TARGET"
        )
    if bool(pressure) == bool(force):
        raise InputError(
            "pressures or forces are needed: --pressure or --force; or --export TARGET"
        )
    check_plot(plot, output.out)
    from mbma_tables.design.uncertainty import Load

    joint = _joint(file, entries)
    title = "joint of options" if file is None else file.name
    pressures = pressure or [joint.pressure_of(each) for each in force]
    if joint.inputs or Load.of(pressures).distributions:
        report = _report_of_ranges(joint, pressures, title, drawn)
        report.write(output, plot, _picture(joint, plot))
        return
    if drawn:
        raise InputError(
            "--draws and --seed are of a joint with ranges, and this has none"
        )
    joint.require_one("a table")
    found = joint.at_pressure(pressures)
    values, units = columns_of(found, uncertainties=True)
    facts = joint.facts() | {"theory": found.theory}
    # a line for each assumption, as of other commands
    assumed = assumptions(joint.surface)
    notes = [f"{name}: {text}" for name, text in facts.items() if name != "assumed"]
    notes += assumption_notes(assumed)
    lines, validity = validity_of(found, values)
    notes += lines
    Report(
        "joint",
        title,
        notes,
        {**facts, "assumed": assumed, **validity},
        values,
        units,
    ).write(output, plot, _picture(joint, plot))
