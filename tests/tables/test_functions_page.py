"""docs/functions.md, as a reader follows it: files written, commands typed, code run, in an empty folder."""

import contextlib
import io
import pathlib
import re
import shlex
import shutil
import subprocess

import pytest
from click.testing import CliRunner
from helpers import assert_same_output

from generate.files import ROOT
from mbma_tables.cli import main

PAGE = (ROOT / "docs" / "functions.md").read_text(encoding="utf-8")
FENCE = re.compile(r"^```(py|toml|sh)\n(.*?)^```\n(?:```text\n(.*?)^```)?", re.M | re.S)


def test_the_page_runs_and_prints_what_it_shows(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    blocks = FENCE.findall(PAGE)
    for number, (kind, text, shown) in enumerate(blocks):
        if kind == "toml":
            pathlib.Path("axes.toml").write_text(text)
            continue
        if number == 0:
            pathlib.Path("my_model.py").write_text(text)
            continue
        if kind == "sh":
            found = CliRunner().invoke(
                main, shlex.split(text)[1:], catch_exceptions=False
            )
            output = found.output
        else:
            with contextlib.redirect_stdout(io.StringIO()) as printed:
                exec(text, names)
            output = printed.getvalue()
        assert_same_output(output, shown, rtol=0.1)
    assert {kind for kind, *_ in blocks} == {"py", "toml", "sh"}
    if not shutil.which("gcc"):
        pytest.skip("gcc is not installed")
    build = ["gcc", "force.c", "force_selftest.c", "cells.c", "-lm", "-o", "test"]
    subprocess.run(build, cwd="code", check=True)
    subprocess.run(["./test"], cwd="code", check=True)
