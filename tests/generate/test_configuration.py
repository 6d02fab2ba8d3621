"""Configurations: what is allowed, and that whatever is not ends in one line, exit code 2 and nothing written."""

import dataclasses

import pytest
from click.testing import CliRunner
from small_tables import SMALL

from generate.__main__ import main
from generate.tables.commands import KINDS, TABLES
from generate.tables.configuration import MIN_SHIPPED_POINTS, load


def refused(kind, folder, *arguments):
    """What a refusal says; it is one line and leaves the folder as it was."""
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    result = CliRunner().invoke(main, ["tables", kind, "--workers", "1", *arguments])
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)
    assert result.stdout == ""
    assert result.stderr.startswith("generate: ")
    assert len(result.stderr.splitlines()) == 1
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before
    return result.stderr


LOW = "low = -2.0\nhigh = 6.0"
UNIVERSAL = [
    ("zzz = 1", "own.toml: top level: unknown key 'zzz'"),
    ("[axes.Y]\nlow = 1", "[axes]: unknown key 'Y'"),
    ("[axes.X]\nlwo = 1e-3", "[axes.X]: unknown key 'lwo'; did you mean 'low'"),
    ("[axes]\nX = [1, 2]", "axes.X: [1, 2] is not of type 'object'"),
    ("kind = 'island4d'", "kind: 'universal' was expected"),
    ("target = 1e-12", "target: 1e-12 is less than the minimum of 1e-11"),
    ("target = nan", "not JSON compliant"),
    ("max_nodes = 1.5", "max_nodes: 1.5 is not of type 'integer'"),
    ("variant = 'rubbed'", "variant: 'rubbed' is not known"),
    ("[axes.mu]\nhigh = 1e11", "axes.mu.high: 100000000000.0 is greater than the maximum of 10000000000.0"),
    ("[axes.X]\nlow = 5.0\nhigh = 2.0", "axes.X: its nodes must increase from low to high"),
    ("variant = [", "is not a TOML file"),
    (SMALL["universal"].replace("max_nodes = 5000", "max_nodes = 100"), "more than the 100 allowed; raise max_nodes"),
    (SMALL["universal"].replace(LOW, "low = 90.0\nhigh = 100.0"), "hardly a surface visits these axes"),
]
ISLAND4D = [
    ("[axes.hurst]\nhigh = 1.1", "axes.hurst.high: 1.1 is greater than the maximum of 1"),
    ("[axes.hurst]\noffset = 1.0", "[axes.hurst]: unknown key 'offset'"),
    ("[axes.X]\noffset = -0.5", "axes.X: its nodes must increase from low to high, and low + offset be above 0"),
    ("[axes.X]\nnodes = 50000", "nodes, max_nodes allows"),
]


@pytest.mark.parametrize(
    ("kind", "text", "message"),
    [("universal", *row) for row in UNIVERSAL] + [("island4d", *row) for row in ISLAND4D],
)
def test_a_bad_configuration_is_refused(kind, text, message, tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(text)
    said = refused(kind, tmp_path, "--config", str(path), "--out", str(tmp_path / "sub" / "table.nc"))
    assert message in said
    assert not (tmp_path / "sub").exists()


def test_misuse_of_the_command_line_is_refused(tmp_path):
    assert "--config and --target belong to one table" in refused("all", tmp_path, "--target", "1e-6")
    assert "'--workers'" in refused("universal", tmp_path, "--workers", "0")
    assert "'univresal'" in refused("univresal", tmp_path)
    message = refused("universal", tmp_path, "--target", "1e-4", "--out", str(tmp_path))
    assert "--out must name a file" in message


def test_few_certificate_points_are_for_tables_that_are_not_shipped(tmp_path):
    path = tmp_path / "few.toml"
    path.write_text(f"certificate_points = {MIN_SHIPPED_POINTS - 1}")
    for out in ((), ("--out", str(TABLES / "other.nc"))):
        message = refused("universal", tmp_path, "--config", str(path), *out)
        assert f"certificate_points must be at least {MIN_SHIPPED_POINTS} for a table in" in message
    assert not (TABLES / "other.nc").exists()
    for kind in KINDS:
        assert load(kind).certificate_points >= MIN_SHIPPED_POINTS


def test_a_target_alone_is_a_configuration():
    shipped, same = load("island4d"), load("island4d", target=4e-4)
    assert same == shipped
    loose, tight = load("island4d", target=0.1), load("island4d", target=shipped.target / 2)
    # errors are of fourth order
    assert [axis.nodes for axis in tight.axes.values()] == [27, 55, 10, 16]
    assert {axis.nodes for axis in loose.axes.values()} < set(range(8, 20))
    assert load("universal", target=1e-6).target == 1e-6
    assert len({made.digest() for made in (shipped, loose, tight, load("universal"))}) == 4


def test_a_file_changes_what_it_names(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text("[axes.spread]\nhigh = 10.0\nnodes = 17")
    found, shipped = load("island4d", path), load("island4d")
    assert found.axes["spread"] == dataclasses.replace(shipped.axes["spread"], high=10.0, nodes=17)
    assert found.axes["X"] == shipped.axes["X"]
