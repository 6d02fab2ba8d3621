"""The command `mbma sensitivity`: how much each unknown of a surface matters."""

from __future__ import annotations

import math
from typing import Any

import click

from mbma_tables.cli import options
from mbma_tables.cli.format import Column, Report, shown_unit, to_columns
from mbma_tables.common.errors import InputError
from mbma_tables.scenes.specimen import Specimen


def _pair(text: str) -> tuple[str, tuple[str, str]]:
    name, equals, ends = text.partition("=")
    low, colon, high = ends.partition(":")
    if not (equals and colon and low and high):
        raise InputError(f"--range must be like h_max=2um:4um, got {text!r}")
    return name.strip().lstrip("-").replace("-", "_"), (low, high)


@click.command("sensitivity", short_help="How much each unknown matters.")
@options.load_options(options.quantity_option)
@click.option(
    "--range", "ranges", multiple=True, metavar="NAME=X:X", help="Where a parameter may lie; may be repeated."
)
@options.specimen_options
@options.theory_options
@options.output_options
def sensitivity_command(
    loads: dict[str, Any], ranges: tuple[str, ...], specimen: Specimen, model: options.Model, output: options.Output
) -> None:
    """d ln(answer)/d ln(parameter) of force, area, stiffness and conductance, what is given being held.

    Parameters are the surface's five numbers, or those of a drawing; of a map or a spectrum the scales of its heights
    and lengths, h_max, cut-offs and the exponent of what is extrapolated. With --range also the smallest and largest
    answer while one runs over its range, and over the ends of all ranges together.

    Example: mbma sensitivity --surface concrete --E-star 13.3MPa -p 100kPa --range h_max=1:1.5 --range hurst=0.6:0.8
    """
    from mbma_tables.answers.sensitivity import sensitivity

    model = model.of(specimen.surface)
    asked = vars(model).copy()
    if asked.pop("hardness") != math.inf:
        raise InputError("sensitivity is of elastic contacts: leave --hardness out")
    modulus: Any = 1.0 if specimen.E_star is None else specimen.E_star
    if specimen.stress_unit is not None:
        modulus = f"{modulus!r} {specimen.stress_unit}"
    found = sensitivity(specimen.surface, **loads, E_star=modulus, ranges=dict(map(_pair, ranges)), **asked)
    parameters = list(found.parameters)
    columns = [
        Column("parameter", "-", parameters),
        Column("value", "-", list(found.parameters.values())),
        Column("unit", "-", [shown_unit(name, found.units) for name in parameters]),
    ]
    columns += to_columns({answer: [found.slopes[name][answer] for name in parameters] for answer in found.answers}, {})

    def with_unit(answer: str, text: str) -> str:
        return f"{answer} {text} {shown_unit(answer, found.units)}".removesuffix(" -")

    here = ", ".join(with_unit(name, f"{value:.6g}") for name, value in found.answers.items())
    notes = [f"theory {model.theory}; d ln(answer)/d ln(parameter) at given {found.by}", f"here: {here}"]
    notes.append("conductance is over the mean conductivity of the bodies")
    for name, spans in found.ranges.items():
        ends = ", ".join(with_unit(answer, f"{low:.4g} to {high:.4g}") for answer, (low, high) in spans.items())
        notes.append(f"range of {name}: {ends}")
    facts = {
        "theory": model.theory,
        "by": found.by,
        "answers": found.answers,
        "ranges": found.ranges,
        "errors": found.errors,
        "answer_units": {name: shown_unit(name, found.units) for name in found.answers},
    }
    Report("sensitivity", specimen.title, notes, facts, columns).write(output)
