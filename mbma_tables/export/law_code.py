"""A contact law as source code that needs nothing else: one description, `law_numbers`, and a template a language."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import InputError
from mbma_tables.export.joint import Joint, checked_conductivity, frozen_joint
from mbma_tables.export.law_numbers import DIGITS, LawNumbers, law_numbers
from mbma_tables.export.text import checked_name, filled, opening, wrapped
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.readings import Reading
from mbma_tables.theories.protocol import Theory, UserTheory

MAX_NAME = 31  # letters, as Fortran and C99 read them
FUNCTIONS = ("pressure", "tangent", "with_tangent", "curvature", "area", "energy", "conductance", "overclosure")
SCALARS = ("h_max", "c_least", "c_turn", "c_most", "scale", "power_p", "power_a")


class Language(NamedTuple):
    """How a law is written in one language.

    `call` is a function's call with {name}, {what} and {x}; `number` writes a float, `arrays` the polynomials by the
    names of their places in the template, `conductance` the function of that name with {ratio}, also by places.
    `subroutine` is the template of a solver's user subroutine that calls the law, `parts` what is filled in there.
    """

    template: str
    mark: str  # of comments
    usage: str
    call: str
    number: Callable[[float], str]
    arrays: Callable[[LawNumbers], dict[str, str]]
    conductance: dict[str, str]
    subroutine: str = ""
    parts: tuple[tuple[str, str], ...] = ()
    only_conductance: bool = False


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

    Returns
    -------
    str
        The text of one file.

    Raises
    ------
    InputError, OutOfRangeError
        As `describe_law`; and for conductance with a hardness, which is not the slope of the law.

    Examples
    --------
    >>> from mbma_tables import Surface
    >>> text = law_text("c-law", Surface.named("concrete"), "13.3 MPa", name="road", theory="calibrated")
    >>> "double road_with_tangent(double c, double *tangent);" in text
    True
    """
    if target not in LANGUAGES:
        raise InputError(f"target must be one of {tuple(LANGUAGES)}, got {target!r}")
    name, heat = code_name(name), (conductivity, conductivity_unit, LANGUAGES[target].only_conductance)
    units: dict[str, Any] = {"length_unit": length_unit, "stress_unit": stress_unit}
    asked = asked_law(surface, E_star, *heat, **units, reading=reading, theory=theory, hardness=hardness)
    return text_of(target, name, asked)


class AskedLaw(NamedTuple):
    """A law and what every file of it says; conductance is `ratio` times the tangent, NaN where it was not asked."""

    joint: Joint
    numbers: LawNumbers
    ratio: float
    conductance_unit: str
    said: tuple[str, ...]


def code_name(name: str) -> str:
    """A name that functions of a law may begin with."""
    if checked_name(name, MAX_NAME).lower() in FUNCTIONS:
        raise InputError(f"name must not be that of a function of the law, {', '.join(FUNCTIONS)}")
    return name


def asked_law(
    surface: AnySurface,
    E_star: float | str,
    conductivity: float | None = None,
    conductivity_unit: str | None = None,
    only_conductance: bool = False,
    **options: Any,
) -> AskedLaw:
    """The law that a file is asked of, made once; arguments as for `law_text`."""
    conducts = only_conductance or conductivity is not None or conductivity_unit is not None
    k_s, k_unit = checked_conductivity(conductivity, conductivity_unit) if conducts else (math.nan, "")
    joint = frozen_joint(surface, E_star, **options)
    if conducts and joint.hardness < math.inf:
        raise InputError("conductance of yielded contact is not a slope of its law: leave conductivity or hardness out")
    numbers, unit = law_numbers(joint.law), f"{k_unit}/{joint.length}" if conducts else ""
    return AskedLaw(joint, numbers, k_s / joint.modulus, unit, _head(joint, numbers, unit))


def text_of(target: str, name: str, asked: AskedLaw) -> str:
    """The text of one file."""
    language, numbers = LANGUAGES[target], asked.numbers
    lines = [*(line.replace("{", "{{").replace("}", "}}") for line in asked.said), language.usage]
    lines.append(_example(asked.joint, language))
    parts = {
        "HEADER": opening((line.format(name=name) for line in lines), language.mark),
        "NAME": name,
        "RECORDS": str(numbers.centre.size),
        "STEP": str(1 << (numbers.centre.size - 1).bit_length() - 1),
        "ENDS": str(int(numbers.ends)),
        "SIDE": str(numbers.side),
        **dict.fromkeys(("CONDUCTANCE", "PROTOTYPE", "PUBLIC", "FLUX", "SUBROUTINE"), ""),
        **{scalar.upper(): language.number(getattr(numbers, scalar)) for scalar in SCALARS},
        **language.arrays(numbers),
    }
    if asked.conductance_unit:
        ratio = language.number(asked.ratio)
        parts |= {place: text.format(name=name, ratio=ratio) for place, text in language.conductance.items()}
    if language.subroutine:
        parts["SUBROUTINE"] = filled(language.subroutine, **parts | dict(language.parts))
    return filled(language.template, **parts)


def _head(joint: Joint, numbers: LawNumbers, conductance_unit: str) -> tuple[str, ...]:
    """The lines that every file has."""
    length, stress = joint.length, joint.stress
    what = f"pressure [{stress}], tangent dp/dc [{stress}/{length}], area A/A0, energy, the integral of pressure"
    what += f" [{stress} {length}]"
    what += f", and conductance [{conductance_unit}]" if conductance_unit else ""
    begin = "no contact below c = 0" if numbers.ends else f"c from {numbers.c_least:.10g}"
    range_ = f"{begin}, to {numbers.c_most:.10g}; there is no answer outside"
    more = f"overclosure at a pressure: up to c = {numbers.c_turn:.10g}"
    more += ", where pressure turns down" if numbers.c_turn < numbers.c_most else ""
    return joint.header(f"{what}, against overclosure c [{length}]", range_, more, end=numbers.c_turn)


def _example(joint: Joint, language: Language) -> str:
    """One line with values of the library's law."""
    law = joint.law
    c = float(f"{(law.h_max - (law.lowest if law.turning_point is None else law.turning_point)) / 8:.3g}")
    p, k = (float(value) for value in law.force_and_stiffness(law.h_max - 2 * c))
    answers = {"pressure": (c, p), "tangent": (c, 2 * k), "overclosure": (p, c)}
    said = ", ".join(
        f"{language.call.format(name='{name}', what=what, x=language.number(float(f'{x:.7g}')))} = {y:.7g}"
        for what, (x, y) in answers.items()
    )
    return f"Example: {said}"


def _rows_of_c(numbers: LawNumbers) -> dict[str, str]:
    """Coefficients as whole numbers in units of their own, which is shortest."""

    def polynomial(row: FloatArray) -> str:
        place = math.floor(math.log10(abs(row).max())) + round(math.log10(DIGITS))
        return f"Q(1e{place},{','.join(f'{value * 10.0**-place:.0f}' for value in row)})"

    rows = [
        f"{{{centre:.17g},{rate:.17g},{energy:.16g},{polynomial(force)},{polynomial(area)}}},"
        for centre, rate, energy, force, area in zip(
            numbers.centre, numbers.rate, numbers.energy, numbers.force, numbers.area, strict=True
        )
    ]
    return {"ROWS": "\n".join(rows), "EDGES": wrapped(map(repr, numbers.edges.tolist()))}


def _lists(numbers: LawNumbers) -> dict[str, str]:
    """Arrays in brackets, as Python and JavaScript have them."""
    return {
        **{name.upper(): f"[{wrapped(map(repr, getattr(numbers, name).tolist()))}]" for name in FLAT},
        **{place: f"[\n{_lines(rows, '[', '],')}\n]" for place, rows in (("P", numbers.force), ("A", numbers.area))},
    }


def _braces(numbers: LawNumbers) -> dict[str, str]:
    """The same in braces, as Modelica has them."""
    return {
        place: text.replace("[", "{").replace("]", "}").replace(",\n}", "\n}")
        for place, text in _lists(numbers).items()
    }


def _matrices(numbers: LawNumbers) -> dict[str, str]:
    """Columns and matrices of MATLAB."""
    return {
        **{name.upper(): f"[\n{_lines(getattr(numbers, name)[:, None], '', ';')}]" for name in FLAT},
        **{place: f"[\n{_lines(rows, '', ';')}]" for place, rows in (("P", numbers.force), ("A", numbers.area))},
    }


def _data(numbers: LawNumbers) -> dict[str, str]:
    """Statements of Fortran, one a record: no statement grows with the law."""
    edges = [*numbers.edges, math.inf]
    columns = zip(edges, numbers.centre, numbers.rate, numbers.energy, numbers.force, numbers.area, strict=True)
    lines = []
    for k, (edge, centre, rate, energy, force, area) in enumerate(columns, 1):
        heads = wrapped(map(_fortran_number, (edge, centre, rate, energy)))
        lines.append(f"  data edges({k}), centre({k}), rate({k}), energies({k}) &\n    / {heads} /")
        for name, row in (("p_", force), ("a_", area)):
            text = wrapped(map(_fortran_number, row), "    ", " &")
            lines.append(f"  data ({name}(k_, {k}), k_ = 0, 8) / &\n{text} /")
    return {"DATA": "\n".join(lines)}


def _lines(rows: FloatArray, begin: str, end: str) -> str:
    return "\n".join(f"{begin}{', '.join(map(repr, row))}{end}" for row in rows.tolist())


def _fortran_number(value: float) -> str:
    if math.isinf(value):
        return "-huge(1d0)" if value < 0 else "1d300"
    text = repr(float(value))
    return text.replace("e", "d") if "e" in text else f"{text}d0"


def _with_infinity(text: str) -> Callable[[float], str]:
    return lambda value: text if value == -math.inf else repr(float(value))


FLAT = ("edges", "centre", "rate", "energy")
PYTHON_CONDUCTANCE = """

def conductance(c{given}):
    return {{ratio}} * tangent(c{passed})

"""
NAN = "Outside the range: NaN."
FORTRAN = Language(
    "law.f90",
    "!",
    f"Fortran 2008: gfortran -c {{name}}.f90, then use {{name}}; functions are elemental, of real(real64). {NAN}",
    "{what}({x})",
    _fortran_number,
    _data,
    {
        "PUBLIC": ", conductance",
        "CONDUCTANCE": "\n  elemental function conductance(c) result(h)\n    real(dp), intent(in) :: c\n"
        "    real(dp) :: h\n    h = {ratio}*tangent(c)\n  end function conductance\n",
    },
)
FLUX = """  if (p > 0) then
    flux = [1, -1]*conductance(c)*(temp(2) - temp(1))
    ddfddt = conductance(c)*reshape([1, -1, -1, 1], [2, 2])
    ddfddr(:, 1) = flux/slope*curvature(c)
  end if
"""
READ = (
    "Written from the manual's list of arguments and called with it by a program of the tests; not run in the solver."
)
GAPCON = FORTRAN._replace(subroutine="gapcon.f90", only_conductance=True)
LANGUAGES = {
    "c-law": Language(
        "law.c",
        "/*",
        f"C99, also C++11: cc -O2 -c {{name}}.c, link with -lm; declare what you call as below. {NAN}",
        "{name}_{what}({x})",
        _with_infinity("-INFINITY"),
        _rows_of_c,
        {
            "PROTOTYPE": "\ndouble {name}_conductance(double c);",
            "CONDUCTANCE": "\ndouble {name}_conductance(double c) {{ return {ratio}*{name}_tangent(c); }}\n",
        },
    ),
    "fortran-law": FORTRAN,
    "javascript-law": Language(
        "law.mjs",
        "/*",
        "An ECMAScript module: import {{{{ pressure, withTangent, area, energy, overclosure }}}} from './{name}.mjs'. "
        "Outside the range a RangeError, of what is no number a TypeError is thrown.",
        "{what}({x})",
        _with_infinity("-Infinity"),
        _lists,
        {"CONDUCTANCE": "\nexport function conductance(c) {{\n  return {ratio} * tangent(c);\n}}\n"},
    ),
    "python-law": Language(
        "law.py",
        "#",
        "Python with numpy alone: import {name}; arrays of any shape. Outside the range: ValueError.",
        "{name}.{what}({x})",
        _with_infinity("-np.inf"),
        _lists,
        {"CONDUCTANCE": PYTHON_CONDUCTANCE.format(given="", passed="")},
    ),
    "jax-law": Language(
        "law.jax.py",
        "#",
        "Python with jax alone, differentiable by c, p and the pytree LAW. Set jax_enable_x64 before the import, or "
        f"answers are in single precision. {NAN}",
        "{name}.{what}({x})",
        _with_infinity("-jnp.inf"),
        _lists,
        {"CONDUCTANCE": PYTHON_CONDUCTANCE.format(given=", law=LAW", passed=", law")},
    ),
    "matlab-law": Language(
        "law.m",
        "%",
        "MATLAB and Octave: law = {name}(); arrays of any shape. Outside the range: an error.",
        "law.{what}({x})",
        _with_infinity("-Inf"),
        _matrices,
        {"CONDUCTANCE": "\n    kept.conductance = @(c) {ratio}*kept.tangent(c);"},
    ),
    "modelica-law": Language(
        "law.mo",
        "//",
        "A Modelica package: p = {name}.pressure(c), with its derivative; where p is known a tool solves this for c. "
        "Outside the range an assertion fails.",
        "{name}.{what}({x})",
        _with_infinity("-1e300"),
        _braces,
        {
            "CONDUCTANCE": "\n  function conductance\n    input Real c;\n    output Real h;\n  algorithm\n"
            "    h := {ratio}*tangent(c);\n  end conductance;\n"
        },
    ),
    "abaqus-uinter": FORTRAN._replace(
        usage="*SURFACE INTERACTION, NAME=..., USER: abaqus job=... user={name}.f90. Place the bodies so that their "
        "surfaces touch where the mean planes are h_max apart. Beyond the law's range the increment is tried again "
        f"with a smaller step. Without friction. {READ} Arguments: Abaqus 2017, user subroutines, UINTER.",
        conductance=FORTRAN.conductance | {"FLUX": FLUX},
        subroutine="uinter.f90",
    ),
    "abaqus-gapcon": GAPCON._replace(
        usage="*GAP CONDUCTANCE, USER: abaqus job=... user={name}.f90, beside a table of pressures. A pressure beyond "
        f"the law's range stops the program. {READ} Arguments: Abaqus 6.5 to 2017, user subroutines, GAPCON.",
        parts=(("SOLVER", "Abaqus/Standard"), ("MORE", ""), ("DECLARED", "")),
    ),
    "calculix-gapcon": GAPCON._replace(
        usage="*GAP CONDUCTANCE, USER: in place of gapcon.f in the sources of CalculiX, which is then built anew. A "
        f"pressure beyond the law's range stops the program. {READ} Arguments: CalculiX 2.7 to 2.20, gapcon.f.",
        parts=(("SOLVER", "CalculiX"), ("MORE", ", &\n  area_"), ("DECLARED", ", area_")),
    ),
}
