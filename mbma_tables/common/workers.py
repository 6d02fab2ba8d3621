"""Jobs, here or in processes of this machine."""

import concurrent.futures
import itertools
import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any


def end_with(parent: int) -> None:
    """End this process when its parent is gone, even if that was killed."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def results(
    label: str,
    work: Callable[..., Any],
    jobs: Sequence[tuple[Any, ...]],
    workers: int = 1,
) -> Iterator[Any]:
    """``work(*job)`` of each job, in order, with a progress bar of that name where stderr is a terminal."""
    from tqdm import tqdm

    # started afresh: threads and forks do not mix
    start = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(
        workers, start, end_with, (os.getpid(),)
    ) as pool:
        found = (
            itertools.starmap(work, jobs)
            if workers == 1
            else pool.map(work, *zip(*jobs, strict=True))
        )
        yield from tqdm(found, label, len(jobs), disable=None)
