"""The spectral half-space operator and its Gauss rule against closed forms and high precision."""

import math

import mpmath as mp
import numpy as np
import pytest
import scipy.special

from mbma_tables.islands.spectral import basis, gauss_legendre


@pytest.mark.parametrize("n", [1, 2, 3, 16, 33, 128, 385])
def test_gauss_rule_to_its_ends(n):
    nodes, weights = gauss_legendre(n)
    # 1 - x rounded to eps moves P_{n-1} by n eps/2, and the weight by n eps; twice that again for the recurrence
    allowed = 4 * max(n, 4) * np.finfo(float).eps
    with mp.workdps(40):
        for k in sorted({0, min(1, n - 1), n // 4, n // 2, n - 1}):
            x = 2 * mp.mpf(float(nodes[k])) - 1
            for _ in range(4):
                value, previous = mp.legendre(n, x), mp.legendre(n - 1, x)
                x -= value * (x * x - 1) / (n * (x * value - previous))
            weight = (1 - x * x) / (n * mp.legendre(n - 1, x)) ** 2
            assert abs(mp.mpf(float(nodes[k])) / ((1 + x) / 2) - 1) <= 1e-15
            assert abs(mp.mpf(float(weights[k])) / weight - 1) <= allowed
    assert nodes.size == n
    assert (np.diff(nodes) > 0).all()


@pytest.mark.parametrize("n", [12, 40])
def test_uniform_pressure_displaces_the_known_volume(n):
    # w = (4/pi) E(rho/a), whose mean over the disc is 16/(3 pi)
    b = basis(n)
    assert b.root_weights @ b.operator @ b.root_weights == pytest.approx(16 / (3 * math.pi), rel=1e-14, abs=0)


def test_smooth_pressure_displaces_as_hankel_transforms_say():
    # p = exp(-s^2 rho^2): w(rho) = (sqrt(pi)/s) exp(-z) I_0(z), z = s^2 rho^2/2
    b = basis(48)
    squared = 36.0
    p = np.exp(-squared * b.v)
    w = b.operator @ (p * b.root_weights) / b.root_weights
    known = math.sqrt(math.pi / squared) * scipy.special.ive(0, squared * b.v / 2)
    assert np.abs(w / known - 1).max() <= 1e-13


@pytest.mark.parametrize("n", [16, 64, 192])
def test_operator_is_symmetric_and_positive(n):
    b = basis(n)
    assert np.array_equal(b.operator, b.operator.T)
    assert np.linalg.eigvalsh(b.operator).min() > 0
    assert np.abs(b.modes @ b.modes.T - np.eye(n)).max() <= 1e-12
