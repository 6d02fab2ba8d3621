"""Tables of any function as source code: one evaluator a language, the table as data, and a self-test."""

from __future__ import annotations

import json
import keyword
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.export.reserved_words import (
    matlab_words,
    small_words,
    words_of_code,
)
from mbma_tables.export.text import (
    checked_name,
    core_file,
    filled,
    number,
    numerals,
    opening,
    template,
)
from mbma_tables.tables.function_table import IN_CORE, ROUNDING, FunctionTable
from mbma_tables.tables.members import RULES

LINE = 118  # letters
MAX_NAME = 40
POINTS = 64  # of a self-test
TOLERANCE = 1e-13  # relative, of a self-test
# of mbma.h, by the numbers of `IN_CORE`
POLICIES = ("MBMA_REFUSED", "MBMA_NEAREST", "MBMA_PERIODIC")
ENDS = {"c": "c", "fortran": "f90", "javascript": "mjs", "matlab": "m", "python": "py"}
C_KEYWORDS = """
    auto break case char const continue default do double else enum extern float for goto if
    inline int long register restrict return short signed sizeof static struct switch typedef
    union unsigned void volatile while main class function var let new delete this null
"""
MARKS = {"c": "/*", "fortran": "!", "javascript": "//", "matlab": "%", "python": "#"}
LANGUAGES = tuple(MARKS)
WHOLE = ("branches", "starts", "terms")  # arrays of whole numbers
FORTRAN_PART = 60  # numbers of a DATA statement


def _lines(texts: Sequence[str], end: str = "") -> str:
    """Numbers, separated by commas, in lines."""
    lines, line = [], ""
    for text in texts:
        if len(line) + len(text) > LINE:
            lines.append(line.rstrip() + end)
            line = ""
        line += f"{text}, "
    lines.append(line.rstrip().removesuffix(","))
    return "\n".join(lines)


def _fortran_number(text: str) -> str:
    if "e" in text:
        return text.replace("e", "d")
    return f"{text}d0" if "." in text else f"{text}.0d0"


def _fortran_data(name: str, texts: Sequence[str], indent: int = 2) -> str:
    """Numbers of an array as DATA statements, each of a few lines."""
    margin = " " * indent
    is_whole = name in WHOLE
    statements = []
    for start in range(0, len(texts), FORTRAN_PART):
        part = texts[start : start + FORTRAN_PART]
        part = part if is_whole else [_fortran_number(text) for text in part]
        body = _lines(part, " &").replace("\n", f"\n{margin}  ")
        ends = f"{start + 1}:{start + len(part)}"
        statements.append(f"{margin}data {name}({ends}) / &\n{margin}  {body} /")
    return "\n".join(statements)


def _about(table: FunctionTable, command: str) -> list[str]:
    """Paragraphs of a header."""
    certificate = json.loads(table.attributes["certificate"])
    errors = ", ".join(f"{n} {e:.2g}" for n, e in certificate["largest_error"].items())
    axes = "; ".join(
        f"{a.name} [{a.unit}] {number(a.low)} to {number(a.high)}, outside: {a.outside}"
        for a in table.axes
    )
    outputs = "; ".join(
        f"{o.name} [{o.unit}], {o.error} error"
        + (", of its logarithm" if o.transform == "log" else "")
        for o in table.outputs
    )
    return [
        f"{table.attributes['title']}: a table of {table.attributes['function']}.",
        f"Axes: {axes}. Outputs: {outputs}. Largest errors on {certificate['held_out_points']} "
        f"held-out points: {errors}.",
        f"Licence: {table.attributes['licence']}. Source: {table.attributes['source']}.",
        command,
    ]


def _parts(
    table: FunctionTable, name: str, language: str, command: str
) -> dict[str, Any]:
    """Places of the templates."""
    arrays = {
        key: numerals(array.astype(int) if key in WHOLE else array)
        for key, array in table.arrays.items()
    }
    rows = [
        [
            *map(number, (axis.low, axis.high, axis.offset)),
            *(number(float(axis.to_grid(end))) for end in (axis.low, axis.high)),
            str(int(axis.transform == "log")),
            str(IN_CORE[axis.outside]),
        ]
        for axis in table.axes
    ]
    points, expected = _replayed(table)
    terms = table.arrays["terms"]
    return {
        "name": name,
        "header": opening(_about(table, command), MARKS[language]),
        "axes": table.axes,
        "outputs": table.outputs,
        "axis_rows": rows,
        "arrays": arrays,
        "lines": _lines,
        "data": _fortran_data,
        "fortran": lambda row: [_fortran_number(text) for text in row],
        "points": numerals(points),
        "expected": numerals(expected),
        "least": [
            number(size if output.error == "absolute" else output.least)
            for output, size in zip(
                table.outputs, np.abs(expected).max(axis=0), strict=True
            )
        ],
        "tolerance": number(TOLERANCE),
        "directions": table.directions().tolist(),
        "rounding": number(ROUNDING),
        "number": number,
        "policies": [POLICIES[IN_CORE[axis.outside]] for axis in table.axes],
        # at least 3, since compilers look at the recurrence from the third on
        "most_terms": max(int(terms.max()), 3),
        "most_products": int(terms.prod(axis=1).max()),
        **_of_members(table, points),
    }


def _replayed(table: FunctionTable) -> tuple[Any, Any]:
    """Points of a self-test where the table has answers, and these."""
    draws = np.random.default_rng(1)
    columns = [
        np.asarray(axis.from_grid(low + (high - low) * draws.random(4 * POINTS)))
        for axis in table.axes
        for low, high in [(float(axis.to_grid(axis.low)), float(axis.to_grid(axis.high)))]
    ]
    found = table.lookup(*columns)
    values = np.stack([found.values[output.name] for output in table.outputs], axis=-1)
    good = np.flatnonzero(np.isfinite(values).all(axis=-1))[:POINTS]
    return np.stack(columns, axis=-1)[good], values[good]


def _of_members(table: FunctionTable, points: FloatArray) -> dict[str, Any]:
    """Further places of the templates of a table with members."""
    members = table.members
    if members is None:
        return {}
    found = table.lookup(*points.T, members=True)
    rows = [
        np.stack([spread.low, spread.high, spread.error, *spread.members], axis=-1)
        for spread in found.spread.values()
    ]
    starts = table.arrays["starts"].astype(int) * len(members.stored)
    return {
        "members": members.names,
        "stored": len(members.stored),
        "rule": members.rule,
        "meaning": RULES[members.rule],
        "number": number,
        "member_starts": numerals(starts),
        "spreads": numerals(np.stack(rows, axis=1)),
    }


def _c_files(parts: dict[str, Any], name: str) -> dict[str, str]:
    files = {
        f"{name}.{end}": filled(f"model/function/table.{end}", **parts)
        for end in ("c", "h")
    }
    files[f"{name}_selftest.c"] = filled("model/function/selftest.c", **parts)
    if "members" in parts:
        files |= {
            f"{name}_members{end}": filled(f"model/function/members{end}", **parts)
            for end in (".c", ".h", "_selftest.c")
        }
    return files | {
        each: core_file(each) for each in ("cells.c", "elementary.h", "four.h", "mbma.h")
    }


def function_code(
    table: FunctionTable, language: str, name: str = "table", command: str = ""
) -> dict[str, str]:
    """Source files of a table of a function, by their names.

    Parameters
    ----------
    table : FunctionTable
        From `open_table`.
    language : {"c", "fortran", "javascript", "matlab", "python"}
    name : str
        Of the function and of its files.
    command : str
        The command that writes them again, for their headers.

    Raises
    ------
    InputError
        For another language, or a name that is none in this language.
    """
    if language not in LANGUAGES:
        raise InputError(
            f"language must be one of {', '.join(LANGUAGES)}, got {language!r}"
        )
    mark = MARKS[language]
    text = template(f"model/function/table.{ENDS[language]}")
    names = (
        matlab_words(text)
        if language == "matlab"
        else small_words(
            words_of_code(text, re.escape(mark)), *keyword.kwlist, C_KEYWORDS
        )
    )
    checked_name(name, MAX_NAME, names, language)
    for axis in table.axes:
        checked_name(axis.name, MAX_NAME, (), f"{language} as a name of an axis")
    parts = _parts(table, name, language, command)
    if language == "c":
        return _c_files(parts, name)
    end = ENDS[language]
    return {f"{name}.{end}": filled(f"model/function/table.{end}", **parts)}
