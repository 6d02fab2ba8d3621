"""Where jobs run: here, or in processes of this machine."""

import concurrent.futures
import contextlib
import functools
import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeVar

Pool = concurrent.futures.Executor | None
Key = TypeVar("Key")


@contextlib.contextmanager
def executor(workers: int) -> Iterator[Pool]:
    """Processes, or None for one worker: here."""
    if workers == 1:
        yield None
        return
    # started afresh: threads and forks do not mix
    start = multiprocessing.get_context("spawn")
    ends = functools.partial(_end_with, os.getpid())
    with concurrent.futures.ProcessPoolExecutor(workers, start, initializer=ends) as pool:
        yield pool


def _end_with(parent: int) -> None:
    """End this worker when its parent is gone, even if that was killed."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def attempts(
    pool: Pool, work: Callable[..., Any], jobs: Mapping[Key, tuple[Any, ...]]
) -> Iterator[tuple[Key, Callable[[], Any]]]:
    """Keys of jobs, as they finish, and a function that returns the job's result or raises its error."""
    if pool is None:
        yield from ((key, functools.partial(work, *job)) for key, job in jobs.items())
        return
    waiting = {pool.submit(work, *job): key for key, job in jobs.items()}
    try:
        for future in concurrent.futures.as_completed(waiting):
            yield waiting[future], future.result
    finally:
        # else leaving the pool waits for all of them
        for future in waiting:
            future.cancel()
