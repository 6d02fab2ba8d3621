"""Node values of uniform tensor splines to B-spline coefficients; `models.island4d` evaluates them.

On an axis of n equally spaced nodes a spline of odd degree k has n + k - 1 coefficients of cardinal B-splines,
centred at the nodes and at (k - 1)/2 places beyond either end. Interpolation and not-a-knot conditions fix them.
"""

import functools

import numpy as np

from mbma_tables.common.arguments import FloatArray

TAPS = {3: (1 / 6, 4 / 6, 1 / 6), 5: (1 / 120, 26 / 120, 66 / 120, 26 / 120, 1 / 120)}


def padding(degree: int) -> int:
    """Coefficients beyond each end of an axis."""
    return (degree - 1) // 2


@functools.lru_cache(maxsize=32)
def _factors(nodes: int, degree: int) -> tuple[FloatArray, FloatArray]:
    import scipy.linalg
    import scipy.special

    size, pad = nodes + degree - 1, padding(degree)
    matrix = np.zeros((size, size))
    for node in range(nodes):
        matrix[pad + node, node : node + degree] = TAPS[degree]
    order = np.arange(degree + 2)
    # no jump of the degree-th derivative at the first and last inner nodes
    jump = (-1.0) ** order * scipy.special.binom(degree + 1, order)
    for row in range(pad):
        matrix[row, row : row + degree + 2] = jump
        matrix[size - 1 - row, size - degree - 2 - row : size - row] = jump
    factors: tuple[FloatArray, FloatArray] = scipy.linalg.lu_factor(matrix)
    return factors


def coefficients(values: FloatArray, degree: int, axes: int) -> FloatArray:
    """B-spline coefficients over the first axes of `values`, each longer by ``degree - 1``; others are components."""
    import scipy.linalg

    result = np.asarray(values, dtype=np.float64)
    for axis in range(axes):
        moved = np.moveaxis(result, axis, 0)
        nodes, pad = moved.shape[0], padding(degree)
        right = np.zeros((nodes + degree - 1, moved[0].size))
        right[pad : pad + nodes] = moved.reshape(nodes, -1)
        solved = np.empty_like(right)
        # column by column: the sums do not depend on how a library blocks them
        factors = _factors(nodes, degree)
        for column in range(right.shape[1]):
            solved[:, column] = scipy.linalg.lu_solve(factors, right[:, column], check_finite=False)
        result = np.moveaxis(solved.reshape(-1, *moved.shape[1:]), 0, axis)
    return np.ascontiguousarray(result)
