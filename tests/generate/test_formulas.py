"""The closed forms: fits have least largest errors, certificates hold, C and sympy agree."""

import numpy as np
import pytest
from scipy.optimize import linprog

from generate import formulas as fit
from generate.formulas import FORMS, MODULE, forms_text, module_text
from generate.pages.library import expressions
from mbma_tables import Surface, contact, greenwood_tripp
from mbma_tables.theories import Mbma
from mbma_tables.theories.mbma.closed_forms import (
    CERTIFICATES,
    FUNCTIONS,
    RANGES,
    evaluate,
)

PRINTED = {
    "rel": 0.011,
    "abs": 0,
}  # three digits are stated, the largest error rounded up
SHIPPED = {
    f"{form}_{result}": one
    for form, results in FUNCTIONS.items()
    for result, one in results.items()
}


@pytest.fixture
def few(monkeypatch):
    """Fits to few samples, kept apart from those of other tests."""
    for name, value in (
        ("POINTS", 300),
        ("HELD_OUT", 400),
        ("GRID", 60),
        ("TOTAL_POINTS", 800),
    ):
        monkeypatch.setattr(fit, name, value)
    monkeypatch.setattr(fit, "TOTAL_HELD_OUT", 600)
    caches = fit.islands, fit.totals
    for cache in caches:
        cache.cache_clear()
    yield
    for cache in caches:
        cache.cache_clear()


def test_the_largest_error_is_least():
    rng = np.random.default_rng(4)
    M = rng.normal(size=(60, 4))
    target = rng.normal(size=60)
    ones = np.ones((60, 1))
    exact = linprog(
        [0, 0, 0, 0, 1],
        A_ub=np.block([[M, -ones], [-M, -ones]]),
        b_ub=np.concatenate([target, -target]),
        bounds=[(None, None)] * 5,
    )
    error, found = fit.least_largest(M, target, 2000)
    assert np.abs(M @ found - target).max() <= error * (1 + 1e-12)
    assert exact.fun <= error * (1 + 1e-9)
    assert error < 1.02 * exact.fun


@pytest.mark.parametrize(
    "name", ["pocket_phi_F", "pocket_phi_A", "totals_pressure", "totals_area"]
)
def test_certificates_are_the_errors_at_held_out_points(name, few):
    function, stated = fit.certified(SHIPPED[name])
    if function.form == "totals":
        given, _ = fit.totals(600, fit.TOTAL_HELD_OUT_SEED)
        surface = Surface(
            given["hurst"], 1.0, given["zeta_1"], 1.0, given["h_max_over_h_rms"]
        )
        found = contact(
            surface,
            separation=given["d_over_h_rms"],
            theory=Mbma(island_model="exact", rtol=1e-6),
        )
        exact = getattr(found, function.result)
    else:
        given, _ = fit.islands(function.form, 400, fit.HELD_OUT_SEED)
        exact = getattr(
            greenwood_tripp.solve(given["X"], given["mu"], rtol=1e-11), function.result
        )
    error = np.abs(evaluate(function.steps, given)[function.result] / exact - 1)
    assert stated.points == error.size
    assert error.max() <= stated.largest
    assert (np.median(error), error.max()) == pytest.approx(
        (stated.median, stated.largest), **PRINTED
    )
    worst = {key: values[error.argmax()] for key, values in given.items()}
    assert stated.worst_at == pytest.approx(worst, **PRINTED)
    assert function.title.endswith(f"within {stated.largest:g}.")
    assert (
        stated.coefficients == CERTIFICATES[function.form][function.result].coefficients
    )


@pytest.mark.parametrize(
    ("text", "good"),
    [("mu*(X + 1)", True), ("1/(X + 1)", False), ("X - 3 + 0*mu", False)],
)
def test_falling_and_negative_forms_are_seen(text, good):
    ranges = {"X": (0.0, 25.0), "mu": (0.0, 2e3)}
    assert fit.rises({"phi_A": text}, "phi_A", ranges) == good


def test_a_form_that_falls_is_refused(few, monkeypatch):
    monkeypatch.setattr(fit, "rises", lambda *_: False)
    with pytest.raises(
        RuntimeError, match="phi_F of the pocket form does not rise with X everywhere"
    ):
        fit.certified(SHIPPED["pocket_phi_F"])


@pytest.mark.parametrize(
    ("form", "accuracy"), [("pocket", 3e-3), ("standard", 1e-3), ("long", 1e-4)]
)
@pytest.mark.parametrize("result", ["phi_F", "phi_A"])
def test_the_rigid_sphere_of_a_form(form, accuracy, result):
    steps = {
        name: SHIPPED[f"{form}_{result}"].steps[name] for name in ("w", "p", "rigid")
    }
    X = np.array([-0.5, -0.37, 0.0, 0.61, 1.3, 2.9, 6.7, 15.3, 33.1, 60.0])
    exact = greenwood_tripp.rigid_sphere(X, np.ones(X.size))[int(result == "phi_A")]
    assert np.abs(evaluate(steps, {"X": X})["rigid"] / exact - 1).max() <= np.expm1(
        accuracy
    )
    assert (
        np.diff(evaluate(steps, {"X": np.linspace(-0.5, 60, 2001)})["rigid"]) > 0
    ).all()


def test_the_shipped_text_is_what_the_generator_prints():
    text = FORMS.read_text(encoding="utf-8")
    assert forms_text(text, FUNCTIONS) == text
    assert module_text(CERTIFICATES) == MODULE.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", SHIPPED)
def test_the_core_agrees_with_sympy_in_30_digits(name):
    function = SHIPPED[name]
    steps = expressions(SHIPPED[name])
    rng = np.random.default_rng(5)
    ranges = RANGES[function.form]
    given = {
        argument: rng.uniform(*ranges[argument], 2)
        for argument in ranges
        if argument != "area"
    }
    if function.form == "totals":
        given["d_over_h_rms"] = given["h_max_over_h_rms"] - rng.uniform(0.1, 6, 2)
    else:
        given["mu"] = np.array([0.0, 10 ** rng.uniform(-9, np.log10(2e3))])
    given = {argument: given[argument] for argument in function.arguments}
    found = FUNCTIONS[function.form][function.result](*given.values())
    for number in range(2):
        values = {argument: float(both[number]) for argument, both in given.items()}
        for step, expression in steps.items():
            values[step] = expression.evalf(30, subs=values)
        assert found[number] == pytest.approx(
            float(values[function.result]), rel=1e-12, abs=0
        )
