"""The height distribution of a surface: measured, Gaussian, or of the sum of two; the highest point of an area."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

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

_TAIL = np.logspace(-6, -1, 61)[:-1]
SHARES = np.concatenate(
    [[0.0], _TAIL, np.linspace(0.1, 0.9, 81), 1 - _TAIL[::-1], [1.0]]
)  # of a surface, from its top
MIN_SHARE = 1e-300  # smallest share of a surface, above underflow
TAIL_NODES = 400  # shares at which heights are convolved
LEAST = 2.0  # h_max/h_rms above which maxima are rare
STEPS = 60  # the error of a level falls fourfold in each, or faster
ENDS = (0.16, 0.84)  # shares of surfaces below the two ends of the stated spread


@dataclasses.dataclass(frozen=True, eq=False)
class Heights:
    """The height distribution of a surface about its mean."""

    quantiles: (
        FloatArray  # above which `SHARES` of the surface lie, highest first [length]
    )
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
        scaled = values / size
        variance = float(np.mean(scaled**2))
        return cls(
            np.interp(SHARES, np.linspace(0, 1, values.size), values[::-1]),
            size * math.sqrt(variance),
            float(values[-1]),
            float(np.mean(scaled**3)) / variance**1.5,
            float(np.mean(scaled**4)) / variance**2,
            1 / values.size,
        )

    @classmethod
    def gaussian(cls, h_rms: float, h_max: float) -> Heights:
        """The distribution of a Gaussian surface with that highest point."""
        from scipy.special import ndtr, ndtri

        quantiles = np.clip(-h_rms * ndtri(SHARES), -h_max, h_max)
        return cls(
            quantiles, h_rms, h_max, 0.0, 3.0, max(float(ndtr(-h_max / h_rms)), MIN_SHARE)
        )

    def scaled(self, factor: float) -> Heights:
        """The same distribution in another unit."""
        lengths = (factor * self.quantiles, factor * self.h_rms, factor * self.h_max)
        return Heights(*lengths, self.skewness, self.kurtosis, self.top)

    def convolved(self, other: Heights) -> Heights:
        """The distribution of the sum of two independent heights; cumulants add."""
        from scipy.special import ndtr, ndtri

        # logarithms of shares weighted by variance: for two Gaussians the squares of h_max then add
        squares = np.array([self.h_rms, other.h_rms]) ** 2
        top = math.exp(float(squares @ np.log([self.top, other.top])) / squares.sum())
        h_rms = math.sqrt(squares.sum())
        if self.is_gaussian and other.is_gaussian:
            sum_of_both = Heights.gaussian(h_rms, math.hypot(self.h_max, other.h_max))
            return dataclasses.replace(sum_of_both, top=top)
        # as fine in both tails as in the middle
        edges = ndtr(np.linspace(-6.0, 6.0, TAIL_NODES + 1))
        share = (edges[1:] + edges[:-1]) / 2
        weight = np.diff(edges)
        one, two = (np.interp(share, SHARES, each.quantiles) for each in (self, other))
        sums = np.add.outer(one, two).ravel()
        weights = np.multiply.outer(weight, weight).ravel()
        order = np.argsort(-sums)
        above = np.cumsum(weights[order]) - weights[order] / 2
        deviates = ndtri(np.clip(above / weights.sum(), MIN_SHARE, 1 - 1e-16))

        def height(share: Any) -> FloatArray:
            # on normal quantiles, on which a Gaussian is straight
            return np.asarray(np.interp(ndtri(share), deviates, sums[order]))

        h_max = float(height(top))
        skewness = (
            self.skewness * self.h_rms**3 + other.skewness * other.h_rms**3
        ) / h_rms**3
        excess = (
            (self.kurtosis - 3) * self.h_rms**4 + (other.kurtosis - 3) * other.h_rms**4
        ) / h_rms**4
        quantiles = np.clip(height(np.clip(SHARES, top, 1 - top)), None, h_max)
        return Heights(quantiles, h_rms, h_max, skewness, 3 + excess, top)

    @property
    def is_gaussian(self) -> bool:
        """Whether skewness and kurtosis are exactly Gaussian, that is, the heights were not measured."""
        return self.skewness == 0 and self.kurtosis == 3


def highest_point(
    h_rms: ArrayLike, m2: ArrayLike, nominal_area: ArrayLike, probability: ArrayLike = 0.5
) -> FloatArray:
    """Height below which the highest point of a Gaussian surface lies with a probability [length]; default the median.

    The expected number of maxima above x = h/h_rms, of an area A0 and a variance m2 of a
    profile's slope (R. J. Adler, The Geometry of Random Fields, 1981), for high levels::

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
    >>> joint = Surface.from_roughness(Rq=1.0, longest=250.0, shortest=2.0, hurst=0.8, nominal_area=20e3**2)
    >>> round(float(joint.h_max), 2), highest_point(1.0, joint.m2, 20e3**2, [0.16, 0.84]).round(2)
    (5.33, array([5.13, 5.59]))
    """
    given = {
        "h_rms": h_rms,
        "m2": m2,
        "nominal_area": nominal_area,
        "probability": probability,
    }
    arrays = {name: positive_array(name, value) for name, value in given.items()}
    height = arrays["h_rms"]
    slope = arrays["m2"]
    chance = arrays["probability"]
    require("probability", chance, chance < 1, "between 0 and 1")
    area = np.broadcast_to(arrays["nominal_area"], broadcast_shape(**arrays))
    with np.errstate(over="ignore"):  # what is infinite is refused as too small an area
        reach = -np.log(chance) * (2 * math.pi) ** 1.5 * height * height / slope
        c = reach / area
    least = reach / (LEAST * math.exp(-(LEAST**2) / 2))
    allowed = (
        f"at least {float(np.max(least)):.4g}, where the highest point is at 2 h_rms"
    )
    require("nominal_area", area, area >= least, allowed)
    x = np.sqrt(-2 * np.log(np.minimum(c, 0.5)))
    for _ in range(STEPS):
        x = np.sqrt(2 * np.log(np.maximum(x, LEAST) / c))
    return np.asarray(height * x)


def of_area(
    surface: Any, nominal_area: Any, h_max: Any
) -> tuple[Any, tuple[Mapping[str, Any], ...]]:
    """h_max of a surface of that area, and its provenance."""
    if h_max is not None:
        raise InputError("h_max and nominal_area are both given: give one of them")
    if surface.labelled:
        raise InputError(
            "nominal_area is of numbers and arrays: give DataArrays h_max, of heights.highest_point"
        )
    area = finite_array(
        "nominal_area", Units(surface.unit).number("nominal_area", nominal_area)
    )
    median, *ends = (
        highest_point(surface.h_rms, surface.m2, area, chance) for chance in (0.5, *ENDS)
    )
    told = "h_max is the median over Gaussian surfaces of the nominal area; two of three are between from and to"
    # of which a theory's validity depends; it does not change with the unit of length
    longest = 2 * np.pi / np.asarray(getattr(surface, "longest", surface.q0))
    waves = np.sqrt(area) / longest
    record = {
        "step": "nominal_area",
        "nominal_area": area.tolist(),
        "from": ends[0].tolist(),
        "to": ends[1].tolist(),
    }
    record["waves_a_side"] = waves.tolist()
    return median[()], (*surface.provenance, record | {"assumed": [told]})
