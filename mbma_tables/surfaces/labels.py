"""xarray in, xarray out: functions of plain arrays on DataArrays, dask-backed ones lazily and in parallel.

Blocks are evaluated by the same functions as plain arrays; dask schedules them.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from mbma_tables.common.arguments import broadcast_shape, is_labelled
from mbma_tables.common.errors import InputError
from mbma_tables.surfaces.any_surface import AnySurface


def apply(function: Any, arguments: tuple[Any, ...], outputs: int) -> Any:
    """The tuple of results of `function` for broadcast arguments, block by block for dask arrays."""
    # xarray is imported already if its objects are passed
    import xarray as xr

    whole = all(np.size(argument) for argument in arguments)

    def block(*fields: Any) -> Any:
        if whole and not all(np.size(field) for field in fields):
            # a chunk of a dask array may be empty, an array may not
            found = (np.empty(np.broadcast_shapes(*map(np.shape, fields))),) * outputs
        else:
            found = function(*fields)
        return found[0] if outputs == 1 else found

    found = xr.apply_ufunc(
        block,
        *arguments,
        input_core_dims=[[]] * len(arguments),
        output_core_dims=[[]] * outputs,
        dask="parallelized",
        output_dtypes=[float] * outputs,
        join="exact",
        keep_attrs=False,
    )
    return (found,) if outputs == 1 else found


def refuse_plain(arguments: Mapping[str, Any]) -> None:
    """Reject arrays without names beside DataArrays."""
    for name, given in arguments.items():
        if not is_labelled(given) and np.ndim(given):
            raise InputError(f"beside DataArrays, {name} must be one or a scalar, got shape {np.shape(given)}")


def agree(**arguments: Any) -> None:
    """Reject plain arrays that do not broadcast, or that are combined with DataArrays."""
    if any(map(is_labelled, arguments.values())):
        refuse_plain(arguments)
    else:
        broadcast_shape(**arguments)


def apply_to_surface(answer: Any, surface: AnySurface, arrays: Mapping[str, Any], outputs: int) -> Any:
    """``answer(surface, *arrays)``, a tuple of `outputs` arrays, of DataArrays; plain arrays among them are errors."""
    count = len(surface.parameters)
    arguments = {name: getattr(surface, name) for name in surface.parameters} | dict(arrays)
    refuse_plain(arguments)

    def block(*numbers: Any) -> Any:
        return answer(surface.with_numbers(*numbers[:count]), *numbers[count:])

    return apply(block, tuple(arguments.values()), outputs)
