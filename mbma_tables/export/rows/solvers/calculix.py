"""Contact laws as cards of CalculiX; 2.20 was run."""

import math
import re

import numpy as np

from mbma_tables.common.errors import InputError
from mbma_tables.export.law_table import Curve, LawTable
from mbma_tables.export.rows.solvers.abaqus import (
    card,
    field,
    interaction,
    read_cards,
)
from mbma_tables.export.targets import CONDUCTANCES, RowFormat
from mbma_tables.export.text import about, opening

# closer overclosures are moved apart by the reader
MIN_STEP = 1e-10
# points of a closure that is read back
FITTED = 200
PAIR = "*CONTACT PAIR, INTERACTION={name}, TYPE="
NOTES_ON_PRESSURE = (
    f"Use this interaction with {PAIR}NODE TO SURFACE",
    "and no other type: with SURFACE TO SURFACE 2.20 reads TABULAR into arrays that are too "
    "short and has no force at up to 41 rows, without a message, and from 50 rows on it "
    "aborts (stack smashing detected); MORTAR reads 50 rows wrongly. Place the bodies so "
    "that their surfaces touch where the mean planes are h_max apart.",
)
NOTES_ON_HEAT = (
    f"Use this interaction with {PAIR}SURFACE TO SURFACE",
    "and no other type: with NODE TO SURFACE 2.20 takes one conductance for all pressures, "
    "without a message. Use it in steps of *COUPLED TEMPERATURE-DISPLACEMENT: with UNCOUPLED "
    "an increment has the conductance of the pressure of the one before it, so that loads "
    "must be held for one more. Between the first two rows conductance is linear.",
    "2.20 takes no table of pressures beside one of conductances. The closure is exponential "
    "here, p = p0 exp(ln(100) c/c0) with c0 = {c0} {length}, over which the pressure falls "
    "to a hundredth, and p0 = {p0} {stress}, the pressure at c = 0: pressure at a given "
    "overclosure is within {by_p:.0%} of the law from p = {low} to {high} {stress}, "
    "overclosure at a given pressure within {by_c} {length}. Where forces are prescribed, "
    "this does not change the conductance.",
    "From an open gap press by displacements at first: by forces alone EXPONENTIAL does not "
    "converge. LINEAR does, with the line {slope} below *SURFACE BEHAVIOR, but its closure "
    "is the law's at the largest pressure alone.",
)


def _stick_card(law: LawTable) -> list[str]:
    """A card with the coefficient of friction and the slope before slip, if there is friction."""
    if "friction" not in law.facts:
        return []
    friction, _ = law.facts["friction"]
    stick_slope, _ = law.facts["stick"]
    return [f"*FRICTION\n{field(friction)}, {field(stick_slope)}\n"]


def _of_pressure(law: LawTable, name: str) -> str:
    if (np.diff(law.x) <= MIN_STEP).any():
        raise InputError(
            f"rows are closer than {MIN_STEP:g} {law.x_unit}, which CalculiX cannot tell "
            "apart: take fewer rows or a smaller unit of length"
        )
    notes = [line.format(name=name) for line in NOTES_ON_PRESSURE]
    closure = card("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TABULAR", law)
    cards = [closure, *_stick_card(law)]
    return f"{opening(notes, '**')}\n{interaction(name, cards)}"


def _of_heat(law: LawTable, name: str) -> str:
    """Conductance beside an exponential closure near the law, the only pair of the two in 2.20."""
    rows = law.behaviour
    assert rows is not None
    least = np.interp(max(rows.floor, law.x[1]), rows.y, rows.x)
    c = np.linspace(least, rows.x[-1], 1001)
    p = np.interp(c, rows.x, rows.y)
    # the line that is nearest to ln p: for concave ln p, the chord has the slope of the line
    # with the least largest distance
    decay_length = (c[-1] - c[0]) / math.log(p[-1] / p[0])
    off = np.log(p) - c / decay_length
    middle = (off.max() + off.min()) / 2
    spread = (off.max() - off.min()) / 2
    # p = p0 exp(c/decay_length), of which CalculiX takes p0 and the distance over which the
    # pressure falls to a hundredth
    c0 = decay_length * math.log(100)
    p0 = math.exp(middle)
    words = {
        "name": name,
        "c0": field(c0),
        "p0": field(p0),
        "low": about(p[0]),
        "high": about(p[-1]),
        "by_p": math.expm1(spread),
        "by_c": about(spread * decay_length, 2),
        "slope": field(p[-1] / c[-1]),
        "stress": rows.y_unit,
        "length": rows.x_unit,
    }
    notes = [line.format_map(words) for line in NOTES_ON_HEAT]
    closure = (
        f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=EXPONENTIAL\n{field(c0)}, {field(p0)}\n"
    )
    cards = [closure, *_stick_card(law), card("*GAP CONDUCTANCE", law)]
    return f"{opening(notes, '**')}\n{interaction(name, cards)}"


def _read(text: str) -> list[Curve]:
    """The tables; and the exponential closure, in the range and within the error of the notes."""
    curves = read_cards(
        text, "SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TABULAR", "GAP CONDUCTANCE"
    )
    closure = re.search(r"=EXPONENTIAL\n(\S+), (\S+)\n", text)
    if closure is not None:
        c0, p0 = map(float, closure.groups())
        words = " ".join(text.replace("\n**", " ").split())
        stated = re.search(r"within (\d+)% of the law from p = (\S+) to (\S+) ", words)
        assert stated is not None
        percent, low, high = map(float, stated.groups())
        # the percentage is rounded; the pressures are those of the law, not of the closure
        within = (percent + 0.5) / 100
        pressure = np.geomspace(low * (1 + within), high / (1 + within), FITTED)
        c = c0 * np.log(pressure / p0) / math.log(100)
        curves.append(Curve("pressure", c, pressure, within))
    return curves


calculix = RowFormat(
    name="calculix",
    program="CalculiX",
    output=(
        "`*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TABULAR`; EXPONENTIAL with "
        "`*GAP CONDUCTANCE`; with `--friction` `*FRICTION`"
    ),
    outside="keeps the last value",
    tested=(
        "CalculiX 2.20: two blocks pressed together, reaction within 0.2% of the law at 30 "
        "pressures from 1e-5 of the largest on (`--pressures`), in mm-N-MPa and in SI; heat "
        "through them within 1% of the law's conductance at 8 pressures over three decades; "
        "[sheared](joints.md#in-solvers-and-programs): within 1%"
    ),
    read=_read,
    mark="**",
    body={"pressure": _of_pressure, **dict.fromkeys(CONDUCTANCES, _of_heat)},
    beyond="CalculiX keeps the value of the last row beyond it.",
    # of more conductances, 2.20 keeps the last twenty, without a message
    most={"pressure": 200, **dict.fromkeys(CONDUCTANCES, 20)},
    named="ROUGH",
    friction="Its stick slope is that of one pressure.",
)
