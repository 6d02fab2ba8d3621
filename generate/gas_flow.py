"""Flow of a rarefied gas through the gaps of simulated contacts, and how well two constants describe it."""

import itertools
import math
import pathlib
from collections.abc import Iterator
from typing import Any

import click
import numpy as np
import pandas as pd
from scipy.optimize import least_squares

from generate import files
from generate.boundary_elements.solve import load_at, prepared
from generate.boundary_elements.surfaces import Recipe, heights
from generate.page import Cell, table
from mbma_tables.common import progress
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.files import write_file
from mbma_tables.contacts.quantities.gas_flow import POWER, WIDER, flow_over_liquid
from mbma_tables.theories.simulated.boundary_elements import BoundaryElementContact
from mbma_tables.theories.simulated.reynolds import flow_conductance

FILE = files.ROOT / "docs" / "data" / "gas_flow.csv"
PATHS = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0)  # mean free path [h_rms]
AREAS = (0.01, 0.03, 0.07, 0.12, 0.18, 0.25, 0.32, 0.38)  # that loads aim at
# longest waves a side and zeta_1, on 256 x 256 points
FITTED = (4, 16.0)
HELD_OUT = (8, 8.0)
# Hurst exponent, seed and hardness over E* g
SURFACES = ((0.8, 1, 0.0), (0.3, 2, 0.0), (0.6, 3, 0.0), (0.8, 4, 0.2), (0.5, 5, 0.1))
POINTS = 256
EDGES = (0.0, 0.05, 0.15, 0.22, 0.3, 0.42)
COLUMNS = (
    *("hurst", "zeta_1", "waves", "seed", "eta", "force", "area", "mean_separation"),
    "flow",
    *(f"flow_{path:g}" for path in PATHS),
)
LARGEST_AREA = 0.3  # of the fit


def plates(gap: FloatArray, path: float) -> FloatArray:
    """Flow of a gas between plates over that of a liquid, at gaps and a mean free path of one unit."""
    return flow_over_liquid(math.sqrt(math.pi) / 2 * gap / path)


def flow(gap: FloatArray) -> float:
    """Geometric mean of both axes."""
    return math.sqrt(math.prod(flow_conductance(gap)))


def rows_of(
    waves: int, zeta_1: float, hurst: float, seed: int, eta: float
) -> Iterator[list[str]]:
    """Rows of one surface, load by load up to its blocking; lengths in h_rms."""
    recipe = Recipe("self_affine", hurst, zeta_1, waves, seed, POINTS)
    height, _, _ = prepared(heights(recipe), recipe.sizes, recipe.q0)
    cap = eta or np.inf
    contact = BoundaryElementContact(height, recipe.sizes, hardness=cap)
    h_rms = float(height.std())
    for area in AREAS:
        force = load_at(area, cap)
        found = contact.press(force)
        gap = contact.gap / h_rms
        of_liquid = flow(gap)
        if of_liquid == 0:
            return
        is_open = gap > 0
        of_gas = [
            flow(
                np.where(
                    is_open, gap * np.cbrt(plates(np.where(is_open, gap, 1.0), path)), 0
                )
            )
            for path in PATHS
        ]
        u = found["mean_separation"] / h_rms
        given = (hurst, zeta_1, waves, seed, eta, force, found["area"], u, of_liquid)
        yield [f"{number:.6g}" for number in (*given, *of_gas)]


def errors(data: pd.DataFrame, wider: float = WIDER, power: float = POWER) -> FloatArray:
    """ln(law/simulation) of gas flow at simulated flow of a liquid and area; a column for each mean free path."""
    h = np.cbrt(data["flow"]) * (1 + wider * data.area**power)
    law = np.stack([plates(h.to_numpy(), path) for path in PATHS], axis=1)
    ratio = data[[f"flow_{path:g}" for path in PATHS]].to_numpy()
    return np.asarray(np.log(law * data["flow"].to_numpy()[:, None] / ratio))


def is_held_out(data: pd.DataFrame) -> Any:
    """Mask of rows that no constant was fitted to."""
    return (data.waves == HELD_OUT[0]).to_numpy()


def accuracy(data: pd.DataFrame) -> str:
    """Root mean squares by contact and mean free path, on surfaces that no constant was fitted to."""
    found = errors(data)
    rows = list[list[Cell]]()
    for low, high in itertools.pairwise(EDGES):
        inside = ((data.area > low) & (data.area <= high)).to_numpy()
        some = found[inside & is_held_out(data)]
        root_mean_squares = np.sqrt((some**2).mean(axis=0))
        title = f"{100 * low:g}-{100 * high:g}% ({len(some)})"
        rows.append([title, *root_mean_squares, np.abs(some).max()])
    paths = " | ".join(f"{path:g} h_rms" for path in PATHS)
    return table(f"A/A0 | {paths} | largest", rows, "{} | {:.3f}")


@click.command()
@click.option(
    "--simulate", is_flag=True, help="Simulate anew (5 minutes) and write the rows."
)
@click.option(
    "--data",
    type=click.Path(path_type=pathlib.Path),
    default=FILE,
    help="File of rows.",
)
def gas_flow(simulate: bool, data: pathlib.Path) -> None:
    """Fit the two constants of gas flow, and compare with simulations that the fit did not see."""
    if simulate:
        lines = [",".join(COLUMNS)]
        cases = [(*wave, *one) for wave in (FITTED, HELD_OUT) for one in SURFACES]
        for number, case in enumerate(cases, 1):
            progress.doing(f"surface {number} of {len(cases)}")
            lines += [",".join(row) for row in rows_of(*case)]
        write_file(data, "\n".join([*lines, ""]).encode())
    rows = pd.read_csv(data)
    some = rows[~is_held_out(rows) & (rows.area < LARGEST_AREA)]
    fit = least_squares(lambda x: errors(some, *x).ravel(), (WIDER, POWER)).x
    progress.echo(f"fitted: WIDER {fit[0]:.3f}, POWER {fit[1]:.3f}")
    progress.echo(accuracy(rows))
