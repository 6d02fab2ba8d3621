"""`mbma plan` and `mbma run`."""

import json
import pathlib

import pytest
import xarray
from helpers import refused, run

JOINT = str(pathlib.Path(__file__).parents[2] / "examples" / "scene_joint.toml")
ROAD = str(pathlib.Path(__file__).parents[2] / "examples" / "scene_road.toml")


def test_plan_as_text_and_json():
    text = run("plan", JOINT)
    assert "-> law by" in text
    assert "left out: pressure, energy" in text
    content = json.loads(run("plan", JOINT, "--json"))
    assert [step["name"] for step in content["steps"]] == ["law"]


def test_run_to_netcdf_and_csv(tmp_path):
    out = tmp_path / "joint.nc"
    assert run("run", JOINT, "--out", out) == ""
    with xarray.open_dataset(out) as found:
        assert found["conductance"].shape == (4,)
        assert found.attrs["variant"] == "reported"
        assert found.attrs["error"] <= 1e-5
        assert found["nominal_pressure"].attrs["units"] == "Pa"
    # the picture is of force and area, whatever else is asked for
    out, picture = tmp_path / "joint.csv", tmp_path / "joint.svg"
    assert run("run", JOINT, "--out", out, "--plot", picture) == ""
    assert b"svg" in picture.read_bytes()
    assert "conductance" in out.read_text(encoding="utf-8")


def test_run_as_table_json_and_picture(tmp_path):
    picture = tmp_path / "road.png"
    assert "persson_pressure" in run("run", ROAD, "--plot", picture)
    assert picture.read_bytes().startswith(b"\x89PNG")
    content = json.loads(run("run", ROAD, "--json"))
    assert content["variables"]["profile_pressure"]["dims"] == ["island", "node"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", JOINT, "--out", "joint.txt"], "--out must end with"),
        (["run", JOINT, "--plot", "joint.jpg"], "must end with one of .png, .svg, .pdf"),
        (["run", "none.toml"], "give the path of a scene file"),
        (["plan", "none.toml"], "give the path of a scene file"),
    ],
)
def test_mistakes_end_with_one_line(arguments, words):
    assert words in refused(*arguments)
