"""The calibrated law and Persson's theory of many spectra at once, sums of power laws each.

`calibrated.formulas.SpectrumLaw` prepares the polynomials of one spectrum, which takes as long as
hundreds of answers here.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray, filled
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.common.shared import shared
from mbma_tables.core import core
from mbma_tables.surfaces.banded import BandedSurface
from mbma_tables.surfaces.surface import Surface
from mbma_tables.theories.calibrated.formulas import (
    CONSTANTS,
    NARROWNESS,
    CalibratedConstants,
    Spectrum,
    SpectrumLaw,
)

# ln y of the inner integral: the first cell, up to whose end it is linear in ln y to 3e-10,
# the last, above which it does not count, cells in 1, and coefficients of each
FIRST = -11.0
LAST = 3.1
RATE = 16.0
TERMS = 6
# surfaces whose wavenumbers are found in one call, in room that is more than enough
TOGETHER = 64
ENERGY_NODES = 40  # of forces on the way to h_max
COUNT, FIRST_WORD, WORD_STEP = 0, 1, 3  # places of numbers, and rows of a wavenumber


@shared()
def _unit_integral(powers: int) -> FloatArray:
    """Polynomials of the inner integral of one power of W, times exp(2 y^2), cell by cell.

    The law of a single wavenumber is this integral over 4.
    """
    weight, cubic = ((1.0, 0.0), (0.0, 1.0), (0.0, 0.0))[powers]
    constants = CalibratedConstants(
        weight=weight, weight_slope=0.0, cubic=cubic, tail=0.0, area_slope=0.0
    )
    one = np.ones(1)
    law = SpectrumLaw(Spectrum(one, one, one, 1.0, 1.5), None, constants)
    edges = np.arange(FIRST, LAST, 1 / RATE)
    places = np.cos(np.pi * (np.arange(TERMS) + 0.5) / TERMS)
    log_y = np.add.outer(edges, (1 + places) / (2 * RATE))
    # beyond, the law has no force; there waves have no weight either
    log_y = np.minimum(log_y, 2.94)
    u = law.separation_persson(np.exp(log_y))[0]
    values = np.exp(np.log(4 * u) + 2 * np.exp(2 * log_y))
    found = np.linalg.solve(np.vander(places, increasing=True), values.T).T
    # there the integral is linear in ln y
    found[0, 1] = -np.sqrt(2 / np.pi) / RATE * weight
    found[0, 2:] = 0.0
    return np.ascontiguousarray(found)


@shared()
def inner_integral(
    constants: CalibratedConstants,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The inner integral of W and its derivative by the narrowness, as the core takes them."""
    parts = [_unit_integral(k) for k in range(3)]
    a = constants.weight
    b = constants.cubic
    polynomials = a * parts[0] + b * parts[1] + (1 - a - b) * parts[2]
    slopes = constants.weight_slope * (parts[0] - parts[2])
    return polynomials.ravel(), slopes.ravel(), np.array([FIRST, RATE, NARROWNESS])


@shared()
def energy_rule() -> FloatArray:
    """Gauss's nodes on [-1, 1] and their weights, by which the core integrates forces."""
    return np.concatenate(np.polynomial.legendre.leggauss(ENERGY_NODES))


class Spectra:
    """Surfaces prepared for the core.

    Parameters
    ----------
    laws : array, shape (surfaces, parts, 4)
        Power laws whose sum a spectrum is: q_low, q_high, C at q_low, power of q.
    alpha, h_max : array, shape (surfaces,)
        Nayak's bandwidth parameter; highest point [h_rms], perhaps infinite.
    constants : CalibratedConstants, optional

    Raises
    ------
    ConvergenceError
        Where the quadrature over wavenumbers needs too many of them.
    """

    def __init__(
        self,
        laws: FloatArray,
        alpha: FloatArray,
        h_max: FloatArray,
        constants: CalibratedConstants = CONSTANTS,
    ) -> None:
        inner = inner_integral(constants)
        given = np.array(dataclasses.astuple(constants))
        room = np.empty(TOGETHER * core.most_wave_words())
        waves = []
        numbers = np.empty((len(laws), core.words_of_spectrum_numbers()))
        used = 0
        for start in range(0, len(laws), TOGETHER):
            some = slice(start, start + TOGETHER)
            columns = [np.ascontiguousarray(each[some], float) for each in (alpha, h_max)]
            flat = np.ascontiguousarray(laws[some], float).ravel()
            own = numbers[some]
            core.spectra_of(*columns, flat, given, *inner, room, own.ravel())
            words = int(WORD_STEP * own[:, COUNT].sum())
            waves.append(room[:words].copy())
            own[:, FIRST_WORD] += used
            used += words
        failed = numbers[:, COUNT] == 0
        if failed.any():
            raise ConvergenceError(
                f"the spectra of {failed.sum()} surfaces have no quadrature", failed
            )
        self._found = (
            np.concatenate(waves),
            numbers.ravel(),
            constants.area_t0,
            *inner,
        )

    def _answers(self, loop: Any, columns: Any, outputs: int) -> FloatArray:
        fill = functools.partial(loop, *self._found)
        return filled(fill, columns, outputs)

    def contacts(self, columns: tuple[Any, FloatArray]) -> FloatArray:
        """Rows of force, area and -dF/du by owners, numbers from 0, and u [h_rms], as of a `Table`."""
        return self._answers(core.spectra_contact, columns, 3)

    def energies(self, columns: tuple[Any, FloatArray]) -> FloatArray:
        """Integrals of force from u to h_max, over h_rms, by owners and u [h_rms]."""
        loop = functools.partial(core.spectra_energy, *self._found, energy_rule())
        energies: FloatArray = filled(loop, columns, 1)[0]
        return energies

    def separations(self, columns: tuple[Any, FloatArray]) -> FloatArray:
        """A row of u [h_rms] by owners and forces over A0 E* g, positive."""
        return self._answers(core.spectra_separation, columns, 1)


def power_laws_of(
    surface: Surface | BandedSurface,
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Hurst exponents and zeta_1, flat, of surfaces that are self-affine, and which these are."""
    if isinstance(surface, BandedSurface):
        hurst, zeta_1, is_one = (np.ravel(each) for each in surface.power_laws)
        return hurst, zeta_1, is_one.astype(bool)
    numbers = surface.hurst, surface.zeta_1
    hurst, zeta_1 = (np.asarray(each, float).ravel() for each in numbers)
    return hurst, zeta_1, np.ones(hurst.size, bool)


def laws_of(surface: Surface | BandedSurface) -> FloatArray:
    """`laws` of a batch."""
    if not isinstance(surface, BandedSurface):
        return self_affine_laws(*power_laws_of(surface)[:2])
    bands = [np.stack(np.broadcast_arrays(*band), axis=-1) for band in surface.bands]
    return np.stack(bands, axis=-2).reshape(-1, len(bands), 4)


def self_affine_laws(hurst: FloatArray, zeta_1: FloatArray) -> FloatArray:
    """`laws` of self-affine surfaces, wavenumbers over q0."""
    one = np.ones_like(hurst)
    return np.stack([one, zeta_1, one, -2 - 2 * hurst], axis=-1)[:, None]
