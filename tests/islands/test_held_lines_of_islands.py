"""Lines of `islands` that altered code got past the other tests with."""

import dataclasses
import math

import numpy as np
import pytest

from mbma_tables import OutOfRangeError, Surface, height_integral, island
from mbma_tables.islands.height_integrals import ORDERS
from mbma_tables.surfaces.readings import PRINTED


@pytest.mark.parametrize("n", ORDERS)
def test_nothing_is_left_far_to_the_right(n):
    assert height_integral(n, [math.nextafter(40, 41), 41.0, 1e3, 1e30, 1e300]).tolist() == [0] * 5


def test_height_integrals_of_several_dimensions():
    x = np.linspace(-3, 3, 24).reshape(2, 3, 4)
    many = height_integral(1.5, x)
    assert many.shape == (2, 3, 4)
    np.testing.assert_array_equal(many.ravel(), [height_integral(1.5, at) for at in x.ravel()])


def test_the_floor_of_zeta_u_itself_is_refused():
    own = dataclasses.replace(PRINTED, name="own", floor_u=3.5)
    with pytest.raises(OutOfRangeError, match=r"q1/q0 must be above floor_u = 3\.5"):
        island(Surface(0.8, 1.0, 3.5, 1.0, 3.0), 1.0, reading=own)
    assert island(Surface(0.8, 1.0, math.nextafter(3.5, 4), 1.0, 3.0), 1.0, reading=own).force > 0
