"""Islands by the paper's four numbers: the axes of the four-parameter table."""

from typing import NamedTuple

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.surfaces.spectrum import BROADENING, RADIUS
from mbma_tables.surfaces.variants import Variant

MOST_WIDTH = 700.0  # largest (4 - 2H) ln(zeta_u/zeta_d), so that its exponential is finite
SPHERE_FLOOR = 1.25  # zeta_d at the end of the axis `sphere`, below the paper's floor of 1.5


def band_fields(spread: FloatArray, sphere: FloatArray, hurst: FloatArray, variant: Variant) -> FloatArray:
    """(mu, sigma zeta_d^H, F_hat zeta_d^(1+H) per Phi_F, A_hat zeta_d^2 per Phi_A), stacked first.

    Arrays of one shape. All are finite for every zeta_d, because its powers cancel; NaN unless zeta_u > zeta_d.
    """
    from scipy.special import exprel

    with np.errstate(all="ignore"):
        power, width = 4 - 2 * hurst, np.log1p(spread)
        # zeta_d^(-p), and integrals of r^(order - 2H - 1) over the band and its width
        inverse, growth = sphere * SPHERE_FLOOR**-power, [exprel((k - 2 * hurst) * width) for k in (0, 2, 4)]
        D = 0.75 * (growth[2] / growth[1]) / variant.density_divisor
        # alpha = 1.5 g0 g4/g2^2, Eq. (3), grouped so that nothing overflows
        narrowness = growth[1] / growth[0] * (growth[1] / growth[2])
        share = 1 - (BROADENING / 1.5 * narrowness if variant.summit_sigma else 0.0)
        sigma = np.sqrt(share * (2 * hurst * width * growth[0]))
        scale, top = 0.75 * hurst / power, np.exp(power * width)
        R_d, R_u = (RADIUS / np.sqrt(scale * (end - inverse)) for end in (1.0, top))
        mu = 8 / 3 * D * sigma * np.sqrt(2 * R_u * R_d)
        found = np.array([mu, sigma, sigma * np.sqrt(2 * R_d * sigma), 2 * np.pi * D * R_u * R_d * sigma**2])
        good = (spread > 0) & (sphere >= 0) & (np.abs(power * width) < MOST_WIDTH) & (mu > 0)
    return np.where(good, found, np.nan)


class Coordinates(NamedTuple):
    """Islands in the four-parameter table: coordinates in the order of its axes, and derived quantities."""

    X: FloatArray
    spread: FloatArray
    sphere: FloatArray
    hurst: FloatArray
    mu: FloatArray
    sigma: FloatArray  # times zeta_d^H
    force: FloatArray  # F_hat per Phi_F, sigma sqrt(2 R_d sigma)
    area: FloatArray  # A_hat per Phi_A, 2 pi D R_u R_d sigma^2


def to_axes(
    delta_over_h_rms: FloatArray, zeta_d: FloatArray, zeta_u: FloatArray, hurst: FloatArray, variant: Variant
) -> Coordinates:
    """Table coordinates of the paper's four numbers, flat arrays with zeta_u > zeta_d."""
    spread = (zeta_u - zeta_d) / zeta_d
    sphere = (SPHERE_FLOOR / zeta_d) ** (4 - 2 * hurst)
    mu, sigma, force, area = band_fields(spread, sphere, hurst, variant)
    wide = zeta_d**hurst
    X = (delta_over_h_rms * wide - 1) / sigma
    return Coordinates(X, spread, sphere, hurst, mu, sigma, force / (zeta_d * wide), area / zeta_d**2)
