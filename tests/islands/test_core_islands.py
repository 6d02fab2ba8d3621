"""Exact islands straight at the core: whatever it is told, it answers, and with the same bits everywhere."""

import importlib
import itertools
import math

import numpy as np
import pytest

from mbma_tables.core import core
from mbma_tables.islands.greenwood_tripp import COARSE_NODES, iterate, ring_matrix
from mbma_tables.islands.height_integrals import height_integral
from mbma_tables.islands.spectral import basis

OK, UNRESOLVED, INVALID = 0, 4, 5


def solve(X, mu, nodes, rtol=1e-10, module=core, profiles=True):
    X, mu = np.ascontiguousarray(X, dtype=float), np.ascontiguousarray(mu, dtype=float)
    phi, steps = np.zeros((X.size, 3)), np.zeros(X.size, dtype=np.int64)
    status = np.full(X.size, 99, dtype=np.uint8)
    kept = np.zeros((3, X.size, nodes)) if profiles else (None,) * 3
    bases = (*basis(nodes), *basis(COARSE_NODES))
    work = np.full(core.islands_work(nodes), np.nan)
    bad = module.solve_islands(X, mu, rtol, *bases, phi, steps, status, *kept, work)
    assert bad == np.count_nonzero(status)
    return phi, steps, status, np.array(kept)


def scatter(count, seed):
    rng = np.random.default_rng(seed)
    return rng.uniform(-12, 60, count), 10 ** rng.uniform(-20, 10, count)


def damped(X, mu, a, damping=0.3, tolerance=1e-9, most=200, rings=40):
    w, p = np.zeros((2, rings))
    return *iterate(X, mu, a, ring_matrix(rings), damping, tolerance, most, w, p), w, p


def test_numbers_that_are_none_are_refused_beside_good_ones():
    X = [1.0, math.nan, math.inf, -math.inf, 1.0, 1.0, 1.0, 1.0, 2.0]
    mu = [1.0, 1.0, 1.0, 1.0, math.nan, math.inf, -math.inf, -1e-300, 1.0]
    phi, steps, status, profiles = solve(X, mu, 24)
    assert status.tolist() == [OK] + [INVALID] * 7 + [OK]
    assert np.isnan(phi[1:8]).all()
    assert np.isnan(profiles[:, 1:8]).all()
    assert (steps[1:8] == 0).all()
    alone = solve([1.0, 2.0], [1.0, 1.0], 24)
    np.testing.assert_array_equal(phi[[0, 8]], alone[0])
    np.testing.assert_array_equal(profiles[:, [0, 8]], alone[3])


EXTREME = [0.0, -0.0, 5e-324, 1e-300, 1e-17, 1.0, 1e6, 1e17, 1e100, 1.7e308]


def test_extremes_end_with_finite_answers_or_a_status():
    X, mu = np.array(list(itertools.product([*EXTREME, *(-x for x in EXTREME)], EXTREME))).T
    with np.errstate(all="raise"):
        phi, steps, status, profiles = solve(X, mu, 16)
    good = status == OK
    assert np.isin(status, [OK, UNRESOLVED]).all()
    assert np.isfinite(phi[good]).all()
    assert (phi[good] >= 0).all()
    assert np.isnan(phi[~good]).all()
    assert np.isnan(profiles[:, ~good]).all()
    # a sphere that roughness hardly lifts is the rigid one
    still = good & (mu < 1e-200) & (np.abs(X) < 1e6)
    expected = np.empty((2, np.count_nonzero(still)))
    for row, twice_n in zip(expected, (5, 4), strict=True):
        core.height_integrals(twice_n, -X[still], row)
    np.testing.assert_allclose(phi[still, 0], math.pi / 5 * mu[still] * expected[0], rtol=1e-14, atol=5e-324)
    np.testing.assert_allclose(phi[still, 1], math.pi / 2 * expected[1], rtol=1e-14)
    assert steps.max() <= 21 * 200 + 200


@pytest.mark.parametrize("rtol", [math.nan, -1.0, 0.0, 1e-300, math.inf])
def test_a_tolerance_that_cannot_be_met_ends(rtol):
    phi, _, status, _ = solve([-3.0, 2.0, 8.0], [1e-3, 1.0, 1e4], 16, rtol=rtol)
    assert np.isin(status, [OK, UNRESOLVED]).all()
    assert (np.isnan(phi).all(axis=1) == (status != OK)).all()


def test_few_nodes_are_refused():
    phi, _, status, _ = solve([1.0], [1.0], 7)
    assert status.tolist() == [INVALID]
    assert np.isnan(phi).all()


def test_bits_do_not_depend_on_how_a_batch_is_cut():
    X, mu = scatter(300, seed=5)
    whole = solve(X, mu, 32)
    for cut in (1, 7, 299):
        parts = [solve(X[k : k + cut], mu[k : k + cut], 32) for k in range(0, 300, cut)]
        for number, axis in enumerate((0, 0, 0, 1)):
            np.testing.assert_array_equal(whole[number], np.concatenate([p[number] for p in parts], axis=axis))
    backwards = solve(X[::-1].copy(), mu[::-1].copy(), 32, profiles=False)
    np.testing.assert_array_equal(whole[0], backwards[0][::-1])


@pytest.fixture
def generations():
    if core.generation < 4:
        pytest.skip("this processor runs one of the two only")
    return [importlib.import_module(f"mbma_tables.core._x86_64_{level}") for level in ("v3", "v4")]


@pytest.mark.parametrize("nodes", [8, 13, 28, 96])
def test_generations_of_processors_give_the_same_bits(generations, nodes):
    older, newer = (solve(*scatter(200, seed=nodes), nodes, module=module) for module in generations)
    for a, b in zip(older, newer, strict=True):
        np.testing.assert_array_equal(a, b)


def test_they_do_of_height_integrals(generations):
    x = np.random.default_rng(6).uniform(-20, 42, 20_000)
    older, newer = np.empty((2, 5, x.size))
    for module, rows in zip(generations, (older, newer), strict=True):
        assert [module.height_integrals(k + 1, x, row) for k, row in enumerate(rows)] == [0] * 5
    np.testing.assert_array_equal(older, newer)


def test_plain_code_agrees_to_rounding():
    plain = importlib.import_module("mbma_tables.core._plain")
    X, mu = scatter(200, seed=8)
    found, other = (solve(X, mu, 64, module=module)[0] for module in (core, plain))
    np.testing.assert_allclose(found[:, :2], other[:, :2], rtol=2e-14)


@pytest.mark.parametrize("place", range(5))
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324])
def test_the_damped_iteration_is_told_anything(place, value):
    arguments = [2.0, 1.0, 3.0, 0.3, 1e-9]
    arguments[place] = value
    X, mu, a, damping, tolerance = arguments
    steps, converged, *phi, _, _ = damped(X, mu, a, damping=damping, tolerance=tolerance)
    assert 0 < steps <= 200
    if converged:
        assert np.isfinite(phi).all()


def test_the_damped_iteration_solves_its_equations():
    steps, converged, force, area, w, p = damped(2.0, 0.5, 3.0, most=30, tolerance=0)
    assert (steps, converged) == (30, False)
    assert np.isfinite([force, area]).all()
    *_, w, p = damped(2.0, 0.5, 3.0, tolerance=1e-12)
    rho = 3.0 * (np.arange(40) + 0.5) / 40
    np.testing.assert_allclose(p, 0.25 * height_integral(1.5, rho**2 - 2.0 + w), rtol=1e-13)
    np.testing.assert_allclose(w, 3.0 * ring_matrix(40) @ p, rtol=1e-10)


def test_extents_of_anything():
    X = np.array([2.0, math.nan, math.inf, 1.0, 1.0, -50.0, 1e308])
    mu = np.array([1.0, 1.0, 1.0, -1.0, math.nan, 1.0, 1.0])
    found = np.empty(X.size)
    assert core.island_extents(X, mu, 1e-12, found) == 4
    assert np.isnan(found).tolist() == [False, True, True, True, True, False, False]
    assert core.island_extents(X, mu, math.nan, found) == X.size


def test_sizes_are_checked():
    nodes = 16
    good = [
        np.zeros(2), np.zeros(2), 1e-6, *basis(nodes), *basis(COARSE_NODES), np.zeros((2, 3)),
        np.zeros(2, dtype=np.int64), np.zeros(2, dtype=np.uint8), *np.zeros((3, 2, nodes)),
        np.zeros(core.islands_work(nodes)),
    ]  # fmt: skip
    assert core.solve_islands(*good) == 0
    for place, argument in enumerate(good):
        if place != 2:
            for other in (argument.ravel()[:-1].copy(), None if place != 14 else argument[:1].copy()):
                with pytest.raises((TypeError, ValueError), match="core:"):
                    core.solve_islands(*good[:place], other, *good[place + 1 :])
