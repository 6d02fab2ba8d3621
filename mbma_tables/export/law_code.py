"""A contact law as source code that needs nothing else: the core's own C, or `law_numbers` in a template a language."""

from __future__ import annotations

import dataclasses
import functools
import math
import re
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import InputError
from mbma_tables.export.core_text import block_rows, block_text, core_text
from mbma_tables.export.joint import Joint, checked_conductivity, frozen_joint
from mbma_tables.export.law_numbers import FlowNumbers, LawNumbers, flow_numbers, law_numbers
from mbma_tables.export.text import checked_name, filled, opening, template, wrapped
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.readings import Reading
from mbma_tables.theories.protocol import Theory, UserTheory

MAX_NAME = 31  # letters, as Fortran and C99 read them
# steps of coefficients over the least value and the least slope of a polynomial; flatter ones count as so steep
VALUES, SLOPES, FLAT = 2e-14, 4e-13, 1e-4
MORE = ("conductance", "leakage")  # asked for
FUNCTIONS = ("pressure", "tangent", "with_tangent", "curvature", "area", "energy", "overclosure", *MORE)

Columns = dict[str, FloatArray]


class Language(NamedTuple):
    """How a law is written in one language.

    `call` is a function's call with {name}, {what} and {x}; `number` writes a float, `arrays` columns of numbers and
    rows of polynomials by their places in the template, whose names begin with a prefix; None where the law is read by
    the core's C. `subroutine` is the template of a solver's user subroutine that calls the law, `parts` what else is
    filled in. `own_name` has key words where the law's name stands alone, as that of a module or package. `beside` is
    the target that it calls, of the same name, in a file of its own; `inverts` whether it has `overclosure`.
    """

    template: str
    mark: str  # of comments
    usage: str
    call: str
    number: Callable[[float], str]
    arrays: Callable[[str, Columns, Columns], dict[str, str]] | None = None
    subroutine: str = ""
    parts: tuple[tuple[str, str], ...] = ()
    only_conductance: bool = False
    own_name: str = ""
    beside: str = ""
    inverts: bool = True


def law_text(
    target: str,
    surface: AnySurface,
    E_star: float | str,
    *,
    name: str = "law",
    length_unit: str | None = None,
    stress_unit: str | None = None,
    conductivity: float | None = None,
    conductivity_unit: str | None = None,
    reading: str | Reading = "reported",
    theory: str | Theory | UserTheory = "mbma",
    hardness: float | str = math.inf,
    leakage: bool = False,
) -> str:
    """A contact law as source code: pressure, tangent, area, energy and the overclosure at a pressure.

    Parameters
    ----------
    target : str
        One of `mbma_tables.export.LAWS`.
    surface, E_star, length_unit, stress_unit, reading, theory, hardness
        As for `describe_law`.
    name : str
        What functions, modules or packages are called, or begin with.
    conductivity, conductivity_unit
        k_s = 2 k1 k2/(k1 + k2) with its unit, for the function `conductance` as well.
    leakage : bool
        The function `leakage` as well, the flow conductance K of the gaps [length^3], as `ContactLaw.leakage`.

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
    if target not in LANGUAGES:
        raise InputError(f"target must be one of {tuple(LANGUAGES)}, got {target!r}")
    name, heat = code_name(name, target), (conductivity, conductivity_unit, leakage, LANGUAGES[target].only_conductance)
    if leakage and LANGUAGES[target].subroutine:
        raise InputError(f"{target} has no place for leakage: leave it out")
    units: dict[str, Any] = {"length_unit": length_unit, "stress_unit": stress_unit}
    asked = asked_law(surface, E_star, *heat, **units, reading=reading, theory=theory, hardness=hardness)
    return text_of(target, name, asked)


class AskedLaw(NamedTuple):
    """A law and what every file of it says; conductance is `ratio` times the tangent, NaN where it was not asked.

    `more` has the units of what was asked of `MORE`.
    """

    joint: Joint
    numbers: LawNumbers
    flow: FlowNumbers | None
    ratio: float
    more: dict[str, str]
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
    numbers, flow = law_numbers(joint.law), flow_numbers(joint.law.leakage) if leakage else None
    return AskedLaw(joint, numbers, flow, k_s / joint.modulus, more, _head(joint, numbers, more))


def text_of(target: str, name: str, asked: AskedLaw) -> str:
    """The text of one file."""
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
    if language.arrays is None:
        parts |= _core(name, asked, language.number)
    else:
        parts |= _numbers("", numbers, {"p": numbers.force, "a": numbers.area}, language, language.arrays)
        if flow:
            parts |= _numbers("flow_", flow, {"p": flow.force}, language, language.arrays)
    if language.subroutine:
        parts["SUBROUTINE"] = filled(language.subroutine, **parts)
    return filled(language.template, **parts)


def _core(name: str, asked: AskedLaw, number: Callable[[float], str]) -> dict[str, str]:
    """The core's C and the law's own blocks, and what the glue about them needs."""
    law, numbers = asked.joint.law, asked.numbers
    first = 0.0 if numbers.ends else (law.h_max - law.highest) / 2
    ends = {"H_MAX": law.h_max, "FIRST": first, "TURN": numbers.c_turn}
    parts = {place: number(value) for place, value in ends.items()} | {"CORE": core_text(["law.c"], name)}
    whats = [what for what in FUNCTIONS if what != "with_tangent" and (what in asked.more or what not in MORE)]
    parts["INTERFACES"] = "\n".join(FORTRAN_INTERFACE.format(name=name, what=what) for what in whats)
    parts["FUNCTIONS"] = "\n".join(FORTRAN_FUNCTION.format(what=what) for what in whats)
    blocks = {"": law.block}
    if asked.flow:
        blocks["FLOW_"], parts["FLOW_H_RMS"] = law.leakage.block, number(asked.flow.h_rms)
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
    p, k = (float(value) for value in law.force_and_stiffness(law.h_max - 2 * c))
    answers = {"pressure": (c, p), "tangent": (c, k)} | ({"overclosure": (p, c)} if language.inverts else {})
    said = ", ".join(
        f"{language.call.format(name='{name}', what=what, x=language.number(float(f'{x:.7g}')))} = {y:.7g}"
        for what, (x, y) in answers.items()
    )
    return f"Example: {said}"


def _lists(prefix: str, columns: Columns, polynomials: Columns) -> dict[str, str]:
    """Arrays in brackets, as Python and JavaScript have them."""
    flat = {name: f"[{wrapped(map(repr, column.tolist()))}]" for name, column in columns.items()}
    rows = {name: f"[\n{_lines(_decimals(rows), '[', '],')}\n]" for name, rows in polynomials.items()}
    return {f"{prefix}{name}".upper(): text for name, text in (flat | rows).items()}


def _braces(prefix: str, columns: Columns, polynomials: Columns) -> dict[str, str]:
    """The same in braces, as Modelica has them."""
    return {
        place: text.replace("[", "{").replace("]", "}").replace(",\n}", "\n}")
        for place, text in _lists(prefix, columns, polynomials).items()
    }


def _matrices(prefix: str, columns: Columns, polynomials: Columns) -> dict[str, str]:
    """Columns and matrices of MATLAB."""
    matrices = {name: column[:, None] for name, column in columns.items()}
    matrices |= {name: _decimals(rows) for name, rows in polynomials.items()}
    return {f"{prefix}{name}".upper(): f"[\n{_lines(rows, '', ';')}]" for name, rows in matrices.items()}


def _lines(rows: FloatArray, begin: str, end: str) -> str:
    return "\n".join(f"{begin}{', '.join(map(repr, row))}{end}" for row in rows.tolist())


def _step(row: FloatArray) -> float:
    """The step in which coefficients are written: values are then right to 1e-13, slopes to about 1e-11."""
    values, slopes = (polyval([-1, 0, 1], a) for a in (row, polyder(row)))
    value = float(np.abs(values).min())
    # about a maximum slopes are small, though not at the ends
    slope = float(np.abs(slopes).min()) if slopes.min() * slopes.max() > 0 else 0.0
    return min(VALUES * value, SLOPES * max(slope, FLAT * value))


def _decimals(rows: FloatArray) -> FloatArray:
    """Coefficients in decimal steps."""
    places = [-math.floor(math.log10(_step(row))) for row in rows]
    return np.array([[round(value, k) for value in row.tolist()] for row, k in zip(rows, places, strict=True)])


def _fortran_number(value: float) -> str:
    text = repr(float(value))
    return text.replace("e", "d") if "e" in text else f"{text}d0"


def _with_infinity(text: str) -> Callable[[float], str]:
    return lambda value: text if value == -math.inf else repr(float(value))


NAN = "Outside the range: NaN."
C = Language(
    "law.c",
    "/*",
    "C99, also C++11: cc -O2 -c {name}.c, link with -lm; declare what you call as where they are declared below. The "
    f"C of the library itself, and the law's own numbers. {NAN}",
    "{name}_{what}({x})",
    repr,
)
FORTRAN_INTERFACE = """\
    pure function c_{what}(x) bind(c, name="{name}_{what}") result(y)
      import :: dp
      real(dp), intent(in), value :: x
      real(dp) :: y
    end function c_{what}"""
FORTRAN_FUNCTION = """\
  elemental function {what}(x) result(y)
    real(dp), intent(in) :: x
    real(dp) :: y
    y = c_{what}(x)
  end function {what}
"""
SUBROUTINE = (
    "{name}.c is C99, also C++11. Written from the manual's list of arguments and called with it by a program of the "
    "tests; not run in the solver."
)
GAPCON = C._replace(subroutine="gapcon.c", only_conductance=True)
LANGUAGES = {
    "c-law": C,
    "fortran-law": Language(
        "law.f90",
        "!",
        "Fortran 2008 on top of {name}_c.c, which is written beside it, by `mbma export c-law`: cc -O2 -c {name}_c.c, "
        f"gfortran -c {{name}}.f90, then use {{name}}; functions are elemental, of real(c_double). {NAN}",
        "{what}({x})",
        _fortran_number,
        own_name="import program pure result value x y",
        beside="c-law",
    ),
    "javascript-law": Language(
        "law.mjs",
        "/*",
        "An ECMAScript module: import {{ pressure, withTangent, area, energy, overclosure }} from './{name}.mjs'. "
        "Outside the range a RangeError, of what is no number a TypeError is thrown.",
        "{what}({x})",
        _with_infinity("-Infinity"),
        _lists,
    ),
    "python-law": Language(
        "law.py",
        "#",
        "Python with numpy alone: import {name}; arrays of any shape. Outside the range: ValueError.",
        "{name}.{what}({x})",
        _with_infinity("-np.inf"),
        _lists,
        parts=(("NP", "np"), ("NUMPY", "asked"), ("JAX", "")),
    ),
    "jax-law": Language(
        "law.py",
        "#",
        "Python with jax alone, differentiable by c, p and the pytree LAW. Set jax_enable_x64 before the import, or "
        f"answers are in single precision. {NAN}",
        "{name}.{what}({x})",
        _with_infinity("-jnp.inf"),
        _lists,
        parts=(("NP", "jnp"), ("NUMPY", ""), ("JAX", "asked")),
    ),
    "matlab-law": Language(
        "law.m",
        "%",
        "MATLAB and Octave: law = {name}(); arrays of any shape. Outside the range: an error.",
        "law.{what}({x})",
        _with_infinity("-Inf"),
        _matrices,
        own_name="case catch classdef continue elseif global otherwise parfor return spmd switch try while",
    ),
    "modelica-law": Language(
        "law.mo",
        "//",
        "A Modelica package: p = {name}.pressure(c), with its derivative; where p is known a tool solves this for c. "
        "Outside the range an assertion fails.",
        "{name}.{what}({x})",
        _with_infinity("-1e300"),
        _braces,
        inverts=False,
        own_name="and block class connect connector der discrete each elsewhen encapsulated enumeration equation "
        "expandable extends external false final flow impure import initial inner model operator or outer partial "
        "public pure record redeclare replaceable return stream then time true type when while within",
    ),
    "abaqus-uinter": C._replace(
        usage="*SURFACE INTERACTION, NAME=..., USER: abaqus job=... user={name}.c. Place the bodies so that their "
        "surfaces touch where the mean planes are h_max apart. Beyond the law's range the increment is tried again "
        "with a smaller step. Without friction. A linear perturbation step stops the program: for "
        "modes of a preloaded joint take the tangent at its pressure, from this file, as a spring's stiffness. "
        f"{SUBROUTINE} Arguments: Abaqus 2017, user subroutines, UINTER.",
        subroutine="uinter.c",
    ),
    "abaqus-gapcon": GAPCON._replace(
        usage="*GAP CONDUCTANCE, USER: abaqus job=... user={name}.c, beside a table of pressures. A pressure beyond "
        f"the law's range stops the program. {SUBROUTINE} Arguments: Abaqus 6.5 to 2017, user subroutines, GAPCON.",
        parts=(("SOLVER", "Abaqus/Standard"),),
    ),
    "calculix-gapcon": GAPCON._replace(
        usage="*GAP CONDUCTANCE, USER, in place of CalculiX's gapcon.f: in its sources cc -O2 -c {name}.c -o gapcon.o, "
        "ar r ccx_2.20.a gapcon.o, and link ccx anew. Use it with *CONTACT PAIR, TYPE=SURFACE TO SURFACE and a closure "
        "that is LINEAR or EXPONENTIAL: 2.20 takes wrong conductances with NODE TO SURFACE, and none with TABULAR. A "
        f"pressure beyond the law's range stops the program. {SUBROUTINE} Arguments: CalculiX 2.7 to 2.20, gapcon.f.",
        parts=(("SOLVER", "CalculiX"),),
    ),
}
