"""`python -m generate leakage`: Reynolds' equation on the gaps of boundary elements."""

from __future__ import annotations

import functools
import importlib.metadata
import pathlib
from typing import Any

import click
import numpy as np

from generate.boundary_elements.capped import CappedContact, load_at
from generate.boundary_elements.collect import collect, leakage_dataset
from generate.boundary_elements.design import leakage_nodes, tasks_of
from generate.boundary_elements.run import run
from generate.boundary_elements.solve import Contact, simulate_to
from generate.boundary_elements.surfaces import Recipe, heights
from mbma_tables.bearing import bearing, radial_spectrum
from mbma_tables.reynolds import flow_conductance

HERE = pathlib.Path("leakage")
# F/(A0 E* g): 0.5% to 42% contact, where the last cells are blocked
LOADS = (0.0025, 0.005, 0.01, 0.02, 0.035, 0.055, 0.08, 0.105, 0.13, 0.155, 0.18, 0.2, 0.22)
FEW_LOADS = (0.005, 0.02, 0.055, 0.08, 0.105, 0.13, 0.155)  # of the largest grids
AREAS = (0.01, 0.03, 0.06, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4)  # that loads of surfaces that yield aim at
LARGE = 1024
QUANTITIES = ("area", "area_raw", "mean_separation", "residual", "seconds")


def solve_flow(recipe: Recipe) -> dict[str, Any]:
    """Contact and flow conductance of one surface up to its blocking: lengths in h_rms, force in A0 E* g."""
    unscaled = heights(recipe)
    surface = unscaled / bearing(unscaled, recipe.sizes).gradient
    known, spectrum = bearing(surface, recipe.sizes), radial_spectrum(surface, recipe.sizes)
    h_rms = known.h_rms
    contact: Contact | CappedContact = Contact(surface, recipe.sizes)
    loads: tuple[float, ...] = FEW_LOADS if recipe.points >= LARGE else LOADS
    if recipe.kind == "yielded":
        contact, loads = (
            CappedContact(surface, recipe.sizes, recipe.shape),
            tuple(load_at(area, recipe.shape) for area in AREAS),
        )
    rows, flows, forces = [], [], []
    for force in loads:
        result = contact.press(force)
        flows.append(flow_conductance(contact.gap / h_rms, recipe.sizes))
        forces.append(force)
        rows.append([result[name] for name in QUANTITIES])
        if not flows[-1].any():
            break
    length = np.array([1, 1, h_rms, h_rms, 1])
    held = spectrum.variance > 0
    return {
        **dict(zip(QUANTITIES, (np.array(rows) / length).T, strict=True)),
        "force": np.array(forces),
        "flow": np.array(flows),
        "q0_h_rms": recipe.q0 * h_rms,
        "h_max": known.h_max / h_rms,
        "anisotropy": known.anisotropy,
        "band_q": np.where(held, spectrum.q / recipe.q0, np.nan),
        "band_variance": spectrum.variance / h_rms**2,
        "engine": f"Tamaas {importlib.metadata.version('tamaas')}",
        "numpy": np.__version__,
    }


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--folder", type=click.Path(path_type=pathlib.Path), default=HERE, show_default=True, help="One file a surface."
)
@click.option("--collect", "target", type=click.Path(path_type=pathlib.Path), help="Write this netCDF file, no runs.")
@click.option("--points", type=click.IntRange(64), default=1024, show_default=True, help="Largest grid to run.")
@click.option("--workers", type=click.IntRange(1), default=1, show_default=True, help="Processes.")
def leakage(folder: pathlib.Path, target: pathlib.Path | None, points: int, workers: int) -> None:
    """Solve Reynolds' equation on gaps of boundary elements (the extra `simulate`): half an hour on two cores.

    Stopped and called again, it goes on where it was.
    """
    from generate.tables.commands import executor

    tasks = [task for task in tasks_of(leakage_nodes()) if task.recipe.points <= points]
    if target is not None:
        counted = collect(leakage_dataset(tasks, folder), target)
        click.echo(f"{target}: {counted} of {len(tasks)} surfaces, {target.stat().st_size} bytes")
        return
    with executor(workers, None) as pool:
        run(tasks, folder, pool, functools.partial(simulate_to, solve=solve_flow))
