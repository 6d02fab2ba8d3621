"""Islands by the paper's four numbers: what the axes of the four-parameter table mean."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.core import core
from mbma_tables.surfaces.variants import Variant

SPHERE_FLOOR = 1.25  # zeta_d at the end of the axis `sphere`, below the paper's floor of 1.5


def from_axes(sphere: Any, hurst: Any) -> Any:
    """zeta_d at a coordinate of the axis `sphere`; infinite at 0."""
    with np.errstate(divide="ignore"):
        return SPHERE_FLOOR * np.asarray(sphere, dtype=float) ** (-1 / (4 - 2 * np.asarray(hurst)))


def band_fields(spread: FloatArray, sphere: FloatArray, hurst: FloatArray, variant: Variant) -> FloatArray:
    """(mu, sigma zeta_d^H, F_hat zeta_d^(1+H) per Phi_F, A_hat zeta_d^2 per Phi_A), stacked first.

    Arrays of one shape. All are finite for every zeta_d, in which powers of it cancel.
    """
    out = np.empty((4, *spread.shape))
    given = (np.ascontiguousarray(x, dtype=float) for x in (spread, sphere, hurst))
    core.four_numbers(*given, variant.density_divisor, variant.summit_sigma, out)
    return out


class Coordinates(NamedTuple):
    """Islands in the four-parameter table: in the order of its axes, and what else follows from the four numbers."""

    X: FloatArray
    spread: FloatArray
    sphere: FloatArray
    hurst: FloatArray
    mu: FloatArray
    sigma: FloatArray  # times zeta_d^H
    force: FloatArray  # F_hat per Phi_F, sigma sqrt(2 R_d sigma)
    area: FloatArray  # A_hat per Phi_A, 2 pi D R_u R_d sigma^2

    def some(self, chosen: Any) -> Coordinates:
        """The islands at these places."""
        return Coordinates(*(field[chosen] for field in self))


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
