"""The fit of the closed totals: its samples, its choice of terms; and the shipped form against exact solves."""

import itertools

import numpy as np
from scipy.optimize import linprog

from generate.formulas.terms import least_largest
from generate.formulas.totals import LEAST_AREA, NAMES, RANGE, anneal, arguments, eliminate, samples
from mbma_tables import Surface, contact
from mbma_tables.formulas.file import TOTALS, get_form


def test_samples_keep_to_the_range_and_reach_its_corners():
    given, truth = samples(4000, 7)
    for name, (low, high) in RANGE.items():
        assert ((given[name] >= low) & (given[name] <= high)).all()
    assert (truth["area"] > LEAST_AREA).all()
    drawn = arguments(4000, 7)
    for corner in itertools.product(*(RANGE[name] for name in ("h_max_over_h_rms", "zeta_1", "hurst"))):
        at = [
            np.isclose(drawn[name], value, rtol=1e-12, atol=0)
            for name, value in zip(("h_max_over_h_rms", "zeta_1", "hurst"), corner, strict=True)
        ]
        assert np.logical_and.reduce(at).any()


def test_the_columns_that_made_the_values_are_found():
    rng = np.random.default_rng(3)
    M = rng.uniform(-1, 1, (400, 30))
    planted = [2, 11, 17, 26]
    target = M[:, planted] @ [1.0, -0.4, 0.7, 0.2] + 0.01 * rng.uniform(-1, 1, 400)
    assert sorted(anneal(M, target, eliminate(M, target, 4))) == planted
    assert sorted(anneal(M, target, [0, 1, 3, 4])) == planted


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


def test_shipped_totals_are_within_a_tenth_of_the_exact_solver():
    rng = np.random.default_rng(5)
    ends = [RANGE[name] for name in ("h_max_over_h_rms", "zeta_1", "hurst")]
    corners = np.array(list(itertools.product(*ends)))
    other = np.stack([rng.uniform(3, 4.5, 12), np.exp(rng.uniform(*np.log(ends[1]), 12)), rng.uniform(0.5, 1, 12)], 1)
    top, zeta_1, hurst = np.concatenate([corners, other]).T[:, :, None]
    gap = top * np.linspace(-1, 0.9, 40)
    found = contact(Surface(hurst, 1.0, zeta_1, 1.0, top), gap, tier="exact", rtol=1e-6)
    seen = found.area > LEAST_AREA
    fields = {"d_over_h_rms": gap, "h_max_over_h_rms": top, "zeta_1": zeta_1, "hurst": hurst}
    told = get_form(TOTALS).evaluate({name: np.broadcast_to(a, gap.shape)[seen] for name, a in fields.items()})
    for name in NAMES:
        assert np.abs(told[name] / getattr(found, name)[seen] - 1).max() <= 0.1
