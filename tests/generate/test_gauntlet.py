"""The program that runs every bulk test at full size, on tests of its own."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

from generate.pages import gauntlet
from generate.pages import stability as atlas

BULK = """
import os
import pytest

SIZE = int(os.environ.get("MBMA_GAUNTLET", "1"))

@pytest.mark.parametrize("kind", ["a", "b"])
def test_many(kind, record_property):
    record_property("inputs fuzzed", 10 * SIZE)
    record_property("refused", SIZE)
    record_property("hours", 7)

def test_left_out():
    pytest.skip("not here")
"""
HELPER = 'import os\nSCALE = int(os.environ.get("MBMA_GAUNTLET", "1"))\n'
BESIDE = """
from helper import SCALE

def test_by_its_helper(record_property):
    record_property("faults injected", SCALE)
"""


@pytest.fixture
def root(tmp_path, monkeypatch):
    """A tree with two bulk tests and one that is none."""
    files = {
        "tests/test_bulk.py": BULK,
        "tests/fuzz/helper.py": HELPER,
        "tests/fuzz/test_beside.py": BESIDE,
        "tests/other/test_small.py": "def test_fails():\n    assert False\n",
        "docs/stability.md": (atlas.PAGE).read_text(encoding="utf-8"),
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.setattr(gauntlet, "ROOT", tmp_path)
    monkeypatch.setattr(atlas, "PAGE", tmp_path / "docs" / "stability.md")
    monkeypatch.setattr(atlas, "parts", lambda figure: {name: lambda name=name: f"of {name}" for name in atlas.CORNERS})
    return tmp_path


def run(root, *options):
    return CliRunner().invoke(gauntlet.main, ["--out", str(root / "out"), *options])


def test_what_is_bulk(root):
    assert [path.name for path in gauntlet.bulk_tests()] == ["test_beside.py", "test_bulk.py"]


def test_every_bulk_test_of_the_library_is_found():
    names = {path.name for path in gauntlet.bulk_tests()}
    assert {"test_continuity.py", "test_invariants.py", "test_faults.py", "test_fuzz_tables.py"} <= names
    assert "test_contact.py" not in names


@pytest.mark.parametrize("no_atlas", [False, True])
def test_counts_are_those_of_the_tests(root, no_atlas):
    done = run(root, "--size", "3", *(["--no-atlas"] if no_atlas else []))
    assert done.exit_code == 0, done.output
    text = (root / "out" / "stability.md").read_text(encoding="utf-8")
    assert ("of corners" in text) != no_atlas
    rows = {cells[1].strip("`"): cells[2:-1] for cells in map(_cells, text.splitlines()) if len(cells) == 12}
    assert [cell or "0" for cell in rows["tests/test_bulk.py"][:8]] == ["3", "0", "1", "60", "0", "0", "0", "6"]
    assert [cell or "0" for cell in rows["tests/fuzz/test_beside.py"][:8]] == ["1", "0", "0", "0", "3", "0", "0", "0"]
    assert [cell or "0" for cell in rows["all"][:8]] == ["4", "0", "1", "60", "3", "0", "0", "6"]


def _cells(line):
    return [cell.strip() for cell in line.split("|")]


def test_where_one_fails_no_page_is_written(root):
    (root / "tests" / "test_bulk.py").write_text(BULK + "\ndef test_fails():\n    assert False\n")
    done = run(root)
    assert done.exit_code == 1
    assert "the page stays as it was" in done.output
    assert not (root / "out").exists()
