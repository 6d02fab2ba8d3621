"""A contact law as a Functional Mock-up Unit, FMI 2.0 or 3.0, model exchange and co-simulation: C and binaries."""

import contextlib
import dataclasses
import functools
import importlib.util
import io
import platform
import re
import shutil
import sys
import uuid
import zipfile
from collections.abc import Mapping
from dataclasses import field
from typing import Any
from xml.etree import ElementTree as ET

from mbma_tables import __version__
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import factor
from mbma_tables.contacts.quantities import registry
from mbma_tables.export.code.language import AskedLaw
from mbma_tables.export.code.law_code import CODE, MAX_NAME, asked_law, text_of
from mbma_tables.export.exported_law import ExportedLaw
from mbma_tables.export.model.c_code import BuildError, built_by
from mbma_tables.export.reserved_words import windows_words
from mbma_tables.export.targets import QuantityOptions, Target, option
from mbma_tables.export.text import checked_name, filled, inert, number
from mbma_tables.surfaces.any_surface import AnySurface

GLIBC = "2.17"  # of Linux distributions from 2014 on
# by zig's names of platforms: folders and ends of libraries, in FMI 2.0, which has none of
# ARM, and in FMI 3.0
PLATFORMS = {
    2: {
        f"x86_64-linux-gnu.{GLIBC}": ("linux64", ".so"),
        "x86_64-macos.10.13": ("darwin64", ".dylib"),
        "x86_64-windows-gnu": ("win64", ".dll"),
    },
    3: {
        f"x86_64-linux-gnu.{GLIBC}": ("x86_64-linux", ".so"),
        f"aarch64-linux-gnu.{GLIBC}": ("aarch64-linux", ".so"),
        "x86_64-macos.10.13": ("x86_64-darwin", ".dylib"),
        "aarch64-macos.11.0": ("aarch64-darwin", ".dylib"),
        "x86_64-windows-gnu": ("x86_64-windows", ".dll"),
        "aarch64-windows-gnu": ("aarch64-windows", ".dll"),
    },
}
# by names of the machine and its system
MACHINES = {
    "x86_64 linux": "x86_64-linux-",
    "aarch64 linux": "aarch64-linux-",
    "x86_64 darwin": "x86_64-macos",
    "arm64 darwin": "aarch64-macos",
    "amd64 win32": "x86_64-windows",
    "arm64 win32": "aarch64-windows",
}
BINARIES = ("here", "all", "none")
INPUT = 1  # value reference of overclosure, after time


@dataclasses.dataclass(frozen=True, kw_only=True)
class FmuOptions(QuantityOptions):
    """Options of an FMU."""

    binaries: Any = field(
        default=None,
        metadata=option(
            "In an FMU: for this platform, for all by zig, or none.", "|".join(BINARIES)
        ),
    )


def fmu(
    surface: AnySurface,
    E_star: float | str,
    *,
    name: str = "law",
    binaries: str = "here",
    fmi: int = 2,
    **asked: Any,
) -> bytes:
    """A contact law as an FMU of FMI 2.0 or 3.0: overclosure in; pressure, tangent, area and energy out.

    Parameters
    ----------
    surface, E_star, name, **asked
        As for `law_text`; a conductivity adds the output solid_conductance, leakage the output leakage.
    binaries : {"here", "all", "none"}
        Beside the sources: a binary for this platform, by the system's C compiler or zig,
        where one of them is installed; binaries for Linux, macOS and Windows on x86-64, by
        zig (the extra "fmu"); or none. FMI 3.0 has those for ARM as well; FMI 2.0 names no
        folder for ARM, where the importing tool compiles the sources.
    fmi : int
        2 or 3, the version of the standard.

    Returns
    -------
    bytes
        The file, the same for the same law and compiler; its description lists the binaries, and the
        C library that those for Linux need.

    Raises
    ------
    InputError, OutOfRangeError
        As `law_text`.

    Examples
    --------
    >>> import io, zipfile
    >>> from mbma_tables import Surface
    >>> file = fmu(Surface.named("concrete"), "13.3 MPa", name="road", theory="calibrated", binaries="none")
    >>> zipfile.ZipFile(io.BytesIO(file)).namelist()
    ['modelDescription.xml', 'sources/road.c']
    """
    checked_name(
        name, MAX_NAME, windows_words(), "Windows, where its files are named so,"
    )
    found = asked_law(surface, E_star, name, **asked)
    law = text_of("c-law", found)
    exported = found.exported
    variables = _variables(found)
    token = f"{{{uuid.uuid5(uuid.NAMESPACE_URL, law)}}}"
    parts = {
        "LAW": law,
        "NAME": name,
        "TOKEN": token,
        "START": variables[1]["start"],
        "of_laws": [each.law_function for each in registry.law_functions().values()],
        "functions": list(found.functions),
        "references": [variable["name"] for variable in variables],
        "LEAST": number(exported.c_least, infinity="INFINITY"),
        "MOST": number(exported.c_most),
    }
    source = filled("code/fmu.c" if fmi == 2 else "code/fmu3.c", **parts)
    built = _binaries(name, source, binaries, PLATFORMS[fmi])
    listed = (
        ", ".join(map(_platform, built, built.values()))
        or "none, sources only: the importing tool compiles them"
    )
    if binaries == "all" and fmi == 2:
        listed += " (x86-64); on ARM the importing tool compiles the sources"
    said = "\n".join(map(inert, (*found.said, f"binaries: {listed}")))
    describe = _description if fmi == 2 else _description_of_fmi3
    files = {
        "modelDescription.xml": describe(name, token, said, variables, exported),
        f"sources/{name}.c": source.encode(),
    }
    if fmi == 3:
        files["sources/buildDescription.xml"] = _build_description(name)
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for path, content in (files | built).items():
            # without the time of writing: the same law is the same file
            archive.writestr(zipfile.ZipInfo(path), content, zipfile.ZIP_DEFLATED)
    return stream.getvalue()


def _platform(path: str, binary: bytes) -> str:
    """A binary's folder, and of Linux the C library that it needs, by the versions of its symbols."""
    folder = path.split("/")[1]
    versions = []
    for major, minor in re.findall(rb"GLIBC_(\d+)\.(\d+)", binary):
        versions.append((int(major), int(minor)))
    if not versions:
        return folder
    major_needed, minor_needed = max(versions)
    return f"{folder} (glibc {major_needed}.{minor_needed} and later)"


def _binaries(
    name: str, source: str, asked: str, platforms: Mapping[str, tuple[str, str]]
) -> dict[str, bytes]:
    """Shared libraries by their paths in the file, for the platforms asked for, as far as there is a compiler."""
    if asked not in BINARIES:
        raise InputError(f"binaries must be one of {BINARIES}, got {asked!r}")
    zig = importlib.util.find_spec("ziglang")
    system = f"{platform.machine()} {sys.platform}".lower()
    if asked == "all" and zig is None:
        raise InputError(
            "binaries for all platforms are compiled by ziglang: pip install ziglang"
        )
    here = MACHINES.get(system)
    found = {}
    for target, (folder, end) in platforms.items():
        is_here = here is not None and target.startswith(here)
        # a file for all platforms is for others' machines, whose C library may be older
        # than that of this one
        own_cc = asked == "here" and is_here and shutil.which("cc")
        if not (own_cc or zig) or asked == "none" or (asked == "here" and not is_here):
            continue
        command = (
            ["cc"]
            if own_cc
            else [sys.executable, "-m", "ziglang", "cc", "-target", target, "-s"]
        )
        command += [
            "-w",
            "-O2",
            "-shared",
            "-DMBMA_WITHOUT_HEADERS",
            *([] if end == ".dll" else ["-fPIC"]),
        ]
        with contextlib.suppress(*([BuildError] if asked == "here" else [])):
            found[f"binaries/{folder}/{name}{end}"] = built_by(
                command, {f"{name}.c": source}, f"{name}{end}", "-lm"
            )
    return found


def _variables(found: AskedLaw) -> list[dict[str, str]]:
    """XML attributes of each variable, by value reference."""
    exported = found.exported
    asked = {
        "start": number(exported.begin),
        "max": number(exported.c_most),
    }
    asked |= {} if exported.ends else {"min": number(exported.c_least)}
    outputs = {}
    for name, declared in registry.law_functions().items():
        assert declared.law_function is not None
        meaning = declared.law_function.meaning or declared.meaning
        outputs[name] = (exported.unit_of(declared), meaning)
    for name, function in found.functions.items():
        outputs[name] = (function.unit, function.meaning)
    said = "h_max less the mean separation"
    return [
        {"name": "time", "causality": "independent", "unit": "s"},
        {
            "name": "overclosure",
            "causality": "input",
            "unit": exported.length,
            "description": said,
            **asked,
        },
        *(
            {"name": n, "causality": "output", "unit": u, "description": said}
            for n, (u, said) in outputs.items()
        ),
    ]


def _description(
    name: str,
    token: str,
    text: str,
    variables: list[dict[str, str]],
    exported: ExportedLaw,
) -> bytes:
    """modelDescription.xml of FMI 2.0."""
    facts = {"fmiVersion": "2.0", "modelName": name, "guid": token, "description": text}
    facts |= {
        "generationTool": f"mbma_tables {__version__}",
        "variableNamingConvention": "flat",
    }
    root = ET.Element("fmiModelDescription", facts)
    provides = {"modelIdentifier": name, "providesDirectionalDerivative": "true"}
    for kind, more in (
        ("ModelExchange", {}),
        ("CoSimulation", {"canHandleVariableCommunicationStepSize": "true"}),
    ):
        interface = ET.SubElement(root, kind, provides | more)
        ET.SubElement(
            ET.SubElement(interface, "SourceFiles"), "File", {"name": f"{name}.c"}
        )
    _add_units(root, variables, exported)
    _add_log_categories(root)
    listed = ET.SubElement(root, "ModelVariables")
    structure = ET.SubElement(root, "ModelStructure")
    of_real = ("unit", "start", "min", "max")
    for reference, all_of in enumerate(variables):
        outer = {"valueReference": str(reference), "variability": "continuous"}
        outer |= {key: value for key, value in all_of.items() if key not in of_real}
        inner = {key: all_of[key] for key in of_real if key in all_of}
        ET.SubElement(ET.SubElement(listed, "ScalarVariable", outer), "Real", inner)
    for kind in ("Outputs", "InitialUnknowns"):
        parent = ET.SubElement(structure, kind)
        for place in range(INPUT + 2, len(variables) + 1):  # in the list, from 1
            ET.SubElement(
                parent, "Unknown", {"index": str(place), "dependencies": str(INPUT + 1)}
            )
    return _written(root)


def _add_log_categories(root: ET.Element) -> None:
    categories = ET.SubElement(root, "LogCategories")
    for category in ("logStatusDiscard", "logStatusError"):
        ET.SubElement(categories, "Category", {"name": category})


def _add_units(
    root: ET.Element, variables: list[dict[str, str]], exported: ExportedLaw
) -> None:
    """The units of the variables by units of SI."""
    length = exported.length
    stress = exported.stress
    metre = factor(length, "m")
    pascal = factor(stress, "Pa", "stress")
    bases: dict[str, tuple[dict[str, int], float]] = {
        "s": ({"s": 1}, 1.0),
        "1": ({}, 1.0),
        length: ({"m": 1}, metre),
        stress: ({"kg": 1, "m": -1, "s": -2}, pascal),
        f"{stress}/{length}": ({"kg": 1, "m": -2, "s": -2}, pascal / metre),
        f"{stress} {length}": ({"kg": 1, "s": -2}, pascal * metre),
        f"{length}^3": ({"m": 3}, metre**3),
    }
    units = ET.SubElement(root, "UnitDefinitions")
    for unit in dict.fromkeys(variable["unit"] for variable in variables):
        named = ET.SubElement(units, "Unit", {"name": unit})
        if unit in bases:
            powers, size = bases[unit]
            base = {key: str(power) for key, power in powers.items()} | {
                "factor": number(size)
            }
            ET.SubElement(named, "BaseUnit", base)


def _written(root: ET.Element) -> bytes:
    ET.indent(root)
    return bytes(ET.tostring(root, encoding="utf-8", xml_declaration=True))


def _description_of_fmi3(
    name: str,
    token: str,
    text: str,
    variables: list[dict[str, str]],
    exported: ExportedLaw,
) -> bytes:
    """modelDescription.xml of FMI 3.0."""
    facts = {"fmiVersion": "3.0", "modelName": name, "instantiationToken": token}
    facts |= {
        "description": text,
        "generationTool": f"mbma_tables {__version__}",
        "variableNamingConvention": "flat",
    }
    root = ET.Element("fmiModelDescription", facts)
    provides = {"modelIdentifier": name, "providesDirectionalDerivatives": "true"}
    ET.SubElement(root, "ModelExchange", provides)
    steps = {"canHandleVariableCommunicationStepSize": "true"}
    ET.SubElement(root, "CoSimulation", provides | steps)
    _add_units(root, variables, exported)
    _add_log_categories(root)
    listed = ET.SubElement(root, "ModelVariables")
    structure = ET.SubElement(root, "ModelStructure")
    for reference, all_of in enumerate(variables):
        own = {"valueReference": str(reference), "variability": "continuous"}
        ET.SubElement(listed, "Float64", own | all_of)
    for kind in ("Output", "InitialUnknown"):
        for reference in range(INPUT + 1, len(variables)):
            depends = {"valueReference": str(reference), "dependencies": str(INPUT)}
            ET.SubElement(structure, kind, depends)
    return _written(root)


def _build_description(name: str) -> bytes:
    """buildDescription.xml, by which tools compile the sources of FMI 3.0."""
    root = ET.Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    built = ET.SubElement(root, "BuildConfiguration", {"modelIdentifier": name})
    files = ET.SubElement(built, "SourceFileSet", {"language": "C99"})
    ET.SubElement(files, "SourceFile", {"name": f"{name}.c"})
    return _written(root)


TARGETS = (
    Target(
        "fmu",
        fmu,
        CODE | {"binaries"},
        FmuOptions,
        rows=False,
        output=(
            "an FMU of FMI 2.0, for model exchange and co-simulation: the C law, "
            "compiled for this platform and as source, units, directional derivatives"
        ),
        outside="`fmi2Discard`, with a message",
        tested=(
            "FMPy 0.3.32: validated, run as exported, built by gcc 12.2 with warnings "
            "as errors, simulated both ways at 10,000 gaps, four laws, an overclosure "
            "outside the range refused; not in Simulink or a Modelica tool"
        ),
    ),
    Target(
        "fmu3",
        functools.partial(fmu, fmi=3),
        CODE | {"binaries"},
        FmuOptions,
        rows=False,
        output=(
            "the same of FMI 3.0; with `--binaries all` also for Linux, macOS and "
            "Windows on ARM"
        ),
        outside="`fmi3Discard`, with a message",
        tested=(
            "FMPy 0.3.32: validated, run as exported, both ways, built by gcc 12.2 "
            "with the headers of the standard and warnings as errors; binaries for ARM "
            "are made, not run"
        ),
    ),
)
