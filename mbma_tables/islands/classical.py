"""The damped iteration of Greenwood and Tripp (1967), as the paper runs it: the baseline of every comparison.

Rings of equal width, the pressure taken constant over each, the elliptic kernel of Eq. (37) at the rings'
middles, and w <- w + damping (w[p] - w) until nothing changes. It slows down and then diverges as mu grows.
"""

from __future__ import annotations

import math

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.core import core

BLOCK = 1 << 26  # products of a ring and a ring between two looks for Ctrl-C, at most about 0.1 s


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
    """Iterate from w = 0; returns iterations, whether it converged, Phi_F and Phi_A, NaN where it diverged."""
    w[:] = 0.0
    phi, used = np.zeros(2), np.zeros(1, dtype=np.int64)
    iterations, converged = 0, False
    # the core does not look for Ctrl-C: it gets a fraction of a second of work at a time
    block = max(1, BLOCK // w.size**2)
    while iterations < max_iterations and not converged and not np.isnan(phi[0]):
        most = min(block, max_iterations - iterations)
        converged = core.damped_steps(X, mu, a, damping, tolerance, most, matrix, w, p, phi, used) == 0
        iterations += int(used[0])
    return iterations, converged, float(phi[0]), float(phi[1])


def radius(X: float, mu: float, rtol: float) -> float:
    """Where an island ends, as far as a relative error `rtol` tells."""
    squared = np.empty(1)
    core.island_extents(np.array([X]), np.array([mu]), 0.03 * rtol, squared)
    return math.sqrt(squared[0])


def solve_classical(
    X: float, mu: float, rings: int, damping: float, rtol: float, max_iterations: int
) -> tuple[int, bool, float, float, FloatArray, FloatArray, FloatArray]:
    """One island; returns iterations, converged, Phi_F, Phi_A, rho, pressure, gap."""
    a = radius(X, mu, rtol)
    w, p = np.zeros(rings), np.zeros(rings)
    rho = a * (np.arange(rings) + 0.5) / rings
    steps, converged, force, area = iterate(X, mu, a, ring_matrix(rings), damping, rtol, max_iterations, w, p)
    return steps, converged, force, area, rho, p, rho**2 - X + w
