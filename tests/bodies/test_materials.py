import csv
import dataclasses
import json
import pathlib

import numpy as np
import pytest
import xarray as xr
from helpers import contact_of, refusals, run
from hypothesis import given
from hypothesis import strategies as st

from mbma_tables import (
    Bodies,
    Gas,
    Scene,
    Surface,
    contact,
    contact_law,
    materials,
    sensitivity,
)
from mbma_tables.bodies.materials import effective_modulus, hardness
from mbma_tables.common.errors import InputError, OutOfRangeError
from mbma_tables.export.rows.law_rows import describe_law

moduli = st.floats(1e-6, 1e12)
ratios = st.floats(-0.99, 0.5)


def test_textbook_values():
    # steel on steel, E/(2 (1 - nu^2)); rubber at nu = 1/2 on a body 1e9 times stiffer, 4 E/3
    assert effective_modulus(210.0, 0.3, 210.0, 0.3) == pytest.approx(
        210 / 1.82, rel=1e-15
    )
    assert effective_modulus(3.0, 0.5, 3e9, 0.0) == pytest.approx(
        4 / (1 + 4e-9 / 3), rel=1e-15
    )


@given(moduli, ratios, moduli, ratios)
def test_bodies_may_be_exchanged_and_compliances_add(E1, nu1, E2, nu2):
    together = effective_modulus(E1, nu1, E2, nu2)
    assert together == effective_modulus(E2, nu2, E1, nu1)
    assert 1 / together == pytest.approx((1 - nu1**2) / E1 + (1 - nu2**2) / E2, rel=1e-13)


def test_texts_give_a_text_that_contact_takes():
    found = effective_modulus("210 GPa", 0.3, "7e4 MPa", 0.33)
    assert found == f"{effective_modulus(210.0, 0.3, 70.0, 0.33)} GPa"
    pressed = contact(Surface.named("challenge"), found, pressure="1 MPa")
    assert pressed.units["pressure"] == "GPa"
    with pytest.raises(InputError, match="E2 without a unit beside numbers in GPa"):
        effective_modulus("210 GPa", 0.3, 70.0, 0.33)
    with pytest.raises(TypeError, match=r"materials\.effective_modulus"):
        contact(Surface.named("challenge"), pressure="1 MPa", E1="210 GPa")


test_out_of_range = refusals(
    effective_modulus,
    (0.0, 0.3, 1.0, 0.3, "E1 must be positive"),
    (1.0, 0.3, -1.0, 0.3, "E2 must be positive"),
    (1.0, 0.51, 1.0, 0.3, "nu1 must be in"),
    (1.0, 0.3, 1.0, -1.0, "nu2 must be in"),
    error=OutOfRangeError,
)


# tensile strength of the hardest temper [MPa]: data sheets of the tempers, Callister's
# table B.4 for gold
TENSILE = {
    "steel 1020": 460, "steel 4140": 1965, "stainless steel 304": 1180, "aluminium 1100": 130, "aluminium 6061": 310,
    "aluminium 7075": 572, "copper C11000": 360, "brass C26000": 640, "titanium Ti-6Al-4V": 1170,
    "magnesium AZ31B": 290, "gold": 220, "steel S235": 510, "steel S355": 630, "copper CuCr1Zr": 510,
}  # fmt: skip
# of other pages than the module's: E [GPa], nu, conductivity [W/(m K)]
ELSEWHERE = {
    "steel 1020": (203, 0.29, 52),  # ASME B31.1 at Engineering ToolBox; MakeItFrom
    "steel 4140": (205, 0.29, 43),  # the same
    "steel 52100": (
        200,
        0.285,
        50,
    ),  # dhanlaxmimetals.com; unitedmetalsc.com.my; material-properties.org, high carbon
    "stainless steel 304": (197, 0.305, 15),  # Miki Pulley; Engineering ToolBox
    "cast iron, grey": (100, 0.26, 46),  # Miki Pulley; formulafactory.tools; MakeItFrom
    "aluminium 1100": (
        69,
        0.33,
        220,
    ),  # Callister's table B.2; MakeItFrom, 1200; CRC at 273 K
    "aluminium 6061": (69, 0.33, 167),  # ecoursesbook.com; MatWeb, T6
    "aluminium 7075": (72, 0.33, 130),  # Miki Pulley; ecoursesbook.com
    "copper C11000": (110, 0.34, 393),  # Aurubis, Cu-ETP; electrical-contacts-wiki.com
    "brass C26000": (110, 0.33, 120),  # MakeItFrom; ecoursesbook.com
    "titanium grade 2": (
        105,
        0.34,
        16,
    ),  # Superior Tube; formulafactory.tools; alloyfyi.com
    "titanium Ti-6Al-4V": (113.8, 0.33, None),  # ecoursesbook.com
    "magnesium AZ31B": (45, 0.35, 100),  # MakeItFrom; Engineers Edge
    "silver": (82, 0.37, None),  # electrical-contacts-wiki.com
    "steel S235": (203, 0.29, 52),  # those of low-carbon steel above
    "steel S355": (203, 0.29, 52),
    "steel C45": (
        201,
        0.27,
        50.9,
    ),  # a179.net/2012/01/08/sae-1045-steel-properties; szrtjs.com, 0.269
    "copper CuCr1Zr": (120, 0.34, 320),  # MakeItFrom, C18100
    "gold": (
        79,
        0.42,
        317,
    ),  # electrical-contacts-wiki.com; Engineers Edge, 183 Btu/(h ft F)
}


@pytest.mark.parametrize("name", materials.METALS)
def test_metals_agree_with_other_pages(name):
    metal, (E, nu, conductivity) = materials.get(name), ELSEWHERE[name]
    assert pytest.approx(E, rel=0.1) == metal.E
    assert metal.nu == pytest.approx(nu, abs=0.021)
    assert (
        conductivity is None
        or 0.9 * metal.conductivity[0] < conductivity < 1.1 * metal.conductivity[1]
    )
    assert 0 < metal.hardness[0] <= metal.hardness[1]
    # plasticity: the pressure of an indentation is about three flow stresses; here within a
    # factor of 1.5
    assert name not in TENSILE or 2 < 1e3 * metal.hardness[1] / TENSILE[name] < 4.5


def test_brinell_and_vickers_numbers_from_the_indentation():
    ball = 10.0  # mm
    for name, numbers, force in (
        ("steel 4140", (200, 578), 3000),
        ("aluminium 6061", (30, 95), 500),
    ):
        depth = force / (
            np.pi * ball * np.array(numbers)
        )  # number is force over the cap's area, pi D depth
        pressure = force * 9.80665 / (np.pi * depth * (ball - depth)) / 1e3
        np.testing.assert_allclose(materials.get(name).hardness, pressure, atol=0.0051)
    diagonal = np.sqrt(1.8544 / np.array((55.0, 200.0)))  # mm, at 1 kgf, ISO 6507
    np.testing.assert_allclose(
        materials.get("brass C26000").hardness,
        9.80665e-3 / (diagonal**2 / 2),
        atol=0.0051,
    )


# table 1 of ASTM E140 at numbers between those of the module, as printed in two manuals of
# hardness testers
@pytest.mark.parametrize(
    ("rockwell", "vickers"),
    [(42, 412), (48, 484), (53, 560), (58, 653), (62, 746), (66, 865)],
)
def test_rockwell_numbers(rockwell, vickers):
    both = (
        float(materials.hardness(text).removesuffix(" GPa"))
        for text in (f"{rockwell} HRC", f"{vickers}HV")
    )
    assert next(both) == pytest.approx(next(both), rel=0.008)


# Vickers numbers at Rockwell B numbers, as printed of DIN 50150 at
# 51tongren.cn/en/technical.asp?plt=4, and of ASTM E140 table 2
@pytest.mark.parametrize(
    ("rockwell", "vickers"),
    [
        (73, 140),
        (80, 160),
        (89.6, 195),
        (95, 220),
        (98.4, 240),
        (75, 137),
        (90, 185),
        (95, 210),
    ],
)
def test_rockwell_b_numbers(rockwell, vickers):
    """Tables differ by 6% or less, as the docstring states."""
    both = (
        float(materials.hardness(text).removesuffix(" GPa"))
        for text in (f"{rockwell} HRB", f"{vickers}HV")
    )
    assert next(both) == pytest.approx(next(both), rel=0.06)


def test_brinell_numbers_at_any_load():
    """The mean pressure is the force over the circle of the indentation, whose cap the number refers to."""
    for text, ball, force in (
        ("95 HBW 10/500", 10.0, 500.0),
        ("200 HB", 10.0, 3000.0),
        ("120 HBW 2.5/187.5", 2.5, 187.5),
    ):
        cap = force / float(text.split()[0])
        depth = cap / (np.pi * ball)
        circle = np.pi * ((ball / 2) ** 2 - (ball / 2 - depth) ** 2)
        found = float(materials.hardness(text).removesuffix(" GPa"))
        assert found == pytest.approx(9.80665e-3 * force / circle, rel=1e-5)
    with pytest.raises(OutOfRangeError, match=r"from 96 to 653 .* '95 HBW 10/500'"):
        materials.hardness("95 HB")


@pytest.mark.parametrize(
    ("typed", "name"),
    [
        ("S355J2", "steel S355"), ("1.4301", "stainless steel 304"), ("304 stainless steel", "stainless steel 304"),
        ("6061-T6", "aluminium 6061 hard"), ("Aluminum 6061 hard", "aluminium 6061 hard"), ("C45", "steel C45"),
        ("gray cast iron", "cast iron, grey"), ("GG25", "cast iron, grey"), ("Ti6Al4V", "titanium Ti-6Al-4V"),
        ("CuCrZr", "copper CuCr1Zr"),
    ],
)  # fmt: skip
def test_names_of_metals_in_other_standards_and_spellings(typed, name):
    assert materials.get(typed) == materials.get(name)


def test_a_name_that_begins_with_a_digit_is_a_hardness_too():
    assert materials.hardness("6061-T6") == materials.hardness("aluminium 6061 hard")
    assert (
        materials.hardness("304") == "304"
    )  # a plain number, in the unit of the modulus


def test_unknown_metals_are_answered_with_the_alike():
    with pytest.raises(
        InputError, match="give aluminium 1100, aluminium 6061, aluminium 7075, perhaps"
    ) as told:
        materials.get("aluminum")
    assert "gold" not in str(told.value)
    with pytest.raises(InputError, match="copper C11000, copper CuCr1Zr"):
        materials.get("copper")


def test_constants_of_a_metal_in_units_and_in_the_wrong_ones():
    typed = materials.Metal("own", "210e3 MPa", 0.3, ("200 HV", "58 HRC"), "45 W/(m K)")
    assert typed == materials.Metal("own", 210, 0.3, (2.11536, 6.9405), (45, 45))
    assert (
        materials.pair(
            {"name": "own", "E": "210 GPa", "nu": 0.3, "hardness": 2, "conductivity": 45}
        ).softer.E
        == 210
    )
    given = {"name": "S", "E": 210.0, "nu": 0.3, "hardness": 2.0, "conductivity": 45.0}
    for changed, match in (
        ({"E": 210e3}, r"from 0\.01 to 2000 GPa"),
        ({"E": 2.1e11}, "'210 GPa'"),
        ({"E": "210 um"}, "unit of stress"),
        ({"nu": 0.7}, "nu of 'S' must be in"),
        ({"hardness": 1500}, "hardness of 'S' in GPa must be a number in"),
        ({"hardness": (3, 2)}, "the lowest comes first"),
        ({"conductivity": "6e7 S/m"}, "is thermal"),
        ({"conductivity": 45e3}, "conductivity of 'S'"),
        ({"name": 5}, "name of a metal"),
    ):
        with pytest.raises(InputError, match=match):
            materials.Metal(**given | changed)
    with pytest.raises(InputError, match="hardness missing and Young unknown"):
        materials.pair({"name": "S", "E": 210, "nu": 0.3, "conductivity": 45, "Young": 5})


def test_hardness_is_three_times_the_yield_stress_or_another_factor():
    assert hardness("yield 350 MPa") == "1.05 GPa"
    assert hardness("2.8 x Yield 0.25 GPa") == "0.7 GPa"
    by_yield, by_pressure = (
        contact(FACE, Bodies("100 GPa", hardness=given), pressure="100 MPa")
        for given in ("yield 350 MPa", "1050 MPa")
    )
    assert by_yield.area == by_pressure.area


def test_every_name_of_a_metal_is_on_its_page():
    page = pathlib.Path("docs/yield.md").read_text(encoding="utf-8")
    lines = pathlib.Path("tables/metals.csv").read_text(encoding="utf-8").splitlines()
    for row in csv.DictReader(line for line in lines if not line.startswith("#")):
        assert f"| {row['name']} | " in page
        for name in row["also"].split(";"):
            assert name in page
        assert row["source"] in page


def test_hardnesses_that_are_refused():
    for text, message in (
        ("aluminium 6061", r"'aluminium 6061 soft' \(0.31 GPa\)"),
        ("70 HRC", "from 20 to 68"),
        ("60 HRB", "from 71.2 to 99.5"),
        ("unobtainium", "no metal is named"),
        ("0 HV", "positive"),
        ("3 um", "unit of stress"),
        ("yield 350", "a yield stress has a unit"),
        ("9 x yield 350 MPa", "factor of the yield stress must be from 1 to 4"),
        ("1.2.3 x yield 350 MPa", "is a number"),
        ("yield -3 MPa", "yield stress must be positive"),
    ):
        with pytest.raises(InputError, match=message):
            contact(FACE, Bodies("100 GPa", hardness=text), pressure="1 MPa")
    for names in ((), ("silver",) * 3, 5, ("silver", 5), {"a": 1}):
        with pytest.raises(
            InputError, match=r"one or two|no metal is named|a metal has name"
        ):
            materials.pair(names)
    with pytest.raises(InputError, match="steel 4140"):
        materials.get("steel 4141")


FACE = Surface(hurst=0.8, q0=0.06, q1=3.0, h_rms=1.0, h_max=3.5, unit="um")


def test_metals_named_answer_as_their_numbers_do():
    asked = {"pressure": ["10 MPa", "100 MPa"], "theory": "calibrated"}
    named = contact_of(FACE, ("steel 4140 hard", "aluminium 6061 hard"), **asked)
    modulus = effective_modulus(205.0, 0.29, 69.0, 0.33)
    plain = contact_of(
        FACE,
        Bodies(
            f"{modulus} GPa",
            hardness=["950 MPa"],
            conductivity=("42.7 W/(m K)", f"{(154 * 180) ** 0.5} W/(m K)"),
        ),
        **asked,
    )
    for name in ("area", "mean_separation", "stiffness", "unloading_stiffness"):
        np.testing.assert_allclose(getattr(named, name), getattr(plain, name), rtol=1e-12)
    np.testing.assert_allclose(
        named.solid_conductance, plain.solid_conductance, rtol=1e-5
    )
    law = contact_law(
        FACE, ("steel 4140 hard", "aluminium 6061 hard"), theory="calibrated"
    )
    np.testing.assert_allclose(law.at_pressure("100 MPa").area, named.area[1], rtol=1e-4)
    with pytest.raises(InputError, match="E_star and metals"):
        contact_of(FACE, Bodies("100 GPa", metals="silver"), **asked)
    without = contact_of(FACE, f"{modulus} GPa", **asked)
    with pytest.raises(
        InputError, match=r"solid_conductance needs conductivity.*named metals"
    ):
        _ = without.solid_conductance


def test_metals_that_yield_are_not_valid_without_a_hardness():
    def at(bodies, surface=FACE, pressure="50 MPa"):
        return contact(surface, bodies, pressure=pressure, theory="calibrated")

    assert at("steel 1020").valid  # one temper: it yields by default
    assert at("steel 1020").yielded > 0.9
    (reason,) = at("steel 4140").reasons
    assert reason == (
        "steel 4140 yields here: give its temper, 'steel 4140 soft' or 'steel 4140 hard', "
        "or Bodies(metals=..., hardness=...), '2.06 GPa' to '5.76 GPa'"
    )
    # the remedies are taken as they are written
    for temper in ("steel 4140 soft", "steel 4140 hard"):
        assert at(temper).valid
    of_ones_own = dataclasses.replace(materials.get("steel 4140"), name="own steel")
    (reason,) = at(of_ones_own).reasons
    assert reason.startswith("own steel yields here: give Bodies(metals=..., hardness=")
    assert at(Bodies(metals="steel 4140", hardness="200 HV")).valid
    elastic_pair = Bodies(metals=("steel 52100", "silver"), hardness=np.inf)
    assert not at(elastic_pair).valid
    (reason,) = at(elastic_pair).reasons
    assert reason == "silver yields here: give Bodies(metals=..., hardness='0.26 GPa')"
    # elastic up to gradients of 0.073, docs/yield.md
    polished = Surface(hurst=0.8, q0=0.06, q1=3.0, h_rms=1.0, h_max=3.5).scaled(1.0, "um")
    for gradient, elastic in ((0.07, True), (0.08, False)):
        height = gradient / float(polished.rms_gradient)
        face = Surface(
            hurst=0.8, q0=0.06, q1=3.0, h_rms=height, h_max=3.5 * height, unit="um"
        )
        steel = Bodies(metals="steel 52100", hardness=np.inf)
        assert at(steel, face).valid == elastic
    # no material named: above what any of them bears
    assert not at("115 GPa").valid
    assert at(Bodies("115 GPa", hardness=np.inf)).valid
    assert at("50 GPa").valid
    assert contact(
        FACE, pressure=1e-3, theory="calibrated"
    ).valid  # over E*: no stress is known
    labelled = at("steel 4140", pressure=xr.DataArray([0.05, 0.1], dims="load"))
    assert not labelled.valid.values.any()
    assert [text[:17] for text in labelled.reasons] == ["steel 4140 yields"]


@pytest.mark.parametrize("theory", ["calibrated", "mbma"])
def test_sensitivities_hold_the_hardness(theory):
    numbers = {"pressure": 0.1, "E_star": 115.0, "hardness": 3.0}
    bodies = Bodies("115 GPa", hardness="3 GPa", conductivity="40 W/(m K)")
    found = sensitivity(FACE, bodies, pressure="0.1 GPa", theory=theory)
    for name in numbers:
        both = []
        for factor in (0.999, 1.001):
            own = numbers | {name: numbers[name] * factor}
            bodies = Bodies(f"{own['E_star']} GPa", hardness=own["hardness"])
            one = contact(FACE, bodies, pressure=own["pressure"], theory=theory)
            both.append(
                [
                    one.area,
                    one.mean_separation,
                    one.stiffness,
                    one.unloading_stiffness / own["E_star"],
                ]
            )
        slope = np.diff(np.log(both), axis=0)[0] / np.log(1.001 / 0.999)
        known = [
            found.slopes[name][answer]
            for answer in ("area", "mean_separation", "stiffness", "solid_conductance")
        ]
        np.testing.assert_allclose(known, slope, atol=1e-4)


def test_scenes_and_rows_take_every_hardness():
    pressures = ["10 MPa", "50 MPa"]
    scene = Scene(
        FACE,
        Bodies("115 GPa", hardness="40 HRC"),
        pressure=pressures,
        theory="calibrated",
    )
    bodies = Bodies("115 GPa", hardness="392 HV")
    known = contact(FACE, bodies, pressure=pressures, theory="calibrated")
    np.testing.assert_allclose(scene.run()["area"], known.area, rtol=1e-4)
    rows = describe_law(FACE, "115 GPa", theory="calibrated", hardness="silver", rows=20)
    assert any(line.startswith("hardness = 0.26 GPa") for line in rows.comments)


def test_a_hardness_in_the_shell():
    asked = "--hurst 0.8 --q0 0.06/um --q1 3/um --h-rms 1um --h-max 3.5um --E-star 115GPa -p 50MPa --theory calibrated"
    for text, valid in (
        ("40 HRC", "yes"),
        ("steel 4140 hard", "yes"),
        ("inf", "yes"),
        (None, "no"),
    ):
        given = ["--hardness", text] if text else []
        answer = json.loads(run("contact", *asked.split(), "--json", *given))["columns"]
        assert answer["valid"] == [valid], text
        bodies = Bodies("115 GPa", hardness=np.inf if text == "inf" else text)
        known = contact(FACE, bodies, pressure="50 MPa", theory="calibrated")
        assert answer["area"] == [pytest.approx(float(known.area), rel=1e-12)]


def test_microhardness_of_the_contacts_of_a_face():
    face = Surface.from_roughness(
        Rq="1 um", longest="250 um", shortest="4 um", hurst=0.8, nominal_area="4 cm^2"
    )
    hard = float(materials.microhardness(face, 5.0, -0.2).split()[0])
    slope = np.sqrt(2 * face.m2 / np.pi)
    assert hard == pytest.approx(5.0 * (1.62 / slope) ** -0.2, rel=1e-5)
    # the same face in other units, and an index of none
    assert materials.microhardness(
        face.to("mm"), "5000 MPa", -0.2
    ) == materials.microhardness(face, "5 GPa", -0.2)
    assert materials.microhardness(face, "5 GPa", 0.0) == "5 GPa"
    for c1, c2, match in (("5 GPa", 0.1, "c2"), (-1.0, -0.1, "c1")):
        with pytest.raises(OutOfRangeError, match=match):
            materials.microhardness(face, c1, c2)


def test_youngs_moduli_give_the_effective_modulus():
    steel_on_glass = Bodies(E=("210 GPa", "70e3 MPa"), nu=(0.3, 0.22))
    compliance = (1 - 0.3**2) / 210 + (1 - 0.22**2) / 70
    found = contact(FACE, steel_on_glass, pressure="1 MPa")
    assert found.units["pressure"] == "GPa"
    assert found.E_star == pytest.approx(1 / compliance, rel=1e-12)
    # a modulus that was rounded by hand is theirs, and plain ones are in its unit
    for rounded, E in ((55.9, (210.0, 70.0)), ("55.9e3 MPa", (210e3, 70e3))):
        both = contact(FACE, Bodies(rounded, E=E, nu=(0.3, 0.22)), pressure=0.001)
        assert both.tangential_stiffness == pytest.approx(
            both.stiffness / materials.tangential_ratio((0.3, 0.22), (210.0, 70.0))
        )


@pytest.mark.parametrize(
    ("constants", "match"),
    [
        ({"E_star": "100 GPa", "E": ("210 GPa", "70 GPa"), "nu": (0.3, 0.22)}, "contradicts E and nu.*leave E_star"),
        ({"E_star": 58e3, "E": (210.0, 70.0), "nu": (0.3, 0.22)}, "contradicts E and nu"),
        ({"metals": "silver", "E": (100.0, 200.0), "nu": (0.3, 0.3)}, "E and metals are both given"),
        ({"metals": "silver", "E_star": "100 GPa"}, "E_star and metals are both given"),
        ({"E": (210.0, 70.0)}, "E needs nu"),
        ({"E": "210 GPa", "nu": 0.3}, "two each"),
        ({"E": 210.0, "nu": 0.3}, "two each"),
        ({"E": (210.0, np.nan), "nu": (0.3, 0.3)}, "E2 must be finite"),
        ({"nu": 0.7}, r"nu must be in \(-1, 0.5\]"),
        ({"nu": "0.3 GPa"}, "nu must be real numbers|nu has no unit"),
    ],
    ids=str,
)  # fmt: skip
def test_contradictory_bodies_are_refused(constants, match):
    with pytest.raises(InputError, match=match):
        Bodies(**constants)


def test_gases_are_checked_when_they_are_described():
    assert Gas("helium", pressure="10 mbar").pascals == pytest.approx(1000.0)
    assert Gas("vacuum", pressure=0.0).name == "vacuum"
    for described, match in (
        ({"name": "vacuum", "accommodation": 7}, r"accommodation must be in \(0, 1\]"),
        ({"name": "air", "accommodation": 0.0}, r"accommodation must be in \(0, 1\]"),
        ({"name": "air", "temperature": "hot"}, "temperature must be real numbers"),
        ({"name": "air", "temperature": np.nan}, "temperature must be finite"),
        ({"name": "air", "pressure": "1 furlong"}, "no known unit of stress"),
        ({"name": ["air"]}, "no gas is named"),
    ):
        with pytest.raises(InputError, match=match):
            Gas(**described)
