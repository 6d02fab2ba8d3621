"""A campaign: many independent chunks of work on any executor, checkpointed one by one.

A chunk is done when its file stands in the checkpoint folder, under a name that is the hash of what was computed;
files are written under another name first and then renamed. So a killed run loses the chunks under way and no more,
a resumed one computes what is missing, and neither the number of workers nor an interruption changes a bit.
"""

from __future__ import annotations

import concurrent.futures
import multiprocessing
import os
import pathlib
import tempfile
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from tqdm import tqdm

from mbma_tables.arguments import FloatArray
from mbma_tables.tablefiles.provenance import digest_arrays, digest_json

ATTEMPTS = 3  # a worker that dies costs its chunks; they are given out again this often

Work = Callable[..., FloatArray]


class CampaignError(RuntimeError):
    """Chunks that failed however often they were tried."""


class Executor(Protocol):
    """What a campaign needs of a concurrent.futures-like executor."""

    def submit(self, work: Any, /, *arguments: Any) -> Any:
        """Start work, give a future."""


def chunk_key(identity: str, arguments: Sequence[FloatArray]) -> str:
    """Name of a chunk's checkpoint: what is computed, and on what."""
    return digest_json([identity, digest_arrays({str(k): a for k, a in enumerate(arguments)})])


def _load(path: pathlib.Path) -> FloatArray | None:
    try:
        loaded: FloatArray = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError):
        return None
    return loaded


def _store(path: pathlib.Path, result: FloatArray) -> None:
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".chunk-")
    try:
        with os.fdopen(handle, "wb") as file:
            np.save(file, result, allow_pickle=False)
            file.flush()
            os.fsync(file.fileno())
        pathlib.Path(name).replace(path)
    except BaseException:
        pathlib.Path(name).unlink(missing_ok=True)
        raise


class Workers:
    """Worker processes of this machine, started afresh (threads and forks do not mix), renewed after one died."""

    def __init__(self, count: int) -> None:
        self.count = count
        self._pool: concurrent.futures.ProcessPoolExecutor | None = None

    def submit(self, work: Any, /, *arguments: Any) -> concurrent.futures.Future[Any]:
        """Start work in a process."""
        if self._pool is None:
            context = multiprocessing.get_context("spawn")
            self._pool = concurrent.futures.ProcessPoolExecutor(self.count, mp_context=context)
        return self._pool.submit(work, *arguments)

    def renew(self) -> None:
        """Give up the present processes; the next work starts new ones."""
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)
            self._pool = None

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        self.renew()


class Campaign:
    """Runs chunks, keeps their results, shows progress on a terminal.

    Parameters
    ----------
    executor : concurrent.futures-like or None
        Where chunks run; None runs them here. `dask.distributed.Client.get_executor()` fits.
    checkpoints : path, optional
        Folder that keeps finished chunks; without it nothing is kept.
    """

    def __init__(
        self,
        executor: Executor | None = None,
        checkpoints: pathlib.Path | None = None,
    ) -> None:
        self.executor = executor
        self.checkpoints = checkpoints
        if checkpoints is not None:
            checkpoints.mkdir(parents=True, exist_ok=True)

    def run(
        self,
        label: str,
        identity: str,
        work: Work,
        chunks: Sequence[Sequence[FloatArray]],
        constants: Sequence[Any] = (),
    ) -> list[FloatArray]:
        """Results of ``work(*chunk, *constants)`` for each chunk, in order.

        Parameters
        ----------
        label : str
            Shown with the progress.
        identity : str
            Whatever the results depend on beyond a chunk's arrays: a hash of code and constants.
        work : callable
            A module-level function.
        chunks : sequence of sequences of arrays
            Arguments of each chunk.
        constants : sequence
            Further arguments, the same for all; `identity` must tell of them.

        Raises
        ------
        CampaignError
            Where chunks failed `ATTEMPTS` times.
        """
        results: dict[int, FloatArray] = {}
        paths = {}
        if self.checkpoints is not None:
            for number, chunk in enumerate(chunks):
                paths[number] = self.checkpoints / f"{chunk_key(identity, chunk)}.npy"
                if (found := _load(paths[number])) is not None:
                    results[number] = found
        with tqdm(total=len(chunks), initial=len(results), desc=label, unit="chunk", disable=None) as bar:

            def keep(number: int, result: FloatArray) -> None:
                if number in paths:
                    _store(paths[number], result)
                results[number] = result
                bar.update()

            for _ in range(ATTEMPTS):
                missing = [number for number in range(len(chunks)) if number not in results]
                if not missing:
                    break
                self._attempt(work, chunks, constants, missing, keep)
        if len(results) < len(chunks):
            raise CampaignError(
                f"{label}: {len(chunks) - len(results)} of {len(chunks)} chunks failed {ATTEMPTS} times; "
                "--resume goes on from those that are done"
            )
        return [results[number] for number in range(len(chunks))]

    def _attempt(
        self,
        work: Work,
        chunks: Sequence[Sequence[FloatArray]],
        constants: Sequence[Any],
        missing: Sequence[int],
        keep: Callable[[int, FloatArray], None],
    ) -> None:
        """Give out the missing chunks once; those whose worker died stay missing."""
        if self.executor is None:
            for number in missing:
                keep(number, work(*chunks[number], *constants))
            return
        try:
            waiting = {self.executor.submit(work, *chunks[n], *constants): n for n in missing}
            for future in concurrent.futures.as_completed(waiting):
                keep(waiting[future], future.result())
        except concurrent.futures.BrokenExecutor:
            if isinstance(self.executor, Workers):
                self.executor.renew()


def split(size: int, *arrays: FloatArray) -> list[list[FloatArray]]:
    """Flat arrays in chunks of at most `size` entries."""
    return [[array[k : k + size] for array in arrays] for k in range(0, arrays[0].size, size)]
