"""`mbma tables show | sample | plot | verify`: what they print and refuse."""

import json
import re

import netCDF4
import numpy as np
import pytest
from helpers import refused, run
from small_tables import small_table

from mbma_tables import open_table
from mbma_tables.tables import open as tabulated
from mbma_tables.tables.make_function import make, wanted_of
from mbma_tables.tables.picture import draw_errors
from mbma_tables.tables.reader import read_table
from mbma_tables.tables.schema import FORMAT_VERSIONS, KINDS, UNIVERSAL
from mbma_tables.tables.writer import write_table


@pytest.fixture
def folder(tmp_path, monkeypatch):
    for kind in KINDS:
        write_table(tmp_path / f"{kind}.nc", small_table(kind))
    monkeypatch.setattr(tabulated, "shipped", lambda kind: tmp_path / f"{kind}.nc")
    return tmp_path


@pytest.mark.parametrize("kind", KINDS)
def test_show_by_kind_and_by_file(kind, folder):
    text = run("tables", "show", kind)
    assert run("tables", "show", str(folder / f"{kind}.nc")) == text
    content = read_table(folder / f"{kind}.nc")
    for axis in content.axes:
        # the universal table has cells
        nodes = "" if kind == UNIVERSAL else f", {axis.nodes} nodes, {axis.formula()}"
        assert (
            f"axis {axis.name}: {axis.long_name}, {axis.low:g} to {axis.high:g}{nodes}\n"
            in text
        )
    for name, value in content.attributes.items():
        assert f"{name}: {value}\n" in text
    shown = json.loads(run("tables", "show", kind, "--json"))
    assert shown["attributes"] == content.attributes
    assert shown["attributes"]["format_version"] == FORMAT_VERSIONS[kind]
    assert shown["axes"] == {
        a.name: {**a.attributes(), "nodes": a.nodes} for a in content.axes
    }
    with netCDF4.Dataset(folder / f"{kind}.nc") as dataset:
        assert list(shown["variables"]) == list(dataset.variables)
        for name, variable in dataset.variables.items():
            entry = shown["variables"][name]
            assert entry["dimensions"] == list(variable.dimensions)
            assert entry["shape"] == list(variable.shape)
            assert entry["largest"] == variable[...].max()
            assert f"variable {name} (" in text
    headings = re.findall("^[A-Z]+$", text, re.MULTILINE)
    assert headings == ["SCHEMA", "AXES", "CERTIFICATE", "PROVENANCE", "DESCRIPTION"]
    certificate = text[text.index("CERTIFICATE") : text.index("PROVENANCE")]
    assert f"largest_error_A: {content.attributes['largest_error_A']}" in certificate


def test_verify_all_some_and_files(folder):
    lines = run("tables", "verify").splitlines()
    assert len(lines) == 2
    for line, kind in zip(lines, KINDS, strict=True):
        assert line.startswith(
            f"{folder / kind}.nc: hashes match; 64 conformance points: table within "
        )
        assert line.endswith(", exact solver identical to the last bit")
    assert run("tables", "verify", "island4d").splitlines() == lines[1:]
    assert run("tables", "verify", str(folder / "universal.nc")).splitlines() == lines[:1]
    assert run("tables", "verify", "island4d", "universal").splitlines() == lines[::-1]
    tables = json.loads(run("tables", "verify", "--json"))["tables"]
    for row, kind in zip(tables, KINDS, strict=True):
        assert row.keys() == {"path", "kind", "points", "table_error", "solver_error"}
        assert (row["path"], row["kind"], row["points"]) == (
            str(folder / f"{kind}.nc"),
            kind,
            64,
        )
        assert 0 <= row["table_error"] < 1e-11
        assert row["solver_error"] == 0


@pytest.mark.parametrize("json_form", [[], ["--json"]])
def test_a_wrong_checksum_is_an_error(json_form, folder):
    path = folder / "universal.nc"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    for arguments in (
        ["show", "universal"],
        ["verify"],
        ["verify", "island4d", str(path)],
    ):
        message = refused("tables", *arguments, *json_form)
        assert f"{path}: is damaged (its checksum does not match)" in message
        assert re.search("`mbma tables make (KIND|universal) --out FILE.nc`", message)


def test_a_missing_table_and_a_wrong_kind(folder):
    assert (
        "no file is called 'univrsal': the tables are universal and island4d"
        in refused("tables", "verify", "univrsal")
    )
    (folder / "universal.nc").replace(folder / "island4d.nc")
    assert "holds a table of kind 'universal', not island4d" in refused(
        "tables", "verify", "island4d"
    )
    assert "holds a table of kind 'universal', not island4d" in refused(
        "tables", "show", "island4d"
    )
    assert "universal.nc: cannot be read" in refused("tables", "verify")
    assert "TABLE" in refused("tables", "show")
    assert "No such command" in refused("tables", "remake")
    assert refused("tables") == "mbma: Missing command.\n(see 'mbma tables --help')\n"


def test_a_sample_has_the_lookups_at_all_combinations():
    asked = ("tables", "sample", "island4d", "--delta", "1.5,2", "--zeta-d", "3")
    text = run(*asked, "--zeta-u", "20", "--hurst", "0.8", "--json")
    columns = json.loads(text)["columns"]
    found = open_table("island4d").lookup([1.5, 2.0], 3.0, 20.0, 0.8)
    for name in found._fields:
        assert columns[name] == getattr(found, name).tolist()
    assert "takes X, mu, got X" in refused("tables", "sample", "universal", "--X", "1")


def test_a_sample_has_nan_for_combinations_that_are_no_islands():
    asked = ("tables", "sample", "island4d", "--delta", "1.5", "--zeta-d", "2,20")
    asked += ("--zeta-u", "20", "--hurst", "0.8")
    columns = json.loads(run(*asked, "--outside", "nan", "--json"))["columns"]
    assert columns["F_hat"] == [open_table("island4d").lookup(1.5, 2, 20, 0.8)[0], None]
    assert "zeta_u must be above zeta_d (--outside nan" in refused(*asked)


def test_a_sample_may_be_a_netcdf_file(tmp_path):
    """It was a table of text under that name."""
    path = tmp_path / "sample.nc"
    run("tables", "sample", "universal", "--X", "1,2", "--mu", "0.1", "--out", str(path))
    with netCDF4.Dataset(path) as data:
        found = np.ma.filled(data["phi_F"][:, 0], np.nan)
    np.testing.assert_array_equal(
        found, open_table("universal").answer([1.0, 2.0], 0.1).phi_F
    )


@pytest.fixture(scope="module")
def of_functions(tmp_path_factory):
    """Tables of functions of one, two and three numbers."""
    folder = tmp_path_factory.mktemp("functions")
    unit = {"low": 0.5, "high": 2.0}
    paths = {}
    for names in ("x", "xy", "xyz"):
        wanted = wanted_of(
            {
                "function": "tabulated:bent",
                "target": 1e-3,
                "certificate_points": 100,
                "axes": {name: unit | {"transform": "log"} for name in names},
                "outputs": {"p": {"unit": "N"}, "q": {"error": "absolute", "unit": "m"}},
            }
        )
        paths[names] = folder / f"{names}.nc"
        make(wanted, paths[names])
    return paths


def test_a_table_of_a_function_is_shown_sampled_and_verified(of_functions):
    """The commands refused it as neither universal nor island4d."""
    path = str(of_functions["xy"])
    table = open_table(path)
    shown = json.loads(run("tables", "show", path, "--json"))
    assert shown["axes"]["x"]["transform"] == "log"
    assert shown["attributes"] == table.attributes
    assert "\naxis y: " in run("tables", "show", path)
    points = len(table.arrays["conformance_x"])
    assert f"hashes match; {points} conformance" in run("tables", "verify", path)
    (verdict,) = json.loads(run("tables", "verify", path, "--json"))["tables"]
    assert verdict.pop("error_over_bound") <= 1
    assert verdict == {"path": path, "kind": "function", "points": points}
    asked = ("tables", "sample", path, "--at", "x=1,1.5", "--at", "y=0.75", "--json")
    report = json.loads(run(*asked))
    found = table.lookup([1.0, 1.5], 0.75)
    assert report["columns"]["p"] == found["p"].tolist()
    assert report["columns"]["q_error"] == found.error["q"].tolist()
    assert report["units"]["q_error"] == "m"
    assert "no axis 'w'" in refused("tables", "sample", path, "--at", "w=1")
    assert "y is missing" in refused("tables", "sample", path, "--at", "x=1")
    assert "NAME=NUMBER" in refused("tables", "sample", path, "--at", "x=one")
    assert "takes --at" in refused("tables", "sample", path, "--X", "1")
    assert "takes X, mu" in refused("tables", "sample", "universal", "--at", "X=1")


@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
def test_a_picture_of_the_errors_is_written(suffix, folder):
    out = folder / f"error.{suffix}"
    run("tables", "plot", "universal", "--out", out)
    begins = {"svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF"}
    assert out.read_bytes().startswith(begins[suffix])


def test_a_picture_of_another_kind_and_a_missing_file_are_refused(folder):
    message = refused("tables", "plot", "universal", "--out", folder / "error.jpg")
    assert "--out must end with one of .png, .svg, .pdf" in message
    out = folder / "error.png"
    assert "no file is called" in refused("tables", "plot", "mine.nc", "--out", out)
    assert "--out" in refused("tables", "plot", "universal")
    assert not out.exists()


def colours(axes, x, y):
    """The bound that a drawing has at a point: of the last rectangle there."""
    (drawn,) = axes.collections
    ends = np.array([path.get_extents().extents for path in drawn.get_paths()])
    inside = (ends[:, 0] <= x) & (x <= ends[:, 2]) & (ends[:, 1] <= y) & (y <= ends[:, 3])
    return np.asarray(drawn.get_array())[inside][-1]


def test_the_picture_has_the_bound_of_each_place_and_no_gap():
    """A scatter of dots at the middles of cells left gaps, and its colours had no label."""
    pytest.importorskip("matplotlib")
    table = open_table("universal")
    figure = draw_errors(table.content)
    force, area, bar = figure.axes
    assert bar.get_ylabel() == "bound on the relative error"
    rng = np.random.default_rng(5)
    X = rng.uniform(-6.2, 40.9, 200)
    mu = 10 ** rng.uniform(-2.5, 6, 200)
    for x, y in zip(X, mu, strict=True):
        stated = table.answer(x, y).error
        # the error of an answer is that of the worse result
        assert max(colours(force, x, y), colours(area, x, y)) == pytest.approx(stated)


def test_the_picture_of_four_numbers_has_the_largest_bound_over_two_of_them():
    pytest.importorskip("matplotlib")
    content = small_table("island4d")
    force = draw_errors(content).axes[0]
    assert (force.get_xlabel(), force.get_ylabel()) == ("X", "spread")
    X, spread = (axis.values for axis in content.axes[:2])
    for i, j in ((0, 0), (3, 5), (len(X) - 2, len(spread) - 2)):
        drawn = colours(force, (X[i] + X[i + 1]) / 2, (spread[j] + spread[j + 1]) / 2)
        assert drawn == content.local_error[i, j, :, :, 0].max()


def test_pictures_of_functions(of_functions):
    pytest.importorskip("matplotlib")
    labels = ["bound on the relative error", "bound on the absolute error [m]"]
    lines = draw_errors(open_table(of_functions["x"])).axes
    assert [axes.get_ylabel() for axes in lines] == labels
    for names in ("xy", "xyz"):
        table = open_table(of_functions[names])
        axes = draw_errors(table).axes
        assert [bar.get_ylabel() for bar in axes[2:]] == labels
        thirds = np.linspace(0.51, 1.99, 40)
        others = {} if names == "xy" else {"z": thirds}
        stated = table.lookup(x=0.9, y=1.3, **others).error["q"]
        assert colours(axes[1], 0.9, 1.3) == pytest.approx(np.max(stated))
