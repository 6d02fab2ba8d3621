"""The closed forms against ready-made regressors on the same samples: largest held-out error, and time an answer.

Regressors learn log(Phi_F/Phi_rigid) or log(force) of variables in which those are smooth.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, WhiteKernel
from sklearn.linear_model import Ridge
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from generate.formulas import islands as formula_islands
from generate.formulas import totals as formula_totals
from mbma_tables.arguments import FloatArray
from mbma_tables.formulas.file import TOTALS, Form, get_form

PROCESS_POINTS = 800
TREES = 300

Row = dict[str, Any]


def _plain(degree: int, count: int, inputs: int) -> list[tuple[str, Any, int | None]]:
    """Title, regressor, and how many samples it takes."""
    kernel = RBF([1.0] * inputs) + WhiteKernel(1e-6, "fixed")
    return [
        (f"ridge, polynomial of degree {degree}", make_pipeline(PolynomialFeatures(degree), Ridge(1e-8)), None),
        (f"Gaussian process, {count} points", GaussianProcessRegressor(kernel, normalize_y=True), count),
        (f"gradient boosting, {TREES} trees", HistGradientBoostingRegressor(max_iter=TREES, random_state=0), None),
    ]


def _answer(model: Any, rows: FloatArray, factor: FloatArray | float) -> FloatArray:
    predicted: FloatArray = np.exp(model.predict(rows)) * factor
    return predicted


def _measured(title: str, answer: Callable[[], FloatArray], truth: FloatArray) -> Row:
    found = answer()
    start = time.perf_counter()
    answer()
    spent = time.perf_counter() - start
    error = float(np.abs(found / truth - 1).max())
    return {"model": title, "largest_error": error, "microseconds": 1e6 * spent / truth.size}


def _compare(
    ready: list[tuple[str, Any, int | None]],
    rows: FloatArray,
    target: FloatArray,
    other: FloatArray,
    factor: FloatArray | float,
    truth: FloatArray,
) -> list[Row]:
    measured = []
    for title, regressor, count in ready:
        model = make_pipeline(StandardScaler(), regressor)
        chosen = slice(None) if count is None else slice(-count, None)
        model.fit(rows[chosen], target[chosen])
        measured.append(_measured(title, functools.partial(_answer, model, other, factor), truth))
    return measured


def islands() -> list[Row]:
    """Phi_F of islands, X from 0.8 on; degree 5 in two variables has 21 coefficients."""

    def features(X: FloatArray, mu: FloatArray) -> FloatArray:
        return np.stack([np.log(X + 2), np.log1p(mu * (X + 1))], axis=1)

    X, mu, log_ratio = formula_islands.solved(formula_islands.POINTS, 0.8, formula_islands.FIT_SEED)
    other_X, other_mu, other = formula_islands.solved(formula_islands.HELD_OUT, 0.8, formula_islands.HELD_OUT_SEED)
    rigid = _rigid(other_X, other_mu)
    truth = np.exp(other[0]) * rigid
    rows = _compare(
        _plain(5, PROCESS_POINTS, 2), features(X, mu), log_ratio[0], features(other_X, other_mu), rigid, truth
    )
    for name in formula_islands.SIZES:
        form = get_form(name)
        answer = functools.partial(_closed, form, {"X": other_X, "mu": other_mu}, "phi_F")
        rows.append(_measured(f"{name} form, {form.coefficients['phi_F']} coefficients", answer, truth))
    return rows


def _rigid(X: FloatArray, mu: FloatArray) -> FloatArray:
    from mbma_tables.islands.greenwood_tripp import rigid_sphere

    rigid: FloatArray = rigid_sphere(X, mu)[0]
    return rigid


def _closed(form: Form, given: dict[str, FloatArray], result: str) -> FloatArray:
    return form.evaluate(given, (result,))[result]


def totals() -> list[Row]:
    """Total force; degree 3 in four variables has 35 coefficients."""

    def features(given: dict[str, FloatArray]) -> FloatArray:
        reach = given["h_max_over_h_rms"] - given["d_over_h_rms"]
        return np.stack([np.log(reach), given["d_over_h_rms"], np.log(given["zeta_1"]), given["hurst"]], axis=1)

    given, own = formula_totals.samples(formula_totals.POINTS, formula_totals.FIT_SEED)
    other, truth = formula_totals.samples(formula_totals.HELD_OUT, formula_totals.HELD_OUT_SEED)
    rows = _compare(
        _plain(3, PROCESS_POINTS, 4), features(given), np.log(own["force"]), features(other), 1.0, truth["force"]
    )
    form = get_form(TOTALS)
    answer = functools.partial(_closed, form, other, "force")
    rows.append(_measured(f"closed totals, {form.coefficients['force']} coefficients", answer, truth["force"]))
    return rows
