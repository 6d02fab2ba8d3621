"""``python -m generate light``: stiffness from first contact on, by boundary elements and by the calibrated law."""

from __future__ import annotations

import pathlib

import click
import numpy as np
import xarray as xr
from tqdm import tqdm

from generate.boundary_elements.collect import TEXTS, group, of_recipes, surfaces
from generate.boundary_elements.solve import Contact, prepared
from generate.boundary_elements.studies import PATH
from generate.boundary_elements.surfaces import Recipe, heights
from generate.calibrated_file import binned, variable, write_part
from mbma_tables import Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.data import FILE

LOADS = np.geomspace(2e-5, 0.012, 40)  # F/(A0 E* g): from first contact, a few points of the grid, to 3% contact
BANDS = ((1, 8), (1, 32), (2, 16), (4, 10), (8, 5), (16, 3.2))  # longest wavelengths a side, and q1/q0
HURSTS, SEEDS, POINTS = (0.5, 0.8), (1, 2, 3, 4, 5), 256
OVER = ("surface", "load")
BINS = (2e-4, 5e-4, 1e-3, 3e-3, 1e-2)  # A/A0


def recipes() -> list[Recipe]:
    """The surfaces."""
    return [
        Recipe("self_affine", hurst, zeta_1, waves, seed, POINTS)
        for waves, zeta_1 in BANDS
        for hurst in HURSTS
        for seed in SEEDS
    ]


def solved(recipe: Recipe) -> FloatArray:
    """Highest point, A/A0 and mean separations [h_rms] at `LOADS`; NaN where a single point is in contact."""
    surface, _, known = prepared(heights(recipe), recipe.sizes, recipe.q0)
    model, rows = Contact(surface, recipe.sizes), np.full((3, LOADS.size), np.nan)
    rows[0] = known["h_max"]
    for k, load in enumerate(LOADS):
        try:
            found = model.press(load)
        except ConvergenceError:
            model = Contact(surface, recipe.sizes)
            continue
        rows[1:, k] = found["area"], found["mean_separation"] / surface.std()
    return rows


def compared(one: xr.Dataset) -> FloatArray:
    """A/A0, ln of simulated over the law's stiffness between loads, and of force at equal u; shape (3, loads - 1)."""
    h_max, area, u = float(one.h_max), *(one[name].values.astype(float) for name in ("area", "mean_separation"))
    face = Surface(float(one.hurst), 1.0, float(one.zeta_1), 1.0, h_max)
    scale = float(face.rms_gradient)
    known = contact(face, pressure=LOADS * scale, theory="calibrated").mean_separation
    with np.errstate(invalid="ignore", divide="ignore"):
        stiffness = np.log(np.diff(known) / np.diff(u))
        force = np.log(LOADS * scale / contact(face, mean_separation=np.nan_to_num(u), theory="calibrated").pressure)
    return np.stack([np.sqrt(area[1:] * area[:-1]), stiffness, force[1:]])


def summary(found: xr.Dataset) -> list[list[str]]:
    """Mean and standard deviation of ln of simulated over the law's stiffness by wavelengths a side and contact."""
    lines = []
    for count in np.unique(found.waves):
        own = [compared(one) for one in surfaces(found) if one.waves == count]
        area, stiffness, _ = np.concatenate(own, axis=1)
        bins = binned(area, stiffness, BINS)
        lines.append([str(count), *(f"{part.mean():+.2f} ± {part.std():.2f}" if part.size else "" for part in bins)])
    return lines


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--data", type=PATH, default=FILE, show_default=True)
def light(data: pathlib.Path) -> None:
    """Simulate light loads on 60 surfaces, four minutes; `generate pages joints` compares."""
    rows = np.array([solved(recipe) for recipe in tqdm(recipes(), disable=None)])
    h_max, area, u = rows[:, 0, 0], *np.moveaxis(rows[:, 1:].astype("f4"), 1, 0)
    columns = {
        "h_max": ("surface", h_max),
        "force": ("load", LOADS),
        "area": (OVER, area),
        "mean_separation": (OVER, u),
    }
    texts = TEXTS["load"] | TEXTS["surface"]
    found = {name: variable(*column, texts[name]) for name, column in columns.items()}
    write_part(data, group("light_loads", of_recipes(recipes()) | found), "light_loads")
    click.echo(f"{data}: {rows.shape[0]} surfaces")
