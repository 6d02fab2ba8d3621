"""TOML files that users write: read, and checked against a JSON schema."""

from __future__ import annotations

import copy
import pathlib
import tomllib
from collections.abc import Mapping, Sequence
from typing import Any

from mbma_tables.common.arguments import nearest
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import read_file

MAX_TOML_BYTES = 2**20


def read_toml(path: pathlib.Path, what: str) -> dict[str, Any]:
    """The entries of a TOML file; `what` is its kind, for messages."""
    try:
        content = read_file(path, MAX_TOML_BYTES)
    except InputError as fault:
        raise InputError(f"{fault}; give the path of a {what} file") from None
    try:
        entries = tomllib.loads(content.decode("utf-8"))
        # rejects integers and nesting too large for a message
        repr(entries)
    except (ValueError, RecursionError) as fault:
        raise InputError(f"{path} is not a TOML file: {fault}") from None
    return entries


def with_settings(entries: Mapping[str, Any], settings: Sequence[str]) -> dict[str, Any]:
    """Entries with others set by texts such as "part_a.Ra=1.6 um": a value of TOML, else a text.

    Raises
    ------
    InputError
        For a text without a name or a value, a name given twice, and a name below an entry
        that is no table.
    """
    made = copy.deepcopy(dict(entries))
    names = set[str]()
    for setting in settings:
        name, separator, value = (part.strip() for part in setting.partition("="))
        if not (name and separator and value) or name in names:
            raise InputError(f"settings are NAME=VALUE, each name once, got {setting!r}")
        names.add(name)
        set_entry(made, name, value_of(value))
    return made


def set_entry(entries: dict[str, Any], name: str, value: Any) -> None:
    """Set an entry by a name with dots, making the tables that it is in."""
    table = entries
    *tables, last = name.split(".")
    for each in tables:
        table = table.setdefault(each, {})
        if not isinstance(table, dict):
            raise InputError(f"{name!r}: {each!r} is no table of the file")
    table[last] = value


def value_of(text: str) -> Any:
    """A value as TOML has it, or else the text."""
    try:
        entries = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return entries["value"] if entries.keys() == {"value"} else text


def check(entries: Mapping[str, Any], rules: Mapping[str, Any]) -> None:
    """Raise an error for entries that a JSON schema does not allow, with their place and the correction."""
    import jsonschema

    faults = list(jsonschema.Draft202012Validator(rules).iter_errors(entries))
    # a misspelt name is the cause of a missing one
    fault = jsonschema.exceptions.best_match(
        [f for f in faults if f.validator == "additionalProperties"] or faults
    )
    if fault is None:
        return
    place = "".join(
        f"[{part}]" if isinstance(part, int) else f".{part}"
        for part in fault.absolute_path
    )[1:]
    table = f"[{place}]" if place else "top level"
    if fault.validator == "additionalProperties":
        known = fault.schema["properties"]
        unknown = next(name for name in fault.instance if name not in known)
        tables = [
            name
            for name, entry in rules.get("properties", {}).items()
            if unknown in entry.get("properties", ())
        ]
        hint = (
            f"it belongs to [{' or ['.join(f'{name}]' for name in tables)}"
            if tables
            else nearest(unknown, known)
        )
        raise InputError(f"{table}: unknown key {unknown!r}; {hint}")
    hint = (
        f"; write [{place}]"
        if fault.validator == "type" and fault.schema["type"] == "object"
        else ""
    )
    raise InputError(f"{place or table}: {fault.message}{hint}")
