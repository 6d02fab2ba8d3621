"""Deviations of theories from simulations: by closed forms, by `contact`, of shipped files and pages."""

import dataclasses
import re

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from helpers import random_map
from scipy.special import erf

from generate import distances
from generate.__main__ import main
from generate.boundary_elements.run import measured_maps
from generate.files import ROOT
from generate.pages import simulations
from generate.theories_of_others import FORCES, Corrected
from mbma_tables import InputError, Surface, contact
from mbma_tables.common.files import shipped_file
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.theories.calibrated.formulas import PERSSON, Spectrum, SpectrumLaw

PAGE = (ROOT / "docs" / "fidelity.md").read_text("utf-8")
PICKED = (
    "bem",
    "gfmd",
    "gfmd 3",
    "challenge",
    "rolloff",
    *distances.MEASURED,
)  # data sets of few surfaces
NUMBER = r"\d[\d.e+-]*"


@pytest.fixture(scope="module")
def bem():
    return distances.older("bem")


def test_areas_and_forces_of_mbma(bem):
    surface = Surface(0.8, 1.0, 64.0, 1.0, 3.3973)
    g = surface.rms_gradient
    found = distances.distances([bem], distances.THEORIES["MBMA reported"])
    by_gap = contact(surface, mean_separation=bem.u, theory="mbma").pressure
    assert found["force"] == pytest.approx(np.log(by_gap / g / bem.force), abs=1e-5)
    # the heaviest loads are beyond the model
    reached = np.isfinite(found["area"])
    assert reached[:5].all()
    assert not reached[-1]
    by_force = contact(surface, pressure=g * bem.force[reached], theory="mbma").area
    assert found["area"][reached] == pytest.approx(
        np.log(by_force / bem.area[reached]), abs=1e-4
    )


def test_perssons_theory_in_closed_form(bem):
    found = distances.distances([bem], distances.THEORIES["Persson"])
    assert found["area"] == pytest.approx(
        np.log(erf(np.sqrt(2) * bem.force) / bem.area), abs=1e-12
    )


def test_a_theory_is_at_no_distance_from_itself(bem):
    law = distances.THEORIES["calibrated"](bem)
    own = dataclasses.replace(bem, area=law.area(bem.force), u=law.separation(bem.force))
    found = distances.distances([own], distances.THEORIES["calibrated"])
    for name, values in found.items():
        assert np.abs(values).max() < 1e-8, name
    nearly = distances.distances(
        [dataclasses.replace(own, area=own.area * 1.02)], distances.THEORIES["calibrated"]
    )
    assert distances.summed_up([own], nearly["area"]) == pytest.approx(
        (np.log(1.02), 1.0)
    )


def test_held_out_distances_are_those_of_the_shipped_file():
    sets = distances.data_sets()
    with xr.open_dataset(shipped_file("calibrated.nc")) as data:
        names = data.attrs["sets"].split("; ")
        edges = (data.contact_low.values, data.contact_high.values)
        stated = data.accuracy.values[names.index("held_out_spectrum, 4 waves, spectrum")]
    seen = [
        one for one in (*sets["spectra"].seen, *sets["plateau"].seen) if one.waves >= 4
    ]
    seen = [one for one in seen if one.split == "held_out_spectrum"]
    found = distances.distances(seen, distances.THEORIES["calibrated"])
    for row, quantity in zip(stated, ("area", "force"), strict=False):
        for k in (3, 4, 5):
            rms = distances.summed_up(seen, found[quantity], edges[0][k], edges[1][k])[0]
            assert rms == pytest.approx(np.hypot(row[k, 0], row[k, 1]), rel=0.02), (
                quantity,
                k,
            )


def test_a_file_of_heights_becomes_a_case(tmp_path):
    pytest.importorskip("tamaas")
    pytest.importorskip("SurfaceTopography")
    grid = random_map(32, 0, 5 / 32)
    grid = (
        grid / grid.std() + np.sin(np.linspace(0, 2 * np.pi, 32, endpoint=False))[:, None]
    )
    np.savetxt(
        tmp_path / "own.asc", grid, header="Width: 1 m\nHeight: 1 m\nValue units: m"
    )
    done = CliRunner().invoke(
        measured_maps, [str(tmp_path / "own.asc"), "--data", str(tmp_path / "own.nc")]
    )
    assert done.exit_code == 0, done.output
    one = distances.measured("own", tmp_path / "own.nc")
    # what is kept gives the law that the map itself gives
    surface = Surface.from_map(grid, 1 / 32, periodic=False, model="measured")
    force = one.force[one.area > 0.02] * surface.bearing.gradient
    mine = distances.THEORIES["calibrated, map"](one).area(one.force[one.area > 0.02])
    assert mine == pytest.approx(
        contact(surface, pressure=force, theory="calibrated").area, rel=0.02
    )
    assert isinstance(
        one.surface, MeasuredSurface
    )  # no self-affine surface stands in for it


def test_committed_page_is_what_the_code_computes():
    sets = distances.data_sets()
    committed = {
        line.split(" | ")[0]: line for line in reversed(PAGE.splitlines())
    }  # the first table
    for line in simulations.summary_table(sets[name] for name in PICKED).splitlines():
        before = committed[line.split(" | ")[0]]
        assert re.sub(NUMBER, "", before) == re.sub(NUMBER, "", line)
        found, expected = (
            list(map(float, re.findall(NUMBER, one))) for one in (before, line)
        )
        assert found == pytest.approx(expected, rel=0.06), line  # two digits are printed


# an exponential law, which is inverted in closed form, as a function of the gap and as an
# object by pressure
POWER = 0.4
DECAY = 0.5
KAPPA = 1.8
FILE = f"""
import numpy as np

name = "by gap"

def answer(surface, mean_separation):
    pressure = {POWER} * surface.q0 * surface.h_rms * np.exp(-mean_separation / ({DECAY} * surface.h_rms))
    return pressure, {KAPPA} * pressure / surface.rms_gradient

class Exponential:
    name = "by pressure"

    def at_pressure(self, surface, pressure):
        p0 = {POWER} * surface.q0 * surface.h_rms
        return {KAPPA} * pressure / surface.rms_gradient, -{DECAY} * surface.h_rms * np.log(pressure / p0)

theory = Exponential()
"""


def deviations():
    """Deviations of area and pressure of the file's law [%], in closed form."""
    seen = distances.held_out()
    force, area, u = (
        np.concatenate([getattr(one, name) for one in seen])
        for name in ("force", "area", "u")
    )
    g = np.concatenate(
        [np.full(one.force.shape, one.surface.rms_gradient) for one in seen]
    )
    touching = np.where(force * g < POWER, np.log(KAPPA * force / area), np.nan)
    errors = touching, np.log(POWER / g / force) - u / DECAY
    inside = [(area >= low) & (area <= high) for low, high in distances.RANGES]
    return [
        100 * np.sqrt(np.nanmean(own[some] ** 2)) for own in errors for some in inside
    ]


def test_scores_of_a_file(tmp_path):
    (tmp_path / "own.py").write_text(FILE)
    done = CliRunner().invoke(
        main, ["score", str(tmp_path / "own.py")], catch_exceptions=False
    )
    assert done.exit_code == 0
    rows = [
        [float(x) for x in re.findall(r"\b[\d.]+", line)]
        for line in done.stdout.splitlines()[2:]
    ]
    for row in rows:
        assert row[:4] == pytest.approx(deviations(), rel=0.05)


def test_perssons_theory_is_the_correction_without_one():
    surface = Surface(0.7, 1.0, 40.0, 1.0, 3.3)
    law = SpectrumLaw(Spectrum.self_affine(0.7, 40.0), None, PERSSON)
    force = FORCES[(FORCES > 1e-3) & (FORCES < 2)]
    area, u = Corrected("none", (1.0,)).at_pressure(
        surface, force * float(surface.rms_gradient)
    )
    assert area == pytest.approx(law.area(force), rel=1e-3)
    assert u == pytest.approx(law.separation(force), rel=1e-3, abs=1e-7)
    # the cover by its own equation solves it
    xu = distances.theories_of(distances.OTHERS)["Xu et al. 2024"]
    P = xu.cover(np.array([0.3, 1.0]))
    right = 2 * FORCES**2 / (np.array([[0.3], [1.0]]) * (xu.gamma + (1 - xu.gamma) * P))
    assert pytest.approx(erf(np.sqrt(right)), abs=1e-9) == P


@pytest.mark.parametrize(
    "text",
    ["", "x = 3\n", "class Theory:\n    name = 'a'\n    def answer(self, s, u): ...\n"],
)
def test_files_without_a_theory_are_refused(text, tmp_path):
    (tmp_path / "none.py").write_text(text)
    with pytest.raises(
        InputError,
        match=r"must have a function answer\(surface, mean_separation\) or at_pressure",
    ):
        distances.theories_of(tmp_path / "none.py")
