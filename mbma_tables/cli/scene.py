"""`mbma plan` and `mbma run`: scenes from TOML files."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mbma_tables.cli.format import Report, to_columns, to_json
from mbma_tables.cli.options import check_plot, json_option, plot_option
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import write_file, written_bytes
from mbma_tables.common.progress import doing, echo

if TYPE_CHECKING:
    import xarray

SUFFIXES = (".nc", ".csv")
scene_file = click.argument("file", type=click.Path(path_type=Path))


@click.command("plan", short_help="Plan of a scene: steps, errors and computing times.")
@scene_file
@json_option("text")
def plan_command(file: Path, as_json: bool) -> None:
    """Plan of the scene in FILE: steps with the effects that need them, certified errors and measured costs.

    Example: mbma plan examples/scene_joint.toml
    """
    from mbma_tables.scenes.scene import Scene

    scene = Scene.from_toml(file)
    if not as_json:
        echo(scene.explain(), nl=False)
        return
    plan = scene.plan()
    content = {
        "rtol": plan.rtol,
        "error": plan.error,
        "seconds": plan.seconds,
        "first_use_seconds": plan.first_use,
        "steps": [vars(step) | {"island_model": step.island_model_name} for step in plan.steps],
        "left_out": plan.left_out,
        "switched_off": plan.switched_off,
    }
    echo(to_json(content))


@click.command("run", short_help="Compute a scene.")
@scene_file
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write it to result.nc or result.csv; - for CSV to stdout.",
)
@plot_option
@json_option("a table")
def run_command(file: Path, out: Path | None, plot: Path | None, as_json: bool) -> None:
    """Compute the scene in FILE, and nothing that it does not ask for.

    CSV and the table hold what is known at gaps; netCDF and JSON hold everything.

    Example: mbma run examples/scene_joint.toml --out joint.nc
    """
    if out is not None and str(out) != "-" and out.suffix not in SUFFIXES:
        raise InputError(f"--out must end with one of {', '.join(SUFFIXES)}, got {out}")
    check_plot(plot, out)
    from mbma_tables.scenes.scene import Scene

    scene = Scene.from_toml(file)
    if plot is not None:
        scene = dataclasses.replace(scene, effects=(*scene.effects, "pressure", "area"))  # what is drawn
    found = scene.run(lambda step, done, total: doing(f"{step}: {done} of {total}"))
    if plot is not None:
        write_file(plot, _picture(found, plot.suffix[1:]))
    if out is not None:
        write_file(
            out,
            written_bytes("scene.nc", lambda path: found.to_netcdf(path, engine="netcdf4"))
            if out.suffix == ".nc"
            else _report(found).to_csv().encode(),
        )
    if as_json:
        variables = {
            str(name): {"dims": list(field.dims), "units": field.attrs["units"], "values": field.values.tolist()}
            for name, field in found.variables.items()
        }
        echo(to_json({"attributes": found.attrs, "variables": variables}))
    elif out is None:
        echo(_report(found).to_table(), nl=False)


def _report(found: xarray.Dataset) -> Report:
    """The quantities at gaps, or at islands if there are none at gaps."""
    lines = next((d for d in (("gap",), ("island", "node")) if any(v.dims == d for v in found.variables.values())), ())
    fields = {str(name): field for name, field in found.variables.items() if field.dims == lines}
    columns = to_columns(
        {name: field.values for name, field in fields.items()},
        {name: field.attrs["units"] for name, field in fields.items()},
    )
    facts = found.attrs
    made = f"variant {facts['variant']}" if facts["variant"] else f"theory {facts['theory']}"
    error = f"error at most {facts['error']:.2g}" if math.isfinite(facts["error"]) else "error not known"
    notes = [f"{made}, rtol {facts['rtol']:.3g}, {error}"]
    return Report("run", str(facts["title"]), notes, dict(facts), columns)


def _picture(found: xarray.Dataset, kind: str) -> bytes:
    from mbma_tables.common.plots import Curve, draw_compression, pressure_label, theory_label, to_picture

    gap = found["mean_separation"].values / found.attrs["surface_h_rms"]
    variant = found.attrs["variant"]
    label = theory_label(found.attrs["theory"]) + (f", {variant}" if variant else "")
    bands = [found[name].values if name in found else None for name in ("scatter", "area_scatter")]
    curves: list[Any] = [Curve(label, gap, found["pressure"].values, found["area"].values, *bands)]
    unit = found["pressure"].attrs["units"]
    hardness = f", hardness {found.attrs['hardness']:.4g} {unit}" if "hardness" in found.attrs else ""
    drawn = draw_compression(curves, found.attrs["title"] + hardness, pressure_label(unit))
    return to_picture(drawn, kind)
