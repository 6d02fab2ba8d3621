"""Contact whose pressure cannot exceed a hardness p_m, from the elastic contact of the same surface; docs/yield.md.

eta = p_m/(E* g), g the rms gradient, x = F/(p_m A0) and F in A0 E* g. Loading only,
frictionless. The mean gap u has no negative gaps: points that yield are flattened.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator, make_interp_spline
from scipy.special import erf, erfc, erfcx, erfinv, ndtr, ndtri

from mbma_tables.common.arguments import FloatArray, answered
from mbma_tables.common.errors import InputError
from mbma_tables.common.shared import shared
from mbma_tables.surfaces.bearing_curve import FRACTIONS

# tau below which images converge faster than a series; its terms, and one
IMAGES = 0.06
TERMS = 10
# least tau; half-width over which a difference goes by powers
SHARPEST = 1e-200
NARROW = 3e-3
SEEN = 6.0  # above which erfc is below rounding of 1
MOST_SHARE = 0.9  # largest share of a map's heights in one node
DEPTH = 30.0  # deepest valleys below the last node, in levels
MIN_SPACING = 0.02  # relative, of mean gaps between nodes of a map's bearing curve
LEVELS = (
    -37.2,
    9.0,
    1500,
)  # of Gaussian heights: nodes; above, the mean gap is the level itself
LEAST_GAP = 1e-300  # mean gap at which all heights lie above the level
# the shares of heights and of elastic contact join as this power of their odds: by 0.1%
# where one is half the other
SHARPNESS = 8.0
NEGLIGIBLE = 1e-17  # part of the larger one's odds that does not change its last digit
FULLEST = 1 - 1e-12  # largest share of elastic contact, whose odds are finite
# larger values give the same force
MOST_ETA = 1e100
MOST_RATIO = 1e300
ROOT_TWO_PI = np.sqrt(2 * np.pi)


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
    # between mean planes interpenetration falls as exp(-(plane_eta - plane_load x) eta)
    plane_eta: float = 3.375
    plane_load: float = 2.505


CONSTANTS = Constants()


def area(
    force: ArrayLike,
    elastic_area: ArrayLike,
    eta: ArrayLike,
    constants: Constants = CONSTANTS,
    yielded: bool = False,
) -> FloatArray:
    """A/A0, or its yielded part, at F/(A0 E* g), at most eta, from the elastic A/A0 there; above 1 only if that is."""
    given = (force, erfinv(np.minimum(elastic_area, 1.0)), eta)
    c = constants
    if yielded:
        return answered(_area, given, 1, c.yield_power, c.yield_scale, True)[0]
    return answered(_area, given, 1, c.area_power, c.area_scale, False)[0] * np.maximum(
        elastic_area, 1.0
    )


@np.errstate(all="ignore")
def _area(
    force: FloatArray,
    e: FloatArray,
    eta: FloatArray,
    power: float,
    scale: float,
    yielded: bool,
    out: Any,
) -> None:
    """A/A0, or its yielded part, at F/(A0 E* g) by e, erf(e) being the elastic A/A0 there."""
    x = np.minimum(force / eta, 1.0)
    # tau of the elastic contact and of the hardness alone
    half = 0.5 * x / e
    limit = 0.125 / (scale * np.sqrt(eta))
    elastic = half * half
    small = np.minimum(elastic, limit)
    joint = np.exp(
        np.log1p(np.exp(power * np.log(small / np.maximum(elastic, limit)))) / (2 * power)
    )
    reach = np.where(elastic < limit, e, 0.5 * x / np.sqrt(limit)) * joint
    between = diffused(x, small / joint**2, -1.0 if yielded else 1.0, reach)
    # clip rounding; then the cases of full contact, no contact and no yielding
    if yielded:
        share = np.where(e < np.inf, np.maximum(np.minimum(between, x), 0.0), x == 1)
    else:
        share = np.where(e < np.inf, np.minimum(np.maximum(between, x), 1.0), 1.0)
    share = np.where(x > 0, share, 0.0 if yielded else np.where(force > 0, erf(e), 0.0))
    out[:] = np.where(
        (force >= 0) & (force < np.inf) & (e >= 0) & (eta > 0), share, np.nan
    )


def diffused(
    x: FloatArray, tau: FloatArray, sign: float, reach: FloatArray | None = None
) -> FloatArray:
    """Share of a diffusion from x, between walls at 0 and 1, after a variance of 2 tau.

    The share not absorbed at 0, or with a negative `sign` that absorbed at 1; `reach` is
    x/sqrt(4 tau).
    """
    over = 0.5 / np.sqrt(np.maximum(tau, SHARPEST))
    reach = x * over if reach is None else reach
    wide = tau >= IMAGES
    if sign > 0:
        found = erf(reach)
        seen = ~wide & (2 * over - reach < SEEN)
        if seen.any():
            found[seen] += _difference(2 * over[seen], reach[seen])
    else:
        found = _difference(over, reach) + _difference(3 * over, reach)
    if wide.any():
        own = x[wide]
        first = np.exp(-(np.pi**2) * tau[wide])
        # sign^n sin(n pi x), and exp(-n^2 pi^2 tau) by the odd powers between the squares
        before = np.zeros_like(own)
        sine = sign * np.sin(np.pi * own)
        twice = 2 * sign * np.cos(np.pi * own)
        odd = first
        factor = first
        total = np.zeros_like(own)
        for n in range(1, TERMS):
            total = total + sine * factor / n
            before, sine, odd = sine, twice * sine - before, odd * first * first
            factor = factor * odd
        found[wide] = own + 2 / np.pi * total
    return np.where((x >= 0) & (x <= 1) & (tau >= 0), found, np.nan)


def _difference(centre: FloatArray, half: FloatArray) -> FloatArray:
    """erfc(centre - half) - erfc(centre + half); by powers where that would cancel."""
    a = (half * centre) ** 2
    b = half**2
    series = 1 + (2 * a - b) / 3 + (a * (2 / 3 * a - 2 * b) + b * b / 2) / 5
    narrow = half * np.maximum(centre, 1.0) < NARROW
    cancelled = 4 / np.sqrt(np.pi) * half * np.exp(-centre * centre) * series
    return np.asarray(
        np.where(narrow, cancelled, erfc(centre - half) - erfc(centre + half))
    )


@np.errstate(all="ignore")
def force(
    elastic_force: ArrayLike,
    stiffness: ArrayLike,
    share: ArrayLike,
    slope: ArrayLike,
    eta: ArrayLike,
    constants: Constants = CONSTANTS,
) -> tuple[FloatArray, FloatArray]:
    """F/(A0 E* g) at a mean gap u and -dF/du, from the elastic force and stiffness there.

    `share` is Q(u), that of the heights above the level, and `slope` is dQ/du. A theory's
    own heights need not be those of Q: Persson's force falls as exp(-u), Gaussian heights
    fall as exp(-u^2/2), and at light loads its elastic contact covers more than all heights
    that lie above. What it covers without yielding is a lower bound of the share that
    bears: erf(sqrt(2) F) of the nominal area by Persson's theory, and of that the part 1 -
    exp(-2 eta^2) whose pressure in a light contact is below the hardness. So a hard contact
    is the elastic one, and a soft one follows the heights alone.
    """
    own = np.asarray(elastic_force)
    heights = np.asarray(share)
    cap = np.asarray(eta)
    c = constants
    unyielded = -np.expm1(-2 * np.minimum(cap, MOST_ETA) ** 2)
    covered = np.minimum(unyielded * erf(np.sqrt(2) * own), FULLEST)
    covered_rate = -unyielded * np.sqrt(8 / np.pi) * np.exp(-2 * own * own) * stiffness
    covered_rate = covered_rate / (covered * (1 - covered))
    heights_rate = slope / (heights * (1 - heights))
    # of the odds of both shares the larger counts, without a kink where they are equal
    log_odds = np.log(heights / (1 - heights))
    log_covered_odds = np.log(covered / (1 - covered))
    excess = np.exp(SHARPNESS * (log_covered_odds - log_odds))
    joined = np.maximum(log_odds, log_covered_odds)
    joined = joined + np.log1p(np.minimum(excess, 1 / excess)) / SHARPNESS
    bearing = 1 / (1 + np.exp(-joined))
    rate = covered_rate + (heights_rate - covered_rate) / (1 + excess)
    rate = np.where(excess < np.inf, rate, covered_rate)
    alone = ~(excess > NEGLIGIBLE) | (heights == 1)
    Q = np.where(alone, heights, bearing)
    slope_of_Q = np.where(alone, slope, bearing * (1 - bearing) * rate)

    level = np.where(cap < np.inf, cap * Q, np.inf)
    small = np.minimum(own, level)
    exponent = c.force_light + c.force_eta * np.minimum(cap, MOST_ETA) + c.force_share * Q
    # an infinite force has no weight
    gain = np.log(np.minimum(np.maximum(own, level) / small, MOST_RATIO))
    power = np.exp(-exponent * gain)
    weight = power / (1 + power)
    # ln F lies so much below that of the smaller; derivatives by the exponent, by the
    # elastic force, and by Q
    lower = np.log1p(power) / exponent
    by_elastic = np.where(own <= level, 1 - weight, weight)
    by_level = (1 - by_elastic) / Q + c.force_share * (lower + weight * gain) / exponent
    elastic_rate = np.where(own < np.inf, by_elastic * stiffness / own, 0.0)
    rate = elastic_rate - np.where(by_level > 0, by_level * slope_of_Q, 0.0)
    # without contact the force is zero
    touching = small > 0
    rest = np.where(cap > 0, small, np.nan)
    found = np.where(touching, small * np.exp(-lower), rest)
    return found, np.where(touching, found * rate, rest)


def closed(
    heights: Any,
    h_rms: FloatArray,
    gradient: FloatArray,
    eta: FloatArray,
    u: Any,
    pressure: Any,
    stiffness: Any,
) -> tuple[FloatArray, FloatArray]:
    """`force` over A0 E* at mean gaps [length] of a `BearingCurve`, or of Gaussian heights by their end."""
    x = u / h_rms
    share, slope = (
        heights(x) if isinstance(heights, BearingCurve) else bearing_share(x, heights)
    )
    load, steep = force(
        pressure / gradient, stiffness / gradient, share, slope / h_rms, eta
    )
    return load * gradient, steep * gradient


def frozen_factor(eta: ArrayLike, constants: Constants = CONSTANTS) -> FloatArray:
    """Stiffness of the frozen contact over the elastic -dF/du at the same mean gap."""
    return np.asarray(
        1 + constants.frozen * np.exp(-np.asarray(eta, float) / constants.frozen_eta)
    )


def plane_separation(
    u: ArrayLike, load: ArrayLike, eta: ArrayLike, constants: Constants = CONSTANTS
) -> FloatArray:
    """Gap between mean planes [h_rms] at mean gap u and x = F/(p_m A0): less the flattening of yielded points."""
    x = np.asarray(load, float)
    cap = np.asarray(eta, float)
    d = -ndtri(x)
    with np.errstate(invalid="ignore"):
        flattened = np.where(x > 0, np.exp(-d * d / 2) / np.sqrt(2 * np.pi) - d * x, 0.0)
    return np.asarray(
        u - flattened * np.exp(-(constants.plane_eta - constants.plane_load * x) * cap)
    )


@np.errstate(all="ignore")
def bearing_share(
    u: ArrayLike, h_max: ArrayLike | None = None
) -> tuple[FloatArray, FloatArray]:
    """Q(u), share of Gaussian heights above the level of mean gap u [h_rms], and dQ/du; with `h_max` it ends there."""
    gap = np.asarray(u, float)
    last = np.asarray(np.inf if h_max is None else h_max)
    d = _levels(gap)
    end = _level_at_end(last.item()) if last.size == 1 else _levels(last)
    below = ndtr(d)
    whole = ndtr(end)
    share = np.maximum(np.where(end > 0, ndtr(-d) - ndtr(-end), whole - below), 0.0)
    slope = np.where(
        gap <= LEAST_GAP, -np.inf, np.exp(-d * d / 2) / (-ROOT_TWO_PI * below)
    )
    return share / whole, np.where(gap >= last, 0.0, slope) / whole


@shared()
def _level_spline() -> Any:
    """Levels d of Gaussian heights by ln of the mean gaps d Phi(d) + phi(d) below them, to 1e-15."""
    d = np.linspace(*LEVELS)
    x = abs(d)
    # the gap of -x, where both terms nearly cancel; that of x is larger by x
    deep = np.exp(-x * x / 2) * (1 / ROOT_TWO_PI - x * erfcx(x / np.sqrt(2)) / 2)
    return make_interp_spline(np.log(np.maximum(d, 0.0) + deep), d, 7)


@shared(64)
def _level_at_end(h_max: float) -> Any:
    """Q(u) for one highest point, cached for inversions."""
    return _levels(np.asarray(h_max))


def _levels(u: FloatArray) -> FloatArray:
    """Levels of Gaussian heights at mean gaps [h_rms]; smaller gaps are set to `LEAST_GAP`."""
    held = np.minimum(np.maximum(u, LEAST_GAP), LEVELS[1])
    return np.asarray(_level_spline()(np.log(held)) + np.maximum(u - LEVELS[1], 0.0))


class BearingCurve:
    """Q(u) of a map's own heights: of M(a) [h_rms] of `bearing_curve`, a = `FRACTIONS`, and its highest point."""

    def __init__(self, mean_height: FloatArray, h_max: float) -> None:
        above = FRACTIONS * mean_height
        # d(a M)/da is the level z(a), and the mean gap below it is z (1 - a) + a M
        level = np.minimum.accumulate(np.diff(above) / np.diff(FRACTIONS))
        share = np.sqrt(FRACTIONS[1:] * FRACTIONS[:-1])
        gap = level * (1 - share) + np.interp(share, FRACTIONS, above)
        # the smallest shares are single points, so nodes must not be as close; the last
        # node ends at the valleys
        kept = np.zeros(gap.size, bool)
        last = h_max
        for k, own in enumerate(gap):
            if 0 < own < (1 - MIN_SPACING) * last and share[k] < MOST_SHARE:
                kept[k], last = True, own
        if not kept.any():
            raise InputError(
                f"nearly {MOST_SHARE:.0%} of the map or more is its highest point: it has no bearing curve"
            )
        self._top, self._lightest, self._h_max = (
            float(gap[kept][0]),
            float(share[kept][0]),
            h_max,
        )
        # against Gaussian heights; valleys below the last node as deep as theirs
        level = _levels(gap[kept][::-1])
        own = -ndtri(share[kept][::-1])
        self._deepest = float(level[0]) - DEPTH
        self._level = PchipInterpolator(
            np.append(self._deepest, level), np.append(own[0] - DEPTH, own)
        )
        self._rate = self._level.derivative()

    def __call__(self, u: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Q and dQ/du at mean gaps [h_rms]; straight to zero at the highest point above the first share."""
        gap = np.asarray(u, float)
        d = np.maximum(_levels(np.clip(gap, 0.0, self._top)), self._deepest)
        own = self._level(d)
        share = ndtr(-own)
        slope = -np.exp(-own * own / 2) / np.sqrt(2 * np.pi) * self._rate(d) / ndtr(d)
        steep = -self._lightest / (self._h_max - self._top)
        light = gap > self._top
        rest = np.maximum(self._h_max - gap, 0.0)
        return np.where(light, -steep * rest, share), np.where(
            light, np.where(rest > 0, steep, 0.0), slope
        )
