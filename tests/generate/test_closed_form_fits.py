"""The fits of the closed forms on few samples: planted terms are found, certificates hold, the choice is stable."""

import mpmath
import numpy as np
import pytest
from scipy.optimize import linprog
from threadpoolctl import threadpool_limits

from generate.formulas import islands, terms, totals
from generate.formulas.fit import least_largest
from generate.formulas.printing import evaluate, steps_of
from generate.formulas.terms import AREA, FORCE, Samples, columns, limit_log_Q, variables
from mbma_tables import Surface, contact, greenwood_tripp

PLANTED = {FORCE: [(1, "t", 1), (2, "z", 1), (1, "v", 2)], AREA: [(0, "z", 1), (1, "t", 0)]}
VALUES = {FORCE: [0.7, -1.1, 0.4], AREA: [0.8, -0.5]}
PRINTED = {"rel": 0.011, "abs": 0}  # three digits are stated, the largest error rounded up


@pytest.fixture(autouse=True)
def one_thread():
    with threadpool_limits(1):
        yield


def planted(which, shape):
    """Samples whose log Q is a sum of a few terms."""
    rng = np.random.default_rng(8)
    X, mu = rng.uniform(0.8, 20, 300), np.exp(rng.uniform(-6, 6, 300))
    log_Q = limit_log_Q(which, X, mu) + columns(PLANTED[which], variables(X, mu, *shape)) @ VALUES[which]
    return Samples.of(which, X, mu, -np.log1p(mu * np.exp(log_Q)))


@pytest.fixture
def few_terms(monkeypatch):
    # the pursuit is greedy: among neighbours that are nearly alike, it may prefer another than the planted one
    monkeypatch.setattr(terms, "dictionary", PLANTED.get)


@pytest.mark.parametrize("which", [FORCE, AREA])
def test_planted_numbers_are_found(which, few_terms, monkeypatch):
    monkeypatch.setattr(terms, "SHAPES", {"c": (1.5, 2.0), "b": (0.5, 1.0), "g": (1.0,)})
    found = terms.fit(planted(which, (2.0, 1.0, 1.0)), len(VALUES[which]))
    values = dict(zip(found.terms, found.coefficients, strict=True))
    assert sorted(values) == sorted(PLANTED[which])
    assert found.shape == (2.0, 1.0, 1.0)
    assert [values[term] for term in PLANTED[which]] == pytest.approx(VALUES[which], rel=1e-9, abs=0)
    assert found.error < 1e-10
    # c always, b with t or z, g with v
    assert found.length == {FORCE: 3 + 3, AREA: 2 + 2}[which]


def test_the_largest_error_is_least():
    rng = np.random.default_rng(4)
    M, target = rng.normal(size=(60, 4)), rng.normal(size=60)
    ones = np.ones((60, 1))
    exact = linprog(
        [0, 0, 0, 0, 1],
        A_ub=np.block([[M, -ones], [-M, -ones]]),
        b_ub=np.concatenate([target, -target]),
        bounds=[(None, None)] * 5,
    )
    error, found = least_largest(M, target, 2000)
    assert np.abs(M @ found - target).max() <= error * (1 + 1e-12)
    assert exact.fun <= error * (1 + 1e-9)
    assert error < 1.02 * exact.fun


@pytest.fixture
def small(monkeypatch):
    """Fits of few terms to few samples, kept apart from those of other tests."""
    caches = (islands.solved, islands.fitted, totals.branch, totals.samples)
    for cache in caches:
        cache.cache_clear()
    sizes = {name: islands.Size((n, n), 0.8, 1e-2) for name, n in (("pocket", 2), ("standard", 4), ("long", 6))}
    for module, changed in (
        (islands, {"SIZES": sizes, "POINTS": 300, "HELD_OUT": 400, "GRID": 60, "TRIES": ((2, 1),)}),
        (terms, {"SHAPES": {"c": (1.5, 3.0), "b": (1.0,), "g": (1.0,)}, "POLISH": 20}),
        (totals, {"POINTS": 500, "HELD_OUT": 600, "DEGREE": 1.5, "TRIALS": 12, "THIN": 4, "ANNEAL_SEEDS": (43,)}),
        (totals, {"TERMS": {"pressure": (6, 4), "area": (5, 3)}}),
    ):
        for name, value in changed.items():
            monkeypatch.setattr(module, name, value)
    yield
    for cache in caches:
        cache.cache_clear()


def agrees(form, given, exact):
    """Each certificate is what the steps of its function err by at the held-out points."""
    for function in form.functions:
        error = np.abs(evaluate(function.steps, given)[function.result] / exact[function.result] - 1)
        stated = form.certificates[function.result]
        assert stated.points == error.size
        assert error.max() <= stated.largest
        assert (np.median(error), error.max()) == pytest.approx((stated.median, stated.largest), **PRINTED)
        worst = {name: values[error.argmax()] for name, values in given.items()}
        assert stated.worst_at == pytest.approx(worst, **PRINTED)


def test_certificates_are_the_errors_at_held_out_points(small):
    errors = {}
    X, mu = islands.points(400, 0.8, islands.HELD_OUT_SEED)
    solved = greenwood_tripp.solve(X, mu, rtol=1e-11)
    for name in islands.SIZES:
        form = islands.island_form(name)
        agrees(form, {"X": X, "mu": mu}, vars(solved) if hasattr(solved, "__dict__") else solved._asdict())
        errors[name] = [found.largest for found in form.certificates.values()]
    assert (np.diff(list(errors.values()), axis=0) < 0).all()

    form = totals.totals_form()
    assert [found.coefficients for found in form.certificates.values()] == [10, 8]
    given = totals.arguments(600, totals.HELD_OUT_SEED)
    surface = Surface(given["hurst"], 1.0, given["zeta_1"], 1.0, given["h_max_over_h_rms"])
    found = contact(surface, separation=given["d_over_h_rms"], island_model="exact", rtol=1e-6)
    some = found.area > totals.MIN_AREA
    exact = {name: getattr(found, name)[some] for name in totals.NAMES}
    agrees(form, {name: values[some] for name, values in given.items()}, exact)


@pytest.mark.parametrize(("text", "good"), [("mu*(X + 1)", True), ("1/(X + 1)", False), ("X - 3 + 0*mu", False)])
def test_falling_and_negative_forms_are_seen(text, good):
    assert islands.rises(steps_of([("phi_A", text)], ("X", "mu")), "phi_A", 0.0) == good


ORDERS = {FORCE: 2.5, AREA: 2.0}
FACTORS = {FORCE: mpmath.pi / 5, AREA: mpmath.pi / 2}


def rigid(which, accuracy, X):
    *_, (name, _) = steps = islands.rigid_steps(which, accuracy)
    return evaluate(steps, {"X": X})[name]


def exact_rigid(which, x):
    """The rigid sphere by quadrature in 25 digits."""
    order = mpmath.mpf(ORDERS[which])
    with mpmath.workdps(25):
        cuts = [-x, max(-x, -8), max(-x, 0), max(-x, 0) + 4, max(-x, 0) + 14]
        return float(FACTORS[which] * mpmath.quad(lambda z: (z + x) ** order * mpmath.npdf(z), cuts))


@pytest.mark.parametrize("accuracy", [1e-2, 1e-3, pytest.param(1e-4, marks=pytest.mark.slow)])
@pytest.mark.parametrize("which", [FORCE, AREA])
def test_the_rigid_sphere_keeps_its_stated_error(which, accuracy):
    low, high = islands.RIGID_RANGE
    X = np.array([low, -0.37, 0.0, 0.61, 1.3, 2.9, 6.7, 15.3, 33.1, high])
    error = np.abs(rigid(which, accuracy, X) / [exact_rigid(which, x) for x in X] - 1).max()
    coefficients, stated = islands.rigid_polynomial(which, accuracy)
    assert error <= stated * (1 + 1e-6)
    assert stated <= np.expm1(accuracy)
    assert len(coefficients) >= len(islands.rigid_polynomial(which, 1e-2)[0])
    assert (np.diff(rigid(which, accuracy, np.linspace(low, high, 2001))) > 0).all()


def test_the_columns_that_made_the_values_are_found(monkeypatch):
    monkeypatch.setattr(totals, "TRIALS", 1000)
    rng = np.random.default_rng(3)
    M = rng.uniform(-1, 1, (400, 30))
    columns = [2, 11, 17, 26]
    target = M[:, columns] @ [1.0, -0.4, 0.7, 0.2] + 0.01 * rng.uniform(-1, 1, 400)
    assert sorted(totals.anneal(M, target, totals.eliminate(M, target, 4), 43)) == columns
    assert sorted(totals.anneal(M, target, [0, 1, 3, 4], 43)) == columns


def test_totals_choose_the_same_terms_when_samples_change_in_the_last_digits(monkeypatch):
    for name, value in (("POINTS", 4000), ("TRIALS", 100), ("THIN", 8), ("ANNEAL_SEEDS", (43,))):
        monkeypatch.setattr(totals, name, value)
    matrix, rng = totals.matrix, np.random.default_rng(1)

    def chosen(noise):
        def noisy(*given):
            M = matrix(*given)
            return M * (1 + noise * rng.standard_normal(M.shape))

        monkeypatch.setattr(totals, "matrix", noisy)
        return [totals.branch.__wrapped__(name, True, totals.TERMS[name][True])[0] for name in totals.NAMES]

    assert chosen(0.0) == chosen(1e-13)
