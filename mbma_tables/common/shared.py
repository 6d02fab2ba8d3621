"""Cached results that all callers share, with arrays that nobody can change."""

import functools
import weakref
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

T = TypeVar("T")
Owner = TypeVar("Owner")

# attributes of surfaces are their maker's, who may go on changing the arrays that they were made of
OF_USERS = "mbma_tables.surfaces"


def parts_of(value: Any) -> list[Any]:
    """What a container, or an object of this package other than a surface, holds."""
    if isinstance(value, dict):
        return list(value.values())
    if isinstance(value, list | tuple):
        return list(value)
    module = type(value).__module__
    if module.startswith("mbma_tables") and not module.startswith(OF_USERS):
        return list(getattr(value, "__dict__", {}).values())
    return []


def frozen(value: T) -> T:
    """`value` with every array in it read-only, also in containers and own objects."""
    seen = set[int]()
    pending: list[Any] = [value]
    while pending:
        part = pending.pop()
        if id(part) in seen:
            continue
        seen.add(id(part))
        if isinstance(part, np.ndarray):
            part.setflags(write=False)
        else:
            pending += parts_of(part)
    return value


def shared(
    maxsize: int | None = None,
) -> Callable[[Callable[..., T]], "functools._lru_cache_wrapper[T]"]:
    """Decorator: results are kept as by `functools.lru_cache`, with read-only arrays."""

    def decorate(make: Callable[..., T]) -> "functools._lru_cache_wrapper[T]":
        @functools.wraps(make)
        def made(*arguments: Any, **named: Any) -> T:
            return frozen(make(*arguments, **named))

        return functools.lru_cache(maxsize)(made)

    return decorate


def kept_with(make: Callable[[Owner], T]) -> Callable[[Owner], T]:
    """Decorator: the result of an object is kept for as long as that object lives."""
    kept: weakref.WeakKeyDictionary[Owner, T] = weakref.WeakKeyDictionary()

    @functools.wraps(make)
    def made(owner: Owner) -> T:
        if owner not in kept:
            kept[owner] = make(owner)
        return kept[owner]

    return made


class shared_property(functools.cached_property[T]):
    """A `functools.cached_property` whose arrays are read-only."""

    def __init__(self, make: Callable[[Any], T]) -> None:
        @functools.wraps(make)
        def made(owner: Any) -> T:
            return frozen(make(owner))

        super().__init__(made)
