"""Tables of functions as source code: each language's own compiler or interpreter runs them, at inner and outer points."""

import functools
import json
import math
import pathlib
import shutil
import subprocess
import sys

import numpy as np
import pytest
import tabulated  # noqa: F401, by its name
from click.testing import CliRunner

from mbma_tables import InputError
from mbma_tables.cli import main
from mbma_tables.export.model.function_code import LANGUAGES, function_code
from mbma_tables.tables.make_function import make, wanted_of

UNIT = {"low": 0.0, "high": 1.0}
TABLES = {
    "smooth": {
        "axes": {
            "x": {"low": 0.01, "high": 10.0, "transform": "log", "offset": 0.5},
            "y": UNIT,
        },
        "outputs": {"u": {"transform": "log", "unit": "N"}, "v": {"error": "absolute"}},
    },
    "periodic": {
        "axes": {
            "x": UNIT | {"outside": "periodic"},
            "y": UNIT | {"outside": "nearest"},
            "z": UNIT | {"outside": "nan"},
        }
    },
    "four": {"axes": dict.fromkeys("xyzw", UNIT)},
    "not_a_number": {"axes": {"x": UNIT}, "on_failure": "mark"},
}
PROGRAMS = {
    "c": "gcc",
    "fortran": "gfortran",
    "javascript": "node",
    "matlab": "octave-cli",
}


def run(*line, **options):
    done = subprocess.run(line, capture_output=True, text=True, check=False, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def in_c(folder, points, outputs):
    rows = ", ".join(f"{{{', '.join(map(repr, point))}}}" for point in points)
    (folder / "run.c").write_text(
        f'#include <stdio.h>\n#include "made.h"\nint main(void) {{ const double p[][{len(points[0])}]'
        f" = {{{rows}}}; for (int k = 0; k < {len(points)}; k++) {{ double v[{outputs}], e[{outputs}];"
        f' made(p[k], v, e, NULL); for (int f = 0; f < {outputs}; f++) printf("%.17g ", v[f]); }} }}\n'
    )
    strict = ["-std=c11", "-O2", "-Wall", "-Wextra", "-Wconversion", "-Werror"]
    run(
        "gcc",
        *strict,
        "made.c",
        "made_selftest.c",
        "cells.c",
        "-lm",
        "-o",
        "t",
        cwd=folder,
    )
    run("./t", cwd=folder)
    run(
        "g++", "-x", "c++", "-c", "-Wall", "-Wextra", "made.c", "-o", "made.o", cwd=folder
    )
    run("gcc", *strict[:2], "made.c", "run.c", "cells.c", "-lm", "-o", "r", cwd=folder)
    return run("./r", cwd=folder)


def in_fortran(folder, points, outputs):
    calls = "".join(
        f"call made([{', '.join(f'{number!r}_dp' for number in point)}], v, e)\nprint *, v\n"
        for point in points
    )
    (folder / "run.f90").write_text(
        "program p\nuse made_table\nimplicit none\ninteger, parameter :: dp = kind(1.0d0)\n"
        f"real(dp) :: v({outputs}), e({outputs})\n"
        f"if (.not. made_selftest() <= 1d-13) error stop\n{calls}end program\n"
    )
    run("gfortran", "-Wall", "-Wextra", "-std=f2008", "-Werror", "-ffree-line-length-none",
        "made.f90", "run.f90", "-o", "r", cwd=folder)  # fmt: skip
    return run("./r", cwd=folder)


def in_javascript(folder, points, outputs):
    program = (
        "import('./made.mjs').then(({ made, selftest }) => { if (!(selftest() <= 1e-13)) "
        f"process.exit(1); for (const p of {json.dumps(points)}) "
        "console.log(made(...p).values.join(' ')); })"
    )
    return run("node", "-e", program, cwd=folder)


def in_matlab(folder, points, outputs):
    calls = "".join(
        f"printf('%.17g ', made({', '.join(map(repr, point))})); " for point in points
    )
    program = f"assert(made('selftest') <= 1e-13); {calls}"
    done = subprocess.run(
        ["octave-cli", "--eval", program], capture_output=True, text=True, cwd=folder
    )
    assert "error: assert" not in done.stderr, done.stderr
    return done.stdout


def in_python(folder, points, outputs):
    run(sys.executable, "made.py", cwd=folder)
    program = f"import math, made\nfor p in {points!r}: print(*made.made(*p)[0])"
    return run(sys.executable, "-c", program, cwd=folder)


RUN = {
    "c": in_c,
    "fortran": in_fortran,
    "javascript": in_javascript,
    "matlab": in_matlab,
    "python": in_python,
}


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tables")

    @functools.cache
    def table(name):
        entries = {"function": f"tabulated:{name}", "certificate_points": 400} | TABLES[
            name
        ]
        return make(wanted_of(entries, target=1e-3), folder / f"{name}.nc")

    return table


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] * (n == "four")) for n in TABLES]
)
def test_every_language_gives_the_same_answers(language, name, tables, tmp_path):
    if not shutil.which(PROGRAMS.get(language, sys.executable)):
        pytest.skip(f"{PROGRAMS[language]} is not installed")
    table = tables(name)
    for file, text in function_code(table, language, "made").items():
        (tmp_path / file).write_text(text)
    draws = np.random.default_rng(7)
    inner = [
        [
            float(axis.low + (axis.high - axis.low) * part)
            for axis, part in zip(table.axes, row, strict=True)
        ]
        for row in draws.random((20, len(table.axes)))
    ]
    # ends, and beyond each axis in turn
    points = [
        *inner,
        [axis.low for axis in table.axes],
        [axis.high for axis in table.axes],
    ]
    for k, axis in enumerate(table.axes):
        beyond = list(inner[0])
        beyond[k] = axis.high + 2.25 * (axis.high - axis.low)
        points.append(beyond)
    found = RUN[language](tmp_path, points, len(table.outputs)).split()
    values = np.array(
        [math.nan if "nan" in text.lower() else float(text) for text in found]
    )
    values = values.reshape(len(points), len(table.outputs))
    expected, *_ = table._answers(np.array(points), False)
    assert np.array_equal(np.isnan(values), np.isnan(expected))
    # of outputs that cross 0 the error is absolute
    absolute = [output.error == "absolute" for output in table.outputs]
    scale = np.where(absolute, np.nanmax(np.abs(expected), axis=0), np.abs(expected))
    assert np.nanmax(np.abs(values - expected) / scale) <= 1e-13
    assert (name == "not_a_number") <= np.isnan(expected[:20]).any()


def test_names_that_a_language_lacks_are_refused(tables):
    with pytest.raises(InputError, match="language must be one of c, fortran"):
        function_code(tables("smooth"), "cobol")
    for language, name in {
        "c": "double",
        "python": "lambda",
        "matlab": "end",
        "fortran": "box",
    }.items():
        with pytest.raises(InputError, match="name"):
            function_code(tables("smooth"), language, name)
    with pytest.raises(InputError, match="a name must be"):
        function_code(tables("smooth"), "c", "2x")


def test_the_command_writes_files_and_names_itself(tables, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    wanted = wanted_of({"function": "tabulated:smooth"} | TABLES["smooth"], target=1e-3)
    make(wanted, pathlib.Path("mine.nc"))
    line = ["tables", "export", "python", "mine.nc", "--name", "mine", "--out", "code"]
    done = CliRunner().invoke(main, line)
    assert done.exit_code == 0, done.output
    text = pathlib.Path("code/mine.py").read_text()
    assert "mbma tables export python mine.nc --name mine" in text
    refused = CliRunner().invoke(main, ["tables", "export", "c", "universal"])
    assert refused.exit_code != 0
