"""How a contact law is written in each language: templates, formats of numbers and arrays, notes for the user."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from mbma_tables.common.arguments import FloatArray
from mbma_tables.export.text import wrapped

# steps of coefficients over the least value and the least slope of a polynomial; flatter ones count as so steep
VALUES, SLOPES, FLAT = 2e-14, 4e-13, 1e-4

Columns = dict[str, FloatArray]


class Language(NamedTuple):
    """Format of a law in one language.

    `call` is a function's call with {name}, {what} and {x}; `number` writes a float, `arrays` columns of numbers and
    rows of polynomials by their places in the template, whose names begin with a prefix; None where the law is read by
    the core's C. `subroutine` is the template of a solver's user subroutine that calls the law, `parts` what else is
    filled in. `own_name` has key words where the law's name stands alone, as that of a module or package. `beside` has
    other files by the ends of their names, each a target or a template; `inverts` is whether it has `overclosure`,
    `unloads` whether it has an unloading stiffness that is not its own slope.
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
    beside: tuple[tuple[str, str], ...] = ()
    inverts: bool = True
    unloads: bool = True


def _lists(prefix: str, columns: Columns, polynomials: Columns) -> dict[str, str]:
    """Arrays in brackets, as Python has them."""
    flat = {name: f"[{wrapped(map(repr, column.tolist()))}]" for name, column in columns.items()}
    rows = {name: f"[\n{_lines(_decimals(rows), '[', '],')}\n]" for name, rows in polynomials.items()}
    return {f"{prefix}{name}".upper(): text for name, text in (flat | rows).items()}


def _braces(prefix: str, columns: Columns, polynomials: Columns) -> dict[str, str]:
    """The same in braces, for Modelica."""
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
    "C99, also C++11: cc -O2 -c {name}.c, link with -lm; {name}.h beside it declares the functions. The C of the "
    f"library itself, and the law's own numbers. {NAN}",
    "{name}_{what}({x})",
    repr,
    beside=((".h", "law.h"),),
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
CALLED = (
    "{name}.c is C99, also C++11. Written from the manual's list of arguments and called with it by a program of the "
    "tests; not run in Abaqus."
)
LAST = "At pressures beyond the law's range the last value is used, with one warning on stderr."
SUBROUTINE = C._replace(beside=())
GAPCON = SUBROUTINE._replace(subroutine="gapcon.c", only_conductance=True)
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
        beside=(("_c.c", "c-law"),),
    ),
    "javascript-law": Language(
        "law.mjs",
        "/*",
        "An ECMAScript module: import {{ pressure, withTangent, area, energy, overclosure }} from './{name}.mjs'. "
        "The C of the library itself as WebAssembly; {name}.d.mts beside it has the types for TypeScript. Outside the "
        "range a RangeError is thrown, of what is no number a TypeError.",
        "{what}({x})",
        _with_infinity("-Infinity"),
        beside=((".d.mts", "law.d.mts"),),
    ),
    "python-law": Language(
        "law.py",
        "#",
        "Python with numpy alone: import {name}; arrays of any shape. Outside the range: ValueError.",
        "{name}.{what}({x})",
        _with_infinity("-np.inf"),
        _lists,
        parts=(("NP", "np"), ("NUMPY", "asked"), ("JAX", "")),
        unloads=False,
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
        unloads=False,
    ),
    "matlab-law": Language(
        "law.m",
        "%",
        "MATLAB and Octave: law = {name}(); arrays of any shape. Outside the range: an error.",
        "law.{what}({x})",
        _with_infinity("-Inf"),
        _matrices,
        own_name="case catch classdef continue elseif global otherwise parfor return spmd switch try while",
        unloads=False,
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
    "abaqus-uinter": SUBROUTINE._replace(
        usage="*SURFACE INTERACTION, NAME=..., USER: abaqus job=... user={name}.c. Place the bodies so that their "
        "surfaces touch where the mean planes are h_max apart. Beyond the law's range the increment is tried again "
        "with a smaller step. Without friction. A linear perturbation step stops the program: for "
        "modes of a preloaded joint take the tangent at its pressure, from this file, as a spring's stiffness. "
        f"{CALLED} Arguments: Abaqus 2017, user subroutines, UINTER.",
        subroutine="uinter.c",
    ),
    "abaqus-gapcon": GAPCON._replace(
        usage=f"*GAP CONDUCTANCE, USER: abaqus job=... user={{name}}.c, beside a table of pressures. {LAST} {CALLED} "
        "Arguments: Abaqus 6.5 to 2017, user subroutines, GAPCON.",
        parts=(("SOLVER", "Abaqus/Standard"),),
    ),
    "calculix-gapcon": GAPCON._replace(
        usage="*GAP CONDUCTANCE, USER in place of CalculiX's gapcon.f: in its sources cc -O2 -c {name}.c -o gapcon.o, "
        "ar r ccx_2.20.a gapcon.o, and make, which links ccx again. Use it with *CONTACT PAIR, TYPE=SURFACE TO SURFACE "
        "and *SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=EXPONENTIAL or LINEAR: with NODE TO SURFACE 2.20 hands over "
        "another pressure, without a message, and with TABULAR it has no force. EXPONENTIAL, which `mbma export "
        "calculix --conductivity` fits to this law, gives closure and conductance in one interaction. "
        f"{LAST} {{name}}.c is C99, also C++11. Run in ccx 2.20. Arguments: CalculiX 2.7 to 2.20, gapcon.f.",
        parts=(("SOLVER", "CalculiX"),),
    ),
}
