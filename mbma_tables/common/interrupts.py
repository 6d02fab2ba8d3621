"""Long computations that Ctrl-C can end."""

import threading
from collections.abc import Callable, Sequence
from typing import TypeVar

Answer = TypeVar("Answer")
WAIT = 0.1  # s between two checks for Ctrl-C


def in_blocks(fill: Callable[[slice], Answer], count: int, size: int) -> list[Answer]:
    """``fill(slice)`` of each `size` of `count` entries, in order; Ctrl-C ends it."""
    return [
        fill(slice(first, min(first + size, count))) for first in range(0, count, size)
    ]


def interruptible(compute: Callable[[], Answer]) -> Answer:
    """``compute()``, a single call of another library, in a thread; Ctrl-C ends the wait.

    What it computes then goes on in a thread of its own to its end, or to that of the process.
    """
    return at_once([compute])[0]


def at_once(computations: Sequence[Callable[[], Answer]]) -> list[Answer]:
    """Results of several such calls, each in a thread of its own."""
    results: dict[int, Answer] = {}
    errors: list[BaseException] = []

    def run(number: int) -> None:
        try:
            results[number] = computations[number]()
        except BaseException as error:
            errors.append(error)

    threads = [
        threading.Thread(target=run, args=(number,), daemon=True)
        for number in range(len(computations))
    ]
    for thread in threads:
        thread.start()
    # a signal may be given to another thread: this one looks for it itself
    for thread in threads:
        while thread.is_alive():
            thread.join(WAIT)
    if errors:
        raise errors[0]
    return [results[number] for number in range(len(computations))]
