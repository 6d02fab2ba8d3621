"""The block of a contact law (layout in `core/mbma.h`): its indices, the fit of its polynomials, and its inverse."""

import itertools
import math
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import Polynomial, chebyshev

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError, OutOfRangeError
from mbma_tables.core import core

DEGREE = 8
# in a record
CENTRE = 0
RATE = 1
FORCE_AT = 2
AREA_AT = 3 + DEGREE
ENERGY_AT = 4 + 2 * DEGREE
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
INVERSE_RECORD = 3 + INVERSE_DEGREE + 1  # centre, rate, sign of the side, coefficients
INVERSE_HEAD = 6
Y_LEAST, Y_LOW, Y_HIGH, Y_TURN, FIRST_BUCKET, END = range(INVERSE_HEAD)
OCTAVES = 100  # below the largest value; lighter loads are found by iteration
LEAST = float(np.finfo(float).tiny)
POINTS = chebyshev.chebpts1(INVERSE_DEGREE + 1)
TRANSFORM: Any = np.linalg.inv(
    np.vander(POINTS, increasing=True)
).T  # values there to monomials

# of these Chebyshev coefficients DEGREE + 1 are kept; the others bound the error of value
# and of slope
SAMPLES = 16
MAX_RECORDS = 4000
# factor on the last two coefficients for all later ones, which fall at least by 2 each
TAIL_SHARE = 4.0
# relative width of a bucket too narrow to fit, for which its neighbour's polynomials are
# used
NEAR = 1e-7
FIRST_BUCKETS = {
    -1: 16,
    -2: 8,
    -3: 4,
}  # initial buckets of the octaves below x = 1, with curved Gaussians; 2 below
SLOPES = 100.0  # ratio of the tolerance of slopes (over F/x if that is larger) to that of values
# tolerance above which octaves begin with one bucket; and that of slopes there
COARSE = 1e-7
COARSE_SLOPES = 10.0
FOR_SLOPES = 4  # largest factor of additional buckets for slopes
KEPT = DEGREE + 1

_POINTS = chebyshev.chebpts1(SAMPLES)
_DEGREES = np.arange(SAMPLES)
PLACES = (
    np.stack([1 - _POINTS, 1 + _POINTS]) / 2
)  # from an interval's ends to samples, and from values there to a
SERIES: Any = np.linalg.inv(
    chebyshev.chebvander(_POINTS, SAMPLES - 1)
).T.copy()  # Chebyshev series
# the even and odd parts of what is left out are in the first two terms, so that neighbours join
for _odd in (0, 1):
    SERIES[:, _odd] += SERIES[:, KEPT + 1 - _odd :: 2].sum(axis=1)
# on the errors of value and of slope by t, of the sizes of terms that are left out
BOUNDS = np.where(
    _DEGREES < KEPT, 0.0, np.stack([np.full(SAMPLES, 2.0), _DEGREES**2 + 1])
)
BOUNDS[:, -2:] += TAIL_SHARE * np.array([[2], [SAMPLES**2]])
# from the series to monomials, from monomials in [-1, 1] to those in [0, 1] and to the
# Bernstein series of the slope
MONOMIALS, FROM_ZERO = np.zeros((2, KEPT, KEPT))
for _k in range(KEPT):
    MONOMIALS[_k, : _k + 1] = chebyshev.cheb2poly(np.eye(KEPT)[_k, : _k + 1])
    FROM_ZERO[_k] = [math.comb(_k, j) * 2.0**j * (-1.0) ** (_k - j) for j in range(KEPT)]
_LOW = Polynomial([0.5, -0.5])
_HIGH = Polynomial([0.5, 0.5])
_N = DEGREE - 1
_BASIS: Any = np.stack(
    [(_LOW ** (_N - j) * _HIGH**j * math.comb(_N, j)).coef for j in range(DEGREE)]
)
BERNSTEIN = np.concatenate(
    [np.zeros((1, DEGREE)), np.arange(1.0, KEPT)[:, None] * np.linalg.inv(_BASIS)]
)

Values = Callable[[FloatArray], FloatArray]
First = tuple[
    FloatArray, FloatArray, tuple[float, float]
]  # record below where x begins, its errors, its powers


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
    rows: list[
        tuple[int, int]
    ]  # (shift, base) of the octaves up to 1, counted from this side's first record


def _fit_intervals(values: Values, ends: FloatArray) -> FloatArray:
    """Records of intervals (n, 2) of x and bounds on their errors, (n, RECORD + 3)."""
    found = positive(values((ends @ PLACES).ravel())).reshape(2, -1, SAMPLES)
    # sums independent of the number of threads, unlike matrix products
    terms = np.einsum("rki,ij->rkj", found, SERIES)
    left = np.einsum("rki,ji->rkj", np.abs(terms), BOUNDS) / found.min(
        axis=-1, keepdims=True
    )
    low, high = ends.T
    half = (high - low) / 2
    reach = high / half
    steep = np.maximum(1.0, reach / 2 * (found.max(axis=-1) / found.min(axis=-1) - 1))
    errors = np.stack(
        [left[..., 0], left[..., 1] * reach, left[..., 1] * reach / steep]
    ).max(axis=1)
    errors[:, high - low <= NEAR * low] = 0.0
    series = np.einsum("rki,ij->krj", terms[..., :KEPT], MONOMIALS).reshape(len(ends), -1)
    return np.column_stack(
        [(low + high) / 2, 1 / half, series, np.zeros(len(ends)), errors.T]
    )


def side_pieces(side: Side, rtol: float) -> Pieces:
    """The records of a side, its first one excepted: octaves of x in buckets, doubled until all meet the tolerance."""
    first = math.floor(math.log2(side.start))
    coarse = rtol > COARSE
    slopes = (COARSE_SLOPES if coarse else SLOPES) * rtol
    counts = {e: 1 if coarse else FIRST_BUCKETS.get(e, 2) for e in range(first, 0)}
    cuts: dict[int, list[tuple[float, float]]] = {}
    done: dict[int, FloatArray] = {}
    enough: dict[int, int] = {}
    while len(done) < len(counts):
        pending = [e for e in counts if e not in done]
        cuts |= {e: _buckets(side, e, counts[e]) for e in pending}
        stops = list(itertools.accumulate(len(cuts[e]) for e in pending))
        made = _fit_intervals(
            side.values, np.array([ends for e in pending for ends in cuts[e]])
        )
        worst = np.maximum.reduceat(made[:, RECORD:], [0, *stops[:-1]]).tolist()
        for e, stop, (value, _, slope) in zip(pending, stops, worst, strict=True):
            if value <= rtol:
                enough.setdefault(e, FOR_SLOPES * counts[e])
            # more buckets do not improve the slopes of noisy values
            if value <= rtol and (slope <= slopes or counts[e] >= enough[e]):
                done[e] = made[stop - len(cuts[e]) : stop]
            else:
                counts[e] *= 2
        if sum(counts.values()) > MAX_RECORDS:
            raise ConvergenceError(
                f"the law needs more than {MAX_RECORDS} pieces for {rtol:.1e}",
                np.array(True),
            )
    rows = []
    place = 0
    for e, count in counts.items():
        power = count.bit_length() - 1
        start = cuts[e][0][0]
        skipped = int((start / 2.0**e - 1) * count)
        passed = sum(kink <= start for kink in side.kinks)
        rows.append((52 - power, place - ((e + 1023) << power) - skipped - passed))
        place += len(cuts[e])
    whole = np.concatenate([done[e] for e in counts])
    for k, (low, high) in enumerate(ends for e in counts for ends in cuts[e]):
        if high - low <= NEAR * low:
            # too narrow for slopes: use the neighbour on the side without a kink
            whole[k] = whole[
                min(max(k + 1 if low in side.kinks else k - 1, 0), place - 1)
            ]
    return Pieces(whole[:, :RECORD], whole[:, RECORD:-1], rows)


def _buckets(side: Side, e: int, count: int) -> list[tuple[float, float]]:
    """Ends of the equal buckets of an octave, with the kinks inserted."""
    edges = [2.0**e * (1 + k / count) for k in range(count)]
    inside = {kink for kink in side.kinks if 2.0**e < kink < 2.0 ** (e + 1)}
    if side.start > 2.0**e or inside:
        edges = sorted(
            {low if low > side.start * (1 + 1e-15) else side.start for low in edges}
            | inside
        )
    return list(itertools.pairwise([*edges, 2.0 ** (e + 1)]))


def positive(found: FloatArray) -> FloatArray:
    """Forces and areas; an error unless they are positive numbers."""
    if not (found.min() > 0 and found.max() < math.inf):
        raise OutOfRangeError("no positive force and area on all of this surface's gaps")
    return found


def first_record(
    make: Callable[[float], First], octaves: Iterable[int], rtol: float
) -> tuple[float, First]:
    """The first of some powers of 1/2 below which a record meets a tolerance, or the last; and the record."""
    for number in octaves:
        start = 2.0**-number
        first = make(start)
        if first[1][0] <= rtol:
            break
    return start, first


def power_record(values: Values, start: float, powers: tuple[float, float]) -> First:
    """The record below `start` where force and area are these powers of x times polynomials."""
    exponents = np.array(powers)[:, None]
    made = _fit_intervals(
        lambda x: values(x) / (x / start) ** exponents, np.array([[0.0, start]])
    )[0]
    record, (value, slope, _) = made[:RECORD], made[RECORD:]
    record[CENTRE], record[RATE] = 0.0, 1 / start
    series = record[FORCE_AT:ENERGY_AT].reshape(2, KEPT)
    series[:] = series @ FROM_ZERO
    return record, np.array([value, max(powers) * value + slope]), powers


def straight_record(values: Values, start: float) -> First:
    """The record below `start` where the powers are not known: they and a slope by least squares."""
    t = PLACES[1]
    t = t[t > 1 / SAMPLES]
    logs = np.log(positive(values(t * start)))
    basis = np.stack([np.ones_like(t), np.log(t), t], axis=-1)
    constants, *_ = np.linalg.lstsq(basis, logs.T, rcond=None)
    missed = np.abs(basis @ constants - logs.T).max(axis=0)
    record = np.zeros(RECORD)
    lead = np.exp(constants[0])
    record[RATE] = 1 / start
    record[[FORCE_AT, AREA_AT]], record[[FORCE_AT + 1, AREA_AT + 1]] = (
        lead,
        lead * constants[2],
    )
    powers = (float(constants[1, 0]), float(constants[1, 1]))
    value = np.expm1(missed) + constants[2] ** 2
    return record, np.array([value.max(), (value * powers + 2 * missed).max()]), powers


def between_nodes(records: FloatArray, values: Values) -> float:
    """Relative error midway between the nodes of the fit, because kinks of the flow may not affect its coefficients."""
    t = np.cos(np.pi * np.arange(SAMPLES + 1) / SAMPLES)
    x = np.minimum(records[:, CENTRE, None] + t / records[:, RATE, None], 1.0)
    found = np.polynomial.polynomial.polyval(t, records[:, FORCE_AT:AREA_AT].T)
    return float(np.abs(found / values(x.ravel())[0].reshape(x.shape) - 1).max())


def assemble(
    h_max: float,
    scale: float,
    sides: list[Side],
    pieces: list[Pieces],
    first: First,
    ends: tuple[float, float],
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The block of one side, or of two: s = -1 for d >= 0 and s = 1 below; its records, a part of it; their errors."""
    low = min(side.start for side in sides)
    lowest = math.floor(math.log2(low))
    rows = np.full((len(sides), -lowest, 2), (63, 0))
    every = sum(len(side.kinks) for side in sides)
    start = 1
    for of_side, side, piece in zip(rows, sides, pieces, strict=True):
        of_side[-lowest - len(piece.rows) :] = piece.rows
        # kinks of the other side are passed on all of this one
        of_side[:, 1] += start - (every - len(side.kinks))
        start += len(piece.records)
    # sign d > kink scale^-1 - h_max: x beyond the kink
    kinks = [
        number
        for side in sides
        for kink in side.kinks
        for number in (side.sign, kink / scale - h_max)
    ]
    kinks += [0.0, 1.0] * (2 - every)
    signs = sides[0].sign, sides[-1].sign
    head = np.array(
        [
            h_max,
            scale,
            low,
            math.nextafter(1.0, 0.0),
            *signs,
            *kinks,
            *first[2],
            *ends,
            0,
            0,
            0,
            0,
        ]
    )
    below = -lowest if len(sides) > 1 else 0
    head.view(np.int64)[EXPONENT:] = lowest + 1023, below, HEAD + rows.size, signs[0] < 0
    parts = [head, rows.view(np.float64), first[0], *(piece.records for piece in pieces)]
    block = np.concatenate([part.ravel() for part in parts])
    errors = np.concatenate([first[1][None], *(piece.errors for piece in pieces)])
    return block, block[head.size + rows.size :].reshape(-1, RECORD), errors


def fill_energies(
    records: FloatArray,
    order: Any,
    signs: FloatArray,
    scale: float,
    power: float,
    last: float,
) -> None:
    """Energies, integrals of force over d, into the records; `last` is that beyond the gaps covered."""
    first = records[0]
    begins = signs[0] < 0
    k = np.arange(1, KEPT + 1)
    if not first[RATE]:
        # none is needed: what rounds below the law's end goes by the next one
        first[:] = records[1]
    of_first = (first[FORCE_AT:AREA_AT] / (power + k)).sum() / (scale * first[RATE])
    own = records[order]
    shares = own[:, FORCE_AT:AREA_AT] / k
    per_d = scale * own[:, RATE]
    # from t = 0 to either end, of which t = s faces last contact
    upper = shares.sum(axis=1) / per_d
    lower = (shares * (-1.0) ** k).sum(axis=1) / per_d
    reached = np.concatenate([[of_first if begins else last], upper - lower]).cumsum()
    records[order, ENERGY_AT] = reached[:-1] + np.where(signs > 0, upper, -lower)
    if not begins:
        first[ENERGY_AT] = (
            reached[-1] + of_first if first[CENTRE] == 0 else records[1, ENERGY_AT]
        )


def first_falls(own: FloatArray, signs: FloatArray) -> list[tuple[float | None, float]]:
    """x at which force, and area, first stop increasing with compression, None if never; and the sign of their side."""
    series = own[:, FORCE_AT:ENERGY_AT].reshape(-1, KEPT)
    found: list[tuple[float | None, float]] = [(None, 0.0), (None, 0.0)]
    # a polynomial whose Bernstein coefficients are positive is positive
    for k in np.flatnonzero(
        (series @ BERNSTEIN * -np.repeat(signs, 2)[:, None]).min(axis=1) <= 0
    ).tolist():
        place, row = divmod(k, 2)
        sign = float(signs[place])
        t = None if found[row][0] is not None else _first_fall(-sign * series[k], sign)
        if t is not None:
            found[row] = float(own[place, CENTRE] + t / own[place, RATE]), sign
    return found


def _first_fall(series: FloatArray, end: float) -> float | None:
    slope = Polynomial(series).deriv()
    if slope(end) <= 0:
        return end
    roots = slope.roots()
    real = roots[np.isreal(roots) & (np.abs(roots) < 1)].real
    # slopes at double roots do not change sign
    way = [*sorted(real, key=lambda t: abs(t - end)), -end]
    falls = (
        float(root)
        for root, following in itertools.pairwise(way)
        if slope((root + following) / 2) < 0
    )
    return next(falls, None)


def inverse_block(which: int, block: FloatArray, end: float) -> FloatArray:
    """Polynomials of x in buckets of force or area down to the gap `end`: starting values for Newton's method."""
    ends = bool(block.view(np.int64)[ENDS])
    top = block[H_MAX] - block[LOW] / block[SCALE] if ends else block[HIGHEST]
    values = np.empty(3)
    core.law_fill(
        np.array([top, end, 0.0]),
        block,
        *((None, values) if which == AREA else (values, None)),
        *[None] * 3,
    )
    least, most, middle = values.tolist()
    bottom = min(max(least, most * 2.0**-OCTAVES, LEAST), most)
    turn = middle if block[PLUS] != block[MINUS] and end < 0 else math.inf
    bits = 52 - INVERSE_BITS
    first, last = (int(np.float64(y).view(np.int64) >> bits) for y in (bottom, most))
    edges = (np.arange(first, last + 2) << bits).view(np.float64)
    edges[0], edges[-1] = bottom, max(most, edges[-2])
    if turn < most:
        edges = np.insert(
            edges, np.searchsorted(edges, max(turn, bottom)), max(turn, bottom)
        )
    centre = (edges[1:] + edges[:-1]) / 2
    half = (edges[1:] - edges[:-1]) / 2
    wanted = (centre[:, None] + half[:, None] * POINTS).ravel()
    x, side = np.empty((2, wanted.size))
    core.inverse_nodes(wanted, block, which, end, x, side)
    records = np.zeros((centre.size, INVERSE_RECORD))
    records[:, 0] = centre
    records[:, 1] = np.divide(
        1.0, half, out=np.zeros_like(half), where=half > np.finfo(float).tiny
    )
    records[:, 2] = side.reshape(-1, POINTS.size)[:, POINTS.size // 2]
    records[:, 3:] = x.reshape(-1, POINTS.size) @ TRANSFORM
    head = np.zeros(INVERSE_HEAD)
    head[Y_LEAST] = 0.0 if ends else least
    head[[Y_LOW, Y_HIGH, Y_TURN, END]] = bottom, most, turn, end
    head.view(np.int64)[FIRST_BUCKET] = first
    return np.concatenate([head, records.ravel()])
