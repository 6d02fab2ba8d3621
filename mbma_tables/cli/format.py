"""What a command found, as a table, as JSON or as CSV."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
from typing import Any

from mbma_tables import __version__

DIGITS = 6  # significant digits of a table; JSON and CSV keep all


@dataclasses.dataclass(frozen=True)
class Column:
    """A named column with its unit: texts, or numbers with None where there is none."""

    name: str
    unit: str
    values: list[Any]


@dataclasses.dataclass(frozen=True)
class Report:
    """Columns of one length, and the facts that they rest on.

    `notes` are lines for a reader; `facts` are the same and more, for a program.
    """

    command: str
    title: str
    notes: list[str]
    facts: dict[str, Any]
    columns: list[Column]

    def to_table(self) -> str:
        """Aligned columns under their names, and their units where they have any."""
        united = any(c.unit != "-" for c in self.columns)
        cells = [
            [c.name, *([c.unit] if united else []), *(_rounded(value) for value in c.values)] for c in self.columns
        ]
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
        return json.dumps(content, indent=2, allow_nan=False) + "\n"

    def to_csv(self) -> str:
        """Comment lines, the columns' names, then their numbers with all their digits."""
        units = "; ".join(f"{c.name} [{c.unit}]" for c in self.columns)
        head = [f"mbma {__version__} {self.command}: {self.title}", *self.notes, f"columns: {units}"]
        content = io.StringIO()
        content.writelines(f"# {line}\n" for line in head)
        rows = csv.writer(content, lineterminator="\n")
        rows.writerow(c.name for c in self.columns)
        rows.writerows(zip(*(c.values for c in self.columns), strict=True))
        return content.getvalue()


def _rounded(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.{DIGITS}g}" if isinstance(value, float) else str(value)
