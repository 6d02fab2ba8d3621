"""Rows of a law, common to all files of rows: columns with names and units, and notes for the reader."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.display import Displayed, Variable, shown
from mbma_tables.common.plots import draw_line

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclasses.dataclass(frozen=True, repr=False)
class LawTable(Displayed):
    """Rows of a contact law, ready to be written."""

    x: FloatArray  # overclosure, or pressure: zero, then rising
    y: FloatArray  # rising from zero; or flow, which falls, to zero where contact blocks it
    x_name: str
    y_name: str
    x_unit: str
    y_unit: str
    largest_error: float  # relative, of linear interpolation between rows as written, where y is above `floor`
    comments: tuple[str, ...]  # notes for the reader of the file
    theory: str  # whose law it is
    floor: float = 0.0  # value below which errors are relative to it
    behaviour: LawTable | None = None  # the pressure of the same joint, with its conductance
    more: Mapping[str, tuple[FloatArray, str]] = dataclasses.field(default_factory=dict)  # other columns, their units
    facts: Mapping[str, tuple[float, str]] = dataclasses.field(
        default_factory=dict
    )  # of the joint; of friction the coefficient, and
    # `stick`, the shear stress over displacement before slip, at one pressure, `stick_pressure`

    @property
    def quantity(self) -> str:
        """See `describe_law`."""
        return "film" if self.x_name == "mean_separation" else self.y_name

    @property
    def columns(self) -> dict[str, tuple[FloatArray, str]]:
        """All columns by their names, with their units."""
        return {self.x_name: (self.x, self.x_unit), self.y_name: (self.y, self.y_unit), **self.more}

    def _facts(self) -> dict[str, str]:
        columns = {name: shown(values, unit) for name, (values, unit) in self.columns.items()}
        return columns | {"rows": str(self.x.size), "theory": self.theory, "largest error": shown(self.largest_error)}

    def _variables(self) -> dict[str, Variable]:
        dims = (self.x_name,)
        return {name: Variable(values, unit, name, dims) for name, (values, unit) in self.columns.items()}

    def _figure(self) -> Figure:
        labels = (f"{name} [{unit}]" for name, unit in ((self.x_name, self.x_unit), (self.y_name, self.y_unit)))
        return draw_line(self.x[1:], self.y[1:], *labels)
