"""`mbma fit`, and options of measured maps on the command line and in TOML."""

import json
import warnings

import numpy as np
import pytest
from click.testing import CliRunner

from mbma_tables import Surface
from mbma_tables.cli import main
from mbma_tables.errors import InputError
from mbma_tables.scenes.specimen import read_specimen

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    library = pytest.importorskip("SurfaceTopography")
POINTS, STEP = 64, 0.5


def heights(points=POINTS):
    noise = np.fft.rfft2(np.random.default_rng(3).standard_normal((points, points)))
    q = np.hypot(np.fft.fftfreq(points)[:, None], np.fft.rfftfreq(points))
    return 0.02 * np.fft.irfft2(np.where(q > 0, noise / np.maximum(q, 0.05) ** 1.7, 0))


@pytest.fixture
def map_file(tmp_path):
    path = tmp_path / "own.nc"
    library.Topography(heights(), (POINTS * STEP, POINTS * STEP), unit="um").to_netcdf(str(path))
    return path


@pytest.fixture
def line_file(tmp_path):
    path = tmp_path / "line.csv"
    line = heights(256).ravel()[:4000]
    np.savetxt(path, np.c_[0.5 * np.arange(line.size), line], delimiter=",")
    return path


def run(*words):
    return CliRunner().invoke(main, [str(word) for word in words])


def test_it_tells_what_was_found_and_done(map_file, tmp_path):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "own.png"
    done = run("fit", map_file, "--short-cutoff", "2um", "--E-star", "100GPa", "--plot", picture)
    assert done.exit_code == 0, done.output
    for text in ("h_rms", "heights: skewness", "slopes: anisotropy", "a short cut-off at 2 um removes", "GPa/um"):
        assert text in done.output
    assert "area is a matter of resolution" in done.output
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_a_line_scan(line_file):
    done = run("fit", line_file, "--json")
    assert done.exit_code == 0, done.output
    found = json.loads(done.output)
    assert {"errors", "unseen"} <= {entry["step"] for entry in found["provenance"]}
    assert found["anisotropy"] is None
    assert set(found["columns"]["valid"]) <= {"yes", "no"}
    assert np.isfinite(found["columns"]["force"]).all()
    assert found["h_rms"] == pytest.approx(float(Surface.from_profile(line_file).h_rms))


def test_every_command_takes_maps_and_says_so(map_file):
    done = run("contact", "--map", map_file, "--short-cutoff", "2um", "-a", "0.05", "--theory", "calibrated", "--json")
    assert done.exit_code == 0, done.output
    found = json.loads(done.output)
    steps = [entry["step"] for entry in found["surface"]["provenance"]]
    assert "short_cutoff" in steps
    assert "resolution" in steps
    plain = run("contact", "--map", map_file, "-a", "0.05")
    assert "area is a matter of resolution" in plain.output


def test_the_same_in_toml(map_file, tmp_path):
    toml = tmp_path / "own.toml"
    toml.write_text('[surface]\nmap = "own.nc"\nshort_cutoff = "2 um"\noutliers = 10\n')
    found = read_specimen(toml).surface
    own = Surface.from_map(map_file, short_cutoff=2.0, outliers=10)
    assert found.h_rms == pytest.approx(own.h_rms)
    assert found.rms_gradient == pytest.approx(own.rms_gradient)
    toml.write_text('[surface]\nname = "concrete"\noutliers = 10\n')
    with pytest.raises(InputError, match="outliers: about a measured map"):
        read_specimen(toml)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["fit", "absent.sur"], "there is no file"),
        (["contact", "--surface", "concrete", "--outliers", "8", "-a", "0.1"], "goes with --map"),
        (["fit", "MAP", "--detrend", "cubic"], "detrend must be one of"),
        (["fit", "MAP", "--dx", "1um"], "has its own lengths"),
        (["fit", "MAP", "--extrapolate-to", "0.1um"], "give both or neither"),
        (["fit", "MAP", "--channel", "7"], "has channels 0 to 0"),
    ],
)
def test_mistakes(words, message, map_file):
    done = run(*(map_file if word == "MAP" else word for word in words))
    assert done.exit_code == 2
    assert message in done.output
    assert len(done.output.strip().splitlines()) <= 2


def test_an_array_in_a_file_needs_its_step(tmp_path):
    path = tmp_path / "own.npy"
    np.save(path, heights())
    assert "give the sampling step dx" in run("fit", path).output
    done = run("fit", path, "--dx", "500nm", "--json")
    assert done.exit_code == 0, done.output
    assert json.loads(done.output)["length_unit"] == "nm"
