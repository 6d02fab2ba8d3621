"""`greenwood_tripp.solve` against the solver of the same problem in the package ContactMechanics, written by others."""

import math
import warnings
from importlib.util import find_spec

import numpy as np
import pytest
from scipy.integrate import simpson
from scipy.interpolate import BarycentricInterpolator

from mbma_tables import greenwood_tripp

pytestmark = pytest.mark.skipif(find_spec("ContactMechanics") is None, reason="ContactMechanics is not installed")


def theirs(solution, points):
    """Radii, pressure and Phi_F by ContactMechanics, as docs/tutorials/other_program.md has them."""
    with warnings.catch_warnings():
        # of its own optional parts
        warnings.simplefilter("ignore")
        from ContactMechanics.ReferenceSolutions.GreenwoodTripp import GreenwoodTripp
    middle = float(BarycentricInterpolator(solution.rho**2, solution.gap)(0.0))
    mix, end = 0.1 if solution.mu < 2 else 0.02, 1.02 * solution.rho[-1]
    _, pressure, rho = GreenwoodTripp(middle, solution.mu, end, points, tol=1e-9, mix=mix, maxiter=10_000)
    return rho, pressure / 2, math.pi * float(simpson(rho * pressure, x=rho))


@pytest.mark.slow
@pytest.mark.parametrize(("X", "mu"), [(2.0, 0.1), (0.0, 1.0), (5.0, 1.0), (5.0, 4.0)])
def test_the_difference_is_the_other_discretisation(X, mu):
    solution = greenwood_tripp.solve(X, mu)
    forces = np.array([theirs(solution, points)[2] for points in (26, 51)])
    error = forces / solution.phi_F - 1
    # of third order in its step
    assert (np.abs(error) < [5e-4, 7e-5]).all()
    assert 6.5 < error[0] / error[1] < 10
    assert abs((8 * forces[1] - forces[0]) / 7 / solution.phi_F - 1) < abs(error[1]) / 3


def test_pressures_agree():
    solution = greenwood_tripp.solve(2.0, 0.1)
    rho, pressure, _ = theirs(solution, 21)
    inside = rho < solution.rho[-1]
    own = BarycentricInterpolator(solution.rho**2, solution.pressure)(rho[inside] ** 2)
    assert np.abs(pressure[inside] - own).max() < 1e-4 * pressure[0]
