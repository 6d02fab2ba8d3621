"""Closed forms of Phi_F(X, mu) and Phi_A(X, mu) in three sizes, fitted to exact solves and certified on others.

The rigid sphere, (pi/5) F_{5/2}(-X) and (pi/2) F_2(-X), is approximated with powers and exp alone,

    F_n(-X) = (X + 3)^n exp(a_1 w + a_2 w^2 + ...),   w = 1/(X + 3),

which tends to X^n as X grows, as it must; the exponent is smooth where X + 3 is positive. What the rigid sphere is
divided by is fitted in `terms`.
"""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np
import sympy

from generate.formulas.fit import DATA_DIGITS, MAX_DIGITS, certificate, fewest_digits, least_largest, rounded
from generate.formulas.printing import Form, Function, Step, evaluate, needed
from generate.formulas.terms import FORCE, Fit, Samples, fit
from mbma_tables.common.arguments import FloatArray
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.height_integrals import height_integral

SOLVED = 1e-10
MIN_MU, MAX_MU = 1e-6, 2e3
MAX_X = 25.0
POINTS, HELD_OUT = 3000, 20_000
FIT_SEED, HELD_OUT_SEED = 31, 32
GRID = 300  # a side, of the check that both rise with X
SLACK = 1.02  # what rounding may add to the largest error
TRIES = ((9, 6), (24, 1))  # shapes that move freely, up to that many terms
NAMES = ("phi_F", "phi_A")
X, MU = sympy.symbols("X mu")

RIGID_ORDERS = (sympy.Rational(5, 2), sympy.Integer(2))
RIGID_FACTORS = (sympy.pi / 5, sympy.pi / 2)
RIGID_SHIFT = 3
RIGID_RANGE = (-0.5, 60.0)  # X
RIGID_POINTS = 3000


@dataclasses.dataclass(frozen=True)
class Size:
    """What a form is made with: terms of both functions, least X, accuracy of the rigid sphere."""

    terms: tuple[int, int]
    min_X: float
    rigid: float


SIZES = {
    "pocket": Size((6, 7), 0.8, 3e-3),
    "standard": Size((20, 20), 0.0, 1e-3),
    "long": Size((40, 50), 0.0, 1e-4),
}


@functools.cache
def rigid_polynomial(which: int, accuracy: float) -> tuple[tuple[float, ...], float]:
    """Coefficients of w, w^2, ... as few and as short as `accuracy` needs, and their largest held-out error."""
    order = float(RIGID_ORDERS[which])

    def samples(count: int) -> tuple[FloatArray, FloatArray]:
        low, high = RIGID_RANGE
        w = np.linspace(1 / (low + RIGID_SHIFT), 1 / (high + RIGID_SHIFT), count)
        return w[:, None], np.log(height_integral(order, RIGID_SHIFT - 1 / w)) + order * np.log(w)

    (w, target), (other, truth) = samples(RIGID_POINTS), samples(3 * RIGID_POINTS + 1)
    for degree in range(2, 16):
        powers = np.arange(1, degree + 1)
        error, found = least_largest(w**powers, rounded(target, DATA_DIGITS))
        if error > accuracy:
            continue
        for digits in range(3, MAX_DIGITS):
            short = rounded(found, digits)
            remaining = float(np.abs(other**powers @ short - truth).max())
            if remaining <= accuracy:
                return tuple(short.tolist()), math.expm1(remaining)
    raise ValueError(f"no polynomial reaches {accuracy:g}")


def rigid_steps(which: int, accuracy: float) -> list[Step]:
    """Steps of the rigid sphere for X in [-0.5, 60]."""
    w, p = sympy.symbols("w p")
    exponent: sympy.Expr = sympy.Integer(0)
    for value in reversed(rigid_polynomial(which, accuracy)[0]):
        exponent = (sympy.Float(value) + exponent) * w
    base = X + RIGID_SHIFT
    sphere = RIGID_FACTORS[which] * base ** RIGID_ORDERS[which] * sympy.exp(p)
    return [(w.name, 1 / base), (p.name, exponent), ("rigid", sphere)]


def points(count: int, min_X: float, seed: int) -> tuple[FloatArray, FloatArray]:
    """Random X and mu of the range, a twelfth of them on each of its edges but mu -> 0, and its corners."""
    rng = np.random.default_rng(seed)
    x = (min_X + 2) * ((MAX_X + 2) / (min_X + 2)) ** rng.uniform(size=count) - 2
    mu = np.exp(rng.uniform(math.log(MIN_MU), math.log(MAX_MU), count))
    share = count // 12
    x[:share], x[share : 2 * share], mu[2 * share : 3 * share] = min_X, MAX_X, MAX_MU
    # corners, where fits are worst
    x[-4:], mu[-4:] = [min_X, MAX_X] * 2, [MIN_MU] * 2 + [MAX_MU] * 2
    return rounded(np.clip(x, min_X, MAX_X), DATA_DIGITS), rounded(mu, DATA_DIGITS)


@functools.cache
def solved(count: int, min_X: float, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """X, mu and log(Phi/Phi_rigid), (2, points), of exact solves."""
    x, mu = points(count, min_X, seed)
    found = greenwood_tripp.solve(x, mu, rtol=SOLVED)
    log_ratio = np.log(np.stack([found.phi_F, found.phi_A]) / greenwood_tripp.rigid_sphere(x, mu))
    return x, mu, rounded(log_ratio, DATA_DIGITS)


@functools.cache
def fitted(which: int, count: int, min_X: float) -> Fit:
    """The fit of `count` terms."""
    x, mu, log_ratio = solved(POINTS, min_X, FIT_SEED)
    tries = next((n for most, n in TRIES if count <= most), 0)
    return fit(Samples.of(which, x, mu, log_ratio[which]), count, tries)


def function_steps(found: Fit, rigid: float, digits: int) -> tuple[Step, ...]:
    """Steps of one function, its coefficients with that many digits."""
    u, y, t, z, v, log_Q, rigid_sphere = sympy.symbols("u y t z v log_Q rigid")
    named = {"t": t, "z": z, "v": v}
    c, b, g = map(sympy.Float, found.shape)
    total = sympy.Add(
        *(
            sympy.Float(value) * u**i * named[name] ** j
            for (i, name, j), value in zip(found.terms, rounded(found.coefficients, digits).tolist(), strict=True)
        )
    )
    if found.which == FORCE:
        top, limit = MU * rigid_sphere, 3 * sympy.sqrt(2) * sympy.pi / 20 * (X + 1)
    else:
        top, limit = rigid_sphere, sympy.cbrt(2 * sympy.pi**2) / 3 * (X + 1) / sympy.cbrt(1 + MU * (X + 1))
    steps = [
        *rigid_steps(found.which, rigid),
        (u.name, 1 / (X + c)),
        (y.name, b * MU * (X + c)),
        (t.name, sympy.log(1 + y)),
        (z.name, 1 / (1 + sympy.sqrt(y))),
        (v.name, sympy.log(1 + g * MU * sympy.sqrt(u))),
        (log_Q.name, total),
        (NAMES[found.which], top / (1 + MU * limit * sympy.exp(log_Q))),
    ]
    return needed(steps)


def relative_error(steps: tuple[Step, ...], which: int, count: int, min_X: float, seed: int) -> FloatArray:
    """Relative error of one function at solved points, (count,)."""
    x, mu, log_ratio = solved(count, min_X, seed)
    exact = np.exp(log_ratio[which]) * greenwood_tripp.rigid_sphere(x, mu)[which]
    error: FloatArray = np.abs(evaluate(steps, {"X": x, "mu": mu})[NAMES[which]] / exact - 1)
    return error


def rises(steps: tuple[Step, ...], result: str, min_X: float) -> bool:
    """Whether a function is positive and rises with X, on a grid of the range."""
    x, mu = np.meshgrid(np.linspace(min_X, MAX_X, GRID), np.geomspace(MIN_MU, MAX_MU, GRID), indexing="ij")
    field = evaluate(steps, {"X": x, "mu": mu})[result]
    return bool((field > 0).all() and (np.diff(field, axis=0) > 0).all())


def island_form(name: str) -> Form:
    """One form with its certificates."""
    size = SIZES[name]
    functions, certificates = [], {}
    for which, result in enumerate(NAMES):
        found = fitted(which, size.terms[which], size.min_X)

        def largest(digits: int, found: Fit = found) -> float:
            steps = function_steps(found, size.rigid, digits)
            return float(relative_error(steps, found.which, POINTS, size.min_X, FIT_SEED).max())

        steps = function_steps(found, size.rigid, fewest_digits(largest, SLACK))
        if not rises(steps, result, size.min_X):
            raise RuntimeError(f"{result} of the {name} form does not rise with X everywhere")
        error = relative_error(steps, which, HELD_OUT, size.min_X, HELD_OUT_SEED)
        x, mu, _ = solved(HELD_OUT, size.min_X, HELD_OUT_SEED)
        certificates[result] = certificate(found.length, error, {"X": x, "mu": mu})
        title = f"{result.replace('phi', 'Phi')}, {name} form: within {certificates[result].largest:g}."
        functions.append(Function(name, result, ("X", "mu"), title, steps))
    return Form(name, {"X": (size.min_X, MAX_X), "mu": (0.0, MAX_MU)}, tuple(functions), certificates)
