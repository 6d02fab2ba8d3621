"""`greenwood_tripp.solve` against composite panels in rho with the elliptic kernel itself (panels.py)."""

import math

import numpy as np
import panels
import pytest
import scipy.special
from scipy.stats import qmc

from mbma_tables import greenwood_tripp, height_integral

COARSE, FINE = (4, 12), (6, 18)
CORNERS = [(X, mu) for X in (-6.0, 40.0) for mu in (1e-14, 1e8)]


def scattered(count: int) -> list[tuple[float, float]]:
    points = qmc.scale(qmc.LatinHypercube(2, rng=7).random(count), [-6, -14], [40, 8])
    return [(float(X), float(10**log_mu)) for X, log_mu in points]


def worst(ours: tuple[float, float], theirs: tuple[float, float]) -> float:
    return max(abs(a / b - 1) for a, b in zip(ours, theirs, strict=True))


def test_its_own_height_integrals():
    x = np.linspace(-40, 14, 1081)
    for n in (0.5, 1.5):
        assert np.abs(panels.trapezoidal(n, x) / height_integral(n, x) - 1).max() <= 1e-13
    assert np.abs(panels.first(x) / height_integral(1, x) - 1).max() <= 1e-12


@pytest.mark.parametrize("grid", [COARSE, FINE])
def test_its_own_operator(grid):
    # uniform pressure on a disc: w = (4/pi) E(rho/a)
    rule = panels.panels(*grid)
    known = 4 / math.pi * scipy.special.ellipe(rule.rho**2)
    assert np.abs(rule.matrix.sum(axis=1) / known - 1).max() <= 1e-14


def test_its_own_convergence():
    for X, mu in CORNERS + scattered(12):
        assert worst(panels.solve(X, mu, *COARSE), panels.solve(X, mu, *FINE)) <= 2e-14, (X, mu)


@pytest.mark.parametrize("rtol", [1e-10, 1e-12])
def test_agreement(rtol):
    points = CORNERS + scattered(60)
    solved = greenwood_tripp.solve(*np.array(points).T, rtol=rtol)
    theirs = np.array([panels.solve(X, mu, *COARSE) for X, mu in points])
    error = np.abs(np.stack([solved.phi_F, solved.phi_A], axis=1) / theirs - 1).max(axis=1)
    assert error.max() <= rtol
    assert (error <= solved.error).all()


def test_agreement_at_first_order_in_mu():
    # Phi_F = rigid (1 - c mu): c from one application of the other operator to the rigid pressure
    rule = panels.panels(*FINE)
    for X in (-3.0, 2.0, 15.0):
        a = panels.outer_radius(X, 0.0)
        ring = 2 * math.pi * a * a * rule.rho * rule.weights
        gap = (a * rule.rho) ** 2 - X
        w = a * rule.matrix @ (panels.trapezoidal(1.5, gap) / 2)
        rigid = ring @ (panels.trapezoidal(1.5, gap) / 2)
        known = ring @ (0.75 * panels.trapezoidal(0.5, gap) * w) / rigid
        mu = np.array([1e-3, 2e-3]) / known
        loss = (1 - greenwood_tripp.solve(X, mu, rtol=1e-13).phi_F / (mu * rigid)) / mu
        extrapolated = 2 * loss[0] - loss[1]
        assert extrapolated == pytest.approx(known, rel=2e-5, abs=0)
