"""`mbma export`: files written whole, or one line and no file."""

import numpy as np
import pytest
from click.testing import CliRunner

from mbma_tables.cli import main

LAW = ["--surface", "concrete", "--E-star", "13.3", "--length-unit", "mm", "--stress-unit", "MPa", "--rows", "20"]
SOLVERS = ("calculix", "abaqus", "lsdyna", "optistruct", "comsol", "moose", "modelica")


def run(*arguments):
    return CliRunner().invoke(main, ["export", *map(str, arguments)])


@pytest.mark.parametrize("target", [*SOLVERS, "csv", "json", "netcdf"])
def test_one_file(target, tmp_path):
    path = tmp_path / "law.out"
    result = run(target, "--out", path, *LAW)
    assert result.exit_code == 0, result.output
    assert path.stat().st_size > 500
    assert [p.name for p in tmp_path.iterdir()] == ["law.out"]


def test_matlab_writes_its_reader_too(tmp_path):
    assert run("matlab", "--out", tmp_path / "law.mat", *LAW).exit_code == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["law.m", "law.mat"]


def test_code_is_written_and_replayed(tmp_path):
    result = run("python", "--out", tmp_path / "code", "--check")
    assert result.exit_code == 0, result.output
    assert "largest relative difference" in result.output


def test_exponential(tmp_path):
    assert run("abaqus", "--out", tmp_path / "law", "--exponential", *LAW).exit_code == 0
    last = (tmp_path / "law").read_text().splitlines()[-1]
    assert np.all(np.array(last.split(", "), dtype=float) > 0)


WITHOUT = {name: [v for k, v in enumerate(LAW) if LAW[k] != name and LAW[k - 1] != name] for name in LAW[::2]}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["calculix", "--out", "law", *WITHOUT["--length-unit"]], "length_unit is missing"),
        (["calculix", "--out", "law", *WITHOUT["--stress-unit"]], "stress_unit is missing"),
        (["calculix", "--out", "law", *WITHOUT["--E-star"]], "a modulus is needed"),
        (["calculix", "--out", "law", *WITHOUT["--surface"]], "one surface is needed"),
        (["calculix", "--out", "law", *LAW, "--pair", "mortar"], "wrongly with mortar"),
        (["calculix", "--out", "law", *WITHOUT["--rows"], "--rows", "300"], "holds 200 rows"),
        (["calculix", "--out", "law", *LAW, "--largest-overclosure", "5"], "largest_overclosure must be in"),
        (["calculix", "--out", "no/such/folder/law", *LAW], "cannot be written"),
        (["csv", "--out", "law", *LAW, "--check"], "none to replay"),
        (["csv", "--out", "law", *LAW, "--exponential"], "law of calculix and abaqus"),
        (["matlab", "--out", "1law.mat", *LAW], "must be NAME.mat"),
        (["cobol", "--out", "law", *LAW], "cobol"),
        (["c", "--out", "code", "--reading", "other"], "reading"),
    ],
)
def test_bad_requests(arguments, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run(*arguments)
    assert result.exit_code == 2
    assert said in result.output
    assert len(result.output.strip().splitlines()) <= 2
    assert list(tmp_path.iterdir()) == []
