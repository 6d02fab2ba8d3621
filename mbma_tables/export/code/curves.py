"""Quantities of exported laws as polynomials of the gap: of gas, of flow, and any other of the registry."""

import dataclasses
import math
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError, InputError
from mbma_tables.common.units import factor
from mbma_tables.contacts.law import block as at
from mbma_tables.contacts.law.block import (
    Side,
    assemble,
    between_nodes,
    first_record,
    power_record,
    side_pieces,
    straight_record,
)
from mbma_tables.contacts.law.law import ContactLaw
from mbma_tables.contacts.quantities import registry
from mbma_tables.contacts.quantities.gas import jump_of
from mbma_tables.core import core
from mbma_tables.export.exported_law import ExportedLaw, GasInGaps

# tolerances of the polynomials, relative to the value there and of a gas to that at first
# contact: the first that can be met, coarser ones of simulated maps, whose answers have
# kinks
RTOLS = (1e-5, 1e-4, 1e-3, 1e-2)
# mean gap over h_max at which the polynomials of a gas end, where contact ends
FAR = 100.0
# mean gap over h_max below which there is no gas
NEAREST = 1e-9
# powers of two below which gaps are in one record, at the most and at the least
OCTAVES = range(6, 21)
ROUNDINGS = 8 * sys.float_info.epsilon
CHECKED = 2001
CHECKED_EACH = 17
# of the largest error of a gas there: with kinks of a theory it may be as large again between
BETWEEN = 2.0
LARGEST_ERROR = 0.05  # of a function that is written
MOST_PIECES = 250  # of polynomials, where a coarser tolerance needs fewer
# overclosures at which a quantity is looked at before it is fitted, over the largest
# up to a thousandth it must be there
SMALL = 50
LOOKED_AT = np.append(np.geomspace(1e-6, 1e-3, SMALL), np.linspace(0, 1, 201)[1:])
# gaps of parted bodies beyond h_max, over that
APART = np.array([1e-3, 1.0, 50.0])
# of a quantity and a slope of the same law, where one is a constant times the other
ROUNDED = 1e-11


@dataclasses.dataclass(frozen=True, eq=False)
class Curve:
    """A quantity against overclosure, and what continues it where bodies are apart.

    It is the block's force less `offset`, no longer known beyond `end`, and below `begin`
    apart + far/(u + jump), or the flow coefficient of wide gaps where `h_rms` is given.
    """

    block: FloatArray
    error: float  # of the polynomials, relative
    begin: float = -math.inf  # overclosures
    end: float = math.inf
    offset: float = 0.0
    apart: float = 0.0
    far: float = 0.0
    jump: float = 0.0
    h_rms: float = 0.0
    #: overclosure from which on a flow that is blocked in elastic contact is not known
    unknown_from: float = math.inf

    @property
    def from_contact(self) -> bool:
        """Whether polynomials begin at first contact, else at the least gap."""
        return bool(self.block[at.PLUS] < 0)


def curve_of_flow(exported: ExportedLaw) -> Curve:
    """The flow coefficient of an exported law."""
    leakage = exported.leakage
    return Curve(
        leakage.block,
        leakage.error,
        begin=0.0 if exported.ends else -math.inf,
        h_rms=leakage.h_rms,
        unknown_from=exported.unknown_from,
    )


def curve_of_gas(exported: ExportedLaw, gas: GasInGaps) -> Curve:
    """The conductance of a gas in the gaps of an exported law, in the unit of the law's conductance."""
    law = exported.law
    h_max = law.h_max
    bottom = float(law.block[at.LOWEST])
    top = (2 * FAR - 1) * h_max if exported.ends else law.highest

    # the law's end, which its theory may miss by a rounding
    least = max(NEAREST * h_max, (h_max + law.lowest) / 2 + ROUNDINGS * h_max)

    def conductance(d: FloatArray) -> FloatArray:
        u = np.maximum((h_max + d) / 2, least)
        return gas.conductance(exported.answer(u))

    # near full contact the gas has nothing left: what is added keeps the sum positive
    offset = float(conductance(np.array([min(h_max, top)]))[0])
    kinks = (h_max,) if exported.ends else ()
    block, _ = _from_least_gap(lambda d: offset + conductance(d), bottom, top, kinks)
    metre = factor("m", exported.length)
    _, jump = jump_of(
        gas.gas.name, gas.gas.temperature, gas.gas.pascals, gas.gas.accommodation
    )
    jump_length = float(jump) * metre
    # of the sum that the polynomials have there
    at_top = float(offset + conductance(np.array([top]))[0]) - offset
    d = _checked(block, bottom, top, min(h_max, top))
    d = d[d <= min(h_max, top)]
    written = np.empty(d.size)
    core.law_fill(d, block, written, *[None] * 4)
    exact = conductance(d)
    # relative to first contact next to full contact
    error = np.abs(written - offset - exact) / np.maximum(exact, offset)
    return Curve(
        block,
        BETWEEN * float(error.max()),
        begin=_overclosure_at(top, h_max) if exported.ends else -math.inf,
        offset=offset,
        far=at_top * ((h_max + top) / 2 + jump_length),
        jump=jump_length,
    )


def _checked(block: FloatArray, bottom: float, top: float, end: float) -> FloatArray:
    """Gaps at which polynomials are compared with what they stand for: in each record, and evenly."""
    records = block[int(block.view(np.int64)[at.RECORDS]) :].reshape(-1, at.RECORD)
    share = np.cos(np.pi * np.arange(CHECKED_EACH) / (CHECKED_EACH - 1))
    x = records[:, at.CENTRE, None] + share / records[:, at.RATE, None]
    of_records = bottom + (top - bottom) * np.clip(x, 0.0, 1.0).ravel()
    return np.append(of_records, np.linspace(bottom, end, CHECKED))


def _overclosure_at(gap: float, h_max: float) -> float:
    """The overclosure of a gap d, which is not beyond that when it is calculated from it."""
    c = (h_max - gap) / 2
    while h_max - 2 * c > gap:
        c = math.nextafter(c, math.inf)
    return c


class Quantity:
    """Any quantity of the registry that a law's contacts have, against overclosure."""

    def __init__(self, exported: ExportedLaw, name: str) -> None:
        self.exported = exported
        self.name = name
        self.declared = registry.get(name)
        law = exported.law
        self.begin = 0.0 if exported.ends else exported.c_least
        self.c = self.begin + (exported.c_turn - self.begin) * LOOKED_AT
        values = self(self.c)
        if not np.isfinite(values[0]):
            raise InputError(
                f"{name} has no function of the overclosure: it is not known at first contact"
            )
        #: 1, or -1 of a quantity that is negative
        self.sign = math.copysign(1.0, values[0])
        bad = ~(np.isfinite(values) & (self.sign * values > 0))
        if bad[:SMALL].any():
            raise InputError(
                f"{name} has no function of the overclosure: it is zero, or not known, at "
                f"c = {self.c[int(np.argmax(bad))]:.4g} {exported.length}, and errors of "
                "functions are relative"
            )
        count = int(np.argmax(np.append(bad, True)))
        self.c = self.c[:count]
        self.values = values[:count]
        #: the last overclosure at which it was found
        self.end = math.inf if count == LOOKED_AT.size else float(self.c[-1])
        self.unit = self.declared.unit(law.at(separation=self.gaps(self.c[0])))

    def __call__(self, c: FloatArray) -> FloatArray:
        """Its values at overclosures."""
        pressed = self.exported.law.at(separation=self.gaps(c))
        with np.errstate(all="ignore"):
            values = np.asarray(pressed.quantity(self.name))
        if values.dtype == bool:
            raise InputError(
                f"{self.name} is true or false, and no function of the overclosure"
            )
        return np.broadcast_to(values, np.shape(c)).astype(float)

    def gaps(self, c: FloatArray) -> FloatArray:
        """Separations of overclosures, where full compression may be missed by a rounding."""
        law = self.exported.law
        return np.maximum(law.h_max - 2 * c, law.lowest)

    def over_slope(self, law: ContactLaw) -> float:
        """Its constant ratio to the slope of a law, or 0 where that is not constant."""
        ratios = self.values / np.asarray(law.stiffness(separation=self.gaps(self.c)))
        ratio = float(np.median(ratios))
        constant = math.isinf(self.end) and np.ptp(ratios) <= ROUNDED * abs(ratio)
        return ratio if constant else 0.0

    def curve(self) -> Curve:
        """Its polynomials, from first contact on."""
        exported = self.exported
        try:
            if exported.ends:
                block, error = self._from_first_contact()
            else:
                h_max = exported.law.h_max
                ends = h_max - 2 * self.c[-1], h_max - 2 * self.begin
                block, error = _from_least_gap(self._positive, *ends, self._kinks())
        except ConvergenceError as fault:
            raise InputError(
                f"{self.name} has no function of the overclosure: {fault}"
            ) from fault
        if error > LARGEST_ERROR:
            raise InputError(
                f"{self.name} has no function of the overclosure: its polynomials are within "
                f"{error:.1e} alone"
            )
        if self.sign < 0:
            block[_coefficients(block)] *= -1
        return Curve(
            block,
            error,
            # zero is no number of a curve that begins as a power
            begin=sys.float_info.min if exported.ends else -math.inf,
            end=self.end,
            apart=self._apart() if exported.ends else 0.0,
        )

    def _positive(self, d: FloatArray) -> FloatArray:
        """Its size at gaps."""
        return self.sign * self((self.exported.law.h_max - d) / 2)

    def _kinks(self) -> tuple[float, ...]:
        """Gaps at which the law changes over to other polynomials."""
        head = self.exported.law.block
        return 0.0, *(
            head[k] * head[k + 1] for k in (at.KINK_SIGN, at.KINK_SIGN_2) if head[k]
        )

    def _apart(self) -> float:
        """Its value where bodies are apart, NaN unless that is the same at all gaps."""
        try:
            values = self(-APART * self.exported.law.h_max)
        except InputError:
            return math.nan
        return float(values[0]) if (values == values[0]).all() else math.nan

    def _from_first_contact(self) -> tuple[FloatArray, float]:
        """A block whose x rises from first contact, and in the other half of the gaps from none, and its error."""
        h_max = self.exported.law.h_max
        least = h_max - self.c[-1]
        # as of laws, mean separations of which x is the share
        width = h_max / 2 if 0 < least < h_max / 2 else self.c[-1]
        kinks = np.array([(h_max + d) / 2 for d in self._kinks()])

        def from_contact(x: FloatArray) -> FloatArray:
            found = self.sign * self(width * x)
            return np.stack([found, found])

        def from_none(x: FloatArray) -> FloatArray:
            found = self.sign * self(h_max - width * x)
            return np.stack([found, found])

        start = 2.0 ** -OCTAVES[-1]
        sides = [Side(-1, start, from_contact, _inside(start, (h_max - kinks) / width))]
        if width < self.c[-1]:
            start = least / width
            sides.append(Side(1, start, from_none, _inside(start, kinks / width)))
        first = straight_record(from_contact, sides[0].start)
        return _fitted(lambda rtol: (sides, first), h_max, 2 * width)


def _inside(start: float, kinks: FloatArray) -> tuple[float, ...]:
    """The kinks of a side, in order."""
    return tuple(sorted(x for x in kinks.tolist() if start < x < 1))


def _from_least_gap(
    values_at: Callable[[FloatArray], FloatArray],
    bottom: float,
    top: float,
    kinks: tuple[float, ...],
) -> tuple[FloatArray, float]:
    """A block of positive values at gaps d, whose x rises from the least gap, and its error."""
    span = top - bottom

    def values(x: FloatArray) -> FloatArray:
        found = values_at(bottom + span * x)
        return np.stack([found, found])

    places = (np.array(kinks) - bottom) / span

    def begun(rtol: float) -> tuple[list[Side], at.First]:
        start, first = first_record(
            lambda start: power_record(values, start, (0.0, 0.0)), OCTAVES, rtol
        )
        return [Side(1, start, values, _inside(start, places))], first

    return _fitted(begun, -bottom, span)


def _fitted(
    begun: Callable[[float], tuple[list[Side], at.First]], h_max: float, span: float
) -> tuple[FloatArray, float]:
    """The block of sides with their first record, by the first tolerance that can be met."""
    for rtol in RTOLS:
        sides, first = begun(rtol)
        try:
            pieces = [side_pieces(side, rtol) for side in sides]
        except ConvergenceError:
            if rtol == RTOLS[-1]:
                raise
            continue
        if sum(len(part.records) for part in pieces) <= MOST_PIECES:
            break
    is_from_contact = sides[0].sign < 0
    ends = (-h_max, span - h_max)
    if is_from_contact:
        # which overclosures are meant is tested before, without rounding
        ends = (-sys.float_info.max, sys.float_info.max)
    block, _, errors = assemble(h_max, 1 / span, sides, pieces, first, ends)
    block.view(np.int64)[at.ENDS] = is_from_contact
    between = [
        between_nodes(part.records, side.values)
        for part, side in zip(pieces, sides, strict=True)
    ]
    return block, float(errors[:, 0].max()) + max(between)


def _coefficients(block: FloatArray) -> Any:
    """Places of the coefficients of force and area in a block."""
    first = int(block.view(np.int64)[at.RECORDS])
    places = np.arange(first, block.size).reshape(-1, at.RECORD)
    return places[:, at.FORCE_AT : at.ENERGY_AT].ravel()
