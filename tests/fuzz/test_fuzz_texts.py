"""Damaged text files: scenes, surfaces and configurations of tables."""

import pathlib
import tomllib

import numpy as np
import pytest
from fuzzing import changed, finite, spoilt, toml_text
from helpers import SCALE

from generate.tables import configuration
from mbma_tables import Scene
from mbma_tables.tablefiles.schema import KINDS

EXAMPLES = pathlib.Path(__file__).parents[2] / "examples"
SCENES = sorted(path.name for path in EXAMPLES.glob("scene_*.toml"))


def scene_numbers(path):
    scene = Scene.from_toml(path)
    surface = scene.surface
    return [scene.E_star, scene.rtol or 1e-3, surface.hurst, surface.q0, surface.q1, surface.h_rms, surface.h_max]


@pytest.mark.parametrize("name", SCENES)
def test_scene_bytes(name, tmp_path, tally):
    rng = np.random.default_rng(3)
    path, text = tmp_path / "scene.toml", (EXAMPLES / name).read_bytes()
    for _ in range(60 * SCALE):
        found = tally.read_file(path, spoilt(text, rng), scene_numbers)
        assert found is None or finite(*found)


@pytest.mark.parametrize("name", SCENES)
def test_scene_structure(name, tmp_path, tally):
    rng = np.random.default_rng(4)
    path, document = tmp_path / "scene.toml", tomllib.loads((EXAMPLES / name).read_text())
    for _ in range(60 * SCALE):
        found = tally.read_file(path, toml_text(changed(document, rng)), scene_numbers)
        assert found is None or finite(*found)


SPECTRUM = "# q [1/m], C [m^4]\n" + "".join(f"{q:.6e} {1e-20 * q**-3.4:.6e}\n" for q in np.geomspace(1e3, 1e6, 40))


@pytest.mark.parametrize("name", ["psd.txt", "psd.csv", "psd.gz", "psd.bz2", "psd.xz"])
def test_spectra_beside_scenes(name, tmp_path, tally):
    rng = np.random.default_rng(5)
    (tmp_path / "scene.toml").write_text(
        f'[surface]\npsd = "{name}"\nh_max = 3e-6\n[effects]\non = ["force"]\n[prescribed]\nseparations = 1e-6\n'
    )
    text = SPECTRUM.replace(" ", ",") if name.endswith("csv") else SPECTRUM
    for _ in range(30 * SCALE):
        content = spoilt(text.encode(), rng)
        found = tally.read_file(tmp_path / name, content, lambda _: scene_numbers(tmp_path / "scene.toml"))
        assert found is None or finite(*found)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("by_structure", [False, True])
def test_configurations(kind, by_structure, tmp_path, tally):
    rng = np.random.default_rng(10)
    path, text = tmp_path / "table.toml", (configuration.HERE / f"{kind}.toml").read_bytes()
    document = tomllib.loads(text.decode())

    def nodes(path):
        found = configuration.load(kind, path)
        assert len(found.digest()) == 64
        return [
            configuration.make_axis(name, name, dict(configuration.AXES[kind])[name], axis, 9).values
            for name, axis in found.axes.items()
        ]

    for _ in range(50 * SCALE):
        content = toml_text(changed(document, rng)) if by_structure else spoilt(text, rng)
        found = tally.read_file(path, content, nodes)
        assert found is None or all(finite(values) and (np.diff(values) > 0).all() for values in found)
