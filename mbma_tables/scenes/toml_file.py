"""TOML files: read within limits, and checked against the published schema of scenes."""

from __future__ import annotations

import functools
import json
import pathlib
import tomllib
from collections.abc import Mapping
from typing import Any

from mbma_tables.arguments import nearest
from mbma_tables.errors import InputError
from mbma_tables.files import read_file

MAX_BYTES = 2**20


def read_toml(path: pathlib.Path, what: str) -> dict[str, Any]:
    """The entries of a TOML file; `what` says of which kind it should be."""
    try:
        content = read_file(path, MAX_BYTES)
    except InputError as fault:
        raise InputError(f"{fault}; give the path of a {what} file") from None
    try:
        entries = tomllib.loads(content.decode("utf-8"))
        # refuses whole numbers and nesting that no message could quote
        repr(entries)
    except (ValueError, RecursionError) as fault:
        raise InputError(f"{path} is not a TOML file: {fault}") from None
    return entries


@functools.cache
def schema() -> dict[str, Any]:
    """The JSON schema of scene files, as published in the package."""
    path = pathlib.Path(__file__).with_name("scene.schema.json")
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content


def check(entries: Mapping[str, Any], rules: Mapping[str, Any]) -> None:
    """Refuse what a JSON schema does not allow, with its place and what to write instead."""
    import jsonschema

    faults = list(jsonschema.Draft202012Validator(rules).iter_errors(entries))
    # a misspelt name is the cause of a missing one
    fault = jsonschema.exceptions.best_match([f for f in faults if f.validator == "additionalProperties"] or faults)
    if fault is None:
        return
    place = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in fault.absolute_path)[1:]
    table = f"[{place}]" if place else "top level"
    if fault.validator == "additionalProperties":
        known = fault.schema["properties"]
        unknown = next(name for name in fault.instance if name not in known)
        tables = [name for name, entry in schema()["properties"].items() if unknown in entry.get("properties", ())]
        hint = f"it belongs to [{' or ['.join(f'{name}]' for name in tables)}" if tables else nearest(unknown, known)
        raise InputError(f"{table}: unknown key {unknown!r}; {hint}")
    if fault.validator == "enum":
        raise InputError(
            f"{place}: {fault.instance!r} is not known; {nearest(str(fault.instance), fault.schema['enum'])}"
        )
    hint = f"; write [{place}]" if fault.validator == "type" and fault.schema["type"] == "object" else ""
    raise InputError(f"{place or table}: {fault.message}{hint}")
