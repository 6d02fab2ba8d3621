"""`mbma plan`, `run` and `cost`."""

import json
import pathlib

import pytest
import xarray
from helpers import refused, run, told

from mbma_tables.common.files import records, shipped_file
from mbma_tables.design.scenes.plan import UNIT, shipped_costs

JOINT = str(pathlib.Path(__file__).parents[2] / "examples" / "scene_joint.toml")
ROAD = str(pathlib.Path(__file__).parents[2] / "examples" / "scene_road.toml")


def test_plan_as_text_and_json():
    text = run("plan", JOINT)
    assert "-> contact by" in text
    assert "left out: pressure, mean_pressure" in text
    content = json.loads(run("plan", JOINT, "--json"))
    assert [step["name"] for step in content["steps"]] == ["contact"]


def test_run_to_netcdf_and_csv(tmp_path):
    out = tmp_path / "joint.nc"
    assert run("run", JOINT, "--out", out) == ""
    with xarray.open_dataset(out) as found:
        assert found["solid_conductance"].shape == (4,)
        assert found.attrs["theory"] == "mbma"
        assert found.attrs["variant"] == "reported"
        assert found.attrs["error"] <= 1e-5
        assert found["nominal_pressure"].attrs["units"] == "Pa"
    out = tmp_path / "joint.csv"
    assert run("run", JOINT, "--out", out) == ""
    assert "solid_conductance" in out.read_text(encoding="utf-8")


def test_run_as_table_and_json():
    assert "persson_pressure" in run("run", ROAD)
    content = json.loads(run("run", ROAD, "--json"))
    assert content["data_vars"]["profile_pressure"]["dims"] == ["island", "node"]


test_mistakes_end_with_one_line = told(
    lambda arguments: refused(*arguments),
    (["run", JOINT, "--out", "joint.txt"], "--out must end with"),
    (["run", "none.toml"], "give the path of a scene file"),
    (["plan", "none.toml"], "give the path of a scene file"),
)


def test_costs_and_distances_have_a_line_for_each_row():
    title, _, header, *lines = run("cost").splitlines()
    assert len(lines) == sum(row["island_model"] != UNIT for row in shipped_costs().rows)
    assert "fixed piece of work" in title
    assert header.split() == [
        "island_model",
        "variant",
        "quantity",
        "error",
        "cost",
        "evaluations",
        "seconds",
    ]
    title, _, header, *lines = run("cost", "--distance").splitlines()
    assert title.endswith("s")
    rows = records(shipped_file("distance.csv"))
    assert header.split() == [*rows[0], "seconds"]
    assert len(lines) == len(rows)
    # no force is known of an area alone
    assert lines[0].split()[-5:-3] == ["-", "-"]
    found = json.loads(run("cost", "--distance", "--json"))
    for row, expected in zip(found["rows"], rows, strict=True):
        assert (row["theory"], row["way"]) == (expected["theory"], expected["way"])
        assert row["seconds"] == pytest.approx(
            float(expected["cost"]) * found["unit_seconds"], rel=1e-12, abs=0
        )


@pytest.mark.parametrize("command", ["plan", "run"])
def test_the_file_of_a_joint_is_no_scene_and_names_its_command(command):
    path = pathlib.Path(JOINT).with_name("joint.toml")
    assert f"`mbma joint {path} --pressure 1MPa` has its results" in refused(
        command, str(path)
    )


STEEP = {
    "--Rq": "1 um",
    "--hurst": "0.05",
    "--longest": "100 um",
    "--shortest": "1e-6 um",
    "--nominal-area": "1 cm^2",
    "--bodies": "70 GPa",
    "--pressure": "0.1GPa",
}


def test_the_remedy_of_a_joint_is_an_option_that_its_command_has():
    given = [word for pair in STEEP.items() for word in pair]
    text = refused("joint", *given, "--set", "theory=mbma")
    assert "--set island_model=exact solves these" in text
    # the option is one of the theory's: another name in its place is refused by that option
    given = [*given, "--set", "theory=mbma", "--set", "island_model=exactly"]
    assert "exactly" in refused("joint", *given)
