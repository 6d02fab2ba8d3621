"""Slopes of totals, and relative derivatives by a surface's numbers, against differences of the solver's totals."""

import dataclasses
import functools

import numpy as np
import pytest
from catalogue import LEVEL, OWN
from helpers import difference_weights

from mbma_tables import Surface, contact, sensitivity
from mbma_tables.islands.geometry import kinks
from mbma_tables.surfaces.variants import get_variant
from mbma_tables.theories import Mbma

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
# next to a kink, where a derivative that forgot it would be wrong: the third number is reach over the kink
AT_KINKS = [(0.9, 100.0, 0, 0.95), (0.9, 100.0, 0, 1.05), (0.9, 100.0, 1, 0.97), (0.9, 100.0, 1, 1.03)]


def differences(numbers, variant, step, names):
    """Derivatives of force and area by high-order differences of exact islands, of shape (2, names)."""
    shifted, spans = [], []
    for name in names:
        place = NAMES.index(name)
        backward = name == "hurst" and numbers[place] == 1
        offsets = np.arange(-6.0, 1) if backward else np.arange(-3.0, 4)
        # the depth is what matters near first contact
        span = step * (numbers[4] - numbers[5] if name in ("separation", "h_max") else numbers[place])
        points = np.repeat(np.asarray(numbers, dtype=float)[:, None], 7, axis=1)
        points[place] += span * offsets
        shifted.append(points)
        spans.append(difference_weights(offsets) / span)
    points = np.stack(shifted, axis=1)
    found = contact(Surface(*points[:5]), separation=points[5], island_model="exact", variant=variant, rtol=1e-11)
    return [np.einsum("nk,nk->n", spans, values) for values in (found.pressure, found.area)]


@functools.cache
def numbers_of(case):
    hurst, zeta_1, top, reach = case
    h_rms = 0.7
    return hurst, 0.3, 0.3 * zeta_1, h_rms, top * h_rms, (top - reach) * h_rms


EVERY = [(case, variant, 4e-3) for case in CASES for variant in ("reported", "printed")]
EVERY += [(CASES[k], variant, 4e-3) for k in (0, 2, 3) for variant in (OWN, LEVEL, NO_OFFSET, OF_HEIGHTS)]
for hurst, zeta_1, which, share in AT_KINKS:
    for variant in ("reported", OWN):
        reach = share * kinks(hurst, zeta_1, get_variant(variant))[which]
        EVERY.append(((hurst, zeta_1, 4.7, reach), variant, 2e-3))


def within(slope, true, value, parameter):
    return (np.abs(slope - true) <= 1e-6 * np.maximum(np.abs(true), np.abs(value / parameter))).all()


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
    found = sensitivity(Surface(*five), separation=gap, theory=Mbma(variant=variant, rtol=1e-10))
    slopes = np.array(differences(numbers, variant, 4e-3, NAMES[:5]))
    for name, parameter, true in zip(NAMES, five, slopes.T, strict=False):
        for answer, slope in zip(("pressure", "area"), true, strict=True):
            assert found.slopes[name][answer] == pytest.approx(slope * parameter / found.answers[answer], abs=1e-5)


def test_units_shapes_and_no_contact():
    surface, gap = Surface([[0.5], [1.0]], 0.3, 30.0, 0.7, 2.4), np.array([1.0, 2.4, 5.0])
    found, stiff = (contact(surface, separation=gap, E_star=e).stiffness for e in (1.0, [2.0, 3.0, 4.0]))
    assert found.shape == (2, 3)
    assert (found[:, 1:] == 0).all()
    np.testing.assert_allclose(stiff, np.array([2, 3, 4]) * found, rtol=1e-15)
    one = contact(Surface(0.5, 0.3, 30.0, 0.7, 2.4), separation=1.0).stiffness
    assert np.shape(one) == ()
    assert one == found[0, 0]
