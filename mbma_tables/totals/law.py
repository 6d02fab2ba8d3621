"""A contact law: one surface's force and area frozen into piecewise polynomials of the gap.

With l = h_max - d, force falls like l^(7/2) and area like l^(10/3) towards first contact. What is left of their
logarithms is smooth in tau = asinh(sqrt(l/layer)) but for kinks at the floors of zeta_d and zeta_u, where pieces
break. So a law is accurate in relative terms down to first contact, and its slopes are those of the polynomials.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from mbma_tables.arguments import FloatArray, finite_array, number_in, require
from mbma_tables.errors import ConvergenceError, InputError
from mbma_tables.surfaces.readings import Reading, get_reading
from mbma_tables.surfaces.surface import PARAMETERS, Surface
from mbma_tables.totals import law_kernel
from mbma_tables.totals.contact import contact
from mbma_tables.totals.pairs import kinks

TERMS = law_kernel.TERMS
MOST_PIECES = 400
SAMPLES = 24  # places a piece where the polynomial is held against fresh totals, and its slope looked at
LEAST_RTOL = 1e-9


@dataclasses.dataclass(frozen=True, eq=False)
class ContactLaw:
    """Force and area of one surface against its gap; made by `contact_law`, picklable, a few kB.

    Attributes
    ----------
    h_max : float
        Gap of first contact [length]; a law covers -h_max <= d, and answers zero from h_max on.
    error : float
        Bound on the relative error of force and area, of the polynomials and of the totals together.
    turning_point, area_turning_point : float or None
        Gap below which the model's force, or area, falls again, where it does (low H); inverses end there.
    reading, tier : str
        What made it.
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

    @functools.cached_property
    def _state(self) -> law_kernel.State:
        return self.breaks, self.pieces, self.layer, self.h_max, self.E_star

    def _map(self, what: int, gap: Any) -> Any:
        if type(gap) is float and -self.h_max <= gap < math.inf:
            return law_kernel.evaluate(what, gap, self._state, self.energies)
        if hasattr(gap, "dims"):
            from mbma_tables.labels import apply

            return apply(lambda block: self._map(what, block), (gap,), 1)
        d = finite_array("separation", gap)
        require("separation", d, d >= -self.h_max, f"at least -h_max = {-self.h_max:.17g}, where the model ends")
        out = np.empty(d.shape)
        law_kernel.fill(what, np.ascontiguousarray(d).reshape(-1), self._state, self.energies, out.reshape(-1))
        return out[()]

    def __call__(self, separation: ArrayLike) -> Any:
        """The same as `force`."""
        return self._map(law_kernel.FORCE, separation)

    def force(self, separation: ArrayLike) -> Any:
        """F/A0 in the unit of E_star at d; zero from h_max on."""
        return self._map(law_kernel.FORCE, separation)

    def area(self, separation: ArrayLike) -> Any:
        """A/A0 at d; zero from h_max on."""
        return self._map(law_kernel.AREA, separation)

    def stiffness(self, separation: ArrayLike) -> Any:
        """-dF/dd per nominal area; it jumps where zeta_d reaches its floor, and belongs to the larger gap there."""
        return self._map(law_kernel.FORCE_SLOPE, separation)

    def stiffness_mean(self, separation: ArrayLike) -> Any:
        """-dF/du per nominal area, against the mean separation u = (h_max + d)/2: twice `stiffness`."""
        return 2 * self.stiffness(separation)

    def area_slope(self, separation: ArrayLike) -> Any:
        """-d(A/A0)/dd."""
        return self._map(law_kernel.AREA_SLOPE, separation)

    def energy(self, separation: ArrayLike) -> Any:
        """Elastic energy per nominal area, the integral of force from d to h_max."""
        return self._map(law_kernel.ENERGY, separation)

    def separation(self, *, force: ArrayLike | None = None, area: ArrayLike | None = None) -> Any:
        """Gap d at a given force or area, on the branch of first contact; h_max at zero.

        Raises
        ------
        OutOfRangeError
            Where the branch does not reach the value; the message says how far it goes.
        """
        given = area if force is None else force
        if (force is None or area is None) and hasattr(given, "dims"):
            from mbma_tables.labels import apply

            kind = "area" if force is None else "force"
            return apply(lambda block: self.separation(**{kind: block}), (given,), 1)
        if force is not None and area is None:
            what, name, wanted = law_kernel.FORCE, "force", finite_array("force", force)
        elif area is not None and force is None:
            what, name, wanted = law_kernel.AREA, "area", finite_array("area", area)
        else:
            raise InputError("give force or area, one of them")
        end = self._branch_end(what)
        most = float(self._map(what, end))
        require(name, wanted, wanted >= 0, "at least 0")
        require(name, wanted, wanted <= most, f"at most {most:.6g}, at d = {end:.6g} where the branch ends")
        out = np.empty(wanted.shape)
        law_kernel.invert(what, np.ascontiguousarray(wanted).reshape(-1), end, self._state, out.reshape(-1))
        if np.isnan(out).any():
            raise ConvergenceError(f"no gap found for some of {name}", np.isnan(out))
        return out[()]

    def slope_error(self, separation: ArrayLike) -> Any:
        """Bound on the error of `stiffness` over F/l, and of `area_slope` over A/l, where l = h_max - d.

        By Markov's inequality in the piece where d is: a residue of degree TERMS has slopes up to TERMS^2 times itself.
        """
        d = finite_array("separation", separation)
        require("separation", d, d >= -self.h_max, f"at least -h_max = {-self.h_max:.17g}, where the model ends")
        tau = np.arcsinh(np.sqrt(np.maximum(self.h_max - d, 0.0) / self.layer))
        # on a break, the worse of both pieces
        sides = (np.searchsorted(self.breaks, tau, side) - 1 for side in ("left", "right"))
        loss = TERMS**2 / np.diff(self.breaks)
        worst = np.maximum(*((self.errors * loss)[np.clip(side, 0, loss.size - 1)] for side in sides))
        # l dtau/dl = tanh(tau)/2
        return np.where(d < self.h_max, worst * np.tanh(tau), 0.0)[()]

    def _branch_end(self, what: int) -> float:
        turn = self.turning_point if what == law_kernel.FORCE else self.area_turning_point
        return -self.h_max if turn is None else turn

    def compiled(self, name: str = "force") -> Any:
        """A numba-compiled function of one float, for use in other compiled code: "force", "area", "stiffness"."""
        codes = {
            "force": law_kernel.FORCE,
            "area": law_kernel.AREA,
            "stiffness": law_kernel.FORCE_SLOPE,
            "area_slope": law_kernel.AREA_SLOPE,
            "energy": law_kernel.ENERGY,
        }
        if name not in codes:
            raise InputError(f"name must be one of {tuple(codes)}, got {name!r}")
        return law_kernel.bind(codes[name], self._state, self.energies)

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


def contact_law(
    surface: Surface,
    rtol: float = 1e-8,
    tier: str = "universal",
    reading: str | Reading = "reported",
    E_star: float = 1.0,
) -> ContactLaw:
    """Freeze a surface into F(d) and A(d).

    Parameters
    ----------
    surface : Surface
        One surface, not a batch.
    rtol : float
        Relative error asked of the polynomials against the tier's totals, in [1e-9, 0.1].
    tier, reading, E_star
        As for `contact`.

    Returns
    -------
    ContactLaw

    Raises
    ------
    InputError, OutOfRangeError, ConvergenceError
    """
    if surface.labelled:
        surface = Surface(*(np.asarray(getattr(surface, name)) for name in PARAMETERS))
    if surface.shape != ():
        raise InputError(f"a law is of one surface, got a batch of shape {surface.shape}")
    asked = number_in("rtol", rtol, LEAST_RTOL, 0.1)
    modulus = number_in("E_star", E_star, np.finfo(float).tiny, np.finfo(float).max)
    rule = get_reading(reading)
    h_rms, h_max = float(surface.h_rms), float(surface.h_max)
    layer = h_rms * float(surface.zeta_1) ** -float(surface.hurst)
    # totals are asked for at E* = 1: the modulus scales what comes out
    inner = max(0.1 * asked, 1e-11)
    worst = 0.0

    def residues(tau: FloatArray) -> FloatArray:
        nonlocal worst
        depth = layer * np.sinh(tau) ** 2
        answer = contact(surface, h_max - depth, tier=tier, reading=rule, rtol=inner)
        worst = max(worst, float(np.max(answer.error)))
        # the gap as it was rounded is what the totals are of
        own = h_max - answer.separation
        return np.stack([np.log(answer.force / own**3.5), np.log(answer.area / own ** (10 / 3))], axis=-1)

    def to_tau(depth: Any) -> Any:
        return np.arcsinh(np.sqrt(np.asarray(depth) / layer))

    ends = [k * h_rms for k in kinks(surface.hurst, surface.zeta_1, rule)]
    edges = to_tau(sorted({0.0, *(e for e in ends if e < 2 * h_max), 2 * h_max}))
    low, high = edges[:-1], edges[1:]
    points = chebyshev.chebpts1(TERMS)
    tests = np.cos(np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES)[::-1]
    kept: list[tuple[float, float, FloatArray, float]] = []
    while low.size:
        if len(kept) + low.size > MOST_PIECES:
            raise ConvergenceError(f"the law needs more than {MOST_PIECES} pieces for {asked:.1e}", np.array(True))
        middle, half = (low + high)[:, None] / 2, (high - low)[:, None] / 2
        fitted = _to_piece(residues(middle + half * points))
        truth = residues(middle + half * tests)
        powers = tests[:, None] ** np.arange(TERMS)
        seen = np.abs(np.einsum("sm,pmc->psc", powers, fitted) - truth).max(axis=(1, 2))
        # Ehlich and Zeller (1964): no polynomial of degree TERMS exceeds its values at the samples by more
        error = np.expm1(seen / math.cos(math.pi * TERMS / (2 * SAMPLES)))
        good = error <= asked
        kept += zip(low[good].tolist(), high[good].tolist(), fitted[good], error[good].tolist(), strict=True)
        cut = (low[~good] + high[~good]) / 2
        low, high = np.concatenate([low[~good], cut]), np.concatenate([cut, high[~good]])
    kept.sort(key=lambda piece: piece[0])
    breaks = np.array([kept[0][0], *(piece[1] for piece in kept)])
    pieces = np.stack([piece[2] for piece in kept])
    errors = np.array([piece[3] for piece in kept]) + worst
    state = (breaks, pieces, layer, h_max, modulus)
    return ContactLaw(
        h_max=h_max,
        E_star=modulus,
        error=float(errors.max()),
        turning_point=law_kernel.turning_point(law_kernel.FORCE, state, SAMPLES),
        area_turning_point=law_kernel.turning_point(law_kernel.AREA, state, SAMPLES),
        reading=rule.name,
        tier=tier,
        breaks=breaks,
        pieces=pieces,
        layer=layer,
        energies=law_kernel.energies(state),
        errors=errors,
    )
