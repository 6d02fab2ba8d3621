"""Contact laws as cards of OptiStruct: PCONT 1 and TABLES1 2, in long fields."""

from mbma_tables.export.law_table import LawTable
from mbma_tables.export.targets import STAY_WITHIN_ROWS, Grammar
from mbma_tables.export.text import number

# columns of a long field, and of the first field of a line
WIDTH = 16
FIRST_WIDTH = 8
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


optistruct = Grammar(
    program="OptiStruct",
    mark="$",
    body={"pressure": _optistruct},
    beyond=STAY_WITHIN_ROWS,
)
