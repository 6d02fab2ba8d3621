"""Derivatives by every number that was typed: against Richardson's extrapolation of contacts described anew."""

import dataclasses

import mpmath
import numpy as np
import pytest
from helpers import difference_weights

from mbma_tables import Bodies, Gas, Joint, Surface, contact, sensitivity
from mbma_tables.bodies.materials import Metal
from mbma_tables.theories import THEORIES

OFFSETS = np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0])
WEIGHTS = difference_weights(OFFSETS)
STEP = 4e-4  # of a number: differences of eight points have errors of its eighth power
ERROR = 1e-6  # of a slope, over itself or 1
FIVE = {"hurst": 0.72, "q0": 0.06, "q1": 11.0, "h_rms": 0.5, "h_max": 1.75}
DRAWN = {"hurst": 0.8, "Ra": 0.4, "Rdq": 0.12, "longest": 100.0, "nominal_area": 2e5}
ALONE = {"E_star": 110.0, "nu": 0.29, "conductivity": 45.0}
PAIR = {
    "part_a.E": 205.0, "part_b.E": 69.0, "part_a.nu": 0.29, "part_b.nu": 0.33,
    "part_a.conductivity": 42.7, "part_b.conductivity": 160.0,
}  # fmt: skip


def bodies_of(numbers):
    """Bodies as one types them."""
    hardness = numbers.get("hardness")
    if "E_star" in numbers:
        return Bodies(
            f"{numbers['E_star']!r} GPa",
            nu=numbers["nu"],
            conductivity=f"{numbers['conductivity']!r} W/(m K)",
            hardness=hardness,
        )
    a, b = (
        {name: numbers[f"part_{end}.{name}"] for name in ("E", "nu", "conductivity")}
        for end in "ab"
    )
    return Bodies(
        E=(f"{a['E']!r} GPa", f"{b['E']!r} GPa"),
        nu=(a["nu"], b["nu"]),
        conductivity=tuple(f"{each['conductivity']!r} W/(m K)" for each in (a, b)),
        hardness=hardness,
    )


def surface_of(numbers, names):
    """A surface as one types it."""
    own = {name: numbers[name] for name in names}
    if "Ra" in names:
        return Surface.from_roughness(**own, unit="um")
    return Surface(**own, unit="um")


BATCHED = tuple(
    f"part_{end}.{name}"
    for end in "ab"
    for name in ("hurst", "Ra", "longest", "shortest")
)


def differences(ask, numbers, name, answers):
    """Relative slopes of answers by a number, of contacts that are described anew."""
    moved = [float(numbers[name] * (1 + STEP * offset)) for offset in OFFSETS]
    if name.endswith(BATCHED):
        # spectra of two faces of a batch are added as they are, those of one joint in samples
        pressed = ask(numbers | {name: moved})
        columns = [np.broadcast_to(pressed.quantity(answer), 8) for answer in answers]
        values = np.transpose(columns)
    else:
        values = []
        for number in moved:
            pressed = ask(numbers | {name: number})
            values.append([float(pressed.quantity(answer)) for answer in answers])
    here = ask(numbers)
    size = np.array([float(here.quantity(answer)) for answer in answers])
    return WEIGHTS @ np.array(values) / STEP / size


def assert_slopes(found, ask, numbers):
    """Rows for all numbers, each with the slopes of contacts described anew."""
    assert set(found.parameters) == set(numbers)
    answers = list(found.answers)
    for name in numbers:
        expected = differences(ask, numbers, name, answers)
        slopes = np.array([found.slopes[name][answer] for answer in answers])
        apart = np.abs(slopes - expected) / np.maximum(1, np.abs(expected))
        assert (apart <= ERROR).all(), (name, dict(zip(answers, apart, strict=True)))
        plain = [found.derivatives[name][answer] for answer in answers]
        values = np.array(list(found.answers.values()))
        np.testing.assert_allclose(
            np.array(plain) * numbers[name] / values, slopes, rtol=1e-12, atol=1e-13
        )
        assert found.sides[name] == 0


AT = {"pressure": 0.03, "mean_separation": 1.1, "separation": 0.6, "area": 0.02}
CASES = [
    (theory, by, {}, PAIR if by == "pressure" else ALONE)
    for theory in THEORIES
    for by in AT
]
CASES += [
    (theory, by, {"hardness": 1.5}, ALONE if by == "pressure" else PAIR)
    for theory in THEORIES
    for by in ("pressure", "mean_separation")
]
SLOW = [
    pytest.param(*case, marks=pytest.mark.slow if case[0] == "persson" or case[2] else ())
    for case in CASES
]


@pytest.mark.parametrize(("theory", "by", "yielding", "constants"), SLOW)
def test_every_number_of_a_surface_and_its_bodies(theory, by, yielding, constants):
    numbers = FIVE | constants | yielding | {by: AT[by]}

    def ask(moved):
        surface = surface_of(moved, FIVE)
        return contact(surface, bodies_of(moved), theory=theory, **{by: moved[by]})

    surface = surface_of(numbers, FIVE)
    found = sensitivity(surface, bodies_of(numbers), theory=theory, **{by: AT[by]})
    assert_slopes(found, ask, numbers)


@pytest.mark.parametrize("yielding", [{}, {"hardness": 1.5}], ids=str)
def test_every_number_of_a_drawing(yielding):
    numbers = DRAWN | ALONE | yielding | {"pressure": 0.03}

    def ask(moved):
        surface = surface_of(moved, DRAWN)
        given = {"pressure": moved["pressure"], "theory": "calibrated"}
        return contact(surface, bodies_of(moved), **given)

    surface = surface_of(numbers, DRAWN)
    given = {"pressure": 0.03, "theory": "calibrated"}
    assert_slopes(sensitivity(surface, bodies_of(numbers), **given), ask, numbers)


def in_um(numbers):
    """A text with its unit, or a list of these."""
    if isinstance(numbers, list):
        return [in_um(number) for number in numbers]
    return f"{numbers!r} um"


def joint_of(numbers):
    """A joint as one types it."""
    faces = [
        {
            "hurst": numbers[f"part_{end}.hurst"],
            **{
                name: in_um(numbers[f"part_{end}.{name}"])
                for name in ("Ra", "longest", "shortest")
            },
        }
        for end in "ab"
    ]
    metals = []
    conductivities = []
    for end in "ab":
        E, nu = (numbers[f"part_{end}.{name}"] for name in ("E", "nu"))
        metals.append(Metal(f"metal {end}", E, nu, (0.95, 0.95), (50.0, 50.0)))
        conductivities.append(f"{numbers[f'part_{end}.conductivity']!r} W/(m K)")
    return Joint(
        *faces,
        bodies=Bodies(
            metals=metals,
            hardness=f"{numbers['hardness']!r} GPa",
            conductivity=tuple(conductivities),
        ),
        nominal_area=f"{numbers['nominal_area']!r} um^2",
        gas=Gas(
            "helium",
            numbers["temperature"],
            numbers["gas_pressure"],
            numbers["accommodation"],
        ),
        theory="calibrated",
    )


JOINT = {
    "part_a.hurst": 0.8, "part_a.Ra": 0.4, "part_a.longest": 500.0, "part_a.shortest": 8.0,
    "part_b.hurst": 0.7, "part_b.Ra": 0.6, "part_b.longest": 800.0, "part_b.shortest": 10.0,
    "nominal_area": 4e8, **PAIR, "hardness": 0.95,
    "temperature": 350.0, "gas_pressure": 9e4, "accommodation": 0.5,
    "pressure": 0.02,
}  # fmt: skip


@pytest.mark.slow
def test_every_number_of_a_joint():
    found = joint_of(JOINT).sensitivity("20 MPa")
    assert_slopes(
        found, lambda moved: joint_of(moved).at_pressure(moved["pressure"]), JOINT
    )
    assert {"total_conductance", "gas_conductance", "tangential_stiffness"} <= set(
        found.answers
    )
    assert found.unit("part_a.conductivity") == "W/(m K)"


def test_area_of_persson_has_the_derivatives_of_its_closed_form():
    """A/A0 = erf(sqrt(2) p/(E* g)), with g the rms gradient, differentiated by mpmath."""
    surface = surface_of(FIVE, FIVE)
    found = sensitivity(surface, "110 GPa", pressure="0.9 GPa", theory="persson")

    def area(hurst, q0, q1, h_rms, E_star, pressure):
        ratio = q1 / q0
        m0 = (1 - ratio ** (-2 * hurst)) / (2 * hurst)
        m2 = (ratio ** (2 - 2 * hurst) - 1) / (2 - 2 * hurst)
        gradient = h_rms * q0 * mpmath.sqrt(m2 / m0)
        return mpmath.erf(mpmath.sqrt(2) * pressure / (E_star * gradient))

    numbers = {name: FIVE[name] for name in ("hurst", "q0", "q1", "h_rms")}
    numbers |= {"E_star": 110.0, "pressure": 0.9}
    point = tuple(map(mpmath.mpf, numbers.values()))
    assert found.answers["area"] == pytest.approx(float(area(*point)), rel=1e-12)
    for k, name in enumerate(numbers):
        order = [int(k == other) for other in range(len(point))]
        exact = float(mpmath.diff(area, point, tuple(order)))
        assert found.derivatives[name]["area"] == pytest.approx(exact, rel=1e-8)


@pytest.mark.parametrize("bodies", ["100 GPa", Bodies("100 GPa", hardness="1.5 GPa")])
@pytest.mark.parametrize("theory", ["calibrated", "greenwood_williamson"])
def test_a_batch_has_the_derivatives_of_its_entries(theory, bodies):
    hurst = np.array([0.6, 0.7, 0.8, 1.0])
    surfaces = Surface(hurst, 0.06, 11.0, 0.5, [1.7, 1.75, 1.8, 1.8], unit="um")
    pressures = [["10 MPa"], ["20 MPa"]]
    given = {"theory": theory}
    found = sensitivity(surfaces, bodies, pressure=pressures, **given)
    assert found.shape == (2, 4)
    values, jacobian = found.values_and_jacobian()
    assert values.shape == (2, 4, len(found.answers))
    assert jacobian.shape == (*values.shape, len(found.parameters))
    for k in range(4):
        alone = Surface(
            *(getattr(surfaces, name)[k] for name in surfaces.parameters), unit="um"
        )
        for row, [pressure] in enumerate(pressures):
            one = sensitivity(alone, bodies, pressure=pressure, **given)
            one_values, one_jacobian = one.values_and_jacobian()
            np.testing.assert_allclose(values[row, k], one_values, rtol=1e-12)
            apart = np.abs(jacobian[row, k] - one_jacobian)
            size = np.abs(one_values)[:, None] / np.abs(list(one.parameters.values()))
            assert (apart <= 1e-7 * np.maximum(size, np.abs(one_jacobian))).all()
            assert one.sides["hurst"] == found.sides["hurst"][row, k] == -(k == 3)


def test_at_the_largest_hurst_exponent_derivatives_are_one_sided():
    surface = surface_of(FIVE | {"hurst": 1.0}, FIVE)
    given = {"pressure": 0.03, "theory": "calibrated"}
    found = sensitivity(surface, "110 GPa", **given)
    assert found.sides["hurst"] == -1
    assert "hurst: one-sided, for decreasing hurst" in str(found)
    steps = np.arange(6.0) * 5e-4
    areas = [
        float(
            contact(dataclasses.replace(surface, hurst=1 - step), "110 GPa", **given).area
        )
        for step in steps
    ]
    by_hand = difference_weights(-steps) @ areas
    assert found.derivatives["hurst"]["area"] == pytest.approx(by_hand, rel=1e-6)


def test_where_contact_begins():
    """Nothing varies beyond first contact; at it, and beside it, slopes are those in contact."""
    surface = surface_of(FIVE, FIVE)
    gaps = [1.75, 1.75 * (1 - 3e-5), 1.7501, 2.5]
    found = sensitivity(surface, "110 GPa", mean_separation=gaps, theory="mbma")
    by_gap = found.derivatives["mean_separation"]
    pressed = contact(surface, "110 GPa", mean_separation=gaps, theory="mbma")
    for values in by_gap.values():
        assert (values[2:] == 0).all()
    assert by_gap["pressure"][1] == pytest.approx(-pressed.stiffness[1], rel=1e-6)
    assert np.isnan(found.slopes["h_max"]["area"][2:]).all()
    apart = sensitivity(surface, "110 GPa", separation="2 um", theory="mbma")
    assert "zero, which has no logarithm: pressure, area" in str(apart)


@pytest.mark.slow
def test_random_quantities_by_random_numbers():
    """`python -m benchmarks.derivative_errors` has 500 of them, in docs/lookup.md."""
    from benchmarks.derivative_errors import outcomes

    made = outcomes(60, seed=7)
    smooth = [one for one in made if one.smooth]
    assert len(smooth) >= 50
    assert [one for one in smooth if not one.error <= ERROR] == []


@pytest.mark.parametrize(
    ("theory", "apart"), [("persson", 1e-9), ("calibrated", 3e-7), ("mbma", 2e-9)]
)
def test_faces_alike_are_the_limit_of_two_bands(theory, apart):
    """One self-affine surface, by a table, and a sum of spectra that differ by less than this."""
    band = {"hurst": 0.6, "shortest": 8.0, "unit": "um"}
    longest = 700.0 * (1 + np.array([-1e-10, 0.0, 1e-10]))
    pressed = Joint(
        band | {"Ra": 0.5, "longest": 700.0},
        band | {"Ra": 1.3, "longest": longest},
        bodies=("steel 4140 hard", "aluminium 6061 hard"),
        nominal_area=4e8,
        theory=theory,
    ).at_pressure("10 MPa")
    for name in ("area", "mean_separation", "stiffness", "energy"):
        values = pressed.quantity(name)
        np.testing.assert_allclose(values, values[1], rtol=apart)
    aperture = pressed.hydraulic_aperture
    np.testing.assert_allclose(aperture, aperture[1], rtol=4e-6)


def test_kinks_of_faces_alike_are_of_a_named_side():
    """A face whose longest wavelength leaves that of the other has another slope on each side."""
    band = {"hurst": 0.6, "longest": 700.0, "shortest": 8.0, "unit": "um"}

    def joint(longest):
        return Joint(
            band | {"Ra": np.full(np.shape(longest), 0.5)},
            band | {"Ra": 1.3, "longest": longest},
            bodies=("steel 4140 hard", "aluminium 6061 hard"),
            nominal_area=4e8,
            theory="persson",
        )

    found = joint(np.array([700.0])).sensitivity("10 MPa", ["hydraulic_aperture"])
    side = int(found.sides["part_b.longest"][0])
    slopes = {}
    for sign in (-1, 1):
        # the value at the kink, of faces alike, is that of a table, 3e-6 from the limits
        steps = np.array([1e-6, 2e-6])
        apertures = joint(700.0 * (1 + sign * steps)).at_pressure("10 MPa")
        near, far = np.log(apertures.hydraulic_aperture)
        slopes[sign] = sign * (far - near) / 1e-6
    assert slopes[-1] > 0 > slopes[1]
    slope = float(found.slopes["part_b.longest"]["hydraulic_aperture"][0])
    assert slope == pytest.approx(slopes[side], rel=1e-2)

    # over 1% neither side has this kink, which is one of the sum over bands of wavelengths
    ends = joint(700.0 * np.exp([0.0, side * 0.01])).at_pressure("10 MPa")
    here, there = np.log(ends.hydraulic_aperture)
    over_bands = side * (there - here) / 0.01
    error = float(found.errors["part_b.longest"]["hydraulic_aperture"][0])
    assert error >= abs(slope - over_bands) / 3 >= 1e-3
