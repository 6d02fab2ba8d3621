"""`mbma fit`, and options of measured maps on the command line and in TOML."""

import json

import numpy as np
import pytest
from helpers import random_map, refused, run, topographies

from mbma_tables import Surface, contact
from mbma_tables.common.errors import InputError
from mbma_tables.contacts.measurement import table_of_loads
from mbma_tables.design.specimen import read_specimen

library = topographies()
POINTS = 64
STEP = 0.5
MAP = "docs/data/maps/top-1.top"


@pytest.fixture
def map_file(tmp_path):
    path = tmp_path / "own.nc"
    library.Topography(
        0.02 * random_map(POINTS, 0.03, 1, 1.7), (POINTS * STEP, POINTS * STEP), unit="um"
    ).to_netcdf(str(path))
    return path


@pytest.fixture
def line_file(tmp_path):
    path = tmp_path / "line.csv"
    line = 0.02 * random_map(256, 0.03, 1, 1.7).ravel()[:4000]
    np.savetxt(path, np.c_[0.5 * np.arange(line.size), line], delimiter=",")
    return path


def test_it_tells_what_was_found_and_done(map_file, tmp_path):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "own.png"
    said = run(
        "fit",
        map_file,
        "--short-cutoff",
        "2um",
        "--detrend",
        "quadratic",
        "--E-star",
        "100GPa",
        "--plot",
        picture,
    )
    for text in (
        "h_rms",
        "heights: skewness",
        "slopes: anisotropy",
        "a short cut-off at 2 um removes",
        "GPa/um",
    ):
        assert text in said
    assert "area depends on resolution" in said
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    found = json.loads(run("fit", MAP, "--short-cutoff", "9.4nm", "--json"))
    assert found["theory"] == "simulated"
    assert found["columns"]["area"] == pytest.approx([0.002, 0.01, 0.03, 0.1, 0.3, 0.6])
    assert found["columns"]["valid"] == ["no", *5 * ["yes"]]
    assert any(
        note.startswith("not valid at contact of 0.002: A/A0 is below 0.003")
        for note in found["notes"]
    )


def test_what_the_calibrated_law_of_a_map_does_not_reach_is_left_out():
    columns, notes = table_of_loads(
        Surface.from_map(MAP, short_cutoff="9.4nm"), theory="calibrated"
    )
    assert columns["area"] == pytest.approx([0.002, 0.01, 0.03, 0.1])
    assert any(
        note.startswith("contact of 0.3, 0.6 left out: area must be at most 0.1062")
        for note in notes
    )


def test_a_line_scan(line_file):
    found = json.loads(run("fit", line_file, "--json"))
    assert {"errors", "unseen"} <= {entry["step"] for entry in found["provenance"]}
    assert found["anisotropy"] is None
    assert set(found["columns"]["valid"]) <= {"yes", "no"}
    assert np.isfinite(found["columns"]["pressure"]).all()
    own = Surface.from_profile(line_file)
    assert found["h_rms"] == pytest.approx(float(own.h_rms))
    said = run("contact", "--map", line_file, "--model", "self-affine", "-a", "0.1")
    assert f"fit: hurst {own.fit().fit.hurst:.6g}" in said


def test_every_command_takes_maps_and_says_so(map_file):
    asked = ("contact", "--map", map_file, "-a", "0.05")
    text = run(*asked, "--model", "self-affine")
    fit = json.loads(run(*asked, "--model", "self-affine", "--json"))["surface"]["fit"]
    assert f"residual {fit['residual']:.6g}" in text
    found = json.loads(
        run(*asked, "--short-cutoff", "2um", "--theory", "calibrated", "--json")
    )
    steps = [entry["step"] for entry in found["surface"]["provenance"]]
    assert "short_cutoff" in steps
    assert "resolution" in steps
    assert "area depends on resolution" in run(*asked)


def test_the_same_in_toml(map_file, tmp_path):
    toml = tmp_path / "own.toml"
    toml.write_text('[surface]\nmap = "own.nc"\nshort_cutoff = "2 um"\noutliers = 10\n')
    found = read_specimen(toml).surface
    own = Surface.from_map(map_file, short_cutoff=2.0, outliers=10)
    assert found.h_rms == pytest.approx(own.h_rms)
    assert found.rms_gradient == pytest.approx(own.rms_gradient)
    toml.write_text('[surface]\nname = "concrete"\noutliers = 10\n')
    with pytest.raises(InputError, match="outliers: for a measured map"):
        read_specimen(toml)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["fit", "absent.sur"], "there is no file"),
        (
            ["contact", "--surface", "concrete", "--outliers", "8", "-a", "0.1"],
            "for a measured map, which is missing",
        ),
        (["fit", "MAP", "--dx", "1um"], "leave dx and dy out (unit=... sets their unit)"),
        (
            ["fit", "MAP", "--extrapolate-to", "0.1um"],
            "extrapolate_to and extrapolate_hurst: give both",
        ),
        (["fit", "MAP", "--channel", "7"], "has channels 0 to 0"),
    ],
)
def test_mistakes(words, message, map_file):
    assert message in refused(*(map_file if word == "MAP" else word for word in words))


def test_an_array_in_a_file_needs_its_step(tmp_path):
    path = tmp_path / "own.npy"
    np.save(path, 0.02 * random_map(POINTS, 0.03, 1, 1.7))
    assert "give the sampling step dx" in refused("fit", path)
    assert json.loads(run("fit", path, "--dx", "500nm", "--json"))["length_unit"] == "nm"
    found = json.loads(
        run(
            "fit",
            path,
            "--dx",
            "500nm",
            "--length-unit",
            "um",
            "--short-cutoff",
            "2",
            "--json",
        )
    )
    own = Surface.from_map(path, dx=0.5, unit="um", short_cutoff="2000 nm")
    assert (found["length_unit"], found["rms_gradient"]) == (
        "um",
        pytest.approx(float(own.rms_gradient)),
    )
    known = json.loads(
        run(
            "contact",
            "--map",
            path,
            "--dx",
            "0.5",
            "--length-unit",
            "um",
            "-a",
            "0.01",
            "--json",
        )
    )
    assert known["surface"]["h_rms"] == pytest.approx(
        float(contact(Surface.from_map(path, dx=0.5), area=0.01).surface.h_rms)
    )


def test_plain_lengths_of_a_map_are_in_the_unit_asked_for(map_file):
    words = ("--short-cutoff", "2000", "--length-unit", "nm", "--json")
    found = (
        json.loads(run("fit", map_file, *words)),
        json.loads(run("contact", "--map", map_file, "-a0.01", *words)),
    )
    own = 1e3 * float(Surface.from_map(map_file, short_cutoff=2.0).h_rms)
    assert (found[0]["h_rms"], found[1]["surface"]["h_rms"]) == (
        pytest.approx(own),
        pytest.approx(own),
    )


def test_reasons_are_those_of_the_theory_that_is_tabulated():
    words = (MAP, "--short-cutoff", "9.4nm")
    fit = run("fit", *words)
    assert "table by theory simulated" in fit
    # which is of the map, whatever its statistics
    assert "tested from" not in fit.split("map of 256")[0]
    area = ("--short-cutoff", "9.4nm", "--area", "0.1", "--json")
    found = json.loads(run("contact", "--map", MAP, *area))
    assert found["theory"] == "simulated"
    row = next(line for line in fit.splitlines() if line.strip().startswith("0.1 "))
    pressure = found["columns"]["pressure"][0]
    assert float(row.split()[1]) == pytest.approx(pressure, rel=1e-5)
