"""docs/maps.md: theories on anisotropic and non-Gaussian surfaces, relative to boundary elements."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from generate.boundary_elements.design import HELD_OUT_SPECTRUM, HELD_OUT_SURFACE, SPLITS
from generate.boundary_elements.surfaces import Recipe, heights
from generate.pages.gallery import BARS, EXAMPLES, ratios, read_rows
from generate.pages.page import DATA, Measured, dataset, table
from mbma_tables import Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import MbmaError
from mbma_tables.scenes.specimen import measured
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.theories import get_theory

KINDS = ("stretched", "peaks", "valleys", "patchy", "worn")
GRADIENT = 0.1  # that surfaces are given: theories are for small ones
# contacts that are summed up: as far as islands do not lie on one another, and all
RANGES = {"mbma": (0.01, 0.1), "calibrated": (0.01, 0.97)}
EXTRAPOLATED = {"extrapolate_to": "2nm", "extrapolate_hurst": 0.8}
PRESSURES = (1e-4, 1e-3, 1e-2)
Seen = tuple[str, MeasuredSurface, FloatArray]


def simulated() -> Iterator[Seen]:
    """Held-out surfaces by name, as maps, with F/(A0 E*), A/A0 and u of boundary elements."""
    data = dataset(DATA / "boundary_elements.nc")
    kinds = data.kind.attrs["flag_meanings"].split()
    order = [KINDS.index(kinds[k]) if kinds[k] in KINDS else -1 for k in data.kind.values]
    for one in (data.isel(surface=number) for number in np.lexsort((data["shape"].values, np.array(order)))):
        kind, shape, points = kinds[int(one.kind)], float(one["shape"]), int(one.points)
        if kind not in KINDS or SPLITS[int(one.split)] not in (HELD_OUT_SURFACE, HELD_OUT_SPECTRUM):
            continue
        recipe = Recipe(kind, float(one.hurst), float(one.zeta_1), int(one.waves), int(one.seed), points, shape)
        # of the map as it is, whose h_rms is 1
        scale = GRADIENT * float(one.q0_h_rms) / recipe.q0
        steps = [side / points for side in recipe.sizes]
        surface = Surface.from_map(scale * heights(recipe), *steps, periodic=True)
        assert isinstance(surface, MeasuredSurface)
        rows = np.stack([one.force * GRADIENT, one.area, one.mean_separation * scale])
        name = f"stretched 1:{shape:g}" if kind == "stretched" else f"{kind} {shape:g}"
        yield name, surface, rows[:, np.isfinite(rows).all(axis=0) & (one.area.values > 0)]


def from_files() -> Iterator[Seen]:
    """Measured maps with boundary elements, those of the gallery and what else is at hand."""
    for example in (*EXAMPLES, *BARS):
        path, rows = example.path(), read_rows().get(example.name)
        if path is not None and rows is not None:
            yield f"measured: {example.name}", measured(path, example.options)[1], rows[:3]


def summary(seen: list[Seen]) -> list[Any]:
    """Cells of one row: area and force of both theories over simulation, and how many answers are valid."""
    cells: list[Any] = []
    for name, (low, high) in RANGES.items():
        theory, found = get_theory(name), []
        for _, surface, rows in seen:
            force, area, u = rows[:, (rows[1] >= low) & (rows[1] <= high)]
            valid = np.full(u.size, np.nan)
            try:
                # a map's curve may end before full contact
                reached = u >= theory.interval(surface)[0]
                valid[reached] = contact(surface, mean_separation=u[reached], theory=theory).valid
                found.append(np.stack([*ratios(theory, surface, force, area, u), valid]))
            except MbmaError:
                found.append(np.full((3, u.size), np.nan))
        *columns, valid = np.concatenate(found, axis=1)
        for column in columns:
            known = column[np.isfinite(column) & (column > 0)]
            cells.append((np.exp(np.mean(np.log(known))), known.min(), known.max()) if known.size else "-")
        answered = valid[np.isfinite(valid)]
        cells.append(f"{answered.mean():.0%}" if answered.size else "-")
    return cells


def extrapolation() -> str:
    """A measured spectrum as it is and extrapolated, by a theory that needs the spectrum only."""
    path, options = EXAMPLES[0].path(), EXAMPLES[0].options
    assert path is not None
    known, longer = (measured(path, options | more)[1] for more in ({}, EXTRAPOLATED))
    rows = []
    for pressure in PRESSURES:
        one, other = (contact(s, pressure=pressure, theory="persson") for s in (known, longer))
        # conductance over conductivity is stiffness over E*
        pairs = ((one.area, other.area), (one.stiffness, other.stiffness))
        rows.append([pressure, *(number for x, y in pairs for number in (x, y, y / x))])
    names = ("area", "stiffness/E* and conductance/k [1/nm]")
    header = " | ".join(["pressure/E*", *(f"{name} | extrapolated | ratio" for name in names)])
    note = next(entry["told"] for entry in longer.provenance if entry["step"] == "extrapolated")
    text = table(header, rows, "{:g} | {:.3g} | {:.3g} | {:.2f} | {:.3g} | {:.3g} | {:.2f}")
    return f"{text}\n\nReported with it: {note}."


def measure() -> Measured:
    """Blocks of the page; no other files."""
    groups: dict[str, list[Seen]] = {}
    for one in (*simulated(), *from_files()):
        groups.setdefault(one[0], []).append(one)
    rows = []
    for name, seen in groups.items():
        stretch, kurtosis, skewness = (
            np.mean([getattr(s.bearing, key, getattr(s, key, 0.0)) for _, s, _ in seen])
            for key in ("anisotropy", "slope_kurtosis", "skewness")
        )
        rows.append([f"{name} ({len(seen)})", stretch, kurtosis, skewness, *summary(seen)])
    columns = (f"{name}: {what}" for name in ("MBMA", "calibrated") for what in ("area", "force", "valid"))
    header = f"surfaces (number) | anisotropy | kurtosis of slopes | skewness | {' | '.join(columns)}"
    shapes = table(header, rows, "{} | {:.1f} | {:.1f} | {:.1f} | {:.2f} ({:.2f} to {:.2f})")
    return {"shapes": shapes, "extrapolation": extrapolation()}, {}
