"""A second discretisation of the island problem, sharing nothing with the library's.

The unknown lives on composite Gauss panels in rho itself. Eq. (37) is integrated with its own elliptic kernel
by product integration: near a collocation point the panel is split there, and t = rho + L y^8 makes the
logarithm harmless. Height integrals come from the trapezoidal rule. Newton uses a general LU.
"""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np
import scipy.interpolate
import scipy.special

NODES = 16  # a panel
STRETCH = 8
NEAR_POINTS = 48
STEP = 0.04  # of the trapezoidal rule; the narrowest integrand, X = 40, has a standard deviation of 0.08


def trapezoidal(n: float, x: np.ndarray) -> np.ndarray:
    """F_n(x), n = 1/2, 3/2: with z = x + u^2 the integrand is even and entire, so this rule is spectral."""
    u = STEP * np.arange(1, math.ceil(math.sqrt(max(0.0, -x.min()) + 9) / STEP))
    density = np.exp(-0.5 * (x[:, None] + u**2) ** 2) / math.sqrt(2 * math.pi)
    return density @ (2 * STEP * u ** round(2 * n + 1))


def first(x: np.ndarray) -> np.ndarray:
    """F_1(x) = phi - x Q, for x > 0 in scaled form."""
    phi = np.exp(-0.5 * x * x) / math.sqrt(2 * math.pi)
    root = math.sqrt(2)
    below = phi - x * scipy.special.ndtr(-x)
    above = phi * (1 - x * math.sqrt(math.pi / 2) * scipy.special.erfcx(np.maximum(x, 0) / root))
    return np.where(x < 0, below, above)


def kernel(rho: np.ndarray, t: np.ndarray, difference: np.ndarray) -> np.ndarray:
    """(4/pi) t/(t + rho) K(k) of Eq. (37), with t - rho given apart for its digits."""
    total = rho + t
    return 4 / math.pi * t / total * scipy.special.ellipkm1((difference / total) ** 2)


def _interpolation(nodes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Values at `at` from values at a panel's nodes, both in [-1, 1]: (..., NODES)."""
    rule = scipy.interpolate.BarycentricInterpolator(nodes, np.eye(nodes.size))
    return rule(at.ravel()).reshape((*at.shape, nodes.size))


@dataclasses.dataclass(frozen=True)
class Panels:
    """Nodes and weights on [0, 1], and w = a * matrix @ p for an outer radius a."""

    rho: np.ndarray
    weights: np.ndarray
    matrix: np.ndarray


@functools.lru_cache(maxsize=4)
def panels(inner: int, outer: int) -> Panels:
    """`inner` panels over the middle half of the radius, `outer` over the rest, where the edge lies."""
    edges = np.concatenate([np.linspace(0, 0.5, inner + 1), np.linspace(0.5, 1, outer + 1)[1:]])
    x, gauss = np.polynomial.legendre.leggauss(NODES)
    middle, half = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / 2
    rho = (middle[:, None] + half[:, None] * x).ravel()
    weights = (half[:, None] * gauss).ravel()
    count = half.size
    home = np.repeat(np.arange(count), NODES)

    apart = np.abs(home[:, None] - home) > 1
    matrix = np.zeros((rho.size, rho.size))
    row, column = np.nonzero(apart)
    matrix[row, column] = weights[column] * kernel(rho[row], rho[column], rho[column] - rho[row])

    y, dy = np.polynomial.legendre.leggauss(NEAR_POINTS)
    y, dy = (y + 1) / 2, dy / 2
    grade, slope = y**STRETCH, STRETCH * y ** (STRETCH - 1) * dy
    for i, own in enumerate(home):
        for panel in range(max(own - 1, 0), min(own + 2, count)):
            low, high = edges[panel], edges[panel + 1]
            start = min(max(rho[i], low), high)
            row = np.zeros(NODES)
            for end in (low, high):
                if end == start:
                    continue
                offset = (end - start) * grade
                t = start + offset
                values = kernel(rho[i], t, (start - rho[i]) + offset) * abs(end - start) * slope
                row += values @ _interpolation(x, (t - middle[panel]) / half[panel])
            matrix[i, panel * NODES : (panel + 1) * NODES] = row
    return Panels(rho, weights, matrix)


def outer_radius(X: float, mu: float) -> float:
    """Where the pressure on a rigid sphere is below 1e-18 of the middle's, softened by mu."""
    middle = trapezoidal(1.5, np.array([-X]))[0]
    least = 1e-18 * middle / (1 + mu * middle)
    low, high = -X, max(-X, 0.0) + 14.0
    for _ in range(60):
        at = (low + high) / 2
        low, high = (at, high) if trapezoidal(1.5, np.array([at]))[0] > least else (low, at)
    return math.sqrt(high + X)


def solve(X: float, mu: float, inner: int, outer: int) -> tuple[float, float]:
    """Phi_F and Phi_A of one island."""
    grid = panels(inner, outer)
    a = outer_radius(X, mu)
    rho = a * grid.rho
    operator = a * grid.matrix
    w = np.zeros_like(rho)
    for _ in range(60):
        gap = rho**2 - X + w
        pressure = mu / 2 * trapezoidal(1.5, gap)
        slope = 0.75 * mu * trapezoidal(0.5, gap)
        step = np.linalg.solve(np.eye(w.size) + operator * slope, operator @ pressure - w)
        w = w + step
        if np.abs(slope * step).max() <= 1e-13 * pressure.max():
            break
    else:
        raise AssertionError(f"no convergence at X = {X}, mu = {mu}")
    gap = rho**2 - X + w
    ring = 2 * math.pi * a * a * grid.rho * grid.weights
    return float(ring @ (mu / 2 * trapezoidal(1.5, gap))), float(ring @ first(gap))
