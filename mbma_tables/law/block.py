"""The block of a contact law (layout in `core/mbma.h`): its indices, and its inverse."""

import math
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from mbma_tables.common.arguments import FloatArray
from mbma_tables.core import core

DEGREE = 8
CENTRE, RATE, FORCE_AT, AREA_AT, ENERGY_AT = 0, 1, 2, 3 + DEGREE, 4 + 2 * DEGREE  # in a record
RECORD = 5 + 2 * DEGREE
# names of the quantities
QUANTITIES = ("pressure", "area", "stiffness", "area_slope", "energy")
FORCE, AREA = range(2)

# words of the head
(
    H_MAX, SCALE, LOW, HIGH, PLUS, MINUS, KINK_SIGN, KINK, KINK_SIGN_2, KINK_2, POWER_F, POWER_A, LOWEST, HIGHEST,
    EXPONENT, MINUS_ROWS, RECORDS, ENDS,
) = range(18)  # fmt: skip
HEAD = 18

INVERSE_DEGREE = 5
INVERSE_BITS = 2  # bits of the mantissa: 4 buckets per octave of force or area
INVERSE_RECORD = 3 + INVERSE_DEGREE + 1
INVERSE_HEAD = 6
Y_LEAST, Y_LOW, Y_HIGH, Y_TURN, FIRST_BUCKET, END = range(INVERSE_HEAD)
OCTAVES = 100  # below the largest value; lighter loads are found by iteration
LEAST = float(np.finfo(float).tiny)
POINTS = chebyshev.chebpts1(INVERSE_DEGREE + 1)
TRANSFORM: Any = np.linalg.inv(np.vander(POINTS, increasing=True)).T  # values there to monomials


def inverse_block(which: int, block: FloatArray, end: float) -> FloatArray:
    """The inverse of force or area of a block, down to the gap `end`: starting values for a Newton step on the law.

    Polynomials of x in buckets of force or area, found from their bits: `INVERSE_HEAD` numbers, then records of centre,
    rate, the sign of the side and INVERSE_DEGREE + 1 coefficients.
    """
    ends = bool(block.view(np.int64)[ENDS])
    top = block[H_MAX] - block[LOW] / block[SCALE] if ends else block[HIGHEST]
    values = np.empty(3)
    core.law_fill(np.array([top, end, 0.0]), block, *((None, values) if which == AREA else (values, None)), *[None] * 3)
    least, most, middle = values.tolist()
    bottom = min(max(least, most * 2.0**-OCTAVES, LEAST), most)
    turn = middle if block[PLUS] != block[MINUS] and end < 0 else math.inf
    bits = 52 - INVERSE_BITS
    first, last = (int(np.float64(y).view(np.int64) >> bits) for y in (bottom, most))
    edges = (np.arange(first, last + 2) << bits).view(np.float64)
    edges[0], edges[-1] = bottom, max(most, edges[-2])
    if turn < most:
        edges = np.insert(edges, np.searchsorted(edges, max(turn, bottom)), max(turn, bottom))
    centre, half = (edges[1:] + edges[:-1]) / 2, (edges[1:] - edges[:-1]) / 2
    wanted = (centre[:, None] + half[:, None] * POINTS).ravel()
    x, side = np.empty((2, wanted.size))
    core.inverse_nodes(wanted, block, which, end, x, side)
    records = np.zeros((centre.size, INVERSE_RECORD))
    records[:, 0] = centre
    records[:, 1] = np.divide(1.0, half, out=np.zeros_like(half), where=half > np.finfo(float).tiny)
    records[:, 2] = side.reshape(-1, POINTS.size)[:, POINTS.size // 2]
    records[:, 3:] = x.reshape(-1, POINTS.size) @ TRANSFORM
    head = np.zeros(INVERSE_HEAD)
    head[Y_LEAST] = 0.0 if ends else least
    head[[Y_LOW, Y_HIGH, Y_TURN, END]] = bottom, most, turn, end
    head.view(np.int64)[FIRST_BUCKET] = first
    return np.concatenate([head, records.ravel()])
