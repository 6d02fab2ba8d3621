"""What the pages of the documentation share.

A page is Markdown in ``docs``, written by hand but for what stands between ``<!-- measured: NAME -->`` and
``<!-- end -->``. A module of this folder with the page's name has a function ``measure`` that returns those parts by
name, and other files (figures, data) by their path in the checkout. ``python -m generate pages NAME`` writes them.
"""

from __future__ import annotations

import math
import pathlib
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import click

from mbma_tables.files import write_file

ROOT = pathlib.Path(__file__).parents[2]
PAGES = (
    "calibrated",
    "cost",
    "explorer",
    "export",
    "fidelity",
    "formula",
    "gallery",
    "leakage",
    "maps",
    "readme",
    "stability",
    "tables",
    "ten_minutes",
    "theories",
    "yield",
)
MARKED = re.compile(r"(<!-- measured: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def fill(text: str, parts: Mapping[str, str]) -> str:
    """Put the measured parts into a page; marks and parts must be the same."""
    found = [match[2] for match in MARKED.finditer(text)]
    if sorted(found) != sorted(parts):
        raise click.ClickException(f"the page marks {sorted(found)}, measured were {sorted(parts)}")
    return MARKED.sub(lambda match: f"{match[1]}\n{parts[match[2]]}\n\n{match[3]}", text)


def write(name: str, parts: Mapping[str, str], files: Mapping[str, bytes], out: pathlib.Path) -> list[pathlib.Path]:
    """Write a page and its files below a folder; returns their paths."""
    page = "README.md" if name == "readme" else f"docs/{name}.md"
    text = fill((ROOT / page).read_text(encoding="utf-8"), parts)
    written = []
    for place, content in {page: text.encode(), **files}.items():
        path = out / place
        write_file(path, content, make_folders=True)
        written.append(path)
    return written


def table(header: Iterable[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    names = list(header)
    lines = [names, ["---"] * len(names), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def percent(value: float, sign: str = "") -> str:
    """A distance in percent, two digits; a dash where there is none."""
    return f"{float(f'{100 * value:.2g}'):g}{sign}" if math.isfinite(value) else "—"


def pyplot() -> Any:
    """Matplotlib's pyplot, drawing without a display."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    return plt


def svg(figure: Any) -> bytes:
    """A figure as the content of an SVG file, the same bytes for the same figure; closes it."""
    from matplotlib import pyplot

    from mbma_tables.plots import to_picture

    content = to_picture(figure, "svg", dpi=100, outlines=True)
    pyplot.close(figure)
    return content
