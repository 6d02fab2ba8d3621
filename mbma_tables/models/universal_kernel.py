"""Compiled lookups in the universal table: (X, mu) to Phi_F, Phi_A, their slopes, a status and a bound on the error.

Nothing is shared or kept between calls; any thread may call any of these.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.islands.height_integrals import f_five_halves, f_one, f_three_halves, f_two
from mbma_tables.tablefiles.interpolate import gradient_2d, value_2d

# low, high, offset, first t and 1/step of X; low, high, first t and 1/step of mu
Axes = tuple[float, float, float, float, float, float, float, float, float]
OK, X_BELOW, X_ABOVE, MU_ABOVE, UNRESOLVED = 0, 1, 2, 3, 4
REASONS = {X_BELOW: "X below", X_ABOVE: "X above", MU_ABOVE: "mu above"}
SECOND_ORDER = 1e-12  # what the expansion about the rigid sphere leaves below mu = 1e-8
_LOOSE = {"contract", "reassoc", "arcp"}


@njit(cache=True, fastmath=_LOOSE, error_model="numpy")
def universal_phi(
    X: float, mu: float, table: FloatArray, errors: FloatArray, axes: Axes
) -> tuple[int, float, float, float]:
    """Status, Phi_F, Phi_A and the bound on their relative error at (X, mu)."""
    X_low, X_high, offset, X_start, X_rate, mu_low, mu_high, mu_start, mu_rate = axes
    if not X_low <= X:
        return X_BELOW, math.nan, math.nan, math.nan
    if not X_high >= X:
        return X_ABOVE, math.nan, math.nan, math.nan
    if not mu <= mu_high:
        return MU_ABOVE, math.nan, math.nan, math.nan
    inside = max(mu, mu_low)
    place_X = (math.log(X + offset) - X_start) * X_rate
    place_mu = (math.log(inside) - mu_start) * mu_rate
    force, area = value_2d(table, place_X, place_mu)
    # first order about the rigid sphere below the table
    share = mu / inside
    row = min(int(place_X * errors.shape[0] / (table.shape[0] - 5)), errors.shape[0] - 1)
    column = min(int(place_mu * errors.shape[1] / (table.shape[1] - 5)), errors.shape[1] - 1)
    phi_F = math.pi / 5.0 * mu * f_five_halves(-X) * math.exp(force * share)
    phi_A = math.pi / 2.0 * f_two(-X) * math.exp(area * share)
    return OK, phi_F, phi_A, errors[max(row, 0), max(column, 0)] + SECOND_ORDER


@njit(cache=True, error_model="numpy")
def universal_slopes(
    X: float, mu: float, table: FloatArray, errors: FloatArray, axes: Axes
) -> tuple[int, float, float, float, float, float, float, float]:
    """Status; Phi_F and d log Phi_F by X and by log(mu); the same of Phi_A; the bound on the relative error."""
    X_low, X_high, offset, X_start, X_rate, mu_low, mu_high, mu_start, mu_rate = axes
    nan = math.nan
    if not X_low <= X:
        return X_BELOW, nan, nan, nan, nan, nan, nan, nan
    if not X_high >= X:
        return X_ABOVE, nan, nan, nan, nan, nan, nan, nan
    if not mu <= mu_high:
        return MU_ABOVE, nan, nan, nan, nan, nan, nan, nan
    inside = max(mu, mu_low)
    place_X = (math.log(X + offset) - X_start) * X_rate
    place_mu = (math.log(inside) - mu_start) * mu_rate
    f, f_X, f_mu, g, g_X, g_mu = gradient_2d(table, place_X, place_mu)
    share = mu / inside
    by_X = X_rate / (X + offset) * share
    five, two = f_five_halves(-X), f_two(-X)
    row = max(min(int(place_X * errors.shape[0] / (table.shape[0] - 5)), errors.shape[0] - 1), 0)
    column = max(min(int(place_mu * errors.shape[1] / (table.shape[1] - 5)), errors.shape[1] - 1), 0)
    # below the table the logarithm is proportional to mu
    F_mu = 1.0 + (f_mu * mu_rate if mu >= mu_low else f * share)
    A_mu = g_mu * mu_rate if mu >= mu_low else g * share
    return (
        OK,
        math.pi / 5.0 * mu * five * math.exp(f * share),
        f_X * by_X + 2.5 * f_three_halves(-X) / five,
        F_mu,
        math.pi / 2.0 * two * math.exp(g * share),
        g_X * by_X + 2.0 * f_one(-X) / two,
        A_mu,
        errors[row, column] + SECOND_ORDER,
    )


@njit(cache=True, error_model="numpy", nogil=True)
def fill_phi(
    X: FloatArray,
    mu: FloatArray,
    table: FloatArray,
    errors: FloatArray,
    axes: Axes,
    status: NDArray[np.int64],
    out: FloatArray,
) -> None:
    """`universal_phi` of each entry: status, and Phi_F, Phi_A, error into the columns of `out` (3, entries)."""
    for k in range(X.size):
        status[k], out[0, k], out[1, k], out[2, k] = universal_phi(X[k], mu[k], table, errors, axes)


@njit(cache=True, error_model="numpy", parallel=True)
def fill_phi_parallel(
    X: FloatArray,
    mu: FloatArray,
    table: FloatArray,
    errors: FloatArray,
    axes: Axes,
    status: NDArray[np.int64],
    out: FloatArray,
) -> None:
    """`fill_phi` on all cores, for large batches."""
    for k in prange(X.size):
        status[k], out[0, k], out[1, k], out[2, k] = universal_phi(X[k], mu[k], table, errors, axes)


@njit(cache=True, error_model="numpy", nogil=True)
def fill_slopes(
    X: FloatArray,
    mu: FloatArray,
    table: FloatArray,
    errors: FloatArray,
    axes: Axes,
    status: NDArray[np.int64],
    out: FloatArray,
) -> None:
    """`universal_slopes` of each entry: status, and the other seven into the columns of `out` (7, entries)."""
    for k in range(X.size):
        status[k], out[0, k], out[1, k], out[2, k], out[3, k], out[4, k], out[5, k], out[6, k] = universal_slopes(
            X[k], mu[k], table, errors, axes
        )
