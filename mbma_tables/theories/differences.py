"""Numerical derivatives of many entries at once, each with an estimate of its own error.

Differences of fourth order at two steps, extrapolated, or one-sided ones of sixth order; steps are halved where these
do not agree.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray

ENOUGH = 2e-8  # relative, of derivatives or of their scale
HALVINGS = 10  # of the step, at most
INTEGRAL_RTOL = 1e-9
LEAST_LEVEL = 4  # of the rule for energies, whose error estimate may be too small by chance on coarse intervals

# places over the step, and weights of the derivative: in their middle, and at the first of them
CENTRAL: tuple[Any, Any] = np.array([-1.0, -0.5, 0.5, 1.0]), np.array([1.0, -8.0, 8.0, -1.0]) / 6
_SIDE = (1 - np.cos(np.linspace(0, np.pi, 7))) / 2
ONE_SIDED: tuple[Any, Any] = _SIDE, np.linalg.solve(np.vander(_SIDE, increasing=True).T, np.eye(7)[1])


@np.errstate(all="ignore")
def differences(
    function: Callable[[Any, FloatArray], FloatArray],
    step: FloatArray,
    side: FloatArray,
    scale: FloatArray,
    halvings: int = HALVINGS,
    enough: float = ENOUGH,
) -> tuple[FloatArray, FloatArray]:
    """Derivatives at 0, shape (kinds, entries), and estimates of their errors.

    ``function(k, x)`` has kinds as rows, of entries `k` at x. `side` is 0, or the side of the steps; `scale` a size of
    derivatives; steps are halved at most `halvings` times, until errors relative to the larger of both are `enough`.
    """
    found, error = np.zeros(scale.shape), np.full(scale.shape, np.inf)
    for (places, weights), apart in ((CENTRAL, 0), (ONE_SIDED, 1)):
        left, widths = np.flatnonzero(np.abs(side) == apart), 2.0 ** -np.arange(2.0)
        coarse = np.empty((len(scale), 0))
        while left.size and widths[-1] >= 2.0**-halvings:
            h = np.where(apart, side, 1.0)[left] * step[left] * widths[:, None, None]
            x = places[:, None] * h
            values = function(np.broadcast_to(left, x.shape).ravel(), x.ravel()).reshape(-1, *x.shape)
            slopes = np.swapaxes(weights @ values, 0, 1) / h
            # of two steps at first, of one more later
            coarse, fine = slopes if widths.size > 1 else (coarse, slopes[0])
            best = fine if apart else fine + (fine - coarse) / 15
            miss = np.abs(best - (coarse if apart else fine))
            better = ~(miss >= error[:, left])
            found[:, left] = np.where(better, best, found[:, left])
            error[:, left] = np.where(better, miss, error[:, left])
            rough = ~(miss <= enough * np.maximum(np.abs(best), scale[:, left])).all(axis=0)
            coarse, left, widths = fine[:, rough], left[rough], widths[-1:] / 2
    return found, error


def integral(function: Callable[..., Any], edges: FloatArray) -> tuple[FloatArray, Any]:
    """Integrals of function(x, place) between rows of edges, shape (m, ...), and a mask of those that failed.

    A place is the flat number of an entry, as a float.
    """
    from scipy.integrate import tanhsinh

    place = np.arange(float(edges[0].size)).reshape(edges[0].shape)
    found = tanhsinh(function, edges[:-1], edges[1:], args=(place,), rtol=INTEGRAL_RTOL, minlevel=LEAST_LEVEL)
    return np.asarray(found.integral.sum(axis=0)), ~found.success.all(axis=0)
