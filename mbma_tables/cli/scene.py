"""`mbma plan`, `mbma run` and `mbma joint`: scenes and joints from TOML files."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mbma_tables.cli.export import write_first
from mbma_tables.cli.format import (
    Report,
    assumption_notes,
    columns_of,
    to_json,
    validity_of,
)
from mbma_tables.cli.options import (
    Output,
    check_plot,
    file_options,
    given_values,
    json_option,
    numbers_option,
    option_group,
    output_options,
    plot_option,
)
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import MAX_BYTES, read_file, write_file, written_bytes
from mbma_tables.common.progress import echo
from mbma_tables.export.targets import targets
from mbma_tables.export.text import written_by
from mbma_tables.surfaces.surface import assumptions

if TYPE_CHECKING:
    pass

SUFFIXES = (".nc", ".csv")
toml_file = click.argument("file", type=click.Path(path_type=Path))


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


def _export_joint(file: Path, out: Path, target: str, **options: Any) -> None:
    """Write the joint of a file for another program."""
    from mbma_tables.design.joint import Joint

    digest = hashlib.sha256(read_file(file, MAX_BYTES)).hexdigest()
    command = written_by(click.get_current_context().obj[1:], "joint")
    options["made_by"] = f"input {file}: sha256 {digest}", command
    joint = Joint.from_toml(file)
    if str(out) == "-":
        first = joint.export(target, **options)
        assert isinstance(first, str | bytes)
        content = first.encode() if isinstance(first, str) else first
        write_first(targets()[target], content)
        return
    for path in joint.export(target, **options, path=out):
        echo(path)


_joint_options = option_group(
    "export",
    given_values,
    click.option(
        "--export",
        "target",
        metavar="TARGET",
        help="Write for another program: a target of `mbma export`.",
    ),
    click.option(
        "--without-heat",
        "heat",
        flag_value=False,
        default=None,
        help="Leave conductance out.",
    ),
    click.option("--length-unit", metavar="UNIT", help="Of the file; mm by default."),
    click.option("--stress-unit", metavar="UNIT", help="Of the file; MPa by default."),
)


@click.command(
    "joint", short_help="Stiffness, area, gap and conductance of two metal parts."
)
@toml_file
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
@_joint_options
@file_options
@output_options
def joint_command(
    file: Path,
    pressure: list[float | str] | None,
    force: tuple[str, ...],
    plot: Path | None,
    output: Output,
    export: dict[str, Any],
    asked: dict[str, Any],
) -> None:
    """Interface laws of the joint in FILE (TOML: bodies, nominal_area, part_a, part_b) at pressures.

    With --export the joint is written for another program instead, with conductance of
    solid spots and gas: any target of `mbma export` that takes a law.

    Example: mbma joint examples/joint.toml --pressure 1MPa,10MPa,50MPa

    Example: mbma joint examples/joint.toml --export abaqus --pressures 1MPa:50MPa --name
    JOINT --out joint.inp
    """
    export |= asked
    if "target" in export:
        if pressure or force or plot is not None or output.as_json or output.as_csv:
            raise InputError(
                "--export writes the joint: leave --pressure, --force, --plot, --json and --csv out"
            )
        if output.out is None:
            raise InputError("--export needs --out, the file to write")
        _export_joint(file, output.out, **export)
        return
    if export:
        raise InputError(
            f"{', '.join(_flag(name) for name in export)} belong to --export TARGET"
        )
    if bool(pressure) == bool(force):
        raise InputError(
            "pressures or forces are needed: --pressure or --force; or --export TARGET"
        )
    check_plot(plot, output.out)
    from mbma_tables.common.plots import to_picture
    from mbma_tables.design.joint import Joint

    joint = Joint.from_toml(file)
    joint.require_one("a table")
    found = joint.at_pressure(pressure or [joint.pressure_of(each) for each in force])
    values, units = columns_of(found, uncertainties=True)
    facts = joint.facts() | {"theory": found.theory}
    # a line for each assumption, as of other commands
    assumed = assumptions(joint.surface)
    notes = [f"{name}: {text}" for name, text in facts.items() if name != "assumed"]
    notes += assumption_notes(assumed)
    lines, validity = validity_of(found)
    notes += lines
    picture = b"" if plot is None else to_picture(joint.plot(), plot.suffix[1:])
    Report(
        "joint",
        file.name,
        notes,
        {**facts, "assumed": assumed, **validity},
        values,
        units,
    ).write(output, plot, picture)
