"""What fuzzing found, each by itself."""

import types

import numpy as np
import pytest

from mbma_tables import InputError, Scene, Surface

HUGE = 10**400
SCENE = '[effects]\non = ["force"]\n[prescribed]\nseparations = [{}]\nover_h_rms = true\n[surface]\nname = "concrete"\n'


def test_a_scene_with_a_number_beyond_doubles(tmp_path):
    (tmp_path / "scene.toml").write_text(SCENE.format(HUGE))
    with pytest.raises(InputError, match="must be real numbers"):
        Scene.from_toml(tmp_path / "scene.toml")


def test_an_empty_spectrum(tmp_path):
    (tmp_path / "psd.txt").write_text("# q C\n")
    (tmp_path / "scene.toml").write_text(
        '[surface]\npsd = "psd.txt"\nh_max = 1.0\n[effects]\non = ["force"]\n[prescribed]\nseparations = 1.0\n'
    )
    with pytest.raises(InputError, match="must hold two columns"):
        Scene.from_toml(tmp_path / "scene.toml")


def test_a_topography_whose_sizes_are_no_numbers():
    given = types.SimpleNamespace(heights=lambda: np.ones((40, 40)), physical_sizes=("a", "b"))
    with pytest.raises(InputError, match="physical_sizes must be real numbers"):
        Surface.from_map(given)


def test_a_map_of_records():
    given = np.ma.masked_array(np.zeros((40, 40), "f8,i4"))
    with pytest.raises(InputError, match="heights must be real numbers"):
        Surface.from_map(given, 1.0)
