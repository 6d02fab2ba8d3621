"""Contact laws in the formats of finite-element and system codes; each target is a `Grammar` of rows.

CalculiX 2.20 was run with these cards, force and conductance; the others follow the manuals.
"""

import math
from typing import Any

import numpy as np

from mbma_tables.common.arguments import whole_number_in
from mbma_tables.common.errors import InputError
from mbma_tables.export.law_table import LawTable
from mbma_tables.export.targets import AGAINST, Grammar
from mbma_tables.export.text import DIGITS, number, opening

MIN_CALCULIX_STEP = 1e-10  # closer overclosures are moved apart by the reader
MAX_ID = 99_999_999  # largest id in a card: eight columns
PAIR = "*CONTACT PAIR, INTERACTION={name}, TYPE="
CALCULIX_TABULAR = (
    f"Use this interaction with {PAIR}NODE TO SURFACE",
    "and no other type: with SURFACE TO SURFACE 2.20 reads TABULAR into arrays that are too short and has no force at "
    "up to 41 rows, without a message, and from 50 rows on it aborts (stack smashing detected); MORTAR reads 50 rows "
    "wrongly. Place the bodies so that their surfaces touch where the mean planes are h_max apart.",
)
CALCULIX_HEAT = (
    f"Use this interaction with {PAIR}SURFACE TO SURFACE",
    "and no other type: with NODE TO SURFACE 2.20 takes one conductance for all pressures, without a message. Use it "
    "in steps of *COUPLED TEMPERATURE-DISPLACEMENT: with UNCOUPLED an increment has the conductance of the pressure "
    "of the one before it, so that loads must be held for one more. Below the second row conductance is linear from 0.",
    "2.20 takes no table of pressures beside one of conductances. The closure is exponential here, p = p0 exp(c/c0): "
    "pressure at a given overclosure is within {by_p:.0%} of the law from p = {low} to {high} {stress}, overclosure at "
    "a given pressure within {by_c} {length}. Where forces are prescribed, this does not change the conductance.",
    "From an open gap press by displacements at first: by forces alone EXPONENTIAL does not converge. LINEAR does, "
    "with the line {slope} below *SURFACE BEHAVIOR, but its closure is the law's at the largest pressure alone.",
)


def _notes(lines: tuple[str, ...], **said: Any) -> str:
    return opening((line.format_map(said) for line in lines), "**") + "\n"


def _interaction(name: str, *cards: str) -> str:
    return f"*SURFACE INTERACTION, NAME={name}\n{''.join(cards)}"


def _card(head: str, law: LawTable) -> str:
    """A card with the columns swapped: pressure, overclosure, or conductance, pressure."""
    return f"{head}\n" + "".join(f"{number(y)}, {number(x)}\n" for x, y in zip(law.x, law.y, strict=True))


def _friction(law: LawTable) -> tuple[float, float, float]:
    """Coefficient, stick slope, and the displacement at which slip begins."""
    friction, slope, pressure = (law.facts[name][0] for name in ("friction", "stick", "stick_pressure"))
    return friction, slope, friction * pressure / slope


def _stick(law: LawTable) -> str:
    return "*FRICTION\n{:.10g}, {:.10g}\n".format(*_friction(law)) if "friction" in law.facts else ""


def _calculix(law: LawTable, name: str) -> str:
    if (np.diff(law.x) <= MIN_CALCULIX_STEP).any():
        raise InputError(
            f"rows are closer than {MIN_CALCULIX_STEP:g} {law.x_unit}, which CalculiX cannot tell apart: take fewer "
            "rows or a smaller unit of length"
        )
    behaviour = _card("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TABULAR", law)
    return _notes(CALCULIX_TABULAR, name=name) + _interaction(name, behaviour, _stick(law))


def _calculix_heat(law: LawTable, name: str) -> str:
    """Conductance beside the exponential closure that is nearest to the law, the only pair of the two in 2.20."""
    rows = law.behaviour
    assert rows is not None
    c = np.linspace(np.interp(max(rows.floor, law.x[1]), rows.y, rows.x), rows.x[-1], 1001)
    p = np.interp(c, rows.x, rows.y)
    # for concave ln p, the chord has the slope of the line with the least largest distance
    u0 = (c[-1] - c[0]) / math.log(p[-1] / p[0])
    off = np.log(p) - c / u0
    middle, spread = (off.max() + off.min()) / 2, (off.max() - off.min()) / 2
    said = {"low": f"{p[0]:.4g}", "high": f"{p[-1]:.4g}", "by_p": math.expm1(spread), "by_c": f"{spread * u0:.2g}"}
    said |= {"slope": number(p[-1] / c[-1]), "name": name, "stress": rows.y_unit, "length": rows.x_unit}
    # p = p0 exp(c/u0), by the distance over which the pressure falls to a hundredth
    closure = f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=EXPONENTIAL\n{number(u0 * math.log(100))}, "
    cards = f"{closure}{number(math.exp(middle))}\n", _stick(law), _card("*GAP CONDUCTANCE", law)
    return _notes(CALCULIX_HEAT, **said) + _interaction(name, *cards)


def _abaqus(law: LawTable, name: str) -> str:
    cards = [_card("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TABULAR", law.behaviour or law)]
    if "friction" in law.facts:
        friction, _, slip = _friction(law)
        cards.append(f"*FRICTION, ELASTIC SLIP={number(slip)}\n{number(friction)}\n")
    if law.behaviour is not None:
        cards.append(_card("*GAP CONDUCTANCE, PRESSURE", law))
    return _interaction(name, *cards)


def _lsdyna(law: LawTable, curve: int = 1) -> str:
    """For inclusion: without *END, which would end the including deck."""
    curve = whole_number_in("curve", curve, 1, MAX_ID)
    head = f"*DEFINE_CURVE\n{curve:10d}{0:10d}{1.0:10.1f}{1.0:10.1f}{0.0:10.1f}{0.0:10.1f}{0:10d}\n"
    return head + "".join(f"{x:20.{DIGITS - 1}E}{y:20.{DIGITS - 1}E}\n" for x, y in zip(law.x, law.y, strict=True))


def _optistruct(law: LawTable, contact: int = 1, table: int = 2) -> str:
    """PCONT and TABLES1, in long fields of 16 columns."""
    contact, table = (whole_number_in(n, k, 1, MAX_ID) for n, k in (("contact", contact), ("table", table)))
    pairs = [f"{value:<16.9E}" for row in zip(law.x, law.y, strict=True) for value in row]
    # the keyword stands where a line begins: on the first one that field is the friction coefficient
    lines = [f"PCONT,{contact:d}", f"+,STFTAB,{table:d}", f"{'TABLES1*':<8}{table:<16d}{'':<16}{'':<16}{'':<16}*"]
    lines.append(f"{'*':<8}")
    fields = [*pairs, f"{'ENDT':<16}"]
    lines += [f"{'*':<8}{''.join(fields[start : start + 4])}".rstrip() for start in range(0, len(fields), 4)]
    return "\n".join(lines) + "\n"


def _columns(law: LawTable) -> str:
    rows = zip(*(values for values, _ in law.columns.values()), strict=True)
    return "".join(" ".join(map(number, row)) + "\n" for row in rows)


def _matrix(law: LawTable, name: str) -> str:
    return f"double {name}({law.x.size},{len(law.columns)})\n{_columns(law)}"


calculix = Grammar(
    "CalculiX",
    "**",
    {"pressure": _calculix, "conductance": _calculix_heat},
    "CalculiX keeps the value of the last row beyond it.",
    # of more conductances, 2.20 keeps the last twenty, without a message
    {"pressure": 200, "conductance": 20},
    "ROUGH",
    friction="Its stick slope is that of one pressure.",
)
abaqus = Grammar(
    "Abaqus",
    "**",
    {"pressure": _abaqus, "conductance": _abaqus},
    "Abaqus continues the last slope beyond the last row: stay within the range.",
    named="ROUGH",
    friction="Its stiffness before slip is proportional to pressure, the coefficient times that over the elastic slip.",
)
STAY = "Stay within the rows: the solver's behaviour beyond them was not tested."
lsdyna = Grammar("LS-DYNA", "$", dict.fromkeys(("pressure", "conductance", "leakage"), _lsdyna), STAY)
optistruct = Grammar("OptiStruct", "$", {"pressure": _optistruct}, STAY)
comsol = Grammar(
    "COMSOL",
    "%",
    dict.fromkeys(AGAINST, _columns),
    "Data format: Spreadsheet; functions by position in file. Interpolation: linear; extrapolation: none.",
)
moose = Grammar(
    "MOOSE",
    "#",
    dict.fromkeys(AGAINST, _columns),
    "[Functions/law] type = PiecewiseLinear, data_file = THIS, format = columns; constant outside the rows. Of more "
    "than two columns: xy_in_file_only = false, y_index_in_file = 1, 2, ...",
)
# of Modelica's CombiTable1Ds
modelica = Grammar(
    "Modelica",
    "#",
    dict.fromkeys(AGAINST, _matrix),
    "smoothness = Modelica.Blocks.Types.Smoothness.LinearSegments; no extrapolation",
    named="law",
    first="#1\n",
)
SOLVERS = calculix, abaqus, lsdyna, optistruct, comsol, moose, modelica
TARGETS = tuple(grammar.target(grammar.program.lower().replace("-", "")) for grammar in SOLVERS)
