"""Preparation of a surface's map for boundary elements: its continuation, and the loads to simulate."""

import hashlib
from collections.abc import Sequence

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.laws.pressing import MIN_POINTS, ROUNDING, coarser
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.surfaces.treatment import Treated
from mbma_tables.theories.calibrated_curves import own_law

# A/A0 by the law of the map, at which it is simulated
AREAS = (7e-4, 0.0015, 0.006, 0.012, 0.05, 0.09, 0.22, 0.3, 0.52, 0.65, 0.88, 0.95)
MOST_POINTS = 2**20  # points of the largest map that is simulated without change
REFINED = 200  # steps of ln F at which the law's area is inverted, an octave


def sides(treated: Treated) -> tuple[float, float]:
    """Sides of a map [length]."""
    return treated.heights.shape[0] * treated.steps[0], treated.heights.shape[1] * treated.steps[1]


def steps_along(surface: MeasuredSurface, whole: Treated) -> float:
    """Sampling steps along the shortest wavelength of a map."""
    return 2 * np.pi / float(surface.q1) / max(whole.steps)


def reduced(values: FloatArray, points: float, mirrored: bool) -> tuple[FloatArray, float, float]:
    """A map of few enough points, sampling steps along its shortest wavelength, and the cut-off in own steps.

    Every second point is left out until at most `MOST_POINTS` remain; where that leaves fewer than four along the
    shortest wavelength, shorter ones than four are cut off.
    """
    step, cut = 1.0, 0.0
    while values.size > MOST_POINTS:
        step *= 2
        fine = points >= 2 * MIN_POINTS * (1 - ROUNDING)
        values = coarser(values, 0.0 if fine else MIN_POINTS, mirrored)
        points, cut = (points / 2, cut) if fine else (MIN_POINTS, step * MIN_POINTS)
    return values, points, cut


def law_loads(surface: MeasuredSurface, areas: Sequence[float]) -> FloatArray:
    """F/(A0 E*) at which the quick law of a map has given contact areas; uses areas only, which never fail."""
    octaves = np.arange(-20 * REFINED, 4 * REFINED) / REFINED
    pressure = float(surface.rms_gradient) * 2.0**octaves
    area = np.maximum.accumulate(own_law(surface).area(pressure)) + 1e-15 * np.arange(pressure.size)
    return np.asarray(np.exp(np.interp(np.log(areas), np.log(area), np.log(pressure))))


def map_of(surface: AnySurface) -> Treated:
    """The map that a surface was made from.

    Raises
    ------
    InputError
        Where there is none.
    """
    whole = surface.map if isinstance(surface, MeasuredSurface) else None
    if whole is None or whole.heights.ndim != 2:
        raise InputError(
            "theories 'simulated' and 'corrected' need a height map, and this surface has none: make it by "
            "Surface.from_map, neither combined nor extrapolated nor fitted"
        )
    return whole


def origin_of(whole: Treated, tolerance: float) -> str:
    """Description of the map simulated, and of the method."""
    digest = hashlib.sha256(np.ascontiguousarray(whole.heights, "<f8").tobytes()).hexdigest()
    points = " x ".join(map(str, whole.heights.shape))
    return f"boundary elements, tolerance {tolerance:g}, of the map of {points} points with SHA-256 {digest[:16]}"
