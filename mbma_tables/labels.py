"""xarray in, xarray out: functions of plain arrays on DataArrays, dask-backed ones lazily and in parallel.

Blocks are answered by the same functions as plain arrays; which block runs where is dask's business.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from mbma_tables.errors import InputError


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


def refuse_unnamed(arguments: Mapping[str, Any]) -> None:
    """Refuse plain arrays beside DataArrays: their axes have no names to broadcast by."""
    for name, given in arguments.items():
        if not hasattr(given, "dims") and np.ndim(given):
            raise InputError(f"beside DataArrays, {name} must be one or a scalar, got shape {np.shape(given)}")
