"""What `write_code` writes and refuses, and what `check` sees."""

import pathlib
import re
import shutil

import pytest

import mbma_tables.core
from mbma_tables import InputError, __version__
from mbma_tables.export import CODE, code, conformance
from mbma_tables.export.code import Replay, check, write_code
from mbma_tables.models.tables import universal_model
from mbma_tables.surfaces.variants import Variant


@pytest.fixture
def no_compiler(monkeypatch):
    monkeypatch.setattr(code, "web_assembly", lambda *given: b"wasm")


@pytest.mark.usefixtures("no_compiler")
@pytest.mark.parametrize("target", CODE)
def test_every_file_says_what_it_is(target, tmp_path):
    attributes = universal_model().content.attributes
    written = write_code(target, tmp_path / "code", variant="printed")
    assert sorted(written) == sorted((tmp_path / "code").iterdir())
    largest = max(attributes["largest_error_F"], attributes["largest_error_A"])
    core = pathlib.Path(mbma_tables.core.__file__).parent
    of_all = (f"mbma_tables {__version__}", "force is per nominal area", "BSD-3-Clause", "Variant: printed")
    of_tables = ("-6.25 <= X <= 41", f"{largest:.2g} on", "zeta_1 in [3, 1e+05]", "of the table against the law")
    for path in written:
        if (core / path.name).is_file():
            assert path.read_bytes() == (core / path.name).read_bytes()
            continue
        text = path.read_text(encoding="utf-8")
        assert not re.search("@[A-Z_]+@", text)
        # the opening comment without its marks
        head = " ".join(word for word in text[:5000].split() if word not in ("*", "!", "#"))
        assert attributes["values_sha256"] in head
        for fact in (path.name, *of_all, *of_tables) if path.suffix != ".csv" else ():
            assert fact in head, fact


def test_headers_of_the_core_come_with_their_sources(tmp_path):
    written = {path.name for path in write_code("c", tmp_path)}
    included = {name for path in tmp_path.glob("*.[ch]") for name in re.findall(r'#include "(.*)"', path.read_text())}
    assert included | set(code.SOURCES) | {"mbma_conformance.csv"} == written


@pytest.mark.skipif(shutil.which("cc") is None, reason="cc is not installed")
def test_a_wrong_number_is_seen(tmp_path):
    write_code("c", tmp_path)
    table = tmp_path / "mbma_data.c"
    text = table.read_text(encoding="utf-8")
    before, variant = text.split("mbma_variant MBMA_VARIANT")
    assert variant.count(", 0.05, ") == 1
    changed = variant.replace(", 0.05, ", ", 0.0500000001, ")
    table.write_text(f"{before}mbma_variant MBMA_VARIANT{changed}", encoding="utf-8")
    found = check("c", tmp_path)
    assert found.failed > 0
    assert "tolerance" in found.reason
    assert 1e-11 < found.largest["geometry"] < 1e-7
    (tmp_path / "points.csv").write_text("phi,1e-11,1.0\n", encoding="utf-8")
    assert check("c", tmp_path, tmp_path / "points.csv").failed == 1
    (tmp_path / "phi.c").write_text("int broken\n", encoding="utf-8")
    assert "did not compile" in check("c", tmp_path).reason


def test_check_names_what_is_missing(tmp_path, monkeypatch):
    with pytest.raises(InputError, match="target must be one of"):
        check("cobol", tmp_path)
    with pytest.raises(InputError, match="does not exist"):
        check("c", tmp_path)
    write_code("fortran", tmp_path)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert check("fortran", tmp_path) == Replay("gfortran", {}, {}, 0, "gfortran is not installed", ran=False)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("cobol", "code"), "target must be one of"),
        (("c", "code", "guessed"), "variant must be one of"),
        (("c", "a_file"), "a_file"),
        (("c", "code", "reported", "island4d"), "universal"),
    ],
)
def test_bad_requests_leave_no_file(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a_file").write_text("kept", encoding="utf-8")
    with pytest.raises(InputError, match=message) as caught:
        write_code(*arguments)
    assert len(str(caught.value).splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["a_file"]
    assert (tmp_path / "a_file").read_text(encoding="utf-8") == "kept"


def test_points_of_a_variant_with_high_floors():
    """A surface below a floor has no islands, and so no points."""
    each = len(conformance.DEPTHS)
    ratios = [surface[2] / surface[1] for surface in conformance.SURFACES]
    for floor in (3.0, 150.0, 500.0):
        text = conformance.points_text(universal_model(), Variant("high floors", floor_u=floor))
        count = sum(line.startswith("total,") for line in text.splitlines())
        assert count == each * sum(ratio > floor for ratio in ratios), floor
