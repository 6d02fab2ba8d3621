"""What the fits of islands and of totals share: rounding, the least largest error, and the certificate.

Terms are selected by comparing sums over thousands of samples, whose last digits depend on the processor. The same
terms come out on all of them because samples are rounded to `DATA_DIGITS` first, the systems that are solved on the way
are well conditioned, and scores are compared after rounding to `SCORE_DIGITS`; the first in a fixed order wins a tie.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.models import Certificate

DATA_DIGITS = 10
SCORE_DIGITS = 6
MIN_DIGITS, MAX_DIGITS = 2, 15  # of a printed constant
LAWSON_ROUNDS = 80


def rounded(values: FloatArray, digits: int) -> FloatArray:
    """Values with that many significant digits."""
    flat = [float(f"{value:.{digits}g}") for value in np.ravel(values).tolist()]
    return np.array(flat).reshape(np.shape(values))


def score(error: float) -> float:
    """An error as it is compared with others."""
    return float(f"{error:.{SCORE_DIGITS}g}")


def least_largest(A: FloatArray, target: FloatArray, rounds: int = LAWSON_ROUNDS) -> tuple[float, FloatArray]:
    """Coefficients whose largest error ``|A c - target|`` is least, by Lawson's reweighting; that error and they.

    Examples
    --------
    >>> error, (mean,) = least_largest(np.ones((3, 1)), np.array([0.0, 1.0, 4.0]), 500)
    >>> round(error, 2), round(float(mean), 2)
    (2.0, 2.0)
    """
    weight: Any = np.ones(target.size)
    best = math.inf
    found = np.zeros(A.shape[1])
    for _ in range(rounds):
        root = np.sqrt(weight)
        trial = np.linalg.lstsq(A * root[:, None], target * root, rcond=1e-13)[0]
        error = np.abs(A @ trial - target)
        largest = float(error.max())
        if largest < best:
            best, found = largest, trial
        grown = weight * (error / largest + 1e-3)
        weight = np.maximum(grown / grown.mean(), 1e-6)
    return best, found


def fewest_digits(largest: Callable[[int], float], slack: float) -> int:
    """Digits that constants need for an error of at most `slack` times that of constants in full."""
    allowed = slack * largest(MAX_DIGITS)
    return next(digits for digits in itertools.count(MIN_DIGITS) if largest(digits) <= allowed)


def certificate(coefficients: int, error: FloatArray, given: Mapping[str, FloatArray]) -> Certificate:
    """What held-out relative errors say; the largest is rounded up."""
    worst = int(error.argmax())
    unit = 10.0 ** (math.floor(math.log10(error[worst])) - 2)
    return Certificate(
        coefficients,
        largest=float(f"{math.ceil(error[worst] / unit) * unit:.3g}"),
        median=float(f"{np.median(error):.3g}"),
        points=error.size,
        worst_at={name: float(f"{values[worst]:.4g}") for name, values in given.items()},
    )
