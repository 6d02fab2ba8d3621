"""`UniversalModel` against the solver within its stated error, its slopes, every edge, one bit pattern."""

import dataclasses
import json
import math

import numpy as np
import pytest
from numpy.polynomial.chebyshev import chebval2d
from small_tables import small_table

from mbma_tables import InputError, OutOfRangeError, greenwood_tripp
from mbma_tables.common.netcdf import digest_json
from mbma_tables.islands.geometry import geometry
from mbma_tables.islands.variants import REPORTED, get_variant
from mbma_tables.tables.open import open_table, shipped, universal_model, verify
from mbma_tables.tables.reader import read_table
from mbma_tables.tables.schema import CELL_EDGES, ISLAND4D, KINDS, UNIVERSAL
from mbma_tables.tables.universal import UniversalModel
from mbma_tables.tables.writer import write_table


@pytest.fixture(scope="module")
def small():
    return UniversalModel(small_table(UNIVERSAL))


def largest(found, solved):
    return np.maximum(
        np.abs(found.phi_F / solved.phi_F - 1), np.abs(found.phi_A / solved.phi_A - 1)
    )


def error_and_bound(model, X, mu):
    found = model.answer(X, mu)
    return largest(found, greenwood_tripp.solve(X, mu, rtol=1e-12)), found.error


def test_the_smallest_mu_and_the_rigid_limit():
    model = universal_model()
    X_axis = model.content.axes[0]
    rng = np.random.default_rng(21)
    X = rng.uniform(X_axis.low, X_axis.high, 300)
    mu = 10 ** rng.uniform(-30, -8, 300)
    error, bound = error_and_bound(model, X, mu)
    assert (error <= bound).all()
    rigid = greenwood_tripp.rigid_sphere(X, np.full(300, 1e-200))
    found = model.answer(X, np.full(300, 1e-200))
    assert (np.abs(np.stack(found[:2]) / rigid - 1) <= found.error).all()
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
    assert (
        abs(top.phi_F[0] / greenwood_tripp.solve(1.0, mu_axis.high).phi_F - 1)
        <= top.error[0]
    )
    with pytest.raises(OutOfRangeError, match=r"mu must be in \[0, 100\]"):
        small.answer(inside, np.array([np.nextafter(mu_axis.high, np.inf)]))


def test_every_cell_answers_with_its_own_series_and_error(small):
    """Against numpy's Chebyshev series, in the middle of each cell and next to its edges."""
    content = small.content
    edges = [content.auxiliary[name][1] for name in CELL_EDGES]
    for cell, (X_low, X_high, mu_low, mu_high) in enumerate(zip(*edges, strict=True)):
        middle = np.sqrt(mu_low * mu_high)
        for share in (1e-9, 0.5, 1 - 1e-9):
            X = X_low + share * (X_high - X_low)
            mu = mu_low + share * (mu_high - mu_low)
            ratio = 2 * mu / mu_high - 1
            if mu_low > 0:
                slope = (np.sqrt(mu_high) + np.sqrt(mu_low)) / (
                    np.sqrt(mu_high) - np.sqrt(mu_low)
                )
                ratio = slope * (mu - middle) / (mu + middle)
            by_hand = chebval2d(2 * share - 1, ratio, content.coefficients[cell])
            found = small.answer(X, mu)
            np.testing.assert_allclose(
                [found.phi_F, found.phi_A], by_hand * [mu, 1], rtol=1e-13
            )
            assert found.error == content.local_error[cell].max()


def test_shipped_tables_are_opened_once_and_files_by_their_kind(tmp_path):
    assert open_table("universal") is universal_model() is open_table()
    path = write_table(tmp_path / "other.nc", small_table(ISLAND4D))
    model = open_table(path)
    assert model.name == "island4d"
    # an opened table does not follow its file, and a replaced one is opened again
    content = small_table(ISLAND4D)
    write_table(
        path,
        dataclasses.replace(
            content, attributes=content.attributes | {"history": "another"}
        ),
    )
    assert model.content.attributes["history"] != "another"
    assert open_table(path).content.attributes["history"] == "another"


def scattered(count, seed, low=1e-8):
    X_axis, mu_axis = universal_model().content.axes
    rng = np.random.default_rng(seed)
    X = rng.uniform(X_axis.low, X_axis.high, count)
    return X, 10 ** rng.uniform(math.log10(low), math.log10(mu_axis.high), count)


def test_no_bound_is_exceeded_nor_much_wider_than_the_error_on_20000_points():
    X, mu = scattered(20_000, seed=60)
    error, bound = error_and_bound(universal_model(), X, mu)
    assert (error <= bound).all()
    assert error.max() <= bound.max() <= 2e-10
    ratio = bound / np.maximum(error, np.finfo(float).eps)
    # where interpolation shows above rounding
    visible = error > 1e-13
    assert visible.mean() > 0.8
    assert np.median(ratio[visible]) <= 30
    assert np.median(ratio) <= 30


def test_island4d_over_what_surfaces_visit():
    rng = np.random.default_rng(61)
    count = 20_000
    hurst = rng.uniform(0.3, 1, count)
    zeta_1 = 10 ** rng.uniform(math.log10(3.001), 4, count)
    g = geometry(10 ** rng.uniform(-6, 1, count), hurst, zeta_1, REPORTED)
    found = open_table("island4d").of_islands(g | {"hurst": hurst})
    error = largest(found, greenwood_tripp.solve(g["X"], g["mu"], rtol=1e-10))
    assert (error <= found.error + 1e-10).all()
    assert error.max() <= 2e-5
    assert found.error.max() <= 3e-5
    # far inside the rigid limit a table has next to no error to state
    visible = error > 1e-10
    assert visible.mean() > 0.5
    assert np.median((found.error / error)[visible]) <= 5


def test_arguments_outside_are_marked():
    answer = universal_model().answer
    with pytest.raises(InputError, match="mu must be finite"):
        answer(0.0, math.nan)
    with pytest.raises(
        OutOfRangeError, match=r"X must be in \[-6\.25, 41\], got 50 at \(1,\)"
    ):
        answer([0.0, 50.0], 1.0)
    with pytest.raises(InputError, match="do not broadcast"):
        answer([0.0, 1.0], [1.0, 2.0, 3.0])


LARGEST_BYTES = {UNIVERSAL: 2e6, ISLAND4D: 16e6}
LARGEST_ERROR = {UNIVERSAL: 1e-9, ISLAND4D: 2e-5}


@pytest.mark.parametrize("kind", KINDS)
def test_shipped_tables_are_small_and_state_what_was_measured(kind):
    table = read_table(shipped(kind), kind)
    verdict = verify(shipped(kind), kind)
    attributes = table.attributes
    variant = get_variant(attributes["variant"]).recorded if kind == ISLAND4D else []
    configuration = json.loads(attributes["configuration"])
    assert digest_json([configuration, variant]) == attributes["configuration_sha256"]
    assert configuration["kind"] == kind
    assert shipped(kind).stat().st_size <= LARGEST_BYTES[kind]
    assert attributes["certificate_points"] >= 5000
    assert (table.local_error > 0).all()
    for number, function in enumerate("FA"):
        typical, rare, largest = (
            attributes[f"{what}_error_{function}"]
            for what in ("median", "p99", "largest")
        )
        assert 0 < typical <= rare <= largest <= LARGEST_ERROR[kind]
        assert (
            attributes[f"visited_largest_error_{function}"]
            <= largest
            <= table.local_error[..., number].max()
        )
        assert kind == UNIVERSAL or attributes[f"visited_p99_error_{function}"] <= 3e-4
    # by the installed solver too
    assert (verdict.points, verdict.solver_error < 1e-11) == (64, True)
    assert all(values.size >= 32 for values in table.conformance.values())
    assert 0 < table.conformance["tolerance"].max() < 1e-6
