"""Pages of the documentation: hand-written Markdown, with blocks and figures that programs fill.

`PAGES` has for each page the function that measures it, as "module:function". It returns
the text of the blocks between ``<!-- measured: BLOCK -->`` and ``<!-- end -->`` of the
page, and figures and data by their path in the checkout. ``python -m generate pages NAME``
writes them.
"""

import contextlib
import importlib
import itertools
import math
import pathlib
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import click
from click.testing import CliRunner

from generate.files import ROOT
from mbma_tables.common.files import write_file
from mbma_tables.common.plots import new_figure, to_picture

PAGES = {
    **{
        name: f"pages.library:{name}"
        for name in ("architecture", "formula", "readme", "tables", "theories")
    },
    **{name: f"pages.laws:{name}" for name in ("calibrated", "leakage", "yielding")},
    **{name: f"pages.maps:{name}" for name in ("gallery", "machined", "maps")},
    **{
        name: f"pages.simulations:{name}"
        for name in ("data", "fidelity", "joints", "lubrication", "rough_bodies")
    },
    **{name: f"pages.{name}:measure" for name in ("cost", "stability")},
    "explorer": "explorer:measure",
}
PAGES["yield"] = PAGES.pop("yielding")
Measured = tuple[dict[str, str], dict[str, Any]]  # blocks and files
MARKED = re.compile(r"(<!-- measured: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def measured(name: str) -> Measured:
    module, _, function = PAGES[name].partition(":")
    found: Measured = getattr(importlib.import_module(f"generate.{module}"), function)()
    return found


def fill(text: str, parts: Mapping[str, str]) -> str:
    """Replace the marked blocks of a page; marks and parts must have the same names."""
    found = [match[2] for match in MARKED.finditer(text)]
    if sorted(found) != sorted(parts):
        raise click.ClickException(
            f"the page marks {sorted(found)}, measured were {sorted(parts)}"
        )
    return MARKED.sub(lambda match: f"{match[1]}\n{parts[match[2]]}\n\n{match[3]}", text)


def write(
    name: str, parts: Mapping[str, str], files: Mapping[str, Any], out: pathlib.Path
) -> list[pathlib.Path]:
    """Write a page and its files, given as bytes or as figures, below a folder; returns their paths."""
    page = "README.md" if name == "readme" else f"docs/{name}.md"
    contents = {
        page: fill((ROOT / page).read_text(encoding="utf-8"), parts).encode(),
        **files,
    }
    for place, content in contents.items():
        write_file(
            out / place,
            content if isinstance(content, bytes) else svg(content),
            make_folders=True,
        )
    return [out / place for place in contents]


def printed(command: str) -> str:
    """A command `mbma ...` with what it prints."""
    from mbma_tables.cli import main

    with contextlib.chdir(ROOT):
        done = CliRunner().invoke(main, command.split()[1:], catch_exceptions=False)
    return f"```\n$ {command}\n{done.stdout.strip()}\n```"


def table(header: str, rows: Iterable[Iterable[Any]], formats: str = "{}") -> str:
    """A Markdown table, of names and formats of columns with bars between them; the last format holds for the rest.

    Strings are copied, None leaves a cell empty, a number that is not finite becomes a
    dash, and a tuple fills a format of several fields.
    """
    known = formats.split(" | ")

    def cell(column: int, value: Any) -> str:
        if isinstance(value, str) or value is None:
            return value or ""
        values = value if isinstance(value, tuple) else (value,)
        if not all(math.isfinite(x) for x in values if not isinstance(x, str)):
            return "—"
        return known[min(column, len(known) - 1)].format(*values)

    lines = [
        header.split(" | "),
        ["---"] * (header.count(" | ") + 1),
        *(map(cell, itertools.count(), r) for r in rows),
    ]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def percent(value: float) -> str:
    """A fraction in percent to two digits; a dash where it is not finite."""
    return f"{float(f'{100 * value:.2g}'):g}" if math.isfinite(value) else "—"


def duration(seconds: float) -> str:
    """A time to two digits, in its unit."""
    unit, size = next(
        ((u, s) for u, s in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)) if seconds >= s),
        ("ns", 1e-9),
    )
    return f"{float(f'{seconds / size:.2g}'):g} {unit}"


def spans(edges: Sequence[float], form: str = "{:g}-{:g}%") -> str:
    """Headers of bins of contact in percent, from their edges as fractions."""
    return " | ".join(form.format(100 * a, 100 * b) for a, b in itertools.pairwise(edges))


def panels(
    rows: int = 1, columns: int = 1, size: tuple[float, float] = (9, 3.4), **options: Any
) -> tuple[Any, Any]:
    figure = new_figure(*size)
    return figure, figure.subplots(rows, columns, **options)


def svg(figure: Any) -> bytes:
    """A figure as the content of an SVG file, the same bytes for the same figure."""
    return to_picture(figure, "svg", dpi=100, outlines=True)
