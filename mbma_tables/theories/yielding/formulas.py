"""Contact whose pressure cannot exceed a hardness p_m, from the elastic contact of the same surface; docs/yield.md.

eta = p_m/(E* g), g the rms gradient, x = F/(p_m A0) and F in A0 E* g. Loading only,
frictionless. The mean gap u has no negative gaps: points that yield are flattened. The
formulas are the core's, `yielding.c`.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator
from scipy.special import ndtr, ndtri

from mbma_tables.common.arguments import FloatArray, answered
from mbma_tables.common.errors import InputError
from mbma_tables.common.shared import frozen
from mbma_tables.core import core
from mbma_tables.surfaces.bearing_curve import FRACTIONS

MOST_SHARE = 0.9  # largest share of a map's heights in one node
DEPTH = 30.0  # deepest valleys below the last node, in levels
MIN_SPACING = 0.02  # relative, of mean gaps between nodes of a map's bearing curve


@dataclasses.dataclass(frozen=True)
class YieldConstants:
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


CONSTANTS = YieldConstants()


@functools.cache
def _numbers(constants: YieldConstants) -> FloatArray:
    """The constants as the core takes them, `mbma_hardness_law` of mbma.h."""
    return frozen(np.array(dataclasses.astuple(constants)))


def area(
    force: ArrayLike,
    elastic_area: ArrayLike,
    eta: ArrayLike,
    constants: YieldConstants = CONSTANTS,
    yielded: bool = False,
) -> FloatArray:
    """A/A0, or its yielded part, at F/(A0 E* g), at most eta, from the elastic A/A0 there; above 1 only if that is."""
    given = (force, elastic_area, eta)
    return answered(core.yielding_areas, given, 1, _numbers(constants), int(yielded))[0]


def diffused(x: ArrayLike, tau: ArrayLike, sign: float) -> FloatArray:
    """Share of a diffusion from x, between walls at 0 and 1, after a variance of 2 tau.

    The share not absorbed at 0, or with a negative `sign` that absorbed at 1.
    """
    return answered(core.diffused, (x, tau), 1, sign)[0]


def force(
    elastic_force: ArrayLike,
    stiffness: ArrayLike,
    share: ArrayLike,
    slope: ArrayLike,
    eta: ArrayLike,
    constants: YieldConstants = CONSTANTS,
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
    given = (elastic_force, stiffness, share, slope, eta)
    load, steep = answered(core.yielding_forces, given, 2, _numbers(constants))
    return load, steep


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
    elastic = pressure / gradient, stiffness * (h_rms / gradient)
    if isinstance(heights, BearingCurve):
        load, steep = force(*elastic, *heights(x), eta)
    else:
        last = np.inf if heights is None else heights
        given = (*elastic, x, last, eta)
        load, steep = answered(core.yielding_at_gaps, given, 2, _numbers(CONSTANTS))
    return load * gradient, steep * (gradient / h_rms)


def frozen_factor(eta: ArrayLike, constants: YieldConstants = CONSTANTS) -> FloatArray:
    """Stiffness of the frozen contact over the elastic -dF/du at the same mean gap."""
    return answered(core.frozen_factors, (eta,), 1, _numbers(constants))[0]


def plane_separation(
    u: ArrayLike, load: ArrayLike, eta: ArrayLike, constants: YieldConstants = CONSTANTS
) -> FloatArray:
    """Gap between mean planes [h_rms] at mean gap u and x = F/(p_m A0): less the flattening of yielded points."""
    return answered(core.yielding_planes, (u, load, eta), 1, _numbers(constants))[0]


def bearing_share(
    u: ArrayLike, h_max: ArrayLike | None = None
) -> tuple[FloatArray, FloatArray]:
    """Q(u), share of Gaussian heights above the level of mean gap u [h_rms], and dQ/du; with `h_max` it ends there."""
    last = np.inf if h_max is None else h_max
    share, slope = answered(core.bearing_shares, (u, last), 2)
    return share, slope


def gap_of_share(share: ArrayLike, h_max: ArrayLike) -> FloatArray:
    """u [h_rms] of which `bearing_share` is this share of Gaussian heights that end at `h_max`."""
    rest = ndtr(-_levels(h_max))
    level = -ndtri(share * (1 - rest) + rest)
    density = np.exp(-0.5 * level * level) / np.sqrt(2 * np.pi)
    return np.asarray(level * ndtr(level) + density)


def _levels(u: ArrayLike) -> FloatArray:
    """Levels of Gaussian heights at mean gaps [h_rms]."""
    return answered(core.gaussian_levels, (u,))[0]


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
