"""Slopes of totals and sensitivities to each unknown: against differences, closed forms and laws of scaling."""

import dataclasses
import functools
import json

import numpy as np
import pytest
import xarray as xr
from catalogue import LEVEL, OWN
from helpers import difference_weights, random_map, refusals, run, sensitivity_of

from mbma_tables import Bodies, Gas, InputError, Joint, Surface, contact, sensitivity
from mbma_tables.contacts.quantities import registry
from mbma_tables.islands.geometry import kinks
from mbma_tables.islands.variants import get_variant
from mbma_tables.theories import THEORIES, Mbma

# each of two flags by itself
NO_OFFSET = dataclasses.replace(OWN, name="no offset", offset=False)
OF_HEIGHTS = dataclasses.replace(OWN, name="of heights", summit_sigma=False)
NAMES = ("hurst", "q0", "q1", "h_rms", "h_max", "separation")

# hurst, zeta_1, h_max/h_rms, (h_max - d)/h_rms
CASES = [
    (0.8, 216.0, 3.0, 1.0),
    (0.45, 1e4, 3.4, 0.02),
    (1.0, 60.0, 4.2, 2.5),
    (1.0, 3.8, 2.6, 4.9),
    (0.6, 12.0, 4.7, 7.0),
    (0.9, 1e3, 2.5, 1e-4),
    (0.7, 3.01, 3.0, 2.0),
]
# next to a kink, where a derivative that forgot it would be wrong: the third number is
# reach over the kink
AT_KINKS = [
    (0.9, 100.0, 0, 0.95),
    (0.9, 100.0, 0, 1.05),
    (0.9, 100.0, 1, 0.97),
    (0.9, 100.0, 1, 1.03),
]


def differences(numbers, variant, step, names):
    """Derivatives of force and area by high-order differences of exact islands, of shape (2, names)."""
    shifted = []
    spans = []
    for name in names:
        place = NAMES.index(name)
        backward = name == "hurst" and numbers[place] == 1
        offsets = np.arange(-6.0, 1) if backward else np.arange(-3.0, 4)
        # the depth is what matters near first contact
        span = step * (
            numbers[4] - numbers[5] if name in ("separation", "h_max") else numbers[place]
        )
        points = np.repeat(np.asarray(numbers, dtype=float)[:, None], 7, axis=1)
        points[place] += span * offsets
        shifted.append(points)
        spans.append(difference_weights(offsets) / span)
    points = np.stack(shifted, axis=1)
    found = contact(
        Surface(*points[:5]),
        separation=points[5],
        theory=Mbma(island_model="exact", variant=variant, rtol=1e-11),
    )
    return [
        np.einsum("nk,nk->n", spans, values) for values in (found.pressure, found.area)
    ]


@functools.cache
def numbers_of(case):
    hurst, zeta_1, top, reach = case
    h_rms = 0.7
    return hurst, 0.3, 0.3 * zeta_1, h_rms, top * h_rms, (top - reach) * h_rms


EVERY = [(case, variant, 4e-3) for case in CASES for variant in ("reported", "printed")]
EVERY += [
    (CASES[k], variant, 4e-3)
    for k in (0, 2, 3)
    for variant in (OWN, LEVEL, NO_OFFSET, OF_HEIGHTS)
]
for hurst, zeta_1, which, share in AT_KINKS:
    for variant in ("reported", OWN):
        reach = share * kinks(hurst, zeta_1, get_variant(variant))[which]
        EVERY.append(((hurst, zeta_1, 4.7, reach), variant, 2e-3))


def within(slope, true, value, parameter):
    return (
        np.abs(slope - true) <= 1e-6 * np.maximum(np.abs(true), np.abs(value / parameter))
    ).all()


@pytest.mark.parametrize(("case", "variant", "step"), EVERY, ids=str)
def test_slopes_against_differences(case, variant, step):
    *five, gap = numbers = numbers_of(case)
    [by_force], [by_area] = differences(numbers, variant, step, ["separation"])
    theory = Mbma(variant=variant, rtol=1e-10)
    # by a profile of islands, and of many surfaces gap by gap
    for surface in (Surface(*five), Surface(np.full(20, five[0]), *five[1:])):
        found = theory.totals(surface, np.full(surface.shape, gap), slopes=True)
        assert within(found.pressure_slope, by_force, found.pressure, gap)
        assert within(found.area_slope, by_area, found.area, gap)


@pytest.mark.parametrize("case", [CASES[0], CASES[3]], ids=str)
@pytest.mark.parametrize("variant", ["reported", "printed"])
def test_sensitivity_against_differences(case, variant):
    *five, gap = numbers = numbers_of(case)
    found = sensitivity(
        Surface(*five), separation=gap, theory=Mbma(variant=variant, rtol=1e-10)
    )
    slopes = np.array(differences(numbers, variant, 4e-3, NAMES[:5]))
    for name, parameter, true in zip(NAMES, five, slopes.T, strict=False):
        for answer, slope in zip(("pressure", "area"), true, strict=True):
            assert found.slopes[name][answer] == pytest.approx(
                slope * parameter / found.answers[answer], abs=1e-5
            )


def test_units_shapes_and_no_contact():
    surface = Surface([[0.5], [1.0]], 0.3, 30.0, 0.7, 2.4)
    gap = np.array([1.0, 2.4, 5.0])
    found, stiff = (
        contact(surface, e, separation=gap).stiffness for e in (1.0, [2.0, 3.0, 4.0])
    )
    assert found.shape == (2, 3)
    assert (found[:, 1:] == 0).all()
    np.testing.assert_allclose(stiff, np.array([2, 3, 4]) * found, rtol=1e-15)
    one = contact(Surface(0.5, 0.3, 30.0, 0.7, 2.4), separation=1.0).stiffness
    assert np.shape(one) == ()
    assert one == found[0, 0]


SURFACE = Surface(0.8, 0.06, 12.0, 0.5, 1.7, unit="um")
HELD = {"mean_separation": 1.1, "pressure": 0.03, "area": 0.02}
SLOW = [
    pytest.param(name, marks=pytest.mark.slow if name == "persson" else ())
    for name in THEORIES
]


@pytest.mark.parametrize("theory", SLOW)
@pytest.mark.parametrize("by", HELD)
def test_answers_scale_as_they_must(theory, by):
    bodies = Bodies("10 GPa", conductivity="45 W/(m K)")
    found = sensitivity_of(SURFACE, bodies, **{by: HELD[by]}, theory=theory)
    powers = {
        "mean_separation": (1, 0),
        "pressure": (0, 1),
        "area": (0, 0),
        "stiffness": (-1, 1),
    }
    powers |= {"solid_conductance": (-1, 0)}
    # those that are declared later have the powers of their unit
    for name, declared in registry.registry().items():
        if declared.is_result and name in found.answers:
            of_unit = declared.dimension.length, declared.dimension.stress
            powers.setdefault(name, of_unit)
    assert set(found.answers) == set(powers) - {by}
    for answer in found.answers:
        slope = {name: row[answer] for name, row in found.slopes.items()}
        length = (
            slope["h_rms"]
            + slope["h_max"]
            + slope.get("mean_separation", 0)
            - slope["q0"]
            - slope["q1"]
        )
        stress = slope["E_star"] + slope.get("pressure", 0)
        assert (length, stress) == pytest.approx(powers[answer], abs=2e-5)
        assert all(abs(row[answer]) < 1e-5 for row in found.errors.values())


def test_numbers_of_a_drawing_are_the_unknowns():
    drawing = {"hurst": 0.8, "Ra": 0.4, "Rdq": 0.1, "longest": 100.0, "h_max": 1.8}
    surface = Surface.from_roughness(**drawing, unit="um")
    found = sensitivity(surface, 10.0, pressure=0.02, theory="persson")
    assert list(found.parameters) == [
        "hurst",
        "Ra",
        "h_max",
        "Rdq",
        "longest",
        "E_star",
        "pressure",
    ]
    # Persson's area is a function of p/(E* g) alone
    slopes = {name: row["area"] for name, row in found.slopes.items()}
    assert slopes["Rdq"] == pytest.approx(-slopes["pressure"], abs=1e-6)
    assert max(abs(slopes[name]) for name in ("hurst", "Ra", "h_max", "longest")) < 1e-6
    assert "q1" in sensitivity(surface.to("mm"), 10.0, pressure=0.02).parameters
    moved = sensitivity(
        dataclasses.replace(surface, h_max=2.5), mean_separation=1.0, theory="calibrated"
    )
    assert moved.parameters["h_max"] == 2.5
    assert "q1" in moved.parameters


LABELLED = Surface(xr.DataArray([0.7, 0.8], dims="s"), 0.06, 12.0, 0.5, 1.7)


test_what_is_refused = refusals(
    lambda changed: sensitivity_of(**({"surface": SURFACE, "bodies": 10.0} | changed)),
    ({}, "give exactly one of separation"),
    ({"pressure": 0.1, "quantities": ["aera"]}, "did you mean 'area'"),
    ({"pressure": 0.1, "quantities": "area"}, "quantities are a list of names"),
    ({"pressure": 0.1, "quantities": ["pressure"]}, "pressure is held fixed"),
    ({"pressure": 0.1, "quantities": ["total_conductance"]}, "needs conductivity"),
    ({"pressure": 0.1, "area": 0.1}, "got pressure and area"),
    ({"pressure": [0.1, np.nan]}, "pressure"),
    (
        {"pressure": [0.1, 0.2], "bodies": np.array([1.0, 2.0]), "surface": LABELLED},
        "array of shape",
    ),
)


def test_labels_are_those_of_the_numbers():
    """Every row and column against plain arrays, in the order of the dimensions."""
    hurst = xr.DataArray([0.7, 0.8], {"part": ["a", "b"]}, dims="part")
    load = xr.DataArray([5.0, 10.0, 20.0], {"load": [1, 2, 3]}, attrs={"units": "MPa"})
    hardness = xr.DataArray([1.0, 2.0], dims="steel", attrs={"units": "GPa"})
    surface = Surface(hurst, 0.06, 12.0, 0.5, 1.7, unit="um")
    bodies = Bodies("100 GPa", hardness=hardness, conductivity="45 W/(m K)")
    found = sensitivity(surface, bodies, pressure=load, gas="air", theory="calibrated")
    steel = [[["1 GPa"]], [["2 GPa"]]]
    plain = sensitivity(
        Surface(np.array([0.7, 0.8]), 0.06, 12.0, 0.5, 1.7, unit="um"),
        Bodies("100 GPa", hardness=steel, conductivity="45 W/(m K)"),
        pressure=[["5 MPa"], ["10 MPa"], ["20 MPa"]],
        gas="air",
        theory="calibrated",
    )
    assert set(found.slopes) == set(plain.slopes)
    assert "total_conductance" in found.answers
    order = ("steel", "load", "part")
    for number, row in plain.derivatives.items():
        for name, values in row.items():
            labelled = found.derivatives[number][name]
            assert labelled.part.values.tolist() == ["a", "b"]
            np.testing.assert_allclose(
                labelled.transpose(*order), values, rtol=1e-9, atol=1e-30
            )
    assert found.derivatives["hurst"]["total_conductance"].attrs["units"] == "W/(m^2 K)"
    assert found.derivatives["hardness"]["mean_separation"].attrs["units"] == "(um)/(GPa)"


def test_labels_of_a_joint_reach_its_derivatives():
    face = {"Ra": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}

    def joint(hardness):
        bodies = Bodies(metals="steel 1020", hardness=hardness)
        return Joint(face, face, bodies=bodies, nominal_area="4 cm^2")

    hardness = xr.DataArray([1.2, 1.6], {"temper": [1, 2]}, attrs={"units": "GPa"})
    load = xr.DataArray([10.0, 20.0], {"load": ["low", "high"]}, attrs={"units": "MPa"})
    found = joint(hardness).sensitivity(load)
    by_Ra = found.derivatives["part_a.Ra"]["total_conductance"]
    for temper, number in enumerate((1.2, 1.6), 1):
        for name, pressure in (("low", "10 MPa"), ("high", "20 MPa")):
            one = joint(f"{number} GPa").sensitivity(pressure)
            single = one.derivatives["part_a.Ra"]["total_conductance"]
            own = float(by_Ra.sel(temper=temper, load=name))
            assert own == pytest.approx(single, rel=1e-6)


def test_total_conductance_of_a_surface_is_that_of_its_joint():
    face = {"Ra": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
    joint = Joint(face, bodies="steel 1020", nominal_area="4 cm^2")
    gas = Gas("air", temperature=310)
    asked = {"pressure": "10 MPa", "theory": "calibrated", "gas": gas}
    found = sensitivity(face | {"nominal_area": "4 cm^2"}, "steel 1020", **asked)
    of_joint = dataclasses.replace(joint, gas=gas).sensitivity("10 MPa")
    for number in ("Ra", "hurst", "longest", "shortest"):
        assert found.slopes[number]["total_conductance"] == pytest.approx(
            of_joint.slopes[f"part_a.{number}"]["total_conductance"], rel=1e-6
        )
    for number in ("temperature", "part_a.conductivity", "pressure"):
        assert found.slopes[number]["total_conductance"] == pytest.approx(
            of_joint.slopes[number]["total_conductance"], rel=1e-6
        )


def test_the_command():
    arguments = ["--surface", "challenge", "--E-star", "25MPa", "-p", "100kPa"]
    answer = json.loads(run("sensitivity", *arguments, "--json"))
    found = sensitivity(Surface.named("challenge"), "25 MPa", pressure=0.1)
    assert answer["slopes"] == found.slopes
    assert [answer["units"][name] for name in found.parameters] == [
        "-",
        "1/um",
        "1/um",
        "um",
        "um",
        "MPa",
        "MPa",
    ]
    assert "MPa/um" in run("sensitivity", *arguments)


@pytest.mark.parametrize("theory", ["mbma", "calibrated"])
def test_a_spectrum_in_samples_has_the_slopes_of_its_five_numbers(theory):
    q = np.geomspace(SURFACE.q0, SURFACE.q1, 50)
    sampled = Surface.from_spectrum(
        q, SURFACE.power_spectrum(q), h_max=SURFACE.h_max, unit="um"
    )
    found, five = (
        sensitivity(s, "10 GPa", pressure=0.03, theory=theory).slopes
        for s in (sampled, SURFACE)
    )
    for answer, slope in found["heights"].items():
        assert slope == pytest.approx(
            five["h_rms"][answer] + five["h_max"][answer], abs=1e-4
        )
        assert found["lengths"][answer] == pytest.approx(
            -five["q0"][answer] - five["q1"][answer], abs=1e-4
        )
        assert found["h_max"][answer] == pytest.approx(five["h_max"][answer], abs=1e-4)
    # a cut takes height away, five numbers keep it
    cut = 0.02
    short = dataclasses.replace(SURFACE, q1=SURFACE.q1 * np.exp(-cut))
    short = dataclasses.replace(
        short,
        h_rms=SURFACE.h_rms * float(short.s / short.h_rms * SURFACE.h_rms / SURFACE.s),
    )
    areas = [
        float(contact(s, "10 GPa", pressure=0.03, theory=theory).area)
        for s in (short, SURFACE)
    ]
    assert found["shortest"]["area"] == pytest.approx(
        np.log(areas[0] / areas[1]) / cut, abs=5e-3
    )


def test_unknowns_of_a_map_and_of_its_extrapolation():
    heights = 0.1 * random_map(64, 0.03, 0.25, power=0)
    given = {"pressure": 0.01, "theory": "calibrated"}
    found = sensitivity_of(Surface.from_map(heights, 1.0, periodic=True), **given)
    assert set(found.slopes) == {"heights", "lengths", "pressure"}
    # a force over E* and the gradient, whatever the size
    assert found.slopes["heights"]["area"] == pytest.approx(
        -found.slopes["lengths"]["area"], abs=1e-3
    )
    assert found.slopes["heights"]["area"] == pytest.approx(
        -found.slopes["pressure"]["area"], abs=1e-3
    )
    longer = Surface.from_map(
        heights, 1.0, periodic=True, extrapolate_to=0.5, extrapolate_hurst=0.8
    )
    assert sensitivity_of(longer, **given).slopes["extrapolate_hurst"]["area"] > 0


def simulated_anew(heights, spacing, modulus="30 GPa", pressure="0.1 GPa"):
    """Logarithms of the answers of a map, which is simulated for this call."""
    surface = Surface.from_map(heights, spacing, periodic=True, unit="um")
    pressed = contact(surface, modulus, pressure=pressure, theory="simulated")
    known = (
        pressed.mean_separation,
        pressed.area,
        pressed.stiffness,
        pressed.unloading_stiffness,
    )
    return np.log(np.array(known, dtype=float))


@pytest.mark.slow
def test_a_map_answers_by_the_theory_that_contact_takes():
    """Maps with larger heights and lengths, simulated each, have the differences that the rows give."""
    heights = 0.1 * random_map(64, 0.03, 0.2, power=0)
    step = 0.01
    surface = Surface.from_map(heights, 1.0, periodic=True, unit="um")
    bodies = Bodies("30 GPa", conductivity="45 W/(m K)")
    slopes = sensitivity(surface, bodies, pressure="0.1 GPa", theory="simulated").slopes
    rows = {
        "heights": [simulated_anew(heights * (1 + sign * step), 1.0) for sign in (1, -1)],
        "lengths": [simulated_anew(heights, 1 + sign * step) for sign in (1, -1)],
    }
    pressures = [f"{0.1 * (1 + sign * step)!r} GPa" for sign in (1, -1)]
    moduli = [f"{30.0 * (1 + sign * step)!r} GPa" for sign in (1, -1)]
    rows["pressure"] = [simulated_anew(heights, 1.0, pressure=text) for text in pressures]
    rows["E_star"] = [simulated_anew(heights, 1.0, modulus=text) for text in moduli]
    # conductance is the stiffness over the modulus
    for row, sign in zip(rows["E_star"], (1, -1), strict=True):
        row[3] -= np.log(1 + sign * step)
    assert set(slopes) == {*rows, "conductivity"}
    assert slopes["conductivity"]["solid_conductance"] == pytest.approx(1, abs=1e-6)
    for name, (up, down) in rows.items():
        known = [
            slopes[name][answer]
            for answer in ("mean_separation", "area", "stiffness", "solid_conductance")
        ]
        differences_by_hand = (up - down) / np.log((1 + step) / (1 - step))
        np.testing.assert_allclose(known, differences_by_hand, atol=0.01, err_msg=name)
    with pytest.raises(InputError, match="theory='calibrated'"):
        sensitivity(
            surface,
            Bodies("30 GPa", hardness="0.6 GPa"),
            pressure="0.1 GPa",
            theory="simulated",
        )


@pytest.mark.slow
def test_the_command_for_a_map_of_many_points(tmp_path):
    """By default with the theory, and so the numbers, of `mbma contact`."""
    np.save(tmp_path / "face.npy", 0.1 * random_map(64, 0.03, 0.2, power=0))
    asked = [
        "--map",
        str(tmp_path / "face.npy"),
        "--dx",
        "1um",
        "--length-unit",
        "um",
        "-p",
        "0.005",
        "--json",
    ]
    told = json.loads(run("sensitivity", *asked))
    pressed = json.loads(run("contact", *asked))
    assert told["answers"]["area"] == pytest.approx(
        pressed["columns"]["area"][0], rel=1e-9
    )
    assert set(told["slopes"]) == {"heights", "lengths", "pressure"}
    lighter = json.loads(run("contact", *asked[:-2], "0.00499", "--json"))["columns"][
        "area"
    ][0]
    by_hand = np.log(pressed["columns"]["area"][0] / lighter) / np.log(0.005 / 0.00499)
    assert told["slopes"]["pressure"]["area"] == pytest.approx(by_hand, abs=0.01)
