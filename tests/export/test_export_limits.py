"""Exports where a package or a compiler is missing or does not end, and what fits no target."""

import subprocess
import sys

import pytest
from click.testing import CliRunner

from mbma_tables import InputError, Surface
from mbma_tables.cli import main
from mbma_tables.export import conformance
from mbma_tables.export import law_rows as description
from mbma_tables.export.conformance import KINDS, Replay, check, read_report
from mbma_tables.export.data import to_hdf5, to_parquet
from mbma_tables.export.law_rows import describe_law
from mbma_tables.export.solvers import calculix, optistruct
from mbma_tables.models.universal import universal_model
from mbma_tables.surfaces.readings import Reading

UNITS = {"length_unit": "mm", "stress_unit": "MPa"}
CONCRETE = Surface.named("concrete")


@pytest.fixture(scope="module")
def law():
    return describe_law(CONCRETE, 13.3, rows=20, **UNITS)


@pytest.fixture(scope="module")
def conducting():
    return describe_law(
        CONCRETE, 13.3, rows=20, quantity="conductance", conductivity=50.0, conductivity_unit="mW/K", **UNITS
    )


@pytest.mark.parametrize(
    ("write", "package", "said"),
    [(to_hdf5, "h5py", r"mbma_tables\[hdf5\]"), (to_parquet, "pyarrow", r"mbma_tables\[parquet\]")],
)
def test_a_missing_package_is_named(write, package, said, law, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(InputError, match=said):
        write(law)


def test_conductance_is_no_pressure(conducting):
    with pytest.raises(InputError, match="takes pressure against overclosure here, got conductance against pressure"):
        optistruct(conducting)


def test_pairs_that_calculix_knows(law):
    with pytest.raises(InputError, match="pair must be one of"):
        calculix(law, pair="nodes")


def test_a_tolerance_that_no_number_of_rows_meets(monkeypatch):
    monkeypatch.setattr(description, "MOST_ROWS", 30)
    with pytest.raises(InputError, match="needs more than 30 rows under linear interpolation"):
        describe_law(CONCRETE, 13.3, rtol=1e-6, **UNITS)
    assert describe_law(CONCRETE, 13.3, rtol=0.2, **UNITS).x.size <= 30


def test_points_of_a_reading_with_high_floors():
    """Surfaces below a floor have no islands to tell of."""
    named = conformance.SURFACES
    rows = {}
    for floor in (3.0, 150.0, 500.0):
        text = conformance.points_text(universal_model(), Reading("own", floor_u=floor))
        rows[floor] = [line for line in text.splitlines() if line.startswith("total,")]
    each = len(conformance.DEPTHS)
    ratios = [surface[2] / surface[1] for surface in named]
    for floor, lines in rows.items():
        assert len(lines) % each == 0
        assert len(lines) // each == sum(ratio > floor for ratio in ratios), floor


def test_a_program_that_does_not_end_is_stopped(monkeypatch, tmp_path):
    monkeypatch.setattr(conformance, "LONGEST_RUN", 0.2)
    done = conformance._run([sys.executable, "-c", "import time; time.sleep(60)"], str(tmp_path))
    assert done.returncode == 1
    found = read_report("python", "python", done)
    assert (found.ran, found.failed, found.reason) == (True, 0, "the self-test did not end: no end within 0.2 s")


def test_a_report_among_other_lines():
    kind = next(iter(KINDS))
    said = f"hello\n{kind} 12 3.5e-12\nno row 1 2\nfailed 0\nfailed completely today\n"
    found = read_report("c", "cc", subprocess.CompletedProcess([], 0, said, ""))
    assert found == Replay("c", "cc", True, {kind: 12}, {kind: 3.5e-12}, 0, "")


@pytest.fixture
def replayed(monkeypatch, tmp_path):
    """`mbma export python --check` with that outcome."""

    def run(found, *options):
        monkeypatch.setattr("mbma_tables.export.code.write_code", lambda target, folder, reading: [folder / "a.py"])
        monkeypatch.setattr("mbma_tables.export.conformance.check", lambda target, folder: found)
        return CliRunner().invoke(main, ["export", "python", "--out", str(tmp_path), *options])

    return run


def test_code_that_was_not_replayed(replayed, tmp_path):
    found = Replay("python", "python3", False, {}, {}, 0, "python3 is not installed")
    done = replayed(found, "--check")
    assert done.exit_code == 2
    assert done.output.endswith("mbma: not checked: python3 is not installed\n")
    done = replayed(found)
    assert done.exit_code == 0
    assert done.output == f"{tmp_path / 'a.py'}\n"


def test_code_that_fails_its_points(replayed):
    found = Replay("python", "python3", True, {"phi": 7}, {"phi": 0.5}, 2, "2 answers are beyond their tolerance")
    done = replayed(found, "--check")
    assert done.exit_code == 2
    assert "phi: 7 points, largest relative difference 5.0e-01" in done.output
    assert done.output.endswith("mbma: 2 points failed: 2 answers are beyond their tolerance\n")


def test_a_folder_without_code(tmp_path):
    with pytest.raises(InputError, match="is not there"):
        check("python", tmp_path)
