"""Persson's theory of area and average separation (Eqs. 18-21).

The double integral (19) is u_P of `mbma_tables.laws.calibrated` with the weight W = gamma P + (1 - gamma) P^3.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Literal

import numpy as np

from mbma_tables.common.arguments import FloatArray, finite_array, grouped, require
from mbma_tables.common.errors import InputError
from mbma_tables.laws.calibrated import LAW_ERROR, YANG_PERSSON, Law, area_persson, self_affine_law, spectrum_of
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.surface import MeasuredSurface, Surface
from mbma_tables.theories.protocol import Theory, TheoryAnswer, select

Method = Literal["full", "simplified"]

GAMMA = YANG_PERSSON.weight  # Eq. (19)
LAMBDA = 4.047  # Eq. (21b)
DECAY = 45.0  # exp(-DECAY) of an integrand's largest value counts as nothing
MAX_RATIO = 26.0  # p0 over E* sqrt(m2) at which u is still a normal number, about exp(-676)
MIN_LOG_FORCE = -690.0  # log p0/(E* q0 s) of the lightest load of the inverse
INVERSE_RTOL = 1e-10  # error of a load found from its separation

# exp(-t) over [0, DECAY]: 64 nodes leave 1e-15
_T, _T_WEIGHTS = DECAY / 2 * np.add(np.polynomial.legendre.leggauss(64), [[1], [0]])


@functools.lru_cache(maxsize=32)
def _own_law(surface: MeasuredSurface) -> Law:
    """Persson's theory for a surface's own spectrum, with Yang and Persson's weight."""
    return Law(spectrum_of(surface), None, YANG_PERSSON)


def _light(law: Law) -> tuple[float, float]:
    """u0/h_rms and log of lambda over the rms gradient, Eq. (21)."""
    s = law.spectrum
    log_g = np.log(s.below) / 2
    shares = s.x * s.variance / (4 * s.gradient) * np.exp(-log_g)
    total = float(shares.sum())
    return GAMMA * math.sqrt(8 / math.pi) * total, math.log(LAMBDA / math.sqrt(2)) + float(shares @ log_g) / total


def _by_law(surface: AnySurface, given: FloatArray, answer: Callable[[Law, FloatArray], FloatArray]) -> FloatArray:
    """Rows of ``answer(law, columns of given)`` of each distinct law, in the places of its entries."""
    if isinstance(surface, MeasuredSurface):
        return answer(_own_law(surface), given)
    assert isinstance(surface, Surface)
    if not surface.shape:
        return answer(self_affine_law(float(surface.hurst), float(surface.zeta_1), None, YANG_PERSSON), given)
    shape = given.shape[1:]
    pairs = np.stack([np.broadcast_to(part, shape).ravel() for part in (surface.hurst, surface.zeta_1)])
    known, inverse = np.unique(pairs, axis=1, return_inverse=True)
    columns, groups = given.reshape(len(given), -1), grouped(inverse.ravel())
    laws = [self_affine_law(*pair, None, YANG_PERSSON) for pair in known.T.tolist()]
    parts = [answer(laws[k], columns[:, mine]) for k, mine in groups]
    out = np.empty((len(parts[0]), inverse.size))
    out[:, np.concatenate([mine for _, mine in groups])] = np.concatenate(parts, axis=1)
    return out.reshape(-1, *shape)


class Persson(Theory):
    """Persson's theory: area by Eq. (18), average separation by Eqs. (19)-(21).

    Parameters
    ----------
    method : {"full", "simplified"}
        The double integral (19), to 1e-11, or its light-load form (20), which ends at u = 0, where the force is lambda.

    Raises
    ------
    InputError
        For another method.

    Examples
    --------
    >>> from mbma_tables import Surface, contact, theories
    >>> found = contact(Surface.named("concrete"), pressure=[0.001, 0.01], theory="persson")
    >>> found.mean_separation.round(4), found.area.round(5)
    (array([0.6721, 0.3801]), array([0.00217, 0.02171]))
    >>> light = theories.Persson("simplified")
    >>> print(f"{contact(Surface.named('concrete'), mean_separation=0.6, E_star=10.0, theory=light).pressure:.4f}")
    0.0184
    """

    name = "persson"
    ends_at_h_max = False

    def __init__(self, method: Method = "full") -> None:
        if method not in ("full", "simplified"):
            raise InputError(f"method must be 'full' or 'simplified', got {method!r}")
        self.method: Method = method

    @property
    def _is_full(self) -> bool:
        return self.method == "full"

    def _separations(self, law: Law, given: FloatArray) -> FloatArray:
        """u/h_rms of Eqs. (19) or (20), and du/d ln F, at loads over A0 E* g."""
        if self._is_full:
            return np.array(law.separation_persson(given[0]))
        u0, log_lambda = _light(law)
        return np.array([u0 * (log_lambda - np.log(given[0])), np.full(given[0].shape, -u0)])

    def _forces(self, law: Law, given: FloatArray) -> FloatArray:
        """Force over A0 E* g and -dF/du at u/h_rms, and u/h_rms at the lightest and the heaviest load covered."""
        u, lightest = given
        if not self._is_full:
            u0, log_lambda = _light(law)
            pressure = np.exp(log_lambda - u / u0)
            return np.array([pressure, pressure / u0, np.full(u.shape, np.inf), np.zeros(u.shape)])
        force, _, stiffness = law.contact(u)
        least, _ = law.separation_persson(MAX_RATIO / math.sqrt(2))
        return np.array([force, stiffness, law.separation_persson(lightest)[0], np.broadcast_to(least, u.shape)])

    def scatter_name(self, surface: AnySurface) -> str:
        """One name per form: they differ by more than their scatter against boundary elements."""
        return self.name if self._is_full else f"{self.name}_{self.method}"

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness at mean separations u [length], positive for the full form.

        Raises
        ------
        OutOfRangeError
            Also where the force of the full form over- or underflows.
        """
        pressure, stiffness = self._force(surface, mean_separation)
        error = np.full(pressure.shape, LAW_ERROR if isinstance(surface, MeasuredSurface) else INVERSE_RTOL)
        return TheoryAnswer(pressure, self.area_at(surface, pressure), stiffness, error)

    def _force(self, surface: AnySurface, mean_separation: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Force over A0 E* at mean separations u [length], and -dF/du."""
        u = finite_array("mean_separation", mean_separation)
        allowed = u > 0 if self._is_full else u >= 0
        require("mean_separation", u, allowed, "positive" if self._is_full else "zero or positive")
        u = np.broadcast_to(u, np.broadcast_shapes(u.shape, surface.shape))
        self._check_form(surface)
        h_rms, gradient = np.asarray(surface.h_rms), np.asarray(surface.rms_gradient)
        unit = np.asarray(surface.s if isinstance(surface, Surface) else h_rms)
        lightest = np.exp(MIN_LOG_FORCE) * np.asarray(surface.q0) * unit / gradient
        given = np.stack([u / h_rms, np.broadcast_to(lightest, u.shape)])
        pressure, stiffness, most, least = _by_law(surface, given, self._forces)
        inside = (u >= least * h_rms) & (u <= most * h_rms)
        reached = [np.max(least * h_rms / unit), np.min(most * h_rms / unit)]
        text = "within the range of normal numbers, {:.3g} to {:.6g}".format(*reached)
        require("mean_separation/s", u / unit, inside, text)
        return pressure * gradient, stiffness * gradient / h_rms

    def _loaded(self, surface: AnySurface, pressure: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean separation [length] at loads over A0 E*, negative beyond lambda E*, and -du/dlog F."""
        self._check_form(surface)
        load = (pressure / np.asarray(surface.rms_gradient))[None]
        u, slope = _by_law(surface, load, self._separations)
        return u * np.asarray(surface.h_rms), -slope * np.asarray(surface.h_rms)

    def _check_form(self, surface: AnySurface) -> None:
        if not self._is_full and isinstance(surface, MeasuredSurface):
            raise InputError("the simplified form (20) needs self-affine surfaces: use method='full', or surface.fit()")

    def interval(self, surface: AnySurface, quantity: str = "pressure") -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] covered by the theory, whose heights are unbounded."""
        low = np.zeros(surface.shape)
        return low, np.full_like(low, np.inf)

    def mean_separation_at(self, surface: AnySurface, quantity: str, wanted: FloatArray) -> FloatArray:
        """Mean separation u [length] at a force over A0 E* (19, 20) or an area (18); zero where it underflows."""
        if quantity == "area":
            require("area", wanted, wanted < 1, "below 1, which Persson's theory reaches at infinite load")
            from scipy.special import erfinv

            wanted = erfinv(wanted) * np.sqrt(surface.m2)
        pressure = finite_array("pressure", wanted)
        require("pressure", pressure, pressure > 0, "positive: u is infinite at zero load")
        pressure = np.broadcast_to(pressure, np.broadcast_shapes(pressure.shape, surface.shape))
        u = self._loaded(surface, pressure)[0]
        require("pressure", pressure, u >= 0, "at most lambda E*, where the simplified form (20) reaches u = 0")
        return u

    def area_at(self, surface: AnySurface, pressure: FloatArray) -> FloatArray:
        """A/A0 = erf(p0/(2 sqrt(G))) at a force over A0 E*, G = E*^2 m2/4 at the largest magnification (18)."""
        return area_persson(pressure / np.asarray(surface.rms_gradient))

    def energy(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        """Elastic energy over A0 E* [length], from dU = -F du = F (-du/dlog F) dlog F."""
        pressure, _ = self._force(surface, mean_separation)
        lighter = pressure[..., None] * np.exp(-_T)
        batch = select(surface, pressure.shape, np.arange(pressure.size).reshape(*pressure.shape, 1))
        return np.asarray((lighter * self._loaded(batch, lighter)[1]) @ _T_WEIGHTS)
