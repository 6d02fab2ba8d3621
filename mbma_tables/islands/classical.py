"""The damped iteration of Greenwood and Tripp (1967), as the paper runs it: the baseline of every comparison.

Rings of equal width, the pressure taken constant over each, the elliptic kernel of Eq. (37) at the rings'
middles, and w <- w + damping (w[p] - w) until nothing changes. It slows down and then diverges as mu grows.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.special

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import njit
from mbma_tables.islands.height_integrals import f_one, f_three_halves
from mbma_tables.islands.newton import extent_squared

GIVEN_UP = 1e12  # a deformation this large is divergence


def ring_matrix(rings: int) -> FloatArray:
    """w at the rings' middles per unit radius a, from pressures on `rings` rings of equal width (Eq. 37)."""
    r = (np.arange(rings) + 0.5) / rings
    t, rho = r[None, :], r[:, None]
    complement = ((t - rho) / (t + rho)) ** 2
    np.fill_diagonal(complement, 1.0)
    matrix: FloatArray = 4 / np.pi * t / (t + rho) * scipy.special.ellipkm1(complement) / rings
    # the midpoint rule across ln|t - rho| is of second order with ln(h/2 pi) in the ring itself
    np.fill_diagonal(matrix, 2 / np.pi * np.log(16 * np.pi * r * rings) / rings)
    return matrix


@njit(cache=True, error_model="numpy", nogil=True)
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
    n = w.size
    w[:] = 0.0
    converged = False
    iterations = 0
    while iterations < max_iterations and not converged:
        iterations += 1
        for i in range(n):
            rho = a * (i + 0.5) / n
            p[i] = 0.5 * mu * f_three_halves(rho * rho - X + w[i])
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
        if not scale < GIVEN_UP:
            break
        converged = largest <= tolerance * damping * scale
    force = 0.0
    area = 0.0
    for i in range(n):
        rho = a * (i + 0.5) / n
        gap = rho * rho - X + w[i]
        p[i] = 0.5 * mu * f_three_halves(gap)
        force += rho * p[i]
        area += rho * f_one(gap)
    width = 2.0 * math.pi * a / n
    return iterations, converged, width * force, width * area


def solve_classical(
    X: float, mu: float, rings: int, damping: float, rtol: float, max_iterations: int
) -> tuple[int, bool, float, float, FloatArray, FloatArray, FloatArray]:
    """One island; returns iterations, converged, Phi_F, Phi_A, rho, pressure, gap."""
    a = math.sqrt(extent_squared(X, mu, 0.03 * rtol))
    w, p = np.zeros(rings), np.zeros(rings)
    rho = a * (np.arange(rings) + 0.5) / rings
    steps, converged, force, area = iterate(X, mu, a, ring_matrix(rings), damping, rtol, max_iterations, w, p)
    return steps, converged, force, area, rho, p, rho**2 - X + w
