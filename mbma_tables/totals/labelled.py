"""xarray in, xarray out: surfaces and gaps as DataArrays, dask-backed ones lazily and in parallel.

Blocks are answered by the same functions as plain arrays; which block runs where is dask's business.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from mbma_tables.errors import InputError
from mbma_tables.surfaces.surface import PARAMETERS, Surface

NAMES = ("force", "area", "error")


def apply(function: Any, arguments: tuple[Any, ...], outputs: int) -> Any:
    """`function` of broadcast arguments, block by block where they are dask arrays."""
    return xr.apply_ufunc(
        function,
        *arguments,
        input_core_dims=[[]] * len(arguments),
        output_core_dims=[[]] * outputs,
        dask="parallelized",
        output_dtypes=[float] * outputs,
        join="exact",
        keep_attrs=False,
    )


def contact_of_labelled(
    answer: Any, surface: Surface, separation: Any, E_star: Any, derivatives: bool
) -> dict[str, Any]:
    """Fields of a `Contact` as DataArrays.

    Parameters
    ----------
    answer : callable
        ``answer(surface, separation, E_star)`` gives a `Contact` of plain arrays.
    """
    by = [(kind, name) for kind in ("force", "area") for name in ("separation", *PARAMETERS)] if derivatives else []

    def block(*fields: Any) -> tuple[Any, ...]:
        *numbers, gap, modulus = fields
        found = answer(Surface(*numbers), gap, modulus)
        slopes = (getattr(found, f"{kind}_by")[name] for kind, name in by)
        return tuple(getattr(found, name) for name in NAMES) + tuple(slopes)

    arguments = (*(getattr(surface, name) for name in PARAMETERS), separation, E_star)
    for name, given in zip((*PARAMETERS, "separation", "E_star"), arguments, strict=True):
        if not hasattr(given, "dims") and np.ndim(given):
            raise InputError(f"beside DataArrays, {name} must be one or a scalar, got shape {np.shape(given)}")
    outputs = apply(block, arguments, len(NAMES) + len(by))
    force, area, error = (found.rename(name) for found, name in zip(outputs, NAMES, strict=False))
    force.attrs = {"long_name": "force over nominal area", "units": "unit of E_star"}
    area.attrs = {"long_name": "real over nominal contact area", "units": "1"}
    error.attrs = {"long_name": "bound on the relative error of force and area", "units": "1"}
    slopes = dict(zip(by, outputs[len(NAMES) :], strict=True))
    return {
        "separation": separation,
        "mean_separation": (surface.h_max + separation) / 2,
        "force": force,
        "area": area,
        "error": error,
        "force_by": {name: value for (kind, name), value in slopes.items() if kind == "force"} or None,
        "area_by": {name: value for (kind, name), value in slopes.items() if kind == "area"} or None,
    }
