"""`python -m generate boundary_elements`: run a campaign, or gather what there is of it into one netCDF file.

`variables.toml` describes the file's variables.
"""

import functools
import pathlib
import tomllib
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import click
import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from generate.boundary_elements.solve import HARDNESSES, simulate, simulate_capped, simulate_to, solve_flow
from generate.boundary_elements.surfaces import SPLITS, Recipe, Task, campaign
from generate.calibrated_file import Variable, attributes, variable, write_part
from generate.workers import results
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.laws import bearing_curve as bearing

SOLVERS = {"elastic": simulate, "hardness": simulate_capped, "leakage": solve_flow}
TEXTS = tomllib.loads(pathlib.Path(__file__).with_name("variables.toml").read_text(encoding="utf-8"))
DIMENSIONS = ("surface", "load", "quantile", "top", "band", "band_or_end", "axis")
COORDINATES: dict[str, Any] = {"quantile": bearing.QUANTILES, "top": bearing.FRACTIONS, "eta": HARDNESSES}
BITS = {"band_energy": 10, "residual": 4, "seconds": 7}  # of mantissas that are kept; of others 24, of force 53
LOADED = {"band_energy", "flow"}


def run(
    tasks: Sequence[Task], folder: pathlib.Path, workers: int = 1, solve: Callable[[Any], dict[str, Any]] = simulate
) -> None:
    """Solve what `folder` does not hold yet, one file a surface; those that fail are named at the end."""
    folder.mkdir(parents=True, exist_ok=True)
    missing = [task.recipe for task in tasks if not (folder / f"{task.recipe.name}.npz").exists()]
    work = functools.partial(simulate_to, solve=solve, folder=folder)
    if failures := [*filter(None, results("surfaces", work, [(recipe,) for recipe in missing], workers))]:
        raise RuntimeError(f"{len(failures)} of {len(missing)} surfaces failed: {failures[0]}")


def collected(name: str, found: Sequence[dict[str, Any]], kind: str) -> xr.Variable:
    """One number or curve of all surfaces; NaN where a surface has fewer loads."""
    of_hardness = kind == "hardness" and name in TEXTS["hardness"]
    dimension = "hardness" if of_hardness else next(d for d in DIMENSIONS if name in TEXTS[d])
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
        values = np.ldexp(np.round(mantissa * 2.0 ** BITS[name]) / 2.0 ** BITS[name], exponent)
    number = "f8" if dimension == "surface" or (dimension == "load" and name == "force") else "f4"
    labels = {"long_name": TEXTS[dimension][name], "units": "s" if name == "seconds" else "1"}
    return xr.Variable(["surface", *dims], values.astype(number), labels)


def stiffness(data: xr.Dataset) -> FloatArray:
    """-dF/du of every surface by a spline; NaN without a gap."""
    found = np.full(data.force.shape, np.nan, "f4")
    for row, force, u in zip(found, data.force.values, data.mean_separation.values, strict=True):
        known = u > 0
        log_u = CubicSpline(np.log(force[known]), np.log(u[known]))
        row[known] = -force[known] / (u[known] * log_u.derivative()(np.log(force[known])))
    return found


def of_recipes(recipes: Sequence[Recipe]) -> dict[str, Variable]:
    """What random surfaces are made of."""
    return {
        name: variable("surface", np.array([getattr(recipe, name) for recipe in recipes]), meaning)
        for name, meaning in TEXTS["recipe"].items()
    }


def group(kind: str, variables: Any, **made_by: str) -> xr.Dataset:
    """A group of the data set with its attributes."""
    return xr.Dataset(variables, attrs=attributes(TEXTS["groups"][kind], made_by))


def of_contacts(kind: str, columns: Iterable[Any]) -> xr.Dataset:
    """A group of a row a contact, its columns as `variables.toml` lists them."""
    texts = TEXTS["groups"][kind]["columns"].items()
    return group(kind, {n: variable("contact", v, m) for (n, m), v in zip(texts, columns, strict=True)})


def surfaces(data: xr.Dataset) -> list[xr.Dataset]:
    return [data.isel(surface=number) for number in range(data.sizes["surface"])]


def _flags(values: Sequence[str], meanings: Sequence[str], name: str) -> xr.Variable:
    attributes = {"long_name": name, "flag_values": np.arange(len(meanings), dtype="i1")}
    numbers = np.array([list(meanings).index(value) for value in values], "i1")
    return xr.Variable("surface", numbers, attributes | {"flag_meanings": " ".join(meanings)})


def dataset(tasks: Sequence[Task], folder: pathlib.Path, kind: str = "elastic") -> xr.Dataset:
    """All solved surfaces of these tasks of a campaign."""
    solved, found = [], []
    for task in tasks:
        path = folder / f"{task.recipe.name}.npz"
        if path.exists():
            solved.append(task)
            with np.load(path, allow_pickle=False) as content:
                found.append(dict(content))
    if not found:
        raise InputError(f"no surface of this campaign is in {folder}")
    texts, recipes = TEXTS["files"][kind], [task.recipe for task in solved]
    data = xr.Dataset({name: collected(name, found, kind) for name in texts["numbers"]})
    data["kind"] = _flags([r.kind for r in recipes], sorted({r.kind for r in recipes}), "family of surfaces")
    meaning = "what a fit may see: the training set and no other"
    data["split"] = _flags([task.split for task in solved], SPLITS, meaning)
    data.update(of_recipes(recipes))
    for name, meaning in TEXTS["coordinates"].items():
        dimension = "hardness" if name == "eta" else name
        if dimension in data.dims:
            data[name] = variable(dimension, np.array(COORDINATES[name]), meaning)
    if kind == "elastic":
        data["stiffness"] = variable(data.force.dims, stiffness(data), TEXTS["load"]["stiffness"])
    made_by = {what: ", ".join(sorted({str(content[what]) for content in found})) for what in ("engine", "numpy")}
    common = TEXTS["files"]
    texts = common | texts | {name: common[name] + texts[name] for name in ("modules", "comment")}
    texts["command"] = f"boundary_elements --of {kind} --collect"
    data.attrs = attributes(texts, made_by) | {"surfaces_planned": len(tasks), "surfaces_solved": len(found)}
    return data


@click.command()
@click.option("--of", "kind", type=click.Choice(list(SOLVERS)), default="elastic", show_default=True)
@click.option("--folder", type=click.Path(path_type=pathlib.Path), help="One file a surface.  [default: its kind]")
@click.option("--collect", "target", type=click.Path(path_type=pathlib.Path), help="Write into this file, no runs.")
@click.option("--points", type=click.IntRange(64), default=1024, show_default=True, help="Largest grid to run.")
@click.option("--workers", type=click.IntRange(1), default=1, show_default=True, help="Processes.")
def boundary_elements(
    kind: str, folder: pathlib.Path | None, target: pathlib.Path | None, points: int, workers: int
) -> None:
    """Solve random surfaces by boundary elements (Tamaas, the extra `simulate`): four hours on two cores.

    Of hardness, a solver of its own caps pressures at seven hardnesses: half an hour, no Tamaas. Of leakage, Reynolds'
    equation is solved on the gaps: half an hour.

    Stopped and called again, it goes on where it was. Small grids come first, every kind of surface in turn.
    """
    folder = folder or pathlib.Path("boundary_elements", kind)
    tasks = [task for task in campaign(kind) if task.recipe.points <= points]
    if target is not None:
        data = dataset(tasks, folder, kind)
        write_part(target, data, kind)
        click.echo(f"{target}: {data.sizes['surface']} of {len(tasks)} surfaces, {target.stat().st_size} bytes")
        return
    run(tasks, folder, workers, SOLVERS[kind])
