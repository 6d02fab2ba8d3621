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
from numpy.typing import ArrayLike, NDArray
from scipy.special import erfinv, ndtri

from mbma_tables.arguments import FloatArray
from mbma_tables.bearing_curve import BearingCurve as BearingCurve
from mbma_tables.bearing_curve import bearing_share as bearing_share
from mbma_tables.bearing_curve import rows
from mbma_tables.compiled import njit

IMAGES = 0.06  # tau below which images converge faster than the series
SHARPEST = 1e-200
TERMS, NOTHING = 9, 1e-20  # of the series from there on; a term that is less than rounding
NODE, WEIGHT = np.polynomial.legendre.leggauss(8)
SETTLED = 1e-7  # of ln F, before the last step
MIN_DEPTH = 4 * np.finfo(float).eps  # relative, of separations that rounding leaves distinct
NARROW = 0.05  # half-width over which a difference of complementary error functions is integrated


@dataclasses.dataclass(frozen=True)
class Constants:
    """The law's constants, fitted to boundary elements."""

    area_power: float = 3.196  # a and b of S for the contact area,
    area_scale: float = 0.6301
    yield_power: float = 2.426  # and for its yielded part
    yield_scale: float = 0.7138
    force_light: float = 1.119  # n0, c and d of the exponent n
    force_eta: float = 1.767
    force_share: float = 0.4736
    frozen: float = 0.3685  # e and f of the frozen contact's stiffness
    frozen_eta: float = 0.2407
    plane_eta: float = 3.375  # between mean planes interpenetration falls as exp(-(plane_eta - plane_load x) eta)
    plane_load: float = 2.505

    @property
    def exponent(self) -> tuple[float, float, float]:
        """n0, c and d."""
        return self.force_light, self.force_eta, self.force_share


CONSTANTS = Constants()


def area(force: ArrayLike, elastic_area: ArrayLike, eta: ArrayLike, constants: Constants = CONSTANTS) -> FloatArray:
    """A/A0 at F/(A0 E* g), at most eta, from the elastic A/A0 at that force."""
    return _between_walls(force, elastic_area, eta, (constants.area_power, constants.area_scale), 1.0)


def yielded_area(
    force: ArrayLike, elastic_area: ArrayLike, eta: ArrayLike, constants: Constants = CONSTANTS
) -> FloatArray:
    """Yielded part of A/A0, likewise."""
    return _between_walls(force, elastic_area, eta, (constants.yield_power, constants.yield_scale), -1.0)


def _between_walls(
    force: ArrayLike, elastic_area: ArrayLike, eta: ArrayLike, numbers: tuple[float, float], sign: float
) -> FloatArray:
    known, shape = rows(force, erfinv(np.minimum(elastic_area, 1.0)), eta)
    out = np.empty(known.shape[1])
    _fill_area(known, numbers, sign, out)
    return out.reshape(shape)


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_area(known: FloatArray, numbers: tuple[float, float], sign: float, out: FloatArray) -> None:
    power, scale = numbers
    for k in range(out.size):
        load, spread, cap = known[0, k], known[1, k], known[2, k]
        x = min(load / cap, 1.0)
        tau = 1.0
        if load > 0.0:
            elastic, limit = 2.0 * (load / spread) ** 2, cap * math.sqrt(cap) / scale
            # the smaller over the larger cannot overflow; an elastic contact that is closed has no variance left
            small, large = min(elastic, limit), max(elastic, limit)
            S = small * (1.0 + (small / large) ** power) ** (-1.0 / power)
            tau = max(S / (8.0 * cap**2), SHARPEST)
        share = diffused(x, tau, sign)
        # rounding may cross the bounds
        out[k] = min(max(share, x), 1.0) if sign > 0.0 else min(max(share, 0.0), x)


@njit(cache=True, error_model="numpy")
def diffused(x: float, tau: float, sign: float) -> float:
    """Share of a diffusion from x, between walls at 0 and 1, after a variance of 2 tau.

    What has not ended at 0, or with a negative `sign` what has ended at 1.
    """
    if tau >= IMAGES:
        first, double = math.exp(-math.pi * math.pi * tau), 2.0 * math.cos(math.pi * x)
        before, sine, factor, odd, total, turn = 0.0, math.sin(math.pi * x), first, first, 0.0, 1.0
        for n in range(1, TERMS + 1):
            turn *= sign
            total += turn * sine * factor / n
            before, sine = sine, double * sine - before
            # first^(n^2) by the odd powers between the squares
            odd *= first * first
            factor *= odd
            if factor < NOTHING:
                break
        return x + total * 2.0 / math.pi
    width = 2.0 * math.sqrt(tau)
    if sign > 0.0:
        return (math.erf(x / width) if x > 0.0 else 0.0) + _difference(2.0 / width, x / width)
    return _difference(1.0 / width, x / width) + _difference(3.0 / width, x / width)


@njit(cache=True, error_model="numpy")
def _difference(centre: float, half: float) -> float:
    """erfc(centre - half) - erfc(centre + half), to relative accuracy where half is small."""
    if half >= NARROW / max(centre, 1.0):
        return math.erfc(centre - half) - math.erfc(centre + half)
    total = 0.0
    for k in range(NODE.size):
        total += WEIGHT[k] * math.exp(-((centre + half * NODE[k]) ** 2))
    return total * half * (2.0 / math.sqrt(math.pi))


@njit(cache=True, error_model="numpy")
def _joined(
    elastic: float, stiffness: float, share: float, slope: float, cap: float, numbers: tuple[float, float, float]
) -> tuple[float, float, float]:
    """The smaller of both forces, by how much ln F lies below its logarithm, and -d ln F/du."""
    n, full = numbers[0] + numbers[1] * cap + numbers[2] * share, cap * share
    small, large = min(elastic, full), max(elastic, full)
    if small <= 0.0:
        return 0.0, 0.0, 0.0
    gain = math.log(large / small)
    power = math.exp(-n * gain) if large < math.inf else 0.0
    lower = math.log1p(power) / n  # of ln F below the smaller
    weight = power / (1.0 + power)  # of the larger
    by_n = (lower + weight * gain if power > 0.0 else 0.0) / n
    by_elastic = 1.0 - weight if elastic <= full else weight
    # where the elastic force has no bound it has no weight
    rate = by_elastic * stiffness / elastic if elastic < math.inf else 0.0
    return small, lower, rate - ((1.0 - by_elastic) / share + numbers[2] * by_n) * slope


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_force(known: FloatArray, numbers: tuple[float, float, float], out: FloatArray) -> None:
    for k in range(known.shape[1]):
        small, lower, rate = _joined(known[0, k], known[1, k], known[2, k], known[3, k], known[4, k], numbers)
        out[0, k] = small * math.exp(-lower)
        out[1, k] = out[0, k] * rate


@njit(cache=True, nogil=True, error_model="numpy")
def newton_step(
    elastic: FloatArray,
    stiffness: FloatArray,
    share: FloatArray,
    slope: FloatArray,
    known: FloatArray,
    numbers: tuple[float, float, float],
    bracket: FloatArray,
    places: NDArray[np.intp],
) -> NDArray[np.bool_]:
    """One step of some separations towards their forces; which of them are not there yet.

    `elastic` force, its `stiffness`, `share` Q and its `slope` by u are those at the gaps u in the first row of
    `bracket`, at `places`; its others have lower and upper bounds of u. Rows of `known`: the wanted force, eta and the
    last gap with contact, which may be infinite. Forces in A0 E* g.
    """
    left = np.ones(places.size, dtype=np.bool_)
    for k in range(places.size):
        place = places[k]
        u, wanted, cap, end = bracket[0, place], known[0, place], known[1, place], known[2, place]
        small, lower, rate = _joined(elastic[k], stiffness[k], share[k], slope[k], cap, numbers)
        miss = math.log(small / wanted) - lower
        if miss > 0.0:
            bracket[1, place] = u
        else:
            bracket[2, place] = u
        low, high = bracket[1, place], bracket[2, place]
        # in ln u - ln(end - u): straight at either end of contact
        rest = 1.0 - u / end
        ratio = u / rest * math.exp(min(max(miss / (rate * u * rest), -40.0), 40.0))
        following = ratio / (1.0 + ratio / end)
        # the next miss would be the square of this one
        near = abs(miss) <= SETTLED
        if near:
            following = min(max(following, low), high)
        elif not low < following < high:
            following = math.sqrt(low) * math.sqrt(high) if high > 2.0 * low else 0.5 * (low + high)
        left[k] = not (near or high - low <= MIN_DEPTH * high or following == u)
        bracket[0, place] = following
    return left


def force(
    elastic_force: ArrayLike,
    stiffness: ArrayLike,
    share: ArrayLike,
    slope: ArrayLike,
    eta: ArrayLike,
    constants: Constants = CONSTANTS,
) -> tuple[FloatArray, FloatArray]:
    """F/(A0 E* g) at a mean gap u and -dF/du, from the elastic force and stiffness, and from Q and dQ/du, there."""
    known, shape = rows(elastic_force, stiffness, share, slope, eta)
    out = np.empty((2, known.shape[1]))
    _fill_force(known, constants.exponent, out)
    return out[0].reshape(shape), out[1].reshape(shape)


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
