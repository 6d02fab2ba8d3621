"""Differences that derivatives of theories are made of, against derivatives in closed form."""

import numpy as np
import pytest

from mbma_tables import ConvergenceError, Surface, contact
from mbma_tables.theories.differences import HALVINGS, differences

FUNCTIONS = (np.exp, lambda x: 1 / (2 + x), lambda x: np.sqrt(1 + x) * np.cos(3 * x), lambda x: 5.0 + 0 * x)
SLOPES = np.array([1.0, -0.25, 0.5, 0.0])


def function(entry, x):
    return np.choose(entry, [f(x) for f in FUNCTIONS])


@pytest.mark.parametrize("side", [0.0, 1.0, -1.0])
@pytest.mark.parametrize("step", [1e-4, 0.02, 0.3])
def test_derivatives_and_their_errors(side, step):
    found, error = differences(
        lambda k, x: np.stack([function(k, x), 2 * function(k, x)]),
        np.full(4, step), np.full(4, side), np.ones((2, 4)),
    )  # fmt: skip
    assert (np.abs(found - [SLOPES, 2 * SLOPES]) <= np.maximum(error, 1e-8)).all()
    assert (error <= 1e-6).all()


def test_steps_are_halved_where_that_is_needed_alone():
    asked = []

    def rough(k, x):
        asked.append(np.unique(k))
        return np.where(k == 1, np.tanh(300 * x), np.sin(x))[None]

    found, error = differences(rough, np.full(3, 0.02), np.zeros(3), np.ones((1, 3)))
    assert found[0] == pytest.approx([1, 300, 1], rel=1e-6)
    assert (error < 1e-3).all()
    assert [len(k) for k in asked] == [3] + [1] * (len(asked) - 1)
    asked.clear()
    found, error = differences(lambda k, x: 1.0 * (x[None] > 0), np.full(3, 0.02), np.zeros(3), np.ones((1, 3)))
    assert (error > 0.1).all()
    found, error = differences(lambda k, x: np.full((1, x.size), np.nan), np.ones(3), np.zeros(3), np.ones((1, 3)))
    assert not (error <= 1).any()
    assert len(asked) <= HALVINGS


def test_a_force_without_bound_has_no_derivative():
    surface = Surface(0.8, 0.01, 2.0, 1.0, 3.0)
    with pytest.raises(ConvergenceError, match="no derivative of pressure by mean_separation was found") as caught:
        contact(surface, mean_separation=[0.0, 1.0], theory="calibrated", derivatives=True)
    assert caught.value.mask.tolist() == [True, False]


@pytest.mark.parametrize("cap", [0.03, np.inf])
def test_forces_that_no_gap_resolves_are_refused(cap):
    surface, asked = Surface(0.8, 0.01, 2.0, 1.0, 3.0), {"pressure": [1e-150, 1e-3], "hardness": cap}
    # lighter than what is left where h_max - u is rounding
    with pytest.raises(ConvergenceError, match="the separation at this pressure was not found for 1 entries") as caught:
        contact(surface, **asked, theory="mbma")
    assert caught.value.mask.tolist() == [True, False]
    found = contact(surface, **asked, theory="greenwood_williamson")
    assert found.pressure == pytest.approx([1e-150, 1e-3], rel=1e-10)
