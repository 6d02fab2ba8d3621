"""How a contact law is written in each language: templates, formats of numbers and arrays, notes for the user."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import NamedTuple

from mbma_tables.common.arguments import FloatArray
from mbma_tables.export.law_numbers import braces, brackets, matrix


class Language(NamedTuple):
    """Format of a law in one language."""

    template: str
    mark: str  # of comments
    usage: str
    call: str  # of a function, with {name}, {what} and {x}
    number: Callable[[float], str] = repr
    array: Callable[[FloatArray], str] | None = None  # None where the core's C reads the law
    subroutine: str = ""  # template of a solver's user subroutine that calls the law
    parts: tuple[tuple[str, str], ...] = ()  # what else is filled in
    beside: tuple[tuple[str, str], ...] = ()  # a target or a template of other files by the ends of their names


def _number(infinity: str, value: float) -> str:
    return repr(float(value)).replace("-inf", infinity)


def _fortran_number(value: float) -> str:
    text = repr(float(value))
    return text.replace("e", "d") if "e" in text else f"{text}d0"


NAN = "Outside the range: NaN."
C = Language(
    "law.c",
    "/*",
    "C99, also C++11: cc -O2 -c {name}.c, link with -lm; {name}.h beside it declares the functions. The C of the "
    f"library itself, and the law's own numbers. {NAN}",
    "{name}_{what}({x})",
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
GAPCON = SUBROUTINE._replace(subroutine="gapcon.c")
LANGUAGES = {
    "c-law": C,
    "fortran-law": Language(
        "law.f90",
        "!",
        "Fortran 2008 on top of {name}_c.c, which is written beside it, by `mbma export c-law`: cc -O2 -c {name}_c.c, "
        f"gfortran -c {{name}}.f90, then use {{name}}; functions are elemental, of real(c_double). {NAN}",
        "{what}({x})",
        _fortran_number,
        beside=(("_c.c", "c-law"),),
    ),
    "javascript-law": Language(
        "law.mjs",
        "/*",
        "An ECMAScript module: import {{ pressure, withTangent, area, energy, overclosure }} from './{name}.mjs'. "
        "The C of the library itself as WebAssembly; {name}.d.mts beside it has the types for TypeScript. Outside the "
        "range a RangeError is thrown, of what is no number a TypeError.",
        "{what}({x})",
        functools.partial(_number, "-Infinity"),
        beside=((".d.mts", "law.d.mts"),),
    ),
    "python-law": Language(
        "law.py",
        "#",
        "Python with numpy alone: import {name}; arrays of any shape. Outside the range: ValueError.",
        "{name}.{what}({x})",
        functools.partial(_number, "-np.inf"),
        brackets,
        parts=(("NP", "np"), ("NUMPY", "asked"), ("JAX", "")),
    ),
    "jax-law": Language(
        "law.py",
        "#",
        "Python with jax alone, differentiable by c, p and the pytree LAW. Set jax_enable_x64 before the import, or "
        f"answers are in single precision. {NAN}",
        "{name}.{what}({x})",
        functools.partial(_number, "-jnp.inf"),
        brackets,
        parts=(("NP", "jnp"), ("NUMPY", ""), ("JAX", "asked")),
    ),
    "matlab-law": Language(
        "law.m",
        "%",
        "MATLAB and Octave: law = {name}(); arrays of any shape. Outside the range: an error.",
        "law.{what}({x})",
        functools.partial(_number, "-Inf"),
        matrix,
    ),
    "modelica-law": Language(
        "law.mo",
        "//",
        "A Modelica package: p = {name}.pressure(c), with its derivative; where p is known a tool solves this for c. "
        "Outside the range an assertion fails.",
        "{name}.{what}({x})",
        functools.partial(_number, "-1e300"),
        braces,
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
