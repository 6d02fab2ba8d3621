"""The commands of `mbma`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import click

from mbma_tables.cli.describe import SURFACE_NUMBERS, describe_answer, to_columns
from mbma_tables.cli.format import Report
from mbma_tables.cli.options import (
    model_options,
    numbers_option,
    output_options,
    over_h_rms,
    surface_options,
)
from mbma_tables.cli.sources import Source, read_source
from mbma_tables.errors import InputError
from mbma_tables.files import write_file

LIGHTEST = 1e-3  # (h_max - d)/h_max of a curve's lightest contact
EVEN_FROM = 0.2  # and where its points, geometric so far, become evenly spaced
FEWEST_POINTS = 5
LABELS = {
    "greenwood_williamson": "Greenwood-Williamson",
    "persson": "Persson",
    "persson_simplified": "Persson, simplified",
}
ISLAND_FIELDS = ("zeta_d", "zeta_u", "R_d", "R_u", "D", "sigma", "h_d", "eta", "X", "mu")


def _lengths(name: str, source: Source, given: Mapping[str, Any]) -> Any:
    """The lengths of an option, in the surface's unit."""
    from mbma_tables.arguments import finite_array

    numbers = finite_array(name, given[name])
    return numbers * source.surface.h_rms if given["over_h_rms"] else numbers


def _model(given: Mapping[str, Any], source: Source) -> dict[str, Any]:
    """What `contact` and `island` are asked for besides the surface and the gap."""
    asked = {name: given[name] for name in ("tier", "reading", "rtol")}
    return asked | {"E_star": 1.0 if source.E_star is None else source.E_star}


def _stress_units(source: Source) -> dict[str, str]:
    return {"force": "F/(A0 E*)" if source.E_star is None else "F/A0", "area": "A/A0"}


def _finish(report: Report, given: Mapping[str, Any], picture: bytes | None = None) -> None:
    """Write the files, then stdout."""
    if given["as_json"] and given["as_csv"]:
        raise InputError("one of --json and --csv, not both")
    text = report.to_json() if given["as_json"] else report.to_csv() if given["as_csv"] else report.to_table()
    if given["out"] is not None:
        if picture is not None and given["out"] == given["plot"]:
            raise InputError(f"--out and --plot name the same file, {given['out']}")
        write_file(given["out"], text.encode())
    if picture is not None:
        write_file(given["plot"], picture)
    if given["out"] is None:
        click.echo(text, nl=False)


@click.command("contact", short_help="Force and area at given gaps.")
@numbers_option("--separation", "-d", help="Gap d from the mid-plane [length]; may be repeated.")
@numbers_option("--mean-separation", "-u", help="Instead: mean separation u = (h_max + d)/2 [length].")
@over_h_rms
@surface_options
@model_options
@output_options
def contact_command(**given: Any) -> None:
    """Force and real contact area at given gaps.

    Lengths are in the surface's own unit. Force is F/(A0 E*), or F/A0 where a modulus is given; area is A/A0.

    Example: mbma contact --surface yang-persson -d 2,1.5 --over-h-rms
    """
    if (given["separation"] is None) == (given["mean_separation"] is None):
        raise InputError("gaps are needed: either --separation or --mean-separation")
    from mbma_tables.arguments import require
    from mbma_tables.theories import separation
    from mbma_tables.totals.contact import contact

    source = read_source(given)
    if given["separation"] is not None:
        gap = _lengths("separation", source, given)
    else:
        average = _lengths("mean_separation", source, given)
        require("mean_separation", average, average >= 0, "at least 0, where the model ends")
        gap = separation(source.surface, average)
    answer = contact(source.surface, gap, **_model(given, source))
    columns = ("separation", "mean_separation", "force", "area", "error")
    values = {name: getattr(answer, name) for name in columns}
    _finish(describe_answer("contact", source, answer, values, _stress_units(source), given), given)


def curve_gaps(h_max: float, points: int) -> Any:
    """Separations from h_max to -h_max: the first, then half geometric in h_max - d, then half even."""
    import numpy as np

    light = (points - 1) // 2
    deep = points - 1 - light
    approach = np.concatenate(
        [[0.0], np.geomspace(LIGHTEST, EVEN_FROM, light + 1)[:-1], np.linspace(EVEN_FROM, 2.0, deep)]
    )
    return h_max * (1 - approach)


def _other_theories(surface: Any, average: Any, gap: Any, modulus: float) -> dict[str, tuple[Any, Any]]:
    """Force and area of the theories beside MBMA; NaN where Persson's full load is infinite, at u = 0."""
    import numpy as np

    from mbma_tables import theories

    asperities = theories.greenwood_williamson(surface, gap, modulus)
    found = {"greenwood_williamson": (asperities.force, asperities.area)}
    methods: dict[str, Literal["full", "simplified"]] = {
        "persson": "full",
        "persson_simplified": "simplified",
    }
    for name, method in methods.items():
        apart = average > 0 if method == "full" else average >= 0
        force, area = np.full((2, average.size), np.nan)
        force[apart] = theories.persson_force(surface, average[apart], modulus, method=method)
        area[apart] = theories.persson_area(surface, force[apart], modulus)
        found[name] = (force, area)
    return found


@click.command("curve", short_help="Force and area from first contact to full compression.")
@click.option("--points", type=click.IntRange(min=FEWEST_POINTS), default=41, show_default=True, help="How many gaps.")
@click.option("--compare", is_flag=True, help="Add Greenwood-Williamson and Persson (full and simplified).")
@click.option("--plot", type=click.Path(path_type=Path), metavar="FILE.png", help="Draw force and area to a PNG file.")
@surface_options
@model_options
@output_options
def curve_command(**given: Any) -> None:
    """Force and area from first contact (d = h_max) to full compression (d = -h_max).

    Half of the points are geometric in (h_max - d)/h_max, from 0.001 to 0.2, since the force falls like its
    power 7/2 at light contact; the rest are even, up to 2.

    Example: mbma curve --surface concrete --plot concrete.png
    """
    if given["plot"] is not None and given["plot"].suffix.lower() != ".png":
        raise InputError(f"--plot writes PNG: the file's name must end with .png, got {given['plot']}")
    from mbma_tables.totals.contact import contact

    source = read_source(given)
    gap = curve_gaps(float(source.surface.h_max), given["points"])
    model = _model(given, source)
    answer = contact(source.surface, gap, **model)
    columns = ("separation", "mean_separation", "force", "area", "error")
    values = {name: getattr(answer, name) for name in columns}
    units = _stress_units(source)
    lines = {"mbma": (answer.force, answer.area)}
    if given["compare"]:
        others = _other_theories(source.surface, answer.mean_separation, gap, model["E_star"])
        for theory, pair in others.items():
            for quantity, array in zip(("force", "area"), pair, strict=True):
                values[f"{theory}_{quantity}"] = array
                units[f"{theory}_{quantity}"] = units[quantity]
        lines |= others
    report = describe_answer("curve", source, answer, values, units, given)
    picture = None if given["plot"] is None else _draw(report, source, answer.mean_separation, lines)
    _finish(report, given, picture)


def _draw(report: Report, source: Source, average: Any, lines: Mapping[str, tuple[Any, Any]]) -> bytes:
    import numpy as np

    from mbma_tables.plots import Curve, draw_compression, to_png

    gap = average / source.surface.h_rms
    curves = []
    for name, (force, area) in lines.items():
        known = np.isfinite(force)
        label = f"MBMA, {report.facts['reading']}" if name == "mbma" else LABELS[name]
        curves.append(Curve(label, gap[known], force[known], area[known]))
    force_label = f"force  {_stress_units(source)['force']}"
    return to_png(draw_compression(curves, source.title, force_label))


@click.command("island", short_help="Contact islands at given approaches.")
@numbers_option("--delta", help="Approach z_max - d of an island [length], positive; may be repeated.")
@over_h_rms
@surface_options
@model_options
@output_options
def island_command(**given: Any) -> None:
    """Band, radii, densities, force and area of contact islands at given approaches.

    Force is F/E*, or F where a modulus is given.

    Example: mbma island --surface concrete --delta 0.1,0.3
    """
    if given["delta"] is None:
        raise InputError("approaches are needed: --delta")
    from mbma_tables.totals.island import island

    source = read_source(given)
    answer = island(source.surface, _lengths("delta", source, given), **_model(given, source))
    values = {name: getattr(answer, name) for name in ("delta", *ISLAND_FIELDS, "force", "area", "error")}
    square = f"{source.length_unit or 'length'}^2"
    units = {"force": square if source.E_star is None else f"[E*] {square}", "area": square}
    _finish(describe_answer("island", source, answer, values, units, given), given)


@click.command("surfaces", short_help="The named surfaces.")
@output_options
def surfaces_command(**given: Any) -> None:
    """The paper's surfaces by name, with their numbers, each in its own unit of length."""
    from mbma_tables.surfaces.cases import CASES
    from mbma_tables.surfaces.surface import Surface

    cases, surfaces = CASES.values(), [Surface.named(name) for name in CASES]
    values: dict[str, Any] = {"name": list(CASES), "length_unit": [case.length_unit for case in cases]}
    values |= {name: [getattr(surface, name) for surface in surfaces] for name in SURFACE_NUMBERS}
    values["title"] = [case.title for case in cases]
    _finish(Report("surfaces", "the paper's cases", [], {}, to_columns(values, {})), given)
