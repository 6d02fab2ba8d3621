"""The examples run, draw, and print numbers that other ways of computing them give too."""

import importlib.util
import pathlib
import runpy
import sys

import numpy as np
import pytest

from mbma_tables import Surface, contact

pytest.importorskip("matplotlib")

EXAMPLES = pathlib.Path(__file__).parents[1] / "examples"


def load(name):
    if name == "scatter":
        pytest.importorskip("dask")
    spec = importlib.util.spec_from_file_location(f"example_{name}", EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    # dataclasses look their module up
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def example(name, **size):
    @pytest.fixture(scope="module", name=name)
    def made(tmp_path_factory):
        module = load(name)
        return module, module.main(tmp_path_factory.mktemp(name) / "own.png", **size)

    return made


seal, scatter = example("seal", cells=0), example("scatter", samples=20)


def direct(module, x):
    """log(pressure/LOAD) and log(conductance), contact by contact, written again from the statement."""
    h_rms, h_max = np.exp(x[0]), module.CREST * np.exp(x[0])
    face = Surface(x[1], module.Q0, np.exp(x[2]), h_rms, h_max)
    both = [contact(face, mean_separation=x[3] * h_max + deeper, theory="calibrated") for deeper in (0, module.DEPTH)]
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
    scatter = found.best.leakage.scatter[0, 1]
    assert abs(np.log(np.exp(found.result.fun) / simulated)) < 3 * scatter


def test_scatter_is_the_exact_island_model_sample_by_sample(scatter):
    module, spread = scatter
    lazy = module.sample_surfaces(20)
    numbers = np.stack([getattr(lazy, name).compute() for name in ("hurst", "q1", "h_rms", "h_max")], axis=1)
    for k, (hurst, q1, h_rms, h_max) in enumerate(numbers):
        own = Surface(hurst, module.Q0, q1, h_rms, h_max)
        exact = contact(own, separation=module.GAP, island_model="exact", rtol=1e-7)
        assert spread.force[k] == pytest.approx(exact.pressure, rel=1.2e-6, abs=0)


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
