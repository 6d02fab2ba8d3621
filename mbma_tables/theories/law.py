"""`contact_law`: one surface's force and area by any theory, frozen into piecewise polynomials of the gap.

MBMA's laws are `totals.law`'s. For other theories ln F and ln A are fitted against a stretched mean separation in
which they stay smooth at both ends of contact (`law_kernel`), in pieces halved until they meet the tolerance.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import Any

import numpy as np

from mbma_tables.arguments import FloatArray, number_in
from mbma_tables.errors import ConvergenceError, InputError, OutOfRangeError
from mbma_tables.models import AnyModel
from mbma_tables.models.protocol import MAX_RTOL
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.readings import Reading
from mbma_tables.theories import law_kernel
from mbma_tables.theories.mbma import Mbma
from mbma_tables.theories.protocol import Theory, UserTheory
from mbma_tables.theories.registry import get_theory, refuse_options_of_mbma
from mbma_tables.theories.yielding import Yielding, checked_hardness
from mbma_tables.totals.law import MIN_LAW_RTOL, SAMPLES, MbmaLaw, fit_pieces, mbma_law, one_surface
from mbma_tables.totals.law_kernel import AREA, AREA_SLOPE, FORCE
from mbma_tables.totals.law_protocol import ContactLaw
from mbma_tables.units import UNKNOWN, Units, modulus_and_units

FIRST_CONTACT = 1e-6  # of (h_max - u)/h_max: below it a law is a power of h_max - u
MAX_SPAN = 10.0  # u/h_max up to which a theory without last contact is covered
LOWEST = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)  # u/h_max from which a theory may answer
SHARE = 0.1  # of a theory's own error: the polynomials need not be closer to it


@dataclasses.dataclass(frozen=True, eq=False)
class TheoryLaw(ContactLaw):
    """A law of another theory than MBMA.

    Where contact ends at h_max, the law is a power of h_max - u in the last millionth of its range, and within about
    that of the theory.

    Attributes
    ----------
    breaks, pieces, energies, errors : ndarray
        The polynomials: ends of the pieces in x, coefficients, energies at the ends of panels, bounds on their errors.
    unbounded, ends : bool
        Whether force has no bound at u = 0, and whether contact ends at h_max.
    """

    h_max: float
    E_star: float
    error: float
    turning_point: float | None
    area_turning_point: float | None
    theory: str
    breaks: FloatArray
    pieces: FloatArray
    energies: FloatArray
    errors: FloatArray
    unbounded: bool
    ends: bool
    reading: str = ""
    tier: str = ""
    units: Units = UNKNOWN

    @functools.cached_property
    def _law(self) -> law_kernel.Law:
        return law_kernel.Law(self.breaks, self.pieces, self.energies, self.unbounded, self.ends, self.h_max)

    def _gap(self, x: float) -> float:
        return self.h_max * (1 - 2 * law_kernel.to_rest(x, self.unbounded, self.ends))

    @functools.cached_property
    def lowest(self) -> float:
        """Smallest gap covered: -h_max, or just above it where force has no bound there."""
        return self._gap(float(self.breaks[0])) if self.unbounded else -self.h_max

    @functools.cached_property
    def highest(self) -> float:
        """Largest gap covered; infinite where contact ends at h_max."""
        return math.inf if self.ends else self._gap(float(self.breaks[-1]))

    def _fill(self, what: int, gap: FloatArray, out: FloatArray) -> None:
        law_kernel.fill(what, gap, tuple(self._law), out)
        if what not in (AREA, AREA_SLOPE):
            out *= self.E_star

    def _invert(self, what: int, wanted: FloatArray, end: float, out: FloatArray) -> None:
        from scipy.optimize.elementwise import find_root

        law, scale = tuple(self._law), self.E_star if what == FORCE else 1.0
        last = float(self.breaks[-1])
        value, slope = np.empty((2, 1))
        law_kernel.fill_logs(np.array([last]), what, law, value, slope)
        touching = wanted > 0
        goal = np.log(np.where(touching, wanted, scale)) - math.log(scale)

        def excess(x: FloatArray, aim: FloatArray) -> FloatArray:
            found, slopes = np.empty((2, x.size))
            law_kernel.fill_logs(np.ascontiguousarray(x).ravel(), what, law, found, slopes)
            return found.reshape(x.shape) - aim

        # lighter than the last piece: the power of h_max - u
        light = goal <= value[0]
        x = last + (goal - value[0]) / slope[0]
        if not light.all():
            rest = 0.5 * (self.h_max - end) / self.h_max
            first = law_kernel.to_x(rest, self.unbounded, self.ends)
            aim = np.minimum(goal[~light], excess(np.array([first]), np.zeros(1))[0])
            found = find_root(excess, (first, last), args=(aim,), tolerances={"xatol": 0, "xrtol": 1e-15, "fatol": 0})
            x[~light] = np.where(found.success, found.x, np.nan)
        for k, place in enumerate(x):
            out[k] = max(self._gap(place), end)
        out[~touching] = self.h_max

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}


def contact_law(
    surface: AnySurface,
    rtol: float = 1e-8,
    tier: str | AnyModel = "universal",
    reading: str | Reading = "reported",
    E_star: float | str = 1.0,
    *,
    theory: str | Theory | UserTheory = "mbma",
    hardness: float | str = math.inf,
) -> ContactLaw:
    """Force and area of one surface as functions of its gap: the way to answer many gaps, and to invert.

    Parameters
    ----------
    surface : Surface
        One surface, not a batch.
    rtol : float
        Relative error asked of the polynomials against the theory (MBMA's tier), in [1e-9, 0.1]; no more than a
        tenth of its own error is asked of another theory's.
    tier, reading, E_star
        As for `contact`; `tier` may be an island model of one's own.
    theory : str or theory
        By name, one of `mbma_tables.theories.THEORIES`, or an object, as for `contact`.
    hardness : float
        As for `contact`: the law of loading. Its `energy` is then the work of loading, not what unloading gives back.

    Returns
    -------
    ContactLaw

    Raises
    ------
    InputError, OutOfRangeError, ConvergenceError

    Examples
    --------
    >>> from mbma_tables import Surface, contact_law
    >>> surface = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0)
    >>> law = contact_law(surface, rtol=1e-6)
    >>> f"{law.force(1.0):.4g}"
    '7.982e-05'
    >>> law.error < 2e-6
    True
    >>> persson = contact_law(surface, theory="persson")
    >>> f"{persson.force(u=2.0):.4g}, {persson.at_pressure(1e-4).mean_separation:.3f}"
    '0.0001832, 2.276'
    """
    number, units = modulus_and_units(E_star, surface)
    modulus = number_in("E_star", number, np.finfo(float).tiny, np.finfo(float).max)
    cap = checked_hardness(units.number("hardness", hardness))
    if cap.ndim:
        raise InputError(f"hardness must be one number, got shape {cap.shape}: a law is of one surface")
    made = _law_in_numbers(surface, rtol, tier, reading, modulus, theory, float(cap) / modulus)
    return dataclasses.replace(made, units=units)


def _law_in_numbers(
    surface: AnySurface,
    rtol: float,
    tier: str | AnyModel,
    reading: str | Reading,
    modulus: float,
    theory: str | Theory | UserTheory,
    hardness: float,
) -> MbmaLaw | TheoryLaw:
    if theory == Mbma.name:
        chosen: Theory = Mbma(tier, reading)
    else:
        refuse_options_of_mbma(tier=tier != "universal", reading=reading != "reported")
        chosen = get_theory(theory)
    if hardness < math.inf:
        chosen = Yielding(chosen, hardness)
    if isinstance(chosen, Mbma):
        return mbma_law(surface, rtol, chosen.tier, chosen.reading, modulus)
    return _theory_law(one_surface(surface), chosen, number_in("rtol", rtol, MIN_LAW_RTOL, MAX_RTOL), modulus)


def _theory_law(surface: AnySurface, theory: Theory, rtol: float, E_star: float) -> TheoryLaw:
    """A law fitted to a theory's answers."""
    h_max, ends = float(surface.h_max), theory.ends_at_h_max
    # below the elastic theory's end force depends on the logarithm of u
    low = _lowest(surface, theory.elastic)
    unbounded = low > 0
    high = min(float(theory.interval(surface)[1]), MAX_SPAN * h_max)
    first = law_kernel.to_x(1 - low / h_max, unbounded, ends)
    last = law_kernel.to_x(FIRST_CONTACT if ends else 1 - high / h_max, unbounded, ends)
    own = 0.0
    to_rest = np.vectorize(law_kernel.to_rest, otypes=[float])

    def log_values(x: FloatArray) -> FloatArray:
        nonlocal own
        answer = theory.answer(surface, h_max * (1 - to_rest(x, unbounded, ends)))
        if not ((answer.force > 0) & (answer.area > 0) & np.isfinite(answer.force)).all():
            raise OutOfRangeError(
                f"theory {theory.name!r} has no positive force and area on all of this surface's gaps"
            )
        own = max(own, float(np.nan_to_num(answer.error).max()))
        return np.stack([np.log(answer.force), np.log(answer.area)], axis=-1)

    # to know the theory's own error
    log_values(np.linspace(first, last, SAMPLES))
    try:
        breaks, pieces, errors = fit_pieces(log_values, np.array([first, last]), max(rtol, SHARE * own))
    except ConvergenceError as fault:
        raise ConvergenceError(f"theory {theory.name!r}: {fault}; ask for a larger rtol", fault.mask) from None
    law = law_kernel.Law(breaks, pieces, np.empty((breaks.size - 1) * law_kernel.PANELS + 1), unbounded, ends, h_max)
    law_kernel.fill_energies(law, 0.0 if ends else float(theory.energy(surface, np.array(high))))
    made = TheoryLaw(
        h_max=h_max,
        E_star=E_star,
        error=float(errors.max()) + own,
        turning_point=None,
        area_turning_point=None,
        theory=theory.name,
        breaks=breaks,
        pieces=pieces,
        energies=law.energies,
        errors=errors,
        unbounded=unbounded,
        ends=ends,
    )
    return dataclasses.replace(
        made, turning_point=_turning_point(made, FORCE), area_turning_point=_turning_point(made, AREA)
    )


def _lowest(surface: AnySurface, theory: Theory) -> float:
    """Mean separation from which a theory has finite force: zero, or the least of `LOWEST` at which it answers."""
    for share in LOWEST:
        u = share * float(surface.h_max)
        try:
            with np.errstate(all="ignore"):
                force = float(theory.answer(surface, np.array(u)).force)
        except InputError:
            continue
        if math.isfinite(force) and force > 0:
            return u
    raise OutOfRangeError(f"theory {theory.name!r} has no finite force on this surface up to u = {u:.6g}")


def _turning_point(law: TheoryLaw, which: int) -> float | None:
    """Gap at which force or area first stops rising with compression."""
    from scipy.optimize import brentq

    plain = tuple(law._law)

    def slope(x: Any) -> Any:
        at = np.atleast_1d(np.asarray(x, dtype=float))
        value, found = np.empty((2, at.size))
        law_kernel.fill_logs(at, which, plain, value, found)
        return found if np.ndim(x) else float(found[0])

    steps = np.arange(SAMPLES) / SAMPLES
    x = np.append((law.breaks[:-1, None] + np.diff(law.breaks)[:, None] * steps).ravel(), law.breaks[-1])
    rises = slope(x) >= 0
    if not rises.any():
        return None
    k = int(np.flatnonzero(rises)[-1])
    return law._gap(brentq(slope, x[k], x[k + 1]) if k + 1 < x.size else float(x[k]))
