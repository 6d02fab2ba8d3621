"""The core's own C as a part of exported files, and a law's block as data for it."""

from __future__ import annotations

import importlib.resources
import re
from collections.abc import Iterable, Iterator

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.export.text import wrapped
from mbma_tables.theories import law_block as at

# functions that other files see, where they are made
_MADE = re.compile(r"^(?!static|typedef|MBMA_INLINE)\w[\w *]*\b(mbma_\w+)\([^{;]*\{$", re.M)


def core_file(name: str) -> str:
    """A file of the core, as the library is compiled from it."""
    return (importlib.resources.files("mbma_tables.core") / name).read_text(encoding="utf-8")


def core_text(sources: Iterable[str], prefix: str) -> str:
    """Sources of the core and their headers as one text, unchanged but for the lines that include them.

    Their functions begin with a prefix there, so that a program may hold several such texts.
    """
    texts = {name: core_file(name) for name in ("mbma.h", "elementary.h", *sources)}
    made = (name for text in texts.values() for name in _MADE.findall(text))
    renamed = [f"#define {name} {prefix}_{name}" for name in made]
    parts = [re.sub(r'^#include ".*"\n', "", text, flags=re.M) for text in texts.values()]
    return "\n".join(["/* functions of the core, which this file holds, under names of its own */", *renamed, *parts])


def block_rows(block: FloatArray) -> tuple[int, int]:
    """How many rows and records a law's block has."""
    first = int(block.view(np.int64)[at.RECORDS])
    return (first - at.HEAD) // 2, (block.size - first) // at.RECORD


def block_text(block: FloatArray) -> str:
    """A law's block as the initializer of head, rows and records in C, every number as it is."""
    rows, _ = block_rows(block)
    whole = block.view(np.int64)
    head = [*map(repr, block[: at.EXPONENT].tolist()), *map(str, whole[at.EXPONENT : at.HEAD].tolist())]
    pairs = whole[at.HEAD : at.HEAD + 2 * rows].reshape(-1, 2).tolist()
    records = block[at.HEAD + 2 * rows :].reshape(-1, at.RECORD)
    lines = [f"{{{wrapped(head)}}},", f"{{{wrapped(f'{{{shift}, {base}}}' for shift, base in pairs)}}},"]
    return "\n".join([*lines, "{", *(f"{wrapped(_record(row.tolist()))}," for row in records), "}"])


def _record(row: list[float]) -> Iterator[str]:
    """The numbers of a record with the braces of its structure."""
    begins, ends = (at.CENTRE, at.FORCE_AT, at.AREA_AT), (at.AREA_AT - 1, at.ENERGY_AT - 1, at.ENERGY_AT)
    for k, value in enumerate(row):
        yield f"{'{' if k in begins else ''}{value!r}{'}' if k in ends else ''}"
