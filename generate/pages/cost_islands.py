"""docs/cost.md: cost of an island by every way to solve it or look it up, on islands that no table was made from."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.stats import qmc

from generate.tables import chunks
from generate.timing import measure, variant
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.geometry import geometry
from mbma_tables.islands.greenwood_tripp import iterate, radius, ring_matrix
from mbma_tables.models import ISLAND_MODELS, answer_islands
from mbma_tables.models.closed_forms import FormulaModel
from mbma_tables.models.named import get_model
from mbma_tables.scenes.costs import Row
from mbma_tables.surfaces.variants import get_variant

ISLANDS = 1000  # evaluated in a batch
HARD = 12  # of them, for the classical iteration
PROFILES = 20
REFERENCE_RTOL = 1e-12
SEED = 2026
RANGES = ((0.32, 0.7, -4.0), (0.98, 3.9, 0.9))  # H, log10 zeta_1, log10 delta/h_rms
DAMPING, MAX_STEPS = 0.1, 5000
MESHES = {
    25: (1e-2, 1e-4),
    50: (1e-3,),
    100: (1e-2, 1e-4, 1e-6),
    200: (1e-5,),
    400: (1e-6,),
    800: (1e-7,),
    1600: (1e-8,),
}
NEWTON_RTOLS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
NEWTON_NODES = (8, 12, 16, 24, 32, 48, 64, 96)
FORMS = ("pocket", "standard", "long")


@dataclasses.dataclass(frozen=True)
class HeldOut:
    """Islands of surfaces that made no table, and their Phi_F and Phi_A (2, islands) on twice the nodes."""

    islands: dict[str, FloatArray]
    truth: FloatArray

    def error(self, phi_F: FloatArray, phi_A: FloatArray, chosen: Any = slice(None)) -> float:
        """Largest relative error of both."""
        return float(np.abs(np.stack([phi_F, phi_A]) / self.truth[:, chosen] - 1).max())


@functools.cache
def held_out(count: int = ISLANDS) -> HeldOut:
    """Islands of random surfaces, variant reported."""
    hurst, log_zeta, log_approach = qmc.scale(qmc.Halton(3, seed=SEED).random(count), *RANGES).T
    fields = geometry(10**log_approach, hurst, 10**log_zeta, get_variant("reported"))
    found = chunks.phi(fields["X"], fields["mu"], REFERENCE_RTOL, 2)
    return HeldOut(fields | {"hurst": hurst}, found.T)


def classical(X: FloatArray, mu: FloatArray, matrix: FloatArray, tolerance: float) -> tuple[Any, ...]:
    """Steps, converged, Phi_F and Phi_A of islands; the matrix is made beforehand, and not timed."""
    rings = len(matrix)
    w, p = np.empty(rings), np.empty(rings)
    rows = [
        iterate(x, m, radius(x, m, tolerance), matrix, DAMPING, tolerance, MAX_STEPS, w, p)
        for x, m in zip(X, mu, strict=True)
    ]
    return tuple(np.array(column) for column in zip(*rows, strict=True))


def classical_rows() -> Iterator[Row]:
    """The damped iteration at several meshes and tolerances."""
    held = held_out()
    chosen = np.linspace(0, ISLANDS - 1, HARD).astype(int)
    X, mu = held.islands["X"][chosen], held.islands["mu"][chosen]
    for rings, tolerances in MESHES.items():
        matrix = ring_matrix(rings)
        for tolerance in tolerances:
            steps, converged, force, area = classical(X, mu, matrix, tolerance)
            if not converged.all():
                raise ConvergenceError(f"the classical iteration on {rings} rings did not converge", ~converged)
            cost, _ = measure(functools.partial(classical, X, mu, matrix, tolerance))
            pressures = rings * (float(steps.mean()) + 1)
            error = held.error(force, area, chosen)
            yield Row("classical", variant(f"rings={rings}", tolerance), "both", error, cost / HARD, pressures)


def newton_rows() -> Iterator[Row]:
    """Newton to several tolerances, on several numbers of nodes, and with p(r) kept."""
    held = held_out()
    chosen = np.arange(0, ISLANDS, 4)
    X, mu = held.islands["X"][chosen], held.islands["mu"][chosen]
    ways: dict[str, dict[str, Any]] = {
        variant("island", rtol): {"rtol": max(0.1 * rtol, greenwood_tripp.MIN_SOLVER_RTOL)} for rtol in NEWTON_RTOLS
    }
    ways |= {f"nodes={nodes}": {"rtol": 1e-11, "nodes": nodes} for nodes in NEWTON_NODES}
    for name, options in ways.items():
        run = functools.partial(greenwood_tripp.solve, X, mu, **options)
        solved, (cost, _) = run(), measure(run)
        pressures = float((solved.nodes * (solved.iterations + 1)).mean())
        error = held.error(solved.phi_F, solved.phi_A, chosen)
        yield Row("exact", name, "both", error, cost / X.size, pressures)
    for rtol in (1e-4, 1e-8):
        cost, _ = measure(lambda rtol=rtol: greenwood_tripp.solve(X[:PROFILES], mu[:PROFILES], rtol=rtol).pressure)  # type: ignore[misc]
        yield Row("exact", variant("profile", rtol), "both", None, cost / PROFILES)


def model_rows() -> Iterator[Row]:
    """Models that do not solve: the shipped ones and each closed form."""
    held = held_out()
    models: list[tuple[str, str, Any]] = [
        (island_model, "island", get_model(island_model, 1e-8, get_variant("reported")))
        for island_model in ISLAND_MODELS
        if island_model != "exact"
    ]
    models += [("formula", f"island form={name}", FormulaModel(name)) for name in FORMS]
    for island_model, name, model in models:
        answer = answer_islands(model, held.islands)
        cost, _ = measure(functools.partial(answer_islands, model, held.islands))
        yield Row(island_model, name, "both", held.error(answer.phi_F, answer.phi_A), cost / ISLANDS, 2)


def island_rows() -> list[Row]:
    """Everything that answers an island."""
    return [*model_rows(), *newton_rows(), *classical_rows()]
