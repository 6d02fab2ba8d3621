"""The closed forms: certificates measured again on fresh exact solves, limits, ranges, and totals for users."""

import itertools

import numpy as np
import pytest

from mbma_tables import InputError, OutOfRangeError, Surface, contact, greenwood_tripp
from mbma_tables.theories import Mbma
from mbma_tables.theories.mbma import closed_forms
from mbma_tables.theories.mbma.closed_forms import (
    FUNCTIONS,
    RANGES,
    TOTALS,
    FormulaModel,
    closed_totals,
)

CERTIFICATES = closed_forms.CERTIFICATES
RESULTS = closed_forms.RESULTS
BULK = pytest.param(20_000, marks=pytest.mark.slow)


@pytest.mark.parametrize("count", [1500, BULK])
@pytest.mark.parametrize("form", closed_forms.ISLAND_FORMS)
def test_errors_of_islands_are_as_certified(form, count):
    rng = np.random.default_rng(77)
    X = rng.uniform(*RANGES[form]["X"], count)
    mu = 10 ** rng.uniform(-8, np.log10(RANGES[form]["mu"][1]), count)
    solved = greenwood_tripp.solve(X, mu, rtol=1e-9)
    for name in RESULTS:
        error = np.abs(FUNCTIONS[form][name](X, mu) / getattr(solved, name) - 1).max()
        # a tenth for points that the certificate's own did not meet
        assert (
            0.3 * CERTIFICATES[form][name].largest
            <= error
            <= 1.1 * CERTIFICATES[form][name].largest
        )


@pytest.mark.parametrize("count", [3000, BULK])
def test_errors_of_totals_are_as_certified(count):
    rng = np.random.default_rng(78)
    zeta_1 = np.exp(rng.uniform(np.log(10), np.log(1000), count))
    surface = Surface(
        rng.uniform(0.5, 1, count), 1.0, zeta_1, 1.0, rng.uniform(3, 4.5, count)
    )
    gap = surface.h_max - np.exp(rng.uniform(np.log(0.1), np.log(2 * surface.h_max)))
    exact = contact(surface, separation=gap)
    some = exact.area > RANGES[TOTALS]["area"][0]
    for name, function in FUNCTIONS[TOTALS].items():
        error = np.abs(
            function(gap, surface.h_max, zeta_1, surface.hurst) / getattr(exact, name) - 1
        )[some].max()
        assert (
            0.3 * CERTIFICATES[TOTALS][name].largest
            <= error
            <= 1.1 * CERTIFICATES[TOTALS][name].largest
        )


def test_totals_are_within_a_tenth_of_the_exact_solver_in_the_corners():
    h_max, zeta_1, hurst = np.array(
        list(itertools.product((3.0, 4.5), (10.0, 1000.0), (0.5, 1.0)))
    ).T[:, :, None]
    gap = h_max * np.linspace(-1, 0.9, 40)
    exact = contact(
        Surface(hurst, 1.0, zeta_1, 1.0, h_max),
        separation=gap,
        theory=Mbma(island_model="exact", rtol=1e-6),
    )
    some = exact.area > RANGES[TOTALS]["area"][0]
    for name, function in FUNCTIONS[TOTALS].items():
        assert (
            np.abs(function(gap, h_max, zeta_1, hurst) / getattr(exact, name) - 1)[
                some
            ].max()
            <= 0.1
        )


@pytest.mark.parametrize(
    ("form", "largest", "count"),
    [
        ("pocket", (0.0371, 0.032), 10),
        ("standard", (0.00164, 0.00768), 24),
        ("long", (5.4e-4, 7.2e-4), 80),
        (TOTALS, (0.1, 0.1), 40),
    ],
)
def test_what_is_promised(form, largest, count):
    for found, bound in zip(CERTIFICATES[form].values(), largest, strict=True):
        assert found.largest <= bound
        assert found.coefficients <= count


@pytest.mark.parametrize("form", closed_forms.ISLAND_FORMS)
def test_the_rigid_limit(form):
    X = np.linspace(*RANGES[form]["X"], 200)
    for name, rigid in zip(
        RESULTS, greenwood_tripp.rigid_sphere(X, np.full(200, 1e-12)), strict=True
    ):
        assert (
            np.abs(FUNCTIONS[form][name](X, np.full(200, 1e-12)) / rigid - 1).max() < 3e-3
        )


@pytest.mark.parametrize("form", closed_forms.ISLAND_FORMS)
def test_positive_and_rising_down_to_no_load(form):
    X = np.linspace(*RANGES[form]["X"], 500)[:, None]
    mu = np.concatenate(
        [[0.0, 5e-324, 1e-300], np.geomspace(1e-30, RANGES[form]["mu"][1], 500)]
    )
    for name in RESULTS:
        field = FUNCTIONS[form][name](X, mu)
        assert (field >= 0).all()
        assert (np.diff(field[:, 3:], axis=0) > 0).all()


def test_totals_by_the_island_model_are_within_one_percent():
    rng = np.random.default_rng(91)
    zeta_1 = 10 ** rng.uniform(0.5, 4, 150)
    h_max = rng.uniform(2.5, 4.5, 150)
    surface = Surface(rng.uniform(0.35, 1, 150), 1.0, zeta_1, 1.0, h_max)
    gap = rng.uniform(-1, 0.999, 150) * h_max
    found = contact(
        surface, separation=gap, theory=Mbma(island_model="formula", rtol=1e-3)
    )
    exact = contact(surface, separation=gap)
    for name in ("pressure", "area"):
        error = np.abs(getattr(found, name) / getattr(exact, name) - 1)
        assert error.max() <= 0.01
        assert (error <= found.error).all()


def test_outside_the_range():
    model = FormulaModel()
    X = np.array([1.0, 30.0, 2.0])
    mu = np.array([0.0, 1.0, 3e3])
    with pytest.raises(OutOfRangeError) as caught:
        model.answer(X, mu)
    assert caught.value.mask.tolist() == [False, True, False]
    lost = model.answer(X, mu, outside="nan")
    assert np.isnan(lost.phi_F).tolist() == [False, True, True]
    solved = model.answer(X, mu, outside="exact")
    np.testing.assert_allclose(
        solved.phi_F[1:], greenwood_tripp.solve(X, mu).phi_F[1:], rtol=1e-8
    )
    assert solved.phi_F[0] == 0
    assert solved.phi_A[0] > 0


@pytest.mark.parametrize(
    ("form", "X", "mu", "outside"),
    [
        ("tiny", 1.0, 1.0, "raise"),
        ("pocket", 1.0, 1.0, "clamp"),
        ("standard", np.nan, 1.0, "exact"),
        ("standard", 1.0, np.inf, "exact"),
        ("standard", 1.0, -1e-3, "exact"),
    ],
)
def test_bad_arguments(form, X, mu, outside):
    with pytest.raises(InputError):
        FormulaModel(form).answer(X, mu, outside=outside)


def test_units_and_shapes_of_closed_totals():
    surface = Surface(0.8, [[0.1], [0.2]], [[10.0], [20.0]], 0.5, 1.7)
    gaps = np.array([0.3, 0.9, -1.0])
    force, area, error = closed_totals(surface, gaps, 200.0)
    exact = contact(surface, 200.0, separation=gaps)
    assert force.shape == area.shape == (2, 3)
    assert np.abs(force / exact.pressure - 1).max() < error
    assert np.abs(area / exact.area - 1).max() < error


@pytest.mark.parametrize(
    ("hurst", "q1", "h_max", "gap"),
    [
        (0.4, 100.0, 3.0, 1.0),
        (0.8, 2000.0, 3.0, 1.0),
        (0.8, 100.0, 5.0, 1.0),
        *((0.8, 100.0, 3.0, gap) for gap in (2.99, 3.0, -3.1, np.nan)),
    ],
)
def test_closed_totals_outside_their_range(hurst, q1, h_max, gap):
    with pytest.raises(OutOfRangeError):
        closed_totals(Surface(hurst, 1.0, q1, 1.0, h_max), gap)
