"""Moments of isotropic spectra: self-affine ones (Eqs. 2, 3, 6, 7, 22, 31), and power laws between samples.

Self-affine ones have heights in s = h_rms / sqrt(1 - zeta_1^(-2H)) and lengths in 1/q0. So
that narrow bands keep their accuracy, a band [za, zb] is given by log(za) and log(zb/za),
and a place between samples by its `Place`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.common.arguments import (
    FloatArray,
    broadcast_shape,
    finite_array,
    require,
)

NAYAK = 6 * math.pi * math.sqrt(3)  # summit density is m4 / (NAYAK m2), Eq. (2)
RADIUS = 3 * math.sqrt(math.pi) / 8  # summit radius is RADIUS / sqrt(m4), Eq. (2)
BROADENING = 0.8968  # summit variance is (1 - BROADENING/alpha) m0, Eq. (2)
MIN_ZETA_1, MAX_ZETA_1 = (
    3.0,
    1e8,
)  # limits for a surface; above 3 for the floors 1.5 and 3 of (27), (30)
SHARES = {0: 1.0, 2: 1 / 2, 4: 3 / 8}  # m_n = share 2 pi integral C q^(n + 1) dq, Eq. (7)
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
    return (
        2
        * SHARES[order]
        * hurst
        * np.exp(power * log_za)
        * log_ratio
        * growth(power, log_ratio)
    )


def alpha_of(hurst: Any, log_ratio: Any) -> Any:
    """Nayak's bandwidth parameter m0 m4/m2^2, Eq. (3): a function of zb/za alone, 1.5 where that is 1."""
    g2 = growth(2.0 - 2.0 * hurst, log_ratio)
    # grouped to avoid overflow
    return (
        1.5
        * (growth(-2.0 * hurst, log_ratio) / g2)
        * (growth(4.0 - 2.0 * hurst, log_ratio) / g2)
    )


def summit_rate(hurst: Any, log_za: Any, log_ratio: Any) -> Any:
    """m4/m2 over the band [q0^2], which summit densities are made of, Eq. (2); finite for a band of no width."""
    ratio = growth(4.0 - 2.0 * hurst, log_ratio) / growth(2.0 - 2.0 * hurst, log_ratio)
    return 0.75 * np.exp(2.0 * log_za) * ratio


def band_moment(order: int, hurst: Any, zeta_a: Any, zeta_b: Any) -> Any:
    """Spectral moment m_n, n = 0, 2, 4, over the band [zeta_a, zeta_b]; arrays broadcast (Eq. 31)."""
    start = np.asarray(zeta_a, dtype=float)
    width = np.asarray(zeta_b, dtype=float) - start
    return moment_of(
        order, np.asarray(hurst, dtype=float), np.log(start), np.log1p(width / start)
    )


def band_from_moments(
    hurst: ArrayLike, m0: ArrayLike, m2: ArrayLike, m4: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(q0, q1, h_rms) of the self-affine band with these moments; arrays broadcast. See `Surface.from_moments`."""
    given = {
        name: finite_array(name, value)
        for name, value in {"hurst": hurst, "m0": m0, "m2": m2, "m4": m4}.items()
    }
    require(
        "hurst", given["hurst"], (given["hurst"] > 0) & (given["hurst"] <= 1), "in (0, 1]"
    )
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
    q0 = np.sqrt(
        b / a / (band_moment(2, h, 1.0, zeta_1) / band_moment(0, h, 1.0, zeta_1))
    )
    return q0, q0 * zeta_1, np.sqrt(a)


class Place(NamedTuple):
    """Wavenumbers, by piece of the spectrum and ln(upper end of the piece/q)."""

    piece: NDArray[np.intp]
    rest: FloatArray


class PowerLaws:
    """Power laws between samples of C(q) [length^4], h_rms^2 = 2 pi integral C q dq, not negative.

    q [1/length] rises; a repeated one is a jump. Where C is zero at a sample, nothing lies
    on either side of it.
    """

    def __init__(self, q: FloatArray, C: FloatArray) -> None:
        held = (q[1:] > q[:-1]) & (C[1:] > 0) & (C[:-1] > 0)
        self.log_low, self.log_high = np.log(q[:-1][held]), np.log(q[1:][held])
        self.low, self.high = C[:-1][held], C[1:][held]
        self.width = np.log1p((q[1:][held] - q[:-1][held]) / q[:-1][held])
        # overflow appears as a moment that is not finite
        with np.errstate(all="ignore"):
            self.slope = np.log(self.high / self.low) / self.width
            whole = {
                order: self._content(order, np.arange(self.width.size), self.width)
                for order in SHARES
            }
            self._before = {
                order: np.append(0.0, np.cumsum(content))
                for order, content in whole.items()
            }
            # summed from the shortest wavelength, for accurate small sums
            self._after = np.append(np.cumsum(whole[0][::-1])[::-1], 0.0)

    def moment(self, order: int) -> float:
        """m_0, m_2 or m_4 of all wavelengths."""
        return float(self._before[order][-1])

    def _content(
        self, order: int, piece: Any, width: Any, rest: Any = None
    ) -> FloatArray:
        """Part of a moment of a width above a piece's lower end, or above a distance `rest` below its upper end."""
        C, log_q = (
            (self.low, self.log_low) if rest is None else (self.high, self.log_high)
        )
        power = self.slope[piece] + order + 2
        start = (
            2 * math.pi * SHARES[order] * C[piece] * np.exp((order + 2) * log_q[piece])
        )
        return np.asarray(
            start
            * np.exp(-power * (0.0 if rest is None else rest))
            * width
            * growth(power, width)
        )

    def place(self, q: Any) -> Place:
        """The place of wavenumbers inside the band; between two pieces, the end of the lower."""
        log_q = np.log(np.asarray(q, float))
        piece = np.clip(np.searchsorted(self.log_high, log_q), 0, self.width.size - 1)
        return Place(piece, np.clip(self.log_high[piece] - log_q, 0.0, self.width[piece]))

    def log_q(self, place: Place) -> FloatArray:
        """ln q."""
        return np.asarray(self.log_high[place.piece] - place.rest)

    def above(self, place: Place) -> FloatArray:
        """T(q) = m_0 of all shorter wavelengths [length^2]."""
        return np.asarray(
            self._after[place.piece + 1]
            + self._content(0, place.piece, place.rest, place.rest)
        )

    def where_above_is(self, variance: Any) -> Place:
        """Places at which T(q) has these values, at most m_0."""
        wanted = np.asarray(variance, float)
        # _after falls; the piece whose content brings the sum to the wanted value
        piece = self.width.size - np.searchsorted(self._after[::-1], wanted, side="left")
        piece = np.clip(piece, 0, self.width.size - 1)
        end = 2 * math.pi * self.high[piece] * np.exp(2 * self.log_high[piece])
        y = np.maximum(wanted - self._after[piece + 1], 0.0) / end
        power = self.slope[piece] + 2
        x = -power * y
        flat = x == 0
        rest = y * np.where(
            flat, 1.0, np.log1p(np.maximum(x, -1 + 1e-16)) / np.where(flat, 1.0, x)
        )
        return Place(piece, np.minimum(rest, self.width[piece]))

    def below(self, order: int, place: Place) -> FloatArray:
        """m_n of all longer wavelengths."""
        rise = self.width[place.piece] - place.rest
        return np.asarray(
            self._before[order][place.piece] + self._content(order, place.piece, rise)
        )

    def between(self, order: int, start: Place, end: Place) -> FloatArray:
        """m_n of the wavelengths from one place to a higher one."""
        width = np.where(start.piece == end.piece, start.rest - end.rest, start.rest)
        inside = self._content(order, start.piece, width, start.rest)
        whole = (
            self._before[order][end.piece]
            - self._before[order][np.minimum(start.piece + 1, end.piece)]
        )
        last = self._content(order, end.piece, self.width[end.piece] - end.rest)
        return np.asarray(inside + np.where(start.piece == end.piece, 0.0, whole + last))

    def at(self, q: FloatArray) -> FloatArray:
        """C(q), zero outside the pieces."""
        log_q = np.log(q)
        piece = np.clip(np.searchsorted(self.log_high, log_q), 0, self.width.size - 1)
        rest = self.log_high[piece] - log_q
        inside = (rest >= -1e-15) & (rest <= self.width[piece] * (1 + 1e-14) + 1e-15)
        return np.where(inside, self.high[piece] * np.exp(-self.slope[piece] * rest), 0.0)
