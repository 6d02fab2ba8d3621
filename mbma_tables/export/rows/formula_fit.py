"""Formulas of other programs, fitted to rows of a law by a factor and one more number."""

import math
from collections.abc import Callable

import numpy as np

from mbma_tables.common.arguments import FloatArray

# ln t is searched between these: factors of 8,000 either way
LOG_RANGE = (-9.0, 9.0)


def nearest_formula(
    log_formula: Callable[[float], FloatArray], log_values: FloatArray
) -> tuple[float, float, FloatArray]:
    """t and f with the least mean square of log_formula(t) + f - log_values.

    The third result is this difference.
    """
    from scipy.optimize import minimize_scalar

    # the best f is the mean difference, which leaves the variance
    def variance(log_t: float) -> float:
        return float(np.var(log_formula(math.exp(log_t)) - log_values))

    best = minimize_scalar(variance, bounds=LOG_RANGE, method="bounded")
    t = math.exp(best.x)
    shape = log_formula(t)
    log_factor = float(np.mean(log_values - shape))
    return t, log_factor, shape + log_factor - log_values
