"""Newton's method for the island problem (Eqs. 34, 36, 37), compiled.

Unknown is the sphere's deformation w at the Gauss nodes. The residual w - a A p(w) is monotone, so full
steps from w = 0 converge; its Jacobian 1 + a A D, D = -dp/dw, is solved by Cholesky in the symmetric
form 1 + a sqrt(D) A sqrt(D).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import njit
from mbma_tables.islands.height_integrals import f_five_halves, f_half, f_one, f_three_halves, f_two, pressure_integrals
from mbma_tables.islands.spectral import Basis

MAX_STEPS = 200
COARSE_TOLERANCE = 1e-4
MIN_COARSE_RATIO = 1.5  # a rough solution first, where the basis is larger than its by this factor
ROUNDING = 1e-14
TINY = 1e-300
NEGLIGIBLE = 1e-17  # a relative effect of the deformation below which the sphere is rigid
MODES_TOGETHER = 4  # neighbouring modes of which the largest counts, for single ones may vanish

_VECTOR_SUMS = {"contract", "reassoc"}  # fastmath flags that change the order of summation only


@njit(cache=True, error_model="numpy")
def extent_squared(X: float, mu: float, share: float) -> float:
    """a^2 with all but `share` of the area on a rigid sphere inside rho < a; X above -38."""
    # elasticity takes up to a factor mu F_{3/2} of the force away from the middle, little from the edge
    softening = math.pow(1.0 + mu * f_three_halves(-X), -0.25)
    target = math.log(f_two(-X)) + math.log(share * softening)
    low = -X
    high = max(-X, 0.0) + 1.0
    # beyond 38 F underflows
    while high < 38.0 and math.log(f_two(high)) > target:
        low = high
        high += 2.0
    for _ in range(20):
        middle = 0.5 * (low + high)
        if math.log(f_two(middle)) > target:
            low = middle
        else:
            high = middle
    return high + X


@njit(cache=True, fastmath=_VECTOR_SUMS, error_model="numpy")
def _dot(matrix: FloatArray, row: int, vector: FloatArray) -> float:
    total = 0.0
    for k in range(vector.size):
        total += matrix[row, k] * vector[k]
    return total


@njit(cache=True, error_model="numpy")
def _sum(values: FloatArray, root_weights: FloatArray) -> float:
    total = 0.0
    for i in range(values.size):
        total += values[i] * root_weights[i]
    return total


@njit(cache=True, error_model="numpy")
def _largest_mode(modes: FloatArray, vector: FloatArray, first: int) -> float:
    """Largest of `MODES_TOGETHER` Legendre coefficients from number `first` on."""
    largest = 0.0
    for k in range(first, first + MODES_TOGETHER):
        largest = max(largest, abs(_dot(modes, k, vector)))
    return largest


@njit(cache=True, error_model="numpy")
def _unresolved(modes: FloatArray, vector: FloatArray, integral: float) -> float:
    """Relative error of a profile's Gauss sum: its modes beyond 2n, extrapolated from n/2 and n."""
    n = vector.size
    last = _largest_mode(modes, vector, n - MODES_TOGETHER)
    middle = _largest_mode(modes, vector, n // 2 - MODES_TOGETHER // 2)
    return last * min(1.0, (last / max(middle, TINY)) ** 2) / integral


@njit(cache=True, fastmath=_VECTOR_SUMS, error_model="numpy")
def _cholesky_solve(matrix: FloatArray, vector: FloatArray) -> None:
    """Overwrite `vector` with the solution and the lower triangle of `matrix` with its factor."""
    n = vector.size
    for i in range(n):
        for j in range(i):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = total * matrix[j, j]
        total = matrix[i, i]
        for k in range(i):
            total -= matrix[i, k] * matrix[i, k]
        # the diagonal holds reciprocals: one division a row
        matrix[i, i] = 1.0 / math.sqrt(total)
    for i in range(n):
        total = vector[i]
        for k in range(i):
            total -= matrix[i, k] * vector[k]
        vector[i] = total * matrix[i, i]
    for i in range(n - 1, -1, -1):
        value = vector[i] * matrix[i, i]
        vector[i] = value
        for k in range(i):
            vector[k] -= value * matrix[i, k]


@njit(cache=True, error_model="numpy", nogil=True)
def newton_steps(
    X: float,
    mu: float,
    squared: float,
    basis: Basis,
    tolerance: float,
    w: FloatArray,
    p: FloatArray,
) -> tuple[int, float]:
    """Iterate on `w` (times root_weights) until the pressure's relative error is below `tolerance`.

    `p` receives pressure/mu times root_weights. Returns the number of steps and the error that the last
    step leaves, the square of its relative change of pressure; NaN where `MAX_STEPS` did not suffice.
    """
    v, root_weights, operator = basis.v, basis.root_weights, basis.operator
    n = v.size
    a = math.sqrt(squared)
    matrix = np.empty((n, n))
    slope = np.empty(n)
    residual = np.empty(n)
    z = np.empty(n)
    left = math.nan
    steps = 0
    while steps < MAX_STEPS:
        steps += 1
        largest = 0.0
        for i in range(n):
            three_halves, half = pressure_integrals(squared * v[i] - X + w[i] / root_weights[i])
            p[i] = 0.5 * three_halves * root_weights[i]
            slope[i] = math.sqrt(0.75 * mu * half)
            largest = max(largest, three_halves)
        for i in range(n):
            residual[i] = mu * a * _dot(operator, i, p) - w[i]
            z[i] = slope[i] * residual[i]
            for j in range(i + 1):
                matrix[i, j] = a * slope[i] * operator[i, j] * slope[j]
            matrix[i, i] += 1.0
        _cholesky_solve(matrix, z)
        for i in range(n):
            z[i] *= slope[i]
        change = 0.0
        for i in range(n):
            step = residual[i] - a * _dot(operator, i, z)
            w[i] += step
            change = max(change, slope[i] * slope[i] * abs(step) / root_weights[i])
        relative = change / (0.5 * mu * largest) if mu > 0.0 else 0.0
        if relative * relative <= tolerance:
            left = relative * relative
            break
    for i in range(n):
        three_halves, _ = pressure_integrals(squared * v[i] - X + w[i] / root_weights[i])
        p[i] = 0.5 * three_halves * root_weights[i]
    return steps, left


@njit(cache=True, error_model="numpy", nogil=True)
def coarse_start(
    X: float,
    mu: float,
    squared: float,
    coarse: Basis,
    modes: FloatArray,
    w: FloatArray,
) -> int:
    """Fill `w` with a rough solution on few nodes, carried over by its Legendre modes; returns its steps."""
    few = coarse.v.size
    rough = np.zeros(few)
    pressure = np.zeros(few)
    used, left = newton_steps(X, mu, squared, coarse, COARSE_TOLERANCE, rough, pressure)
    w[:] = 0.0
    if left <= COARSE_TOLERANCE:
        for k in range(few):
            mode = _dot(coarse.modes, k, rough)
            for i in range(w.size):
                w[i] += mode * modes[k, i]
    return used


@njit(cache=True, error_model="numpy", nogil=True)
def solve_islands(
    X: FloatArray,
    mu: FloatArray,
    rtol: float,
    basis: Basis,
    coarse: Basis,
    phi: FloatArray,
    extent: FloatArray,
    steps: NDArray[np.int64],
    w: FloatArray,
    p: FloatArray,
) -> None:
    """Solve each (X, mu) on one basis.

    `phi` (entries, 3) receives Phi_F/mu, Phi_A and an estimate of their relative error, NaN where Newton
    failed; `coarse` is the small basis of the first guess, `extent` receives the squared radius a^2. `w` and
    `p` (entries or 1, nodes) receive the last profiles, times root_weights. Begins with the rigid sphere, whose
    Phi_F/mu = pi F_{5/2}(-X)/5 and Phi_A = pi F_2(-X)/2 are the limits as mu goes to 0.
    """
    v, root_weights, modes = basis.v, basis.root_weights, basis.modes
    n = v.size
    covered = np.empty(n)
    for entry in range(X.size):
        profile = min(entry, w.shape[0] - 1)
        wi, pi = w[profile], p[profile]
        wi[:] = 0.0
        pi[:] = 0.0
        steps[entry] = 0
        deepest = f_two(-X[entry])
        phi[entry, 0] = math.pi / 5.0 * f_five_halves(-X[entry])
        phi[entry, 1] = math.pi / 2.0 * deepest
        phi[entry, 2] = ROUNDING if deepest > 0.0 else 0.0
        squared = extent_squared(X[entry], mu[entry], 0.03 * rtol) if deepest > TINY else 1.0
        extent[entry] = squared
        if mu[entry] * f_half(-X[entry]) * (1.0 + squared) < NEGLIGIBLE:
            for i in range(n):
                pi[i] = 0.5 * f_three_halves(squared * v[i] - X[entry]) * root_weights[i]
            continue
        if n >= MIN_COARSE_RATIO * coarse.v.size:
            steps[entry] += coarse_start(X[entry], mu[entry], squared, coarse, modes, wi)
        while True:
            used, left = newton_steps(X[entry], mu[entry], squared, basis, 0.01 * rtol, wi, pi)
            steps[entry] += used
            for i in range(n):
                gap = squared * v[i] - X[entry] + wi[i] / root_weights[i]
                covered[i] = f_one(gap) * root_weights[i]
            force = _sum(pi, root_weights)
            area = _sum(covered, root_weights)
            edge = squared - X[entry] + wi[n - 1] / root_weights[n - 1]
            # what lies outside a, for pressure and area as they decay over a rigid sphere
            cut = max(f_five_halves(edge) / (5.0 * force), f_two(edge) / (2.0 * area)) / squared
            if not 12.0 * cut > rtol:
                break
            # hard contact lifts the middle more than expected: widen
            squared += 1.0
        discrete = max(_unresolved(modes, pi, force), _unresolved(modes, covered, area))
        extent[entry] = squared
        phi[entry, 0] = math.pi * squared * force
        phi[entry, 1] = math.pi * squared * area
        phi[entry, 2] = 8.0 * (discrete + cut) + left + ROUNDING
