"""Theories of rough contact behind one protocol: MBMA, Persson, Greenwood-Williamson, or an object of one's own."""

from __future__ import annotations

from mbma_tables.theories.greenwood_williamson import (
    Asperities,
    GreenwoodWilliamson,
    greenwood_williamson,
    mean_separation,
    separation,
)
from mbma_tables.theories.mbma import Mbma
from mbma_tables.theories.persson import Method, Persson, persson_area, persson_force, persson_separation
from mbma_tables.theories.protocol import Theory, TheoryAnswer, UserTheory
from mbma_tables.theories.registry import THEORIES, get_theory

__all__ = [
    "THEORIES",
    "Asperities",
    "GreenwoodWilliamson",
    "Mbma",
    "Method",
    "Persson",
    "Theory",
    "TheoryAnswer",
    "UserTheory",
    "get_theory",
    "greenwood_williamson",
    "mean_separation",
    "persson_area",
    "persson_force",
    "persson_separation",
    "separation",
]
