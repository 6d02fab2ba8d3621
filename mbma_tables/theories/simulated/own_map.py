"""A surface's map for boundary elements: its loads, and its simulation as a netCDF file that opens without the map."""

import dataclasses
import datetime
import json
import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError, TableFileError
from mbma_tables.common.netcdf import OWN_REMEDY, read_own, write_own
from mbma_tables.common.shared import shared
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.bearing_curve import Bearing, RadialSpectrum
from mbma_tables.surfaces.heights import Heights
from mbma_tables.surfaces.map_simulation import (
    MIN_POINTS,
    ROUNDING,
    MapSimulation,
    cutting,
)
from mbma_tables.surfaces.maps import without_shorter
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.surfaces.treatment import Treated
from mbma_tables.theories.calibrated.curves import own_law
from mbma_tables.theories.simulated.boundary_elements import composed, waves
from mbma_tables.theories.simulated.grids import Grid, steps_along
from mbma_tables.theories.simulated.pressing import coarser

REFINED = 200  # steps of ln F at which the law's area is inverted, an octave

ROWS = {
    "pressure": ("F/(A0 E*) of a load", "1"),
    "area": ("A/A0, real over nominal contact area", "1"),
    "mean_separation": ("u, the mean gap", "{length}"),
    "energy": ("elastic energy over A0 E*", "{length}"),
}
NUMBERS = {
    "points": "sampling steps along the shortest wavelength",
    "left_out": "wavelength below which a large map was cut off, 0 if it was not",
    "anisotropy": "root of the ratio of the gradient tensor's eigenvalues",
}
# parts of the surface, by the names of their fields
PARTS: dict[str, Any] = {"heights": Heights, "bearing": Bearing, "bands": RadialSpectrum}
POWERS = {
    **dict.fromkeys(("h_rms", "h_max", "quantiles", "mean_height"), "{length}"),
    **{"q": "1/{length}", "variance": "{length}^2"},
}


def sides(treated: Treated) -> tuple[float, float]:
    """Sides of a map [length]."""
    return treated.heights.shape[0] * treated.steps[0], treated.heights.shape[
        1
    ] * treated.steps[1]


@shared(8)
def resolved(surface: MeasuredSurface, grid: Grid) -> MeasuredSurface:
    """The surface of which the simulation of a map is: without wavelengths that its grid does not sample.

    The surface itself where the map has enough sampling steps along its shortest wavelength,
    or a cut-off that was given: a simulation does not choose another one.
    """
    whole = map_of(surface)
    points = steps_along(surface, whole)
    if points >= MIN_POINTS * (1 - ROUNDING) or np.isfinite(whole.waves[1]):
        return surface
    each = 2 ** halvings_of(whole.heights, grid)
    step = max(whole.steps) * each
    # of as many digits as are printed, so that the printed one gives the same answer
    cutoff = float(f"{1.001 * MIN_POINTS * step:.4g}")
    why = (
        f"chosen for the simulation, whose grid has {MIN_POINTS:g} steps along it"
        f"{f' {which_points(each)}' if each > 1 else ''}: "
        f"{cutting(cutoff, surface.unit)} of Surface.from_map sets the instrument's"
    )
    return without_shorter(surface, cutoff, why)


def which_points(each: int) -> str:
    """Which points of a map are simulated, if not all."""
    ordinal = "second" if each == 2 else f"{each}th"
    return f"on every {ordinal} point along each side" if each > 1 else ""


def halvings_of(heights: FloatArray, grid: Grid) -> int:
    """How often a map's points are halved along each side for a grid, which has a largest size."""
    size, halvings = heights.size, 0
    while halvings < grid.halvings or size > grid.most_points:
        size //= 4
        halvings += 1
    return halvings


def refined(values: FloatArray, mirrored: bool) -> FloatArray:
    """A map on twice as many points along each axis, by its waves."""
    from scipy.signal import resample

    rows, columns = (2 * count for count in values.shape)
    if mirrored:
        return composed(waves(values, True), (rows, columns), True)
    return np.asarray(resample(resample(values, rows), columns, axis=1))


def reduced(
    values: FloatArray, points: float, mirrored: bool, grid: Grid
) -> tuple[FloatArray, float, float]:
    """A map halved for a grid, or refined for a short cut-off that was given.

    With sampling steps along its shortest wavelength, and the cut-off in steps of the whole map.
    """
    step = 1.0
    cut = 0.0
    is_fine = points >= MIN_POINTS * (1 - ROUNDING)
    if not is_fine and not grid.halvings and 4 * values.size <= grid.most_points:
        return refined(values, mirrored), 2 * points, cut
    for _ in range(halvings_of(values, grid)):
        step *= 2
        fine = points >= 2 * MIN_POINTS * (1 - ROUNDING)
        values = coarser(values, 0.0 if fine else MIN_POINTS, mirrored)
        points, cut = (points / 2, cut) if fine else (MIN_POINTS, step * MIN_POINTS)
    return values, points, cut


def law_loads(surface: MeasuredSurface, areas: Sequence[float]) -> FloatArray:
    """F/(A0 E*) at which the quick law of a map has given contact areas; uses areas only, which never fail."""
    octaves = np.arange(-20 * REFINED, 4 * REFINED) / REFINED
    pressure = float(surface.rms_gradient) * 2.0**octaves
    area = np.maximum.accumulate(own_law(surface).area(pressure)) + 1e-15 * np.arange(
        pressure.size
    )
    return np.asarray(np.exp(np.interp(np.log(areas), np.log(area), np.log(pressure))))


def map_of(surface: AnySurface) -> Treated:
    """The map that a surface was made from, an InputError where there is none."""
    whole = surface.map if isinstance(surface, MeasuredSurface) else None
    if whole is None or whole.heights.ndim != 2:
        raise InputError(
            "theory 'simulated' needs a height map, and this surface has none: make it by "
            "Surface.from_map, neither combined nor extrapolated nor fitted"
        )
    return whole


def _fields(name: str) -> list[str]:
    return [field.name for field in dataclasses.fields(PARTS[name])]


def write_table(theory: Any, path: os.PathLike[str] | str) -> None:
    """Write a simulated map; see `BoundaryElements.to_netcdf`."""
    surface = theory.surface
    table: dict[str, Any] = {}
    for row, (name, (meaning, unit)) in zip(theory.rows, ROWS.items(), strict=True):
        table[name] = ("load",), row, meaning, unit
    gaps, flow = theory.flows
    table["flow_gaps"] = (
        ("flow_load",),
        gaps,
        "u of a load whose flow is known",
        "{length}",
    )
    table["flow"] = (
        ("flow_load", "axis"),
        flow,
        "flow coefficients xx, yy and xy, 0 where blocked",
        "{length}^3",
    )
    numbers = (theory.points, theory.pressed.left_out, surface.anisotropy)
    for (name, meaning), value in zip(NUMBERS.items(), numbers, strict=True):
        table[name] = (), value, meaning, "{length}" if name == "left_out" else "1"
    table["q"] = ("wave",), surface.q, "wavenumber", "1/{length}"
    table["C"] = (
        ("wave",),
        surface.C,
        "power spectrum, h_rms^2 = 2 pi integral C q dq",
        "{length}^4",
    )
    table["samples"] = (
        ("wave",),
        surface.samples,
        "independent samples of the spectrum",
        "1",
    )
    table["h_max"] = (), surface.h_max, "highest point above the mean", "{length}"
    held = surface.bands.variance > 0
    for part, kind in PARTS.items():
        for name in _fields(part):
            values = np.asarray(getattr(getattr(surface, part), name), float)
            values = values[held] if part == "bands" else values
            over = (f"{part}_{values.size}",) if values.ndim else ()
            unit = POWERS.get(name, "1")
            table[f"{part}_{name}"] = (
                over,
                values,
                f"{name} of mbma_tables {kind.__name__}",
                unit,
            )
    length = surface.unit or "length"
    attributes = {
        "Conventions": "CF-1.11",
        "title": "A rough surface pressed flat by boundary elements",
        "source": theory.origin,
        "history": f"{datetime.datetime.now(datetime.UTC):%Y-%m-%d} mbma fit MAP --simulate",
        "comment": f"Lengths in {length}. BoundaryElements.from_netcdf of mbma_tables opens it.",
        "provenance": json.dumps([dict(step) for step in surface.provenance]),
    } | ({"length_unit": surface.unit} if surface.unit else {})
    described = {
        name: (over, values, meaning, unit.format(length=length) if surface.unit else "1")
        for name, (over, values, meaning, unit) in table.items()
    }
    write_own(path, described, attributes)


def read_surface(path: os.PathLike[str] | str) -> MeasuredSurface:
    """The surface of such a file, with its table."""
    values, own = read_own(path)
    try:
        plain = {
            name: value.item() if value.size == 1 else value
            for name, value in values.items()
        }
        parts = {
            part: kind(**{n: plain[f"{part}_{n}"] for n in _fields(part)})
            for part, kind in PARTS.items()
        }
        numbers = [values[name].item() for name in NUMBERS]
        rows = np.stack([values[name] for name in ROWS])
        if values["flow"].shape != (*values["flow_gaps"].shape, 3) or rows.ndim != 2:
            raise InputError("has loads and flows that do not fit each other")
        points, left_out, anisotropy = numbers
        table = MapSimulation(
            rows, values["flow_gaps"], values["flow"], points, left_out, own["source"]
        )
        return MeasuredSurface(
            values["q"], values["C"], values["h_max"].item(), **parts, table=table,
            samples=values["samples"], anisotropy=anisotropy, unit=own.get("length_unit"),
            provenance=tuple(json.loads(own["provenance"])),
        )  # fmt: skip
    except (InputError, LookupError, TypeError, ValueError) as fault:
        raise TableFileError(
            f"{path}: is no table of a simulated map ({fault}); {OWN_REMEDY}"
        ) from None
