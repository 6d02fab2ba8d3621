"""Check a table file: its hashes, its conformance points, and, if asked, the exact solver at some of them."""

from __future__ import annotations

import dataclasses
import os
from typing import Any

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import TableFileError
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.four_numbers import hat_scales, to_axes
from mbma_tables.tablefiles.netcdf import check_table
from mbma_tables.tablefiles.schema import FUNCTIONS, UNIVERSAL, TableContent


@dataclasses.dataclass(frozen=True)
class Verdict:
    """What a check found.

    Attributes
    ----------
    path : str
    kind : str
    conformance_error : float
        Largest relative difference of the table's own answers from those stored, over the conformance points.
    resolved : int
        Points solved anew.
    resolved_error : float
        Largest relative difference of the new exact answers from those stored; 0 where identical to the bit.
    stale : str or None
        Why the table is stale, if it is.
    """

    path: str
    kind: str
    conformance_error: float
    resolved: int
    resolved_error: float
    stale: str | None

    @property
    def identical(self) -> bool:
        """Whether the exact answers of this machine are those stored, to the bit."""
        return self.resolved > 0 and self.resolved_error == 0.0


@dataclasses.dataclass(frozen=True)
class _Replay:
    """Conformance points: (X, mu), what turns Phi into the stored answers, and log(Phi/Phi_rigid) by the table."""

    X: FloatArray
    mu: FloatArray
    scales: FloatArray
    log_ratio: FloatArray


def _replay(content: TableContent) -> _Replay:
    from mbma_tables.models.island4d import Island4dModel
    from mbma_tables.models.universal import UniversalModel

    points = content.conformance
    if content.kind == UNIVERSAL:
        X, mu = points["X"], points["mu"]
        return _Replay(X, mu, np.ones((2, X.size)), UniversalModel(content).log_ratio(X, mu))
    model = Island4dModel(content)
    zeta_d, zeta_u, hurst = (points[name] for name in ("zeta_d", "zeta_u", "hurst"))
    place = to_axes(points["delta_over_h_rms"], zeta_d, zeta_u, hurst, model.reading)
    scales = np.stack(hat_scales(place.spread, zeta_d, hurst, place.sigma, model.reading))
    return _Replay(place.X, place.mu, scales, model.log_ratio(place))


def verify(path: os.PathLike[str] | str, kind: str | None = None, resolve: int = 0) -> Verdict:
    """Check a table file offline.

    Parameters
    ----------
    path : path
        The file.
    kind : str, optional
        The kind that it must be.
    resolve : int
        Conformance points to solve anew with the exact solver.

    Raises
    ------
    TableFileError
        Where a hash does not match, or an answer is further from the stored one than its tolerance.
    """
    content, stale = check_table(path, kind)
    points = content.conformance
    replay = _replay(content)
    answers = replay.scales * np.exp(replay.log_ratio) * greenwood_tripp.rigid_sphere(replay.X, replay.mu)
    own = _compare(path, content.kind, "its own answers", answers, points, "table", slice(None))
    count = min(resolve, points["tolerance"].size)
    exact = 0.0
    if count:
        # evenly over the points, so that both halves of them are met
        chosen = np.linspace(0, points["tolerance"].size - 1, count).astype(int)
        solved = greenwood_tripp.solve(replay.X[chosen], replay.mu[chosen], rtol=greenwood_tripp.TIGHTEST)
        answers = replay.scales[:, chosen] * np.stack([solved.phi_F, solved.phi_A])
        exact = _compare(path, content.kind, "the exact solver's answers", answers, points, "exact", chosen)
    return Verdict(os.fspath(path), content.kind, own, count, exact, stale)


def _compare(
    path: Any, kind: str, who: str, answers: FloatArray, points: dict[str, FloatArray], which: str, chosen: Any
) -> float:
    stored = np.stack([points[f"{which}_{function}"][chosen] for function in FUNCTIONS])
    difference = np.abs(answers / stored - 1)
    excess = difference / points["tolerance"][chosen]
    if not (excess <= 1).all():
        worst = np.unravel_index(excess.argmax(), excess.shape)
        raise TableFileError(
            f"{path}: {who} differ from the stored conformance points by {difference[worst]:.1e} where "
            f"{points['tolerance'][chosen][worst[1]]:.1e} is allowed; `python -m generate {kind}` makes the table anew"
        )
    return float(difference.max())
