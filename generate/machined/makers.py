"""Surfaces as machining leaves them: periodic maps of 13 families.

Each is made anew from its family and a seed. Lengths in sampling steps. Every map is low-passed to
its shortest wavelength, has mean zero and rms gradient 0.1. The order in which random numbers are
drawn is part of a map: it must stay.
"""

import dataclasses
import zlib
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray

GRADIENT = 0.1
SHORTEST = (
    4.8,
    6.0,
    8.0,
)  # wavelengths; the last one has enough steps for half of the grid
Rng = np.random.Generator


@dataclasses.dataclass(frozen=True)
class Part:
    """A surface of a family: number, grid points along a side and shortest wavelength."""

    family: str
    number: int
    points: int = 256

    @property
    def name(self) -> str:
        return f"{self.family}_{self.number}_n{self.points}"

    @property
    def shortest(self) -> float:
        return SHORTEST[self.number % len(SHORTEST)]


def heights(part: Part) -> FloatArray:
    # of the family's name, so that a new family changes no other
    seed = zlib.crc32(part.family.encode()) % 10_000_000 * 100 + part.number
    rng = np.random.default_rng(seed)
    unfinished = FAMILIES[part.family](rng, part.points, part.shortest)
    return finished(unfinished, part.shortest)


def _waves(points: int) -> tuple[FloatArray, FloatArray]:
    q = np.asarray(2 * np.pi * np.fft.fftfreq(points), float)
    return q[:, None], q[None, :]


def _grid(coordinates: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Both coordinates of every point of a square grid."""
    x, y = np.meshgrid(coordinates, coordinates, indexing="ij")
    return x, y


def finished(values: FloatArray, shortest: float) -> FloatArray:
    """Without waves below the shortest, at mean zero and the common rms gradient."""
    q = np.hypot(*_waves(len(values)))
    # the mean, at q = 0, is left out; a wave at the limit itself stays whatever its rounding
    passed = (q > 0) & (q <= 2 * np.pi / shortest * (1 + 1e-9))
    transform = np.where(passed, np.fft.fft2(values), 0)
    # by Parseval's theorem
    gradient = np.sqrt(np.sum(np.abs(q * transform) ** 2)) / values.size
    return np.asarray(np.fft.ifft2(transform).real * (GRADIENT / gradient))


def rough(
    rng: Rng,
    points: int,
    longest: float,
    shortest: float,
    hurst: float,
    lay: float = 1.0,
) -> FloatArray:
    """Gaussian heights of standard deviation 1, rolled off at a wavelength.

    They are stretched `lay` times along the first axis.
    """
    qx, qy = _waves(points)
    q = np.hypot(qx * lay, qy)
    # self-affine above the roll-off wavenumber 2 pi/longest, flat below it
    over_roll_off = np.maximum(q * longest / (2 * np.pi), 1.0)
    amplitude = np.where(q <= 2 * np.pi / shortest, over_roll_off ** (-1 - hurst), 0)
    amplitude[0, 0] = 0
    noise = rng.standard_normal((points, points))
    values = np.fft.ifft2(np.fft.fft2(noise) * amplitude).real
    return np.asarray(values / values.std())


def _log(rng: Rng, low: float, high: float) -> float:
    """A random number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _fine(
    rng: Rng,
    points: int,
    shortest: float,
    low: float = 0.03,
    high: float = 0.2,
) -> FloatArray:
    """Fine roughness that every process leaves, of a random amplitude."""
    amplitude = _log(rng, low, high)
    return amplitude * rough(rng, points, 32, shortest, 0.8)


def gaussian(rng: Rng, points: int, shortest: float) -> FloatArray:
    longest = _log(rng, 32, points)
    hurst = rng.uniform(0.3, 1)
    return rough(rng, points, longest, shortest, hurst)


def turned(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Cusps of a feed, with roughness stretched along them."""
    feed = points / rng.integers(8, 24)
    lay = _log(rng, 2, 16)
    place = np.arange(points)
    # parabolic cusps, one a feed
    phase = place / feed % 1 - 0.5
    cusp = 4 * _log(rng, 0.7, 3) * phase**2
    # a lathe that is out of true by one wave a side
    waviness = rng.uniform(0, 0.2) * np.sin(2 * np.pi * place / points)
    profile = cusp + waviness
    torn = _log(rng, 0.25, 0.7) * rough(rng, points, 2 * feed, shortest, 0.7, lay)
    return profile + torn + _fine(rng, points, shortest)


def milled(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Cusps along arcs, of different depths."""
    x, y = _grid(np.arange(points))
    count = rng.integers(6, 16)
    bow = rng.uniform(5, 25)
    # number of the cusp, and the place across it
    place = count * (x + bow * np.sin(2 * np.pi * y / points)) / points
    depth_of_cusps = rng.uniform(0.6, 1.4, count)
    depth = depth_of_cusps[np.floor(place).astype(int) % count]
    lay = _log(rng, 1, 5)
    torn = 0.3 * rough(rng, points, 32, shortest, 0.8, lay)
    cusps = np.asarray(depth * np.abs(np.sin(np.pi * place)))
    return cusps + torn + _fine(rng, points, shortest)


def ground(rng: Rng, points: int, shortest: float) -> FloatArray:
    longest = _log(rng, 32, 96)
    hurst = rng.uniform(0.5, 0.9)
    lay = _log(rng, 2, 16)
    return rough(rng, points, longest, shortest, hurst, lay)


def honed(rng: Rng, points: int, shortest: float) -> FloatArray:
    """A worn plateau crossed by grooves at two angles."""
    x, y = _grid(np.arange(points))
    base = 0.8 * rough(rng, points, 64, shortest, 0.8)
    # whole numbers, so that grooves close on themselves
    steep = rng.integers(1, 3)
    depth = _log(rng, 1, 4)
    for slope in (-steep, steep):
        for _ in range(rng.integers(3, 7)):
            middle = rng.uniform(0, points)
            distance = (x + slope * y - middle + points / 2) % points - points / 2
            groove_depth = depth * rng.uniform(0.6, 1.4)
            width = rng.uniform(2, 4)
            base -= groove_depth * np.exp(-((distance / width) ** 2) / 2)
    plateau = np.quantile(base, rng.uniform(0.3, 0.7))
    return np.minimum(base, plateau) + _fine(rng, points, shortest)


def lapped(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Short scratches in every direction."""
    x, y = _grid(np.arange(points) - points / 2)
    values = _fine(rng, points, shortest, 0.1, 0.4)
    for _ in range(rng.integers(100, 300)):
        turn = rng.uniform(0, np.pi)
        length = _log(rng, 10, 40)
        width = rng.uniform(1.5, 3)
        along = x * np.cos(turn) + y * np.sin(turn)
        across = y * np.cos(turn) - x * np.sin(turn)
        depth = rng.exponential(1)
        scratch = depth * np.exp(-((along / length) ** 2 + (across / width) ** 2) / 2)
        values -= np.roll(scratch, rng.integers(0, points, 2), (0, 1))
    return values


def worn(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Gaussian heights cut off, with fine roughness on the plateaus."""
    longest = _log(rng, 32, 96)
    base = rough(rng, points, longest, shortest, 0.8)
    plateau = np.quantile(base, rng.uniform(0.3, 0.85))
    return np.minimum(base, plateau) + _fine(rng, points, shortest, 0.02, 0.15)


def sprayed(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Lognormal heights: peaks are higher than valleys are deep."""
    spread = rng.uniform(0.25, 0.75)
    return np.exp(spread * rough(rng, points, 64, shortest, 0.8))


def pitted(rng: Rng, points: int, shortest: float) -> FloatArray:
    return -sprayed(rng, points, shortest)


def etched(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Two levels with flanks between."""
    longest = _log(rng, 32, 64)
    base = rough(rng, points, longest, 10, 1)
    level = rng.uniform(-0.7, 0.7)
    width = _log(rng, 0.15, 0.5)
    return np.tanh((base - level) / width) / 2 + _fine(rng, points, shortest, 0.02, 0.1)


def eroded(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Craters of sparks, each over those before."""
    x, y = _grid(np.arange(points))
    values = np.zeros((points, points))
    smallest = rng.uniform(5, 8)
    depth_ratio = _log(rng, 0.1, 0.3)
    # so many that craters cover the face several times
    for _ in range(round(0.006 * points**2)):
        centre = rng.uniform(0, points, 2)
        radius = _log(rng, smallest, 3 * smallest)
        # distances to the nearest periodic image of the centre
        from_centre_x = (x - centre[0] + points / 2) % points - points / 2
        from_centre_y = (y - centre[1] + points / 2) % points - points / 2
        square = (from_centre_x**2 + from_centre_y**2) / radius**2
        inside = square < 1
        floor = values[inside].mean() + depth_ratio * radius * (0.7 * square - 0.55)
        rim = 0.25 * depth_ratio * radius * np.exp(-30 * (np.sqrt(square) - 1) ** 2)
        values = np.where(inside, floor, values + rim)
    return values + _fine(rng, points, shortest)


def patchy(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Roughness whose amplitude varies from place to place."""
    spread = rng.uniform(0.3, 0.9)
    amplitude = np.exp(spread * rough(rng, points, points, points / 4, 1))
    longest = _log(rng, 24, 64)
    return amplitude * rough(rng, points, longest, shortest, 0.8)


def dimpled(rng: Rng, points: int, shortest: float) -> FloatArray:
    """A lattice of parabolic dimples, every second row moved by half a pitch."""
    x, y = _grid(np.arange(points))
    pitch = points / rng.choice([4, 8, 16])
    row = np.floor(y / pitch)
    # distances to the nearest dimple's middle, in pitches
    off_x = ((x + pitch / 2 * (row % 2)) / pitch + 0.5) % 1 - 0.5
    off_y = ((y - pitch / 2) / pitch + 0.5) % 1 - 0.5
    radius = max(0.3 * pitch, 5.0)
    square = (off_x**2 + off_y**2) * (pitch / radius) ** 2
    depth = _log(rng, 0.7, 3)
    values = -depth * np.maximum(1 - square, 0)
    return np.asarray(values + _fine(rng, points, shortest, 0.05, 0.2))


_MAKERS: tuple[Callable[[Rng, int, float], FloatArray], ...] = (
    gaussian,
    turned,
    milled,
    ground,
    honed,
    lapped,
    worn,
    sprayed,
    pitted,
    etched,
    eroded,
    patchy,
    dimpled,
)
FAMILIES = {maker.__name__: maker for maker in _MAKERS}
