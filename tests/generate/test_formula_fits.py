"""The fits of the closed forms on few samples: planted terms are found, and what is stated is what holds."""

from __future__ import annotations

import math

import numpy as np
import pytest
from click.testing import CliRunner

from generate.formulas import alternatives as formula_alternatives
from generate.formulas import fit as formula
from generate.formulas import islands as formula_islands
from generate.formulas import terms as formula_terms
from generate.formulas import totals as formula_totals
from generate.formulas.terms import AREA, FORCE, Samples, columns, limit_log_Q, variables
from generate.pages import formula as formula_page
from mbma_tables import contact
from mbma_tables.formulas.file import TOTALS, get_form, read
from mbma_tables.islands import greenwood_tripp
from mbma_tables.surfaces.surface import Surface

PLANTED = {FORCE: [(1, "t", 1), (2, "z", 1), (1, "v", 2)], AREA: [(0, "z", 1), (1, "t", 0)]}
PRINTED = {"rel": 0.006, "abs": 0}  # three digits are stated
VALUES = {FORCE: [0.7, -1.1, 0.4], AREA: [0.8, -0.5]}


def planted(which, shape):
    """Samples whose log Q is a sum of a few terms."""
    rng = np.random.default_rng(8)
    X, mu = rng.uniform(0.8, 20, 300), np.exp(rng.uniform(-6, 6, 300))
    log_Q = limit_log_Q(which, X, mu) + columns(PLANTED[which], variables(X, mu, *shape)) @ VALUES[which]
    return Samples.of(which, X, mu, -np.log1p(mu * np.exp(log_Q)))


@pytest.fixture
def few_terms(monkeypatch):
    # the pursuit is greedy: among neighbours that are nearly alike, it may prefer another than the planted one
    monkeypatch.setattr(formula_terms, "dictionary", PLANTED.get)


@pytest.mark.parametrize("which", [FORCE, AREA])
def test_planted_numbers_are_found(which, few_terms, monkeypatch):
    monkeypatch.setattr(formula_terms, "GRID", {"c": (1.5, 2.0), "b": (0.5, 1.0), "g": (1.0,)})
    found = formula_terms.fit(planted(which, (2.0, 1.0, 1.0)), len(VALUES[which]))
    values = dict(zip(found.terms, found.coefficients, strict=True))
    assert sorted(values) == sorted(PLANTED[which])
    assert found.shape == (2.0, 1.0, 1.0)
    assert [values[term] for term in PLANTED[which]] == pytest.approx(VALUES[which], rel=1e-9, abs=0)
    assert found.error < 1e-10
    # c always, b with t or z, g with v
    assert found.length == {FORCE: 3 + 3, AREA: 2 + 2}[which]


def test_shapes_that_move_reach_what_no_grid_holds(few_terms, monkeypatch):
    monkeypatch.setattr(formula_terms, "GRID", {"c": (2.0,), "b": (1.0,), "g": (1.0,)})
    samples = planted(AREA, (2.2, 0.8, 1.0))
    fixed, moved = (formula_terms.fit(samples, 2, tries) for tries in (0, 1))
    assert fixed.shape == (2.0, 1.0, 1.0)
    assert moved.error < 0.05 * fixed.error
    assert moved.shape[:2] == pytest.approx((2.2, 0.8), rel=0.02, abs=0)


@pytest.fixture
def small(monkeypatch):
    """Fits of few terms to few samples, kept apart from those of other tests."""
    caches = (formula_islands.solved, formula_islands.fitted, formula_totals.branch, formula_totals.samples)
    for cache in caches:
        cache.cache_clear()
    sizes = {
        name: formula_islands.Size(title, (terms, terms), 0.8, 1e-2)
        for name, title, terms in (("pocket", "a", 2), ("standard", "b", 4), ("long", "c", 6))
    }
    for module, name, value in (
        (formula_islands, "SIZES", sizes),
        (formula_islands, "POINTS", 300),
        (formula_islands, "HELD_OUT", 400),
        (formula_islands, "GRID", 60),
        (formula_islands, "TRIES", ((2, 1),)),
        (formula_terms, "GRID", {"c": (1.5, 3.0), "b": (1.0,), "g": (1.0,)}),
        (formula_terms, "POLISH", 20),
        (formula_totals, "POINTS", 500),
        (formula_totals, "HELD_OUT", 600),
        (formula_totals, "DEGREE", 1.5),
        (formula_totals, "TERMS", {"force": (6, 4), "area": (5, 3)}),
        (formula_totals, "TRIALS", 12),
        (formula_alternatives, "PROCESS_POINTS", 60),
        (formula_alternatives, "TREES", 3),
    ):
        monkeypatch.setattr(module, name, value)
    yield
    for cache in caches:
        cache.cache_clear()


def test_the_file_holds_what_it_states(small, tmp_path):
    target = tmp_path / "formula.json"
    made = formula.build(target)
    again = read(target)
    assert again.data_hash == made.data_hash
    errors = {}
    for name in formula_islands.SIZES:
        form = again.forms[name]
        X, mu = formula_islands.points(400, 0.8, formula_islands.HELD_OUT_SEED)
        solved = greenwood_tripp.solve(X, mu, rtol=1e-11)
        told = form.evaluate({"X": X, "mu": mu})
        for function in ("phi_F", "phi_A"):
            error = np.abs(told[function] / getattr(solved, function) - 1)
            stated = form.errors[function]
            assert (np.median(error), error.max()) == pytest.approx((stated["median"], stated["largest"]), **PRINTED)
            worst = {"X": X[error.argmax()], "mu": mu[error.argmax()]}
            assert stated["worst_at"] == pytest.approx(worst, **PRINTED)
            errors[name, function] = stated["largest"]
        assert form.coefficients["phi_F"] >= formula_islands.SIZES[name].terms[0]
    for function in ("phi_F", "phi_A"):
        assert errors["pocket", function] > errors["standard", function] > errors["long", function]

    form = again.forms[TOTALS]
    assert form.coefficients == {"force": 10, "area": 8}
    given = formula_totals.arguments(600, formula_totals.HELD_OUT_SEED)
    surface = Surface(given["hurst"], 1.0, given["zeta_1"], 1.0, given["h_max_over_h_rms"])
    found = contact(surface, given["d_over_h_rms"], tier="exact", rtol=1e-6)
    seen = found.area > formula_totals.LEAST_AREA
    assert form.errors["points"] == seen.sum()
    told = form.evaluate({name: a[seen] for name, a in given.items()})
    for function in ("force", "area"):
        error = np.abs(told[function] / getattr(found, function)[seen] - 1)
        stated = form.errors[function]
        assert (np.median(error), error.max()) == pytest.approx((stated["median"], stated["largest"]), **PRINTED)


def test_a_form_that_does_not_rise_is_refused(small, monkeypatch):
    monkeypatch.setattr(formula_islands, "rises", lambda steps, lowest: False)
    with pytest.raises(RuntimeError, match="the pocket form does not rise"):
        formula_islands.island_form("pocket")


def test_falling_forms_are_seen():
    steps = [["phi_F", "mu*(X + 1)"], ["phi_A", "X + 1"]]
    assert formula_islands.rises(steps, 0.0)
    assert not formula_islands.rises([steps[0], ["phi_A", "1/(X + 1)"]], 0.0)
    assert not formula_islands.rises([["phi_F", "X - 3"], steps[1]], 0.0)


def test_longer_forms_err_less(small):
    rows = formula_islands.front((2, 5))
    for name in formula_islands.NAMES:
        assert rows[1][f"error_{name}"] < rows[0][f"error_{name}"] < 0.5
        assert rows[1][f"coefficients_{name}"] > rows[0][f"coefficients_{name}"]


def test_alternatives_are_measured_where_the_forms_are(small):
    islands, totals = formula_alternatives.islands(), formula_alternatives.totals()
    titles = [row["model"].split(",")[0] for row in islands]
    assert titles == ["ridge", "Gaussian process", "gradient boosting", "pocket form", "standard form", "long form"]
    X, mu, log_ratio = formula_islands.solved(400, 0.8, formula_islands.HELD_OUT_SEED)
    truth = np.exp(log_ratio[0]) * greenwood_tripp.rigid_sphere(X, mu)[0]
    for row, name in zip(islands[3:], formula_islands.SIZES, strict=True):
        own = get_form(name).evaluate({"X": X, "mu": mu})["phi_F"]
        assert row["largest_error"] == pytest.approx(np.abs(own / truth - 1).max(), rel=1e-9, abs=0)
        assert row["largest_error"] <= get_form(name).errors["phi_F"]["largest"] * 1.05
    assert len(totals) == 4
    assert totals[-1]["largest_error"] < 0.1
    for row in (*islands, *totals):
        assert 0 < row["largest_error"] < math.inf
        assert row["microseconds"] > 0


def test_the_page_says_what_was_measured(tmp_path, monkeypatch):
    front = [
        {"terms": n, "coefficients_phi_F": n + 2, "error_phi_F": 0.5 / n, "coefficients_phi_A": n + 3}
        | {"error_phi_A": 0.25 / n}
        for n in (4, 8)
    ]
    monkeypatch.setattr(formula_islands, "front", lambda: front)
    row = {"model": "a ruler", "largest_error": 0.37, "microseconds": 1.25}
    monkeypatch.setattr(formula_alternatives, "islands", lambda: [row])
    monkeypatch.setattr(formula_alternatives, "totals", lambda: [row | {"model": "another ruler"}])
    done = CliRunner().invoke(formula_page.main, ["--out", str(tmp_path)], catch_exceptions=False)
    assert done.exit_code == 0
    text = (tmp_path / "formula.md").read_text(encoding="utf-8")
    assert "| 4 | 6 | 0.12 | 7 | 0.062 |" in text
    assert "| a ruler | 0.37 | 1.2 |" in text
    assert "| another ruler | 0.37 | 1.2 |" in text
    for name in (*formula_islands.SIZES, TOTALS):
        form = get_form(name)
        for result in form.outputs:
            stated = form.errors[result]
            wanted = f"| {name} | {result} | {form.coefficients[result]} | {stated['largest']:.2g} |"
            assert wanted in text
    assert (tmp_path / "figures" / "formula.png").read_bytes().startswith(b"\x89PNG")
