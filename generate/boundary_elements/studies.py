"""Further commands on simulated maps: `grids`, `measured_maps`, `light` and `gaps`."""

import dataclasses
import itertools
import pathlib
import time
from collections.abc import Iterator
from typing import Any

import click
import numpy as np
import pandas as pd
import xarray as xr
from tqdm import tqdm

from generate.boundary_elements.run import TEXTS, collected, group, of_recipes
from generate.boundary_elements.solve import LOADS, Contact, load_at, prepared, pressed
from generate.boundary_elements.surfaces import CAMPAIGNS, HELD_OUT_SPECTRUM, Recipe, campaign, heights
from generate.calibrated_file import rms, variable, write_part
from generate.timing import seconds_of_work
from mbma_tables import Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.common.files import write_file
from mbma_tables.data import FILE
from mbma_tables.laws import boundary_elements
from mbma_tables.laws.bearing_curve import bearing
from mbma_tables.laws.gas import mean_inverse
from mbma_tables.surfaces.maps import prepared as treated_map
from mbma_tables.surfaces.treatment import Treated, mirrored

DATA = pathlib.Path("docs/data")
CHOSEN = ((0.3, 12.0), (0.9, 12.0))  # H and zeta_1 of held-out spectra, their first surfaces
GRIDS = (32, 64, 128, 256, 512, 1024)  # points a side; 60 of the shortest waves
STARTS = ("cold", "continued")
COLUMNS = ("hurst", "zeta_1", "waves", "seed", "points", "start", "force", "area", "mean_separation", "seconds", "cost")
HEAD = """\
# Held-out surfaces of the group elastic on grids of 32 to 1024 points a side, by python -m generate grids.
# force in A0 E* g, g the rms gradient of the finest grid; area A/A0, corrected for its perimeter; separation in h_rms.
# seconds of the processor a load; cost: those over the fixed piece of work of docs/cost.md, timed before and after.
"""
LARGEST = 256  # points a side of measured maps that are kept, from the middle

LIGHT_LOADS = np.geomspace(2e-5, 0.012, 40)  # F/(A0 E* g): from first contact, a few points of the grid, to 3% contact
LIGHT_BANDS = ((1, 8), (1, 32), (2, 16), (4, 10), (8, 5), (16, 3.2))  # longest wavelengths a side, and q1/q0
LIGHT_HURSTS, LIGHT_SEEDS = (0.5, 0.8), (1, 2, 3, 4, 5)
LIGHT_BINS = (2e-4, 5e-4, 1e-3, 3e-3, 1e-2)  # A/A0

JUMPS = np.array([0.03, 0.1, 0.3, 1.0, 3.0])  # of a gas's temperature [h_rms]
AREAS = (0.003, 0.01, 0.03, 0.1, 0.2, 0.35, 0.55, 0.75)
LIGHT, HEAVY = 0.05, 0.3  # contact fractions
MANY = 3  # long waves a side from which the highest point is a surface's, not a map's
HARDNESSES = {"fitted": (np.inf, 0.4, 0.1), "held out": (np.inf, 0.8, 0.2, 0.05)}
PLAIN = "self_affine"
PATH: Any = click.Path(path_type=pathlib.Path)


def solve(recipe: Recipe, grid: int, finest: int, start: str) -> Iterator[tuple[Any, ...]]:
    """Rows of one surface on one grid, whose heights are those of the finest at every second, fourth, ... point."""
    fine = heights(dataclasses.replace(recipe, points=finest))
    known = bearing(fine, recipe.sizes)
    surface = (fine / known.gradient)[:: finest // grid, :: finest // grid]
    length, engine = known.h_rms / known.gradient, Contact(surface, recipe.sizes)
    for force in LOADS[::2]:
        # cold by an engine made for the load, continued from the pressures of the load below
        before, started = seconds_of_work(), time.process_time()
        found = (Contact(surface, recipe.sizes) if start == "cold" else engine).press(force)
        seconds = time.process_time() - started
        cost = 2 * seconds / (before + seconds_of_work())
        node = (recipe.hurst, recipe.zeta_1, recipe.waves, recipe.seed, grid, start, force)
        yield (*node, found["area"], found["mean_separation"] / length, seconds, cost)


@click.command()
@click.option("--out", "target", type=PATH, default=DATA / "boundary_element_grids.csv", show_default=True)
def grids(target: pathlib.Path) -> None:
    """Solve held-out surfaces on ever finer grids, loads cold and continued: half an hour."""
    held = [task.recipe for task in campaign() if task.split == HELD_OUT_SPECTRUM and task.recipe.kind == PLAIN]
    surfaces = [next(one for one in held if (one.hurst, one.zeta_1) == chosen) for chosen in CHOSEN]
    rows = list[tuple[Any, ...]]()
    for grid, recipe, start in tqdm(list(itertools.product(GRIDS, surfaces, STARTS)), disable=None):
        rows += solve(recipe, grid, GRIDS[-1], start)
    text = pd.DataFrame(rows, columns=COLUMNS).to_csv(index=False, float_format="%.8g", lineterminator="\n")
    write_file(target, (HEAD + text).encode())
    click.echo(f"{target}: {len(rows)} loads")


def middle(treated: Treated) -> Treated:
    """At most `LARGEST` points a side from the middle of a map."""
    kept = tuple(slice((n - min(n, LARGEST)) // 2, (n + min(n, LARGEST)) // 2) for n in treated.heights.shape)
    return dataclasses.replace(treated, heights=treated.heights[kept])


@click.command()
@click.argument("maps", nargs=-1, required=True, type=click.Path(path_type=pathlib.Path, exists=True, dir_okay=False))
@click.option("--data", type=PATH, default=FILE, show_default=True)
def measured_maps(maps: tuple[pathlib.Path, ...], data: pathlib.Path) -> None:
    """Simulate measured maps for docs/fidelity.md, read by SurfaceTopography: a few minutes each."""
    solved = []
    for path in maps:
        treated = middle(treated_map(path, {"periodic": False}))
        surface = mirrored(treated.heights - treated.heights.mean())
        sizes = surface.shape[0] * treated.steps[0], surface.shape[1] * treated.steps[1]
        # in units of the shorter side, as random surfaces are
        unit = min(sizes)
        solved.append(pressed(surface / unit, (sizes[0] / unit, sizes[1] / unit), 2 * np.pi))
        click.echo(f"{path}: h_rms {surface.std():.4g} {treated.unit}")
    found = {name: collected(name, solved, "elastic") for name in TEXTS["files"]["elastic"]["numbers"]}
    own = group("measured", found, engine=str(solved[0]["engine"])).assign_coords(
        surface=variable("surface", [path.stem for path in maps], "name of the map's file")
    )
    write_part(data, own, "measured")


def light_contacts(recipe: Recipe) -> FloatArray:
    """Highest point, A/A0 and mean separations [h_rms] at `LIGHT_LOADS`; NaN where a single point is in contact."""
    surface, _, known = prepared(heights(recipe), recipe.sizes, recipe.q0)
    model, rows = Contact(surface, recipe.sizes), np.full((3, LIGHT_LOADS.size), np.nan)
    rows[0] = known["h_max"]
    for k, load in enumerate(LIGHT_LOADS):
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
    known = contact(face, pressure=LIGHT_LOADS * scale, theory="calibrated").mean_separation
    with np.errstate(invalid="ignore", divide="ignore"):
        stiffness = np.log(np.diff(known) / np.diff(u))
        by_gap = contact(face, mean_separation=np.nan_to_num(u), theory="calibrated").pressure
        force = np.log(LIGHT_LOADS * scale / by_gap)
    return np.stack([np.sqrt(area[1:] * area[:-1]), stiffness, force[1:]])


@click.command()
@click.option("--data", type=PATH, default=FILE, show_default=True)
def light(data: pathlib.Path) -> None:
    """Simulate light loads on 60 surfaces, four minutes; `generate pages joints` compares."""
    over, texts = ("surface", "load"), TEXTS["load"] | TEXTS["surface"]
    design = itertools.product(LIGHT_BANDS, LIGHT_HURSTS, LIGHT_SEEDS)
    recipes = [Recipe(PLAIN, hurst, zeta_1, waves, seed, 256) for (waves, zeta_1), hurst, seed in design]
    h_max, area, u = np.array([light_contacts(recipe) for recipe in tqdm(recipes, disable=None)]).swapaxes(0, 1)
    columns = {"h_max": ("surface", h_max[:, 0]), "force": ("load", LIGHT_LOADS), "area": (over, area.astype("f4"))}
    columns["mean_separation"] = over, u.astype("f4")
    found = {name: variable(*column, texts[name]) for name, column in columns.items()}
    write_part(data, group("light_loads", of_recipes(recipes) | found), "light_loads")
    click.echo(f"{data}: {len(recipes)} surfaces")


def gap_errors(kind: str) -> pd.DataFrame:
    """ln(law/simulation) at `JUMPS`, a row a contact: with the simulated contact, with one gap for all, of the chain.

    The chain, from pressure and hardness by the calibrated law, is that of self-affine surfaces, else NaN.
    """
    found, recipes = [], [Recipe(*row) for row in CAMPAIGNS["gaps"][kind]]
    for recipe, eta in itertools.product(recipes, HARDNESSES[kind]):
        surface, _, known = prepared(heights(recipe), recipe.sizes, recipe.q0)
        h_rms = float(surface.std())
        like = Surface(recipe.hurst, recipe.q0, recipe.q0 * recipe.zeta_1, h_rms, known["h_max"] * h_rms)
        solved = boundary_elements.Contact(surface, recipe.sizes, hardness=eta)
        for load in (load_at(area, eta) for area in AREAS):
            row: dict[str, Any] = {"area": solved.press(load)["area"], "waves": recipe.waves}
            assert solved.pressure is not None
            open_, gap = solved.pressure <= 0, solved.gap / h_rms
            simulated = np.array([(open_ / (gap + jump)).mean() for jump in JUMPS])
            laws = {"law": mean_inverse(gap.mean(), 1 - open_.mean(), JUMPS, 1.0, eta)}
            laws |= {"one gap": 1 / (gap.mean() + JUMPS), "chain": np.full(JUMPS.size, np.nan)}
            if recipe.kind == PLAIN:
                own = contact(like, pressure=load, theory="calibrated", hardness=eta)
                laws["chain"] = mean_inverse(float(own.mean_separation) / h_rms, float(own.area), JUMPS, 1.0, eta)
            found.append(row | {name: np.log(value / simulated) for name, value in laws.items()})
    return pd.DataFrame(found)


@click.command()
def gaps() -> None:
    """Print errors of a gas's conductance against gaps of boundary elements, for docs/joints.md: six minutes."""
    for kind in HARDNESSES:
        known = gap_errors(kind)
        light, many = known["area"] < LIGHT, (known["waves"] >= MANY) & (known["area"] < HEAVY)
        law, one, chain = (100 * np.stack(known[name]) for name in ("law", "one gap", "chain"))
        click.echo(f"{kind}: M/h_rms; root mean square and largest error; largest of k/(u + M) below 5% contact;")
        click.echo("mean and standard deviation of the chain, from three long waves a side on, below 30% contact [%]")
        for k, jump in enumerate(JUMPS):
            told = rms(law[:, k]), np.abs(law[:, k]).max(), np.abs(one[light, k]).max()
            of_chain = np.nanmean(chain[many, k]), np.nanstd(chain[many, k])
            click.echo(" ".join([f"{jump:5g}", *(f"{value:6.1f}" for value in (*told, *of_chain))]))
