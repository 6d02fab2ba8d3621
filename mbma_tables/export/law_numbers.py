"""Numbers of a contact law for languages that do not read the core's C: polynomials in order of rising overclosure c.

Record k, which holds where edges[k - 1] <= scale c < edges[k], is, with x = scale c for the first `side` records and
x = scale (c - h_max) for the rest,

    t = (x - centre) rate,   p = sum_j p[j] t^j,   A/A0 = sum_j a[j] t^j,   dp/dc = scale rate dp/dt,
    energy = energy_0 + t sum_j p[j] t^j/(j + 1)/(scale rate).

Where contact ends at c = 0 the first record's polynomials are multiplied by t^power. Leakage has records of its own
against x = scale (d - blocked) with the gap d = h_max - 2 c; with a power the first one is multiplied by it, and K is
zero at and below x = 0. Where bodies are apart, K is u^3 (1 - 1.5/((u/h_rms)^2 + 4)).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from mbma_tables.common.arguments import FloatArray
from mbma_tables.export.text import wrapped
from mbma_tables.law import block as at
from mbma_tables.law.block import AREA_AT, CENTRE, ENERGY_AT, FORCE_AT, POWER_F, RATE, SCALE
from mbma_tables.law.law import ContactLaw
from mbma_tables.law.leakage import LeakageLaw

# steps of coefficients over the least value and the least slope of a polynomial; flatter ones count as so steep
VALUES, SLOPES, FLAT = 2e-14, 4e-13, 1e-4


def flow_numbers(leakage: LeakageLaw) -> dict[str, Any]:
    """Numbers of a law's leakage, by name."""
    head, ((x, records), *_) = leakage.block, _sides(leakage.block)
    return {
        "blocked": -float(head[at.H_MAX]),
        "scale": float(head[SCALE]),
        "power": float(head[POWER_F]),
        "h_rms": leakage.h_rms,
        "edges": x[1:],
        "centre": records[:, CENTRE],
        "rate": records[:, RATE],
        "p": records[:, FORCE_AT:AREA_AT],
    }


def law_numbers(law: ContactLaw) -> dict[str, Any]:
    """Numbers of a law, by name."""
    head, ends, sides = law.block, law.highest == math.inf, _sides(law.block)
    scale, side = 2 * float(head[SCALE]), len(sides[0][0]) if ends else 0
    edges, numbers = ([sides[0][0]], [sides[0][1]]) if ends else ([], [])
    for x, records in sides[ends:]:
        # towards full compression an end belongs to the record of larger gaps, also where the sides meet
        above = np.append(x[1:], 1.0)[::-1]
        edges.append(np.nextafter(law.h_max * scale - above, math.inf))
        numbers.append(records[::-1])
    records = np.concatenate(numbers)
    signs = np.where(np.arange(len(records)) < side, 1.0, -1.0)
    return {
        "h_max": law.h_max,
        "side": side,
        "scale": scale,
        "ends": int(ends),
        "power_p": float(head[POWER_F]) if ends else 0.0,
        "power_a": float(head[at.POWER_A]) if ends else 0.0,
        "edges": np.concatenate(edges)[1:],
        "centre": signs * records[:, CENTRE],
        "rate": signs * records[:, RATE],
        "energies": records[:, ENERGY_AT] / 2,
        "p": records[:, FORCE_AT:AREA_AT],
        "a": records[:, AREA_AT:ENERGY_AT],
    }


def _sides(block: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Where records of each side of a block begin, by its own x, and the records."""
    records = block[int(block.view(np.int64)[at.RECORDS]) :].reshape(-1, at.RECORD)
    if records[0, CENTRE] == records[1, CENTRE]:  # a copy
        records = records[1:]
    begins = records[:, CENTRE] - 1 / records[:, RATE]
    cut = np.flatnonzero(np.diff(records[:, CENTRE]) < 0) + 1
    return list(zip(np.split(begins, cut), np.split(records, cut), strict=True))


def brackets(values: FloatArray) -> str:
    """A column, or rows of polynomials, as Python has them."""
    if values.ndim == 1:
        return f"[{wrapped(map(repr, values.tolist()))}]"
    return f"[\n{_lines(_decimals(values), '[', '],')}\n]"


def braces(values: FloatArray) -> str:
    """The same for Modelica."""
    return brackets(values).replace("[", "{").replace("]", "}").replace(",\n}", "\n}")


def matrix(values: FloatArray) -> str:
    """A column, or rows of polynomials, of MATLAB."""
    return f"[\n{_lines(values[:, None] if values.ndim == 1 else _decimals(values), '', ';')}]"


def _lines(rows: FloatArray, begin: str, end: str) -> str:
    return "\n".join(f"{begin}{', '.join(map(repr, row))}{end}" for row in rows.tolist())


def _step(row: FloatArray) -> float:
    """The step in which coefficients are written: values are then right to 1e-13, slopes to about 1e-11."""
    values, slopes = (polyval([-1, 0, 1], a) for a in (row, polyder(row)))
    value = float(np.abs(values).min())
    # about a maximum slopes are small, though not at the ends
    slope = float(np.abs(slopes).min()) if slopes.min() * slopes.max() > 0 else 0.0
    return min(VALUES * value, SLOPES * max(slope, FLAT * value))


def _decimals(rows: FloatArray) -> FloatArray:
    """Coefficients in decimal steps."""
    places = [-math.floor(math.log10(_step(row))) for row in rows]
    return np.array([[round(value, k) for value in row.tolist()] for row, k in zip(rows, places, strict=True)])
