"""xarray in, xarray out: functions of plain arrays on DataArrays, dask-backed ones lazily and in parallel.

Blocks are answered by the same functions as plain arrays; which block runs where is dask's business.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mbma_tables.errors import InputError
from mbma_tables.surfaces.surface import PARAMETERS, Surface

OPTIONS = ("method",)  # arguments that are no arrays


def apply(function: Any, arguments: tuple[Any, ...], outputs: int) -> Any:
    """`function` of broadcast arguments, block by block where they are dask arrays."""
    # xarray comes in with its own objects
    import xarray as xr

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


def takes_labelled(result: type | None = None) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Let ``function(surface, array, ...)`` take DataArrays as well; it answers an array, or a `result` of arrays."""
    fields = [] if result is None else [field.name for field in dataclasses.fields(result)]

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        signature = inspect.signature(function)

        @functools.wraps(function)
        def answer(*given: Any, **named: Any) -> Any:
            bound = signature.bind(*given, **named)
            bound.apply_defaults()
            surface = bound.arguments["surface"]
            options = {name: bound.arguments[name] for name in OPTIONS if name in bound.arguments}
            arrays = {name: it for name, it in bound.arguments.items() if name not in ("surface", *OPTIONS)}
            if not (surface.labelled or any(hasattr(it, "dims") for it in arrays.values())):
                return function(*given, **named)
            arrays = {name: getattr(surface, name) for name in PARAMETERS} | arrays
            refuse_unnamed(arrays)

            def block(*numbers: Any) -> Any:
                rest = dict(zip(list(arrays)[len(PARAMETERS) :], numbers[len(PARAMETERS) :], strict=True))
                found = function(Surface(*numbers[: len(PARAMETERS)]), **rest, **options)
                return found if result is None else tuple(getattr(found, name) for name in fields)

            found = apply(block, tuple(arrays.values()), max(len(fields), 1))
            return found if result is None else result(*found)

        return answer

    return decorate
