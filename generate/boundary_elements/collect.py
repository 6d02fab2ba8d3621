"""One netCDF file of all surfaces that are solved, with what made them; `variables.toml` describes its variables."""

from __future__ import annotations

import datetime
import json
import pathlib
import tomllib
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from generate.boundary_elements import capped
from generate.boundary_elements.design import SPLITS, Task
from generate.boundary_elements.surfaces import Recipe
from generate.calibrated_file import Variable, variable
from generate.provenance import source_digest, versions
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.laws import bearing_curve as bearing

TEXTS = tomllib.loads(pathlib.Path(__file__).with_name("variables.toml").read_text(encoding="utf-8"))
DIMENSIONS = ("surface", "load", "quantile", "top", "band", "band_or_end", "axis")
COORDINATES: dict[str, Any] = {"quantile": bearing.QUANTILES, "top": bearing.FRACTIONS, "eta": capped.HARDNESSES}
BITS = {"band_energy": 10, "residual": 4, "seconds": 7}  # of mantissas that are kept; of others 24, of force 53
LOADED = {"band_energy", "flow"}


def collected(name: str, found: Sequence[dict[str, Any]], kind: str) -> xr.Variable:
    """One number or curve of all surfaces; NaN where a surface has fewer loads."""
    capped_too = kind == "hardness" and name in TEXTS["hardness"]
    dimension = "hardness" if capped_too else next(d for d in DIMENSIONS if name in TEXTS[d])
    own = [np.atleast_1d(content[name]) for content in found]
    values, dims = np.array([own[0]]), [] if dimension == "surface" else [dimension]
    if dimension == "surface":
        values = np.array([v.item() for v in own])
    elif dimension == "load" or name in LOADED:
        values = np.full((len(own), max(len(content["force"]) for content in found), *own[0].shape[1:]), np.nan)
        for row, v in zip(values, own, strict=True):
            row[: len(v)] = v
        dims = ["load", *(d for d in dims if d != "load")]
    else:
        values, dims = np.array(own), [*dims, *(["load"] if capped_too else [])]
    if name in BITS:
        mantissa, exponent = np.frexp(values)
        values = np.ldexp(np.round(mantissa * 2.0 ** BITS[name]) / 2.0 ** BITS[name], exponent)
    number = "f8" if dimension == "surface" or (dimension == "load" and name == "force") else "f4"
    attributes = {"long_name": TEXTS[dimension][name], "units": "s" if name == "seconds" else "1"}
    return xr.Variable(["surface", *dims], values.astype(number), attributes)


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


def attributes(texts: dict[str, Any], made_by: dict[str, str]) -> dict[str, Any]:
    """Attributes of a group of the data set, by its texts in `variables.toml` and the programs that made it."""
    return {
        "Conventions": "CF-1.11",
        "title": texts["title"],
        "institution": "mbma_tables contributors",
        "source": texts["source"].format_map(made_by),
        "history": f"{datetime.datetime.now(datetime.UTC):%Y-%m-%d} python -m generate {texts['command']}",
        "versions": json.dumps(versions() | made_by),
        "code_sha256": source_digest(tuple(texts["modules"])),
    } | {name: texts[name] for name in ("comment", "references") if name in texts}


def group(kind: str, variables: Any, **made_by: str) -> xr.Dataset:
    """A group of the data set with its attributes."""
    return xr.Dataset(variables, attrs=attributes(TEXTS["groups"][kind], made_by))


def of_contacts(kind: str, columns: Iterable[Any]) -> xr.Dataset:
    """A group of a row a contact, its columns as `variables.toml` lists them."""
    texts = TEXTS["groups"][kind]["columns"].items()
    return group(kind, {n: variable("contact", v, m) for (n, m), v in zip(texts, columns, strict=True)})


def surfaces(data: xr.Dataset) -> list[xr.Dataset]:
    """Every surface of a group."""
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
