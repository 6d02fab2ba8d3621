"""Compute the polynomial pieces of the height integrals with mpmath.

``python -m generate tables heights`` writes ``mbma_tables/core/height_coefficients.h`` again; the output is the same
on every machine.
"""

from __future__ import annotations

import itertools
import pathlib
import textwrap
from collections.abc import Callable

import mpmath

from mbma_tables.files import write_file

TARGET = pathlib.Path(__file__).parents[2] / "mbma_tables" / "core" / "height_coefficients.h"
HEADER = """\
/* F_n for n = 1/2, 1, 3/2, 2, 5/2: eight polynomials each. Made by python -m generate tables heights. */
#ifndef MBMA_HEIGHT_COEFFICIENTS_H
#define MBMA_HEIGHT_COEFFICIENTS_H

static const double MBMA_HEIGHT[5][8][19] = {
%s
};

#endif
"""
DIGITS = 40
TERMS = 19  # the hardest piece, [-2, 0], needs 19 for 2e-17
SAMPLES = 48
DEEP_EDGE = -8  # below it: powers of 1/x^2
MIDDLE_EDGES = (-8, -6, -4, -2, 0)  # polynomials in x
SCALED_EDGES = (0, 1, 4, 40)  # polynomials in 1/(x + 1), exp(-x^2/2) taken out

Function = Callable[[mpmath.mpf], mpmath.mpf]


def height_integral(n: mpmath.mpf, x: mpmath.mpf) -> mpmath.mpf:
    """F_n(x) through the parabolic cylinder function U(n + 1/2, x)."""
    half = mpmath.mpf(1) / 2
    scale = mpmath.gamma(n + 1) / mpmath.sqrt(2 * mpmath.pi)
    return scale * mpmath.exp(-x * x / 4) * mpmath.pcfu(n + half, x)


def _on_unit_interval(function: Function, low: mpmath.mpf, high: mpmath.mpf) -> list[mpmath.mpf]:
    """Monomial coefficients in t, for ``function((low + high)/2 + (high - low)/2 t)``, |t| <= 1."""
    angles = [mpmath.pi * (k + mpmath.mpf(1) / 2) / SAMPLES for k in range(SAMPLES)]
    values = [function((low + high) / 2 + (high - low) / 2 * mpmath.cos(a)) for a in angles]
    chebyshev = [
        2 * mpmath.fsum(v * mpmath.cos(j * a) for v, a in zip(values, angles, strict=True)) / SAMPLES
        for j in range(TERMS)
    ]
    chebyshev[0] /= 2
    monomial = [mpmath.mpf(0)] * TERMS
    previous = [mpmath.mpf(1)] + [mpmath.mpf(0)] * (TERMS - 1)
    current = [mpmath.mpf(0), mpmath.mpf(1)] + [mpmath.mpf(0)] * (TERMS - 2)
    for coefficient in chebyshev:
        monomial = [m + coefficient * p for m, p in zip(monomial, previous, strict=True)]
        following = [-p for p in previous]
        for power in range(TERMS - 1):
            following[power + 1] += 2 * current[power]
        previous, current = current, following
    return monomial


def pieces(twice_n: int) -> list[list[mpmath.mpf]]:
    """The polynomial pieces of F_n, n = twice_n / 2, from the deep end to the far tail."""
    n = mpmath.mpf(twice_n) / 2
    far = mpmath.mpf(0)

    def deep(s: mpmath.mpf) -> mpmath.mpf:
        if s < mpmath.mpf(10) ** -30:
            return mpmath.mpf(1)
        return height_integral(n, -1 / mpmath.sqrt(s)) * s ** (n / 2)

    def middle(x: mpmath.mpf) -> mpmath.mpf:
        return height_integral(n, x)

    def scaled(v: mpmath.mpf) -> mpmath.mpf:
        x = 1 / v - 1
        return height_integral(n, x) * mpmath.exp(x * x / 2) / v ** (n + 1)

    rows = [_on_unit_interval(deep, far, mpmath.mpf(1) / DEEP_EDGE**2)]
    for low, high in itertools.pairwise(MIDDLE_EDGES):
        rows.append(_on_unit_interval(middle, mpmath.mpf(low), mpmath.mpf(high)))
    for low, high in itertools.pairwise(SCALED_EDGES):
        rows.append(_on_unit_interval(scaled, mpmath.mpf(1) / (high + 1), mpmath.mpf(1) / (low + 1)))
    return rows


def main() -> None:
    """Write the coefficients."""
    with mpmath.workdps(DIGITS):
        orders = [[[repr(float(value)) for value in row] for row in pieces(k)] for k in (1, 2, 3, 4, 5)]
    rows = ",\n".join("{" + ",\n".join("{" + ", ".join(row) + "}" for row in rows) + "}" for rows in orders)
    text = textwrap.indent("\n".join(textwrap.wrap(rows, 116, break_on_hyphens=False)), "    ")
    write_file(TARGET, (HEADER % text).encode())
