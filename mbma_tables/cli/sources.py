"""Where a surface comes from: a name, numbers, a TOML file or a measured map."""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mbma_tables.errors import InputError
from mbma_tables.scenes.sources import (
    MATERIAL,
    NUMBERS,
    Source,
    from_map,
    from_name,
    from_numbers,
    known_keys,
    modulus,
    shown,
)

__all__ = ["MATERIAL", "NUMBERS", "Source", "read_source"]

TABLES = {"surface": (*NUMBERS, "name", "map", "length_unit"), "material": MATERIAL}


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
        source = from_map(given["map"])
    elif given["name"] is not None:
        source = from_name(given["name"])
    else:
        source = Source(from_numbers(numbers), "surface of given numbers")
    own = modulus({key: given[key] for key in MATERIAL if given[key] is not None})
    return source if own is None else dataclasses.replace(source, E_star=own)


def _from_file(path: Path) -> Source:
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except ValueError as fault:
        raise InputError(f"{path} is no TOML file: {fault}") from None
    known_keys(content, TABLES, f"{path}")
    for table, keys in TABLES.items():
        if not isinstance(content.get(table, {}), dict):
            raise InputError(f"{path}: {table} must be a table, [{table}]")
        known_keys(content.get(table, {}), keys, f"{path}, [{table}]")
    entries = dict(content.get("surface", {}))
    texts = {key: entries.pop(key, None) for key in ("name", "map", "length_unit")}
    for key, text in texts.items():
        if text is not None and not isinstance(text, str):
            raise InputError(f"{path}, [surface]: {key} must be a text, got {text!r}")
    if (texts["name"] is not None) + (texts["map"] is not None) + bool(entries) != 1:
        raise InputError(f"{path}, [surface]: one of name, map or numbers is needed")
    try:
        if texts["name"] is not None:
            source = from_name(texts["name"])
        elif texts["map"] is not None:
            source = from_map(path.parent / texts["map"])
        else:
            source = Source(from_numbers(entries), f"surface of {shown(path)}")
        own = modulus(content.get("material", {}))
    except InputError as fault:
        raise InputError(f"{path}: {fault}") from None
    unit = texts["length_unit"]
    if unit is not None and source.length_unit not in (None, unit):
        raise InputError(f"{path}, [surface]: length_unit is {unit!r}, the surface's own {source.length_unit!r}")
    return dataclasses.replace(source, length_unit=unit or source.length_unit, E_star=own)
