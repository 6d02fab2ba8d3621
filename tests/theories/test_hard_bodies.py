"""Contacts with a hardness go over into the elastic ones as the hardness grows, by every theory."""

import numpy as np
import pytest

from mbma_tables import Bodies, MbmaError, Surface, contact
from mbma_tables.theories import THEORIES

# plasticity indices from where an eighth of the contact yields to where nothing does
PSI = np.array([0.5, 0.4, 0.3, 0.2, 0.1, 0.03, 1e-2, 1e-4])
AREAS = (1e-10, 1e-6, 1e-3, 0.02, 0.2, 0.5)
QUANTITIES = ("area", "stiffness", "unloading_stiffness", "mean_separation")


def pairs(theory):
    """Elastic contacts, and those with the hardnesses of `PSI` at the same pressures."""
    for hurst in (0.3, 0.8, 1.0):
        for zeta_1 in (8.0, 128.0):
            for height in (2.5, 4.0, 6.0):
                surface = Surface(hurst, 1.0, zeta_1, 1.0, height)
                for area in AREAS:
                    try:
                        elastic = contact(surface, area=area, theory=theory)
                    except MbmaError:
                        continue  # MBMA does not reach every area
                    caps = float(surface.rms_gradient) / PSI
                    yield (
                        elastic,
                        contact(
                            surface,
                            Bodies(hardness=caps),
                            pressure=elastic.pressure,
                            theory=theory,
                        ),
                    )


@pytest.mark.slow
@pytest.mark.parametrize("theory", THEORIES)
def test_every_answer_goes_over_into_the_elastic_one(theory):
    count = 0
    for elastic, hard in pairs(theory):
        for name in QUANTITIES:
            distance = np.abs(np.log(getattr(hard, name) / getattr(elastic, name)))
            # monotonically, up to the solver's rounding of a separation
            assert (np.diff(distance) <= 1e-9).all(), name
            # by what yields, and by the area's series, which falls as psi^4.8
            assert (distance <= hard.yielded + 5e-3).all(), name
            assert (distance[PSI <= 0.1] <= 1e-3).all(), name
            assert (distance[PSI <= 0.01] <= 1e-7).all(), name
        count += 1
    assert count > 60


def test_persson_at_light_loads_where_nothing_yields():
    """Its force falls as exp(-u) and Gaussian heights as exp(-u^2/2), which do not cap what it bears."""
    surface = Surface(hurst=0.8, q0=0.01, q1=0.64, h_rms=1.0, h_max=3.3)
    cap = float(surface.rms_gradient) / 0.2
    for area in (1e-10, 1e-6, 1e-4):
        elastic = contact(surface, area=area, theory="persson")
        hard = contact(
            surface, Bodies(hardness=cap), pressure=elastic.pressure, theory="persson"
        )
        for name in QUANTITIES:
            assert getattr(hard, name) == pytest.approx(
                getattr(elastic, name), rel=2e-5
            ), name


@pytest.mark.parametrize("theory", THEORIES)
def test_force_rises_with_the_hardness_without_a_jump(theory):
    surface = Surface(hurst=0.8, q0=0.01, q1=0.64, h_rms=1.0, h_max=5.0)
    caps = float(surface.rms_gradient) * np.geomspace(1e-3, 1e3, 2001)
    for u in (0.05, 1.0, 3.0, 4.5):
        pressed = contact(
            surface, Bodies(hardness=caps), mean_separation=u, theory=theory
        )
        steps = np.diff(np.log(pressed.pressure)) / np.diff(np.log(caps))
        assert steps.min() >= -1e-6
        # of next to no hardness pressure is in proportion to it; what an elastic contact
        # adds rises as its cube
        assert steps.max() <= 3


@pytest.mark.parametrize("theory", ["mbma", "calibrated", "persson"])
def test_where_valid_unloading_is_as_stiff_as_loading(theory):
    for hurst in (0.3, 0.8):
        for zeta_1 in (8.0, 128.0):
            surface = Surface(hurst, 1e-3, 1e-3 * zeta_1, 1.0, 4.2)
            u = 4.2 * np.linspace(0.02, 0.98, 25)[:, None]
            caps = float(surface.rms_gradient) / np.geomspace(0.3, 30, 12)
            pressed = contact(
                surface, Bodies(hardness=caps), mean_separation=u, theory=theory
            )
            ratio = pressed.unloading_stiffness / pressed.stiffness
            # the frozen stiffness is known to 5%
            assert ratio[pressed.valid].min() > 0.95
            if theory != "greenwood_williamson":
                assert pressed.valid.any()


@pytest.mark.parametrize("theory", ["calibrated", "persson"])
def test_the_slope_of_loading_is_as_certain_as_the_elastic_one_where_nothing_yields(
    theory,
):
    surface = Surface(hurst=0.8, q0=1 / 32, q1=1.0, h_rms=1.0, h_max=4.0)
    area = np.array([0.003, 0.03, 0.3, 0.9])
    elastic = contact(surface, area=area, theory=theory)
    for eta, is_elastic in ((0.9, False), (4.0, True), (1e12, True)):
        hard = contact(
            surface,
            Bodies(hardness=eta * surface.rms_gradient),
            pressure=elastic.pressure,
            theory=theory,
        )
        if not is_elastic:
            assert np.isnan(hard.stiffness_scatter).all()
            continue
        assert (hard.yielded < 1e-5).all()
        np.testing.assert_allclose(hard.stiffness, elastic.stiffness, rtol=1e-4)
        np.testing.assert_allclose(
            hard.stiffness_scatter, elastic.stiffness_scatter, rtol=1e-4
        )
