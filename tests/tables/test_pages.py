"""Pages that make tables, as a reader follows them: files written, commands typed, code run, in an empty folder."""

import contextlib
import io
import os
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

PAGES = [
    "tutorials/functions.md",
    pytest.param("tutorials/own_table.md", marks=pytest.mark.slow),
]
FENCE = re.compile(r"^```(py|toml|sh|c)\n(.*?)^```\n(?:```text\n(.*?)^```)?", re.M | re.S)
# a block is a file if the sentence above it ends with its name and a colon
NAMED = re.compile(r"`([\w.]+)`:\n\n\Z")
SIZE = re.compile(r"; \d+ bytes")  # compression differs


def blocks_of(page):
    """Kind, file name or None, text, and the output that a page shows, of each block."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    for block in FENCE.finditer(text):
        name = NAMED.search(text[: block.start()])
        yield block[1], name and name[1], block[2], block[3]


def typed(commands):
    """What commands print, those of this program and those of a shell."""
    output = ""
    for line in commands.splitlines():
        if line.startswith("mbma "):
            found = CliRunner().invoke(
                main, shlex.split(line)[1:], catch_exceptions=False
            )
            assert found.exit_code == 0, found.output
            output += found.stdout
        else:
            output += subprocess.run(
                line, shell=True, check=True, capture_output=True, text=True
            ).stdout
    return output


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize("page", PAGES)
def test_the_page_runs_and_prints_what_it_shows(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    kinds = set()
    for kind, name, text, shown in blocks_of(page):
        kinds.add(kind)
        if name:
            pathlib.Path(name).write_text(text)
            continue
        if kind == "sh":
            output = typed(text)
        else:
            assert kind == "py", f"a block of {kind} without the name of its file"
            with contextlib.redirect_stdout(io.StringIO()) as printed:
                exec(text, names)
            output = printed.getvalue()
        if shown:
            # of several commands, the page shows what the last ones print
            lines = SIZE.sub("", output).splitlines()[-len(shown.splitlines()) :]
            assert_same_output("\n".join(lines), SIZE.sub("", shown), rtol=0.1)
    assert kinds >= {"py", "toml", "sh"}
    if page == "tutorials/functions.md":
        build = ["cc", "force.c", "force_selftest.c", "cells.c", "-lm", "-o", "test"]
        subprocess.run(build, cwd="code", check=True)
        subprocess.run([os.path.join(".", "test")], cwd="code", check=True)
