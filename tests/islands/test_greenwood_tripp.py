"""The island problem: resolution, closed-form limits, published codes, invariants, profiles, bad input."""

import csv
import math
import pathlib
from importlib.util import find_spec

import numpy as np
import pytest
import scipy.integrate
import scipy.interpolate
import scipy.special
from hypothesis import given, settings
from hypothesis import strategies as st

from generate.cost import iterated, ring_matrix
from mbma_tables import (
    ConvergenceError,
    InputError,
    OutOfRangeError,
    greenwood_tripp,
)
from mbma_tables.islands.greenwood_tripp import height_integral

PUBLISHED = pathlib.Path(__file__).parents[1] / "data" / "greenwood_tripp.csv"

approaches = st.floats(-6, 40)
stiffnesses = st.floats(-14, 8).map(lambda power: 10**power)
several = settings(deadline=None, max_examples=60)


def rigid(X, mu):
    return mu * math.pi / 5 * height_integral(2.5, -X), math.pi / 2 * height_integral(
        2.0, -X
    )


def true_error(found, exact):
    return np.maximum(
        np.abs(found.phi_F / exact.phi_F - 1), np.abs(found.phi_A / exact.phi_A - 1)
    )


def scatter(count, low_X, high_X, low_mu, high_mu, seed):
    rng = np.random.default_rng(seed)
    return rng.uniform(low_X, high_X, count), 10 ** rng.uniform(low_mu, high_mu, count)


@pytest.mark.parametrize(
    "options",
    [{"rtol": 10.0**-k} for k in (3, 6, 9, 11)] + [{"nodes": n} for n in (16, 32, 64)],
)
def test_estimate_covers_the_true_error(options):
    X, mu = scatter(
        2000 if "rtol" in options else 500,
        -12,
        60,
        -20,
        10,
        seed=options.get("nodes") or round(-math.log10(options["rtol"])),
    )
    exact = greenwood_tripp.solve(X, mu, rtol=1e-13)
    solved = greenwood_tripp.solve(X, mu, **options)
    error = true_error(solved, exact)
    assert (error <= solved.error + exact.error).all()
    assert error.max() <= options.get("rtol", np.inf)
    assert (solved.nodes == options.get("nodes", solved.nodes)).all()


def test_no_failure_over_the_whole_range():
    X, mu = scatter(10_000, -12, 100, -28, 12, seed=2)
    solved = greenwood_tripp.solve(X, mu, rtol=1e-8)
    assert solved.error.max() <= 1e-8
    assert (solved.phi_F > 0).all()
    assert (solved.phi_A > 0).all()


@pytest.mark.parametrize("mu", [0.0, 1e-200, 1e-40, 1e-20])
def test_rigid_limit(mu):
    X = np.array([-12.0, -3.0, 0.0, 4.0, 24.0, 100.0])
    solved = greenwood_tripp.solve(X, mu, rtol=1e-13)
    force, area = rigid(X, mu)
    assert np.abs(solved.phi_A / area - 1).max() <= 1e-13
    if mu == 0:
        assert (solved.phi_F == 0).all()
    else:
        assert np.abs(solved.phi_F / force - 1).max() <= 1e-13


@pytest.mark.parametrize("mu", [0.1, 1.0, 100.0, 1e4, 1e6, 1e8])
def test_smooth_hertz_is_approached(mu):
    X = np.array([20.0, 40, 80, 160, 320])
    solved = greenwood_tripp.solve(X, mu, rtol=1e-8)
    ratio = solved.phi_F / (4 / 3 / math.sqrt(2) * X**1.5)
    distance = np.abs(ratio - 1)
    assert (np.diff(distance) < 0).all()
    # the roughness shifts the approach by about the gap that it holds open in the middle
    shift = X * (ratio ** (2 / 3) - 1)
    if mu >= 100:
        assert ((solved.gap[:, 0] < shift) & (shift < solved.gap[:, 0] + 0.6)).all()
        assert distance[-1] < 1.5 * (solved.gap[-1, 0] + 0.6) / X[-1] * (
            1 + 0.5 * 6 / X[-1]
        )


def test_published_codes():
    E_star = 1.1538e11
    sigma = 20e-6
    density = 2e8
    R_u = 30e-6
    R_d = 10e-3
    mu = 8 / 3 * density * sigma * math.sqrt(2 * R_u * R_d)
    L = math.sqrt(2 * R_d * sigma)
    with PUBLISHED.open() as lines:
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    table = {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}
    solved = greenwood_tripp.solve(-table["d_over_sigma"], mu)
    force = E_star * sigma * L * solved.phi_F
    area = math.pi * density * R_u * sigma * L**2 * solved.phi_A
    assert mu == pytest.approx(8.2624, abs=5e-5)
    assert np.abs(table["force_a_N"] / force - 1).max() <= 1.5e-3
    assert np.abs(table["force_b_N"] / force - 1).max() <= 1.5e-3
    assert np.abs(table["area_m2"] / area - 1).max() <= 1.5e-3


@several
@given(X=approaches, mu=stiffnesses, factor=st.floats(1.01, 100))
def test_rising_with_stiffness_and_below_rigid(X, mu, factor):
    solved = greenwood_tripp.solve(X, [mu, factor * mu])
    force, area = rigid(X, np.array([mu, factor * mu]))
    rounded = 1 + 1e-10
    assert 0 < solved.phi_F[0] < solved.phi_F[1]
    # stiffer roughness pushes the sphere away, and touches less
    assert solved.phi_A[1] <= solved.phi_A[0] * rounded
    assert (solved.phi_F <= force * rounded).all()
    assert (solved.phi_A <= area * rounded).all()


@pytest.mark.parametrize(
    ("X", "mu"),
    [(-6.0, 1e-14), (-4.0, 1e3), (2.0, 0.3), (8.0, 20.0), (30.0, 1e5), (40.0, 1e8)],
)
def test_profiles(X, mu):
    solved = greenwood_tripp.solve(X, mu, rtol=1e-11)
    rho = solved.rho
    pressure = solved.pressure
    gap = solved.gap
    assert rho.shape == pressure.shape == gap.shape == (solved.nodes,)
    law = mu / 2 * height_integral(1.5, gap)
    felt = pressure > 1e-6 * pressure.max()
    assert np.abs(pressure / law - 1)[felt].max() <= 1e-9

    # Gauss points in rho^2: their rule gives the totals, their interpolant Eq. (37) at any radius
    x, weights = np.polynomial.legendre.leggauss(rho.size)
    squared = rho[-1] ** 2 / ((1 + x[-1]) / 2)
    assert math.pi * squared * (weights / 2) @ pressure == pytest.approx(
        float(solved.phi_F), rel=1e-10, abs=0
    )
    covered = height_integral(1, gap)
    assert math.pi * squared * (weights / 2) @ covered == pytest.approx(
        float(solved.phi_A), rel=1e-10, abs=0
    )
    at = scipy.interpolate.BarycentricInterpolator(2 * rho**2 / squared - 1, pressure)

    def kernel(t, r):
        complement = ((t - r) / (t + r)) ** 2
        return (
            4
            / math.pi
            * t
            / (t + r)
            * at(2 * t * t / squared - 1)
            * scipy.special.ellipkm1(complement)
        )

    for k in (2, rho.size // 2, rho.size - 3):
        w = sum(
            scipy.integrate.quad(
                kernel, low, high, args=(rho[k],), epsrel=1e-11, limit=200
            )[0]
            for low, high in ((0, rho[k]), (rho[k], math.sqrt(squared)))
        )
        assert gap[k] == pytest.approx(rho[k] ** 2 - X + w, abs=1e-8 * max(1, abs(X)))


def test_underflow_is_smooth_and_no_touch_is_zero_without_a_warning():
    solved = greenwood_tripp.solve(np.linspace(-38.5, -36, 60), 1.0, rtol=1e-8)
    assert (np.diff([solved.phi_F, solved.phi_A]) >= 0).all()
    solved = greenwood_tripp.solve([-45.0, -1e3, -1e300], [[0.0], [1e-3], [1e12]])
    assert not np.any([solved.phi_F, solved.phi_A, solved.error])


def test_failure_says_where():
    with pytest.raises(
        ConvergenceError, match="1 of 3 entries, the first at X = 100000"
    ) as caught:
        greenwood_tripp.solve([1.0, 1e5, 2.0], 1.0, rtol=1e-12)
    assert caught.value.mask.tolist() == [False, True, False]
    assert (
        caught.value.result.phi_F[2] == greenwood_tripp.solve(2.0, 1.0, rtol=1e-12).phi_F
    )


def test_negative_stiffness():
    with pytest.raises(
        OutOfRangeError, match=r"mu must be at least 0, got -1 at \(1,\)"
    ) as caught:
        greenwood_tripp.solve(1.0, [1.0, -1.0])
    assert caught.value.mask.tolist() == [False, True]


BAD = {"rtol": (0.0, 1e-14, 0.5, math.nan, "tight"), "nodes": (7, 1025, 20.5)}


@pytest.mark.parametrize(
    ("option", "value"), [(option, value) for option in BAD for value in BAD[option]]
)
def test_bad_options(option, value):
    with pytest.raises(InputError, match=option):
        greenwood_tripp.solve(1.0, 1.0, **{option: value})


OTHERS = pytest.mark.skipif(
    find_spec("ContactMechanics") is None, reason="ContactMechanics is not installed"
)


@pytest.fixture(scope="module")
def theirs():
    """The function of the notebook that compares both programs."""
    page = pathlib.Path(__file__).parents[2] / "docs" / "tutorials" / "other_program.md"
    names = {}
    exec(
        page.read_text(encoding="utf-8")
        .partition("```{code-cell}\n")[2]
        .partition("```")[0],
        names,
    )
    return names["theirs"]


@OTHERS
@pytest.mark.slow
@pytest.mark.parametrize(("X", "mu"), [(2.0, 0.1), (0.0, 1.0), (5.0, 1.0), (5.0, 4.0)])
def test_the_difference_from_contactmechanics_is_its_discretisation(theirs, X, mu):
    solution = greenwood_tripp.solve(X, mu)
    forces = np.array([theirs(solution, points)[2] for points in (26, 51)])
    error = forces / solution.phi_F - 1
    # of third order in its step
    assert (np.abs(error) < [5e-4, 7e-5]).all()
    assert 6.5 < error[0] / error[1] < 10
    assert abs((8 * forces[1] - forces[0]) / 7 / solution.phi_F - 1) < abs(error[1]) / 3


@OTHERS
def test_pressures_of_the_package_contactmechanics(theirs):
    solution = greenwood_tripp.solve(2.0, 0.1)
    rho, pressure, _ = theirs(solution, 21)
    inside = rho < solution.rho[-1]
    own = scipy.interpolate.BarycentricInterpolator(solution.rho**2, solution.pressure)(
        rho[inside] ** 2
    )
    assert np.abs(pressure[inside] - own).max() < 1e-4 * pressure[0]


@pytest.mark.parametrize(
    ("X", "mu"), [(5.0, 0.01), (5.0, 1.0), (2.0, 0.5), (5.0, 3.0), (0.0, 4.0)]
)
def test_the_damped_iteration_errs_like_the_square_of_the_ring_width(X, mu):
    exact = greenwood_tripp.solve(X, mu, rtol=1e-12)
    error = []
    for rings in (50, 100, 200, 400):
        _, converged, phi_F, phi_A = iterated(X, mu, ring_matrix(rings), 1e-10)
        assert converged
        error.append(abs(phi_F / exact.phi_F - 1))
        assert max(error[-1], abs(phi_A / exact.phi_A - 1)) < 5e-3
    order = np.log2(np.array(error[1:-1]) / error[2:])
    assert (order > 1.8).all(), order
    assert not iterated(5.0, 1e6, ring_matrix(60), 1e-10)[1]
