"""Exported Fortran: warnings are errors, checks are on, and it answers as the runtime does."""

from __future__ import annotations

import pathlib
import shutil
import subprocess

import code_points
import pytest

from mbma_tables.export.code import write_code
from mbma_tables.export.conformance import read_report

pytestmark = pytest.mark.skipif(shutil.which("gfortran") is None, reason="gfortran is not installed")

STRICT = ("-std=f2008", "-pedantic", "-Wall", "-Wextra", "-Werror", "-fcheck=all", "-fsanitize=address,undefined")
FILES = ("mbma_table.f90", "mbma.f90", "mbma_selftest.f90")


def test_equal_to_the_runtime_with_every_check(tmp_path: pathlib.Path) -> None:
    write_code("fortran", tmp_path)
    points = code_points.write_points(tmp_path)
    command = ["gfortran", *STRICT, "-O1", *FILES, "-o", "selftest"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr[:2000]
    done = subprocess.run(
        [str(tmp_path / "selftest"), str(points)], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.stderr == ""
    code_points.assert_equal_to_runtime(read_report("fortran", "gfortran", done))


@pytest.mark.skipif(shutil.which("nm") is None, reason="nm is not installed")
def test_nothing_is_allocated(tmp_path: pathlib.Path) -> None:
    write_code("fortran", tmp_path)
    subprocess.run(["gfortran", "-std=f2008", "-O1", "-c", *FILES[:2]], cwd=tmp_path, check=True)
    listed = subprocess.run(["nm", "-u", "mbma.o"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    outside = {line.split()[-1] for line in listed.splitlines()}
    assert "log1p" in outside
    assert not [name for name in outside if "alloc" in name or name == "free" or name.startswith("_gfortran")]


def test_lines_stay_within_the_standard(tmp_path: pathlib.Path) -> None:
    for path in write_code("fortran", tmp_path):
        if path.suffix == ".f90":
            lines = path.read_text(encoding="utf-8").splitlines()
            assert max(map(len, lines)) <= 132
            continued = "".join("&" if line.endswith("&") else "." for line in lines)
            assert max(map(len, continued.split("."))) <= 255
