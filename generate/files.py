"""Files of a checkout: data of docs/data, what several programs read of them, and where values came from."""

import functools
import hashlib
import importlib.util
import pathlib
import platform
from typing import Any

import numpy as np

from mbma_tables.core import ARITHMETIC
from mbma_tables.data import FILE, boundary_elements
from mbma_tables.tables.schema import ISLAND4D, UNIVERSAL

ROOT = pathlib.Path(__file__).parents[1]
DATA = ROOT / "docs" / "data"
SOLVER_SOURCES = (
    "mbma_tables/core/elementary.h",
    "mbma_tables/core/height_coefficients.h",
    "mbma_tables/core/heights.h",
    "mbma_tables/core/newton.c",
)
GEOMETRY_SOURCES = (
    "mbma_tables/core/four.h",
    "mbma_tables/core/island.h",
    "mbma_tables/core/island4d.c",
    "mbma_tables/core/quintic.h",
)
SOLVER = (
    "mbma_tables.islands.half_space",
    "mbma_tables.islands.greenwood_tripp",
)
GEOMETRY = (
    "mbma_tables.surfaces.spectrum",
    "mbma_tables.islands.geometry",
    "mbma_tables.tables.island4d",
)
MODULES = {
    UNIVERSAL: SOLVER_SOURCES + SOLVER,
    ISLAND4D: SOLVER_SOURCES + GEOMETRY_SOURCES + SOLVER + GEOMETRY,
}


def to_csv(head: str, frame: Any, form: str | None = None) -> bytes:
    text: str = head + frame.to_csv(index=False, float_format=form, lineterminator="\n")
    return text.encode()


def read_csv(name: str | pathlib.Path) -> Any:
    """A CSV file of docs/data with comments and a line of names, as a data frame."""
    import pandas as pd

    return pd.read_csv(DATA / name, comment="#")


@functools.cache
def dataset(group: str, path: pathlib.Path = FILE) -> Any:
    """A group of the data set of boundary-element simulations, in memory."""
    return boundary_elements(path)[group].to_dataset()


def source_digest(modules: tuple[str, ...]) -> str:
    """SHA-256 of the files of modules, or of C sources, as bytes: a record of what ran, compared with nothing."""
    digest = hashlib.sha256()
    for module in modules:
        path: str | pathlib.Path = ROOT / module
        if "/" not in module:
            spec = importlib.util.find_spec(module)
            if spec is None or spec.origin is None:
                raise ModuleNotFoundError(module)
            path = spec.origin
        digest.update(pathlib.Path(path).read_bytes())
    return digest.hexdigest()


def versions() -> dict[str, str]:
    """Versions of what computes, and whether the core's processor has fused multiply-add, which decides last bits."""
    import netCDF4
    import scipy

    from mbma_tables import __version__

    return {
        "arithmetic": ARITHMETIC,
        "mbma_tables": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "netCDF4": netCDF4.__version__,
    }
