"""The exact islands that tables are made of, solved in chunks by worker processes, one file a finished chunk.

A chunk's file is named by the hash of all that decides its values to the last bit: the solver's source, versions,
tolerance and arguments. So a resumed run computes what is missing, and never mixes versions.
"""

import concurrent.futures
import io
import pathlib
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from tqdm import tqdm

from generate.provenance import SOLVER, source_digest, versions
from generate.workers import Pool, WorkerError, attempts
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.files import write_file
from mbma_tables.islands import greenwood_tripp
from mbma_tables.tablefiles.netcdf import digest_arrays, digest_json

CHUNK = 2000
Work = Callable[..., FloatArray]
Job = tuple[Any, ...]
CODE = (*SOLVER, "generate.tables.chunks", "generate.tables.universal")


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


def chunk_key(work: Work, job: Job) -> str:
    made_by = [source_digest(CODE), versions(), work.__name__]
    return digest_json([made_by, digest_arrays({str(number): value for number, value in enumerate(job)})])


class ChunkedSolver:
    """Solves islands on an executor, None: here, and keeps finished chunks in a folder, None: nowhere."""

    def __init__(self, executor: Pool = None, folder: pathlib.Path | None = None) -> None:
        self.executor = executor
        self.folder = folder

    def map(self, label: str, work: Work, jobs: Sequence[Job]) -> list[FloatArray]:
        """``work(*job)`` of each job, in order; WorkerError where a worker died. `label` names the progress bar."""
        results, missing, paths = {}, {}, {}
        for number, job in enumerate(jobs):
            missing[number] = job
            if self.folder is not None:
                # written whole or not at all
                paths[number] = self.folder / chunk_key(work, job)
                if paths[number].exists():
                    results[number] = np.asarray(np.load(paths[number]))
                    del missing[number]
        # silent where stderr is not a terminal
        with tqdm(total=len(jobs), initial=len(results), desc=label, unit="chunk", disable=None) as bar:
            try:
                for number, finish in attempts(self.executor, work, missing):
                    results[number] = finish()
                    if number in paths:
                        content = io.BytesIO()
                        np.save(content, results[number])
                        write_file(paths[number], content.getvalue(), make_folders=True)
                    bar.update()
            except (concurrent.futures.BrokenExecutor, concurrent.futures.CancelledError) as fault:
                text = f"a worker process died ({fault}); --resume continues from the finished chunks"
                raise WorkerError(text) from None
        return [results[number] for number in range(len(jobs))]

    def phi(self, label: str, X: FloatArray, mu: FloatArray, rtol: float, refinement: int = 1) -> FloatArray:
        """`phi` of arrays of any one shape, shape (..., 2)."""
        flat = [np.ascontiguousarray(array, dtype=float).ravel() for array in (X, mu)]
        jobs = [
            (flat[0][k : k + CHUNK], flat[1][k : k + CHUNK], rtol, refinement) for k in range(0, flat[0].size, CHUNK)
        ]
        return np.concatenate(self.map(label, phi, jobs)).reshape((*np.shape(X), 2))

    def log_ratio(self, label: str, X: FloatArray, mu: FloatArray, rtol: float, refinement: int = 1) -> FloatArray:
        """log(Phi/Phi_rigid) of arrays of any one shape, shape (..., 2)."""
        rigid = np.moveaxis(greenwood_tripp.rigid_sphere(X, mu), 0, -1)
        ratio: FloatArray = np.log(self.phi(label, X, mu, rtol, refinement) / rigid)
        return ratio
