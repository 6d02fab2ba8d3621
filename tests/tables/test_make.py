"""`mbma tables make`: what it prints, makes and refuses, as a user of the installed library calls it."""

import importlib.abc
import os
import re
import subprocess
import sys
import tomllib

import pytest
from click.testing import CliRunner
from small_tables import SMALL

from mbma_tables.cli import main
from mbma_tables.tables.configuration import SCHEMAS, load
from mbma_tables.tables.make import KINDS, forecast
from mbma_tables.tables.open import open_table, verify


def run(*arguments):
    return CliRunner().invoke(main, ["tables", "make", *map(str, arguments)])


def refused(folder, *arguments):
    """The one line of a refusal, which leaves the folder as it was."""
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    result = run(*arguments)
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert len(result.stderr.splitlines()) == 1
    after = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert after == before
    return result.stderr


def keys(schema, prefix=""):
    """All keys of a configuration's schema, as paths."""
    for name, entry in schema["properties"].items():
        if "properties" in entry:
            yield from keys(entry, f"{prefix}{name}.")
        else:
            yield prefix + name


@pytest.mark.parametrize("kind", KINDS)
def test_the_example_has_every_key_and_is_the_default(kind, tmp_path):
    text = run(kind, "--example").stdout
    entries = tomllib.loads(text.replace("# nodes", "nodes"))
    named = set()
    for name, entry in entries.items():
        if name != "axes":
            named.add(name)
        for axis, numbers in entry.items() if name == "axes" else ():
            named |= {f"axes.{axis}.{key}" for key in numbers}
    assert named == set(keys(SCHEMAS[kind]))
    path = tmp_path / "example.toml"
    path.write_text(text)
    assert load(kind, path) == load(kind)


@pytest.mark.parametrize("kind", KINDS)
def test_a_table_is_made_silently_in_a_pipe_and_opens(kind, tmp_path):
    (tmp_path / "grid.toml").write_text(SMALL[kind])
    command = f"-m mbma_tables tables make {kind} --config grid.toml --out mine.nc"
    done = subprocess.run(
        [sys.executable, *command.split()],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stderr == ""
    assert re.fullmatch(
        r"mine\.nc: .*; largest held-out error F .*, A .*; \d+ bytes\n", done.stdout
    )
    assert sorted(path.name for path in tmp_path.iterdir()) == ["grid.toml", "mine.nc"]
    assert verify(tmp_path / "mine.nc").kind == kind
    assert open_table(tmp_path / "mine.nc").name == kind


@pytest.mark.parametrize("kind", KINDS)
def test_a_dry_run_says_points_time_and_size_and_makes_nothing(kind, tmp_path):
    (tmp_path / "grid.toml").write_text(SMALL[kind])
    out = tmp_path / "mine.nc"
    text = run(kind, "--config", tmp_path / "grid.toml", "--out", out, "--dry-run").stdout
    said = re.fullmatch(
        r"(\d+) points, (\d+) islands to solve: about (\d+) s and ([\d.]+) MB\n", text
    )
    assert said
    assert not out.exists()
    configuration = load(kind, tmp_path / "grid.toml")
    content = KINDS[kind](configuration).build()
    points = content.coefficients[..., 0].size
    if kind == "island4d":
        points = content.axes[0].nodes
        for axis in content.axes[1:]:
            points *= axis.nodes
        assert forecast(configuration).points == points
    # estimated from some of the cells
    assert 0.3 < forecast(configuration).points / points < 3


def test_a_target_out_of_reach_names_what_it_takes_and_the_nearest(tmp_path):
    """The remedies are followed: the number of nodes and the target that are named are accepted."""
    said = refused(tmp_path, "island4d", "--target", "1e-6", "--out", tmp_path / "x.nc")
    nodes, nearest = re.search(
        r"takes (\d+) nodes, and max_nodes is 400000: set max_nodes = \1; .* target of (\S+)",
        said,
    ).groups()
    (tmp_path / "more.toml").write_text(f"target = 1e-6\nmax_nodes = {nodes}\n")
    load("island4d", tmp_path / "more.toml")
    load("island4d", target=float(nearest))
    said = refused(tmp_path, "island4d", "--target", "1e-9", "--out", tmp_path / "x.nc")
    most, nearest = re.search(
        r"with max_nodes = (\d+), the nearest .* a target of (\S+);", said
    ).groups()
    (tmp_path / "most.toml").write_text(f"target = {nearest}\nmax_nodes = {most}\n")
    load("island4d", tmp_path / "most.toml")


WRONG = [
    ("targte = 1e-3", "unknown key 'targte'; did you mean 'target'"),
    ("[axes.hurst]\nnodes = 1", "1 is less than the minimum of 8"),
    ("[axes.hurst]\nlow = 0.9\nhigh = 0.5", "axes.hurst: its nodes must increase"),
    ("[axes.hurst]\nlow = 0.5\nhigh = 0.5", "axes.hurst: its nodes must increase"),
    ("[axes.hurts]\nlow = 0.5", "unknown key 'hurts'; did you mean 'hurst'"),
    ("target = nan", "target must be a finite number, got nan"),
    ("target = ", "is not a TOML file"),
]


@pytest.mark.parametrize(("text", "message"), WRONG)
def test_wrong_configurations(text, message, tmp_path):
    (tmp_path / "own.toml").write_text(text)
    out = tmp_path / "x.nc"
    said = refused(tmp_path, "island4d", "--config", tmp_path / "own.toml", "--out", out)
    assert message in said
    assert "own.toml" in said


def test_places_that_cannot_be_written_are_refused_before_work(tmp_path, monkeypatch):
    monkeypatch.setattr("mbma_tables.tables.make.KINDS", {})
    nowhere = tmp_path / "no" / "x.nc"
    assert "there is no folder" in refused(tmp_path, "universal", "--out", nowhere)
    assert "is a folder" in refused(tmp_path, "universal", "--out", tmp_path)
    assert "--out must name the file" in refused(tmp_path, "universal")


def test_a_full_disk_leaves_what_was_there(tmp_path, monkeypatch):
    out = tmp_path / "mine.nc"
    out.write_bytes(b"before")
    (tmp_path / "grid.toml").write_text(SMALL["universal"])

    def full(*given):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    config = tmp_path / "grid.toml"
    said = refused(
        tmp_path, "universal", "--config", config, "--out", out, "--workers", 1
    )
    assert "mine.nc cannot be written: No space left on device" in said


class NoExtras(importlib.abc.MetaPathFinder):
    """Refuses what the library does not depend on."""

    def find_spec(self, name, path, target=None):
        if name.partition(".")[0] in {"mpmath", "sympy", "pandas", "matplotlib"}:
            raise ModuleNotFoundError(name)


def test_tables_are_made_without_any_extra(tmp_path):
    (tmp_path / "grid.toml").write_text(SMALL["universal"])
    program = (
        "import sys; sys.path.insert(0, sys.argv[1]); from test_make import NoExtras; "
        "sys.meta_path.insert(0, NoExtras()); from mbma_tables.cli import main; "
        "main(['tables', 'make', 'universal', '--config', 'grid.toml', '--out', 'a.nc'])"
    )
    subprocess.run(
        [sys.executable, "-c", program, os.path.dirname(__file__)],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        check=True,
    )
    assert (tmp_path / "a.nc").exists()
