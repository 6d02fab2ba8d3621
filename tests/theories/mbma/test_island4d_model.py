"""`Island4dModel` against islands by geometry and solver, at every edge and beyond its axes."""

import numpy as np
import pytest
from small_tables import small_table

from mbma_tables import InputError, OutOfRangeError, greenwood_tripp
from mbma_tables.common.table_schema import ISLAND4D
from mbma_tables.theories.mbma.geometry import geometry
from mbma_tables.theories.mbma.island import scale_area, scale_force
from mbma_tables.theories.mbma.island4d import SPHERE_FLOOR, Island4dModel, to_axes
from mbma_tables.theories.mbma.tables import open_table
from mbma_tables.theories.mbma.variants import REPORTED


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
