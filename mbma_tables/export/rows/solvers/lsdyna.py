"""Contact laws as curves of LS-DYNA, for inclusion.

They are without *END, which would end the including deck.
"""

from collections.abc import Sequence

from mbma_tables.export.law_table import LawTable
from mbma_tables.export.targets import CONDUCTANCES, STAY_WITHIN_ROWS, Grammar
from mbma_tables.export.text import number

# columns of a field
WIDTH = 20
TAKES = ("pressure", *CONDUCTANCES, "tangential_stiffness", "leakage")


def _curve(law: LawTable, curve: int = 1) -> str:
    """*DEFINE_CURVE with its number, scales of 1, offsets of 0, and two fields a row."""
    scale = f"{1.0:10.1f}"
    offset = f"{0.0:10.1f}"
    settings = f"{curve:10d}{0:10d}{scale}{scale}{offset}{offset}{0:10d}"
    lines = ["*DEFINE_CURVE", settings]
    for x, y in zip(law.x, law.y, strict=True):
        lines.append(_field(x) + _field(y))
    return "\n".join(lines) + "\n"


def _field(value: float) -> str:
    return number(value, width=WIDTH).rjust(WIDTH)


def _curves(laws: Sequence[LawTable]) -> str:
    """Curves 1, 2, ..., below a list of what they are."""
    titles = ""
    curves = ""
    for curve, law in enumerate(laws, 1):
        titles += f"$ curve {curve}: {law.y_name} against {law.x_name}\n"
        curves += _curve(law, curve)
    return titles + curves


lsdyna = Grammar(
    program="LS-DYNA",
    mark="$",
    body=dict.fromkeys(TAKES, _curve),
    beyond=STAY_WITHIN_ROWS,
    several=_curves,
)
