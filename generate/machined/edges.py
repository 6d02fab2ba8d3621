"""How a map that is not periodic is best continued: patches cut from periodic maps, simulated, against the whole maps.

`python -m generate edges` prints, for each way, errors against the simulation of the whole map at 1, 3, 10, 30
and 60% contact: of ln A at equal F, of ln F at equal u, and of ln of the stiffness at equal F; a patch differs from its
map by itself, so that only differences between ways tell. Then the time of a map, and on how many it is the nearest.
"""

import os
import time
from collections.abc import Callable
from typing import Any

import click
import numpy as np

from generate.machined.makers import FAMILIES, Part, heights
from mbma_tables import Surface
from mbma_tables.common import cache
from mbma_tables.common.arguments import FloatArray
from mbma_tables.theories import BoundaryElements

AREAS = np.array([0.01, 0.03, 0.1, 0.3, 0.6])
POINTS, CORNER, NUMBERS = 128, (40, 70), (0, 2)


def blended(values: FloatArray, width: int) -> FloatArray:
    """A patch whose last rows and columns fade into the first, squares of both weights adding to one."""
    for axis in (0, 1):
        rows = np.moveaxis(values, axis, 0)
        turn = ((np.arange(width) + 0.5) / width * np.pi / 2)[:, None]
        joined = rows[: len(rows) - width].copy()
        joined[:width] = np.cos(turn) * rows[len(rows) - width :] + np.sin(turn) * rows[:width]
        values = np.moveaxis(joined, 0, axis)
    return np.asarray(values - values.mean())


WAYS: dict[str, Callable[[FloatArray], Any]] = {
    "mirror images": lambda patch: Surface.from_map(patch, 1.0, detrend="mean"),
    "edges joined": lambda patch: Surface.from_map(patch, 1.0, periodic=True),
    "blended over 1/8": lambda patch: Surface.from_map(blended(patch, POINTS // 8), 1.0, periodic=True),
    "blended over 1/4": lambda patch: Surface.from_map(blended(patch, POINTS // 4), 1.0, periodic=True),
}


def errors(part: Part) -> tuple[FloatArray, FloatArray]:
    """Errors by way, quantity and area, and seconds by way."""
    whole = heights(part)
    truth = BoundaryElements.of(Surface.from_map(whole, 1.0, periodic=True)).fit
    x = truth.log_force_at(AREAS)
    u, stiffness, force = truth.separation(x), truth.stiffness(x), np.exp(x)
    patch = whole[tuple(slice(start, start + POINTS) for start in CORNER)]
    found, seconds = [], []
    for way in WAYS.values():
        start = time.process_time()
        curve = BoundaryElements.of(way(patch - patch.mean())).fit
        seconds.append(time.process_time() - start)
        by_force = np.log(curve.area(x) / AREAS), np.log(curve.stiffness(x) / stiffness)
        found.append([by_force[0], (curve.separation(x) - u) * stiffness / force, by_force[1]])
    return np.array(found), np.array(seconds)


@click.command()
def edges() -> None:
    """Print the table."""
    os.environ[cache.VARIABLE] = "off"  # times are those of simulations
    found = [errors(Part(family, number)) for number in NUMBERS for family in FAMILIES]
    missed, seconds = (np.array(each) for each in zip(*found, strict=True))
    nearest = np.sqrt(np.mean(missed**2, axis=-1)).argmin(axis=1)
    for k, way in enumerate(WAYS):
        rms = np.sqrt(np.mean(missed[:, k] ** 2, axis=(0, 2))).round(3)
        median = np.median(np.abs(missed[:, k]), axis=(0, 2)).round(3)
        best = np.count_nonzero(nearest == k, axis=0)
        click.echo(
            f"{way}: rms {rms}, median {median}, {seconds[:, k].mean():.2f} s, nearest on {best} of {len(found)}"
        )
