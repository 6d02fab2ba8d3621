"""The examples run, draw, print what pages of docs show, and agree with other ways of computing their numbers."""

import importlib.util
import pathlib
import re
import runpy
import sys

import numpy as np
import pytest
from click.testing import CliRunner
from helpers import assert_same_output

from mbma_tables import Bodies, Surface, contact
from mbma_tables.theories import Mbma

pytest.importorskip("matplotlib")

ROOT = pathlib.Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
PAGES = "".join(
    path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs").glob("*.md"))
)
NEEDS = {"scatter": "dask", "heat": "skfem", "newton": "skfem"}


def load(name):
    if name in NEEDS:
        pytest.importorskip(NEEDS[name])
    spec = importlib.util.spec_from_file_location(
        f"example_{name}", EXAMPLES / f"{name}.py"
    )
    module = importlib.util.module_from_spec(spec)
    # dataclasses look their module up
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def seal(tmp_path_factory):
    module = load("seal")
    return module, module.main(tmp_path_factory.mktemp("seal") / "own.png", cells=0)


def direct(module, x):
    """log(pressure/LOAD) and log(conductance), contact by contact, written again from the statement."""
    h_rms = np.exp(x[0])
    h_max = module.CREST * np.exp(x[0])
    face = Surface(x[1], module.Q0, np.exp(x[2]), h_rms, h_max)
    both = [
        contact(face, mean_separation=x[3] * h_max + deeper, theory="calibrated")
        for deeper in (0, module.DEPTH)
    ]
    pressure = module.E_STAR * np.mean([half.pressure for half in both])
    return np.log([pressure / module.LOAD, np.mean([half.leakage.K for half in both])])


def test_seal_gradients(seal):
    module, found = seal
    x = found.result.x
    values, gradients = module.log_answers(x)
    np.testing.assert_allclose(values, direct(module, x), atol=1e-9)
    for axis, step in enumerate(1e-4 * np.eye(4)):
        central = (direct(module, x + step) - direct(module, x - step)) / 2e-4
        np.testing.assert_allclose(gradients[:, axis], central, rtol=1e-4, atol=1e-4)


@pytest.mark.slow
def test_seal_leaks_as_simulated(seal):
    pytest.importorskip("tamaas")
    module, found = seal
    simulated = module.simulate(found.best, found.result.x, 256, 7)
    assert (
        abs(np.log(np.exp(found.result.fun) / simulated))
        < 3 * found.best.leakage.scatter[0, 1]
    )


def test_scatter_is_the_exact_island_model_sample_by_sample(tmp_path):
    module = load("scatter")
    spread = module.main(tmp_path / "own.png", samples=20)
    lazy = module.sample_surfaces(20)
    numbers = np.stack(
        [getattr(lazy, name).compute() for name in ("hurst", "q1", "h_rms", "h_max")],
        axis=1,
    )
    for k, (hurst, q1, h_rms, h_max) in enumerate(numbers):
        own = Surface(hurst, module.Q0, q1, h_rms, h_max)
        exact = contact(
            own, separation=module.GAP, theory=Mbma(island_model="exact", rtol=1e-7)
        )
        assert spread.force[k] == pytest.approx(exact.pressure, rel=1.2e-6, abs=0)


def test_the_band_of_a_conductance_is_the_model_uncertainty_of_conductance():
    module = load("conductance")
    curve = module.conductance_curve(20)
    conductivities = module.K_STEEL, module.K_ALUMINIUM
    middle, soft = (
        contact(
            module.JOINT,
            Bodies(module.E_STAR, hardness=hardness, conductivity=conductivities),
            pressure=curve.pressure,
            theory="calibrated",
        )
        for hardness in (np.sqrt(module.SOFT * module.HARD), module.SOFT)
    )
    np.testing.assert_allclose(curve.conductance, middle.solid_conductance, rtol=1e-9)
    high = soft.solid_conductance * np.exp(middle.solid_conductance_scatter)
    np.testing.assert_allclose(curve.high, high, rtol=1e-9)
    assert np.isfinite(high).sum() >= 10


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "size"),
    [("seal", "--cells=0"), ("conductance", "--points=40"), ("scatter", "--samples=50")],
)
def test_runs_as_a_script(name, size, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [f"{name}.py", size, "--out", "own.svg"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
    assert ended.value.code == 0
    assert b"<svg" in (tmp_path / "own.svg").read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bearing", "heat", "fracture", "conductance"])
def test_an_example_prints_what_its_page_shows(name, tmp_path):
    ran = CliRunner().invoke(
        load(name).command, ["--out", str(tmp_path / "own.svg")], catch_exceptions=False
    )
    shown = re.search(
        rf"`python examples/{name}\.py`.*?\n\n((?:    [^\n]*\n)+)", PAGES, re.S
    )[1]
    assert_same_output(ran.output, shown, rtol=0.02)
    assert b"<svg" in (tmp_path / "own.svg").read_bytes()


def test_a_short_smooth_bearing_is_ocvirks(monkeypatch):
    """Ocvirk 1953, half of Sommerfeld's film: W = eta U L^3 e sqrt(16 e^2 + pi^2 (1 - e^2))/(4 c^2 (1 - e^2)^2)."""
    module = load("bearing")
    monkeypatch.setattr(module, "LENGTH", 1e-3)
    smooth = {"mean_separation": np.array([0.0, 1.0])} | dict.fromkeys(
        ("phi_x", "phi_y"), np.ones(2)
    )
    smooth |= dict.fromkeys(("pressure", "area"), np.zeros(2))
    for e in (0.2, 0.5, 0.8):
        found = module.state(smooth, e, 1.0)
        shape = e * np.sqrt(16 * e**2 + np.pi**2 * (1 - e**2)) / (4 * (1 - e**2) ** 2)
        assert found.load == pytest.approx(
            module.VISCOSITY * 1e-9 / module.CLEARANCE**2 * shape, rel=0.015
        )
        # Petroff's friction of the film that fills the gap
        around = (
            2
            * np.pi
            * module.RADIUS
            * 1e-3
            * module.VISCOSITY
            / module.CLEARANCE
            / np.sqrt(1 - e**2)
        )
        assert found.friction * found.load == pytest.approx(around, rel=1e-6)


def test_a_bearing_carries_its_load():
    module = load("bearing")
    slow, fast = module.stribeck(np.array([0.05, 2.0]))
    assert [slow.load, fast.load] == pytest.approx([module.LOAD] * 2, rel=1e-4)
    assert slow.in_contact > 0.5 > fast.in_contact
    table = module.film_table()
    u = module.CLEARANCE * (1 - slow.eccentricity)
    peak = contact(module.FACES, 110e9, mean_separation=u, theory="calibrated").pressure
    assert np.interp(u, table["mean_separation"], table["pressure"]) == pytest.approx(
        peak, rel=2e-3
    )


def test_uniform_conductance_is_resistances_in_series():
    module = load("heat")
    h = 2e4
    area = np.pi * (module.RIM**2 - module.HOLE**2)
    own = module.resistance(np.full_like(module.top.global_coordinates()[0], h))
    k_1, k_2 = module.CONDUCTIVITY
    assert own == pytest.approx(
        (module.THICK / k_1 + 1 / h + module.THICK / k_2) / area, rel=1e-9
    )
    r = np.linspace(module.HOLE, module.CONE, 4001)
    assert np.trapezoid(2 * np.pi * r * module.pressure(r), r) == pytest.approx(
        module.FORCE, rel=1e-6
    )


def test_a_well_draws_what_the_leakage_of_the_contact_lets_through():
    module = load("fracture")
    p = np.linspace(5e6, module.PORE, 401)
    K = contact(
        module.FRACTURE, module.E_STAR, pressure=module.NORMAL - p, theory="calibrated"
    ).leakage.K
    exact = (
        2
        * np.pi
        * np.trapezoid(K, p)
        / (12 * module.VISCOSITY * np.log(module.EDGE / module.WELL))
    )
    assert module.drawn(module.aperture_table(), 5e6) == pytest.approx(exact, rel=3e-3)


def test_newton_in_scikit_fem_from_zero_load(capsys):
    load("newton")
    *steps, last = capsys.readouterr().out.splitlines()
    residuals = [float(line.split()[1]) for line in steps]
    assert residuals[-1] < 1e-12
    assert len(residuals) <= 14
    assert residuals[-2] < 1e-4 * residuals[-3]  # quadratic
    assert "force 8.000000" in last
