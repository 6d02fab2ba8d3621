"""Contact laws as cards of Abaqus; of its manual. CalculiX reads the same syntax."""

import re
from collections.abc import Iterable

import numpy as np

from mbma_tables.export.law_table import Curve, LawTable
from mbma_tables.export.targets import CONDUCTANCES, RowFormat
from mbma_tables.export.text import number

# columns of a number: CalculiX reads no more of it, so that a longer one may lose its exponent
CARD_WIDTH = 20
# of a number in so many columns
CARD_RTOL = 5e-13


def field(value: float) -> str:
    """A number of a card."""
    return number(value, width=CARD_WIDTH)


def card(head: str, law: LawTable) -> str:
    """A card with the columns swapped: pressure, overclosure, or conductance, pressure."""
    lines = [head]
    for x, y in zip(law.x, law.y, strict=True):
        lines.append(f"{field(y)}, {field(x)}")
    return "\n".join(lines) + "\n"


def interaction(name: str, cards: Iterable[str]) -> str:
    """A surface interaction with its cards."""
    return f"*SURFACE INTERACTION, NAME={name}\n{''.join(cards)}"


def _friction_card(law: LawTable) -> str:
    """The coefficient, and the displacement at which slip begins."""
    friction, _ = law.facts["friction"]
    stick_slope, _ = law.facts["stick"]
    pressure, _ = law.facts["stick_pressure"]
    slip = friction * pressure / stick_slope
    return f"*FRICTION, ELASTIC SLIP={field(slip)}\n{field(friction)}\n"


def _abaqus(law: LawTable, name: str) -> str:
    # rows of conductance have those of the pressure of the same joint beside them
    closure = law.behaviour or law
    cards = [card("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TABULAR", closure)]
    if "friction" in law.facts:
        cards.append(_friction_card(law))
    if law.behaviour is not None:
        cards.append(card("*GAP CONDUCTANCE, PRESSURE", law))
    return interaction(name, cards)


def read_cards(text: str, behaviour: str, conductance: str) -> list[Curve]:
    """The rows below cards of such names, with the columns swapped back."""
    curves = []
    for keyword, name in ((conductance, "conductance"), (behaviour, "pressure")):
        found = re.search(rf"^\*{re.escape(keyword)}\n((?:[^*\n].*\n)+)", text, re.M)
        if found is not None:
            lines = found[1].splitlines()
            y, x = np.array([line.split(",") for line in lines], dtype=float).T
            curves.append(Curve(name, x, y, CARD_RTOL))
    return curves


def _read(text: str) -> list[Curve]:
    return read_cards(
        text,
        "SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TABULAR",
        "GAP CONDUCTANCE, PRESSURE",
    )


abaqus = RowFormat(
    name="abaqus",
    program="Abaqus",
    output=(
        "TABULAR, and with `--conductivity` also `*GAP CONDUCTANCE, PRESSURE`, with "
        "`--friction` `*FRICTION, ELASTIC SLIP`, in one interaction"
    ),
    outside="continues the last slope",
    tested="written according to the manual, not tested",
    read=_read,
    mark="**",
    body=dict.fromkeys(("pressure", *CONDUCTANCES), _abaqus),
    beyond=(
        "Abaqus continues the last slope beyond the last row: stay within the range."
    ),
    named="ROUGH",
    closure=True,
    friction=(
        "Its stiffness before slip is proportional to pressure, the coefficient times that "
        "over the elastic slip."
    ),
)
