"""The compiled core: all loops of the library, in C; exports contain the same files.

`core` is the module of the newest generation of processor that this machine supports; the environment variable
MBMA_TABLES_CORE names another one, such as "x86_64_v3". `mbma.h` describes the functions; arguments of the wrappers are
in the same order, without the counts of arrays.
"""

import importlib
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

Answer = TypeVar("Answer")

# `mbma_status` of mbma.h
OK, X_BELOW, X_ABOVE, MU_ABOVE, UNRESOLVED, INVALID, OUTSIDE = range(7)
REASONS = {X_BELOW: "X below", X_ABOVE: "X above", MU_ABOVE: "mu above"}
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


def in_blocks(fill: Callable[[slice], Answer], count: int, size: int, workers: int = 1) -> list[Answer]:
    """``fill(slice)`` of each `size` of `count` entries, in order; Ctrl-C takes effect between two of them.

    Blocks, and with them all bits of the results, are independent of the number of threads, `workers`.
    """
    if 0 < count <= size:
        return [fill(slice(0, count))]
    blocks = [slice(first, min(first + size, count)) for first in range(0, count, size)]
    others = min(workers, len(blocks)) - 1
    if others <= 0:
        return [fill(block) for block in blocks]
    left, answers = enumerate(blocks), dict[int, Answer]()

    def work() -> None:
        try:
            for number, block in left:
                answers[number] = fill(block)
        finally:
            # after Ctrl-C, only the running blocks are completed
            for _ in left:
                pass

    # threads end with the call, so that a process may fork after it
    with ThreadPoolExecutor(others) as pool:
        begun = [pool.submit(work) for _ in range(others)]
        work()
        for other in begun:
            other.result()
    return [answers[number] for number in range(len(blocks))]
