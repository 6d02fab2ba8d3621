"""A law's numbers for languages that do not read the core's C, and how these are written.

They are polynomials in order of rising overclosure c. Record k, which holds where edges[k -
1] <= scale c < edges[k], is, with x = scale c for the first `side` records and x = scale (c
- h_max) for the rest,

    t = (x - centre) rate,   p = sum_j p[j] t^j,   A/A0 = sum_j a[j] t^j,
    dp/dc = scale rate dp/dt,   energy = energy_0 + t sum_j p[j] t^j/(j + 1)/(scale rate).

Where contact ends at c = 0 the first record's polynomials are multiplied by t^power.
A curve of another quantity has records of its own, against x = scale c, or x = scale (d -
blocked) with the gap d = h_max - 2 c. With a power the first one is multiplied by it.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from mbma_tables.common.arguments import FloatArray
from mbma_tables.contacts.law import block as at
from mbma_tables.contacts.law.block import (
    AREA_AT,
    CENTRE,
    ENERGY_AT,
    FORCE_AT,
    POWER_F,
    RATE,
    SCALE,
)
from mbma_tables.contacts.law.law import ContactLaw
from mbma_tables.export.code.curves import Curve
from mbma_tables.export.text import number, wrapped

# steps of coefficients over the least value and the least slope of a polynomial; flatter
# ones count as so steep
VALUES = 2e-14
SLOPES = 4e-13
FLAT = 1e-4
# more than any double has: coefficients stay as they are
MOST_DECIMALS = 400


class _Side(NamedTuple):
    """Records on one side of a block."""

    begins: FloatArray  # where each begins, by the side's own x
    records: FloatArray


def law_numbers(law: ContactLaw) -> dict[str, float | FloatArray]:
    """Numbers of a law, by name."""
    head = law.block
    ends = law.highest == math.inf
    side, edges, records, signs = _in_order(law.block, law.h_max, ends)
    return {
        "side": side,
        "scale": 2 * float(head[SCALE]),
        "power_p": float(head[POWER_F]) if ends else 0.0,
        "power_a": float(head[at.POWER_A]) if ends else 0.0,
        "edges": edges,
        "centre": signs * records[:, CENTRE],
        "rate": signs * records[:, RATE],
        "energies": records[:, ENERGY_AT] / 2,
        "p": records[:, FORCE_AT:AREA_AT],
        "a": records[:, AREA_AT:ENERGY_AT],
    }


def curve_numbers(curve: Curve, h_max: float) -> dict[str, float | FloatArray]:
    """Numbers of a curve's polynomials, by name."""
    head = curve.block
    scale = float(head[SCALE])
    if curve.from_contact:
        scale *= 2
        side, edges, records, signs = _in_order(head, h_max, ends=True)
    else:
        begins, records = _sides(head)[0]
        side, edges, signs = len(records), begins[1:], np.ones(len(records))
    return {
        "side": side,
        "blocked": -float(head[at.H_MAX]),
        "scale": scale,
        "power": float(head[POWER_F]),
        "edges": edges,
        "centre": signs * records[:, CENTRE],
        "rate": signs * records[:, RATE],
        "p": records[:, FORCE_AT:AREA_AT],
    }


def _in_order(
    block: FloatArray, h_max: float, ends: bool
) -> tuple[int, FloatArray, FloatArray, FloatArray]:
    """Records in order of overclosure: how many are from first contact on, edges, records, and signs of their x."""
    scale = 2 * float(block[SCALE])
    sides = _sides(block)
    edges: list[FloatArray] = []
    parts: list[FloatArray] = []
    side = 0
    if ends:
        # from first contact on: records are in order of overclosure
        side = len(sides[0].begins)
        edges.append(sides[0].begins)
        parts.append(sides[0].records)
    for begins, records_of_side in sides[ends:]:
        # towards full compression an end belongs to the record of larger gaps, also where
        # the sides meet
        above = np.append(begins[1:], 1.0)[::-1]
        edges.append(np.nextafter(h_max * scale - above, math.inf))
        parts.append(records_of_side[::-1])
    records = np.concatenate(parts)
    signs = np.where(np.arange(len(records)) < side, 1.0, -1.0)
    return side, np.concatenate(edges)[1:], records, signs


def _sides(block: FloatArray) -> list[_Side]:
    """The sides of a block."""
    first_record = int(block.view(np.int64)[at.RECORDS])
    records = block[first_record:].reshape(-1, at.RECORD)
    # where nothing lies below x's beginning the first record is a copy of the second
    if records[0, CENTRE] == records[1, CENTRE]:
        records = records[1:]
    begins = records[:, CENTRE] - 1 / records[:, RATE]
    # x begins again on the other side
    cut = np.flatnonzero(np.diff(records[:, CENTRE]) < 0) + 1
    parts = zip(np.split(begins, cut), np.split(records, cut), strict=True)
    return [_Side(*part) for part in parts]


def brackets(values: FloatArray) -> str:
    """A column, or rows of polynomials, as Python has them."""
    if values.ndim == 1:
        return f"[{wrapped(', '.join(map(number, values)))}]"
    return f"[\n{_lines(decimals(values), '[', '],')}\n]"


def braces(values: FloatArray) -> str:
    """The same for Modelica."""
    return brackets(values).replace("[", "{").replace("]", "}").replace(",\n}", "\n}")


def matrix(values: FloatArray) -> str:
    """A column, or rows of polynomials, of MATLAB."""
    rows = values[:, None] if values.ndim == 1 else decimals(values)
    return f"[\n{_lines(rows, '', ';')}]"


def _lines(rows: FloatArray, begin: str, end: str) -> str:
    return "\n".join(f"{begin}{', '.join(map(number, row))}{end}" for row in rows)


def _decimal_places(row: FloatArray) -> int:
    """Decimals with which coefficients are written.

    Values are then right to 1e-13, slopes to about 1e-11.
    """
    values = polyval([-1, 0, 1], row)
    slopes = polyval([-1, 0, 1], polyder(row))
    least_value = float(np.abs(values).min())
    if least_value == 0:
        return MOST_DECIMALS
    # by logarithms: a pressure may be so small that the step itself is below the smallest
    # double
    log_value = math.log10(least_value)
    log_slope = math.log10(FLAT) + log_value
    # about a maximum slopes are small, though not at the ends
    if (slopes > 0).all() or (slopes < 0).all():
        log_slope = max(math.log10(np.abs(slopes).min()), log_slope)
    log_step = min(math.log10(VALUES) + log_value, math.log10(SLOPES) + log_slope)
    return min(-math.floor(log_step), MOST_DECIMALS)


def decimals(rows: FloatArray) -> FloatArray:
    """Coefficients in decimal steps."""
    written = []
    for row in rows:
        places = _decimal_places(row)
        written.append([round(coefficient, places) for coefficient in row.tolist()])
    return np.array(written)
