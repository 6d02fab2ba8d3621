"""Leakage of a contact law: flow coefficient as polynomials of the gap, from that at which contact blocks it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, Numbers, is_labelled, number_in
from mbma_tables.common.errors import ConvergenceError, InputError
from mbma_tables.common.shared import frozen
from mbma_tables.contacts.law import block as fit
from mbma_tables.contacts.quantities.effective_medium import wide_gap
from mbma_tables.contacts.quantities.leakage import (
    along,
    area_of_flow,
    degrees,
    flow_of_contact,
    shipped_flow,
    unknown_where_blocked,
    yields_noticeably,
)
from mbma_tables.core import core
from mbma_tables.surfaces.any_surface import AnySurface, apply

# tolerance of the polynomials, or this share of the law's own error
RTOL = 1e-4
SHARE = 0.1
MOST_OCTAVES = (
    20  # octaves of gaps from the blocked one; nearer to it the flow is a power
)


@dataclasses.dataclass(frozen=True, eq=False)
class LeakageLaw:
    """Flow coefficient [length^3] of a surface against its gap; of a simulated map the geometric mean of both axes."""

    law: Any  # the ContactLaw whose area and mean separation it is of
    h_rms: float  # [length]
    #: mean separation u [length] at and below which contact percolates and nothing flows;
    #: of simulated elastic gaps of a contact that yields the flow is not known there;
    #: -infinity where contact never percolates
    blocked_at: float
    # bound on the polynomials' relative error at the law's area, whose own errors come on
    # top times -d ln k/d ln A
    error: float
    # as a law's, with flow in place of force and hydraulic aperture in place of area
    block: FloatArray

    def along(self, direction: str | float) -> LeakageLaw:
        """Of a simulated map, the same along an axis, "x" or "y", or in a direction in degrees from x; else itself."""
        found = number_in("direction", degrees(direction), -360.0, 360.0)
        return (
            self
            if self.law.gaps is None
            else leakage_law(self.law, self.law.surface, found)
        )

    def __call__(
        self,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Flow coefficient at gaps, pressures or areas; exactly 0 where blocked.

        Of simulated elastic gaps NaN there where the contact yields: yielded patches are
        compact and leave channels.
        """
        d = self.law.separation(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        if is_labelled(d):
            return apply(lambda block: (self._at(block),), (d,), 1)[0]  # type: ignore[no-any-return]
        return self._at(d)

    def _at(self, d: Any) -> Numbers:
        """Flow coefficient at separations d within the law."""
        flat = np.ascontiguousarray(d).reshape(-1)
        found = np.empty(flat.size)
        core.law_fill(flat, self.block, found, *[None] * 4)
        # bodies farther apart
        apart = (flat > self.block[fit.HIGHEST]) & (flat < np.inf)
        gap = self.law.both_separations("separation", flat[apart])[1]
        found[apart] = gap**3 * wide_gap(gap / self.h_rms)
        # simulated gaps that are blocked where nothing yields may be open where it does
        theory = self.law.setup.theory_of(self.law.setup.bodies)
        blocked = np.flatnonzero(found == 0)
        yields_elsewhere = (
            self.law.gaps is not None
            and theory.elastic is not theory
            and not getattr(self.law.gaps, "of_yielded_gaps", False)
        )
        # theories are asked at one gap at least
        if yields_elsewhere and blocked.size:
            u = self.law.both_separations("separation", flat[blocked])[1]
            yields = yields_noticeably(theory, self.law.surface, u)
            found[blocked] = unknown_where_blocked(found[blocked], yields)
        return found.reshape(np.shape(d))[()]


def leakage_law(
    law: Any, surface: AnySurface, direction: float | None = None
) -> LeakageLaw:
    """Leakage of a contact law's surface; of a simulated map in a direction in degrees, or the mean of both axes."""
    h_rms = float(surface.h_rms)
    rtol = max(RTOL, SHARE * law.error)
    top = (
        min(law.h_max, law.highest) if law.block.view(np.int64)[fit.ENDS] else law.highest
    )
    turns: tuple[float, ...] = ()
    theory = law.setup.theory_of(law.setup.bodies)

    def obstructing(d: FloatArray) -> FloatArray:
        """A/A0 of the elastic contact that obstructs flow alike."""
        u = (law.h_max + d) / 2
        return area_of_flow(theory, surface, u, np.asarray(law.area(separation=d)))

    if law.gaps is None:
        threshold = shipped_flow().constants.threshold
        deepest = law.lowest if law.area_turning_point is None else law.area_turning_point
        blocked = bool(obstructing(np.array(deepest)) >= threshold)
        bottom = law.lowest
        if blocked and theory.elastic is theory:
            bottom = float(law.separation(area=threshold))
        elif blocked:
            bottom = _blocked_gap(obstructing, threshold, deepest, top)
        head = law.block
        turns = tuple(
            head[k] * head[k + 1] for k in (fit.KINK_SIGN, fit.KINK_SIGN_2) if head[k]
        )
    else:
        bottom, turns = _ends(law, direction)
        blocked = bottom > law.lowest
        bottom = max(bottom, law.lowest)
    span = top - bottom

    def coefficient(d: FloatArray) -> FloatArray:
        u = (law.h_max + d) / 2
        if law.gaps is None:
            area = np.asarray(law.area(separation=d))
            return h_rms**3 * flow_of_contact(theory, surface, u, area)
        x, y, xy = law.gaps.flow(surface, u)
        return np.asarray(
            np.sqrt(x * y) if direction is None else along(direction, x, y, xy)
        )

    def values(x: FloatArray) -> FloatArray:
        K = coefficient(bottom + span * x)
        return np.stack([K, np.cbrt(K)])

    # gaps close as u under full compression
    known = (3.0, 1.0) if bottom == -law.h_max else (0.0, 0.0)
    start, first = fit.first_record(
        lambda start: (
            fit.straight_record(values, start)
            if blocked
            else fit.power_record(values, start, known)
        ),
        range(MOST_OCTAVES if blocked else 6, MOST_OCTAVES + 1),
        rtol,
    )
    kinks = [(turn - bottom) / span for turn in turns]
    side = fit.Side(
        1, start, values, tuple(sorted(kink for kink in kinks if start < kink < 1))
    )
    try:
        pieces = fit.side_pieces(side, rtol)
    except ConvergenceError:
        # jumps between the law's polynomials are amplified towards the blocked gap
        pieces = fit.side_pieces(side, max(RTOL, law.error))
    block, _, errors = fit.assemble(
        -bottom, 1 / span, [side], [pieces], first, (law.block[fit.LOWEST], top)
    )
    block.view(np.int64)[fit.ENDS] = blocked
    error = float(errors[:, 0].max()) + fit.between_nodes(pieces.records, values)
    if law.gaps is not None:
        # bodies apart: the h_rms of the wide gap that continues it
        missed = 1 - float(values(np.array(1.0))[0]) / ((law.h_max + top) / 2) ** 3
        h_rms = law.h_max / np.sqrt(max(1.5 / max(missed, 1e-6) - 4, 1e-3))
    blocked_at = (law.h_max + bottom) / 2 if blocked else -np.inf
    return LeakageLaw(law, h_rms, blocked_at, error, frozen(block))


def _blocked_gap(
    obstructing: Callable[[FloatArray], FloatArray],
    threshold: float,
    low: float,
    high: float,
) -> float:
    """Separation at which a contact that yields blocks flow."""
    from scipy.optimize import brentq

    found: float = brentq(
        lambda d: float(obstructing(np.array(d))) - threshold,
        low,
        high,
        xtol=1e-15,
        rtol=1e-15,
    )
    return found


def _ends(law: Any, direction: float | None) -> tuple[float, tuple[float, ...]]:
    """Separation of a simulated map from which on it is open, and separations of kinks."""
    ends = [2 * end - law.h_max for _, end, _ in law.gaps.closing]
    shares = np.abs(
        np.sin(
            np.deg2rad(
                [90.0, 0.0] if direction is None else [90.0 + direction, direction]
            )
        )
    )
    if direction is None:
        bottom = max(ends)
    else:
        bottom = min(end for end, share in zip(ends, shares, strict=True) if share > 1e-9)
    first = 2 * float(law.gaps.rows[2, 0]) - law.h_max
    if not bottom < first:
        raise InputError(
            "the map is blocked in this direction at its lightest simulated load: there is no leakage law"
        )
    return bottom, tuple(turn for turn in {max(ends), first} if turn > bottom)
