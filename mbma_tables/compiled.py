"""numba's decorators, which here also work where no folder can keep what they compile."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numba
from numba.extending import register_jitable

Function = TypeVar("Function", bound=Callable[..., Any])
Answer = TypeVar("Answer")

# what compiled arithmetic may do that a rounding error notices and nothing else
CONTRACT = {"contract"}
REORDER = {"contract", "reassoc", "arcp"}


def _kept(decorate: Callable[..., Any], *signature: Any, **options: Any) -> Callable[[Function], Function]:
    def wrap(function: Function) -> Function:
        try:
            made: Function = decorate(*signature, **options)(function)
        # "no locator available": neither the package's folder nor the user's can be written
        except RuntimeError:
            made = decorate(*signature, **(options | {"cache": False}))(function)
        return made

    return wrap


def njit(**options: Any) -> Callable[[Function], Function]:
    """`numba.njit`; with `cache=True` the code is kept for later processes where numba finds a folder for it."""
    return _kept(numba.njit, **options)


def vectorize(signatures: list[str], **options: Any) -> Callable[[Function], Function]:
    """`numba.vectorize`, kept likewise."""
    return _kept(numba.vectorize, signatures, **options)


def jitable(function: Function) -> Function:
    """A plain function, of numbers and numpy arrays alike, that compiled code may call too."""
    made: Function = register_jitable(function)
    return made


def in_blocks(fill: Callable[[slice], Answer], count: int, size: int, threads: int = 1) -> list[Answer]:
    """``fill(slice)`` of each `size` of `count` entries, in order: Ctrl-C is honoured between two, not inside one."""
    blocks = [slice(first, min(first + size, count)) for first in range(0, count, size)]
    if threads == 1 or len(blocks) == 1:
        return [fill(block) for block in blocks]
    # threads end with the call, so that a process may fork after it
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(fill, blocks))
