"""A contact law as source code that needs nothing else: the core's own C, or `law_numbers` in a template a language."""

from __future__ import annotations

import base64
import dataclasses
import functools
import math
import re
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.export.joint import Joint, checked_conductivity, frozen_joint
from mbma_tables.export.law_languages import FORTRAN_FUNCTION, FORTRAN_INTERFACE, LANGUAGES, Columns, Language
from mbma_tables.export.law_numbers import FlowNumbers, LawNumbers, flow_numbers, law_numbers
from mbma_tables.export.targets import CODE, Target
from mbma_tables.export.text import (
    braces,
    checked_name,
    core_file,
    filled,
    numerals,
    opening,
    page_file,
    template,
    wrapped,
)
from mbma_tables.law import block as at
from mbma_tables.surfaces.any_surface import AnySurface

LAW_MODULE = "law.wasm"  # the core's laws for JavaScript
MAX_NAME = 31  # letters, as Fortran and C99 read them
MORE = ("conductance", "leakage")  # asked for
FUNCTIONS = ("pressure", "tangent", "with_tangent", "curvature", "area", "energy", "overclosure", *MORE)
# functions that other files see, where they are made
_MADE = re.compile(r"^(?!static|typedef|MBMA_INLINE)\w[\w *]*\b(mbma_\w+)\([^{;]*\{$", re.M)


def law_text(
    target: str, surface: AnySurface, E_star: float | str, *, name: str = "law", leakage: bool = False, **asked: Any
) -> str:
    """A contact law as source code: pressure, tangent, area, energy and the overclosure at a pressure.

    Parameters
    ----------
    target : str
        One of `mbma_tables.export.LAWS`; a conductivity adds the function `conductance`.
    surface, E_star, **asked
        As for `describe_law`: length_unit, stress_unit, variant, theory, hardness, conductivity, conductivity_unit,
        direction.
    name : str
        What functions, modules or packages are called, or begin with.
    leakage : bool
        The function `leakage` as well, the flow coefficient K of the gaps [length^3], as `ContactLaw.leakage`.

    Returns
    -------
    str
        The text of one file; that of fortran-law calls the C of c-law by the same name.

    Raises
    ------
    InputError, OutOfRangeError
        As `describe_law`; for conductance with a hardness, which is not the slope of the law, and for leakage of a
        target that is a user subroutine.

    Examples
    --------
    >>> from mbma_tables import Surface
    >>> text = law_text("c-law", Surface.named("concrete"), "13.3 MPa", name="road", theory="calibrated")
    >>> "double road_with_tangent(double c, double *tangent);" in text, "size_t mbma_law_fill(" in text
    (True, True)
    """
    return law_files(target, surface, E_star, name=name, leakage=leakage, **asked)[""]


def law_files(
    target: str, surface: AnySurface, E_star: float | str, *, name: str = "law", leakage: bool = False, **asked: Any
) -> dict[str, str]:
    """What `law_text` returns, and the files beside it, by the ends of their names: ".h" of C, "_c.c" of Fortran."""
    if target not in LANGUAGES:
        raise InputError(f"target must be one of {tuple(LANGUAGES)}, got {target!r}")
    name, language = code_name(name, target), LANGUAGES[target]
    if leakage and language.subroutine:
        raise InputError(f"{target} has no place for leakage: leave it out")
    found = asked_law(surface, E_star, leakage=leakage, only_conductance=language.only_conductance, **asked)
    files = {"": text_of(target, name, found)}
    for end, other in language.beside:
        files[end] = text_of(other, name, found) if other in LANGUAGES else text_of(target, name, found, other)
    return files


class AskedLaw(NamedTuple):
    """A law and what every file of it says."""

    joint: Joint
    numbers: LawNumbers
    flow: FlowNumbers | None
    ratio: float  # of conductance to the tangent; NaN where it was not asked
    more: dict[str, str]  # units of what was asked of `MORE`
    said: tuple[str, ...]


def code_name(name: str, target: str = "c-law") -> str:
    """A name that functions of a law may begin with, or its module or package be called."""
    if checked_name(name, MAX_NAME).lower() in FUNCTIONS:
        raise InputError(f"name must not be that of a function of the law, {', '.join(FUNCTIONS)}")
    if name.lower() in _words(target):
        raise InputError(f"name = {name!r} stands for something else in {target}: take another one")
    return name


@functools.cache
def _words(target: str) -> frozenset[str]:
    """Words that a file's own name must not be: those in its templates, but for comments and texts, and key words."""
    language = LANGUAGES[target]
    if not language.own_name:
        return frozenset()
    text = " ".join(template(name) for name in (language.template, language.subroutine) if name)
    code = re.sub(rf"{language.mark}.*|\"[^\"]*\"|'[^'\n]*'|@\w+@", "", text)
    return frozenset(re.findall(r"[a-z]\w*", f"{code} {language.own_name}".lower()))


def asked_law(
    surface: AnySurface,
    E_star: float | str,
    conductivity: float | None = None,
    conductivity_unit: str | None = None,
    leakage: bool = False,
    only_conductance: bool = False,
    **options: Any,
) -> AskedLaw:
    """The law that a file is asked of, made once; arguments as for `law_text`."""
    conducts = only_conductance or conductivity is not None or conductivity_unit is not None
    k_s, k_unit = checked_conductivity(conductivity, conductivity_unit) if conducts else (math.nan, "")
    joint = frozen_joint(surface, E_star, **options)
    if conducts and joint.hardness < math.inf:
        raise InputError("conductance of yielded contact is not a slope of its law: leave conductivity or hardness out")
    more = {"conductance": f"{k_unit}/{joint.length}"} if conducts else {}
    more |= {"leakage": f"{joint.length}^3"} if leakage else {}
    numbers, flow = law_numbers(joint.law), flow_numbers(joint.leakage) if leakage else None
    return AskedLaw(joint, numbers, flow, k_s / joint.modulus, more, _head(joint, numbers, more))


def text_of(target: str, name: str, asked: AskedLaw, template: str = "") -> str:
    """The text of a target's own file, or of another template of it."""
    language, numbers, flow = LANGUAGES[target], asked.numbers, asked.flow
    lines = [*(line.replace("{", "{{").replace("}", "}}") for line in asked.said), language.usage]
    lines.append(_example(asked.joint, language))
    parts = {
        "HEADER": opening((line.format(name=name) for line in lines), language.mark),
        "NAME": name,
        "SUBROUTINE": "",
        "LENGTH": asked.joint.length,
        "STRESS": asked.joint.stress,
        **dict(language.parts),
        **{quantity.upper(): asked.more.get(quantity, "") and language.number(asked.ratio) for quantity in MORE},
    }
    if template:
        return filled(template, **parts)
    if language.arrays is None:
        parts |= _core(target, name, asked, language.number)
    else:
        parts |= _numbers("", numbers, {"p": numbers.force, "a": numbers.area}, language, language.arrays)
        if flow:
            parts |= _numbers("flow_", flow, {"p": flow.force}, language, language.arrays)
    if language.subroutine:
        parts["SUBROUTINE"] = filled(language.subroutine, **parts)
    return filled(language.template, **parts)


def _core(target: str, name: str, asked: AskedLaw, number: Callable[[float], str]) -> dict[str, str]:
    """The core, as C or compiled, the law's own blocks, and what the glue about them needs."""
    law, numbers = asked.joint.law, asked.numbers
    first = 0.0 if numbers.ends else (law.h_max - law.highest) / 2
    ends = {"H_MAX": law.h_max, "FIRST": first, "TURN": numbers.c_turn}
    ends |= {"C_LEAST": numbers.c_least, "C_MOST": numbers.c_most}
    parts = {place: number(value) for place, value in ends.items()}
    blocks = {"": law.block}
    if asked.flow:
        blocks["FLOW_"], parts["FLOW_H_RMS"] = asked.joint.leakage.block, number(asked.flow.h_rms)
    if target == "javascript-law":
        held = {"WASM": page_file(LAW_MODULE)}
        held |= {f"{prefix}BLOCK": block.astype("<f8", copy=False).tobytes() for prefix, block in blocks.items()}
        return parts | {place: base64.b64encode(content).decode("ascii") for place, content in held.items()}
    parts["CORE"] = core_text(["law.c"], name)
    more = {quantity.upper(): asked.more.get(quantity, "") for quantity in MORE}
    parts["DECLARED"] = filled("law.h", HEADER="", NAME=name, **more).lstrip()
    whats = [what for what in FUNCTIONS if what != "with_tangent" and (what in asked.more or what not in MORE)]
    parts["INTERFACES"] = "\n".join(FORTRAN_INTERFACE.format(name=name, what=what) for what in whats)
    parts["FUNCTIONS"] = "\n".join(FORTRAN_FUNCTION.format(what=what) for what in whats)
    for prefix, block in blocks.items():
        rows, records = block_rows(block)
        parts |= {f"{prefix}ROWS": str(rows), f"{prefix}RECORDS": str(records), f"{prefix}DATA": block_text(block)}
    return parts


def _numbers(
    prefix: str,
    numbers: LawNumbers | FlowNumbers,
    rows: Columns,
    language: Language,
    arrays: Callable[[str, Columns, Columns], dict[str, str]],
) -> dict[str, str]:
    """All numbers by their places, flags and counts as whole ones."""
    known = {field.name: getattr(numbers, field.name) for field in dataclasses.fields(numbers)}
    places = {"RECORDS": str(numbers.centre.size)}
    for name, value in known.items():
        if isinstance(value, int | float):
            places[name.upper()] = str(int(value)) if isinstance(value, int) else language.number(value)
    columns = {name: column for name, column in known.items() if name in ("edges", "centre", "rate", "energies")}
    return {f"{prefix}{place}".upper(): text for place, text in places.items()} | arrays(prefix, columns, rows)


def _head(joint: Joint, numbers: LawNumbers, more: dict[str, str]) -> tuple[str, ...]:
    """The lines that every file has."""
    length, stress = joint.length, joint.stress
    what = f"pressure [{stress}], tangent dp/dc [{stress}/{length}], area A/A0, energy, the integral of pressure"
    what += f" [{stress} {length}]"
    what += "".join(f", {quantity} [{unit}]" for quantity, unit in more.items())
    begin = "no contact below c = 0" if numbers.ends else f"c from {numbers.c_least:.10g}"
    range_ = f"{begin}, to {numbers.c_most:.10g}; there is no answer outside"
    inverse = f"overclosure at a pressure: up to c = {numbers.c_turn:.10g}"
    inverse += "" if joint.law.turning_point is None else ", where pressure turns down"
    what += f", against overclosure c [{length}]"
    return joint.header(what, range_, inverse, end=numbers.c_turn, leakage="leakage" in more)


def _example(joint: Joint, language: Language) -> str:
    """One line with values of the library's law."""
    law = joint.law
    c = float(f"{(law.h_max - (law.lowest if law.turning_point is None else law.turning_point)) / 8:.3g}")
    p, k = (float(value) for value in law.pressure_and_stiffness(law.h_max - c))
    answers = {"pressure": (c, p), "tangent": (c, k)} | ({"overclosure": (p, c)} if language.inverts else {})
    said = ", ".join(
        f"{language.call.format(name='{name}', what=what, x=language.number(float(f'{x:.7g}')))} = {y:.7g}"
        for what, (x, y) in answers.items()
    )
    return f"Example: {said}"


def core_text(sources: Iterable[str], prefix: str) -> str:
    """Sources of the core and their headers as one text; a prefix to their functions lets a program hold several."""
    texts = {name: core_file(name) for name in ("mbma.h", "elementary.h", *sources)}
    made = (name for text in texts.values() for name in _MADE.findall(text))
    renamed = [f"#define {name} {prefix}_{name}" for name in made]
    parts = [re.sub(r'^#include ".*"\n', "", text, flags=re.M) for text in texts.values()]
    return "\n".join(["/* functions of the core, which this file holds, under names of its own */", *renamed, *parts])


def block_rows(block: FloatArray) -> tuple[int, int]:
    """How many rows and records a law's block has."""
    first = int(block.view(np.int64)[at.RECORDS])
    return (first - at.HEAD) // 2, (block.size - first) // at.RECORD


def block_text(block: FloatArray) -> str:
    """A law's block as the initializer of head, rows and records in C, every number as it is."""
    rows, _ = block_rows(block)
    whole, last = block.view(np.int64), at.HEAD + 2 * rows
    head = braces(*numerals(block[: at.EXPONENT]), *numerals(whole[at.EXPONENT : at.HEAD]))
    records = [
        braces(*numerals(row[: at.FORCE_AT]), *np.split(row[at.FORCE_AT : -1], 2), *numerals(row[-1]))
        for row in block[last:].reshape(-1, at.RECORD)
    ]
    parts = head, braces(*whole[at.HEAD : last].reshape(-1, 2)), braces(*records)
    return ",\n".join(wrapped([part]) for part in parts)


TARGETS = tuple(
    Target(
        name,
        functools.partial(law_files, name),
        CODE - {"leakage"} if language.subroutine else CODE,
        rows=False,
        alone=not language.own_name or language.arrays is not None,
    )
    for name, language in LANGUAGES.items()
)
