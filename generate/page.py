"""Pages of the documentation: hand-written Markdown, with blocks and figures that programs fill.

`PARTS` of `__main__.py` has for each part the page it fills and the function that measures
it. The function returns the text of blocks between ``<!-- measured: BLOCK -->`` and
``<!-- end -->`` of the page, and figures and data by their path in the checkout.
``python -m generate pages NAME`` writes them.
"""

from __future__ import annotations

import contextlib
import itertools
import math
import pathlib
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import click
from click.testing import CliRunner

from generate.files import ROOT
from mbma_tables.common.files import write_file
from mbma_tables.common.plots import new_figure, to_picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Picture: TypeAlias = "bytes | Figure"  # the content of a file, or what it is drawn from
Measured: TypeAlias = tuple[dict[str, str], dict[str, Picture]]  # blocks and files
# of a table: a tuple fills a format of several fields
Cell: TypeAlias = str | float | tuple[str | float, ...] | None
UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}  # of time, longest first
MARKED = re.compile(r"(<!-- measured: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def fill(text: str, parts: Mapping[str, str]) -> str:
    """Replace the marked blocks of a page that were measured; another program writes the others."""
    marked = [match[2] for match in MARKED.finditer(text)]
    if not set(parts) <= set(marked):
        raise click.ClickException(
            f"the page marks {sorted(marked)}, measured were {sorted(parts)}"
        )

    def filled(match: re.Match[str]) -> str:
        if match[2] not in parts:
            return match[0]
        return f"{match[1]}\n{parts[match[2]]}\n\n{match[3]}"

    return MARKED.sub(filled, text)


def write(
    page: str, parts: Mapping[str, str], files: Mapping[str, Picture], out: pathlib.Path
) -> list[pathlib.Path]:
    """Write a page and its files, given as bytes or as figures, below a folder.

    The page is named by its path in the checkout. Returns the paths that were written.
    """
    text = (ROOT / page).read_text(encoding="utf-8")
    contents: dict[str, Picture] = {page: fill(text, parts).encode(), **files}
    for place, content in contents.items():
        body = content if isinstance(content, bytes) else svg(content)
        write_file(out / place, body, make_folders=True)
    return [out / place for place in contents]


def printed(command: str) -> str:
    """A command `mbma ...` with what it prints."""
    from mbma_tables.cli import main

    with contextlib.chdir(ROOT):
        done = CliRunner().invoke(main, command.split()[1:], catch_exceptions=False)
    return f"```\n$ {command}\n{done.stdout.strip()}\n```"


def table(header: str, rows: Iterable[Iterable[Cell]], formats: str = "{}") -> str:
    """A Markdown table.

    Names and formats of columns have bars between them; the last format holds for the rest.
    Strings are copied, None leaves a cell empty, a number that is not finite becomes a
    dash, and a tuple fills a format of several fields.
    """
    names = header.split(" | ")
    format_of_column = formats.split(" | ")
    lines = [names, ["---"] * len(names)]
    for row in rows:
        texts = []
        for column, value in enumerate(row):
            form = format_of_column[min(column, len(format_of_column) - 1)]
            texts.append(_cell(value, form))
        lines.append(texts)
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _cell(value: Cell, form: str) -> str:
    """The text of a cell of `table`."""
    if isinstance(value, str) or value is None:
        return value or ""
    values = value if isinstance(value, tuple) else (value,)
    numbers = [part for part in values if not isinstance(part, str)]
    if not all(math.isfinite(number) for number in numbers):
        return "—"
    return form.format(*values)


def percent(value: float) -> str:
    """A fraction in percent to two digits; a dash where it is not finite."""
    return f"{float(f'{100 * value:.2g}'):g}" if math.isfinite(value) else "—"


def as_error(deviation: float) -> str:
    """A difference of logarithms in percent, or as a factor where it is large."""
    if deviation < 0.5:
        return f"{100 * math.expm1(deviation):.2g}%"
    return f"factor {math.exp(deviation):.2g}"


def duration(seconds: float) -> str:
    """A time to two digits, in its unit."""
    unit = next((unit for unit, size in UNITS.items() if seconds >= size), "ns")
    return f"{float(f'{seconds / UNITS[unit]:.2g}'):g} {unit}"


def seconds(text: str) -> float:
    """A time from its text by `duration`."""
    number, unit = text.split()
    return float(number) * UNITS[unit]


def spans(edges: Sequence[float], form: str = "{:g}-{:g}%") -> str:
    """Headers of bins of contact in percent, from their edges as fractions."""
    return " | ".join(form.format(100 * a, 100 * b) for a, b in itertools.pairwise(edges))


def panels(
    rows: int = 1, columns: int = 1, size: tuple[float, float] = (9, 3.4), **options: Any
) -> tuple[Figure, Any]:
    """A figure and its axes: one of them, or an array."""
    figure = new_figure(*size)
    return figure, figure.subplots(rows, columns, **options)


def svg(figure: Figure) -> bytes:
    """A figure as the content of an SVG file, the same bytes for the same figure."""
    return to_picture(figure, "svg", dpi=100, outlines=True)
