"""The height distribution of a surface, and the highest point of an area.

Distributions are measured, Gaussian, or of the sum of two.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import (
    FloatArray,
    broadcast_shape,
    finite_array,
    positive_array,
    require,
)
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import Units

if TYPE_CHECKING:
    from mbma_tables.surfaces.any_surface import AnySurface

_TAIL = np.logspace(-6, -1, 61)[:-1]
SHARES = np.concatenate(
    [[0.0], _TAIL, np.linspace(0.1, 0.9, 81), 1 - _TAIL[::-1], [1.0]]
)  # of a surface, from its top
MIN_SHARE = 1e-300  # smallest share of a surface, above underflow
LEAST = 2.0  # h_max/h_rms above which maxima are rare


@dataclasses.dataclass(frozen=True, eq=False)
class Heights:
    """The height distribution of a surface about its mean."""

    # above which `SHARES` of the surface lie, highest first [length]
    quantiles: FloatArray
    h_rms: float
    h_max: float
    skewness: float  # 0 if Gaussian
    kurtosis: float  # 3 if Gaussian
    top: float  # share of the surface represented by its highest point

    @classmethod
    def of(cls, heights: ArrayLike) -> Heights:
        """The distribution of sampled heights, of any shape and mean."""
        values = np.sort(finite_array("heights", heights), axis=None)
        values = values - values.mean()
        size = float(np.abs(values).max())
        if not size > 0:
            raise InputError("heights are all the same: without their mean they are zero")
        # of order one, so that their powers neither underflow nor overflow
        scaled = values / size
        variance = float(np.mean(scaled**2))
        third = float(np.mean(scaled**3))
        fourth = float(np.mean(scaled**4))
        share_above = np.linspace(0, 1, values.size)
        return cls(
            quantiles=np.interp(SHARES, share_above, values[::-1]),
            h_rms=size * math.sqrt(variance),
            h_max=float(values[-1]),
            skewness=third / variance**1.5,
            kurtosis=fourth / variance**2,
            top=1 / values.size,
        )

    @classmethod
    def gaussian(cls, h_rms: float, h_max: float) -> Heights:
        """The distribution of a Gaussian surface with that highest point."""
        from scipy.special import ndtr, ndtri

        quantiles = np.clip(-h_rms * ndtri(SHARES), -h_max, h_max)
        top = max(float(ndtr(-h_max / h_rms)), MIN_SHARE)
        return cls(quantiles, h_rms, h_max, skewness=0.0, kurtosis=3.0, top=top)

    def scaled(self, factor: float) -> Heights:
        """The same distribution in another unit."""
        return dataclasses.replace(
            self,
            quantiles=factor * self.quantiles,
            h_rms=factor * self.h_rms,
            h_max=factor * self.h_max,
        )

    def convolved(self, other: Heights) -> Heights:
        """The distribution of the sum of two independent heights; cumulants add."""
        # logarithms of shares weighted by variance: for two Gaussians the squares of h_max
        # then add
        variances = np.array([self.h_rms, other.h_rms]) ** 2
        variance = variances.sum()
        log_shares = np.log([self.top, other.top])
        top = math.exp(float(variances @ log_shares) / variance)
        h_rms = math.sqrt(variance)
        if self.is_gaussian and other.is_gaussian:
            sum_of_both = Heights.gaussian(h_rms, math.hypot(self.h_max, other.h_max))
            return dataclasses.replace(sum_of_both, top=top)
        shares = np.clip(SHARES, top, 1 - top)
        highest, *quantiles = _sum_above(self, other, np.append(top, shares))
        # third cumulants, and fourth ones without those of Gaussians
        third = self.skewness * self.h_rms**3 + other.skewness * other.h_rms**3
        fourth_of_self = (self.kurtosis - 3) * self.h_rms**4
        fourth_of_other = (other.kurtosis - 3) * other.h_rms**4
        excess = (fourth_of_self + fourth_of_other) / h_rms**4
        return Heights(
            quantiles=np.clip(quantiles, None, highest),
            h_rms=h_rms,
            h_max=float(highest),
            skewness=third / h_rms**3,
            kurtosis=3 + excess,
            top=top,
        )

    @property
    def is_gaussian(self) -> bool:
        """Whether skewness and kurtosis are exactly Gaussian: the heights were not measured."""
        return self.skewness == 0 and self.kurtosis == 3


def _sum_above(one: Heights, other: Heights, shares: FloatArray) -> FloatArray:
    """Heights of the sum of two independent ones above which shares of it lie."""
    from scipy.special import ndtr, ndtri

    # 400 shares of each, as fine in both tails as in the middle
    edges = ndtr(np.linspace(-6.0, 6.0, 400 + 1))
    middle = (edges[1:] + edges[:-1]) / 2
    weight = np.diff(edges)
    heights = np.interp(middle, SHARES, one.quantiles)
    heights_of_other = np.interp(middle, SHARES, other.quantiles)
    sums = np.add.outer(heights, heights_of_other).ravel()
    weights = np.multiply.outer(weight, weight).ravel()
    falling = np.argsort(-sums)
    above = np.cumsum(weights[falling]) - weights[falling] / 2
    # on normal quantiles, on which a Gaussian is straight
    deviates = ndtri(np.clip(above / weights.sum(), MIN_SHARE, 1 - 1e-16))
    return np.asarray(np.interp(ndtri(shares), deviates, sums[falling]))


def highest_point(
    h_rms: ArrayLike, m2: ArrayLike, nominal_area: ArrayLike, probability: ArrayLike = 0.5
) -> FloatArray:
    """Height below which the highest point of a Gaussian surface lies with a probability.

    In the unit of length; the median by default. The expected number of maxima above
    x = h/h_rms, of an area A0 and a variance m2 of a profile's slope (R. J. Adler, The
    Geometry of Random Fields, 1981), for high levels::

        N(x) = A0 (m2/h_rms^2) (2 pi)^(-3/2) x exp(-x^2/2),    P(max < x) = exp(-N(x))

    Parameters
    ----------
    h_rms, m2, nominal_area : array_like
        Root-mean-square height [length], variance of a profile's slope, A0 [length^2]: so
        large that the highest point is above 2 h_rms.
    probability : array_like
        In (0, 1).

    Examples
    --------
    A joint of 20 mm x 20 mm with wavelengths up to 250 um [um]:

    >>> from mbma_tables import Surface
    >>> from mbma_tables.surfaces.heights import highest_point
    >>> area = 20e3**2
    >>> joint = Surface.from_roughness(
    ...     Rq=1.0, longest=250.0, shortest=2.0, hurst=0.8, nominal_area=area
    ... )
    >>> round(float(joint.h_max), 2)
    5.33
    >>> highest_point(1.0, joint.m2, area, [0.16, 0.84]).round(2)
    array([5.13, 5.59])
    """
    arguments = {
        "h_rms": h_rms,
        "m2": m2,
        "nominal_area": nominal_area,
        "probability": probability,
    }
    arrays = {name: positive_array(name, value) for name, value in arguments.items()}
    height = arrays["h_rms"]
    slope = arrays["m2"]
    chance = arrays["probability"]
    require("probability", chance, chance < 1, "between 0 and 1")
    area = np.broadcast_to(arrays["nominal_area"], broadcast_shape(**arrays))
    # N = -ln P is solved for x = sqrt(2 ln(x/c))
    with np.errstate(over="ignore"):  # what is infinite is refused as too small an area
        reach = -np.log(chance) * (2 * math.pi) ** 1.5 * height * height / slope
        c = reach / area
    least = reach / (LEAST * math.exp(-(LEAST**2) / 2))
    at_least = float(np.max(least))
    allowed = f"at least {at_least:.4g}, where the highest point is at 2 h_rms"
    require("nominal_area", area, area >= least, allowed)
    x = np.sqrt(-2 * np.log(np.minimum(c, 0.5)))
    # Newton's method for x^2/2 - ln x + ln c, which is convex
    log_c = np.log(c)
    for _ in range(60):
        miss = 0.5 * x * x - np.log(x) + log_c
        step = miss / (x - 1 / x)
        x = np.maximum(x - step, LEAST)
        # what is left is about the square of this
        if (np.abs(step) <= 1e-9 * x).all():
            break
    return np.asarray(height * x)


def of_area(
    surface: AnySurface, nominal_area: Any, h_max: Any
) -> tuple[Any, tuple[Mapping[str, Any], ...]]:
    """h_max of a surface of that area, and its provenance."""
    if h_max is not None:
        raise InputError("h_max and nominal_area are both given: give one of them")
    if surface.labelled:
        raise InputError(
            "nominal_area is of numbers and arrays: give DataArrays h_max, "
            "of heights.highest_point"
        )
    number = Units(surface.unit).number("nominal_area", nominal_area)
    area = finite_array("nominal_area", number)
    # two of three surfaces are between low, which needs the largest area, and high
    low = highest_point(surface.h_rms, surface.m2, area, 0.16)
    chances = np.reshape([0.5, 0.84], (2, *[1] * low.ndim))
    median, high = highest_point(surface.h_rms, surface.m2, area, chances)
    assumption = (
        "h_max is the median over Gaussian surfaces of the nominal area; two of three are "
        "between from and to"
    )
    # of which a theory's validity depends; it does not change with the unit of length
    longest = 2 * np.pi / np.asarray(getattr(surface, "longest", surface.q0))
    waves = np.sqrt(area) / longest
    record = {
        "step": "nominal_area",
        "nominal_area": area.tolist(),
        "from": low.tolist(),
        "to": high.tolist(),
        "waves_a_side": waves.tolist(),
        "assumed": [assumption],
    }
    return median[()], (*surface.provenance, record)
