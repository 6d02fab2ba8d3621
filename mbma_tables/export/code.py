"""Write the whole model as source code: universal table with derivatives, island geometry, totals."""

from __future__ import annotations

import importlib
import importlib.resources
import os
import pathlib
from typing import Any

from mbma_tables.errors import InputError
from mbma_tables.files import write_file
from mbma_tables.models.universal import UniversalModel, open_table
from mbma_tables.surfaces.readings import Reading, get_reading

TARGETS = ("c", "fortran", "javascript", "python")
POINTS_FILE = "mbma_conformance.csv"


def write_code(
    target: str,
    folder: os.PathLike[str] | str,
    reading: str | Reading = "reported",
    table: os.PathLike[str] | str = "universal",
) -> list[pathlib.Path]:
    """Write the model as code into a folder, with conformance points and a self-test that replays them.

    Parameters
    ----------
    target : {"c", "fortran", "javascript", "python"}
        C99 (which C++ compiles too), a Fortran 2008 module, an ECMAScript module, or a reader in Python and numpy.
    folder : path
        Where the files go; it is made if its parent exists. Files of the same names are replaced.
    reading : {"reported", "printed"} or Reading
        Which reading of the paper's equations the geometry and the totals have.
    table : path
        A universal table; the shipped one by default.

    Returns
    -------
    list of pathlib.Path
        The files written.

    Raises
    ------
    InputError
        For an unknown target or reading, a table that is no universal one, or a folder that cannot be written; no file
        is left then.
    TableFileError
        Where the table cannot be read.
    """
    if target not in TARGETS:
        raise InputError(f"target must be one of {TARGETS}, got {target!r}")
    rule = get_reading(reading)
    model = open_table(table)
    if not isinstance(model, UniversalModel):
        raise InputError(f"code is written from a universal table, and {os.fspath(table)} is none")
    from mbma_tables.export.conformance import points_text

    return _write(pathlib.Path(folder), {**sources(target, model, rule), POINTS_FILE: points_text(model, rule)})


def sources(target: str, model: UniversalModel, reading: Reading) -> dict[str, str]:
    """Names and texts of a target's source files."""
    from mbma_tables.export.numbers import collect, describe

    language: Any = importlib.import_module(f"mbma_tables.export.{target}_source")
    numbers = collect(model, reading)
    parts = language.parts(numbers)
    texts = {}
    for name, title in language.TITLES.items():
        header = describe(model.content, reading, title, language.USAGE)
        if name in language.TEMPLATES:
            text = (importlib.resources.files("mbma_tables.export") / "templates" / f"{name}.in").read_text(
                encoding="utf-8"
            )
            text = text.replace("@HEADER@", language.comment(header))
            for place, part in parts.items():
                text = text.replace(f"@{place}@", part)
        else:
            text = language.numbers_text(numbers, header)
        texts[name] = text
    return texts


def _write(folder: pathlib.Path, texts: dict[str, str]) -> list[pathlib.Path]:
    """Write the files, each whole or not at all."""
    for name, text in texts.items():
        write_file(folder / name, text.encode(), make_folders=True)
    return [folder / name for name in texts]
