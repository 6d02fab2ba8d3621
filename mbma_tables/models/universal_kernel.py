"""Compiled lookups in the universal table: (X, mu) to Phi_F, Phi_A, derivatives, status and error bound.

A cell is a record: an error bound, the two maps from X and mu to [-1, 1], and the powers of both polynomials, so that
a lookup is a few comparisons, one division and 16 additions of eight products at once. `Table` says what lies where.
Nothing is shared or kept between calls; any thread may call any of these.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import Instruction, Lanes, njit
from mbma_tables.elementary import bits_of
from mbma_tables.tablefiles.schema import BUCKET_BITS

OK, X_BELOW, X_ABOVE, MU_ABOVE, UNRESOLVED = 0, 1, 2, 3, 4
REASONS = {X_BELOW: "X below", X_ABOVE: "X above", MU_ABOVE: "mu above"}

TERMS = 8  # of each polynomial along each axis
# a record, in doubles: eight of the cell, then powers of X at each power of mu, of Phi_F/mu and of Phi_A
ERROR, CENTRE, RATE, TOP_MU, TOP, BOTTOM_MU, BOTTOM = range(7)
FORCE_POWERS, AREA_POWERS, RECORD = 8, 8 + TERMS**2, 8 + 2 * TERMS**2


class Table(NamedTuple):
    """The universal table as compiled code takes it.

    The cell of (X, mu) is ``places[places[int((X - X_low) X_rate)] + bits(mu) >> BUCKET_BITS - first_bucket]``; in it
    x = (X - CENTRE) RATE and y = (mu TOP_MU + TOP)/(mu BOTTOM_MU + BOTTOM).
    """

    records: FloatArray  # flat, RECORD doubles a cell, on lines of 64 bytes
    places: NDArray[np.int32]  # where a strip's buckets begin, by equal steps of X; then the cells of the buckets
    X_low: float
    X_high: float
    X_rate: float
    mu_high: float
    first_bucket: int
    buckets: int


def _along_x(row: Any, x: Any) -> Any:
    """The sum over a row of powers of x, by halves."""
    for power, half in (((x * x) * (x * x), 4), (x * x, 2), (x, 1)):
        row = row[:half] + row[half:] * power
    return row[0]


def polynomial(rows: Any, x: Any, y: Any) -> Any:
    """Rows of powers of x, one for each power of y, summed by pairs, which waits less than one after the other.

    An array of `Lanes`, or one whose first axes are those of the powers of y and x.
    """
    while len(rows) > 1:
        rows, y = rows[::2] + rows[1::2] * y, y * y
    return _along_x(rows[0], x)


def gradient(rows: Any, x: Any, y: Any) -> Any:
    """The same, summed one after the other, and its derivatives by x and by y."""
    value, slope = rows[-2] + rows[-1] * y, rows[-1]
    for row in rows[-3::-1]:
        value, slope = row + value * y, value + slope * y
    powers = [*range(1, TERMS), 0]
    return _along_x(value, x), _along_x(value[powers] * powers, x), _along_x(slope, x)


def _instruction(function: Any, *flags: str) -> Any:
    """`polynomial` or `gradient` of an array from an offset on, at x and y in [-1, 1], with flags of LLVM's."""

    def define(typing: Any, array: Any, offset: Any, x: Any, y: Any) -> Any:
        from numba import types
        from numba.np.arrayobj import make_array

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            data, rows = make_array(signature.args[0])(context, builder, arguments[0]).data, np.empty(TERMS, object)
            for k in range(TERMS):
                at = builder.add(arguments[1], arguments[1].type(TERMS * k))
                rows[k] = Lanes.load(builder, data, at, TERMS, flags)
            found = function(rows, *(Lanes(builder, number, flags) for number in arguments[2:]))
            if function is polynomial:
                return found.value
            return context.make_tuple(builder, signature.return_type, [part.value for part in found])

        made = types.float64 if function is polynomial else types.UniTuple(types.float64, 3)
        return made(array, types.int64, x, y), generate

    def plain(array: FloatArray, offset: int, x: float, y: float) -> Any:
        return function(array[offset : offset + TERMS**2].reshape(TERMS, TERMS), x, y)

    return Instruction(define, plain)


value_at, gradient_at = _instruction(polynomial), _instruction(gradient, "contract")


# fastmath=False is said because else numba takes that of whichever caller compiles these first, and bits depend on it
@njit(cache=True, fastmath=False, error_model="numpy", forceinline=True)
def _find(X: float, mu: float, table: Table) -> tuple[int, int, float, float]:
    """Status, where the record of the cell begins, and x and y in it."""
    if not table.X_low <= X:
        return X_BELOW, 0, math.nan, math.nan
    if not table.X_high >= X:
        return X_ABOVE, 0, math.nan, math.nan
    if not mu <= table.mu_high:
        return MU_ABOVE, 0, math.nan, math.nan
    strip = table.places[int((X - table.X_low) * table.X_rate)]
    bucket = min(max((bits_of(mu) >> BUCKET_BITS) - table.first_bucket, 0), table.buckets - 1)
    r, cell = table.records, RECORD * table.places[strip + bucket]
    y = (mu * r[cell + TOP_MU] + r[cell + TOP]) / (mu * r[cell + BOTTOM_MU] + r[cell + BOTTOM])
    return OK, cell, (X - r[cell + CENTRE]) * r[cell + RATE], y


@njit(cache=True, fastmath=False, error_model="numpy", forceinline=True)
def universal_phi(
    X: float, mu: float, table: Table, slopes: Any
) -> tuple[int, float, float, float, float, float, float, float]:
    """Status, Phi_F and its derivatives by X and by mu, Phi_A and its, and the bound on the error of the functions.

    Where `slopes` is None, not True, derivatives are 0 and cost nothing: the code of each is compiled by itself.
    """
    status, cell, x, y = _find(X, mu, table)
    if status != OK:
        nan = math.nan
        return status, nan, nan, nan, nan, nan, nan, nan
    r = table.records
    if slopes is None:
        F, A = value_at(r, cell + FORCE_POWERS, x, y), value_at(r, cell + AREA_POWERS, x, y)
        return OK, mu * F, 0.0, 0.0, A, 0.0, 0.0, r[cell + ERROR]
    by_X, bottom = r[cell + RATE], mu * r[cell + BOTTOM_MU] + r[cell + BOTTOM]
    by_mu = (r[cell + TOP_MU] * r[cell + BOTTOM] - r[cell + TOP] * r[cell + BOTTOM_MU]) / (bottom * bottom)
    F, F_x, F_y = gradient_at(r, cell + FORCE_POWERS, x, y)
    A, A_x, A_y = gradient_at(r, cell + AREA_POWERS, x, y)
    return OK, mu * F, mu * F_x * by_X, F + mu * F_y * by_mu, A, A_x * by_X, A_y * by_mu, r[cell + ERROR]


@njit(cache=True, fastmath=False, error_model="numpy", nogil=True)
def fill(X: FloatArray, mu: FloatArray, table: Table, slopes: Any, out: FloatArray) -> None:
    """`universal_phi` of each entry into rows of `out`: Phi_F, Phi_A, error, then derivatives; NaN outside."""
    for k in range(X.size):
        row = out[k]
        _, row[0], F_X, F_mu, row[1], A_X, A_mu, row[2] = universal_phi(X[k], mu[k], table, slopes)
        if slopes is not None:
            row[3], row[4], row[5], row[6] = F_X, F_mu, A_X, A_mu
