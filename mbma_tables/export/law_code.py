"""A contact law as source code that needs nothing else: the core's own C, or `law_numbers` in a template a language."""

import base64
import functools
import re
import zlib
from typing import Any, NamedTuple

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.export.exported_law import ExportedLaw, GasInGaps, exported_law
from mbma_tables.export.law_languages import (
    FUNCTIONS,
    LANGUAGES,
    MORE,
    Beside,
    Language,
    flow_numbers,
    law_numbers,
)
from mbma_tables.export.targets import CODE, Target
from mbma_tables.export.text import (
    about,
    braces,
    checked_name,
    core_file,
    filled,
    number,
    numerals,
    opening,
    page_file,
    template,
    wrapped,
)
from mbma_tables.law import block as at
from mbma_tables.law.law import ContactLaw
from mbma_tables.rough_body.force_law import ForceLaw
from mbma_tables.surfaces.any_surface import AnySurface

LAW_MODULE = "law.wasm"  # the core's laws for JavaScript
# without functions that follow the unloading stiffness of contact that yields
LOADING_ALONE = ("python-law", "jax-law", "matlab-law")
NAME = "law"  # where none is given
MAX_NAME = 31  # letters, as Fortran and C99 read them
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
MODELICA_NAMES = r"\b(?<!type )(\w+)(?:\[[^]]*\])? = [-\d{]|function (\w+)"
# functions that other files see, where they are made
_MADE = re.compile(
    r"^(?!static|typedef|MBMA_INLINE)\w[\w *]*\b(mbma_\w+)\([^{;]*\{$", re.M
)


def law_text(
    target: str, surface: AnySurface | ForceLaw, E_star: float | str = 1.0, **asked: Any
) -> str:
    """A contact law as source code: pressure, tangent, area, energy and the overclosure at a pressure.

    Parameters
    ----------
    target : str
        One of `mbma_tables.export.LAWS`; a conductivity adds the function `conductance`,
        kappa `tangential_stiffness`, of an unloading stiffness that with a hardness is not
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
    >>> text = law_text("c-law", Surface.named("concrete"), "13.3 MPa", name="road", theory="calibrated")
    >>> "double road_with_tangent(double c, double *tangent);" in text, "size_t mbma_law_fill(" in text
    (True, True)
    """
    return law_files(target, surface, E_star, **asked)[""]


def law_files(
    target: str, surface: AnySurface | ForceLaw, E_star: float | str = 1.0, **asked: Any
) -> dict[str, str]:
    """The result of `law_text`, and the files beside it, by the ends of their names: ".h" of C, "_c.c" of Fortran."""
    if target not in LANGUAGES:
        raise InputError(f"target must be one of {tuple(LANGUAGES)}, got {target!r}")
    language = LANGUAGES[target]
    if language.subroutine and (asked.get("leakage") or isinstance(surface, ForceLaw)):
        raise InputError(
            f"{target} has no place for leakage, nor for the force of a body: leave it out"
        )
    if language.subroutine == "gapcon.c":  # which is of conductance alone
        asked.setdefault("conductivity_unit", "")
    checked_name(asked.get("name", NAME), MAX_NAME, language.reserved(), target)
    made = asked_law(surface, E_star, **asked)
    files = {"": text_of(target, made)}
    for file in language.beside:
        files[file.end] = text_of(file.target or target, made, file)
    return files


class AskedLaw(NamedTuple):
    """A law and the contents common to its files."""

    name: str  # prefix of functions, or name of the module or package
    exported: ExportedLaw
    slopes: dict[str, float]  # ratios of functions to the slope of a law,
    sloped: ContactLaw  # of the contact without a hardness
    more: dict[str, str]  # units of the requested quantities of `MORE`
    said: tuple[str, ...]


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
            "a force law has neither conductance nor leakage: leave conductivity and leakage out"
        )
    exported = exported_law(surface, E_star, **options)
    length, stress, law = exported.length, exported.stress, exported.law
    slopes, more = {}, {}
    for quantity, wanted in (
        ("conductance", conducts),
        ("tangential_stiffness", kappa is not None),
    ):
        if wanted:
            slopes[quantity], more[quantity] = exported.slope(
                quantity, conductivity, conductivity_unit, kappa
            )
    if leakage:
        more["leakage"] = f"{length}^3"
    sloped, factor = law.unloading() if slopes else (law, 1.0)
    what = f"pressure [{stress}], tangent dp/dc [{stress}/{length}], area A/A0, energy, the integral of pressure "
    what += f"[{stress} {length}]{''.join(f', {quantity} [{unit}]' for quantity, unit in more.items())}"
    begin = (
        "no contact below c = 0"
        if exported.ends
        else f"c from {number(exported.c_least)}"
    )
    turns = "" if law.turning_point is None else ", where pressure turns down"
    if conducts:
        notes += exported.of_gas(
            gas, more["conductance"], exported.c_turn, included=False
        )
    said = exported.header(
        f"{what}, against overclosure c [{length}]",
        f"{begin}, to {number(exported.c_most)}; there is no answer outside",
        f"overclosure at a pressure: up to c = {number(exported.c_turn)}{turns}",
        *notes,
        end=exported.c_turn,
        leakage=leakage,
    )
    slopes = {quantity: factor * ratio for quantity, ratio in slopes.items()}
    return AskedLaw(name, exported, slopes, sloped, more, said)


def text_of(target: str, asked: AskedLaw, file: Beside | None = None) -> str:
    """The text of a target's own file, or of one beside it."""
    language, name, exported = LANGUAGES[target], asked.name, asked.exported
    yields, nested = asked.sloped is not exported.law, target == "modelica-law"
    if yields and language.array is not None and not nested:
        raise InputError(
            f"{target} has no place for an unloading stiffness, which conductance and tangential stiffness of yielded "
            "contact follow: leave the hardness out, or take c-law, fortran-law, javascript-law, modelica-law or an FMU"
        )
    said = (line.replace("{", "{{").replace("}", "}}") for line in asked.said)
    lines = [*said, language.usage, _example(exported, language)]
    interface = name.upper()  # as solvers read the name of a surface interaction
    first = 0.0 if exported.ends else (exported.law.h_max - exported.law.highest) / 2
    numbers = {"H_MAX": exported.law.h_max, "FIRST": first, "C_TURN": exported.c_turn}
    numbers |= {"C_LEAST": exported.c_least, "C_MOST": exported.c_most}
    each = {what: language.number(ratio) for what, ratio in asked.slopes.items()}
    parts = {
        "HEADER": opening(
            (line.format(name=name, interface=interface) for line in lines), language.mark
        ),
        "NAME": name,
        "SUBROUTINE": "",
        "INTERFACE": interface,
        "LENGTH": exported.length,
        "STRESS": exported.stress,
        "ELASTIC": "yes" if yields else "",
        "LEAKAGE": asked.more.get("leakage", ""),
        "CONDUCTANCE": each.get("conductance", ""),
        "SLOPED": "ELASTIC" if yields else "LAW",
        **{place: language.number(value) for place, value in numbers.items()},
        **dict(language.parts),
        **dict(file.parts if file else ()),
    }
    template_name = file.template if file and file.template else language.template
    if target == "fortran-law":  # all functions are alike, but for the one of two answers
        public = [what for what in FUNCTIONS if what in asked.more or what not in MORE]
        parts["PUBLIC"], each = ", ".join(public), dict.fromkeys(public, "")
        del each["with_tangent"]
    elif language.array is None:
        parts |= _core(target, asked)
    else:
        parts |= _numbers(language, "", law_numbers(exported.law))
        if parts["LEAKAGE"]:
            parts |= _numbers(language, "flow_", flow_numbers(exported.leakage))
        if nested:
            parts["SLOPED"] = "elastic.elastic_tangent" if yields else "tangent"
        if yields:
            own = (
                parts
                | _numbers(language, "", law_numbers(asked.sloped))
                | {"NAME": "elastic", "HEADER": ""}
            )
            text = filled(
                language.template, **own | {"LEAKAGE": "", "ELASTIC": ""}
            ).strip()
            # some tools confuse names of a package with those of one in it
            names = "|".join(
                constant or function
                for constant, function in re.findall(MODELICA_NAMES, text)
            )
            parts["ELASTIC"] = re.sub(rf"\b({names})\b", r"elastic_\1", text)
    if language.subroutine:
        parts["SUBROUTINE"] = filled(language.subroutine, **parts)
        routine = language.subroutine.removesuffix(".c")
        parts["DISPATCHER"] = filled(
            "interfaces.c", **parts, ROUTINE=routine, LISTS=routine.upper()
        )
    return filled(template_name, each, **parts)


def _numbers(language: Language, prefix: str, numbers: dict[str, Any]) -> dict[str, str]:
    """Numbers of a law by their placeholders."""
    write: dict[type, Any] = {
        int: str,
        float: language.number,
        np.ndarray: language.array,
    }
    texts = {
        what: write[float if isinstance(value, float) else type(value)](value)
        for what, value in numbers.items()
    }
    return {
        f"{prefix}{what}".upper(): text
        for what, text in (texts | {"records": str(len(numbers["centre"]))}).items()
    }


def _core(target: str, asked: AskedLaw) -> dict[str, str]:
    """The core, as C or compiled, and the law's own blocks."""
    law, leaks, name, parts = (
        asked.exported.law,
        asked.more.get("leakage", ""),
        asked.name,
        dict[str, str](),
    )
    blocks = {"LAW": law.block} | (
        {"ELASTIC": asked.sloped.block} if asked.sloped is not law else {}
    )
    if leaks:
        blocks["FLOW"], parts["FLOW_H_RMS"] = (
            asked.exported.leakage.block,
            number(asked.exported.leakage.h_rms),
        )
    if target == "javascript-law":
        held = {"WASM": page_file(LAW_MODULE)}
        held |= {
            f"{own}_BLOCK": block.astype("<f8", copy=False).tobytes()
            for own, block in blocks.items()
        }
        return parts | {
            place: base64.b64encode(content).decode("ascii")
            for place, content in held.items()
        }
    return parts | {
        "CORE": core_text(name),
        "CODE": _code_mark(),
        "DECLARED": filled(
            "law.h", dict.fromkeys(asked.slopes, ""), HEADER="", NAME=name, LEAKAGE=leaks
        ).lstrip(),
        "LAWS": "".join(
            _data(f"{name}_{own}", block) for own, block in blocks.items()
        ).rstrip(),
    }


def _example(exported: ExportedLaw, language: Language) -> str:
    """One line with values of the library's law; Modelica solves for c itself."""
    c = float(f"{exported.c_turn / 4:.3g}")
    p, k = (
        float(value)
        for value in exported.law.pressure_and_stiffness(exported.law.h_max - c)
    )
    answers = {"pressure": (c, p), "tangent": (c, k)} | (
        {"overclosure": (p, c)} if language.template != "law.mo" else {}
    )
    calls = []
    for what, (x, y) in answers.items():
        rounded_x = language.number(float(f"{x:.7g}"))
        calls.append(
            f"{language.call.format(name='{name}', what=what, x=rounded_x)} = {about(y, 7)}"
        )
    return f"Example: {', '.join(calls)}"


def core_text(prefix: str) -> str:
    """Laws of the core with their headers; a prefix to the functions lets a program hold several."""
    texts = [core_file(name) for name in ("mbma.h", "elementary.h", "law.c")]
    renamed = [
        f"#define {name} {prefix}_{name}"
        for text in texts
        for name in _MADE.findall(text)
    ]
    parts = [re.sub(r'^#include ".*"\n', "", text, flags=re.M) for text in texts]
    return "\n".join(
        [
            "/* functions of the core, which this file holds, under names of its own */",
            *renamed,
            *parts,
        ]
    )


@functools.cache
def _code_mark() -> str:
    """A number in C of all code that laws in one file share: laws of different code are refused there."""
    shared = [
        core_text(""),
        *map(template, ("law.c", "interfaces.c", "uinter.c", "gapcon.c")),
    ]
    return f"0x{zlib.crc32(''.join(shared).encode()):08x}"


def _data(name: str, block: FloatArray) -> str:
    """A law's block as the head, rows and records of a variable in C, every number as it is."""
    whole = block.view(np.int64)
    last = int(whole[at.RECORDS])
    records = [
        braces(
            *numerals(row[: at.FORCE_AT]),
            *np.split(row[at.FORCE_AT : -1], 2),
            *numerals(row[-1]),
        )
        for row in block[last:].reshape(-1, at.RECORD)
    ]
    head = braces(
        *numerals(block[: at.EXPONENT]), *numerals(whole[at.EXPONENT : at.HEAD])
    )
    rows = whole[at.HEAD : last].reshape(-1, 2)
    data = ",\n".join(wrapped(part) for part in (head, braces(*rows), braces(*records)))
    return DATA.format(name=name, data=data, rows=len(rows), records=len(records))


TARGETS = tuple(
    Target(
        name,
        functools.partial(law_files, name),
        CODE - {"leakage"} if language.subroutine else CODE,
        rows=False,
        # the C that the module calls is beside it
        alone=name != "fortran-law",
    )
    for name, language in LANGUAGES.items()
)
