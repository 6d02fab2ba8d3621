"""Share of a surface's heights above the level of a mean gap: Gaussian heights, and a map's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator
from scipy.special import ndtr, ndtri

from mbma_tables.arguments import FloatArray, rows
from mbma_tables.bearing import FRACTIONS
from mbma_tables.core import core, in_blocks
from mbma_tables.errors import InputError

BLOCK = 1 << 16  # entries between two looks for Ctrl-C
MOST_SHARE = 0.9  # of a map's heights up to which a node stands for its own
DEPTH = 30.0  # of a map's valleys below the last node, in levels
MIN_SPACING = 0.02  # relative, of mean gaps between nodes of a map's bearing curve


def filled(fill: Callable[..., int], known: FloatArray, out: FloatArray, *more: Any) -> FloatArray:
    """Rows of `out`, one or several, by a loop of the compiled core over rows of as many entries."""
    own = [out] if out.ndim == 1 else out
    if out.shape[-1] <= BLOCK:
        fill(*known, *more, *own)
        return out

    def block(some: slice) -> int:
        return fill(*(row[some] for row in known), *more, *(row[some] for row in own))

    in_blocks(block, out.shape[-1], BLOCK)
    return out


def bearing_share(u: ArrayLike, h_max: ArrayLike | None = None) -> tuple[FloatArray, FloatArray]:
    """Q(u), share of Gaussian heights above the level of mean gap u [h_rms], and dQ/du; with `h_max` it ends there."""
    known, shape = rows(u, np.inf if h_max is None else h_max)
    share, slope = filled(core.bearing_share, known, np.empty_like(known))
    return share.reshape(shape), slope.reshape(shape)


def _levels(u: FloatArray) -> FloatArray:
    """Levels of Gaussian heights at mean gaps [h_rms]."""
    known, shape = rows(u)
    return filled(core.gaussian_level, known, np.empty(known.shape[1])).reshape(shape)


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
        level, own = _levels(gap[kept][::-1]), -ndtri(share[kept][::-1])
        self._deepest = float(level[0]) - DEPTH
        self._level = PchipInterpolator(np.append(self._deepest, level), np.append(own[0] - DEPTH, own))
        self._rate = self._level.derivative()

    def __call__(self, u: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Q and dQ/du at mean gaps [h_rms]; straight to zero at the highest point above the first share."""
        gap = np.asarray(u, float)
        d = np.maximum(_levels(np.clip(gap, 0.0, self._top)), self._deepest)
        own = self._level(d)
        share, slope = ndtr(-own), -np.exp(-own * own / 2) / np.sqrt(2 * np.pi) * self._rate(d) / ndtr(d)
        steep = -self._lightest / (self._h_max - self._top)
        light, rest = gap > self._top, np.maximum(self._h_max - gap, 0.0)
        return np.where(light, -steep * rest, share), np.where(light, np.where(rest > 0, steep, 0.0), slope)
