"""Reynolds' equation on gaps: closed forms, another solver, and ways that are open or blocked."""

import numpy as np
import pytest
from helpers import random_map

from mbma_tables.common.errors import InputError, OutOfRangeError
from mbma_tables.laws.reynolds import flow_conductance, open_ways


def test_scale_of_gaps_and_sides():
    gap = np.exp(0.3 * np.random.default_rng(1).standard_normal((20, 40)))
    first = flow_conductance(gap, (1.0, 2.0))
    np.testing.assert_allclose(flow_conductance(1e-3 * gap, (3.0, 6.0)), 1e-9 * first, rtol=1e-10)
    np.testing.assert_allclose(flow_conductance(gap.T, (2.0, 1.0)), first[::-1], rtol=1e-10)


def test_a_dam_blocks_one_way():
    gap = np.ones((16, 16))
    gap[5] = 0
    np.testing.assert_allclose(flow_conductance(gap), [0.0, 15 / 16], rtol=1e-12)
    gap[:, 7] = 0
    assert flow_conductance(gap).tolist() == [0.0, 0.0]


def test_a_slanted_channel_is_open_both_ways():
    # steps of one along x and y in turn: 32 faces in series
    gap = np.zeros((16, 16))
    for i in range(16):
        gap[i, i] = gap[i, (i + 1) % 16] = 1.0
    assert open_ways(gap)[1] == (True, True)
    np.testing.assert_allclose(flow_conductance(gap), 1 / 32, rtol=1e-12)


def test_dead_ends_carry_nothing():
    gap = np.zeros((16, 16))
    gap[:, 3] = 1.0
    straight = flow_conductance(gap)
    # a branch, and a hole that leads nowhere
    gap[4, 3:9] = gap[10:13, 10:13] = 5.0
    gap[4, 3] = 1.0
    assert (open_ways(gap)[0] > 0).sum() == 16 + 5
    np.testing.assert_allclose(flow_conductance(gap), straight, rtol=1e-12)


@pytest.mark.slow
def test_another_solver():
    transport = pytest.importorskip("reynoldsflow.transport")
    field = random_map(64, 1.99 / 64, 12.01 / 64, power=0, seed=3)
    # 5% and 30% of the points touch
    for level, touching in ((1.6, 0.055), (0.5, 0.31)):
        gap = np.maximum(field / field.std() + level, 0)
        assert np.mean(gap == 0) == pytest.approx(touching, abs=0.03)
        for axis, values in enumerate((gap, gap.T)):
            kept, _, flux = transport.solve_fluid_problem(values, "scipy-spsolve", boundary_mode="periodic")
            theirs, _ = transport.compute_total_flux(kept, flux, 64, "periodic")
            assert flow_conductance(gap)[axis] == pytest.approx(theirs, rel=1e-6)


@pytest.mark.parametrize("gap", [np.ones(4), np.full((4, 4), -1.0), np.full((4, 4), np.nan)])
def test_no_gaps(gap):
    with pytest.raises((InputError, OutOfRangeError), match="gap"):
        flow_conductance(gap)
