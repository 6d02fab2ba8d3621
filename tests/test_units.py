"""Units: read and converted rightly in every entry, kept through results, refused where they conflict."""

import json
import pickle
from fractions import Fraction

import numpy as np
import pytest
import xarray as xr
from helpers import refusals, refused, run, told
from hypothesis import given, settings
from hypothesis import strategies as st

from mbma_tables import InputError, Scene, Surface, contact, contact_law
from mbma_tables.common.units import (
    ALIASES,
    DIMENSIONS,
    SIZES,
    Units,
    in_one_unit,
    known,
    read,
    unit_of,
)
from mbma_tables.contacts.quantities.registry import registry
from mbma_tables.contacts.quantities.registry import unit_of as unit_of_quantity
from mbma_tables.export.rows.law_rows import describe_law

# in metres and pascals, written down again: 1 in = 25.4 mm, 1 lbf = 4.4482216152605 N
METRES = {
    "m": 1,
    "km": 1e3,
    "cm": 1e-2,
    "mm": 1e-3,
    "um": 1e-6,
    "nm": 1e-9,
    "angstrom": 1e-10,
    "pm": 1e-12,
}
METRES |= {"in": 0.0254, "ft": 12 * 0.0254, "mil": 2.54e-5, "uin": 2.54e-8}
PASCALS = {
    "Pa": 1,
    "kPa": 1e3,
    "MPa": 1e6,
    "GPa": 1e9,
    "TPa": 1e12,
    "bar": 1e5,
    "mbar": 100,
    "atm": 101325,
}
PASCALS |= {"psi": 6894.757293168361, "ksi": 6894757.293168361, "Msi": 6894757293.168361}
EPS = np.finfo(float).eps
LENGTH_NAMES = [
    name for name, (length, stress) in DIMENSIONS.items() if length and not stress
]
SPELLINGS = {
    1: ("{0}",),
    2: ("{0}^2", "{0}2", "{0}**2", "{0}²"),
    -1: ("1/{0}", "/{0}", "{0}^-1", "{0}-1"),
    -2: ("1/{0}^2", "/{0}2", "{0}^-2", "1/{0}²"),
    -3: ("1/{0}^3", "{0}^-3"),
    3: ("{0}^3",),
}


def test_sizes():
    for kind, known_sizes in (("length", METRES), ("stress", PASCALS)):
        assert set(SIZES[kind]) == set(known_sizes)
        for unit, size in known_sizes.items():
            assert float(SIZES[kind][unit]) == pytest.approx(size, rel=1e-15)
    assert {known("µm"), known("μm"), known("micron"), known(" um ")} == {"um"}
    assert known("N/mm²", "stress") == known("N/mm2", "stress") == "MPa"
    assert all(
        any(unit in sizes for sizes in SIZES.values()) for unit in ALIASES.values()
    )


@settings(max_examples=1000, deadline=None)
@given(
    number=st.floats(-1e12, 1e12, allow_subnormal=False).filter(
        lambda x: x == 0 or abs(x) > 1e-12
    ),
    name=st.sampled_from(LENGTH_NAMES),
    have=st.sampled_from(sorted(METRES)),
    want=st.sampled_from(sorted(METRES)),
    spelling=st.integers(0, 3),
    space=st.sampled_from(["", " ", "  "]),
)
def test_any_length_converts(number, name, have, want, spelling, space):
    power = DIMENSIONS[name][0]
    forms = SPELLINGS[power]
    unit = forms[spelling % len(forms)].format(have)
    # 5 1/mm needs the space that 5/mm does not
    text = f"{number!r}{space or (' ' if unit[0] == '1' else '')}{unit}"
    found = Units(want).number(name, text)
    exact = Fraction(number) * (SIZES["length"][have] / SIZES["length"][want]) ** power
    assert abs(Fraction(found) - exact) <= abs(exact) * Fraction(2 * EPS)


@settings(max_examples=50, deadline=None)
@given(st.sampled_from(sorted(METRES)), st.sampled_from(sorted(METRES)))
def test_a_surface_there_and_back(have, want):
    surface = Surface(0.8, [0.5, 1.0], 100.0, 0.2, 0.6, unit=have)
    moved = surface.to(want)
    assert moved.unit == want
    for name in ("hurst", "zeta_1", "alpha", "rms_gradient", "m2"):
        np.testing.assert_allclose(
            getattr(moved, name), getattr(surface, name), rtol=1e-13
        )
    for name in ("q0", "q1", "h_rms", "h_max", "m0", "m4"):
        size = (METRES[have] / METRES[want]) ** DIMENSIONS[name][0]
        np.testing.assert_allclose(
            getattr(moved, name), getattr(surface, name) * size, rtol=1e-13
        )
        np.testing.assert_allclose(
            getattr(moved.to(have), name), getattr(surface, name), rtol=1e-14
        )


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("h_rms", "0.8 um^2"),
        ("q0", "6 mm"),
        ("m0", "1 mm"),
        ("hurst", "0.8 um"),
        ("E1", "210 mm"),
        ("h_rms", "1 MPa"),
    ]
    + [
        ("h_rms", text)
        for text in ("um", "", "1,5 um", "0.8 furlong", "nan um", "1 um um")
    ],
)
def test_texts_that_are_refused(name, text):
    with pytest.raises(InputError, match=name + "|no known unit"):
        read(name, text)


def test_two_surfaces_in_their_own_units():
    one = Surface(0.8, 0.5, 100.0, 0.2, 0.6, unit="mm")
    other = Surface(0.8, 0.5e-3, 0.1, 200.0, 600.0, unit="um")
    both = one.combined(other)
    same = one.combined(one)
    assert both.unit == "mm"
    for name in ("h_rms", "h_max", "q0", "q1", "m2", "m4"):
        assert getattr(both, name) == pytest.approx(getattr(same, name), rel=1e-9)
    assert both.to("um").h_rms == pytest.approx(1e3 * both.h_rms, rel=1e-14)
    with pytest.raises(InputError, match="the unit of the other is not known"):
        one.combined(PLAIN)


NUMBERS = {
    "hurst": 0.8,
    "q0": "6.283/mm",
    "zeta_1": 100,
    "h_rms": "0.8 um",
    "h_max": "2.4e-3 mm",
}


def test_resolve_takes_the_first_unit_or_the_one_asked_for():
    assert in_one_unit(NUMBERS)[1] == "mm"
    plain, unit = in_one_unit(NUMBERS, "m")
    assert unit == "m"
    assert [plain[name] for name in NUMBERS] == pytest.approx(
        [0.8, 6283.0, 100, 0.8e-6, 2.4e-6], rel=1e-15
    )
    # plain numbers are in the unit asked for
    assert in_one_unit({"h_rms": 2.0, "h_max": "6 mm"}, "um") == (
        {"h_rms": 2.0, "h_max": 6000.0},
        "um",
    )
    with pytest.raises(
        InputError,
        match="h_max without a unit beside numbers in um: write the unit to each",
    ):
        in_one_unit({"h_rms": "2 um", "h_max": 6.0})


CONCRETE = Surface.named("concrete")
PLAIN = Surface(0.8, 0.1, 10.0, 1.0, 3.0)


test_conflicts_in_python = refusals(
    lambda ask: ask(),
    (lambda: PLAIN.to("mm"), "the surface's unit is not known: make it with unit="),
    (
        lambda: Surface(0.8, 0.1, 10.0, 1.0, 3.0, unit="millimetre"),
        "no known unit of length",
    ),
    (lambda: CONCRETE.to(1.0), "a unit of length is a text"),
    (lambda: Scene(PLAIN, separation=["1 um"]), "give the surface its unit"),
    (lambda: Scene(CONCRETE, pressure=["1 MPa"]), "needs a modulus"),
    (lambda: Scene(CONCRETE, 9.0, pressure=["1 MPa"]), "give E\\* with its unit"),
    (lambda: describe_law(PLAIN, "13 MPa", rows=9), "length_unit is missing"),
    (lambda: describe_law(CONCRETE, 13.0, rows=9), "stress_unit is missing"),
)


test_conflicts_on_the_command_line = told(
    lambda arguments: refused("contact", *arguments.split()),
    (
        "--hurst 0.8 --q0 0.1/mm --zeta-1 50 --h-rms 800um --h-max 3 -d 1",
        "h_max without a unit beside numbers in mm",
    ),
    ("--hurst 0.8 --q0 0.1 --zeta-1 50 --h-rms 1 --h-max 3 -d 1mm", "give --length-unit"),
    ("--surface concrete -d 1 --stress-unit MPa", "no modulus"),
    ("--surface concrete -a 1mm", "area has no unit"),
)


def asked(*arguments):
    return json.loads(run("contact", *arguments, "--json"))


def test_the_command_line_converts():
    plain = asked("--surface", "concrete", "--E-star", "13.3MPa", "-d", "0.5,0.2")
    moved = asked(
        "--surface",
        "concrete",
        "--E-star",
        "13.3MPa",
        "-d",
        "500um,0.2mm",
        "--length-unit",
        "m",
    )
    assert (
        plain["units"]["separation"],
        plain["units"]["pressure"],
        plain["units"]["area"],
    ) == ("mm", "MPa", "-")
    assert (moved["units"]["separation"], moved["units"]["stiffness"]) == ("m", "MPa/m")
    for name, size in {
        "separation": 1e-3,
        "pressure": 1,
        "area": 1,
        "stiffness": 1e3,
    }.items():
        found, expected = (np.array(answer["columns"][name]) for answer in (moved, plain))
        np.testing.assert_allclose(found, size * expected, rtol=1e-8)
    pascals = asked(
        "--surface",
        "concrete",
        "--E-star",
        "13.3MPa",
        "--stress-unit",
        "Pa",
        "-p",
        "1kPa",
    )
    assert pascals["columns"]["pressure"] == pytest.approx([1000.0], rel=1e-12)
    assert (pascals["E_star"], pascals["stress_unit"], pascals["units"]["pressure"]) == (
        13.3e6,
        "Pa",
        "Pa",
    )


def test_a_surface_file_states_both_units(tmp_path):
    path = tmp_path / "s.toml"
    path.write_text(
        '[surface]\nname = "concrete"\n[material]\nE_star = "0.0133 GPa"\nstress_unit = "MPa"\n'
    )
    found = asked("--file", path, "-d", "0.5")
    assert (found["E_star"], found["stress_unit"], found["units"]["pressure"]) == (
        pytest.approx(13.3),
        "MPa",
        "MPa",
    )
    # a modulus of the command line is in the file's unit, unless it has its own
    assert asked("--file", path, "--E-star", "20", "-d", "0.5")["E_star"] == 20
    assert asked("--file", path, "--E-star", "2GPa", "-d", "0.5")["stress_unit"] == "GPa"
    moved = asked(
        "--file", path, "-d", "500", "--length-unit", "um", "--stress-unit", "Pa"
    )
    assert moved["E_star"] == pytest.approx(13.3e6)


NUMBERS_OF = (
    "--hurst",
    CONCRETE.hurst,
    "--q0",
    f"{CONCRETE.q0}/mm",
    "--q1",
    f"{CONCRETE.q1}/mm",
)
HEIGHTS_OF = (
    "--h-rms",
    f"{CONCRETE.h_rms}mm",
    "--h-max",
    f"{CONCRETE.h_max}mm",
    "--E-star",
    "13.3",
)


@pytest.mark.parametrize(
    "source", [("--surface", "concrete", "--E-star", "13.3"), (*NUMBERS_OF, *HEIGHTS_OF)]
)
def test_an_export_converts_what_knows_its_unit(source, tmp_path):
    laws = []
    for unit in ("mm", "m"):
        units = ("--length-unit", unit, "--stress-unit", "MPa")
        run(
            "export",
            "json",
            *source,
            *units,
            "--rows",
            20,
            "--out",
            tmp_path / f"{unit}.json",
        )
        laws.append(json.loads((tmp_path / f"{unit}.json").read_text()))
    in_mm, in_m = laws
    assert (in_m["x_unit"], in_m["comments"][2].count("h_max = 0.0011")) == ("m", 1)
    for name, size, rtol in (("overclosure", 1e-3, 1e-6), ("pressure", 1, 1e-3)):
        assert in_m["columns"][name][-1] == pytest.approx(
            size * in_mm["columns"][name][-1], rel=rtol
        )


@pytest.mark.parametrize("theory", ["mbma", "calibrated", "persson"])
def test_a_contact_keeps_its_units(theory):
    plain = contact(CONCRETE, 13.3, separation=[0.5, 0.2], theory=theory)
    found = contact(
        CONCRETE.to("um"), "0.0133 GPa", separation=["0.5 mm", "200 um"], theory=theory
    )
    expected = {
        "separation": "um",
        "pressure": "GPa",
        "area": "1",
        "stiffness": "GPa/um",
        "energy": "GPa um",
    }
    assert expected.items() <= found.units.items()
    assert unit_of("island_force", Units("um", "1")) == "um^2"
    sizes = {
        "separation": 1e3,
        "pressure": 1e-3,
        "area": 1,
        "stiffness": 1e-6,
        "energy": 1,
        "mean_pressure": 1e-3,
    }
    for name, size in sizes.items():
        np.testing.assert_allclose(
            getattr(found, name), size * getattr(plain, name), rtol=1e-7
        )
    joint = contact(CONCRETE, "13.3 MPa", pressure="10 kPa", theory=theory)
    assert joint.pressure == pytest.approx(0.01, rel=1e-9)
    assert plain.units["pressure"] == "stress"
    assert contact(CONCRETE, separation=0.5, theory=theory).units["stiffness"] == "1/mm"


@pytest.mark.parametrize("theory", ["mbma", "persson"])
def test_a_law_keeps_its_units(theory):
    law = contact_law(CONCRETE.to("um"), "13.3 MPa", rtol=1e-5, theory=theory)
    assert law.units == Units("um", "MPa")
    assert law.pressure("0.7 mm") == law.pressure(700.0)
    assert law.separation(pressure="10 kPa") == law.separation(pressure=0.01)
    assert law.at_pressure("10 kPa").area == law.at_pressure(0.01).area
    point = law.at_pressure("10 kPa")
    assert f"mean_separation {point.mean_separation:.4g} um," in repr(point)
    assert "pressure 0.01 MPa" in repr(pickle.loads(pickle.dumps(point)))
    assert pickle.loads(pickle.dumps(law)).units == law.units
    with pytest.raises(InputError, match="needs a modulus"):
        contact_law(CONCRETE, rtol=1e-3).at_pressure("10 kPa")


@pytest.mark.parametrize("theory", ["mbma", "calibrated"])
def test_a_surface_that_is_its_own_spectrum_has_the_same_rule(theory):
    q = np.geomspace(0.2, 50, 200)
    surface = Surface.from_spectrum(
        q, 0.01 * np.minimum(1, q**-3.6), h_max=1.1, unit="um"
    )
    plain = contact(surface, "100 GPa", mean_separation=0.6, theory=theory)
    moved = contact(surface.to("mm"), "100 GPa", mean_separation="600 nm", theory=theory)
    assert (plain.units["stiffness"], moved.units["stiffness"]) == ("GPa/um", "GPa/mm")
    for name, size in {
        "pressure": 1,
        "area": 1,
        "stiffness": 1e3,
        "energy": 1e-3,
    }.items():
        assert getattr(moved, name) == pytest.approx(
            size * getattr(plain, name), rel=1e-9
        )
    law = describe_law(surface, "100 GPa", length_unit="mm", rows=20, theory=theory)
    assert (law.x_unit, law.y_unit) == ("mm", "GPa")
    assert law.x[-1] == pytest.approx(1e-3 * surface.h_max, rel=1e-3)
    found = Scene(
        surface, "100 GPa", separation=["0.3e-3 mm"], theory=theory, rtol=1e-3
    ).run()
    assert (found["separation"].item(), found["pressure"].attrs["units"]) == (0.3, "GPa")
    with pytest.raises(InputError, match="give the surface its unit"):
        contact(
            Surface.from_spectrum(q, 0.01 * q**-3.6, h_max=1.1),
            mean_separation="600 nm",
            theory=theory,
        )


@pytest.mark.parametrize(
    ("text", "si", "unit"),
    [
        ("45 W/(m K)", 45.0, "W/(m^2 K)"), ("45 mW/(mm K)", 45.0, "W/(m^2 K)"), ("0.45 W/(cm K)", 45.0, "W/(m^2 K)"),
        ("45 W/m/K", 45.0, "W/(m^2 K)"), ("0.045 kW/(m*K)", 45.0, "W/(m^2 K)"), ("58 MS/m", 58e6, "S/m^2"),
        ("58e3 S/mm", 58e6, "S/m^2"),
    ],
)  # fmt: skip
def test_conductivities_in_any_unit(text, si, unit):
    for length, metre in (("um", 1e6), ("mm", 1e3)):
        numbers, found = Units(length).conductivities(text, text)
        assert found == unit
        assert numbers == pytest.approx([si * metre] * 2, rel=1e-15)


@pytest.mark.parametrize(
    "pair",
    [
        ("45 W/(m K)", "6e7 S/m"), ("45 W/m", "45 W/m"), ("45 furlong", "45 furlong"), ("45 W/(parsec K)",) * 2,
        (45.0, "45 W/(m K)"), ("45 mS/(m K)",) * 2, ("W/(m K)",) * 2,
    ],
)  # fmt: skip
def test_conductivities_that_are_refused(pair):
    with pytest.raises(InputError, match=r"conductivities are|no known unit of length"):
        Units("um").conductivities(*pair)


def test_units_of_data_arrays_have_powers():
    face = {"hurst": 0.8, "q0": 0.06, "q1": 3.0, "h_rms": 1.0}
    area = xr.DataArray([4.0, 5.0], dims="face")
    for size, power in ((1e8, "um^2"), (1e8, "um2")):
        stated = (size * area).assign_attrs(units=power)
        found = Surface(**face, nominal_area=stated, unit="um").h_max
        plain = Surface(**face, nominal_area=size * area.values, unit="um").h_max
        np.testing.assert_array_equal(found, plain)
    with pytest.raises(InputError, match=r"in 'mm\^2' by its .* asked for in 'um\^2'"):
        Surface(**face, nominal_area=area.assign_attrs(units="mm^2"), unit="um")
    with pytest.raises(InputError, match=r"q0 is in '1/mm' .* asked for in '1/um'"):
        Surface(
            **face | {"q0": xr.DataArray([0.06], dims="face", attrs={"units": "1/mm"})},
            h_max=3.0,
            unit="um",
        )
    one = Surface(**face, h_max=3.0, unit="um")
    gaps = xr.DataArray([1.9, 2.0], dims="gap", attrs={"units": "GPa"})
    with pytest.raises(InputError, match="no known unit of length but one of stress"):
        contact(one, mean_separation=gaps)
    pressures = xr.DataArray([1.0], dims="p", attrs={"units": "kN/m^2"})
    with pytest.raises(InputError, match="no known unit of stress"):
        contact(one, "1 GPa", pressure=pressures)
    # what the library wrote of numbers without a unit is a number without a unit
    bare = Surface(**face, h_max=3.0)
    loads = xr.DataArray([1e-5, 1e-4], dims="load")
    u = contact(bare, pressure=loads).mean_separation
    assert u.attrs["units"] == "length"
    np.testing.assert_array_equal(contact(one, mean_separation=u).mean_separation, u)


def test_quantities_have_the_unit_of_their_declaration_alone():
    units = Units("um", "GPa")
    for name, declared in registry().items():
        # an argument may have the name of a quantity
        if name in DIMENSIONS:
            assert unit_of(name, units) == declared.unit_in(units)
        assert unit_of_quantity(name, units) == declared.unit_in(units)
    assert unit_of_quantity("h_max", units) == "um"
    for lookup in (unit_of, unit_of_quantity):
        with pytest.raises(KeyError, match="flow_coeficient"):
            lookup("flow_coeficient", units)
