"""`contact_law`: pressure and area of one surface by any theory, fitted by polynomials of the gap (`law.block`)."""

import contextlib
import functools
import math
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray, checked_hardness, hinted, number_in
from mbma_tables.common.errors import ConvergenceError, InputError, OutOfRangeError
from mbma_tables.common.shared import frozen
from mbma_tables.common.units import modulus_and_units
from mbma_tables.contacts.contact import chosen_theory
from mbma_tables.law import block as fit
from mbma_tables.law.law import ROUNDING, ContactLaw
from mbma_tables.materials import Metal, Pair, bodies, hardness_in
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.surface import Surface
from mbma_tables.theories.base import Theory, UserTheory
from mbma_tables.theories.mbma.island import check_band
from mbma_tables.theories.mbma.island_models import MAX_RTOL, MIN_RTOL, AnyModel
from mbma_tables.theories.mbma.profile import profile
from mbma_tables.theories.mbma.tables import get_model
from mbma_tables.theories.mbma.theory import Mbma
from mbma_tables.theories.mbma.variants import Variant

MIN_LAW_RTOL = 1e-9
RESOLVED = 1e-3  # for polynomials this accurate the last coefficients estimate the error
POWERS = (3.5, 10 / 3)  # leading powers of h_max - d of MBMA's force and area
LAYER_SHARE = 0.5  # of the boundary layer, up to which these powers dominate
FIRST_OCTAVES = 20  # below which a theory that ends at h_max is a power of h_max - u
MOST_OCTAVES = 60
MAX_SPAN = 10.0  # u/h_max up to which a theory without last contact is covered
LOWEST = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)  # u/h_max from which a theory may answer
LOOKED_AT = 24  # points at which a theory's own error is evaluated
SHARE = (
    0.1  # of the median of a theory's own errors: sufficient accuracy of the polynomials
)


@hinted
def contact_law(
    surface: AnySurface,
    theory: str | Theory | UserTheory | None = None,
    *,
    rtol: float = 1e-8,
    island_model: str | AnyModel = "universal",
    variant: str | Variant = "reported",
    E_star: float | str = 1.0,
    hardness: float | str | None = None,
    materials: str | Metal | Pair | Sequence[str | Metal] | None = None,
) -> ContactLaw:
    """Pressure and area of one surface as functions of its gap, for many gaps and for inverses.

    Parameters
    ----------
    surface : Surface
        One surface, not a batch.
    theory : str or theory, optional
        As for `contact`.
    rtol : float
        Requested relative error of the polynomials against the theory (MBMA's island
        model), in [1e-9, 0.1]; for other theories not below a tenth of their own error (its
        median over gaps), or not below that error where their results are not smooth within
        it.
    island_model, variant, E_star : optional
        As for `contact`.
    hardness, materials : optional
        As for `contact`: the law of loading. Its `energy` is then the work of loading, not
        that recovered on unloading.

    Returns
    -------
    ContactLaw

    Raises
    ------
    InputError, OutOfRangeError
        For a batch of surfaces, and numbers outside these ranges.
    ConvergenceError
        Where polynomials do not reach `rtol`; the message names the remedy.

    Examples
    --------
    >>> from mbma_tables import Surface, contact_law
    >>> surface = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0)
    >>> law = contact_law(surface, "mbma", rtol=1e-6)
    >>> f"{law.pressure(separation=1.0):.4g}"
    '7.982e-05'
    >>> law.error < 2e-6
    True
    >>> persson = contact_law(surface, theory="persson")
    >>> f"{persson.pressure(2.0):.4g}, {persson.at_pressure(1e-4).mean_separation:.3f}"
    '0.0001832, 2.276'
    """
    E_star, hardness, pair = bodies(materials, E_star, hardness)
    given, units = modulus_and_units(E_star, surface)
    modulus = number_in("E_star", given, sys.float_info.min, sys.float_info.max)
    chosen = chosen_theory(surface, theory, island_model=island_model, variant=variant)
    yields: dict[str, Any] = {}
    cap = checked_hardness(hardness_in(units, math.inf if hardness is None else hardness))
    if cap.ndim:
        raise InputError(
            f"hardness must be one number, got shape {cap.shape}: a law is of one surface"
        )
    if cap < math.inf:
        elastic = functools.partial(
            contact_law, surface, chosen, rtol=rtol, E_star=modulus
        )
        yields = {"hardness": float(cap), "elastic": elastic}
        chosen = chosen.with_hardness(float(cap), modulus)
    one = surface
    if one.labelled:
        one = one.with_numbers(
            *(np.asarray(getattr(one, name)) for name in one.parameters)
        )
    if one.shape != ():
        raise InputError(f"a law needs one surface, got a batch of shape {one.shape}")
    asked = number_in("rtol", rtol, MIN_LAW_RTOL, MAX_RTOL)
    facts = {
        "surface": one,
        "E_star": modulus,
        "units": units,
        "materials": pair,
        "gaps": chosen.gaps(),
        **yields,
    }
    if isinstance(chosen, Mbma):
        return _mbma_law(one, chosen.island_model, chosen.variant, asked, facts)
    try:
        return theory_law(one, chosen, asked, facts)
    except ConvergenceError as fault:
        raise ConvergenceError(
            f"theory {chosen.name!r}: {fault}; use a larger rtol", fault.mask
        ) from None


def _mbma_law(
    surface: AnySurface,
    island_model: Any,
    variant: Variant,
    rtol: float,
    facts: dict[str, Any],
) -> ContactLaw:
    """A law of the MBMA model: x = (h_max - d)/(2 h_max), powers of it below half of the boundary layer."""
    inner, h_max, h_rms = (
        max(0.1 * rtol, MIN_RTOL),
        float(surface.h_max),
        float(surface.h_rms),
    )
    model, stress = get_model(island_model, inner, variant), 1.0
    shape: Any = surface
    if isinstance(surface, Surface):
        check_band(surface, variant)
        stress = float(surface.q0 * surface.s)
        shape = float(surface.hurst), float(surface.zeta_1), h_max / h_rms
    kept = profile(shape, model, variant, inner)
    # the law ends with the island model's table; rounding may pass full compression
    end, source = min(float(kept.edges[-1]) * h_rms, 2 * h_max), kept.source

    def values(x: FloatArray) -> FloatArray:
        found = kept.totals(x * end / h_rms)
        if not found.all():
            raise OutOfRangeError(
                f"h_max is {h_max / h_rms:g} h_rms, so high that force or area underflow"
            )
        found[0] *= stress
        found[1] = variant.area_of(found[1])
        return found

    kinks, layer = (
        (source.breaks[-2:] * h_rms / end).tolist(),
        LAYER_SHARE * source.layer * h_rms / end,
    )
    tolerance, octaves = (
        min(rtol, RESOLVED),
        range(math.ceil(-math.log2(min(layer, *kinks))), 1100),
    )
    start, first = fit.first_record(
        lambda start: fit.power_record(values, start, POWERS), octaves, tolerance
    )
    facts |= {"theory": "mbma", "variant": variant.name, "island_model": model.name}
    side, limits = fit.Side(-1, start, values, tuple(kinks)), (h_max - end, math.inf)
    return _finish(
        1 / end,
        [side],
        tolerance,
        first,
        limits,
        0.0,
        [np.array([kept.error])],
        kept.leverage,
        facts,
    )


def theory_law(
    surface: AnySurface, theory: Theory, rtol: float, facts: dict[str, Any]
) -> ContactLaw:
    """A law fitted to a theory's answers: x from first contact, from u = 0, or from both where force has no bound."""
    h_max, ends = float(surface.h_max), theory.ends_at_h_max
    # below the elastic theory's end, and with a hardness towards u = 0, force depends on
    # the logarithm of u
    lowest = _lowest(
        surface, theory.elastic, LOWEST if theory.elastic is theory else LOWEST[1:]
    )
    highest = h_max if ends else min(float(theory.interval(surface)[1]), MAX_SPAN * h_max)
    errors: list[FloatArray] = []  # of the answers, which are asked until the end

    def answer(u: FloatArray) -> FloatArray:
        with np.errstate(all="ignore"):
            found = theory.answer(surface, u)
        if not (
            (found.pressure > 0) & (found.area > 0) & np.isfinite(found.pressure)
        ).all():
            raise OutOfRangeError(
                f"theory {theory.name!r} has no positive force and area on all of this surface's gaps"
            )
        errors.append(np.nan_to_num(found.error))
        return np.stack([found.pressure, found.area])

    answer(lowest + (highest - lowest) * (np.arange(LOOKED_AT) + 0.5) / LOOKED_AT)
    # far larger errors at some gaps, as at the lightest contact of a small map, are ignored
    own = float(np.median(errors[0]))
    tolerance = max(min(rtol, RESOLVED), SHARE * own)
    bends = np.asarray(theory.bends(surface), dtype=float)

    width = highest if not ends else h_max / 2 if lowest else h_max
    above = fit.Side(1, lowest / width, lambda x: answer(width * x), tuple(bends / width))
    if ends:
        start = 2.0**-FIRST_OCTAVES
        below = fit.Side(
            -1, start, lambda x: answer(h_max - width * x), tuple((h_max - bends) / width)
        )
        sides, first = (
            [below, above] if lowest else [below],
            fit.straight_record(below.values, start),
        )
    elif lowest > 0:
        sides, first = [above], (np.zeros(fit.RECORD), np.zeros(2), (0.0, 0.0))
    else:
        octaves = range(3, MOST_OCTAVES)
        start, first = fit.first_record(
            lambda start: fit.power_record(above.values, start, (0.0, 0.0)),
            octaves,
            tolerance,
        )
        sides = [above._replace(start=start)]
    beyond = 0.0 if ends else 2 * float(theory.energy(surface, np.array(highest)))
    limits = 2 * lowest - h_max, math.inf if ends else 2 * highest - h_max
    facts |= {"theory": theory.name, "variant": "", "island_model": ""}
    finish = functools.partial(_finish, 1 / (2 * width), sides)
    try:
        return finish(tolerance, first, limits, beyond, errors, 0.0, facts)
    except ConvergenceError:
        # answers need not be smooth below their own error
        if own <= tolerance:
            raise
        return finish(own, first, limits, beyond, errors, 0.0, facts)


def _finish(
    scale: float, sides: list[fit.Side], tolerance: float, first: fit.First, limits: tuple[float, float], beyond: float,
    own_errors: list[FloatArray], leverage: float, facts: dict[str, Any],
) -> ContactLaw:  # fmt: skip
    """Fit the sides, put the block together, and look for turning points."""
    h_max, (lowest, highest) = float(facts["surface"].h_max), limits
    sides = [
        side._replace(kinks=tuple(kink for kink in side.kinks if side.start < kink < 1))
        for side in sides
    ]
    pieces: list[fit.Pieces] = [fit.side_pieces(side, tolerance) for side in sides]
    ends = (
        lowest if lowest == -h_max else lowest - ROUNDING * h_max,
        sys.float_info.max if highest == math.inf else highest * (1 + ROUNDING),
    )
    block, records, errors = fit.assemble(h_max, scale, sides, pieces, first, ends)
    # records after the first in order of falling d, and the sign of d of each
    counts = [len(piece.records) for piece in pieces]
    signs, order = (
        np.repeat([float(side.sign) for side in sides], counts),
        np.arange(1, len(records)),
    )
    if sides[-1].sign > 0:
        order[-counts[-1] :] = order[-counts[-1] :][::-1].copy()
    fit.fill_energies(records, order, signs, scale, first[2][0], beyond)
    turns = [
        None if x is None else s * (x / scale - h_max)
        for x, s in fit.first_falls(records[order], signs)
    ]
    # forces carry the modulus
    records[:, fit.FORCE_AT : fit.AREA_AT] *= facts["E_star"]
    records[:, fit.ENERGY_AT] *= facts["E_star"]
    error, own = float(errors[:, 0].max()), float(np.concatenate(own_errors).max())
    ends_at: dict[str, Any] = {
        "h_max": h_max,
        "lowest": lowest,
        "highest": highest,
        "error": error + own,
    }
    ends_at |= {"turning_point": turns[0], "area_turning_point": turns[1]}
    errors = errors + np.array([0.0, leverage * own])
    return ContactLaw(**facts, **ends_at, block=frozen(block), errors=frozen(errors))


def _lowest(surface: AnySurface, theory: Theory, shares: tuple[float, ...]) -> float:
    """Mean separation from which a theory has finite force: the least of `shares`, or where its answers begin."""
    for u in (
        *(share * float(surface.h_max) for share in shares),
        float(theory.interval(surface)[0]),
    ):
        with np.errstate(all="ignore"), contextlib.suppress(InputError):
            if 0 < float(theory.answer(surface, np.array(u)).pressure) < math.inf:
                return u
    raise OutOfRangeError(
        f"theory {theory.name!r} has no finite force on this surface up to u = {u:.6g}"
    )
