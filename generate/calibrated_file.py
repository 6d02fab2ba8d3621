"""What fits of calibrated laws share, and their file tables/calibrated.nc: a root, and groups of other commands."""

import dataclasses
import hashlib
import itertools
import json
import os
import pathlib
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

import numpy as np
import xarray as xr
from scipy.optimize import least_squares

from generate.provenance import source_digest, versions
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.files import write_file, written_bytes
from mbma_tables.data import read_groups
from mbma_tables.tablefiles.netcdf import HDF5_LOCK, SEAL

QUANTITIES = ("area", "force", "stiffness")  # as the file names them: the library's "pressure" is "force" there
FOLDS = 5
Fitted = TypeVar("Fitted", bound=Any)  # a dataclass of constants
Variable = tuple[Any, Any, dict[str, Any]]


def fitted(
    start: Fitted, names: Sequence[str], residuals: Callable[[Fitted], Iterable[FloatArray]], **options: Any
) -> Fitted:
    """Constants of which the named ones make the residuals small, by robust least squares with these options."""

    def trial(values: FloatArray) -> Fitted:
        return dataclasses.replace(start, **dict(zip(names, map(float, values), strict=True)))

    first = [getattr(start, name) for name in names]
    found = least_squares(lambda x: np.concatenate([*residuals(trial(x))]), first, loss="soft_l1", **options)
    return trial(found.x)


def cross_validated(seen: Sequence[Any], fit: Callable[[list[Any]], Fitted]) -> dict[Any, Fitted]:
    """For the node of each surface, constants from other nodes: a fifth of them is left out at a time."""
    order, own = sorted({one.node for one in seen}), dict[Any, Fitted]()
    for fold in range(FOLDS):
        out = set(order[fold::FOLDS])
        own |= dict.fromkeys(out, fit([one for one in seen if one.node not in out]))
    return own


def binned(area: FloatArray, values: FloatArray, edges: Sequence[float]) -> list[FloatArray]:
    """Finite values at contacts between edges, bin by bin."""
    known = np.isfinite(values)
    return [values[(area >= low) & (area < high) & known] for low, high in itertools.pairwise(edges)]


def by_bin(area: Any, values: Any, edges: Sequence[float], *statistics: Callable[[FloatArray], Any]) -> FloatArray:
    """Statistics of finite values at contacts between edges, (bins, statistics); NaN in an empty bin."""
    parts = binned(np.asarray(area), np.asarray(values), edges)
    return np.array([[f(part) if part.size else np.nan for f in statistics] for part in parts], float)


def rms(values: FloatArray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def within(sizes: FloatArray) -> list[float]:
    """Shares of errors, over their stated standard deviation, within one and two."""
    return [float(np.mean(np.abs(sizes) < limit)) for limit in (1, 2)]


def variable(dimensions: str | Sequence[str], values: Any, meaning: str, **attributes: Any) -> Variable:
    """A variable without a unit."""
    return dimensions, values, {"long_name": meaning, "units": "1", **attributes}


def coordinates(
    nodes: dict[str, FloatArray], meanings: dict[str, str], covered: dict[str, Any], edges: FloatArray, middles: Any
) -> dict[str, Variable]:
    """Coordinates of a table's nodes, with the range that is answered, and of bins of contact."""
    return {name: variable(name, values, meanings[name], covered=covered[name]) for name, values in nodes.items()} | {
        "contact": variable("contact", middles, "A/A0, middle of a bin"),
        "contact_low": variable("contact", edges[:-1], "A/A0, low end of a bin"),
        "contact_high": variable("contact", edges[1:], "A/A0, high end of a bin"),
    }


def made_by(modules: Sequence[str]) -> dict[str, str]:
    """Attributes on what made a part."""
    return {
        "versions": json.dumps(versions(), sort_keys=True),
        "source_sha256": source_digest(tuple(modules)),
        "source_modules": " ".join(modules),
    }


def write_part(path: os.PathLike[str] | str, data: xr.Dataset, group: str = "/") -> None:
    """Write the root, or one group, of a file, compressed and sealed; what else the file holds stays as it is."""
    path = pathlib.Path(path)
    parts = (read_groups(path) if path.exists() else {}) | {group: data}
    packed = {"zlib": True, "complevel": 9, "shuffle": True, "_FillValue": None}

    def store(name: str) -> None:
        with HDF5_LOCK:
            for k, (own, part) in enumerate(sorted(parts.items())):
                # of a variable's encoding, how its numbers are stored
                kinds = {
                    n: v.encoding.get("dtype", v.dtype) for n, v in part.variables.items() if v.dtype.kind in "fiu"
                }
                encoding = {n: packed | ({"dtype": kinds[n]} if n in kinds else {}) for n in part.variables}
                part.to_netcdf(name, "a" if k else "w", engine="netcdf4", group=own, encoding=encoding)

    body = written_bytes(path.name, store)
    write_file(path, body + SEAL + hashlib.sha256(body).hexdigest().encode() + b"\n", make_folders=True)
