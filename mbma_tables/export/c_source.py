"""The model as C99: a header, a source, and the table that the source includes; C++ compiles it too.

The table is text, in shortest decimals that give back every bit, so that the files mean the same to any compiler on any
machine; 120 000 numbers are 2.5 MB of text and a fraction of a second of compiling.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator

from mbma_tables.arguments import FloatArray
from mbma_tables.export.numbers import Numbers
from mbma_tables.formulas.printers import assignments

USAGE = (
    "Compile mbma.c, which includes mbma_table.h, and link the C mathematics library: cc -std=c99 -O2 -c mbma.c. "
    "Every function may be called from any thread; nothing is allocated and nothing is kept between calls. "
    "mbma_selftest.c replays the conformance points of mbma_conformance.csv."
)
TITLES = {
    "mbma.h": "mbma.h: the MBMA model in C99, declarations.",
    "mbma.c": "mbma.c: the MBMA model in C99.",
    "mbma_table.h": "mbma_table.h: the numbers of the MBMA model in C99, for mbma.c alone.",
    "mbma_selftest.c": "mbma_selftest.c: replays the conformance points of the MBMA model in C99.",
}
TEMPLATES = ("mbma.h", "mbma.c", "mbma_selftest.c")
NUMBERS_FILE = "mbma_table.h"


def comment(lines: list[str]) -> str:
    """Lines inside a block comment."""
    return "\n".join(f" * {line}".rstrip() for line in lines)


def _rows(values: FloatArray, indent: str) -> Iterator[str]:
    if values.ndim == 1:
        text = ", ".join(repr(float(value)) for value in values)
        yield from textwrap.wrap(text, 120, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False)
        return
    for row in values:
        yield f"{indent}{{"
        yield from _rows(row, indent + "  ")
        yield f"{indent}}},"


def parts(numbers: Numbers) -> dict[str, str]:
    """What stands in the templates' places."""
    return {"FORMULA": _formula(numbers)}


def _formula(numbers: Numbers) -> str:
    """The closed form's steps and results."""
    form = numbers.form
    lines = [f"const double {name} = {text};" for name, text in assignments(form, "c")]
    lines += [f"answer->{name} = {step};" for name, step in form.outputs.items()]
    return "\n".join(f"    {line}" for line in lines)


def numbers_text(numbers: Numbers, header: list[str]) -> str:
    """The table's own file."""
    lines = ["/*", comment(header), " */", "#ifndef MBMA_TABLE_H", "#define MBMA_TABLE_H", ""]
    lines += [f"#define MBMA_{name} {value}" for name, value in numbers.whole.items()]
    lines += [f"#define MBMA_{name} ({value!r})" for name, value in numbers.scalars.items()]
    for name, values in numbers.arrays.items():
        extents = "".join(f"[{extent}]" for extent in values.shape)
        lines += ["", f"static const double MBMA_{name}{extents} = {{", *_rows(values, "  "), "};"]
    lines += ["", "#endif", ""]
    return "\n".join(lines)
