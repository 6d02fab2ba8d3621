"""Make a table of either kind: the example of a configuration, what it would take, the file."""

import os
import pathlib

from mbma_tables.common.errors import InputError
from mbma_tables.tables import make_function
from mbma_tables.tables.certificate import Forecast
from mbma_tables.tables.configuration import HERE, Configuration
from mbma_tables.tables.make_island4d import Island4d
from mbma_tables.tables.make_universal import Universal
from mbma_tables.tables.schema import ISLAND4D, UNIVERSAL, TableContent
from mbma_tables.tables.writer import write_table

KINDS: dict[str, type[Universal | Island4d]] = {UNIVERSAL: Universal, ISLAND4D: Island4d}


def example(kind: str) -> str:
    """A configuration of a kind of table, or of a function, as TOML, with every key and what it means.

    That of a kind is the shipped one. Its numbers of nodes are comments: where a file has
    none, they follow its target.
    """
    if kind not in KINDS:
        return make_function.example()
    text = (HERE / f"{kind}.toml").read_text(encoding="utf-8")
    return text.replace("\nnodes = ", "\n# nodes = ")


def forecast(configuration: Configuration, workers: int = 1) -> Forecast:
    """What a table would take, from the time of a few of its islands on this machine."""
    return KINDS[configuration.kind](configuration, workers).forecast()


def check_place(path: pathlib.Path) -> None:
    """Raise InputError, before anything is computed, if no file can be written there."""
    if path.is_dir():
        raise InputError(f"--out must name a file for one table, {path} is a folder")
    folder = path.resolve().parent
    if not folder.is_dir():
        raise InputError(f"{path} cannot be written: there is no folder {folder}")
    if not os.access(folder, os.W_OK):
        raise InputError(f"{path} cannot be written: {folder} is read-only")


def make_table(
    configuration: Configuration, path: pathlib.Path, workers: int = 1
) -> TableContent:
    """Make, certify and write a table; nothing is written unless all of it succeeds.

    Parameters
    ----------
    configuration : Configuration
        From `tables.configuration.load`.
    path : Path
        The file, which is replaced if it exists.
    workers : int
        Processes; the values do not depend on their number.

    Raises
    ------
    UncertifiedError
        If the table misses its target or breaks a physical rule.
    InputError, TableFileError
        If the file cannot be written.
    """
    check_place(path)
    content = KINDS[configuration.kind](configuration, workers).build()
    write_table(path, content)
    return content


def summary(path: pathlib.Path, content: TableContent) -> str:
    """A line on a table that was written."""
    errors = ", ".join(
        f"{f} {content.attributes[f'largest_error_{f}']:.2e}" for f in ("F", "A")
    )
    return (
        f"{path}: {content.size}; largest held-out error {errors}; "
        f"{path.stat().st_size} bytes"
    )
