"""The commands `mbma contact`, `curve`, `island` and `surfaces`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from mbma_tables.cli.format import SURFACE_NUMBERS, Report, report_answer, to_columns
from mbma_tables.cli.options import (
    Model,
    Output,
    check_png,
    model_options,
    numbers_option,
    output_options,
    over_h_rms,
    png_option,
    specimen_options,
)
from mbma_tables.errors import InputError
from mbma_tables.scenes.specimen import Specimen

MIN_DEPTH = 1e-3  # (h_max - d)/h_max at a curve's second point
EVEN_FROM = 0.2  # and where its points, geometric so far, become evenly spaced
MIN_POINTS = 5
LABELS = {
    "greenwood_williamson": "Greenwood-Williamson",
    "persson": "Persson",
    "persson_simplified": "Persson, simplified",
}
COLUMNS = ("separation", "mean_separation", "force", "area", "error")
ISLAND_FIELDS = ("zeta_d", "zeta_u", "R_d", "R_u", "D", "sigma", "h_d", "eta", "X", "mu")


def _lengths(name: str, numbers: list[float], specimen: Specimen, over_h_rms: bool) -> Any:
    """The lengths of an option, in the surface's unit."""
    from mbma_tables.arguments import finite_array

    return finite_array(name, numbers) * (specimen.surface.h_rms if over_h_rms else 1.0)


def _asked(model: Model, specimen: Specimen) -> dict[str, Any]:
    """Keywords for `contact` and `island`."""
    return {**vars(model), "E_star": 1.0 if specimen.E_star is None else specimen.E_star}


def _stress_units(specimen: Specimen) -> dict[str, str]:
    return {"force": "F/(A0 E*)" if specimen.E_star is None else "F/A0", "area": "A/A0"}


@click.command("contact", short_help="Force and area at given gaps.")
@numbers_option("--separation", "-d", help="Gap d from the mid-plane [length]; may be repeated.")
@numbers_option("--mean-separation", "-u", help="Instead: mean separation u = (h_max + d)/2 [length].")
@over_h_rms
@specimen_options
@model_options
@output_options
def contact_command(
    separation: list[float] | None,
    mean_separation: list[float] | None,
    over_h_rms: bool,
    specimen: Specimen,
    model: Model,
    output: Output,
) -> None:
    """Force and real contact area at given gaps.

    Lengths are in the surface's own unit. Force is F/(A0 E*), or F/A0 where a modulus is given; area is A/A0.

    Example: mbma contact --surface yang-persson -d 2,1.5 --over-h-rms
    """
    known = {"separation": separation, "mean_separation": mean_separation}
    given = {name: numbers for name, numbers in known.items() if numbers is not None}
    if len(given) != 1:
        raise InputError("gaps are needed: either --separation or --mean-separation")
    from mbma_tables.arguments import require
    from mbma_tables.theories.contact import contact

    gaps = {name: _lengths(name, numbers, specimen, over_h_rms) for name, numbers in given.items()}
    if mean_separation is not None:
        average = gaps["mean_separation"]
        require("mean_separation", average, average >= 0, "at least 0, where the model ends")
    answer = contact(specimen.surface, **gaps, **_asked(model, specimen))
    values = {name: getattr(answer, name) for name in COLUMNS}
    report_answer("contact", specimen, model, answer, values, _stress_units(specimen)).write(output)


def curve_gaps(h_max: float, points: int) -> Any:
    """Separations from h_max to -h_max: the first, then half geometric in h_max - d, then half even."""
    import numpy as np

    light = (points - 1) // 2
    deep = points - 1 - light
    approach = np.concatenate(
        [[0.0], np.geomspace(MIN_DEPTH, EVEN_FROM, light + 1)[:-1], np.linspace(EVEN_FROM, 2.0, deep)]
    )
    return h_max * (1 - approach)


@click.command("curve", short_help="Force and area from first contact to full compression.")
@click.option("--points", type=click.IntRange(min=MIN_POINTS), default=41, show_default=True, help="How many gaps.")
@click.option("--compare", is_flag=True, help="Add Greenwood-Williamson and Persson (full and simplified).")
@png_option
@specimen_options
@model_options
@output_options
def curve_command(
    points: int, compare: bool, plot: Path | None, specimen: Specimen, model: Model, output: Output
) -> None:
    """Force and area from first contact (d = h_max) to full compression (d = -h_max).

    Half of the points are geometric in (h_max - d)/h_max, from 0.001 to 0.2, since the force falls like its
    power 7/2 at light contact; the rest are even, up to 2.

    Example: mbma curve --surface concrete --plot concrete.png
    """
    check_png(plot, output.out)
    from mbma_tables.theories.contact import contact

    gap = curve_gaps(float(specimen.surface.h_max), points)
    asked = _asked(model, specimen)
    answer = contact(specimen.surface, gap, **asked)
    values = {name: getattr(answer, name) for name in COLUMNS}
    units = _stress_units(specimen)
    lines = {"mbma": (answer.force, answer.area)}
    if compare:
        from mbma_tables.scenes.run import other_theory

        for theory in LABELS:
            lines[theory] = other_theory(theory, specimen.surface, gap, asked["E_star"])
            for quantity, array in zip(("force", "area"), lines[theory], strict=True):
                values[f"{theory}_{quantity}"] = array
                units[f"{theory}_{quantity}"] = units[quantity]
    picture = b"" if plot is None else _draw(specimen, answer, lines)
    report_answer("curve", specimen, model, answer, values, units).write(output, plot, picture)


def _draw(specimen: Specimen, answer: Any, lines: Mapping[str, tuple[Any, Any]]) -> bytes:
    import numpy as np

    from mbma_tables.plots import Curve, draw_compression, to_png

    gap = answer.mean_separation / specimen.surface.h_rms
    curves = []
    for name, (force, area) in lines.items():
        known = np.isfinite(force)
        label = f"MBMA, {answer.reading}" if name == "mbma" else LABELS[name]
        curves.append(Curve(label, gap[known], force[known], area[known]))
    return to_png(draw_compression(curves, specimen.title, f"force  {_stress_units(specimen)['force']}"))


@click.command("island", short_help="Contact islands at given approaches.")
@numbers_option("--delta", help="Approach z_max - d of an island [length], positive; may be repeated.")
@over_h_rms
@specimen_options
@model_options
@output_options
def island_command(
    delta: list[float] | None, over_h_rms: bool, specimen: Specimen, model: Model, output: Output
) -> None:
    """Band, radii, densities, force and area of contact islands at given approaches.

    Force is F/E*, or F where a modulus is given.

    Example: mbma island --surface concrete --delta 0.1,0.3
    """
    if delta is None:
        raise InputError("approaches are needed: --delta")
    from mbma_tables.totals.island import island

    answer = island(specimen.surface, _lengths("delta", delta, specimen, over_h_rms), **_asked(model, specimen))
    values = {name: getattr(answer, name) for name in ("delta", *ISLAND_FIELDS, "force", "area", "error")}
    square = f"{specimen.length_unit or 'length'}^2"
    units = {"force": square if specimen.E_star is None else f"[E*] {square}", "area": square}
    report_answer("island", specimen, model, answer, values, units).write(output)


@click.command("surfaces", short_help="The named surfaces.")
@output_options
def surfaces_command(output: Output) -> None:
    """The paper's surfaces by name, with their numbers, each in its own unit of length."""
    from mbma_tables.surfaces.cases import CASES
    from mbma_tables.surfaces.surface import Surface

    cases, surfaces = CASES.values(), [Surface.named(name) for name in CASES]
    values: dict[str, Any] = {"name": list(CASES), "length_unit": [case.length_unit for case in cases]}
    values |= {name: [getattr(surface, name) for surface in surfaces] for name in SURFACE_NUMBERS}
    values["title"] = [case.title for case in cases]
    Report("surfaces", "the paper's cases", [], {}, to_columns(values, {})).write(output)
