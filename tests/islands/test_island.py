"""`island`: units, scales, shapes, island models and bad input."""

import dataclasses
import math

import numpy as np
import pytest

from generate.tables.exact_geometry import divisor, exact_island
from mbma_tables import InputError, OutOfRangeError, Surface, greenwood_tripp, island
from mbma_tables.surfaces.variants import PRINTED


@pytest.fixture(scope="module")
def surface():
    return Surface(0.8, 0.18125, 0.18125 * 216, 1.3, 3.9)


@pytest.mark.parametrize("variant", ["reported", "printed"])
def test_units(surface, variant):
    for approach in (1e-9, 0.02, 0.7, 8.0):
        found = island(surface, approach * surface.h_rms, variant=variant)
        exact = exact_island(approach, surface.hurst, surface.zeta_1, divisor(variant))
        # the unit of height and of length that the paper's geometry is in
        s, length = surface.s, 1 / surface.q0
        units = {"R_d": length**2 / s, "R_u": length**2 / s, "D": length**-2, "sigma": s, "h_d": s}
        for name in ("zeta_d", "zeta_u", "eta", "X", "mu", *units):
            known = float(exact[name]) * units.get(name, 1.0)
            assert getattr(found, name) == pytest.approx(known, rel=2e-12, abs=0), name


@pytest.mark.parametrize("variant", ["reported", "printed"])
def test_force_and_area(surface, variant):
    delta = np.array([1e-6, 0.1, 1.0, 6.0])
    found = island(surface, delta, variant=variant, E_star=7.0)
    solved = greenwood_tripp.solve(found.X, found.mu, rtol=1e-12)
    L = np.sqrt(2 * found.R_d * found.sigma)
    force = 7.0 * found.sigma * L * solved.phi_F
    area = found.eta * math.pi * found.D * found.R_u * found.sigma * L**2 * solved.phi_A
    assert np.abs(found.force / force - 1).max() <= 1e-9
    assert np.abs(found.area / area - 1).max() <= 1e-9
    assert (np.abs(found.force / force - 1) <= found.error).all()
    assert found.variant == variant
    assert found.island_model == "universal"


@pytest.mark.parametrize("delta", [0.0, -1.0, [1.0, -0.5]])
def test_no_approach(surface, delta):
    with pytest.raises(OutOfRangeError, match="delta must be positive") as caught:
        island(surface, delta)
    assert caught.value.mask.shape == np.shape(delta)
    assert caught.value.mask.sum() == 1


BAD = {"island_model": ("magic",), "variant": ("guessed",), "E_star": (0.0, -1.0, math.nan)}
BAD |= {"rtol": (0.0, -1e-9, 2.0, math.nan)}


@pytest.mark.parametrize(("option", "value"), [(option, value) for option in BAD for value in BAD[option]])
def test_bad_options(surface, option, value):
    with pytest.raises(InputError, match=option):
        island(surface, 1.0, **{option: value})


def test_a_band_that_ends_at_the_floor_of_zeta_u_is_refused():
    own = dataclasses.replace(PRINTED, name="own", floor_u=3.5)
    with pytest.raises(OutOfRangeError, match=r"q1/q0 must be greater than 3\.5"):
        island(Surface(0.8, 1.0, 3.5, 1.0, 3.0), 1.0, variant=own)
    assert island(Surface(0.8, 1.0, math.nextafter(3.5, 4), 1.0, 3.0), 1.0, variant=own).force > 0


@pytest.mark.parametrize("approach", [1e-150, 1e-160, 1e-200, 1e-300])
def test_vanishing_approach_is_answered_or_refused(surface, approach):
    room = surface.h_rms / surface.s
    limit = (room - 4 / 9) / (math.sqrt(1 - 0.8968 / 1.5) * math.sqrt(16 / 81 - room**2 / 441))
    try:
        found = island(surface, approach * surface.h_rms)
    except OutOfRangeError:
        return
    assert abs(found.X / limit - 1) <= 1e-12
