"""`UniversalModel` against the solver within the error that it states, and at every edge."""

import dataclasses

import numpy as np
import pytest
from numpy.polynomial.chebyshev import chebval2d
from small_tables import small_table

from generate.tables.writing import write_table
from mbma_tables import OutOfRangeError, greenwood_tripp
from mbma_tables.models.tables import open_table, universal_model
from mbma_tables.models.universal import UniversalModel
from mbma_tables.tablefiles.schema import CELL_EDGES, ISLAND4D, UNIVERSAL


@pytest.fixture(scope="module")
def small():
    return UniversalModel(small_table(UNIVERSAL))


def largest_error(model, X, mu):
    """Largest relative error, largest share of the stated bound, and the bounds."""
    found = model.answer(X, mu)
    solved = greenwood_tripp.solve(X, mu, rtol=1e-12)
    error = np.maximum(np.abs(found.phi_F / solved.phi_F - 1), np.abs(found.phi_A / solved.phi_A - 1))
    return error, found.error


def test_the_smallest_mu_and_the_rigid_limit():
    model = universal_model()
    X_axis = model.content.axes[0]
    rng = np.random.default_rng(21)
    X = rng.uniform(X_axis.low, X_axis.high, 300)
    mu = 10 ** rng.uniform(-30, -8, 300)
    error, bound = largest_error(model, X, mu)
    assert (error <= bound).all()
    rigid = greenwood_tripp.rigid_sphere(X, np.ones(300))
    value, _, by_mu = model.slopes(X, np.zeros(300))
    assert (np.abs(np.stack([by_mu.phi_F, value.phi_A]) / rigid - 1) <= value.error).all()
    np.testing.assert_array_equal(value.phi_F, 0)
    np.testing.assert_array_equal(model.answer(X, np.zeros(300)).phi_F, 0)


def test_edges_to_the_last_bit(small):
    X_axis, mu_axis = small.content.axes
    inside = np.array([1.0])
    for x in (X_axis.low, X_axis.high):
        found = small.answer(np.array([x]), inside)
        solved = greenwood_tripp.solve(x, 1.0)
        assert abs(found.phi_F[0] / solved.phi_F - 1) <= found.error[0]
    for x in (np.nextafter(X_axis.low, -np.inf), np.nextafter(X_axis.high, np.inf)):
        with pytest.raises(OutOfRangeError, match=r"X must be in \[-2, 6\]"):
            small.answer(np.array([x]), inside)
    top = small.answer(inside, np.array([mu_axis.high]))
    assert abs(top.phi_F[0] / greenwood_tripp.solve(1.0, mu_axis.high).phi_F - 1) <= top.error[0]
    with pytest.raises(OutOfRangeError, match=r"mu must be in \[0, 100\]"):
        small.answer(inside, np.array([np.nextafter(mu_axis.high, np.inf)]))


def test_every_cell_answers_with_its_own_series_and_error(small):
    """Against numpy's Chebyshev series, in the middle of each cell and next to its edges."""
    content = small.content
    edges = [content.auxiliary[name][1] for name in CELL_EDGES]
    for cell, (X_low, X_high, mu_low, mu_high) in enumerate(zip(*edges, strict=True)):
        middle = np.sqrt(mu_low * mu_high)
        for share in (1e-9, 0.5, 1 - 1e-9):
            X, mu = X_low + share * (X_high - X_low), mu_low + share * (mu_high - mu_low)
            ratio = 2 * mu / mu_high - 1
            if mu_low > 0:
                slope = (np.sqrt(mu_high) + np.sqrt(mu_low)) / (np.sqrt(mu_high) - np.sqrt(mu_low))
                ratio = slope * (mu - middle) / (mu + middle)
            by_hand = chebval2d(2 * share - 1, ratio, content.coefficients[cell])
            found = small.answer(X, mu)
            np.testing.assert_allclose([found.phi_F, found.phi_A], by_hand * [mu, 1], rtol=1e-13)
            assert found.error == content.local_error[cell].max()


def test_shipped_tables_are_opened_once_and_files_by_their_kind(tmp_path):
    assert open_table("universal") is universal_model() is open_table()
    path = write_table(tmp_path / "other.nc", small_table(ISLAND4D))
    model = open_table(path)
    assert model.name == "island4d"
    # an opened table does not follow its file, and a replaced one is opened again
    content = small_table(ISLAND4D)
    write_table(path, dataclasses.replace(content, attributes=content.attributes | {"history": "another"}))
    assert model.content.attributes["history"] != "another"
    assert open_table(path).content.attributes["history"] == "another"


@pytest.mark.parametrize("shape", [(2, 3), (1, 2, 2)])
def test_marks_have_the_shape_of_the_arguments(small, shape):
    last = np.zeros(shape, dtype=bool)
    last.flat[-1] = True
    for bad in (np.nan, np.inf, -np.inf, 1e9, -1e9):
        for given in ((np.where(last, bad, 0.0), np.ones(shape)), (np.zeros(shape), np.where(last, bad, 1.0))):
            with pytest.raises(OutOfRangeError) as caught:
                small.answer(*given)
            np.testing.assert_array_equal(caught.value.mask, last)
