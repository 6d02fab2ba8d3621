"""Scene files: TOML by the published schema, every mistake answered with what to write instead."""

from __future__ import annotations

import functools
import json
import os
import pathlib
import re
import tomllib
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

from mbma_tables.errors import InputError
from mbma_tables.scenes.effects import nearest
from mbma_tables.scenes.scene import Scene
from mbma_tables.scenes.sources import Source, from_map, from_name, from_numbers, modulus

LARGEST_FILE = 2**20
LARGEST_SPECTRUM = 16 * 2**20
WHOLE_NUMBER_BITS = 10_000
LARGEST_NUMBER = 1e300
# the time to parse a dotted key grows with the square of its parts
LONG_KEY = re.compile(r"""(?<![^\s.,=\[\]{}#"'])(?:(?:"[^"\n]*"|'[^'\n]*'|[^\s.,=\[\]{}#"']+)[ \t]*\.[ \t]*){20}""")
WORDS = {
    "string": "a text in quotes",
    "number": "a number",
    "integer": "a whole number",
    "boolean": "true or false",
    "array": "a list in [ ]",
    "object": "a table",
}


@functools.lru_cache(maxsize=1)
def schema() -> dict[str, Any]:
    """The JSON schema of scene files, as published in the package."""
    path = pathlib.Path(__file__).with_name("scene.schema.json")
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content


def _whole_numbers(node: Any) -> Iterator[int]:
    """Every whole number in a document."""
    if isinstance(node, int):
        yield node
    for child in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from _whole_numbers(child)


def read_toml(path: pathlib.Path, what: str) -> dict[str, Any]:
    """The entries of a TOML file; `what` says of which kind.

    Raises
    ------
    InputError
        Where it cannot be read, is too long, or is no TOML.
    """
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except OSError as fault:
        raise InputError(f"{path}: cannot be read ({fault.strerror}); give the path of a {what} file") from None
    if len(content) > LARGEST_FILE:
        raise InputError(f"{path} has more than {LARGEST_FILE} bytes: no {what} file is that long")
    try:
        text = content.decode("utf-8")
        if LONG_KEY.search(text):
            raise ValueError("a key of many parts")
        entries = tomllib.loads(text)
        # in hexadecimal one can be longer than Python shows in a message
        if any(number.bit_length() > WHOLE_NUMBER_BITS for number in _whole_numbers(entries)):
            raise ValueError(f"a whole number has more than {WHOLE_NUMBER_BITS} bits")
    except (ValueError, RecursionError) as fault:
        raise InputError(f"{path} is no TOML file: {fault}") from None
    return entries


def read_scene(path: os.PathLike[str] | str) -> Scene:
    """The scene of a file; every fault is told with the file's name."""
    own = pathlib.Path(path)
    entries = read_toml(own, "scene")
    try:
        return scene_of(entries, own.parent, own.stem)
    except InputError as fault:
        raise InputError(f"{own}: {fault}") from None


def scene_of(content: Mapping[str, Any], folder: pathlib.Path = pathlib.Path(), title: str = "scene") -> Scene:
    """The scene of a file's content; files that it names are relative to `folder`."""
    _check(content, schema(), "")
    source = _source(content["surface"], folder)
    material = dict(content.get("material", {}))
    stress_unit = material.pop("stress_unit", None)
    E_star = modulus(material)
    prescribed = dict(content.get("prescribed", {}))
    over = prescribed.pop("over_h_rms", False)
    h_rms = float(source.surface.h_rms)
    if over and "nominal_pressures" in prescribed:
        raise InputError("[prescribed]: over_h_rms is about lengths, nominal_pressures have none: leave it out")
    if not prescribed and "prescribed" in content:
        raise InputError("[prescribed] is empty: give separations, mean_separations or nominal_pressures")
    if over:
        prescribed = {name: _times(value, h_rms) for name, value in prescribed.items()}
    profile = dict(content.get("pressure_profile", {}))
    deltas = profile.get("deltas")
    if deltas is not None and profile.get("over_h_rms", False):
        deltas = _times(deltas, h_rms)
    statistics = content.get("island_statistics", {})
    if statistics and "island_statistics" not in content["effects"]["on"]:
        raise InputError("[island_statistics] is given and the effect is off: add it to on, or leave the table out")
    conductivities = content.get("conductance")
    extra = {name: prescribed[name] for name in prescribed}
    return Scene(
        source.surface,
        effects=content["effects"]["on"],
        without=content["effects"].get("off", ()),
        E_star=1.0 if E_star is None else E_star,
        reading=content.get("reading", "reported"),
        conductivities=None if conductivities is None else (conductivities["k1"], conductivities["k2"]),
        deltas=deltas,
        theories=content.get("comparison", {}).get("theories", ()),
        length_unit=source.length_unit,
        stress_unit=stress_unit,
        title=content.get("title", title),
        **content.get("accuracy", {}),
        **statistics,
        **extra,
    )


def _times(value: Any, factor: float) -> Any:
    return [entry * factor for entry in value] if isinstance(value, list) else value * factor


def _is(value: Any, kind: str) -> bool:
    if kind == "number":
        return isinstance(value, int | float) and not isinstance(value, bool)
    if kind == "integer":
        return isinstance(value, int) and not isinstance(value, bool)
    kinds = {"string": str, "boolean": bool, "array": list, "object": Mapping}
    return isinstance(value, kinds[kind])


def _check(value: Any, rule: Mapping[str, Any], where: str) -> None:
    """Refuse what the schema does not allow, with the place and what is allowed there."""
    if "oneOf" in rule:
        kinds = [one for one in rule["oneOf"] if _is(value, one["type"])]
        if not kinds:
            raise InputError(f"{where} must be a number or a list of numbers, got {value!r}")
        _check(value, kinds[0], where)
        return
    if not _is(value, rule["type"]):
        hint = f": write [{where}]" if rule["type"] == "object" else ""
        raise InputError(f"{where} must be {WORDS[rule['type']]}, got {value!r}{hint}")
    if rule["type"] == "number" and isinstance(value, int) and not -LARGEST_NUMBER < value < LARGEST_NUMBER:
        raise InputError(f"{where} must be a finite number, got {value!r}")
    if "enum" in rule and value not in rule["enum"]:
        raise InputError(f"{where}: {value!r} is not known; {nearest(value, rule['enum'])}")
    low, high = rule.get("minimum"), rule.get("maximum")
    if (low is not None and not value >= low) or (high is not None and not value <= high):
        raise InputError(f"{where} must lie in [{low:g}, {high:g}], got {value!r}")
    if "exclusiveMinimum" in rule and not value > rule["exclusiveMinimum"]:
        raise InputError(f"{where} must be positive, got {value!r}")
    if rule["type"] == "array":
        if len(value) < rule.get("minItems", 0):
            raise InputError(f"{where} is an empty list: give at least one entry")
        for number, entry in enumerate(value):
            _check(entry, rule["items"], f"{where}[{number}]")
    if rule["type"] == "object":
        _check_table(value, rule, where)


def _check_table(value: Mapping[str, Any], rule: Mapping[str, Any], where: str) -> None:
    place = f"[{where}]" if where else "a scene file"
    known = rule["properties"]
    for name in value:
        if name not in known:
            raise InputError(f"{place}: unknown key {name!r}; {nearest(name, known)}")
    for name in rule.get("required", ()):
        if name not in value:
            missing = f"the table [{name}]" if not where else f"{name} = ..."
            raise InputError(f"{place} needs {missing}")
    for name, entry in value.items():
        _check(entry, known[name], f"{where}.{name}" if where else name)


def _source(entries: Mapping[str, Any], folder: pathlib.Path) -> Source:
    numbers = dict(entries)
    texts = {name: numbers.pop(name, None) for name in ("name", "map", "psd", "convention", "length_unit")}
    given = [name for name in ("name", "map", "psd") if texts[name] is not None]
    if len(given) > 1:
        raise InputError(f"[surface]: {' and '.join(given)} are given: one of name, map, psd or numbers")
    if given in (["name"], ["map"]) and numbers:
        raise InputError(f"[surface]: {given[0]} and numbers ({', '.join(numbers)}) are given: leave one of them out")
    if texts["convention"] is not None and given != ["psd"]:
        raise InputError("[surface]: convention is of a psd: give psd = ..., or leave it out")
    if given == ["name"]:
        source = from_name(str(texts["name"]))
    elif given == ["map"]:
        source = from_map(_file(folder, str(texts["map"]), "map"))
    elif given == ["psd"]:
        source = _from_psd(_file(folder, str(texts["psd"]), "psd"), numbers, texts["convention"] or "paper")
    else:
        source = Source(from_numbers(numbers), "surface of given numbers")
    unit = texts["length_unit"]
    if unit is not None and source.length_unit not in (None, unit):
        raise InputError(
            f"[surface]: length_unit is {unit!r}, the surface's own {source.length_unit!r}: leave length_unit out"
        )
    return Source(source.surface, source.title, unit or source.length_unit)


def _file(folder: pathlib.Path, name: str, key: str) -> pathlib.Path:
    path = folder / name
    if not path.is_file():
        raise InputError(f"[surface]: {key} = {name!r} is no file; paths are relative to the scene file")
    return path


def _from_psd(path: pathlib.Path, numbers: Mapping[str, Any], convention: str) -> Source:
    import numpy as np

    from mbma_tables.surfaces.surface import Surface

    if set(numbers) != {"h_max"}:
        raise InputError(f"[surface]: beside psd stands h_max = ... and no other number, got {', '.join(numbers)}")
    # not by its name: numpy would unpack .gz, .bz2 and .xz, whatever they grow to
    with path.open("rb") as file:
        content = file.read(LARGEST_SPECTRUM + 1)
    if len(content) > LARGEST_SPECTRUM:
        raise InputError(f"[surface]: {path.name} has more than {LARGEST_SPECTRUM} bytes: average it over wavenumbers")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # of nothing in it
            lines = content.decode("utf-8").splitlines()
            columns = np.loadtxt(lines, ndmin=2, delimiter="," if path.suffix == ".csv" else None)
    except (ValueError, UserWarning) as fault:
        raise InputError(f"[surface]: {path.name} must hold two columns of numbers, q and C: {fault}") from None
    if columns.shape[1] != 2:
        raise InputError(f"[surface]: {path.name} must hold two columns, q and C, got {columns.shape[1]}")
    surface = Surface.from_psd(columns[:, 0], columns[:, 1], h_max=numbers["h_max"], convention=convention)
    return Source(surface, f"fitted to {path.name}")
