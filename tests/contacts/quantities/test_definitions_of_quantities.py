"""Formulas of quantities against the definitions that they are solutions or fits of, where a wrong sign or power would show."""

import itertools

import numpy as np
import pytest
from scipy.integrate import quad

from mbma_tables.contacts.quantities.effective_medium import FlowConstants
from mbma_tables.contacts.quantities.gas import TEMPERATURES
from mbma_tables.contacts.quantities.gas_flow import (
    FLOWING,
    PIECES,
    flow_over_liquid,
    gas_for_flow,
    mass_flow,
    width_of_channels,
)
from mbma_tables.contacts.quantities.lay import anisotropic_medium, stress_shares
from mbma_tables.contacts.quantities.leakage import along


@pytest.mark.parametrize("ends", [(101325.0, 0.0), (3e5, 1e5), (50.0, 1.0)])
def test_mass_flow_is_the_integral_of_the_local_flow_over_the_pressure(ends):
    K, area, width = 3e-19, 0.1, 2e-3  # m^3, channels of a micrometre; m
    gas = gas_for_flow("helium", 300.0)
    h = float(width_of_channels(K, area))
    viscosity, T = float(gas.viscosity), 300.0
    R_s = 8.314462618 / float(np.asarray(gas.mass))

    def local(p):
        # inverse Knudsen number of plates: h over the mean free path, up to sqrt(pi)/2
        D = p * h / (viscosity * np.sqrt(2 * R_s * T))
        return K * float(flow_over_liquid(D)) * p / (12 * viscosity * R_s * T * width)

    inlet, outlet = ends
    # pieces of the flow between plates meet within 1e-3
    unit = viscosity * np.sqrt(2 * R_s * T) / h
    inner = [low * unit for low, _ in PIECES if outlet < low * unit < inlet]
    places = sorted([outlet, inlet, *inner])
    expected = sum(
        quad(local, a, b, epsabs=0, epsrel=1e-10, limit=400)[0]
        for a, b in itertools.pairwise(places)
    )
    found = mass_flow(K, area, gas, inlet, outlet, width)
    assert found == pytest.approx(expected, rel=1e-9, abs=0)


@pytest.mark.parametrize("gas", FLOWING)
def test_viscosities_rise_like_a_power_of_the_temperature(gas):
    """By kinetic theory between that of hard spheres, 1/2, and that of soft molecules, 1."""
    _, viscosity = FLOWING[gas]
    power = np.diff(np.log(viscosity)) / np.diff(np.log(TEMPERATURES))
    assert (power > 0.5).all()
    assert (power < 1.02).all()


@pytest.mark.parametrize("angle", [0.0, 30.0, 90.0, 135.0, 200.0])
def test_flow_in_a_direction_is_that_of_the_tensor(angle):
    tensor = np.array([[3.0, 0.7], [0.7, 1.5]])
    n = np.array([np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))])
    found = along(angle, tensor[0, 0], tensor[1, 1], tensor[0, 1])
    assert found == pytest.approx(n @ tensor @ n, rel=1e-12)


def test_an_effective_medium_of_wider_gaps_conducts_like_their_cube():
    draws = np.random.default_rng(3)
    share = draws.random((4, 30))
    share /= 1.1 * share.sum(axis=1, keepdims=True)
    gap = draws.random((4, 30)) + 0.1
    blocked, lay = np.full(4, 0.05), np.array([0.25, 1.0, 2.0, 4.0])
    k, carried = anisotropic_medium(share, gap, blocked, lay)
    wide, further = anisotropic_medium(share, 2.5 * gap, blocked, lay)
    np.testing.assert_allclose(wide, 2.5**3 * k, rtol=1e-9)
    np.testing.assert_allclose(further, 2.5 * carried, rtol=1e-9)
    # a medium without a lay is the same along both axes, and gaps of one width are themselves
    assert k[0, 1] == pytest.approx(k[1, 1], rel=1e-9)
    one = np.full((4, 30), 1 / 30)
    same, _ = anisotropic_medium(one, np.full((4, 30), 0.7), np.zeros(4), lay)
    np.testing.assert_allclose(same, 0.7**3, rtol=1e-9)
    # what blocks the flow makes it smaller
    more, _ = anisotropic_medium(share, gap, 2 * blocked, lay)
    assert (more < k).all()


def test_shares_of_stress():
    # without Poisson's ratio the stress that varies is shared by the two directions
    first, second = stress_shares(3.0, 0.1, 0.0)
    assert first + second == pytest.approx(1.0, rel=1e-12)
    # the excess is as Poisson's ratio over 2 - nu, the ratio of the two stiffnesses of a circle
    excess = [sum(stress_shares(3.0, 0.1, nu)) - 1 for nu in (0.25, 0.5)]
    assert excess[1] / excess[0] == pytest.approx((0.5 / 1.5) / (0.25 / 1.75), rel=1e-9)
    # turning the lay exchanges the directions; without one they are alike
    same = stress_shares(1.0, 0.1, 0.3)
    assert same[0] == pytest.approx(same[1], rel=1e-12)


def test_the_closed_form_of_flow_ends_at_the_threshold():
    flow = FlowConstants()
    areas = np.array([0.0, 0.1, 0.3])
    k = flow.closed_form(1.3, areas)
    open_share = 1 - areas / flow.threshold
    np.testing.assert_allclose(k / k[0], open_share**flow.exponent, rtol=1e-12)
    np.testing.assert_allclose(flow.closed_form(2.6, areas), 8 * k, rtol=1e-12)
    assert flow.closed_form(1.3, flow.threshold) == 0
    assert (np.diff(k) < 0).all()
