"""`mbma tables list | info | verify`: what they print and refuse."""

import dataclasses
import pathlib
import re

import pytest
from click.testing import CliRunner

from mbma_tables import greenwood_tripp
from mbma_tables.cli import main
from mbma_tables.models import tables as tabulated
from mbma_tables.tablefiles.netcdf import read_table, write_table
from mbma_tables.tablefiles.schema import KINDS


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Small tables in place of the shipped ones."""
    monkeypatch.syspath_prepend(pathlib.Path(__file__).parent / "tablefiles")
    from small_tables import small_table

    for kind in KINDS:
        write_table(tmp_path / f"{kind}.nc", small_table(kind))
    monkeypatch.setattr(tabulated, "shipped", lambda kind: tmp_path / f"{kind}.nc")
    return tmp_path


def run(*arguments):
    result = CliRunner().invoke(main, ["tables", *arguments])
    assert (result.exit_code, result.stderr) == (0, "")
    return result.stdout


def refused(*arguments):
    result = CliRunner().invoke(main, ["tables", *arguments])
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)
    assert result.stdout == ""
    assert result.stderr.startswith("mbma: ")
    assert 1 <= len(result.stderr.splitlines()) <= 2
    return result.stderr


def test_list(folder):
    lines = run("list").splitlines()
    assert [line.partition(":")[0] for line in lines] == list(KINDS)
    assert "12 X x 10 mu; reading any" in lines[0]
    assert "9 X x 10 spread x 6 sphere x 7 hurst; reading reported" in lines[1]
    for kind, line in zip(KINDS, lines, strict=True):
        path = folder / f"{kind}.nc"
        facts = read_table(path).attributes
        assert f"{path.stat().st_size} bytes; data {facts['data_version']}; {path}" in line
        assert f"error F {facts['largest_error_F']:.2g}, A {facts['largest_error_A']:.2g}" in line


@pytest.mark.parametrize("kind", KINDS)
def test_info_by_kind_and_by_file(kind, folder):
    text = run("info", kind)
    assert run("info", str(folder / f"{kind}.nc")) == text
    content = read_table(folder / f"{kind}.nc")
    for axis in content.axes:
        assert f"axis {axis.name}: {axis.long_name}, {axis.low:g} to {axis.high:g}, {axis.nodes} nodes" in text
        assert axis.formula() in text
    for name, value in content.attributes.items():
        assert f"{name}: {value}\n" in text


def test_verify_all_some_and_files(folder):
    lines = run("verify").splitlines()
    assert len(lines) == 2
    for line, kind in zip(lines, KINDS, strict=True):
        within = re.fullmatch(
            rf"{folder / kind}.nc: hashes match; 12 conformance points: table within (.*), "
            "exact solver identical to the last bit",
            line,
        )
        assert within
        assert 0 <= float(within[1]) < 1e-11
    assert run("verify", "island4d").splitlines() == lines[1:]
    assert run("verify", str(folder / "universal.nc")).splitlines() == lines[:1]
    assert run("verify", "island4d", "universal").splitlines() == lines[::-1]


def test_answers_of_another_machine(folder, monkeypatch):
    solve = greenwood_tripp.solve

    def nearby(X, mu, rtol):
        found = solve(X, mu, rtol=rtol)
        return dataclasses.replace(found, phi_F=found.phi_F * (1 + 2e-12))

    monkeypatch.setattr(greenwood_tripp, "solve", nearby)
    assert run("verify", "universal").endswith(", exact solver within 2.0e-12\n")


def test_a_wrong_checksum_is_an_error(folder):
    path = folder / "universal.nc"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    for arguments in (["list"], ["info", "universal"], ["verify"], ["verify", "island4d", str(path)]):
        message = refused(*arguments)
        assert f"{path}: is damaged (its checksum does not match)" in message
        assert "`python -m generate tables all`" in message


def test_a_missing_table_and_a_wrong_kind(folder):
    assert "univrsal: cannot be read: No such file or directory" in refused("verify", "univrsal")
    (folder / "universal.nc").replace(folder / "island4d.nc")
    assert "holds a table of kind 'universal', not island4d" in refused("verify", "island4d")
    assert "holds a table of kind 'universal', not island4d" in refused("info", "island4d")
    assert "universal.nc: cannot be read" in refused("list")


def test_misuse(folder):
    assert "TABLE" in refused("info")
    assert "No such command" in refused("remake")
