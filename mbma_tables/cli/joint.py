"""`mbma joint`: interface laws of two metal parts from a TOML file."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np

from mbma_tables.cli import options
from mbma_tables.cli.format import Report, to_columns
from mbma_tables.common.errors import InputError


@click.command("joint", short_help="Stiffness, area, gap and conductance of two metal parts.")
@click.argument("file", type=click.Path(path_type=Path))
@options.numbers_option("--pressure", "-p", help="Force over nominal area; plain numbers are in GPa.")
@options.plot_option
@options.output_options
def joint_command(file: Path, pressure: list[float | str] | None, plot: Path | None, output: options.Output) -> None:
    """Interface laws of the joint in FILE (TOML: materials, nominal_area, part_a, part_b) at pressures.

    Example: mbma joint examples/joint.toml --pressure 1MPa,10MPa,50MPa
    """
    if not pressure:
        raise InputError("pressures are needed: --pressure")
    options.check_plot(plot, output.out)
    from mbma_tables.common.plots import to_picture
    from mbma_tables.joint import Joint

    joint = Joint.from_toml(file)
    found = joint.at_pressure(pressure)
    held = joint.quantities(found)
    values = {name: kept.values for name, kept in held.items()} | {"valid": np.where(found.valid, "yes", "no")}
    facts = joint.facts()
    notes = [f"{name}: {text}" for name, text in facts.items()]
    notes += [
        f"not valid at {int(np.sum(mask))} of {np.size(mask)}: {reason}" for reason, mask in found.reasons.items()
    ]
    units = {name: kept.unit for name, kept in held.items() if kept.unit != "1"}
    picture = b"" if plot is None else to_picture(joint.plot(), plot.suffix[1:])
    Report("joint", file.name, notes, facts, to_columns(values, units)).write(output, plot, picture)
