"""The height distribution of a surface: measured, Gaussian, or of the sum of two."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, finite_array, one_number, positive_array
from mbma_tables.common.errors import InputError

_TAIL = np.logspace(-6, -1, 61)[:-1]
SHARES = np.concatenate([[0.0], _TAIL, np.linspace(0.1, 0.9, 81), 1 - _TAIL[::-1], [1.0]])  # of a surface, from its top
MIN_SHARE = 1e-300  # of a surface, as a normal number
TAIL_NODES = 400  # shares at which heights are convolved


@dataclasses.dataclass(frozen=True, eq=False)
class Heights:
    """The height distribution of a surface about its mean."""

    quantiles: FloatArray  # above which `SHARES` of the surface lie, highest first [length]
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
        return cls(quantiles, h_rms, h_max, 0.0, 3.0, max(float(ndtr(-h_max / h_rms)), MIN_SHARE))

    def scaled(self, factor: float) -> Heights:
        """The same distribution in another unit."""
        lengths = (factor * self.quantiles, factor * self.h_rms, factor * self.h_max)
        return Heights(*lengths, self.skewness, self.kurtosis, self.top)

    def convolved(self, other: Heights) -> Heights:
        """The distribution of the sum of two independent heights; cumulants add."""
        from scipy.special import ndtr, ndtri

        # as fine in both tails as in the middle
        edges = ndtr(np.linspace(-6.0, 6.0, TAIL_NODES + 1))
        share, weight = (edges[1:] + edges[:-1]) / 2, np.diff(edges)
        one, two = (np.interp(share, SHARES, each.quantiles) for each in (self, other))
        sums, weights = np.add.outer(one, two).ravel(), np.multiply.outer(weight, weight).ravel()
        order = np.argsort(-sums)
        above = np.cumsum(weights[order]) - weights[order] / 2
        deviates = ndtri(np.clip(above / weights.sum(), MIN_SHARE, 1 - 1e-16))

        def height(share: Any) -> FloatArray:
            # in the scale in which a Gaussian is straight
            return np.asarray(np.interp(ndtri(share), deviates, sums[order]))

        # logarithms of shares weighted by variance: for two Gaussians the squares of h_max then add
        squares = np.array([self.h_rms, other.h_rms]) ** 2
        top = math.exp(float(squares @ np.log([self.top, other.top])) / squares.sum())
        h_rms = math.sqrt(squares.sum())
        gaussian = self.is_gaussian and other.is_gaussian
        h_max = math.hypot(self.h_max, other.h_max) if gaussian else float(height(top))
        skewness = (self.skewness * self.h_rms**3 + other.skewness * other.h_rms**3) / h_rms**3
        excess = ((self.kurtosis - 3) * self.h_rms**4 + (other.kurtosis - 3) * other.h_rms**4) / h_rms**4
        quantiles = np.clip(height(np.clip(SHARES, top, 1 - top)), None, h_max)
        return Heights(quantiles, h_rms, h_max, skewness, 3 + excess, top)

    @property
    def is_gaussian(self) -> bool:
        """Whether skewness and kurtosis are exactly Gaussian, that is, the heights were not measured."""
        return self.skewness == 0 and self.kurtosis == 3


def one_height(h_max: Any) -> float:
    """h_max as one positive number."""
    return float(positive_array("h_max", one_number("h_max", h_max)))
