"""The command `mbma fit`: what a measured map or line scan says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from mbma_tables.cli.format import Report, to_columns
from mbma_tables.cli.options import Output, check_plot, map_options, output_options, plot_option, quantity_option


@click.command("fit", short_help="What a measured map or line scan says, and how it touches.")
@click.argument("measurement", metavar="MAP", type=click.Path(path_type=Path))
@quantity_option("--E-star", "E_star", help="Effective modulus; without one pressures are over E*.")
@plot_option
@map_options
@output_options
def fit_command(measurement: Path, E_star: Any, plot: Path | None, treatment: dict[str, Any], output: Output) -> None:
    """Read a map or line scan, say what was found in it and done to it, and how it touches a flat.

    The table is by the calibrated law, with its distance from boundary elements (scatter: standard deviation of ln A at
    a pressure and of ln F at a separation). The picture has the map, its spectrum, its heights, and area and
    separation against pressure.

    Example: mbma fit wafer.sur --short-cutoff 2um --plot wafer.png
    """
    check_plot(plot, output.out)
    from mbma_tables.measurement import curves, described, draw, table_of_loads
    from mbma_tables.plots import to_picture
    from mbma_tables.scenes.specimen import effective_modulus_of, measured
    from mbma_tables.units import Units, unit_of

    modulus, stress_unit = effective_modulus_of({} if E_star is None else {"E_star": E_star})
    treated, surface = measured(measurement, treatment)
    scale = 1.0 if modulus is None else modulus
    columns, told = table_of_loads(surface, scale)
    units = Units(surface.unit, "1" if modulus is None else stress_unit)
    facts = {
        "length_unit": surface.unit,
        "stress_unit": stress_unit,
        "h_rms": float(surface.h_rms),
        "h_max": float(surface.h_max),
        "rms_gradient": float(surface.rms_gradient),
        "skewness": surface.skewness,
        "kurtosis": surface.kurtosis,
        "anisotropy": surface.anisotropy,
        "provenance": list(surface.provenance),
        "notes": told,
    }
    title = measurement.name
    own = {name: unit_of(name, units) or "-" for name in columns} | {"area": "A/A0", "force": unit_of("force", units)}
    report = Report("fit", title, [*described(surface), *told], facts, to_columns(columns, own))
    picture = b""
    if plot is not None:
        label = "pressure  F/(A0 E*)" if modulus is None else f"pressure [{stress_unit or 'stress'}]"
        picture = to_picture(draw(treated, surface, curves(surface, scale), title, label), plot.suffix[1:])
    report.write(output, plot, picture)
