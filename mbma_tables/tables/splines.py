"""Node values of uniform tensor splines to B-spline coefficients; `tables.island4d` evaluates them.

On an axis of n equally spaced nodes a spline of odd degree k has n + k - 1 coefficients of cardinal
B-splines, centred at the nodes and at (k - 1)/2 places beyond either end. Interpolation and
not-a-knot conditions fix them.
"""

import numpy as np
import scipy.linalg
import scipy.special

from mbma_tables.common.arguments import FloatArray

# values of the cardinal B-spline of each degree at its nodes
TAPS = {
    3: (1 / 6, 4 / 6, 1 / 6),
    5: (1 / 120, 26 / 120, 66 / 120, 26 / 120, 1 / 120),
}


def padding(degree: int) -> int:
    """Coefficients beyond each end of an axis."""
    return (degree - 1) // 2


def conditions(nodes: int, degree: int) -> FloatArray:
    """Matrix of the conditions: not-a-knot at both ends, and the values at the nodes between."""
    size = nodes + degree - 1
    pad = padding(degree)
    matrix = np.zeros((size, size))
    for node in range(nodes):
        matrix[pad + node, node : node + degree] = TAPS[degree]
    # no jump of the degree-th derivative at the first and last inner nodes
    order = np.arange(degree + 2)
    jump = (-1.0) ** order * scipy.special.binom(degree + 1, order)
    for row in range(pad):
        matrix[row, row : row + degree + 2] = jump
        matrix[size - 1 - row, size - degree - 2 - row : size - row] = jump
    return matrix


def coefficients(values: FloatArray, degree: int, axes: int) -> FloatArray:
    """B-spline coefficients over the first axes of `values`; others are components.

    Each of these axes is longer by ``degree - 1``.
    """
    result = np.asarray(values, dtype=np.float64)
    pad = padding(degree)
    for axis in range(axes):
        moved = np.moveaxis(result, axis, 0)
        nodes = moved.shape[0]
        factors = scipy.linalg.lu_factor(conditions(nodes, degree))
        solved = np.zeros((nodes + degree - 1, moved[0].size))
        solved[pad : pad + nodes] = moved.reshape(nodes, -1)
        # column by column: the sums do not depend on how a library blocks them
        for column in range(solved.shape[1]):
            right_side = solved[:, column]
            solved[:, column] = scipy.linalg.lu_solve(
                factors, right_side, check_finite=False
            )
        result = np.moveaxis(solved.reshape(-1, *moved.shape[1:]), 0, axis)
    return np.ascontiguousarray(result)
