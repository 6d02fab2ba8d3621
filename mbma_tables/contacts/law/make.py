"""`contact_law`: pressure and area of one surface by any theory, fitted by polynomials of the gap (`law.block`)."""

import dataclasses
import functools
import math
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from mbma_tables.bodies.bodies import Bodies, BodiesInUnits, after
from mbma_tables.common.arguments import FloatArray, hinted, number_in
from mbma_tables.common.errors import ConvergenceError, InputError, OutOfRangeError
from mbma_tables.common.shared import frozen
from mbma_tables.contacts.law import block as fit
from mbma_tables.contacts.law.law import ROUNDING, ContactLaw
from mbma_tables.contacts.quantities.interface import NOTHING_BETWEEN, Interface
from mbma_tables.contacts.result import Setup
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories import resolve
from mbma_tables.theories.base import Compression, Theory, UserTheory

MIN_LAW_RTOL = 1e-9
MAX_RTOL = 0.1
# for polynomials this accurate the last coefficients estimate the error
RESOLVED = 1e-3
# octaves of x, below which a theory that ends at h_max is a power of h_max - u
FIRST_OCTAVES = 20
MOST_OCTAVES = 60
# u/h_max up to which a theory without last contact is covered
MAX_SPAN = 10.0
# u/h_max from which a theory may answer
LOWEST = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
# points at which a theory's own error is evaluated
SAMPLED_ANSWERS = 24
# of the median of a theory's own errors: sufficient accuracy of the polynomials
SHARE = 0.1


@hinted
def contact_law(
    surface: AnySurface,
    bodies: Bodies | float | str = 1.0,
    theory: str | Theory | UserTheory | None = None,
    *,
    largest_pressure: float | str | None = None,
    rtol: float | None = None,
) -> ContactLaw:
    """Pressure and area of one surface as functions of its gap, for many gaps and for inverses.

    Parameters
    ----------
    surface : Surface
        One surface, not a batch.
    bodies : Bodies or float or str
        The bodies in contact, as for `contact`, each constant one number. With a hardness
        it is the law of first loading, which has no `energy`, unless a largest pressure is
        given.
    theory : str or theory, optional
        As for `contact`; by default "simulated" for a map, else "calibrated". The
        law covers the gaps that the theory answers: with ``Mbma(outside="exact")`` also
        those whose islands no table covers.
    largest_pressure : float or str, optional
        The largest pressure so far, with a hardness: below it the law is that of unloading
        and reloading, above it that of first loading.
    rtol : float, optional
        Requested relative error of the polynomials against the theory (MBMA's island
        model), in [1e-9, 0.1]; for other theories not below a tenth of their own error (its
        median over gaps), or not below that error where their results are not smooth within
        it. Default: that of ``Mbma(rtol=...)``, but at least 1e-9; 1e-8 of other theories.

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
    >>> law = contact_law(surface, theory="mbma", rtol=1e-6)
    >>> f"{law.pressure(separation=1.0):.4g}"
    '7.982e-05'
    >>> law.error < 2e-6
    True
    >>> persson = contact_law(surface, theory="persson")
    >>> f"{persson.pressure(2.0):.4g}, {persson.at_pressure(1e-4).mean_separation:.3f}"
    '0.0001832, 2.276'
    """
    if largest_pressure is not None:
        bodies = after(Bodies.of(bodies), largest_pressure)
    return law_of(surface, bodies, theory, rtol)


def law_of(
    surface: AnySurface,
    bodies: Any,
    theory: str | Theory | UserTheory | None,
    rtol: float | None,
    interface: Interface = NOTHING_BETWEEN,
) -> ContactLaw:
    """The law of one surface, with what a joint has between its bodies."""
    given = (
        bodies
        if isinstance(bodies, BodiesInUnits)
        else Bodies.of(bodies).in_units(surface)
    )
    modulus = number_in("E_star", given.E_star, sys.float_info.min, sys.float_info.max)
    numbers = dict(given.checked().numbers, E_star=modulus)
    for name, number in numbers.items():
        if np.ndim(number):
            raise InputError(
                f"{name} must be one number, got shape {np.shape(number)}: a law is of one "
                "surface"
            )
    given.require_one_conductivity()
    one = _one_surface(surface)
    chosen = resolve(theory, surface)
    simulated = chosen.surface_of(one)
    loaded = given.at(*map(float, numbers.values()))
    setup = Setup(simulated, loaded, chosen, interface)
    loading = setup.theory_of(setup.bodies)
    least = max(chosen.rtol, MIN_LAW_RTOL, loading.least_rtol)
    asked = least if rtol is None else rtol
    tolerance = number_in("rtol", asked, MIN_LAW_RTOL, MAX_RTOL)
    return _law_of_theory(setup, loading, tolerance)


def _one_surface(surface: AnySurface) -> AnySurface:
    """A surface of plain numbers; a batch is refused."""
    one = surface
    if one.labelled:
        one = one.with_numbers(*map(np.asarray, one.numbers().values()))
    if one.shape != ():
        raise InputError(f"a law needs one surface, got a batch of shape {one.shape}")
    return one


def _elastic_law(setup: Setup, rtol: float) -> ContactLaw:
    """The law of the same contact without a hardness and adhesion."""
    elastic = dataclasses.replace(setup.bodies.bodies, hardness=np.inf, adhesion=None)
    bodies = dataclasses.replace(
        setup.bodies, bodies=elastic, hardness=np.inf, adhesion=None
    )
    setup = dataclasses.replace(setup, bodies=bodies)
    return _law_of_theory(setup, setup.theory, rtol)


def _law_of_theory(setup: Setup, theory: Theory, rtol: float) -> ContactLaw:
    """The law by the curves that a theory has for it, or else by its answers."""
    curves = theory.law_curves(setup.surface, rtol)
    if curves is not None:
        return _law_of_curves(setup, curves, min(rtol, RESOLVED))
    try:
        return theory_law(setup, theory, rtol)
    except ConvergenceError as fault:
        raise ConvergenceError(
            f"theory {theory.name!r}: {fault}; use a larger rtol", fault.mask
        ) from None


def _law_of_curves(setup: Setup, curves: Compression, tolerance: float) -> ContactLaw:
    """A law by compressions: x rises from 0 at first contact, d = h_max, to 1 at the end."""
    h_max = float(setup.surface.h_max)

    def record_below(start: float) -> fit.First:
        return fit.power_record(curves.values, start, curves.powers)

    # the leading powers within the layer, and down to the smallest double at most
    octaves = range(math.ceil(-math.log2(min(curves.layer, *curves.kinks))), 1100)
    start, first = fit.first_record(record_below, octaves, tolerance)
    return _fitted_law(
        setup,
        h_max,
        tolerance,
        scale=1 / curves.end,
        sides=[fit.Side(-1, start, curves.values, curves.kinks)],
        first=first,
        limits=(h_max - curves.end, math.inf),
        answer_errors=[np.array([curves.error])],
        leverage=curves.leverage,
    )


def theory_law(setup: Setup, theory: Theory, rtol: float) -> ContactLaw:
    """A law fitted to a theory's answers at mean separations u.

    x rises from first contact, from u = 0, or from both where the force at u = 0 has no
    bound.
    """
    surface: Any = setup.surface
    h_max = float(theory.highest(surface))
    lowest, highest, ends_at_h_max = _covered(surface, theory)
    answer_errors: list[FloatArray] = []

    def force_and_area(u: FloatArray) -> FloatArray:
        with np.errstate(all="ignore"):
            answers = theory.answer(surface, u)
        pressure = answers.pressure
        if not ((pressure > 0) & (answers.area > 0) & np.isfinite(pressure)).all():
            raise OutOfRangeError(
                f"theory {theory.name!r} has no positive force and area on all of this "
                "surface's gaps"
            )
        answer_errors.append(np.nan_to_num(answers.error))
        return np.stack([pressure, answers.area])

    # polynomials need not be far more accurate than the theory's answers, nor can be where
    # these are not smooth; far larger errors at some gaps, as at the lightest contact of a
    # small map, are ignored
    shares = (np.arange(SAMPLED_ANSWERS) + 0.5) / SAMPLED_ANSWERS
    force_and_area(lowest + (highest - lowest) * shares)
    error_of_answers = float(np.median(answer_errors[0]))
    tolerance = max(min(rtol, RESOLVED), SHARE * error_of_answers)

    width, sides, first = _sides(
        surface, theory, force_and_area, (lowest, highest), ends_at_h_max, tolerance
    )
    if ends_at_h_max:
        largest_gap = math.inf
        energy_beyond = 0.0
    else:
        largest_gap = 2 * highest - h_max
        energy_beyond = 2 * float(theory.energy(surface, np.array(highest)))
        if setup.bodies.adhesion is not None:
            # pressures are net ones: the integral is from the end of the law
            energy_beyond = 0.0
    fitted = functools.partial(
        _fitted_law,
        setup,
        h_max,
        scale=1 / (2 * width),
        sides=sides,
        first=first,
        limits=(2 * lowest - h_max, largest_gap),
        energy_beyond=energy_beyond,
        answer_errors=answer_errors,
    )
    try:
        return fitted(tolerance)
    except ConvergenceError:
        # answers need not be smooth below their own error
        if error_of_answers <= tolerance:
            raise
        return fitted(error_of_answers)


def _covered(surface: AnySurface, theory: Theory) -> tuple[float, float, bool]:
    """Least and largest mean separation of a law, and whether the largest is last contact."""
    # below the elastic theory's end, and with a hardness towards u = 0, force depends on
    # the logarithm of u
    shares = LOWEST if theory.elastic is theory else LOWEST[1:]
    lowest = _lowest(surface, theory.elastic, shares)
    h_max = float(theory.highest(surface))
    if theory.ends_at_h_max and np.isinf(theory.domain(surface)[1]):
        return lowest, h_max, True
    return lowest, min(float(theory.interval(surface)[1]), MAX_SPAN * h_max), False


def _sides(
    surface: AnySurface,
    theory: Theory,
    force_and_area: fit.Values,
    covered: tuple[float, float],
    ends_at_h_max: bool,
    tolerance: float,
) -> tuple[float, list[fit.Side], fit.First]:
    """Mean separation over which x rises to 1; the sides of a law; the record where x begins."""
    h_max = float(theory.highest(surface))
    lowest, highest = covered
    bends = np.asarray(theory.bends(surface), dtype=float)
    if not ends_at_h_max:
        width = highest
    elif lowest:
        # two sides, which meet in the middle
        width = h_max / 2
    else:
        width = h_max

    def towards_full_compression(x: FloatArray) -> FloatArray:
        return force_and_area(width * x)

    def towards_first_contact(x: FloatArray) -> FloatArray:
        return force_and_area(h_max - width * x)

    above = fit.Side(1, lowest / width, towards_full_compression, tuple(bends / width))
    if ends_at_h_max:
        start = 2.0**-FIRST_OCTAVES
        kinks = tuple((h_max - bends) / width)
        below = fit.Side(-1, start, towards_first_contact, kinks)
        first = fit.straight_record(below.values, start)
        return width, [below, above] if lowest else [below], first
    if lowest > 0:
        # x begins at a gap that is answered: no record lies below it
        return width, [above], (np.zeros(fit.RECORD), np.zeros(2), (0.0, 0.0))

    def record_below(start: float) -> fit.First:
        return fit.power_record(above.values, start, (0.0, 0.0))

    # eighths of x at first
    octaves = range(3, MOST_OCTAVES)
    start, first = fit.first_record(record_below, octaves, tolerance)
    return width, [above._replace(start=start)], first


def _fitted_law(
    setup: Setup,
    h_max: float,
    tolerance: float,
    *,
    scale: float,
    sides: Sequence[fit.Side],
    first: fit.First,
    limits: tuple[float, float],
    answer_errors: Sequence[FloatArray],
    energy_beyond: float = 0.0,
    leverage: float = 0.0,
) -> ContactLaw:
    """Fit the sides, put the block together, and look for turning points.

    x is scale (h_max + s d) on a side of sign s, and `first` the record below where x
    begins; `limits` are the least and the largest gap d, and `energy_beyond` is the energy
    over E* of gaps above the largest. `answer_errors` are the theory's, of all answers
    until the end of the fit, and `leverage` is the error of slopes over F/x per error of
    answers.
    """
    lowest, highest = limits
    sides = [
        side._replace(kinks=tuple(k for k in side.kinks if side.start < k < 1))
        for side in sides
    ]
    pieces = [fit.side_pieces(side, tolerance) for side in sides]
    # gaps that differ from the ends by rounding are answered, full compression excepted
    ends = (
        lowest if lowest == -h_max else lowest - ROUNDING * h_max,
        sys.float_info.max if highest == math.inf else highest * (1 + ROUNDING),
    )
    block, records, errors = fit.assemble(h_max, scale, sides, pieces, first, ends)
    # records after the first in order of falling d, and the sign of d of each
    counts = [len(piece.records) for piece in pieces]
    signs = np.repeat([float(side.sign) for side in sides], counts)
    order = np.arange(1, len(records))
    if sides[-1].sign > 0:
        order[-counts[-1] :] = order[-counts[-1] :][::-1].copy()
    power_of_force = first[2][0]
    fit.fill_energies(records, order, signs, scale, power_of_force, energy_beyond)
    turns: list[float | None] = []
    for x, sign in fit.first_falls(records[order], signs):
        turns.append(None if x is None else sign * (x / scale - h_max))
    # forces carry the modulus
    modulus = float(setup.bodies.E_star)
    records[:, fit.FORCE_AT : fit.AREA_AT] *= modulus
    records[:, fit.ENERGY_AT] *= modulus
    error_of_fit = float(errors[:, 0].max())
    error_of_answers = float(np.concatenate(answer_errors).max())
    errors = errors + np.array([0.0, leverage * error_of_answers])
    elastic = None
    if setup.bodies.yields or setup.bodies.adhesion is not None:
        # what follows unloading is calculated from the law of the elastic contact, on demand
        elastic = functools.partial(_elastic_law, setup, tolerance)
    return ContactLaw(
        setup,
        h_max=h_max,
        lowest=lowest,
        highest=highest,
        error=error_of_fit + error_of_answers,
        turning_point=turns[0],
        area_turning_point=turns[1],
        block=frozen(block),
        errors=frozen(errors),
        elastic=elastic,
        gaps=setup.theory_of(setup.bodies).gaps(),
    )


def _lowest(surface: AnySurface, theory: Theory, shares: tuple[float, ...]) -> float:
    """Mean separation from which a theory has finite force.

    It is the least of these shares of h_max within the theory's domain, or where its
    answers begin.
    """
    low = float(theory.domain(surface)[0])
    separations = [max(low, share * float(surface.h_max)) for share in shares]
    separations.append(float(theory.interval(surface)[0]))
    cause: Exception | None = None
    for u in separations:
        try:
            with np.errstate(all="ignore"):
                pressure = float(theory.answer(surface, np.array(u)).pressure)
        except Exception as fault:  # of any kind, as theories may be a user's
            cause = fault
            continue
        if 0 < pressure < math.inf:
            return u
    reason = f" ({cause})" if cause is not None else ""
    raise OutOfRangeError(
        f"theory {theory.name!r} has no finite force on this surface up to "
        f"u = {separations[-2]:.6g}{reason}; its method `interval` states where it is defined"
    ) from cause
