"""`contact` asked in each way, of any theory and any kind of array: xarray in, xarray out; dask stays lazy."""

import dataclasses
import pathlib
import re
import runpy
import subprocess
import sys

import dask
import dask.array
import netCDF4
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from dask.callbacks import Callback
from helpers import contact_of, fresh, refusals

import mbma_tables
from mbma_tables import (
    Bodies,
    ConvergenceError,
    InputError,
    OutOfRangeError,
    Surface,
    contact,
    contact_law,
    island,
)
from mbma_tables.common.files import shipped_file
from mbma_tables.theories import THEORIES, Mbma, Theory, TheoryAnswer, resolve

ROOT = pathlib.Path(__file__).parents[2]
SURFACE = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0)
BATCH = Surface(hurst=[0.7, 0.9], q0=0.01, q1=[1.0, 2.0], h_rms=1.0, h_max=[3.0, 3.4])
MODULUS = 100e3
each = pytest.mark.parametrize("theory", THEORIES)


@each
@pytest.mark.parametrize("surface", [SURFACE, BATCH], ids=["one", "batch"])
def test_the_four_ways_to_ask_give_one_contact(surface, theory):
    u = np.array([[1.2], [1.9], [2.4]])
    first = contact(surface, MODULUS, mean_separation=u, theory=theory)
    assert first.separation == pytest.approx(2 * u - surface.h_max)
    assert first.mean_pressure == pytest.approx(first.pressure / first.area, rel=1e-15)
    for known in ("separation", "pressure", "area"):
        again = contact_of(
            surface, MODULUS, **{known: getattr(first, known)}, theory=theory
        )
        for name in (
            "mean_separation",
            "separation",
            "pressure",
            "area",
            "stiffness",
            "mean_pressure",
            "energy",
        ):
            assert getattr(again, name) == pytest.approx(
                getattr(first, name), rel=1e-8
            ), (known, name)


@pytest.mark.parametrize("island_model", ["exact", "formula", "island4d"])
def test_other_island_models_have_stiffness_and_validity_too(island_model):
    u = [0.0, 0.05, 0.3, 1.0, 2.0, 2.99, 3.0]
    models = ("universal", island_model)
    table, other = (
        contact(SURFACE, mean_separation=u, theory=Mbma(island_model=t)) for t in models
    )
    assert other.stiffness == pytest.approx(
        table.stiffness, rel={"exact": 1e-6}.get(island_model, 5e-3)
    )
    assert other.valid.tolist() == table.valid.tolist()
    assert set(other.reasons) == set(table.reasons)
    rigid = contact(
        SURFACE, mean_separation=[1.0, 2.0], theory=Mbma(island_model="rigid")
    )
    assert rigid.stiffness == pytest.approx(
        contact_law(SURFACE, theory=Mbma(island_model="rigid")).stiffness([1.0, 2.0]),
        rel=1e-6,
    )


def test_scatter_of_stiffness_and_separation():
    small = 1e-4
    found = contact(
        SURFACE, MODULUS, pressure=[100.0, 400.0, 1500.0], theory="calibrated"
    )
    heavier = contact(
        SURFACE, MODULUS, pressure=found.pressure * (1 + small), theory="calibrated"
    )
    # a force that is off by its scatter moves the separation by this, to first order
    moved = found.mean_separation - heavier.mean_separation
    assert found.separation_scatter == pytest.approx(
        found.scatter * moved / small, rel=1e-3
    )
    # what was stated for stiffness at equal force, in the middle of a bin
    with netCDF4.Dataset(shipped_file("calibrated.nc")) as data:
        theories = data.theories.split()
        middle = float(data["contact"][3])
        row = data["stated_scatter"][:, data.quantities.split().index("stiffness"), 3]
    # of a band that the stated data have, beyond which calibrated's is larger
    narrower = Surface(SURFACE.hurst, SURFACE.q0, 100 * SURFACE.q0, 1.0, 4.0)
    for theory in ("calibrated", "mbma", "persson"):
        stated = contact(narrower, area=middle, theory=theory).stiffness_scatter
        assert stated == pytest.approx(row[theories.index(theory)], rel=1e-6)


def test_conductance_is_per_unit_of_length_and_in_SI_of_texts():
    face = dataclasses.replace(SURFACE, unit="um")
    texts = ("45 W/(m K)", "167 W/m/K")
    k_s = 2 / (1 / 45 + 1 / 167)
    for bodies, pressure, modulus in (
        (Bodies(100e3), [10.0, 30.0], 100e3),
        (Bodies("100 GPa", hardness="1.5 GPa"), ["10 MPa", "30 MPa"], 100),
    ):

        def pressed(conductivity, bodies=bodies, pressure=pressure):
            conducting = dataclasses.replace(bodies, conductivity=conductivity)
            return contact(face, conducting, pressure=pressure, theory="calibrated")

        plain = pressed((45.0, 167.0))
        thermal = pressed(texts)
        stiffness = np.asarray(plain.unloading_stiffness) / modulus
        assert plain.solid_conductance == pytest.approx(k_s * stiffness, rel=1e-14)
        assert thermal.solid_conductance == pytest.approx(
            1e6 * k_s * stiffness, rel=1e-14
        )
        electrical = pressed("6e7 S/m")
        assert electrical.solid_conductance == pytest.approx(
            1e6 * pressed(6e7).solid_conductance, rel=1e-14
        )
        units = [each.units["solid_conductance"] for each in (plain, thermal, electrical)]
        assert units == ["conductivity/um", "W/(m^2 K)", "S/m^2"]
    loads = xr.DataArray([10.0, 30.0], dims="load")
    labelled = contact(face, Bodies(MODULUS, conductivity=45.0), pressure=loads)
    assert labelled.solid_conductance.dims == ("load",)
    for bad, says in (
        ((45.0, "167 W/(m K)"), "got 45.0"),
        ("45 W/K", "texts such as '45 W/"),
        (("45 W/(m K)", "6e7 S/m"), "both thermal or both electrical"),
        (-1.0, "k1 must be positive"),
        ((45.0, [1.0, 0.0]), "k2 must be positive, got 0 at (1,)"),
        ((45.0, np.nan), "k2 must be finite"),
    ):
        with pytest.raises(InputError, match=re.escape(says)):
            _ = pressed(bad).solid_conductance
    with pytest.raises(InputError, match="give the surface its unit"):
        _ = contact(
            SURFACE, Bodies(conductivity="45 W/(m K)"), area=0.01
        ).solid_conductance


@each
def test_labelled_arrays_keep_their_names(theory):
    pressure = xr.DataArray([1.0, 10.0], dims="load", coords={"load": [1.0, 10.0]})
    hurst = xr.DataArray([0.7, 0.8], dims="hurst")
    surface, lazy = (
        Surface(each, 0.01, 2.0, 1.0, 3.0) for each in (hurst, hurst.chunk(hurst=1))
    )
    found = contact(surface, MODULUS, pressure=pressure, theory=theory)
    later = contact(lazy, MODULUS, pressure=pressure, theory=theory).area
    assert later.chunks is not None
    np.testing.assert_array_equal(later.compute(), found.area)
    plain = contact(
        Surface([[0.7], [0.8]], 0.01, 2.0, 1.0, 3.0),
        MODULUS,
        pressure=[1.0, 10.0],
        theory=theory,
    )
    names = (
        "separation",
        "mean_separation",
        "area",
        "stiffness",
        "mean_pressure",
        "valid",
    )
    for labelled, expected in [
        (getattr(found, name), getattr(plain, name)) for name in names
    ]:
        assert set(labelled.dims) == {"load", "hurst"}
        assert labelled.transpose("hurst", "load").values == pytest.approx(
            expected, rel=1e-13
        )
    assert found.area.attrs["units"] == "1"


test_what_cannot_be_asked = refusals(
    lambda asked: contact(SURFACE, **asked),
    ({}, "exactly one of separation, mean_separation, pressure, area; got none"),
    ({"separation": 1.0, "pressure": 1.0}, "got separation and pressure"),
    ({"pressure": 1.0, "theory": "hertz"}, "theory must be one of"),
    (
        {"pressure": 1.0, "theory": "persson", "island_model": "exact"},
        TypeError,
        "contact has no argument 'island_model'",
    ),
    (
        {"separation": 1.0, "theory": Mbma(), "variant": "printed"},
        TypeError,
        "contact has no argument 'variant'",
    ),
    ({"pressure": np.nan}, "pressure must be finite"),
    ({"pressure": -1.0}, "pressure must be at least 0"),
    ({"mean_separation": -1.0}, "mean_separation must be at least 0, got -1"),
    ({"area": 0.9, "theory": "mbma"}, "area must be at most what theory 'mbma' reaches"),
)


@each
def test_ends_validity_and_advice(theory):
    if not resolve(theory).ends_at_h_max:  # heights without an end
        within = Surface(hurst=0.8, q0=0.01, q1=0.64, h_rms=1.0, h_max=3.0)
        pressed = contact(within, mean_separation=[2.0, 3.1], theory=theory)
        # without a stated scatter nothing is valid
        assert pressed.valid.tolist() == [np.isfinite(pressed.scatter[0]), False]
        assert any("u is above h_max" in reason for reason in pressed.reasons)
        with pytest.raises(OutOfRangeError, match="pressure must be positive"):
            contact(SURFACE, pressure=0.0, theory=theory)
    else:
        found = contact(SURFACE, pressure=[0.0, 1e-9], theory=theory)
        assert found.separation[0] == 3.0
        assert found.pressure[0] == found.area[0] == found.stiffness[0] == 0
        assert not np.signbit(contact(SURFACE, separation=3.0, theory=theory).energy)
    said = repr(contact(SURFACE, area=0.01, theory=theory))
    assert ("advice theory='calibrated' for stiffness or separation" in said) == (
        theory == "mbma"
    )
    # heights in um, wavenumbers in 1/mm
    found = contact(
        Surface(0.8, 10.0, 2000.0, 1.0, 3.0), mean_separation=2.0, theory=theory
    )
    assert not found.valid
    assert any("one unit?" in reason for reason in found.reasons)
    with pytest.raises(OutOfRangeError, match=r"^separation must be at least -h_max"):
        contact(SURFACE, separation=-3.1, theory=theory)
    with pytest.raises(InputError, match="hardness is empty"):
        contact(SURFACE, Bodies(hardness=[]), separation=0.5, theory=theory)


def test_mbma_says_where_it_is_not_to_be_trusted():
    within = Surface(hurst=0.8, q0=0.01, q1=0.64, h_rms=1.0, h_max=3.0)
    found = contact(within, mean_separation=[2.0, 0.3], theory="mbma")
    assert found.valid.tolist() == [True, False]
    assert [mask.tolist() for mask in found.reasons.values()] == [[False, True]] * 2
    assert any("stiffness falls" in reason for reason in found.reasons)
    beyond = Surface([0.05, 0.8], 1.0, 1e8, 1.0, 4.5)
    assert contact(
        beyond, mean_separation=[2.25, 0.5], theory=Mbma(outside="exact")
    ).valid.tolist() == [False, False]


def test_units_of_lists_and_of_named_arrays():
    listed = contact(SURFACE, ["100 GPa", "200 GPa"], pressure="1 MPa")
    assert listed.pressure == pytest.approx([1e-3, 1e-3])
    named = xr.DataArray([100.0, 200.0], dims="body", attrs={"units": "GPa"})
    assert contact(SURFACE, named, pressure="1 MPa").units["pressure"] == "GPa"
    with pytest.raises(InputError, match="hardness is in 'MPa'"):
        contact(
            SURFACE,
            Bodies(named, hardness=named.assign_attrs(units="MPa")),
            pressure=0.001,
        )
    gaps = xr.DataArray([0.5, 1.0], dims="gap", name="mine")
    found = contact(
        dataclasses.replace(SURFACE, unit="um"),
        Bodies("100 GPa", hardness="1.5 GPa"),
        separation=gaps,
    )
    expected = {
        "stiffness": "GPa/um",
        "mean_pressure": "GPa",
        "mean_separation": "um",
        "separation_scatter": "um",
    }
    for name, unit in expected.items():
        quantity = getattr(found, name)
        assert (quantity.name, quantity.attrs["units"]) == (name, unit)
    assert found.separation.name == "mine"


@pytest.mark.parametrize("cap", [0.03, np.inf])
def test_forces_that_no_gap_resolves_are_refused(cap):
    surface = Surface(0.8, 0.01, 2.0, 1.0, 3.0)
    bodies = Bodies(hardness=cap)
    pressures = [1e-150, 1e-3]
    # lighter than what is left where h_max - u is rounding
    with pytest.raises(
        ConvergenceError,
        match="the separation at this pressure was not found for 1 entries",
    ) as caught:
        contact(surface, bodies, pressure=pressures, theory="mbma")
    assert caught.value.mask.tolist() == [True, False]
    found = contact(surface, bodies, pressure=pressures, theory="greenwood_williamson")
    assert found.pressure == pytest.approx(pressures, rel=1e-10)


@pytest.mark.parametrize("height", [3.0, 9.0])
def test_areas_that_no_gap_resolves_are_refused(height):
    """Beside h_max, where rounding of u is as large as the depth; 9 h_rms is outside of the table."""
    surface = Surface(0.8, 0.01, 0.64, 1.0, height)
    with pytest.raises(
        ConvergenceError, match="the separation at this area was not found for 1 entries"
    ) as caught:
        contact(surface, area=[1e-300, 1e-3], theory="calibrated")
    assert caught.value.mask.tolist() == [True, False]
    found = contact(surface, area=[0.0, 1e-12, 1e-3], theory="calibrated")
    assert (np.abs(found.area - [0.0, 1e-12, 1e-3]) <= found.error * found.area).all()


@each
@pytest.mark.parametrize("cap", [None, 0.02])
def test_the_bits_of_every_theory_do_not_depend_on_the_other_entries(theory, cap):
    surface = Surface(0.8, 0.01, 0.64, 1.0, 3.0)
    u = np.linspace(0.3, 2.9, 3001)
    names = [
        "pressure",
        "area",
        "stiffness",
        "unloading_stiffness",
        "yielded",
        "plane_separation",
    ]
    names += ["energy"] if cap is None else []
    many = contact(surface, Bodies(hardness=cap), mean_separation=u, theory=theory)
    labelled = contact(
        surface,
        Bodies(hardness=cap),
        mean_separation=xr.DataArray(u, dims="gap"),
        theory=theory,
    )
    for k in (0, 17, 1500, 3000):
        one = contact(
            surface, Bodies(hardness=cap), mean_separation=float(u[k]), theory=theory
        )
        for name in names:
            value = float(getattr(one, name))
            assert value == getattr(many, name)[k] == float(getattr(labelled, name)[k]), (
                name
            )


def test_a_request_takes_few_calls():
    command = [sys.executable, "-m", "benchmarks.request"]
    for row in subprocess.run(
        command, capture_output=True, text=True, check=True, cwd=ROOT
    ).stdout.splitlines():
        assert int(re.search(r"(\d+) calls", row)[1]) <= 105


def test_calls_of_other_packages_do_not_count_wherever_they_lie():
    """A clone in a folder of the library's name has numpy below a path with that name too."""
    source = "def average():\n    return sum(map(float, (1, 2)))\n"
    beside = pathlib.Path(mbma_tables.__file__).parent.with_name("mbma_tables.venv")
    names = {}
    exec(compile(source, str(beside / "mbma_tables" / "numpy.py"), "exec"), names)
    traced = runpy.run_path(str(ROOT / "benchmarks" / "request.py"))["traced"]
    assert traced(names["average"])[0] == 0
    assert traced(SURFACE.__repr__)[0] > 0


@each
def test_bodies_apart(theory):
    found = contact(SURFACE, separation=50.0, theory=theory)
    ends = resolve(theory).ends_at_h_max
    assert (found.separation, found.mean_separation) == (50.0, 50.0 if ends else 26.5)
    for name in ("separation", "mean_separation"):
        plain = contact_of(SURFACE, **{name: [1.0, 50.0]}, theory=theory)
        labelled = contact_of(
            SURFACE, **{name: xr.DataArray([1.0, 50.0], dims="gap")}, theory=theory
        )
        assert labelled.separation.values.tolist() == plain.separation.tolist()
        assert labelled.mean_separation.values.tolist() == plain.mean_separation.tolist()
    if ends:
        assert (found.pressure, found.area) == (0, 0)
        assert "the bodies are apart" in repr(found)
        assert contact(SURFACE, mean_separation=50.0, theory=theory).separation == 50.0
    assert (
        contact(SURFACE, separation=SURFACE.h_max, theory=theory).mean_separation
        == SURFACE.h_max
    )


FIELDS = ("pressure", "area", "error")
SMOOTH = Surface(0.8, 0.2, 40.0, 1.0, 3.0)


def gaps_over(n, **kwargs):
    return xr.DataArray(
        np.linspace(-2.9, 3.1, n),
        dims="gap",
        coords={"gap": np.arange(n)},
        name="d",
        **kwargs,
    )


def surfaces_over():
    hurst = xr.DataArray(
        [0.4, 0.7, 1.0],
        dims="surface",
        coords={"surface": ["a", "b", "c"]},
        attrs={"units": "1"},
    )
    h_max = xr.DataArray([3.0, 3.2], dims="case")
    return Surface(hurst, 0.2, 40.0, 1.0, h_max)


class Tasks(Callback):
    def __init__(self):
        super().__init__()
        self.ran = 0

    def _pretask(self, key, dsk, state):
        self.ran += 1


def test_dimensions_by_name():
    gaps = gaps_over(7, attrs={"units": "mm", "long_name": "separation"})
    found = contact(surfaces_over(), separation=gaps)
    h_max = np.array([3.0, 3.2])[:, None]
    plain = contact(
        Surface(np.array([0.4, 0.7, 1.0])[:, None, None], 0.2, 40.0, 1.0, h_max),
        separation=gaps.values,
    )
    assert found.islands is None
    for name in FIELDS:
        values = getattr(found, name)
        assert (values.name, values.attrs["units"]) == (name, "1")
        assert set(values.dims) == {"surface", "case", "gap"}
        np.testing.assert_array_equal(
            values.transpose("surface", "case", "gap"), getattr(plain, name)
        )
        assert values.surface.values.tolist() == ["a", "b", "c"]
        assert values.gap.values.tolist() == list(range(7))
    assert found.pressure.attrs["long_name"] == "force over nominal area"
    assert found.separation.identical(gaps)
    assert gaps.attrs == {"units": "mm", "long_name": "separation"}
    # above h_max the bodies are apart
    expected = np.maximum((h_max + gaps.values) / 2, gaps.values)
    np.testing.assert_array_equal(
        found.mean_separation.isel(surface=0).transpose("case", "gap"), expected
    )
    assert xr.Dataset({name: getattr(found, name) for name in FIELDS}).sizes == {
        "surface": 3,
        "case": 2,
        "gap": 7,
    }


@pytest.mark.parametrize("scheduler", ["synchronous", "threads"])
def test_dask_is_lazy_and_gives_the_same_answers(scheduler):
    gaps = gaps_over(50)
    surfaces = surfaces_over()
    eager = contact(surfaces, separation=gaps)
    lazy_surfaces = Surface(
        surfaces.hurst.chunk(surface=2), 0.2, 40.0, 1.0, surfaces.h_max.chunk(case=1)
    )

    def outputs(found):
        return {
            name: getattr(found, name)
            for name in (*FIELDS, "mean_separation", "separation")
        }

    with Tasks() as tasks:
        lazy = outputs(contact(lazy_surfaces, separation=gaps.chunk(gap=11)))
        assert all(dask.is_dask_collection(value) for value in lazy.values())
        assert tasks.ran == 0
    with dask.config.set(scheduler=scheduler, num_workers=4), Tasks() as tasks:
        computed = dask.compute(lazy)[0]
    assert tasks.ran > 10
    for name, expected in outputs(eager).items():
        assert (computed[name].dims, lazy[name].attrs) == (expected.dims, expected.attrs)
        # at few gaps of one surface islands are summed, at more there is a series: within
        # their errors
        if name == "error":
            assert (computed[name] <= 1e-8).all()
        else:
            np.testing.assert_allclose(
                computed[name], expected, rtol=float(2 * eager.error.max())
            )


def test_the_bits_of_one_surface_depend_neither_on_the_kind_of_argument_nor_on_the_chunks():
    surface = SMOOTH
    gaps = gaps_over(5000)
    eager = contact(surface, separation=gaps)
    plain = contact(surface, separation=gaps.values)
    assert plain.islands < 5000  # one series for all gaps
    for k in (0, 17, 2500, 4999):
        one = contact(surface, separation=float(gaps[k]))
        assert (one.pressure, one.area, one.error) == (
            plain.pressure[k],
            plain.area[k],
            plain.error[k],
        )
    lazy = contact(surface, separation=gaps.chunk(gap=(7, 493, 4500)))
    with dask.config.set(scheduler="threads", num_workers=4):
        for name in FIELDS:
            np.testing.assert_array_equal(getattr(plain, name), getattr(eager, name))
            np.testing.assert_array_equal(
                getattr(lazy, name).compute(), getattr(eager, name)
            )


def test_chunks_without_entries():
    gaps = gaps_over(12)
    for ask in (
        lambda d: contact(SMOOTH, separation=d).pressure,
        lambda d: contact_law(SMOOTH).area(separation=d),
    ):
        np.testing.assert_array_equal(
            ask(gaps.chunk(gap=(5, 0, 7))).compute(), ask(gaps.values)
        )
    with pytest.raises(InputError, match="separation is empty"):
        contact(SMOOTH, separation=gaps[:0])


def test_bad_input_is_refused_when_it_is_computed():
    bad = xr.DataArray([1.0, np.nan], dims="t")
    with pytest.raises(InputError, match=r"separation must be finite, got nan at \(1,\)"):
        contact(SMOOTH, separation=bad)
    lazy = contact(SMOOTH, separation=bad.chunk(t=1)).pressure
    with pytest.raises(InputError, match="separation must be finite"):
        lazy.compute(scheduler="synchronous")


def labelled(values, **coords):
    return xr.DataArray(values, dims="t", coords=coords and {"t": coords["t"]})


test_labelled_arguments_that_are_refused = refusals(
    lambda hurst, h_rms, gaps: contact(
        Surface(hurst, 0.2, 0.2e8, h_rms, 3.0), separation=gaps
    ),
    (labelled([0.8, 1.2]), 1.0, 1.0, r"hurst must be in \(0, 1\]"),
    (labelled([0.05, 0.8]), 1.0, 1.0, "outside of island model .universal"),
    (
        labelled([0.8, 0.9]),
        1.0,
        [0.0, 1.0, 2.0],
        r"separation must be one or a scalar, got shape \(3,\)",
    ),
    (labelled([0.8, 0.9]), np.ones(2), 1.0, r"beside DataArrays, h_rms must be"),
    (labelled([0.8, 0.9], t=[0, 1]), 1.0, labelled([1.0, 2.0], t=[1, 2]), "join|align"),
    error=ValueError,
)


def test_options_go_through():
    gaps = gaps_over(3)
    surfaces = Surface(xr.DataArray([0.05, 0.8], dims="s"), 0.2, 0.2e8, 1.0, 3.0)
    found = contact(surfaces, separation=gaps, theory=Mbma(outside="nan")).pressure
    assert np.isnan(found.transpose("s", "gap")).values.tolist() == [
        [True, True, False],
        [False] * 3,
    ]
    theory = Mbma(island_model="rigid", variant="printed", rtol=1e-4)
    rigid = contact(SMOOTH, separation=gaps, theory=theory)
    assert (rigid.island_model, rigid.variant) == ("rigid", "printed")
    np.testing.assert_array_equal(
        rigid.pressure, contact(SMOOTH, separation=gaps.values, theory=theory).pressure
    )


COLD = """
import dask, numpy as np, xarray as xr
from mbma_tables import Surface, contact
from mbma_tables.theories import Mbma
gaps = xr.DataArray(np.linspace(-2.9, 3.1, 120), dims="gap")
surface = Surface(xr.DataArray([0.5, 0.8], dims="surface").chunk(surface=1), 0.2, 40.0, 1.0, 3.0)
with dask.config.set(scheduler="threads", num_workers=8):
    few, many = gaps.chunk(gap=3), gaps.chunk(gap=15)
    table = Mbma(island_model="island4d", rtol=1e-3)
    lazy = contact(surface, separation=few), contact(surface, separation=many, theory=table)
    first, second = dask.compute(lazy[0].pressure, lazy[1].pressure)
assert (abs(first - second) <= 0.01 * first).all()
print(len(first.gap))
"""


@pytest.mark.slow
def test_cold_tables_opened_by_many_threads():
    assert fresh(COLD) == 120


def test_islands_are_of_plain_arrays():
    with pytest.raises(InputError, match="plain arrays"):
        island(SMOOTH, gaps_over(3))


class Careful(Theory):
    """As docs/theories.md describes a class: `reasons` states why results are not valid."""

    name = "careful"

    def answer(self, surface, mean_separation):
        force = np.exp(-3 * mean_separation / surface.h_rms)
        return TheoryAnswer(
            force, 0.1 * force, 3 / surface.h_rms * force, np.zeros_like(force)
        )

    def reasons(self, surface, answer, mean_separation):
        return {"u is below 1": mean_separation < 1}


def test_reasons_of_ones_own_theory_are_those_of_its_contacts():
    found = contact(SURFACE, mean_separation=[0.5, 1.5], theory=Careful())
    assert found.reasons["u is below 1"].tolist() == [True, False]
    assert not found.valid[0]


@pytest.mark.parametrize("hardness", [None, 1.5])
def test_a_list_of_moduli_is_an_array(hardness):
    moduli = [57.0, 58.0]
    bodies = Bodies(
        moduli, hardness=hardness, nu=0.3, conductivity=np.array([40.0, 60.0])
    )
    of_list = contact(SURFACE, bodies, pressure=0.01, theory="calibrated")
    assert "Contact(" in repr(of_list)
    assert of_list.to_dataset()["pressure"].size == 2
    for k, (modulus, k_s) in enumerate(zip(moduli, (40.0, 60.0), strict=True)):
        one = Bodies(modulus, hardness=hardness, nu=0.3, conductivity=k_s)
        single = contact(SURFACE, one, pressure=0.01, theory="calibrated")
        names = ["area", "stiffness", "solid_conductance", "scatter"]
        names += [] if hardness is None else ["psi", "yielded"]
        for name in names:
            assert getattr(of_list, name)[k] == pytest.approx(getattr(single, name))
    with_units = contact(SURFACE, ["57 GPa", "58e3 MPa"], pressure="10 MPa")
    np.testing.assert_allclose(with_units.E_star, moduli)
    with pytest.raises(InputError, match="conductivity must be one number"):
        contact_law(SURFACE, Bodies(58.0, conductivity=np.array([40.0, 60.0])))


def test_what_was_given_may_be_changed_afterwards():
    gaps = np.array([1.9, 2.0])
    moduli = np.array([100.0, 200.0])
    caps = np.array([1.0, 2.0])
    named = xr.DataArray(gaps.copy(), dims="gap")
    bodies = Bodies(moduli, hardness=caps)
    pressed = contact(SURFACE, bodies, mean_separation=gaps, theory="calibrated")
    of_named = contact(SURFACE, 100.0, mean_separation=named, theory="calibrated")
    law = contact_law(SURFACE, 100.0, theory="calibrated")
    pressures = law.pressure(gaps)
    before = pressures.copy()
    of_law = law.at(gaps), law.at(pressure=pressures)
    series = pd.Series([100.0, 200.0])
    of_series = Bodies(series, hardness=series)
    for array in (gaps, moduli, caps, named, pressures, series):
        array[:] = 1.0
    assert repr(Bodies(np.float64(58.0)).E_star) == repr(np.float64(58.0))
    np.testing.assert_array_equal(of_series.E_star, [100.0, 200.0])
    np.testing.assert_array_equal(of_series.hardness, [100.0, 200.0])
    np.testing.assert_array_equal(pressed.mean_separation, [1.9, 2.0])
    np.testing.assert_array_equal(of_named.mean_separation, [1.9, 2.0])
    np.testing.assert_array_equal(bodies.E_star, [100.0, 200.0])
    np.testing.assert_array_equal(bodies.hardness, [1.0, 2.0])
    np.testing.assert_array_equal(of_law[0].mean_separation, [1.9, 2.0])
    np.testing.assert_array_equal(of_law[1].pressure, before)
    anew = contact(
        SURFACE,
        Bodies([100.0, 200.0], hardness=[1.0, 2.0]),
        mean_separation=[1.9, 2.0],
        theory="calibrated",
    )
    np.testing.assert_array_equal(pressed.stiffness, anew.stiffness)


def test_labels_of_conductivities_and_of_a_gas_are_kept():
    face = dataclasses.replace(SURFACE, unit="um")
    pressures = xr.DataArray([0.01, 0.02], dims="p", coords={"p": [10, 20]})
    k = xr.DataArray([40.0, 50.0], dims="k", coords={"k": ["a", "b"]})
    bodies = Bodies("100 GPa", conductivity=k)
    for asked in (pressures, 0.01):
        pressed = contact(face, bodies, pressure=asked, theory="calibrated")
        assert set(pressed.solid_conductance.dims) == {"k"} | set(
            getattr(asked, "dims", ())
        )
    pressed = contact(face, bodies, pressure=pressures, theory="calibrated")
    table = pressed.solid_conductance.transpose("k", "p").values
    for i, k_s in enumerate(k.values):
        plain = Bodies("100 GPa", conductivity=k_s)
        for j, pressure in enumerate(pressures.values):
            one = contact(face, plain, pressure=pressure, theory="calibrated")
            assert table[i, j] == pytest.approx(one.solid_conductance, rel=1e-12)
    T = xr.DataArray([300.0, 400.0], dims="T")
    of_gas = pressed.gap_conductance("air", T)
    assert set(of_gas.dims) == {"p", "T"}
    for j, temperature in enumerate(T.values):
        one = contact(face, "100 GPa", pressure=pressures.values, theory="calibrated")
        np.testing.assert_allclose(
            of_gas.isel(T=j), one.gap_conductance("air", temperature), rtol=1e-12
        )
    with pytest.raises(InputError, match="temperature must be one or a scalar"):
        pressed.gap_conductance("air", [300.0, 400.0])
    plain = contact(face, "100 GPa", pressure=[0.01, 0.02], theory="calibrated")
    with pytest.raises(InputError, match="do not broadcast"):
        plain.gap_conductance("air", [300.0, 400.0, 500.0])


class Linear(Theory):
    """Force and area proportional to the depth."""

    name = "linear"

    def answer(self, surface, mean_separation):
        depth = np.maximum(np.asarray(surface.h_max) - mean_separation, 0)
        return TheoryAnswer(depth, 0.1 * depth, np.ones_like(depth), 0.0 * depth)


class Paired(Linear):
    def answer(self, surface, mean_separation):
        return super().answer(surface, mean_separation)[:2]


class Odd:
    name = "odd"

    def __init__(self, answered):
        self.answered = answered

    def answer(self, surface, mean_separation):
        return self.answered


@pytest.mark.parametrize("asked", ["pressure", "area", "mean_separation"])
@pytest.mark.parametrize(
    "theory",
    [Paired(), *map(Odd, (None, 1.0, (1.0,), (1.0, 2.0, 3.0), ("a", "b"), (np.ones(7), np.ones(7))))],
)  # fmt: skip
def test_theories_whose_answers_are_none_are_named(theory, asked):
    assert contact(SURFACE, area=0.05, theory=Linear()).pressure == pytest.approx(0.5)
    with pytest.raises(InputError, match=f"theory '{theory.name}'.* must answer"):
        _ = contact(SURFACE, **{asked: [0.01, 0.02]}, theory=theory).stiffness
    with pytest.raises(InputError, match=f"theory '{theory.name}'.* must answer"):
        contact_law(SURFACE, theory=theory)


@pytest.mark.parametrize(
    ("process", "shown"),
    [
        (None, "valid True, if the face is Gaussian and isotropic, "),
        ("gaussian", "valid True, evidence"),
        ("milled", "valid False)"),
    ],
)
def test_what_numbers_leave_open_is_a_condition_of_validity(process, shown):
    # faces of many kinds have the same Ra and wavelengths
    face = Surface.from_roughness(
        hurst=0.8,
        Ra="0.4 um",
        longest="0.25 mm",
        shortest="5 um",
        h_max="1.7 um",
        process=process,
    )
    found = contact(face, Bodies("100 GPa"), pressure="100 MPa")
    assert shown in repr(found)
    # a difference of two such faces leaves the same open
    combined = face.combined(face)
    assert shown in repr(contact(combined, Bodies("100 GPa"), pressure="100 MPa"))
