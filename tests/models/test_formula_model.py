"""The formula tier: within its error, its limits, and outside its range."""

import numpy as np
import pytest

from mbma_tables import InputError, OutOfRangeError, Surface, contact, greenwood_tripp
from mbma_tables.models.closed_forms import FormulaModel
from mbma_tables.models.protocol import AREA, FORCE


@pytest.mark.parametrize("form", ["pocket", "standard", "long"])
def test_answers_within_its_error(form):
    model = FormulaModel(form)
    X, mu = np.meshgrid(np.linspace(0.8, 25, 30), np.geomspace(1e-9, 2e3, 25))
    found, solved = model.answer(X, mu), greenwood_tripp.solve(X, mu, rtol=1e-9)
    for name in ("phi_F", "phi_A"):
        assert (np.abs(getattr(found, name) / getattr(solved, name) - 1) <= found.error).all()


def test_totals_within_one_percent():
    rng = np.random.default_rng(91)
    hurst, zeta_1 = rng.uniform(0.35, 1, 150), 10 ** rng.uniform(0.5, 4, 150)
    h_max = rng.uniform(2.5, 4.5, 150)
    surface = Surface(hurst, 1.0, zeta_1, 1.0, h_max)
    gap = rng.uniform(-1, 0.999, 150) * h_max
    found, exact = contact(surface, gap, tier="formula", rtol=1e-3), contact(surface, gap)
    for name in ("force", "area"):
        error = np.abs(getattr(found, name) / getattr(exact, name) - 1)
        assert error.max() <= 0.01
        assert (error <= found.error).all()


def test_one_function_alone():
    model = FormulaModel()
    islands = {"X": np.array([1.0, 5.0]), "mu": np.array([0.1, 10.0])}
    both = model.of_islands(islands)
    force, area = model.of_islands(islands, which=FORCE), model.of_islands(islands, which=AREA)
    np.testing.assert_array_equal(force.phi_F, both.phi_F)
    np.testing.assert_array_equal(area.phi_A, both.phi_A)
    assert np.isnan(force.phi_A).all()
    assert np.isnan(area.phi_F).all()


def test_outside():
    model = FormulaModel()
    X, mu = np.array([1.0, 30.0, 2.0]), np.array([0.0, 1.0, 3e3])
    with pytest.raises(OutOfRangeError):
        model.answer(X, mu)
    lost = model.answer(X, mu, outside="nan")
    assert np.isnan(lost.phi_F).tolist() == [False, True, True]
    solved = model.answer(X, mu, outside="exact")
    np.testing.assert_allclose(solved.phi_F[1:], greenwood_tripp.solve(X, mu).phi_F[1:], rtol=1e-8)
    assert solved.phi_F[0] == 0
    assert solved.phi_A[0] > 0


@pytest.mark.parametrize("bad", [{"form": "tiny"}, {"outside": "clamp"}])
def test_bad_choices(bad):
    with pytest.raises(InputError):
        FormulaModel(bad.get("form", "standard")).answer(1.0, 1.0, outside=bad.get("outside", "raise"))


@pytest.mark.parametrize(("X", "mu"), [(np.nan, 1.0), (1.0, np.inf), (1.0, -1e-3)])
def test_no_number(X, mu):
    with pytest.raises(InputError):
        FormulaModel().answer(X, mu, outside="exact")


def test_scalars_are_answered_as_arrays_are():
    from mbma_tables import island

    one, many = FormulaModel().answer(1.0, 1.0), FormulaModel().answer([1.0], [1.0])
    assert (one.phi_F, one.phi_A, one.error) == (many.phi_F[0], many.phi_A[0], many.error[0])
    surface = Surface(0.8, 1.0, 100.0, 1.0, 3.0)
    assert island(surface, 0.5, tier="formula").force == island(surface, [0.5], tier="formula").force[0]
