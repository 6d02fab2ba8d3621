"""Hashes of values and attributes, and where values came from: versions, processor, source files."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import pathlib
import platform
from typing import Any

import numpy as np

from mbma_tables.tablefiles.schema import ISLAND4D, UNIVERSAL

SOLVER = (
    "mbma_tables/core/elementary.h",
    "mbma_tables/core/height_coefficients.h",
    "mbma_tables/core/newton.c",
    "mbma_tables.islands.spectral",
    "mbma_tables.islands.greenwood_tripp",
)
GEOMETRY = ("mbma_tables.surfaces.spectrum", "mbma_tables.islands.geometry", "mbma_tables.islands.four_numbers")
MODULES = {UNIVERSAL: SOLVER, ISLAND4D: SOLVER + GEOMETRY}


def digest_json(content: Any) -> str:
    """SHA-256 of a JSON value in its canonical form."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()


def digest_arrays(arrays: dict[str, Any]) -> str:
    """SHA-256 of named arrays: names, shapes, and bytes in little-endian order."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.asarray(arrays[name])
        plain = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("<"))
        digest.update(f"{name}:{plain.dtype.str}:{plain.shape};".encode())
        digest.update(plain.tobytes())
    return digest.hexdigest()


def source_digest(modules: tuple[str, ...]) -> str:
    """SHA-256 of the files of modules, or of C sources, as bytes: a record of what ran, compared with nothing."""
    digest = hashlib.sha256()
    for module in modules:
        path: str | pathlib.Path = pathlib.Path(__file__).parents[2] / module
        if "/" not in module:
            spec = importlib.util.find_spec(module)
            if spec is None or spec.origin is None:
                raise ModuleNotFoundError(module)
            path = spec.origin
        digest.update(pathlib.Path(path).read_bytes())
    return digest.hexdigest()


def processor() -> tuple[str, str]:
    """Name and features of the processor that numba compiles for; they decide the last bits of values."""
    from llvmlite import binding
    from numba.core import config

    # set by the environment where code is compiled for another processor
    name, features = (getattr(config, f"CPU_{what}") for what in ("NAME", "FEATURES"))
    return name or binding.get_host_cpu_name(), features or binding.get_host_cpu_features().flatten()


def versions() -> dict[str, str]:
    """The processor, and the versions of what computes."""
    import netCDF4
    import numba
    import scipy

    from mbma_tables import __version__

    return {
        "processor": processor()[0],
        "mbma_tables": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "numba": numba.__version__,
        "netCDF4": netCDF4.__version__,
    }
