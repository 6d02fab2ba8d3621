"""Conductance through spots and gas: against boundary elements, kinetic theory, tables, and closed values."""

import math

import numpy as np
import pytest

from generate.boundary_elements.solve import load_at
from generate.boundary_elements.surfaces import Recipe, heights
from mbma_tables import InputError, Surface, contact
from mbma_tables.laws.boundary_elements import Contact
from mbma_tables.laws.gas import R, jump_of, mean_inverse
from mbma_tables.totals.conductance import cooper_mikic_yovanovich, mean_conductivity

FACE = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0, unit="um")


@pytest.mark.parametrize("eta", [np.inf, 0.1])
@pytest.mark.parametrize(("hurst", "seed"), [(0.8, 901), (0.4, 902)])
def test_gaps_of_boundary_elements(hurst, seed, eta):
    recipe = Recipe("self_affine", hurst, 6, 4, seed, 128)
    z = heights(recipe)
    slope = np.hypot(*np.gradient(z, 1 / 128)).std()
    solved, jumps = Contact(z / slope, recipe.sizes, hardness=eta), np.array([0.3, 1.0, 3.0])
    for area in (0.01, 0.05, 0.2):
        solved.press(load_at(area, eta))
        gap, open_ = solved.gap * slope, solved.pressure <= 0
        measured = np.array([(open_ / (gap + jump)).mean() for jump in jumps])
        law = mean_inverse(gap.mean(), 1 - open_.mean(), jumps, 1.0, eta)
        assert (np.abs(law / measured - 1) < [0.08, 0.04, 0.02]).all()
        if area < 0.1:  # a gap like the mean one is further off
            assert (np.abs(law / measured - 1)[:2] < np.abs(1 / (gap.mean() + jumps) / measured - 1)[:2]).all()


def test_limits():
    # a wide jump hides the gaps; a plane far away is a plane
    assert mean_inverse(1.0, 0.25, 1e6, 1.0) == pytest.approx(0.75e-6, rel=1e-5)
    assert mean_inverse(1e3, 1e-300, 0.1, 1.0) == pytest.approx(1e-3, rel=5e-3)
    assert mean_inverse(1e-12, 1.0, 1.0, 1.0) == pytest.approx(0.0, abs=1e-9)
    # no jump at first contact
    assert mean_inverse(3.0, 1e-12, 0.1, 1.0) == pytest.approx(mean_inverse(3.0, 0.0, 0.1, 1.0), rel=1e-6)
    # soft bodies: Gaussian heights cut off by a plane, by a sum over them
    z = np.random.default_rng(1).standard_normal(2_000_000)
    gap = np.maximum(1.5 - z, 0)
    found = mean_inverse(gap.mean(), (gap == 0).mean(), 0.2, 1.0, 1e-6)
    assert found == pytest.approx(np.mean((gap > 0) / (gap + 0.2)), rel=2e-3)


@pytest.mark.parametrize(
    ("gas", "mass", "gamma", "share"), [("air", 28.97e-3, 1.4, 0.85), ("helium", 4.0026e-3, 5 / 3, 0.45)]
)
def test_at_low_pressure_molecules_fly_from_face_to_face(gas, mass, gamma, share):
    """Free molecular conduction between parallel plates (Kennard 1938), without conductivity, viscosity and gap."""
    T, P = np.array([250.0, 300.0, 550.0]), 10.0
    k, jump = jump_of(gas, T, P)
    free = share / (2 - share) * (gamma + 1) / (gamma - 1) * np.sqrt(R / (8 * np.pi * mass * T)) * P
    np.testing.assert_allclose(k / jump, free, rtol=1e-12)


def test_conductivities_of_other_tables():
    # helium: NIST SRD 134; air: UW/MHTL 8406, 2.334e-3 T^1.5/(T + 164.54)
    for T, k in ((225.0, 0.1282), (350.0, 0.1732), (450.0, 0.2060)):
        assert jump_of("helium", T, 1e5)[0] == pytest.approx(k, rel=0.01)
    for T in (220.0, 350.0, 450.0, 550.0):
        assert jump_of("air", T, 1e5)[0] == pytest.approx(2.334e-3 * T**1.5 / (T + 164.54), rel=0.02)
    # mean free path of nitrogen at room temperature and 1 atm, 67 nm: CRC Handbook
    assert jump_of("air", 298.15, 101325.0, 1.0)[1] == pytest.approx(67e-9 * 2 * 2.8 / (2.4 * 0.71), rel=0.03)


def test_contacts_have_it_in_watts():
    joint = contact(FACE, pressure=["1 MPa", "10 MPa"], theory="calibrated", materials="steel 1020")
    k, jump = jump_of("air", 300.0, 101325.0)
    eta = 1 / joint.psi
    plain = 1e6 * k * mean_inverse(joint.mean_separation, joint.area, 1e6 * jump, 1.0, eta)
    np.testing.assert_allclose(joint.gap_conductance(), plain, rtol=1e-12)
    np.testing.assert_allclose(joint.gap_conductance(gas_pressure=101325.0), plain, rtol=1e-12)
    assert (joint.gap_conductance("helium") > 2 * plain).all()
    assert (joint.gap_conductance("vacuum") == 0).all()
    in_mm = contact(FACE.to("mm"), pressure=["1 MPa", "10 MPa"], theory="calibrated", materials="steel 1020")
    np.testing.assert_allclose(in_mm.gap_conductance(), plain, rtol=1e-9)
    xr = pytest.importorskip("xarray")
    named = contact(FACE, pressure=xr.DataArray([1e-3, 1e-2], dims="load"), theory="calibrated", materials="steel 1020")
    np.testing.assert_allclose(named.gap_conductance().values, plain, rtol=1e-9)


def test_what_is_refused():
    joint = contact(FACE, pressure="1 MPa", theory="calibrated", E_star="10 GPa")
    for given, message in (
        ({"gas": "argon"}, "no gas is named 'argon'"),
        ({"temperature": 100.0}, "from 200 to 600 K"),
        ({"temperature": np.nan}, "finite"),
        ({"gas_pressure": 0.0}, "positive"),
        ({"gas_pressure": "1 um"}, "unit of stress"),
        ({"accommodation": 1.5}, r"in \(0, 1\]"),
    ):
        with pytest.raises(InputError, match=message):
            joint.gap_conductance(**given)
    unknown = contact(Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0), pressure=1e-4, theory="calibrated")
    with pytest.raises(InputError, match="give the surface its unit"):
        unknown.gap_conductance()


def test_mean_conductivity_is_harmonic():
    # a body that conducts without limit leaves twice the other
    for given, expected in (((50.0, 200.0), 80.0), ((3.0, 3.0), 3.0), ((7.0, 1e300), 14.0), ((1e300, 7.0), 14.0)):
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
    assert (1.45 * area**0.985 * slope / joint.h_rms / plastic).min() == pytest.approx(0.72, abs=0.005)
