"""The calibrated law far above the surface: right, or its error states how far off it is, for every h_max."""

import numpy as np
import pytest
from scipy.integrate import quad

from mbma_tables import Surface, contact
from mbma_tables.laws.calibrated import self_affine_law

EDGES = ((0.1, 3.001), (0.1, 1e5), (1.0, 3.001), (1.0, 1e5))


def force_by_quadrature(surface, u):
    """F/(A0 E* g) of the law's definition: u_P by parts and `quad`, the root by bisection of its logarithm."""
    law = self_affine_law(float(surface.hurst), float(surface.zeta_1), None)

    def gap(log_force):
        F = np.exp(log_force)
        rest = quad(
            lambda x: float(law.energy(np.exp(x))) * np.exp(-x), log_force, 8, epsabs=0, epsrel=1e-10, limit=500
        )
        return rest[0] + float(law.energy(np.exp(8.0))) * np.exp(-8.0) - float(law.energy(F)) / F

    def endless(wanted):
        low, high = -200.0, 5.0
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if gap(middle) > wanted else (low, middle)
        return np.exp(low - law.tail * wanted**3)

    return endless(u) - endless(float(surface.h_max))


def test_far_gaps_of_one_surface_against_quadrature():
    surface = Surface(0.5, 1.0, 100.0, 1.0, 12.0)
    for u in (3.0, 6.0, 11.0):
        found = contact(surface, mean_separation=u, theory="calibrated")
        expected = force_by_quadrature(surface, u) * float(surface.rms_gradient)
        assert abs(found.pressure / expected - 1) <= found.error + 1e-6


@pytest.mark.parametrize("edge", [None, *EDGES])
def test_no_gap_is_beyond_its_stated_error(edge):
    rng, count = np.random.default_rng(7), 300 if edge is None else 60
    for _ in range(count):
        hurst, zeta_1 = edge or (rng.uniform(0.1, 1.0), np.exp(rng.uniform(np.log(3.001), np.log(1e5))))
        h_max = np.exp(rng.uniform(np.log(2.0), np.log(32.0)))
        u = h_max * (1 - np.exp(rng.uniform(np.log(1e-3), 0, 30)))
        pressure, _, _ = self_affine_law(hurst, zeta_1, h_max).contact(u)
        surface = Surface(hurst, 1.0, zeta_1, 1.0, h_max)
        found = contact(surface, mean_separation=u, theory="calibrated")
        seen = (pressure > 1e-290) & (u > 1e-5)
        off = found.pressure[seen] / (pressure[seen] * float(surface.rms_gradient)) - 1
        assert (np.abs(off) <= found.error[seen]).all()
