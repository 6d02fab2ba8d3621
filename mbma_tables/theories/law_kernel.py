"""Compiled contact laws: values, slopes and energy in one pass, inverses. A law is one block of numbers.

The block holds, in words of 8 bytes, `HEAD` numbers (`Head`), rows of two integers (shift, base), and records of
`RECORD` numbers. With x = (h_max + s d) scale, s the sign of this side of d = 0, the exponent of x picks a row, and

    record = (bits(x) >> shift) + base + (kinks passed),    t = (x - record[CENTRE]) record[RATE],
    F = sum_k record[FORCE_AT + k] t^k,   A = sum_k record[AREA_AT + k] t^k,
    E = record[ENERGY_AT] + sum_k record[FORCE_AT + k] t^(k+1)/(k+1)/q,   q = -s scale record[RATE],   -dF/dd = q dF/dt.

Below x = LOW the first record holds: F = t^p times its polynomial, and A likewise.
Compiled code takes the block's address: a number is passed on faster than an array. No work space, no shared state.
"""

from __future__ import annotations

import ctypes
import math
from typing import Any, NamedTuple

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import CONTRACT, Instruction, njit
from mbma_tables.elementary import bits_of

DEGREE = 8
CENTRE, RATE, FORCE_AT, AREA_AT, ENERGY_AT = 0, 1, 2, 3 + DEGREE, 4 + 2 * DEGREE
RECORD = 5 + 2 * DEGREE
FORCE, AREA, FORCE_SLOPE, AREA_SLOPE, ENERGY = range(5)  # slopes against -d, energy over d

# words of the head
(
    H_MAX, SCALE, LOW, HIGH, PLUS, MINUS, KINK_SIGN, KINK, KINK_SIGN_2, KINK_2, POWER_F, POWER_A, LOWEST, HIGHEST,
    EXPONENT, MINUS_ROWS, RECORDS, ENDS,
) = range(18)  # fmt: skip
HEAD = 18

INVERSE_DEGREE = 5
INVERSE_BITS = 2  # of the mantissa: 4 buckets an octave of force or area
INVERSE_RECORD = 3 + INVERSE_DEGREE + 1
INVERSE_HEAD = 6
Y_LEAST, Y_LOW, Y_HIGH, Y_TURN, FIRST_BUCKET, END = range(INVERSE_HEAD)
SURE = 3e-6  # steps, in halves of a record, after which another would change nothing
STEPS = 200
EPSILON = 5e-16
FINITE = CONTRACT | {"nnan", "nsz"}  # arguments are clamped: a product with the first 0.0 is none


def _loader(made: str, in_c: Any) -> Any:
    """A function that reads a word of the block at an address."""

    def load(typing: Any, address: Any, word: Any) -> Any:
        from llvmlite import ir
        from numba import types

        kind = getattr(types, made)
        code = ir.DoubleType() if made == "float64" else ir.IntType(64)

        def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            pointer = builder.inttoptr(given[0], code.as_pointer())
            value = builder.load(builder.gep(pointer, [given[1]]))
            # blocks never change: the loads may leave a loop
            value.set_metadata("invariant.load", builder.module.add_metadata([]))
            return value

        return kind(types.int64, types.int64), generate

    return Instruction(load, lambda address, word: in_c.from_address(int(address) + 8 * int(word)).value)


number = _loader("float64", ctypes.c_double)
whole = _loader("int64", ctypes.c_int64)


class Place(NamedTuple):
    """Where a gap is in a law: its record's first word, t, q = -s scale rate, and t/q."""

    word: int
    t: float
    q: float
    beyond: float


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", forceinline=True)
def _depth(address: int, d: float) -> float:
    """x of a gap."""
    plus, minus = number(address, PLUS), number(address, MINUS)
    side = minus if d < 0.0 else plus
    x: float = (number(address, H_MAX) + side * d) * number(address, SCALE)
    return x


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", forceinline=True)
def _place(address: int, word: int, x: float, side: float) -> Place:
    """The place of x in the record at a word."""
    beyond, rate, scale = x - number(address, word + CENTRE), number(address, word + RATE), number(address, SCALE)
    return Place(word, beyond * rate, -side * scale * rate, -side * beyond * (1.0 / scale))


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", forceinline=True)
def _record_of(address: int, x: float, d: float) -> Place:
    """The place of a gap whose x is known better than its d."""
    plus, minus, rows_below = number(address, PLUS), number(address, MINUS), whole(address, MINUS_ROWS)
    side = minus if d < 0.0 else plus
    rows = rows_below if d < 0.0 else 0
    held = min(max(x, number(address, LOW)), number(address, HIGH))
    bits = bits_of(held)
    row = HEAD + 2 * ((bits >> 52) - whole(address, EXPONENT) + rows)
    record = (bits >> whole(address, row)) + whole(address, row + 1)
    record += d * number(address, KINK_SIGN) > number(address, KINK)
    record += d * number(address, KINK_SIGN_2) > number(address, KINK_2)
    word = whole(address, RECORDS) + record * RECORD
    return _place(address, word, held, side)


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", forceinline=True)
def _value(address: int, word: int, t: float) -> float:
    """A polynomial at t, its constant at `word`."""
    value = number(address, word + DEGREE)
    for k in range(DEGREE - 1, -1, -1):
        value = value * t + number(address, word + k)
    result: float = value
    return result


@njit(cache=True, fastmath=FINITE, error_model="numpy", forceinline=True)
def _with_slope(address: int, word: int, t: float) -> tuple[float, float]:
    """It and its derivative, of one pass."""
    value, slope = number(address, word + DEGREE), 0.0
    for k in range(DEGREE - 1, -1, -1):
        slope = slope * t + value
        value = value * t + number(address, word + k)
    return value, slope


@njit(cache=True, fastmath=FINITE, error_model="numpy", forceinline=True)
def _with_slopes(address: int, word: int, t: float) -> tuple[float, float, float]:
    """It, its derivative, and half of the second."""
    value, slope, bend = number(address, word + DEGREE), 0.0, 0.0
    for k in range(DEGREE - 1, -1, -1):
        bend = bend * t + slope
        slope = slope * t + value
        value = value * t + number(address, word + k)
    return value, slope, bend


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", forceinline=True)
def _integral(address: int, word: int, t: float, power: float) -> float:
    """Sum of coefficients t^k/(power + k); even and odd k apart, whose sums do not wait for each other."""
    square = t * t
    value, odd = number(address, word + DEGREE) * (1.0 / (power + DEGREE)), 0.0
    for k in range(DEGREE - 1, 0, -2):
        odd = odd * square + number(address, word + k) * (1.0 / (power + k))
        value = value * square + number(address, word + k - 1) * (1.0 / (power + k - 1))
    result: float = value + t * odd
    return result


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", forceinline=True)
def _inside(what: int, address: int, place: Place, power: float = 0.0) -> Any:
    """One of FORCE, AREA, FORCE_SLOPE, AREA_SLOPE and ENERGY at a place, of t^power times the polynomial."""
    t, start = place.t, place.word + (AREA_AT if what in (AREA, AREA_SLOPE) else FORCE_AT)
    lead = t**power if power != 0.0 else 1.0
    if what in (FORCE, AREA):
        return lead * _value(address, start, t)
    if what == ENERGY:
        return number(address, place.word + ENERGY_AT) + lead * place.beyond * _integral(address, start, t, 1.0 + power)
    value, slope = _with_slope(address, start, t)
    return (slope if power == 0.0 else lead * (slope + power / t * value)) * place.q


@njit(cache=True, fastmath=CONTRACT, error_model="numpy")
def _first_record(what: int, address: int, x: float) -> Any:
    """The same below LOW."""
    if x <= 0.0 and whole(address, ENDS):
        return 0.0
    place = _place(address, whole(address, RECORDS), x, number(address, PLUS))
    return _inside(what, address, place, number(address, POWER_A if what in (AREA, AREA_SLOPE) else POWER_F))


@njit(cache=True, error_model="numpy")
def evaluate(what: int, address: int, d: float) -> float:
    """One quantity at a gap; NaN outside the law."""
    if not number(address, LOWEST) <= d <= number(address, HIGHEST):
        return math.nan
    x = _depth(address, d)
    first = x < number(address, LOW)
    value: float = _first_record(what, address, x) if first else _inside(what, address, _record_of(address, x, d))
    return value


@njit(cache=True, error_model="numpy")
def force_at(address: int, d: float) -> float:
    """Force at a gap, with fewer arguments to pass; NaN outside the law."""
    return evaluate(FORCE, address, d)


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", nogil=True)
def fill(address: int, d: FloatArray, force: Any, area: Any, stiffness: Any, area_slope: Any, energy: Any) -> bool:
    """The quantities whose arrays are given, not None, at each gap; whether all are in the law.

    Stiffness and energy are by u, which moves half as far as d.
    """
    low, lowest, highest = number(address, LOW), number(address, LOWEST), number(address, HIGHEST)
    below = bad = 0
    for k in range(d.size):
        gap = d[k]
        x = _depth(address, gap)
        bad += not lowest <= gap <= highest
        below += x < low
        place = _record_of(address, x, gap)
        if force is not None:
            force[k] = _inside(FORCE, address, place)
        if area is not None:
            area[k] = _inside(AREA, address, place)
        if stiffness is not None:
            stiffness[k] = 2.0 * _inside(FORCE_SLOPE, address, place)
        if area_slope is not None:
            area_slope[k] = _inside(AREA_SLOPE, address, place)
        if energy is not None:
            energy[k] = 0.5 * _inside(ENERGY, address, place)
    # no branch above: entries of the first record are mended here
    if below:
        for k in range(d.size):
            x = _depth(address, d[k])
            if x < low:
                if force is not None:
                    force[k] = _first_record(FORCE, address, x)
                if area is not None:
                    area[k] = _first_record(AREA, address, x)
                if stiffness is not None:
                    stiffness[k] = 2.0 * _first_record(FORCE_SLOPE, address, x)
                if area_slope is not None:
                    area_slope[k] = _first_record(AREA_SLOPE, address, x)
                if energy is not None:
                    energy[k] = 0.5 * _first_record(ENERGY, address, x)
    return bad == 0


@njit(cache=True, error_model="numpy")
def _towards(which: int, address: int, gap: float, wanted: float) -> float:
    """A Newton step from a gap, on the logarithm of force or area: loads range over many decades."""
    value, slope = evaluate(which, address, gap), evaluate(which + FORCE_SLOPE, address, gap)
    if not (value > 0.0 and slope > 0.0):
        return math.nan
    step = value * math.log(value / wanted) / slope
    left = number(address, H_MAX) - gap
    # where contact ends force is nearly a power of what is left
    return gap + left * -math.expm1(-step / left) if whole(address, ENDS) else gap + step


@njit(cache=True, error_model="numpy")
def solve(which: int, address: int, wanted: float, low: float, high: float) -> float:
    """Gap between `low` and `high` at which force or area, falling there, has a value."""
    if not wanted > 0.0:
        return high
    gap, before, least = 0.5 * (low + high), math.inf, EPSILON * number(address, H_MAX)
    for _ in range(STEPS):
        if evaluate(which, address, gap) > wanted:
            low = gap
        else:
            high = gap
        following = _towards(which, address, gap, wanted)
        if abs(following - gap) <= EPSILON * abs(gap) + least:
            gap = following if low < following < high else gap
            break
        # steps that do not halve may go to and fro for ever
        if not (low < following < high and abs(following - gap) <= 0.5 * before):
            following = 0.5 * (low + high)
        before = abs(following - gap)
        if following in (gap, low, high):
            break
        gap = following
    # the best of the last bracket; its ends may be full compression or first contact
    best, missed = gap, abs(evaluate(which, address, gap) - wanted)
    for end in (low, high):
        other = abs(evaluate(which, address, end) - wanted)
        if other < missed:
            best, missed = end, other
    return best


@njit(cache=True, error_model="numpy", nogil=True)
def fill_inverse_nodes(
    which: int, address: int, values: FloatArray, end: float, x: FloatArray, side: FloatArray
) -> None:
    """x at values, and the sign of its side, for the records of an inverse that ends at a gap."""
    top = number(address, H_MAX) if whole(address, ENDS) else number(address, HIGHEST)
    for k in range(values.size):
        d = solve(which, address, values[k], end, top)
        x[k] = _depth(address, d)
        side[k] = number(address, MINUS) if d < 0.0 else number(address, PLUS)


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", forceinline=True)
def _fill_inverse(
    which: int, address: int, inverse: int, wanted: FloatArray, out: FloatArray, area: Any, stiffness: Any
) -> bool:
    """As `fill_inverse`: a polynomial and one step, each in a loop of its own, which keeps more entries in flight.

    The step is of third order. `solve` finds the entries for which one step may not be enough.
    """
    least, y_low, y_high = number(inverse, Y_LEAST), number(inverse, Y_LOW), number(inverse, Y_HIGH)
    turn, first, end = number(inverse, Y_TURN), whole(inverse, FIRST_BUCKET), number(inverse, END)
    h_max, width = number(address, H_MAX), 1.0 / number(address, SCALE)
    low, high = number(address, LOW), number(address, HIGH)
    start = FORCE_AT if which == FORCE else AREA_AT
    unsure = bad = 0
    for k in range(wanted.size):
        y = wanted[k]
        if not least <= y <= y_high:
            bad += 1
        held = min(max(y, y_low), y_high)
        bucket = (bits_of(held) >> (52 - INVERSE_BITS)) - first + (held > turn)
        word = INVERSE_HEAD + bucket * INVERSE_RECORD
        t = (held - number(inverse, word)) * number(inverse, word + 1)
        x = number(inverse, word + 3 + INVERSE_DEGREE)
        for j in range(INVERSE_DEGREE - 1, -1, -1):
            x = x * t + number(inverse, word + 3 + j)
        # x is positive, and its sign free for that of the side
        out[k] = min(max(x, low), high) * number(inverse, word + 2)
    for k in range(wanted.size):
        x = abs(out[k])
        side = 1.0 if out[k] > 0.0 else -1.0
        place = _record_of(address, x, (x * width - h_max) * side)
        value, slope, bend = _with_slopes(address, place.word + start, place.t)
        inverse_slope = 1.0 / slope
        step = (wanted[k] - value) * inverse_slope
        step -= bend * inverse_slope * step * step
        gap = max((x * width - h_max) * side - step / place.q, end)
        # branches that are hardly ever taken cost less than masks
        if not (abs(step) < SURE and wanted[k] >= y_low):
            gap, unsure = math.nan, unsure + 1
        out[k] = gap
        if area is not None:
            area[k] = _value(address, place.word + AREA_AT, place.t + step)
        if stiffness is not None:
            value, slope, bend = _with_slopes(address, place.word + FORCE_AT, place.t)
            stiffness[k] = 2.0 * (slope + 2.0 * bend * step) * place.q
    if unsure and not bad:
        top = h_max if whole(address, ENDS) else number(address, HIGHEST)
        for k in range(wanted.size):
            if math.isnan(out[k]):
                out[k] = solve(which, address, wanted[k], end, top)
                if area is not None:
                    area[k] = evaluate(AREA, address, out[k])
                if stiffness is not None:
                    stiffness[k] = 2.0 * evaluate(FORCE_SLOPE, address, out[k])
    return bad == 0


@njit(cache=True, error_model="numpy", nogil=True)
def fill_inverse(
    which: int, address: int, inverse: int, wanted: FloatArray, out: FloatArray, area: Any, stiffness: Any
) -> bool:
    """Gaps of forces or areas, with area and -dF/du there where their arrays are given; whether all are in range."""
    if which == FORCE:
        return _fill_inverse(FORCE, address, inverse, wanted, out, area, stiffness)
    return _fill_inverse(AREA, address, inverse, wanted, out, area, stiffness)
