"""The damped iteration of Greenwood and Tripp (1967), as the paper runs it: the baseline of every comparison.

Rings of equal width, the pressure taken constant over each, the elliptic kernel of Eq. (37) at the rings'
middles, and w <- w + damping (w[p] - w) until nothing changes. It slows down and then diverges as mu grows.
"""

from __future__ import annotations

import math

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import njit
from mbma_tables.islands.height_integrals import f_one, f_three_halves
from mbma_tables.islands.newton import extent_squared

MAX_DEFORMATION = 1e12  # one this large is divergence
BLOCK = 1 << 26  # products of a ring and a ring between two looks for Ctrl-C, about 0.1 s


def ring_matrix(rings: int) -> FloatArray:
    """w at the rings' middles per unit radius a, from pressures on `rings` rings of equal width (Eq. 37)."""
    from scipy.special import ellipkm1

    r = (np.arange(rings) + 0.5) / rings
    t, rho = r[None, :], r[:, None]
    complement = ((t - rho) / (t + rho)) ** 2
    np.fill_diagonal(complement, 1.0)
    matrix: FloatArray = 4 / np.pi * t / (t + rho) * ellipkm1(complement) / rings
    # the midpoint rule across ln|t - rho| is of second order with ln(h/2 pi) in the ring itself
    np.fill_diagonal(matrix, 2 / np.pi * np.log(16 * np.pi * r * rings) / rings)
    return matrix


@njit(cache=True, error_model="numpy", nogil=True)
def _steps(
    X: float,
    mu: float,
    a: float,
    matrix: FloatArray,
    damping: float,
    tolerance: float,
    most: int,
    w: FloatArray,
    p: FloatArray,
) -> tuple[int, bool, bool]:
    """At most `most` steps on from `w`; returns their number, whether w converged, and whether it diverged."""
    n = w.size
    for step in range(most):
        for i in range(n):
            rho = a * (i + 0.5) / n
            p[i] = 0.5 * mu * f_three_halves(rho * rho - X + w[i])  # (36)
        largest = 0.0
        scale = 0.0
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += matrix[i, j] * p[j]
            change = damping * (a * total - w[i])
            largest = max(largest, abs(change))
            w[i] += change
            scale = max(scale, abs(w[i]))
        if not scale < MAX_DEFORMATION:
            return step + 1, False, True
        if largest <= tolerance * damping * scale:
            return step + 1, True, False
    return most, False, False


@njit(cache=True, error_model="numpy", nogil=True)
def _totals(X: float, mu: float, a: float, w: FloatArray, p: FloatArray) -> tuple[float, float]:
    """Phi_F and Phi_A by the midpoint rule; fills the pressures `p`."""
    n = w.size
    force = 0.0
    area = 0.0
    for i in range(n):
        rho = a * (i + 0.5) / n
        gap = rho * rho - X + w[i]
        p[i] = 0.5 * mu * f_three_halves(gap)
        force += rho * p[i]
        area += rho * f_one(gap)
    width = 2.0 * math.pi * a / n
    return width * force, width * area


def iterate(
    X: float,
    mu: float,
    a: float,
    matrix: FloatArray,
    damping: float,
    tolerance: float,
    max_iterations: int,
    w: FloatArray,
    p: FloatArray,
) -> tuple[int, bool, float, float]:
    """Iterate from w = 0; returns iterations, whether it converged, Phi_F and Phi_A."""
    w[:] = 0.0
    iterations = 0
    converged = diverged = False
    # compiled code does not look for Ctrl-C: it gets a fraction of a second of work at a time
    block = max(1, BLOCK // w.size**2)
    while iterations < max_iterations and not (converged or diverged):
        most = min(block, max_iterations - iterations)
        used, converged, diverged = _steps(X, mu, a, matrix, damping, tolerance, most, w, p)
        iterations += used
    return iterations, converged, *_totals(X, mu, a, w, p)


def solve_classical(
    X: float, mu: float, rings: int, damping: float, rtol: float, max_iterations: int
) -> tuple[int, bool, float, float, FloatArray, FloatArray, FloatArray]:
    """One island; returns iterations, converged, Phi_F, Phi_A, rho, pressure, gap."""
    a = math.sqrt(extent_squared(X, mu, 0.03 * rtol))
    w, p = np.zeros(rings), np.zeros(rings)
    rho = a * (np.arange(rings) + 0.5) / rings
    steps, converged, force, area = iterate(X, mu, a, ring_matrix(rings), damping, rtol, max_iterations, w, p)
    return steps, converged, force, area, rho, p, rho**2 - X + w
