"""The exact islands that tables are made of, solved in chunks by worker processes, one file a finished chunk.

A chunk's file is named by the hash of all that decides its values to the last bit: the solver's source, versions,
tolerance and arguments. So a resumed run computes what is missing, and never mixes versions.
"""

from __future__ import annotations

import concurrent.futures
import io
import pathlib
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from tqdm import tqdm

from generate.provenance import SOLVER, source_digest, versions
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import MbmaError
from mbma_tables.common.files import write_file
from mbma_tables.islands import greenwood_tripp
from mbma_tables.tablefiles.netcdf import digest_arrays, digest_json

CHUNK = 2000
Work = Callable[..., FloatArray]
Job = tuple[Any, ...]
CODE = (*SOLVER, "generate.tables.chunks", "generate.tables.universal")


class WorkerError(MbmaError, RuntimeError):
    """Worker processes that died, or that a scheduler lost."""


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
    """Name of a chunk's file."""
    made_by = [source_digest(CODE), versions(), work.__name__]
    return digest_json([made_by, digest_arrays({str(number): value for number, value in enumerate(job)})])


class ChunkedSolver:
    """Solves islands on an executor and keeps what is finished.

    Parameters
    ----------
    executor : concurrent.futures.Executor or None
        Where chunks run, dask's `Client.get_executor()` included; None runs them here.
    folder : path, optional
        Folder of the finished chunks; without it nothing is kept.
    """

    def __init__(self, executor: concurrent.futures.Executor | None = None, folder: pathlib.Path | None = None) -> None:
        self.executor = executor
        self.folder = folder

    def map(self, label: str, work: Work, jobs: Sequence[Job]) -> list[FloatArray]:
        """``work(*job)`` of each job, in order; `label` names the progress bar.

        Raises
        ------
        WorkerError
            Where a worker died; finished chunks are kept.
        """
        keys = [chunk_key(work, job) for job in jobs]
        results = {number: found for number, key in enumerate(keys) if (found := self._load(key)) is not None}
        missing = {number: job for number, job in enumerate(jobs) if number not in results}
        # silent where stderr is not a terminal
        with tqdm(total=len(jobs), initial=len(results), desc=label, unit="chunk", disable=None) as bar:
            for number, result in self._computed(work, missing):
                if self.folder is not None:
                    content = io.BytesIO()
                    np.save(content, result)
                    write_file(self.folder / keys[number], content.getvalue(), make_folders=True)
                results[number] = result
                bar.update()
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

    def _load(self, key: str) -> FloatArray | None:
        """A kept chunk, which is written whole or not at all; None where there is none."""
        path = None if self.folder is None else self.folder / key
        return np.asarray(np.load(path)) if path is not None and path.exists() else None

    def _computed(self, work: Work, missing: dict[int, Job]) -> Iterator[tuple[int, FloatArray]]:
        """Numbers and results of chunks, as they finish."""
        if self.executor is None:
            yield from ((number, work(*job)) for number, job in missing.items())
            return
        try:
            waiting = {self.executor.submit(work, *job): number for number, job in missing.items()}
            for future in concurrent.futures.as_completed(waiting):
                yield waiting[future], future.result()
        except (concurrent.futures.BrokenExecutor, concurrent.futures.CancelledError) as fault:
            raise WorkerError(f"a worker process died ({fault}); --resume continues from the finished chunks") from None
