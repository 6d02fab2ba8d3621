"""Draw docs/export.md (``python -m generate.pages.export``): targets, and what rows chosen by their error are worth."""

from __future__ import annotations

import pathlib
from typing import Any

import click

from generate.pages.page import png
from mbma_tables import Surface
from mbma_tables.export.law_rows import describe_law
from mbma_tables.files import write_file

PAGE, FIGURE = pathlib.Path("export.md"), pathlib.Path("figures") / "export.png"
NAMES = ("concrete", "asphalt", "yang-persson", "challenge")
ROWS = (20, 50, 200)
MODULUS = 13.3

TARGETS = [
    ("target", "what is written", "tried in"),
    (
        "`c`, `fortran`",
        ("the whole model: table lookup with derivatives, island geometry, totals, the standard closed form"),
        "gcc, g++, gfortran, with sanitizers",
    ),
    ("`javascript`, `python`", "the same in one file each", "node, Python"),
    (
        "`calculix`",
        "`*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TABULAR` or EXPONENTIAL, `*GAP CONDUCTANCE`",
        (
            "CalculiX 2.20: two blocks pressed together, reaction within 0.2% of the rows at 20 "
            "compressions, in mm-N-MPa and in SI"
        ),
    ),
    ("`abaqus`", "the same cards", "from the manual"),
    ("`lsdyna`", "`*DEFINE_CURVE`", "from the manual"),
    ("`optistruct`", "`PCONT`, `TABLES1`", "from the manual"),
    ("`comsol`, `moose`", "columns with comments", "from the manual"),
    ("`modelica`", "text for CombiTable", "the rule of the standard library's reader, not the reader itself"),
    ("`matlab`", "a `.mat` of version 5 and a function that looks it up", "Octave, to 1e-12"),
    ("`netcdf`, `hdf5`, `parquet`, `csv`, `json`", "rows with units and the header", "ncdump, h5py, pyarrow"),
]


def draw(path: pathlib.Path) -> None:
    """Rows of the concrete road, chosen by error and even, on the curve."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    surface = Surface.named("concrete")
    figure, axes = pyplot.subplots(figsize=(6, 4), layout="constrained")
    units: dict[str, Any] = {"length_unit": "mm", "stress_unit": "MPa"}
    fine = describe_law(surface, MODULUS, rows=500, **units)
    axes.semilogy(fine.x[1:], fine.y[1:], "k-", lw=0.8, label="model")
    for evenly, mark, label in ((False, "o", "chosen"), (True, "x", "even")):
        law = describe_law(surface, MODULUS, rows=20, evenly=evenly, **units)
        axes.semilogy(law.x[1:], law.y[1:], mark, label=f"20 rows, {label}: error {law.largest_error:.1%}")
    axes.set(xlabel="overclosure [mm]", ylabel="pressure [MPa]", ylim=(1e-4, 5))
    axes.grid(True, alpha=0.3)
    axes.legend()
    write_file(path, png(figure, dpi=130), make_folders=True)


def targets() -> str:
    """What is written for which target, and where it was tried."""
    head, *rows = TARGETS
    return "\n".join("| " + " | ".join(row) + " |" for row in (head, ("---",) * len(head), *rows))


def errors() -> str:
    """Largest errors of linear interpolation by surface and rows."""
    lines = ["| surface | rows | chosen | even | ratio |", "| --- | --- | --- | --- | --- |"]
    for name in NAMES:
        surface = Surface.named(name)
        for rows in ROWS:
            own, even = (
                describe_law(surface, MODULUS, length_unit="mm", stress_unit="MPa", rows=rows, evenly=evenly)
                for evenly in (False, True)
            )
            ratio = even.largest_error / own.largest_error
            lines.append(f"| {name} | {rows} | {own.largest_error:.1e} | {even.largest_error:.1e} | {ratio:.1f} |")
    return "\n".join(lines)


def page() -> str:
    """The text of the page."""
    return f"""# Tables and laws in other codes

    mbma export calculix --surface concrete --E-star 13.3 --length-unit mm --stress-unit MPa --out law.inp
    mbma export matlab --surface concrete --E-star 13.3 --length-unit mm --stress-unit MPa --rtol 1e-4 --out law.mat
    mbma export c --out model --check

The first two write a contact law of one surface; the last writes the whole model as C and replays its conformance
points in the compiled program. Each file opens with what it is: surface, E* and how it is formed, units, which gap,
the reading, the table's hashes, the range, and the largest error of the file against the model.

{targets()}

## Which gap, and where it starts

Laws are pressure against overclosure `c = h_max - u`, with `u = (h_max + d)/2` the mean separation: zero at first
contact. Place the bodies so that their surfaces touch where their mean planes are `h_max` apart. The rows end at
full compression, or where the force of the surface turns down. Conductance (`--conductivity`) is against pressure,
from the incremental stiffness (Barber 2003).

CalculiX 2.20 reads TABULAR rightly with `TYPE=NODE TO SURFACE` and a slave surface of element faces; of a slave
surface of nodes it took three times the area, and surface-to-surface and mortar contact read the table wrongly
without a message, so these are refused. It keeps the pressure constant beyond the last row; Abaqus goes on with the
last slope.

## Rows by their error

Rows are placed so that the chords between them err alike, and moved by half of that. Largest relative error of
linear interpolation, above a thousandth of the largest pressure:

{errors()}

A ratio of 5 was wanted: the surface `yang-persson`, whose pressure spans less, stays below it.

![twenty rows chosen by error and twenty even ones]({FIGURE.as_posix()})

This page and its figure: `python -m generate.pages.export --out docs`.
"""


@click.command()
@click.option("--out", type=click.Path(path_type=pathlib.Path, file_okay=False), default="docs", show_default=True)
def main(out: pathlib.Path) -> None:
    """Write the page and its figure."""
    draw(out / FIGURE)
    write_file(out / PAGE, page().encode())
    click.echo(out / PAGE)


if __name__ == "__main__":
    main()
