"""An isotropic spectrum as power laws between its samples: moments of any band in closed form, and their inverse.

A place in the spectrum is a piece and a distance ln(upper end/q) below its upper end, so that bands that tend to the
shortest wavelength keep their accuracy.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.common.arguments import FloatArray, finite_array
from mbma_tables.common.errors import InputError
from mbma_tables.surfaces.spectrum import growth

SHARES = {0: 1.0, 2: 1 / 2, 4: 3 / 8}  # m_n = share 2 pi integral C q^(n + 1) dq, Eq. (7)


class Place(NamedTuple):
    """Wavenumbers, by piece and ln(upper end of the piece/q)."""

    piece: NDArray[np.intp]
    rest: FloatArray


def two_columns(q: ArrayLike, C: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Wavenumbers and spectrum as arrays of one length."""
    wavenumber, spectrum = finite_array("q", q), finite_array("C", C)
    if wavenumber.ndim != 1 or wavenumber.shape != spectrum.shape:
        raise InputError(
            f"q and C must be two columns of one length, got shapes {wavenumber.shape} and {spectrum.shape}"
        )
    return wavenumber, spectrum


def sorted_spectrum(q: ArrayLike, C: ArrayLike, convention: str) -> tuple[FloatArray, FloatArray]:
    """An isotropic spectrum in the order of its wavenumbers and in the paper's convention, without masked entries."""
    if convention not in ("paper", "isotropic"):
        raise InputError(f"convention must be 'paper' or 'isotropic', got {convention!r}")
    if np.ma.is_masked(C) and np.shape(q) == np.shape(C):
        shown = ~np.ma.getmaskarray(np.ma.asanyarray(C))
        q, C = np.asarray(q)[shown], np.asarray(C)[shown]
    wavenumber, spectrum = two_columns(q, C)
    order = np.argsort(wavenumber, kind="stable")
    return wavenumber[order], spectrum[order] * (1.0 if convention == "paper" else 1 / (4 * math.pi**2))


class PowerLaws:
    """Power laws between samples of C(q) [length^4], h_rms^2 = 2 pi integral C q dq, not negative.

    q [1/length] rises; a repeated one is a jump. Where C is zero at a sample, nothing lies on either side of it.
    """

    def __init__(self, q: FloatArray, C: FloatArray) -> None:
        held = (q[1:] > q[:-1]) & (C[1:] > 0) & (C[:-1] > 0)
        self.log_low, self.log_high = np.log(q[:-1][held]), np.log(q[1:][held])
        self.low, self.high = C[:-1][held], C[1:][held]
        self.width = np.log1p((q[1:][held] - q[:-1][held]) / q[:-1][held])
        with np.errstate(all="ignore"):
            self.slope = np.log(self.high / self.low) / self.width
        self._before: dict[int, FloatArray] = {}
        everything = np.arange(self.width.size)
        # overflow appears as a moment that is not finite
        with np.errstate(all="ignore"):
            for order in SHARES:
                content = self._up(order, everything, self.width)
                self._before[order] = np.append(0.0, np.cumsum(content))
            # summed from the shortest wavelength, for accurate small sums
            self._after = np.append(np.cumsum(self._up(0, everything, self.width)[::-1])[::-1], 0.0)

    def moment(self, order: int) -> float:
        """m_0, m_2 or m_4 of all wavelengths."""
        return float(self._before[order][-1])

    def _up(self, order: int, piece: Any, width: Any) -> FloatArray:
        """Contribution to a moment of a width above a piece's lower end."""
        power = self.slope[piece] + order + 2
        start = 2 * math.pi * SHARES[order] * self.low[piece] * np.exp((order + 2) * self.log_low[piece])
        return np.asarray(start * width * growth(power, width))

    def _down(self, order: int, place: Place, width: Any) -> FloatArray:
        """Contribution to a moment of a width above a place, inside its piece."""
        piece, rest = place
        power = self.slope[piece] + order + 2
        start = 2 * math.pi * SHARES[order] * self.high[piece] * np.exp((order + 2) * self.log_high[piece])
        return np.asarray(start * np.exp(-power * rest) * width * growth(power, width))

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
        return np.asarray(self._after[place.piece + 1] + self._down(0, place, place.rest))

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
        rest = y * np.where(flat, 1.0, np.log1p(np.maximum(x, -1 + 1e-16)) / np.where(flat, 1.0, x))
        return Place(piece, np.minimum(rest, self.width[piece]))

    def below(self, order: int, place: Place) -> FloatArray:
        """m_n of all longer wavelengths."""
        rise = self.width[place.piece] - place.rest
        return np.asarray(self._before[order][place.piece] + self._up(order, place.piece, rise))

    def between(self, order: int, start: Place, end: Place) -> FloatArray:
        """m_n of the wavelengths from one place to a higher one."""
        inside = self._down(order, start, np.where(start.piece == end.piece, start.rest - end.rest, start.rest))
        whole = self._before[order][end.piece] - self._before[order][np.minimum(start.piece + 1, end.piece)]
        last = self._up(order, end.piece, self.width[end.piece] - end.rest)
        return np.asarray(inside + np.where(start.piece == end.piece, 0.0, whole + last))

    def at(self, q: FloatArray) -> FloatArray:
        """C(q), zero outside the pieces."""
        log_q = np.log(q)
        piece = np.clip(np.searchsorted(self.log_high, log_q), 0, self.width.size - 1)
        rest = self.log_high[piece] - log_q
        inside = (rest >= -1e-15) & (rest <= self.width[piece] * (1 + 1e-14) + 1e-15)
        return np.where(inside, self.high[piece] * np.exp(-self.slope[piece] * rest), 0.0)
