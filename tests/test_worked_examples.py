"""The bearing, the joint and the fracture of docs/examples.md: their printed numbers, and limits that are known."""

import pathlib
import re

import numpy as np
import pytest
from click.testing import CliRunner
from helpers import assert_same_output
from test_examples import load

from mbma_tables import contact

PAGE = (pathlib.Path(__file__).parents[1] / "docs" / "examples.md").read_text(encoding="utf-8")
NAMES = ("bearing", "heat", "fracture")


def worked(name):
    if name == "heat":
        pytest.importorskip("skfem")
    return load(name)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_an_example_prints_what_its_page_shows(name, tmp_path):
    module = worked(name)
    ran = CliRunner().invoke(module.command, ["--out", str(tmp_path / "own.svg")], catch_exceptions=False)
    shown = re.search(rf"`python examples/{name}\.py`.*?\n\n((?:    [^\n]*\n)+)", PAGE, re.S)[1]
    assert_same_output(ran.output, shown, rtol=0.02)
    assert b"<svg" in (tmp_path / "own.svg").read_bytes()


def test_a_short_smooth_bearing_is_ocvirks(monkeypatch):
    """Ocvirk 1953, half of Sommerfeld's film: W = eta U L^3 e sqrt(16 e^2 + pi^2 (1 - e^2))/(4 c^2 (1 - e^2)^2)."""
    module = worked("bearing")
    monkeypatch.setattr(module, "LENGTH", 1e-3)
    smooth = {"mean_separation": np.array([0.0, 1.0])} | dict.fromkeys(("phi_x", "phi_y"), np.ones(2))
    smooth |= dict.fromkeys(("pressure", "area"), np.zeros(2))
    for e in (0.2, 0.5, 0.8):
        found = module.state(smooth, e, 1.0)
        shape = e * np.sqrt(16 * e**2 + np.pi**2 * (1 - e**2)) / (4 * (1 - e**2) ** 2)
        assert found.load == pytest.approx(module.VISCOSITY * 1e-9 / module.CLEARANCE**2 * shape, rel=0.015)
        # Petroff's friction of the film that fills the gap
        around = 2 * np.pi * module.RADIUS * 1e-3 * module.VISCOSITY / module.CLEARANCE / np.sqrt(1 - e**2)
        assert found.friction * found.load == pytest.approx(around, rel=1e-6)


def test_a_bearing_carries_its_load():
    module = worked("bearing")
    slow, fast = module.stribeck(np.array([0.05, 2.0]))
    assert [slow.load, fast.load] == pytest.approx([module.LOAD] * 2, rel=1e-4)
    assert slow.in_contact > 0.5 > fast.in_contact
    table = module.film_table()
    u = module.CLEARANCE * (1 - slow.eccentricity)
    peak = contact(module.FACES, mean_separation=u, E_star=110e9, theory="calibrated").pressure
    assert np.interp(u, table["mean_separation"], table["pressure"]) == pytest.approx(peak, rel=2e-3)


def test_uniform_conductance_is_resistances_in_series():
    module = worked("heat")
    h, area = 2e4, np.pi * (module.RIM**2 - module.HOLE**2)
    own = module.resistance(np.full_like(module.top.global_coordinates()[0], h))
    k_1, k_2 = module.CONDUCTIVITY
    assert own == pytest.approx((module.THICK / k_1 + 1 / h + module.THICK / k_2) / area, rel=1e-9)
    r = np.linspace(module.HOLE, module.CONE, 4001)
    assert np.trapezoid(2 * np.pi * r * module.pressure(r), r) == pytest.approx(module.FORCE, rel=1e-6)


def test_a_well_draws_what_the_leakage_of_the_contact_lets_through():
    module = worked("fracture")
    p = np.linspace(5e6, module.PORE, 401)
    K = contact(module.FRACTURE, pressure=module.NORMAL - p, E_star=module.E_STAR, theory="calibrated").leakage.K
    exact = 2 * np.pi * np.trapezoid(K, p) / (12 * module.VISCOSITY * np.log(module.EDGE / module.WELL))
    assert module.drawn(module.aperture_table(), 5e6) == pytest.approx(exact, rel=3e-3)
