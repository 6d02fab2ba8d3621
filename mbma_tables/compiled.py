"""numba where it is needed: functions are compiled when they are first called, so that importing modules stays light.

What is compiled is kept for later processes, and made in each where no folder can keep it. Where numba is not installed
(the extra `fast`) the same functions run as plain Python, with the same answers, hundreds of times slower.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numpy as np

Function = TypeVar("Function", bound=Callable[..., Any])
Answer = TypeVar("Answer")

# what compiled arithmetic may do that a rounding error notices and nothing else
CONTRACT = {"contract"}
REORDER = {"contract", "reassoc", "arcp"}

_plain: list[Callable[..., Any]] = []  # which numba has not been told of


class Compiled:
    """A function that numba compiles when it is first called, from Python or from compiled code."""

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        functools.update_wrapper(self, function)
        self._function, self._options = function, options

    @functools.cached_property
    def dispatcher(self) -> Any:
        """numba's own object; the plain function where there is no numba."""
        try:
            import numba
            from numba.extending import register_jitable
        except ImportError:
            return _uncompiled(self._function)

        while _plain:
            register_jitable(fastmath=CONTRACT, error_model="numpy")(_plain.pop())
        try:
            return numba.njit(**self._options)(self._function)
        # "no locator available": neither the package's folder nor the user's can be written
        except RuntimeError:
            return numba.njit(**(self._options | {"cache": False}))(self._function)

    def __call__(self, *arguments: Any) -> Any:
        """Call it, compiled."""
        return self.dispatcher(*arguments)

    def entry(self, signature: str) -> Any:
        """What numba's dispatcher calls for arguments of these types: nothing looks at them, so a call is faster."""
        dispatcher = self.dispatcher
        return dispatcher.compile(signature) if hasattr(dispatcher, "compile") else dispatcher

    def __getattr__(self, name: str) -> Any:
        # numba asks for `_numba_type_` where compiled code calls this
        if name == "_numba_type_" or not name.startswith("_"):
            return getattr(self.dispatcher, name)
        raise AttributeError(name)


def _uncompiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function as Python runs it, silent as compiled code is."""

    @functools.wraps(function)
    def plain(*arguments: Any) -> Any:
        with np.errstate(all="ignore"):
            return function(*arguments)

    return plain


class Instruction:
    """An intrinsic of numba's, made when compiled code first names it; `plain` does the same in Python."""

    def __init__(self, define: Callable[..., Any], plain: Callable[..., Any]) -> None:
        self._define, self._plain = define, plain

    def __call__(self, *arguments: Any) -> Any:
        """Call it, uncompiled."""
        return self._plain(*arguments)

    @functools.cached_property
    def _numba_type_(self) -> Any:
        from numba.core.registry import cpu_target
        from numba.extending import intrinsic

        made, context = intrinsic(self._define), cpu_target.typing_context
        context.refresh()
        return context.resolve_value_type(made)


def njit(**options: Any) -> Callable[[Function], Function]:
    """`numba.njit`, put off; with `cache=True` the code is kept where numba finds a folder for it."""

    def wrap(function: Function) -> Function:
        made: Any = Compiled(function, options)
        return made  # type: ignore[no-any-return]

    return wrap


def jitable(function: Function) -> Function:
    """A plain function, of numbers and numpy arrays alike, that compiled code may call too."""
    _plain.append(function)
    return function


def in_blocks(fill: Callable[[slice], Answer], count: int, size: int, workers: int = 1) -> list[Answer]:
    """``fill(slice)`` of each `size` of `count` entries, in order: Ctrl-C is honoured between two, not inside one.

    Blocks are the same whatever the number of threads, `workers`, and so are the bits of what they fill.
    """
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
            # after Ctrl-C, the blocks at work alone are waited for
            for _ in left:
                pass

    # threads end with the call, so that a process may fork after it
    with ThreadPoolExecutor(others) as pool:
        begun = [pool.submit(work) for _ in range(others)]
        work()
        for other in begun:
            other.result()
    return [answers[number] for number in range(len(blocks))]
