"""Distances of theories from simulations, against closed forms, roots found otherwise and the shipped file."""

import dataclasses

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import brentq
from scipy.special import erf

from generate import distances
from mbma_tables import Surface, contact
from mbma_tables.common.files import shipped_file
from mbma_tables.theories import Persson


@pytest.fixture(scope="module")
def bem():
    return distances.older("bem")


def test_areas_and_forces_of_mbma_equal_roots_found_otherwise(bem):
    surface = Surface(0.8, 1.0, 64.0, 1.0, 3.3973)
    g = surface.rms_gradient
    found = distances.distances([bem], distances.THEORIES["MBMA reported"])
    for k, (force, area, u) in enumerate(zip(bem.force, bem.area, bem.u, strict=True)):
        of_gap = contact(surface, mean_separation=u).pressure / g
        assert found["force"][k] == pytest.approx(np.log(of_gap / force), abs=1e-5)
        if np.isfinite(found["area"][k]):
            gap = brentq(lambda x, f=force: np.log(contact(surface, mean_separation=x).pressure / g / f), 0.3, 3.39)
            expected = np.log(contact(surface, mean_separation=gap).area / area)
            assert found["area"][k] == pytest.approx(expected, abs=1e-4)
    # the heaviest loads are beyond the model
    assert not np.isfinite(found["area"][-1])
    assert np.isfinite(found["area"][:5]).all()


def test_perssons_theory_in_closed_form(bem):
    found = distances.distances([bem], distances.THEORIES["Persson"])
    assert found["area"] == pytest.approx(np.log(erf(np.sqrt(2) * bem.force) / bem.area), abs=1e-12)
    surface = Surface(0.8, 1.0, 64.0, 1.0, 3.3973)
    back = Persson().mean_separation_at(surface, "pressure", bem.force * np.exp(found["force"]) * surface.rms_gradient)
    assert back[1:] == pytest.approx(bem.u[1:], rel=1e-4)


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


def test_theories_that_do_not_take_a_surface_are_left_out():
    # a band below the floors of `fitted`
    narrow = distances._simulated(
        "self_affine", ([0.01, 0.02, 0.05], [0.02, 0.04, 0.1], [1.5, 1.2, 0.8]), 3.0, zeta_1=4.0
    )
    found = distances.distances([narrow], distances.THEORIES["MBMA fitted"])
    assert all(np.isnan(values).all() for values in found.values())
    assert distances.summed_up([narrow], found["area"])[1] == 0
