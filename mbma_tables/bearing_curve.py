"""Share of a surface's heights above the level of a mean gap: Gaussian heights, and a map's."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator
from scipy.special import ndtr, ndtri

from mbma_tables.arguments import FloatArray
from mbma_tables.bearing import FRACTIONS
from mbma_tables.compiled import njit
from mbma_tables.errors import InputError

LINEAR, LEAST = 8.3, 1e-300  # mean gaps from which u = d, and below which all heights lie above the level
LOG_GAPS, NODES = (-12.0, math.log(8.3)), 16384  # of tabulated levels
MOST_SHARE = 0.9  # of a map's heights up to which a node stands for its own
DEPTH = 30.0  # of a map's valleys below the last node, in levels
MIN_SPACING = 0.02  # relative, of mean gaps between nodes of a map's bearing curve
CANCELS, FRACTION_TERMS = 3.0, 60


def rows(*given: ArrayLike) -> tuple[FloatArray, tuple[int, ...]]:
    """What is given, broadcast and flat, and the shape."""
    arrays = [np.asarray(value, float) for value in given]
    shape = np.broadcast(*arrays).shape
    table = np.empty((len(arrays), *shape))
    for k, array in enumerate(arrays):
        table[k] = array
    return table.reshape(len(arrays), -1), shape


@njit(cache=True, error_model="numpy")
def mean_gap(d: float) -> tuple[float, float]:
    """Mean gap under a plane at level d of a Gaussian surface, d Phi(d) + phi(d) [h_rms], and Phi(d)."""
    density = math.exp(-0.5 * d * d) / math.sqrt(2 * math.pi)
    if d > -CANCELS:
        below = 0.5 * math.erfc(-d / math.sqrt(2.0))
        return d * below + density, below
    # both terms nearly cancel: by the continued fraction of Mills' ratio
    rest = 0.0
    for k in range(FRACTION_TERMS, 1, -1):
        rest = k / (-d + rest)
    rest = 1.0 / (-d + rest)
    mills = 1.0 / (-d + rest)
    return density * mills * rest, density * mills


def _levels() -> FloatArray:
    """Levels d at mean gaps equally spaced in the logarithm, and their slopes by it."""
    log_gap = np.linspace(*LOG_GAPS, NODES)
    d = np.linspace(-6.0, LINEAR, 4000)
    d = np.interp(log_gap, np.log(np.exp(-d * d / 2) / np.sqrt(2 * np.pi) + d * ndtr(d)), d)
    for _ in range(4):
        gap = np.exp(-d * d / 2) / np.sqrt(2 * np.pi) + d * ndtr(d)
        d += (log_gap - np.log(gap)) * gap / ndtr(d)
    return np.stack([d, np.exp(log_gap) / ndtr(d)], axis=1)


_LEVELS = _levels()


@njit(cache=True, error_model="numpy")
def _level(u: float) -> float:
    """Level d whose mean gap is u: Hermite's cubics of ln u, to 1e-14, or Newton's method in the logarithm."""
    if u >= LINEAR:
        return u
    if u <= LEAST:
        return -math.inf
    log_u = math.log(u)
    step = (LOG_GAPS[1] - LOG_GAPS[0]) / (NODES - 1)
    place = (log_u - LOG_GAPS[0]) / step
    if place > 0.0:
        k = min(int(place), NODES - 2)
        x = place - k
        rise = _LEVELS[k + 1, 0] - _LEVELS[k, 0]
        first, last = _LEVELS[k, 1] * step - rise, rise - _LEVELS[k + 1, 1] * step
        d: float = _LEVELS[k, 0] + x * (rise + (1.0 - x) * ((1.0 - x) * first + x * last))
        return d
    d = -math.sqrt(-2.0 * log_u)
    for _ in range(30):
        gap, below = mean_gap(d)
        move = (math.log(gap) - log_u) * gap / below
        d -= move
        if abs(move) <= 3e-7:  # and the next one its square
            break
    return d


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_levels(u: FloatArray, out: FloatArray) -> None:
    for k in range(u.size):
        out[k] = _level(u[k])


def _levels_at(u: FloatArray) -> FloatArray:
    """`_level` of an array."""
    out = np.empty(u.size)
    _fill_levels(u.ravel(), out)
    return out.reshape(u.shape)


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_bearing(u: FloatArray, h_max: FloatArray, share: FloatArray, slope: FloatArray) -> None:
    last, end = -1.0, 0.0
    for k in range(u.size):
        if h_max[k] != last:
            last = h_max[k]
            end = 0.5 * math.erfc(_level(last) / math.sqrt(2.0)) if last < math.inf else 0.0
        if u[k] >= last:
            share[k] = slope[k] = 0.0
            continue
        d = _level(u[k])
        # the larger follows from the smaller
        below = mean_gap(d)[1] if d <= 0.0 else 0.0
        above = 0.5 * math.erfc(d / math.sqrt(2.0)) if d > 0.0 else 1.0 - below
        share[k] = max(above - end, 0.0) / (1.0 - end)
        density = math.exp(-0.5 * d * d) / math.sqrt(2 * math.pi)
        slope[k] = -density / (below if d <= 0.0 else 1.0 - above) / (1.0 - end) if d > -math.inf else -math.inf


def bearing_share(u: ArrayLike, h_max: ArrayLike | None = None) -> tuple[FloatArray, FloatArray]:
    """Q(u), share of Gaussian heights above the level of mean gap u [h_rms], and dQ/du; with `h_max` it ends there."""
    known, shape = rows(u, np.inf if h_max is None else h_max)
    out = np.empty_like(known)
    _fill_bearing(*known, *out)
    return out[0].reshape(shape), out[1].reshape(shape)


class BearingCurve:
    """Q(u) of a map's own heights: of M(a) [h_rms] of `mbma_tables.bearing`, a = `FRACTIONS`, and its highest point."""

    def __init__(self, mean_height: FloatArray, h_max: float) -> None:
        above = FRACTIONS * mean_height
        # d(a M)/da is the level z(a), and the mean gap below it is z (1 - a) + a M
        level = np.minimum.accumulate(np.diff(above) / np.diff(FRACTIONS))
        share = np.sqrt(FRACTIONS[1:] * FRACTIONS[:-1])
        gap = level * (1 - share) + np.interp(share, FRACTIONS, above)
        # the smallest shares are single points: nodes as close as theirs would make steps; the last one ends at valleys
        kept, last = np.zeros(gap.size, bool), h_max
        for k, own in enumerate(gap):
            if 0 < own < (1 - MIN_SPACING) * last and share[k] < MOST_SHARE:
                kept[k], last = True, own
        if not kept.any():
            raise InputError(
                f"nearly {MOST_SHARE:.0%} of the map or more is its highest point: it has no bearing curve"
            )
        self._top, self._lightest, self._h_max = float(gap[kept][0]), float(share[kept][0]), h_max
        # against Gaussian heights; valleys below the last node as deep as theirs
        level, own = _levels_at(gap[kept][::-1]), -ndtri(share[kept][::-1])
        self._deepest = float(level[0]) - DEPTH
        self._level = PchipInterpolator(np.append(self._deepest, level), np.append(own[0] - DEPTH, own))
        self._rate = self._level.derivative()

    def __call__(self, u: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Q and dQ/du at mean gaps [h_rms]; straight to zero at the highest point above the first share."""
        gap = np.asarray(u, float)
        d = np.maximum(_levels_at(np.clip(gap, 0.0, self._top)), self._deepest)
        own = self._level(d)
        share, slope = ndtr(-own), -np.exp(-own * own / 2) / np.sqrt(2 * np.pi) * self._rate(d) / ndtr(d)
        steep = -self._lightest / (self._h_max - self._top)
        light, rest = gap > self._top, np.maximum(self._h_max - gap, 0.0)
        return np.where(light, -steep * rest, share), np.where(light, np.where(rest > 0, steep, 0.0), slope)
