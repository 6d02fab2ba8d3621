"""BEM of one map at a list of loads, on a coarser grid where that resolves its contacts.

Grids of eight or more sampling steps along the shortest wavelength are halved for the heavier loads. Flow is solved on
gaps of the full grid: displacements of a coarser one are smooth, the heights are not, so the former are interpolated.

Each load, and each flow, is stored in `mbma_tables.common.cache` as soon as it is computed.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
from typing import Any

import numpy as np

from mbma_tables.common import cache
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.common.progress import doing, shown
from mbma_tables.laws.boundary_elements import Contact
from mbma_tables.laws.reynolds import flow_conductance

MIN_POINTS = 4.0  # sampling steps per wavelength; with fewer, areas of boundary elements are too large
HALVED = 8.0  # sampling steps per wavelength, from which heavier loads use half of the grid
LIGHT = 0.06  # contact area above which half of the grid is used
TOLERANCE = 1e-3
LOWEST, HIGHEST = 1e-3, 0.9  # A/A0 that the loads reach at least
MORE, LIGHTER, HEAVIER = 6, 0.5, 1.2  # loads added for that, at most, and their factors
ROUNDING = 1e-6
KEPT = "pressed 1"  # version of cached results: change it when this file gives other numbers
QUANTITIES = ("area", "mean_separation", "energy")


def coarser(values: FloatArray, points: float = 0.0) -> FloatArray:
    """A periodic map on every second sampling step along each axis, without wavelengths below `points` of these."""
    from scipy.signal import resample

    if points:
        q2 = np.add.outer(*(np.fft.fftfreq(count) ** 2 for count in values.shape))
        values = np.fft.ifft2(np.where(q2 <= (0.5 / points) ** 2 * (1 + ROUNDING), np.fft.fft2(values), 0)).real
    for axis, count in enumerate(values.shape):
        values = resample(values, count // 2, axis=axis)
    return np.asarray(values)


@dataclasses.dataclass(frozen=True, eq=False)
class Pressed:
    """A periodic map at some loads; lengths of the map.

    Attributes
    ----------
    rows : ndarray, shape (4, n)
        F/(A0 E*), A/A0, u and U/(A0 E*).
    coarse_from : int
        First load on half of the grid; n if there is none.
    """

    heights: FloatArray
    sizes: tuple[float, float]
    rows: FloatArray
    coarse_from: int
    gaps: tuple[FloatArray, ...]
    names: tuple[str, ...]  # key of the cached loads
    left_out: float = 0.0  # wavelength [length] below which a large map was cut off; 0 if it was not
    cut: float = 0.0  # sampling steps of the coarse grid per shortest wavelength, where shorter ones were omitted

    def flow(self) -> FloatArray:
        """Flow coefficient along both axes [length^3], shape (n, 2); 0 where blocked."""
        found, scale = np.zeros((len(self.gaps), 2)), float(np.abs(self.heights).max())
        own = _digest(self.heights / scale)
        with shown("flow through the gaps"):
            for k in range(len(self.gaps)):
                doing(f"flow through the gaps {_bar(k, len(self.gaps))}")
                name = _digest(self.names[k], own, f"{self.rows[2, k] / scale:.9g}")
                kept = cache.load(name, flow=(2,))
                if kept is None:
                    kept = {"flow": flow_conductance(self.gap(k), self.sizes) / scale**3}
                    cache.keep(name, **kept)
                found[k] = kept["flow"] * scale**3
                # once blocked along both axes, heavier loads are blocked as well
                if not found[k].any():
                    break
        return found

    def gap(self, k: int) -> FloatArray:
        """Gaps [length] on the full grid, of mean u."""
        from scipy.signal import resample

        gap = self.gaps[k].astype(float)
        if gap.shape == self.heights.shape:
            return gap
        moved = gap + coarser(self.heights, self.cut)
        for axis, count in enumerate(self.heights.shape):
            moved = resample(moved, count, axis=axis)
        gap = moved - self.heights
        # level at which the gaps cut off at zero have the given mean
        ordered = np.sort(gap, axis=None)
        below = np.cumsum(ordered[::-1])[::-1] - ordered * np.arange(gap.size, 0, -1)
        level = np.interp(-self.rows[2, k] * gap.size, -below, ordered)
        return np.asarray(np.maximum(gap - level, 0.0))


@dataclasses.dataclass(frozen=True, eq=False)
class Table:
    """Results for a map, without the map and its gaps: rows and flow as in `Pressed`.

    Attributes
    ----------
    points, elements : float
        Sampling steps along the shortest wavelength, and elements of the map that do not repeat each other.
    left_out : float
        As of `Pressed`.
    origin : str
        Description of the map and of the simulation.
    """

    rows: FloatArray
    flows: FloatArray
    coarse_from: int
    points: float
    elements: float
    left_out: float = 0.0
    origin: str = ""

    def flow(self) -> FloatArray:
        """Flow coefficient along both axes [length^3], shape (n, 2); 0 where blocked."""
        return self.flows

    def resized(self, up: float, along: float) -> Table:
        """For the surface with heights multiplied by `up` and lengths along the plane by `along`."""
        by = np.array([[up / along], [1.0], [up], [up**2 / along]])
        return dataclasses.replace(self, rows=self.rows * by, flows=self.flows * up**3, left_out=self.left_out * along)


def _digest(*parts: Any) -> str:
    """SHA-256 of numbers and of arrays, these in single precision, so that it is independent of the unit of length."""
    digest = hashlib.sha256(KEPT.encode())
    for part in parts:
        array = isinstance(part, np.ndarray)
        digest.update(np.ascontiguousarray(part, "<f4").tobytes() if array else f";{part!r};".encode())
    return digest.hexdigest()


def _bar(done: int, number: int) -> str:
    return f"[{'#' * done}{'.' * (number - done)}] {done} of {number}"


def press(
    heights: FloatArray,
    sizes: tuple[float, float],
    loads: FloatArray,
    points: float,
    gradient: float,
    area: Any = None,
    tolerance: float = TOLERANCE,
) -> Pressed:
    """Simulate a periodic map; `loads` over A0 E*, `points` per shortest wavelength, `gradient` its rms gradient.

    If its approximate `area` at a load is known, heavier loads use half of the grid, and loads are added
    until contacts from `LOWEST` to `HIGHEST` are covered.
    """
    # scaled to an rms gradient of one and heights of order one
    scale = float(np.abs(heights).max())
    stretched = sizes[0] * gradient / scale, sizes[1] * gradient / scale
    halved = area is not None and points >= HALVED * (1 - ROUNDING)
    engines: dict[bool, Contact] = {}
    found: dict[float, tuple[bool, FloatArray, FloatArray]] = {}
    names: dict[float, str] = {}
    own = _digest(heights / scale, heights.shape, *(f"{side:.9g}" for side in stretched), tolerance)

    def add(load: float, coarse: bool) -> None:
        # further loads are added after those requested
        doing(f"boundary elements {_bar(len(found), max(len(loads), len(found) + 1))}")
        name = _digest(own, coarse, f"{load / gradient:.9g}")
        shape = tuple(count // (1 + coarse) for count in heights.shape)
        names[load] = name
        kept = cache.load(name, row=(len(QUANTITIES),), gap=shape)
        if kept is None:
            if coarse not in engines:
                engines[coarse] = Contact((coarser(heights) if coarse else heights) / scale, stretched, tolerance)
            result = engines[coarse].press(load / gradient)
            row = np.array([result[name] for name in QUANTITIES])
            kept = {"row": row, "gap": engines[coarse].gap.astype(np.float32)}
            cache.keep(name, **kept)
        found[load] = coarse, kept["row"], kept["gap"]

    with shown("boundary elements"):
        for load in map(float, loads):
            add(load, halved and float(area(np.array(load))) > LIGHT)
        for _ in range(MORE if area is not None else 0):
            low, high = min(found), max(found)
            # with a single element in contact the solver may fail
            if found[low][1][0] > LOWEST:
                with contextlib.suppress(ConvergenceError):
                    add(low * LIGHTER, False)
            if found[high][1][0] < HIGHEST:
                add(high * HEAVIER, halved)
    cache.trim()
    order = sorted(found)
    rows = np.array([[load, *found[load][1]] for load in order]).T
    rows[2:] *= np.array([[scale], [gradient * scale]])
    fine = sum(not found[load][0] for load in order)
    gaps = tuple(found[load][2] * np.float32(scale) for load in order)
    return Pressed(heights, sizes, rows, fine, gaps, tuple(names[load] for load in order))
