"""The damped iteration of Greenwood and Tripp, which costs are compared with: agreement, mesh error, divergence."""

import numpy as np
import pytest

from generate.pages.classical import iterated, ring_matrix
from mbma_tables import greenwood_tripp

CASES = [(5.0, 0.01), (5.0, 1.0), (2.0, 0.5), (5.0, 3.0), (0.0, 4.0)]


@pytest.mark.parametrize(("X", "mu"), CASES)
def test_mesh_error_falls_like_the_square_of_the_ring_width(X, mu):
    exact, error = greenwood_tripp.solve(X, mu, rtol=1e-12), []
    for rings in (50, 100, 200, 400):
        _, converged, phi_F, phi_A = iterated(X, mu, ring_matrix(rings), 1e-10)
        assert converged
        error.append(abs(phi_F / exact.phi_F - 1))
        assert max(error[-1], abs(phi_A / exact.phi_A - 1)) < 5e-3
    order = np.log2(np.array(error[1:-1]) / error[2:])
    assert (order > 1.8).all(), order


def test_divergence():
    assert not iterated(5.0, 1e6, ring_matrix(60), 1e-10)[1]
