"""`contact` asked by separation, mean separation, pressure or area, of any theory, and differences for derivatives."""

import dataclasses
import pathlib
import re
import subprocess
import sys

import netCDF4
import numpy as np
import pytest
import xarray as xr
from helpers import refusals

from mbma_tables import ConvergenceError, InputError, OutOfRangeError, Surface, contact, contact_law
from mbma_tables.common.files import shipped_file
from mbma_tables.theories import THEORIES, Mbma, get_theory

ROOT = pathlib.Path(__file__).parents[2]
SURFACE = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0)
BATCH = Surface(hurst=[0.7, 0.9], q0=0.01, q1=[1.0, 2.0], h_rms=1.0, h_max=[3.0, 3.4])
MODULUS = 100e3
each = pytest.mark.parametrize("theory", THEORIES)


@each
@pytest.mark.parametrize("surface", [SURFACE, BATCH], ids=["one", "batch"])
def test_the_four_ways_to_ask_give_one_contact(surface, theory):
    u = np.array([[1.2], [1.9], [2.4]])
    first = contact(surface, mean_separation=u, E_star=MODULUS, theory=theory)
    assert first.separation == pytest.approx(2 * u - surface.h_max)
    assert first.mean_pressure == pytest.approx(first.pressure / first.area, rel=1e-15)
    for known in ("separation", "pressure", "area"):
        again = contact(surface, **{known: getattr(first, known)}, E_star=MODULUS, theory=theory)
        for name in ("mean_separation", "separation", "pressure", "area", "stiffness", "mean_pressure", "energy"):
            assert getattr(again, name) == pytest.approx(getattr(first, name), rel=1e-8), (known, name)


@pytest.mark.parametrize("island_model", ["exact", "formula", "island4d"])
def test_other_island_models_have_stiffness_and_validity_too(island_model):
    u = [0.0, 0.05, 0.3, 1.0, 2.0, 2.99, 3.0]
    table, other = (contact(SURFACE, mean_separation=u, island_model=t) for t in ("universal", island_model))
    assert other.stiffness == pytest.approx(table.stiffness, rel={"exact": 1e-6}.get(island_model, 5e-3))
    assert other.valid.tolist() == table.valid.tolist()
    assert set(other.reasons) == set(table.reasons)
    rigid = contact(SURFACE, mean_separation=[1.0, 2.0], island_model="rigid")
    assert rigid.stiffness == pytest.approx(contact_law(SURFACE, island_model="rigid").stiffness([1.0, 2.0]), rel=1e-6)


def test_scatter_of_stiffness_and_separation():
    known, small = {"E_star": MODULUS, "theory": "calibrated"}, 1e-4
    found = contact(SURFACE, pressure=[100.0, 400.0, 1500.0], **known)
    # a force that is off by its scatter moves the separation by this, to first order
    moved = found.mean_separation - contact(SURFACE, pressure=found.pressure * (1 + small), **known).mean_separation
    assert found.separation_scatter == pytest.approx(found.scatter * moved / small, rel=1e-3)
    # what was stated for stiffness at equal force, in the middle of a bin
    with netCDF4.Dataset(shipped_file("calibrated.nc")) as data:
        theories, middle = data.theories.split(), float(data["contact"][3])
        row = data["stated_scatter"][:, data.quantities.split().index("stiffness"), 3]
    for theory in ("calibrated", "mbma", "persson"):
        stated = contact(SURFACE, area=middle, theory=theory).stiffness_scatter
        assert stated == pytest.approx(row[theories.index(theory)], rel=1e-6)


def test_conductance_is_per_unit_of_length_and_in_SI_of_texts():
    face, bodies = dataclasses.replace(SURFACE, unit="um"), ("45 W/(m K)", "167 W/m/K")
    asked = {"pressure": [10.0, 30.0], "theory": "calibrated"}
    for modulus, given in ((100e3, {}), ("100 GPa", {"hardness": "1.5 GPa", "pressure": ["10 MPa", "30 MPa"]})):
        found = contact(face, E_star=modulus, **(asked | given))
        k_s = 2 / (1 / 45 + 1 / 167)
        stiffness = np.asarray(found.unloading_stiffness) / (100e3 if modulus == 100e3 else 100)
        assert found.conductance(45.0, 167.0) == pytest.approx(k_s * stiffness, rel=1e-14)
        assert found.conductance(*bodies) == pytest.approx(1e6 * k_s * stiffness, rel=1e-14)
        assert found.conductance("6e7 S/m") == pytest.approx(1e6 * found.conductance(6e7), rel=1e-14)
    labelled = contact(face, pressure=xr.DataArray([10.0, 30.0], dims="load"), E_star=MODULUS).conductance(45.0)
    assert labelled.dims == ("load",)
    for bad, says in (
        ((45.0, "167 W/(m K)"), "got 45.0"),
        (("45 W/K",), "texts in one unit such as '45 W/"),
        (("45 W/(m K)", "6e7 S/m"), "in one unit"),
        ((-1.0,), "k1 must be positive"),
        ((45.0, [1.0, 0.0]), "k2 must be positive, got 0 at (1,)"),
        ((45.0, np.nan), "k2 must be finite"),
    ):
        with pytest.raises(InputError, match=re.escape(says)):
            found.conductance(*bad)
    with pytest.raises(InputError, match="give the surface its unit"):
        contact(SURFACE, area=0.01).conductance("45 W/(m K)")


@each
def test_labelled_arrays_keep_their_names(theory):
    pressure = xr.DataArray([1.0, 10.0], dims="load", coords={"load": [1.0, 10.0]})
    hurst = xr.DataArray([0.7, 0.8], dims="hurst")
    surface, lazy = (Surface(each, 0.01, 2.0, 1.0, 3.0) for each in (hurst, hurst.chunk(hurst=1)))
    asked = {"E_star": MODULUS, "theory": theory}
    found, later = contact(surface, pressure=pressure, **asked), contact(lazy, pressure=pressure, **asked).area
    assert later.chunks is not None
    np.testing.assert_array_equal(later.compute(), found.area)
    plain = contact(Surface([[0.7], [0.8]], 0.01, 2.0, 1.0, 3.0), pressure=[1.0, 10.0], **asked)
    names = ("separation", "mean_separation", "area", "stiffness", "mean_pressure", "valid")
    for labelled, expected in [(getattr(found, name), getattr(plain, name)) for name in names]:
        assert set(labelled.dims) == {"load", "hurst"}
        assert labelled.transpose("hurst", "load").values == pytest.approx(expected, rel=1e-13)
    assert found.area.attrs["units"] == "1"


test_what_cannot_be_asked = refusals(
    lambda asked: contact(SURFACE, **asked),
    ({}, "exactly one of separation, mean_separation, pressure, area; got none"),
    ({"separation": 1.0, "pressure": 1.0}, "got separation and pressure"),
    ({"pressure": 1.0, "theory": "hertz"}, "theory must be one of"),
    ({"pressure": 1.0, "theory": "persson", "island_model": "exact"}, "island_model: options of theory 'mbma'"),
    ({"separation": 1.0, "theory": Mbma(), "variant": "printed"}, "variant: options of theory 'mbma' alone"),
    ({"pressure": np.nan}, "pressure must be finite"),
    ({"pressure": -1.0}, "pressure must be at least 0"),
    ({"mean_separation": -1.0}, "mean_separation must be at least 0, got -1"),
    ({"area": 0.9}, "area must be at most what theory 'mbma' reaches"),
)


@each
def test_ends_validity_and_advice(theory):
    gw_or_persson = theory in ("persson", "greenwood_williamson")
    if gw_or_persson:  # heights without an end
        assert contact(SURFACE, mean_separation=[2.5, 3.1], theory=theory).valid.tolist() == [True, False]
        with pytest.raises(OutOfRangeError, match="pressure must be positive"):
            contact(SURFACE, pressure=0.0, theory=theory)
    else:
        found = contact(SURFACE, pressure=[0.0, 1e-9], theory=theory)
        assert found.separation[0] == 3.0
        assert found.pressure[0] == found.area[0] == found.stiffness[0] == 0
        assert not np.signbit(contact(SURFACE, separation=3.0, theory=theory).energy)
    said = repr(contact(SURFACE, area=0.01, theory=theory))
    assert ("advice theory='calibrated' for stiffness or separation" in said) == (theory == "mbma")
    # heights in um, wavenumbers in 1/mm
    found = contact(Surface(0.8, 10.0, 2000.0, 1.0, 3.0), mean_separation=2.0, theory=theory)
    assert not found.valid
    assert any("one unit?" in reason for reason in found.reasons)
    with pytest.raises(OutOfRangeError, match=r"^separation must be at least -h_max"):
        contact(SURFACE, separation=-3.1, theory=theory)
    with pytest.raises(InputError, match="hardness is empty"):
        contact(SURFACE, separation=0.5, theory=theory, hardness=[])


def test_mbma_says_where_it_is_not_to_be_trusted():
    found = contact(SURFACE, mean_separation=[2.5, 0.3])
    assert found.valid.tolist() == [True, False]
    assert [mask.tolist() for mask in found.reasons.values()] == [[False, True]] * 2
    assert any("stiffness falls" in reason for reason in found.reasons)
    beyond = Surface([0.05, 0.8], 1.0, 1e8, 1.0, 4.5)
    assert contact(beyond, mean_separation=[2.25, 0.5], outside="exact").valid.tolist() == [False, False]


def test_units_of_lists_and_of_named_arrays():
    listed = contact(SURFACE, pressure="1 MPa", E_star=["100 GPa", "200 GPa"])
    assert listed.pressure == pytest.approx([1e-3, 1e-3])
    named = xr.DataArray([100.0, 200.0], dims="body", attrs={"units": "GPa"})
    assert contact(SURFACE, pressure="1 MPa", E_star=named).units["pressure"] == "GPa"
    with pytest.raises(InputError, match="hardness is in 'MPa'"):
        contact(SURFACE, pressure=0.001, E_star=named, hardness=named.assign_attrs(units="MPa"))
    gaps = xr.DataArray([0.5, 1.0], dims="gap", name="mine")
    found = contact(dataclasses.replace(SURFACE, unit="um"), separation=gaps, E_star="100 GPa", hardness="1.5 GPa")
    expected = {"stiffness": "GPa/um", "mean_pressure": "GPa", "mean_separation": "um", "separation_scatter": "um"}
    for name, unit in expected.items():
        quantity = getattr(found, name)
        assert (quantity.name, quantity.attrs["units"]) == (name, unit)
    assert found.separation.name == "mine"


@pytest.mark.parametrize("cap", [0.03, np.inf])
def test_forces_that_no_gap_resolves_are_refused(cap):
    surface, asked = Surface(0.8, 0.01, 2.0, 1.0, 3.0), {"pressure": [1e-150, 1e-3], "hardness": cap}
    # lighter than what is left where h_max - u is rounding
    with pytest.raises(ConvergenceError, match="the separation at this pressure was not found for 1 entries") as caught:
        contact(surface, **asked, theory="mbma")
    assert caught.value.mask.tolist() == [True, False]
    found = contact(surface, **asked, theory="greenwood_williamson")
    assert found.pressure == pytest.approx([1e-150, 1e-3], rel=1e-10)


def test_a_request_takes_few_calls_in_few_files():
    command = [sys.executable, "-m", "benchmarks.request"]
    for row in subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout.splitlines():
        calls, files = re.search(r"(\d+) calls .* (\d+) files", row).groups()
        assert int(calls) <= 90
        assert int(files) <= 9


@each
def test_bodies_apart(theory):
    found = contact(SURFACE, separation=50.0, theory=theory)
    ends = get_theory(theory).ends_at_h_max
    assert (found.separation, found.mean_separation) == (50.0, 50.0 if ends else 26.5)
    xr = pytest.importorskip("xarray")
    for name in ("separation", "mean_separation"):
        plain = contact(SURFACE, **{name: [1.0, 50.0]}, theory=theory)
        labelled = contact(SURFACE, **{name: xr.DataArray([1.0, 50.0], dims="gap")}, theory=theory)
        assert labelled.separation.values.tolist() == plain.separation.tolist()
        assert labelled.mean_separation.values.tolist() == plain.mean_separation.tolist()
    if ends:
        assert (found.pressure, found.area) == (0, 0)
        assert "the bodies are apart" in repr(found)
        assert contact(SURFACE, mean_separation=50.0, theory=theory).separation == 50.0
    assert contact(SURFACE, separation=SURFACE.h_max, theory=theory).mean_separation == SURFACE.h_max
