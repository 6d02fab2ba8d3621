"""Reflection of ultrasound at a contact, against the waves of two springs' ends."""

import numpy as np
import pytest

from mbma_tables import Bodies, InputError, Joint, OutOfRangeError, Surface, contact
from mbma_tables.effects.ultrasound import impedance, reflection, stiffness_from

STEEL, ALUMINIUM = 4.6e7, 1.72e7


def waves(K, omega, z1, z2):
    """|R| from both conditions at the interface, an incident wave exp(i (k x - omega t)) of amplitude 1.

    Stress is -z du/dt of waves to the right and z du/dt of those to the left; it is the same
    on both sides, and K times the jump of the displacement.
    """
    equations = np.array(
        [
            [-1j * omega * z1, -1j * omega * z2],
            [-K, K - 1j * omega * z2],
        ]
    )
    incident = np.array([-1j * omega * z1, K])
    R, _ = np.linalg.solve(equations, incident)
    return abs(R)


@pytest.mark.parametrize("z", [(STEEL, STEEL), (STEEL, ALUMINIUM), (ALUMINIUM, STEEL)])
@pytest.mark.parametrize("K", [1e12, 3e14, 1e17])
def test_reflection_is_that_of_the_waves(K, z):
    found = reflection(K, "5 MHz", z)
    assert found == pytest.approx(waves(K, 2 * np.pi * 5e6, *z), rel=1e-12)


def test_limits_and_the_way_back():
    assert reflection(1e30, 5e6, (STEEL, ALUMINIUM)) == pytest.approx(
        (STEEL - ALUMINIUM) / (STEEL + ALUMINIUM)
    )
    K = np.geomspace(1e13, 1e16, 7)
    frequency = np.array([[1e6], [2e7]])
    for z in (STEEL, (STEEL, ALUMINIUM)):
        back = stiffness_from(reflection(K, frequency, z), frequency, z)
        np.testing.assert_allclose(back, np.broadcast_to(K, (2, 7)), rtol=1e-9)


def test_speed_of_longitudinal_waves():
    # handbook: 5.9 to 6.0 km/s in steel
    assert impedance(210.0, 0.29, 7850.0) / 7850.0 == pytest.approx(5950, rel=0.01)


def test_of_a_contact_in_any_unit():
    numbers = {"Rq": "0.4 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
    joint = Joint(numbers, bodies="steel 1020 hard", nominal_area="4 cm^2")
    pressed = joint.at_pressure("50 MPa")
    in_pascals = pressed.unloading_stiffness * 1e9 / 1e-6
    expected = reflection(in_pascals, "5 MHz", STEEL)
    assert reflection(pressed, "5 MHz", STEEL) == pytest.approx(expected, rel=1e-12)
    surface = joint.surface.to("mm")
    other = contact(surface, Bodies("113700 MPa", hardness="1440 MPa"), pressure="50 MPa")
    assert reflection(other, "5 MHz", STEEL) == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize(
    "call",
    [
        lambda: reflection(-1.0, 5e6, STEEL),
        lambda: reflection(1e14, "5", STEEL),
        lambda: reflection(1e14, 0.0, STEEL),
        lambda: reflection(1e14, 5e6, (STEEL, STEEL, STEEL)),
        lambda: reflection(np.nan, 5e6, STEEL),
        lambda: stiffness_from(1.0, 5e6, STEEL),
        lambda: stiffness_from(0.4, 5e6, (STEEL, ALUMINIUM)),
        lambda: impedance(210.0, 0.5, 7850.0),
        lambda: reflection(contact(Surface(0.8, 1, 20, 1, 4), pressure=0.1), 5e6, STEEL),
    ],
)
def test_what_is_refused(call):
    with pytest.raises((InputError, OutOfRangeError)):
        call()
