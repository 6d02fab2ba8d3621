"""The compiled core: all loops of the library, in C, as exports contain it.

`core` is the module of the newest generation of processor that this machine supports; the environment variable
MBMA_TABLES_CORE names another one, such as "x86_64_v3". `mbma.h` describes the functions; arguments of the wrappers are
in the same order, without the counts of arrays.
"""

import importlib
import os
import threading
from collections.abc import Callable
from typing import Any, TypeVar

Answer = TypeVar("Answer")

# `mbma_status` of mbma.h
OK, X_BELOW, X_ABOVE, MU_ABOVE, UNRESOLVED, INVALID, OUTSIDE = range(7)
WAIT = 0.1  # s between two checks for Ctrl-C
GENERATIONS = {"x86_64_v4": 4, "x86_64_v3": 3, "plain": 0}


def _load() -> Any:
    wanted = os.environ.get("MBMA_TABLES_CORE")
    if wanted:
        return importlib.import_module(f"mbma_tables.core._{wanted}")
    try:
        plain = importlib.import_module("mbma_tables.core._plain")
    except ModuleNotFoundError as missing:
        raise ImportError(
            f"the compiled core is not in {os.path.dirname(__file__)}: start Python outside of the checkout, or "
            "install it there with `pip install -e .`"
        ) from missing
    best = next(name for name, least in GENERATIONS.items() if plain.generation >= least)
    return plain if best == "plain" else importlib.import_module(f"mbma_tables.core._{best}")


core: Any = _load()
# builds with the same arithmetic give identical results
ARITHMETIC: str = core.arithmetic


def in_blocks(fill: Callable[[slice], Answer], count: int, size: int) -> list[Answer]:
    """``fill(slice)`` of each `size` of `count` entries, in order; Ctrl-C takes effect between two of them."""
    return [fill(slice(first, min(first + size, count))) for first in range(0, count, size)]


def interruptible(compute: Callable[[], Answer]) -> Answer:
    """``compute()``, a single call of another library that lets other threads run; Ctrl-C ends the wait for it.

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
