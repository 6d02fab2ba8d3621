"""`UniversalModel` against the solver within the error that it states, and at every edge."""

import dataclasses
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from small_tables import small_table

from mbma_tables import OutOfRangeError, greenwood_tripp
from mbma_tables.models import tables as tabulated
from mbma_tables.models.tables import open_table, universal_model
from mbma_tables.models.universal import UniversalModel
from mbma_tables.tablefiles.netcdf import read_table, write_table
from mbma_tables.tablefiles.schema import ISLAND4D, UNIVERSAL, error_cell


@pytest.fixture(scope="module")
def small():
    return UniversalModel(small_table(UNIVERSAL))


def shipped_model():
    return UniversalModel(read_table(tabulated.shipped(UNIVERSAL), UNIVERSAL))


def largest_error(model, X, mu):
    """Largest relative error, largest share of the stated bound, and the bounds."""
    found = model.answer(X, mu)
    solved = greenwood_tripp.solve(X, mu, rtol=1e-12)
    error = np.maximum(np.abs(found.phi_F / solved.phi_F - 1), np.abs(found.phi_A / solved.phi_A - 1))
    return error, found.error


def test_below_the_shipped_table_to_first_order():
    model = shipped_model()
    X_axis, mu_axis = model.content.axes
    rng = np.random.default_rng(21)
    X = rng.uniform(X_axis.low, X_axis.high, 300)
    mu = 10 ** rng.uniform(-30, np.log10(mu_axis.low), 300)
    error, bound = largest_error(model, X, mu)
    assert (error <= bound).all()
    assert error.max() < 1e-8


def test_a_small_table_keeps_its_word(small):
    X_axis, mu_axis = small.content.axes
    rng = np.random.default_rng(22)
    X = rng.uniform(X_axis.low, X_axis.high, 400)
    mu = 10 ** rng.uniform(np.log10(mu_axis.low), np.log10(mu_axis.high), 400)
    error, bound = largest_error(small, X, mu)
    assert (error <= bound).all()
    # a bound that is much too wide would say nothing
    assert np.median(bound / error) < 100


def test_below_a_table_the_logarithm_is_proportional_to_mu(small):
    X_axis, mu_axis = small.content.axes
    X = np.linspace(X_axis.low, X_axis.high, 50)
    edge = small.log_ratio(X, np.full(50, mu_axis.low))
    for factor in (1.0, 0.5, 1e-3, 1e-24):
        found = small.log_ratio(X, np.full(50, factor * mu_axis.low))
        np.testing.assert_allclose(found, factor * edge, rtol=1e-14)
    rigid = greenwood_tripp.rigid_sphere(X, np.zeros(50))
    found = small.answer(X, np.zeros(50))
    np.testing.assert_array_equal(found.phi_F, 0)
    np.testing.assert_allclose(found.phi_A, rigid[1], rtol=2e-15)


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


def test_no_step_where_the_table_ends_below(small):
    _, mu_axis = small.content.axes
    X = np.linspace(-2, 6, 40)
    above = small.log_ratio(X, np.full(40, np.nextafter(mu_axis.low, 1)))
    below = small.log_ratio(X, np.full(40, np.nextafter(mu_axis.low, 0)))
    np.testing.assert_allclose(above, below, rtol=1e-9)


def test_shapes_and_input_are_kept(small):
    X = np.linspace(-2, 6, 12).reshape(3, 4)
    mu = np.logspace(-9, 2, 12).reshape(3, 4)
    copies = X.copy(), mu.copy()
    found = small.answer(X, mu)
    np.testing.assert_array_equal((X, mu), copies)
    flat = small.answer(X.ravel(), mu.ravel())
    for name in ("phi_F", "phi_A", "error"):
        assert getattr(found, name).shape == (3, 4)
        np.testing.assert_array_equal(getattr(found, name).ravel(), getattr(flat, name))
    turned = small.answer(X.T, mu.T)
    np.testing.assert_array_equal(turned.phi_F, found.phi_F.T)


def test_the_error_is_that_of_the_cell(small):
    X_axis, mu_axis = small.content.axes
    field = small.content.local_error
    for i in (0, 4, 10):
        for j in (0, 3, 8):
            X, mu = X_axis.coordinate(i + 0.5), mu_axis.coordinate(j + 0.5)
            assert int(error_cell(X_axis, 11, i + 0.5)) == i
            found = small.answer(np.array([X]), np.array([mu])).error[0]
            assert found == pytest.approx(field[i, j].max(), rel=1e-10, abs=2e-12)


def test_shipped_tables_are_opened_once_and_files_by_their_kind(tmp_path):
    assert open_table("universal") is universal_model() is open_table()
    path = write_table(tmp_path / "other.nc", small_table(ISLAND4D))
    model = open_table(path)
    assert model.name == "island4d"
    # an opened table does not follow its file, and a replaced one is opened again
    content = small_table(ISLAND4D)
    write_table(path, dataclasses.replace(content, attributes=content.attributes | {"history": "another"}))
    assert "history" not in model.content.attributes
    assert open_table(path).content.attributes["history"] == "another"


def test_threads_that_open_one_table_at_once():
    gate = threading.Barrier(16)

    def opened(_):
        gate.wait()
        return open_table("universal")

    tabulated._opened.cache_clear()
    with ThreadPoolExecutor(16) as threads:
        assert len({id(model) for model in threads.map(opened, range(16))}) == 1


@pytest.mark.parametrize("shape", [(2, 3), (1, 2, 2)])
def test_marks_have_the_shape_of_the_arguments(small, shape):
    last = np.zeros(shape, dtype=bool)
    last.flat[-1] = True
    for bad in (np.nan, np.inf, -np.inf, 1e9, -1e9):
        for given in ((np.where(last, bad, 0.0), np.ones(shape)), (np.zeros(shape), np.where(last, bad, 1.0))):
            with pytest.raises(OutOfRangeError) as caught:
                small.answer(*given)
            np.testing.assert_array_equal(caught.value.mask, last)


def test_slopes_at_mu_zero_are_the_rigid_spheres(small):
    axis = small.content.axes[0]
    X = np.linspace(axis.low, axis.high, 20)
    value, by_X, by_mu = small.slopes(X, np.zeros(20))
    rigid = greenwood_tripp.rigid_sphere(X, np.ones(20))
    np.testing.assert_array_equal(value.phi_F, 0)
    np.testing.assert_allclose(value.phi_A, rigid[1], rtol=1e-14)
    np.testing.assert_allclose(by_mu.phi_F, rigid[0], rtol=1e-14)
    # below the table the logarithm is proportional to mu
    step = 1e-3 * small.content.axes[1].low
    slope = small.log_ratio(X, np.full(20, step))[1] / step
    np.testing.assert_allclose(by_mu.phi_A, slope * rigid[1], rtol=1e-12)
    assert np.isfinite(by_X.phi_A).all()
    assert (np.abs(by_X.phi_F) < 1e-150).all()
    assert small.slopes(axis.low, 0.0)[0].phi_F == 0
