"""A contact law: one surface's force and area frozen into piecewise polynomials of the gap.

With l = h_max - d, force falls like l^(7/2) and area like l^(10/3) towards first contact. What is left of their
logarithms is smooth in tau = asinh(sqrt(l/layer)) but for kinks at the floors of zeta_d and zeta_u, where pieces
break. So a law is accurate in relative terms down to first contact, and its slopes are those of the polynomials.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from mbma_tables.arguments import FloatArray, number_in
from mbma_tables.errors import ConvergenceError, InputError, OutOfRangeError
from mbma_tables.models import AnyModel, get_model
from mbma_tables.models.protocol import MAX_RTOL, MIN_RTOL
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.measured import MeasuredSurface
from mbma_tables.surfaces.readings import Reading, get_reading
from mbma_tables.surfaces.surface import Surface
from mbma_tables.totals import law_kernel
from mbma_tables.totals.island_sum import kinks, totals_of
from mbma_tables.totals.kernel import Pairs
from mbma_tables.totals.law_protocol import ContactLaw
from mbma_tables.totals.measured import island_curve, measured_totals
from mbma_tables.units import UNKNOWN, Units

TERMS = law_kernel.TERMS
MAX_PIECES = 400
SAMPLES = 24  # places a piece where the polynomial is compared with fresh totals, and its slope looked at
MIN_LAW_RTOL = 1e-9
RESOLVED = 1e-3  # a polynomial this close is one whose error the samples see
QUANTITIES = {
    "force": law_kernel.FORCE,
    "area": law_kernel.AREA,
    "stiffness": law_kernel.FORCE_SLOPE,
    "area_slope": law_kernel.AREA_SLOPE,
    "energy": law_kernel.ENERGY,
}


@dataclasses.dataclass(frozen=True, eq=False)
class MbmaLaw(ContactLaw):
    """A law of the MBMA model, which covers -h_max <= d and answers zero from h_max on.

    Attributes
    ----------
    breaks, pieces, layer, energies, errors : ndarray or float
        The polynomials: ends of the pieces in tau, coefficients, unit of l, energy at the ends, bounds on their errors.
    """

    h_max: float
    E_star: float
    error: float
    turning_point: float | None
    area_turning_point: float | None
    reading: str
    tier: str
    breaks: FloatArray
    pieces: FloatArray
    layer: float
    energies: FloatArray
    errors: FloatArray
    theory: str = "mbma"
    units: Units = UNKNOWN

    @property
    def lowest(self) -> float:
        """-h_max, full compression."""
        return -self.h_max

    @property
    def highest(self) -> float:
        """Infinite: from h_max on the answer is zero."""
        return math.inf

    @functools.cached_property
    def _law(self) -> law_kernel.Law:
        return law_kernel.Law(self.breaks, self.pieces, self.energies, self.layer, self.h_max, self.E_star)

    @functools.cached_property
    def _plain(self) -> tuple[Any, ...]:
        return tuple(self._law)

    def _map(self, what: int, separation: Any, u: Any = None) -> Any:
        if type(separation) is float and u is None and -self.h_max <= separation < math.inf:
            return law_kernel.evaluate(what, separation, self._plain)
        return super()._map(what, separation, u)

    def _fill(self, what: int, gap: FloatArray, out: FloatArray) -> None:
        law_kernel.fill(what, gap, self._plain, out)

    def _invert(self, what: int, wanted: FloatArray, end: float, out: FloatArray) -> None:
        law_kernel.invert(what, wanted, end, self._law, out)

    def slope_error(self, separation: ArrayLike) -> Any:
        """Bound on the error of `stiffness` over F/l, and of `area_slope` over A/l, where l = h_max - d.

        Of the value's own error, and of the logarithm's slope by Markov's inequality in the piece where d is: a
        residue of degree TERMS has slopes up to TERMS^2 times itself.
        """
        d = self._gaps(separation, None)
        tau = np.arcsinh(np.sqrt(np.maximum(self.h_max - d, 0.0) / self.layer))
        # on a break, the worse of both pieces
        sides = [np.searchsorted(self.breaks, tau, side) - 1 for side in ("left", "right")]
        pieces = [np.clip(side, 0, self.errors.size - 1) for side in sides]
        value, slope = (
            np.maximum(*(errors[piece] for piece in pieces))
            for errors in (self.errors, self.errors * TERMS**2 / np.diff(self.breaks))
        )
        steepest = np.maximum(
            *(np.abs(self._map(what, d)) for what in (law_kernel.FORCE_LOG_SLOPE, law_kernel.AREA_LOG_SLOPE))
        )
        # l dtau/dl = tanh(tau)/2
        return np.where(d < self.h_max, value * steepest + (1 + value) * slope * np.tanh(tau), 0.0)[()]

    def compiled(self, name: str = "force") -> Any:
        """A numba-compiled function of one float, for use in other compiled code: "force", "area", "stiffness"...

        It is compiled on the first call, and stays in memory, about 3 MB, until the process ends.
        """
        if name not in QUANTITIES:
            raise InputError(f"name must be one of {tuple(QUANTITIES)}, got {name!r}")
        made = self.__dict__.setdefault("_compiled", {})
        if name not in made:
            made[name] = law_kernel.bind(QUANTITIES[name], self._law)
        return made[name]

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}


def _to_piece(values: FloatArray) -> FloatArray:
    """Monomial coefficients in [-1, 1] from values at Chebyshev points, shape (pieces, TERMS, 2)."""
    count = values.shape[1]
    transform = np.linalg.inv(chebyshev.chebvander(chebyshev.chebpts1(count), count - 1))
    series = np.einsum("kj,pjc->pkc", transform, values)
    monomials = np.stack([np.pad(chebyshev.cheb2poly(row), (0, count))[:count] for row in np.eye(count)])
    pieces: FloatArray = np.einsum("pkc,km->pmc", series, monomials)
    return pieces


def one_surface(surface: AnySurface) -> AnySurface:
    """A surface of plain numbers.

    Raises
    ------
    InputError
        For a batch.
    """
    if surface.labelled:
        surface = surface.with_numbers(*(np.asarray(getattr(surface, name)) for name in surface.parameters))
    if surface.shape != ():
        raise InputError(f"a law is of one surface, got a batch of shape {surface.shape}")
    return surface


def mbma_law(
    surface: AnySurface,
    rtol: float = 1e-8,
    tier: str | AnyModel = "universal",
    reading: str | Reading = "reported",
    E_star: float = 1.0,
) -> MbmaLaw:
    """The law of the MBMA model for one surface; arguments as for `mbma_tables.contact_law`.

    Raises
    ------
    InputError, OutOfRangeError, ConvergenceError
    """
    surface = one_surface(surface)
    asked = number_in("rtol", rtol, MIN_LAW_RTOL, MAX_RTOL)
    modulus = number_in("E_star", E_star, np.finfo(float).tiny, np.finfo(float).max)
    choice = get_reading(reading)
    inner = max(0.1 * asked, MIN_RTOL)
    model = get_model(tier, inner, choice)
    h_rms, h_max = float(surface.h_rms), float(surface.h_max)
    layer, ends, totals = _islands(surface, model, choice, inner)
    worst = 0.0

    def residues(tau: FloatArray) -> FloatArray:
        nonlocal worst
        depth = layer * np.sinh(tau) ** 2
        force, area, error = (part.reshape(tau.shape) for part in totals(depth))
        worst, area = max(worst, float(np.max(error))), choice.area_of(area)
        if not (force.all() and area.all()):
            raise OutOfRangeError(f"h_max is {h_max / h_rms:g} h_rms, so high that force or area underflow")
        log_depth = np.log(depth)
        return np.stack([np.log(force) - 3.5 * log_depth, np.log(area) - 10 / 3 * log_depth], axis=-1)

    def to_tau(depth: Any) -> Any:
        return np.arcsinh(np.sqrt(np.asarray(depth) / layer))

    edges = to_tau(sorted({0.0, *(e for e in ends if e < 2 * h_max), 2 * h_max}))
    breaks, pieces, errors = fit_pieces(residues, edges, min(asked, RESOLVED))
    errors += worst
    law = law_kernel.Law(breaks, pieces, np.empty(breaks.size), layer, h_max, modulus)
    law_kernel.fill_energies(law)
    return MbmaLaw(
        h_max=h_max,
        E_star=modulus,
        error=float(errors.max()),
        turning_point=law_kernel.turning_point(law_kernel.FORCE, law, SAMPLES),
        area_turning_point=law_kernel.turning_point(law_kernel.AREA, law, SAMPLES),
        reading=choice.name,
        tier=model.name,
        breaks=breaks,
        pieces=pieces,
        layer=layer,
        energies=law.energies,
        errors=errors,
    )


def _islands(
    surface: AnySurface, model: AnyModel, reading: Reading, rtol: float
) -> tuple[float, list[float], Callable[[FloatArray], tuple[FloatArray, ...]]]:
    """Approach at which an island's band leaves the shortest wave, its kinks [length], and totals at E* = 1."""
    if isinstance(surface, MeasuredSurface):
        curve = island_curve(surface, model, reading, rtol, "raise")
        return (
            curve.layer,
            list(curve.kinks),
            lambda depth: measured_totals(surface, depth, model, reading, rtol, "raise")[:3],
        )
    assert isinstance(surface, Surface)
    if not surface.zeta_1 > reading.floor_u:
        raise OutOfRangeError(f"q1/q0 must be greater than {reading.floor_u:g}, the reading's floor of zeta_u")
    h_rms, stress = float(surface.h_rms), float(surface.q0) * float(surface.s)

    def totals(depth: FloatArray) -> tuple[FloatArray, ...]:
        found = totals_of(model, Pairs.of(surface, depth), reading, rtol)
        return found.force * stress, found.area, found.error

    ends = [k * h_rms for k in kinks(surface.hurst, surface.zeta_1, reading)]
    return h_rms * float(surface.zeta_1) ** -float(surface.hurst), ends, totals


def fit_pieces(residues: Any, edges: FloatArray, rtol: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Breaks, pieces and bounds on their errors: polynomials of `residues` between `edges`, halved until they fit."""
    low, high = edges[:-1], edges[1:]
    points = chebyshev.chebpts1(TERMS)
    tests = np.cos(np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES)[::-1]
    kept: list[tuple[float, float, FloatArray, float]] = []
    while low.size:
        if len(kept) + low.size > MAX_PIECES:
            raise ConvergenceError(f"the law needs more than {MAX_PIECES} pieces for {rtol:.1e}", np.array(True))
        middle, half = (low + high)[:, None] / 2, (high - low)[:, None] / 2
        fitted = _to_piece(residues(middle + half * points))
        truth = residues(middle + half * tests)
        powers = tests[:, None] ** np.arange(TERMS)
        seen = np.abs(np.einsum("sm,pmc->psc", powers, fitted) - truth).max(axis=(1, 2))
        # Ehlich and Zeller (1964): no polynomial of degree TERMS exceeds its values at the samples by more
        error = np.expm1(seen / math.cos(math.pi * TERMS / (2 * SAMPLES)))
        good = error <= rtol
        kept += zip(low[good].tolist(), high[good].tolist(), fitted[good], error[good].tolist(), strict=True)
        cut = (low[~good] + high[~good]) / 2
        low, high = np.concatenate([low[~good], cut]), np.concatenate([cut, high[~good]])
    kept.sort(key=lambda piece: piece[0])
    breaks = np.array([kept[0][0], *(piece[1] for piece in kept)])
    return breaks, np.stack([piece[2] for piece in kept]), np.array([piece[3] for piece in kept])
