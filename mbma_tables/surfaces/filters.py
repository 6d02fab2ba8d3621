"""Filters of height maps and line scans: least-squares polynomials, and the Gaussian filters of ISO 16610-61."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray

GAUSSIAN = math.log(2)  # of the filter's exponent: wavelengths equal to the nesting index are halved
LAST_WAVES = 0.01  # amplitude below which wavelengths count as removed by an S-filter


def without_polynomial(heights: FloatArray, degree: int) -> FloatArray:
    """Heights less their least-squares polynomial of that total degree: same as SurfaceTopography's modes."""
    bases = [
        np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1, 1, count), degree))[0] for count in heights.shape
    ]
    if heights.ndim == 1:
        return np.asarray(heights - bases[0] @ (bases[0].T @ heights))
    along, across = bases
    wanted = np.add.outer(np.arange(degree + 1), np.arange(degree + 1)) <= degree
    return np.asarray(heights - along @ (wanted * (along.T @ heights @ across)) @ across.T)


def last_wave(nesting: float) -> float:
    """Wavenumber above which an S-filter leaves less than `LAST_WAVES` of the amplitude."""
    return 2 * math.pi / nesting * math.sqrt(-math.log(LAST_WAVES) / GAUSSIAN)


def gaussian(values: FloatArray, steps: tuple[float, ...], name: str, nesting: float) -> FloatArray:
    """Periodic heights after a Gaussian filter: "s_filter" keeps long wavelengths, "l_filter" short ones."""
    waves = [2 * np.pi * np.fft.fftfreq(count, step) for count, step in zip(values.shape, steps, strict=True)]
    q2: Any = np.add.outer(waves[0] ** 2, waves[1] ** 2) if values.ndim == 2 else waves[0] ** 2
    left = np.exp(-GAUSSIAN * q2 * (nesting / (2 * math.pi)) ** 2)
    left = np.where(q2 < last_wave(nesting) ** 2, left, 0.0) if name == "s_filter" else 1 - left
    return np.asarray(np.fft.ifftn(np.fft.fftn(values) * left).real)
