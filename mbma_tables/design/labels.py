"""DataArrays among the numbers of a description: plain arrays in their place, and their labels for results."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mbma_tables.bodies.bodies import Bodies
from mbma_tables.common.arguments import is_labelled
from mbma_tables.common.errors import InputError
from mbma_tables.contacts.quantities.interface import Gas
from mbma_tables.surfaces.any_surface import AnySurface


@dataclasses.dataclass(frozen=True)
class Labels:
    """Dimensions and coordinates of DataArrays that broadcast by their names."""

    template: Any  # a DataArray of all dimensions; None where there are no labels

    @classmethod
    def of(cls, *typed: Any) -> Labels:
        """Those of all DataArrays in what was typed: numbers, surfaces, bodies, mappings and lists of them.

        Raises
        ------
        InputError
            For coordinates that differ.
        """
        arrays = [array for each in typed for array in _labelled_in(each)]
        if not arrays:
            return cls(None)
        import xarray as xr

        try:
            aligned = xr.align(*arrays, join="exact", copy=False)
        except ValueError as fault:
            raise InputError(f"DataArrays do not agree: {fault}") from None
        return cls(xr.broadcast(*aligned)[0])

    def plain(self, typed: Any) -> Any:
        """What was typed with plain arrays in place of DataArrays, their axes in the order of all dimensions."""
        if self.template is None:
            return typed
        if is_labelled(typed):
            return self._values(typed)
        if isinstance(typed, Mapping):
            return {name: self.plain(each) for name, each in typed.items()}
        if type(typed) in (tuple, list):
            return type(typed)(self.plain(each) for each in typed)
        is_surface = isinstance(typed, AnySurface) and not typed.labelled
        shape = (
            getattr(typed, "shape", ())
            if is_surface or isinstance(typed, np.ndarray)
            else ()
        )
        if shape != ():
            raise InputError(
                "beside DataArrays, other numbers are single ones or DataArrays, got an "
                f"array of shape {shape}"
            )
        if isinstance(typed, AnySurface):
            return self._surface(typed)
        if isinstance(typed, Bodies | Gas):
            fields = {name: self.plain(each) for name, each in vars(typed).items()}
            return dataclasses.replace(typed, **fields)
        return typed

    def _surface(self, surface: Any) -> Any:
        """A surface of plain numbers, which are in its unit already."""
        if not surface.labelled:
            return surface
        numbers = [
            self._values(each, has_unit=True) if is_labelled(each) else each
            for each in surface.numbers().values()
        ]
        return surface.with_numbers(*numbers)

    def _values(self, array: Any, has_unit: bool = False) -> Any:
        """The numbers of a DataArray, as texts with the unit in its attributes."""
        dims = self.template.dims
        missing = [name for name in dims if name not in array.dims]
        values = array.expand_dims(missing).transpose(*dims).values
        unit = array.attrs.get("units", "1")
        if has_unit or unit in ("", "1"):
            return values
        return _texts(values.tolist(), unit)

    def labelled(self, values: Any, unit: str = "1") -> Any:
        """Results with the labels, or as they are where there were none."""
        if self.template is None:
            return values
        import xarray as xr

        filled = np.array(np.broadcast_to(values, self.template.shape))
        template = self.template
        return xr.DataArray(filled, template.coords, template.dims, attrs={"units": unit})


def _labelled_in(typed: Any) -> Iterator[Any]:
    """The DataArrays in what was typed."""
    if is_labelled(typed):
        yield typed
    elif isinstance(typed, Mapping):
        for each in typed.values():
            yield from _labelled_in(each)
    elif isinstance(typed, tuple | list):
        for each in typed:
            yield from _labelled_in(each)
    elif isinstance(typed, AnySurface):
        if typed.labelled:
            yield from filter(is_labelled, typed.numbers().values())
    elif isinstance(typed, Bodies | Gas):
        yield from _labelled_in(vars(typed))


def _texts(numbers: Any, unit: str) -> Any:
    """Numbers, or lists of them, as texts with a unit."""
    if isinstance(numbers, list):
        return [_texts(each, unit) for each in numbers]
    return f"{numbers!r} {unit}"
