"""The attraction of one surface over its mean gap, by polynomials between knots of it.

A mean over gaps takes a hundred times as long as the elastic contact. It is smooth in the mean gap but
for the end of contact, and is kept here as ln of it, piece by piece as pieces are asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.shared import kept_with
from mbma_tables.surfaces.any_surface import AnySurface

Mean = Callable[[FloatArray], FloatArray]
NODES = 12  # of a piece
RTOL = 1e-9  # error of a piece between its nodes, above which it has no polynomial
MOST_KEPT = 64  # ranges of one surface
# ends of pieces over h_rms: by decades where gaps are small, by steps where the attraction
# falls as exp(-u/range)
KNOTS = np.concatenate([np.geomspace(1e-10, 0.1, 37), np.arange(0.2, 12.05, 0.1)])
BEYOND = 8  # pieces from there on

_POINTS = chebyshev.chebpts1(NODES)
_ORDERS = np.arange(1.0, NODES)[:, None]
_BETWEEN = np.linspace(-0.98, 0.98, 7)
# values at the points to coefficients of powers, and those to values between
_TO_POWERS = np.linalg.inv(np.vander(_POINTS, NODES, increasing=True))
_TO_VALUES = np.vander(_BETWEEN, NODES, increasing=True)


class AttractionCurve:
    """ln of a mean over the gaps of one surface, and its derivative, at mean gaps.

    Parameters
    ----------
    knots : ndarray
        Rising mean gaps [length], between which it is smooth.
    """

    def __init__(self, knots: FloatArray) -> None:
        self.knots = knots
        self.log_knots = np.log(knots)
        pieces = len(knots) - 1
        self._powers = np.full((NODES, pieces), np.nan)
        self._is_made = np.zeros(pieces, bool)
        self._at_knots: tuple[FloatArray, FloatArray] | None = None

    def at_knots(
        self, find: Callable[[FloatArray], tuple[FloatArray, FloatArray]]
    ) -> tuple[FloatArray, FloatArray]:
        """What is found at the knots, once."""
        if self._at_knots is None:
            self._at_knots = find(self.knots)
        return self._at_knots

    def values(self, u: FloatArray, direct: Mean) -> tuple[FloatArray, FloatArray]:
        """The mean, and its derivative by u [1/length]; NaN where there is no polynomial.

        `direct` is the mean itself at an array of gaps. It is no part of the curve, which would keep
        its surface alive by it.
        """
        flat = u.ravel()
        inside = (flat >= self.knots[0]) & (flat <= self.knots[-1])
        piece = np.searchsorted(self.knots[1:-1], flat, side="right")
        missing = inside & ~self._is_made[piece]
        if missing.any():
            self._make(np.unique(piece[missing]), direct)
        low, high = self.knots[piece], self.knots[piece + 1]
        half = (high - low) / 2
        x = (flat - low) / half - 1
        x_to = np.empty((NODES, x.size))
        x_to[0] = 1
        x_to[1:] = x
        np.multiply.accumulate(x_to, out=x_to)
        powers = self._powers.take(piece, axis=1)
        value = (powers * x_to).sum(axis=0)
        slope = (_ORDERS * powers[1:] * x_to[:-1]).sum(axis=0)
        mean = np.where(inside, np.exp(value), np.nan)
        return mean.reshape(u.shape), (mean * slope / half).reshape(u.shape)

    def _make(self, pieces: Any, direct: Mean) -> None:
        """Polynomials of pieces, all at once."""
        low, high = self.knots[pieces, None], self.knots[pieces + 1, None]
        x = np.concatenate([_POINTS, _BETWEEN])
        with np.errstate(divide="ignore", invalid="ignore"):
            value = np.log(direct(low + (high - low) * (1 + x) / 2))
            powers = value[:, :NODES] @ _TO_POWERS.T
            missed = np.abs(powers @ _TO_VALUES.T - value[:, NODES:]).max(axis=1)
        powers[~(missed < RTOL)] = np.nan
        self._powers[:, pieces] = powers.T
        # in this order, since other threads read it
        self._is_made[pieces] = True


def knots_of(low: float, high: float, h_rms: float, h_max: float) -> FloatArray:
    """Ends of pieces between mean gaps [length], also at the end of contact."""
    far = np.geomspace(KNOTS[-1], max(high / h_rms, KNOTS[-1]), BEYOND + 1)[1:]
    every = h_rms * np.concatenate([KNOTS, far])
    ends = np.array([low, h_max, high] if low < h_max < high else [low, high])
    # no pieces that are rounding
    inside = (
        (every > low)
        & (every < high)
        & ~np.isclose(every[:, None], ends, 1e-9, 0).any(axis=1)
    )
    return np.sort(np.concatenate([every[inside], ends]))


@kept_with
def _curves_of(surface: AnySurface) -> dict[Any, AttractionCurve]:
    return {}


def kept_curve(
    surface: AnySurface, key: Any, make: Callable[[], AttractionCurve]
) -> AttractionCurve:
    """The curve of a surface and a key, made once while the surface lives."""
    own = _curves_of(surface)
    if key not in own:
        if len(own) >= MOST_KEPT:
            own.clear()
        own[key] = make()
    return own[key]
