"""Contacts answered from traces of simulated maps: errors, coverage and shares that are valid.

Traces are cut from maps of the groups machined and elastic. `python -m generate profiles`
compares contacts at the pressures of the simulations with 1 to 60% contact, and writes every
error with its stated standard deviation. The least number of longest wavelengths for which
results are valid was chosen by other maps of the groups (`--first 0`).
"""

import csv
import dataclasses
import gzip
import io
import itertools
import json
import pathlib
import zlib
from collections.abc import Iterator
from typing import Any

import click
import numpy as np
from scipy.ndimage import map_coordinates
from tqdm import tqdm

from generate.boundary_elements import surfaces
from generate.files import dataset
from generate.machined.campaign import parts
from generate.machined.makers import GRADIENT, heights
from mbma_tables import Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.files import write_file
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.surfaces.treatment import squares

OBLIQUE = np.arctan(0.618)  # angle to an axis, whose tangent is no simple ratio
RANGE = (0.01, 0.6)  # A/A0 of the contacts that count
# families without a lay, of which isotropic=True is true
ISOTROPIC = (
    "gaussian",
    "self_affine",
    "plateau",
    "filtered",
    "peaks",
    "valleys",
    "worn",
    "patchy",
    "lapped",
    "sprayed",
    "pitted",
    "etched",
    "eroded",
    "dimpled",
)
POINTS = (128, 512)  # along a side
FILE = pathlib.Path("docs/data/profiles.csv.gz")
TRACES = ((8, 1), (32, 1), (32, 3))  # sides of each trace, and traces in a direction
COLUMNS = (
    "family",
    "map",
    "way",
    "sides",
    "traces",
    "quantity",
    "area",
    "error",
    "scatter",
    "valid",
)
QUANTITIES = ("area", "mean_separation", "stiffness")


@dataclasses.dataclass(frozen=True, eq=False)
class Simulated:
    """A map, and its contacts with 1 to 60% contact, E* = 1."""

    family: str
    name: str
    heights: FloatArray
    steps: tuple[float, float]
    pressure: FloatArray
    answers: dict[str, FloatArray]  # by quantity


def machined(every: int, first: int) -> Iterator[Simulated]:
    """One in so many maps of the group machined."""
    data = dataset("machined")
    for part in parts()[first::every]:
        one = data.sel(surface=part.name)
        area = one.area.values.astype(float)
        counts = (area >= RANGE[0]) & (area <= RANGE[1])
        answers = {name: one[name].values.astype(float)[counts] for name in QUANTITIES}
        pressure = one.pressure.values.astype(float)[counts]
        yield Simulated(
            part.family, part.name, heights(part), (1.0, 1.0), pressure, answers
        )


def elastic(every: int, first: int) -> Iterator[Simulated]:
    """One in so many maps of the group elastic, of 128 to 512 points a side."""
    data = dataset("elastic")
    kinds = data.kind.attrs["flag_meanings"].split()
    numbers = ("kind", "hurst", "zeta_1", "waves", "seed", "points", "shape")
    sides = data.points.values
    chosen = np.flatnonzero((sides >= POINTS[0]) & (sides <= POINTS[1]))
    for place in chosen[first::every]:
        one = data.isel(surface=place)
        kind, hurst, zeta_1, waves, seed, points, shape = (
            one[name].item() for name in numbers
        )
        recipe = surfaces.Recipe(
            kinds[int(kind)], hurst, zeta_1, int(waves), int(seed), int(points), shape
        )
        values = surfaces.heights(recipe)
        x, y = (size / points for size in recipe.sizes)
        # heights of unit standard deviation become those of a common gradient
        up = GRADIENT / float(np.sqrt(squares(values, (x, y))[1]))
        area = one.area.values.astype(float)
        counts = (area >= RANGE[0]) & (area <= RANGE[1])
        by = {"area": 1.0, "mean_separation": up, "stiffness": GRADIENT / up}
        answers = {
            name: factor * one[name].values.astype(float)[counts]
            for name, factor in by.items()
        }
        pressure = GRADIENT * one.force.values.astype(float)[counts]
        yield Simulated(recipe.kind, recipe.name, up * values, (x, y), pressure, answers)


def cut(one: Simulated, sides: int, count: int, axis: int) -> list[FloatArray]:
    """Traces of so many sides of the map, which is continued periodically.

    Those of families without a lay are oblique, so that they see all of the map; others are
    nearly along an axis, and advance along the other one by one side.
    """
    rng = np.random.default_rng(zlib.crc32(f"{one.name} {axis}".encode()))
    values = one.heights if axis == 0 else one.heights.T
    points, others = values.shape
    angle = OBLIQUE if one.family in ISOTROPIC else np.arctan(1 / sides)
    distance = np.arange(sides * points)
    along, aside = distance * np.cos(angle), distance * np.sin(angle) * others / points
    found = []
    for start in rng.random((count, 2)):
        places = [start[0] * points + along, start[1] * others + aside]
        line = map_coordinates(values, places, order=5, mode="grid-wrap")
        found.append(np.asarray(line, float))
    return found


def surface_of(one: Simulated, sides: int, count: int, way: str) -> MeasuredSurface:
    """The surface of traces in two directions ("both"), or in one."""
    along = cut(one, sides, count, 0)
    step_x, step_y = one.steps
    if way == "one":
        return Surface.from_profile(along, step_x, isotropic=True)
    across = cut(one, sides, count, 1)
    # of one step: the coarser one
    every = max(1, round(step_x / step_y))
    across = [trace[::every] for trace in across]
    return Surface.from_profile(along, step_x, across=across)


def rows_of(
    one: Simulated, traces: tuple[tuple[int, int], ...] = TRACES
) -> Iterator[dict[str, Any]]:
    """Relative errors and standard deviations of every contact, of all traces of a map."""
    ways = ("one", "both") if one.family in ISOTROPIC else ("both",)
    for (sides, count), way in itertools.product(traces, ways):
        surface = surface_of(one, sides, count, way)
        found = contact(surface, pressure=one.pressure, theory="calibrated")
        gap = np.asarray(found.mean_separation)
        scatter = {
            "area": found.area_scatter,
            "mean_separation": np.asarray(found.separation_scatter) / gap,
            "stiffness": found.stiffness_scatter,
        }
        for name, deviation in scatter.items():
            error = np.log(found.quantity(name) / one.answers[name])
            columns = (one.answers["area"], error, deviation, found.valid)
            for area, *numbers, valid in zip(*map(np.asarray, columns), strict=True):
                row = (one.family, one.name, way, sides, count, name)
                texts = (f"{number:.4g}" for number in (area, *numbers))
                yield dict(zip(COLUMNS, (*row, *texts, int(valid)), strict=True))


@dataclasses.dataclass(frozen=True)
class Reduced:
    """A number of one trace beside that of its map.

    Attributes
    ----------
    number : str
        "h_rms" or "rms_gradient".
    sides : int
        Length of the trace, in sides of the map.
    waves : float
        Longest wavelengths that it holds.
    ratio : float
        The number over that of the map.
    deviation : float
        The standard error that is stated for it, relative.
    """

    number: str
    sides: int
    waves: float
    ratio: float
    deviation: float


def reduced(one: Simulated) -> Iterator[Reduced]:
    """What one trace of each length in `TRACES` says of a map, and its stated error."""
    true = squares(one.heights - one.heights.mean(), one.steps)
    for sides in dict.fromkeys(length for length, _ in TRACES):
        surface = surface_of(one, sides, 1, "one")
        (stated,) = (step for step in surface.provenance if step["step"] == "errors")
        length = sides * one.heights.shape[0] * one.steps[0]
        waves = length * float(surface.longest) / (2 * np.pi)
        for number, square in zip(("h_rms", "rms_gradient"), true, strict=True):
            ratio = float(getattr(surface, number)) / float(np.sqrt(square))
            yield Reduced(number, sides, waves, ratio, stated[number])


def read(path: pathlib.Path = FILE) -> list[dict[str, str]]:
    """The rows of the file."""
    with gzip.open(path, "rt", encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def table(rows: list[dict[str, str]]) -> str:
    """By families and traces: maps, the share of valid contacts, and their coverage."""
    lines = ["| traces | directions | maps | valid | within one | within two | largest |"]
    lines.append("| --- " * 7 + "|")
    for (sides, count), way in itertools.product(TRACES, ("one", "both")):
        key = (str(sides), str(count), way)
        own = [row for row in rows if (row["sides"], row["traces"], row["way"]) == key]
        valid = [row for row in own if row["valid"] == "1"]
        z = np.abs([float(row["error"]) / float(row["scatter"]) for row in valid])
        shares = [f"{np.mean(z <= most):.0%}" for most in (1, 2)] if valid else ["-", "-"]
        largest = f"{z.max():.1f}" if valid else "-"
        maps = len({row["map"] for row in own})
        name = f"{count} of {sides} sides"
        share = f"{len(valid) / max(len(own), 1):.0%}"
        cells = (name, way, str(maps), share, *shares, largest)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


@click.command()
@click.option("--every", default=8, help="One map in so many of each group,")
@click.option("--first", default=4, help="from this one on.")
@click.option("--folder", default="profiles", help="Rows of each map, to resume.")
def profiles(every: int, first: int, folder: str) -> None:
    """Compare contacts answered from traces with simulations: ten minutes of a core."""
    place = pathlib.Path(folder)
    place.mkdir(exist_ok=True)
    found: list[dict[str, Any]] = []
    maps = itertools.chain(machined(every, first), elastic(every, first))
    for one in tqdm(maps, disable=None):
        path = place / f"{one.name}.json"
        if not path.exists():
            write_file(path, json.dumps(list(rows_of(one))).encode())
        found += json.loads(path.read_text(encoding="utf-8"))
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(found)
    write_file(FILE, gzip.compress(text.getvalue().encode(), mtime=0))
    click.echo(table(read()))
