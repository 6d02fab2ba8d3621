r"""Contact of a rough surface by Persson's energy integral, its cover and weight calibrated on boundary elements.

Units: force :math:`\hat F = F/(A_0 E^* g)` with g the rms gradient in two dimensions, lengths in h_rms, wavenumbers
x = q/q0, elastic energy over :math:`A_0 E^* g h_{rms}`. A spectrum enters by its shares w(x) of h_rms^2 per d ln x. ::

    S(F; s0, t0)  = (s0 + t)/(1 + t),  t = F/t0;        cover(F; s0, t0) = erf(sqrt(2) F/sqrt(S))
    A/A0          = cover(F)                             s0 of Nayak's alpha
    P(x; F)       = cover(F g/g(x))                      g(x)^2: the gradient's square of waves below x
    U(F)          = 1/(4 g^) integral x w(x) W(P) d ln x,   W(P) = a P + b P^3 + (1 - a - b) P^4,   g^ = g/(q0 h_rms)
    u_P(F)        = integral from F to infinity of dU/F    so that F = -dU/du, and full contact is exact
    F_G(u)        = F_P(u) exp(-c max(u - 2, 0)^2)         a Gaussian surface without end

W = P is Persson's theory with weight 1. Because P depends on F and x through y = F g/g(x) alone, the inner integral
is a function of y, tabulated once: a curve is then one sum over the spectrum.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BSpline, make_interp_spline
from scipy.special import erf, ndtri

from mbma_tables.arguments import FloatArray

LOG_Y = (-32.0, 2.25)  # ln y of the tabulated inner integrals; above its end they are below 1e-150
Y_NODES = 1200
POWERS = (1, 3, 4)  # of the cover in the weight W
CLOSEST = -36.0  # ln ln x where a self-affine spectrum's quadrature begins
PANEL, PANEL_NODES = 1.0, 10  # its panels, in ln ln x below x = e and in ln x above
LOG_FORCE = (-21.0, 1.6)  # ln F^ over which a curve is tabulated
FORCE_NODES = 227


@dataclasses.dataclass(frozen=True)
class Constants:
    """The law's constants.

    Attributes
    ----------
    area_s0, area_slope, area_t0 : float
        S of the area: s0 = area_s0 + area_slope ln(alpha/10), at most 0.95.
    cover_s0, cover_t0 : float
        S of the cover P in the energy integral.
    weight, weight_slope, cubic : float
        W's coefficients: of P, with its slope in (H - 0.7), and of P^3.
    tail, tail_slope : float
        Of the Gaussian tail factor, the slope again in (H - 0.7).
    closure : float
        Exponent b of F^b = F_G(u)^b - F_G(h_max)^b.
    mixing : float
        Height u where half of a map's own heights have come in.
    """

    area_s0: float = 0.497
    area_slope: float = 0.041
    area_t0: float = 0.321
    cover_s0: float = 0.50
    cover_t0: float = 0.303
    weight: float = 0.393
    weight_slope: float = 0.149
    cubic: float = -0.517
    tail: float = 0.892
    tail_slope: float = 0.516
    closure: float = 0.749
    mixing: float = 1.034


CONSTANTS = Constants()
PERSSON = dataclasses.replace(
    CONSTANTS,
    area_s0=1.0,
    area_slope=0.0,
    cover_s0=1.0,
    weight=1.0,
    weight_slope=0.0,
    cubic=0.0,
    tail=0.0,
    tail_slope=0.0,
)


def _cover(force: FloatArray, s0: float | FloatArray, t0: float) -> tuple[FloatArray, FloatArray]:
    """erf(sqrt(2) F/sqrt(S)) and its derivative with respect to F."""
    t = force / t0
    S = (s0 + t) / (1 + t)
    argument = force * np.sqrt(2 / S)
    slope = np.sqrt(2 / S) * (1 - 0.5 * t * (1 - s0) / ((1 + t) * (s0 + t)))
    return erf(argument), 2 / np.sqrt(np.pi) * np.exp(-(argument**2)) * slope


def area(force: ArrayLike, alpha: ArrayLike, constants: Constants = CONSTANTS) -> FloatArray:
    """A/A0 at F/(A0 E* g) on a surface of Nayak's parameter alpha = m0 m4/m2^2."""
    s0 = np.minimum(constants.area_s0 + constants.area_slope * np.log(np.asarray(alpha) / 10), 0.95)
    return _cover(np.asarray(force, float), s0, constants.area_t0)[0]


@functools.lru_cache(maxsize=64)
def _inner_integrals(s0: float, t0: float) -> tuple[BSpline, ...]:
    """ln of I_n(y) = integral from y to infinity of dP^n/y', for n in POWERS, over ln y."""
    log_y = np.linspace(*LOG_Y, Y_NODES)
    node, weight = np.polynomial.legendre.leggauss(12)
    step = log_y[1] - log_y[0]
    y = np.exp(log_y[:-1, None] + step * (node + 1) / 2)
    P, dP = _cover(y, s0, t0)
    dP_end = _cover(np.exp(log_y), s0, t0)[1]
    shapes = []
    for n in POWERS:
        # dP^n/y' = n P^(n-1) P' d ln y'
        pieces = (n * P ** (n - 1) * dP) @ weight * step / 2
        # beyond the end the integrand falls like exp(-2 y^2): its own share of the last value
        end = n * dP_end[-1] / (4 * np.exp(2 * log_y[-1]))
        value = np.cumsum(np.append(pieces, end)[::-1])[::-1]
        shapes.append(make_interp_spline(log_y, np.log(value), k=5))
    return tuple(shapes)


def _inner(y: FloatArray, coefficients: FloatArray, s0: float, t0: float) -> FloatArray:
    """Sum of a_n I_n(y)."""
    log_y = np.log(y)
    inside = np.clip(log_y, *LOG_Y)
    total = np.zeros(np.shape(y))
    for n, a, shape in zip(POWERS, coefficients, _inner_integrals(s0, t0), strict=True):
        value = np.exp(shape(inside))
        if n == 1:
            # below the table I_1 is a logarithm, the others are constant
            value += _cover(np.zeros(1), s0, t0)[1] * (inside - log_y) * (log_y < LOG_Y[0])
        total += a * value
    return np.where(log_y < LOG_Y[1], total, 0.0)


@dataclasses.dataclass(frozen=True, eq=False)
class Spectrum:
    """An isotropic spectrum as a quadrature rule.

    Attributes
    ----------
    x : numpy.ndarray, shape (n,)
        Wavenumbers over a reference q0 (any: it cancels), rising.
    variance : numpy.ndarray, shape (n,)
        Shares of h_rms^2, their sum 1.
    below : numpy.ndarray, shape (n,)
        Shares of g^2 of the waves below each x.
    gradient : float
        g/(q0 h_rms).
    alpha : float
        m0 m4/m2^2.
    hurst : float
        Exponent that the constants' slopes refer to.
    """

    x: FloatArray
    variance: FloatArray
    below: FloatArray
    gradient: float
    alpha: float
    hurst: float = 0.7

    @classmethod
    def self_affine(cls, hurst: float, zeta_1: float, panel: float = PANEL) -> Spectrum:
        """Power law x^(-2H) between 1 and zeta_1, graded towards x = 1 where g(x) vanishes."""
        L = np.log(zeta_1)
        first = min(L, 1.0)
        graded = first * np.exp(np.linspace(CLOSEST, 0, round(-CLOSEST / panel) + 1))
        edges = np.append(graded, np.linspace(first, L, int(np.ceil((L - first) / panel)) + 1)[1:])
        node, weight = np.polynomial.legendre.leggauss(PANEL_NODES)
        half = np.diff(edges)[:, None] / 2
        log_x = (edges[:-1, None] + half * (1 + node)).ravel()
        d_log_x = (half * weight).ravel()
        low, mid, high = -2 * hurst, 2 - 2 * hurst, 4 - 2 * hurst

        def growth(power: float, log_ratio: ArrayLike) -> FloatArray:
            """Integral of x^power d ln x from 1."""
            width = np.asarray(log_ratio)
            return np.expm1(power * width) / power if abs(power) > 1e-9 else width * (1 + power * width / 2)

        m0, m2, m4 = (growth(power, L) for power in (low, mid, high))
        return cls(
            np.exp(log_x),
            np.exp(low * log_x) * d_log_x / m0,
            growth(mid, log_x) / m2,
            float(np.sqrt(m2 / m0)),
            float(1.5 * m0 * m4 / m2**2),
            hurst,
        )

    @classmethod
    def from_shares(cls, x: ArrayLike, variance: ArrayLike, hurst: float = 0.7) -> Spectrum:
        """Bands of wavenumber x (each its root mean square) that hold these shares of the height variance."""
        wavenumber, share = np.asarray(x, float), np.asarray(variance, float)
        held = share > 0
        wavenumber, share = wavenumber[held], share[held] / share[held].sum()
        slopes = share * wavenumber**2
        m2 = slopes.sum()
        # a band's own waves lie half below its middle
        below = (np.cumsum(slopes) - slopes / 2) / m2
        alpha = 1.5 * np.sum(share * wavenumber**4) / m2**2
        return cls(wavenumber, share, below, float(np.sqrt(m2)), float(alpha), hurst)


@dataclasses.dataclass(frozen=True, eq=False)
class Law:
    """The curve of a spectrum, of a Gaussian surface without end or, with `h_max`, of one that ends there.

    Parameters
    ----------
    spectrum : Spectrum
    h_max : float, optional
        Highest point [h_rms].
    constants : Constants
    """

    spectrum: Spectrum
    h_max: float | None = None
    constants: Constants = CONSTANTS

    @functools.cached_property
    def _coefficients(self) -> FloatArray:
        c = self.constants
        a = c.weight + c.weight_slope * (self.spectrum.hurst - 0.7)
        return np.array([a, c.cubic, 1 - a - c.cubic])

    def _over_spectrum(self, force: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """y = F g/g(x), shape (..., n), 1/g(x) and the spectrum's weights x w/(4 g^)."""
        inverse = 1 / np.sqrt(self.spectrum.below)
        shares = self.spectrum.x * self.spectrum.variance / (4 * self.spectrum.gradient)
        return np.asarray(force, float)[..., None] * inverse, inverse, shares

    def energy(self, force: ArrayLike) -> FloatArray:
        """Elastic energy U of the endless Gaussian surface, before its tail factor."""
        y, _, shares = self._over_spectrum(force)
        P, _ = _cover(y, self.constants.cover_s0, self.constants.cover_t0)
        weights = sum(a * P**n for n, a in zip(POWERS, self._coefficients, strict=True))
        return np.asarray(weights @ shares)

    def separation_persson(self, force: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """u_P and du_P/d ln F, before the tail factor."""
        c = self.constants
        y, inverse, shares = self._over_spectrum(force)
        u = _inner(y, self._coefficients, c.cover_s0, c.cover_t0) @ (shares * inverse)
        P, dP = _cover(y, c.cover_s0, c.cover_t0)
        slope = sum(a * n * P ** (n - 1) for n, a in zip(POWERS, self._coefficients, strict=True)) * dP
        return u, -np.asarray(slope @ (shares * inverse))

    @functools.cached_property
    def _curve(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """ln F_P nodes, falling; u; d ln F_G/du."""
        log_force = np.linspace(*LOG_FORCE[::-1], FORCE_NODES)
        u, slope = self.separation_persson(np.exp(log_force))
        return log_force, u, slope

    def _log_force_persson(self, u: FloatArray) -> FloatArray:
        """ln F_P(u): from the tabulated curve, then Newton's method on it."""
        log_nodes, u_nodes, _ = self._curve
        log_force = np.interp(np.log(u), np.log(u_nodes), log_nodes)
        for _ in range(30):
            value, slope = self.separation_persson(np.exp(log_force))
            # in ln u: nearly straight in F^2 at high loads, safe at light ones
            step = np.clip((np.log(value) - np.log(u)) * value / slope, -0.5, 0.5)
            log_force -= step
            if np.all(np.abs(step) < 1e-12):
                break
        return log_force

    def gaussian(self, u: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """ln F_G and -d ln F_G/du of the endless Gaussian surface at mean separations u > 0."""
        values = np.asarray(u, float)
        flat = values.ravel()
        log_force = self._log_force_persson(flat)
        _, slope = self.separation_persson(np.exp(log_force))
        tail = self.constants.tail + self.constants.tail_slope * (self.spectrum.hurst - 0.7)
        above = np.maximum(flat - 2, 0)
        return (
            (log_force - tail * above**2).reshape(values.shape),
            (-1 / slope + 2 * tail * above).reshape(values.shape),
        )

    def force(self, u: ArrayLike) -> FloatArray:
        """F/(A0 E* g) at mean separations u [h_rms]; zero from h_max on."""
        return self.force_and_stiffness(u)[0]

    def force_and_stiffness(self, u: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Force and -dF/du [A0 E* g/h_rms]."""
        gap = np.asarray(u, float)
        log_gaussian, rate = self.gaussian(gap)
        if self.h_max is None:
            return np.exp(log_gaussian), rate * np.exp(log_gaussian)
        b = self.constants.closure
        log_end, _ = self.gaussian(self.h_max)
        # F^b = F_G^b (1 - r), r = (F_G(h_max)/F_G)^b
        share = -np.expm1(np.minimum(b * (log_end - log_gaussian), 0.0))
        touching = share > 0
        safe = np.where(touching, share, 1.0)
        force = np.where(touching, np.exp(log_gaussian) * safe ** (1 / b), 0.0)
        return force, np.where(touching, rate * np.exp(log_gaussian) * safe ** (1 / b - 1), 0.0)

    def area(self, force: ArrayLike) -> FloatArray:
        """A/A0 at F/(A0 E* g)."""
        return area(force, self.spectrum.alpha, self.constants)

    def force_with_heights(self, u: ArrayLike, share_above: ArrayLike) -> FloatArray:
        """Force at u [h_rms] on a map of which these shares lie above u: closes itself at the highest point."""
        gap, share = np.asarray(u, float), np.asarray(share_above, float)
        mixed = gap + (-ndtri(np.maximum(share, 1e-300)) - gap) * -np.expm1(-((gap / self.constants.mixing) ** 4))
        return np.where(share > 0, np.exp(self.gaussian(mixed)[0]), 0.0)


def mean_top_height(share: ArrayLike) -> FloatArray:
    """M_G(a) = phi(z)/a, z = -Phi^-1(a): mean height of the highest share a of a Gaussian surface [h_rms]."""
    a = np.asarray(share, float)
    z = ndtri(a)
    result: NDArray[np.float64] = np.exp(-z * z / 2) / np.sqrt(2 * np.pi) / a
    return result
