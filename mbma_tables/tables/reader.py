"""Read table files: opened, verified, and checked against the schema."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from mbma_tables.common.netcdf import opened, verified
from mbma_tables.tables import schema
from mbma_tables.tables.function_table import KIND as FUNCTION
from mbma_tables.tables.function_table import FunctionTable, table_in

if TYPE_CHECKING:
    import netCDF4

REMEDY = "rebuild it with `mbma tables make {} --out FILE.nc` or reinstall mbma_tables"


def _content(dataset: netCDF4.Dataset, kind: str) -> schema.TableContent:
    """The table in an open file of known kind and format."""
    attributes_of_file, described, values = verified(dataset, schema.REQUIRED)
    names = [name for name, _ in schema.AXES[kind]]
    fields = ("long_name", "transform", "offset", "first", "last")
    axes = tuple(
        schema.Axis(*(name, *map(described[name].__getitem__, fields), values[name].size))
        for name in names
    )
    # one variable a function, of its coefficients and of their error
    main = set(names)
    stacked = []
    kinds = schema.COEFFICIENTS[kind], "error"
    for what, over in zip(kinds, schema.dimensions(kind), strict=True):
        of_functions = [f"{what}_{function}" for function in schema.FUNCTIONS]
        if any(dataset[name].dimensions != over for name in of_functions):
            raise ValueError(f"has {what} over other dimensions than {', '.join(over)}")
        main.update(of_functions)
        stacked.append(of_functions)
    coefficients, local_error = (
        np.stack([values[name] for name in of_functions], axis=-1)
        for of_functions in stacked
    )
    point = "conformance_"
    beside = [name for name in values if name not in main and not name.startswith(point)]
    auxiliary = {
        name: (dataset[name].dimensions, values[name], described[name]) for name in beside
    }
    conformance = {
        name.removeprefix(point): values[name]
        for name in values
        if name.startswith(point)
    }
    return schema.TableContent(
        kind, axes, coefficients, local_error, auxiliary, conformance, attributes_of_file
    )


def content_in(dataset: netCDF4.Dataset, kind: str | None = None) -> schema.TableContent:
    """The table of islands in an open file, checked, of a `kind` where one is given; else ValueError."""
    table_kind, version = (
        getattr(dataset, name, None) for name in ("mbma_kind", "format_version")
    )
    if table_kind not in schema.KINDS or (kind is not None and table_kind != kind):
        raise ValueError(
            f"holds a table of kind {table_kind!r}, not {kind or ' or '.join(schema.KINDS)}"
        )
    if version != schema.FORMAT_VERSIONS[table_kind]:
        raise ValueError(
            f"has format {version}, this library reads {schema.FORMAT_VERSIONS[table_kind]}"
        )
    content = _content(dataset, table_kind)
    schema.check_content(content)
    return content


def read_table(
    path: os.PathLike[str] | str, kind: str | None = None
) -> schema.TableContent:
    """Open and check a table file, which must be of a `kind` where one is given."""
    with opened(path, REMEDY.format(kind or "KIND")) as dataset:
        return content_in(dataset, kind)


def read_any(
    path: os.PathLike[str] | str, kind: str | None = None
) -> schema.TableContent | FunctionTable:
    """As `read_table`; a file of any kind may hold a table of a function, too."""
    with opened(path, REMEDY.format(kind or "KIND")) as dataset:
        if kind is None and getattr(dataset, "mbma_kind", None) == FUNCTION:
            return table_in(dataset)
        return content_in(dataset, kind)
