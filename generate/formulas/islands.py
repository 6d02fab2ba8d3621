"""Closed forms of Phi_F(X, mu) and Phi_A(X, mu) in three sizes, fitted to exact solves and certified on others.

The fit is `formula_terms`, the rigid sphere `formula_heights`; here are the samples, the text and the certificate,
which is measured on the text itself: what is printed is what is certified.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import Any

import numpy as np

from generate.formulas import heights as formula_heights
from generate.formulas.terms import AREA, FORCE, HERTZ, Fit, Samples, Term, fit
from mbma_tables.arguments import FloatArray
from mbma_tables.formulas.expressions import evaluate_steps
from mbma_tables.islands import greenwood_tripp

SOLVED = 1e-10
LEAST_MU, MOST_MU = 1e-6, 2e3
HIGHEST_X = 25.0
POINTS, HELD_OUT = 3000, 20_000
FIT_SEED, HELD_OUT_SEED = 31, 32
GRID = 300  # a side, of the check that both rise with X
SLACK = 1.02  # what rounding may add to the largest error
MOST_DIGITS = 15
TRIES = ((9, 6), (24, 1))  # shapes that move freely, up to that many terms
NAMES = ("phi_F", "phi_A")
LETTERS = "FA"

Form = dict[str, Any]


@dataclasses.dataclass(frozen=True)
class Size:
    """What a form is made with: terms of both functions, range of X, accuracy of the rigid sphere."""

    title: str
    terms: tuple[int, int]
    lowest_X: float
    heights: float


SIZES = {
    "pocket": Size("islands, pocket form", (6, 7), 0.8, 3e-3),
    "standard": Size("islands, standard form", (20, 20), 0.0, 1e-3),
    "long": Size("islands, long form", (40, 50), 0.0, 1e-4),
}


def points(count: int, lowest_X: float, seed: int) -> tuple[FloatArray, FloatArray]:
    """Random X and mu of the range, a twelfth of them on each of its edges but mu -> 0, and its corners."""
    rng = np.random.default_rng(seed)
    X = (lowest_X + 2) * ((HIGHEST_X + 2) / (lowest_X + 2)) ** rng.uniform(size=count) - 2
    mu = np.exp(rng.uniform(math.log(LEAST_MU), math.log(MOST_MU), count))
    share = count // 12
    X[:share], X[share : 2 * share], mu[2 * share : 3 * share] = lowest_X, HIGHEST_X, MOST_MU
    # corners, where fits are worst
    X[-4:], mu[-4:] = [lowest_X, HIGHEST_X] * 2, [LEAST_MU] * 2 + [MOST_MU] * 2
    return np.clip(X, lowest_X, HIGHEST_X), mu


@functools.cache
def solved(count: int, lowest_X: float, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """X, mu and log(Phi/Phi_rigid), (2, points), of exact solves."""
    X, mu = points(count, lowest_X, seed)
    found = greenwood_tripp.solve(X, mu, rtol=SOLVED)
    return X, mu, np.log(np.stack([found.phi_F, found.phi_A]) / greenwood_tripp.rigid_sphere(X, mu))


@functools.cache
def fitted(which: int, count: int, lowest_X: float) -> Fit:
    """The fit of `count` terms."""
    X, mu, log_ratio = solved(POINTS, lowest_X, FIT_SEED)
    return fit(Samples.of(which, X, mu, log_ratio[which]), count, next((n for most, n in TRIES if count <= most), 0))


def _product(term: Term, letter: str) -> str:
    """A term as text, "1" for none."""
    power, name, j = term
    factors = [f"u_{letter}" if power == 1 else f"u_{letter}**{power}"] if power else []
    if j:
        factors.append(f"{name}_{letter}" if j == 1 else f"{name}_{letter}**{j}")
    return "*".join(factors) or "1"


def _text(found: Fit, digits: int) -> list[list[str]]:
    """Steps that define log_Q of a fit, coefficients with that many digits."""
    letter = LETTERS[found.which]
    c, b, g = found.shape
    used = {name for _, name, j in found.terms if j}
    steps = [[f"u_{letter}", f"1/(X + {c!r})"]]
    if used & {"t", "z"}:
        steps.append([f"y_{letter}", f"{b!r}*mu*(X + {c!r})"])
    if "t" in used:
        steps.append([f"t_{letter}", f"log(1 + y_{letter})"])
    if "z" in used:
        steps.append([f"z_{letter}", f"1/(1 + sqrt(y_{letter}))"])
    if "v" in used:
        steps.append([f"v_{letter}", f"log(1 + {g!r}*mu*sqrt(u_{letter}))"])
    total = ""
    for term, value in zip(found.terms, formula_heights.rounded(found.coefficients, digits).tolist(), strict=True):
        sign = (" - " if value < 0 else " + ") if total else ("-" if value < 0 else "")
        total += f"{sign}{abs(value)!r}*{_product(term, letter)}"
    if found.which == FORCE:
        limit = f"{HERTZ[FORCE]:.10g}*(X + 1)"
    else:
        limit = f"{HERTZ[AREA]:.10g}*(X + 1)/(1 + mu*(X + 1))**(1/3)"
    steps.append([f"log_Q_{letter}", total])
    top = "mu*rigid_F" if found.which == FORCE else "rigid_A"
    steps.append([NAMES[found.which], f"{top}/(1 + mu*{limit}*exp(log_Q_{letter}))"])
    return steps


def _errors(steps: list[list[str]], X: FloatArray, mu: FloatArray, log_ratio: FloatArray) -> FloatArray:
    """Relative errors of both functions as the text gives them, (2, points)."""
    found = evaluate_steps(steps, {"X": X, "mu": mu}, NAMES)
    exact = np.exp(log_ratio) * greenwood_tripp.rigid_sphere(X, mu)
    errors: FloatArray = np.stack([found[name] for name in NAMES]) / exact - 1
    return errors


def _shortest(name: str) -> list[list[str]]:
    """The steps of a form, constants as short as they may be."""
    size = SIZES[name]
    sample = solved(POINTS, size.lowest_X, FIT_SEED)
    both = [fitted(which, size.terms[which], size.lowest_X) for which in (FORCE, AREA)]
    heights = formula_heights.height_steps(size.heights)

    def largest(digits: tuple[int, int]) -> FloatArray:
        steps = heights + [step for found, places in zip(both, digits, strict=True) for step in _text(found, places)]
        errors: FloatArray = np.abs(_errors(steps, *sample)).max(axis=1)
        return errors

    best = largest((MOST_DIGITS, MOST_DIGITS))
    digits = [
        next(places for places in range(2, MOST_DIGITS + 1) if largest((places, places))[which] <= SLACK * best[which])
        for which in (FORCE, AREA)
    ]
    return heights + [step for found, places in zip(both, digits, strict=True) for step in _text(found, places)]


def rises(steps: list[list[str]], lowest_X: float) -> bool:
    """Whether both functions are positive and rise with X, on a grid of the range."""
    X = np.linspace(lowest_X, HIGHEST_X, GRID)[:, None]
    mu = np.geomspace(LEAST_MU, MOST_MU, GRID)
    X, mu = (np.ascontiguousarray(a) for a in np.broadcast_arrays(X, mu))
    found = evaluate_steps(steps, {"X": X.ravel(), "mu": mu.ravel()}, NAMES)
    fields = [found[name].reshape(GRID, GRID) for name in NAMES]
    return all((field > 0).all() and (np.diff(field, axis=0) > 0).all() for field in fields)


def island_form(name: str) -> Form:
    """One form with its certificate, in the shape of the formula file."""
    size = SIZES[name]
    steps = _shortest(name)
    if not rises(steps, size.lowest_X):
        raise RuntimeError(f"the {name} form does not rise with X everywhere")
    X, mu, log_ratio = solved(HELD_OUT, size.lowest_X, HELD_OUT_SEED)
    errors = np.abs(_errors(steps, X, mu, log_ratio))
    stated: Form = {"points": HELD_OUT}
    for which, function in enumerate(NAMES):
        worst = int(errors[which].argmax())
        stated[function] = {
            "largest": float(f"{errors[which].max():.3g}"),
            "median": float(f"{np.median(errors[which]):.3g}"),
            "worst_at": {"X": float(f"{X[worst]:.4g}"), "mu": float(f"{mu[worst]:.4g}")},
        }
    return {
        "title": size.title,
        "arguments": ["X", "mu"],
        "range": {"X": [size.lowest_X, HIGHEST_X], "mu": [0.0, MOST_MU]},
        "steps": steps,
        "outputs": {name: name for name in NAMES},
        "coefficients": {
            NAMES[which]: fitted(which, size.terms[which], size.lowest_X).length for which in (FORCE, AREA)
        },
        "heights": {
            name: float(f"{formula_heights.height_error(name, size.heights):.3g}") for name in ("rigid_F", "rigid_A")
        },
        "errors": stated,
    }


def island_forms() -> dict[str, Form]:
    """All three forms."""
    return {name: island_form(name) for name in SIZES}


def front(sizes: tuple[int, ...] = (4, 6, 8, 12, 16, 20, 28, 36, 48)) -> list[dict[str, float]]:
    """Coefficients of a function against its largest error on held-out points, X from 0.8 on, heights exact."""
    X, mu, log_ratio = solved(HELD_OUT, 0.8, HELD_OUT_SEED)
    rows = []
    for count in sizes:
        row: dict[str, float] = {"terms": count}
        for which, name in enumerate(NAMES):
            found = fitted(which, count, 0.8)
            held_out = Samples.of(which, X, mu, log_ratio[which])
            error = held_out.columns(found.terms, found.shape) @ found.coefficients - held_out.residual
            row[f"coefficients_{name}"] = found.length
            row[f"error_{name}"] = math.expm1(float(np.abs(error).max()))
        rows.append(row)
    return rows
