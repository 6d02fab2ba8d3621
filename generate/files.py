"""Files of a checkout: data of docs/data, and what several programs read of them."""

import functools
import pathlib
from typing import Any

ROOT = pathlib.Path(__file__).parents[1]
DATA = ROOT / "docs" / "data"


def to_csv(head: str, frame: Any, form: str | None = None) -> bytes:
    """A data frame as a CSV file with a head of comments."""
    text: str = head + frame.to_csv(index=False, float_format=form, lineterminator="\n")
    return text.encode()


def read_csv(name: str | pathlib.Path) -> Any:
    """A CSV file of docs/data with comments and a line of names, as a data frame."""
    import pandas as pd

    return pd.read_csv(DATA / name, comment="#")


@functools.cache
def dataset(path: str | pathlib.Path) -> Any:
    """A netCDF file, by its name in docs/data or its path, in memory."""
    import xarray as xr

    return xr.load_dataset(DATA / path)


@functools.cache
def evidence() -> tuple[Any, ...]:
    """The simulated surfaces (`Case`) of docs/data/boundary_elements.nc."""
    from generate.boundary_elements.evidence import cases

    return tuple(cases(dataset("boundary_elements.nc")))
