"""`greenwood_tripp.solve` against the solver of the same problem in the package ContactMechanics, written by others."""

from importlib.util import find_spec

import numpy as np
import pytest
from scipy.interpolate import BarycentricInterpolator

from generate.pages import stability
from mbma_tables import greenwood_tripp

pytestmark = pytest.mark.skipif(find_spec("ContactMechanics") is None, reason="ContactMechanics is not installed")


@pytest.mark.slow
@pytest.mark.parametrize(("X", "mu"), [(2.0, 0.1), (0.0, 1.0), (5.0, 1.0), (5.0, 4.0)])
def test_the_difference_is_the_other_discretisation(X, mu):
    solution = greenwood_tripp.solve(X, mu)
    forces = np.array([stability.theirs(solution, points)[2] for points in (26, 51)])
    error = forces / solution.phi_F - 1
    # of third order in its step
    assert (np.abs(error) < [5e-4, 7e-5]).all()
    assert 6.5 < error[0] / error[1] < 10
    assert abs((8 * forces[1] - forces[0]) / 7 / solution.phi_F - 1) < abs(error[1]) / 3


def test_pressures_agree():
    solution = greenwood_tripp.solve(2.0, 0.1)
    rho, pressure, _ = stability.theirs(solution, 21)
    inside = rho < solution.rho[-1]
    own = BarycentricInterpolator(solution.rho**2, solution.pressure)(rho[inside] ** 2)
    assert np.abs(pressure[inside] - own).max() < 1e-4 * pressure[0]
