"""Moments of isotropic spectra: self-affine ones, and power laws between samples.

Eqs. 2, 3, 6, 7, 22, 31. Self-affine ones have heights in s = h_rms / sqrt(1 - zeta_1^(-2H))
and lengths in 1/q0. So that narrow bands keep their accuracy, a band [za, zb] is given by
log(za) and log(zb/za), and a place between samples by its `Place`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, TypeAlias

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
# limits for a surface; the lower one is above the floors 1.5 and 3 of (27), (30)
MIN_ZETA_1 = 3.0
MAX_ZETA_1 = 1e8
MOST_BANDS = 16  # that the core adds
SHARES = {0: 1.0, 2: 1 / 2, 4: 3 / 8}  # m_n = share 2 pi integral C q^(n + 1) dq, Eq. (7)

Reals: TypeAlias = float | FloatArray


def growth(power: Reals, log_ratio: Reals) -> FloatArray:
    """(r^power - 1)/(power log r) with r = exp(log_ratio): 1 where either is 0."""
    x = power * log_ratio
    # the quotient tends to 1, which it has at any number this small
    x = x + 1e-300 * (x == 0.0)
    quotient: FloatArray = np.expm1(x) / x
    return quotient


def moment_of(order: int, hurst: Reals, log_za: Reals, log_ratio: Reals) -> FloatArray:
    """Variance of height, of a profile's slope or of its curvature over the band, Eq. (7).

    In (s q0^(n/2))^2 for the order n.
    """
    power = order - 2.0 * hurst
    at_start = 2 * SHARES[order] * hurst * np.exp(power * log_za)
    return at_start * log_ratio * growth(power, log_ratio)


def alpha_of(hurst: Reals, log_ratio: Reals) -> FloatArray:
    """Nayak's bandwidth parameter m0 m4/m2^2, Eq. (3).

    A function of zb/za alone, 1.5 where that is 1.
    """
    growth_0 = growth(-2.0 * hurst, log_ratio)
    growth_2 = growth(2.0 - 2.0 * hurst, log_ratio)
    growth_4 = growth(4.0 - 2.0 * hurst, log_ratio)
    # grouped to avoid overflow
    return 1.5 * (growth_0 / growth_2) * (growth_4 / growth_2)


def summit_rate(hurst: Reals, log_za: Reals, log_ratio: Reals) -> FloatArray:
    """m4/m2 over the band [q0^2], which summit densities are made of, Eq. (2).

    Finite for a band of no width.
    """
    growth_2 = growth(2.0 - 2.0 * hurst, log_ratio)
    growth_4 = growth(4.0 - 2.0 * hurst, log_ratio)
    return 0.75 * np.exp(2.0 * log_za) * (growth_4 / growth_2)


def band_moment(
    order: int, hurst: ArrayLike, zeta_a: ArrayLike, zeta_b: ArrayLike
) -> FloatArray:
    """Spectral moment m_n, n = 0, 2, 4, over the band [zeta_a, zeta_b]; arrays broadcast.

    Eq. (31).
    """
    exponent = np.asarray(hurst, dtype=float)
    start = np.asarray(zeta_a, dtype=float)
    width = np.asarray(zeta_b, dtype=float) - start
    return moment_of(order, exponent, np.log(start), np.log1p(width / start))


def band_from_moments(
    hurst: ArrayLike, m0: ArrayLike, m2: ArrayLike, m4: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(q0, q1, h_rms) of the self-affine band with these moments; arrays broadcast.

    See `Surface.from_moments`.
    """
    arguments = {"hurst": hurst, "m0": m0, "m2": m2, "m4": m4}
    arrays = {name: finite_array(name, value) for name, value in arguments.items()}
    in_range = (arrays["hurst"] > 0) & (arrays["hurst"] <= 1)
    require("hurst", arrays["hurst"], in_range, "in (0, 1]")
    for name in ("m0", "m2", "m4"):
        require(name, arrays[name], arrays[name] > 0, "positive")
    shape = broadcast_shape(**arrays)
    exponent, variance, slope, curvature = (
        np.broadcast_to(array, shape) for array in arrays.values()
    )
    alpha = (variance / slope) * (curvature / slope)
    zeta_1 = np.exp(_log_zeta_of_alpha(exponent, alpha))
    # m2/m0 = q0^2 times that of the band from 1 to zeta_1
    of_unit_band = band_moment(2, exponent, 1.0, zeta_1) / band_moment(
        0, exponent, 1.0, zeta_1
    )
    q0 = np.sqrt(slope / variance / of_unit_band)
    return q0, q0 * zeta_1, np.sqrt(variance)


def _log_zeta_of_alpha(hurst: FloatArray, alpha: FloatArray) -> FloatArray:
    """ln zeta_1 of self-affine bands with a Nayak parameter, by bisection."""
    lowest = math.log(MIN_ZETA_1)
    highest = math.log(MAX_ZETA_1)
    # alpha rises with zeta_1 at a given Hurst exponent
    least = alpha_of(hurst, lowest)
    most = alpha_of(hurst, highest)
    allowed = "the range"
    if least.size == 1:
        allowed = f"({least.min():.6g}, {most.max():.6g}]"
    require(
        "alpha = m0 m4/m2^2",
        alpha,
        (alpha > least) & (alpha <= most),
        f"in {allowed} that 3 < zeta_1 <= 1e8 gives at this hurst",
    )
    low = np.full(alpha.shape, lowest)
    high = np.full(alpha.shape, highest)
    middle: FloatArray
    # so many bisections reach the rounding of log(zeta_1)
    for _ in range(56):
        middle = 0.5 * (low + high)
        is_wider = alpha_of(hurst, middle) < alpha
        low = np.where(is_wider, middle, low)
        high = np.where(is_wider, high, middle)
    return middle


class Band(NamedTuple):
    """A power law of a spectrum: C (q/q_low)^power from q_low to q_high; numbers or arrays."""

    q_low: Any
    q_high: Any
    C: Any  # [length^4] as h_rms^2 = 2 pi integral C q dq
    power: Any


class Place(NamedTuple):
    """Wavenumbers, by piece of the spectrum and ln(upper end of the piece/q)."""

    piece: NDArray[np.intp]
    rest: FloatArray


class PowerLaws:
    """Power laws between samples of C(q) [length^4], not negative.

    h_rms^2 = 2 pi integral C q dq. q [1/length] rises; a repeated one is a jump. Where C is
    zero at a sample, nothing lies on either side of it.
    """

    def __init__(self, q: FloatArray, C: FloatArray) -> None:
        # a piece is between two neighbours with power, unless they are a jump
        is_piece = (q[1:] > q[:-1]) & (C[1:] > 0) & (C[:-1] > 0)
        q_low = q[:-1][is_piece]
        q_high = q[1:][is_piece]
        self.log_low = np.log(q_low)
        self.log_high = np.log(q_high)
        self.low = C[:-1][is_piece]
        self.high = C[1:][is_piece]
        self.width = np.log1p((q_high - q_low) / q_low)
        # overflow appears as a moment that is not finite
        with np.errstate(all="ignore"):
            self.slope = np.log(self.high / self.low) / self.width
            every = np.arange(self.width.size)
            self._before: dict[int, FloatArray] = {}
            for order in SHARES:
                content = self._from_low(order, every, self.width)
                self._before[order] = np.append(0.0, np.cumsum(content))
                if order == 0:
                    # summed from the shortest wavelength, for accurate small sums
                    self._after = np.append(np.cumsum(content[::-1])[::-1], 0.0)

    def moment(self, order: int) -> float:
        """m_0, m_2 or m_4 of all wavelengths."""
        return float(self._before[order][-1])

    def _from_low(
        self, order: int, piece: NDArray[np.intp], width: FloatArray
    ) -> FloatArray:
        """Part of a moment from a piece's lower end to a width [ln q] above it."""
        return self._content(order, piece, width, self.low, self.log_low, 0.0)

    def _from(self, order: int, place: Place, width: FloatArray) -> FloatArray:
        """Part of a moment from a place to a width [ln q] above it, in its piece."""
        piece, rest = place
        return self._content(order, piece, width, self.high, self.log_high, rest)

    def _content(
        self,
        order: int,
        piece: NDArray[np.intp],
        width: FloatArray,
        C: FloatArray,
        log_q: FloatArray,
        rest: Reals,
    ) -> FloatArray:
        """Part of a moment over a width from ln q = log_q - rest on, C being that at log_q."""
        power = self.slope[piece] + order + 2
        scale = np.exp((order + 2) * log_q[piece])
        at_log_q = 2 * math.pi * SHARES[order] * C[piece] * scale
        at_start = at_log_q * np.exp(-power * rest)
        return np.asarray(at_start * width * growth(power, width))

    def place(self, q: ArrayLike) -> Place:
        """The place of wavenumbers inside the band; between two pieces, the end of the lower."""
        log_q = np.log(np.asarray(q, float))
        piece = self._piece_of(log_q)
        return Place(piece, np.clip(self.log_high[piece] - log_q, 0.0, self.width[piece]))

    def _piece_of(self, log_q: FloatArray) -> NDArray[np.intp]:
        """The piece that ends at or above a wavenumber, the last one beyond all."""
        return np.clip(np.searchsorted(self.log_high, log_q), 0, self.width.size - 1)

    def log_q(self, place: Place) -> FloatArray:
        """ln q."""
        return np.asarray(self.log_high[place.piece] - place.rest)

    def above(self, place: Place) -> FloatArray:
        """T(q) = m_0 of all shorter wavelengths [length^2]."""
        in_piece = self._from(0, place, place.rest)
        return np.asarray(self._after[place.piece + 1] + in_piece)

    def where_above_is(self, variance: ArrayLike) -> Place:
        """Places at which T(q) has these values, at most m_0."""
        wanted = np.asarray(variance, float)
        # _after falls; the piece whose content brings the sum to the wanted value
        piece = self.width.size - np.searchsorted(self._after[::-1], wanted, side="left")
        piece = np.clip(piece, 0, self.width.size - 1)
        # y = (e^(-power rest) - 1)/(-power) is solved for rest
        end = 2 * math.pi * self.high[piece] * np.exp(2 * self.log_high[piece])
        y = np.maximum(wanted - self._after[piece + 1], 0.0) / end
        power = self.slope[piece] + 2
        x = -power * y
        is_flat = x == 0
        divisor = np.where(is_flat, 1.0, x)
        quotient = np.log1p(np.maximum(x, -1 + 1e-16)) / divisor
        rest = y * np.where(is_flat, 1.0, quotient)
        return Place(piece, np.minimum(rest, self.width[piece]))

    def below(self, order: int, place: Place) -> FloatArray:
        """m_n of all longer wavelengths."""
        rise = self.width[place.piece] - place.rest
        in_piece = self._from_low(order, place.piece, rise)
        return np.asarray(self._before[order][place.piece] + in_piece)

    def between(self, order: int, start: Place, end: Place) -> FloatArray:
        """m_n of the wavelengths from one place to a higher one."""
        in_one_piece = start.piece == end.piece
        width = np.where(in_one_piece, start.rest - end.rest, start.rest)
        first = self._from(order, start, width)
        # whole pieces between those of both places
        after_first = np.minimum(start.piece + 1, end.piece)
        before = self._before[order]
        whole = before[end.piece] - before[after_first]
        last = self._from_low(order, end.piece, self.width[end.piece] - end.rest)
        return np.asarray(first + np.where(in_one_piece, 0.0, whole + last))

    def at(self, q: FloatArray) -> FloatArray:
        """C(q), zero outside the pieces."""
        log_q = np.log(q)
        piece = self._piece_of(log_q)
        rest = self.log_high[piece] - log_q
        # with the rounding of logarithms
        longest = self.width[piece] * (1 + 1e-14) + 1e-15
        is_inside = (rest >= -1e-15) & (rest <= longest)
        return np.where(
            is_inside, self.high[piece] * np.exp(-self.slope[piece] * rest), 0.0
        )
