"""From numbers of the model to a report: units, the surface's numbers, what made the answer."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mbma_tables.cli.format import Column, Report
from mbma_tables.cli.sources import Source

SURFACE_NUMBERS = ("hurst", "q0", "q1", "zeta_1", "h_rms", "h_max", "m0", "m2", "m4", "alpha")
# options that say where the answer goes, or that the report names by themselves
NO_ARGUMENTS = ("as_json", "as_csv", "out", "plot", "reading", "tier", "rtol")


def units_of(length: str | None) -> dict[str, str]:
    """Unit of every named number that has one, for a unit of length."""
    unit = length or "length"
    return {
        **dict.fromkeys(("separation", "mean_separation", "delta", "R_d", "R_u", "sigma", "h_d"), unit),
        **dict.fromkeys(("h_rms", "h_max"), unit),
        **dict.fromkeys(("q0", "q1"), f"1/{unit}"),
        **dict.fromkeys(("D", "m4"), f"1/{unit}^2"),
        "m0": f"{unit}^2",
    }


def to_columns(values: Mapping[str, Any], units: Mapping[str, str]) -> list[Column]:
    """One column for each array, scalars being arrays of one entry; NaN says that there is no number."""
    import numpy as np

    columns = []
    for name, array in values.items():
        entries = np.atleast_1d(array).tolist()
        known = [None if entry != entry else entry for entry in entries]
        columns.append(Column(name, units.get(name, "-"), known))
    return columns


def describe_surface(source: Source) -> tuple[dict[str, Any], list[str]]:
    """The surface's numbers for a program, and lines of them for a reader."""
    surface, units = source.surface, units_of(source.length_unit)
    numbers = {name: float(getattr(surface, name)) for name in SURFACE_NUMBERS}
    facts: dict[str, Any] = {"length_unit": source.length_unit, **numbers}
    shown = [f"{name} {value:.6g} {units.get(name, '')}".rstrip() for name, value in numbers.items()]
    notes = ["surface: " + ", ".join(shown)]
    if surface.fit is not None:
        fields = [field.name for field in dataclasses.fields(surface.fit)]
        fit = {name: _plain(getattr(surface.fit, name)) for name in fields}
        facts["fit"] = fit
        shown = [
            f"{name} {value:.6g}" if isinstance(value, float) else f"{name} {value}"
            for name, value in fit.items()
            if value is not None
        ]
        notes.append("fit: " + ", ".join(shown))
    return facts, notes


def _plain(value: Any) -> Any:
    """A number, array or text as JSON has it."""
    return value.tolist() if hasattr(value, "tolist") else value


def describe_answer(
    command: str,
    source: Source,
    answer: Any,
    values: Mapping[str, Any],
    units: Mapping[str, str],
    given: Mapping[str, Any],
) -> Report:
    """The report of a command that evaluated the model.

    Parameters
    ----------
    command : str
        Its name.
    source : Source
        The surface.
    answer : Contact or Island
        What says which reading and tier made it.
    values, units : mapping
        Arrays by column, and the units that `units_of` does not know.
    given : mapping
        The command's parameters.
    """
    surface, notes = describe_surface(source)
    scale = "forces are over E*, none was given" if source.E_star is None else f"E* is {source.E_star:.6g}"
    notes += [
        f"reading {answer.reading}, tier {answer.tier}, rtol {given['rtol']:g}; {scale}",
        "error bounds the relative error of force and area",
    ]
    facts = {
        "arguments": {
            key: str(value) if isinstance(value, Path) else value
            for key, value in given.items()
            if key not in NO_ARGUMENTS and value is not None and value is not False
        },
        "reading": answer.reading,
        "tier": answer.tier,
        "rtol": given["rtol"],
        "E_star": source.E_star,
        "surface": surface,
    }
    every_unit = {**units_of(source.length_unit), "error": "relative", **units}
    return Report(command, source.title, notes, facts, to_columns(values, every_unit))
