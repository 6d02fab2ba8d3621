"""From an island's approach delta to its band, radii, densities, X and mu (Section 3.2).

Units as in `surfaces.spectrum`: heights in s, lengths in 1/q0. With e = zeta_1^(-2H) the ends are carried as

    zeta_d^(-2H) = e + a,   zeta_u^(-2H) = e + b

so that m0 = a - b, h_d = sqrt(a), h_u = sqrt(b) and log(zeta_u/zeta_d) = log1p((a - b)/(e + b))/(2H) keep
their digits when both ends run into zeta_1, that is when delta goes to 0.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import jitable
from mbma_tables.surfaces.readings import Reading
from mbma_tables.surfaces.spectrum import BROADENING, RADIUS, alpha_of, m0_of, m4_of, summit_rate

# of an island in units of s and 1/q0: zeta_d (27), zeta_u (30), R_d (26), R_u (29), D and sigma (32), h_d (B.3),
# h_u (B.12), eta (39), X = (h_rms/s delta/h_rms - h_d)/sigma, mu = 8/3 D sigma sqrt(2 R_u R_d), D_d and sigma_d (43),
# width = log(zeta_u/zeta_d)
FIELDS = (
    "zeta_d", "zeta_u", "R_d", "R_u", "D", "sigma", "h_d", "h_u", "eta", "X", "mu", "D_d", "sigma_d", "width",
)  # fmt: skip


@jitable
def floor_offset(hurst: Any, zeta_1: Any, floor: float) -> Any:
    """floor^(-2H) - zeta_1^(-2H) without cancellation: the largest a (or b) above a floor; of numbers or arrays."""
    e = np.exp(-2.0 * hurst * np.log(zeta_1))
    return e * np.expm1(2.0 * hurst * np.log1p((zeta_1 - floor) / floor))


@jitable
def summit_sigma(m0: Any, alpha: Any, summits: bool) -> Any:
    """Standard deviation of summit heights (2), or of all heights where a reading says so."""
    return np.sqrt((1.0 - (BROADENING / alpha if summits else 0.0)) * m0)


@np.errstate(under="ignore")
def geometry(approach: FloatArray, hurst: Any, zeta_1: Any, reading: Reading) -> dict[str, FloatArray]:
    """`FIELDS` of islands at delta/h_rms = approach > 0; arguments of one shape, or numbers for one surface."""
    log_zeta_1 = np.log(zeta_1)
    e = np.exp(-2.0 * hurst * log_zeta_1)
    h_rms = np.sqrt(-np.expm1(-2.0 * hurst * log_zeta_1))  # over s, sqrt(1 - e)

    def end(root: FloatArray, floor: float) -> tuple[FloatArray, ...]:
        """The square root and the square of an end's offset, its log(zeta) and zeta, not below the floor."""
        top = floor_offset(hurst, zeta_1, floor)
        square, log_zeta = root * root, log_zeta_1 - np.log1p(root * root / e) / (2.0 * hurst)
        held = square >= top
        return (
            np.where(held, np.sqrt(top), root),
            np.where(held, top, square),
            np.where(held, np.log(floor), log_zeta),
            np.where(held, floor, np.exp(log_zeta)),
        )

    root_a, a, log_d, zeta_d = end(4.0 / 3.0 * reading.beta * approach, reading.floor_d)
    root_b, b, log_u, zeta_u = end(reading.phi / (1.0 + reading.phi) * h_rms * approach, reading.floor_u)
    # the band [zeta_d, zeta_u]; m0 = a - b, and alpha from the width alone
    width = np.log1p((a - b) / (e + b)) / (2.0 * hurst)
    D = summit_rate(hurst, log_d, width) / reading.density_divisor
    # a and b may underflow where their roots do not
    m0_root = np.sqrt(root_a - root_b) * np.sqrt(root_a + root_b)
    sigma = m0_root * summit_sigma(1.0, alpha_of(hurst, width), reading.summit_sigma)
    R_d, R_u, R_top = (RADIUS / np.sqrt(m4_of(hurst, 0.0, log)) for log in (log_d, log_u, log_zeta_1))
    D_top = summit_rate(hurst, 0.0, log_zeta_1) / reading.density_divisor
    h_d = root_a if reading.offset else np.zeros_like(root_a)
    return {
        "zeta_d": zeta_d,
        "zeta_u": zeta_u,
        "R_d": R_d,
        "R_u": R_u,
        "D": D,
        "sigma": sigma,
        "h_d": h_d,
        "h_u": root_b,
        "eta": 0.75 * np.cbrt(np.pi * D_top) * np.cbrt(1.5 * R_top) ** 2 * np.cbrt(root_b / (reading.phi * R_u)),
        "X": (h_rms * approach - h_d) / sigma,
        "mu": 8.0 / 3.0 * D * sigma * np.sqrt(2.0 * R_u * R_d),
        "D_d": summit_rate(hurst, 0.0, log_d) / reading.density_divisor,
        "sigma_d": summit_sigma(m0_of(hurst, 0.0, log_d), alpha_of(hurst, log_d), reading.summit_sigma),
        "width": width,
    }
