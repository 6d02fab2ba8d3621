"""The closed approximations of the rigid sphere: their stated errors, their ends, and their text."""

import mpmath
import numpy as np
import pytest

from generate.formulas.heights import HIGH, LOW, height_error, height_steps
from mbma_tables.formulas.expressions import evaluate_steps

ORDERS = {"rigid_F": 2.5, "rigid_A": 2.0}


def exact(name, x):
    """pi F_n(-X)/n or pi F_2(-X)/2 by quadrature in 25 digits."""
    order = mpmath.mpf(ORDERS[name])
    with mpmath.workdps(25):
        cuts = [-x, max(-x, -8), max(-x, 0), max(-x, 0) + 4, max(-x, 0) + 14]
        integral = mpmath.quad(lambda z: (z + x) ** order * mpmath.npdf(z), cuts)
        factor = mpmath.pi / 5 if name == "rigid_F" else mpmath.pi / 2
        return float(factor * integral)


@pytest.mark.parametrize("accuracy", [1e-2, 1e-3, 2e-5])
@pytest.mark.parametrize("name", list(ORDERS))
def test_the_text_keeps_its_stated_error(name, accuracy):
    X = np.array([LOW, -0.37, 0.0, 0.61, 1.3, 2.9, 6.7, 15.3, 33.1, HIGH])
    found = evaluate_steps(height_steps(accuracy), {"X": X}, [name])[name]
    error = np.abs(found / [exact(name, x) for x in X] - 1)
    stated = height_error(name, accuracy)
    assert error.max() <= stated * (1 + 1e-6)
    assert stated <= np.expm1(accuracy)


@pytest.mark.parametrize("name", list(ORDERS))
def test_beyond_the_range_it_tends_to_the_power_of_the_smooth_sphere(name):
    X = np.array([1e4, 1e6])
    found = evaluate_steps(height_steps(1e-2), {"X": X}, [name])[name]
    factor = np.pi / 5 if name == "rigid_F" else np.pi / 2
    assert np.abs(found / (factor * X ** ORDERS[name]) - 1).max() < 20 / X[0]


@pytest.mark.parametrize("name", list(ORDERS))
def test_it_rises(name):
    found = evaluate_steps(height_steps(1e-3), {"X": np.linspace(LOW, HIGH, 2001)}, [name])[name]
    assert (np.diff(found) > 0).all()


def test_more_accuracy_takes_a_longer_text():
    lengths = [sum(len(text) for _, text in height_steps(accuracy)) for accuracy in (1e-2, 1e-3, 2e-5)]
    assert lengths == sorted(set(lengths))


def test_an_accuracy_out_of_reach_is_refused():
    with pytest.raises(ValueError, match="no polynomial reaches"):
        height_error("rigid_F", 1e-15)
