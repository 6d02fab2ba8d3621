"""Contact laws in the words of finite-element and system codes; each target is one function of a `LawTable`.

CalculiX 2.20 was run with what is written here, force and conductance; the others are written from their manuals.
"""

from __future__ import annotations

import math

import numpy as np

from mbma_tables import __version__
from mbma_tables.common.arguments import whole_number_in
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import in_unit, modulus_and_units
from mbma_tables.export.law_rows import LawTable
from mbma_tables.export.text import DIGITS, checked_name, comment, number
from mbma_tables.surfaces.any_surface import AnySurface

MAX_CALCULIX_ROWS = 200
MAX_CALCULIX_CONDUCTANCES = 20  # of more, 2.20 keeps the last twenty, without a message
MIN_CALCULIX_STEP = 1e-10  # overclosures that are closer are moved apart when they are read
MAX_ID = 99_999_999  # of a card: eight columns
MAX_NAME = 80  # letters of a name in CalculiX and Abaqus


def _is_contact(law: LawTable, target: str, conducts: bool = True) -> None:
    """Refuse all but pressure, and, where the target `conducts`, conductance with its pressure."""
    if law.y_name != "pressure" and not (conducts and law.behaviour):
        raise InputError(f"{target} takes pressure against overclosure here, got {law.y_name} against {law.x_name}")


def _interaction(name: str, *cards: str) -> str:
    return f"*SURFACE INTERACTION, NAME={checked_name(name, MAX_NAME)}\n{''.join(cards)}"


def _card(head: str, law: LawTable) -> str:
    """A card with its rows, the other way about than in the law: pressure, overclosure, or conductance, pressure."""
    return f"{head}\n" + "".join(f"{number(y)}, {number(x)}\n" for x, y in zip(law.x, law.y, strict=True))


def calculix(law: LawTable, name: str = "ROUGH") -> str:
    """A surface interaction for CalculiX, with the contact pair that reads it rightly.

    A law of conductance comes with a linear closure, the only one with which 2.20 takes a table of conductances.

    Raises
    ------
    InputError
        For more rows than its arrays hold, 200 of pressure or 20 of conductance, and for rows that it would move apart.
    """
    _is_contact(law, "CalculiX")
    most = MAX_CALCULIX_ROWS if law.behaviour is None else MAX_CALCULIX_CONDUCTANCES
    if law.x.size > most:
        raise InputError(f"CalculiX holds {most} rows of {law.y_name}, this law has {law.x.size}: give fewer rows")
    if law.behaviour is not None:
        return _calculix_conductance(law, law.behaviour, name)
    if (np.diff(law.x) <= MIN_CALCULIX_STEP).any():
        raise InputError(
            f"rows are closer than {MIN_CALCULIX_STEP:g} {law.x_unit}, which CalculiX cannot tell apart: take fewer "
            "rows or a smaller unit of length"
        )
    notes = (
        *law.comments,
        "CalculiX keeps the pressure constant beyond the last row. Use this interaction with",
        f"  *CONTACT PAIR, INTERACTION={name}, TYPE=NODE TO SURFACE",
        "and no other type: 2.20 reads TABULAR wrongly with SURFACE TO SURFACE and MORTAR, without a message.",
        "Place the bodies so that their surfaces touch where the mean planes are h_max apart.",
    )
    return comment(notes, "**") + _interaction(name, _card("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TABULAR", law))


def _calculix_conductance(law: LawTable, behaviour: LawTable, name: str) -> str:
    slope = float(behaviour.y[-1] / behaviour.x[-1])
    notes = (
        *law.comments,
        "Use this interaction with",
        f"  *CONTACT PAIR, INTERACTION={name}, TYPE=SURFACE TO SURFACE",
        "and no other type: with NODE TO SURFACE 2.20 takes one conductance for all pressures, or none, silently.",
        f"The closure is linear here, p = {number(slope)} c, and the law's at the largest pressure alone:",
        "2.20 takes no table of pressures beside one of conductances. Prescribe forces; for closures export pressure.",
    )
    linear = f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{number(slope)}\n"
    return comment(notes, "**") + _interaction(name, linear, _card("*GAP CONDUCTANCE", law))


def abaqus(law: LawTable, name: str = "ROUGH") -> str:
    """A surface interaction for Abaqus, which continues the last slope beyond the last row; pressure, or both."""
    _is_contact(law, "Abaqus")
    notes = (*law.comments, "Abaqus continues the last slope beyond the last row: stay within the range.")
    cards = [_card("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TABULAR", law.behaviour or law)]
    if law.behaviour is not None:
        cards.append(_card("*GAP CONDUCTANCE, PRESSURE", law))
    return comment(notes, "**") + _interaction(name, *cards)


def exponential(
    surface: AnySurface,
    E_star: float | str,
    *,
    length_unit: str | None = None,
    stress_unit: str | None = None,
    name: str = "ROUGH",
) -> str:
    """CalculiX's card of an exponential law: Persson's for light loads, p = beta E* exp(-u/u0) (20).

    Abaqus has a card of that name for another curve, which ends at a clearance.
    """
    from mbma_tables.theories import Persson

    surface = in_unit(surface, length_unit)
    modulus, units = modulus_and_units(E_star, surface, stress_unit)
    for kind in ("length", "stress"):
        if getattr(units, kind) in (None, "1"):
            raise InputError(f"{kind}_unit is missing: a law without units is read wrongly sooner or later")
    h_rms = float(surface.h_rms)
    near, far = modulus * Persson("simplified").answer(surface, h_rms * np.array([1.0, 2.0])).pressure
    u0 = h_rms / math.log(near / far)
    p0 = near * math.exp((h_rms - float(surface.h_max)) / u0)
    numbers = ", ".join(f"{key} = {float(getattr(surface, key)):.10g}" for key in surface.parameters)
    notes = (
        f"Contact law of a rough surface by Persson's theory for light loads; mbma_tables {__version__}",
        f"p = p0 exp(c/u0), p0 = {number(p0)} {units.stress}, u0 = {number(u0)} {units.length}; u0 ln 100, p0 follow",
        f"surface: {numbers}; lengths in {units.length}; E* = {modulus:.10g} {units.stress}",
        "overclosure c = h_max - u with the mean separation u: bodies touch where the mean planes are h_max apart;",
        "this law has no last contact: at c = 0 its pressure is p0. It holds for light loads alone.",
    )
    row = f"{number(u0 * math.log(100))}, {number(p0)}\n"
    card = f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=EXPONENTIAL\n{row}"
    return comment(notes, "**") + _interaction(name, card)


def lsdyna(law: LawTable, curve: int = 1) -> str:
    """A *DEFINE_CURVE for LS-DYNA, to be included: without *END, which would end the deck that it is pasted into."""
    curve = whole_number_in("curve", curve, 1, MAX_ID)
    head = f"*DEFINE_CURVE\n{curve:10d}{0:10d}{1.0:10.1f}{1.0:10.1f}{0.0:10.1f}{0.0:10.1f}{0:10d}\n"
    rows = "".join(f"{x:20.{DIGITS - 1}E}{y:20.{DIGITS - 1}E}\n" for x, y in zip(law.x, law.y, strict=True))
    return comment(law.comments, "$") + head + rows


def optistruct(law: LawTable, contact: int = 1, table: int = 2) -> str:
    """PCONT and TABLES1 for OptiStruct, in long fields of 16 columns."""
    _is_contact(law, "OptiStruct", conducts=False)
    contact, table = (whole_number_in(n, k, 1, MAX_ID) for n, k in (("contact", contact), ("table", table)))
    pairs = [f"{value:<16.9E}" for row in zip(law.x, law.y, strict=True) for value in row]
    # the keyword stands where a line begins: on the first one that field is the friction coefficient
    lines = [f"PCONT,{contact:d}", f"+,STFTAB,{table:d}", f"{'TABLES1*':<8}{table:<16d}{'':<16}{'':<16}{'':<16}*"]
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
