"""Flow through the gaps of yielded contacts after unloading, by boundary elements, and how well the law describes it."""

import dataclasses
import itertools
import pathlib
from collections.abc import Iterator
from typing import Any, cast

import click
import numpy as np
import pandas as pd

from generate import files
from generate.boundary_elements import run as campaigns
from generate.boundary_elements.solve import load_at, prepared
from generate.boundary_elements.surfaces import Recipe, Task, heights
from generate.page import Cell, table
from mbma_tables import Bodies, Surface, contact
from mbma_tables.common import progress
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.files import write_file
from mbma_tables.contacts.quantities.leakage import OPENING
from mbma_tables.theories.simulated.boundary_elements import BoundaryElementContact
from mbma_tables.theories.simulated.reynolds import flow_conductance

FILE = files.ROOT / "docs" / "data" / "unloaded_flow.csv"
AREAS = (0.01, 0.03, 0.06, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5)
UNLOADED = (0.06, 0.15, 0.3, 0.45)  # areas from which loads are taken back
SHARES = (0.5, 0.2, 0.05)  # of the largest load, to which they are
# longest waves a side and zeta_1, Hurst exponents and hardness over E* g
FITTED = ((4, 16.0), (8, 8.0)), (0.8, 0.5, 0.3, 1.0), (0.12, 0.03, 0.25, 0.06, 0.5)
HELD_OUT = ((5, 12.0), (8, 8.0)), (0.4, 0.9, 0.65), (0.09, 0.18, 0.04, 0.35)
LARGE = ((4, 32.0),), (0.8, 0.5), (0.12, 0.3)
POINTS_A_WAVE = 4
H_MAX = (
    4.0  # [h_rms], about that of the cells; the law's gap and area hardly depend on it
)
Q0 = 0.02  # [1/h_rms], so small that gradients are
OPEN = 1e-6  # flow [h_rms^3] below which a cell is nearly blocked
EDGES = (0.0, 0.1, 0.2, 0.32)  # A/A0 at the largest pressure
COLUMNS = (
    *("hurst", "zeta_1", "waves", "seed", "held_out", "eta", "largest_force", "force"),
    *("area", "yielded", "mean_separation", "flow_x", "flow_y"),
)


def recipes(
    waves: Any, hursts: Any, etas: Any, first_seed: int
) -> Iterator[tuple[Recipe, float]]:
    """Surfaces with a hardness each, those of one Hurst exponent far apart."""
    seed = first_seed
    for eta, hurst, (count, zeta_1) in itertools.product(etas, hursts, waves):
        points = round(count * zeta_1 * POINTS_A_WAVE)
        yield Recipe("self_affine", hurst, zeta_1, count, seed, points), eta
        seed += 1


@dataclasses.dataclass(frozen=True)
class Case:
    """A surface with a hardness, p_m/(E* g)."""

    recipe: Recipe
    eta: float
    is_held_out: bool

    @property
    def name(self) -> str:
        return f"{self.recipe.name}_eta{self.eta:g}"


def cases() -> list[Case]:
    """All surfaces in the order in which they are simulated."""
    fitted = [Case(*one, False) for one in recipes(*FITTED, 3001)]
    held_out = [Case(*one, True) for one in recipes(*HELD_OUT, 4001)]
    both = itertools.zip_longest(fitted, held_out)
    small = [case for pair in both for case in pair if case is not None]
    return small + [Case(*one, True) for one in recipes(*LARGE, 5001)]


def solved(case: Any) -> dict[str, FloatArray]:
    """Columns of one surface, load by load up to its blocking; lengths in h_rms."""
    recipe, eta = case.recipe, case.eta
    height, _, _ = prepared(heights(recipe), recipe.sizes, recipe.q0)
    h_rms = float(height.std())
    contact = BoundaryElementContact(height, recipe.sizes, hardness=eta)

    def row(
        found: dict[str, float], gap: FloatArray, *forces: float
    ) -> tuple[float, ...]:
        flow = flow_conductance(gap / h_rms, recipe.sizes)
        given = (recipe.hurst, recipe.zeta_1, recipe.waves, recipe.seed)
        u = found["mean_separation"] / h_rms
        contact_of = found["area"], found["area_yielded"], u
        return (*given, case.is_held_out, eta, *forces, *contact_of, *map(float, flow))

    rows = list[tuple[float, ...]]()
    for area in AREAS:
        force = load_at(area, eta)
        loaded = row(contact.press(force), contact.gap, force, force)
        rows.append(loaded)
        if area in UNLOADED:
            after = contact.unloading()
            for share in SHARES:
                found = after.press(share * force) | {"area_yielded": 0.0}
                # lengths as those of the map before
                rows.append(row(found, after.gap, force, share * force))
        if not any(loaded[-2:]):
            break
    values = np.array(rows, dtype=float)
    return {name: values[:, k] for k, name in enumerate(COLUMNS)}


def openings(rows: pd.DataFrame) -> pd.DataFrame:
    """Growth of the simulated hydraulic aperture over that of the mean gap, at each lower load."""
    data = rows.assign(aperture=np.cbrt(np.sqrt(rows.flow_x * rows.flow_y)))
    keys = ["seed", "largest_force"]
    names = [*keys, "area", "aperture", "mean_separation"]
    first = data[data.force == data.largest_force][names]
    lower = data[data.force < data.largest_force]
    both = lower.merge(first, on=keys, suffixes=("", "_0"))
    grown = both.aperture - both.aperture_0
    return both.assign(opening=grown / (both.mean_separation - both.mean_separation_0))


def errors(rows: pd.DataFrame) -> pd.DataFrame:
    """ln(law/simulation) of flow at each lower load, over the stated scatter too, and A/A0 at the largest load."""
    parts = []
    is_open = (rows.flow_x > OPEN) & (rows.flow_y > OPEN)
    lower = rows[(rows.force < rows.largest_force) & is_open]
    keys = ["hurst", "zeta_1", "eta", "held_out", "largest_force"]
    for (hurst, zeta_1, eta, held_out, largest), some in lower.groupby(keys):
        surface = Surface(hurst, Q0, Q0 * zeta_1, 1.0, H_MAX)
        gradient = float(surface.rms_gradient)
        bodies = Bodies(1.0, hardness=eta * gradient)
        top = contact(surface, bodies, pressure=largest * gradient, theory="calibrated")
        leak = contact(
            surface,
            bodies,
            pressure=some.force.to_numpy() * gradient,
            largest_pressure=largest * gradient,
            theory="calibrated",
        ).leakage
        miss = np.log(leak.K) - np.log(some.flow_x * some.flow_y).to_numpy() / 2
        found = {
            "held_out": held_out,
            "area": float(top.area),
            "share": (some.force / largest).round(3).to_numpy(),
            "error": miss,
            "standardised": miss / leak.scatter,
            "is_valid": leak.valid,
            "is_blocked": leak.blocked,
        }
        parts.append(pd.DataFrame(found))
    return pd.concat(parts, ignore_index=True)


def accuracy(found: pd.DataFrame) -> str:
    """Bias and root mean square on surfaces that no constant was fitted to."""
    unseen = found[found.held_out == 1]
    rows = list[list[Cell]]()
    for share in sorted(unseen.share.unique(), reverse=True):
        cells: list[Cell] = [f"{share:g}"]
        for low, high in itertools.pairwise(EDGES):
            inside = (unseen.area > low) & (unseen.area <= high)
            miss = unseen.error[inside & (unseen.share == share)]
            root_mean_square = float(np.sqrt(np.mean(miss**2)))
            cells.append((float(miss.mean()), root_mean_square, miss.size))
        rows.append(cells)
    titles = [f"{100 * low:g}-{100 * high:g}%" for low, high in itertools.pairwise(EDGES)]
    return table(f"p/p0 | {' | '.join(titles)}", rows, "{} | {:+.2f}, {:.2f} ({:.0f})")


@click.command()
@click.option("--simulate", "is_simulated", is_flag=True, help="Solve missing surfaces.")
@click.option(
    "--folder",
    type=click.Path(path_type=pathlib.Path),
    default="unloaded_flow",
    show_default=True,
    help="One file a surface.",
)
@click.option(
    "--collect", is_flag=True, help="Write what there is into docs/data, no runs."
)
@click.option(
    "--data",
    "path",
    type=click.Path(path_type=pathlib.Path),
    default=FILE,
    help="File of rows.",
)
def unloaded_flow(
    is_simulated: bool, folder: pathlib.Path, collect: bool, path: pathlib.Path
) -> None:
    """How flow grows as yielded contacts are unloaded, and the law beside simulations that it was not fitted to.

    Simulations that are stopped and called again go on where they were.
    """
    if is_simulated:
        tasks = [Task(cast(Recipe, case), "") for case in cases()]
        campaigns.run(tasks, folder, 1, solved)
        return
    if collect:
        rows = campaigns.gathered(folder, cases())[list(COLUMNS)]
        write_file(path, files.to_csv("", rows, "%.6g"))
        progress.echo(f"{path}: {len(rows)} contacts")
        return
    rows = pd.read_csv(path)
    found = openings(rows)
    fitted = found[(found.held_out == 0) & (found.area_0 < EDGES[-1])]
    progress.echo(
        f"growth of the aperture over that of the gap {fitted.opening.median():.3f}, "
        f"deviation {fitted.opening.std():.3f}; the law has {OPENING:g}"
    )
    progress.echo(accuracy(errors(rows)))
