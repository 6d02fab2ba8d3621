"""Long computations that Ctrl-C can end."""

import threading
from collections.abc import Callable
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
    results: list[Answer] = []
    errors: list[BaseException] = []

    def run() -> None:
        try:
            results.append(compute())
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    # a signal may be given to the other thread: this one looks for it itself
    while thread.is_alive():
        thread.join(WAIT)
    if errors:
        raise errors[0]
    return results[0]
