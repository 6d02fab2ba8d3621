"""Conductances as tables of Ansys Mechanical APDL, of its manual: `*DIM`, `*SET` and `RMODIF`."""

import re

import numpy as np

from mbma_tables.export.law_table import Curve, LawTable, titled
from mbma_tables.export.targets import CONDUCTANCES, STAY_WITHIN_ROWS, RowFormat
from mbma_tables.export.text import number, opening

MAX_LETTERS = 32  # of a parameter
# of the contact elements CONTA171 to CONTA177
CONDUCTANCE = 14


def _ansys(law: LawTable, name: str) -> str:
    """A table over the pressure, whose indices stand in its column 0."""
    notes = (
        f"Read this file with /INPUT where the real constants of the contact are set, and "
        f"give these the table as thermal contact conductance, number {CONDUCTANCE} of "
        f"CONTA171 to CONTA177: RMODIF,N,{CONDUCTANCE},%{name}% with N the number of the "
        "set, `cid` in the commands of a contact of Workbench. PRESSURE is known in "
        "analyses of displacements and temperatures together, KEYOPT(1) = 1.",
    )
    lines = [
        opening(notes, "!"),
        f"*DIM,{name},TABLE,{law.x.size},1,1,PRESSURE",
    ]
    for row, (x, y) in enumerate(zip(law.x, law.y, strict=True), 1):
        lines.append(f"*SET,{name}({row},0),{number(x)}")
        lines.append(f"*SET,{name}({row},1),{number(y)}")
    return "\n".join(lines) + "\n"


def _read(text: str) -> list[Curve]:
    """The table by the rules of `*DIM`: indices ascend, and all of the rows are set."""
    dimensioned = re.search(r"^\*DIM,(\w+),TABLE,(\d+),1,1,PRESSURE$", text, re.M)
    assert dimensioned is not None
    name, rows = dimensioned.groups()
    table = np.full((int(rows), 2), np.nan)
    for row, column, value in re.findall(
        rf"^\*SET,{name}\((\d+),([01])\),(\S+)$", text, re.M
    ):
        table[int(row) - 1, int(column)] = float(value)
    assert (np.diff(table[:, 0]) > 0).all()
    return [Curve(titled(text)[0], table[:, 0], table[:, 1])]


ansys = RowFormat(
    name="ansys",
    program="Ansys Mechanical APDL",
    output="a table of `PRESSURE` for the thermal contact conductance TCC",
    outside="not tested",
    tested="written according to the manual of `*DIM` and `RMODIF` (2018), not tested",
    read=_read,
    mark="!",
    body=dict.fromkeys(reversed(CONDUCTANCES), _ansys),
    beyond=STAY_WITHIN_ROWS,
    named="ROUGH",
    longest_name=MAX_LETTERS,
)
