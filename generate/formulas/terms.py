"""Terms of the island formulas, and their fit: sparse selection, cross-validated shapes, then a least largest error.

With Phi_rigid the closed form of the rigid sphere, each function is written as

    Phi = Phi_rigid/(1 + mu Q(X, mu)),

right as mu -> 0 whatever Q is. Q is positive by being an exponential; log Q is its own limit at large X, which is the
smooth sphere of Hertz, and a sum of terms that die there. In

    u = 1/(X + c),  y = b mu (X + c),  t = log(1 + y),  z = 1/(1 + sqrt(y)),  v = log(1 + g mu/sqrt(X + c))

these are z^j, u^i t^j, u^i z^j and u^i v^j: at fixed mu, u, z and v fall faster than any power of t grows.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from scipy.optimize import minimize
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.linear_model import OrthogonalMatchingPursuit
from sklearn.model_selection import KFold, ParameterGrid, cross_val_predict
from sklearn.pipeline import Pipeline
from sklearn.preprocessing import MaxAbsScaler

from mbma_tables.arguments import FloatArray

FORCE, AREA = 0, 1
# Phi_rigid mu^-1/(limit of Phi) at large X: (pi/5) X^(5/2) over (4/3) X^(3/2)/sqrt(2), and (pi/2) X^2 over
# (3 pi/8) (3 sqrt(32)/(3 pi))^(2/3) X^(4/3) mu^(-2/3)
HERTZ = (3 * math.sqrt(2) * math.pi / 20, 4 / 3 * (4 * math.sqrt(2) / math.pi) ** (-2 / 3))
LAWSON_ROUNDS = 80
GRID = {"c": (1.5, 2.0, 3.0), "b": (0.5, 1.0, 3.0), "g": (0.3, 1.0, 3.0)}
FOLDS = 5
POLISH, POLISH_ROUNDS, THIN = 100, 30, 3  # trials of Nelder and Mead's, each on every third sample
SEED = 20

Term = tuple[int, str, int]  # power of u; one of t, z, v; its power


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


def limit_log_Q(which: int, X: FloatArray, mu: FloatArray) -> FloatArray:
    """Log Q at large X."""
    log_Q = np.log(HERTZ[which] * (X + 1))
    result: FloatArray = log_Q - np.log1p(mu * (X + 1)) / 3 if which == AREA else log_Q
    return result


class Terms(TransformerMixin, BaseEstimator):  # type: ignore[misc]
    """Columns of the terms, each row times its weight, from rows of X, mu and weight."""

    def __init__(self, which: int = FORCE, c: float = 1.0, b: float = 1.0, g: float = 1.0) -> None:
        self.which, self.c, self.b, self.g = which, c, b, g

    def fit(self, rows: FloatArray, values: FloatArray | None = None) -> Terms:
        """Nothing is learned."""
        del rows, values
        return self

    def transform(self, rows: FloatArray) -> FloatArray:
        """Columns in the order of `dictionary`."""
        X, mu, weight = rows.T
        weighted: FloatArray = (
            columns(dictionary(self.which), variables(X, mu, self.c, self.b, self.g)) * weight[:, None]
        )
        return weighted


def columns(terms: list[Term], named: dict[str, FloatArray]) -> FloatArray:
    """One column a term."""
    return np.stack([named["u"] ** i * named[name] ** j for i, name, j in terms], axis=1)


@dataclasses.dataclass(frozen=True)
class Fit:
    """Terms and coefficients of log Q of one function, with c, b, g; and its largest error where it was fitted."""

    which: int
    terms: list[Term]
    coefficients: FloatArray
    shape: tuple[float, float, float]
    error: float

    @property
    def length(self) -> int:
        """Fitted constants: coefficients and those of c, b, g that a term uses."""
        used = {name for _, name, j in self.terms if j}
        return len(self.terms) + 1 + bool(used & {"t", "z"}) + ("v" in used)


def least_largest(A: FloatArray, residual: FloatArray, rounds: int = LAWSON_ROUNDS) -> tuple[float, FloatArray]:
    """Coefficients whose largest error is least, by Lawson's reweighting; that error and they."""
    weight: Any = np.ones_like(residual)
    best = math.inf
    found = np.zeros(A.shape[1])
    for _ in range(rounds):
        root = np.sqrt(weight)
        trial = np.linalg.lstsq(A * root[:, None], residual * root, rcond=1e-13)[0]
        error = np.abs(A @ trial - residual)
        largest = float(error.max())
        if largest < best:
            best, found = largest, trial
        grown = weight * (error / largest + 1e-3)
        weight = np.maximum(grown / grown.mean(), 1e-6)
    return best, found


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

    def columns(self, terms: list[Term], shape: tuple[float, float, float]) -> FloatArray:
        """Weighted columns of some terms."""
        return columns(terms, variables(self.X, self.mu, *shape)) * self.weight[:, None]


def fit(samples: Samples, count: int, tries: int = 0) -> Fit:
    """A formula of `count` terms: shape by cross-validated largest error, terms by matching pursuit.

    With `tries`, c, b and g then move freely from that many of the best shapes, each with its own terms, and the least
    largest error wins.
    """
    rows = np.stack([samples.X, samples.mu, samples.weight], axis=1)
    folds = KFold(FOLDS, shuffle=True, random_state=SEED)

    def pipeline(chosen: dict[str, float]) -> Any:
        select = OrthogonalMatchingPursuit(n_nonzero_coefs=count, fit_intercept=False)
        return Pipeline([("terms", Terms(samples.which, **chosen)), ("scale", MaxAbsScaler()), ("select", select)])

    def score(chosen: dict[str, float]) -> float:
        told = cross_val_predict(pipeline(chosen), rows, samples.residual, cv=folds)
        return float(np.abs(told - samples.residual).max())

    found = []
    for chosen in sorted(ParameterGrid(GRID), key=score)[: max(tries, 1)]:
        kept = np.flatnonzero(pipeline(chosen).fit(rows, samples.residual)["select"].coef_)
        terms = [dictionary(samples.which)[k] for k in kept]
        shape = (float(chosen["c"]), float(chosen["b"]), float(chosen["g"]))
        if tries:
            shape = _polished(samples, terms, shape)
        error, coefficients = least_largest(samples.columns(terms, shape), samples.residual)
        found.append(Fit(samples.which, terms, coefficients, shape, error))
    return min(found, key=lambda one: one.error)


def _polished(samples: Samples, terms: list[Term], shape: tuple[float, float, float]) -> tuple[float, float, float]:
    """The shape moved to where the largest error of these terms is least, to three digits."""
    few = slice(None, None, THIN)

    def largest(logs: FloatArray) -> float:
        c, b, g = np.exp(logs)
        return least_largest(samples.columns(terms, (c, b, g))[few], samples.residual[few], POLISH_ROUNDS)[0]

    best = minimize(largest, np.log(shape), method="Nelder-Mead", options={"maxfev": POLISH}).x
    c, b, g = (float(f"{value:.3g}") for value in np.exp(best))
    return c, b, g
