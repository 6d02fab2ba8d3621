"""How a map that is not periodic is best continued.

Patches cut from periodic maps are simulated and compared with the whole maps. `python -m generate
edges` prints, for each way, errors against the simulation of the whole map at 1, 3, 10, 30 and 60%
contact: of ln A at equal F, of ln F at equal u, and of ln of the stiffness at equal F. A patch
differs from its map by itself, so that only differences between ways count. Then the time of a map,
and on how many it is the nearest.
"""

import os
import time
from collections.abc import Callable

import click
import numpy as np

from generate.machined.makers import FAMILIES, Part, heights
from mbma_tables import Surface
from mbma_tables.common import cache
from mbma_tables.common.arguments import FloatArray
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories import BoundaryElements

AREAS = np.array([0.01, 0.03, 0.1, 0.3, 0.6])
POINTS = 128  # of a patch, along a side
CORNER = (40, 70)  # where it is cut from
NUMBERS = (0, 2)  # of parts of each family


def blended(values: FloatArray, width: int) -> FloatArray:
    """A patch whose last rows and columns fade into the first, squares of weights adding to one."""
    turn = ((np.arange(width) + 0.5) / width * np.pi / 2)[:, None]
    for axis in (0, 1):
        rows = np.moveaxis(values, axis, 0)
        remaining = len(rows) - width
        joined = rows[:remaining].copy()
        joined[:width] = np.cos(turn) * rows[remaining:] + np.sin(turn) * rows[:width]
        values = np.moveaxis(joined, 0, axis)
    return np.asarray(values - values.mean())


def mirror_images(patch: FloatArray) -> AnySurface:
    return Surface.from_map(patch, 1.0, detrend="mean")


def edges_joined(patch: FloatArray) -> AnySurface:
    return Surface.from_map(patch, 1.0, periodic=True)


def blended_over_eighth(patch: FloatArray) -> AnySurface:
    return Surface.from_map(blended(patch, POINTS // 8), 1.0, periodic=True)


def blended_over_quarter(patch: FloatArray) -> AnySurface:
    return Surface.from_map(blended(patch, POINTS // 4), 1.0, periodic=True)


WAYS: dict[str, Callable[[FloatArray], AnySurface]] = {
    "mirror images": mirror_images,
    "edges joined": edges_joined,
    "blended over 1/8": blended_over_eighth,
    "blended over 1/4": blended_over_quarter,
}


def errors(part: Part) -> tuple[FloatArray, FloatArray]:
    """Errors by way, quantity and area, and seconds by way."""
    whole = heights(part)
    truth = BoundaryElements.of(Surface.from_map(whole, 1.0, periodic=True)).fit
    # the whole map's pressure, gap and stiffness at `AREAS`
    x = truth.log_force_at(AREAS)
    u = truth.separation(x)
    stiffness = truth.stiffness(x)
    force = np.exp(x)
    patch = whole[tuple(slice(start, start + POINTS) for start in CORNER)]
    missed = []
    seconds = []
    for way in WAYS.values():
        start = time.process_time()
        curve = BoundaryElements.of(way(patch - patch.mean())).fit
        seconds.append(time.process_time() - start)
        of_area = np.log(curve.area(x) / AREAS)
        of_force = (curve.separation(x) - u) * stiffness / force
        of_stiffness = np.log(curve.stiffness(x) / stiffness)
        missed.append([of_area, of_force, of_stiffness])
    return np.array(missed), np.array(seconds)


@click.command()
def edges() -> None:
    """Print the table."""
    os.environ[cache.VARIABLE] = "off"  # times are those of simulations
    of_parts = [errors(Part(family, number)) for number in NUMBERS for family in FAMILIES]
    missed = np.array([by_way for by_way, _ in of_parts])
    seconds = np.array([by_way for _, by_way in of_parts])
    nearest = np.sqrt(np.mean(missed**2, axis=-1)).argmin(axis=1)
    for k, way in enumerate(WAYS):
        rms = np.sqrt(np.mean(missed[:, k] ** 2, axis=(0, 2))).round(3)
        median = np.median(np.abs(missed[:, k]), axis=(0, 2)).round(3)
        time_of_map = f"{seconds[:, k].mean():.2f} s"
        best = f"nearest on {np.count_nonzero(nearest == k, axis=0)} of {len(of_parts)}"
        click.echo(f"{way}: rms {rms}, median {median}, {time_of_map}, {best}")
