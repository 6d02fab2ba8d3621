"""Second block of docs/stability.md: the island solver beside `GreenwoodTripp` of ContactMechanics.

Both solve (34), (36), (37). ContactMechanics takes the gap in the middle, d(0), instead of X, and scales pressure by
E* sqrt(sigma/8B), which is half of E* sigma/L.
"""

from __future__ import annotations

import math
import warnings

import numpy as np
from scipy.integrate import simpson
from scipy.interpolate import BarycentricInterpolator

from generate.pages.page import Measured, panels, svg, table
from mbma_tables import greenwood_tripp
from mbma_tables.common.arguments import FloatArray
from mbma_tables.islands.greenwood_tripp import IslandSolution

CASES = ((2.0, 0.1), (0.0, 1.0), (5.0, 1.0), (8.0, 0.3), (5.0, 4.0))
POINTS = (26, 51, 101, 201)  # each with half the step of the one before
BEYOND = 1.02  # of our outer radius, beyond which both pressures vanish
TOLERANCE, MAX_ITERATIONS = 1e-9, 10_000


def theirs(solution: IslandSolution, points: int) -> tuple[FloatArray, FloatArray, float]:
    """Radii over L, pressure over E* sigma/L and Phi_F by ContactMechanics on so many points."""
    with warnings.catch_warnings():
        # of its own optional parts
        warnings.simplefilter("ignore")
        from ContactMechanics.ReferenceSolutions.GreenwoodTripp import GreenwoodTripp

    # profiles are polynomials of rho^2 through the Gauss nodes
    middle = float(BarycentricInterpolator(solution.rho**2, solution.gap)(0.0))
    mix = 0.1 if solution.mu < 2 else 0.02  # its iteration diverges with more
    end = BEYOND * solution.rho[-1]
    _, pressure, rho = GreenwoodTripp(middle, solution.mu, end, points, tol=TOLERANCE, mix=mix, maxiter=MAX_ITERATIONS)
    return rho, pressure / 2, math.pi * float(simpson(rho * pressure, x=rho))


def measure() -> Measured:
    """Forces and pressures of both solvers, and their differences against the other's number of points."""
    figure, (left, right) = panels(1, 2, (10, 4))
    rows, differences = [], []
    for X, mu in CASES:
        solution = greenwood_tripp.solve(X, mu)
        found = [theirs(solution, points) for points in POINTS]
        forces = np.array([force for _, _, force in found])
        differences.append(forces / solution.phi_F - 1)
        # what is left of an error of third order
        extrapolated = abs((8 * forces[-1] - forces[-2]) / 7 / solution.phi_F - 1)
        numbers = [f"{error:.1e}" for error in (solution.error, *differences[-1], extrapolated)]
        rows.append([f"{X:g}", f"{mu:g}", f"{solution.phi_F:.10f}", *numbers])
        rho, pressure, _ = found[1]
        (line,) = left.plot(solution.rho, solution.pressure / pressure[0], label=f"X = {X:g}, mu = {mu:g}")
        left.plot(rho[::3], pressure[::3] / pressure[0], ".", color=line.get_color())
        right.loglog(POINTS, np.abs(differences[-1]), ".-", color=line.get_color())
    right.loglog(POINTS, np.abs(differences).max() * (POINTS[0] / np.array(POINTS)) ** 3, "k:", label="third order")
    left.set(xlabel="radius  rho/L", ylabel="pressure  p/p(0)", title="lines: this library; dots: ContactMechanics")
    right.set(xlabel="points of ContactMechanics", ylabel="relative difference of force")
    right.set_xticks(POINTS, [f"{points}" for points in POINTS], minor=False)
    right.minorticks_off()
    left.legend()
    right.legend()
    header = ["X", "mu", "Phi_F", "its error", *(f"{points} points" for points in POINTS), "extrapolated"]
    return {"comparison": table(header, rows)}, {"docs/figures/islands.svg": svg(figure)}
