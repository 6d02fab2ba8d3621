"""Surfaces as machining leaves them: periodic maps of 13 families, each made anew from its family and a seed.

Lengths in sampling steps. Every map is low-passed to its shortest wavelength, has mean zero and rms gradient 0.1.
"""

import dataclasses
import zlib
from collections.abc import Callable

import numpy as np

from mbma_tables.common.arguments import FloatArray

GRADIENT = 0.1
SHORTEST = (4.8, 6.0, 8.0)  # wavelengths; the last one has enough steps for half of the grid
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
    rng = np.random.default_rng(zlib.crc32(part.family.encode()) % 10_000_000 * 100 + part.number)
    return finished(FAMILIES[part.family](rng, part.points, part.shortest), part.shortest)


def _waves(points: int) -> tuple[FloatArray, FloatArray]:
    q = np.asarray(2 * np.pi * np.fft.fftfreq(points), float)
    return q[:, None], q[None, :]


def finished(values: FloatArray, shortest: float) -> FloatArray:
    """Without waves below the shortest, at mean zero and the common rms gradient."""
    q = np.hypot(*_waves(len(values)))
    transform = np.where((q > 0) & (q <= 2 * np.pi / shortest * (1 + 1e-9)), np.fft.fft2(values), 0)
    gradient = np.sqrt(np.sum(np.abs(q * transform) ** 2)) / values.size
    return np.asarray(np.fft.ifft2(transform).real * (GRADIENT / gradient))


def rough(rng: Rng, points: int, longest: float, shortest: float, hurst: float, lay: float = 1.0) -> FloatArray:
    """Gaussian heights of standard deviation 1, rolled off at a wavelength, stretched along the first axis."""
    qx, qy = _waves(points)
    q = np.hypot(qx * lay, qy)
    amplitude = np.where(q <= 2 * np.pi / shortest, np.maximum(q * longest / (2 * np.pi), 1.0) ** (-1 - hurst), 0)
    amplitude[0, 0] = 0
    values = np.fft.ifft2(np.fft.fft2(rng.standard_normal((points, points))) * amplitude).real
    return np.asarray(values / values.std())


def _log(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _fine(rng: Rng, points: int, shortest: float, low: float = 0.03, high: float = 0.2) -> FloatArray:
    return _log(rng, low, high) * rough(rng, points, 32, shortest, 0.8)


def gaussian(rng: Rng, points: int, shortest: float) -> FloatArray:
    return rough(rng, points, _log(rng, 32, points), shortest, rng.uniform(0.3, 1))


def turned(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Cusps of a feed, with roughness stretched along them."""
    feed, lay = points / rng.integers(8, 24), _log(rng, 2, 16)
    phase = np.arange(points) / feed % 1 - 0.5
    cusp = 4 * _log(rng, 0.7, 3) * phase**2 + rng.uniform(0, 0.2) * np.sin(2 * np.pi * np.arange(points) / points)
    return cusp + _log(rng, 0.25, 0.7) * rough(rng, points, 2 * feed, shortest, 0.7, lay) + _fine(rng, points, shortest)


def milled(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Cusps along arcs, of different depths."""
    x, y = np.meshgrid(*2 * [np.arange(points)], indexing="ij")
    count, bow = rng.integers(6, 16), rng.uniform(5, 25)
    place = count * (x + bow * np.sin(2 * np.pi * y / points)) / points
    depth = rng.uniform(0.6, 1.4, count)[np.floor(place).astype(int) % count]
    lay = 0.3 * rough(rng, points, 32, shortest, 0.8, _log(rng, 1, 5))
    return np.asarray(depth * np.abs(np.sin(np.pi * place))) + lay + _fine(rng, points, shortest)


def ground(rng: Rng, points: int, shortest: float) -> FloatArray:
    return rough(rng, points, _log(rng, 32, 96), shortest, rng.uniform(0.5, 0.9), _log(rng, 2, 16))


def honed(rng: Rng, points: int, shortest: float) -> FloatArray:
    """A worn plateau crossed by grooves at two angles."""
    x, y = np.meshgrid(*2 * [np.arange(points)], indexing="ij")
    base = 0.8 * rough(rng, points, 64, shortest, 0.8)
    steep, depth = rng.integers(1, 3), _log(rng, 1, 4)
    for way in (-steep, steep):
        for _ in range(rng.integers(3, 7)):
            off = (x + way * y - rng.uniform(0, points) + points / 2) % points - points / 2
            base -= depth * rng.uniform(0.6, 1.4) * np.exp(-((off / rng.uniform(2, 4)) ** 2) / 2)
    return np.minimum(base, np.quantile(base, rng.uniform(0.3, 0.7))) + _fine(rng, points, shortest)


def lapped(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Short scratches in every direction."""
    x, y = np.meshgrid(*2 * [np.arange(points) - points / 2], indexing="ij")
    values = _fine(rng, points, shortest, 0.1, 0.4)
    for _ in range(rng.integers(100, 300)):
        turn, length, width = rng.uniform(0, np.pi), _log(rng, 10, 40), rng.uniform(1.5, 3)
        along, across = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
        scratch = rng.exponential(1) * np.exp(-((along / length) ** 2 + (across / width) ** 2) / 2)
        values -= np.roll(scratch, rng.integers(0, points, 2), (0, 1))
    return values


def worn(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Gaussian heights cut off, with fine roughness on the plateaus."""
    base = rough(rng, points, _log(rng, 32, 96), shortest, 0.8)
    return np.minimum(base, np.quantile(base, rng.uniform(0.3, 0.85))) + _fine(rng, points, shortest, 0.02, 0.15)


def sprayed(rng: Rng, points: int, shortest: float) -> FloatArray:
    return np.exp(rng.uniform(0.25, 0.75) * rough(rng, points, 64, shortest, 0.8))


def pitted(rng: Rng, points: int, shortest: float) -> FloatArray:
    return -sprayed(rng, points, shortest)


def etched(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Two levels with flanks between."""
    base = rough(rng, points, _log(rng, 32, 64), 10, 1)
    level, width = rng.uniform(-0.7, 0.7), _log(rng, 0.15, 0.5)
    return np.tanh((base - level) / width) / 2 + _fine(rng, points, shortest, 0.02, 0.1)


def eroded(rng: Rng, points: int, shortest: float) -> FloatArray:
    """Craters of sparks, each over those before."""
    x, y = np.meshgrid(*2 * [np.arange(points)], indexing="ij")
    values, small, ratio = np.zeros((points, points)), rng.uniform(5, 8), _log(rng, 0.1, 0.3)
    for _ in range(round(0.006 * points**2)):
        centre, radius = rng.uniform(0, points, 2), _log(rng, small, 3 * small)
        off = [(axis - c + points / 2) % points - points / 2 for axis, c in zip((x, y), centre, strict=True)]
        square = (off[0] ** 2 + off[1] ** 2) / radius**2
        floor = values[square < 1].mean() + ratio * radius * (0.7 * square - 0.55)
        rim = 0.25 * ratio * radius * np.exp(-30 * (np.sqrt(square) - 1) ** 2)
        values = np.where(square < 1, floor, values + rim)
    return values + _fine(rng, points, shortest)


def patchy(rng: Rng, points: int, shortest: float) -> FloatArray:
    where = np.exp(rng.uniform(0.3, 0.9) * rough(rng, points, points, points / 4, 1))
    return where * rough(rng, points, _log(rng, 24, 64), shortest, 0.8)


def dimpled(rng: Rng, points: int, shortest: float) -> FloatArray:
    x, y = np.meshgrid(*2 * [np.arange(points)], indexing="ij")
    pitch = points / rng.choice([4, 8, 16])
    row = np.floor(y / pitch)
    off = [(axis / pitch + 0.5) % 1 - 0.5 for axis in (x + pitch / 2 * (row % 2), y - pitch / 2)]
    square = (off[0] ** 2 + off[1] ** 2) * (pitch / max(0.3 * pitch, 5.0)) ** 2
    values = -_log(rng, 0.7, 3) * np.maximum(1 - square, 0)
    return np.asarray(values + _fine(rng, points, shortest, 0.05, 0.2))


FAMILIES: dict[str, Callable[[Rng, int, float], FloatArray]] = {
    maker.__name__: maker
    for maker in (
        gaussian, turned, milled, ground, honed, lapped, worn, sprayed, pitted, etched, eroded, patchy, dimpled,
    )
}  # fmt: skip
