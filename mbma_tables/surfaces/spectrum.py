"""Moments and summits of a self-affine spectrum over a band of magnifications (Eqs. 2, 3, 6, 7, 22, 31), and back.

Units: heights in s = h_rms / sqrt(1 - zeta_1^(-2H)), lengths in 1/q0. A band [za, zb] is given by log(za) and
log(zb/za), so that a band of any width, however narrow, keeps its digits. Plain arithmetic, for arrays
and for compiled code alike.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import FloatArray, broadcast_shape, finite_array, require
from mbma_tables.compiled import njit, vectorize

NAYAK = 6 * math.pi * math.sqrt(3)  # summit density is m4 / (NAYAK m2), Eq. (2)
RADIUS = 3 * math.sqrt(math.pi) / 8  # summit radius is RADIUS / sqrt(m4), Eq. (2)
BROADENING = 0.8968  # summit variance is (1 - BROADENING/alpha) m0, Eq. (2)
MIN_ZETA_1, MAX_ZETA_1 = 3.0, 1e8  # of a whole surface; above 3 for the floors 1.5 and 3 of (27), (30)


@njit(cache=True, error_model="numpy")
def _growth(power: float, log_ratio: float) -> float:
    """(r^power - 1)/(power log r) with r = exp(log_ratio): 1 where either is 0."""
    x = power * log_ratio
    return math.expm1(x) / x if x != 0.0 else 1.0


@njit(cache=True, error_model="numpy")
def m0_of(hurst: float, log_za: float, log_ratio: float) -> float:
    """Variance of height over the band, Eq. (7), in s^2."""
    return 2.0 * hurst * math.exp(-2.0 * hurst * log_za) * log_ratio * _growth(-2.0 * hurst, log_ratio)


@njit(cache=True, error_model="numpy")
def m2_of(hurst: float, log_za: float, log_ratio: float) -> float:
    """Variance of a profile's slope over the band, Eq. (7), in (s q0)^2."""
    power = 2.0 - 2.0 * hurst
    return hurst * math.exp(power * log_za) * log_ratio * _growth(power, log_ratio)


@njit(cache=True, error_model="numpy")
def m4_of(hurst: float, log_za: float, log_ratio: float) -> float:
    """Variance of a profile's second derivative over the band, Eq. (7), in (s q0^2)^2."""
    power = 4.0 - 2.0 * hurst
    return 0.75 * hurst * math.exp(power * log_za) * log_ratio * _growth(power, log_ratio)


@njit(cache=True, error_model="numpy")
def alpha_of(hurst: float, log_ratio: float) -> float:
    """Nayak's bandwidth parameter m0 m4/m2^2, Eq. (3): a function of zb/za alone, 1.5 where that is 1."""
    g2 = _growth(2.0 - 2.0 * hurst, log_ratio)
    # grouped so that nothing overflows
    return 1.5 * (_growth(-2.0 * hurst, log_ratio) / g2) * (_growth(4.0 - 2.0 * hurst, log_ratio) / g2)


@njit(cache=True, error_model="numpy")
def summit_rate(hurst: float, log_za: float, log_ratio: float) -> float:
    """m4/m2 over the band [q0^2], which summit densities are made of, Eq. (2); finite for a band of no width."""
    growth = _growth(4.0 - 2.0 * hurst, log_ratio) / _growth(2.0 - 2.0 * hurst, log_ratio)
    return 0.75 * math.exp(2.0 * log_za) * growth


@vectorize(["f8(f8, f8, f8, i8)"], cache=True)
def _moment(hurst: float, log_za: float, log_ratio: float, order: int) -> float:
    if order == 0:
        return m0_of(hurst, log_za, log_ratio)
    if order == 2:
        return m2_of(hurst, log_za, log_ratio)
    return m4_of(hurst, log_za, log_ratio)


def band_moment(order: int, hurst: Any, zeta_a: Any, zeta_b: Any) -> Any:
    """Spectral moment m_n, n = 0, 2, 4, over the band [zeta_a, zeta_b]; arrays broadcast (Eq. 31)."""
    start = np.asarray(zeta_a, dtype=float)
    width = np.asarray(zeta_b, dtype=float) - start
    return _moment(hurst, np.log(start), np.log1p(width / start), order)


def band_from_moments(
    hurst: ArrayLike, m0: ArrayLike, m2: ArrayLike, m4: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(q0, q1, h_rms) of the self-affine band with these moments; arrays broadcast. See `Surface.from_moments`."""
    from scipy.optimize import brentq

    given = {name: finite_array(name, value) for name, value in {"hurst": hurst, "m0": m0, "m2": m2, "m4": m4}.items()}
    require("hurst", given["hurst"], (given["hurst"] > 0) & (given["hurst"] <= 1), "in (0, 1]")
    for name in ("m0", "m2", "m4"):
        require(name, given[name], given[name] > 0, "positive")
    shape = broadcast_shape(**given)
    h, a, b, c = (np.broadcast_to(array, shape) for array in given.values())
    # alpha rises with zeta_1 at a given Hurst exponent
    alpha = (a / b) * (c / b)
    low, high = math.log(MIN_ZETA_1), math.log(MAX_ZETA_1)
    least, most = (np.vectorize(alpha_of)(h, end) for end in (low, high))
    allowed = f"({least.min():.6g}, {most.max():.6g}]" if least.size == 1 else "the range"
    require(
        "alpha = m0 m4/m2^2",
        alpha,
        (alpha > least) & (alpha <= most),
        f"in {allowed} that 3 < zeta_1 <= 1e8 gives at this hurst",
    )
    log_zeta = np.empty(shape)
    for place in np.ndindex(shape):
        goal = float(alpha[place])
        log_zeta[place] = brentq(
            lambda x, hurst=float(h[place]), goal=goal: math.log(alpha_of(hurst, x) / goal),
            low,
            high,
            xtol=1e-15,
            rtol=4 * np.finfo(float).eps,
        )
    zeta_1 = np.exp(log_zeta)
    q0 = np.sqrt(b / a / (band_moment(2, h, 1.0, zeta_1) / band_moment(0, h, 1.0, zeta_1)))
    return q0, q0 * zeta_1, np.sqrt(a)
