"""Theories of users, and results of a theory where they are finite."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.differences import differences
from mbma_tables.theories.protocol import FEW_LOOKS, Curve, Theory, TheoryAnswer, UserTheory, select


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

    def looks(self, surface: AnySurface) -> int:
        """Few, since each evaluation may take long."""
        return FEW_LOOKS

    def curve(self, surface: AnySurface, quantity: str) -> Curve:
        """Force or area alone."""

        def values(u: FloatArray) -> tuple[Any, Any, bool]:
            found = np.asarray(self._theory.answer(surface, u)[int(quantity == "area")], dtype=float)
            return np.broadcast_to(found, u.shape), np.full(u.shape, np.nan), False

        return values
