"""Files of others: nothing of them is quoted or run, sizes have limits, drafts of killed runs go."""

import os
import time

import pytest
from helpers import refused, run

from mbma_tables import InputError, Surface
from mbma_tables.common.files import write_file

SCENE = """[surface]
psd = "{}"
h_max = 1.0
[prescribed]
separations = [0.5]
[effects]
on = ["area"]
"""


@pytest.mark.parametrize("text", ["root:hunter2:0\n", "1.0 2.0\n3.0 hunter2\n", "1.0 hunter2 3.0\n"])
def test_errors_quote_no_contents(tmp_path, text):
    (tmp_path / "private").write_text(text)
    (tmp_path / "private.csv").write_text(text.replace(" ", ","))
    (tmp_path / "scene.toml").write_text(SCENE.format("private"))
    for told in (refused("plan", tmp_path / "scene.toml"), refused("fit", tmp_path / "private.csv")):
        assert "hunter2" not in told
    assert "row" in refused("plan", tmp_path / "scene.toml")


def test_cells_that_a_spreadsheet_would_run(tmp_path):
    path = tmp_path / "surfaces.csv"
    path.write_text("name,surface\n=cmd|' /C calc'!A0,concrete\n@SUM(1),challenge\nplain,concrete\n")
    lines = run("batch", path, "--area", "0.05", "--csv").splitlines()
    assert [line.split(",")[0] for line in lines[-3:]] == ["'=cmd|' /C calc'!A0", "'@SUM(1)", "plain"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (",".join(map(str, range(200_000))) + "\n", "200000 columns, more than 100"),
        ("name,surface\n" + "\n" * 1_000_001, "lines, more than 1000000"),
        (f"name,surface\n{'x' * 2000},concrete\n", "line 2, column name: more than 1000 letters"),
    ],
)
def test_sizes_have_limits(tmp_path, text, told):
    path = tmp_path / "surfaces.csv"
    path.write_text(text)
    started = time.perf_counter()
    assert told in refused("batch", path, "--area", "0.05")
    assert time.perf_counter() - started < 10


def test_drafts_of_killed_runs_are_removed(tmp_path):
    old, young, other = (tmp_path / name for name in (".a.nc.0123.draft", ".a.nc.4567.draft", ".b.nc.0123.draft"))
    for draft in (old, young, other):
        draft.write_bytes(b"half")
    for draft in (old, other):
        os.utime(draft, (1e9, 1e9))
    write_file(tmp_path / "a.nc", b"whole")
    assert sorted(path.name for path in tmp_path.iterdir()) == [young.name, other.name, "a.nc"]


def test_names_that_no_file_has():
    with pytest.raises(InputError, match="there is no file"):
        Surface.from_map("1" * 300, 1.0)
