"""Slip and conductance: against closed forms, boundary elements, kinetic theory and tables."""

import dataclasses
import math
import pickle

import numpy as np
import pytest
import xarray as xr
from helpers import refusals

from generate.boundary_elements.solve import load_at
from generate.boundary_elements.surfaces import Recipe, heights
from mbma_tables import (
    Bodies,
    InputError,
    OutOfRangeError,
    Surface,
    contact,
    contact_law,
)
from mbma_tables.bodies.bodies import mean_conductivity
from mbma_tables.bodies.materials import tangential_ratio
from mbma_tables.contacts.quantities.conductances import cooper_mikic_yovanovich
from mbma_tables.contacts.quantities.gas import R, jump_of, mean_inverse
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.theories.simulated.boundary_elements import BoundaryElementContact

FACE = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0, unit="um")
RADIUS = 5.0
FRICTION = 0.3
NU = 0.25


class Spheres:
    """One sphere of `RADIUS` on each unit of area, in contact from h_max on."""

    name = "spheres"

    def answer(self, surface, mean_separation):
        depth = np.maximum(np.asarray(surface.h_max) - mean_separation, 0)
        return 4 / 3 * np.sqrt(RADIUS) * depth**1.5, np.pi * RADIUS * depth


def sheared(u=2.5):
    bodies = Bodies(1e3, nu=NU)
    pressed = contact(FACE, bodies, mean_separation=u, theory=Spheres())
    return pressed.tangential(FRICTION)


def test_spheres_are_those_of_cattaneo_mindlin_and_deresiewicz():
    """K. L. Johnson, Contact Mechanics, Eqs. (7.42), (7.44) and (7.57), for two bodies alike."""
    depth = 0.5
    modulus = 1e3
    found = sheared(3.0 - depth)
    a = np.sqrt(RADIUS * depth)
    G = modulus * (1 - NU)  # 1/E* = 2 (1 - nu^2)/E = (1 - nu)/G
    compliance = 2 * (2 - NU) / G
    load = 4 / 3 * modulus * np.sqrt(RADIUS) * depth**1.5
    share = np.array([0.05, 0.3, 0.7, 0.99])
    shear = share * FRICTION * load
    slid = 3 * FRICTION * load / (16 * a) * compliance * (1 - (1 - share) ** (2 / 3))
    np.testing.assert_allclose(found.displacement(shear), slid, rtol=1e-6)
    np.testing.assert_allclose(found.shear(slid), shear, rtol=1e-6)
    assert found.stiffness == pytest.approx(8 * a / compliance, rel=1e-5)
    assert found.gross_slip == pytest.approx(3 * FRICTION * load / (16 * a) * compliance)
    assert found.shear(2 * found.gross_slip) == pytest.approx(FRICTION * load)
    assert found.displacement(FRICTION * load) == pytest.approx(
        found.gross_slip, rel=1e-6
    )
    lost = 9 * (FRICTION * load) ** 2 / (10 * a) * compliance
    lost = lost * (
        1 - (1 - share) ** (5 / 3) - 5 * share / 6 * (1 + (1 - share) ** (2 / 3))
    )
    np.testing.assert_allclose(found.energy_loss(shear)[1:], lost[1:], rtol=1e-5)


@pytest.mark.parametrize("theory", ["calibrated", "mbma"])
def test_laws_answer_as_contacts_do(theory):
    bodies = Bodies("100 GPa", nu=0.3)
    one = contact(FACE, bodies, pressure="10 MPa", theory=theory).tangential(0.2)
    law = contact_law(FACE, bodies, theory=theory)
    two = law.tangential(pressure="10 MPa", friction=0.2)
    assert two.stiffness == pytest.approx(one.stiffness, rel=1e-5)
    assert law.tangential(one.mean_separation).stiffness == pytest.approx(
        one.stiffness, rel=1e-5
    )
    for slid in ("10 nm", ["0.05 um", "0.1 um"]):
        np.testing.assert_allclose(two.shear(slid), one.shear(slid), rtol=1e-4)
    np.testing.assert_allclose(
        two.energy_loss("1 MPa"), one.energy_loss("1 MPa"), rtol=1e-4
    )
    assert one.shear(1e-5) / 1e-5 == pytest.approx(one.stiffness, rel=1e-3)
    # a cycle loses less than one that slips freely, and more than none
    assert 0 < one.energy_loss("1 MPa") < 4e-3 * one.displacement("1 MPa")


@pytest.mark.parametrize("of_law", [False, True])
def test_a_sheared_contact_is_the_same_after_pickling(of_law):
    bodies = Bodies("100 GPa", nu=0.3)
    if of_law:
        law = contact_law(FACE, bodies, theory="calibrated")
        sheared = law.tangential(pressure="10 MPa", friction=0.2)
    else:
        pressed = contact(FACE, bodies, pressure="10 MPa", theory="calibrated")
        sheared = pressed.tangential(0.2)
    copy = pickle.loads(pickle.dumps(sheared))
    assert copy.gross_slip == sheared.gross_slip
    for ask, value in (
        ("shear", "50 nm"),
        ("displacement", "1 MPa"),
        ("energy_loss", "1 MPa"),
    ):
        assert getattr(copy, ask)(value) == getattr(sheared, ask)(value)


@pytest.mark.parametrize("theory", ["calibrated", "mbma", "persson"])
def test_with_a_hardness_slip_is_that_of_unloading(theory):
    bodies = Bodies("100 GPa", hardness="1.5 GPa", nu=0.3)
    joint = contact(FACE, bodies, pressure=["1 MPa", "10 MPa"], theory=theory)
    law = pickle.loads(pickle.dumps(contact_law(FACE, bodies, theory=theory)))
    np.testing.assert_allclose(
        law.unloading_stiffness(joint.mean_separation),
        joint.unloading_stiffness,
        rtol=1e-5,
    )
    assert (joint.unloading_stiffness > 1.1 * joint.stiffness).all()
    without_poisson = dataclasses.replace(bodies, nu=0.0)
    alike = contact(FACE, without_poisson, pressure=["1 MPa", "10 MPa"], theory=theory)
    np.testing.assert_allclose(
        alike.tangential().stiffness, joint.unloading_stiffness, rtol=1e-15
    )
    np.testing.assert_allclose(
        law.tangential(joint.mean_separation).stiffness,
        joint.tangential().stiffness,
        rtol=1e-5,
    )
    for slips in (
        joint.tangential(0.2),
        law.tangential(pressure="1 MPa", friction=0.2),
    ):
        # of small shear that of full stick, and half of what slips everywhere
        small = 1e-5 * slips.pressure / slips.stiffness
        np.testing.assert_allclose(slips.shear(small), slips.stiffness * small, rtol=1e-3)
        half = 0.1 * slips.pressure
        np.testing.assert_allclose(slips.shear(slips.displacement(half)), half, rtol=1e-6)
        assert (np.asarray(slips.energy_loss(half)) > 0).all()
    elastic = contact_law(FACE, "100 GPa", theory=theory)
    assert elastic.unloading_stiffness(2.0) == elastic.stiffness(2.0)


def test_two_bodies_add_their_compliances():
    # against a rigid one only the other counts
    assert tangential_ratio((0.3, 0.1), (1.0, 1e12)) == pytest.approx(
        tangential_ratio(0.3)
    )
    assert tangential_ratio((0.3, 0.3), ("210 GPa", "7e4 MPa")) == pytest.approx(
        1.7 / 1.4
    )
    # Mindlin's 4 (1 - nu)/(2 - nu) of half-spaces over the 2 of normal contact
    assert tangential_ratio(0.5) == pytest.approx(1.5)
    named = contact(
        FACE,
        ("steel 4140 hard", "aluminium 6061 hard"),
        pressure="10 MPa",
        theory="calibrated",
    )
    known = named.tangential()
    assert known.ratio == pytest.approx(tangential_ratio((0.29, 0.33), (205.0, 69.0)))
    assert known.stiffness == pytest.approx(named.unloading_stiffness / known.ratio)
    share = lambda nu: 0.2 + 0.1 * nu  # noqa: E731
    assert tangential_ratio((0.3, 0.3), (210.0, 70.0), share) == pytest.approx(
        tangential_ratio(0.3, share=share)
    )
    two = {"nu": (0.3, 0.3)}
    for wrong in (
        two,
        two | {"E": (1.0, -1.0)},
        {"nu": 0.6},
        {"nu": 0.3, "E": (1.0, 1.0)},
        {},
    ):
        with pytest.raises(InputError):
            contact(FACE, Bodies("100 GPa", **wrong), pressure="10 MPa").tangential()


def test_what_is_refused():
    bodies = Bodies(nu=NU)
    found = sheared()
    apart = contact(FACE, bodies, mean_separation=2.5, theory=Spheres())
    law = contact_law(FACE, bodies, theory="calibrated")
    cases = [
        (ask, (-0.1,), "at least 0")
        for ask in (found.shear, found.displacement, found.energy_loss)
    ]
    cases += [(apart.tangential, (mu,), "friction") for mu in (0.0, -1.0, np.nan)]
    cases += [(found.displacement, (1e9,), "at most the friction times the pressure")]
    cases += [
        (found.shear, ("1 MPa",), "pressure= takes"),
        (law.tangential, (), "give exactly one of"),
    ]
    for ask, given, match in cases:
        with pytest.raises(
            OutOfRangeError if match.startswith("at ") else InputError, match=match
        ):
            ask(*given)
    with pytest.raises(InputError, match="slip needs friction"):
        _ = apart.tangential().gross_slip
    with pytest.raises(InputError, match="give exactly one of"):
        law.tangential(mean_separation=2.0, pressure=1e-3)


def test_batches_and_data_arrays():
    u = np.array([1.5, 2.0, 2.5])
    bodies = Bodies(nu=0.3)
    plain = contact(FACE, bodies, mean_separation=u, theory="calibrated").tangential(0.3)
    batch = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=[3.0, 3.5, 4.0])
    many = contact(batch, bodies, mean_separation=u, theory="calibrated").tangential(0.3)
    assert many.shear(0.1).shape == (3,)
    assert many.shear(0.1)[0] == pytest.approx(plain.shear(0.1)[0], rel=1e-9)
    named = contact(
        FACE, bodies, mean_separation=xr.DataArray(u, dims="gap"), theory="calibrated"
    ).tangential(0.3)
    np.testing.assert_allclose(named.shear(0.1).values, plain.shear(0.1), rtol=1e-12)
    assert named.stiffness.dims == ("gap",)


# kappa k_t/k_n along and across a lay of 4:1 at nu = 0.3, by boundary elements of another
# code, at three contacts
LAY_OF_FOUR = {0.03: (0.93, 1.09), 0.12: (0.914, 1.118), 0.4: (0.893, 1.157)}


def test_a_lay_is_stiffer_across():
    q = np.geomspace(0.1, 3.0, 50)
    plain = MeasuredSurface(q, q**-3.6, h_max=8.0)
    stretched = dataclasses.replace(plain, anisotropy=4.0)
    bodies = Bodies(nu=0.3)
    for area, expected in LAY_OF_FOUR.items():
        isotropic = contact(plain, bodies, area=area).tangential().stiffness
        found = contact(stretched, bodies, area=area)
        for way, ratio in zip(("along", "across"), expected, strict=True):
            stiffness = found.tangential(direction=way).stiffness
            assert stiffness / isotropic == pytest.approx(ratio, abs=0.02)
    with pytest.raises(InputError, match="direction"):
        found.tangential()
    with pytest.raises(InputError, match="anisotropy"):
        contact(plain, bodies, area=0.1).tangential(direction="along")
    with pytest.raises(InputError, match="slip"):
        found.tangential(0.2, direction="along").shear(1e-9)
    with pytest.raises(OutOfRangeError, match="area"):
        contact(stretched, bodies, area=0.001).tangential(direction="along")


@pytest.mark.parametrize("eta", [np.inf, 0.1])
@pytest.mark.parametrize(("hurst", "seed"), [(0.8, 901), (0.4, 902)])
def test_gaps_of_boundary_elements(hurst, seed, eta):
    recipe = Recipe("self_affine", hurst, 6, 4, seed, 128)
    z = heights(recipe)
    slope = np.hypot(*np.gradient(z, 1 / 128)).std()
    solved = BoundaryElementContact(z / slope, recipe.sizes, hardness=eta)
    jumps = np.array([0.3, 1.0, 3.0])
    for area in (0.01, 0.05, 0.2):
        solved.press(load_at(area, eta))
        gap = solved.gap * slope
        open_ = solved.pressure <= 0
        measured = np.array([(open_ / (gap + jump)).mean() for jump in jumps])
        law = mean_inverse(gap.mean(), 1 - open_.mean(), jumps, 1.0, eta)
        assert (np.abs(law / measured - 1) < [0.08, 0.04, 0.02]).all()
        if area < 0.1:  # a gap like the mean one is further off
            assert (
                np.abs(law / measured - 1)[:2]
                < np.abs(1 / (gap.mean() + jumps) / measured - 1)[:2]
            ).all()


def test_limits():
    # a wide jump hides the gaps; a plane far away is a plane
    assert mean_inverse(1.0, 0.25, 1e6, 1.0) == pytest.approx(0.75e-6, rel=1e-5)
    assert mean_inverse(1e3, 1e-300, 0.1, 1.0) == pytest.approx(1e-3, rel=5e-3)
    assert mean_inverse(1e-12, 1.0, 1.0, 1.0) == pytest.approx(0.0, abs=1e-9)
    # no jump at first contact
    assert mean_inverse(3.0, 1e-12, 0.1, 1.0) == pytest.approx(
        mean_inverse(3.0, 0.0, 0.1, 1.0), rel=1e-6
    )
    # soft bodies: Gaussian heights cut off by a plane, by a sum over them
    z = np.random.default_rng(1).standard_normal(2_000_000)
    gap = np.maximum(1.5 - z, 0)
    found = mean_inverse(gap.mean(), (gap == 0).mean(), 0.2, 1.0, 1e-6)
    assert found == pytest.approx(np.mean((gap > 0) / (gap + 0.2)), rel=2e-3)


@pytest.mark.parametrize(
    ("gas", "mass", "gamma", "share"),
    [("air", 28.97e-3, 1.4, 0.85), ("helium", 4.0026e-3, 5 / 3, 0.45)],
)
def test_at_low_pressure_molecules_fly_from_face_to_face(gas, mass, gamma, share):
    """Free molecular conduction between parallel plates (Kennard 1938), without conductivity, viscosity and gap."""
    T = np.array([250.0, 300.0, 550.0])
    P = 10.0
    k, jump = jump_of(gas, T, P)
    free = (
        share
        / (2 - share)
        * (gamma + 1)
        / (gamma - 1)
        * np.sqrt(R / (8 * np.pi * mass * T))
        * P
    )
    np.testing.assert_allclose(k / jump, free, rtol=1e-12)


def test_conductivities_of_other_tables():
    # helium: NIST SRD 134; air: UW/MHTL 8406, 2.334e-3 T^1.5/(T + 164.54)
    for T, k in ((225.0, 0.1282), (350.0, 0.1732), (450.0, 0.2060)):
        assert jump_of("helium", T, 1e5)[0] == pytest.approx(k, rel=0.01)
    for T in (220.0, 350.0, 450.0, 550.0):
        assert jump_of("air", T, 1e5)[0] == pytest.approx(
            2.334e-3 * T**1.5 / (T + 164.54), rel=0.02
        )
    # mean free path of nitrogen at room temperature and 1 atm, 67 nm: CRC Handbook
    assert jump_of("air", 298.15, 101325.0, 1.0)[1] == pytest.approx(
        67e-9 * 2 * 2.8 / (2.4 * 0.71), rel=0.03
    )


def test_contacts_have_it_in_watts():
    joint = contact(FACE, "steel 1020", pressure=["1 MPa", "10 MPa"], theory="calibrated")
    k, jump = jump_of("air", 300.0, 101325.0)
    eta = 1 / joint.psi
    plain = (
        1e6 * k * mean_inverse(joint.mean_separation, joint.area, 1e6 * jump, 1.0, eta)
    )
    np.testing.assert_allclose(joint.gap_conductance(), plain, rtol=1e-12)
    np.testing.assert_allclose(
        joint.gap_conductance(gas_pressure=101325.0), plain, rtol=1e-12
    )
    assert (joint.gap_conductance("helium") > 2 * plain).all()
    assert (joint.gap_conductance("vacuum") == 0).all()
    in_mm = contact(
        FACE.to("mm"), "steel 1020", pressure=["1 MPa", "10 MPa"], theory="calibrated"
    )
    np.testing.assert_allclose(in_mm.gap_conductance(), plain, rtol=1e-9)
    named = contact(
        FACE,
        "steel 1020",
        pressure=xr.DataArray([1e-3, 1e-2], dims="load"),
        theory="calibrated",
    )
    np.testing.assert_allclose(named.gap_conductance().values, plain, rtol=1e-9)


test_gases_that_are_refused = refusals(
    lambda face, given: contact(
        face, "10 GPa", area=0.01, theory="calibrated"
    ).gap_conductance(**given),
    (FACE, {"gas": "xenon"}, "no gas is named 'xenon'"),
    (FACE, {"gas": "hydrogen"}, "hydrogen has no conductance .* accommodation"),
    (FACE, {"temperature": 100.0}, "from 200 to 600 K"),
    (FACE, {"temperature": np.nan}, "finite"),
    (FACE, {"gas_pressure": 0.0}, "positive"),
    (FACE, {"gas_pressure": "1 um"}, "unit of stress"),
    (FACE, {"accommodation": 1.5}, r"in \(0, 1\]"),
    (Surface(0.8, 0.01, 2.0, 1.0, 3.0), {}, "give the surface its unit"),
)


def test_mean_conductivity_is_harmonic():
    # a body that conducts without limit leaves twice the other
    for given, expected in (
        ((50.0, 200.0), 80.0),
        ((3.0, 3.0), 3.0),
        ((7.0, 1e300), 14.0),
        ((1e300, 7.0), 14.0),
    ):
        found = mean_conductivity(*given)
        assert found == pytest.approx(expected, rel=1e-15, abs=0)
        assert np.shape(found) == ()
    found = mean_conductivity([[1.0], [2.0]], [1.0, 4.0, 6.0])
    np.testing.assert_allclose(found, [[1, 1.6, 12 / 7], [4 / 3, 8 / 3, 3]], rtol=1e-15)


def test_the_correlation_follows_the_model_it_was_fitted_to():
    # Gaussian heights cut at a multiple of sigma: spots of the truncated area
    cut = np.linspace(2, 4.75, 200)
    area = np.array([math.erfc(c / math.sqrt(2)) / 2 for c in cut])
    spots = np.exp(-(cut**2) / 2) / (2 * math.sqrt(2 * math.pi))
    joint = Surface(hurst=0.8, q0=6e3, q1=6e5, h_rms=1e-6, h_max=3.5e-6)
    slope = math.sqrt(2 * joint.m2 / math.pi)
    plastic = slope / joint.h_rms * spots / (1 - np.sqrt(area)) ** 1.5
    found = cooper_mikic_yovanovich(joint, area * 1e9, 1.0, 1e11, 1e9)
    np.testing.assert_allclose(found, plastic, rtol=0.016)
    # the older power law leaves the model at small pressures
    assert (1.45 * area**0.985 * slope / joint.h_rms / plastic).min() == pytest.approx(
        0.72, abs=0.005
    )


@pytest.mark.parametrize("method", ["shear", "displacement", "energy_loss"])
@pytest.mark.parametrize(
    "odd",
    [{}, [], 1j, b"x", None, True, "abc", "1 furlong", [[1.0], [1.0, 2.0]], np.inf, np.nan, np.ma.masked_all(2)],
    ids=str,
)  # fmt: skip
def test_odd_displacements_and_shears_are_refused_by_name(method, odd):
    sheared = contact(FACE, Bodies("100 GPa", nu=0.3), area=0.01).tangential(friction=0.2)
    with pytest.raises(InputError, match=r"displacement|shear|no known unit"):
        getattr(sheared, method)(odd)
