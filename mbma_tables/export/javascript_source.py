"""The model as one ECMAScript module, for pages and for node.

The table is at the end of the module, as the base64 text of its doubles: one file to serve, nothing to fetch, half the
length of decimals.
"""

from __future__ import annotations

import base64
import textwrap

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.export.numbers import Numbers
from mbma_tables.formulas.printers import assignments

USAGE = (
    "import { phi, phiSlopes, formula, islandGeometry, total } from './mbma.mjs'; no dependency, ECMAScript 2018. "
    "Answers are objects with a status, which is STATUS.OK where they hold numbers. "
    "`node mbma_selftest.mjs` replays the conformance points of mbma_conformance.csv."
)
TITLES = {
    "mbma.mjs": "mbma.mjs: the MBMA model as an ECMAScript module.",
    "mbma_selftest.mjs": "mbma_selftest.mjs: replays the conformance points of the MBMA model in JavaScript.",
}
TEMPLATES = ("mbma.mjs", "mbma_selftest.mjs")


def comment(lines: list[str]) -> str:
    """Lines as comments."""
    return "\n".join(f"// {line}".rstrip() for line in lines)


def encoded(values: FloatArray) -> str:
    """Little-endian doubles as base64 in lines."""
    text = base64.b64encode(np.ravel(values).astype("<f8").tobytes()).decode("ascii")
    return "\n".join(textwrap.wrap(text, 120))


def parts(numbers: Numbers) -> dict[str, str]:
    """What stands in the templates' places."""
    return {"FORMULA": _formula(numbers), "NUMBERS": _numbers(numbers)}


def _formula(numbers: Numbers) -> str:
    """The closed form's steps."""
    return "\n".join(f"  const {name} = {text};" for name, text in assignments(numbers.form, "javascript")) + (
        f"\n  return {{ {', '.join(f'{name}: {step}' for name, step in numbers.form.outputs.items())} }};"
    )


def _numbers(numbers: Numbers) -> str:
    """The table's part of the module."""
    lines = [f"const {name} = {value};" for name, value in numbers.whole.items()]
    lines += [f"const {name} = {value!r};" for name, value in numbers.scalars.items()]
    for name, values in numbers.arrays.items():
        if values.size < 100:
            lines += [f"const {name} = [", *textwrap.wrap(", ".join(map(repr, values.tolist())), 118), "];"]
        else:
            lines += [f"const {name} = decoded(`", encoded(values), "`);"]
    return "\n".join(lines)
