"""Compiled interpolation in the universal table: (X, mu) to Phi_F, Phi_A, derivatives, status and error bound.

Nothing is shared or kept between calls; any thread may call any of these.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import REORDER, njit
from mbma_tables.islands import height_integrals as heights
from mbma_tables.models.protocol import FORCE
from mbma_tables.tablefiles.interpolate import gradient_2d, value_2d

OK, X_BELOW, X_ABOVE, MU_ABOVE, UNRESOLVED = 0, 1, 2, 3, 4
REASONS = {X_BELOW: "X below", X_ABOVE: "X above", MU_ABOVE: "mu above"}
SECOND_ORDER = 1e-12  # what the expansion about the rigid sphere leaves below mu = 1e-8

_ONE, _THREE_HALVES, _TWO, _FIVE_HALVES = heights._ONE, heights._THREE_HALVES, heights._TWO, heights._FIVE_HALVES


class Axes(NamedTuple):
    """Both axes: range, first node and 1/step of log(X + X_offset) and log(mu), error cells per node."""

    X_low: float
    X_high: float
    X_offset: float
    X_start: float
    X_rate: float
    mu_low: float
    mu_high: float
    mu_start: float
    mu_rate: float
    X_cells: float
    mu_cells: float


class Table(NamedTuple):
    """The universal table as compiled code takes it."""

    coefficients: FloatArray
    errors: FloatArray
    axes: Axes


@njit(cache=True, error_model="numpy")
def _locate(X: float) -> tuple[int, float, float, float]:
    """`height_integrals._locate` at -X, with one comparison where X lies in [0, 8]."""
    if 0.0 <= X < 8.0:
        pair = int(0.5 * X)
        return 4 - pair, 2.0 * pair + 1.0 - X, 1.0, 1.0
    return heights._locate(-X)


@njit(cache=True, fastmath=REORDER, error_model="numpy")
def _polynomial(row: FloatArray, t: float) -> float:
    """`height_integrals._horner` in four chains that run side by side."""
    t2 = t * t
    t4 = t2 * t2
    even = row[0] + t4 * (row[4] + t4 * (row[8] + t4 * (row[12] + t4 * row[16])))
    odd = row[1] + t4 * (row[5] + t4 * (row[9] + t4 * (row[13] + t4 * row[17])))
    second = row[2] + t4 * (row[6] + t4 * (row[10] + t4 * (row[14] + t4 * row[18])))
    third = row[3] + t4 * (row[7] + t4 * (row[11] + t4 * row[15]))
    value: float = even + t2 * second + t * (odd + t2 * third)
    return value


@njit(cache=True, error_model="numpy")
def _rigid_integrals(X: float) -> tuple[float, float]:
    """(F_{5/2}(-X), F_2(-X)) in one pass."""
    piece, t, base, weight = _locate(X)
    common = base * base * weight
    return _polynomial(_FIVE_HALVES[piece], t) * (math.sqrt(base) * common), _polynomial(_TWO[piece], t) * common


@njit(cache=True, error_model="numpy")
def _rigid_slopes(X: float) -> tuple[float, float]:
    """(F_{3/2}(-X), F_1(-X)), up to factors the derivatives of `_rigid_integrals`."""
    piece, t, base, weight = _locate(X)
    common = base * weight
    return _polynomial(_THREE_HALVES[piece], t) * (math.sqrt(base) * common), _polynomial(_ONE[piece], t) * common


@njit(cache=True, error_model="numpy", forceinline=True)
def _error_at(place_X: float, place_mu: float, table: Table) -> float:
    """Bound on the error in the cell of a position."""
    errors, axes = table.errors, table.axes
    row = max(min(int(place_X * axes.X_cells), errors.shape[0] - 1), 0)
    column = max(min(int(place_mu * axes.mu_cells), errors.shape[1] - 1), 0)
    bound: float = errors[row, column] + SECOND_ORDER
    return bound


@njit(cache=True, error_model="numpy", inline="always")
def _place(X: float, mu: float, axes: Axes) -> tuple[int, float, float, float]:
    """Status, position on both axes in node units, and mu over the nearest mu that the table holds."""
    if not axes.X_low <= X:
        return X_BELOW, math.nan, math.nan, math.nan
    if not axes.X_high >= X:
        return X_ABOVE, math.nan, math.nan, math.nan
    if not mu <= axes.mu_high:
        return MU_ABOVE, math.nan, math.nan, math.nan
    inside = max(mu, axes.mu_low)
    place_X = (math.log(X + axes.X_offset) - axes.X_start) * axes.X_rate
    # first order about the rigid sphere below the table
    return OK, place_X, (math.log(inside) - axes.mu_start) * axes.mu_rate, mu / inside


@njit(cache=True, fastmath=REORDER, error_model="numpy", forceinline=True)
def universal_phi(X: float, mu: float, table: Table) -> tuple[int, float, float, float]:
    """Status, Phi_F, Phi_A and the bound on their relative error at (X, mu)."""
    status, place_X, place_mu, share = _place(X, mu, table.axes)
    if status != OK:
        return status, math.nan, math.nan, math.nan
    force, area = value_2d(table.coefficients, place_X, place_mu)
    five, two = _rigid_integrals(X)
    phi_F = math.pi / 5.0 * mu * five * math.exp(force * share)
    phi_A = math.pi / 2.0 * two * math.exp(area * share)
    return OK, phi_F, phi_A, _error_at(place_X, place_mu, table)


@njit(cache=True, fastmath=REORDER, error_model="numpy", forceinline=True)
def universal_one(which: int, X: float, mu: float, table: Table) -> tuple[int, float, float]:
    """Status, Phi_F (`which` = 0) or Phi_A (1) alone, and the bound on its relative error."""
    status, place_X, place_mu, share = _place(X, mu, table.axes)
    if status != OK:
        return status, math.nan, math.nan
    # the spline of both costs what one does: their coefficients lie in pairs
    force, area = value_2d(table.coefficients, place_X, place_mu)
    piece, t, base, weight = _locate(X)
    common = base * base * weight
    if which == FORCE:
        phi = math.pi / 5.0 * mu * _polynomial(_FIVE_HALVES[piece], t) * (math.sqrt(base) * common)
        phi *= math.exp(force * share)
    else:
        phi = math.pi / 2.0 * _polynomial(_TWO[piece], t) * common * math.exp(area * share)
    return OK, phi, _error_at(place_X, place_mu, table)


class Slopes(NamedTuple):
    """Phi_F and Phi_A with their logarithmic derivatives by X and by log(mu)."""

    status: int
    phi_F: float
    F_by_X: float
    F_by_mu: float
    phi_A: float
    A_by_X: float
    A_by_mu: float
    error: float


@njit(cache=True, error_model="numpy", forceinline=True)
def universal_slopes(X: float, mu: float, table: Table) -> Slopes:
    """Phi_F and d log Phi_F by X and by log(mu), the same of Phi_A, and the bound on the relative error."""
    axes = table.axes
    status, place_X, place_mu, share = _place(X, mu, axes)
    if status != OK:
        nan = math.nan
        return Slopes(status, nan, nan, nan, nan, nan, nan, nan)
    f, f_X, f_mu, g, g_X, g_mu = gradient_2d(table.coefficients, place_X, place_mu)
    by_X = axes.X_rate / (X + axes.X_offset) * share
    five, two = _rigid_integrals(X)
    three, one = _rigid_slopes(X)
    inside = mu >= axes.mu_low
    return Slopes(
        OK,
        math.pi / 5.0 * mu * five * math.exp(f * share),
        f_X * by_X + 2.5 * three / five,
        # below the table the logarithm is proportional to mu
        1.0 + (f_mu * axes.mu_rate if inside else f * share),
        math.pi / 2.0 * two * math.exp(g * share),
        g_X * by_X + 2.0 * one / two,
        g_mu * axes.mu_rate if inside else g * share,
        _error_at(place_X, place_mu, table),
    )


@njit(cache=True, error_model="numpy", nogil=True)
def fill_phi(X: FloatArray, mu: FloatArray, table: Table, status: NDArray[np.int64], out: FloatArray) -> None:
    """`universal_phi` of each entry: status, and Phi_F, Phi_A, error into the rows of `out` (entries, 3)."""
    for k in range(X.size):
        status[k], out[k, 0], out[k, 1], out[k, 2] = universal_phi(X[k], mu[k], table)


@njit(cache=True, error_model="numpy", nogil=True)
def fill_slopes(X: FloatArray, mu: FloatArray, table: Table, status: NDArray[np.int64], out: FloatArray) -> None:
    """`universal_slopes` of each entry: status, and the other seven into the rows of `out` (entries, 7)."""
    for k in range(X.size):
        found = universal_slopes(X[k], mu[k], table)
        status[k] = found.status
        out[k, 0], out[k, 1], out[k, 2] = found.phi_F, found.F_by_X, found.F_by_mu
        out[k, 3], out[k, 4], out[k, 5] = found.phi_A, found.A_by_X, found.A_by_mu
        out[k, 6] = found.error
