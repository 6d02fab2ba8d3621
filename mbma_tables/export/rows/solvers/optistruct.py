"""Contact laws as cards of OptiStruct: PCONT 1 and TABLES1 2, in long fields."""

import numpy as np

from mbma_tables.export.law_table import Curve, LawTable, titled
from mbma_tables.export.targets import STAY_WITHIN_ROWS, RowFormat
from mbma_tables.export.text import number

# columns of a long field, and of the first field of a line
WIDTH = 16
FIRST_WIDTH = 8
# of a number in a long field
RTOL = 5e-9
# long fields of a line
FIELDS = 4


def _optistruct(law: LawTable) -> str:
    # the keyword stands where a line begins: on the first one that field is the friction
    # coefficient
    table = 2
    blank = " " * WIDTH
    lines = [
        "PCONT,1",
        f"+,STFTAB,{table}",
        f"{'TABLES1*':<{FIRST_WIDTH}}{table:<{WIDTH}d}{blank}{blank}{blank}*",
        "*".ljust(FIRST_WIDTH),
    ]
    fields: list[str] = []
    for x, y in zip(law.x, law.y, strict=True):
        fields.append(number(x, width=WIDTH).ljust(WIDTH))
        fields.append(number(y, width=WIDTH).ljust(WIDTH))
    fields.append("ENDT".ljust(WIDTH))
    for start in range(0, len(fields), FIELDS):
        line = "*".ljust(FIRST_WIDTH) + "".join(fields[start : start + FIELDS])
        lines.append(line.rstrip())
    return "\n".join(lines) + "\n"


def _read(text: str) -> list[Curve]:
    """Long fields of the table, from its third line to ENDT."""
    # on the first line of PCONT this field would be the friction coefficient
    head = "PCONT,1\n+,STFTAB,2\nTABLES1*2 "
    lines = text[text.index(head) + len("PCONT,1\n+,STFTAB,2\n") :].splitlines()[2:]
    fields = []
    for line in lines:
        starts = range(FIRST_WIDTH, len(line), WIDTH)
        fields += [line[start : start + WIDTH].strip() for start in starts]
    values = np.array(fields[: fields.index("ENDT")], dtype=float)
    return [Curve(titled(text)[0], values[::2], values[1::2], RTOL)]


optistruct = RowFormat(
    name="optistruct",
    program="OptiStruct",
    output="`PCONT`, `TABLES1`",
    tested=(
        "written according to the manual; pyNastran 1.4.1 parses TABLES1 and ignores PCONT, "
        "which it does not support"
    ),
    read=_read,
    mark="$",
    body={"pressure": _optistruct},
    beyond=STAY_WITHIN_ROWS,
)
