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
from mbma_tables.export.exported_law import ExportedLaw, checked_conductivity, checked_kappa, exported_law
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
from mbma_tables.law.force_law import ForceLaw
from mbma_tables.law.law import ContactLaw
from mbma_tables.surfaces.any_surface import AnySurface

LAW_MODULE = "law.wasm"  # the core's laws for JavaScript
MAX_NAME = 31  # letters, as Fortran and C99 read them
MORE = ("conductance", "tangential_stiffness", "leakage")  # asked for; all but the last are slopes times a ratio
FUNCTIONS = ("pressure", "tangent", "with_tangent", "curvature", "area", "energy", "overclosure", *MORE)
DATA = """\
static const struct {{
    mbma_law_head head;
    mbma_law_row rows[{rows}];
    mbma_law_record records[{records}];
}} {name}_DATA = {{
{data}
}};
static const mbma_law {name} = {{&{name}_DATA.head, {name}_DATA.rows, {name}_DATA.records, {records} - 1}};
"""  # of a law in C
# functions that other files see, where they are made
_MADE = re.compile(r"^(?!static|typedef|MBMA_INLINE)\w[\w *]*\b(mbma_\w+)\([^{;]*\{$", re.M)


def law_text(
    target: str,
    surface: AnySurface | ForceLaw,
    E_star: float | str = 1.0,
    *,
    name: str = "law",
    leakage: bool = False,
    **asked: Any,
) -> str:
    """A contact law as source code: pressure, tangent, area, energy and the overclosure at a pressure.

    Parameters
    ----------
    target : str
        One of `mbma_tables.export.LAWS`; a conductivity adds the function `conductance`, kappa
        `tangential_stiffness`, of an unloading stiffness that with a hardness is not the law's own slope.
    surface, E_star, **asked
        As for `describe_law`: length_unit, stress_unit, variant, theory, hardness, conductivity, conductivity_unit,
        kappa. Or the force law of a rough sphere or cylinder (`RoughContact.law`) alone: its "pressure" is force.
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
        As `describe_law`; for conductance and tangential stiffness with a hardness in Python and MATLAB, and for
        leakage of a target that is a user subroutine.

    Examples
    --------
    >>> from mbma_tables import Surface
    >>> text = law_text("c-law", Surface.named("concrete"), "13.3 MPa", name="road", theory="calibrated")
    >>> "double road_with_tangent(double c, double *tangent);" in text, "size_t mbma_law_fill(" in text
    (True, True)
    """
    return law_files(target, surface, E_star, name=name, leakage=leakage, **asked)[""]


def law_files(
    target: str,
    surface: AnySurface | ForceLaw,
    E_star: float | str = 1.0,
    *,
    name: str = "law",
    leakage: bool = False,
    **asked: Any,
) -> dict[str, str]:
    """The result of `law_text`, and the files beside it, by the ends of their names: ".h" of C, "_c.c" of Fortran."""
    if target not in LANGUAGES:
        raise InputError(f"target must be one of {tuple(LANGUAGES)}, got {target!r}")
    name, language = code_name(name, target), LANGUAGES[target]
    if leakage and language.subroutine:
        raise InputError(f"{target} has no place for leakage: leave it out")
    if language.subroutine and isinstance(surface, ForceLaw):
        raise InputError(f"{target} takes pressures, not the force of a body")
    found = asked_law(surface, E_star, leakage=leakage, only_conductance=language.only_conductance, **asked)
    files = {"": text_of(target, name, found)}
    for end, other in language.beside:
        files[end] = text_of(other, name, found) if other in LANGUAGES else text_of(target, name, found, other)
    return files


class AskedLaw(NamedTuple):
    """A law and the contents common to its files."""

    exported: ExportedLaw
    numbers: LawNumbers
    flow: FlowNumbers | None
    slopes: dict[str, float]  # ratios of functions to the slope of a law,
    sloped: ContactLaw  # of the contact without a hardness
    more: dict[str, str]  # units of the requested quantities of `MORE`
    said: tuple[str, ...]


def code_name(name: str, target: str = "c-law") -> str:
    """A valid prefix for the functions of a law, or name for its module or package."""
    if checked_name(name, MAX_NAME).lower() in FUNCTIONS:
        raise InputError(f"name must not be that of a function of the law, {', '.join(FUNCTIONS)}")
    if name.lower() in _words(target):
        raise InputError(f"name = {name!r} stands for something else in {target}: take another one")
    return name


@functools.cache
def _words(target: str) -> frozenset[str]:
    """Names that a law must not have: identifiers in its templates (without comments and strings), and key words."""
    language = LANGUAGES[target]
    if not language.own_name:
        return frozenset()
    text = " ".join(template(name) for name in (language.template, language.subroutine) if name)
    code = re.sub(rf"{language.mark}.*|\"[^\"]*\"|'[^'\n]*'|@\w+@", "", text)
    return frozenset(re.findall(r"[a-z]\w*", f"{code} {language.own_name}".lower()))


def asked_law(
    surface: AnySurface | ForceLaw,
    E_star: float | str = 1.0,
    conductivity: float | None = None,
    conductivity_unit: str | None = None,
    kappa: float | None = None,
    leakage: bool = False,
    only_conductance: bool = False,
    **options: Any,
) -> AskedLaw:
    """The law for a requested file, made once; arguments as for `law_text`."""
    conducts = only_conductance or conductivity is not None or conductivity_unit is not None
    k_s, k_unit = checked_conductivity(conductivity, conductivity_unit) if conducts else (math.nan, "")
    if isinstance(surface, ForceLaw) and (conducts or leakage):
        raise InputError("a force law has neither conductance nor leakage: leave conductivity and leakage out")
    exported = exported_law(surface, E_star, **options)
    slopes = {"conductance": k_s / exported.modulus} if conducts else {}
    more = {"conductance": f"{k_unit}/{exported.length}"} if conducts else {}
    if kappa is not None:
        slopes["tangential_stiffness"] = 1 / checked_kappa(kappa)
        more["tangential_stiffness"] = f"{exported.stress}/{exported.length}"
    more |= {"leakage": f"{exported.length}^3"} if leakage else {}
    sloped, factor = exported.law.unloading if slopes else (exported.law, 1.0)
    slopes = {what: factor * ratio for what, ratio in slopes.items()}
    numbers, flow = law_numbers(exported.law), flow_numbers(exported.leakage) if leakage else None
    return AskedLaw(exported, numbers, flow, slopes, sloped, more, _head(exported, numbers, more))


def text_of(target: str, name: str, asked: AskedLaw, template: str = "") -> str:
    """The text of a target's own file, or of another template of it."""
    language, numbers, flow = LANGUAGES[target], asked.numbers, asked.flow
    yields = asked.sloped is not asked.exported.law
    if yields and not language.unloads:
        raise InputError(
            f"{target} has no place for an unloading stiffness, which conductance and tangential stiffness of yielded "
            "contact follow: leave the hardness out, or take c-law, fortran-law, javascript-law, modelica-law or an FMU"
        )
    lines = [*(line.replace("{", "{{").replace("}", "}}") for line in asked.said), language.usage]
    lines.append(_example(asked.exported, language))
    parts = {
        "HEADER": opening((line.format(name=name) for line in lines), language.mark),
        "NAME": name,
        "SUBROUTINE": "",
        "LENGTH": asked.exported.length,
        "STRESS": asked.exported.stress,
        **dict(language.parts),
        "ELASTIC": "yes" if yields else "",
        "LEAKAGE": asked.more.get("leakage", ""),
    }
    each = {what: language.number(ratio) for what, ratio in asked.slopes.items()}
    sloped = ("LAW", "ELASTIC") if language.arrays is None else ("tangent", "unloading")
    parts |= {"CONDUCTANCE": each.get("conductance", ""), "SLOPED": sloped[yields]}
    if template:
        return filled(template, each, **parts)
    if language.arrays is None:
        parts |= _core(target, name, asked, language.number)
    else:
        parts |= _numbers("", numbers, {"p": numbers.force, "a": numbers.area}, language, language.arrays)
        if flow:
            parts |= _numbers("flow_", flow, {"p": flow.force}, language, language.arrays)
        if yields:
            own = law_numbers(asked.sloped)
            parts |= _numbers("elastic_", own, {"p": own.force}, language, language.arrays)
    if language.subroutine:
        parts["SUBROUTINE"] = filled(language.subroutine, **parts)
    return filled(language.template, each, **parts)


def _core(target: str, name: str, asked: AskedLaw, number: Callable[[float], str]) -> dict[str, str]:
    """The core, as C or compiled, the law's own blocks, and the values for the wrapper around them."""
    law, numbers = asked.exported.law, asked.numbers
    first = 0.0 if numbers.ends else (law.h_max - law.highest) / 2
    ends = {"H_MAX": law.h_max, "FIRST": first, "TURN": numbers.c_turn}
    ends |= {"C_LEAST": numbers.c_least, "C_MOST": numbers.c_most}
    parts = {place: number(value) for place, value in ends.items()}
    blocks = {"LAW": law.block}
    if asked.flow:
        blocks["FLOW"], parts["FLOW_H_RMS"] = asked.exported.leakage.block, number(asked.flow.h_rms)
    if asked.sloped is not law:
        blocks["ELASTIC"] = asked.sloped.block
    if target == "javascript-law":
        held = {"WASM": page_file(LAW_MODULE)}
        held |= {f"{name}_BLOCK": block.astype("<f8", copy=False).tobytes() for name, block in blocks.items()}
        return parts | {place: base64.b64encode(content).decode("ascii") for place, content in held.items()}
    parts["CORE"] = core_text(["law.c"], name)
    slopes = dict.fromkeys(asked.slopes, "")
    parts["DECLARED"] = filled("law.h", slopes, HEADER="", NAME=name, LEAKAGE=asked.more.get("leakage", "")).lstrip()
    whats = [what for what in FUNCTIONS if what != "with_tangent" and (what in asked.more or what not in MORE)]
    parts["INTERFACES"] = "\n".join(FORTRAN_INTERFACE.format(name=name, what=what) for what in whats)
    parts["FUNCTIONS"] = "\n".join(FORTRAN_FUNCTION.format(what=what) for what in whats)
    rows = {own: dict(zip(("rows", "records"), block_rows(block), strict=True)) for own, block in blocks.items()}
    laws = (DATA.format(name=own, data=block_text(block), **rows[own]) for own, block in blocks.items())
    return parts | {"LAWS": "".join(laws).rstrip()}


def _numbers(
    prefix: str,
    numbers: LawNumbers | FlowNumbers,
    rows: Columns,
    language: Language,
    arrays: Callable[[str, Columns, Columns], dict[str, str]],
) -> dict[str, str]:
    """All numbers by their placeholders, flags and counts as integers."""
    known = {field.name: getattr(numbers, field.name) for field in dataclasses.fields(numbers)}
    places = {"RECORDS": str(numbers.centre.size)}
    for name, value in known.items():
        if isinstance(value, int | float):
            places[name.upper()] = str(int(value)) if isinstance(value, int) else language.number(value)
    columns = {name: column for name, column in known.items() if name in ("edges", "centre", "rate", "energies")}
    return {f"{prefix}{place}".upper(): text for place, text in places.items()} | arrays(prefix, columns, rows)


def _head(exported: ExportedLaw, numbers: LawNumbers, more: dict[str, str]) -> tuple[str, ...]:
    """The lines that every file has."""
    length, stress = exported.length, exported.stress
    what = f"pressure [{stress}], tangent dp/dc [{stress}/{length}], area A/A0, energy, the integral of pressure"
    what += f" [{stress} {length}]"
    what += "".join(f", {quantity} [{unit}]" for quantity, unit in more.items())
    begin = "no contact below c = 0" if numbers.ends else f"c from {numbers.c_least:.10g}"
    range_ = f"{begin}, to {numbers.c_most:.10g}; there is no answer outside"
    inverse = f"overclosure at a pressure: up to c = {numbers.c_turn:.10g}"
    inverse += "" if exported.law.turning_point is None else ", where pressure turns down"
    what += f", against overclosure c [{length}]"
    return exported.header(what, range_, inverse, end=numbers.c_turn, leakage="leakage" in more)


def _example(exported: ExportedLaw, language: Language) -> str:
    """One line with values of the library's law."""
    law = exported.law
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
    """Numbers of rows and records of a law's block."""
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
