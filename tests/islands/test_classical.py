"""The damped iteration of Greenwood and Tripp: agreement, mesh error, divergence, interruption."""

import signal

import numpy as np
import pytest

from mbma_tables import ConvergenceError, greenwood_tripp

CASES = [(5.0, 0.01), (5.0, 1.0), (2.0, 0.5), (5.0, 3.0), (0.0, 4.0)]


@pytest.mark.parametrize(("X", "mu"), CASES)
def test_mesh_error_is_within_its_estimate_and_falls_like_the_square_of_the_ring_width(X, mu):
    exact, error = greenwood_tripp.solve(X, mu, rtol=1e-12), []
    for rings in (50, 100, 200, 400):
        found = greenwood_tripp.solve(X, mu, method="classical", nodes=rings)
        error.append(abs(found.phi_F / exact.phi_F - 1))
        assert max(error[-1], abs(found.phi_A / exact.phi_A - 1)) <= found.error < 5e-3
        assert (found.nodes, found.method) == (rings, "classical")
    order = np.log2(np.array(error[1:-1]) / error[2:])
    assert (order > 1.8).all(), order


def test_profiles():
    found = greenwood_tripp.solve([2.0, 5.0], 1.0, method="classical", nodes=200)
    newton = greenwood_tripp.solve([2.0, 5.0], 1.0)
    assert found.rho.shape == found.pressure.shape == found.gap.shape == (2, 200)
    for k in range(2):
        there = np.interp(found.rho[k], newton.rho[k], newton.pressure[k])
        inside = found.rho[k] < 0.7 * newton.rho[k].max()
        assert np.abs(found.pressure[k] - there)[inside].max() <= 0.01 * newton.pressure[k].max()


def test_divergence_is_an_error_with_its_mask():
    with pytest.raises(ConvergenceError, match="2 of 4 entries, the first at X = 5, mu = 1000") as caught:
        greenwood_tripp.solve(5.0, [0.1, 1e3, 1.0, 1e6], method="classical", nodes=60)
    assert caught.value.mask.tolist() == [False, True, False, True]
    reached = caught.value.result
    exact = greenwood_tripp.solve(5.0, 0.1)
    assert abs(reached.phi_F[0] / exact.phi_F - 1) <= reached.error[0]


def test_a_signal_is_heard_within_a_long_iteration():
    class Rung(Exception):
        pass

    def ring(*_):
        raise Rung

    greenwood_tripp.solve(5.0, 1.0, method="classical", nodes=60)
    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, 0.2)
    try:
        # hours, if it ran to its end
        with pytest.raises(Rung):
            greenwood_tripp.solve(5.0, 1.0, method="classical", damping=1e-6, max_iterations=10**9)
    finally:
        signal.signal(signal.SIGALRM, before)
