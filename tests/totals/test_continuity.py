"""No jumps: force and area at pairs of inputs a relative 1e-9 apart, across every switch of the code."""

import numpy as np
import pytest

from mbma_tables import Surface, contact
from mbma_tables.islands.island import geometry
from mbma_tables.models.tabulated import universal_model
from mbma_tables.surfaces.readings import READINGS, get_reading
from mbma_tables.totals.pairs import kinks

STEP = 1e-9
COUNT = 4000


def surfaces(rng, count):
    hurst = rng.uniform(0.3, 1, count)
    hurst[: count // 20] = 1 - STEP / 2
    return hurst, 10 ** rng.uniform(0.5, 6, count), rng.uniform(2.5, 4.5, count)


@pytest.mark.parametrize("reading", sorted(READINGS))
@pytest.mark.parametrize("which", ["hurst", "zeta_1", "h_max", "separation"])
def test_totals_do_not_jump(reading, which):
    rng = np.random.default_rng([5, sorted(READINGS).index(reading), len(which)])
    hurst, zeta_1, h_max = surfaces(rng, COUNT)
    kink_d, kink_u = kinks(hurst, zeta_1, get_reading(reading))
    # a third at random, a third at each kink, where a segment of the integral appears
    reach = rng.uniform(1e-6, 2, COUNT) * h_max
    third = COUNT // 3
    reach[:third], reach[third : 2 * third] = kink_d[:third], kink_u[third : 2 * third]
    reach = np.minimum(reach, 2 * h_max)
    gap = h_max - reach
    one = contact(Surface(hurst, 1.0, zeta_1, 1.0, h_max), np.maximum(gap, -h_max), reading=reading, outside="exact")
    moved = {"hurst": hurst, "zeta_1": zeta_1, "h_max": h_max, "separation": gap}
    step = STEP * np.maximum(np.abs(moved[which]), 1e-3)
    moved[which] = moved[which] - step if which == "hurst" else moved[which] + step
    gap = np.clip(moved["separation"], -moved["h_max"], None)
    surface = Surface(moved["hurst"], 1.0, moved["zeta_1"], 1.0, moved["h_max"])
    other = contact(surface, gap, reading=reading, outside="exact")
    for name in ("force", "area"):
        a, b = getattr(one, name), getattr(other, name)
        some = (a > 0) & (b > 0)
        # a steep function moves by itself: by up to 1e3 a unit of relative change but next to first contact
        own = 1e3 * STEP + 8 * step / np.maximum(reach, 1e-300)
        allowed = one.error + other.error + own
        assert (np.abs(b / a - 1)[some] <= allowed[some]).all()


def test_islands_do_not_jump_at_the_floors():
    rng = np.random.default_rng(6)
    hurst, zeta_1, _ = surfaces(rng, COUNT)
    for reading in READINGS.values():
        for kink in kinks(hurst, zeta_1, reading):
            below, above = (geometry(kink * (1 + side * STEP), hurst, zeta_1, reading) for side in (-1, 1))
            for name in ("X", "mu", "eta", "D_d", "sigma_d", "R_d", "R_u"):
                assert np.abs(above[name] / below[name] - 1).max() < 1e3 * STEP, name


def test_the_table_joins_its_expansion():
    model = universal_model()
    rng = np.random.default_rng(7)
    X = rng.uniform(model.content.axes[0].low, model.content.axes[0].high, COUNT)
    edge = model.content.axes[1].low
    below, above = (model.answer(X, np.full(COUNT, edge * (1 + side * STEP))) for side in (-1, 1))
    np.testing.assert_allclose(above.phi_F / below.phi_F, 1 + 2 * STEP, rtol=1e-10)
    np.testing.assert_allclose(above.phi_A, below.phi_A, rtol=1e-10)


@pytest.mark.parametrize("X", [-8.0, -6.0, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0, 8.0])
def test_height_integrals_join(X):
    """The polynomial pieces of the rigid sphere meet where they switch."""
    from mbma_tables.islands.height_integrals import ORDERS, height_integral

    for order in ORDERS:
        below, above = (float(height_integral(order, -X * (1 + side * 1e-12) - side * 1e-13)) for side in (-1, 1))
        assert above == pytest.approx(below, rel=1e-9, abs=0)
        exact = float(height_integral(order, np.nextafter(-X, 1)))
        assert exact == pytest.approx(float(height_integral(order, np.nextafter(-X, -50))), rel=1e-14, abs=0)
