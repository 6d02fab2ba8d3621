"""The calibrated law and Persson's theory of many spectra at once, sums of power laws each.

`calibrated.formulas.Law` prepares the polynomials of one spectrum, which takes as long as
hundreds of answers here.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray, filled
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.common.shared import shared
from mbma_tables.core import core
from mbma_tables.theories.calibrated.formulas import (
    CONSTANTS,
    NARROWNESS,
    Constants,
    Law,
    Spectrum,
)

# ln y of the inner integral: the first cell, up to whose end it is linear in ln y to 3e-10,
# the last, above which it does not count, cells in 1, and coefficients of each
FIRST = -11.0
LAST = 3.1
RATE = 16.0
TERMS = 6
# room for the wavenumbers of each part of a spectrum: most need no more than the first
ROOM = 256, 512, 1024


@shared()
def _unit_integral(powers: int) -> FloatArray:
    """Polynomials of the inner integral of one power of W, times exp(2 y^2), cell by cell.

    The law of a single wavenumber is this integral over 4.
    """
    weight, cubic = ((1.0, 0.0), (0.0, 1.0), (0.0, 0.0))[powers]
    constants = Constants(
        weight=weight, weight_slope=0.0, cubic=cubic, tail=0.0, area_slope=0.0
    )
    one = np.ones(1)
    law = Law(Spectrum(one, one, one, 1.0, 1.5), None, constants)
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
def inner_integral(constants: Constants) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The inner integral of W and its derivative by the narrowness, as the core takes them."""
    parts = [_unit_integral(k) for k in range(3)]
    a = constants.weight
    b = constants.cubic
    polynomials = a * parts[0] + b * parts[1] + (1 - a - b) * parts[2]
    slopes = constants.weight_slope * (parts[0] - parts[2])
    return polynomials.ravel(), slopes.ravel(), np.array([FIRST, RATE, NARROWNESS])


class Spectra:
    """Surfaces prepared for the core.

    Parameters
    ----------
    laws : array, shape (surfaces, parts, 4)
        Power laws whose sum a spectrum is: q_low, q_high, C at q_low, power of q.
    alpha, h_max : array, shape (surfaces,)
        Nayak's bandwidth parameter; highest point [h_rms], perhaps infinite.
    constants : Constants, optional

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
        constants: Constants = CONSTANTS,
    ) -> None:
        self._columns = laws, alpha, h_max
        self._constants = constants
        count, parts, _ = laws.shape
        numbers = np.empty(count * core.words_of_spectrum_numbers())
        inner = inner_integral(constants)
        columns = [np.ascontiguousarray(each, float) for each in (alpha, h_max)]
        given = np.array(dataclasses.astuple(constants))
        flat = np.ascontiguousarray(laws).ravel()
        for most in ROOM:
            waves = np.empty(count * 3 * most * parts)
            failed = core.spectra_of(*columns, flat, given, *inner, waves, numbers)
            if not failed:
                break
        if failed:
            raise ConvergenceError(
                f"{failed} spectra have no quadrature of {most * parts} wavenumbers",
                numbers.reshape(count, -1)[:, 0] == 0,
            )
        self._found = waves, numbers, constants.area_t0, *inner

    def _answers(self, loop: Any, columns: Any, outputs: int) -> FloatArray:
        fill = functools.partial(loop, *self._found)
        return filled(fill, columns, outputs)

    def contacts(self, columns: tuple[Any, FloatArray]) -> FloatArray:
        """Rows of force, area and -dF/du by owners, numbers from 0, and u [h_rms], as of a `Table`."""
        return self._answers(core.spectra_contact, columns, 3)

    def separations(self, columns: tuple[Any, FloatArray]) -> FloatArray:
        """A row of u [h_rms] by owners and forces over A0 E* g, positive."""
        return self._answers(core.spectra_separation, columns, 1)


def self_affine_laws(hurst: FloatArray, zeta_1: FloatArray) -> FloatArray:
    """`laws` of self-affine surfaces, wavenumbers over q0."""
    one = np.ones_like(hurst)
    return np.stack([one, zeta_1, one, -2 - 2 * hurst], axis=-1)[:, None]
