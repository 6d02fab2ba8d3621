"""Contact laws as columns for COMSOL's interpolation functions."""

from mbma_tables.export.law_table import LawTable
from mbma_tables.export.targets import Grammar
from mbma_tables.export.text import number


def columns(law: LawTable) -> str:
    """All columns of a law, separated by blanks."""
    values = [column for column, _ in law.columns.values()]
    text = ""
    for row in zip(*values, strict=True):
        text += " ".join(map(number, row)) + "\n"
    return text


comsol = Grammar(
    program="COMSOL",
    mark="%",
    of_any=columns,
    beyond=(
        "Data format: Spreadsheet; functions by position in file. Interpolation: linear; "
        "extrapolation: none."
    ),
)
