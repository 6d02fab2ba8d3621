"""Conductances as boundary conditions of Elmer, by `LocalJumps` of its HeatSolveVec.F90."""

import numpy as np

from mbma_tables.export.law_table import Curve, LawTable, titled
from mbma_tables.export.targets import CONDUCTANCES, RowFormat
from mbma_tables.export.text import number


def _elmer(law: LawTable) -> str:
    lines = [
        "Heat Gap = Logical True",
        "Heat Gap Coefficient = Variable Contact Pressure",
        "  Real",
    ]
    for x, y in zip(law.x, law.y, strict=True):
        lines.append(f"    {number(x)} {number(y)}")
    return "\n".join([*lines, "  End"]) + "\n"


def _read(text: str) -> list[Curve]:
    """The rows between the type of the keyword and End."""
    head, found, rest = text.partition(
        "Heat Gap = Logical True\n"
        "Heat Gap Coefficient = Variable Contact Pressure\n"
        "  Real\n"
    )
    assert found
    rows, end, _ = rest.partition("  End\n")
    assert end
    x, y = np.array([line.split() for line in rows.splitlines()], dtype=float).T
    return [Curve(titled(head)[0], x, y)]


elmer = RowFormat(
    name="elmer",
    program="Elmer",
    output="`Heat Gap Coefficient` against the contact pressure, of a boundary condition",
    outside="continues the last slope",
    tested="written according to the source of its heat equation, not tested",
    read=_read,
    mark="!",
    body=dict.fromkeys(reversed(CONDUCTANCES), _elmer),
    beyond=(
        "Elmer continues the last slope beyond the last row: stay within the range. These "
        "lines belong in a Boundary Condition of the interface, whose elements have two "
        "parents with temperatures of their own, as discontinuous ones have. Contact "
        "Pressure stands for the variable of your case that has the pressure there, in the "
        "units of the rows."
    ),
)
