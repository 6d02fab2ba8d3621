"""Closed approximations of the rigid sphere: (pi/5) F_{5/2}(-X) and (pi/2) F_2(-X), with powers and exp alone.

    F_n(-X) = (X + c)^n exp(a_1 u + a_2 u^2 + ...),   u = 1/(X + c),

tends to X^n as X grows, as it must, and the exponent is smooth where X + c is positive.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from generate.formulas.terms import least_largest
from mbma_tables.arguments import FloatArray
from mbma_tables.islands.height_integrals import height_integral

SHIFT = 3.0
LOW, HIGH = -0.5, 60.0  # X
POINTS = 3000
MOST_DIGITS = 15
Step = list[str]

_FACTORS = {"rigid_F": (2.5, math.pi / 5), "rigid_A": (2.0, math.pi / 2)}


def _points(count: int) -> FloatArray:
    """X, even in u, where the exponent is a polynomial."""
    u = np.linspace(1 / (LOW + SHIFT), 1 / (HIGH + SHIFT), count)
    return 1 / u - SHIFT


def _exponent(order: float, X: FloatArray) -> FloatArray:
    exponent: FloatArray = np.log(height_integral(order, -X)) - order * np.log(X + SHIFT)
    return exponent


def rounded(values: FloatArray, digits: int) -> FloatArray:
    """Values with that many significant digits."""
    return np.array([float(f"{value:.{digits}g}") for value in values])


@functools.cache
def _polynomial(name: str, accuracy: float) -> tuple[tuple[float, ...], float]:
    """Coefficients of u, u^2, ... as few and as short as `accuracy` needs, and their largest error."""
    order, _ = _FACTORS[name]
    X, held_out = _points(POINTS), _points(3 * POINTS + 1)
    target, truth = _exponent(order, X), _exponent(order, held_out)
    for degree in range(2, 16):
        powers = np.arange(1, degree + 1)
        error, found = least_largest((X[:, None] + SHIFT) ** -powers, target)
        if error > accuracy:
            continue
        for digits in range(3, MOST_DIGITS):
            short = rounded(found, digits)
            left = float(np.abs((held_out[:, None] + SHIFT) ** -powers @ short - truth).max())
            if left <= accuracy:
                return tuple(short.tolist()), math.expm1(left)
    raise ValueError(f"no polynomial reaches {accuracy:g}")


def height_error(name: str, accuracy: float) -> float:
    """Largest relative error of `name`, "rigid_F" or "rigid_A", on points that the fit did not see."""
    return _polynomial(name, accuracy)[1]


def height_steps(accuracy: float) -> list[Step]:
    """Steps of rigid_F = (pi/5) F_{5/2}(-X) and rigid_A = (pi/2) F_2(-X), to `accuracy` for X in [-0.5, 60]."""
    steps = [["w", f"1/(X + {SHIFT:g})"]]
    for name, (order, factor) in _FACTORS.items():
        # Horner's scheme, highest power first
        text = ""
        for value in reversed(_polynomial(name, accuracy)[0]):
            text = f"({value!r}{text})*w" if not text else f"({value!r} + {text})*w"
        steps.append([name, f"{factor:.15g}*(X + {SHIFT:g})**{order:g}*exp({text})"])
    return steps
