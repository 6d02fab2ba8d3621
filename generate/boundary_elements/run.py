"""`python -m generate boundary_elements`, `grids`, `measured_maps`, `light` and `gas`: simulated maps.

Campaigns are run, or what there is of them gathered into one netCDF file; `variables.toml`
describes its variables.
"""

import dataclasses
import functools
import itertools
import pathlib
import time
import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import click
import numpy as np
import pandas as pd
import xarray as xr
from scipy.interpolate import CubicSpline
from tqdm import tqdm

from generate.boundary_elements.solve import (
    HARDNESSES,
    KEEPING,
    RANGES,
    SOLVERS,
    Contact,
    Solve,
    is_solved,
    load_at,
    prepared,
    pressed,
    simulated,
)
from generate.boundary_elements.surfaces import (
    CAMPAIGNS,
    HELD_OUT_SPECTRUM,
    SPLITS,
    Recipe,
    Task,
    campaign,
    heights,
)
from generate.calibrated_file import Variable, attributes, rms, variable, write_part
from generate.timing import seconds_of_work
from mbma_tables import Bodies, Surface, contact
from mbma_tables.cli.options import work_options
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError, InputError
from mbma_tables.common.files import write_file
from mbma_tables.common.workers import crew, part_of, share_of
from mbma_tables.contacts.quantities.gas import mean_inverse
from mbma_tables.surfaces.bearing_curve import FRACTIONS, QUANTILES, bearing
from mbma_tables.surfaces.maps import prepared as treated_map
from mbma_tables.surfaces.treatment import Treated, mirrored
from mbma_tables.theories.dataset import FILE
from mbma_tables.theories.simulated.boundary_elements import LOADS
from mbma_tables.theories.simulated.boundary_elements import (
    BoundaryElementContact as YieldingContact,
)
from mbma_tables.theories.simulated.map_gaps import OPEN_SHARES

TEXTS = tomllib.loads(
    pathlib.Path(__file__).with_name("variables.toml").read_text(encoding="utf-8")
)
FEWEST = 4  # loads of a surface from which on its stiffness is found
DIMENSIONS = (
    *("surface", "load", "quantile", "top", "band", "band_or_end", "axis"),
    *("share_open", "range"),
)
COORDINATES: dict[str, Any] = {
    "quantile": QUANTILES,
    "top": FRACTIONS,
    "eta": HARDNESSES,
    "share_open": OPEN_SHARES,
    "range": RANGES,
}
BITS = {
    "band_energy": 10,
    "residual": 4,
    "seconds": 7,
    "gap_quantile": 12,
    "gap_moment": 14,
}  # of mantissas that are kept; of others 24, of force 53
LOADED = {"band_energy", "flow", "gap_quantile", "gap_moment"}


def run(
    tasks: Sequence[Task],
    folder: pathlib.Path,
    workers: int = 1,
    solve: Solve = SOLVERS["elastic"],
    part: tuple[int, int] | None = None,
    scheduler: str | None = None,
    local_cluster: int | None = None,
) -> None:
    """Solve what `folder` does not hold yet, one file a surface; those that fail are named at the end.

    A file is written, whole, as soon as its surface is solved. Who does the work is said as
    for tables of functions, `mbma_tables.tables.make_function.make`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    missing = [
        task.recipe
        for task in share_of(part, tasks)
        if not is_solved(folder / f"{task.recipe.name}.npz", task.recipe)
    ]
    jobs = [(recipe, solve) for recipe in missing]
    failures = []
    with crew(workers, scheduler, local_cluster) as run_jobs:
        bar = tqdm(
            run_jobs.as_finished(simulated, jobs), "surfaces", len(jobs), disable=None
        )
        for name, found in bar:
            if isinstance(found, str):
                failures.append(f"{name}: {found}")
            else:
                write_file(folder / f"{name}.npz", found)
    if failures:
        raise RuntimeError(
            f"{len(failures)} of {len(missing)} surfaces failed: {failures[0]}"
        )


def gathered(
    folder: pathlib.Path,
    asked: Sequence[Any],
    described: Callable[[Any], dict[str, Any]] = lambda one: {},
) -> pd.DataFrame:
    """Rows of those of the asked that are solved, behind the columns that describe each."""
    frames = []
    for one in asked:
        path = folder / f"{one.name}.npz"
        if path.exists():
            with np.load(path, allow_pickle=False) as content:
                frame = pd.DataFrame(dict(content))
            own = described(one)
            frames.append(frame.assign(**own)[[*own, *frame.columns]])
    return pd.concat(frames, ignore_index=True)


def collected(name: str, found: Sequence[dict[str, Any]], kind: str) -> xr.Variable:
    """One number or curve of all surfaces; NaN where a surface has fewer loads."""
    of_hardness = kind == "hardness" and name in TEXTS["hardness"]
    dimension = (
        "hardness" if of_hardness else next(d for d in DIMENSIONS if name in TEXTS[d])
    )
    own = [np.asarray(content[name]) for content in found]
    dims = [] if dimension == "surface" else [dimension]
    if dimension == "load" or name in LOADED:
        dims = ["load", *(d for d in dims if d != "load")]
        values = np.full((len(own), max(map(len, own)), *own[0].shape[1:]), np.nan)
        for row, v in zip(values, own, strict=True):
            row[: len(v)] = v
    else:
        dims += ["load"] if of_hardness else []
        values = np.array(own)
    if name in BITS:
        mantissa, exponent = np.frexp(values)
        values = np.ldexp(
            np.round(mantissa * 2.0 ** BITS[name]) / 2.0 ** BITS[name], exponent
        )
    number = (
        "f8"
        if dimension == "surface" or (dimension == "load" and name == "force")
        else "f4"
    )
    labels = {
        "long_name": TEXTS[dimension][name],
        "units": "s" if name == "seconds" else "1",
    }
    return xr.Variable(["surface", *dims], values.astype(number), labels)


def stiffness(data: xr.Dataset) -> FloatArray:
    """-dF/du of every surface by a spline; NaN without a gap, and of few loads."""
    found = np.full(data.force.shape, np.nan, "f4")
    for row, force, u in zip(
        found, data.force.values, data.mean_separation.values, strict=True
    ):
        known = u > 0
        if np.count_nonzero(known) < FEWEST:
            continue
        log_u = CubicSpline(np.log(force[known]), np.log(u[known]))
        row[known] = -force[known] / (u[known] * log_u.derivative()(np.log(force[known])))
    return found


def of_recipes(recipes: Sequence[Recipe]) -> dict[str, Variable]:
    return {
        name: variable(
            "surface", np.array([getattr(recipe, name) for recipe in recipes]), meaning
        )
        for name, meaning in TEXTS["recipe"].items()
    }


def group(kind: str, variables: Any, **made_by: str) -> xr.Dataset:
    return xr.Dataset(variables, attrs=attributes(TEXTS["groups"][kind], made_by))


def of_contacts(kind: str, columns: Iterable[Any]) -> xr.Dataset:
    """A group of a row a contact, its columns as `variables.toml` lists them."""
    texts = TEXTS["groups"][kind]["columns"].items()
    return group(
        kind,
        {n: variable("contact", v, m) for (n, m), v in zip(texts, columns, strict=True)},
    )


def surfaces(data: xr.Dataset) -> list[xr.Dataset]:
    return [data.isel(surface=number) for number in range(data.sizes["surface"])]


def _flags(values: Sequence[str], meanings: Sequence[str], name: str) -> xr.Variable:
    attributes = {"long_name": name, "flag_values": np.arange(len(meanings), dtype="i1")}
    numbers = np.array([list(meanings).index(value) for value in values], "i1")
    return xr.Variable(
        "surface", numbers, attributes | {"flag_meanings": " ".join(meanings)}
    )


def dataset(
    tasks: Sequence[Task], folder: pathlib.Path, kind: str = "elastic"
) -> xr.Dataset:
    solved = []
    found = []
    for task in tasks:
        path = folder / f"{task.recipe.name}.npz"
        if path.exists():
            solved.append(task)
            with np.load(path, allow_pickle=False) as content:
                found.append(dict(content))
    if not found:
        raise InputError(f"no surface of this campaign is in {folder}")
    texts = TEXTS["files"][kind]
    recipes = [task.recipe for task in solved]
    data = xr.Dataset({name: collected(name, found, kind) for name in texts["numbers"]})
    data["kind"] = _flags(
        [r.kind for r in recipes], sorted({r.kind for r in recipes}), "family of surfaces"
    )
    meaning = "what a fit may see: the training set and no other"
    data["split"] = _flags([task.split for task in solved], SPLITS, meaning)
    data.update(of_recipes(recipes))
    for name, meaning in TEXTS["coordinates"].items():
        dimension = "hardness" if name == "eta" else name
        if dimension in data.dims:
            data[name] = variable(dimension, np.array(COORDINATES[name]), meaning)
    if kind in ("elastic", "bandwidth"):
        data["stiffness"] = variable(
            data.force.dims, stiffness(data), TEXTS["load"]["stiffness"]
        )
    made_by = {
        what: ", ".join(sorted({str(content[what]) for content in found}))
        for what in ("engine", "numpy")
    }
    common = TEXTS["files"]
    texts = (
        common
        | texts
        | {name: common[name] + texts[name] for name in ("modules", "comment")}
    )
    texts["command"] = f"boundary_elements --of {kind} --collect"
    data.attrs = attributes(texts, made_by) | {
        "surfaces_planned": len(tasks),
        "surfaces_solved": len(found),
    }
    return data


@click.command()
@click.option(
    "--of",
    "kind",
    type=click.Choice([*SOLVERS, *KEEPING]),
    default="elastic",
    show_default=True,
)
@click.option(
    "--folder",
    type=click.Path(path_type=pathlib.Path),
    help="One file a surface.  [default: its kind]",
)
@click.option(
    "--collect",
    "target",
    type=click.Path(path_type=pathlib.Path),
    help="Write into this file, no runs.",
)
@click.option(
    "--points",
    type=click.IntRange(64),
    default=1024,
    show_default=True,
    help="Largest grid to run.",
)
@click.option(
    "--workers", type=click.IntRange(1), default=1, show_default=True, help="Processes."
)
@work_options()
def boundary_elements(
    kind: str,
    folder: pathlib.Path | None,
    target: pathlib.Path | None,
    points: int,
    workers: int,
    part: str | None,
    scheduler: str | None,
    local_cluster: int | None,
) -> None:
    """Solve random surfaces by boundary elements (Tamaas, the extra `simulate`): four hours on two cores.

    Of hardness, a solver of its own caps pressures at seven hardnesses: half an hour, no
    Tamaas. Of leakage, Reynolds' equation is solved on the gaps: half an hour. Of bandwidth,
    surfaces of 2048 and 4096 points a side are pressed by the library's own solver, which
    keeps every load at once: hours; give `--points 4096`.

    Stopped and called again, it goes on where it was. Small grids come first, every kind of
    surface in turn. The files of parts belong in one folder.
    """
    folder = folder or pathlib.Path("boundary_elements", kind)
    tasks = [task for task in campaign(kind) if task.recipe.points <= points]
    if target is not None:
        data = dataset(tasks, folder, kind)
        write_part(target, data, kind)
        click.echo(
            f"{target}: {data.sizes['surface']} of {len(tasks)} surfaces, {target.stat().st_size} bytes"
        )
        return
    solver = SOLVERS.get(kind) or functools.partial(KEEPING[kind], folder=folder)
    run(tasks, folder, workers, solver, part_of(part), scheduler, local_cluster)


DATA = pathlib.Path("docs/data")
CHOSEN = (
    (0.3, 12.0),
    (0.9, 12.0),
)  # H and zeta_1 of held-out spectra, their first surfaces
GRIDS = (32, 64, 128, 256, 512, 1024)  # points a side; 60 of the shortest waves
STARTS = ("cold", "continued")
COLUMNS = (
    "hurst",
    "zeta_1",
    "waves",
    "seed",
    "points",
    "start",
    "force",
    "area",
    "mean_separation",
    "seconds",
    "cost",
)
HEAD = """\
# Held-out surfaces of the group elastic on grids of 32 to 1024 points a side, by python -m generate grids.
# force in A0 E* g, g the rms gradient of the finest grid; area A/A0, corrected for its perimeter; separation in h_rms.
# seconds of the processor a load; cost: those over the fixed piece of work of docs/lookup.md, timed before and after.
"""
LARGEST = 256  # points a side of measured maps that are kept, from the middle

LIGHT_LOADS = np.geomspace(
    2e-5, 0.012, 40
)  # F/(A0 E* g): from first contact, a few points of the grid, to 3% contact
LIGHT_BANDS = (
    (1, 8),
    (1, 32),
    (2, 16),
    (4, 10),
    (8, 5),
    (16, 3.2),
)  # longest wavelengths a side, and q1/q0
LIGHT_HURSTS = (0.5, 0.8)
LIGHT_SEEDS = (1, 2, 3, 4, 5)
LIGHT_BINS = (2e-4, 5e-4, 1e-3, 3e-3, 1e-2)  # A/A0

JUMPS = np.array([0.03, 0.1, 0.3, 1.0, 3.0])  # of a gas's temperature [h_rms]
AREAS = (0.001, 0.003, 0.01, 0.03, 0.1, 0.2, 0.35, 0.55, 0.75)
# contact fractions
LIGHT = 0.05
HEAVY = 0.3
MANY = 3  # long waves a side from which the highest point is a surface's, not a map's
GAP_HARDNESSES = {"fitted": (np.inf, 0.4, 0.1), "held out": (np.inf, 0.8, 0.2, 0.05)}
PLAIN = "self_affine"
PATH: Any = click.Path(path_type=pathlib.Path)


def solve(
    recipe: Recipe, grid: int, finest: int, start: str
) -> Iterator[tuple[Any, ...]]:
    """Rows of one surface on one grid, whose heights are those of the finest at every second, fourth, ... point."""
    fine = heights(dataclasses.replace(recipe, points=finest))
    known = bearing(fine, recipe.sizes)
    surface = (fine / known.gradient)[:: finest // grid, :: finest // grid]
    length = known.h_rms / known.gradient
    engine = Contact(surface, recipe.sizes)
    for force in LOADS[::2]:
        # cold by an engine made for the load, continued from the pressures of the load below
        before = seconds_of_work()
        started = time.process_time()
        found = (Contact(surface, recipe.sizes) if start == "cold" else engine).press(
            force
        )
        seconds = time.process_time() - started
        cost = 2 * seconds / (before + seconds_of_work())
        node = (
            recipe.hurst,
            recipe.zeta_1,
            recipe.waves,
            recipe.seed,
            grid,
            start,
            force,
        )
        yield (*node, found["area"], found["mean_separation"] / length, seconds, cost)


@click.command()
@click.option(
    "--out",
    "target",
    type=PATH,
    default=DATA / "boundary_element_grids.csv",
    show_default=True,
)
def grids(target: pathlib.Path) -> None:
    """Solve held-out surfaces on ever finer grids, loads cold and continued: half an hour."""
    held = [
        task.recipe
        for task in campaign()
        if task.split == HELD_OUT_SPECTRUM and task.recipe.kind == PLAIN
    ]
    surfaces = [
        next(one for one in held if (one.hurst, one.zeta_1) == chosen)
        for chosen in CHOSEN
    ]
    rows = list[tuple[Any, ...]]()
    for grid, recipe, start in tqdm(
        list(itertools.product(GRIDS, surfaces, STARTS)), disable=None
    ):
        rows += solve(recipe, grid, GRIDS[-1], start)
    text = pd.DataFrame(rows, columns=COLUMNS).to_csv(
        index=False, float_format="%.8g", lineterminator="\n"
    )
    write_file(target, (HEAD + text).encode())
    click.echo(f"{target}: {len(rows)} loads")


def middle(treated: Treated) -> Treated:
    """At most `LARGEST` points a side from the middle of a map."""
    kept = tuple(
        slice((n - min(n, LARGEST)) // 2, (n + min(n, LARGEST)) // 2)
        for n in treated.heights.shape
    )
    return dataclasses.replace(treated, heights=treated.heights[kept])


@click.command()
@click.argument(
    "maps",
    nargs=-1,
    required=True,
    type=click.Path(path_type=pathlib.Path, exists=True, dir_okay=False),
)
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
        solved.append(
            pressed(surface / unit, (sizes[0] / unit, sizes[1] / unit), 2 * np.pi)
        )
        click.echo(f"{path}: h_rms {surface.std():.4g} {treated.unit}")
    found = {
        name: collected(name, solved, "elastic")
        for name in TEXTS["files"]["elastic"]["numbers"]
    }
    own = group("measured", found, engine=str(solved[0]["engine"])).assign_coords(
        surface=variable(
            "surface", [path.stem for path in maps], "name of the map's file"
        )
    )
    write_part(data, own, "measured")


def light_contacts(recipe: Recipe) -> FloatArray:
    """Highest point, A/A0 and mean separations [h_rms] at `LIGHT_LOADS`; NaN where a single point is in contact."""
    surface, _, known = prepared(heights(recipe), recipe.sizes, recipe.q0)
    model = Contact(surface, recipe.sizes)
    rows = np.full((3, LIGHT_LOADS.size), np.nan)
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
    h_max, area, u = (
        float(one.h_max),
        *(one[name].values.astype(float) for name in ("area", "mean_separation")),
    )
    face = Surface(float(one.hurst), 1.0, float(one.zeta_1), 1.0, h_max)
    scale = float(face.rms_gradient)
    known = contact(
        face, pressure=LIGHT_LOADS * scale, theory="calibrated"
    ).mean_separation
    with np.errstate(invalid="ignore", divide="ignore"):
        stiffness = np.log(np.diff(known) / np.diff(u))
        by_gap = contact(
            face, mean_separation=np.nan_to_num(u), theory="calibrated"
        ).pressure
        force = np.log(LIGHT_LOADS * scale / by_gap)
    return np.stack([np.sqrt(area[1:] * area[:-1]), stiffness, force[1:]])


@click.command()
@click.option("--data", type=PATH, default=FILE, show_default=True)
def light(data: pathlib.Path) -> None:
    """Simulate light loads on 60 surfaces, four minutes; `generate pages joints` compares."""
    over = ("surface", "load")
    texts = TEXTS["load"] | TEXTS["surface"]
    design = itertools.product(LIGHT_BANDS, LIGHT_HURSTS, LIGHT_SEEDS)
    recipes = [
        Recipe(PLAIN, hurst, zeta_1, waves, seed, 256)
        for (waves, zeta_1), hurst, seed in design
    ]
    h_max, area, u = np.array(
        [light_contacts(recipe) for recipe in tqdm(recipes, disable=None)]
    ).swapaxes(0, 1)
    columns = {
        "h_max": ("surface", h_max[:, 0]),
        "force": ("load", LIGHT_LOADS),
        "area": (over, area.astype("f4")),
    }
    columns["mean_separation"] = over, u.astype("f4")
    found = {name: variable(*column, texts[name]) for name, column in columns.items()}
    write_part(data, group("light_loads", of_recipes(recipes) | found), "light_loads")
    click.echo(f"{data}: {len(recipes)} surfaces")


def gap_errors(kind: str) -> pd.DataFrame:
    """ln(law/simulation) at `JUMPS`, a row a contact: with the simulated contact, with one gap for all, of the chain.

    The chain, from pressure and hardness by the calibrated law, is that of self-affine
    surfaces, else NaN.
    """
    found = []
    recipes = [Recipe(*row) for row in CAMPAIGNS["gas"][kind]]
    for recipe, eta in itertools.product(recipes, GAP_HARDNESSES[kind]):
        surface, _, known = prepared(heights(recipe), recipe.sizes, recipe.q0)
        h_rms = float(surface.std())
        like = Surface(
            recipe.hurst,
            recipe.q0,
            recipe.q0 * recipe.zeta_1,
            h_rms,
            known["h_max"] * h_rms,
        )
        solved = YieldingContact(surface, recipe.sizes, hardness=eta)
        for load in (load_at(area, eta) for area in AREAS):
            row: dict[str, Any] = {
                "area": solved.press(load)["area"],
                "waves": recipe.waves,
            }
            assert solved.pressure is not None
            open_ = solved.pressure <= 0
            gap = solved.gap / h_rms
            simulated = np.array([(open_ / (gap + jump)).mean() for jump in JUMPS])
            laws = {"law": mean_inverse(gap.mean(), 1 - open_.mean(), JUMPS, 1.0, eta)}
            laws |= {
                "one gap": 1 / (gap.mean() + JUMPS),
                "chain": np.full(JUMPS.size, np.nan),
            }
            if recipe.kind == PLAIN:
                own = contact(
                    like, Bodies(hardness=eta), pressure=load, theory="calibrated"
                )
                laws["chain"] = mean_inverse(
                    float(own.mean_separation) / h_rms, float(own.area), JUMPS, 1.0, eta
                )
            found.append(
                row | {name: np.log(value / simulated) for name, value in laws.items()}
            )
    return pd.DataFrame(found)


@click.command()
def gas() -> None:
    """Print errors of a gas's conductance against gaps of boundary elements, for docs/joints.md: six minutes."""
    for kind in GAP_HARDNESSES:
        known = gap_errors(kind)
        light = known["area"] < LIGHT
        many = (known["waves"] >= MANY) & (known["area"] < HEAVY)
        law, one, chain = (
            100 * np.stack(known[name]) for name in ("law", "one gap", "chain")
        )
        click.echo(
            f"{kind}: M/h_rms; root mean square and largest error; largest of k/(u + M) below 5% contact;"
        )
        click.echo(
            "mean and standard deviation of the chain, from three long waves a side on, below 30% contact [%]"
        )
        for k, jump in enumerate(JUMPS):
            told = rms(law[:, k]), np.abs(law[:, k]).max(), np.abs(one[light, k]).max()
            of_chain = np.nanmean(chain[many, k]), np.nanstd(chain[many, k])
            click.echo(
                " ".join(
                    [f"{jump:5g}", *(f"{value:6.1f}" for value in (*told, *of_chain))]
                )
            )
