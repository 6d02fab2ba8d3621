"""Elementary functions of compiled loops over arrays: without a branch and without a call, so that loops vectorise.

Each errs by less than 1e-15, relative to its value. What lies beyond the range of an exponential is taken at its end.
"""

from __future__ import annotations

import struct
from typing import Any

from mbma_tables.compiled import CONTRACT, Instruction, njit

_ROUND = 6755399441055744.0  # 1.5 2^52: adding it rounds to a whole number
_LOG2E = 1.4426950408889634
_LN2_HIGH, _LN2_LOW = 0.6931471803691238, 1.9082149292705877e-10
_LEAST, _MOST = -700.0, 700.0  # of exponents
_ONE = 0x3FF0000000000000  # bits of 1.0
_ROOT_HALF = 0x3FE6A09E667F3BCD  # and of sqrt(1/2)


def _reinterpret(made: str, source: str, target: str) -> Any:
    """A function that takes the bits of a number for one of another type; formats are those of `struct`."""

    def define(typing: Any, value: Any) -> Any:
        from numba import types

        kind = getattr(types, made)
        return kind(value), lambda context, builder, signature, given: builder.bitcast(
            given[0], context.get_value_type(kind)
        )

    def plain(value: Any) -> Any:
        return struct.unpack(target, struct.pack(source, int(value) % 2**64 if source == "Q" else value))[0]

    return Instruction(define, plain)


bits_of = _reinterpret("int64", "d", "q")
float_of = _reinterpret("float64", "Q", "d")


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", forceinline=True)
def _reduced(x: float) -> tuple[float, float]:
    """2^k and (exp(r) - 1)/r - 1 times r, plus r, with x = k ln 2 + r and |r| <= ln(2)/2."""
    shifted = min(max(x, _LEAST), _MOST) * _LOG2E + _ROUND
    power = shifted - _ROUND
    r = (min(max(x, _LEAST), _MOST) - power * _LN2_HIGH) - power * _LN2_LOW
    p = 1.0 / 6227020800.0
    p = p * r + 1.0 / 479001600.0
    p = p * r + 1.0 / 39916800.0
    p = p * r + 1.0 / 3628800.0
    p = p * r + 1.0 / 362880.0
    p = p * r + 1.0 / 40320.0
    p = p * r + 1.0 / 5040.0
    p = p * r + 1.0 / 720.0
    p = p * r + 1.0 / 120.0
    p = p * r + 1.0 / 24.0
    p = p * r + 1.0 / 6.0
    p = p * r + 0.5
    return float_of(_ONE + (bits_of(shifted) << 52)), r + r * r * p


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", forceinline=True)
def exp(x: float) -> float:
    """exp(x); of x in [-700, 700]."""
    power, rest = _reduced(x)
    return power + power * rest


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", forceinline=True)
def expm1(x: float) -> float:
    """exp(x) - 1; of x in [-700, 700]."""
    power, rest = _reduced(x)
    return power * rest + (power - 1.0)


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", forceinline=True)
def log(x: float) -> float:
    """ln(x) of normal x > 0."""
    bits = bits_of(x)
    # so many halvings that the rest lies in [sqrt(1/2), sqrt(2))
    halvings = (bits - _ROOT_HALF) >> 52
    f = float_of(bits - (halvings << 52)) - 1.0
    k = float_of(bits_of(_ROUND) + halvings) - _ROUND
    s = f / (2.0 + f)
    z = s * s
    p = 2.0 / 21.0
    p = p * z + 2.0 / 19.0
    p = p * z + 2.0 / 17.0
    p = p * z + 2.0 / 15.0
    p = p * z + 2.0 / 13.0
    p = p * z + 2.0 / 11.0
    p = p * z + 2.0 / 9.0
    p = p * z + 2.0 / 7.0
    p = p * z + 2.0 / 5.0
    p = p * z + 2.0 / 3.0
    # 2 s = f - s f, whose rounding does not count
    value: float = k * _LN2_HIGH + (f - (s * (f - z * p) - k * _LN2_LOW))
    return value


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", forceinline=True)
def log1p(x: float) -> float:
    """ln(1 + x) of x > -1."""
    u = 1.0 + x
    # what rounding took from 1 + x
    return log(u) + (x - (u - 1.0)) / u
