"""Derivatives of a theory's force and area with respect to the gap and the surface's parameters.

Where a theory has none in closed form they are finite differences with steps inside the range of contact; an error is
raised if their estimated error is too large. With a hardness, the elastic derivatives enter its law by the chain rule.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.self_affine import PARAMETERS
from mbma_tables.surfaces.spectrum import MAX_ZETA_1, MIN_ZETA_1
from mbma_tables.theories.differences import differences
from mbma_tables.theories.protocol import Theory, TheoryAnswer

STEP = 0.02  # relative step of a parameter, or of its distance to a limit
RTOL = 1e-6  # tolerance relative to the derivative, or to quantity/parameter
GAP, MODULUS = "mean_separation", "E_star"
KINDS = ("pressure", "area")

Answers = tuple[FloatArray, FloatArray]  # force and area
Slopes = tuple[dict[str, FloatArray], ...]  # slopes of force and of area, by names


def differentiate(
    theory: Theory, surface: AnySurface, mean_separation: FloatArray, lighter: FloatArray | None = None
) -> Slopes:
    """Derivatives of F/(A0 E*) and A/A0 by "separation" d and each of the surface's parameters, the others held.

    With a hardness, which is held, also by the logarithm of "E_star"; `lighter` is that of `Yielding.loaded`.

    Raises ConvergenceError where differences do not converge: at kinks of a theory, or where force is unbounded.
    """
    u = np.asarray(mean_separation, dtype=float)
    known = theory.slopes(surface, u)
    if known is None and theory is not theory.elastic:
        known = _yielding(theory, surface, u, lighter)
    slopes = _elastic(theory, surface, u) if known is None else known
    for found in slopes:
        # d = 2 u - h_max is held, not u
        by_gap = found.pop(GAP)
        found["separation"] = by_gap / 2
        if "h_max" in found:
            found["h_max"] = found["h_max"] + by_gap / 2
    return slopes


def _elastic(theory: Theory, surface: AnySurface, u: FloatArray) -> Slopes:
    known = theory.slopes(surface, u)
    if known is not None:
        return known
    whole, names = theory.answer(surface, u), (GAP, *surface.parameters)

    def answer(moved: AnySurface, own: Mapping[str, FloatArray], entry: tuple[Any, Any], x: FloatArray) -> Answers:
        found = theory.answer(moved, own[GAP])
        return found.pressure, found.area

    return _numerical(theory, surface, u, names, whole, answer)


@np.errstate(all="ignore")
def _yielding(capped: Any, surface: AnySurface, u: FloatArray, lighter: FloatArray | None) -> Slopes:
    # imports scipy: needed for a hardness only
    from mbma_tables.laws import hardness as law

    elastic, names = capped.elastic, (GAP, *surface.parameters, MODULUS)
    if lighter is None and not capped.knows_areas:
        lighter = capped.lighter(surface, u)
    whole = capped.loaded(surface, u, lighter)
    shape = np.shape(whole.answer.pressure)
    gaps = np.stack([np.broadcast_to(gap, shape) for gap in (u, lighter) if gap is not None])
    # by gap, name and flat place
    pressure, area = (
        np.array([np.broadcast_to(slopes.get(name, 0.0), gaps.shape).reshape(len(gaps), -1) for name in names])
        for slopes in _elastic(elastic, surface, gaps)
    )
    at_force, rise = np.broadcast_to(whole.elastic_area, shape).ravel(), np.zeros(0)
    if lighter is not None:
        # slopes of the area at given force: by the force, and by parameters
        rise = np.nan_to_num(area[0, 1] / pressure[0, 1])
        tilt = area[:, 1] - pressure[:, 1] * rise

    def answer(moved: AnySurface, own: Mapping[str, FloatArray], entry: tuple[Any, Any], x: FloatArray) -> Answers:
        name, place = entry
        known = zip(whole.elastic[:2], (pressure, area), strict=True)
        force, share = (np.ravel(part)[place] + slope[name, 0, place] * x for part, slope in known)
        hardness = np.broadcast_to(capped.hardness, shape).ravel()[place] / own[MODULUS]
        sizes = np.asarray(moved.h_rms), np.asarray(moved.rms_gradient)
        eta, endless = hardness / sizes[1], np.isinf(hardness)
        load, _ = law.closed(elastic.heights(moved), *sizes, eta, own[GAP], force, np.zeros_like(force))
        if lighter is None:
            at = elastic.area_at(moved, load)
        else:
            at = at_force[place] + tilt[name, place] * x + rise[place] * (load - np.ravel(whole.answer.pressure)[place])
        return np.where(endless, force, load), np.where(endless, share, law.area(load / sizes[1], at, eta))

    return _numerical(capped, surface, u, names, whole.answer, answer)


def _numerical(
    theory: Theory,
    surface: AnySurface,
    u: FloatArray,
    names: tuple[str, ...],
    whole: TheoryAnswer,
    answer: Callable[..., Answers],
) -> Slopes:
    """Differences of ``answer(moved, own, (name, place), x)``: surfaces, their numbers, the parameter changed by x."""
    shape = np.shape(whole.pressure)
    at = {name: getattr(surface, name) for name in (*PARAMETERS[1:], *surface.parameters)} | {GAP: u, MODULUS: 1.0}
    at = {name: np.broadcast_to(np.asarray(value, dtype=float), shape).ravel() for name, value in at.items()}
    size, values = at[GAP].size, np.stack([np.ravel(getattr(whole, kind)) for kind in KINDS])
    step, side = np.swapaxes([_steps(theory, at, name) for name in names], 0, 1).reshape(2, -1)
    centre = np.concatenate([at[name] for name in names])
    scale = np.abs(np.tile(values, len(names)) / np.where(centre == 0, 1.0, centre))

    def moved(k: Any, x: FloatArray) -> FloatArray:
        number, place = np.divmod(k, size)
        own = {name: value[place] for name, value in at.items()}
        for j, name in enumerate(names):
            own[name] = own[name] + np.where(number == j, x, 0.0)
        others = surface.with_numbers(*(own[name] for name in surface.parameters))
        return np.stack(answer(others, own, (number, place), x))

    with np.errstate(all="ignore"):
        slopes, error = (each.reshape(2, len(names), *shape) for each in differences(moved, step, side, scale))
        missed = ~(error <= RTOL * np.maximum(np.abs(slopes), scale.reshape(slopes.shape)))
    for kind, name in zip(*np.nonzero(missed.reshape(2, len(names), -1).any(axis=-1)), strict=True):
        text = f"theory {theory.name!r}: no derivative of {KINDS[kind]} by {names[name]} was found"
        raise ConvergenceError(text, missed[kind, name])
    return tuple(dict(zip(names, rows, strict=True)) for rows in slopes)


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


def at_fixed(held: str, by: str, slopes: dict[str, Any], by_modulus: dict[str, Any]) -> dict[str, Any]:
    """Derivatives at fixed pressure or area: of the separation, and of the other quantity."""
    other = "area" if held == "pressure" else "pressure"
    steep, follows = slopes[held]["separation"], slopes[other]["separation"]
    names = [name for name in slopes[held] if name != "separation"]
    gap = {by: 1 / steep} | {name: -slopes[held][name] / steep for name in names}
    free = {by: follows / steep} | {name: slopes[other][name] + follows * gap[name] for name in names}
    if held == "pressure":
        gap["E_star"] = -by_modulus["pressure"] / steep
        free["E_star"] = by_modulus["area"] + follows * gap["E_star"]
    return {"separation_by": gap, f"{other}_by": free, f"{held}_by": None}
