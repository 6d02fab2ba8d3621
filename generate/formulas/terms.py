"""Terms of the island forms and their selection: sparse, cross-validated, then of least largest error.

With Phi_rigid the closed form of the rigid sphere, each function is written as

    Phi = Phi_rigid/(1 + mu Q(X, mu)),

right as mu -> 0 whatever Q is. Q is positive by being an exponential; log Q is its own limit at large X, which is the
smooth sphere of Hertz, and a sum of terms that die there. In

    u = 1/(X + c),  y = b mu (X + c),  t = log(1 + y),  z = 1/(1 + sqrt(y)),  v = log(1 + g mu/sqrt(X + c))

these are z^j, u^i t^j, u^i z^j and u^i v^j: at fixed mu, u, z and v fall faster than any power of t grows.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from typing import Any

import numpy as np
from scipy.optimize import minimize
from sklearn.linear_model import OrthogonalMatchingPursuit
from sklearn.model_selection import KFold, cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import MaxAbsScaler

from generate.formulas.fit import least_largest, rounded, score
from mbma_tables.common.arguments import FloatArray

FORCE, AREA = 0, 1
# Phi_rigid mu^-1/(limit of Phi) at large X: (pi/5) X^(5/2) over (4/3) X^(3/2)/sqrt(2), and (pi/2) X^2 over
# (3 pi/8) (3 sqrt(32)/(3 pi))^(2/3) X^(4/3) mu^(-2/3)
HERTZ = (3 * math.sqrt(2) * math.pi / 20, (2 * math.pi**2) ** (1 / 3) / 3)
SHAPES = {"c": (1.5, 2.0, 3.0), "b": (0.5, 1.0, 3.0), "g": (0.3, 1.0, 3.0)}
FOLDS = 5
POLISH, POLISH_ROUNDS, THIN = 100, 30, 3  # trials of Nelder and Mead's, each on every third sample
SEED = 20

Term = tuple[int, str, int]  # power of u; one of t, z, v; its power
Shape = tuple[float, float, float]  # c, b, g


def dictionary(which: int) -> list[Term]:
    """Every term that a fit may choose from."""
    terms: list[Term] = [(0, "z", j) for j in (1, 2, 3)]
    terms += [(i, "t", j) for i in range(1, 7) for j in range(6)]
    terms += [(i, "z", j) for i in range(1, 6) for j in (1, 2, 3)]
    # the area's own limit needs mu << sqrt(X), where v dies by itself
    return terms + [(i, "v", j) for i in range(1 - which, 4) for j in range(1, 5)]


def variables(X: FloatArray, mu: FloatArray, c: float, b: float, g: float) -> dict[str, FloatArray]:
    """The named variables of the terms."""
    y = b * mu * (X + c)
    return {"u": 1 / (X + c), "t": np.log1p(y), "z": 1 / (1 + np.sqrt(y)), "v": np.log1p(g * mu / np.sqrt(X + c))}


def columns(terms: list[Term], named: dict[str, FloatArray]) -> FloatArray:
    """One column a term, (points, terms)."""
    return np.stack([named["u"] ** i * named[name] ** j for i, name, j in terms], axis=1)


def limit_log_Q(which: int, X: FloatArray, mu: FloatArray) -> FloatArray:
    """Log Q at large X."""
    log_Q = np.log(HERTZ[which] * (X + 1))
    result: FloatArray = log_Q - np.log1p(mu * (X + 1)) / 3 if which == AREA else log_Q
    return result


@dataclasses.dataclass(frozen=True)
class Samples:
    """Solved islands of one function: log Q, and how much of an error of log Q is one of log Phi."""

    which: int
    X: FloatArray
    mu: FloatArray
    log_Q: FloatArray
    weight: FloatArray

    @classmethod
    def of(cls, which: int, X: FloatArray, mu: FloatArray, log_ratio: FloatArray) -> Samples:
        """From log(Phi/Phi_rigid)."""
        growth = np.expm1(-log_ratio)
        return cls(which, X, mu, np.log(growth / mu), growth / (1 + growth))

    @property
    def residual(self) -> FloatArray:
        """What the terms must give, weighted."""
        return (self.log_Q - limit_log_Q(self.which, self.X, self.mu)) * self.weight

    def columns(self, terms: list[Term], shape: Shape) -> FloatArray:
        """Weighted columns of some terms."""
        return columns(terms, variables(self.X, self.mu, *shape)) * self.weight[:, None]


@dataclasses.dataclass(frozen=True)
class Fit:
    """Terms and coefficients of log Q of one function, with c, b, g; and its largest error where it was fitted."""

    which: int
    terms: list[Term]
    coefficients: FloatArray
    shape: Shape
    error: float

    @property
    def length(self) -> int:
        """Fitted constants: coefficients and those of c, b, g that a term uses."""
        used = {name for _, name, j in self.terms if j}
        return len(self.terms) + 1 + bool(used & {"t", "z"}) + ("v" in used)


def fit(samples: Samples, count: int, tries: int = 0) -> Fit:
    """A form of `count` terms: shape by cross-validated largest error, terms by matching pursuit.

    With `tries`, c, b and g then move freely from that many of the best shapes, each with its own terms, and the least
    largest error wins.
    """
    every = dictionary(samples.which)
    pursuit: Any = make_pipeline(MaxAbsScaler(), OrthogonalMatchingPursuit(n_nonzero_coefs=count, fit_intercept=False))
    folds = KFold(FOLDS, shuffle=True, random_state=SEED)

    def cross_validated(shape: Shape) -> float:
        predicted = cross_val_predict(pursuit, samples.columns(every, shape), samples.residual, cv=folds)
        return score(float(np.abs(predicted - samples.residual).max()))

    found = []
    shapes = [(c, b, g) for c, b, g in itertools.product(*SHAPES.values())]
    for shape in sorted(shapes, key=cross_validated)[: max(tries, 1)]:
        chosen = pursuit.fit(samples.columns(every, shape), samples.residual)[-1].coef_
        terms = [every[k] for k in np.flatnonzero(chosen)]
        moved = _polished(samples, terms, shape) if tries else shape
        error, coefficients = least_largest(samples.columns(terms, moved), samples.residual)
        found.append(Fit(samples.which, terms, coefficients, moved, error))
    return min(found, key=lambda one: score(one.error))


def _polished(samples: Samples, terms: list[Term], shape: Shape) -> Shape:
    """The shape moved to where the largest error of these terms is least, to three digits."""
    few = slice(None, None, THIN)

    def largest(logs: FloatArray) -> float:
        c, b, g = np.exp(logs)
        return least_largest(samples.columns(terms, (c, b, g))[few], samples.residual[few], POLISH_ROUNDS)[0]

    best = minimize(largest, np.log(shape), method="Nelder-Mead", options={"maxfev": POLISH}).x
    c, b, g = rounded(np.exp(best), 3).tolist()
    return c, b, g
