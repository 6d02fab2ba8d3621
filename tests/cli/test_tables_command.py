"""`mbma tables info | verify`: what they print and refuse."""

import json
import re

import netCDF4
import numpy as np
import pytest
from helpers import refused, run
from small_tables import small_table

from mbma_tables import open_table
from mbma_tables.tables import open as tabulated
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
def test_info_by_kind_and_by_file(kind, folder):
    text = run("tables", "info", kind)
    assert run("tables", "info", str(folder / f"{kind}.nc")) == text
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
    shown = json.loads(run("tables", "info", kind, "--json"))
    assert shown["attributes"] == content.attributes
    assert shown["attributes"]["format_version"] == FORMAT_VERSIONS[kind]
    assert shown["axes"] == {
        a.name: {**a.attributes(), "nodes": a.nodes} for a in content.axes
    }


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
        ["info", "universal"],
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
        "tables", "info", "island4d"
    )
    assert "universal.nc: cannot be read" in refused("tables", "verify")
    assert "TABLE" in refused("tables", "info")
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
