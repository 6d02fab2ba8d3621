"""numba's decorators, which here also work where no folder can keep what they compile."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


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
