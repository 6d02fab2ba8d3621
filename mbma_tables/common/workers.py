"""Jobs, here or in processes of this machine."""

import collections
import concurrent.futures
import contextlib
import itertools
import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from mbma_tables.common.arguments import needed

Crew = Callable[[Callable[..., Any], Iterable[tuple[Any, ...]]], Iterator[Any]]
AHEAD = 2  # jobs a worker that are under way, or done and not yet asked for


def end_with(parent: int) -> None:
    """End this process when its parent is gone, even if that was killed."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextlib.contextmanager
def crew(workers: int = 1, scheduler: str | None = None) -> Iterator[Crew]:
    """What runs jobs: a function of work and jobs that yields results in the order of the jobs.

    One worker is this process; others are processes of this machine, or the workers of a
    dask scheduler by its address.
    """
    if scheduler is not None:
        client = needed("distributed").Client(scheduler)
        try:
            yield lambda work, jobs: (
                future.result() for future in client.map(work, *zip(*jobs, strict=True))
            )
        finally:
            client.close()
        return
    if workers == 1:
        yield itertools.starmap
        return
    # started afresh: threads and forks do not mix
    start = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(
        workers, start, end_with, (os.getpid(),)
    ) as pool:
        yield lambda work, jobs: _in_order(pool, work, jobs, AHEAD * workers)


def _in_order(
    pool: concurrent.futures.Executor,
    work: Callable[..., Any],
    jobs: Iterable[tuple[Any, ...]],
    most: int,
) -> Iterator[Any]:
    """Results in the order of the jobs, which are taken as they are needed: memory stays flat."""
    running: collections.deque[concurrent.futures.Future[Any]] = collections.deque()
    try:
        for job in jobs:
            running.append(pool.submit(work, *job))
            if len(running) > most:
                yield running.popleft().result()
        while running:
            yield running.popleft().result()
    finally:
        for unfinished in running:
            unfinished.cancel()


def results(
    label: str,
    work: Callable[..., Any],
    jobs: Sequence[tuple[Any, ...]],
    workers: int = 1,
) -> Iterator[Any]:
    """``work(*job)`` of each job, in order, with a progress bar of that name where stderr is a terminal."""
    from tqdm import tqdm

    with crew(workers) as run:
        yield from tqdm(run(work, jobs), label, len(jobs), disable=None)
