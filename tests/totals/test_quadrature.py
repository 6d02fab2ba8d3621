"""The batch quadrature: the rule itself, many integrals of unlike size, failure."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mbma_tables import ConvergenceError, Surface
from mbma_tables.models.named import get_model
from mbma_tables.surfaces.variants import get_variant
from mbma_tables.totals.island_sum import Pairs, integrate, totals_of


def run(function, low, high, rtol=1e-10, owner=None):
    """Integrate one-component `function(owner, x)`."""
    low, high = np.atleast_1d(np.asarray(low, float)), np.atleast_1d(np.asarray(high, float))
    owners = np.arange(low.size) if owner is None else np.asarray(owner)
    return integrate(lambda who, x: function(who[:, None], x)[..., None], owners, low, high, owners.max() + 1, rtol)


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-10, 1e-13])
def test_each_integral_to_its_own_size(rtol):
    # integral of scale exp(-(x/width)^2) over [-1, 1]
    width = np.array([1.0, 1e-1, 1e-3, 1e-4])
    scale = np.array([1e-200, 1.0, 1e100, 1e-20])
    found = run(lambda who, x: scale[who] * np.exp(-((x / width[who]) ** 2)), -np.ones(4), np.ones(4), rtol)
    known = scale * math.sqrt(math.pi) * width * [math.erf(1 / w) for w in width]
    error = np.abs(found.value[:, 0] / known - 1)
    assert (error <= np.maximum(found.error[:, 0], 4e-15)).all()
    assert found.error.max() <= rtol


@settings(deadline=None)
@given(power=st.floats(-0.5, 8), high=st.floats(1e-8, 1e8))
def test_end_point_powers(power, high):
    found = run(lambda who, x: x**power, 0.0, high, 1e-8)
    known = high ** (power + 1) / (power + 1)
    assert abs(found.value[0, 0] / known - 1) <= 1e-8


def test_several_intervals_of_one_owner_and_none():
    found = integrate(
        lambda who, x: np.stack([x, x**2], axis=-1),
        np.array([0, 2, 0]),
        np.array([0.0, 0.0, 1.0]),
        np.array([1.0, 3.0, 2.0]),
        3,
        1e-12,
    )
    assert found.value == pytest.approx(np.array([[2.0, 8 / 3], [0, 0], [4.5, 9.0]]), rel=1e-14, abs=0)
    assert (found.error[1] == 0).all()


def test_failure_says_which():
    with pytest.raises(ConvergenceError, match="1 of 3") as caught:
        run(lambda who, x: np.where(who == 1, x**-1.0, x), np.zeros(3), np.ones(3))
    assert caught.value.mask.tolist() == [False, True, False]


def test_the_estimate_is_of_the_kronrod_sum():
    """Not of the Gauss sum, which is far worse: where that one alone misses the tolerance, nothing is halved."""
    x, weights = np.polynomial.legendre.leggauss(10)
    true, gauss = 4 + 0.4 * math.sin(5), weights @ (2 + np.cos(5 * x))
    rtol = abs(gauss / true - 1) / 5
    ends = np.array([-1.0]), np.array([1.0])
    found = integrate(lambda _, points: 2 + np.cos(5 * points)[..., None], np.array([0]), *ends, 1, rtol)
    assert found.evaluations == 21
    assert abs(found.value[0, 0] / true - 1) <= found.error[0, 0] <= rtol


@pytest.mark.slow
@pytest.mark.parametrize("name", ["reported", "printed", "fitted"])
def test_stated_errors_of_totals(name):
    # of a force and an area that are nearly proportional both differences between the rules may vanish by chance
    rng, variant, count = np.random.default_rng(1), get_variant(name), 100_000
    low, high = (0.1, np.log(max(3.1, 1.01 * variant.floor_u)), 2.5, 0), (1, np.log(1e4), 5.5, 1)
    hurst, log_zeta, peak, share = rng.uniform(low, high, (count, 4)).T
    surface = Surface(hurst, np.ones(count), np.exp(log_zeta), np.ones(count), peak)
    pairs = Pairs.of(surface, 2 * peak * share**1.5)
    found, known = (totals_of(get_model("universal", 1e-8, variant), pairs, variant, rtol) for rtol in (1e-8, 1e-12))
    with np.errstate(invalid="ignore"):
        off = [np.nan_to_num(np.abs(a / b - 1)) for a, b in ((found.force, known.force), (found.area, known.area))]
    assert (np.max(off, axis=0) <= found.error).all()
    assert found.error.max() <= 1e-8
