"""Conductance of a gas in the gaps as polynomials of the gap, for laws as code."""

from typing import NamedTuple

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.common.units import factor
from mbma_tables.contacts.law import block as at
from mbma_tables.contacts.law.block import (
    Side,
    assemble,
    first_record,
    power_record,
    side_pieces,
)
from mbma_tables.contacts.quantities.gas import jump_of
from mbma_tables.core import core
from mbma_tables.export.exported_law import ExportedLaw, GasInGaps

# tolerances of the polynomials, relative to the value there and that at first contact:
# the first that can be met, coarser ones of simulated maps, whose answers have kinks
RTOLS = (1e-5, 1e-4, 1e-3, 1e-2)
# mean gap over h_max at which the polynomials end, where contact ends
FAR = 100.0
# mean gap over h_max below which there is none
NEAREST = 1e-9
# powers of two below which gaps are in one record, at the most and at the least
OCTAVES = range(6, 21)
CHECKED = 501
MOST_PIECES = 250  # of polynomials, where a coarser tolerance needs fewer


class GasLaw(NamedTuple):
    """Conductance of a gas against the gap d, in the unit of a law's conductance.

    It is the block's force less `offset`, and far / (u + jump) where the bodies are farther
    apart than the block reaches.
    """

    block: FloatArray
    offset: float
    far: float
    jump: float  # temperature jump of both faces, in the law's unit of length
    # of the polynomials where bodies touch, over the value, or that at first contact if larger
    error: float


def gas_law(exported: ExportedLaw, gas: GasInGaps) -> GasLaw:
    """The conductance of a gas in the gaps of an exported law."""
    law = exported.law
    h_max = law.h_max
    bottom = float(law.block[at.LOWEST])
    top = (2 * FAR - 1) * h_max if exported.ends else law.highest
    span = top - bottom

    def conductance(d: FloatArray) -> FloatArray:
        u = np.maximum((h_max + d) / 2, NEAREST * h_max)
        return gas.conductance(exported.answer(u))

    # near full contact the gas has nothing left: what is added keeps the sum positive
    offset = float(conductance(np.array([min(h_max, top)]))[0])

    def values(x: FloatArray) -> FloatArray:
        whole = offset + conductance(bottom + span * x)
        return np.stack([whole, whole])

    kinks = ((h_max - bottom) / span,) if exported.ends else ()
    for rtol in RTOLS:
        start, first = first_record(
            lambda start: power_record(values, start, (0.0, 0.0)), OCTAVES, rtol
        )
        side = Side(1, start, values, kinks)
        try:
            pieces = side_pieces(side, rtol)
        except ConvergenceError:
            if rtol == RTOLS[-1]:
                raise
            continue
        if len(pieces.records) <= MOST_PIECES:
            break
    block, _, _ = assemble(-bottom, 1 / span, [side], [pieces], first, (bottom, top))
    block.view(np.int64)[at.ENDS] = 0
    metre = factor("m", exported.length)
    _, jump = jump_of(
        gas.gas.name, gas.gas.temperature, gas.gas.pascals, gas.gas.accommodation
    )
    jump_length = float(jump) * metre
    u_far = (h_max + top) / 2
    far = (float(values(np.array([1.0]))[0, 0]) - offset) * (u_far + jump_length)
    d = np.linspace(bottom, min(h_max, top), CHECKED)
    written = np.empty(CHECKED)
    core.law_fill(d, block, written, *[None] * 4)
    exact = conductance(d)
    # next to full contact the gas has nothing left: relative to first contact there
    error = np.abs(written - offset - exact) / np.maximum(exact, offset)
    return GasLaw(block, offset, far, jump_length, float(error.max()))
