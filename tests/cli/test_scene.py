"""`mbma plan`, `run`, `cost` and `batch`."""

import json
import pathlib

import pytest
import xarray
from click.testing import CliRunner
from helpers import refused, run, told

from mbma_tables import Surface, contact
from mbma_tables.cli import main
from mbma_tables.scenes.costs import UNIT, Distance, shipped_costs, shipped_distances

JOINT = str(pathlib.Path(__file__).parents[2] / "examples" / "scene_joint.toml")
ROAD = str(pathlib.Path(__file__).parents[2] / "examples" / "scene_road.toml")


def test_plan_as_text_and_json():
    text = run("plan", JOINT)
    assert "-> contact by" in text
    assert "left out: pressure, energy" in text
    content = json.loads(run("plan", JOINT, "--json"))
    assert [step["name"] for step in content["steps"]] == ["contact"]


def test_run_to_netcdf_and_csv(tmp_path):
    out = tmp_path / "joint.nc"
    assert run("run", JOINT, "--out", out) == ""
    with xarray.open_dataset(out) as found:
        assert found["conductance"].shape == (4,)
        assert found.attrs["variant"] == "reported"
        assert found.attrs["error"] <= 1e-5
        assert found["nominal_pressure"].attrs["units"] == "Pa"
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


test_mistakes_end_with_one_line = told(
    lambda arguments: refused(*arguments),
    (["run", JOINT, "--out", "joint.txt"], "--out must end with"),
    (["run", JOINT, "--plot", "joint.jpg"], "must end with one of .png, .svg, .pdf"),
    (["run", "none.toml"], "give the path of a scene file"),
    (["plan", "none.toml"], "give the path of a scene file"),
)


def test_the_table_has_a_line_for_each_row():
    title, _, header, *lines = run("cost").splitlines()
    assert len(lines) == sum(row.island_model != UNIT for row in shipped_costs().rows)
    assert "fixed piece of work" in title
    assert header.split() == ["island_model", "variant", "quantity", "error", "cost", "evaluations", "seconds"]


def test_distances_are_told_beside_times():
    title, _, header, *lines = run("cost", "--distance").splitlines()
    assert title.endswith("s")
    assert header.split() == [*Distance._fields, "seconds"]
    assert len(lines) == len(shipped_distances())
    # no force is known of an area alone
    assert lines[0].split()[-5:-3] == ["-", "-"]
    found = json.loads(run("cost", "--distance", "--json"))
    for row, expected in zip(found["rows"], shipped_distances(), strict=True):
        assert (row["theory"], row["way"]) == (expected.theory, expected.way)
        assert row["seconds"] == pytest.approx(expected.cost * found["unit_seconds"], rel=1e-12, abs=0)


SURFACES = """name,hurst,q0,q1,h_rms,h_max,E_star
smooth,0.8,0.01/um,2/um,1um,3um,100GPa
rough,0.7,10/mm,3/um,0.5um,1500nm,50e9Pa
"""


@pytest.fixture(autouse=True)
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.csv").write_text(SURFACES)


@pytest.mark.parametrize("theory", ["mbma", "calibrated"])
def test_lines_are_single_contacts(theory):
    found = json.loads(run("batch", "s.csv", "-p", "10MPa", "--theory", theory, "--json"))
    assert found["columns"]["name"] == ["smooth", "rough"]
    surfaces = (Surface(0.8, 0.01, 2.0, 1.0, 3.0), Surface(0.7, 0.01, 3.0, 0.5, 1.5))  # um
    for k, (surface, modulus) in enumerate(zip(surfaces, (100.0, 50.0), strict=True)):  # GPa
        single = contact(surface, pressure=0.01, E_star=modulus, theory=theory)
        for name in ("separation", "mean_separation", "pressure", "area", "stiffness", "scatter"):
            assert found["columns"][name][k] == pytest.approx(float(getattr(single, name)), rel=1e-8), name
        assert found["columns"]["valid"][k] == bool(single.valid)
    assert (found["units"]["separation"], found["units"]["pressure"]) == ("um", "GPa")


def test_named_surfaces_loads_in_columns_and_other_kinds_of_numbers():
    lines = "surface,hurst,m0,m2,m4,h_max,area\nconcrete,,,,,,0.01\n,0.7,0.071mm^2,0.27,62/mm^2,1.1mm,0.02\n"
    given = CliRunner().invoke(main, ["batch", "-", "--json", "--length-unit", "um"], input=lines)
    assert given.exit_code == 0, given.output
    found = json.loads(given.stdout)["columns"]
    expected = contact(Surface.named("concrete").to("um"), area=[0.01, 0.02])
    assert found["mean_separation"] == pytest.approx(expected.mean_separation, rel=1e-8)
    assert found["name"] == ["concrete", "line 3"]


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("hurst,q0,q1,h_rms,h_max\n", "no line of a surface"),
        ("", "no line of a surface"),
        ("hurst,q0,q1,h_rms,hmax\n0.8,1,9,1,3\n", "unknown columns hmax"),
        ("hurst,q0,q1,h_rms,h_max\n0.8,1,9,1,3\n0.8,1,9,-1,3\n", "line 3: h_rms must be positive, got -1"),
        ("hurst,q0,q1,h_rms,h_max\n0.8,1,9,1\n", "line 2: a surface needs"),
        ("hurst,q0,q1,h_rms,h_max\n0.8,1,9,1,3,4\n", "line 2: more cells than the header has"),
        ("hurst,q0,q1,h_rms,h_max,hurst\n0.8,1,9,1,3,0.7\n", "more than one column hurst"),
        pytest.param("surface\n" + "x" * 200_000, "bad.csv cannot be read: field larger than field limit", id="long"),
        ("surface,hurst\nconcrete,0.8\n", "line 2: [surface]: name and numbers (hurst) are given"),
        ("surface,pressure\nconcrete,1\n", "one of --separation, --mean-separation, --pressure and --area"),
        ("surface,E_star\nconcrete,1\nasphalt,\n", "some lines have units"),
    ],
)
def test_what_is_refused(tmp_path, lines, message):
    (tmp_path / "bad.csv").write_text(lines)
    assert message in refused("batch", "bad.csv", "-d", "0.1")
    assert "one of --separation" in refused("batch", "s.csv")
