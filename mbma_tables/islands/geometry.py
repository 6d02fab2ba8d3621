"""From an island's approach delta to its band, radii, densities, X and mu (Section 3.2).

Units as in `surfaces.spectrum`: heights in s, lengths in 1/q0. With e = zeta_1^(-2H) the ends are carried as

    zeta_d^(-2H) = e + a,   zeta_u^(-2H) = e + b

so that m0 = a - b, h_d = sqrt(a), h_u = sqrt(b) and log(zeta_u/zeta_d) = log1p((a - b)/(e + b))/(2H) keep
their digits when both ends run into zeta_1, that is when delta goes to 0.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import jitable, njit
from mbma_tables.surfaces.readings import ReadingNumbers
from mbma_tables.surfaces.spectrum import BROADENING, RADIUS, alpha_of, m0_of, m4_of, summit_rate


class IslandGeometry(NamedTuple):
    """One island in units of s and 1/q0, with the equation of each number."""

    zeta_d: float  # (27)
    zeta_u: float  # (30)
    R_d: float  # (26)
    R_u: float  # (29)
    D: float  # (32)
    sigma: float  # (32)
    h_d: float  # (B.3)
    h_u: float  # (B.12)
    eta: float  # (39)
    X: float  # (h_rms/s delta/h_rms - h_d)/sigma
    mu: float  # 8/3 D sigma sqrt(2 R_u R_d)
    D_d: float  # (43)
    sigma_d: float  # (43)
    width: float  # log(zeta_u/zeta_d)


FIELDS = IslandGeometry._fields


@jitable
def floor_offset(hurst: Any, zeta_1: Any, floor: float) -> Any:
    """floor^(-2H) - zeta_1^(-2H) without cancellation: the largest a (or b) above a floor; of numbers or arrays."""
    e = np.exp(-2.0 * hurst * np.log(zeta_1))
    return e * np.expm1(2.0 * hurst * np.log1p((zeta_1 - floor) / floor))


@njit(cache=True, error_model="numpy")
def _log_band(hurst: float, e: float, log_zeta_1: float, offset: float) -> float:
    """log(zeta) where zeta^(-2H) = e + offset."""
    return log_zeta_1 - math.log1p(offset / e) / (2.0 * hurst)


@njit(cache=True, error_model="numpy")
def summit_sigma(m0: float, alpha: float, summits: bool) -> float:
    """Standard deviation of summit heights (2), or of all heights where a reading says so."""
    return math.sqrt((1.0 - BROADENING / alpha) * m0) if summits else math.sqrt(m0)


@njit(cache=True, error_model="numpy")
def island_fields(
    approach: float,
    hurst: float,
    zeta_1: float,
    reading: ReadingNumbers,
) -> IslandGeometry:
    """The island at delta = approach * h_rms."""
    divisor, beta, phi, floor_d, floor_u, offset, summits = reading
    log_zeta_1 = math.log(zeta_1)
    e = math.exp(-2.0 * hurst * log_zeta_1)
    h_rms = math.sqrt(-math.expm1(-2.0 * hurst * log_zeta_1))  # over s, sqrt(1 - e)
    root_a = 4.0 / 3.0 * beta * approach
    root_b = phi / (1.0 + phi) * h_rms * approach
    a = root_a * root_a
    b = root_b * root_b
    top_a = floor_offset(hurst, zeta_1, floor_d)
    top_b = floor_offset(hurst, zeta_1, floor_u)
    log_d = _log_band(hurst, e, log_zeta_1, a)
    log_u = _log_band(hurst, e, log_zeta_1, b)
    zeta_d = math.exp(log_d)
    zeta_u = math.exp(log_u)
    if a >= top_a:
        a = top_a
        root_a = math.sqrt(top_a)
        log_d = math.log(floor_d)
        zeta_d = floor_d
    if b >= top_b:
        b = top_b
        root_b = math.sqrt(top_b)
        log_u = math.log(floor_u)
        zeta_u = floor_u

    # the band [zeta_d, zeta_u]; m0 = a - b, and alpha from the width alone
    width = math.log1p((a - b) / (e + b)) / (2.0 * hurst)
    D = summit_rate(hurst, log_d, width) / divisor
    # a and b may underflow where their roots do not
    m0_root = math.sqrt(root_a - root_b) * math.sqrt(root_a + root_b)
    sigma = m0_root * summit_sigma(1.0, alpha_of(hurst, width), summits)
    R_d = RADIUS / math.sqrt(m4_of(hurst, 0.0, log_d))
    R_u = RADIUS / math.sqrt(m4_of(hurst, 0.0, log_u))
    D_d = summit_rate(hurst, 0.0, log_d) / divisor
    sigma_d = summit_sigma(m0_of(hurst, 0.0, log_d), alpha_of(hurst, log_d), summits)

    m4_all = m4_of(hurst, 0.0, log_zeta_1)
    D_top = summit_rate(hurst, 0.0, log_zeta_1) / divisor
    R_top = RADIUS / math.sqrt(m4_all)
    eta = 0.75 * (math.pi * D_top) ** (1.0 / 3.0) * (1.5 * R_top) ** (2.0 / 3.0) * (root_b / (phi * R_u)) ** (1.0 / 3.0)
    h_d = root_a if offset else 0.0
    X = (h_rms * approach - h_d) / sigma
    mu = 8.0 / 3.0 * D * sigma * math.sqrt(2.0 * R_u * R_d)
    return IslandGeometry(zeta_d, zeta_u, R_d, R_u, D, sigma, h_d, root_b, eta, X, mu, D_d, sigma_d, width)


@njit(cache=True, error_model="numpy", nogil=True)
def fill_islands(
    approach: FloatArray,
    hurst: FloatArray,
    zeta_1: FloatArray,
    reading: ReadingNumbers,
    out: FloatArray,
) -> None:
    """`island_fields` of each entry into the columns of `out` (fields, entries)."""
    for k in range(approach.size):
        fields = island_fields(approach[k], hurst[k], zeta_1[k], reading)
        for column in range(len(fields)):
            out[column, k] = fields[column]
