"""Jobs, here or in processes of this machine."""

import concurrent.futures
import itertools
import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from tqdm import tqdm


def results(label: str, work: Callable[..., Any], jobs: Sequence[tuple[Any, ...]], workers: int = 1) -> Iterator[Any]:
    """``work(*job)`` of each job, in order, with a progress bar of that name where stderr is a terminal."""
    # started afresh: threads and forks do not mix
    start = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(workers, start) as pool:
        found = itertools.starmap(work, jobs) if workers == 1 else pool.map(work, *zip(*jobs, strict=True))
        yield from tqdm(found, label, len(jobs), disable=None)
