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
from generate.boundary_elements.studies import measured_maps
from generate.files import ROOT
from generate.pages import simulations
from mbma_tables import Surface, contact
from mbma_tables.common.files import shipped_file
from mbma_tables.surfaces.surface import MeasuredSurface

PAGE = (ROOT / "docs" / "fidelity.md").read_text("utf-8")
PICKED = ("bem", "gfmd", "gfmd 3", "challenge", "rolloff", *distances.MEASURED)  # data sets of few surfaces
NUMBER = r"\d[\d.e+-]*"


@pytest.fixture(scope="module")
def bem():
    return distances.older("bem")


def test_areas_and_forces_of_mbma(bem):
    surface = Surface(0.8, 1.0, 64.0, 1.0, 3.3973)
    g = surface.rms_gradient
    found = distances.distances([bem], distances.THEORIES["MBMA reported"])
    by_gap = contact(surface, mean_separation=bem.u).pressure
    assert found["force"] == pytest.approx(np.log(by_gap / g / bem.force), abs=1e-5)
    # the heaviest loads are beyond the model
    reached = np.isfinite(found["area"])
    assert reached[:5].all()
    assert not reached[-1]
    by_force = contact(surface, pressure=g * bem.force[reached]).area
    assert found["area"][reached] == pytest.approx(np.log(by_force / bem.area[reached]), abs=1e-4)


def test_perssons_theory_in_closed_form(bem):
    found = distances.distances([bem], distances.THEORIES["Persson"])
    assert found["area"] == pytest.approx(np.log(erf(np.sqrt(2) * bem.force) / bem.area), abs=1e-12)


def test_a_theory_is_at_no_distance_from_itself(bem):
    law = distances.THEORIES["calibrated"](bem)
    own = dataclasses.replace(bem, area=law.area(bem.force), u=law.separation(bem.force))
    found = distances.distances([own], distances.THEORIES["calibrated"])
    for name, values in found.items():
        assert np.abs(values).max() < 1e-8, name
    nearly = distances.distances([dataclasses.replace(own, area=own.area * 1.02)], distances.THEORIES["calibrated"])
    assert distances.summed_up([own], nearly["area"]) == pytest.approx((np.log(1.02), 1.0))


def test_held_out_distances_are_those_of_the_shipped_file():
    sets = distances.data_sets()
    with xr.open_dataset(shipped_file("calibrated.nc")) as data:
        names, edges = data.attrs["sets"].split("; "), (data.contact_low.values, data.contact_high.values)
        stated = data.accuracy.values[names.index("held_out_spectrum, 4 waves, spectrum")]
    seen = [one for one in (*sets["spectra"].seen, *sets["plateau"].seen) if one.waves >= 4]
    seen = [one for one in seen if one.split == "held_out_spectrum"]
    found = distances.distances(seen, distances.THEORIES["calibrated"])
    for row, quantity in zip(stated, ("area", "force"), strict=False):
        for k in (3, 4, 5):
            rms = distances.summed_up(seen, found[quantity], edges[0][k], edges[1][k])[0]
            assert rms == pytest.approx(np.hypot(row[k, 0], row[k, 1]), rel=0.02), (quantity, k)


def test_a_file_of_heights_becomes_a_case(tmp_path):
    pytest.importorskip("tamaas")
    pytest.importorskip("SurfaceTopography")
    grid = random_map(32, 0, 5 / 32)
    grid = grid / grid.std() + np.sin(np.linspace(0, 2 * np.pi, 32, endpoint=False))[:, None]
    np.savetxt(tmp_path / "own.asc", grid, header="Width: 1 m\nHeight: 1 m\nValue units: m")
    done = CliRunner().invoke(measured_maps, [str(tmp_path / "own.asc"), "--data", str(tmp_path / "own.nc")])
    assert done.exit_code == 0, done.output
    one = distances.measured("own", tmp_path / "own.nc")
    # what is kept gives the law that the map itself gives
    surface = Surface.from_map(grid, 1 / 32, periodic=False, model="measured")
    force = one.force[one.area > 0.02] * surface.bearing.gradient
    mine = distances.THEORIES["calibrated, map"](one).area(one.force[one.area > 0.02])
    assert mine == pytest.approx(contact(surface, pressure=force, theory="calibrated").area, rel=0.02)
    assert isinstance(one.surface, MeasuredSurface)  # no self-affine surface stands in for it


def test_committed_page_is_what_the_code_computes():
    sets = distances.data_sets()
    committed = {line.split(" | ")[0]: line for line in reversed(PAGE.splitlines())}  # the first table
    for line in simulations.summary_table(sets[name] for name in PICKED).splitlines():
        before = committed[line.split(" | ")[0]]
        assert re.sub(NUMBER, "", before) == re.sub(NUMBER, "", line)
        found, expected = (list(map(float, re.findall(NUMBER, one))) for one in (before, line))
        assert found == pytest.approx(expected, rel=0.06), line  # two digits are printed
