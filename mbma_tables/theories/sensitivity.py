"""Derivatives of a theory's force and area in the gap and in the surface's parameters, by numerical differentiation.

Richardson extrapolation of central differences (one-sided where a parameter ends) in steps that keep clear of the
ends of contact; every result carries an estimate of its own error, which decides whether it is given out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import ConvergenceError
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.spectrum import MAX_ZETA_1, MIN_ZETA_1
from mbma_tables.surfaces.surface import PARAMETERS

if TYPE_CHECKING:
    from mbma_tables.theories.protocol import Theory

STEP = 0.02  # of a parameter, or of the room that it has
RTOL = 1e-6  # of a derivative that is given out, or of the quantity over the parameter
GAP, MODULUS = "mean_separation", "E_star"
KINDS = ("force", "area")


def differentiate(
    theory: Theory, surface: AnySurface, mean_separation: FloatArray
) -> tuple[dict[str, FloatArray], ...]:
    """Derivatives of F/(A0 E*) and A/A0 by "separation" d and each of the surface's parameters, the others held.

    With a hardness, which is held, also by the logarithm of "E_star".

    Where differences do not settle, at corners of a theory or where force has no bound, it is a ConvergenceError.
    """
    shape = np.broadcast_shapes(np.shape(mean_separation), surface.shape)
    names = (GAP, *surface.parameters, *(() if theory is theory.elastic else (MODULUS,)))
    at = {name: np.broadcast_to(np.asarray(getattr(surface, name), float), shape) for name in PARAMETERS[1:]}
    at |= {name: np.broadcast_to(np.asarray(getattr(surface, name), float), shape) for name in surface.parameters}
    at |= {GAP: np.broadcast_to(np.asarray(mean_separation, float), shape), MODULUS: np.ones(shape)}
    whole = theory.answer(surface, at[GAP])
    slopes: tuple[dict[str, FloatArray], ...] = ({}, {})
    for kind, found in zip(KINDS, slopes, strict=True):
        for name in names:
            found[name] = _derivative(theory, surface, at, name, kind, getattr(whole, kind))
        # d = 2 u - h_max is held, not u
        by_gap = found.pop(GAP)
        found["separation"] = by_gap / 2
        if "h_max" in found:
            found["h_max"] = found["h_max"] + by_gap / 2
    return slopes


def _derivative(
    theory: Theory, surface: AnySurface, at: dict[str, FloatArray], name: str, kind: str, value: FloatArray
) -> FloatArray:
    """Derivative by one parameter, the others and u held."""
    from scipy.differentiate import derivative

    centre = at[name]
    places = np.arange(value.size, dtype=float).reshape(value.shape)
    step, direction = _steps(theory, at, name)

    def moved(x: FloatArray, place: FloatArray) -> FloatArray:
        flat = place.astype(np.intp)
        own = {other: numbers.ravel()[flat] for other, numbers in at.items()} | {name: x}
        return np.asarray(
            getattr(
                theory.at(value.shape, place)
                .stiffer(own[MODULUS])
                .answer(surface.with_numbers(*(own[p] for p in surface.parameters)), own[GAP]),
                kind,
            )
        )

    with np.errstate(all="ignore"):
        found = derivative(
            moved,
            centre,
            args=(places,),
            initial_step=step,
            step_direction=direction,
            tolerances={"rtol": RTOL * STEP, "atol": RTOL * STEP * float(np.nanmin(_scale(value, centre)))},
        )
        missed = ~(found.error <= RTOL * np.maximum(np.abs(found.df), _scale(value, centre)))
    if missed.any():
        raise ConvergenceError(f"theory {theory.name!r}: no derivative of {kind} by {name} was found", missed)
    return np.asarray(found.df)


def _scale(value: FloatArray, centre: FloatArray) -> FloatArray:
    return np.abs(value / np.where(centre == 0, 1.0, centre))


def _steps(theory: Theory, at: dict[str, FloatArray], name: str) -> tuple[FloatArray, FloatArray]:
    """First steps, and on which side of a parameter to step: 0 for both."""
    centre = at[name]
    room = np.abs(centre)
    side: FloatArray = np.zeros(centre.shape)
    if name == GAP:
        room = np.where(centre > 0, centre, at["h_rms"])
    if name in (GAP, "h_max") and theory.ends_at_h_max:
        beyond = np.abs(at["h_max"] - at[GAP])
        room = np.where(beyond > 0, np.minimum(room, beyond), room)
        # at first contact only what lies below it has a derivative
        side = np.where(beyond == 0, -1.0 if name == GAP else 1.0, side)
    step = STEP * room
    if name == "hurst":
        side = np.where(centre + step > 1, -1.0, side)
    ratio = at["q1"] / at["q0"]
    if name in ("q0", "q1"):
        up = 1.0 if name == "q1" else -1.0
        side = np.where(ratio * (1 - STEP) <= MIN_ZETA_1, up, np.where(ratio > MAX_ZETA_1 * (1 - STEP), -up, side))
    return step, side
