"""Derivatives of elastic theories by the gap and the surface's parameters: differences with steps inside of contact."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.self_affine import PARAMETERS
from mbma_tables.surfaces.spectrum import MAX_ZETA_1, MIN_ZETA_1
from mbma_tables.theories.numerical import differences
from mbma_tables.theories.protocol import Theory

STEP = 0.02  # relative step of a parameter, or of its distance to a limit
RTOL = 1e-6  # tolerance relative to the derivative, or to quantity/parameter
GAP = "mean_separation"
KINDS = ("pressure", "area")


def differentiate(theory: Theory, surface: AnySurface, mean_separation: FloatArray) -> list[dict[str, FloatArray]]:
    """Derivatives of F/(A0 E*), and of A/A0, by "separation" d and each of the surface's parameters, the others held.

    Raises ConvergenceError where differences do not converge: at kinks of a theory, or where force is unbounded.
    """
    whole, names = theory.answer(surface, mean_separation), (GAP, *surface.parameters)
    shape = np.shape(whole.pressure)
    at = {name: getattr(surface, name) for name in (*PARAMETERS[1:], *surface.parameters)} | {GAP: mean_separation}
    at = {name: np.broadcast_to(np.asarray(value, dtype=float), shape).ravel() for name, value in at.items()}
    size, values = at[GAP].size, np.stack([np.ravel(getattr(whole, kind)) for kind in KINDS])
    step, side = np.swapaxes([_steps(theory, at, name) for name in names], 0, 1).reshape(2, -1)
    centre = np.concatenate([at[name] for name in names])
    scale = np.abs(np.tile(values, len(names)) / np.where(centre == 0, 1.0, centre))

    def moved(k: Any, x: FloatArray) -> FloatArray:
        number, place = np.divmod(k, size)
        own = {name: at[name][place] + np.where(number == j, x, 0.0) for j, name in enumerate(names)}
        found = theory.answer(surface.with_numbers(*(own[name] for name in surface.parameters)), own[GAP])
        return np.stack([found.pressure, found.area])

    with np.errstate(all="ignore"):
        slopes, error = (each.reshape(2, len(names), *shape) for each in differences(moved, step, side, scale))
        missed = ~(error <= RTOL * np.maximum(np.abs(slopes), scale.reshape(slopes.shape)))
    for kind, name in zip(*np.nonzero(missed.reshape(2, len(names), -1).any(axis=-1)), strict=True):
        text = f"theory {theory.name!r}: no derivative of {KINDS[kind]} by {names[name]} was found"
        raise ConvergenceError(text, missed[kind, name])
    made = [dict(zip(names, rows, strict=True)) for rows in slopes]
    for found in made:
        # d = 2 u - h_max is held, not u
        found["separation"] = found.pop(GAP) / 2
        if "h_max" in found:
            found["h_max"] = found["h_max"] + found["separation"]
    return made


def _steps(theory: Theory, at: Mapping[str, FloatArray], name: str) -> tuple[FloatArray, FloatArray]:
    """Initial steps, and the side of a parameter on which to step: 0 for both."""
    centre = at[name]
    room = np.abs(centre)
    side: FloatArray = np.zeros(centre.shape)
    if name == GAP:
        # no gap is negative
        room, side = np.where(centre > 0, centre, at["h_rms"]), np.where(centre > 0, 0.0, 1.0)
    if name in (GAP, "h_max") and theory.ends_at_h_max:
        beyond = np.abs(at["h_max"] - at[GAP])
        room = np.where(beyond > 0, np.minimum(room, beyond), room)
        # at first contact only one-sided derivatives exist, from smaller gaps
        side = np.where(beyond == 0, -1.0 if name == GAP else 1.0, side)
    step = STEP * room
    if name == "hurst":
        side = np.where(centre + step > 1, -1.0, side)
    ratio = at["q1"] / at["q0"]
    if name in ("q0", "q1"):
        up = 1.0 if name == "q1" else -1.0
        side = np.where(ratio * (1 - STEP) <= MIN_ZETA_1, up, np.where(ratio > MAX_ZETA_1 * (1 - STEP), -up, side))
    return step, side


def at_fixed(held: str, by: str, slopes: dict[str, Any], by_modulus: Any) -> dict[str, Any]:
    """Derivatives at fixed pressure or area: of the separation, and of the other quantity."""
    other = "area" if held == "pressure" else "pressure"
    steep, follows = slopes[held]["separation"], slopes[other]["separation"]
    names = [name for name in slopes[held] if name != "separation"]
    gap = {by: 1 / steep} | {name: -slopes[held][name] / steep for name in names}
    free = {by: follows / steep} | {name: slopes[other][name] + follows * gap[name] for name in names}
    if held == "pressure":
        gap["E_star"] = -by_modulus / steep
        free["E_star"] = follows * gap["E_star"]
    return {"separation_by": gap, f"{other}_by": free, f"{held}_by": None}
