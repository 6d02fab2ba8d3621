"""The result of a command, with units and provenance, as a table, JSON or CSV."""

from __future__ import annotations

import csv
import dataclasses
import functools
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from mbma_tables import __version__
from mbma_tables.bodies.materials import ELASTIC_PSI
from mbma_tables.cli.options import Model, Output
from mbma_tables.common.display import shown
from mbma_tables.common.files import write_file
from mbma_tables.common.plain_text import visible
from mbma_tables.common.progress import echo
from mbma_tables.common.units import Units
from mbma_tables.contacts.quantities import registry
from mbma_tables.contacts.quantities.registry import unit_of
from mbma_tables.design.specimen import Specimen
from mbma_tables.export.text import comment
from mbma_tables.surfaces.surface import assumptions

if TYPE_CHECKING:
    from mbma_tables.contacts.result import Contact
    from mbma_tables.design.uncertainty import Uncertainty

DIGITS = 6  # significant digits of a table; JSON and CSV keep all
# how the meaning of a model uncertainty begins
STATED = "model uncertainty: standard deviation of "
SURFACE_NUMBERS = (
    "hurst",
    "q0",
    "q1",
    "zeta_1",
    "h_rms",
    "h_max",
    "m0",
    "m2",
    "m4",
    "alpha",
)


@dataclasses.dataclass(frozen=True)
class Report:
    """Columns of one length by name, their units, and their provenance: lines of text, and the same in JSON."""

    command: str
    title: str
    notes: list[str]
    facts: dict[str, Any]
    values: Mapping[str, Any]
    units: Mapping[str, str] = dataclasses.field(default_factory=dict)

    @functools.cached_property
    def columns(self) -> dict[str, list[Any]]:
        """Entries of the columns, None in place of NaN."""
        entries = {
            name: np.atleast_1d(array).ravel().tolist()
            for name, array in self.values.items()
        }
        return {
            name: [None if entry != entry else entry for entry in column]
            for name, column in entries.items()
        }

    @property
    def all_units(self) -> dict[str, str]:
        """The unit of each column, "-" where it has none."""
        return {name: self.units.get(name, "-") for name in self.columns}

    def to_table(self) -> str:
        """Aligned columns under their names, and their units where they have any."""
        units = self.all_units if set(self.all_units.values()) - {"-"} else {}
        lines = []
        for name, values in self.columns.items():
            cells = [name, *([units[name]] if units else []), *map(_rounded, values)]
            width = max(map(len, cells))
            text = any(isinstance(value, str) for value in values)
            lines.append(
                [cell.ljust(width) if text else cell.rjust(width) for cell in cells]
            )
        table = ["  ".join(row).rstrip() for row in zip(*lines, strict=True)]
        head = [visible(f"mbma {self.command}: {self.title}"), *map(visible, self.notes)]
        return "\n".join([*head, "", *table]) + "\n"

    def to_json(self) -> str:
        """One JSON object, its numbers with all their digits."""
        head = {
            "program": f"mbma {__version__}",
            "command": self.command,
            "title": self.title,
        }
        return (
            to_json(
                {**head, **self.facts, "units": self.all_units, "columns": self.columns}
            )
            + "\n"
        )

    def to_csv(self) -> str:
        """Comment lines, the columns' names, then their numbers with all their digits."""
        units = "; ".join(f"{name} [{unit}]" for name, unit in self.all_units.items())
        head = (
            f"mbma {__version__} {self.command}: {self.title}",
            *self.notes,
            f"columns: {units}",
        )
        content = io.StringIO()
        content.write(comment(head, "#"))
        rows = csv.writer(content, lineterminator="\n")
        rows.writerow(self.columns)
        rows.writerows(zip(*self.columns.values(), strict=True))
        return content.getvalue()

    def write(
        self, output: Output, plot: Path | None = None, picture: bytes = b""
    ) -> None:
        """To its file, with the picture after it, or to stdout once the picture is written."""
        text = (
            self.to_json()
            if output.as_json
            else self.to_csv()
            if output.as_csv
            else self.to_table()
        )
        if output.out is not None and str(output.out) != "-":
            write_file(output.out, text.encode())
        if plot is not None:
            write_file(plot, picture)
        if output.out is None or str(output.out) == "-":
            echo(text, nl=False)


def to_json(content: Any) -> str:
    """JSON, with null in place of missing numbers."""
    plain = json.dumps(content, default=lambda array: array.tolist())
    return json.dumps(json.loads(plain, parse_constant=lambda _: None), indent=2)


def _rounded(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.{DIGITS}g}" if isinstance(value, float) else str(value)


def shown_unit(name: str, units: Units) -> str:
    """The unit of a column; "-" where it has none."""
    return column_unit("relative" if name == "error" else unit_of(name, units))


def columns_of(
    pressed: Contact, uncertainties: bool = False, asked: Sequence[str] = ()
) -> tuple[dict[str, Any], dict[str, str]]:
    """Values and units of the quantities that tables show of a contact, of those asked for, and of uncertainties if asked."""
    shown_names = [
        name
        for name, quantity in registry.registry().items()
        if quantity.is_column and quantity.is_shown(pressed)
    ]
    shown_names += [name for name in dict.fromkeys(asked) if name not in shown_names]
    if uncertainties:
        stated = {registry.registry()[name].uncertainty for name in shown_names}
        shown_names += [
            name for name in registry.registry() if name in stated - {*shown_names}
        ]
    values = {}
    units = {}
    for name in shown_names:
        values[name] = pressed.quantity(name)
        units[name] = column_unit(registry.get(name).unit(pressed))
    values["valid"] = np.where(pressed.judged(shown_names).valid, "yes", "no")
    units["error"] = "relative"
    return values, units


def column_unit(unit: str) -> str:
    """A unit as it stands below the name of a column."""
    return "-" if unit == "1" else unit


def assumption_notes(assumed: list[str]) -> list[str]:
    """Lines of text of the assumptions of a surface."""
    return [f"assumed: {line}" for line in assumed]


def _surface_facts(specimen: Specimen) -> tuple[dict[str, Any], list[str]]:
    """The surface's parameters in machine-readable form, and as lines of text."""
    surface = specimen.surface
    known = {name: getattr(surface, name) for name in SURFACE_NUMBERS}
    # a spectrum that is no power law has no Hurst exponent
    numbers = {name: float(value) for name, value in known.items() if value is not None}
    units = {name: shown_unit(name, specimen.units).strip("-") for name in numbers}
    listed = (
        f"{name} {value:.6g} {units[name]}".rstrip() for name, value in numbers.items()
    )
    assumed = assumptions(surface)
    notes = [f"surface: {', '.join(listed)}", *assumption_notes(assumed)]
    notes += [record["told"] for record in surface.provenance if "told" in record]
    facts: dict[str, Any] = {"length_unit": surface.unit, **numbers, "assumed": assumed}
    facts["provenance"] = [dict(record) for record in surface.provenance]
    fit = getattr(surface, "fit", None)  # a field if given by five numbers, else a method
    if dataclasses.is_dataclass(fit):
        facts["fit"] = {name: np.asarray(v).tolist() for name, v in vars(fit).items()}
        notes.append(
            "fit: "
            + ", ".join(
                f"{name} {_rounded(v)}"
                for name, v in facts["fit"].items()
                if v is not None
            )
        )
    return facts, notes


def validity_of(
    answer: Contact, names: Iterable[str]
) -> tuple[list[str], dict[str, Any]]:
    """Where quantities of contacts are valid and why, or why not, and how they are loaded: lines of text, and machine-readable facts."""
    judged = answer.judged(names)
    valid = np.atleast_1d(judged.valid)
    reasons = {
        reason: np.flatnonzero(mask).tolist() for reason, mask in judged.reasons.items()
    }
    notes = []
    if reasons:
        listed = "; ".join(
            f"{reason} ({len(places)})" for reason, places in reasons.items()
        )
        notes.append(f"not valid at {int((~valid).sum())} of {valid.size}: {listed}")
    # that of a flow is on its own page
    evidence = answer.evidence if judged is answer and valid.any() else None
    if evidence:
        notes.append(
            f"valid at {int(valid.sum())} of {valid.size}: tested against {evidence}"
        )
    if answer.loading:
        notes.append(f"loading: {answer.loading}")
    return notes, {
        "valid": valid.tolist(),
        "reasons": reasons,
        "evidence": evidence,
        "loading": answer.loading or None,
    }


def _scatter(answer: Contact) -> tuple[list[str], dict[str, Any]]:
    """Model uncertainties of a contact, likewise."""
    scatter = {
        name: answer.quantity(name)
        for name, declared in registry.registry().items()
        if declared.meaning.startswith(STATED) and declared.is_shown(answer)
    }
    # of an elastic contact both stiffnesses are one
    listed_names = [
        name for name in scatter if answer.yields or name != "unloading_stiffness_scatter"
    ]
    meanings = ", ".join(
        registry.get(name).meaning.removeprefix(STATED) for name in listed_names
    )
    ranges = ", ".join(shown(scatter[name], answer.units[name]) for name in listed_names)
    notes = []
    if any(np.isfinite(values).any() for values in scatter.values()):
        notes.append(f"scatter of {meanings}: {ranges}")
    return notes, {name: np.ravel(values).tolist() for name, values in scatter.items()}


def report_of_quantiles(
    command: str,
    title: str,
    notes: Sequence[str],
    facts: Mapping[str, Any],
    found: Uncertainty,
) -> Report:
    """The report of numbers that are ranges: medians and quantiles of quantities, and shares of inputs."""
    values: dict[str, Any] = {"pressure": found.pressure}
    units = {"pressure": column_unit(found.units["pressure"])}
    for name, (low, median, high) in found.quantiles.items():
        ends = {f"{name}_low": low, f"{name}_high": high}
        values |= {name: median} | ends
        units |= dict.fromkeys((name, *ends), column_unit(found.units[name]))
    values["valid"] = np.where(found.valid, "yes", "no")
    of_draws = [
        f"median of {found.draws} draws (seed {found.seed}); low and high: quantiles "
        "5% and 95%, of inputs and model"
    ]
    for k, at in enumerate(found.pressure.tolist()):
        place = f"{at:.4g} {units['pressure']}".removesuffix(" -")
        of_draws += [
            f"shares in {name} at {place}: {found.shares_text(name, k)}"
            for name in found.quantiles
        ]
    of_draws += [f"not valid over the whole range: {reason}" for reason in found.reasons]
    shares = {
        quantity: {name: share.tolist() for name, share in of.items()}
        for quantity, of in found.shares.items()
    }
    facts_of_draws = {
        "draws": found.draws,
        "seed": found.seed,
        "shares": shares,
        "valid": found.valid.tolist(),
        "reasons": list(found.reasons),
    }
    return Report(
        command, title, [*notes, *of_draws], {**facts, **facts_of_draws}, values, units
    )


def quantiles_of_surface(
    command: str, specimen: Specimen, theory: str, found: Uncertainty
) -> Report:
    """The report of a surface and bodies of which numbers are ranges; the specimen is that of the medians."""
    facts, notes = _surface_facts(specimen)
    typed = [f"{name}: {each.text}" for name, each in found.inputs.items()]
    notes = [f"{notes[0]}, of the middle of each range", *notes[1:], *typed]
    notes.append(f"theory {theory}")
    texts = {name: each.text for name, each in found.inputs.items()}
    return report_of_quantiles(
        command,
        specimen.title,
        notes,
        {"theory": theory, "surface": facts, "inputs": texts},
        found,
    )


def report_answer(
    command: str,
    specimen: Specimen,
    model: Model,
    answer: Any,
    values: Mapping[str, Any],
    units: Mapping[str, str] = MappingProxyType({}),
) -> Report:
    """The report of a command that evaluated the model; `units` are those that do not follow from names."""
    simulated = model.theory.surface_of(specimen.surface)
    surface, notes = _surface_facts(dataclasses.replace(specimen, surface=simulated))
    stress = specimen.stress_unit or ""
    scale = "forces are over E*, since no modulus was given"
    if specimen.E_star is not None:
        scale = f"E* is {specimen.E_star:.6g} {stress}".rstrip()
    made = (
        f", variant {answer.variant}, island model {answer.island_model}, rtol {model.theory.options['rtol']:g}"
        if answer.variant
        else ""
    )
    notes += [
        f"theory {model.theory.name}{made}; {scale}",
        "error: relative, numerical; without the theory's scatter",
    ]
    facts = {
        "theory": model.theory.name,
        "variant": answer.variant or None,
        "island_model": answer.island_model or None,
        "rtol": model.theory.options.get("rtol"),
        "hardness": model.hardness if model.yields else None,
        "E_star": specimen.E_star,
        "stress_unit": specimen.stress_unit,
        "surface": surface,
    }
    if command != "island":
        limit = f"{answer.elastic_hardness:.4g} {stress}".rstrip()
        notes.append(f"elastic: area within 5% for hardnesses from {limit} on")
        if model.yields:
            notes[-1] = (
                f"hardness {model.hardness}: psi {answer.psi:.3g}, elastic up to {ELASTIC_PSI:g} (from {limit} on)"
            )
        # columns of leakage have a validity of their own
        names = () if "leakage_valid" in values else values
        for lines, more in (validity_of(answer, names), _scatter(answer)):
            notes = notes + lines
            facts = facts | more
    own = {name: shown_unit(name, specimen.units) for name in values if name not in units}
    return Report(command, specimen.title, notes, facts, values, own | dict(units))
