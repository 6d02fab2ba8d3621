"""Spectral form of the elastic half-space under an axisymmetric pressure (Eq. 37).

With v = (rho/a)^2 on [0, 1] and shifted Legendre polynomials, the Abel transform of the
k-th polynomial is sin((2k+1) psi)/(2k+1) at s = a cos(psi), and Eq. (37) is two Abel
transforms in a row. Its Galerkin matrix is therefore rational, symmetric and positive
definite:

    integral_0^1 P_k w[P_l] dv = (8 a/pi) I_kl / ((2k+1)(2l+1)),
    I_kl = (1/(1 - 4 (k-l)^2) - 1/(1 - 4 (k+l+1)^2)) / 2
"""

import functools
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from mbma_tables.common.arguments import FloatArray


class Basis(NamedTuple):
    """Gauss nodes on [0, 1] and the half-space operator in them, for one node count."""

    v: FloatArray  # Gauss nodes in v = (rho/a)^2
    # square roots of their weights; vectors of the solver are values times these
    root_weights: FloatArray
    modes: FloatArray  # row k maps such a vector to its k-th orthonormal Legendre coefficient
    operator: (
        FloatArray  # w = a * operator @ p in such vectors; symmetric, positive definite
    )


def gauss_legendre(n: int) -> tuple[FloatArray, FloatArray]:
    """Gauss nodes and weights on [0, 1], relative accuracy of a few n eps at the ends too.

    numpy and scipy form 1 - x^2 from a rounded x and lose up to five digits of the end
    weights, which the pressure at an island's edge needs. Here t = 1 - x is the unknown,
    and the recurrence is of differences of polynomials.
    """
    theta = np.pi * (4 * np.arange(1, (n + 1) // 2 + 1) - 1) / (4 * n + 2)
    t = 2 * np.sin(theta / 2) ** 2

    def polynomials(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        value = 1 - t
        previous = np.ones_like(t)
        difference = -t
        for k in range(1, n):
            difference = (k * difference - (2 * k + 1) * t * value) / (k + 1)
            previous = value
            value = value + difference
        return value, previous

    for _ in range(6):
        value, previous = polynomials(t)
        t = t + value * t * (2 - t) / (n * (previous - (1 - t) * value))
    _, previous = polynomials(t)
    half_weights = t * (2 - t) / (n * previous) ** 2
    mirrored = slice(None, n - len(t)) if n % 2 == 0 else slice(None, -1)
    nodes = np.concatenate([t / 2, 1 - t[mirrored][::-1] / 2])
    weights = np.concatenate([half_weights, half_weights[mirrored][::-1]])
    return nodes, weights / weights.sum()


@functools.lru_cache(maxsize=64)
def basis(nodes: int) -> Basis:
    """The basis of `nodes` Gauss points; computed once, read-only."""
    v, weights = gauss_legendre(nodes)
    k = np.arange(nodes)
    odd = 2.0 * k + 1
    overlap = (
        1 / (1 - 4.0 * (k[:, None] - k) ** 2) - 1 / (1 - 4.0 * (k[:, None] + k + 1) ** 2)
    ) / 2
    galerkin = 8 / np.pi * overlap / np.sqrt(np.outer(odd, odd))
    return made(v, weights, legendre.legvander(2 * v - 1, nodes - 1), odd, galerkin)


def made(
    v: FloatArray, weights: FloatArray, values: Any, odd: Any, galerkin: FloatArray
) -> Basis:
    """The basis of polynomials at the nodes, with their Galerkin matrix when they are orthonormal."""
    root_weights = np.sqrt(weights)
    modes = (values * root_weights[:, None] * np.sqrt(odd)).T
    # order of summation independent of BLAS and threads, so that tables are reproducible
    half = np.einsum("ki,kl->il", modes, galerkin)
    operator = np.einsum("il,lj->ij", half, modes)
    found = Basis(v, root_weights, modes, (operator + operator.T) / 2)
    for array in found:
        array.setflags(write=False)
    return found
