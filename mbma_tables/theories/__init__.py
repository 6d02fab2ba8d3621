"""Theories of rough contact behind one protocol: MBMA, Persson, Greenwood-Williamson, or an object of one's own."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from mbma_tables.theories.registry import THEORIES, get_theory

if TYPE_CHECKING:
    from mbma_tables.theories.asperities import GreenwoodWilliamson
    from mbma_tables.theories.calibrated import Calibrated
    from mbma_tables.theories.mbma import Mbma
    from mbma_tables.theories.persson import Method, Persson
    from mbma_tables.theories.protocol import Theory, TheoryAnswer, UserTheory
    from mbma_tables.theories.simulated import BoundaryElements

__all__ = [
    "THEORIES",
    "BoundaryElements",
    "Calibrated",
    "GreenwoodWilliamson",
    "Mbma",
    "Method",
    "Persson",
    "Theory",
    "TheoryAnswer",
    "UserTheory",
    "get_theory",
]

# a theory's module is imported when it is first asked for
_MODULES = {
    "asperities": ("GreenwoodWilliamson",),
    "calibrated": ("Calibrated",),
    "mbma": ("Mbma",),
    "persson": ("Method", "Persson"),
    "protocol": ("Theory", "TheoryAnswer", "UserTheory"),
    "simulated": ("BoundaryElements",),
}
_HOMES = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
