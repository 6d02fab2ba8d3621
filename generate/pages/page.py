"""Helpers of the programs that write the documentation's tables and figures.

A page is hand-written Markdown in ``docs``, except for the blocks between ``<!-- measured: NAME -->`` and
``<!-- end -->``. The module of this folder with the page's name has a function ``measure`` that returns these blocks by
name, and other files (figures, data) by their path in the checkout. ``python -m generate pages NAME`` writes them.
"""

from __future__ import annotations

import csv
import functools
import io
import itertools
import math
import pathlib
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from mbma_tables.common.files import write_file

if TYPE_CHECKING:
    from generate.boundary_elements.evidence import Case

ROOT = pathlib.Path(__file__).parents[2]
DATA = ROOT / "docs" / "data"
PAGES = (
    *("calibrated", "cost", "explorer", "export", "fidelity", "formula", "gallery", "leakage", "machined", "maps"),
    *("readme", "stability", "tables", "ten_minutes", "theories", "yield"),
)
MARKED = re.compile(r"(<!-- measured: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)
Measured = tuple[dict[str, str], dict[str, bytes]]  # what a page's `measure` returns: blocks and files


def fill(text: str, parts: Mapping[str, str]) -> str:
    """Replace the marked blocks of a page; marks and parts must have the same names."""
    found = [match[2] for match in MARKED.finditer(text)]
    if sorted(found) != sorted(parts):
        raise click.ClickException(f"the page marks {sorted(found)}, measured were {sorted(parts)}")
    return MARKED.sub(lambda match: f"{match[1]}\n{parts[match[2]]}\n\n{match[3]}", text)


def write(name: str, parts: Mapping[str, str], files: Mapping[str, bytes], out: pathlib.Path) -> list[pathlib.Path]:
    """Write a page and its files below a folder; returns their paths."""
    page = "README.md" if name == "readme" else f"docs/{name}.md"
    contents = {page: fill((ROOT / page).read_text(encoding="utf-8"), parts).encode(), **files}
    for place, content in contents.items():
        write_file(out / place, content, make_folders=True)
    return [out / place for place in contents]


def table(header: Iterable[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    names = list(header)
    return "\n".join("| " + " | ".join(line) + " |" for line in [names, ["---"] * len(names), *rows])


def percent(value: float, sign: str = "") -> str:
    """A fraction in percent to two digits; a dash where it is not finite."""
    return f"{float(f'{100 * value:.2g}'):g}{sign}" if math.isfinite(value) else "—"


def duration(seconds: float) -> str:
    """A time to two digits, in its unit."""
    unit, size = next(((u, s) for u, s in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)) if seconds >= s), ("ns", 1e-9))
    return f"{float(f'{seconds / size:.2g}'):g} {unit}"


def spans(edges: Sequence[float], digits: str = "g") -> list[str]:
    """Headers of bins of contact in percent, from their edges as fractions."""
    return [f"{100 * a:{digits}}-{100 * b:{digits}}" for a, b in itertools.pairwise(edges)]


def to_csv(head: str, names: Sequence[str], rows: Iterable[Iterable[Any]]) -> bytes:
    """A CSV file with a head of comments."""
    text = io.StringIO()
    text.write(head)
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(names)
    lines.writerows(rows)
    return text.getvalue().encode()


def read_csv(name: str) -> Any:
    """A CSV file of docs/data with comments and a line of names, as a structured array."""
    lines = [line for line in (DATA / name).read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return np.genfromtxt(lines, delimiter=",", names=True, dtype=None, encoding=None)


@functools.cache
def dataset(path: str | pathlib.Path) -> Any:
    """A netCDF file in memory."""
    import xarray as xr

    with xr.open_dataset(path) as opened:
        return opened.load()


@functools.cache
def evidence() -> tuple[Case, ...]:
    """The simulated surfaces of docs/data/boundary_elements.nc."""
    from generate.boundary_elements.evidence import cases

    return tuple(cases(dataset(DATA / "boundary_elements.nc")))


def panels(rows: int = 1, columns: int = 1, size: tuple[float, float] = (9, 3.4), **options: Any) -> tuple[Any, Any]:
    """A figure and its axes, drawn without a display."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    return pyplot.subplots(rows, columns, figsize=size, layout="constrained", **options)


def svg(figure: Any) -> bytes:
    """A figure as the content of an SVG file, the same bytes for the same figure; closes it."""
    from matplotlib import pyplot

    from mbma_tables.common.plots import to_picture

    content = to_picture(figure, "svg", dpi=100, outlines=True)
    pyplot.close(figure)
    return content


def unmarked(figure: Any) -> Any:
    """The axes of a figure of theories, their lines without markers."""
    for axes in figure.axes:
        for line in axes.lines:
            line.set_marker("")
    return figure.axes
