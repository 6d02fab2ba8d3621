"""Islands by the paper's four numbers: what the axes of the four-parameter table mean."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import njit
from mbma_tables.islands.geometry import summit_sigma
from mbma_tables.surfaces.readings import Reading
from mbma_tables.surfaces.spectrum import RADIUS, alpha_of, m0_of, m4_of, summit_rate

SPHERE_FLOOR = 1.25  # zeta_d at the end of the axis `sphere`, below the paper's floor of 1.5


def from_axes(sphere: Any, hurst: Any) -> Any:
    """zeta_d at a coordinate of the axis `sphere`; infinite at 0."""
    with np.errstate(divide="ignore"):
        return SPHERE_FLOOR * np.asarray(sphere, dtype=float) ** (-1 / (4 - 2 * np.asarray(hurst)))


@njit(cache=True, error_model="numpy")
def band_of_axes(
    spread: float, sphere: float, hurst: float, divisor: float, summits: bool
) -> tuple[float, float, float]:
    """(mu, sigma zeta_d^H, mu/sqrt(spread)): finite for every zeta_d, in which powers of it cancel.

    mu = (8/3) D sigma sqrt(2 R_u R_d), Eqs. (26), (29), (32); with r = zeta_u/zeta_d and R = RADIUS/sqrt(m4),
    m4 over [1, zeta] is 3 H zeta^p (1 - zeta^(-p))/(4 p), p = 4 - 2H.
    """
    width = math.log1p(spread)
    power = 4.0 - 2.0 * hurst
    inverse = sphere * math.pow(1.25, -power)  # zeta_d^(-p)
    D = summit_rate(hurst, 0.0, width) / divisor
    sigma = summit_sigma(m0_of(hurst, 0.0, width), alpha_of(hurst, width), summits)
    scale = 0.75 * hurst / power
    m4_d = scale * (1.0 - inverse)
    m4_u = scale * (math.exp(power * width) - inverse)
    mu = 8.0 / 3.0 * D * sigma * RADIUS * math.sqrt(2.0) / math.pow(m4_d * m4_u, 0.25)
    return mu, sigma, mu / math.sqrt(spread)


@njit(cache=True, nogil=True)
def _fill(
    spread: FloatArray, sphere: FloatArray, hurst: FloatArray, divisor: float, summits: bool, out: FloatArray
) -> None:
    for k in range(spread.size):
        out[0, k], out[1, k], out[2, k] = band_of_axes(spread[k], sphere[k], hurst[k], divisor, summits)


def band_fields(spread: FloatArray, sphere: FloatArray, hurst: FloatArray, reading: Reading) -> FloatArray:
    """`band_of_axes` of arrays of one shape, stacked first."""
    out = np.empty((3, spread.size))
    a, b, c = (np.ascontiguousarray(x, dtype=float).ravel() for x in (spread, sphere, hurst))
    _fill(a, b, c, reading.density_divisor, reading.summit_sigma, out)
    return out.reshape((3, *spread.shape))


class Coordinates(NamedTuple):
    """Islands in the four-parameter table: in the order of its axes, and what else follows from the four numbers."""

    X: FloatArray
    spread: FloatArray
    sphere: FloatArray
    hurst: FloatArray
    mu: FloatArray
    sigma: FloatArray  # times zeta_d^H

    def some(self, chosen: Any) -> Coordinates:
        """The islands at these places."""
        return Coordinates(*(field[chosen] for field in self))


def to_axes(
    delta_over_h_rms: FloatArray, zeta_d: FloatArray, zeta_u: FloatArray, hurst: FloatArray, reading: Reading
) -> Coordinates:
    """Table coordinates of the paper's four numbers, flat arrays with zeta_u > zeta_d."""
    spread = (zeta_u - zeta_d) / zeta_d
    sphere = (SPHERE_FLOOR / zeta_d) ** (4 - 2 * hurst)
    mu, sigma, _ = band_fields(spread, sphere, hurst, reading)
    return Coordinates((delta_over_h_rms * zeta_d**hurst - 1) / sigma, spread, sphere, hurst, mu, sigma)


def hat_scales(
    spread: FloatArray, zeta_d: FloatArray, hurst: FloatArray, sigma: FloatArray, reading: Reading
) -> tuple[FloatArray, FloatArray]:
    """F_hat per Phi_F, sigma sqrt(2 R_d sigma), and A_hat per Phi_A, 2 pi D R_u R_d sigma^2."""
    width, log_d = np.log1p(spread), np.log(zeta_d)
    out = np.empty((3, spread.size))
    _fill_radii(width, log_d, hurst, reading.density_divisor, out)
    R_d, R_u, D = out
    own = sigma * zeta_d**-hurst
    return own * np.sqrt(2 * R_d * own), 2 * math.pi * D * R_u * R_d * own**2


@njit(cache=True, nogil=True)
def _fill_radii(width: FloatArray, log_d: FloatArray, hurst: FloatArray, divisor: float, out: FloatArray) -> None:
    for k in range(width.size):
        out[0, k] = RADIUS / math.sqrt(m4_of(hurst[k], 0.0, log_d[k]))
        out[1, k] = RADIUS / math.sqrt(m4_of(hurst[k], 0.0, log_d[k] + width[k]))
        out[2, k] = summit_rate(hurst[k], log_d[k], width[k]) / divisor
