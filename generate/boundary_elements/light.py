"""``python -m generate light``: stiffness from first contact on, by boundary elements and by the calibrated law."""

from __future__ import annotations

import io
import itertools
import pathlib

import click
import numpy as np
from tqdm import tqdm

from generate.boundary_elements.solve import Contact, prepared
from generate.boundary_elements.studies import DATA, PATH
from generate.boundary_elements.surfaces import Recipe, heights
from mbma_tables import Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.common.files import write_file

LOADS = np.geomspace(2e-5, 0.012, 40)  # F/(A0 E* g): from first contact, a few points of the grid, to 3% contact
BANDS = ((1, 8), (1, 32), (2, 16), (4, 10), (8, 5), (16, 3.2))  # longest wavelengths a side, and q1/q0
HURSTS, SEEDS, POINTS = (0.5, 0.8), (1, 2, 3, 4, 5), 256
BINS = (2e-4, 5e-4, 1e-3, 3e-3, 1e-2)  # A/A0
ENDLESS = 7.9  # h_max/h_rms whose last contact is lighter than any load here


def recipes() -> list[Recipe]:
    """The surfaces."""
    return [
        Recipe("self_affine", hurst, zeta_1, waves, seed, POINTS)
        for waves, zeta_1 in BANDS
        for hurst in HURSTS
        for seed in SEEDS
    ]


def solved(recipe: Recipe) -> FloatArray:
    """Highest point, A/A0 and mean separations [h_rms] at `LOADS`; NaN where one grid point is in contact."""
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


def compared(recipe: Recipe, rows: FloatArray, endless: bool = False) -> FloatArray:
    """A/A0, ln of simulated over the law's stiffness between loads, and of force at equal u; shape (3, loads - 1)."""
    h_max, area, u = rows[0, 0], rows[1], rows[2]
    face = Surface(recipe.hurst, recipe.q0, recipe.q0 * recipe.zeta_1, 1.0, ENDLESS if endless else h_max)
    scale = float(face.rms_gradient)
    known = contact(face, pressure=LOADS * scale, theory="calibrated").mean_separation
    with np.errstate(invalid="ignore", divide="ignore"):
        stiffness = np.log(np.diff(known) / np.diff(u))
        force = np.log(LOADS * scale / contact(face, mean_separation=np.nan_to_num(u), theory="calibrated").pressure)
    return np.stack([np.sqrt(area[1:] * area[:-1]), stiffness, force[1:]])


def table(found: FloatArray) -> list[str]:
    """Mean and standard deviation of ln of simulated over the law's stiffness by wavelengths a side and contact."""
    lines, waves = [], np.array([recipe.waves for recipe in recipes()])
    for count in np.unique(waves):
        own = [compared(r, rows) for r, rows in zip(recipes(), found, strict=True) if r.waves == count]
        area, stiffness, _ = np.concatenate(own, axis=1)
        cells = []
        for low, high in itertools.pairwise(BINS):
            part = stiffness[(area >= low) & (area < high) & np.isfinite(stiffness)]
            cells.append(f"{part.mean():+.2f} ± {part.std():.2f}" if part.size else "")
        lines.append(f"| {count} | {' | '.join(cells)} |")
    return lines


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--data", type=PATH, default=DATA / "light_loads.npz", show_default=True)
@click.option("--collect", is_flag=True, help="Compare with the data that there are, no simulations.")
def light(data: pathlib.Path, collect: bool) -> None:
    """Simulate light loads on 60 surfaces, four minutes, and print how far the calibrated law's stiffness is."""
    if not collect:
        content = io.BytesIO()
        rows = np.array([solved(recipe) for recipe in tqdm(recipes(), disable=None)], dtype=np.float32)
        np.savez_compressed(content, loads=LOADS, rows=rows)
        write_file(data, content.getvalue(), make_folders=True)
    with np.load(data) as known:
        found = known["rows"].astype(float)
    click.echo(
        "| longest wavelengths a side | " + " | ".join(f"{a:.2%} to {b:.2%}" for a, b in itertools.pairwise(BINS))
    )
    click.echo("\n".join(table(found)))
