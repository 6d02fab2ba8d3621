"""Where values came from: versions, arithmetic, source files."""

import hashlib
import importlib.util
import pathlib
import platform

import numpy as np

from mbma_tables.core import ARITHMETIC
from mbma_tables.tablefiles.schema import ISLAND4D, UNIVERSAL

SOLVER = (
    "mbma_tables/core/eight.h",
    "mbma_tables/core/elementary.h",
    "mbma_tables/core/height_coefficients.h",
    "mbma_tables/core/heights.h",
    "mbma_tables/core/newton.c",
    "mbma_tables.islands.spectral",
    "mbma_tables.islands.greenwood_tripp",
)
GEOMETRY = ("mbma_tables.surfaces.spectrum", "mbma_tables.islands.geometry", "mbma_tables.models.island4d")
MODULES = {UNIVERSAL: SOLVER, ISLAND4D: SOLVER + GEOMETRY}


def source_digest(modules: tuple[str, ...]) -> str:
    """SHA-256 of the files of modules, or of C sources, as bytes: a record of what ran, compared with nothing."""
    digest = hashlib.sha256()
    for module in modules:
        path: str | pathlib.Path = pathlib.Path(__file__).parents[1] / module
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
