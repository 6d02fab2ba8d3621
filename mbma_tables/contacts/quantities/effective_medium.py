"""Flow through the gaps of a rough contact: an effective medium of gaps, a closed form; see docs/leakage.md.

Lengths are in h_rms: flow per length of seal is k h_rms^3 (p1 - p2)/(12 viscosity width).
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, answered
from mbma_tables.common.shared import shared, shared_property
from mbma_tables.core import core
from mbma_tables.theories.calibrated.formulas import (
    CONSTANTS,
    CalibratedConstants,
    Spectrum,
    SpectrumLaw,
    area,
    force_at_area,
    light_factor,
)

LARGEST_AREA = 0.3  # above it cells of one spectrum differ by factors
BANDS = 64  # bands of a spectrum, graded towards both ends
# quadrature in ln(h/s), from u1/s - 8 or 1e-6 to u1/s + 8
NODES = 80
LOWEST_GAP = 1e-6
REACH = 8.0
NO_SLOPE = 1e-12  # share of the squared gradient that the last bands hold at least
# share of the surface between two magnifications: the mean gap of fewer is a difference of two
# means that is mostly rounding
NO_COVER = 1e-8
NEAREST = 1e-4  # least distance of A/A0 to the threshold


def wide_gap(u: ArrayLike) -> FloatArray:
    """k/u^3 of Gaussian gaps of mean u [h_rms] without contact: 1 - 1.5/(u^2 + 4), within 0.4% from u = 2.5 on."""
    return 1 - 1.5 / (np.asarray(u, float) ** 2 + 4)


@dataclasses.dataclass(frozen=True)
class FlowConstants:
    """Constants of the flow."""

    threshold: float = 0.415  # Ac, the contact fraction at which gaps no longer percolate
    obstruction: float = 0.89  # m, of contact below it
    prefactor: float = 0.77  # of the closed form prefactor u^3 (1 - A/Ac)^exponent
    exponent: float = 3.04
    # of contacts that yield, whose patches are compact and leave wider channels: what a
    # contact that yields everywhere adds to the threshold and to the power of its area, and
    # the power of its yielded share with which both grow
    yielded_threshold: float = 0.17
    yielded_exponent: float = 0.2
    yielded_power: float = 6.7

    def elastic_area(self, area: ArrayLike, yielded: ArrayLike) -> FloatArray:
        """A/A0 of the elastic contact that obstructs flow as one does of which a share is at its hardness."""
        numbers = np.array(dataclasses.astuple(self))
        return answered(core.flow_areas, (area, yielded), 1, numbers)[0]

    def closed_form(self, u: ArrayLike, area: ArrayLike) -> FloatArray:
        """k at mean gaps u [h_rms] and A/A0 without a spectrum, for zeta_1 up to 32; 0 at and above the threshold."""
        left = np.maximum(1 - np.asarray(area, float) / self.threshold, 0)
        return np.asarray(
            self.prefactor * np.asarray(u, float) ** 3 * left**self.exponent
        )

    def obstructed(self, area: ArrayLike) -> FloatArray:
        """Contribution of the contact to the balance of an effective medium."""
        return np.asarray(
            (1 - self.threshold)
            * (np.asarray(area, float) / self.threshold) ** self.obstruction
        )


@shared()
def _rule() -> tuple[FloatArray, FloatArray]:
    """Gauss's nodes in [-1, 1] and their weights, which take longer to find than the gaps at them."""
    return np.polynomial.legendre.leggauss(NODES)


@dataclasses.dataclass(frozen=True, eq=False)
class GapStatistics:
    """Gaps of the endless Gaussian surface by the calibrated law, at a row of loads."""

    # of the surface that leaves contact within a band of magnification, (loads, bands),
    share: FloatArray
    mean: FloatArray  # and u1 of it [h_rms]
    spread: FloatArray  # rms height of the wavenumbers above each band [h_rms]
    area: FloatArray  # A/A0 at each load,
    separation: FloatArray  # and mean gap [h_rms]

    @shared_property
    def quadrature(self) -> tuple[FloatArray, FloatArray]:
        """Shares of the surface and ln h^3 of gaps there [h_rms^3], shape (loads, points)."""
        centre = self.mean / self.spread
        low = np.log(np.maximum(centre - REACH, LOWEST_GAP))
        high = np.log(centre + REACH)
        node, weight = _rule()
        half = (high - low)[..., None] / 2
        t = np.exp(low[..., None] + half * (1 + node))
        density = np.exp(-((t - centre[..., None]) ** 2) / 2) + np.exp(
            -((t + centre[..., None]) ** 2) / 2
        )
        share = self.share[..., None] * density * t * half * weight / np.sqrt(2 * np.pi)
        rows = len(self.area)
        return share.reshape(rows, -1), 3 * np.log(t * self.spread[:, None]).reshape(
            rows, -1
        )


def _shares(spectrum: Spectrum) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Variance, gradient's square and x times variance of bands graded towards both ends of a spectrum."""
    log_x = np.log(spectrum.x / spectrum.x[0])
    edges = log_x[-1] * 0.5 * (1 - np.cos(np.pi * np.arange(BANDS + 1) / BANDS))
    band = np.clip(np.searchsorted(edges, log_x, side="right") - 1, 0, BANDS - 1)
    x = spectrum.x
    variance = spectrum.variance
    parts = [
        np.bincount(band, v, BANDS).astype(float)
        for v in (variance, variance * x**2, variance * x)
    ]
    # the last wavenumbers of a map may be rounding errors
    held = (parts[0] > 0) & (np.cumsum(parts[1][::-1])[::-1] > NO_SLOPE * parts[1].sum())
    return parts[0][held], parts[1][held] / parts[1].sum(), parts[2][held]


def gaps(
    spectrum: Spectrum, force: ArrayLike, constants: CalibratedConstants = CONSTANTS
) -> GapStatistics:
    """Gaps at loads F/(A0 E* g), magnification by magnification."""
    variance, slope, wave = _shares(spectrum)
    load = np.asarray(force, float)[:, None]
    below = np.append(0.0, np.cumsum(slope))
    below[-1] = 1.0
    with np.errstate(divide="ignore"):
        cover = area(np.minimum(load / np.sqrt(below), 1e8), spectrum.alpha, constants)
    above = np.append(np.cumsum(variance[::-1])[::-1], 0.0)
    spread = np.sqrt(above[:-1])
    mean = np.zeros((load.size, variance.size + 1))
    middle = (below[:-1] + below[1:]) / 2
    for first in range(variance.size):
        # wavenumbers from this band on as a spectrum of their own, lengths over `spread`,
        # loads over its gradient
        left = 1 - below[first]
        part = Spectrum(
            wave[first:] / variance[first:],
            variance[first:] / spread[first] ** 2,
            (middle[first:] - below[first]) / left,
            math.sqrt(left) * spectrum.gradient / spread[first],
            spectrum.alpha,
        )
        carried = load[:, 0] / cover[:, first] / math.sqrt(left)
        mean[:, first] = (
            SpectrumLaw(part, None, constants).separation(carried) * spread[first]
        )
    share = cover[:, :-1] - cover[:, 1:]
    volume = mean * cover
    open_ = np.maximum(volume[:, :-1] - volume[:, 1:], 0)
    touched = share > NO_COVER
    return GapStatistics(
        np.where(touched, share, 0.0),
        np.divide(open_, share, out=np.zeros(share.shape), where=touched),
        np.sqrt((above[1:] + above[:-1]) / 2),
        cover[:, -1],
        mean[:, 0],
    )


def contact_factor(
    spectrum: Spectrum,
    contact: ArrayLike,
    flow: FlowConstants,
    constants: CalibratedConstants = CONSTANTS,
) -> FloatArray:
    """ln R at contact fractions A/A0 above zero and below the threshold."""
    load = force_at_area(contact, light_factor(spectrum.alpha, constants), constants)
    return log_factor(gaps(spectrum, load, constants), flow)


def log_factor(found: GapStatistics, flow: FlowConstants) -> FloatArray:
    """ln R for the gaps of a spectrum, scaled by their mean; -infinity where blocked."""
    share, log_cube = found.quadrature
    mean = np.sum(share * np.exp(log_cube / 3), axis=1)
    log_k = effective_medium(
        share, log_cube, flow.obstructed(np.minimum(found.area, flow.threshold - NEAREST))
    )
    factor = log_k - 3 * np.log(mean) - np.log(wide_gap(found.separation))
    return np.where(found.area < flow.threshold, factor, -np.inf)


def effective_medium(
    share: FloatArray, log_cube: FloatArray, blocked: FloatArray
) -> FloatArray:
    """Solution ln k of sum share (h^3 - k)/(h^3 + k) = blocked."""
    from scipy.optimize.elementwise import find_root

    def miss(log_k: FloatArray, load: FloatArray) -> FloatArray:
        row = load.astype(int)
        return np.asarray(
            np.sum(share[row] * np.tanh((log_cube[row] - log_k[..., None]) / 2), axis=-1)
            - blocked[row]
        )

    return np.asarray(
        find_root(
            miss,
            (log_cube.min(axis=1), log_cube.max(axis=1)),
            args=(np.arange(float(len(share))),),
        ).x
    )
