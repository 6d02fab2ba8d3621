"""Many pieces of work: here, in processes of this machine, by a dask scheduler, or a part on each of several machines."""

from __future__ import annotations

import collections
import concurrent.futures
import contextlib
import dataclasses
import itertools
import multiprocessing
import os
import re
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeVar

from mbma_tables.common.arguments import needed
from mbma_tables.common.errors import InputError

Work = Callable[..., Any]
Jobs = Iterable[tuple[Any, ...]]
Each = TypeVar("Each")
AHEAD = 2  # jobs a worker that are under way, or done and not yet asked for


@dataclasses.dataclass(frozen=True)
class Crew:
    """What runs jobs: a function of work and jobs that yields results in the order of the jobs.

    Attributes
    ----------
    in_order : callable
        That function.
    as_finished : callable
        Of work and jobs: results as they are finished.
    size : callable
        How many jobs run at a time, at present.
    """

    in_order: Callable[[Work, Jobs], Iterator[Any]]
    as_finished: Callable[[Work, Jobs], Iterator[Any]]
    size: Callable[[], int]

    def __call__(self, work: Work, jobs: Jobs) -> Iterator[Any]:
        """Results in the order of the jobs."""
        return self.in_order(work, jobs)


def end_with(parent: int) -> None:
    """End this process when its parent is gone, even if that was killed."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def part_of(text: str | None) -> tuple[int, int] | None:
    """K and N of "K/N"."""
    if text is None:
        return None
    numbers = re.fullmatch(r"(\d+)/(\d+)", text)
    if numbers is None:
        raise InputError(f"--part must be K/N, such as 1/4, got {text!r}")
    return int(numbers[1]), int(numbers[2])


def share_of(part: tuple[int, int] | None, pieces: Sequence[Each]) -> Sequence[Each]:
    """The pieces of work that part k of n does: every n-th, so that parts take equally long."""
    if part is None:
        return pieces
    k, n = part
    if not 1 <= k <= n:
        raise InputError(f"part must be k/n with 1 <= k <= n, got {k}/{n}")
    return pieces[k - 1 :: n]


@contextlib.contextmanager
def crew(
    workers: int = 1, scheduler: str | None = None, local_cluster: int | None = None
) -> Iterator[Crew]:
    """What runs jobs.

    Parameters
    ----------
    workers : int
        Processes of this machine; one is this process.
    scheduler : str, optional
        Address of a dask scheduler, whose workers run them instead.
    local_cluster : int, optional
        Processes of a dask cluster on this machine, which goes on when one of them is killed.
    """
    if scheduler is not None and local_cluster is not None:
        raise InputError("give a scheduler or local_cluster, not both")
    if scheduler is not None or local_cluster is not None:
        with _dask_crew(scheduler, local_cluster) as found:
            yield found
        return
    if workers == 1:
        yield Crew(itertools.starmap, itertools.starmap, lambda: 1)
        return
    # started afresh: threads and forks do not mix
    start = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(
        workers, start, end_with, (os.getpid(),)
    ) as pool:

        def as_finished(work: Work, jobs: Jobs) -> Iterator[Any]:
            futures = [pool.submit(work, *job) for job in jobs]
            try:
                for future in concurrent.futures.as_completed(futures):
                    yield future.result()
            finally:
                for future in futures:
                    future.cancel()

        yield Crew(
            lambda work, jobs: _in_order(pool, work, jobs, AHEAD * workers),
            as_finished,
            lambda: workers,
        )


def _in_order(
    pool: concurrent.futures.Executor,
    work: Work,
    jobs: Jobs,
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


@contextlib.contextmanager
def _dask_crew(scheduler: str | None, local_cluster: int | None) -> Iterator[Crew]:
    """The workers of a dask scheduler; work of one that is killed is done by the others."""
    distributed = needed("distributed")
    with contextlib.ExitStack() as stack:
        if local_cluster is not None:
            scheduler = stack.enter_context(
                distributed.LocalCluster(
                    n_workers=local_cluster, threads_per_worker=1, dashboard_address=None
                )
            )
        client = stack.enter_context(distributed.Client(scheduler))

        def submitted(work: Work, jobs: Jobs) -> Any:
            return [client.submit(work, *job, pure=False) for job in jobs]

        yield Crew(
            lambda work, jobs: (each.result() for each in submitted(work, jobs)),
            lambda work, jobs: (
                each.result() for each in distributed.as_completed(submitted(work, jobs))
            ),
            lambda: max(1, sum(client.nthreads().values())),
        )


def results(
    label: str, work: Work, jobs: Sequence[tuple[Any, ...]], workers: int = 1
) -> Iterator[Any]:
    """``work(*job)`` of each job, in order, with a progress bar of that name where stderr is a terminal."""
    from tqdm import tqdm

    with crew(workers) as run:
        yield from tqdm(run(work, jobs), label, len(jobs), disable=None)
