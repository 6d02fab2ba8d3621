"""A contact law as source code that needs nothing else.

It is the core's own C (`core_code`), or polynomials in a template a language (`polynomials`).
"""

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mbma_tables.bodies.bodies import Bodies
from mbma_tables.common.arguments import one_number
from mbma_tables.common.errors import InputError
from mbma_tables.contacts.law.law import ContactLaw
from mbma_tables.contacts.quantities.gas import VACUUM
from mbma_tables.contacts.quantities.registry import law_functions, registry
from mbma_tables.contacts.quantities.tangential import checked_friction
from mbma_tables.effects.force_law import ForceLaw
from mbma_tables.export.code.functions import Functions
from mbma_tables.export.code.language import (
    FOLDER,
    FUNCTIONS,
    AskedLaw,
    Beside,
    Function,
    Language,
    evaluator,
)
from mbma_tables.export.code.languages import LANGUAGES
from mbma_tables.export.code.polynomials import curve_numbers, law_numbers
from mbma_tables.export.exported_law import (
    ExportedLaw,
    GasInGaps,
    exported_law,
    with_conductivity,
)
from mbma_tables.export.targets import (
    LAW,
    QuantityOptions,
    Target,
    names_of,
    require_quantity,
)
from mbma_tables.export.text import about, checked_name, filled, inert, number, opening
from mbma_tables.surfaces.any_surface import AnySurface

# where none is given
NAME = "law"
# options of a law as code
CODE = LAW | names_of(QuantityOptions) | {"name"}
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
    friction : float, optional
        Coefficient of friction, for "abaqus-uinter" alone, with kappa.
    name : str
        What functions, modules or packages are called, or begin with; "law" by default.
    quantity : str or sequence of str, optional
        Further quantities of a contact by name, each a function: whatever the registry has
        that is positive, or negative, from first contact on. What they need is in `E_star`,
        which may be `Bodies`, and in `conductivity`.
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
        As `describe_law`; for leakage and other quantities of a target that is a user
        subroutine, and for quantities that are zero or not known at light contact.

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
    more = asked.get("leakage") or asked.get("quantity") or isinstance(surface, ForceLaw)
    if language.subroutine and more:
        raise InputError(
            f"{target} has no place for leakage or other quantities, nor for the force of a "
            "body: leave it out"
        )
    if language.friction is None and asked.get("friction") is not None:
        raise InputError(
            f"{target} has no place for friction, which the solver has: leave it out"
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
    E_star: float | str | Bodies = 1.0,
    name: str = NAME,
    conductivity: float | None = None,
    conductivity_unit: str | None = None,
    kappa: float | None = None,
    friction: float | None = None,
    leakage: bool = False,
    gas: GasInGaps | None = None,
    quantity: str | Sequence[str] | None = None,
    notes: tuple[str, ...] = (),
    **options: Any,
) -> AskedLaw:
    """The law for a requested file, made once; arguments as for `law_text`."""
    checked_name(name, MAX_NAME, {*FUNCTIONS, *registry()}, "a function of the law")
    conducts = conductivity is not None or conductivity_unit is not None
    wanted = _names(quantity)
    if isinstance(surface, ForceLaw) and (conducts or leakage or wanted):
        raise InputError(
            "a force law has neither conductance nor leakage, nor other quantities: leave "
            "conductivity, leakage and quantity out"
        )
    bodies = E_star
    if wanted and conductivity is not None and not isinstance(E_star, Bodies):
        # quantities need it as that of the bodies
        hardness = options.get("hardness", math.inf)
        bodies = with_conductivity(E_star, hardness, conductivity, conductivity_unit)
    if friction is not None:
        one_number("friction", friction)
        checked_friction(friction)
    if friction is not None and kappa is None:
        raise InputError(
            "friction needs kappa, the normal over the tangential stiffness before slip"
        )
    exported = exported_law(surface, bodies, **options)
    parts = Functions(exported)
    if conducts:
        parts.add_ratio(
            "solid_conductance",
            *exported.slope("solid_conductance", conductivity, conductivity_unit),
        )
    if kappa is not None:
        parts.add_ratio(
            "tangential_stiffness", *exported.slope("tangential_stiffness", kappa=kappa)
        )
    if conducts and gas is not None and gas.gas.name != VACUUM:
        parts.add_gas(gas)
    if leakage or "leakage" in wanted:
        parts.add_flow()
    for one in wanted:
        parts.add(one)
    notes = (*notes, *parts.notes())
    if conducts:
        unit = parts.functions["solid_conductance"].unit
        notes = (*notes, *exported.of_gas(gas, unit, exported.c_turn, included=False))
    said = exported.header(
        _contents(exported, parts.functions),
        _range(exported),
        _inverse_range(exported),
        *notes,
        end=exported.c_turn,
        leakage="leakage" in parts.functions,
    )
    return AskedLaw(
        name, exported, parts.laws, parts.functions, parts.curves, said, friction
    )


def _names(quantity: str | Sequence[str] | None) -> list[str]:
    """Names of the quantities that are wanted, each a function that not every law has."""
    if quantity is None:
        return []
    names = [quantity] if isinstance(quantity, str) else list(quantity)
    for name in names:
        require_quantity(name)
    return [name for name in dict.fromkeys(names) if name not in FUNCTIONS]


def _contents(exported: ExportedLaw, more: Mapping[str, Function]) -> str:
    """The line of a header on the functions of a law."""
    length = exported.length
    stress = exported.stress
    functions = [
        f"pressure [{stress}]",
        f"tangent dp/dc [{stress}/{length}]",
        "area A/A0",
        f"energy, the integral of pressure [{stress} {length}]",
        *(f"{name} [{function.unit}]" for name, function in more.items()),
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
    pieces = _pieces(language, asked)
    functions = []
    for name, function in asked.functions.items():
        functions.append(_function(language, name, function, pieces))
    # as solvers read the name of a surface interaction
    interface = asked.name.upper()
    conductance = "total_conductance"
    if conductance not in asked.functions:
        conductance = (
            "solid_conductance" if "solid_conductance" in asked.functions else ""
        )
    places = {
        "name": asked.name,
        "header": _header(language, asked, interface),
        "length": asked.exported.length,
        "stress": asked.exported.stress,
        "evaluator": evaluator(language.evaluator) if language.evaluator else "",
        "laws": list(asked.laws),
        "law": pieces["law"]["plain"],
        "pieces": pieces,
        "of_laws": [each.law_function for each in law_functions().values()],
        "functions": functions,
        "conductance": conductance,
        "friction": "" if asked.friction is None else language.number(asked.friction),
        "subroutine": language.subroutine,
        "interface": interface,
        **language.parts,
        **language.places(asked),
    }
    template = language.template
    if file is not None:
        places |= file.parts
        template = file.template or template
    return filled(f"{FOLDER}/{template}", **places)


def _header(language: Language, asked: AskedLaw, interface: str) -> str:
    """The opening comments of a file."""
    # the lines of the law may have braces of their own
    said = [line.replace("{", "{{").replace("}", "}}") for line in asked.said]
    paragraphs = [*said, language.usage, _example(asked.exported, language)]
    friction = ""
    if language.friction is not None:
        friction = language.friction[asked.friction is not None]
    places = {"name": asked.name, "interface": interface, "friction": friction}
    lines = [line.format_map(places) for line in paragraphs]
    return opening(lines, language.mark)


def _pieces(language: Language, asked: AskedLaw) -> dict[str, Any]:
    """Numbers of all laws and curves as a language has them, those of polynomials where it evaluates them itself."""
    pieces: dict[str, Any] = {}
    evaluates = language.array is not None
    for name, law in asked.laws.items():
        numbers = _range_numbers(asked.exported, law)
        pieces[name] = _written(
            language, numbers | (law_numbers(law) if evaluates else {})
        )
    # a language without an evaluator calls another one
    for name, curve in asked.curves.items() if language.evaluator else ():
        plain: dict[str, Any] = dataclasses.asdict(curve)
        del plain["block"], plain["error"]
        plain["from_contact"] = curve.from_contact
        numbers = plain | (
            curve_numbers(curve, asked.exported.law.h_max) if evaluates else {}
        )
        pieces[f"{name}_curve"] = _written(language, numbers) | {"curve": curve}
    return pieces


def _range_numbers(exported: ExportedLaw, law: ContactLaw) -> dict[str, Any]:
    """The range of a law, and where its pressure begins and turns down."""
    own = dataclasses.replace(exported, law=law)
    return {
        "h_max": law.h_max,
        "ends": own.ends,
        # where pressure is defined first: at contact, or at the law's largest gap
        "first": 0.0 if own.ends else (law.h_max - law.highest) / 2,
        "c_turn": own.c_turn,
        "c_least": own.c_least,
        "c_most": own.c_most,
        "length": own.length,
        "stress": own.stress,
    }


def _written(language: Language, numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers and arrays as a language writes them, and how many records there are."""
    plain = {}
    arrays = {}
    records = 0
    for name, value in numbers.items():
        if isinstance(value, np.ndarray):
            assert language.array is not None
            arrays[name] = language.array(value)
            records = max(records, len(value))
        elif isinstance(value, bool):
            plain[name] = language.booleans[value]
        elif isinstance(value, float):
            plain[name] = language.number(value)
        elif isinstance(value, str):
            plain[name] = f"'{value}'"
        else:
            plain[name] = str(value)
    return {"plain": plain, "arrays": arrays, "records": records}


def _function(
    language: Language, name: str, function: Function, pieces: Mapping[str, Any]
) -> dict[str, Any]:
    """A function as templates have it."""
    curve = None
    if function.curve:
        numbers = pieces.get(f"{function.curve}_curve", {"plain": {}})
        curve = {"name": function.curve} | numbers["plain"]
    return {
        "name": name,
        "meaning": inert(function.meaning),
        "law": function.law if function.ratio else "",
        "ratio": language.number(function.ratio),
        "curve": curve,
    }


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
    takes = CODE
    if language.subroutine:
        takes = CODE - names_of(QuantityOptions)
    if language.friction is not None:
        takes |= {"friction"}
    return Target(
        name,
        functools.partial(law_files, name),
        takes,
        QuantityOptions,
        rows=False,
        alone=language.alone,
        beside=tuple(file.end for file in language.beside),
        output=language.output,
        outside=language.outside,
        tested=language.tested,
    )


TARGETS = tuple(_target(name, language) for name, language in LANGUAGES.items())
