"""README's first section: its commands, as they are typed, print what it shows."""

import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest
from helpers import assert_same_output

ROOT = pathlib.Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_the_commands_of_the_first_section_print_what_it_shows(tmp_path):
    section = README[README.index("## A table of your own") :]
    commands, shown = re.findall(
        r"^```\w+\n(.*?)^```", section, re.DOTALL | re.MULTILINE
    )[:2]
    # the folder of a clone, with an environment in which the library is installed
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    programs = tmp_path / ".venv" / "bin"
    programs.mkdir(parents=True)
    for name, words in (("python", ""), ("mbma", " -m mbma_tables")):
        program = programs / name
        program.write_text(f'#!/bin/sh\nexec "{sys.executable}"{words} "$@"\n')
        program.chmod(0o755)
    paths = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    output = ""
    for command in commands.splitlines():
        ran = subprocess.run(
            command,
            shell=True,
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": paths},
            capture_output=True,
            text=True,
            check=True,
        )
        output += ran.stdout
    assert len(commands.splitlines()) == 3
    # the names of the C files that were written are left out
    lines = [line for line in output.splitlines() if not line.startswith("c/")]
    # sizes of files differ by their compression
    without_size = re.compile(r"; \d+ bytes")
    assert_same_output(
        without_size.sub("", "\n".join(lines)), without_size.sub("", shown), rtol=0.05
    )
