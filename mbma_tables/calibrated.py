"""Contact of a rough surface by Persson's energy integral, its cover and weight calibrated on boundary elements.

Units: force over A0 E* g with g the rms gradient in two dimensions, lengths in h_rms, wavenumbers x = q/q0, elastic
energy over A0 E* g h_rms. A spectrum enters by its shares w(x) of h_rms^2 per d ln x. ::

    A/A0    = erf(sqrt(2) F/sqrt(S)),  S = (s0 + t)/(1 + t),  t = F/t0,  s0 of Nayak's alpha (S = 1: Persson's)
    P(x; F) = erf(sqrt(2) F g/g(x))                      g(x)^2: the gradient's square of the waves below x
    U(F)    = 1/(4 g^) integral x w(x) W(P) d ln x,      W(P) = a P + b P^3 + (1 - a - b) P^16,  g^ = g/(q0 h_rms)
    u_P(F)  = integral from F to infinity of dU/F        so that F = -dU/du, and full contact is exact
    F_G(u)  = F_P(u) exp(-c (1 - nu) u^3)                a Gaussian surface without end
    F(u)    = F_G(u) - F_G(h_max)                        one that ends at h_max: its stiffness is the endless one's

W = P is Persson's theory with weight 1, W = gamma P + (1 - gamma) P^3 Yang and Persson's. a depends on the
spectrum's narrowness nu = 1/(<x> <1/x>), which needs no Hurst exponent. Because P depends on F and x through
y = F g/g(x) alone, the inner integral is a function of y, tabulated once: a curve is one sum over waves.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.arguments import FloatArray

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

LOG_Y = (-32.0, 2.25)  # ln y of the tabulated inner integrals; above its end they are below 1e-150
Y_NODES = 4800
POWERS = (1, 3, 16)  # of the cover in the weight W
CLOSEST = -36.0  # ln ln x where a self-affine spectrum's quadrature begins
PANEL, PANEL_NODES = 1.0, 10  # its panels, in ln ln x below x = e and in ln x above
LOG_FORCE = (-21.0, 1.6)  # ln F^ over which a curve is tabulated
FORCE_NODES = 227
NARROWNESS = 0.65  # that W's slope refers to


@dataclasses.dataclass(frozen=True)
class Constants:
    """The law's constants."""

    area_s0: float = 0.5131  # S of the area: s0 = area_s0 + area_slope ln(alpha/10), at most Persson's 1
    area_slope: float = 0.02973
    area_t0: float = 0.3428
    weight: float = 0.438  # W's coefficient a,
    weight_slope: float = 0.08577  # its slope in the narrowness less 0.65,
    cubic: float = 0.4279  # and b
    tail: float = 0.06492  # c of the Gaussian tail factor


CONSTANTS = Constants()
PERSSON = Constants(area_s0=1.0, area_slope=0.0, weight=1.0, weight_slope=0.0, cubic=0.0, tail=0.0)
YANG_PERSSON = dataclasses.replace(PERSSON, weight=0.42, cubic=0.58)


def _cover(force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """erf(sqrt(2) F), Persson's contact of unit gradient, and its derivative."""
    from scipy.special import erf

    return erf(np.sqrt(2) * force), np.sqrt(8 / np.pi) * np.exp(-2 * force**2)


def area(force: ArrayLike, alpha: ArrayLike, constants: Constants = CONSTANTS) -> FloatArray:
    """A/A0 at F/(A0 E* g) on a surface of Nayak's parameter alpha = m0 m4/m2^2."""
    from scipy.special import erf

    values = np.asarray(force, float)
    t = values / constants.area_t0
    return np.asarray(erf(values * np.sqrt(2 * (1 + t) / (light_factor(alpha, constants) + t))))


def force_of(e: ArrayLike, light: ArrayLike, constants: Constants = CONSTANTS) -> FloatArray:
    """F/(A0 E* g) at A/A0 = erf(e) by the light factor s0: `area` inverted, 2 y^2 (1 + y/t0) = e^2 (s0 + y/t0)."""
    wanted, s0, t0 = np.asarray(e, float), np.asarray(light), constants.area_t0
    # at y = e/sqrt(2) the left side is the larger, and the cubic is convex from there to its root
    y = wanted / np.sqrt(2)
    for _ in range(60):
        miss = 2 * y**2 * (1 + y / t0) - wanted**2 * (s0 + y / t0)
        slope = 4 * y + 6 * y**2 / t0 - wanted**2 / t0
        step = np.divide(miss, slope, out=np.zeros(np.shape(slope)), where=slope > 0)
        y = np.maximum(y - step, 0.3 * y)
        if (step <= 1e-15 * y).all():
            break
    return np.asarray(y)


def light_factor(alpha: ArrayLike, constants: Constants = CONSTANTS) -> FloatArray:
    """s0, the value of S at light loads."""
    return np.minimum(constants.area_s0 + constants.area_slope * np.log(np.asarray(alpha) / 10), 1.0)


@functools.cache
def _inner_integrals() -> CubicSpline:
    """ln of I_n(y) = integral from y to infinity of dP^n/y', for n in POWERS, over ln y; shape (..., 3)."""
    from scipy.interpolate import CubicSpline

    log_y = np.linspace(*LOG_Y, Y_NODES)
    node, weight = np.polynomial.legendre.leggauss(12)
    step = log_y[1] - log_y[0]
    y = np.exp(log_y[:-1, None] + step * (node + 1) / 2)
    P, dP = _cover(y)
    dP_end = _cover(np.exp(log_y))[1]
    values = []
    for n in POWERS:
        # dP^n/y' = n P^(n-1) P' d ln y'
        pieces = (n * P ** (n - 1) * dP) @ weight * step / 2
        # beyond the end the integrand falls like exp(-2 y^2): its own share of the last value
        end = n * dP_end[-1] / (4 * np.exp(2 * log_y[-1]))
        values.append(np.log(np.cumsum(np.append(pieces, end)[::-1])[::-1]))
    return CubicSpline(log_y, np.stack(values, axis=1))


def inner_integral(y: FloatArray, coefficients: FloatArray) -> FloatArray:
    """Sum of a_n I_n(y)."""
    log_y = np.log(y)
    inside = np.clip(log_y, *LOG_Y)
    total = np.exp(_inner_integrals()(inside)) @ coefficients
    # below the table I_1 is a logarithm, the others are constant
    total += coefficients[0] * np.sqrt(8 / np.pi) * (inside - log_y) * (log_y < LOG_Y[0])
    return np.where(log_y < LOG_Y[1], total, 0.0)


@dataclasses.dataclass(frozen=True, eq=False)
class Spectrum:
    """An isotropic spectrum as a quadrature rule, arrays of shape (n,)."""

    x: FloatArray  # wavenumbers over a reference q0 (any: it cancels), rising
    variance: FloatArray  # shares of h_rms^2, their sum 1
    below: FloatArray  # shares of g^2 of the waves below each x
    gradient: float  # g/(q0 h_rms)
    alpha: float  # m0 m4/m2^2

    @functools.cached_property
    def narrowness(self) -> float:
        """Harmonic over arithmetic mean wavenumber, weighted by variance: 1 for one wavelength, 0 for a broad band."""
        return float(1 / (np.sum(self.variance * self.x) * np.sum(self.variance / self.x)))

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
        )

    @classmethod
    def from_shares(cls, x: ArrayLike, variance: ArrayLike) -> Spectrum:
        """Bands of wavenumber x (each its root mean square) that hold these shares of the height variance."""
        wavenumber, share = np.asarray(x, float), np.asarray(variance, float)
        held = share > 0
        wavenumber, share = wavenumber[held], share[held] / share[held].sum()
        slopes = share * wavenumber**2
        m2 = slopes.sum()
        # a band's own waves lie half below its middle
        below = (np.cumsum(slopes) - slopes / 2) / m2
        alpha = 1.5 * np.sum(share * wavenumber**4) / m2**2
        return cls(wavenumber, share, below, float(np.sqrt(m2)), float(alpha))


@dataclasses.dataclass(frozen=True, eq=False)
class Law:
    """The curve of a spectrum, of a Gaussian surface without end or, with `h_max` [h_rms], of one that ends there."""

    spectrum: Spectrum
    h_max: float | None = None
    constants: Constants = CONSTANTS

    @functools.cached_property
    def tail(self) -> float:
        """c (1 - nu) of the tail factor."""
        return self.constants.tail * (1 - self.spectrum.narrowness)

    @functools.cached_property
    def coefficients(self) -> FloatArray:
        """Of `POWERS` in W."""
        c = self.constants
        a = c.weight + c.weight_slope * (self.spectrum.narrowness - NARROWNESS)
        return np.array([a, c.cubic, 1 - a - c.cubic])

    def _over_spectrum(self, force: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """y = F g/g(x), shape (..., n), 1/g(x) and the spectrum's weights x w/(4 g^)."""
        inverse = 1 / np.sqrt(self.spectrum.below)
        shares = self.spectrum.x * self.spectrum.variance / (4 * self.spectrum.gradient)
        return np.asarray(force, float)[..., None] * inverse, inverse, shares

    def energy(self, force: ArrayLike) -> FloatArray:
        """Elastic energy U of the endless Gaussian surface, before its tail factor."""
        y, _, shares = self._over_spectrum(force)
        P, _ = _cover(y)
        weights = sum(a * P**n for n, a in zip(POWERS, self.coefficients, strict=True))
        return np.asarray(weights @ shares)

    def separation_persson(self, force: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """u_P and du_P/d ln F, before the tail factor."""
        y, inverse, shares = self._over_spectrum(force)
        u = inner_integral(y, self.coefficients) @ (shares * inverse)
        P, dP = _cover(y)
        slope = sum(a * n * P ** (n - 1) for n, a in zip(POWERS, self.coefficients, strict=True)) * dP
        return u, -np.asarray(slope @ (shares * inverse))

    @functools.cached_property
    def _curve(self) -> tuple[FloatArray, FloatArray]:
        """ln F_P, falling, and u."""
        log_force = np.linspace(*LOG_FORCE[::-1], FORCE_NODES)
        return log_force, self.separation_persson(np.exp(log_force))[0]

    def _log_force_persson(self, u: FloatArray) -> FloatArray:
        """ln F_P(u): from the tabulated curve, then Newton's method on it."""
        log_nodes, u_nodes = self._curve
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
        return (
            (log_force - self.tail * flat**3).reshape(values.shape),
            (-1 / slope + 3 * self.tail * flat**2).reshape(values.shape),
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
        end, touching = np.exp(self.gaussian(self.h_max)[0]), gap < self.h_max
        endless = np.exp(log_gaussian)
        force = np.where(touching, endless - end, 0.0)
        return force, np.where(touching, rate * endless, 0.0)

    def separation(self, force: ArrayLike) -> FloatArray:
        """Mean separation u [h_rms] at F/(A0 E* g): the inverse of `force`."""
        given = np.asarray(force, float)
        end = 0.0 if self.h_max is None else np.exp(self.gaussian(self.h_max)[0])
        goal = np.log(given.ravel() + end)
        log_nodes, u_nodes = self._curve
        log_force = np.interp(goal, (log_nodes - self.tail * u_nodes**3)[::-1], log_nodes[::-1])
        for _ in range(30):
            u, slope = self.separation_persson(np.exp(log_force))
            step = (log_force - self.tail * u**3 - goal) / (1 - 3 * self.tail * u**2 * slope)
            log_force -= step
            if np.all(np.abs(step) < 1e-12):
                break
        return self.separation_persson(np.exp(log_force))[0].reshape(given.shape)

    def area(self, force: ArrayLike) -> FloatArray:
        """A/A0 at F/(A0 E* g)."""
        return area(force, self.spectrum.alpha, self.constants)


def mean_top_height(share: ArrayLike) -> FloatArray:
    """M_G(a) = phi(z)/a, z = -Phi^-1(a): mean height of the highest share a of a Gaussian surface [h_rms]."""
    from scipy.special import ndtri

    a = np.asarray(share, float)
    z = ndtri(a)
    result: NDArray[np.float64] = np.exp(-z * z / 2) / np.sqrt(2 * np.pi) / a
    return result
