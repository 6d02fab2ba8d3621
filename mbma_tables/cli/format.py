"""The result of a command, with units and provenance, as a table, JSON or CSV."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from mbma_tables import __version__
from mbma_tables.cli.options import Model, Output
from mbma_tables.common.files import write_file
from mbma_tables.common.progress import echo
from mbma_tables.common.units import Units, unit_of
from mbma_tables.scenes.specimen import Specimen
from mbma_tables.surfaces.roughness import ASSUMED
from mbma_tables.surfaces.surface import Surface

if TYPE_CHECKING:
    from mbma_tables.answers.result import Contact

DIGITS = 6  # significant digits of a table; JSON and CSV keep all
SURFACE_NUMBERS = ("hurst", "q0", "q1", "zeta_1", "h_rms", "h_max", "m0", "m2", "m4", "alpha")
# options on the output, and those that the report names separately
NOT_ARGUMENTS = ("as_json", "as_csv", "out", "plot", "theory", "variant", "island_model", "rtol")


@dataclasses.dataclass(frozen=True)
class Column:
    """A named column with its unit: texts, or numbers with None where there is none."""

    name: str
    unit: str
    values: list[Any]


@dataclasses.dataclass(frozen=True)
class Report:
    """Columns of one length, and their provenance.

    `notes` are lines of text; `facts` contain the same and more in machine-readable form.
    """

    command: str
    title: str
    notes: list[str]
    facts: dict[str, Any]
    columns: list[Column]

    def to_table(self) -> str:
        """Aligned columns under their names, and their units where they have any."""
        with_units = any(c.unit != "-" for c in self.columns)
        cells = [[c.name, *([c.unit] if with_units else []), *map(_rounded, c.values)] for c in self.columns]
        widths = [max(map(len, column)) for column in cells]
        texts = [any(isinstance(value, str) for value in c.values) for c in self.columns]
        lines = [
            "  ".join(
                cell.ljust(width) if text else cell.rjust(width)
                for cell, width, text in zip(row, widths, texts, strict=True)
            ).rstrip()
            for row in zip(*cells, strict=True)
        ]
        return "\n".join([f"mbma {self.command}: {self.title}", *self.notes, "", *lines]) + "\n"

    def to_json(self) -> str:
        """One JSON object, its numbers with all their digits."""
        content = {
            "program": f"mbma {__version__}",
            "command": self.command,
            "title": self.title,
            **self.facts,
            "units": {c.name: c.unit for c in self.columns},
            "columns": {c.name: c.values for c in self.columns},
        }
        return to_json(content) + "\n"

    def to_csv(self) -> str:
        """Comment lines, the columns' names, then their numbers with all their digits."""
        units = "; ".join(f"{c.name} [{c.unit}]" for c in self.columns)
        head = [f"mbma {__version__} {self.command}: {self.title}", *self.notes, f"columns: {units}"]
        content = io.StringIO()
        content.writelines(f"# {line}\n" for line in head)
        rows = csv.writer(content, lineterminator="\n")
        rows.writerow(c.name for c in self.columns)
        rows.writerows(map(_harmless, row) for row in zip(*(c.values for c in self.columns), strict=True))
        return content.getvalue()

    def write(self, output: Output, plot: Path | None = None, picture: bytes = b"") -> None:
        """To its file, with the picture after it, or to stdout once the picture is written."""
        text = self.to_json() if output.as_json else self.to_csv() if output.as_csv else self.to_table()
        if output.out is not None and str(output.out) != "-":
            write_file(output.out, text.encode())
        if plot is not None:
            write_file(plot, picture)
        if output.out is None or str(output.out) == "-":
            echo(text, nl=False)


def to_json(content: Any) -> str:
    """JSON, with null in place of missing numbers."""
    return json.dumps(json.loads(json.dumps(content), parse_constant=lambda _: None), indent=2)


def _harmless(cell: Any) -> Any:
    """A cell of CSV; text that a spreadsheet would run as a formula begins with an apostrophe."""
    return f"'{cell}" if isinstance(cell, str) and cell[:1] in ("=", "+", "-", "@", "\t", "\r") else cell


def _rounded(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.{DIGITS}g}" if isinstance(value, float) else str(value)


def shown_unit(name: str, units: Units) -> str:
    """The unit of a column; "-" where it has none."""
    unit = "relative" if name == "error" else unit_of(name, units)
    return "-" if unit == "1" else unit


def to_columns(values: Mapping[str, Any], units: Mapping[str, str]) -> list[Column]:
    """One column for each array, scalars being arrays of one entry; NaN stands for missing numbers."""
    columns = []
    for name, array in values.items():
        entries = np.atleast_1d(array).ravel().tolist()
        columns.append(Column(name, units.get(name, "-"), [None if entry != entry else entry for entry in entries]))
    return columns


def _surface_facts(specimen: Specimen) -> tuple[dict[str, Any], list[str]]:
    """The surface's parameters in machine-readable form, and as lines of text."""
    surface = specimen.surface
    known = {name: getattr(surface, name) for name in SURFACE_NUMBERS}
    # a spectrum that is no power law has no Hurst exponent
    numbers = {name: float(value) for name, value in known.items() if value is not None}
    facts: dict[str, Any] = {"length_unit": surface.unit, **numbers}
    units = {name: shown_unit(name, specimen.units).strip("-") for name in numbers}
    shown = [f"{name} {value:.6g} {units[name]}".rstrip() for name, value in numbers.items()]
    notes = ["surface: " + ", ".join(shown)]
    assumed = [line for record in surface.provenance for line in record.get("assumed", ())]
    if isinstance(surface, Surface) and ASSUMED not in assumed:
        assumed.insert(0, ASSUMED)
    notes += [f"assumed: {line}" for line in assumed]
    facts["assumed"] = assumed
    notes += [record["told"] for record in surface.provenance if "told" in record]
    facts["provenance"] = [dict(record) for record in surface.provenance]
    fit = getattr(surface, "fit", None)  # of five numbers; of a spectrum a method
    if dataclasses.is_dataclass(fit):
        values = {field.name: getattr(fit, field.name) for field in dataclasses.fields(fit)}
        facts["fit"] = {name: v.tolist() if hasattr(v, "tolist") else v for name, v in values.items()}
        notes.append("fit: " + ", ".join(f"{name} {_rounded(v)}" for name, v in facts["fit"].items() if v is not None))
    return facts, notes


def _validity(answer: Contact) -> tuple[list[str], dict[str, Any]]:
    """Range in which a contact's theory was tested, and its scatter: lines of text, and machine-readable facts."""
    valid = np.atleast_1d(answer.valid)
    reasons = {reason: np.atleast_1d(mask) for reason, mask in answer.reasons.items()}
    notes = []
    if reasons:
        listed = "; ".join(f"{reason} ({int(mask.sum())})" for reason, mask in reasons.items())
        notes.append(f"not valid at {int((~valid).sum())} of {valid.size}: {listed}")
    texts = {
        "scatter": "ln force {} at a separation",
        "area_scatter": "ln area {} at a force",
        "stiffness_scatter": "ln stiffness {}",
        "separation_scatter": f"u {{}} {answer.units['separation']}",
    }
    scatter = {name: np.atleast_1d(getattr(answer, name)) for name in texts}
    known = {name: values[np.isfinite(values)] for name, values in scatter.items()}
    said = [texts[name].format(f"{v.min():.2g} to {v.max():.2g}") for name, v in known.items() if v.size]
    if said:
        notes.append(f"scatter against simulations: {', '.join(said)}")
    facts: dict[str, Any] = {
        "valid": valid.tolist(),
        "reasons": {reason: np.flatnonzero(mask).tolist() for reason, mask in reasons.items()},
    }
    facts |= {name: v.tolist() for name, v in scatter.items()}  # NaN is null in JSON
    return notes, facts


def report_answer(
    command: str,
    specimen: Specimen,
    model: Model,
    answer: Any,
    values: Mapping[str, Any],
    units: Mapping[str, str] = MappingProxyType({}),
) -> Report:
    """The report of a command that evaluated the model; `units` are those that do not follow from names."""
    surface, notes = _surface_facts(specimen)
    scale = "forces are over E*, since no modulus was given"
    if specimen.E_star is not None:
        scale = f"E* is {specimen.E_star:.6g} {specimen.stress_unit or ''}".rstrip()
    made = (
        f", variant {answer.variant}, island model {answer.island_model}, rtol {model.rtol:g}" if answer.variant else ""
    )
    notes += [f"theory {model.theory}{made}; {scale}", "error: relative, numerical, beside the theory's scatter"]
    if hasattr(answer, "elastic_hardness"):
        limit = f"{answer.elastic_hardness:.4g} {specimen.stress_unit or ''}".rstrip()
        if not model.yields:
            notes.append(f"elastic: area within 5% for hardnesses from {limit} on")
        else:
            notes.append(f"hardness {model.hardness}: psi {answer.psi:.3g}, elastic up to 1.1 (from {limit} on)")
    facts = {
        "arguments": {
            key: str(value) if isinstance(value, Path) else value
            for key, value in click.get_current_context().params.items()
            if key not in NOT_ARGUMENTS and value is not None and value is not False
        },
        "theory": model.theory,
        "variant": answer.variant or None,
        "island_model": answer.island_model or None,
        "rtol": model.rtol if model.theory == "mbma" else None,
        "hardness": model.hardness if model.yields else None,
        "E_star": specimen.E_star,
        "stress_unit": specimen.stress_unit,
        "surface": surface,
    }
    if command != "island":
        lines, known = _validity(answer)
        notes += lines
        facts |= known
    own = {name: shown_unit(name, specimen.units) for name in values}
    return Report(command, specimen.title, notes, facts, to_columns(values, {**own, **units}))
