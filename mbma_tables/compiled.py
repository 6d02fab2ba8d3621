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


class Lanes:
    """A double, or a vector of them, in LLVM's code, with the arithmetic of numpy; `flags` are LLVM's of each step."""

    def __init__(self, builder: Any, value: Any, flags: tuple[str, ...]) -> None:
        self.builder, self.value, self.flags = builder, value, flags

    @classmethod
    def load(cls, builder: Any, data: Any, at: Any, count: int, flags: tuple[str, ...]) -> Lanes:
        """Neighbours in an array of doubles or floats, from number `at` on."""
        from llvmlite import ir

        pointer, double = builder.gep(data, [at], inbounds=True), ir.DoubleType()
        kind = pointer.type.pointee
        vector = builder.load(builder.bitcast(pointer, ir.VectorType(kind, count).as_pointer()))
        # numbers, not vectors, are what numpy aligns
        vector.align = 8 if kind == double else 4
        return cls(builder, vector if kind == double else builder.fpext(vector, ir.VectorType(double, count)), flags)

    def __add__(self, other: Lanes) -> Lanes:
        """Of two alike."""
        return Lanes(self.builder, self.builder.fadd(self.value, other.value, flags=self.flags), self.flags)

    def __mul__(self, other: Any) -> Lanes:
        """By another alike; of a vector by a list of constants, or every lane of it by a number."""
        from llvmlite import ir

        own, factor = self.value, ir.Constant(self.value.type, other) if isinstance(other, list) else other.value
        if own.type != factor.type:
            factor = ir.Constant(own.type, ir.Undefined)
            for k in range(own.type.count):
                factor = self.builder.insert_element(factor, other.value, ir.IntType(32)(k))
        return Lanes(self.builder, self.builder.fmul(own, factor, flags=self.flags), self.flags)

    def __getitem__(self, lanes: Any) -> Lanes:
        """One lane, or the vector of those in a slice or list."""
        from llvmlite import ir

        index, vector = ir.IntType(32), self.value
        if isinstance(lanes, int):
            return Lanes(self.builder, self.builder.extract_element(vector, index(lanes)), self.flags)
        places = [index(k) for k in (lanes if isinstance(lanes, list) else range(vector.type.count)[lanes])]
        mask = ir.Constant(ir.VectorType(index, len(places)), places)
        picked = self.builder.shuffle_vector(vector, ir.Constant(vector.type, ir.Undefined), mask)
        return Lanes(self.builder, picked, self.flags)


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
