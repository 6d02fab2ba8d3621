"""The examples run, draw, and print numbers that other ways of computing them give too."""

import importlib.util
import pathlib
import runpy
import subprocess
import sys

import numpy as np
import pytest

from mbma_tables import Surface, contact

pytest.importorskip("matplotlib")

EXAMPLES = pathlib.Path(__file__).parents[1] / "examples"
PNG = b"\x89PNG\r\n\x1a\n"


def load(name):
    if name == "scatter":
        pytest.importorskip("dask")
    spec = importlib.util.spec_from_file_location(f"example_{name}", EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    # dataclasses look their module up
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def seal(tmp_path_factory):
    module = load("seal")
    picture = tmp_path_factory.mktemp("seal") / "seal.png"
    return module, module.main(picture, cells=0), picture


@pytest.fixture(scope="module")
def scatter(tmp_path_factory):
    module = load("scatter")
    picture = tmp_path_factory.mktemp("scatter") / "scatter.png"
    return module, module.main(picture, samples=20), picture


@pytest.fixture(scope="module")
def conductance(tmp_path_factory):
    module = load("conductance")
    picture = tmp_path_factory.mktemp("conductance") / "conductance.png"
    return module, module.main(picture, points=40), picture


@pytest.mark.parametrize("name", ["seal", "scatter", "conductance"])
def test_a_picture_is_drawn(name, request):
    picture = request.getfixturevalue(name)[2]
    content = picture.read_bytes()
    assert content.startswith(PNG)
    width, height = (int.from_bytes(content[k : k + 4], "big") for k in (16, 20))
    assert width > 600
    assert height > 300


def direct(module, x):
    """log(pressure/LOAD) and log(conductance), contact by contact, written again from the statement."""
    h_rms, h_max = np.exp(x[0]), module.CREST * np.exp(x[0])
    face = Surface(x[1], module.Q0, np.exp(x[2]), h_rms, h_max)
    both = [contact(face, mean_separation=x[3] * h_max + deeper, theory="calibrated") for deeper in (0, module.DEPTH)]
    pressure = module.E_STAR * np.mean([half.force for half in both])
    return np.log([pressure / module.LOAD, np.mean([half.leakage.conductance for half in both])])


def test_seal_gradients(seal):
    module, found, _ = seal
    x = found.result.x
    values, gradients = module.log_answers(x)
    np.testing.assert_allclose(values, direct(module, x), atol=1e-9)
    for axis in range(4):
        step = np.zeros(4)
        step[axis] = 1e-4
        central = (direct(module, x + step) - direct(module, x - step)) / 2e-4
        np.testing.assert_allclose(gradients[:, axis], central, rtol=1e-4, atol=1e-4)


def test_seal_optimum_meets_the_conditions_of_karush_kuhn_and_tucker(seal):
    module, found, _ = seal
    x = found.result.x
    assert found.result.success
    pressure, conductance = direct(module, x)
    assert abs(pressure) < 1e-6
    assert found.result.fun == pytest.approx(conductance, abs=1e-6)
    _, (load, leak) = module.log_answers(x)
    low, high = np.transpose(module.BOUNDS)
    at_low, at_high = x <= low + 1e-9, x >= high - 1e-9
    free = ~(at_low | at_high)
    assert free.tolist() == [True, False, False, True]
    # -leak = multiplier * load where free, and pushes outwards at the bounds
    multiplier = leak[free] @ load[free] / (load[free] @ load[free])
    rest = multiplier * load - leak
    assert np.abs(rest[free]).max() < 1e-3 * np.abs(leak).max()
    assert (rest[at_high] > 0).all()
    assert (rest[at_low] < 0).all()


def test_seal_optimum_is_the_least_of_others_under_the_load(seal):
    module, found, _ = seal
    others = module.alike(found.result.x, found.result.x[0] + np.array([-0.3, -0.01, 0.01, 0.3]))
    assert (others > np.exp(found.result.fun)).all()
    assert others[1:3].max() < 1.001 * np.exp(found.result.fun)


@pytest.mark.slow
def test_seal_leaks_as_simulated(seal):
    pytest.importorskip("tamaas")
    module, found, _ = seal
    simulated = module.simulate(found.best, found.result.x, 256, 7)
    scatter = found.best.leakage.scatter[0, 1]
    assert abs(np.log(np.exp(found.result.fun) / simulated)) < 3 * scatter


def test_scatter_is_the_exact_tier_sample_by_sample(scatter):
    module, spread, _ = scatter
    lazy = module.sample_surfaces(20)
    numbers = np.stack([getattr(lazy, name).compute() for name in ("hurst", "q1", "h_rms", "h_max")], axis=1)
    for k, (hurst, q1, h_rms, h_max) in enumerate(numbers):
        own = Surface(hurst, module.Q0, q1, h_rms, h_max)
        exact = contact(own, module.GAP, tier="exact", rtol=1e-7)
        assert spread.force[k] == pytest.approx(exact.force, rel=1.2e-6, abs=0)


def test_scatter_samples_have_the_stated_distribution(scatter):
    module, _, _ = scatter
    count = 20_000
    surfaces = module.sample_surfaces(count)
    for sample, (mean, deviation) in (
        (np.log(surfaces.h_rms), module.LOG_H_RMS),
        (np.log(surfaces.q1), module.LOG_Q1),
    ):
        values = sample.compute().values
        assert abs(values - mean).max() <= 3 * deviation * (1 + 1e-12)
        assert abs(values.mean() - mean) < 5 * deviation / np.sqrt(count)
        # a normal cut at three deviations keeps 0.98658 of its deviation
        assert values.std() == pytest.approx(0.98658 * deviation, rel=0.03, abs=0)
    hurst = surfaces.hurst.compute().values
    assert hurst.min() >= 0.3
    assert hurst.max() <= 1
    assert (np.corrcoef([hurst, surfaces.q1.compute(), surfaces.h_rms.compute()]) - np.eye(3)).max() < 0.05


def test_scatter_standard_errors_are_those_of_repeated_samples(scatter):
    module, _, _ = scatter
    # forces of one large sample, cut into many of the same size
    count, repeats = 200, 40
    force = module.spread_of_force(count * repeats).force.reshape(repeats, count)
    own = np.quantile(force, module.QUANTILES, axis=1).std(axis=1, ddof=1)
    stated = module.spread_of_force(count).standard_errors
    # the deviation of 40 numbers is known to 11%, a stated one to some 20%
    assert (np.abs(np.log(own / stated)) < np.log(2)).all()


@pytest.mark.parametrize("name", ["seal", "conductance", "scatter", "own_island_model"])
def test_help_is_asked_of_a_script(name, tmp_path):
    command = [sys.executable, str(EXAMPLES / f"{name}.py"), "--help"]
    said = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert said.startswith(f"Usage: {name}.py [OPTIONS]")
    assert name == "own_island_model" or "--out" in said
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "size"), [("seal", "--cells=0"), ("conductance", "--points=40"), ("scatter", "--samples=50")]
)
def test_runs_as_a_script(name, size, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [f"{name}.py", size, "--out", "own.svg"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
    assert ended.value.code == 0
    assert [path.name for path in tmp_path.iterdir()] == ["own.svg"]
    assert b"<svg" in (tmp_path / "own.svg").read_bytes()


def test_elastic_conductance_is_the_finite_difference_of_pressures(conductance):
    module, curve, _ = conductance
    joint = module.JOINT
    k_s = 2 / (1 / module.K_STEEL + 1 / module.K_ALUMINIUM)
    u = np.linspace(0.3, 0.6, 9) * joint.h_max
    step = 1e-4 * joint.h_rms
    p_minus, p, p_plus = (
        contact(joint, mean_separation=u + k * step, theory="calibrated", E_star=module.E_STAR).force
        for k in (-1, 0, 1)
    )
    h = k_s / module.E_STAR * (p_minus - p_plus) / (2 * step)
    inside = (p > curve.pressure[0]) & (p < curve.pressure[-1])
    assert inside.sum() >= 4
    found = np.exp(np.interp(np.log(p), np.log(curve.pressure), np.log(curve.elastic)))
    # forty points of a curve, drawn straight between
    np.testing.assert_allclose(found[inside], h[inside], rtol=5e-3)


def test_conductance_of_a_yielding_joint(conductance):
    _, curve, _ = conductance
    assert (curve.low < curve.conductance).all()
    assert (curve.conductance < curve.high).all()
    # more area than elastic, and far more than the slope of loading says
    assert (curve.conductance > curve.elastic).all()
    assert (curve.loading_slope < 0.8 * curve.conductance).all()
    ratio = curve.plastic_correlation / curve.conductance
    assert ((ratio > 0.6) & (ratio < 1.7)).all()


def test_conductance_of_one_smooth_circular_spot_gives_the_constant(conductance):
    module, curve, _ = conductance
    # Hertz: F = 4/3 E* sqrt(R) delta^(3/2), a = sqrt(R delta); Holm: 1/R = 4 a/(1/k1 + 1/k2)
    radius, delta, E_star = 2e-3, 1e-6, module.E_STAR
    stiffness = 2 * E_star * np.sqrt(radius * delta)
    holm = 4 * np.sqrt(radius * delta) / (1 / module.K_STEEL + 1 / module.K_ALUMINIUM)
    ratio = curve.conductance / curve.stiffness
    np.testing.assert_allclose(ratio, holm / stiffness, rtol=1e-13)
