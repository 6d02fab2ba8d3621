"""Contact laws in the words of finite-element and system codes; each target is one function of a `LawTable`.

CalculiX 2.20 was run with what is written here; the others are written from their manuals.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from mbma_tables.errors import InputError
from mbma_tables.export.law_rows import LawTable
from mbma_tables.export.text import DIGITS, checked_name, comment, number
from mbma_tables.surfaces.surface import Surface

MAX_CALCULIX_ROWS = 200
MAX_NAME = 80  # letters of a name in CalculiX and Abaqus


def _is_pressure(law: LawTable, target: str) -> None:
    if law.y_name != "pressure":
        raise InputError(f"{target} takes pressure against overclosure here, got {law.y_name} against {law.x_name}")


def _interaction(name: str, card: str, rows: str) -> str:
    return f"*SURFACE INTERACTION, NAME={checked_name(name, MAX_NAME)}\n{card}\n{rows}"


def _tabular(law: LawTable, name: str, conductance: str) -> str:
    """The cards that CalculiX and Abaqus share but for the one of conductance."""
    card = "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TABULAR" if law.y_name == "pressure" else conductance
    # the other way about than in the law: pressure, overclosure, or conductance, pressure
    return _interaction(name, card, "".join(f"{number(y)}, {number(x)}\n" for x, y in zip(law.x, law.y, strict=True)))


def calculix(law: LawTable, name: str = "ROUGH") -> str:
    """A surface interaction for CalculiX, with the contact pair that reads it rightly.

    Raises
    ------
    InputError
        For more than 200 rows, which its arrays do not hold.
    """
    if law.x.size > MAX_CALCULIX_ROWS:
        raise InputError(f"CalculiX holds {MAX_CALCULIX_ROWS} rows, this law has {law.x.size}: give fewer rows")
    notes = (
        *law.comments,
        "CalculiX keeps the pressure constant beyond the last row. Use this interaction with",
        f"  *CONTACT PAIR, INTERACTION={name}, TYPE=NODE TO SURFACE",
        "and no other type: 2.20 reads TABULAR wrongly with SURFACE TO SURFACE and MORTAR, without a message.",
        "Place the bodies so that their surfaces touch where the mean planes are h_max apart.",
    )
    return comment(notes, "**") + _tabular(law, name, "*GAP CONDUCTANCE")


def abaqus(law: LawTable, name: str = "ROUGH") -> str:
    """A surface interaction for Abaqus, which continues the last slope beyond the last row."""
    notes = (*law.comments, "Abaqus continues the last slope beyond the last row: stay within the range.")
    return comment(notes, "**") + _tabular(law, name, "*GAP CONDUCTANCE, PRESSURE")


def exponential(surface: Surface, E_star: float, comments: Iterable[str], name: str = "ROUGH") -> str:
    """The card of an exponential law: Persson's for light loads, p = beta E* exp(-u/u0) (20), with c0 = u0 ln 100."""
    from mbma_tables.theories import persson_force

    h_rms = float(surface.h_rms)
    near, far = (float(persson_force(surface, u * h_rms, E_star, method="simplified")) for u in (1.0, 2.0))
    u0 = h_rms / math.log(near / far)
    p0 = near * math.exp((h_rms - float(surface.h_max)) / u0)
    notes = (
        *comments,
        "EXPONENTIAL is Persson's law for light loads, p = p0 exp(c/u0), not the MBMA model's: c0 = u0 ln 100",
    )
    row = f"{number(u0 * math.log(100))}, {number(p0)}\n"
    return comment(notes, "**") + _interaction(name, "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=EXPONENTIAL", row)


def lsdyna(law: LawTable, curve: int = 1) -> str:
    """A *DEFINE_CURVE for LS-DYNA."""
    head = f"*DEFINE_CURVE\n{curve:10d}{0:10d}{1.0:10.1f}{1.0:10.1f}{0.0:10.1f}{0.0:10.1f}{0:10d}\n"
    rows = "".join(f"{x:20.{DIGITS - 1}E}{y:20.{DIGITS - 1}E}\n" for x, y in zip(law.x, law.y, strict=True))
    return comment(law.comments, "$") + head + rows + "*END\n"


def optistruct(law: LawTable, contact: int = 1, table: int = 2) -> str:
    """PCONT and TABLES1 for OptiStruct, in long fields of 16 columns."""
    _is_pressure(law, "OptiStruct")
    pairs = [f"{value:<16.9E}" for row in zip(law.x, law.y, strict=True) for value in row]
    lines = [f"PCONT,{contact:d},,,STFTAB,{table:d}", f"{'TABLES1*':<8}{table:<16d}{'':<16}{'':<16}{'':<16}*"]
    lines.append(f"{'*':<8}")
    fields = [*pairs, f"{'ENDT':<16}"]
    lines += [f"{'*':<8}{''.join(fields[start : start + 4])}".rstrip() for start in range(0, len(fields), 4)]
    return comment(law.comments, "$") + "\n".join(lines) + "\n"


def _columns(law: LawTable) -> str:
    return "".join(f"{number(x)} {number(y)}\n" for x, y in zip(law.x, law.y, strict=True))


def comsol(law: LawTable) -> str:
    """A text file for COMSOL's interpolation function: spreadsheet columns with % comments."""
    return comment((*law.comments, "Interpolation: linear; extrapolation: none."), "%") + _columns(law)


def moose(law: LawTable) -> str:
    """A data file for MOOSE's PiecewiseLinear."""
    notes = (*law.comments, "[Functions/law] type = PiecewiseLinear, data_file = THIS, format = columns")
    return comment(notes, "#") + _columns(law)


def modelica(law: LawTable, name: str = "law") -> str:
    """A text file for Modelica's CombiTable1Ds: first line #1, then the matrix.

    Its default is linear interpolation (smoothness LinearSegments), for which the rows were chosen.
    """
    notes = (*law.comments, "smoothness = Modelica.Blocks.Types.Smoothness.LinearSegments; no extrapolation")
    return f"#1\n{comment(notes, '#')}double {checked_name(name, MAX_NAME)}({law.x.size},2)\n{_columns(law)}"
