"""Contact laws as columns for COMSOL's interpolation functions."""

from collections.abc import Iterable

import numpy as np

from mbma_tables.export.law_table import Curve, LawTable, titled
from mbma_tables.export.targets import RowFormat
from mbma_tables.export.text import number


def columns(law: LawTable) -> str:
    """All columns of a law, separated by blanks."""
    values = [column for column, _ in law.columns.values()]
    text = ""
    for row in zip(*values, strict=True):
        text += " ".join(map(number, row)) + "\n"
    return text


def read_columns(lines: Iterable[str], names: Iterable[str]) -> list[Curve]:
    """Columns of lines against the first one."""
    x, *others = np.array([line.split() for line in lines], dtype=float).T
    return [Curve(name, x, y) for name, y in zip(names, others, strict=True)]


def below_comments(text: str, mark: str) -> list[str]:
    """The lines of a text that are no comments."""
    return [line for line in text.splitlines() if not line.startswith(mark)]


def _read(text: str) -> list[Curve]:
    return read_columns(below_comments(text, "%"), titled(text))


comsol = RowFormat(
    name="comsol",
    program="COMSOL",
    output="columns with comments; of a film or aperture all columns",
    outside="no value, with the settings of the header",
    tested="written according to the manual, not tested",
    read=_read,
    mark="%",
    of_any=columns,
    beyond=(
        "Data format: Spreadsheet; functions by position in file. Interpolation: linear; "
        "extrapolation: none."
    ),
)
