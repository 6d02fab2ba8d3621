"""A contact law as numbers for other languages: polynomials in order of rising overclosure, found by their edges.

Record k, which holds where edges[k - 1] <= scale c < edges[k], is, with x = scale c for the first
`side` records and x = scale (c - h_max) for the rest,

    t = (x - centre) rate,   p = sum_j force[j] t^j,   A/A0 = sum_j area[j] t^j,   dp/dc = scale rate dp/dt,
    energy = energy_0 + t sum_j force[j] t^j/(j + 1)/(scale rate).

Where contact ends at c = 0 the first record's polynomials are multiplied by t^power. Leakage has records of its own,
over the gap d = h_max - 2 c (`FlowNumbers`). These are the numbers of `ContactLaw`; each language's template
is a reader of them.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.law import block as at
from mbma_tables.law.block import AREA_AT, CENTRE, ENERGY_AT, FORCE_AT, POWER_F, RATE, SCALE
from mbma_tables.law.law import ROUNDING, ContactLaw
from mbma_tables.law.leakage import LeakageLaw


@dataclasses.dataclass(frozen=True)
class LawNumbers:
    """Numbers of a law against overclosure c, from first contact at 0 (see the module)."""

    h_max: float
    c_least: float  # the law's range: minus infinity where contact ends at c = 0,
    c_turn: float  # where inverses end: at the maximum of pressure, or c_most,
    c_most: float  # end of the range
    ends: bool  # whether contact ends at c = 0, and pressure is zero below
    side: int  # how many records count from first contact; the others count from full compression
    scale: float
    power_p: float  # of pressure and of area in the first record; zero where contact does not end
    power_a: float
    edges: FloatArray  # of scale c, shape (records - 1,)
    centre: FloatArray  # this and the next two of shape (records,)
    rate: FloatArray
    energies: FloatArray
    force: FloatArray  # shape (records, 9)
    area: FloatArray  # likewise


@dataclasses.dataclass(frozen=True)
class FlowNumbers:
    """Numbers of a law's leakage against x = scale (d - blocked): K = sum_j force[j] t^j, t = (x - centre) rate.

    The first record, x < edges[0], is multiplied by t^power; with a power K is zero at and below x = 0. Where bodies
    are apart, d > h_max of a law that ends there, K is u^3 (1 - 1.5/((u/h_rms)^2 + 4)).
    """

    blocked: float  # gap d from which x counts
    scale: float
    power: float
    h_rms: float
    edges: FloatArray  # shape (records - 1,)
    centre: FloatArray  # shape (records,)
    rate: FloatArray  # likewise
    force: FloatArray  # shape (records, 9)


def flow_numbers(leakage: LeakageLaw) -> FlowNumbers:
    """The numbers of a law's leakage."""
    head = leakage.block
    blocked = -float(head[at.H_MAX])
    # in the layout of a law that counts from full compression
    as_law = dataclasses.replace(leakage.law, block=head, h_max=-blocked, lowest=blocked)
    x, which = _intervals(as_law, 1.0)
    records = as_law.records[which]
    return FlowNumbers(
        blocked=blocked,
        scale=float(head[SCALE]),
        power=float(head[POWER_F]),
        h_rms=leakage.h_rms,
        edges=x[1:-1],
        centre=records[:, CENTRE],
        rate=records[:, RATE],
        force=records[:, FORCE_AT:AREA_AT],
    )


def law_numbers(law: ContactLaw) -> LawNumbers:
    """The numbers of a law."""
    head = law.block
    h_max, ends = law.h_max, bool(head.view(np.int64)[at.ENDS])
    scale = 2 * float(head[SCALE])
    # sides in order of rising c: by the depth below h_max, then by the height above full compression
    sides = ([-1.0] if ends else []) + ([1.0] if head[at.MINUS] > 0 else [])
    edges: list[FloatArray] = []
    numbers, signs = [], []
    for sign in sides:
        x, records = _intervals(law, sign)
        if sign > 0:
            # towards full compression an end belongs to the record of larger gaps, also where the sides meet
            x, records = np.nextafter(h_max * scale - x[::-1], math.inf), records[::-1]
        edges.append(x[:-1] if edges else x[1:-1])
        numbers.append(records)
        signs.append(np.full(records.size, -sign))
    records, of_side = law.records[np.concatenate(numbers)], np.concatenate(signs)
    turn = law.lowest if law.turning_point is None else law.turning_point
    return LawNumbers(
        h_max=h_max,
        c_least=-math.inf if ends else (h_max - float(head[at.HIGHEST])) / 2,
        c_turn=(h_max - turn) / 2,
        c_most=(h_max - float(head[at.LOWEST])) / 2,
        ends=ends,
        side=numbers[0].size if ends else 0,
        scale=scale,
        power_p=float(head[POWER_F]) if ends else 0.0,
        power_a=float(head[at.POWER_A]) if ends else 0.0,
        edges=np.concatenate(edges),
        centre=of_side * records[:, CENTRE],
        rate=of_side * records[:, RATE],
        energies=records[:, ENERGY_AT] / 2,
        force=records[:, FORCE_AT:AREA_AT],
        area=records[:, AREA_AT:ENERGY_AT],
    )


def _intervals(law: ContactLaw, sign: float) -> tuple[FloatArray, Any]:
    """Ends of the intervals of x on the side where x = (h_max + sign d) scale, and the records that hold there."""
    head, whole = law.block, law.block.view(np.int64)
    two = head[at.PLUS] != head[at.MINUS]
    octaves = int(whole[at.MINUS_ROWS]) if two else len(law.rows)
    first = octaves if two and sign > 0 else 0
    edges = [np.array([0.0, head[at.LOW], 1.0])]
    for k, shift in enumerate(law.rows[first : first + octaves, 0]):
        # shifts of 63 mark octaves in which this side has nothing
        buckets = 1 << max(52 - int(shift), 0)
        edges.append(2.0 ** (int(whole[at.EXPONENT]) - 1023 + k) * (1 + np.arange(buckets) / buckets))
    for kink_sign, kink in ((at.KINK_SIGN, at.KINK), (at.KINK_SIGN_2, at.KINK_2)):
        if head[kink_sign] == sign:
            edges.append(np.array([(head[kink] + law.h_max) * head[SCALE]]))
    least = (law.h_max + law.lowest) * head[SCALE] if sign > 0 else 0.0
    x = np.unique(np.concatenate(edges))
    x = np.concatenate([[least], x[x > least * (1 + ROUNDING)]])
    middle = (x[1:] + x[:-1]) / 2
    records = law._records_at(sign * (middle / head[SCALE] - law.h_max), middle)
    begins = np.concatenate([[True], np.diff(records) != 0])
    return np.append(x[:-1][begins], x[-1]), records[begins]
