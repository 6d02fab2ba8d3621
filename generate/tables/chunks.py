"""The exact islands that tables are made of, solved in chunks, by worker processes where there are some."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from tqdm import tqdm

from generate.workers import Pool
from mbma_tables.common.arguments import FloatArray
from mbma_tables.islands import greenwood_tripp

CHUNK = 2000


def phi(X: FloatArray, mu: FloatArray, rtol: float, refinement: int = 1) -> FloatArray:
    """Phi_F and Phi_A at flat (X, mu), shape (entries, 2), on `refinement` times the nodes that `rtol` asks."""
    solved = greenwood_tripp.solve(X, mu, rtol=rtol)
    found = np.stack([solved.phi_F, solved.phi_A], axis=-1)
    if refinement > 1:
        for nodes in np.unique(solved.nodes):
            same = solved.nodes == nodes
            finer = greenwood_tripp.solve(X[same], mu[same], rtol=rtol, nodes=refinement * int(nodes))
            found[same] = np.stack([finer.phi_F, finer.phi_A], axis=-1)
    return found


class ChunkedSolver:
    """Solves islands on an executor, None: here; the values are the same to the last bit."""

    def __init__(self, executor: Pool = None) -> None:
        self.executor = executor

    def map(self, label: str, work: Callable[..., FloatArray], jobs: Sequence[tuple[Any, ...]]) -> list[FloatArray]:
        """``work(*job)`` of each job, in order. `label` names the progress bar."""
        run = map if self.executor is None else self.executor.map
        found = run(work, *zip(*jobs, strict=True))
        # silent where stderr is not a terminal
        return list(tqdm(found, total=len(jobs), desc=label, unit="chunk", disable=None))

    def phi(self, label: str, X: FloatArray, mu: FloatArray, rtol: float, refinement: int = 1) -> FloatArray:
        """`phi` of arrays of any one shape, shape (..., 2)."""
        flat = [np.ascontiguousarray(array, dtype=float).ravel() for array in (X, mu)]
        parts = (slice(k, k + CHUNK) for k in range(0, flat[0].size, CHUNK))
        jobs = [(flat[0][part], flat[1][part], rtol, refinement) for part in parts]
        return np.concatenate(self.map(label, phi, jobs)).reshape((*np.shape(X), 2))

    def log_ratio(self, label: str, X: FloatArray, mu: FloatArray, rtol: float, refinement: int = 1) -> FloatArray:
        """log(Phi/Phi_rigid) of arrays of any one shape, shape (..., 2)."""
        rigid = np.moveaxis(greenwood_tripp.rigid_sphere(X, mu), 0, -1)
        ratio: FloatArray = np.log(self.phi(label, X, mu, rtol, refinement) / rigid)
        return ratio
