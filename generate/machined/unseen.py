"""Surfaces of kinds that no law and no scatter was fitted to, as a check of both.

Each maker has the arguments of those of `generate.machined.makers`.
"""

from collections.abc import Callable

import numpy as np

from generate.machined.makers import Rng, rough
from mbma_tables.common.arguments import FloatArray


def _grid(points: int) -> tuple[FloatArray, FloatArray]:
    """Both coordinates of every point, from 0 to 1."""
    place = np.arange(points) / points
    return place[:, None] + np.zeros(points), place + np.zeros((points, 1))


def _tooth(phase: FloatArray) -> FloatArray:
    """A triangle between 0 and 1 of period 1."""
    return np.asarray(2 * np.abs(phase % 1 - 0.5))


def _centres(
    rng: Rng, points: int, count: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Number of the nearest of some random centres at every point, and distances to two."""
    x, y = _grid(points)
    centres = rng.random((count, 2))
    apart_x = (x[..., None] - centres[:, 0] + 0.5) % 1 - 0.5
    apart_y = (y[..., None] - centres[:, 1] + 0.5) % 1 - 0.5
    distance = np.hypot(apart_x, apart_y)
    nearest = distance.argmin(axis=-1)
    two = np.partition(distance, 1, axis=-1)
    return nearest, two[..., 0], two[..., 1]


def knurled(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Pyramids between two sets of V grooves."""
    x, y = _grid(points)
    count = rng.integers(4, 9)
    pyramids = np.minimum(_tooth(count * (x + y)), _tooth(count * (x - y)))
    return pyramids + 0.05 * rough(rng, points, 24, shortest, 0.8)


def printed(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Round beads of different heights side by side."""
    _, y = _grid(points)
    count = int(rng.integers(5, 12))
    across = 2 * (count * y % 1) - 1
    level = rng.normal(0, 0.15, count)[np.floor(count * y).astype(int) % count]
    beads = np.sqrt(np.maximum(1 - 0.9 * across**2, 0))
    return np.asarray(beads + level + 0.1 * rough(rng, points, 32, shortest, 0.7, 4.0))


def peened(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Round dents, the deepest of which remains everywhere."""
    x, y = _grid(points)
    values = np.zeros((points, points))
    for _ in range(150):
        radius = rng.uniform(0.06, 0.14)
        centre = rng.random(2)
        square = ((x - centre[0] + 0.5) % 1 - 0.5) ** 2
        square += ((y - centre[1] + 0.5) % 1 - 0.5) ** 2
        depth = rng.uniform(0.7, 1.0) * radius
        values = np.minimum(values, depth * (square / radius**2 - 1))
    return values + 0.003 * rough(rng, points, 24, shortest, 0.8)


def grained(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Facets of different levels and tilts."""
    nearest, _, _ = _centres(rng, points, 60)
    x, y = _grid(points)
    tilt = rng.normal(0, 1.0, (2, 60))
    level = rng.normal(0, 0.1, 60)
    planes = level + tilt[0] * rng.random(60) + tilt[1] * rng.random(60)
    facets = 0.3 * planes[nearest] + 0.1 * np.sin(2 * np.pi * (x + y))
    return np.asarray(facets + 0.1 * rough(rng, points, 32, shortest, 0.8))


def cracked(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Rough plates with deep cracks between them."""
    _, first, second = _centres(rng, points, 40)
    crack = np.exp(-(((second - first) * points / 4) ** 2))
    return rough(rng, points, 48, shortest, 0.7) - rng.uniform(2, 6) * crack


def rippled(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Asymmetric ripples whose phase wanders."""
    x, _ = _grid(points)
    phase = rng.integers(5, 11) * x + 0.15 * rough(rng, points, points / 2, 16, 1.0)
    lee = rng.uniform(0.65, 0.85)
    part = phase % 1
    ripples = np.where(part < lee, part / lee, (1 - part) / (1 - lee))
    return ripples + 0.05 * rough(rng, points, 24, shortest, 0.8)


def honeycombed(rng: Rng, points: int, shortest: float) -> FloatArray:
    """A lattice of cells with walls of one level."""
    x, y = _grid(points)
    count = int(rng.integers(4, 8))
    waves = np.zeros((points, points))
    for along, across in ((1, 0), (0, 1), (1, 1)):
        waves += np.cos(2 * np.pi * count * (along * x + across * y))
    walls = np.minimum(-waves, rng.uniform(0.3, 1.0))
    return walls + 0.05 * rough(rng, points, 24, shortest, 0.8)


def woven(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Threads that pass over and under each other."""
    x, y = _grid(points)
    count = rng.integers(3, 7)
    warp = np.abs(np.sin(np.pi * count * x)) + 0.5 * np.sin(np.pi * count * y)
    weft = np.abs(np.sin(np.pi * count * y)) - 0.5 * np.sin(np.pi * count * x)
    return np.maximum(warp, weft) + 0.08 * rough(rng, points, 24, shortest, 0.8)


def splashed(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Spots of a laser with raised rims on a rough face."""
    x, y = _grid(points)
    values = 0.15 * rough(rng, points, 64, shortest, 0.8)
    for _ in range(rng.integers(10, 40)):
        radius = rng.uniform(0.03, 0.07)
        centre = rng.random(2)
        apart = np.hypot((x - centre[0] + 0.5) % 1 - 0.5, (y - centre[1] + 0.5) % 1 - 0.5)
        values += np.exp(-(((apart / radius - 1) / 0.3) ** 2))
        values -= 1.5 * np.exp(-((apart / radius / 0.7) ** 2))
    return values


def faced(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Arcs around a centre beside the map, of a feed that varies."""
    x, y = _grid(points)
    radius = np.hypot(x - 0.5, y + rng.uniform(0.5, 1.5))
    cusps = _tooth(rng.uniform(8, 16) * radius + 0.1 * np.sin(20 * radius)) ** 2
    return cusps + 0.15 * rough(rng, points, 32, shortest, 0.6)


def fibrous(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Long thin fibres on each other."""
    x, y = _grid(points)
    values = 0.1 * rough(rng, points, 48, shortest, 0.8)
    for _ in range(25):
        turn = rng.choice([0.0, 0.5]) * np.pi + rng.normal(0, 0.15)
        apart = (x - rng.random()) * np.cos(turn) + (y - rng.random()) * np.sin(turn)
        width = rng.uniform(0.02, 0.04)
        values = np.maximum(
            values, values / 2 + np.sqrt(np.maximum(1 - (apart / width) ** 2, 0))
        )
    return values


UNSEEN: dict[str, Callable[[Rng, int, float], FloatArray]] = {
    maker.__name__: maker
    for maker in (
        knurled,
        printed,
        peened,
        grained,
        cracked,
        rippled,
        honeycombed,
        woven,
        splashed,
        faced,
        fibrous,
    )
}
