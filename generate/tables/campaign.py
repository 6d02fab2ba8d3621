"""A campaign: many independent chunks of work on any executor, checkpointed one by one.

A chunk is done when its file stands in the checkpoint folder, under a name that is the hash of what was computed;
files are written under another name first and then renamed, and begin with a checksum of that name and the content.
So a killed run loses the chunks under way and no more, a resumed one computes what is missing or damaged, and neither
the number of workers nor an interruption changes a bit.
"""

from __future__ import annotations

import concurrent.futures
import hashlib
import io
import math
import multiprocessing
import os
import pathlib
import re
import shutil
import threading
from collections.abc import Callable, Sequence
from typing import Any, Literal, Protocol

import numpy as np
from tqdm import tqdm

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import InputError
from mbma_tables.files import write_file
from mbma_tables.tablefiles.provenance import digest_arrays, digest_json

ATTEMPTS = 3  # a worker that dies costs its chunks; they are given out again until this often none was finished
DIGEST_LENGTH = 64
HEADER = re.compile(
    rb"\x93NUMPY\x01\x00..{'descr': '<f8', 'fortran_order': (?P<order>True|False), "
    rb"'shape': \((?P<shape>[\d, ]{0,40})\), } *\n",
    re.DOTALL,
)

Work = Callable[..., FloatArray]


class CampaignError(RuntimeError):
    """Chunks that failed however often they were tried, or that could not be kept."""


class Executor(Protocol):
    """What a campaign needs of a concurrent.futures-like executor."""

    def submit(self, work: Any, /, *arguments: Any) -> Any:
        """Start work, give a future."""


def chunk_key(identity: str, arguments: Sequence[FloatArray]) -> str:
    """Name of a chunk's checkpoint: what is computed, and on what."""
    return digest_json([identity, digest_arrays({str(k): a for k, a in enumerate(arguments)})])


def _digest(key: str, body: bytes) -> bytes:
    return hashlib.sha256(key.encode() + body).hexdigest().encode()


def _load(folder: pathlib.Path, key: str) -> FloatArray | None:
    """A kept result; None where there is none, or where it is damaged or another chunk's."""
    try:
        content = (folder / key).read_bytes()
    except OSError:
        return None
    digest, body = content[:DIGEST_LENGTH], content[DIGEST_LENGTH:]
    if digest != _digest(key, body):
        return None
    # no more than what `_store` writes: nothing that the header claims is believed
    header = HEADER.match(body)
    if header is None:
        return None
    shape = tuple(int(size) for size in header["shape"].split(b",") if size.strip())
    values = body[header.end() :]
    if len(values) != 8 * math.prod(shape):
        return None
    order: Literal["C", "F"] = "F" if header["order"] == b"True" else "C"
    return np.frombuffer(values, "<f8").reshape(shape, order=order).copy(order)


def _store(folder: pathlib.Path, key: str, result: FloatArray) -> None:
    body = io.BytesIO()
    np.save(body, result, allow_pickle=False)
    content = _digest(key, body.getvalue()) + body.getvalue()
    try:
        write_file(folder / key, content, make_folders=True)
    except InputError as fault:
        raise CampaignError(f"cannot keep finished chunks: {fault}") from None


def _follow_parent() -> None:
    """End this process when the one that started it is gone, whatever ended that."""
    parent = multiprocessing.parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


class Workers:
    """Worker processes of this machine, started afresh (threads and forks do not mix), renewed after one died."""

    def __init__(self, count: int) -> None:
        self.count = count
        self._pool: concurrent.futures.ProcessPoolExecutor | None = None

    def submit(self, work: Any, /, *arguments: Any) -> concurrent.futures.Future[Any]:
        """Start work in a process."""
        if self._pool is None:
            context = multiprocessing.get_context("spawn")
            self._pool = concurrent.futures.ProcessPoolExecutor(self.count, context, _follow_parent)
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
    resume : bool
        Whether chunks count that the folder held before.
    """

    def __init__(
        self,
        executor: Executor | None = None,
        checkpoints: pathlib.Path | None = None,
        resume: bool = True,
    ) -> None:
        self.executor = executor
        self.checkpoints = checkpoints
        self.resume = resume
        self._own: set[str] = set()

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
            Where chunks failed `ATTEMPTS` times, or could not be kept.
        """
        results: dict[int, FloatArray] = {}
        keys = [chunk_key(identity, chunk) for chunk in chunks]
        if self.checkpoints is not None:
            for number, key in enumerate(keys):
                if (self.resume or key in self._own) and (found := _load(self.checkpoints, key)) is not None:
                    results[number] = found
        # a terminal may say that it has no columns and no lines
        size = shutil.get_terminal_size()
        shape = {"ncols": size.columns, "nrows": size.lines, "disable": None}
        with tqdm(total=len(chunks), initial=len(results), desc=label, unit="chunk", **shape) as bar:

            def keep(number: int, result: FloatArray) -> None:
                if self.checkpoints is not None:
                    _store(self.checkpoints, keys[number], result)
                    self._own.add(keys[number])
                results[number] = result
                bar.update()

            fruitless = 0
            while fruitless < ATTEMPTS and len(results) < len(chunks):
                before = len(results)
                missing = [number for number in range(len(chunks)) if number not in results]
                self._attempt(work, chunks, constants, missing, keep)
                fruitless = 0 if len(results) > before else fruitless + 1
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
        waiting: dict[concurrent.futures.Future[FloatArray], int] = {}
        lost = (concurrent.futures.BrokenExecutor, concurrent.futures.CancelledError)
        broken = False
        try:
            for number in missing:
                waiting[self.executor.submit(work, *chunks[number], *constants)] = number
        except lost:
            broken = True
        for future in concurrent.futures.as_completed(waiting):
            try:
                result = future.result()
            except lost:
                broken = True
                continue
            keep(waiting[future], result)
        if broken and isinstance(self.executor, Workers):
            self.executor.renew()


def split(size: int, *arrays: FloatArray) -> list[list[FloatArray]]:
    """Flat arrays in chunks of at most `size` entries."""
    return [[array[k : k + size] for array in arrays] for k in range(0, arrays[0].size, size)]
