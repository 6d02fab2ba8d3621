"""tables/formula.json: the closed forms, one source for the tier, the exports and the page. Every key stands here."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import os
import pathlib
import re
from typing import Any

import numpy as np

from mbma_tables.arguments import FloatArray, require
from mbma_tables.errors import InputError, TableFileError
from mbma_tables.files import shipped_file, write_file
from mbma_tables.formulas.expressions import FUNCTIONS, evaluate_steps, names_in, parse

FORMAT, FORMAT_VERSION = "mbma-formula", 1
LARGEST = 1_000_000  # bytes
LARGEST_NUMBER = 1e300
MOST_STEPS = 200
ISLAND_FORMS = ("pocket", "standard", "long")
TOTALS = "totals"
ISLAND_OUTPUTS, TOTAL_OUTPUTS = ("phi_F", "phi_A"), ("force", "area")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,31}")


@dataclasses.dataclass(frozen=True)
class Form:
    """One closed form.

    Attributes
    ----------
    arguments : tuple of str
        Names of its arguments.
    range : dict
        Lowest and highest value of each argument; "area" for the least and largest area of the totals.
    steps : tuple of (name, expression)
        Each uses the arguments and earlier names.
    outputs : dict
        The step that holds each result.
    coefficients : dict
        Fitted constants of each result, those of the rigid sphere's integrals not counted.
    errors : dict
        Largest and median relative error of each result on points that no fit saw, and where it is worst.
    """

    name: str
    title: str
    arguments: tuple[str, ...]
    range: dict[str, tuple[float, float]]
    steps: tuple[tuple[str, str], ...]
    outputs: dict[str, str]
    coefficients: dict[str, int]
    errors: dict[str, Any]

    def evaluate(self, given: dict[str, FloatArray], results: tuple[str, ...] | None = None) -> dict[str, FloatArray]:
        """Results at flat arrays of one size that lie in the range.

        Raises
        ------
        OutOfRangeError
            Where a result is NaN or infinite, which in the range none is.
        """
        wanted = tuple(self.outputs) if results is None else results
        found = evaluate_steps(self.steps, given, [self.outputs[name] for name in wanted])
        for name in wanted:
            values = found[self.outputs[name]]
            require(
                f"{name} of the {self.name} form", values, np.isfinite(values), f"finite (its range is {self.range})"
            )
        return {name: found[self.outputs[name]] for name in wanted}

    def largest_error(self, result: str) -> float:
        """Largest relative error of a result, as certified."""
        return float(self.errors[result]["largest"])


def canonical(document: dict[str, Any]) -> bytes:
    """What is hashed: everything but the hash."""
    rest = {key: value for key, value in document.items() if key != "data_hash"}
    return json.dumps(rest, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def data_hash(document: dict[str, Any]) -> str:
    """SHA-256 of the document without its hash."""
    return hashlib.sha256(canonical(document)).hexdigest()


def _require(condition: bool, path: object, what: str) -> None:
    if not condition:
        raise TableFileError(f"{path}: {what}")


def _numbers(values: Any, count: int) -> bool:
    return (
        isinstance(values, list)
        and len(values) == count
        # not isfinite: it overflows on a whole number of 400 digits
        and all(type(v) in (int, float) and -LARGEST_NUMBER < v < LARGEST_NUMBER for v in values)
    )


def _form(name: str, given: Any, path: object) -> Form:
    """A checked form."""
    keys = {"title", "arguments", "range", "steps", "outputs", "coefficients", "errors"}
    _require(isinstance(given, dict) and keys <= set(given), path, f"form {name!r} lacks some of {sorted(keys)}")
    outputs = TOTAL_OUTPUTS if name == TOTALS else ISLAND_OUTPUTS
    arguments, steps, named = given["arguments"], given["steps"], given["outputs"]
    _require(isinstance(given["title"], str), path, f"form {name!r} has no title")
    _require(
        isinstance(arguments, list) and all(isinstance(a, str) and _NAME.fullmatch(a) for a in arguments),
        path,
        f"form {name!r}: arguments are no names",
    )
    _require(
        isinstance(given["range"], dict)
        and set(arguments) <= set(given["range"])
        and all(_numbers(ends, 2) and ends[0] < ends[1] for ends in given["range"].values()),
        path,
        f"form {name!r}: range must hold [low, high] of every argument",
    )
    _require(isinstance(steps, list) and 0 < len(steps) <= MOST_STEPS, path, f"form {name!r}: no steps, or too many")
    known = set(arguments)
    for step in steps:
        pair = isinstance(step, list) and len(step) == 2 and all(isinstance(part, str) for part in step)
        _require(pair, path, f"form {name!r}: a step must be [name, expression]")
        target, text = step
        free = _NAME.fullmatch(target) is not None and target not in known | set(FUNCTIONS)
        _require(free, path, f"form {name!r}: {target!r} is no new name")
        try:
            unknown = names_in(parse(text)) - known
        except TableFileError as fault:
            raise TableFileError(f"{path}: form {name!r}, step {target!r}: {fault}") from fault
        _require(not unknown, path, f"form {name!r}, step {target!r}: unknown names {sorted(unknown)}")
        known.add(target)
    _require(
        isinstance(named, dict)
        and set(named) == set(outputs)
        and all(isinstance(step, str) and step in known for step in named.values()),
        path,
        f"form {name!r}: outputs must name a step for each of {outputs}",
    )
    errors, coefficients = given["errors"], given["coefficients"]
    for output in outputs:
        stated = errors.get(output) if isinstance(errors, dict) else None
        told = isinstance(stated, dict) and _numbers([stated.get("largest"), stated.get("median")], 2)
        _require(told, path, f"form {name!r}: no largest and median error of {output}")
        counted = isinstance(coefficients, dict) and type(coefficients.get(output)) is int
        _require(counted, path, f"form {name!r}: no number of coefficients of {output}")
    return Form(
        name,
        given["title"],
        tuple(arguments),
        {key: (float(low), float(high)) for key, (low, high) in given["range"].items()},
        tuple((target, text) for target, text in steps),
        dict(named),
        dict(coefficients),
        dict(errors),
    )


@dataclasses.dataclass(frozen=True)
class Formulas:
    """Every form of a file, its hash, and what made it."""

    forms: dict[str, Form]
    data_hash: str
    provenance: dict[str, Any]


def check(document: Any, path: object = "formula file") -> Formulas:
    """The forms of a document.

    Raises
    ------
    TableFileError
        If a key is missing or wrong, or the hash does not fit.
    """
    head = {"format", "format_version", "data_hash", "provenance", "forms"}
    _require(isinstance(document, dict) and head <= set(document), path, f"lacks some of {sorted(head)}")
    _require(document["format"] == FORMAT, path, f"format is {document['format']!r}, not {FORMAT!r}")
    _require(document["format_version"] == FORMAT_VERSION, path, f"format_version must be {FORMAT_VERSION}")
    try:
        own = data_hash(document)
    except (ValueError, RecursionError) as fault:
        raise TableFileError(f"{path}: {fault}") from fault
    _require(document["data_hash"] == own, path, "data_hash does not fit its content: the file was changed")
    _require(isinstance(document["provenance"], dict), path, "provenance is no object")
    forms = document["forms"]
    expected = {*ISLAND_FORMS, TOTALS}
    _require(isinstance(forms, dict) and set(forms) == expected, path, f"forms must be {sorted(expected)}")
    return Formulas(
        {name: _form(name, given, path) for name, given in forms.items()}, own, dict(document["provenance"])
    )


def read(path: os.PathLike[str] | str) -> Formulas:
    """The forms of a file.

    Raises
    ------
    TableFileError
        If it is no formula file, or a changed one.
    OSError
        If it cannot be read.
    """
    file = pathlib.Path(path)
    with file.open("rb") as stream:
        content = stream.read(LARGEST + 1)
    _require(len(content) <= LARGEST, file, f"more than {LARGEST} bytes: at most that many are read")
    try:
        document = json.loads(content.decode("utf-8"))
    except (ValueError, RecursionError) as fault:
        raise TableFileError(f"{file}: no JSON: {fault}") from fault
    return check(document, file)


def write(path: os.PathLike[str] | str, forms: dict[str, Any], provenance: dict[str, Any]) -> Formulas:
    """Write a formula file, whole or not at all."""
    document: dict[str, Any] = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "provenance": provenance,
        "forms": forms,
    }
    document["data_hash"] = data_hash(document)
    found = check(document)
    write_file(path, (json.dumps(document, indent=1) + "\n").encode())
    return found


@functools.lru_cache(maxsize=1)
def shipped_formulas() -> Formulas:
    """The forms that come with the library; read once."""
    return read(shipped_file("formula.json"))


def get_form(name: str) -> Form:
    """A form of the shipped file by name.

    Raises
    ------
    InputError
        For an unknown name.
    """
    forms = shipped_formulas().forms
    if name not in forms:
        raise InputError(f"form must be one of {sorted(forms)}, got {name!r}")
    return forms[name]
