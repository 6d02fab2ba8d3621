"""Fitting a law: polynomials of force and area in buckets of x, their proven errors, energies, turning points.

A side of a law is its stretch of gaps with one sign of d that has its own x in (0, 1]: the depth below h_max, or the
height above full compression. Octaves of x are cut into equal buckets, doubled in number until every polynomial meets
the tolerance. Of 16 Chebyshev coefficients nine are kept: what is left bounds the error of value and of slope.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import ConvergenceError, OutOfRangeError
from mbma_tables.theories import law_kernel as kernel
from mbma_tables.theories.law_kernel import AREA_AT, CENTRE, DEGREE, ENERGY_AT, FORCE_AT, RATE, RECORD

SAMPLES = 16
MAX_RECORDS = 4000
TAIL_SHARE = 4.0  # of the last two coefficients, for all that follow: they fall by 2 at least
NEAR = 1e-7  # relative width of a bucket below which it takes its neighbour's polynomials
FIRST_BUCKETS = {-1: 16, -2: 8, -3: 4}  # of the octaves below x = 1, where Gaussians of heights bend; 2 below
SLOPES = 100.0  # times the tolerance of values: that of slopes, over F/x where they are smaller
COARSE, COARSE_SLOPES = 1e-7, 10.0  # tolerance above which octaves begin with one bucket; and that of slopes there
FOR_SLOPES = 4  # times more buckets are tried for the sake of slopes
KEPT = DEGREE + 1

Values = Callable[[FloatArray], FloatArray]
First = tuple[FloatArray, FloatArray, tuple[float, float]]  # record below where x begins, its errors, its powers


class Side(NamedTuple):
    """Gaps that share an x: the sign s of d in it, where x begins, force and area (2, n) at x, and kinks in x."""

    sign: int
    start: float
    values: Values
    kinks: tuple[float, ...] = ()


class Pieces(NamedTuple):
    """Records of a side in order of x, bounds on their errors (value, slope over F/x), and rows of its octaves."""

    records: FloatArray
    errors: FloatArray
    rows: dict[int, tuple[int, int]]  # exponent -> (shift, base) counted from this side's first record, without kinks


@functools.cache
def _transforms() -> tuple[Any, Any, Any]:
    """Chebyshev points, values there to coefficients, and coefficients to monomials."""
    points = chebyshev.chebpts1(SAMPLES)
    monomials = np.zeros((KEPT, KEPT))
    for k in range(KEPT):
        monomials[k, : k + 1] = chebyshev.cheb2poly(np.eye(KEPT)[k, : k + 1])
    return points, np.linalg.inv(chebyshev.chebvander(points, SAMPLES - 1)), monomials


def fit(values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Monomials (..., KEPT) in t from values (..., SAMPLES); bounds on the errors of values and slopes by t.

    The polynomial meets the interpolant of all samples at both ends, so that neighbours join.
    """
    _, to_series, to_monomials = _transforms()
    series = values @ to_series.T
    left = series[..., KEPT:]
    k = np.arange(KEPT, SAMPLES)
    kept = series[..., :KEPT].copy()
    kept[..., 0] += left[..., k % 2 == 0].sum(axis=-1)
    kept[..., 1] += left[..., k % 2 == 1].sum(axis=-1)
    size = np.abs(left)
    beyond = TAIL_SHARE * (size[..., -1] + size[..., -2])
    value = 2 * (size.sum(axis=-1) + beyond)
    slope = (size * (k**2 + 1)).sum(axis=-1) + SAMPLES**2 * beyond
    return kept @ to_monomials, value, slope


def side_pieces(side: Side, rtol: float) -> Pieces:
    """The records of a side, its first one excepted."""
    first = math.floor(math.log2(side.start))
    coarse = rtol > COARSE
    slopes = COARSE_SLOPES if coarse else SLOPES
    counts = {e: 1 if coarse else FIRST_BUCKETS.get(e, 2) for e in range(first, 0)}
    done: dict[int, tuple[FloatArray, ...]] = {}
    enough: dict[int, int] = {}
    while len(done) < len(counts):
        pending = [e for e in counts if e not in done]
        cut = {e: _buckets(e, counts[e], side) for e in pending}
        owner = np.repeat(pending, [part.size - 1 for part in cut.values()])
        low = np.concatenate([part[:-1] for part in cut.values()])
        high = np.concatenate([part[1:] for part in cut.values()])
        fitted = _fit_intervals(side.values, low, high)
        for e in pending:
            mine = owner == e
            worst = fitted[1][mine & (high - low > NEAR * low)].max(axis=0)
            if worst[0] <= rtol:
                enough.setdefault(e, FOR_SLOPES * counts[e])
            # slopes of what carries noise do not become better
            if worst[0] <= rtol and (worst[2] <= slopes * rtol or counts[e] >= enough[e]):
                done[e] = (fitted[0][mine], fitted[1][mine, :2], low[mine], high[mine])
            else:
                counts[e] *= 2
        if sum(counts.values()) > MAX_RECORDS:
            raise ConvergenceError(f"the law needs more than {MAX_RECORDS} pieces for {rtol:.1e}", np.array(True))
    rows, place = {}, 0
    for e in range(first, 0):
        power = counts[e].bit_length() - 1
        skipped = int((max(side.start, 2.0**e) / 2.0**e - 1) * counts[e])
        before = sum(kink <= max(side.start, 2.0**e) for kink in side.kinks)
        rows[e] = (52 - power, place - ((e + 1023) << power) - skipped - before)
        place += len(done[e][0])
    records, errors, low, high = (np.concatenate([done[e][k] for e in range(first, 0)]) for k in range(4))
    narrow: Any = np.flatnonzero(high - low <= NEAR * low)
    for k in narrow:
        # too narrow for slopes: what lies beside it, on the side that has no kink
        beside = min(max(k + 1 if low[k] in side.kinks else k - 1, 0), len(low) - 1)
        records[k], errors[k] = records[beside], errors[beside]
    return Pieces(records, errors, rows)


def _buckets(e: int, count: int, side: Side) -> FloatArray:
    """Ends of the buckets of an octave, kinks among them."""
    edges = 2.0**e * (1 + np.arange(count + 1) / count)
    if side.start <= edges[0] and not any(edges[0] < kink < edges[-1] for kink in side.kinks):
        return edges
    edges = np.concatenate([[max(side.start, edges[0])], edges[edges > side.start * (1 + 1e-15)]])
    edges = np.unique(edges)
    inside = [kink for kink in side.kinks if edges[0] < kink < edges[-1]]
    return np.sort(np.concatenate([edges, inside]))


def _fit_intervals(values: Values, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Records of intervals of x, and bounds on the errors of value over F, of slope over F/x, and over the slope."""
    centre, half = (low + high) / 2, (high - low) / 2
    x = centre[:, None] + half[:, None] * _transforms()[0]
    found = positive(values(x.ravel())).reshape(2, *x.shape)
    monomials, value, slope = fit(found)
    records = np.zeros((low.size, RECORD))
    records[:, CENTRE], records[:, RATE] = centre, 1 / half
    records[:, FORCE_AT:AREA_AT], records[:, AREA_AT:ENERGY_AT] = monomials
    least = found.min(axis=-1)
    steep = np.maximum(1.0, (found.max(axis=-1) / least - 1) * high / half / 2)
    slope *= high / half
    slope /= least
    errors = np.stack([(value / least).max(axis=0), slope.max(axis=0), (slope / steep).max(axis=0)], axis=-1)
    return records, errors


def positive(found: FloatArray) -> FloatArray:
    """Forces and areas, refused where they are not positive numbers."""
    if not ((found > 0) & np.isfinite(found)).all():
        raise OutOfRangeError("no positive force and area on all of this surface's gaps")
    return found


def first_record(make: Callable[[float], First], octaves: Iterable[int], rtol: float) -> tuple[float, First]:
    """The first of some powers of 1/2 below which a record meets a tolerance, or the last; and the record."""
    for number in octaves:
        start = 2.0**-number
        first = make(start)
        if first[1][0] <= rtol:
            break
    return start, first


def power_record(values: Values, start: float, powers: tuple[float, float]) -> First:
    """The record below `start` where force and area are these powers of x times polynomials."""
    t = (1 + _transforms()[0]) / 2
    lead = np.stack([t**power for power in powers])
    rest = positive(values(t * start)) / lead
    monomials, value, slope = fit(rest)
    # from [-1, 1] to [0, 1]: (2 t - 1)^k
    shift = np.array([[math.comb(k, j) * 2.0**j * (-1.0) ** (k - j) for j in range(KEPT)] for k in range(KEPT)])
    least = rest.min(axis=-1)
    return _first(monomials @ shift, start), _first_errors(value / least, slope / least, powers), powers


def _first_errors(value: FloatArray, slope: FloatArray, powers: tuple[float, float]) -> FloatArray:
    return np.array([value.max(), (value * np.array(powers) + 2 * slope).max()])


def _first(monomials: FloatArray, start: float) -> FloatArray:
    record = np.zeros(RECORD)
    record[RATE] = 1 / start
    record[FORCE_AT : FORCE_AT + monomials.shape[1]] = monomials[0]
    record[AREA_AT : AREA_AT + monomials.shape[1]] = monomials[1]
    return record


def straight_record(values: Values, start: float) -> First:
    """The record below `start` where the powers are not known: they and a slope by least squares."""
    t = (1 + _transforms()[0]) / 2
    t = t[t > 1 / SAMPLES]
    logs = np.log(positive(values(t * start)))
    basis = np.stack([np.ones_like(t), np.log(t), t], axis=-1)
    constants, *_ = np.linalg.lstsq(basis, logs.T, rcond=None)
    missed = np.abs(basis @ constants - logs.T).max(axis=0)
    lead = np.exp(constants[0])
    record = _first(np.stack([lead, lead * constants[2]], axis=-1), start)
    powers = (float(constants[1, 0]), float(constants[1, 1]))
    return record, _first_errors(np.expm1(missed) + constants[2] ** 2, missed, powers), powers


@dataclasses.dataclass
class Assembly:
    """A law's block as it is put together."""

    head: FloatArray
    rows: Any
    records: FloatArray
    errors: FloatArray

    @property
    def block(self) -> FloatArray:
        """All of it in one array."""
        return np.concatenate([self.head, self.rows.ravel().view(np.float64), self.records.ravel()])


def assemble(
    h_max: float, scale: float, sides: list[Side], pieces: list[Pieces], first: FloatArray, first_error: FloatArray
) -> Assembly:
    """Head, rows and records of one side, or of two: s = -1 for d >= 0 and s = 1 below."""
    low = min(side.start for side in sides)
    lowest = math.floor(math.log2(low))
    rows = np.zeros((len(sides) * -lowest, 2), dtype=np.int64)
    rows[:, 0] = 63
    start, signs, kinks = 1, [0.0, 0.0], [1.0, 1.0]
    every = [(side.sign, kink) for side in sides for kink in side.kinks]
    for number, (side, piece) in enumerate(zip(sides, pieces, strict=True)):
        # kinks of the other side are passed on all of this one
        others = len(every) - len(side.kinks)
        of_side = rows[number * -lowest : (number + 1) * -lowest]
        of_side[:, 1] = start - others
        for e, (shift, base) in piece.rows.items():
            of_side[e - lowest] = shift, base + start - others
        start += len(piece.records)
    for k, (sign, kink) in enumerate(every):
        # sign d > kink scale^-1 - h_max: x beyond the kink
        signs[k], kinks[k] = sign, kink / scale - h_max
    head = np.zeros(kernel.HEAD)
    head[kernel.H_MAX], head[kernel.SCALE] = h_max, scale
    head[kernel.LOW], head[kernel.HIGH] = low, math.nextafter(1.0, 0.0)
    head[kernel.PLUS], head[kernel.MINUS] = sides[0].sign, sides[-1].sign
    head[kernel.KINK_SIGN], head[kernel.KINK] = signs[0], kinks[0]
    head[kernel.KINK_SIGN_2], head[kernel.KINK_2] = signs[1], kinks[1]
    whole = head.view(np.int64)
    whole[kernel.EXPONENT] = lowest + 1023
    whole[kernel.MINUS_ROWS] = -lowest if len(sides) > 1 else 0
    whole[kernel.RECORDS] = kernel.HEAD + rows.size
    records = np.concatenate([first[None], *(piece.records for piece in pieces)])
    errors = np.concatenate([first_error[None], *(piece.errors for piece in pieces)])
    return Assembly(head, rows, records, errors)


def order_of(sides: list[Side], pieces: list[Pieces]) -> tuple[Any, FloatArray]:
    """Numbers of the records after the first in order of falling d, and the sign s of each."""
    numbers, signs, start = [], [], 1
    for side, piece in zip(sides, pieces, strict=True):
        own = np.arange(start, start + len(piece.records))
        numbers.append(own if side.sign < 0 else own[::-1])
        signs.append(np.full(own.size, side.sign))
        start += own.size
    return np.concatenate(numbers), np.concatenate(signs)


def fill_energies(made: Assembly, order: Any, signs: FloatArray, power: float, last: float) -> None:
    """Energies, integrals of force over d, into the records; `last` is that beyond the gaps covered."""
    scale, k = made.head[kernel.SCALE], np.arange(KEPT)
    records, begins = made.records, signs[0] < 0
    first = records[0]
    if not first[RATE]:
        # none is needed: what rounds below the law's end goes by the next one
        first[:] = records[1]
    of_first = (first[FORCE_AT:AREA_AT] / (power + 1 + k)).sum() / (scale * first[RATE])
    own = records[order]
    q = -signs * scale * own[:, RATE]
    shares = own[:, FORCE_AT:AREA_AT] / (k + 1)
    # from the end that faces last contact, t = s, to the other
    towards, away = (shares * end[:, None] ** (k + 1) for end in (signs, -signs))
    from_end, whole = towards.sum(axis=1) / q, (away.sum(axis=1) - towards.sum(axis=1)) / q
    reached = np.concatenate([[of_first if begins else last], whole]).cumsum()
    records[order, ENERGY_AT] = reached[:-1] - from_end
    if not begins:
        first[ENERGY_AT] = reached[-1] + of_first if first[CENTRE] == 0 else records[1, ENERGY_AT]


def first_fall(made: Assembly, order: Any, signs: FloatArray, start: int) -> tuple[int, float] | None:
    """Record and t at which force (`start` FORCE_AT) or area first stops rising with compression; None if never."""
    derivative = made.records[order, start + 1 : start + KEPT] * np.arange(1, KEPT)
    derivative *= -signs[:, None]
    # a polynomial whose Bernstein coefficients are positive is positive
    doubtful = np.flatnonzero((derivative @ _bernstein()).min(axis=1) <= 0)
    for k in doubtful:
        slope, end = np.polynomial.Polynomial(derivative[k]), float(signs[k])
        if slope(end) <= 0:
            return int(order[k]), end
        roots = slope.roots()
        real = roots[np.isreal(roots) & (np.abs(roots) < 1)].real
        # the first on the way from last contact; slopes at double roots do not change sign
        way = [*sorted(real, key=lambda t: abs(t - end)), -end]
        for root, following in itertools.pairwise(way):
            if slope((root + following) / 2) < 0:
                return int(order[k]), float(root)
    return None


@functools.cache
def _bernstein() -> FloatArray:
    """Monomials of degree DEGREE - 1 in [-1, 1] to Bernstein coefficients."""
    n = DEGREE - 1
    basis = [
        np.polynomial.Polynomial([0.5, -0.5]) ** (n - j) * np.polynomial.Polynomial([0.5, 0.5]) ** j * math.comb(n, j)
        for j in range(n + 1)
    ]
    return np.linalg.inv(np.stack([poly.coef for poly in basis]))
