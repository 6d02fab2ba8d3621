"""Files of a checkout: data of docs/data, and what several programs read of them."""

import functools
import pathlib
from typing import Any

from mbma_tables.theories.dataset import FILE, boundary_elements

ROOT = pathlib.Path(__file__).parents[1]
DATA = ROOT / "docs" / "data"


def to_csv(head: str, frame: Any, form: str | None = None) -> bytes:
    text: str = head + frame.to_csv(index=False, float_format=form, lineterminator="\n")
    return text.encode()


def read_csv(name: str | pathlib.Path) -> Any:
    """A CSV file of docs/data with comments and a line of names, as a data frame."""
    import pandas as pd

    return pd.read_csv(DATA / name, comment="#")


@functools.cache
def dataset(group: str, path: pathlib.Path = FILE) -> Any:
    """A group of the data set of boundary-element simulations, in memory."""
    return boundary_elements(path)[group].to_dataset()
