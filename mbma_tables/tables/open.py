"""Island models by name; the shipped tables by kind, others from their file; verification of their results."""

import os
import pathlib
import reprlib
from typing import NamedTuple

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError, TableFileError
from mbma_tables.common.files import shipped_file
from mbma_tables.common.netcdf import HDF5_LOCK
from mbma_tables.common.shared import shared
from mbma_tables.islands import greenwood_tripp
from mbma_tables.tables.function_table import FunctionTable
from mbma_tables.tables.island4d import Island4dModel, to_axes
from mbma_tables.tables.reader import read_any, read_table
from mbma_tables.tables.schema import (
    ARGUMENTS,
    FUNCTIONS,
    ISLAND4D,
    KINDS,
    UNIVERSAL,
    TableContent,
)
from mbma_tables.tables.universal import UniversalModel


def shipped(kind: str) -> pathlib.Path:
    """Path of the shipped table of that kind."""
    return shipped_file(f"{kind}.nc")


def _model(content: TableContent) -> UniversalModel | Island4dModel:
    return (
        UniversalModel(content) if content.kind == UNIVERSAL else Island4dModel(content)
    )


@shared()
def _opened(kind: str) -> UniversalModel | Island4dModel:
    """The shipped table of that kind, read once."""
    return _model(read_table(shipped(kind), kind))


def open_table(
    table: os.PathLike[str] | str = UNIVERSAL,
) -> UniversalModel | Island4dModel | FunctionTable:
    """A table as an island model, for the argument `island_model` of `contact`, `contact_law`, `island` and `Scene`.

    Parameters
    ----------
    table : {"universal", "island4d"} or path
        A shipped table, which is opened once, or a file, which is read on every call.

    Returns
    -------
    UniversalModel, Island4dModel, or FunctionTable of a file that was made of a function

    Raises
    ------
    TableFileError
        If the file cannot be used; the message has the reason and the remedy.
    InputError
        For what is neither a name nor a path.

    Examples
    --------
    >>> from mbma_tables import Surface, contact, open_table
    >>> from mbma_tables.theories import Mbma
    >>> table = open_table("universal")
    >>> phi_F, phi_A, error = table.answer(2.0, 1e-3)
    >>> round(float(phi_F), 6), round(float(phi_A), 4)
    (0.005178, 7.8328)
    >>> surface = Surface(0.8, 1.0, 200.0, 0.1, 0.3)
    >>> summed = contact(surface, separation=0.1, theory=Mbma(island_model=table))
    >>> float(summed.error) < 1e-8
    True
    """
    if not isinstance(table, str | os.PathLike) or table in KINDS:
        return open_islands(table)
    found = read_any(table)
    return found if isinstance(found, FunctionTable) else _model(found)


def open_islands(
    table: os.PathLike[str] | str = UNIVERSAL,
) -> UniversalModel | Island4dModel:
    """A table of islands, shipped or of a file; `open_table` opens those of functions too."""
    if not isinstance(table, str | os.PathLike):
        raise InputError(
            f"a table must be {UNIVERSAL!r}, {ISLAND4D!r} or the path of a file, got {reprlib.repr(table)}"
        )
    if table in KINDS:
        with HDF5_LOCK:
            return _opened(str(table))
    return _model(read_table(table))


def universal_model() -> UniversalModel:
    """The model of the shipped universal table."""
    model = open_islands(UNIVERSAL)
    assert isinstance(model, UniversalModel)
    return model


class Verdict(NamedTuple):
    """Result of the check of a file: largest relative differences from the stored results."""

    path: str
    kind: str
    points: int  # of the table as opened, and of the installed solver
    table_error: float
    solver_error: float


def _replay(content: TableContent) -> tuple[FloatArray, FloatArray]:
    """Results at the conformance points by the table and by the solver, each (2, points)."""
    points = content.conformance
    model = _model(content)
    if isinstance(model, UniversalModel):
        X = points["X"]
        mu = points["mu"]
        scales = np.ones((2, 1))
        table = np.stack(model.answer(X, mu)[:2])
    else:
        delta, zeta_d, zeta_u, hurst = (points[name] for name in ARGUMENTS[ISLAND4D])
        table = np.stack(model.lookup(delta, zeta_d, zeta_u, hurst)[:2])
        place = to_axes(delta, zeta_d, zeta_u, hurst, model.variant)
        X = place.X
        mu = place.mu
        scales = np.stack([place.force, place.area])
    solved = greenwood_tripp.solve(X, mu, rtol=greenwood_tripp.MIN_SOLVER_RTOL)
    return table, scales * np.stack([solved.phi_F, solved.phi_A])


def verify(path: os.PathLike[str] | str, kind: str | None = None) -> Verdict:
    """Check a table file, of a `kind` where one is given; TableFileError beyond a tolerance of conformance points."""
    content = read_table(path, kind)
    points = content.conformance
    try:
        answers = _replay(content)
    except ValueError as fault:
        raise TableFileError(
            f"{path}: its conformance points cannot be answered: {fault}"
        ) from None
    errors = []
    for who, which, answer in zip(
        ("the table", "the exact solver"), ("table", "exact"), answers, strict=True
    ):
        stored = np.stack([points[f"{which}_{function}"] for function in FUNCTIONS])
        difference = np.abs(answer / stored - 1)
        excess = difference / points["tolerance"]
        if not (excess <= 1).all():
            worst = np.unravel_index(excess.argmax(), excess.shape)
            raise TableFileError(
                f"{path}: the answers of {who} differ from the stored conformance points by {difference[worst]:.1e} "
                f"where {points['tolerance'][worst[1]]:.1e} is allowed; rebuild the table with "
                f"`mbma tables make {content.kind} --out FILE.nc`"
            )
        errors.append(float(difference.max()))
    return Verdict(os.fspath(path), content.kind, points["tolerance"].size, *errors)
