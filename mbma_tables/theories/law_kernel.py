"""Compiled evaluation of the laws of any theory: polynomials of ln F and ln A in a stretched mean separation.

With v = u/h_max the unknown is x = ln v where force has no bound at u = 0, -ln(1 - v) where contact ends at h_max,
the sum of both where both do, and v itself where neither does. x rises with u.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import njit
from mbma_tables.totals.law_kernel import AREA_SLOPE, ENERGY, FORCE_SLOPE, locate, slope_in, value_in

PANELS = 8  # of a piece, over which force is integrated
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(20)


class Law(NamedTuple):
    """A law as compiled code takes it."""

    breaks: FloatArray  # ends of the pieces in x
    pieces: FloatArray  # coefficients (pieces, TERMS, 2)
    energies: FloatArray  # integral of force over u from last contact to each end of the panels
    unbounded: bool  # whether force has no bound at u = 0
    ends: bool  # whether contact ends at h_max
    h_max: float


@njit(cache=True, error_model="numpy")
def to_x(rest: float, unbounded: bool, ends: bool) -> float:
    """x at 1 - v."""
    v = 1.0 - rest
    if not (unbounded or ends):
        return v
    x = 0.0
    if unbounded:
        x += math.log(v)
    if ends:
        x -= math.log(rest)
    return x


@njit(cache=True, error_model="numpy")
def to_rest(x: float, unbounded: bool, ends: bool) -> float:
    """1 - v at x."""
    if unbounded:
        return 1.0 / (1.0 + math.exp(x)) if ends else -math.expm1(x)
    return math.exp(-x) if ends else 1.0 - x


@njit(cache=True, error_model="numpy")
def stretch(rest: float, unbounded: bool, ends: bool) -> float:
    """dx/dv."""
    if not (unbounded or ends):
        return 1.0
    return (1.0 / (1.0 - rest) if unbounded else 0.0) + (1.0 / rest if ends else 0.0)


@njit(cache=True, error_model="numpy")
def logs(x: float, which: int, law: Law) -> tuple[float, float]:
    """ln F or ln A at x, and its slope; straight beyond the last break, a power of h_max - u."""
    last = law.breaks.size - 1
    held = min(max(x, law.breaks[0]), law.breaks[last])
    piece = locate(held, law.breaks)
    a, b = law.breaks[piece], law.breaks[piece + 1]
    y = (2.0 * held - a - b) / (b - a)
    slope = slope_in(law.pieces, piece, which, y) * 2.0 / (b - a)
    return value_in(law.pieces, piece, which, y) + slope * (x - held), slope


@njit(cache=True, error_model="numpy")
def _work(low: float, high: float, law: Law) -> float:
    """Integral of force over u between two x."""
    half, centre, total = 0.5 * (high - low), 0.5 * (high + low), 0.0
    for k in range(_NODES.size):
        x = centre + half * _NODES[k]
        steep = stretch(to_rest(x, law.unbounded, law.ends), law.unbounded, law.ends)
        total += _WEIGHTS[k] * math.exp(logs(x, 0, law)[0]) / steep
    return half * total * law.h_max


@njit(cache=True, error_model="numpy")
def _tail(x: float, law: Law) -> float:
    """Integral of a power of h_max - u from x to first contact."""
    value, slope = logs(x, 0, law)
    return math.exp(value) * law.h_max * to_rest(x, law.unbounded, law.ends) / (1.0 - slope)


@njit(cache=True, error_model="numpy")
def _panel_end(k: int, law: Law) -> float:
    """x at an entry of `energies`."""
    piece, part = k // PANELS, k % PANELS
    x: float = law.breaks[piece]
    if part > 0:
        x += (law.breaks[piece + 1] - law.breaks[piece]) * part / PANELS
    return x


@njit(cache=True, error_model="numpy")
def _energy(x: float, law: Law) -> float:
    """Integral of force over u from last contact to x."""
    if law.ends and x > law.breaks[law.breaks.size - 1]:
        return _tail(x, law)
    piece = locate(max(x, law.breaks[0]), law.breaks)
    a, b = law.breaks[piece], law.breaks[piece + 1]
    after = piece * PANELS + min(max(int(PANELS * (x - a) / (b - a)) + 1, 1), PANELS)
    below: float = law.energies[after]
    return below + _work(x, _panel_end(after, law), law)


@njit(cache=True, error_model="numpy")
def fill_energies(law: Law, last: float) -> None:
    """Energies at the panels' ends, into the law; `last` at the last of them where contact does not end at h_max."""
    end = law.energies.size - 1
    law.energies[end] = _tail(law.breaks[law.breaks.size - 1], law) if law.ends else last
    for k in range(end - 1, -1, -1):
        law.energies[k] = law.energies[k + 1] + _work(_panel_end(k, law), _panel_end(k + 1, law), law)


@njit(cache=True, error_model="numpy", nogil=True)
def fill(what: int, gap: FloatArray, given: Any, out: FloatArray) -> None:
    """FORCE, AREA, FORCE_SLOPE, AREA_SLOPE (both against -d) or ENERGY (over d) of each gap d, with E* = 1."""
    law = Law(*given)
    which = what if what <= 1 else what - FORCE_SLOPE
    for k in range(gap.size):
        rest = 0.5 * (law.h_max - gap[k]) / law.h_max
        if law.ends and not rest > 0.0:
            out[k] = 0.0
            continue
        x = to_x(rest, law.unbounded, law.ends)
        if what == ENERGY:
            out[k] = 2.0 * _energy(x, law)
            continue
        value, slope = logs(x, which, law)
        out[k] = math.exp(value)
        if what in (FORCE_SLOPE, AREA_SLOPE):
            out[k] *= -slope * stretch(rest, law.unbounded, law.ends) / (2.0 * law.h_max)


@njit(cache=True, error_model="numpy", nogil=True)
def fill_logs(x: FloatArray, which: int, given: Any, out: FloatArray, slopes: FloatArray) -> None:
    """`logs` of each x."""
    law = Law(*given)
    for k in range(x.size):
        out[k], slopes[k] = logs(x[k], which, law)
