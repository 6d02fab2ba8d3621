"""Readers of a table's netCDF file in C and MATLAB, run by gcc with libnetcdf and by Octave: Python's answers."""

import pathlib
import shutil
import subprocess

import numpy as np
import pytest
import tabulated  # noqa: F401, by its name

from mbma_tables.export.text import core_file
from mbma_tables.tables.function_table import read_function_table
from mbma_tables.tables.make_function import make, wanted_of

EXAMPLES = pathlib.Path(__file__).parents[2] / "examples"
UNIT = {"low": 0.0, "high": 1.0}
TABLES = {
    "smooth": {
        "axes": {
            "x": {"low": 0.01, "high": 10.0, "transform": "log", "offset": 0.5},
            "y": UNIT | {"outside": "nearest"},
        },
        "outputs": {"u": {"transform": "log"}, "v": {"error": "absolute"}},
    },
    "periodic": {
        "axes": {
            "x": UNIT | {"outside": "periodic"},
            "y": UNIT | {"outside": "nan"},
            "z": UNIT,
        }
    },
    "not_a_number": {"axes": {"x": UNIT}, "on_failure": "mark"},
}
MAIN = r"""
#include <stdio.h>
#include "read_table.h"
int main(int count, char **argv) {
    read_table t;
    const char *fault = read_table_open(argv[1], &t);
    if (fault) { printf("%s", fault); return 3; }
    printf("%.17g\n", read_table_selftest(&t));
    double x[6], values[8], errors[8];
    int64_t cell;
    for (;;) {
        for (size_t a = 0; a < t.cells.axes; a++)
            if (scanf("%lf", &x[a]) != 1) { read_table_free(&t); return count != 2; }
        mbma_cell_answers(&t.cells, 1, x, values, NULL, errors, &cell);
        for (size_t f = 0; f < t.cells.outputs; f++)
            printf("%.17g %.17g ", values[f], read_table_bound(&t, f, values[f], errors[f]));
        printf("\n");
    }
}
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("readers")
    for name, entries in TABLES.items():
        own = {"function": f"tabulated:{name}", "certificate_points": 200, "pieces": 2}
        make(wanted_of(own | entries, target=1e-5), folder / f"{name}.nc")
    return folder


@pytest.fixture(scope="module")
def in_c(tmp_path_factory):
    """The program of MAIN."""
    settings = shutil.which("nc-config")
    if not (settings and shutil.which("gcc")):
        pytest.skip("gcc or libnetcdf is not installed")
    folder = tmp_path_factory.mktemp("c")
    for name in ("cells.c", "elementary.h", "four.h", "mbma.h"):
        (folder / name).write_text(core_file(name))
    for name in ("read_table.c", "read_table.h"):
        shutil.copy(EXAMPLES / name, folder)
    (folder / "main.c").write_text(MAIN)
    flags = [
        subprocess.run([settings, option], capture_output=True, text=True, check=True)
        for option in ("--cflags", "--libs")
    ]
    strict = ["-std=c11", "-O1", "-Wall", "-Wextra", "-Wconversion", "-Werror"]
    line = ["gcc", *strict, "-fsanitize=address,undefined", *flags[0].stdout.split()]
    line += ["main.c", "read_table.c", "cells.c", "-o", "reader"]
    subprocess.run([*line, *flags[1].stdout.split(), "-lm"], cwd=folder, check=True)
    return folder / "reader"


def points_of(table):
    """Held-out points of the file, its corners, and points beyond each axis."""
    low, high = np.array([(axis.low, axis.high) for axis in table.axes]).T
    beyond = low + (high - low) * np.where(np.eye(low.size), 3.25, 0.5)
    return np.concatenate([table.arrays["conformance_x"], [low, high], beyond])


def assert_answers(table, x, found):
    values, _, errors, _ = table._answers(x, False)
    expected = np.stack([values, table._absolute(values, errors)])
    assert np.array_equal(np.isnan(found), np.isnan(expected))
    assert np.isnan(expected[0]).any()
    # outputs that cross 0 have an absolute error
    scale = np.nanmax(np.abs(expected), axis=1, keepdims=True)
    relative = [output.error == "relative" for output in table.outputs]
    scale = np.where(relative, np.abs(expected), scale)
    assert np.nanmax(np.abs(found - expected) / scale) <= 1e-13


@pytest.mark.parametrize("name", TABLES)
def test_the_reader_in_c(name, files, in_c):
    table = read_function_table(files / f"{name}.nc")
    x = points_of(table)
    text = "\n".join(" ".join(map(repr, map(float, row))) for row in x)
    done = subprocess.run(
        [in_c, files / f"{name}.nc"], input=text, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    first, *lines = done.stdout.split("\n")
    assert 0 < float(first) <= 1
    found = np.array([[*map(float, line.split())] for line in lines if line])
    assert_answers(table, x, found.reshape(len(x), -1, 2).transpose(2, 0, 1))


def test_the_reader_in_c_refuses_other_files(files, in_c, tmp_path):
    (tmp_path / "text.nc").write_text("no table")
    own = pathlib.Path(__file__).parents[2] / "tables" / "universal.nc"
    for path, message in {
        tmp_path / "text.nc": "is no netCDF file",
        tmp_path / "none.nc": "is no netCDF file",
        own: "is no table of a function",
    }.items():
        done = subprocess.run([in_c, path], capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (3, "")
        assert message in done.stdout


@pytest.mark.parametrize("name", TABLES)
def test_the_reader_in_matlab(name, files, tmp_path):
    if not shutil.which("octave-cli"):
        pytest.skip("Octave is not installed")
    table = read_function_table(files / f"{name}.nc")
    x = points_of(table)
    rows = "; ".join(" ".join(map(repr, map(float, row))) for row in x)
    program = (
        f"try, pkg load netcdf, catch, exit(77), end\naddpath('{EXAMPLES}');\n"
        f"t = read_table('{files / name}.nc');\n"
        f"[v, e] = read_table(t, [{rows}]);\n"
        "printf('%.17g ', read_table(t, 'selftest'), v.', e.');\nexit(0)\n"
    )
    (tmp_path / "run.m").write_text(program)
    done = subprocess.run(
        ["octave-cli", "--quiet", "run.m"], capture_output=True, text=True, cwd=tmp_path
    )
    if done.returncode == 77:
        pytest.skip("Octave has no package netcdf")
    first, *numbers = done.stdout.replace("NaN", "nan").replace("NA", "nan").split()
    assert 0 < float(first) <= 1, done.stderr
    found = np.array([*map(float, numbers)]).reshape(2, len(x), len(table.outputs))
    assert_answers(table, x, found)


def test_readers_are_short_and_name_variables_of_the_file(files):
    table = read_function_table(files / "smooth.nc")
    names = {*table.arrays, *table.numbers()}
    for file in ("read_table.c", "read_table.m"):
        text = (EXAMPLES / file).read_text()
        assert len(text.splitlines()) <= 200
        quoted = {name for name in names if f'"{name}"' in text or f"'{name}'" in text}
        assert quoted >= names - {"starts"}
