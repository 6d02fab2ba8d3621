"""Where a surface comes from: a name, numbers, a TOML file or a measured map."""

from __future__ import annotations

import dataclasses
import difflib
import tomllib
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mbma_tables.errors import InputError

if TYPE_CHECKING:
    from mbma_tables.surfaces.surface import Surface

BAND = ("hurst", "q0", "q1", "h_rms", "h_max")
MAGNIFICATION = ("hurst", "q0", "zeta_1", "h_rms", "h_max")
MOMENTS = ("hurst", "m0", "m2", "m4", "h_max")
NUMBERS = tuple(dict.fromkeys(BAND + MAGNIFICATION + MOMENTS))
MATERIAL = ("E_star", "E1", "nu1", "E2", "nu2")
TABLES = {"surface": (*NUMBERS, "name", "map", "length_unit"), "material": MATERIAL}


@dataclasses.dataclass(frozen=True)
class Source:
    """A surface, and what is known about it besides its five numbers."""

    surface: Surface
    title: str
    length_unit: str | None = None
    E_star: float | None = None


def read_source(given: Mapping[str, Any]) -> Source:
    """The surface that the options of a command describe, with the modulus that goes with it.

    A modulus on the command line goes before the one of a file.
    """
    used = [f"--{key}" for key in ("file", "map") if given[key] is not None]
    used += ["--surface"] if given["name"] is not None else []
    numbers = {key: given[key] for key in NUMBERS if given[key] is not None}
    used += ["numbers"] if numbers else []
    if len(used) != 1:
        raise InputError(
            "one surface is needed: --surface NAME, --file TOML, --map MAP, --hurst --q0 --q1 (or --zeta-1) "
            f"--h-rms --h-max, or --hurst --m0 --m2 --m4 --h-max; got {' and '.join(used) or 'none'}"
        )
    if given["file"] is not None:
        source = _from_file(given["file"])
    elif given["map"] is not None:
        source = _from_map(given["map"])
    elif given["name"] is not None:
        source = _from_name(given["name"])
    else:
        source = Source(_from_numbers(numbers), "surface of given numbers")
    modulus = _modulus({key: given[key] for key in MATERIAL if given[key] is not None})
    return source if modulus is None else dataclasses.replace(source, E_star=modulus)


def _from_name(name: str) -> Source:
    from mbma_tables.surfaces.cases import get_case

    case = get_case(name)
    return Source(case.surface, case.title, case.length_unit)


def _from_map(path: Path) -> Source:
    from mbma_tables.surfaces.maps import read_map
    from mbma_tables.surfaces.surface import Surface

    surface = Surface.from_map(read_map(path))
    unit = None if surface.fit is None else surface.fit.length_unit
    return Source(surface, f"fitted to the map {_shown(path)}", unit)


def _shown(path: Path) -> str:
    """The file's name without its folder, bytes that are no text replaced."""
    return click.format_filename(path, shorten=True)


def _from_numbers(given: Mapping[str, Any]) -> Surface:
    from mbma_tables.arguments import require
    from mbma_tables.surfaces.surface import LEAST_ZETA_1, Surface

    if set(given) not in (set(BAND), set(MAGNIFICATION), set(MOMENTS)):
        raise InputError(
            f"a surface needs {', '.join(BAND)} (or zeta_1 for q1), or {', '.join(MOMENTS)}; got "
            f"{', '.join(given) or 'none of them'}"
        )
    numbers = {key: _one_number(key, value) for key, value in given.items()}
    if "m0" in numbers:
        return Surface.from_moments(**numbers)
    if "zeta_1" in numbers:
        zeta_1 = numbers.pop("zeta_1")
        require("zeta_1", zeta_1, zeta_1 > LEAST_ZETA_1, "greater than 3 (the model's floors need room)")
        numbers["q1"] = numbers["q0"] * zeta_1
    return Surface(**numbers)


def _one_number(name: str, value: Any) -> Any:
    from mbma_tables.arguments import finite_array

    array = finite_array(name, value)
    if array.ndim:
        raise InputError(f"{name} must be one number, got {array.size}")
    return array


def _modulus(given: Mapping[str, Any]) -> float | None:
    """E* of a material's numbers; None of none."""
    from mbma_tables.arguments import require
    from mbma_tables.materials import effective_modulus

    if not given:
        return None
    numbers = {key: _one_number(key, value) for key, value in given.items()}
    if set(numbers) == {"E_star"}:
        require("E_star", numbers["E_star"], numbers["E_star"] > 0, "positive")
        return float(numbers["E_star"])
    if set(numbers) != set(MATERIAL[1:]):
        raise InputError(f"a material is E_star alone, or all of E1, nu1, E2, nu2; got {', '.join(given)}")
    return float(effective_modulus(**numbers))


def _from_file(path: Path) -> Source:
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except ValueError as fault:
        raise InputError(f"{path} is no TOML file: {fault}") from None
    _known_keys(content, TABLES, f"{path}")
    for table, keys in TABLES.items():
        if not isinstance(content.get(table, {}), dict):
            raise InputError(f"{path}: {table} must be a table, [{table}]")
        _known_keys(content.get(table, {}), keys, f"{path}, [{table}]")
    entries = dict(content.get("surface", {}))
    texts = {key: entries.pop(key, None) for key in ("name", "map", "length_unit")}
    for key, text in texts.items():
        if text is not None and not isinstance(text, str):
            raise InputError(f"{path}, [surface]: {key} must be a text, got {text!r}")
    if (texts["name"] is not None) + (texts["map"] is not None) + bool(entries) != 1:
        raise InputError(f"{path}, [surface]: one of name, map or numbers is needed")
    try:
        if texts["name"] is not None:
            source = _from_name(texts["name"])
        elif texts["map"] is not None:
            source = _from_map(path.parent / texts["map"])
        else:
            source = Source(_from_numbers(entries), f"surface of {_shown(path)}")
        modulus = _modulus(content.get("material", {}))
    except InputError as fault:
        raise InputError(f"{path}: {fault}") from None
    unit = texts["length_unit"]
    if unit is not None and source.length_unit not in (None, unit):
        raise InputError(f"{path}, [surface]: length_unit is {unit!r}, the surface's own {source.length_unit!r}")
    return dataclasses.replace(source, length_unit=unit or source.length_unit, E_star=modulus)


def _known_keys(entries: Mapping[str, Any], known: Collection[str], where: str) -> None:
    for key in entries:
        if key not in known:
            near = difflib.get_close_matches(key, known, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(known)}"
            raise InputError(f"{where}: unknown key {key!r}; {hint}")
