"""Numerical derivatives, theories of users, and results of a theory where they are finite."""

from collections.abc import Callable
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.protocol import FEW_LOOKS, Curve, Theory, TheoryAnswer, UserTheory, select

ENOUGH = 2e-8  # relative, of derivatives or of their scale
HALVINGS = 10  # largest number of halvings of the step

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
) -> tuple[FloatArray, FloatArray]:
    """Derivatives at 0, shape (kinds, entries), and estimates of their errors.

    Differences of fourth order at two steps, extrapolated, or one-sided ones of sixth order.

    ``function(k, x)`` has kinds as rows, of entries `k` at x. `side` is 0, or the side of the steps; `scale` a size of
    derivatives; steps are halved at most `halvings` times, until errors relative to the larger of both are `ENOUGH`.
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
            # for two steps at first, then for one more
            coarse, fine = slopes if widths.size > 1 else (coarse, slopes[0])
            best = fine if apart else fine + (fine - coarse) / 15
            miss = np.abs(best - (coarse if apart else fine))
            better = ~(miss >= error[:, left])
            found[:, left] = np.where(better, best, found[:, left])
            error[:, left] = np.where(better, miss, error[:, left])
            rough = ~(miss <= ENOUGH * np.maximum(np.abs(best), scale[:, left])).all(axis=0)
            coarse, left, widths = fine[:, rough], left[rough], widths[-1:] / 2
    return found, error


def answer_where_finite(theory: Theory, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
    """A theory's results at mean separations u, shape (n,), on one surface; NaN where the force is not finite."""
    u = np.asarray(mean_separation, dtype=float)
    places = np.arange(u.size)
    fields = np.full((4, u.size), np.nan)
    while places.size:
        try:
            with np.errstate(all="ignore"):
                found = theory.answer(surface, u[places])
        except OutOfRangeError as fault:
            if fault.mask is None or np.shape(fault.mask) != places.shape or not np.any(fault.mask):
                raise
            places = places[~np.asarray(fault.mask)]
        else:
            fields[:, places] = np.where(np.isfinite(found.pressure), found, np.nan)
            break
    return TheoryAnswer(*fields)


class Wrapped(Theory):
    """A user's theory, its stiffness by numerical differentiation."""

    looks = FEW_LOOKS  # each may take long

    def departures(self, surface: AnySurface) -> tuple[str, ...]:
        """None: its author is responsible."""
        return ()

    def __init__(self, theory: UserTheory) -> None:
        self.name = theory.name
        self._theory = theory

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness at mean separations u [length]; the error is not known."""
        u = np.asarray(mean_separation, dtype=float)
        found = self._theory.answer(surface, u)
        pressure, area = (np.array(np.broadcast_to(part, u.shape), dtype=float) for part in found)

        def force_at(k: Any, x: FloatArray) -> FloatArray:
            return np.asarray(self._theory.answer(select(surface, u.shape, k), u.ravel()[k] + x)[0], dtype=float)[None]

        step = 0.01 * np.broadcast_to(np.asarray(surface.h_rms), u.shape).ravel()
        slope, _ = differences(force_at, step, np.zeros(u.size), np.zeros((1, u.size)))
        return TheoryAnswer(pressure, area, -slope[0].reshape(u.shape), np.full(u.shape, np.nan))

    def curve(self, surface: AnySurface, quantity: str) -> Curve:

        def values(u: FloatArray) -> tuple[Any, Any, bool]:
            found = np.asarray(self._theory.answer(surface, u)[int(quantity == "area")], dtype=float)
            return np.broadcast_to(found, u.shape), np.full(u.shape, np.nan), False

        return values
