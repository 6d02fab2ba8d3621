"""Where the values of a table came from: its sources, and the versions of what computed them."""

import hashlib
import importlib.util
import pathlib
import platform

import numpy as np

from mbma_tables.core import ARITHMETIC
from mbma_tables.tables.schema import ISLAND4D, UNIVERSAL

ROOT = pathlib.Path(__file__).parents[2]
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
