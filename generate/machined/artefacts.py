"""Which artefacts of measurement are told, and what those that are not do to contact.

Artefacts are planted in maps of all families, which are then simulated as from a file, cut off at
four sampling steps. `python -m generate artefacts` prints, by kind, how many maps are valid though
their area is wrong by more than three standard deviations at 3 or 10% contact, how many are told,
and of how many the area is wrong. First comes the number of maps without artefacts that are told.
"""

import dataclasses
import itertools
import zlib
from collections.abc import Callable, Iterator

import click
import numpy as np

from generate.machined.makers import FAMILIES, Part, Rng, heights
from mbma_tables import Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import MbmaError
from mbma_tables.surfaces.any_surface import AnySurface

POINTS = 96  # along a side
CUTOFF = 4.004  # sampling steps
AREAS = np.array([0.03, 0.1])  # of the map without the artefact
LARGEST = 3.0  # standard deviations
NUMBERS = (1, 2)  # of parts of each family: 6 and 8 steps a shortest wavelength


@dataclasses.dataclass(frozen=True)
class Artefact:
    """A kind of artefact, in points and standard deviations of height.

    `plant` returns what it adds to heights of unit standard deviation.
    """

    name: str
    plant: Callable[[Rng, tuple[int, int]], FloatArray]


def squares(side: int, share: float, height: float) -> Artefact:
    """Squares of some points along a side, on a share of the map, up or down."""

    def plant(rng: Rng, shape: tuple[int, int]) -> FloatArray:
        added = np.zeros(shape)
        count = max(1, round(share * added.size / side**2))
        for _ in range(count):
            row, column = (int(rng.integers(0, size - side)) for size in shape)
            level = height * rng.choice([-1.0, 1.0])
            added[row : row + side, column : column + side] = level
        # at least one of them up, on which contact begins
        added[row : row + side, column : column + side] = height
        return added

    return Artefact(f"{side} x {side} on {share:g}, {height:g} h_rms", plant)


def step(angle: float, height: float) -> Artefact:
    """A step along a line through the middle, at an angle in degrees to the columns."""

    def plant(rng: Rng, shape: tuple[int, int]) -> FloatArray:
        row, column = np.indices(shape) - np.reshape(shape, (2, 1, 1)) / 2
        turn = np.deg2rad(angle)
        side = row * np.cos(turn) + column * np.sin(turn) + rng.uniform(-5, 5)
        return np.where(side > 0, height, 0.0)

    return Artefact(f"step at {angle:g} degrees, {height:g} h_rms", plant)


def tiles(side: int, height: float) -> Artefact:
    """A chequerboard of tiles, as of images that were joined."""

    def plant(rng: Rng, shape: tuple[int, int]) -> FloatArray:
        row, column = np.indices(shape) // side
        return np.where((row + column) % 2, height, 0.0)

    return Artefact(f"tiles of {side} points, {height:g} h_rms", plant)


def scars(count: int, height: float) -> Artefact:
    """Rows that a scanning probe lost over a quarter to the whole of their length."""

    def plant(rng: Rng, shape: tuple[int, int]) -> FloatArray:
        added = np.zeros(shape)
        for row in rng.choice(shape[0], count, replace=False):
            first = int(rng.integers(0, 3 * shape[1] // 4))
            added[row, first : first + int(rng.integers(shape[1] // 4, shape[1]))] = (
                height
            )
        return added

    return Artefact(f"{count} scars, {height:g} h_rms", plant)


KINDS: list[Artefact] = [
    *itertools.starmap(
        squares,
        itertools.product((1, 2, 3, 4, 5), (1e-3, 6e-3, 0.02), (3.0, 8.0)),
    ),
    *itertools.starmap(step, itertools.product((0.0, 90.0, 20.0, 45.0), (0.5, 1.5))),
    *itertools.starmap(tiles, itertools.product((16, 32), (0.5, 1.5))),
    *itertools.starmap(scars, ((1, 3.0), (5, 1.5))),
]


def with_artefact(part: Part, artefact: Artefact) -> tuple[FloatArray, FloatArray]:
    """The heights of a part with an artefact, and without."""
    clean = heights(part)
    rng = np.random.default_rng(zlib.crc32(f"{part.name} {artefact.name}".encode()))
    return clean + clean.std() * artefact.plant(rng, clean.shape), clean


def opened(values: FloatArray) -> AnySurface:
    return Surface.from_map(values, 1.0, short_cutoff=CUTOFF)


def deviation(spoilt: AnySurface, clean: AnySurface) -> float:
    """The largest error of the area in standard deviations that both maps state."""
    right = contact(clean, area=AREAS, theory="simulated")
    answer = contact(spoilt, pressure=right.pressure, theory="simulated")
    scatter = np.hypot(answer.area_scatter, right.area_scatter)
    errors = np.abs(np.log(answer.area / AREAS)) / scatter
    # where there is no scatter, nothing is stated
    return float(np.nanmax(errors, initial=0.0))


def parts() -> Iterator[Part]:
    for family, number in itertools.product(FAMILIES, NUMBERS):
        yield Part(family, number, POINTS)


@click.command()
@click.option("--every", default=5, help="One part in so many of each kind.")
def artefacts(every: int) -> None:
    """Print the table."""
    every_part = list(parts())
    doubted = [part.name for part in every_part if opened(heights(part)).doubts]
    click.echo(f"without artefacts: {len(doubted)} of {len(every_part)} told {doubted}")
    missed_in_all = 0
    planted = 0
    for k, artefact in enumerate(KINDS):
        missed = []
        told = wrong = count = 0
        for part in every_part[k % every :: every]:
            values, clean = with_artefact(part, artefact)
            spoilt = opened(values)
            count += 1
            told += bool(spoilt.doubts)
            try:
                error = deviation(spoilt, opened(clean))
            except MbmaError:
                # it has no answer, which is no wrong one
                error = 0.0
            wrong += error > LARGEST
            if error > LARGEST and not spoilt.doubts:
                missed.append(f"{part.name} {error:.1f}")
        click.echo(
            f"{artefact.name}: {len(missed)} of {count} missed, {told} told, {wrong} wrong {missed}"
        )
        planted += count
        missed_in_all += len(missed)
    click.echo(f"{missed_in_all} of {planted} missed")
