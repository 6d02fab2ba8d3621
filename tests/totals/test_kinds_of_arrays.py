"""Arrays of every kind, units and moduli give the same answers."""

import numpy as np
import pytest

from mbma_tables import Surface, contact

SURFACE = Surface(0.8, 1.0, 216.0, 1.0, 3.0)
GAPS = np.linspace(-2.0, 2.9, 40)


def frozen():
    gaps = GAPS.copy()
    gaps.flags.writeable = False
    return gaps


KINDS = {
    "strided": np.repeat(GAPS, 3)[::3],
    "read-only": frozen(),
    "reversed view": GAPS[::-1].copy()[::-1],
    "Fortran order": np.asfortranarray(GAPS.reshape(5, 8)),
    "list": GAPS.tolist(),
}


@pytest.mark.parametrize("kind", KINDS)
def test_layout_does_not_matter(kind):
    found, expected = contact(SURFACE, KINDS[kind]), contact(SURFACE, GAPS)
    np.testing.assert_array_equal(np.ravel(found.force), expected.force)
    np.testing.assert_array_equal(np.ravel(found.area), expected.area)


@pytest.mark.parametrize("dtype", [np.float32, int])
def test_other_numbers_are_the_doubles_that_they_are(dtype):
    gaps = GAPS.astype(dtype)
    np.testing.assert_array_equal(contact(SURFACE, gaps).force, contact(SURFACE, gaps.astype(float)).force)


@pytest.mark.parametrize("unit", [1e-9, 1e-3, 1e3])
def test_length_unit(unit):
    scaled = Surface(0.8, 1.0 / unit, 216.0 / unit, unit, 3.0 * unit)
    assert contact(scaled, GAPS * unit).force == pytest.approx(contact(SURFACE, GAPS).force, rel=1e-12, abs=0)


def test_modulus():
    assert contact(SURFACE, GAPS, E_star=1e12).force == pytest.approx(1e12 * contact(SURFACE, GAPS).force, rel=1e-15)
