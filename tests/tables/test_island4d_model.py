"""`Island4dModel` against islands by geometry and solver, at every edge and beyond its axes."""

import copy
import pickle

import numpy as np
import pytest
import xarray as xr
from small_tables import small_table

from mbma_tables import InputError, OutOfRangeError, greenwood_tripp
from mbma_tables.islands.geometry import geometry
from mbma_tables.islands.variants import REPORTED
from mbma_tables.tables.island4d import (
    SPHERE_FLOOR,
    Island4dModel,
    band_fields,
    to_axes,
)
from mbma_tables.tables.open import open_table
from mbma_tables.tables.schema import ISLAND4D
from mbma_tables.theories.mbma.island import scale_area, scale_force


@pytest.fixture(scope="module")
def small():
    return Island4dModel(small_table(ISLAND4D))


def test_edges_to_the_last_bit(small):
    delta = 1.5
    zeta_d = 2.0
    zeta_u = 20.0
    for hurst in (0.3, 1.0):
        small.lookup(delta, zeta_d, zeta_u, hurst)
    for hurst in (np.nextafter(0.3, 0), np.nextafter(1.0, 2)):
        with pytest.raises(OutOfRangeError, match=r"hurst must be in \[0\.3, 1\]"):
            small.lookup(delta, zeta_d, zeta_u, hurst)
    small.lookup(delta, SPHERE_FLOOR, zeta_u, 0.7)
    with pytest.raises(OutOfRangeError, match=r"zeta_d must be at least 1\.25"):
        small.lookup(delta, np.nextafter(SPHERE_FLOOR, 0), zeta_u, 0.7)
    # 2 * 101 is exact, so is the spread of 100
    small.lookup(3.0, 2.0, 202.0, 0.7)
    with pytest.raises(OutOfRangeError, match="zeta_u/zeta_d - 1 must be at most 100"):
        small.lookup(3.0, 2.0, np.nextafter(202.0, 300), 0.7)
    # one bit apart, at X = 5
    sigma = to_axes(
        *(np.array([v]) for v in (1.0, 2.0, np.nextafter(2.0, 3), 0.7)), REPORTED
    ).sigma[0]
    small.lookup(2.0**-0.7 * (1 + 5 * sigma), 2.0, np.nextafter(2.0, 3), 0.7)
    for top in (2.0, 1.9):
        with pytest.raises(OutOfRangeError, match="zeta_u must be above zeta_d"):
            small.lookup(delta, 2.0, top, 0.7)


@pytest.mark.parametrize(
    ("position", "bad"),
    [
        (0, 0.1),
        (0, 1e3),
        (0, -1.0),
        (1, 1.0),
        (1, -3.0),
        (2, 1e6),
        (2, 1.0),
        (3, 0.1),
        (3, 1.2),
    ],
)
def test_what_is_out_of_range_is_marked(small, position, bad):
    raw = [1.5, 2.0, 20.0, 0.7]
    raw[position] = [[raw[position], bad], [raw[position], bad]]
    with pytest.raises(OutOfRangeError) as caught:
        small.lookup(*raw)
    np.testing.assert_array_equal(caught.value.mask, [[False, True], [False, True]])


def islands(approach, hurst, zeta_1):
    """The four numbers of islands of surfaces, and F_hat and A_hat by the solver."""
    approach, hurst, zeta_1 = (
        np.array(a, dtype=float) for a in np.broadcast_arrays(approach, hurst, zeta_1)
    )
    g = geometry(approach, hurst, zeta_1, REPORTED)
    solved = greenwood_tripp.solve(g["X"], g["mu"], rtol=1e-10)
    raw = np.stack(
        [g["X"] * g["sigma"] + g["zeta_d"] ** -hurst, g["zeta_d"], g["zeta_u"], hurst]
    )
    return raw, scale_force(g) * solved.phi_F, scale_area(g) * solved.phi_A / g["eta"]


# inside; H and zeta_d beyond their axes; X beyond its own
INSIDE = [True, False, True, False]
RAW, FORCE, AREA = islands(
    [1.0, 0.5, 3.0, 60.0], [0.8, 0.12, 0.5, 0.8], [30.0, 30.0, 500.0, 30.0]
)


def test_outside_the_solver_answers_where_asked():
    found = open_table("island4d").lookup(*RAW, outside="exact")
    bound = np.where(INSIDE, 1e-3, 1e-8)
    assert (np.abs(found.F_hat / FORCE - 1) < bound).all()
    assert (np.abs(found.A_hat / AREA - 1) < bound).all()
    assert (found.error <= bound).all()
    assert (np.abs(found.F_hat / FORCE - 1) <= found.error + 1e-10).all()


def test_outside_nothing_is_said_where_asked():
    found = open_table("island4d").lookup(*RAW, outside="nan")
    for field in found:
        np.testing.assert_array_equal(np.isfinite(field), INSIDE)
    inside = open_table("island4d").lookup(*RAW[:, INSIDE])
    np.testing.assert_array_equal(found.F_hat[INSIDE], inside.F_hat)
    everywhere = open_table("island4d").lookup(*RAW[:, [1, 3]], outside="nan")
    assert np.isnan(everywhere.F_hat).all()


@pytest.mark.parametrize("kind", ["island4d", "universal"])
def test_words_for_outside(kind):
    model = open_table(kind)
    asked, given = (model.lookup, RAW) if kind == "island4d" else (model.answer, RAW[:2])
    with pytest.raises(InputError, match="outside must be one of"):
        asked(*given, outside="clamp")


ZETA_D = 3.7
HURST = 0.8
X = 3.0


def narrow_island(spread):
    """An island at X = 3 with that spread as rounded, and where it lies on the axes."""
    raw = [np.array([value]) for value in (1.0, ZETA_D, ZETA_D * (1 + spread), HURST)]
    raw[0] = ZETA_D**-HURST * (1 + X * to_axes(*raw, REPORTED).sigma)
    return raw, to_axes(*raw, REPORTED)


@pytest.mark.parametrize("power", range(-12, -1))
def test_narrow_bands(power):
    raw, place = narrow_island(10.0**power)
    found = open_table("island4d").lookup(*raw)
    solved = greenwood_tripp.solve(place.X, place.mu, rtol=1e-10)
    for hat, scale, phi in (
        (found.F_hat, place.force, solved.phi_F),
        (found.A_hat, place.area, solved.phi_A),
    ):
        np.testing.assert_allclose(hat, scale * phi, rtol=found.error.max() + 1e-10)


def test_bounds_hold_and_are_close_to_the_errors():
    """Against the table `universal`, which is five orders more accurate, below the first spread too."""
    table = open_table("island4d")
    X, spread, sphere, hurst = random_places(table, 40_000)
    spread[::20] = table.content.axes[1].low * np.geomspace(1e-6, 1, spread[::20].size)
    mu = band_fields(spread, sphere, hurst, table.variant)[0]
    zeta_d = SPHERE_FLOOR * sphere ** (-1 / (4 - 2 * hurst))
    width = np.log1p(spread)
    fields = {"X": X, "width": width, "zeta_d": zeta_d, "hurst": hurst, "mu": mu}
    found = table.of_islands(fields)
    exact = open_table("universal").answer(X, mu)
    pairs = zip(found[:2], exact[:2], strict=True)
    errors = np.max([np.abs(own / other - 1) for own, other in pairs], axis=0)
    assert (errors <= found.error + exact.error).all()
    assert errors.max() < 2e-5
    assert np.median(found.error / errors) < 5


def random_places(table, count):
    """Coordinates of the axes of a table, evenly over its box."""
    rng = np.random.default_rng(7)
    nodes = [axis.nodes - 1 for axis in table.content.axes]
    return [
        axis.coordinate(rng.uniform(0, last, count))
        for axis, last in zip(table.content.axes, nodes, strict=True)
    ]


ONE = {"island4d": (1.0, 3.0, 20.0, 0.8), "universal": (2.0, 1e-3)}


@pytest.mark.parametrize("kind", ONE)
def test_one_island_is_answered_as_in_an_array(kind):
    """Floats are answered without numpy, other numbers with it, by the same arithmetic."""
    table = open_table(kind)
    lookup = table.lookup if kind == "island4d" else table.answer
    one = ONE[kind]
    many = lookup(*(np.full(3, value) for value in one))
    for given in (one, [np.float64(value) for value in one], [[value] for value in one]):
        found = lookup(*given)
        assert type(found) is type(many)
        for alone, row in zip(found, many, strict=True):
            assert np.ravel(alone)[0] == row[0] == row[2]
            assert np.shape(alone) == np.shape(given[0])
    assert {type(field) for field in lookup(*one)} == {np.float64}
    for outside in ("raise", "exact", "nan"):
        assert lookup(*one, outside=outside) == lookup(*one)
    with pytest.raises(InputError, match="outside must be one of"):
        lookup(*one, outside="clamp")


@pytest.mark.parametrize("kind", ONE)
@pytest.mark.parametrize(
    "wrong", [np.nan, np.inf, -np.inf, "3", None, True, 1j, [], 1e300]
)
def test_one_wrong_number_is_refused(kind, wrong):
    table = open_table(kind)
    lookup = table.lookup if kind == "island4d" else table.answer
    for place in range(len(ONE[kind])):
        given = list(ONE[kind])
        given[place] = wrong
        with pytest.raises((InputError, OutOfRangeError)):
            lookup(*given)


@pytest.mark.parametrize("kind", ONE)
def test_a_table_that_was_used_is_pickled(kind):
    table = open_table(kind)
    for used in (table, copy.deepcopy(table), pickle.loads(pickle.dumps(table))):
        lookup = used.lookup if kind == "island4d" else used.answer
        assert lookup(*ONE[kind]) == (
            table.lookup if kind == "island4d" else table.answer
        )(*ONE[kind])


def test_a_lookup_by_names_broadcasts_and_takes_lists_and_labelled_arrays():
    table = open_table("island4d")
    deltas = np.array([0.9, 1.0])
    zetas_d = np.array([[2.0], [3.0], [4.0]])
    found = table.lookup(delta=deltas, zeta_d=zetas_d, zeta_u=20.0, hurst=0.8)
    for i, j in np.ndindex(3, 2):
        one = table.lookup(deltas[j], zetas_d[i, 0], 20.0, 0.8)
        assert [row[i, j] for row in found] == list(one)
    for kind in (list, xr.DataArray):
        other = table.lookup(delta=kind(deltas), zeta_d=3.0, zeta_u=20.0, hurst=0.8)
        np.testing.assert_array_equal(np.array(other), np.array(found)[:, 1])
    with pytest.raises(InputError, match="delta must be finite"):
        table.lookup(delta=[1.0, np.nan], zeta_d=3.0, zeta_u=20.0, hurst=0.8)


def test_a_grid_has_what_each_lookup_has_and_nan_outside():
    table = open_table("island4d")
    axes = {
        "delta": [1.5, 2.0, 50.0],
        "zeta_d": [2.0, 3.0],
        "zeta_u": 20.0,
        "hurst": [0.5, 0.8],
    }
    grid = table.to_dataset(**axes)
    assert grid.F_hat.dims == tuple(axes) == tuple(grid.sizes)
    for name in (*axes, "F_hat", "A_hat", "error"):
        assert grid[name].attrs["units"] == "1"
        assert grid[name].attrs["long_name"]
    assert np.isnan(grid.F_hat.sel(delta=50.0)).all()
    assert grid.attrs["outside"].startswith("NaN")
    for place in ({"delta": 1.5, "zeta_d": 3.0}, {"delta": 2.0, "zeta_d": 2.0}):
        for hurst in axes["hurst"]:
            one = table.lookup(**place, zeta_u=20.0, hurst=hurst)
            at = grid.sel(place, method=None).sel(zeta_u=20.0, hurst=hurst)
            assert (at.F_hat, at.A_hat, at.error) == one
    with pytest.raises(OutOfRangeError):
        table.to_dataset(**axes, outside="raise")
    with pytest.raises(InputError, match="delta must be an axis of one dimension, got 2"):
        table.to_dataset(**axes | {"delta": [[1.0], [2.0]]})
    with pytest.raises(InputError, match="hurst must be an axis without equal"):
        table.to_dataset(**axes | {"hurst": [0.5, 0.5]})


def test_a_grid_has_nan_where_zeta_u_is_not_above_zeta_d():
    """It raised, so that no grid could span both magnifications."""
    table = open_table("island4d")
    axes = {"delta": 1.5, "zeta_d": [2.0, 3.0, 4.0], "zeta_u": [3.0, 20.0]}
    grid = table.to_dataset(**axes, hurst=0.8)
    is_island = np.less.outer(axes["zeta_d"], axes["zeta_u"])
    for name in ("F_hat", "A_hat", "error"):
        np.testing.assert_array_equal(np.isfinite(grid[name][0, ..., 0]), is_island)
    found = table.lookup(1.5, 2.0, [1.0, 2.0, 20.0], 0.8, outside="nan")
    assert np.isnan(found.F_hat).tolist() == [True, True, False]
    assert found.F_hat[2] == grid.F_hat.sel(zeta_d=2.0, zeta_u=20.0).item()
    assert np.isnan(table.lookup(1.5, 20.0, 2.0, 0.8, outside="nan")).all()
    for outside in ("raise", "exact"):
        with pytest.raises(OutOfRangeError, match=r"above zeta_d .outside='nan'"):
            table.to_dataset(**axes, hurst=0.8, outside=outside)


def test_a_grid_of_the_universal_table():
    table = open_table("universal")
    grid = table.to_dataset(X=[0.0, 2.0, 1e4], mu=[0.1, 10.0])
    assert grid.phi_F.dims == ("X", "mu")
    assert np.isnan(grid.phi_A.sel(X=1e4)).all()
    for X, mu in ((0.0, 10.0), (2.0, 0.1)):
        at = grid.sel(X=X, mu=mu)
        assert (at.phi_F, at.phi_A, at.error) == table.answer(X, mu)
