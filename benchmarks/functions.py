"""``python -m benchmarks functions``: tables of functions, the error on a million points that no table saw, and times.

It writes the table of docs/tables.md.
"""

import functools
import pathlib
import tempfile
import time
from typing import Any

import click
import numpy as np

from benchmarks.rows import microseconds, rounds
from generate import page
from generate.files import ROOT
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.variants import get_variant
from mbma_tables.tables.function_table import FunctionTable
from mbma_tables.tables.island4d import band_fields
from mbma_tables.tables.make_function import make, verified_errors, wanted_of
from mbma_tables.tables.schema import AXES, ISLAND4D

POINTS = 1_000_000
ISLAND_POINTS = 100_000  # an exact island takes 20 us
UNIT = {"low": 0.0, "high": 1.0}
HEADER = (
    "function | axes | target | cells | coefficients | made in | largest error | "
    "of points | above the bound | in C | in C with derivatives | "
    "lookup | lookup with derivatives"
)


def smooth(x: Any, y: Any) -> Any:
    """Five decades in one axis."""
    return np.exp(x * y / 5) * x**1.5


def kinked(x: Any, y: Any) -> Any:
    """A kink across one axis."""
    return 1 + np.abs(x - 0.4231) + y * y


def steep(x: Any, y: Any) -> Any:
    """A step along a diagonal, 1/40 wide."""
    return 2 + np.tanh(40 * (x + y - 1))


def periodic(x: Any, y: Any, z: Any) -> Any:
    """Periodic along one axis."""
    return 3 + np.sin(2 * np.pi * x) * np.cos(3 * y) + z


def four(x: Any, y: Any, z: Any, w: Any) -> Any:
    """Four numbers."""
    return 1 / (1 + x + 2 * y * z + w * w)


def six(a: Any, b: Any, c: Any, d: Any, e: Any, f: Any) -> Any:
    """Six numbers."""
    return np.exp(-(a * b + c * d + e * f))


def island(X: Any, spread: Any, sphere: Any, hurst: Any) -> Any:
    """Force and area of an island over those of a rigid sphere, on the axes of the four-number table."""
    mu = band_fields(spread, sphere, hurst, get_variant("reported"))[0]
    solved = greenwood_tripp.solve(X, mu, rtol=1e-9)
    rigid = greenwood_tripp.rigid_sphere(X, mu)
    return solved.phi_F / rigid[0], solved.phi_A / rigid[1]


def _island_axes() -> dict[str, Any]:
    """The ranges of the shipped four-number table."""
    from mbma_tables.tables.configuration import load

    axes = load(ISLAND4D).axes
    return {
        name: {"low": axes[name].low, "high": axes[name].high}
        | ({"transform": "log", "offset": axes[name].offset} if kind == "log" else {})
        for name, kind in AXES[ISLAND4D]
    }


LOG = {"outputs": {"force": {"transform": "log"}, "area": {"transform": "log"}}}
CASES: dict[str, tuple[dict[str, Any], float]] = {
    "smooth": (
        {"axes": {"x": {"low": 1e-4, "high": 10.0, "transform": "log"}, "y": UNIT}},
        1e-6,
    ),
    "kinked": ({"axes": {"x": UNIT, "y": UNIT}}, 1e-6),
    "steep": ({"axes": {"x": UNIT, "y": UNIT}}, 1e-6),
    "periodic": (
        {"axes": {"x": UNIT | {"outside": "periodic"}, "y": UNIT, "z": UNIT}},
        1e-6,
    ),
    "four": ({"axes": dict.fromkeys("xyzw", UNIT)}, 1e-6),
    "six": ({"axes": dict.fromkeys("abcdef", UNIT)}, 1e-4),
}


def row_of(
    name: str, entries: dict[str, Any], target: float, points: int
) -> list[page.Cell]:
    """A line of the page's table."""
    wanted = wanted_of(
        {"function": f"benchmarks.functions:{name}", "chunk": 1024} | entries,
        target=target,
    )
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        table = make(wanted, pathlib.Path(folder, "table.nc"), workers=2)
        seconds = time.perf_counter() - start
    assert isinstance(table, FunctionTable)
    largest, above = 0.0, 0
    for error, bound, size in (
        block.swapaxes(0, 1) for block in verified_errors(table, points)
    ):
        largest = max(largest, float((error / size).max()))
        above += int((error > bound).any(axis=0).sum())
    draws = np.random.default_rng(3)
    x = np.stack(
        [
            axis.from_grid(
                draws.uniform(axis.to_grid(axis.low), axis.to_grid(axis.high), 20_000)
            )
            for axis in table.axes
        ],
        axis=-1,
    )
    taken = rounds(
        {
            "core": functools.partial(table._answers, x, False),
            "core slopes": functools.partial(table._answers, x, True),
            "values": functools.partial(table.lookup, *x.T),
            "slopes": functools.partial(table.lookup, *x.T, derivatives=1),
        }
    )
    return [
        name,
        str(len(table.axes)),
        f"{target:.0e}",
        f"{len(table.arrays['starts']):,}",
        f"{table.arrays['coefficients'].size:,}",
        page.duration(seconds),
        f"{largest:.1e}",
        f"{points:,}",
        str(above),
        *(page.duration(1e-6 * microseconds(t, len(x))) for t in taken.values()),
    ]


@click.command()
@click.option("--out", type=click.Path(path_type=pathlib.Path), default=ROOT)
def functions(out: pathlib.Path) -> None:
    """Make tables of seven functions, measure them, and write docs/tables.md (two minutes)."""
    cells = [row_of(name, *case, POINTS) for name, case in CASES.items()]
    cells.append(row_of("island", {"axes": _island_axes()} | LOG, 2e-5, ISLAND_POINTS))
    text = page.table(HEADER, cells)
    click.echo(text)
    for path in page.write("docs/tables.md", {"functions": text}, {}, out):
        click.echo(path)
