"""Total force and area of a surface at a gap: the sum over its contact islands (Eqs. 44-50).

Everything of an island depends on its approach delta alone; the gap enters through the Gaussian weight and
the upper limit h_max - d. In units of s and 1/q0,

    F/(A0 E* q0 s) = integral_0^((h_max - d)/s) F_hat D_d K1 G d(delta/s),
    G = exp(-z'^2/2 sigma_d^2)/(sqrt(2 pi) sigma_d),   z' = (d + delta)/s - h_d (41),

and A/A0 likewise.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import FloatArray, broadcast_shape, finite_array, require
from mbma_tables.errors import ConvergenceError, InputError, OutOfRangeError
from mbma_tables.models import get_model
from mbma_tables.models.protocol import AREA, BOTH, FORCE, OUTSIDE, QUANTITIES
from mbma_tables.models.universal import UniversalModel
from mbma_tables.surfaces.readings import Reading, get_reading
from mbma_tables.surfaces.surface import Surface
from mbma_tables.totals.island_sum import sum_islands
from mbma_tables.totals.pairs import Pairs
from mbma_tables.totals.universal_sum import look_up, look_up_slopes

MANY_GAPS = 4096  # on one surface: about what making a law costs
FROZEN_RTOL = 2e-9


@dataclasses.dataclass(frozen=True, eq=False)
class Contact:
    """Force and area at given separations; arrays of the broadcast shape.

    Attributes
    ----------
    separation : ndarray
        d, between the rigid plane and the mid-plane [length].
    mean_separation : ndarray
        u = (h_max + d)/2 (50) [length].
    force : ndarray or None
        F/A0 in the unit of E_star; F/(A0 E*) where that is 1. None where not asked for.
    area : ndarray or None
        A/A0, None where not asked for. The model does not end at 1 under full compression, and this is not clamped.
    error : ndarray
        Bound on the relative error of both against the model that the tier stands for, of quadrature and islands
        together. For tier "rigid" that model is the undeformed sphere, which may be far from the elastic one.
    reading, tier : str
        What made them.
    islands : int or None
        Islands evaluated; None where that is left to dask or to a law.
    force_by, area_by : dict of ndarray, or None
        Partial derivatives by "separation", "hurst", "q0", "q1", "h_rms" and "h_max", the others held.
    """

    separation: Any
    mean_separation: Any
    force: Any
    area: Any
    error: Any
    reading: str
    tier: str
    islands: int | None
    force_by: dict[str, Any] | None = None
    area_by: dict[str, Any] | None = None


def contact(
    surface: Surface,
    separation: ArrayLike,
    tier: str = "universal",
    reading: str | Reading = "reported",
    E_star: ArrayLike = 1.0,
    rtol: float = 1e-8,
    outside: str = "raise",
    derivatives: bool = False,
    quantities: Iterable[str] = QUANTITIES,
) -> Contact:
    """Force and real contact area of a surface at given separations (Eqs. 48, 49).

    Parameters
    ----------
    surface : Surface
        One surface or a batch; it broadcasts against `separation`.
    separation : array_like
        d between the rigid plane and the mid-plane [length], at least -h_max (full compression). From h_max
        on there is no contact, and force and area are zero.
    tier : {"universal", "island4d", "exact", "formula", "rigid"}
        The island model: a table, the full solver, or spheres that do not deform, in closed form.
    reading : {"reported", "printed"} or Reading
        Which reading of the paper's equations.
    E_star : array_like
        Effective modulus, (1 - nu1^2)/E1 + (1 - nu2^2)/E2 inverted; force is in its unit.
    rtol : float
        Relative error asked of force and area, in [1e-11, 0.1]. A table adds its own error; `error` holds both.
    outside : {"raise", "exact", "nan"}
        For surfaces with islands outside the table: an error, the exact solver, or NaN.
    derivatives : bool
        Whether `force_by` and `area_by` are asked for (tier "universal").
    quantities : iterable of {"force", "area"}
        What is wanted. One alone costs less; the other is then None, and `error` is of the one.

    Returns
    -------
    Contact

    Raises
    ------
    InputError, OutOfRangeError
        For NaN, infinite or empty input, separations below -h_max, islands that no table covers.
    ConvergenceError
        Where the accuracy was not reached; its `mask` says which entries.
    """
    wanted = _wanted(quantities)
    if surface.labelled or hasattr(separation, "dims") or hasattr(E_star, "dims"):
        # xarray comes in with its own objects
        from mbma_tables.totals.labelled import contact_of_labelled

        # of all gaps: answers do not depend on how they are cut into blocks
        many = bool(getattr(separation, "size", 1) >= MANY_GAPS)

        def answer(block: Surface, gaps: Any, modulus: Any) -> Contact:
            return _contact(block, gaps, tier, reading, modulus, rtol, outside, derivatives, wanted, many)

        fields = contact_of_labelled(answer, surface, separation, E_star, derivatives, wanted)
        return Contact(**fields, reading=get_reading(reading).name, tier=tier, islands=None)
    return _contact(surface, separation, tier, reading, E_star, rtol, outside, derivatives, wanted)


def _wanted(quantities: Iterable[str]) -> tuple[str, ...]:
    """The quantities asked for, each once, in the order of `QUANTITIES`."""
    asked = (quantities,) if isinstance(quantities, str) else tuple(quantities)
    if not asked or not set(asked) <= set(QUANTITIES):
        raise InputError(f"quantities must be some of {QUANTITIES}, got {quantities!r}")
    return tuple(name for name in QUANTITIES if name in asked)


def _contact(
    surface: Surface,
    separation: ArrayLike,
    tier: str,
    reading: str | Reading,
    E_star: ArrayLike,
    rtol: float,
    outside: str,
    derivatives: bool,
    quantities: tuple[str, ...],
    many: bool | None = None,
) -> Contact:
    """`contact` of plain arrays; `many` says whether they are a block of many gaps."""
    gap = finite_array("separation", separation)
    modulus = finite_array("E_star", E_star)
    require("E_star", modulus, modulus > 0, "positive")
    rule = get_reading(reading)
    if outside not in OUTSIDE:
        raise InputError(f"outside must be one of {OUTSIDE}, got {outside!r}")
    model = get_model(tier, rtol, rule)
    which = BOTH if len(quantities) > 1 else QUANTITIES.index(quantities[0])
    shape = broadcast_shape(separation=gap, surface=surface.hurst, E_star=modulus)
    gap = np.broadcast_to(gap, shape)
    h_max = np.broadcast_to(np.asarray(surface.h_max), shape)
    require("separation", gap, gap >= -h_max, "at least -h_max, where the model ends")

    def flat(field: Any) -> FloatArray:
        return np.broadcast_to(np.asarray(field, dtype=float), shape).ravel()

    room = flat(surface.h_rms / surface.s)
    most = np.broadcast_to(np.asarray(surface.zeta_1), shape)
    require("q1/q0", most, most > rule.floor_u, f"greater than {rule.floor_u:g}, the reading's floor of zeta_u")
    zeta_1, hurst = flat(most), flat(surface.hurst)
    pairs = Pairs(
        hurst=hurst,
        zeta_1=zeta_1,
        room=room,
        reach=((h_max - gap) / surface.h_rms).ravel(),
        top=flat(surface.h_max / surface.h_rms),
        layer=np.exp(-hurst * np.log(zeta_1)),
    )
    stress = modulus * surface.q0 * surface.s
    force_by = area_by = None
    try:
        if derivatives:
            if not isinstance(model, UniversalModel):
                raise InputError("derivatives come from tier 'universal'")
            sums, error, islands = look_up_slopes(pairs, rule, model, rtol, outside, shape)
            force, area = sums[:, 0, 0], sums[:, 1, 0]
            force_by, area_by = _by_parameter(surface, sums.reshape((*shape, 2, 5)), pairs, stress)
        elif isinstance(model, UniversalModel):
            own = gap.size >= MANY_GAPS if many is None else many
            frozen = _through_law(surface, gap, modulus, rule, rtol) if own else None
            if frozen is not None:
                force, area, error = frozen
                islands = None
            else:
                force, area, error, islands = look_up(pairs, rule, model, rtol, outside, shape, which)
        else:
            force, area, error, islands = sum_islands(pairs, rule, model, 0.5 * rtol, outside, which)
    except ConvergenceError as fault:
        fault.mask = fault.mask.reshape(shape)
        raise
    return Contact(
        separation=gap[()],
        mean_separation=((h_max + gap) / 2)[()],
        force=(force.reshape(shape) * stress)[()] if which != AREA else None,
        area=area.reshape(shape)[()] if which != FORCE else None,
        error=error.reshape(shape)[()],
        reading=rule.name,
        tier=model.name,
        islands=islands,
        force_by=force_by if which != AREA else None,
        area_by=area_by if which != FORCE else None,
    )


def _through_law(
    surface: Surface, gap: FloatArray, modulus: FloatArray, reading: Reading, rtol: float
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """F/(A0 E* q0 s), A/A0 and their error through a law of half the tolerance, where one surface has many gaps."""
    if surface.shape != () or modulus.ndim or rtol < FROZEN_RTOL:
        return None
    # laws are made of totals
    from mbma_tables.totals.law import contact_law

    try:
        law = contact_law(surface, 0.5 * rtol, reading=reading)
    except (OutOfRangeError, ConvergenceError):
        # a law needs every gap down to -h_max, these may do without
        return None
    flat = gap.ravel()
    force = law.force(flat) / float(surface.q0 * surface.s)
    return force, law.area(flat), np.where(flat < law.h_max, law.error, 0.0)


def _by_parameter(
    surface: Surface, sums: FloatArray, pairs: Pairs, stress: FloatArray
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Chain rule from H, log(zeta_1), reach and top to the gap and the surface's own parameters."""
    shape = sums.shape[:-2]
    reach, top, room, hurst, zeta_1 = (
        getattr(pairs, name).reshape(shape) for name in ("reach", "top", "room", "hurst", "zeta_1")
    )
    h_rms, q0, q1 = surface.h_rms, surface.q0, surface.q1
    # log(1/room) by H and by log(zeta_1): room^2 = 1 - zeta_1^(-2H)
    lift = -(1 - room**2) / room**2
    answers = []
    for number in range(2):
        value, by_H, by_zeta, by_reach, by_top = np.moveaxis(sums[..., number, :], -1, 0)
        scale: Any = 1.0
        own = np.zeros_like(value)
        if number == 0:
            # force carries q0 s = q0 h_rms/room
            scale = stress
            by_H = by_H + value * lift * np.log(zeta_1)
            by_zeta = by_zeta + value * lift * hurst
            own = value
        found = {
            "separation": -by_reach / h_rms,
            "hurst": by_H,
            "q0": (own - by_zeta) / q0,
            "q1": by_zeta / q1,
            "h_rms": (own - reach * by_reach - top * by_top) / h_rms,
            "h_max": (by_reach + by_top) / h_rms,
        }
        answers.append({name: (scale * slope)[()] for name, slope in found.items()})
    return answers[0], answers[1]
