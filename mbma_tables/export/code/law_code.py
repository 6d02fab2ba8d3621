"""A contact law as source code that needs nothing else.

It is the core's own C (`core_code`), or polynomials in a template a language (`polynomials`).
"""

import functools
import math
from typing import Any

from mbma_tables.common.errors import InputError
from mbma_tables.contacts.law import block as at
from mbma_tables.contacts.quantities.gas import VACUUM
from mbma_tables.effects.force_law import ForceLaw
from mbma_tables.export.code.language import FUNCTIONS, AskedLaw, Beside, Language
from mbma_tables.export.code.languages import LANGUAGES
from mbma_tables.export.exported_law import ExportedLaw, GasInGaps, exported_law
from mbma_tables.export.gas_law import gas_law
from mbma_tables.export.targets import CODE, Target
from mbma_tables.export.text import about, checked_name, filled, number, opening
from mbma_tables.surfaces.any_surface import AnySurface

# where none is given
NAME = "law"
# letters, as Fortran and C99 read them
MAX_NAME = 31


def law_text(
    target: str, surface: AnySurface | ForceLaw, E_star: float | str = 1.0, **asked: Any
) -> str:
    """A contact law as source code.

    It has pressure, tangent, area, energy and the overclosure at a pressure.

    Parameters
    ----------
    target : str
        One of `mbma_tables.export.LAWS`; a conductivity adds the function
        `solid_conductance`, a gas `gas_conductance` and `total_conductance`, kappa `tangential_stiffness`, of an unloading stiffness that with a hardness is not
        the law's own slope.
    surface, E_star, **asked
        As for `describe_law`: length_unit, stress_unit, variant, theory, hardness,
        conductivity, conductivity_unit, kappa. Or the force law of a rough sphere or
        cylinder (`RoughContact.law`) alone: its "pressure" is force.
    name : str
        What functions, modules or packages are called, or begin with; "law" by default.
    leakage : bool
        The function `leakage` as well, the flow coefficient K of the gaps [length^3], as
        `ContactLaw.leakage`.

    Returns
    -------
    str
        The text of one file; that of fortran-law calls the C of c-law by the same name.

    Raises
    ------
    InputError, OutOfRangeError
        As `describe_law`; for conductance and tangential stiffness with a hardness in
        Python and MATLAB, and for leakage of a target that is a user subroutine.

    Examples
    --------
    >>> from mbma_tables import Surface
    >>> road = Surface.named("concrete")
    >>> text = law_text("c-law", road, "13.3 MPa", name="road", theory="calibrated")
    >>> "double road_with_tangent(double c, double *tangent);" in text
    True
    >>> "size_t mbma_law_fill(" in text
    True
    """
    return law_files(target, surface, E_star, **asked)[""]


def law_files(
    target: str, surface: AnySurface | ForceLaw, E_star: float | str = 1.0, **asked: Any
) -> dict[str, str]:
    """The result of `law_text`, and the files beside it, by the ends of their names.

    These are ".h" of C, "_c.c" of Fortran.
    """
    if target not in LANGUAGES:
        raise InputError(f"target must be one of {tuple(LANGUAGES)}, got {target!r}")
    language = LANGUAGES[target]
    if language.subroutine and (asked.get("leakage") or isinstance(surface, ForceLaw)):
        raise InputError(
            f"{target} has no place for leakage, nor for the force of a body: leave it out"
        )
    if language.conductance_alone:
        # so that a missing conductivity is refused
        asked.setdefault("conductivity_unit", "")
    checked_name(asked.get("name", NAME), MAX_NAME, language.reserved(), target)
    law = asked_law(surface, E_star, **asked)
    files = {"": text_of(target, law)}
    for file in language.beside:
        files[file.end] = text_of(file.target or target, law, file)
    return files


def asked_law(
    surface: AnySurface | ForceLaw,
    E_star: float | str = 1.0,
    name: str = NAME,
    conductivity: float | None = None,
    conductivity_unit: str | None = None,
    kappa: float | None = None,
    leakage: bool = False,
    gas: GasInGaps | None = None,
    notes: tuple[str, ...] = (),
    **options: Any,
) -> AskedLaw:
    """The law for a requested file, made once; arguments as for `law_text`."""
    checked_name(name, MAX_NAME, FUNCTIONS, "a function of the law")
    conducts = conductivity is not None or conductivity_unit is not None
    if isinstance(surface, ForceLaw) and (conducts or leakage):
        raise InputError(
            "a force law has neither conductance nor leakage: leave conductivity and leakage "
            "out"
        )
    exported = exported_law(surface, E_star, **options)
    ratios: dict[str, float] = {}
    units: dict[str, str] = {}
    if conducts:
        ratios["solid_conductance"], units["solid_conductance"] = exported.slope(
            "solid_conductance", conductivity, conductivity_unit
        )
    if kappa is not None:
        ratios["tangential_stiffness"], units["tangential_stiffness"] = exported.slope(
            "tangential_stiffness", kappa=kappa
        )
    of_gas = None
    if conducts and gas is not None and gas.gas.name != VACUUM:
        of_gas = gas_law(exported, gas)
        for name_of_heat in ("gas_conductance", "total_conductance"):
            units[name_of_heat] = units["solid_conductance"]
        notes = (
            *notes,
            f"gas_conductance is within {of_gas.error:.1e} of the theory's, relative to it, "
            "or to that at first contact where that is larger",
        )
    if leakage:
        units["leakage"] = f"{exported.length}^3"
    # these functions follow the unloading stiffness
    sloped, factor = exported.law.unloading() if ratios else (exported.law, 1.0)
    slopes = {quantity: factor * ratio for quantity, ratio in ratios.items()}
    if conducts:
        notes = (
            *notes,
            *exported.of_gas(
                gas, units["solid_conductance"], exported.c_turn, included=False
            ),
        )
    said = exported.header(
        _contents(exported, units),
        _range(exported),
        _inverse_range(exported),
        *notes,
        end=exported.c_turn,
        leakage=leakage,
    )
    return AskedLaw(name, exported, slopes, sloped, units, said, of_gas)


def _contents(exported: ExportedLaw, units: dict[str, str]) -> str:
    """The line of a header on the functions of a law."""
    length = exported.length
    stress = exported.stress
    functions = [
        f"pressure [{stress}]",
        f"tangent dp/dc [{stress}/{length}]",
        "area A/A0",
        f"energy, the integral of pressure [{stress} {length}]",
        *(f"{quantity} [{unit}]" for quantity, unit in units.items()),
    ]
    return f"{', '.join(functions)}, against overclosure c [{length}]"


def _range(exported: ExportedLaw) -> str:
    """The line of a header on the range of overclosures."""
    begin = "no contact below c = 0"
    if not exported.ends:
        begin = f"c from {number(exported.c_least)}"
    return f"{begin}, to {number(exported.c_most)}; there is no answer outside"


def _inverse_range(exported: ExportedLaw) -> str:
    """The line of a header on the range of the inverse."""
    line = f"overclosure at a pressure: up to c = {number(exported.c_turn)}"
    if exported.law.turning_point is None:
        return line
    return f"{line}, where pressure turns down"


def text_of(target: str, asked: AskedLaw, file: Beside | None = None) -> str:
    """The text of a target's own file, or of one beside it."""
    language = LANGUAGES[target]
    if asked.yields and not language.unloads:
        raise InputError(
            f"{target} has no place for an unloading stiffness, which conductance and "
            "tangential stiffness of yielded contact follow: leave the hardness out, or take "
            "c-law, fortran-law, javascript-law, modelica-law or an FMU"
        )
    places = _common_places(language, asked)
    if file is not None:
        places |= file.parts
    places |= language.law_places(asked, places)
    if language.subroutine:
        routine = language.subroutine
        places["SUBROUTINE"] = filled(f"code/languages/{routine}.c", **places)
        # chooses the law by the name of the surface interaction
        places["DISPATCHER"] = filled(
            "code/languages/interfaces.c",
            **places,
            ROUTINE=routine,
            LISTS=routine.upper(),
        )
    template = language.template
    if file is not None and file.template:
        template = file.template
    repeated = language.repeated or language.ratios
    return filled(template, each=repeated(asked), **places)


def _common_places(language: Language, asked: AskedLaw) -> dict[str, str]:
    """Places of templates that are the same in all languages, but for the form of numbers."""
    exported = asked.exported
    law = exported.law
    # as solvers read the name of a surface interaction
    interface = asked.name.upper()
    # the lines of the law may have braces of their own
    said = [line.replace("{", "{{").replace("}", "}}") for line in asked.said]
    paragraphs = [*said, language.usage, _example(exported, language)]
    lines = [line.format(name=asked.name, interface=interface) for line in paragraphs]
    # where pressure is defined first: at contact, or at the law's largest gap
    first = 0.0 if exported.ends else (law.h_max - law.highest) / 2
    return {
        "HEADER": opening(lines, language.mark),
        "NAME": asked.name,
        "SUBROUTINE": "",
        "INTERFACE": interface,
        "LENGTH": exported.length,
        "STRESS": exported.stress,
        "H_MAX": language.number(law.h_max),
        "FIRST": language.number(first),
        "C_TURN": language.number(exported.c_turn),
        "C_LEAST": language.number(exported.c_least),
        "C_MOST": language.number(exported.c_most),
        "CONDUCTANCE": language.ratios(asked).get("solid_conductance", ""),
        **_of_gas(language, asked),
        "LEAKAGE": asked.more.get("leakage", ""),
        "CLOSED": _where_blocked(language, asked),
        "ELASTIC": "yes" if asked.yields else "",
        "SLOPED": "ELASTIC" if asked.yields else "LAW",
        **language.parts,
    }


def _of_gas(language: Language, asked: AskedLaw) -> dict[str, str]:
    """Places of the conductance of a gas; SOLID is there where solid spots alone conduct."""
    conducts = "solid_conductance" in asked.slopes
    if asked.gas is None:
        return {"GAS": "", "SOLID": "yes" if conducts else ""}
    return {
        "GAS": "yes",
        "SOLID": "",
        "GAS_OFFSET": language.number(asked.gas.offset),
        "GAS_FAR": language.number(asked.gas.far),
        "GAS_JUMP": language.number(asked.gas.jump),
        "GAS_TOP": language.number(float(asked.gas.block[at.HIGHEST])),
    }


def _where_blocked(language: Language, asked: AskedLaw) -> str:
    """The flow where contact blocks it at c: none, or not known of contact that yields."""
    if "leakage" not in asked.more or asked.exported.unknown_from == math.inf:
        return language.none
    return language.unknown.format(language.number(asked.exported.unknown_from))


def _example(exported: ExportedLaw, language: Language) -> str:
    """One line with values of the library's law."""
    c = float(f"{exported.c_turn / 4:.3g}")
    p, tangent = exported.law.pressure_and_stiffness(exported.law.h_max - c)
    calls = [
        _call(language, "pressure", c, float(p)),
        _call(language, "tangent", c, float(tangent)),
    ]
    if language.inverts:
        calls.append(_call(language, "overclosure", float(p), c))
    return f"Example: {', '.join(calls)}"


def _call(language: Language, what: str, x: float, y: float) -> str:
    """A function at a rounded argument, and its value; {name} is filled in later."""
    rounded_x = language.number(float(f"{x:.7g}"))
    call = language.call.format(name="{name}", what=what, x=rounded_x)
    return f"{call} = {about(y, 7)}"


def _target(name: str, language: Language) -> Target:
    return Target(
        name,
        functools.partial(law_files, name),
        CODE - {"leakage"} if language.subroutine else CODE,
        rows=False,
        alone=language.alone,
        beside=tuple(file.end for file in language.beside),
    )


TARGETS = tuple(_target(name, language) for name, language in LANGUAGES.items())
