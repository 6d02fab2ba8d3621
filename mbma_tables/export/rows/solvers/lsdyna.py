"""Contact laws as curves of LS-DYNA, for inclusion.

They are without *END, which would end the including deck.
"""

import re
from collections.abc import Sequence

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.export.law_table import Curve, LawTable, titled
from mbma_tables.export.targets import STAY_WITHIN_ROWS, RowFormat
from mbma_tables.export.text import comment, number

# columns of a field
WIDTH = 20
# of a number in so many columns
RTOL = 5e-13


def _curve(rows: FloatArray, column: FloatArray, curve: int = 1) -> str:
    """*DEFINE_CURVE with its number, scales of 1, offsets of 0, and two fields a row."""
    scale = f"{1.0:10.1f}"
    offset = f"{0.0:10.1f}"
    settings = f"{curve:10d}{0:10d}{scale}{scale}{offset}{offset}{0:10d}"
    lines = ["*DEFINE_CURVE", settings]
    for x, y in zip(rows, column, strict=True):
        lines.append(_field(x) + _field(y))
    return "\n".join(lines) + "\n"


def _field(value: float) -> str:
    return number(value, width=WIDTH).rjust(WIDTH)


def _of_one(law: LawTable) -> str:
    """A curve, whose title is in the header, or one for each column."""
    return _curves([law]) if law.more else _curve(law.x, law.y)


def _curves(laws: Sequence[LawTable]) -> str:
    """Curves 1, 2, ..., below a list of what they are."""
    titles = ""
    curves = ""
    number_of_curve = 0
    for law in laws:
        (abscissa, (rows, unit)), *columns = law.columns.items()
        for name, (column, of_column) in columns:
            number_of_curve += 1
            title = f"{name} [{of_column}] against {abscissa} [{unit}]"
            titles += comment([f"curve {number_of_curve}: {title}"], "$")
            curves += _curve(rows, column, number_of_curve)
    return titles + curves


def _read(text: str) -> list[Curve]:
    """Fields of the curves, by their titles; of a single one by the header's."""
    titles = re.findall(r"^\$ curve \d+: (.*)$", text, re.M) or [text]
    curves = []
    blocks = text.split("*DEFINE_CURVE\n")[1:]
    for title, block in zip(titles, blocks, strict=True):
        # below the settings of the curve
        lines = block.splitlines()[1:]
        x = np.array([line[:WIDTH] for line in lines], dtype=float)
        y = np.array([line[WIDTH : 2 * WIDTH] for line in lines], dtype=float)
        curves.append(Curve(titled(title)[0], x, y, RTOL))
    return curves


lsdyna = RowFormat(
    name="lsdyna",
    program="LS-DYNA",
    output="`*DEFINE_CURVE` for each column, to be included in a deck",
    outside="not tested",
    tested="parsed by ansys-dyna-core 0.12.1",
    read=_read,
    mark="$",
    of_any=_of_one,
    beyond=STAY_WITHIN_ROWS,
    several=_curves,
)
