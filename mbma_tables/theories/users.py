"""Theories of users, and results of a theory where they are finite."""

from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError, OutOfRangeError
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.base import (
    Theory,
    TheoryAnswer,
    UserTheory,
    select,
)
from mbma_tables.theories.inversion import FEW_LOOKS, Curve

# methods and attributes of `Theory` that a user's object may have
OF_USERS = (
    "interval",
    "ends_at_h_max",
    "bends",
    "departures",
    "reasons",
    "scatter",
    "advice",
    "rtol",
)
ENOUGH = 2e-8  # relative error of stiffnesses


def answer_where_finite(
    theory: Theory, surface: AnySurface, mean_separation: FloatArray
) -> TheoryAnswer:
    """A theory's results at mean separations u, shape (n,), on one surface; NaN where the force is not finite."""
    u = np.asarray(mean_separation, dtype=float)
    places = np.arange(u.size)
    fields = np.full((4, u.size), np.nan)
    while places.size:
        try:
            with np.errstate(all="ignore"):
                found = theory.answer(surface, u[places])
        except OutOfRangeError as fault:
            if (
                fault.mask is None
                or np.shape(fault.mask) != places.shape
                or not np.any(fault.mask)
            ):
                raise
            places = places[~np.asarray(fault.mask)]
        else:
            fields[:, places] = np.where(np.isfinite(found.pressure), found, np.nan)
            break
    return TheoryAnswer(*fields)


class Wrapped(Theory):
    """A user's theory, its stiffness by numerical differentiation.

    What the user's object has beside its answer stands in place of the defaults.
    """

    looks = FEW_LOOKS  # each may take long

    def __init__(self, theory: UserTheory) -> None:
        self.name = theory.name
        self._theory = theory
        for name in OF_USERS:
            if hasattr(theory, name):
                vars(self)[name] = getattr(theory, name)

    def __getstate__(self) -> dict[str, Any]:
        return {"_theory": self._theory}

    def __setstate__(self, state: dict[str, Any]) -> None:
        Wrapped.__init__(self, state["_theory"])

    def departures(self, surface: AnySurface) -> tuple[str, ...]:
        """None: its author is responsible."""
        return ()

    def reasons(
        self,
        surface: AnySurface,
        answer: TheoryAnswer,
        mean_separation: FloatArray,
    ) -> dict[str, Any]:
        """None: its author is responsible."""
        return {}

    @np.errstate(all="ignore")
    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness at mean separations u [length]; the error is not known."""
        from scipy.differentiate import derivative

        u = np.asarray(mean_separation, dtype=float)
        pressure, area = self._forces_and_areas(surface, u)

        def force(x: FloatArray, place: FloatArray) -> FloatArray:
            return self._forces_and_areas(select(surface, u.shape, place), x)[0]

        place = np.arange(float(u.size)).reshape(u.shape)
        step = 0.01 * np.asarray(surface.h_rms)
        known = {"order": 4, "initial_step": step, "tolerances": {"rtol": ENOUGH}}
        slope = derivative(force, u, args=(place,), **known).df
        return TheoryAnswer(pressure, area, -slope, np.full(u.shape, np.nan))

    def _forces_and_areas(
        self, surface: AnySurface, u: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Copies of what the user's theory answers, in the shape of u."""
        answer = self._theory.answer(surface, u)
        try:
            pressure, area = (
                np.array(np.broadcast_to(part, u.shape), dtype=float) for part in answer
            )
        except (TypeError, ValueError) as fault:
            raise InputError(
                f"theory {self.name!r} must answer F/(A0 E*) and A/A0, arrays of the shape "
                f"of u, {u.shape}: {fault}"
            ) from None
        return pressure, area

    def curve(self, surface: AnySurface, quantity: str) -> Curve:

        def values(u: FloatArray) -> tuple[Any, Any, bool]:
            value = self._forces_and_areas(surface, u)[int(quantity == "area")]
            return value, np.full(u.shape, np.nan), False

        return values
