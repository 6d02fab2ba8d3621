"""Check a table file by what it answers: its conformance points, by the table and by the exact solver."""

from __future__ import annotations

import dataclasses
import os

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import TableFileError
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.four_numbers import hat_scales, to_axes
from mbma_tables.models.island4d import Island4dModel
from mbma_tables.models.universal import UniversalModel
from mbma_tables.tablefiles.netcdf import read_table
from mbma_tables.tablefiles.schema import FUNCTIONS, UNIVERSAL, TableContent


@dataclasses.dataclass(frozen=True)
class Verdict:
    """What a check found.

    Attributes
    ----------
    path : str
    kind : str
    points : int
        Conformance points of the file, each answered twice.
    table_error : float
        Largest relative difference between the answers of the table as opened and those stored.
    solver_error : float
        Largest relative difference between the installed solver's answers and those stored; 0 where they are
        identical to the last bit.
    """

    path: str
    kind: str
    points: int
    table_error: float
    solver_error: float


def _replay(content: TableContent) -> tuple[FloatArray, FloatArray]:
    """Answers at the conformance points by the table and by the solver, each (2, points)."""
    points = content.conformance
    if content.kind == UNIVERSAL:
        X, mu = points["X"], points["mu"]
        answer = UniversalModel(content).answer(X, mu)
        scales = np.ones((2, X.size))
        table = np.stack([answer.phi_F, answer.phi_A])
    else:
        model = Island4dModel(content)
        delta, zeta_d, zeta_u, hurst = (points[name] for name in ("delta_over_h_rms", "zeta_d", "zeta_u", "hurst"))
        found = model.lookup(delta, zeta_d, zeta_u, hurst)
        place = to_axes(delta, zeta_d, zeta_u, hurst, model.reading)
        X, mu = place.X, place.mu
        scales = np.stack(hat_scales(place.spread, zeta_d, hurst, place.sigma, model.reading))
        table = np.stack([found.F_hat, found.A_hat])
    solved = greenwood_tripp.solve(X, mu, rtol=greenwood_tripp.MIN_SOLVER_RTOL)
    return table, scales * np.stack([solved.phi_F, solved.phi_A])


def verify(path: os.PathLike[str] | str, kind: str | None = None) -> Verdict:
    """Check a table file offline: hashes, types and shapes, then its conformance points.

    Parameters
    ----------
    path : path
        The file.
    kind : str, optional
        The kind that it must be.

    Raises
    ------
    TableFileError
        Where the file cannot be used, or an answer is further from the stored one than its tolerance.

    Examples
    --------
    >>> from mbma_tables.models.tables import shipped
    >>> from mbma_tables.models.verify import verify
    >>> verdict = verify(shipped("universal"))
    >>> verdict.points, verdict.table_error < 1e-11, verdict.solver_error < 1e-11
    (64, True, True)
    """
    content = read_table(path, kind)
    points = content.conformance
    try:
        answers = _replay(content)
    except ValueError as fault:
        raise TableFileError(f"{path}: its conformance points cannot be answered: {fault}") from None
    errors = []
    for who, which, answer in zip(("the table", "the exact solver"), ("table", "exact"), answers, strict=True):
        stored = np.stack([points[f"{which}_{function}"] for function in FUNCTIONS])
        difference = np.abs(answer / stored - 1)
        excess = difference / points["tolerance"]
        if not (excess <= 1).all():
            worst = np.unravel_index(excess.argmax(), excess.shape)
            raise TableFileError(
                f"{path}: the answers of {who} differ from the stored conformance points by {difference[worst]:.1e} "
                f"where {points['tolerance'][worst[1]]:.1e} is allowed; rebuild the table with "
                f"`python -m generate tables {content.kind}`"
            )
        errors.append(float(difference.max()))
    return Verdict(os.fspath(path), content.kind, points["tolerance"].size, *errors)
