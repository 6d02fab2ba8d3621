"""Many candidates in chunks: memory stays flat, both cores work, and a terminal shows how far it is."""

from __future__ import annotations

import collections
import concurrent.futures
import os
from collections.abc import Callable, Iterator
from typing import TypeVar

from mbma_tables.common.arguments import whole_number_in
from mbma_tables.common.interrupts import WAIT
from mbma_tables.common.progress import doing, shown

Answer = TypeVar("Answer")

SIZE = 1 << 14  # candidates whose numbers fit into the caches of a processor
MOST = 1 << 40
MOST_THREADS = 64


def in_chunks(
    make: Callable[[slice], Answer],
    count: int,
    *,
    size: int = SIZE,
    threads: int | None = None,
    what: str = "candidates",
) -> Iterator[tuple[slice, Answer]]:
    """What `make` answers for each chunk of many candidates, in order.

    Parameters
    ----------
    make : callable
        ``make(some)`` answers for the candidates ``some``, a slice: a contact or a joint of
        parts of arrays, or what is needed of it. Threads call it, and it must not change
        anything that they share.
    count : int
        Number of candidates.
    size : int, optional
        Number of candidates in a chunk.
    threads : int, optional
        Chunks that are computed at the same time; default: one for each processor, at most
        4. No more than one chunk per thread, and one, are in memory besides those that the
        caller keeps.
    what : str, optional
        What the candidates are, for the progress line of a terminal.

    Yields
    ------
    some : slice
    answer
        Of ``make(some)``.

    Raises
    ------
    InputError
        For numbers that are not whole or not positive; also what `make` raises.

    Examples
    --------
    >>> import numpy as np
    >>> from mbma_tables import Bodies, Surface, contact, in_chunks
    >>> Rq = np.linspace(0.2, 0.4, 1000)
    >>> def make(some):
    ...     faces = Surface(0.8, 0.01, 2.0, Rq[some], 1.5, unit="um")
    ...     return contact(faces, Bodies("58 GPa", hardness="1 GPa"), pressure="10 MPa").area
    >>> area = np.empty(1000)
    >>> for some, found in in_chunks(make, 1000, size=256):
    ...     area[some] = found
    >>> area[[0, -1]].round(4)
    array([0.0318, 0.0164])
    """
    whole_number_in("count", count, 0, MOST)
    whole_number_in("size", size, 1, MOST)
    workers = min(os.cpu_count() or 1, 4) if threads is None else threads
    whole_number_in("threads", workers, 1, MOST_THREADS)
    return _answers(make, count, size, workers, what)


def _answers(
    make: Callable[[slice], Answer], count: int, size: int, workers: int, what: str
) -> Iterator[tuple[slice, Answer]]:
    chunks = [slice(first, min(first + size, count)) for first in range(0, count, size)]
    waiting = collections.deque(chunks)
    running: collections.deque[tuple[slice, concurrent.futures.Future[Answer]]]
    running = collections.deque()
    pool = concurrent.futures.ThreadPoolExecutor(workers)
    try:
        with shown(what):
            while waiting or running:
                while waiting and len(running) <= workers:
                    some = waiting.popleft()
                    running.append((some, pool.submit(make, some)))
                some, answer = running.popleft()
                doing(f"{some.start:,} of {count:,} {what}", some.start / count)
                yield some, _result(answer)
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _result(answer: concurrent.futures.Future[Answer]) -> Answer:
    """The result of a thread; Ctrl-C ends the wait."""
    while True:
        try:
            return answer.result(timeout=WAIT)
        except concurrent.futures.TimeoutError:
            if answer.done():
                return answer.result()
