"""The paper's own method for an island, which docs/cost.md compares with: the damped iteration of Greenwood and Tripp.

Rings of equal width, the pressure taken constant over each, and w <- w + damping (w[p] - w) until nothing changes
(Eqs. 34, 36, 37). It slows down and then diverges as mu grows.
"""

import math

import numpy as np
from scipy.special import ellipkm1

from mbma_tables.common.arguments import FloatArray
from mbma_tables.core import core

DAMPING, MAX_STEPS, MAX_DEFORMATION = 0.1, 5000, 1e12  # a larger deformation is divergence


def ring_matrix(rings: int) -> FloatArray:
    """w at the rings' middles per unit radius a, from pressures on `rings` rings of equal width (Eq. 37)."""
    r = (np.arange(rings) + 0.5) / rings
    t, rho = r[None, :], r[:, None]
    complement = ((t - rho) / (t + rho)) ** 2
    np.fill_diagonal(complement, 1.0)
    matrix: FloatArray = 4 / np.pi * t / (t + rho) * ellipkm1(complement) / rings
    # the midpoint rule across ln|t - rho| is of second order with ln(h/2 pi) in the ring itself
    np.fill_diagonal(matrix, 2 / np.pi * np.log(16 * np.pi * r * rings) / rings)
    return matrix


@np.errstate(all="ignore")
def iterated(X: float, mu: float, matrix: FloatArray, tolerance: float) -> tuple[int, bool, float, float]:
    """Iterations from w = 0, whether they converged, Phi_F and Phi_A, NaN where they diverged."""
    squared, w = np.empty(1), np.zeros(len(matrix))
    core.island_extents(np.array([X]), np.array([mu]), 0.03 * tolerance, squared)
    a, loads = math.sqrt(squared[0]), np.empty(w.size)
    rho, steps, converged = a * (np.arange(w.size) + 0.5) / w.size, 0, False
    while not converged and steps < MAX_STEPS:
        core.height_integrals(3, rho**2 - X + w, loads)
        change = DAMPING * (a * (matrix @ (mu / 2 * loads)) - w)
        w += change
        steps, scale = steps + 1, np.abs(w).max()
        if not scale < MAX_DEFORMATION:
            return steps, False, math.nan, math.nan
        converged = bool(np.abs(change).max() <= tolerance * DAMPING * scale)
    sums = []
    for twice_n, strength in ((3, mu / 2), (2, 1.0)):
        core.height_integrals(twice_n, rho**2 - X + w, loads)
        sums.append(float(2 * np.pi * a / w.size * strength * (rho @ loads)))
    return steps, converged, sums[0], sums[1]
