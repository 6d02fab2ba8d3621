"""Contact laws as cards of OptiStruct: PCONT 1 and TABLES1 2, in long fields.

Conductances are PCONTHT 1 and TABLED1 3.
"""

import numpy as np

from mbma_tables.export.law_table import Curve, LawTable, titled
from mbma_tables.export.targets import CONDUCTANCES, RowFormat
from mbma_tables.export.text import number

# columns of a long field, and of the first field of a line
WIDTH = 16
FIRST_WIDTH = 8
# of a number in a long field
RTOL = 5e-9
# long fields of a line
FIELDS = 4
# the keyword stands where a line begins: on the first one that field is the friction
# coefficient
CLOSURE = "PCONT,1\n+,STFTAB,2\n"
# after the number the conductances of closed and of open contact, which are constants
CONDUCTANCE = "PCONTHT,1,,,3\n"


def _table(keyword: str, table: int, law: LawTable) -> str:
    """A table in long fields, to ENDT."""
    blank = " " * WIDTH
    lines = [
        f"{keyword:<{FIRST_WIDTH}}{table:<{WIDTH}d}{blank}{blank}{blank}*",
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


def _of_pressure(law: LawTable) -> str:
    return CLOSURE + _table("TABLES1*", 2, law)


def _of_heat(law: LawTable) -> str:
    """Conductance beside the closure of the same joint, with which it shares the number."""
    assert law.behaviour is not None
    return _of_pressure(law.behaviour) + CONDUCTANCE + _table("TABLED1*", 3, law)


def _read(text: str) -> list[Curve]:
    """Long fields of the tables, from their third line to ENDT."""
    names = ["pressure"]
    if CONDUCTANCE in text:
        names.insert(0, titled(text)[0])
    # on the first line of PCONT this field would be the friction coefficient
    heads = {"pressure": f"{CLOSURE}TABLES1*2 "}
    curves = []
    for name in names:
        head = heads.get(name, f"{CONDUCTANCE}TABLED1*3 ")
        fields = []
        for line in text[text.index(head) + len(head) :].splitlines()[2:]:
            starts = range(FIRST_WIDTH, len(line), WIDTH)
            fields += [line[start : start + WIDTH].strip() for start in starts]
        values = np.array(fields[: fields.index("ENDT")], dtype=float)
        curves.append(Curve(name, values[::2], values[1::2], RTOL))
    return curves


optistruct = RowFormat(
    name="optistruct",
    program="OptiStruct",
    output="`PCONT`, `TABLES1`; with `--conductivity` also `PCONTHT`, `TABLED1`",
    outside="continues the last slope, by its manual; not tested",
    tested=(
        "written according to the manual; pyNastran 1.4.1 parses TABLES1 and TABLED1, and "
        "ignores PCONT and PCONTHT, which it does not support"
    ),
    read=_read,
    mark="$",
    body={"pressure": _of_pressure, **dict.fromkeys(CONDUCTANCES, _of_heat)},
    beyond=(
        "By its manual OptiStruct continues the last slope beyond the last row, which was not "
        "tested: stay within the range."
    ),
    closure=True,
)
