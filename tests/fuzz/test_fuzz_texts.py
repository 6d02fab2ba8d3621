"""Damaged text files: scenes, surfaces and configurations of tables."""

import pathlib

import numpy as np
import pytest
from fuzzing import finite, spoilt
from helpers import SCALE

from mbma_tables import Scene

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
