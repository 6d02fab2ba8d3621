"""How a contact law is written in each language, and its numbers for those that do not read the core's C.

They are polynomials in order of rising overclosure c. Record k, which holds where edges[k -
1] <= scale c < edges[k], is, with x = scale c for the first `side` records and x = scale (c
- h_max) for the rest,

    t = (x - centre) rate,   p = sum_j p[j] t^j,   A/A0 = sum_j a[j] t^j,   dp/dc = scale rate dp/dt,
    energy = energy_0 + t sum_j p[j] t^j/(j + 1)/(scale rate).

Where contact ends at c = 0 the first record's polynomials are multiplied by t^power.
Leakage has records of its own against x = scale (d - blocked) with the gap d = h_max - 2 c;
with a power the first one is multiplied by it, and K is zero at and below x = 0. Where
bodies are apart, K is u^3 (1 - 1.5/((u/h_rms)^2 + 4)).
"""

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from mbma_tables.common.arguments import FloatArray
from mbma_tables.export.reserved_words import (
    fortran_words,
    law_in_matlab_words,
    modelica_words,
    python_words,
)
from mbma_tables.export.text import number, wrapped
from mbma_tables.law import block as at
from mbma_tables.law.block import (
    AREA_AT,
    CENTRE,
    ENERGY_AT,
    FORCE_AT,
    POWER_F,
    RATE,
    SCALE,
)
from mbma_tables.law.law import ContactLaw
from mbma_tables.law.leakage import LeakageLaw

MORE = (
    "conductance",
    "tangential_stiffness",
    "leakage",
)  # asked for; all but the last are slopes times a ratio
FUNCTIONS = (
    "pressure",
    "tangent",
    "with_tangent",
    "curvature",
    "area",
    "energy",
    "overclosure",
    *MORE,
)
# steps of coefficients over the least value and the least slope of a polynomial; flatter
# ones count as so steep
VALUES, SLOPES, FLAT = 2e-14, 4e-13, 1e-4
MOST_DECIMALS = 400  # more than any double has: coefficients stay as they are


def flow_numbers(leakage: LeakageLaw) -> dict[str, Any]:
    """Numbers of a law's leakage, by name."""
    head, ((x, records), *_) = leakage.block, _sides(leakage.block)
    return {
        "blocked": -float(head[at.H_MAX]),
        "scale": float(head[SCALE]),
        "power": float(head[POWER_F]),
        "h_rms": leakage.h_rms,
        "edges": x[1:],
        "centre": records[:, CENTRE],
        "rate": records[:, RATE],
        "p": records[:, FORCE_AT:AREA_AT],
    }


def law_numbers(law: ContactLaw) -> dict[str, Any]:
    """Numbers of a law, by name."""
    head, ends, sides = law.block, law.highest == math.inf, _sides(law.block)
    scale, side = 2 * float(head[SCALE]), len(sides[0][0]) if ends else 0
    edges, numbers = ([sides[0][0]], [sides[0][1]]) if ends else ([], [])
    for x, records in sides[ends:]:
        # towards full compression an end belongs to the record of larger gaps, also where
        # the sides meet
        above = np.append(x[1:], 1.0)[::-1]
        edges.append(np.nextafter(law.h_max * scale - above, math.inf))
        numbers.append(records[::-1])
    records = np.concatenate(numbers)
    signs = np.where(np.arange(len(records)) < side, 1.0, -1.0)
    return {
        "h_max": law.h_max,
        "side": side,
        "scale": scale,
        "ends": int(ends),
        "power_p": float(head[POWER_F]) if ends else 0.0,
        "power_a": float(head[at.POWER_A]) if ends else 0.0,
        "edges": np.concatenate(edges)[1:],
        "centre": signs * records[:, CENTRE],
        "rate": signs * records[:, RATE],
        "energies": records[:, ENERGY_AT] / 2,
        "p": records[:, FORCE_AT:AREA_AT],
        "a": records[:, AREA_AT:ENERGY_AT],
    }


def _sides(block: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Where records of each side of a block begin, by its own x, and the records."""
    records = block[int(block.view(np.int64)[at.RECORDS]) :].reshape(-1, at.RECORD)
    if records[0, CENTRE] == records[1, CENTRE]:  # a copy
        records = records[1:]
    begins = records[:, CENTRE] - 1 / records[:, RATE]
    cut = np.flatnonzero(np.diff(records[:, CENTRE]) < 0) + 1
    return list(zip(np.split(begins, cut), np.split(records, cut), strict=True))


def brackets(values: FloatArray) -> str:
    """A column, or rows of polynomials, as Python has them."""
    if values.ndim == 1:
        return f"[{wrapped(', '.join(map(number, values)))}]"
    return f"[\n{_lines(_decimals(values), '[', '],')}\n]"


def braces(values: FloatArray) -> str:
    """The same for Modelica."""
    return brackets(values).replace("[", "{").replace("]", "}").replace(",\n}", "\n}")


def matrix(values: FloatArray) -> str:
    """A column, or rows of polynomials, of MATLAB."""
    return f"[\n{_lines(values[:, None] if values.ndim == 1 else _decimals(values), '', ';')}]"


def _lines(rows: FloatArray, begin: str, end: str) -> str:
    return "\n".join(f"{begin}{', '.join(map(number, row))}{end}" for row in rows)


def _decimal_places(row: FloatArray) -> int:
    """Decimals with which coefficients are written: values are then right to 1e-13, slopes to about 1e-11."""
    values = polyval([-1, 0, 1], row)
    slopes = polyval([-1, 0, 1], polyder(row))
    least_value = float(np.abs(values).min())
    if least_value == 0:
        return MOST_DECIMALS
    # by logarithms: a pressure may be so small that the step itself is below the smallest double
    log_value = math.log10(least_value)
    log_slope = math.log10(FLAT) + log_value
    # about a maximum slopes are small, though not at the ends
    if (slopes > 0).all() or (slopes < 0).all():
        log_slope = max(math.log10(np.abs(slopes).min()), log_slope)
    log_step = min(math.log10(VALUES) + log_value, math.log10(SLOPES) + log_slope)
    return min(-math.floor(log_step), MOST_DECIMALS)


def _decimals(rows: FloatArray) -> FloatArray:
    """Coefficients in decimal steps."""
    written = []
    for row in rows:
        places = _decimal_places(row)
        written.append([round(coefficient, places) for coefficient in row.tolist()])
    return np.array(written)


class Beside(NamedTuple):
    """A file beside the first one of a target."""

    end: str  # of its name
    template: str = ""
    target: str = ""  # whose first file it is, in place of a template
    parts: tuple[tuple[str, str], ...] = ()  # filled in as those of its language


class Language(NamedTuple):
    """Format of a law in one language."""

    template: str
    mark: str  # of comments
    usage: str
    call: str  # of a function, with {name}, {what} and {x}
    number: Callable[[float], str] = number
    array: Callable[[FloatArray], str] | None = (
        None  # None where the core's C reads the law
    )
    subroutine: str = ""  # template of a solver's user subroutine that calls the law
    parts: tuple[tuple[str, str], ...] = ()  # what else is filled in
    beside: tuple["Beside", ...] = ()  # other files of the target
    reserved: Callable[[], frozenset[str]] = (
        frozenset  # names that it cannot have, in small letters
    )


NAN = "Outside the range: NaN."
C = Language(
    "law.c",
    "/*",
    "C99, also C++11: cc -O2 -c {name}.c, link with -lm; {name}.h beside it declares the functions. The C of the "
    f"library itself, and the law's own numbers. {NAN}",
    "{name}_{what}({x})",
    functools.partial(number, infinity="INFINITY"),
    beside=(Beside(".h", "law.h"),),
)
CALLED = (
    "{name}.c is C99, also C++11. Written from the manual's list of arguments and called with it by a program of the "
    "tests; not run in Abaqus."
)
LAST = "At pressures beyond the law's range the last value is used, with one warning on stderr."
# of a solver's surface interactions, by the names of its routine
INTERACTIONS = (
    "Surface interactions of other names stop the job. Several laws in one job, each exported under a name of its own: "
    'begin a file with the line #define {routine}_INTERFACES INTERFACE("{{interface}}", {{name}}) '
    'INTERFACE("SEAL", seal) and go on with the contents of {{name}}.c and seal.c, or #include both; the text in '
    "quotes is the name of the surface interaction, the other one that of the law."
)
SEVERAL_UINTER = INTERACTIONS.format(routine="UINTER")
SEVERAL_GAPCON = INTERACTIONS.format(routine="GAPCON")
# how a user subroutine ends the job: Abaqus has a routine for it, CalculiX its own
# routines' exit status
STOP_IN_ABAQUS = (
    (
        "STOP_DECLARED",
        "SUBROUTINE FOR_NAME(xit, XIT)(void); /* of Abaqus, closes its files */",
    ),
    ("STOP", "FOR_NAME(xit, XIT)()"),
)
STOP_IN_CALCULIX = (
    ("STOP_DECLARED", ""),
    ("STOP", "exit(201) /* as CalculiX's own routines do */"),
)
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
        functools.partial(number, exponent="d", infinity="huge(1d0)"),
        beside=(Beside("_c.c", target="c-law"),),
        reserved=functools.partial(fortran_words, FUNCTIONS),
    ),
    "javascript-law": Language(
        "law.mjs",
        "/*",
        "import {{ pressure, with_tangent, curvature, area, energy, overclosure }} from './{name}.mjs', an ECMAScript "
        "module, or require('./{name}.cjs'), the same as a CommonJS module. The C of the library itself as "
        "WebAssembly; {name}.d.mts and {name}.d.cts have the types for TypeScript. Outside the range a RangeError is "
        "thrown, of what is no number a TypeError.",
        "{what}({x})",
        functools.partial(number, infinity="Infinity"),
        parts=(("EXPORT", "export"),),
        beside=(
            Beside(".cjs", "law.mjs", parts=(("EXPORT", "module.exports ="),)),
            Beside(".d.mts", "law.d.mts"),
            Beside(".d.cts", "law.d.mts"),
        ),
    ),
    "python-law": Language(
        "law.py",
        "#",
        "Python with numpy alone: import {name}; arrays of any shape. Outside the range: ValueError.",
        "{name}.{what}({x})",
        functools.partial(number, infinity="np.inf"),
        brackets,
        reserved=python_words,
        parts=(("NP", "np"), ("NUMPY", "asked"), ("JAX", "")),
    ),
    "jax-law": Language(
        "law.py",
        "#",
        "Python with jax alone, differentiable by c, p and the pytree LAW. Set jax_enable_x64 before the import, or "
        f"answers are in single precision. {NAN}",
        "{name}.{what}({x})",
        functools.partial(number, infinity="jnp.inf"),
        brackets,
        reserved=python_words,
        parts=(("NP", "jnp"), ("NUMPY", ""), ("JAX", "asked")),
    ),
    "matlab-law": Language(
        "law.m",
        "%",
        "MATLAB and Octave: law = {name}(); arrays of any shape. Outside the range: an error.",
        "law.{what}({x})",
        functools.partial(number, infinity="Inf"),
        matrix,
        reserved=law_in_matlab_words,
    ),
    "modelica-law": Language(
        "law.mo",
        "//",
        "A Modelica package: p = {name}.pressure(c), with its derivative; where p is known a tool solves this for c. "
        "Outside the range an assertion fails.",
        "{name}.{what}({x})",
        functools.partial(number, infinity="1.0e300"),
        braces,
        reserved=modelica_words,
    ),
    "abaqus-uinter": SUBROUTINE._replace(
        usage="WITHOUT FRICTION: the faces slide freely. *SURFACE INTERACTION, NAME={interface}, USER: abaqus job=... "
        f"user={{name}}.c. {SEVERAL_UINTER} Place the bodies so that their "
        "surfaces touch where the mean planes are h_max apart. Beyond the law's range the increment is tried again "
        "with a smaller step. A linear perturbation step stops the program: for "
        "modes of a preloaded joint take the tangent at its pressure, from this file, as a spring's stiffness. "
        f"{CALLED} Arguments: Abaqus 2017, user subroutines, UINTER.",
        subroutine="uinter.c",
        parts=STOP_IN_ABAQUS,
    ),
    "abaqus-gapcon": GAPCON._replace(
        usage="*GAP CONDUCTANCE, USER of *SURFACE INTERACTION, NAME={interface}: abaqus job=... user={name}.c, beside "
        f"a table of pressures. {SEVERAL_GAPCON} {LAST} {CALLED} "
        "Arguments: Abaqus 6.5 to 2017, user subroutines, GAPCON.",
        parts=(("SOLVER", "Abaqus/Standard"), *STOP_IN_ABAQUS),
    ),
    "calculix-gapcon": GAPCON._replace(
        usage="*GAP CONDUCTANCE, USER of *SURFACE INTERACTION, NAME={interface}, in place of CalculiX's "
        "gapcon.f: in its sources cc -O2 -c {name}.c -o gapcon.o, "
        "ar r ccx_2.20.a gapcon.o, and make, which links ccx again. Use it with *CONTACT PAIR, TYPE=SURFACE TO SURFACE "
        "and *SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=EXPONENTIAL or LINEAR: with NODE TO SURFACE 2.20 hands over "
        "another pressure, without a message, and with TABULAR it has no force. EXPONENTIAL, which `mbma export "
        "calculix --conductivity` fits to this law, gives closure and conductance in one interaction. "
        f"{SEVERAL_GAPCON} {LAST} {{name}}.c is C99, also C++11. Run in ccx 2.20. "
        "Arguments: CalculiX 2.7 to 2.20, gapcon.f.",
        parts=(("SOLVER", "CalculiX"), *STOP_IN_CALCULIX),
    ),
}
