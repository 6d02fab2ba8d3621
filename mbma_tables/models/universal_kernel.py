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
from mbma_tables.compiled import Instruction, njit
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


class _Polynomial:
    """Code for TERMS rows of powers of x from `offset` on, a row for each power of y; fused, or rounded as in numpy."""

    def __init__(self, context: Any, builder: Any, signature: Any, arguments: Any, fused: bool = False) -> None:
        from llvmlite import ir
        from numba.np.arrayobj import make_array

        array, self.offset, self.x, self.y = arguments
        self.ir, self.builder, self.flags = ir, builder, ("contract",) if fused else ()
        self.data = make_array(signature.args[0])(context, builder, array).data

    def row(self, power: int) -> Any:
        builder, ir = self.builder, self.ir
        start = builder.gep(self.data, [builder.add(self.offset, ir.IntType(64)(TERMS * power))], inbounds=True)
        vector = builder.load(builder.bitcast(start, ir.VectorType(ir.DoubleType(), TERMS).as_pointer()))
        # doubles, not vectors, are what numpy aligns
        vector.align = 8
        return vector

    def add(self, total: Any, factor: Any, vector: Any) -> Any:
        """``total + factor * vector`` of vectors and a number."""
        spread = self.ir.Constant(vector.type, self.ir.Undefined)
        for k in range(vector.type.count):
            spread = self.builder.insert_element(spread, factor, self.ir.IntType(32)(k))
        return self.builder.fadd(total, self.builder.fmul(spread, vector, flags=self.flags), flags=self.flags)

    def picked(self, vector: Any, lanes: range | list[int]) -> Any:
        index = self.ir.IntType(32)
        mask = self.ir.Constant(self.ir.VectorType(index, len(lanes)), [index(k) for k in lanes])
        return self.builder.shuffle_vector(vector, self.ir.Constant(vector.type, self.ir.Undefined), mask)

    def sum(self) -> Any:
        """The sum over the rows by pairs, which waits less than one after the other."""
        rows, power = [self.row(k) for k in range(TERMS)], self.y
        while len(rows) > 1:
            rows = [self.add(even, power, odd) for even, odd in zip(rows[::2], rows[1::2], strict=True)]
            power = self.builder.fmul(power, power)
        return rows[0]

    def sums(self) -> tuple[Any, Any]:
        """The sum over the rows, and its derivative by y."""
        value, slope = self.row(TERMS - 1), None
        for power in range(TERMS - 2, -1, -1):
            slope = value if slope is None else self.add(value, self.y, slope)
            value = self.add(self.row(power), self.y, value)
        return value, slope

    def along_x(self, row: Any) -> Any:
        """The sum over one row, by halves."""
        powers = [self.x]
        while 2 ** len(powers) < TERMS:
            powers.append(self.builder.fmul(powers[-1], powers[-1]))
        for power in reversed(powers):
            half = row.type.count // 2
            low, high = (self.picked(row, range(k, k + half)) for k in (0, half))
            row = self.add(low, power, high)
        return self.builder.extract_element(row, self.ir.IntType(32)(0))

    def slope_along_x(self, row: Any) -> Any:
        powers = [*range(1, TERMS), 0]
        factors = self.ir.Constant(row.type, [float(power) for power in powers])
        return self.along_x(self.builder.fmul(self.picked(row, powers), factors))


def polynomial(powers: FloatArray, x: Any, y: Any) -> Any:
    """Polynomials (..., y, x) in numpy, operation by operation as compiled; x and y have two axes of length 1 more."""
    rows, power = powers, y
    while rows.shape[-2] > 1:
        rows, power = rows[..., ::2, :] + power * rows[..., 1::2, :], power * power
    row = rows[..., 0, :]
    for power in ((x * x) * (x * x), x * x, x):
        half = row.shape[-1] // 2
        row = row[..., :half] + power[..., 0] * row[..., half:]
    return row[..., 0]


def _plain(array: FloatArray, offset: int, x: float, y: float) -> tuple[Any, Any, Any]:
    powers = array[offset : offset + TERMS**2].reshape(TERMS, TERMS)
    by_x = np.pad(powers[:, 1:] * np.arange(1, TERMS), ((0, 0), (0, 1)))
    by_y = np.pad(powers[1:] * np.arange(1, TERMS)[:, None], ((0, 1), (0, 0)))
    value, slope_x, slope_y = polynomial(np.stack([powers, by_x, by_y]), np.array([[x]]), np.array([[y]]))
    return value, slope_x, slope_y


def _instruction(slopes: bool) -> Any:
    """A polynomial of an array from an offset on, at x and y in [-1, 1], perhaps with its derivatives by both."""

    def define(typing: Any, array: Any, offset: Any, x: Any, y: Any) -> Any:
        from numba import types

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            polynomial = _Polynomial(context, builder, signature, arguments, fused=slopes)
            if not slopes:
                return polynomial.along_x(polynomial.sum())
            value, slope = polynomial.sums()
            parts = polynomial.along_x(value), polynomial.slope_along_x(value), polynomial.along_x(slope)
            return context.make_tuple(builder, signature.return_type, parts)

        made = types.UniTuple(types.float64, 3) if slopes else types.float64
        return made(array, types.int64, x, y), generate

    return Instruction(define, _plain if slopes else lambda *given: _plain(*given)[0])


value_at, gradient_at = _instruction(False), _instruction(True)


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
def fill(X: FloatArray, mu: FloatArray, table: Table, slopes: Any, status: NDArray[np.int64], out: FloatArray) -> None:
    """`universal_phi` of each entry: status, and Phi_F, Phi_A, error, then derivatives, into rows of `out`."""
    for k in range(X.size):
        row = out[k]
        status[k], row[0], F_X, F_mu, row[1], A_X, A_mu, row[2] = universal_phi(X[k], mu[k], table, slopes)
        if slopes is not None:
            row[3], row[4], row[5], row[6] = F_X, F_mu, A_X, A_mu
