"""A contact law as a Functional Mock-up Unit, FMI 2.0 or 3.0, model exchange and co-simulation: C and binaries."""

from __future__ import annotations

import contextlib
import functools
import importlib.util
import io
import platform
import shutil
import sys
import uuid
import zipfile
from typing import Any
from xml.etree import ElementTree as ET

from mbma_tables import __version__
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import factor
from mbma_tables.export.code import BuildError, built_by
from mbma_tables.export.exported_law import ExportedLaw
from mbma_tables.export.law_code import AskedLaw, asked_law, code_name, text_of
from mbma_tables.export.targets import CODE, Target
from mbma_tables.export.text import filled, template
from mbma_tables.surfaces.any_surface import AnySurface

# names that differ in the C of both standards
STANDARDS = {
    "fmu": {"FMI": "fmi2", "INSTANCE": "fmi2Component", "REAL": "Real", "SIZE": "", "SEEDS": ""}
    | {"LOGGER": "fmi2CallbackLogger", "NAMED": "m->name, ", "FORMAT": '"%s", '},
    "fmu3": {"FMI": "fmi3", "INSTANCE": "fmi3Instance", "REAL": "Float64", "SIZE": ", size_t size"}
    | {"LOGGER": "fmi3LogMessageCallback", "NAMED": "", "FORMAT": "", "SEEDS": ", size_t seeds"},
}
SAID = {
    "conductance": "through the contact, over nominal area",
    "tangential_stiffness": "shear stress over displacement before any slip",
    "leakage": "flow coefficient K: K dp/(12 viscosity width) per length of seal, viscosity in stress times s",
}
# names of platforms in FMI 3.0; folders in FMI 2.0, which has none of ARM, ends of libraries, and zig's names
PLATFORMS = {
    "x86_64-linux": ("linux64", ".so", "x86_64-linux-gnu.2.17"),
    "aarch64-linux": ("", ".so", "aarch64-linux-gnu.2.17"),
    "x86_64-darwin": ("darwin64", ".dylib", "x86_64-macos.10.13"),
    "aarch64-darwin": ("", ".dylib", "aarch64-macos.11.0"),
    "x86_64-windows": ("win64", ".dll", "x86_64-windows-gnu"),
}
INPUT = 1  # value reference of overclosure, after time


def fmu(
    target: str, surface: AnySurface, E_star: float | str, *, name: str = "law", binaries: str = "here", **asked: Any
) -> bytes:
    """A contact law as an FMU: overclosure in; pressure, tangent, area and energy out.

    Parameters
    ----------
    target : str
        "fmu" for FMI 2.0, "fmu3" for FMI 3.0.
    surface, E_star, name, **asked
        As for `law_text`; a conductivity adds the output conductance, leakage the output leakage.
    binaries : {"here", "all", "none"}
        Beside the sources: a binary for this platform, by the system's C compiler or zig, where one of them is
        installed; binaries for Linux, macOS and Windows, by zig (the extra "javascript"); or none.

    Returns
    -------
    bytes
        The file, the same for the same law and compiler; its description lists the binaries.

    Raises
    ------
    InputError, OutOfRangeError
        As `law_text`.

    Examples
    --------
    >>> import io, zipfile
    >>> from mbma_tables import Surface
    >>> file = fmu("fmu", Surface.named("concrete"), "13.3 MPa", name="road", theory="calibrated", binaries="none")
    >>> zipfile.ZipFile(io.BytesIO(file)).namelist()
    ['modelDescription.xml', 'sources/road.c']
    """
    if target not in STANDARDS:
        raise InputError(f"target must be one of {tuple(STANDARDS)}, got {target!r}")
    code_name(name)
    found, third = asked_law(surface, E_star, **asked), target == "fmu3"
    law, exported = text_of("c-law", name, found), found.exported
    token = f"{{{uuid.uuid5(uuid.NAMESPACE_URL, f'{target} {law}')}}}"
    parts = STANDARDS[target] | {
        "LAW": law,
        "NAME": name,
        "TOKEN": token,
        "START": repr(_start(exported)),
        "LEAKAGE": found.more.get("leakage", ""),
        "SLOPED": "LAW" if found.sloped is exported.law else "ELASTIC",
        "LEAST": "-INFINITY" if exported.ends else repr(exported.c_least),
        "MOST": repr(exported.c_most),
        "WRAPPER": template(f"{STANDARDS[target]['FMI']}.c"),
        "DECLARED": template(f"{STANDARDS[target]['FMI']}.h"),
    }
    source = filled("fmu.c", {what: repr(ratio) for what, ratio in found.slopes.items()}, **parts)
    built = _binaries(name, source, third, binaries)
    listed = ", ".join(path.split("/")[1] for path in built) or "none, sources only: the importing tool compiles them"
    said = "\n".join((*found.said, f"binaries: {listed}"))
    files = {
        "modelDescription.xml": _description(third, name, token, said, found),
        f"sources/{name}.c": source.encode(),
    }
    if third:
        root = ET.Element("fmiBuildDescription", {"fmiVersion": "3.0"})
        set_ = ET.SubElement(root, "BuildConfiguration", {"modelIdentifier": name})
        set_ = ET.SubElement(set_, "SourceFileSet", {"language": "C99"})
        ET.SubElement(set_, "SourceFile", {"name": f"{name}.c"})
        files["sources/buildDescription.xml"] = _xml(root)
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for path, content in (files | built).items():
            # without the time of writing: the same law is the same file
            archive.writestr(zipfile.ZipInfo(path), content, zipfile.ZIP_DEFLATED)
    return stream.getvalue()


def _binaries(name: str, source: str, third: bool, asked: str) -> dict[str, bytes]:
    """Shared libraries by their paths in the file, for the platforms asked for, as far as there is a compiler."""
    if asked not in ("here", "all", "none"):
        raise InputError(f"binaries must be one of {('here', 'all', 'none')}, got {asked!r}")
    processor = {"amd64": "x86_64", "arm64": "aarch64"}.get(machine := platform.machine().lower(), machine)
    here, zig = f"{processor}-{sys.platform.replace('win32', 'windows')}", importlib.util.find_spec("ziglang")
    if asked == "all" and zig is None:
        raise InputError("binaries for all platforms are compiled by ziglang: pip install 'mbma_tables[javascript]'")
    found = {}
    for own, (second, end, target) in PLATFORMS.items():
        own_cc = own == here and shutil.which("cc")
        wanted = own == here if asked == "here" else asked == "all"
        if not (wanted and (own_cc or zig) and (third or second)):
            continue
        command = ["cc"] if own_cc else [sys.executable, "-m", "ziglang", "cc", "-target", target, "-s"]
        flags = ["-w", "-O2", "-shared", "-DMBMA_WITHOUT_HEADERS", *([] if end == ".dll" else ["-fPIC"])]
        with contextlib.suppress(*([BuildError] if asked == "here" else [])):
            library = built_by([*command, *flags], {f"{name}.c": source}, f"{name}{end}", "-lm")
            found[f"binaries/{own if third else second}/{name}{end}"] = library
    return found


def _start(exported: ExportedLaw) -> float:
    return 0.0 if exported.ends else max(0.0, exported.c_least)


def _variables(found: AskedLaw) -> list[dict[str, str]]:
    """XML attributes of each variable, by value reference."""
    exported = found.exported
    length, stress = exported.length, exported.stress
    asked = {"start": repr(_start(exported)), "max": repr(exported.c_most)}
    asked |= {} if exported.ends else {"min": repr(exported.c_least)}
    outputs = {
        "pressure": (stress, "force over nominal area"),
        "tangent": (f"{stress}/{length}", "derivative of pressure by overclosure"),
        "area": ("1", "area of contact over nominal area"),
        "energy": (f"{stress} {length}", "integral of pressure over overclosure"),
        **{name: (unit, SAID[name]) for name, unit in found.more.items()},
    }
    said = "h_max less the mean separation"
    return [
        {"name": "time", "causality": "independent", "unit": "s"},
        {"name": "overclosure", "causality": "input", "unit": length, "description": said, **asked},
        *({"name": n, "causality": "output", "unit": u, "description": said} for n, (u, said) in outputs.items()),
    ]


def _description(third: bool, name: str, token: str, text: str, found: AskedLaw) -> bytes:
    """modelDescription.xml of either standard."""
    variables = _variables(found)
    root = ET.Element(
        "fmiModelDescription",
        {"fmiVersion": "3.0" if third else "2.0", "modelName": name}
        | {"instantiationToken" if third else "guid": token, "description": text}
        | {"generationTool": f"mbma_tables {__version__}", "variableNamingConvention": "flat"},
    )
    derivatives = {f"providesDirectionalDerivative{'s' if third else ''}": "true"}
    for kind, more in (("ModelExchange", {}), ("CoSimulation", {"canHandleVariableCommunicationStepSize": "true"})):
        interface = ET.SubElement(root, kind, {"modelIdentifier": name} | derivatives | more)
        if not third:
            ET.SubElement(ET.SubElement(interface, "SourceFiles"), "File", {"name": f"{name}.c"})
    units = ET.SubElement(root, "UnitDefinitions")
    bases = _units(found.exported)
    for unit in dict.fromkeys(variable["unit"] for variable in variables):
        named = ET.SubElement(units, "Unit", {"name": unit})
        if unit in bases:
            ET.SubElement(named, "BaseUnit", bases[unit])
    ET.SubElement(ET.SubElement(root, "LogCategories"), "Category", {"name": "logStatusError"})
    listed, structure = ET.SubElement(root, "ModelVariables"), ET.SubElement(root, "ModelStructure")
    of_real = ("unit", "start", "min", "max")
    for reference, all_of in enumerate(variables):
        outer = {"valueReference": str(reference), "variability": "continuous"}
        if third:
            ET.SubElement(listed, "Float64", outer | all_of)
            continue
        outer |= {key: value for key, value in all_of.items() if key not in of_real}
        inner = {key: all_of[key] for key in of_real if key in all_of}
        ET.SubElement(ET.SubElement(listed, "ScalarVariable", outer), "Real", inner)
    outputs = range(INPUT + 1, len(variables))
    for kind, inner_kind in (("Outputs", "Output"), ("InitialUnknowns", "InitialUnknown")):
        parent = structure if third else ET.SubElement(structure, kind)
        for reference in outputs:
            if third:
                ET.SubElement(parent, inner_kind, {"valueReference": str(reference), "dependencies": str(INPUT)})
            else:  # by places in the list, from 1
                ET.SubElement(parent, "Unknown", {"index": str(reference + 1), "dependencies": str(INPUT + 1)})
    return _xml(root)


def _units(exported: ExportedLaw) -> dict[str, dict[str, str]]:
    """Units of the law by those of SI."""
    length, stress = factor(exported.length, "m"), factor(exported.stress, "Pa", "stress")
    base = {
        "s": ({"s": 1}, 1.0),
        "1": ({}, 1.0),
        exported.length: ({"m": 1}, length),
        exported.stress: ({"kg": 1, "m": -1, "s": -2}, stress),
        f"{exported.stress}/{exported.length}": ({"kg": 1, "m": -2, "s": -2}, stress / length),
        f"{exported.stress} {exported.length}": ({"kg": 1, "s": -2}, stress * length),
        f"{exported.length}^3": ({"m": 3}, length**3),
    }
    return {
        unit: {key: str(power) for key, power in powers.items()} | {"factor": repr(size)}
        for unit, (powers, size) in base.items()
    }


def _xml(root: ET.Element) -> bytes:
    ET.indent(root)
    return bytes(ET.tostring(root, encoding="utf-8", xml_declaration=True))


TARGETS = tuple(Target(name, functools.partial(fmu, name), CODE | {"binaries"}, rows=False) for name in STANDARDS)
