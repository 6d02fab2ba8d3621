"""How much each unknown matters: against derivatives in closed form, laws of scaling, and plain differences."""

import dataclasses
import json

import numpy as np
import pytest
from helpers import random_map, refusals, run

from mbma_tables import Surface, contact, sensitivity
from mbma_tables.theories import THEORIES

SURFACE = Surface(0.8, 0.06, 12.0, 0.5, 1.7, unit="um")
HELD = {"mean_separation": 1.1, "pressure": 0.03, "area": 0.02}
SLOW = [pytest.param(name, marks=pytest.mark.slow if name == "persson" else ()) for name in THEORIES]


@pytest.mark.parametrize("theory", SLOW)
@pytest.mark.parametrize("by", HELD)
def test_answers_scale_as_they_must(theory, by):
    found = sensitivity(SURFACE, **{by: HELD[by]}, E_star="10 GPa", theory=theory)
    powers = {"mean_separation": (1, 0), "pressure": (0, 1), "area": (0, 0), "stiffness": (-1, 1)}
    powers |= {"conductance": (-1, 0)}
    assert set(found.answers) == set(powers) - {by}
    for answer in found.answers:
        slope = {name: row[answer] for name, row in found.slopes.items()}
        length = slope["h_rms"] + slope["h_max"] + slope.get("mean_separation", 0) - slope["q0"] - slope["q1"]
        stress = slope["E_star"] + slope.get("pressure", 0)
        assert (length, stress) == pytest.approx(powers[answer], abs=2e-5)
        assert all(abs(row[answer]) < 1e-5 for row in found.errors.values())


def test_numbers_of_a_drawing_are_the_unknowns():
    drawing = {"hurst": 0.8, "Ra": 0.4, "Rdq": 0.1, "longest": 100.0, "h_max": 1.8}
    surface = Surface.from_roughness(**drawing, unit="um")
    found = sensitivity(surface, pressure=0.02, E_star=10.0, theory="persson")
    assert list(found.parameters) == ["hurst", "Ra", "h_max", "Rdq", "longest", "E_star", "pressure"]
    # Persson's area is a function of p/(E* g) alone
    slopes = {name: row["area"] for name, row in found.slopes.items()}
    assert slopes["Rdq"] == pytest.approx(-slopes["pressure"], abs=1e-6)
    assert max(abs(slopes[name]) for name in ("hurst", "Ra", "h_max", "longest")) < 1e-6
    assert "q1" in sensitivity(surface.to("mm"), pressure=0.02, E_star=10.0).parameters
    moved = sensitivity(dataclasses.replace(surface, h_max=2.5), mean_separation=1.0, theory="calibrated")
    assert moved.parameters["h_max"] == 2.5
    assert "q1" in moved.parameters


test_what_is_refused = refusals(
    lambda changed: sensitivity(**({"surface": SURFACE, "E_star": 10.0} | changed)),
    ({}, "give exactly one of separation"),
    ({"pressure": 0.1, "area": 0.1}, "got pressure and area"),
    ({"separation": 2.0}, "there is no contact at this separation"),
    ({"pressure": [0.1, 0.2]}, "pressure must be one number"),
    ({"pressure": 0.1, "surface": Surface([0.7, 0.8], 0.06, 12.0, 0.5, 1.7)}, "not of a batch"),
)


def test_the_command():
    arguments = ["--surface", "challenge", "--E-star", "25MPa", "-p", "100kPa"]
    answer = json.loads(run("sensitivity", *arguments, "--json"))
    found = sensitivity(Surface.named("challenge"), pressure=0.1, E_star="25 MPa")
    assert answer["slopes"] == found.slopes
    assert [answer["units"][name] for name in found.parameters] == ["-", "1/um", "1/um", "um", "um", "MPa", "MPa"]
    assert "MPa/um" in run("sensitivity", *arguments)


@pytest.mark.parametrize("theory", ["mbma", "calibrated"])
def test_a_spectrum_in_samples_has_the_slopes_of_its_five_numbers(theory):
    q = np.geomspace(SURFACE.q0, SURFACE.q1, 50)
    sampled = Surface.from_spectrum(q, SURFACE.power_spectrum(q), h_max=SURFACE.h_max, unit="um")
    found, five = (sensitivity(s, pressure=0.03, E_star="10 GPa", theory=theory).slopes for s in (sampled, SURFACE))
    for answer, slope in found["heights"].items():
        assert slope == pytest.approx(five["h_rms"][answer] + five["h_max"][answer], abs=1e-4)
        assert found["lengths"][answer] == pytest.approx(-five["q0"][answer] - five["q1"][answer], abs=1e-4)
        assert found["h_max"][answer] == pytest.approx(five["h_max"][answer], abs=1e-4)
    # a cut takes height away, five numbers keep it
    cut = 0.02
    short = dataclasses.replace(SURFACE, q1=SURFACE.q1 * np.exp(-cut))
    short = dataclasses.replace(short, h_rms=SURFACE.h_rms * float(short.s / short.h_rms * SURFACE.h_rms / SURFACE.s))
    areas = [float(contact(s, pressure=0.03, E_star="10 GPa", theory=theory).area) for s in (short, SURFACE)]
    assert found["shortest"]["area"] == pytest.approx(np.log(areas[0] / areas[1]) / cut, abs=5e-3)


def test_unknowns_of_a_map_and_of_its_extrapolation():
    heights = 0.1 * random_map(64, 0.03, 0.25, power=0)
    given = {"pressure": 0.01, "theory": "calibrated"}
    found = sensitivity(Surface.from_map(heights, 1.0, periodic=True), **given)
    assert set(found.slopes) == {"heights", "lengths", "pressure"}
    # a force over E* and the gradient, whatever the size
    assert found.slopes["heights"]["area"] == pytest.approx(-found.slopes["lengths"]["area"], abs=1e-3)
    assert found.slopes["heights"]["area"] == pytest.approx(-found.slopes["pressure"]["area"], abs=1e-3)
    longer = Surface.from_map(heights, 1.0, periodic=True, extrapolate_to=0.5, extrapolate_hurst=0.8)
    assert sensitivity(longer, **given).slopes["extrapolate_hurst"]["area"] > 0
