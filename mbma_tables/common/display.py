"""Display of results: a line, a table, a picture, an xarray Dataset.

A class that derives from `Displayed` defines its description (`_facts`), its quantities
(`_variables`) and its picture (`_figure`). The description is what editors and notebooks
show unasked: it neither solves a contact nor draws.
"""

from __future__ import annotations

import dataclasses
import html
import inspect
import os
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from mbma_tables.common.arguments import is_labelled
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import write_file
from mbma_tables.common.plain_text import visible
from mbma_tables.common.plots import KINDS, to_picture

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class Variable(NamedTuple):
    """An entry of a Dataset; without `dims` those of a batch are numbered."""

    values: Any
    unit: str = "1"
    meaning: str = ""
    dims: tuple[str, ...] | None = None


def shown(value: Any, unit: str = "1") -> str:
    """A number, or the range of an array, with its unit; sizes of a lazy DataArray."""
    if is_labelled(value):
        return f"<DataArray {dict(value.sizes)}>"
    numbers = np.asarray(value)
    if numbers.dtype == bool:
        return (
            str(bool(numbers))
            if numbers.ndim == 0
            else f"{int(numbers.sum())} of {numbers.size}"
        )
    numbers_not_nan = numbers[~np.isnan(numbers)]
    if not numbers_not_nan.size:
        return "not known"
    ends = dict.fromkeys(
        f"{end:.4g}" for end in (numbers_not_nan.min(), numbers_not_nan.max())
    )
    return " to ".join(ends) + ("" if unit == "1" else f" {unit}")


def quantity(meaning: str) -> Any:
    """A field of a `Displayed` dataclass.

    Its meaning goes to the docstring and, up to a semicolon, to the Dataset.
    """
    return dataclasses.field(metadata={"meaning": meaning})


class Displayed:
    """Base class with display as a line, a table, a figure and a Dataset."""

    units: Any
    _dims: ClassVar[tuple[str, ...] | None] = None

    def __init_subclass__(cls) -> None:
        metadata = {
            name: each.metadata
            for name, each in vars(cls).items()
            if isinstance(each, dataclasses.Field)
        }
        lines = [
            f"{name}\n    {about['meaning']}"
            for name, about in metadata.items()
            if "meaning" in about
        ]
        if lines and cls.__doc__:
            cls.__doc__ = "\n".join(
                [inspect.cleandoc(cls.__doc__), "\nAttributes\n----------", *lines]
            )

    def _facts(self) -> Mapping[str, str]:
        """Its description, by name."""
        raise NotImplementedError

    def _variables(self) -> Mapping[str, Variable]:
        """Its quantities, by name."""
        instance: Any = self
        meanings = {
            each.name: each.metadata["meaning"]
            for each in dataclasses.fields(instance)
            if each.metadata
        }
        return {
            name: Variable(
                getattr(self, name),
                self.units.get(name, "1"),
                re.split(r";| \[", text)[0],
                self._dims,
            )
            for name, text in meanings.items()
        }

    def _origin(self) -> Mapping[str, str]:
        """Further attributes of the Dataset."""
        return {}

    def _figure(self) -> Figure:
        raise NotImplementedError

    def __repr__(self) -> str:
        facts = ", ".join(f"{name} {text}" for name, text in self._facts().items())
        return visible(f"{type(self).__name__}({facts})")

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th style='text-align:left'>{html.escape(name)}</th><td "
            f"style='text-align:left'>{html.escape(text)}</td></tr>"
            for name, text in self._facts().items()
        )
        return f"<div><b>{type(self).__name__}</b><table>{rows}</table></div>"

    def plot(self, path: str | os.PathLike[str] | None = None) -> Figure:
        """Plot the quantities and return the figure; `path` ("name.svg", .pdf, .png) saves it.

        Raises
        ------
        InputError
            If there is no curve to draw, as for a single contact, or the kind of file is unknown.
        MbmaError
            If matplotlib is not installed.
        """
        return saved(self._figure(), path)

    def to_dataset(self) -> xr.Dataset:
        """The quantities as an xarray Dataset, with units and descriptions."""
        return dataset_of(self._variables(), {**self._facts(), **self._origin()})


def saved(figure: Figure, path: str | os.PathLike[str] | None) -> Figure:
    """A figure, which is also saved where a path is given."""
    if path is not None:
        kind = os.fspath(path).rpartition(".")[2]
        if kind not in KINDS:
            raise InputError(
                f"a picture's name must end with one of .{', .'.join(KINDS)}, got "
                f"{os.fspath(path)!r}"
            )
        write_file(path, to_picture(figure, kind))
    return figure


def dataset_of(variables: Mapping[str, Variable], facts: Mapping[str, str]) -> xr.Dataset:
    """An xarray Dataset of variables, with facts as its attributes."""
    import xarray

    made = {}
    for name, (values, unit, meaning, dims) in variables.items():
        described = {"units": unit} | ({"long_name": meaning} if meaning else {})
        if is_labelled(values):
            made[name] = values.assign_attrs(described)
            continue
        rank = np.ndim(values)
        dimensions = (
            dims
            if dims is not None
            else ("point",)
            if rank == 1
            else tuple(f"dim_{k}" for k in range(rank))
        )
        made[name] = xarray.Variable(dimensions, values, described)
    dataset: xr.Dataset = xarray.Dataset(made, attrs=dict(facts))
    return dataset
