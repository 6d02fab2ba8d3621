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
from scipy.interpolate import PchipInterpolator
from scipy.special import erfinv, ndtr, ndtri

from mbma_tables.arguments import FloatArray
from mbma_tables.bearing import FRACTIONS
from mbma_tables.compiled import njit

IMAGES = 0.06  # tau below which images converge faster than the series
SHARPEST = 1e-200
TERMS = 9  # of the series from there on
LINEAR, LEAST = 8.3, 1e-300  # mean gaps from which u = d, and below which all heights lie above the level
LOG_GAPS, NODES = (-12.0, math.log(8.3)), 16384  # of tabulated levels
MOST_SHARE = 0.9  # of a map's heights up to which a node stands for its own
DEPTH = 30.0  # of a map's valleys below the last node, in levels
MIN_SPACING = 0.02  # relative, of mean gaps between nodes of a map's bearing curve
CANCELS, FRACTION_TERMS = 3.0, 60
NODE, WEIGHT = np.polynomial.legendre.leggauss(8)
SETTLED = 1e-7  # of ln F, before the last step
MIN_DEPTH = 4 * np.finfo(float).eps  # relative, of separations that rounding leaves distinct
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

    area_power: float = 3.196
    area_scale: float = 0.6301
    yield_power: float = 2.426
    yield_scale: float = 0.7138
    force_light: float = 1.119
    force_eta: float = 1.767
    force_share: float = 0.4736
    frozen: float = 0.3685
    frozen_eta: float = 0.2407
    plane_eta: float = 3.375
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


def rows(*given: ArrayLike) -> tuple[FloatArray, tuple[int, ...]]:
    """What is given, broadcast and flat, and the shape."""
    arrays = [np.asarray(value, float) for value in given]
    shape = np.broadcast(*arrays).shape
    table = np.empty((len(arrays), *shape))
    for k, array in enumerate(arrays):
        table[k] = array
    return table.reshape(len(arrays), -1), shape


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_area(known: FloatArray, numbers: tuple[float, float], sign: float, out: FloatArray) -> None:
    power, scale = numbers
    for k in range(out.size):
        load, spread, cap = known[0, k], known[1, k], known[2, k]
        x = min(load / cap, 1.0)
        tau = 1.0
        if load > 0.0:
            elastic, limit = 2.0 * (load / spread) ** 2, cap**1.5 / scale
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
    """Levels d at mean gaps equally spaced in the logarithm, and their slopes by it."""
    log_gap = np.linspace(*LOG_GAPS, NODES)
    d = np.linspace(-6.0, LINEAR, 4000)
    d = np.interp(log_gap, np.log(np.exp(-d * d / 2) / np.sqrt(2 * np.pi) + d * ndtr(d)), d)
    for _ in range(4):
        gap = np.exp(-d * d / 2) / np.sqrt(2 * np.pi) + d * ndtr(d)
        d += (log_gap - np.log(gap)) * gap / ndtr(d)
    return np.stack([d, np.exp(log_gap) / ndtr(d)], axis=1)


_LEVELS = _levels()


@njit(cache=True, error_model="numpy")
def _level(u: float) -> float:
    """Level d whose mean gap is u: Hermite's cubics of ln u, to 1e-14, or Newton's method in the logarithm."""
    if u >= LINEAR:
        return u
    if u <= LEAST:
        return -math.inf
    log_u = math.log(u)
    step = (LOG_GAPS[1] - LOG_GAPS[0]) / (NODES - 1)
    place = (log_u - LOG_GAPS[0]) / step
    if place > 0.0:
        k = min(int(place), NODES - 2)
        x = place - k
        rise = _LEVELS[k + 1, 0] - _LEVELS[k, 0]
        first, last = _LEVELS[k, 1] * step - rise, rise - _LEVELS[k + 1, 1] * step
        d: float = _LEVELS[k, 0] + x * (rise + (1.0 - x) * ((1.0 - x) * first + x * last))
        return d
    d = -math.sqrt(-2.0 * log_u)
    for _ in range(30):
        gap, below = _gap(d)
        move = (math.log(gap) - log_u) * gap / below
        d -= move
        if abs(move) <= 3e-7:  # and the next one its square
            break
    return d


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_levels(u: FloatArray, out: FloatArray) -> None:
    for k in range(u.size):
        out[k] = _level(u[k])


def _levels_at(u: FloatArray) -> FloatArray:
    """`_level` of an array."""
    out = np.empty(u.size)
    _fill_levels(u.ravel(), out)
    return out.reshape(u.shape)


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
    known, shape = rows(u, np.inf if h_max is None else h_max)
    out = np.empty_like(known)
    _fill_bearing(*known, *out)
    return out[0].reshape(shape), out[1].reshape(shape)


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
        # the smallest shares are single points: nodes as close as theirs would make steps; the last one ends at valleys
        kept, last = np.zeros(gap.size, bool), h_max
        for k, own in enumerate(gap):
            if 0 < own < (1 - MIN_SPACING) * last and share[k] < MOST_SHARE:
                kept[k], last = True, own
        self._top, self._lightest, self._h_max = float(gap[kept][0]), float(share[kept][0]), h_max
        # against Gaussian heights; valleys below the last node as deep as theirs
        level, own = _levels_at(gap[kept][::-1]), -ndtri(share[kept][::-1])
        self._deepest = float(level[0]) - DEPTH
        self._level = PchipInterpolator(np.append(self._deepest, level), np.append(own[0] - DEPTH, own))
        self._rate = self._level.derivative()

    def __call__(self, u: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Q and dQ/du at mean gaps [h_rms]; straight to zero at the highest point above the first share."""
        gap = np.asarray(u, float)
        d = np.maximum(_levels_at(np.clip(gap, 0.0, self._top)), self._deepest)
        own = self._level(d)
        share, slope = ndtr(-own), -np.exp(-own * own / 2) / np.sqrt(2 * np.pi) * self._rate(d) / ndtr(d)
        steep = -self._lightest / (self._h_max - self._top)
        light, rest = gap > self._top, np.maximum(self._h_max - gap, 0.0)
        return np.where(light, -steep * rest, share), np.where(light, np.where(rest > 0, steep, 0.0), slope)


@njit(cache=True, error_model="numpy")
def _joined(
    elastic: float, stiffness: float, share: float, slope: float, cap: float, numbers: tuple[float, float, float]
) -> tuple[float, float]:
    """F, and -d ln F/du."""
    n, full = numbers[0] + numbers[1] * cap + numbers[2] * share, cap * share
    small, large = min(elastic, full), max(elastic, full)
    if small <= 0.0:
        return 0.0, 0.0
    gain = math.log(large / small)
    power = math.exp(-n * gain) if large < math.inf else 0.0
    lower = math.log1p(power) / n  # of ln F below the smaller
    weight = power / (1.0 + power)  # of the larger
    by_n = (lower + weight * gain if power > 0.0 else 0.0) / n
    by_elastic = 1.0 - weight if elastic <= full else weight
    # where the elastic force has no bound it has no weight
    rate = by_elastic * stiffness / elastic if elastic < math.inf else 0.0
    return small * math.exp(-lower), rate - ((1.0 - by_elastic) / share + numbers[2] * by_n) * slope


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_force(known: FloatArray, numbers: tuple[float, float, float], out: FloatArray) -> None:
    for k in range(known.shape[1]):
        force, rate = _joined(known[0, k], known[1, k], known[2, k], known[3, k], known[4, k], numbers)
        out[0, k], out[1, k] = force, force * rate


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
    `bracket`, at `places`; its others have lower and upper bounds of u. Rows of `known`: the wanted force, eta, the
    last gap with contact, which may be infinite, and h_rms. Forces in A0 E* g.
    """
    left = np.ones(places.size, dtype=np.bool_)
    for k in range(places.size):
        place = places[k]
        u, wanted, cap, end = bracket[0, place], known[0, place], known[1, place], known[2, place]
        force, rate = _joined(elastic[k], stiffness[k], share[k], slope[k], cap, numbers)
        miss = math.log(force / wanted)
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
        if not low < following < high:
            following = u if near else (math.sqrt(low * high) if high > 2.0 * low else 0.5 * (low + high))
        left[k] = not (near or high - low <= MIN_DEPTH * high or following == u)
        bracket[0, place] = following
    return left


@njit(cache=True, nogil=True, error_model="numpy")
def start(known: FloatArray, numbers: tuple[float, float, float], bracket: FloatArray) -> None:
    """First separations u for `newton_step`, in place of levels d above which a share F/(p_m A0) of heights lies.

    Below the elastic contact's, which are the upper bounds, and below the bearing curve's.
    """
    for k in range(known.shape[1]):
        wanted, cap, h_rms, d = known[0, k], known[1, k], known[3, k], bracket[0, k]
        low, high = bracket[1, k], bracket[2, k]
        if not 0.0 < wanted < cap < math.inf:
            continue
        x, density = wanted / cap, math.exp(-0.5 * d * d) / math.sqrt(2.0 * math.pi)
        gap = _gap(d)[0]
        # powers of u near both, joined as forces are
        steep = min(max(gap * density / (x * (1.0 - x)), 1.0), 40.0)
        n = (numbers[0] + numbers[1] * cap + numbers[2] * x) * steep
        small, large = min(high, gap * h_rms), max(high, gap * h_rms)
        u = small * (1.0 + (small / large) ** n) ** (-1.0 / n)
        bracket[0, k] = min(max(u, low), high * (1.0 - MIN_DEPTH))


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
