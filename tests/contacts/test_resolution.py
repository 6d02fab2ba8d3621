"""How the contact of a map depends on its short cut-off, by simulations at several of them."""

import re

import numpy as np
import pytest
from helpers import run

from generate.machined.makers import Part, heights
from mbma_tables import InputError, Surface, contact, last_octave, resolution_study
from mbma_tables.theories import Simulated

PRESSURES = ["20 MPa", "200 MPa", "1 GPa"]
NAMES = ("area", "mean_separation", "stiffness")


def of(family, **options):
    return Surface.from_map(
        heights(Part(family, 1, 96)), 1.0, periodic=True, unit="um", **options
    )


@pytest.mark.parametrize("family", ["gaussian", "worn"])
def test_changes_are_those_of_full_simulations_within_a_tenth(family):
    """Of maps that were cut off by their option, on another grid."""
    study = resolution_study(of(family), PRESSURES, "100 GPa", cutoffs=[12.0, 6.0])
    np.testing.assert_array_equal(study.cutoff, [6.0, 12.0])
    assert study.valid.all()
    truth = [
        contact(
            of(family, short_cutoff=f"{cutoff} um"),
            "100 GPa",
            pressure=PRESSURES,
            theory=Simulated("full"),
        )
        for cutoff in (6.0, 12.0)
    ]
    for name in NAMES:
        fine, coarse = (getattr(found, name) for found in truth)
        np.testing.assert_allclose(study.change(name), np.log(fine / coarse), atol=0.1)


def test_the_statement_of_the_gradient_is_not_that_of_the_area():
    """Plateaus without their shortest waves have smaller areas at some pressures, though their gradient is smaller."""
    study = resolution_study(of("worn"), PRESSURES, "100 GPa")
    assert study.change("area").max() > 0 > study.change("area").min()
    assert of("worn").provenance[-1]["gradient_without_last_octave"] < 1
    assert study.statement().startswith("without wavelengths below 12.46 um")


def test_the_surface_names_the_call_that_simulates_it():
    surface = of("worn")
    found = contact(surface, "100 GPa", pressure=PRESSURES)
    call = re.search(r"last_octave\(contact\(surface, \.\.\.\)\)", surface.resolution)
    names = {"last_octave": last_octave, "contact": contact, "surface": surface}
    more = "'100 GPa', pressure=pressures"
    study = eval(call[0].replace("...", more), names | {"pressures": PRESSURES})
    longer = of("worn", short_cutoff=f"{study.cutoff[1]} um")
    coarse = contact(longer, "100 GPa", pressure=PRESSURES, theory=Simulated("full"))
    np.testing.assert_allclose(
        study.change("area"), np.log(found.area / coarse.area), atol=0.05
    )
    with pytest.raises(InputError, match="no simulated gaps"):
        last_octave(contact(surface, "100 GPa", pressure=1e-3, theory="calibrated"))


def test_what_is_independent_of_the_cutoff():
    """A long wave carries the load: shorter waves change the area, hardly the gap."""
    x = np.arange(96.0)
    wave = np.cos(2 * np.pi * x / 96)
    fine = heights(Part("gaussian", 1, 96))
    values = 20 * np.add.outer(wave, wave) * fine.std() + 8 * fine
    surface = Surface.from_map(values, 1.0, periodic=True)
    study = resolution_study(surface, [0.03], 1.0, cutoffs=[6.0, 8.5, 12.0])
    assert study.independent("mean_separation").all()
    assert not study.independent("area").any()
    data = study.to_dataset()
    assert data.area.dims == ("cutoff", "pressure")
    assert len(study.plot().axes) == 4
    assert (study.flow > 0).all()


def test_it_begins_where_the_simulation_does_and_takes_a_raw_map():
    rng = np.random.default_rng(1)
    values = heights(Part("gaussian", 1, 96)) + 0.005 * rng.standard_normal((96, 96))
    surface = Surface.from_map(values, 1.0, periodic=True)
    study = resolution_study(surface, [0.01], 1.0)
    assert "short_cutoff=4.004" in study.contacts[0].surface.resolution
    assert study.area[0, 0] == contact(surface, pressure=0.01).area
    ratios = study.cutoff / study.cutoff[0]
    np.testing.assert_allclose(ratios, 2 ** np.arange(0, 2.1, 0.5))


def test_what_cannot_be_studied_is_refused():
    surface = of("gaussian")
    for cutoffs, why in (
        ([5.0], "two different lengths"),
        ([5.0, 5.0], "two different lengths"),
        ([3.0, 8.0], "at least 4, four sampling steps"),
        ([5.0, np.nan], "nan"),
        ([5.0, -8.0], "positive"),
        ([8.0, 90.0], "wavelength"),
    ):
        with pytest.raises((InputError, ValueError), match=why):
            resolution_study(surface, 0.01, 1.0, cutoffs=cutoffs)
    with pytest.raises(InputError, match="needs a height map"):
        resolution_study(Surface.named("concrete"), 1.0)
    with pytest.raises(InputError, match="no 'volume'"):
        resolution_study(surface, 0.01, 1.0, cutoffs=[6, 12]).change("volume")


def test_the_command_line_states_what_was_simulated(tmp_path):
    path = tmp_path / "map.npy"
    np.save(path, heights(Part("worn", 1, 96)))
    words = ("--map", path, "--dx", "1um", "--periodic", "--length-unit", "um")
    told = run("contact", *words, "--E-star", "100GPa", "-p", "0.02,0.2,1")
    line = next(line for line in told.splitlines() if "by simulation" in line)
    study = resolution_study(of("worn"), PRESSURES, "100 GPa")
    assert study.statement() in line
