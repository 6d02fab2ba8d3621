"""Contact whose pressure cannot exceed a hardness p_m, from the elastic contact of the same surface.

With eta = p_m/(E* g), g the rms gradient, x = F/(p_m A0) and F in A0 E* g; psi = 1/eta is the plasticity index. ::

    area        pressures diffuse as in Persson's theory, between walls at 0 and at p_m:
                A       = x + (2/pi) sum        sin(n pi x)/n exp(-n^2 pi^2 tau)
                A_yield = x + (2/pi) sum (-1)^n sin(n pi x)/n exp(-n^2 pi^2 tau),   tau = S/(8 eta^2)
                S^-a = S_el^-a + (eta^1.5/b)^-a,   A_el = erf(sqrt(2) F/sqrt(S_el)) the elastic area at F,
                a and b of their own for A and for A_yield
    force       F(u)^-n = F_el(u)^-n + (eta Q(u))^-n,   n = n0 + c eta + d Q(u)
                Q(u): share of heights above the level whose mean gap is u
    stiffness   of the frozen contact, -dF_el/du(u) (1 + e exp(-eta/f)): yielded points unload elastically

Hardness is constant, loading only, frictionless; yielded volume vanishes. The mean gap u has no negative gaps: points
that yield are flattened. A, A_yield and F go over to the elastic contact as eta grows, and to the bearing curve,
A = A_yield = x and F = eta Q(u), as it falls.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator
from scipy.special import erf, erfc, erfinv, ndtr, ndtri

from mbma_tables.arguments import FloatArray
from mbma_tables.bearing import FRACTIONS
from mbma_tables.compiled import njit

IMAGES = 0.06  # tau below which images converge faster than the series
SHARPEST = 1e-200
TERMS = 9  # of the series from there on
LINEAR, LEAST = 8.3, 1e-300  # mean gaps from which u = d, and below which all heights lie above the level
LOG_GAPS, STARTS = (-12.0, math.log(8.3)), 16384  # tabulated to start from
MIN_SPACING = 0.02  # relative, of mean gaps between nodes of a map's bearing curve
CANCELS, FRACTION_TERMS = 3.0, 60
EVEN = np.polynomial.legendre.leggauss(8)
NARROW = 0.05  # half-width over which a difference of complementary error functions is integrated


@dataclasses.dataclass(frozen=True)
class Constants:
    """The law's constants, fitted to boundary elements.

    Attributes
    ----------
    area_power, area_scale, yield_power, yield_scale : float
        a and b of S, for the contact area and for its yielded part.
    force_light, force_eta, force_share : float
        n0, c and d of the exponent n.
    frozen, frozen_eta : float
        e and f of the frozen contact's stiffness.
    plane_eta, plane_load : float
        Of the gap between mean planes: mean interpenetration falls as exp(-(plane_eta - plane_load x) eta).
    """

    area_power: float = 3.203
    area_scale: float = 0.6362
    yield_power: float = 2.394
    yield_scale: float = 0.7237
    force_light: float = 1.131
    force_eta: float = 1.736
    force_share: float = 0.4839
    frozen: float = 0.3685
    frozen_eta: float = 0.252
    plane_eta: float = 3.153
    plane_load: float = 2.334


CONSTANTS = Constants()


def area(force: ArrayLike, elastic_area: ArrayLike, eta: ArrayLike, constants: Constants = CONSTANTS) -> FloatArray:
    """A/A0 at F/(A0 E* g), at most eta, from the elastic A/A0 at that force."""
    load, elastic, cap = np.broadcast_arrays(*(np.asarray(v, float) for v in (force, elastic_area, eta)))
    x = np.minimum(load / cap, 1.0)
    tau = _variance(load, elastic, cap, constants.area_power, constants.area_scale)
    # rounding may cross the bounds
    return np.clip(_not_at_zero(x, tau), x, 1.0)


def yielded_area(
    force: ArrayLike, elastic_area: ArrayLike, eta: ArrayLike, constants: Constants = CONSTANTS
) -> FloatArray:
    """Yielded part of A/A0, likewise."""
    load, elastic, cap = np.broadcast_arrays(*(np.asarray(v, float) for v in (force, elastic_area, eta)))
    x = np.minimum(load / cap, 1.0)
    tau = _variance(load, elastic, cap, constants.yield_power, constants.yield_scale)
    return np.clip(_at_cap(x, tau), 0.0, x)


def _variance(load: FloatArray, elastic: FloatArray, cap: FloatArray, power: float, scale: float) -> FloatArray:
    """tau of the capped pressures; 1 without load."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        spread = 2 * (load / erfinv(np.minimum(elastic, 1.0))) ** 2
        limit = cap**1.5 / scale
        # the smaller over the larger cannot overflow
        small, large = np.minimum(spread, limit), np.maximum(spread, limit)
        S = small * (1 + (small / large) ** power) ** (-1 / power)
        # an elastic contact that is closed has no variance left
        return np.where(load > 0, np.maximum(S / (8 * cap**2), SHARPEST), 1.0)


def _not_at_zero(x: FloatArray, tau: FloatArray) -> FloatArray:
    """Share of a diffusion from x between walls at 0 and 1 that has not ended at 0 after a variance of 2 tau."""
    out, few = np.empty(x.shape), tau < IMAGES
    start, width = x[few], 2 * np.sqrt(tau[few])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        out[few] = np.where(start > 0, erf(start / width), 0.0) + _difference(2 / width, start / width)
    out[~few] = x[~few] + _series(x[~few], tau[~few], 1.0)
    return out


def _at_cap(x: FloatArray, tau: FloatArray) -> FloatArray:
    """Share that has ended at 1."""
    out, few = np.empty(x.shape), tau < IMAGES
    start, width = x[few], 2 * np.sqrt(tau[few])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        out[few] = _difference(1 / width, start / width) + _difference(3 / width, start / width)
    out[~few] = x[~few] + _series(x[~few], tau[~few], -1.0)
    return out


def _series(x: FloatArray, tau: FloatArray, sign: float) -> FloatArray:
    out = np.empty(x.size)
    _fill_series(x, tau, sign, out)
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_series(x: FloatArray, tau: FloatArray, sign: float, out: FloatArray) -> None:
    for k in range(x.size):
        first = math.exp(-math.pi * math.pi * tau[k])
        double = 2.0 * math.cos(math.pi * x[k])
        before, sine, factor, odd, total, turn = 0.0, math.sin(math.pi * x[k]), first, first, 0.0, 1.0
        for n in range(1, TERMS + 1):
            turn *= sign
            total += turn * sine * factor / n
            before, sine = sine, double * sine - before
            # first^(n^2) by the odd powers between the squares
            odd *= first * first
            factor *= odd
        out[k] = total * 2.0 / math.pi


def _difference(centre: FloatArray, half: FloatArray) -> FloatArray:
    """erfc(centre - half) - erfc(centre + half), to relative accuracy where half is small."""
    found = np.asarray(erfc(centre - half) - erfc(centre + half))
    close = half < NARROW / np.maximum(centre, 1.0)
    middle, rate = centre[close], half[close]
    node, weight = EVEN
    found[close] = np.exp(-((middle[:, None] + rate[:, None] * node) ** 2)) @ weight * rate * (2 / np.sqrt(np.pi))
    return np.asarray(found)


@njit(cache=True, error_model="numpy")
def _gap(d: float) -> tuple[float, float]:
    """Mean gap under a plane at level d of a Gaussian surface, d Phi(d) + phi(d) [h_rms], and Phi(d)."""
    density = math.exp(-0.5 * d * d) / math.sqrt(2 * math.pi)
    if d > -CANCELS:
        below = 0.5 * math.erfc(-d / math.sqrt(2.0))
        return d * below + density, below
    # both terms nearly cancel: by the continued fraction of Mills' ratio
    rest = 0.0
    for k in range(FRACTION_TERMS, 1, -1):
        rest = k / (-d + rest)
    rest = 1.0 / (-d + rest)
    mills = 1.0 / (-d + rest)
    return density * mills * rest, density * mills


def _levels() -> FloatArray:
    """Levels at mean gaps equally spaced in the logarithm, close enough to start Newton's method."""
    d = np.linspace(-6.0, LINEAR, 4000)
    log_gap = np.log(np.exp(-d * d / 2) / np.sqrt(2 * np.pi) + d * ndtr(d))
    return np.interp(np.linspace(*LOG_GAPS, STARTS), log_gap, d)


_STARTS = _levels()


@njit(cache=True, error_model="numpy")
def _level(u: float) -> float:
    """Level d whose mean gap is u, by Newton's method in the logarithm."""
    if u >= LINEAR:
        return u
    if u <= LEAST:
        return -math.inf
    log_u = math.log(u)
    place = (log_u - LOG_GAPS[0]) * ((STARTS - 1) / (LOG_GAPS[1] - LOG_GAPS[0]))
    d: float
    if place > 0.0:
        k = min(int(place), STARTS - 2)
        d = _STARTS[k] + (place - k) * (_STARTS[k + 1] - _STARTS[k])
    else:
        d = -math.sqrt(-2.0 * log_u)
    for _ in range(30):
        gap, below = _gap(d)
        step = (math.log(gap) - log_u) * gap / below
        d -= step
        if abs(step) <= 3e-7:  # and the next one its square
            break
    return d


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_bearing(u: FloatArray, h_max: FloatArray, share: FloatArray, slope: FloatArray) -> None:
    last, end = -1.0, 0.0
    for k in range(u.size):
        if h_max[k] != last:
            last = h_max[k]
            end = 0.5 * math.erfc(_level(last) / math.sqrt(2.0)) if last < math.inf else 0.0
        if u[k] >= last:
            share[k] = slope[k] = 0.0
            continue
        d = _level(u[k])
        above = 0.5 * math.erfc(d / math.sqrt(2.0))
        share[k] = max(above - end, 0.0) / (1.0 - end)
        density = math.exp(-0.5 * d * d) / math.sqrt(2 * math.pi)
        slope[k] = -density / ((1.0 - above) if d > 0.0 else _gap(d)[1]) / (1.0 - end) if d > -math.inf else -math.inf


def bearing_share(u: ArrayLike, h_max: ArrayLike | None = None) -> tuple[FloatArray, FloatArray]:
    """Q(u), share of Gaussian heights above the level of mean gap u [h_rms], and dQ/du; with `h_max` it ends there."""
    gap, end = np.broadcast_arrays(np.asarray(u, float), np.inf if h_max is None else np.asarray(h_max, float))
    out = np.empty((2, gap.size))
    _fill_bearing(gap.flatten(), end.flatten(), *out)
    return out[0].reshape(gap.shape), out[1].reshape(gap.shape)


def gaussian_gap(share: ArrayLike) -> FloatArray:
    """Mean gap [h_rms] under the level above which a share of a Gaussian surface lies; 0 at 1."""
    d = -ndtri(np.asarray(share, float))
    with np.errstate(invalid="ignore"):
        return np.where(d > -np.inf, np.maximum(d * ndtr(d) + np.exp(-d * d / 2) / np.sqrt(2 * np.pi), 0.0), 0.0)


class BearingCurve:
    """Q(u) of a map's own heights.

    Parameters
    ----------
    mean_height : numpy.ndarray, shape (91,)
        M(a) of `mbma_tables.bearing` [h_rms], a = `FRACTIONS`.
    h_max : float
        Highest point [h_rms].
    """

    def __init__(self, mean_height: FloatArray, h_max: float) -> None:
        above = FRACTIONS * mean_height
        # d(a M)/da is the level z(a), and the mean gap below it is z (1 - a) + a M
        level = np.minimum.accumulate(np.diff(above) / np.diff(FRACTIONS))
        share = np.sqrt(FRACTIONS[1:] * FRACTIONS[:-1])
        gap = level * (1 - share) + np.interp(share, FRACTIONS, above)
        # the highest shares are single points: nodes as close as theirs would make steps
        kept, last = np.zeros(gap.size, bool), h_max
        for k, own in enumerate(gap):
            if 0 < own < (1 - MIN_SPACING) * last:
                kept[k], last = True, own
        self._top, self._lightest, self._h_max = float(gap[kept][0]), float(share[kept][0]), h_max
        self._log_share = PchipInterpolator(
            np.append(0.0, gap[kept][::-1]), np.append(0.0, np.log(share[kept][::-1])), extrapolate=False
        )
        self._rate = self._log_share.derivative()

    def __call__(self, u: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Q and dQ/du at mean gaps [h_rms]; straight to zero at the highest point above the first share."""
        gap = np.asarray(u, float)
        inside = np.clip(gap, 0.0, self._top)
        share = np.exp(self._log_share(inside))
        steep = -self._lightest / (self._h_max - self._top)
        light, rest = gap > self._top, np.maximum(self._h_max - gap, 0.0)
        return np.where(light, -steep * rest, share), np.where(
            light, np.where(rest > 0, steep, 0.0), share * self._rate(inside)
        )


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_force(
    elastic: FloatArray, share: FloatArray, cap: FloatArray, numbers: tuple[float, float, float], out: FloatArray
) -> None:
    for k in range(elastic.size):
        Q = share[k]
        n, full = numbers[0] + numbers[1] * cap[k] + numbers[2] * Q, cap[k] * Q
        small, large = min(elastic[k], full), max(elastic[k], full)
        if small <= 0.0:
            out[0, k], out[1, k], out[2, k] = 0.0, 1.0, 0.0
            continue
        gain = math.log(large / small)
        power = math.exp(-n * gain) if large < math.inf else 0.0
        lower = math.log1p(power) / n  # of ln F below the smaller
        weight = power / (1.0 + power)  # of the larger
        by_n = (lower + weight * gain if power > 0.0 else 0.0) / n
        out[0, k] = small * math.exp(-lower)
        out[1, k] = 1.0 - weight if elastic[k] <= full else weight
        out[2, k] = (1.0 - out[1, k]) / Q + numbers[2] * by_n


def force(
    elastic_force: ArrayLike, share: ArrayLike, eta: ArrayLike, constants: Constants = CONSTANTS
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """F/(A0 E* g) at a mean gap from the elastic force and Q there, and d ln F by d ln F_el and by dQ."""
    elastic, Q, cap = np.broadcast_arrays(*(np.asarray(v, float) for v in (elastic_force, share, eta)))
    out = np.empty((3, elastic.size))
    numbers = (constants.force_light, constants.force_eta, constants.force_share)
    _fill_force(elastic.flatten(), Q.flatten(), cap.flatten(), numbers, out)
    return out[0].reshape(Q.shape), out[1].reshape(Q.shape), out[2].reshape(Q.shape)


def frozen_factor(eta: ArrayLike, constants: Constants = CONSTANTS) -> FloatArray:
    """Stiffness of the frozen contact over the elastic -dF/du at the same mean gap."""
    return np.asarray(1 + constants.frozen * np.exp(-np.asarray(eta, float) / constants.frozen_eta))


def plane_separation(u: ArrayLike, load: ArrayLike, eta: ArrayLike, constants: Constants = CONSTANTS) -> FloatArray:
    """Gap between mean planes [h_rms] at mean gap u and x = F/(p_m A0): less by what yielded points are flattened."""
    x, cap = np.asarray(load, float), np.asarray(eta, float)
    d = -ndtri(x)
    with np.errstate(invalid="ignore"):
        flattened = np.where(x > 0, np.exp(-d * d / 2) / np.sqrt(2 * np.pi) - d * x, 0.0)
    return np.asarray(u - flattened * np.exp(-(constants.plane_eta - constants.plane_load * x) * cap))
