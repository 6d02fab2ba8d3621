"""`mbma plan` and `mbma run`."""

import json
import pathlib

import pytest
import xarray
from click.testing import CliRunner

from mbma_tables.cli import main

JOINT = str(pathlib.Path(__file__).parents[2] / "examples" / "scene_joint.toml")
ROAD = str(pathlib.Path(__file__).parents[2] / "examples" / "scene_road.toml")


def invoke(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def test_plan_as_text_and_json():
    text = invoke("plan", JOINT)
    assert text.exit_code == 0
    assert "-> law by" in text.output
    assert "left out: force, energy" in text.output
    content = json.loads(invoke("plan", JOINT, "--json").output)
    assert [step["name"] for step in content["steps"]] == ["law"]


def test_run_to_netcdf_and_csv(tmp_path):
    out = tmp_path / "joint.nc"
    assert invoke("run", JOINT, "--out", out).exit_code == 0
    with xarray.open_dataset(out) as found:
        assert found["conductance"].shape == (4,)
        assert found.attrs["reading"] == "reported"
        assert found.attrs["error"] <= 1e-5
        assert found["nominal_pressure"].attrs["units"] == "Pa"
    out = tmp_path / "joint.csv"
    assert invoke("run", JOINT, "--out", out).exit_code == 0
    assert "conductance" in out.read_text(encoding="utf-8")


def test_run_as_table_json_and_picture(tmp_path):
    picture = tmp_path / "road.png"
    assert "persson_force" in invoke("run", ROAD, "--plot", picture).output
    assert picture.read_bytes().startswith(b"\x89PNG")
    content = json.loads(invoke("run", ROAD, "--json").output)
    assert content["variables"]["profile_pressure"]["dims"] == ["island", "node"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", JOINT, "--out", "joint.txt"], "--out must end with"),
        (["run", JOINT, "--plot", "joint.pdf"], "must end with .png"),
        (["run", JOINT, "--plot", "joint.png"], "ask for both"),
        (["run", "none.toml"], "give the path of a scene file"),
        (["plan", "none.toml"], "give the path of a scene file"),
    ],
)
def test_mistakes_end_with_one_line(arguments, words):
    found = invoke(*arguments)
    assert found.exit_code == 2
    assert words in found.output
    assert "Traceback" not in found.output
