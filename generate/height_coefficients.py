"""Compute the polynomial pieces of the height integrals with mpmath.

``python -m generate tables heights`` writes ``mbma_tables/core/height_coefficients.h``
again; the output is the same on every machine.
"""

import functools
import itertools
import pathlib
import re
from collections.abc import Callable

import mpmath
import numpy as np
from mpmath import mpf
from numpy.polynomial import chebyshev

from mbma_tables.common.files import write_file

TARGET = (
    pathlib.Path(__file__).parents[1] / "mbma_tables" / "core" / "height_coefficients.h"
)
HEADER = """\
/* Height integrals as polynomials. Made by python -m generate tables heights.
 *
 * F_{3/2}, then F_{5/2} from 0 on and F_{1/2} below, in [0, 1], [1, 4], [4, 40], below -8, [-8, -6] ... [-2, 0]; F_1
 * and F_2 from 0 on. Digits of less than 1e-17 of F are left out. */
static const double MBMA_HEIGHT_HALVES[2][8][20] = {
%s
};
static const double MBMA_HEIGHT_WHOLE[2][3][20] = {
%s
};
"""
DIGITS = 40
TERMS = 20  # the hardest piece, F_{5/2} in [0, 1], needs as many for 2e-16
SAMPLES = 48
NOTHING = mpf(10) ** -17  # of the least value of a piece
DEEP_EDGE = -8  # below it: powers of 1/x^2
MIDDLE_EDGES = (-8, -6, -4, -2, 0)  # polynomials in x
SCALED_EDGES = (0, 1, 4, 40)  # polynomials in 1/(x + 1), exp(-x^2/2) taken out


def height_integral(n: mpf, x: mpf) -> mpf:
    """F_n(x) through the parabolic cylinder function U(n + 1/2, x)."""
    scale = mpmath.gamma(n + 1) / mpmath.sqrt(2 * mpmath.pi)
    return scale * mpmath.exp(-x * x / 4) * mpmath.pcfu(n + mpf(1) / 2, x)


def piece(function: Callable[[mpf], mpf], low: mpf, high: mpf) -> list[mpf]:
    """Monomial coefficients in t, for ``function((low + high)/2 + (high - low)/2 t)``, |t| <= 1."""
    angles = [mpmath.pi * (k + mpf(1) / 2) / SAMPLES for k in range(SAMPLES)]
    values = [
        function((low + high) / 2 + (high - low) / 2 * mpmath.cos(a)) for a in angles
    ]
    series = [
        mpmath.fsum(v * mpmath.cos(j * a) for v, a in zip(values, angles, strict=True))
        for j in range(TERMS)
    ]
    return list(chebyshev.cheb2poly(np.array([series[0] / 2, *series[1:]]) * 2 / SAMPLES))


def scaled_pieces(twice_n: int) -> list[list[mpf]]:
    """The polynomial pieces of F_n, n = twice_n / 2, from 0 on, exp(-x^2/2)/(x + 1)^(n + 1) taken out."""
    n = mpf(twice_n) / 2

    def scaled(v: mpf) -> mpf:
        x = 1 / v - 1
        return height_integral(n, x) * mpmath.exp(x * x / 2) / v ** (n + 1)

    return [
        piece(scaled, mpf(1) / (b + 1), mpf(1) / (a + 1))
        for a, b in itertools.pairwise(SCALED_EDGES)
    ]


def lower_pieces(twice_n: int) -> list[list[mpf]]:
    """The polynomial pieces of F_n below 0, from the deep end on."""
    n = mpf(twice_n) / 2

    def deep(s: mpf) -> mpf:
        return (
            height_integral(n, -1 / mpmath.sqrt(s)) * s ** (n / 2)
            if s >= mpf(10) ** -30
            else mpf(1)
        )

    middle = functools.partial(height_integral, n)
    lowest = piece(deep, mpf(0), mpf(1) / DEEP_EDGE**2)
    return [
        lowest,
        *(piece(middle, mpf(a), mpf(b)) for a, b in itertools.pairwise(MIDDLE_EDGES)),
    ]


def row_text(row: list[mpf]) -> str:
    """The coefficients of a piece, each with the digits that count, as an initializer."""
    unit = NOTHING * min(
        abs(mpmath.polyval(row[::-1], t)) for t in mpmath.linspace(-1, 1, 41)
    )
    texts = []
    for value in row:
        digits = (
            int(mpmath.floor(mpmath.log10(abs(value) / unit))) + 1
            if abs(value) > unit
            else 0
        )
        shortest = (
            repr(float(mpmath.nstr(value, digits)) if 0 < digits < 17 else float(value))
            if digits
            else "0.0"
        )
        texts.append(shortest.replace("e-0", "e-"))
    while texts[-1] == "0.0":
        texts.pop()
    return "{" + ",".join(texts) + "}"


def main() -> None:
    with mpmath.workdps(DIGITS):
        halves = [scaled_pieces(3) + lower_pieces(3), scaled_pieces(5) + lower_pieces(1)]
        orders = [
            [[row_text(row) for row in rows] for rows in both]
            for both in (halves, map(scaled_pieces, (2, 4)))
        ]
    parts = (",".join("{" + ",".join(rows) + "}" for rows in both) for both in orders)
    wrapped = ("\n".join(re.findall(r".{1,119}(?:,|$)", part)) for part in parts)
    write_file(TARGET, (HEADER % tuple(wrapped)).encode())
