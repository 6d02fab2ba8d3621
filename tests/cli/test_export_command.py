"""`mbma export`: files written whole, or one line and no file."""

import hashlib
import html
import re
import shlex
import shutil
import zipfile

import numpy as np
import pytest
from click.testing import CliRunner
from helpers import skip_without_package

from mbma_tables.cli import main
from mbma_tables.export import CODE
from mbma_tables.export.model import c_code
from mbma_tables.export.registry import targets
from mbma_tables.export.targets import ROWS

LAW = [
    "--surface",
    "concrete",
    "--E-star",
    "13.3",
    "--length-unit",
    "mm",
    "--stress-unit",
    "MPa",
    "--rows",
    "20",
]
NUMBERS = [
    "--hurst",
    "0.8",
    "--q0",
    "0.1",
    "--zeta-1",
    "50",
    "--h-rms",
    "1",
    "--h-max",
    "3",
]


def run(*arguments):
    return CliRunner().invoke(main, ["export", *map(str, arguments)])


OF_PRESSURE = [
    name
    for name, kind in targets("SOLVERS", "DATA").items()
    if kind.takes_rows("pressure")
]


@pytest.mark.parametrize("target", OF_PRESSURE)
def test_files_of_laws(target, tmp_path):
    skip_without_package(target)
    result = run(target, "--out", tmp_path / "law.mat", *LAW)
    assert result.exit_code == 0, result.output
    assert (tmp_path / "law.mat").stat().st_size > 500
    assert {p.name for p in tmp_path.iterdir()} == {"law.mat"} | (
        {"law.m"} if target == "matlab" else set()
    )


def test_pressures_asked_for_that_are_not_valid_are_told(tmp_path):
    law = [*LAW, "--theory", "calibrated", "--out", tmp_path / "law.csv", "--pressures"]
    # A/A0 = 0.001 is at 0.0046 MPa
    assert "not valid below p = 0.00" in run("csv", *law, "0.001:0.05").stderr
    assert run("csv", *law, "0.01:0.05").stderr == ""


def test_fortran_writes_its_c_too(tmp_path):
    law = [*LAW[:-2], "--name", "road", "--theory", "calibrated", "--out"]
    assert run("fortran-law", *law, tmp_path / "own.f90").exit_code == 0
    assert run("c-law", *law, tmp_path / "own.c").exit_code == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "own.c",
        "own.f90",
        "own.h",
        "own_c.c",
    ]
    beside, own = (
        (tmp_path / name).read_text().partition("*/")[2] for name in ("own_c.c", "own.c")
    )
    assert beside == own


@pytest.mark.parametrize(
    ("target", "name"), [("c-law", "own.h"), ("javascript-law", "own.cjs")]
)
def test_a_file_does_not_replace_one_beside_it(target, name, tmp_path):
    result = run(target, *LAW[:-2], "--theory", "calibrated", "--out", tmp_path / name)
    assert result.exit_code == 2
    assert "a file beside the first one has this name" in result.output
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(shutil.which("cc") is None, reason="cc is not installed")
def test_code_is_written_and_replayed(tmp_path):
    result = run("c", "--out", tmp_path / "code", "--check")
    assert result.exit_code == 0, result.output
    assert "largest relative difference" in result.output


def test_a_check_that_fails(tmp_path, monkeypatch):
    monkeypatch.setattr(
        c_code, "check", lambda folder: c_code.Replay({"phi": 7}, {"phi": 0.5}, 2)
    )
    result = run("c", "--out", tmp_path, "--check")
    assert result.exit_code == 2
    assert (
        "check failed: 2 answers are beyond their tolerance"
        in result.output.splitlines()[-1]
    )
    assert run("c", "--out", tmp_path).exit_code == 0


WITHOUT = {
    name: [v for k, v in enumerate(LAW) if LAW[k] != name and LAW[k - 1] != name]
    for name in LAW[::2]
}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ["calculix", "--out", "law", *NUMBERS, "--E-star", "13.3MPa"],
            "length_unit is missing",
        ),
        (
            ["calculix", "--out", "law", *WITHOUT["--stress-unit"]],
            "stress_unit is missing",
        ),
        (["calculix", "--out", "law", *WITHOUT["--E-star"]], "is given and no modulus"),
        (["calculix", "--out", "law", *WITHOUT["--surface"]], "one surface is needed"),
        (["matlab", "--out", "law.txt", *LAW], "must be NAME.mat"),
        (["cobol", "--out", "law", *LAW], "cobol"),
        (
            ["c_law", "--out", "law", *LAW],
            "no target is named 'c_law'; did you mean 'c-law'?",
        ),
        (
            ["c", "--out", "code", "--rows", "3", "--rtol", "0.1"],
            "leave --rows and --rtol out",
        ),
        (
            ["calculix", "--out", "law", *LAW, "--pressures", "1"],
            "--pressures must be like 0.1:100",
        ),
        (
            [
                "calculix",
                "--out",
                "law",
                *LAW,
                "--pressures",
                "1:1e9",
                "--theory",
                "mbma",
            ],
            "pressure must be at most 2.02721 MPa, at d =",
        ),
        (
            ["calculix", "--out", "law", *LAW, "--conductivity-unit", "W/K"],
            "conductance needs conductivity, which is missing",
        ),
    ],
)
def test_bad_requests(arguments, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run(*arguments)
    assert result.exit_code == 2
    assert said in result.output
    assert len(result.output.strip().splitlines()) <= 2
    assert list(tmp_path.iterdir()) == []


BASE = ["--surface", "concrete", "--E-star", "13.3MPa"]
ANY = {
    "--rows": ["7"],
    "--rtol": ["0.01"],
    "--pressures": ["1kPa:0.5MPa"],
    "--conductivity": ["3", "--conductivity-unit", "mW/(mm K)"],
    "--leakage": [],
    "--name": ["OTHER"],
    "--binaries": ["none"],
    "--theory": ["calibrated"],
    "--hardness": ["2MPa", "--theory", "calibrated"],
    "--variant": ["printed"],
    "--check": [],
}


@pytest.mark.parametrize("target", targets())
def test_an_option_without_effect_is_refused(target, tmp_path):
    base = [] if target in CODE else BASE
    for option in {name.replace("_", "-") for name in ROWS} | {"check", "binaries"}:
        if (
            f"--{option}" not in ANY
            or option.replace("-", "_") in targets()[target].takes
            # formats without names have it in their comments
            or (option == "name" and target not in CODE)
        ):
            continue
        result = run(
            target,
            "--out",
            tmp_path / "law.mat",
            *base,
            f"--{option}",
            *ANY[f"--{option}"],
        )
        assert result.exit_code == 2, option
        assert f"without effect on {target}: leave --{option}" in result.output
        assert len(result.output.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


# one of each kind: within a kind the same function takes the options
KINDS = [(target, option) for target in ("csv", "abaqus", "c-law", "c") for option in ANY]
KINDS.remove(("abaqus", "--leakage"))  # refused by its interaction


@pytest.mark.slow
@pytest.mark.parametrize(
    ("target", "option"),
    [
        pair
        for pair in KINDS
        if pair[1].strip("-").replace("-", "_") in targets()[pair[0]].takes
    ],
)
def test_an_option_has_an_effect(target, option, tmp_path, monkeypatch):
    monkeypatch.setattr(
        c_code, "check", lambda folder: c_code.Replay({"phi": 7}, {"phi": 0.0}, 0)
    )
    base = [] if target in CODE else BASE
    plain = run(target, "--out", tmp_path / "plain", *base)
    given = run(target, "--out", tmp_path / "given", *base, option, *ANY[option])
    assert (plain.exit_code, given.exit_code) == (0, 0), given.output
    wrote, changed = (
        [
            path.read_bytes()
            for path in sorted([*(tmp_path / name).rglob("*.*"), tmp_path / name])
            if path.is_file()
        ]
        for name in ("plain", "given")
    )
    assert wrote != changed or "largest relative difference" in given.output


@pytest.mark.parametrize("target", ["csv", "c-law", "fmu"])
def test_a_header_has_the_command_and_hashes(target, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.save(
        'a map of 100%; "x".npy', np.random.default_rng(3).normal(size=(32, 32)).cumsum(0)
    )
    (path,) = tmp_path.iterdir()
    given = [
        "--map",
        path.name,
        "--dx",
        "1um",
        "--E-star",
        "10 GPa",
        "--length-unit",
        "um",
        "--theory",
        "calibrated",
    ]
    assert run(target, *given, "--out", "law.x").exit_code == 0
    content = (tmp_path / "law.x").read_bytes()
    if target == "fmu":
        content = html.unescape(
            zipfile.ZipFile("law.x").read("modelDescription.xml").decode()
        ).encode()
    text = re.sub(r"\s+(?:[#*] )?", " ", content.decode())
    words = shlex.split(text.partition(": mbma export ")[2].partition("law.x")[0])
    assert [target, *given, "--out"] == words
    assert hashlib.sha256(path.read_bytes()).hexdigest() in text


def test_code_takes_several_quantities(tmp_path):
    more = ["--quantity", "mean_pressure,flow_coefficient"]
    out = ["--theory", "calibrated", "--out", tmp_path / "road.py"]
    result = run("python-law", *LAW[:-2], *more, *out)
    assert result.exit_code == 0, result.output
    text = (tmp_path / "road.py").read_text()
    assert "def mean_pressure(c" in text
    assert "def flow_coefficient(c" in text
