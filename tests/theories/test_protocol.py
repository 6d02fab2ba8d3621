"""Theories behind one protocol: stiffness, energy and inverses against other ways to the same numbers."""

import numpy as np
import pytest
from helpers import Springs

from mbma_tables import InputError, OutOfRangeError, Surface, contact_law
from mbma_tables.theories import GreenwoodWilliamson, Mbma, Persson, get_theory

SURFACE = Surface(hurst=0.8, q0=0.2, q1=20.0, h_rms=1.5, h_max=4.8)
BATCH = Surface(hurst=[0.3, 0.7, 0.9], q0=1.0, q1=[1000.0, 60.0, 216.0], h_rms=1.0, h_max=[3.0, 3.0, 3.5])
SHARES = np.array([0.3, 0.5, 0.8])  # of u over h_max
ALL = [Mbma(), Persson(), Persson("simplified"), GreenwoodWilliamson()]
each = pytest.mark.parametrize("theory", ALL, ids=lambda t: f"{t.name}-{getattr(t, 'method', '')}")


@each
def test_stiffness_is_the_slope_of_force(theory):
    u = SHARES * SURFACE.h_max
    step = 1e-4 * u
    # Richardson's two central differences: error of order step^4
    coarse, fine = (
        (theory.answer(SURFACE, u - h).pressure - theory.answer(SURFACE, u + h).pressure) / (2 * h)
        for h in (step, step / 2)
    )
    assert theory.answer(SURFACE, u).stiffness == pytest.approx((4 * fine - coarse) / 3, rel=1e-5)


def test_mbma_inverts_and_integrates_as_its_law_does():
    law, theory, u = contact_law(SURFACE), Mbma(), SHARES * SURFACE.h_max
    loads = law.pressure(u)
    assert theory.answer(SURFACE, u).stiffness == pytest.approx(law.stiffness(u), rel=1e-5)
    assert theory.energy(SURFACE, u) == pytest.approx(law.energy(u), rel=1e-7)
    assert theory.mean_separation_at(SURFACE, "pressure", loads) == pytest.approx(u, rel=1e-7)
    with pytest.raises(OutOfRangeError, match="'mbma' reaches"):
        theory.mean_separation_at(SURFACE, "pressure", np.array(1.0))


def test_mbma_ends_where_its_force_turns():
    low = Mbma().interval(BATCH)[0]
    law = contact_law(Surface(0.3, 1.0, 1000.0, 1.0, 3.0))
    assert law.turning_point is not None
    assert low[0] == pytest.approx((3.0 + law.turning_point) / 2, abs=1e-5)
    assert (low[1:] == 0).all()


def test_softening_is_the_maximum_of_stiffness():
    found = Mbma().softening(BATCH)
    fine = np.linspace(0.01, 0.999, 1500)[:, None]
    stiffness = Mbma().answer(BATCH, fine * BATCH.h_max).stiffness
    # the first maximum from first contact on
    rising = np.diff(stiffness[::-1], axis=0) > 0
    first = 1500 - 1 - np.argmin(rising, axis=0)
    assert found == pytest.approx(fine[first, 0] * BATCH.h_max, abs=3e-3)


def test_a_users_own_object_is_a_theory():
    theory = get_theory(Springs())
    u = np.array([0.5, 2.0])
    found = theory.answer(SURFACE, u)
    assert found.stiffness == pytest.approx(3 / SURFACE.h_rms * found.pressure, rel=1e-8)
    assert theory.mean_separation_at(SURFACE, "pressure", found.pressure) == pytest.approx(u, rel=1e-10)
    work = (found.pressure - np.exp(-3 * SURFACE.h_max / SURFACE.h_rms)) * SURFACE.h_rms / 3
    assert theory.energy(SURFACE, u) == pytest.approx(work, rel=1e-8)


@pytest.mark.parametrize("wrong", ["perssons", 3, None, Springs, object()])
def test_what_is_no_theory_is_refused(wrong):
    with pytest.raises(InputError, match="theory must be one of"):
        get_theory(wrong)
