"""Moments and summits of a self-affine spectrum over a band of magnifications (Eqs. 2, 3, 6, 7, 22, 31), and back.

Units: heights in s = h_rms / sqrt(1 - zeta_1^(-2H)), lengths in 1/q0. A band [za, zb] is given by log(za) and
log(zb/za), so that narrow bands keep their accuracy.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, broadcast_shape, finite_array, require

NAYAK = 6 * math.pi * math.sqrt(3)  # summit density is m4 / (NAYAK m2), Eq. (2)
RADIUS = 3 * math.sqrt(math.pi) / 8  # summit radius is RADIUS / sqrt(m4), Eq. (2)
BROADENING = 0.8968  # summit variance is (1 - BROADENING/alpha) m0, Eq. (2)
MIN_ZETA_1, MAX_ZETA_1 = 3.0, 1e8  # limits for a surface; above 3 for the floors 1.5 and 3 of (27), (30)
SHARES = {0: 2.0, 2: 1.0, 4: 0.75}  # of moments of order n, Eq. (7)
BISECTIONS = 56  # bisections of log(zeta_1), to rounding
TINY = 1e-300  # in place of 0, where a quotient tends to 1


def growth(power: Any, log_ratio: Any) -> Any:
    """(r^power - 1)/(power log r) with r = exp(log_ratio): 1 where either is 0."""
    x = power * log_ratio
    x = x + TINY * (x == 0.0)
    return np.expm1(x) / x


def moment_of(order: int, hurst: Any, log_za: Any, log_ratio: Any) -> Any:
    """Variance of height, of a profile's slope or of its curvature over the band, Eq. (7), in (s q0^(n/2))^2."""
    power = order - 2.0 * hurst
    return SHARES[order] * hurst * np.exp(power * log_za) * log_ratio * growth(power, log_ratio)


def alpha_of(hurst: Any, log_ratio: Any) -> Any:
    """Nayak's bandwidth parameter m0 m4/m2^2, Eq. (3): a function of zb/za alone, 1.5 where that is 1."""
    g2 = growth(2.0 - 2.0 * hurst, log_ratio)
    # grouped to avoid overflow
    return 1.5 * (growth(-2.0 * hurst, log_ratio) / g2) * (growth(4.0 - 2.0 * hurst, log_ratio) / g2)


def summit_rate(hurst: Any, log_za: Any, log_ratio: Any) -> Any:
    """m4/m2 over the band [q0^2], which summit densities are made of, Eq. (2); finite for a band of no width."""
    ratio = growth(4.0 - 2.0 * hurst, log_ratio) / growth(2.0 - 2.0 * hurst, log_ratio)
    return 0.75 * np.exp(2.0 * log_za) * ratio


def band_moment(order: int, hurst: Any, zeta_a: Any, zeta_b: Any) -> Any:
    """Spectral moment m_n, n = 0, 2, 4, over the band [zeta_a, zeta_b]; arrays broadcast (Eq. 31)."""
    start = np.asarray(zeta_a, dtype=float)
    width = np.asarray(zeta_b, dtype=float) - start
    return moment_of(order, np.asarray(hurst, dtype=float), np.log(start), np.log1p(width / start))


def band_from_moments(
    hurst: ArrayLike, m0: ArrayLike, m2: ArrayLike, m4: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(q0, q1, h_rms) of the self-affine band with these moments; arrays broadcast. See `Surface.from_moments`."""
    given = {name: finite_array(name, value) for name, value in {"hurst": hurst, "m0": m0, "m2": m2, "m4": m4}.items()}
    require("hurst", given["hurst"], (given["hurst"] > 0) & (given["hurst"] <= 1), "in (0, 1]")
    for name in ("m0", "m2", "m4"):
        require(name, given[name], given[name] > 0, "positive")
    shape = broadcast_shape(**given)
    h, a, b, c = (np.broadcast_to(array, shape) for array in given.values())
    # alpha rises with zeta_1 at a given Hurst exponent
    alpha = (a / b) * (c / b)
    low, high = math.log(MIN_ZETA_1), math.log(MAX_ZETA_1)
    least, most = (alpha_of(h, end) for end in (low, high))
    allowed = f"({least.min():.6g}, {most.max():.6g}]" if least.size == 1 else "the range"
    require(
        "alpha = m0 m4/m2^2",
        alpha,
        (alpha > least) & (alpha <= most),
        f"in {allowed} that 3 < zeta_1 <= 1e8 gives at this hurst",
    )
    ends = np.full(shape, low), np.full(shape, high)
    for _ in range(BISECTIONS):
        log_zeta = 0.5 * (ends[0] + ends[1])
        more = alpha_of(h, log_zeta) < alpha
        ends = np.where(more, log_zeta, ends[0]), np.where(more, ends[1], log_zeta)
    zeta_1 = np.exp(log_zeta)
    q0 = np.sqrt(b / a / (band_moment(2, h, 1.0, zeta_1) / band_moment(0, h, 1.0, zeta_1)))
    return q0, q0 * zeta_1, np.sqrt(a)
