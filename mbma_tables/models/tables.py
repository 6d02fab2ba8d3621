"""Opening tables: the shipped ones by kind, once a process, and any other from its file."""

from __future__ import annotations

import functools
import os
import pathlib

from mbma_tables.files import shipped_file
from mbma_tables.models.island4d import Island4dModel
from mbma_tables.models.universal import UniversalModel
from mbma_tables.tablefiles.netcdf import HDF5_LOCK, read_table
from mbma_tables.tablefiles.schema import ISLAND4D, UNIVERSAL


def shipped(kind: str) -> pathlib.Path:
    """Path of the shipped table of that kind."""
    return shipped_file(f"{kind}.nc")


@functools.cache
def _opened(kind: str) -> UniversalModel | Island4dModel:
    content = read_table(shipped(kind), kind)
    return UniversalModel(content) if kind == UNIVERSAL else Island4dModel(content)


def open_table(table: os.PathLike[str] | str = UNIVERSAL) -> UniversalModel | Island4dModel:
    """A table as an island model, for `contact`, `contact_law`, `island` and `Scene` to take as their `tier`.

    Parameters
    ----------
    table : {"universal", "island4d"} or path
        A shipped table, which is opened once, or a file, which is read on every call.

    Raises
    ------
    TableFileError
        Where the file cannot be used; the message says why and what to do.

    Examples
    --------
    >>> from mbma_tables import Surface, contact, open_table
    >>> table = open_table("universal")
    >>> phi_F, phi_A, error = table.answer(2.0, 1e-3)
    >>> round(float(phi_F), 6), round(float(phi_A), 4)
    (0.005178, 7.8328)
    >>> float(contact(Surface(0.8, 1.0, 200.0, 0.1, 0.3), 0.1, tier=table).error) < 1e-8
    True
    """
    if table in (UNIVERSAL, ISLAND4D):
        with HDF5_LOCK:
            return _opened(str(table))
    content = read_table(table)
    return UniversalModel(content) if content.kind == UNIVERSAL else Island4dModel(content)


def universal_model() -> UniversalModel:
    """The model of the shipped universal table."""
    model = open_table(UNIVERSAL)
    assert isinstance(model, UniversalModel)
    return model


def island4d_model() -> Island4dModel:
    """The model of the shipped four-parameter table."""
    model = open_table(ISLAND4D)
    assert isinstance(model, Island4dModel)
    return model
