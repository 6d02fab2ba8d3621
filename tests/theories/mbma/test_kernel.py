"""Totals in the core: islands, failure, kinks, independence of order, stated errors."""

import math

import numpy as np
import pytest
from catalogue import LEVEL

from mbma_tables import ConvergenceError, Surface, contact
from mbma_tables.core import INVALID, OK, UNRESOLVED, core
from mbma_tables.islands.geometry import FIELDS, geometry
from mbma_tables.islands.variants import PRINTED, REPORTED
from mbma_tables.tables.open import universal_model
from mbma_tables.theories import Mbma
from mbma_tables.theories.mbma import sums as sums


@pytest.mark.parametrize(
    "variant", [REPORTED, PRINTED, LEVEL], ids=lambda variant: variant.name
)
def test_islands_are_those_of_geometry(variant):
    rng = np.random.default_rng(40)
    hurst = rng.uniform(0.1, 1, 3000)
    hurst[::10] = 1
    hurst[1::10] = 1 - 10 ** rng.uniform(-15, -3, 300)
    zeta_1 = np.maximum(
        10 ** rng.uniform(math.log10(3.01), 8, 3000), 1.001 * variant.floor_u
    )
    x = 10 ** rng.uniform(-12, 1, 3000)
    g = geometry(x, hurst, zeta_1, variant)
    nodes = np.empty((3000, len(FIELDS)))
    for *numbers, node in zip(x, hurst, zeta_1, nodes, strict=True):
        assert core.island_geometry(*numbers, variant.numbers, node) == OK
    expected = np.stack([g[name] for name in FIELDS], axis=-1)
    np.testing.assert_allclose(nodes, expected, rtol=1e-11)
    assert (
        np.median(
            np.abs(nodes / np.where(expected == 0, 1.0, expected) - (expected != 0))
        )
        < 1e-14
    )
    for bad in [
        (math.nan, 0.8, 9.0),
        (1.0, math.nan, 9.0),
        (1.0, 0.8, math.inf),
        (0.0, 0.8, 9.0),
        (1.0, 1.5, 9.0),
    ]:
        assert core.island_geometry(*bad, variant.numbers, nodes[0]) == INVALID
        assert np.isnan(nodes[0]).all()


def totals(hurst, zeta_1, compression, peak, rtol=1e-9):
    arrays = np.broadcast_arrays(
        *(np.atleast_1d(np.asarray(x, float)) for x in (hurst, zeta_1, compression, peak))
    )
    numbers = [np.ascontiguousarray(array) for array in arrays]
    count = arrays[0].size
    out = np.empty((count, 2, 2))
    error = np.empty(count)
    status = np.empty(count, np.uint8)
    own = REPORTED.numbers, *universal_model().cells
    bad = core.totals(*numbers, rtol, *own, out, error, status, np.empty(1, np.int64))
    assert bad == (status != OK).sum()
    return out, error, status


def test_no_number_crashes_and_none_that_is_wrong_is_answered():
    awful = np.array(
        [math.nan, math.inf, -math.inf, 5e-324, -5e-324, 1e300, -1.0, 0.0, 1.0, 1e-160]
    )
    good = (0.8, 216.0, 2.0, 3.0)
    for place in range(4):
        given = list(good)
        given[place] = awful
        out, error, status = totals(*given)
        answered = status == OK
        assert np.isfinite(out[answered]).all()
        assert np.isnan(out[~answered]).all()
        assert np.isnan(error[~answered]).all()
        assert not answered[:3].any()
        # 1e300 times h_rms is deeper than any table
        assert (out[answered] >= 0)[:, :, 0].all()


def test_what_cannot_be_resolved_is_said(monkeypatch):
    assert totals(0.8, 216.0, 4.0, 3.0)[2][0] == OK
    out, error, status = totals(0.8, 216.0, 4.0, 3.0, rtol=1e-30)
    assert status[0] == UNRESOLVED
    assert np.isnan([*error, *out.ravel()]).all()
    surface = Surface(np.linspace(0.2, 0.9, 20)[:, None], 0.2, 40.0, 1.0, 3.0)

    class Unresolved:
        def totals(self, *given):
            *_, out, bound, status, _ = given
            status[:], out[:], bound[:] = OK, 1.0, 1.0
            status[3] = UNRESOLVED

    monkeypatch.setattr(sums, "core", Unresolved())
    with pytest.raises(
        ConvergenceError, match="quadrature did not reach its tolerance"
    ) as caught:
        contact(surface, separation=[0.0, 1.0], theory=Mbma(outside="nan"))
    assert np.argwhere(caught.value.mask).tolist() == [[1, 1]]


def test_bits_depend_neither_on_the_batch_nor_on_the_generation(generations):
    rng = np.random.default_rng(8)
    given = (
        rng.uniform(0.2, 1, 300),
        10 ** rng.uniform(0.7, 4, 300),
        rng.uniform(0, 6, 300),
        rng.uniform(3, 5, 300),
    )
    whole = totals(*given)[0]
    for k in range(0, 300, 37):
        assert totals(*(x[k] for x in given))[0].tobytes() == whole[k].tobytes()
    X = rng.uniform(-6, 40, 500)
    mu = 10 ** rng.uniform(-10, 6, 500)
    phi = []
    for one in generations:
        phi.append(np.empty((500, 3)))
        one.phi(X, mu, *universal_model().cells, phi[-1], None)
        assert phi[-1].tobytes() == phi[0].tobytes()
