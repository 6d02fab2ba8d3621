"""Uniform tensor splines by their B-spline coefficients, which `generate.splines` finds."""

from __future__ import annotations

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.core import core


def padding(degree: int) -> int:
    """Coefficients beyond each end of an axis."""
    return (degree - 1) // 2


def at_places(coefs: FloatArray, places: FloatArray, slopes: bool = False) -> FloatArray:
    """Two cubic functions of four axes, (2, entries), at positions in node units, (4, entries); NaN beyond the axes.

    With `slopes` the values come with derivatives by the positions, (2, 5, entries).
    """
    nodes, given = np.array(coefs.shape[:4]) - 2, np.ascontiguousarray(places, dtype=float)
    out = np.empty((2, 5, given.shape[1]) if slopes else (2, given.shape[1]))
    core.spline4(given, np.ascontiguousarray(coefs), nodes, slopes, out)
    return out
