"""`python -m generate unloading`: contacts that yielded, unloaded by boundary elements.

A map is loaded to a largest pressure p0, with pressures capped at the hardness. What yielded
points overlap the other body by stays, and the map so flattened is unloaded elastically.
"""

import dataclasses
import gzip
import pathlib
from typing import Any, cast

import click
import numpy as np

from generate.boundary_elements import run as campaigns
from generate.boundary_elements.solve import load_at
from generate.boundary_elements.surfaces import Recipe, Task
from generate.boundary_elements.surfaces import heights as random_heights
from generate.files import DATA, read_csv, to_csv
from generate.machined.makers import Part
from generate.machined.makers import heights as machined_heights
from generate.unloading_fit import report
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.files import write_file
from mbma_tables.surfaces.bearing_curve import bearing
from mbma_tables.theories.simulated.boundary_elements import BoundaryElementContact

TOLERANCE = 1e-5
# A/A0 that largest pressures aim at, and pressures over the largest
PEAKS = (0.003, 0.012, 0.05, 0.15, 0.3, 0.5)
FRACTIONS = (1.0, 0.9, 0.75, 0.5, 0.3, 0.2, 0.1, 0.03, 0.01)
FEWEST = 12  # points in contact, below which a contact is not pressed
ELASTIC_LOADS = 12
INDICES = (
    2.5,
    8.0,
    1.6,
    16.0,
    4.0,
    1.2,
    30.0,
)  # psi = E* g/p_m, in the order of the runs
HURSTS = (0.8, 0.5, 0.3, 1.0, 0.65, 0.2, 0.9)
# zeta_1, longest wavelengths and grid points a side
BANDS = ((12.5, 4, 320), (8.0, 4, 256), (16.0, 2, 256), (10.0, 3, 256), (8.0, 6, 384))
MACHINED = ("ground", "honed", "turned")
GROUPS = 147  # of random surfaces
REFINED = (
    8,
    16,
    22,
    37,
    60,
)  # turns whose surface is solved on a grid twice as fine, too
# spectra of several maps each, which no fit sees: Hurst exponent and psi; longest wavelengths
# and grid points a side, and maps
REPEATED = ((0.5, 4.0), (0.9, 16.0))
REPEATS = ((4, 256, 6), (8, 512, 5))
FILE = DATA / "unloading.csv.gz"
CELLS = DATA / "unloading_cells.csv.gz"
HEAD = """\
# Contacts loaded to p0 with pressures capped at a hardness and unloaded elastically, by python -m generate unloading.
# kind loaded: the way to p0; unloaded: p = s p0 after p0 of the same row; elastic: no hardness, on the map as it was.
# Pressures in E* g, g the rms gradient; areas over A0; lengths in h_rms; stiffness in E* g/h_rms at constant area.
# highest: the largest pressure over the hardness on unloading, where yielding anew is neglected.
"""


@dataclasses.dataclass(frozen=True)
class Group:
    """A map and its plasticity index, psi = E* g/p_m."""

    surface: Recipe | Part
    psi: float

    @property
    def name(self) -> str:
        return f"{self.surface.name}_psi{self.psi:g}"

    def map(self) -> tuple[FloatArray, tuple[float, float]]:
        """Heights at rms gradient 1, and sides of the map."""
        if isinstance(self.surface, Part):
            values = machined_heights(self.surface)
            sizes = (float(values.shape[0]), float(values.shape[1]))
        else:
            values, sizes = random_heights(self.surface), self.surface.sizes
        return values / bearing(values, sizes).gradient, sizes


def groups() -> list[Group]:
    """Every group, so mixed that stopping early leaves a balanced set."""
    chosen = list[Group]()
    for turn in range(GROUPS):
        psi = INDICES[turn % len(INDICES)]
        # every psi meets every Hurst exponent
        hurst = HURSTS[(turn + turn // len(HURSTS)) % len(HURSTS)]
        zeta_1, waves, points = BANDS[turn % len(BANDS)]
        seed = 8000 + turn
        recipe = Recipe("self_affine", hurst, zeta_1, waves, seed, points)
        chosen.append(Group(recipe, psi))
        if turn % 4 == 3:
            k = turn // 4
            part = Part(MACHINED[k % len(MACHINED)], 2 + 3 * (k // len(MACHINED)))
            chosen.append(Group(part, INDICES[(k + k // len(MACHINED)) % len(INDICES)]))
        if turn in REFINED:
            finer = dataclasses.replace(recipe, points=2 * points)
            chosen.append(Group(finer, psi))
    return chosen


def repeats() -> list[Group]:
    """Groups of one spectrum that differ by their random numbers alone."""
    chosen = list[Group]()
    for turn, (waves, points, count) in enumerate(REPEATS):
        for number in range(count * len(REPEATED)):
            hurst, psi = REPEATED[number % len(REPEATED)]
            seed = 9000 + 100 * turn + number
            recipe = Recipe("self_affine", hurst, 8.0, waves, seed, points)
            chosen.append(Group(recipe, psi))
    return chosen


def solved(group: Any) -> dict[str, FloatArray]:
    """Rows of a group: contacts loaded, unloaded and elastic."""
    surface, sizes = group.map()
    h_rms = float(surface.std())
    eta = 1 / group.psi
    loaded = BoundaryElementContact(surface, sizes, TOLERANCE, eta)
    rows = list[dict[str, float]]()
    largest = [load_at(area, eta) for area in PEAKS]
    for number, p0 in enumerate(largest):
        peak = loaded.press(p0)
        rows.append(row(loaded, peak, h_rms, number, p0, p0, "loaded"))
        after = loaded.unloading()
        for fraction in FRACTIONS:
            found = after.press(p0 * fraction)
            if found["area_raw"] * surface.size < FEWEST:
                break
            rows.append(row(after, found, h_rms, number, p0, p0 * fraction, "unloaded"))
            rows[-1]["highest"] = float(after.traction.max()) / eta
    elastic = BoundaryElementContact(surface, sizes, TOLERANCE)
    for force in np.geomspace(0.01 * largest[0], largest[-1], ELASTIC_LOADS)[::-1]:
        found = elastic.press(float(force))
        if found["area_raw"] * surface.size < FEWEST:
            break
        rows.append(row(elastic, found, h_rms, -1, force, force, "elastic"))
    return {name: np.array([one.get(name, np.nan) for one in rows]) for name in rows[0]}


def row(
    contact: BoundaryElementContact,
    found: dict[str, float],
    h_rms: float,
    number: int,
    p0: float,
    p: float,
    kind: str,
) -> dict[str, Any]:
    return {
        "kind": kind,
        "peak": number,
        "p0": p0,
        "p": p,
        "area": found["area"],
        "area_yielded": found["area_yielded"],
        "area_raw": found["area_raw"],
        "mean_separation": found["mean_separation"] / h_rms,
        "plane_separation": found["plane_separation"] / h_rms,
        "energy": found["energy"] / h_rms,
        "frozen_stiffness": contact.frozen_stiffness() * h_rms,
        "highest": np.nan,
    }


def described(group: Group) -> dict[str, Any]:
    """Columns of a group."""
    surface = group.surface
    if isinstance(surface, Part):
        own = {"family": surface.family, "hurst": np.nan, "zeta_1": np.nan}
        own |= {"waves": 0, "seed": surface.number}
    else:
        own = {"family": surface.kind, "hurst": surface.hurst, "zeta_1": surface.zeta_1}
        own |= {"waves": surface.waves, "seed": surface.seed}
    return own | {"points": surface.points, "psi": group.psi}


@click.command()
@click.option(
    "--folder",
    type=click.Path(path_type=pathlib.Path),
    default="unloading",
    show_default=True,
    help="One file a group.",
)
@click.option(
    "--collect", is_flag=True, help="Write what there is into docs/data, no runs."
)
@click.option("--fit", is_flag=True, help="Fit the law to what docs/data has, no runs.")
@click.option(
    "--out", type=click.Path(path_type=pathlib.Path), default=FILE, show_default=True
)
def unloading(folder: pathlib.Path, collect: bool, fit: bool, out: pathlib.Path) -> None:
    """Unload contacts that yielded, by boundary elements: an hour or two on one core.

    Stopped and called again, it goes on where it was.
    """
    if fit:
        click.echo(report(read_csv(out)))
        return
    if not collect:
        tasks = [Task(cast(Recipe, group), "") for group in [*groups(), *repeats()]]
        campaigns.run(tasks, folder, 1, solved)
        return
    for path, asked in ((out, groups()), (CELLS, repeats())):
        if not any((folder / f"{group.name}.npz").exists() for group in asked):
            continue
        frame = campaigns.gathered(folder, asked, described)
        write_file(path, gzip.compress(to_csv(HEAD, frame, "%.6g"), mtime=0))
        click.echo(f"{path}: {len(frame)} contacts")


if __name__ == "__main__":
    unloading()
