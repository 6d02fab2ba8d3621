"""Which artefacts of measurement are reported, and what those that are not do to contact.

Artefacts are planted in maps of all families, which are then simulated as from a file, cut off at
four sampling steps. `python -m generate artefacts` writes, by kind, of how many maps results are not
valid ("reported"), of how many the area is wrong by more than three standard deviations at 3 or 10%
contact, and of how many of these nothing is reported: neither a doubt nor a note on a bow. The
first row is of maps without artefacts.
"""

import dataclasses
import itertools
import pathlib
import zlib
from collections.abc import Callable, Iterator
from typing import Any

import click
import numpy as np
import pandas as pd

from generate.files import ROOT
from generate.machined import raw_maps
from generate.machined.makers import FAMILIES, Part, Rng, heights
from mbma_tables import Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import MbmaError
from mbma_tables.surfaces.any_surface import AnySurface

POINTS = 96  # along a side
CUTOFF = 4.004  # sampling steps
AREAS = np.array([0.03, 0.1])  # of the map without the artefact
LARGEST = 3.0  # standard deviations
CLEAN = "bow, highest place"  # what maps of these families may have by nature
FILE = ROOT / "docs/data/artefacts.csv"
NUMBERS = (1, 2)  # of parts of each family: 6 and 8 steps a shortest wavelength


@dataclasses.dataclass(frozen=True)
class Artefact:
    """A kind of artefact, in points and standard deviations of height.

    `plant` returns heights of unit standard deviation with it, undefined ones as NaN.
    """

    group: str
    name: str
    plant: Callable[[Rng, FloatArray], FloatArray]


def squares(side: int, share: float, height: float) -> Artefact:
    """Squares of some points along a side, on a share of the map, up or down."""

    def plant(rng: Rng, values: FloatArray) -> FloatArray:
        added, shape = np.zeros(values.shape), values.shape
        count = max(1, round(share * added.size / side**2))
        for _ in range(count):
            row, column = (int(rng.integers(0, size - side)) for size in shape)
            level = height * rng.choice([-1.0, 1.0])
            added[row : row + side, column : column + side] = level
        # at least one of them up, on which contact begins
        added[row : row + side, column : column + side] = height
        return values + added

    group = "spikes" if side == 1 else "dust"
    return Artefact(group, f"{side} x {side} on {share:g}, {height:g} h_rms", plant)


def step(angle: float, height: float) -> Artefact:
    """A step along a line through the middle, at an angle in degrees to the columns."""

    def plant(rng: Rng, values: FloatArray) -> FloatArray:
        shape = values.shape
        row, column = np.indices(shape) - np.reshape(shape, (2, 1, 1)) / 2
        turn = np.deg2rad(angle)
        side = row * np.cos(turn) + column * np.sin(turn) + rng.uniform(-5, 5)
        return np.asarray(values + np.where(side > 0, height, 0.0))

    return Artefact("steps", f"step at {angle:g} degrees, {height:g} h_rms", plant)


def tiles(side: int, height: float) -> Artefact:
    """A chequerboard of tiles, as of images that were joined."""

    def plant(rng: Rng, values: FloatArray) -> FloatArray:
        row, column = np.indices(values.shape) // side
        return np.asarray(values + np.where((row + column) % 2, height, 0.0))

    return Artefact("steps", f"tiles of {side} points, {height:g} h_rms", plant)


def scars(count: int, height: float) -> Artefact:
    """Rows that a scanning probe lost over a quarter to the whole of their length."""

    def plant(rng: Rng, values: FloatArray) -> FloatArray:
        added, shape = np.zeros(values.shape), values.shape
        for row in rng.choice(shape[0], count, replace=False):
            first = int(rng.integers(0, 3 * shape[1] // 4))
            added[row, first : first + int(rng.integers(shape[1] // 4, shape[1]))] = (
                height
            )
        return values + added

    return Artefact("lost lines", f"{count} scars, {height:g} h_rms", plant)


def repeated(count: int) -> Artefact:
    """Rows in which an instrument gave the one before again."""

    def plant(rng: Rng, values: FloatArray) -> FloatArray:
        spoilt = values.copy()
        for row in np.sort(rng.choice(np.arange(1, len(values)), count, replace=False)):
            spoilt[row] = spoilt[row - 1]
        return spoilt

    return Artefact("lost lines", f"{count} rows repeated", plant)


def holes(side: int, share: float) -> Artefact:
    """Squares of undefined points, which are filled."""

    def plant(rng: Rng, values: FloatArray) -> FloatArray:
        spoilt = values.copy()
        for _ in range(max(1, round(share * values.size / side**2))):
            row, column = (int(rng.integers(0, size - side)) for size in values.shape)
            spoilt[row : row + side, column : column + side] = np.nan
        return spoilt

    return Artefact("filled holes", f"{side} x {side} undefined on {share:g}", plant)


def clipped(share: float, sign: int) -> Artefact:
    """Heights beyond the range of an instrument."""

    def plant(rng: Rng, values: FloatArray) -> FloatArray:
        end = np.quantile(sign * values, 1 - share)
        return np.asarray(sign * np.minimum(sign * values, end))

    which = "highest" if sign > 0 else "lowest"
    return Artefact("saturation", f"{which} {share:g} saturated", plant)


def bow(height: float, axes: int) -> Artefact:
    """A parabola along one axis or both, up or down."""

    def plant(rng: Rng, values: FloatArray) -> FloatArray:
        x, y = (np.linspace(-1, 1, size) ** 2 for size in values.shape)
        form = x[:, None] + (y if axes == 2 else np.zeros_like(y))
        form = (form - form.mean()) / form.std()
        return np.asarray(values + rng.choice([-1.0, 1.0]) * height * form)

    return Artefact("bow", f"bow along {axes} axes, {height:g} h_rms", plant)


def tilt(height: float) -> Artefact:
    """A plane along an axis and across it."""

    def plant(rng: Rng, values: FloatArray) -> FloatArray:
        x, y = (np.linspace(-height, height, size) for size in values.shape)
        return np.asarray(values + np.add.outer(x, -y))

    return Artefact("tilt", f"tilt by {height:g} h_rms", plant)


KINDS: list[Artefact] = [
    *itertools.starmap(
        squares,
        itertools.product((1, 2, 3, 4, 5), (1e-3, 6e-3, 0.02), (3.0, 8.0)),
    ),
    *itertools.starmap(step, itertools.product((0.0, 90.0, 20.0, 45.0), (0.5, 1.5))),
    *itertools.starmap(tiles, itertools.product((16, 32), (0.5, 1.5))),
    *itertools.starmap(scars, ((1, 3.0), (5, 1.5))),
    *itertools.starmap(squares, ((1, 1e-5, 3.0), (1, 1e-4, 8.0), (1, 0.05, 8.0))),
    *map(repeated, (1, 5)),
    *itertools.starmap(holes, ((1, 1e-3), (5, 0.01), (5, 0.03), (12, 0.03))),
    *itertools.starmap(clipped, ((0.005, 1), (0.03, 1), (0.03, -1))),
    *itertools.starmap(bow, itertools.product((1.0, 2.0, 4.0), (1, 2))),
    *map(tilt, (1.0, 10.0)),
    *itertools.starmap(bow, itertools.product((0.2, 0.35, 0.5, 0.7), (1, 2))),
]


def with_artefact(part: Part, artefact: Artefact) -> tuple[FloatArray, FloatArray]:
    """The heights of a part with an artefact, and without."""
    clean = heights(part)
    rng = np.random.default_rng(zlib.crc32(f"{part.name} {artefact.name}".encode()))
    scale = clean.std()
    return scale * artefact.plant(rng, clean / scale), clean


def opened(values: FloatArray, **options: Any) -> AnySurface:
    return Surface.from_map(values, 1.0, short_cutoff=CUTOFF, **options)


def deviation(spoilt: AnySurface, clean: AnySurface) -> float:
    """The largest error of the area in standard deviations that both maps state."""
    right = contact(clean, area=AREAS, theory="simulated")
    answer = contact(spoilt, pressure=right.pressure, theory="simulated")
    scatter = np.hypot(answer.area_scatter, right.area_scatter)
    errors = np.abs(np.log(answer.area / AREAS)) / scatter
    # where there is no scatter, nothing is stated
    return float(np.nanmax(errors, initial=0.0))


def has_note(surface: AnySurface) -> bool:
    """Whether a bow is reported that is no doubt, since waves of the surface may be one."""
    return any("a bow has" in step.get("told", "") for step in surface.provenance)


def parts() -> Iterator[Part]:
    for family, number in itertools.product(FAMILIES, NUMBERS):
        yield Part(family, number, POINTS)


def planted(artefact: Artefact, chosen: list[Part]) -> dict[str, Any]:
    """A row of the table: numbers of maps, of those reported, wrong, and wrong but not reported."""
    reported = wrong = missed = 0
    for part in chosen:
        values, clean = with_artefact(part, artefact)
        spoilt = opened(values)
        reported += bool(spoilt.doubts)
        try:
            error = deviation(spoilt, opened(clean, confirmed=CLEAN))
        except MbmaError:
            # it has no answer, which is no wrong one
            error = 0.0
        wrong += error > LARGEST
        missed += error > LARGEST and not (spoilt.doubts or has_note(spoilt))
    counts = {"maps": len(chosen), "reported": reported, "wrong": wrong, "missed": missed}
    return {"group": artefact.group, "artefact": artefact.name, **counts}


def without() -> dict[str, Any]:
    """The row of maps without artefacts: machined ones, and raw ones of all kinds."""
    doubted = [bool(opened(heights(part)).doubts) for part in parts()]
    for kind, number in itertools.product(raw_maps.KINDS, range(900, 904)):
        values, periodic = raw_maps.raw(kind, number)
        doubted.append(bool(Surface.from_map(values, 1.0, periodic=periodic).doubts))
    counts = {"maps": len(doubted), "reported": sum(doubted), "wrong": 0, "missed": 0}
    return {"group": "none", "artefact": "none", **counts}


@click.command()
@click.option("--every", default=6, help="One part in so many of each kind.")
@click.option("--out", type=click.Path(path_type=pathlib.Path), default=FILE)
def artefacts(every: int, out: pathlib.Path) -> None:
    """Write the table; stopped and called again, it goes on where it was."""
    rows = pd.read_csv(out).to_dict("records") if out.exists() else [without()]
    every_part = list(parts())
    done = {row["artefact"] for row in rows}
    for k, artefact in enumerate(KINDS):
        if artefact.name not in done:
            rows.append(planted(artefact, every_part[k % every :: every]))
            click.echo(rows[-1])
        pd.DataFrame(rows).to_csv(out, index=False)
