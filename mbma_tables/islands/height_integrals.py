"""Height integrals of Gaussian summits, F_n(x) = integral_x^inf (z - x)^n phi(z) dz.

phi is the standard normal density; n = 1/2, 1, 3/2, 2, 5/2. Eqs. (36) and (38) of the paper are F_{3/2}
and F_1; F_{5/2} and F_2 are their integrals over a rigid sphere.

Each F_n is eight polynomial pieces (`generate/tables/height_coefficients.py`), accurate to 1e-13 relative for x <= 10
and to 5e-13 up to 37. They are made here because scipy's parabolic cylinder functions lose five digits near x = -6 and
seven near 6 and answer NaN at -100, and because compiled code calls them. Arrays are answered in numpy.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import FloatArray, finite_array
from mbma_tables.compiled import njit
from mbma_tables.errors import InputError
from mbma_tables.files import shipped_file

ORDERS = (0.5, 1.0, 1.5, 2.0, 2.5)

BLOCK = 1 << 14  # entries held at once

_COEFFICIENTS = np.loadtxt(shipped_file("height_coefficients.csv"), delimiter=",").reshape(len(ORDERS), 8, 19)
_HALF, _ONE, _THREE_HALVES, _TWO, _FIVE_HALVES = _COEFFICIENTS


@njit(cache=True, fastmath={"contract"}, error_model="numpy")
def _locate(x: float) -> tuple[int, float, float, float]:
    """Row of the piece that holds x, its polynomial variable in [-1, 1], and factor = base^n * weight."""
    if x < -8.0:
        return 0, 128.0 / (x * x) - 1.0, -x, 1.0
    if x < -6.0:
        return 1, x + 7.0, 1.0, 1.0
    if x < -4.0:
        return 2, x + 5.0, 1.0, 1.0
    if x < -2.0:
        return 3, x + 3.0, 1.0, 1.0
    if x < 0.0:
        return 4, x + 1.0, 1.0, 1.0
    if x > 40.0:
        return 7, 0.0, 0.0, 0.0
    v = 1.0 / (x + 1.0)
    # x^2/2 in two parts, so that a rounded square costs no digits where exp is steep
    head = float(np.float32(x))
    weight = math.exp(-0.5 * head * head) * math.exp(-0.5 * (x - head) * (x + head)) * v
    if x < 1.0:
        return 5, 4.0 * v - 3.0, v, weight
    if x < 4.0:
        return 6, (v - 0.35) * (1.0 / 0.15), v, weight
    low = 1.0 / 41.0
    return 7, (2.0 * v - (0.2 + low)) / (0.2 - low), v, weight


@njit(cache=True, fastmath={"contract"}, error_model="numpy")
def _horner(row: FloatArray, t: float) -> float:
    value: float = row[18]
    for k in range(17, -1, -1):
        value = value * t + row[k]
    return value


@njit(cache=True, error_model="numpy")
def f_half(x: float) -> float:
    """F_{1/2}(x), compiled."""
    piece, t, base, weight = _locate(x)
    return _horner(_HALF[piece], t) * (math.sqrt(base) * weight)


@njit(cache=True, error_model="numpy")
def f_one(x: float) -> float:
    """F_1(x), compiled."""
    piece, t, base, weight = _locate(x)
    return _horner(_ONE[piece], t) * (base * weight)


@njit(cache=True, error_model="numpy")
def f_three_halves(x: float) -> float:
    """F_{3/2}(x), compiled."""
    piece, t, base, weight = _locate(x)
    return _horner(_THREE_HALVES[piece], t) * (base * (math.sqrt(base) * weight))


@njit(cache=True, error_model="numpy")
def f_two(x: float) -> float:
    """F_2(x), compiled."""
    piece, t, base, weight = _locate(x)
    return _horner(_TWO[piece], t) * (base * base * weight)


@njit(cache=True, error_model="numpy")
def f_five_halves(x: float) -> float:
    """F_{5/2}(x), compiled."""
    piece, t, base, weight = _locate(x)
    return _horner(_FIVE_HALVES[piece], t) * (base * base * math.sqrt(base) * weight)


@njit(cache=True, error_model="numpy")
def pressure_integrals(x: float) -> tuple[float, float]:
    """(F_{3/2}(x), F_{1/2}(x)) in one pass: a pressure and, up to -3/2, its derivative."""
    piece, t, base, weight = _locate(x)
    root = math.sqrt(base) * weight
    return _horner(_THREE_HALVES[piece], t) * (base * root), _horner(_HALF[piece], t) * root


@np.errstate(under="ignore")
def integrals(n: float, x: FloatArray) -> FloatArray:
    """F_n of flat x in numpy; the arithmetic of `_locate` and `_horner`."""
    piece = np.searchsorted((-8.0, -6.0, -4.0, -2.0, 0.0, 1.0, 4.0), x, side="right")
    light, far = np.clip(x, 0.0, 41.0), np.minimum(x, -8.0)
    v = 1.0 / (light + 1.0)
    head = light.astype(np.float32).astype(float)
    weight = np.exp(-0.5 * head * head) * np.exp(-0.5 * (light - head) * (light + head)) * v
    low = 1.0 / 41.0
    places = (
        128.0 / far / far - 1.0, x + 7.0, x + 5.0, x + 3.0, x + 1.0,
        4.0 * v - 3.0, (v - 0.35) * (1.0 / 0.15), (2.0 * v - (0.2 + low)) / (0.2 - low),
    )  # fmt: skip
    t = np.choose(piece, places)
    base = np.where(piece == 0, -far, np.where(piece < 5, 1.0, v))
    weight = np.where(piece < 5, 1.0, np.where(x > 40.0, 0.0, weight))
    pieces = _COEFFICIENTS[ORDERS.index(n)].T[:, piece]
    value = pieces[18]
    for k in range(17, -1, -1):
        value = value * t + pieces[k]
    return np.asarray(value * base**n * weight)


def height_integral(n: float, x: ArrayLike) -> Any:
    """F_n(x) = integral_x^inf (z - x)^n phi(z) dz for n = 1/2, 1, 3/2, 2 or 5/2.

    Parameters
    ----------
    n : float
        The order, one of `ORDERS`.
    x : array_like
        Separation over the summits' standard deviation; any finite numbers, any shape.

    Returns
    -------
    numpy.ndarray or numpy.float64
        F_n(x), dimensionless, in the shape of `x`. Beyond x = 38 it underflows smoothly to zero.

    Raises
    ------
    InputError
        If `n` is not one of `ORDERS` or `x` holds NaN or infinity.

    Examples
    --------
    >>> from mbma_tables import height_integral
    >>> height_integral(1.5, [-1.0, 0.0, 1.0]).round(6)
    array([1.404597, 0.43002 , 0.075668])
    """
    if n not in ORDERS:
        raise InputError(f"n must be one of {ORDERS}, got {n!r}")
    argument = finite_array("x", x)
    flat = argument.ravel()
    blocks = [integrals(n, flat[k : k + BLOCK]) for k in range(0, flat.size, BLOCK)]
    return np.concatenate(blocks).reshape(argument.shape)[()]
