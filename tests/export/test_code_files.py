"""What `write_code` writes, what it refuses, and what `check` sees."""

from __future__ import annotations

import pathlib
import shutil

import pytest

from mbma_tables import __version__
from mbma_tables.errors import InputError, TableFileError
from mbma_tables.export import conformance
from mbma_tables.export.code import TARGETS, write_code
from mbma_tables.export.conformance import check
from mbma_tables.models.universal import shipped, universal_model

DAMAGE = {
    # a file, a number in it, and one near it
    "c": ("mbma_table.h", "#define MBMA_PHI (0.05)", "#define MBMA_PHI (0.0500000001)"),
    "fortran": ("mbma_table.f90", "PHI = 0.05_dp", "PHI = 0.0500000001_dp"),
    "javascript": ("mbma.mjs", "const PHI = 0.05;", "const PHI = 0.0500000001;"),
    "python": ("mbma_reader.py", "\nPHI = 0.05\n", "\nPHI = 0.0500000001\n"),
}


@pytest.mark.parametrize("target", TARGETS)
def test_every_file_says_what_it_is(target: str, tmp_path: pathlib.Path) -> None:
    attributes = universal_model().content.attributes
    written = write_code(target, tmp_path / "code", reading="printed")
    assert sorted(written) == sorted((tmp_path / "code").iterdir())
    for path in written:
        head = " ".join(path.read_text(encoding="utf-8")[:4000].split())
        assert attributes["values_sha256"] in head
        if path.suffix == ".csv":
            continue
        assert "@" not in head
        for fact in (
            path.name,
            f"mbma_tables {__version__}",
            "Reading: printed",
            attributes["physics_sha256"],
            "-6.25 <= X <= 41",
            "force is per nominal area",
            "BSD-3-Clause",
        ):
            assert fact in head, fact
        largest = max(attributes["largest_error_F"], attributes["largest_error_A"])
        assert f"{largest:.2g}" in head


@pytest.mark.parametrize("target", TARGETS)
def test_a_wrong_number_is_seen(target: str, tmp_path: pathlib.Path) -> None:
    program = conformance.BUILDS[target][0]
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed")
    write_code(target, tmp_path)
    assert check(target, tmp_path).reason == ""
    name, right, wrong = DAMAGE[target]
    text = (tmp_path / name).read_text(encoding="utf-8")
    assert text.count(right) == 1
    (tmp_path / name).write_text(text.replace(right, wrong), encoding="utf-8")
    found = check(target, tmp_path)
    assert found.failed > 0
    assert "tolerance" in found.reason
    assert 1e-11 < found.largest["geometry"] < 1e-7


def test_a_row_that_is_no_row_is_a_failure(tmp_path: pathlib.Path) -> None:
    write_code("python", tmp_path)
    (tmp_path / "points.csv").write_text("phi,1e-11,1.0\n", encoding="utf-8")
    assert check("python", tmp_path, tmp_path / "points.csv").reason != ""


def test_a_missing_program_is_told(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_code("fortran", tmp_path)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    found = check("fortran", tmp_path)
    assert not found.ran
    assert found.reason == "gfortran is not installed"


def test_code_that_does_not_compile_is_told(tmp_path: pathlib.Path) -> None:
    if shutil.which("cc") is None:
        pytest.skip("cc is not installed")
    write_code("c", tmp_path)
    (tmp_path / "mbma.c").write_text("int broken\n", encoding="utf-8")
    assert "did not compile" in check("c", tmp_path).reason


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("cobol", "code"), "target must be one of"),
        (("c", "code", "guessed"), "reading must be one of"),
        (("c", "a_file"), "a_file.* cannot be written"),
    ],
)
def test_bad_requests_leave_no_file(
    arguments: tuple[str, ...], message: str, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a_file").write_text("kept", encoding="utf-8")
    with pytest.raises(InputError, match=message) as caught:
        write_code(*arguments)
    assert len(str(caught.value).splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["a_file"]
    assert (tmp_path / "a_file").read_text(encoding="utf-8") == "kept"


def test_tables_that_do_not_serve(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match="universal"):
        write_code("c", tmp_path / "code", table=shipped("island4d"))
    (tmp_path / "broken.nc").write_bytes(b"nothing")
    with pytest.raises(TableFileError):
        write_code("c", tmp_path / "code", table=tmp_path / "broken.nc")
    assert not (tmp_path / "code").exists()


def test_check_refuses_what_it_cannot_check(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match="target must be one of"):
        check("cobol", tmp_path)
    with pytest.raises(InputError, match="is not there"):
        check("c", tmp_path)
