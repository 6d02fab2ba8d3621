"""The closed totals as a function: units, shapes, and their range."""

import numpy as np
import pytest

from mbma_tables import InputError, OutOfRangeError, Surface, contact
from mbma_tables.formulas.totals import closed_totals


def test_units_and_shapes():
    surface = Surface(0.8, [[0.1], [0.2]], [[10.0], [20.0]], 0.5, 1.7)
    gaps = np.array([0.3, 0.9, -1.0])
    force, area, error = closed_totals(surface, gaps, 200.0)
    exact = contact(surface, gaps, E_star=200.0)
    assert force.shape == area.shape == (2, 3)
    assert np.abs(force / exact.force - 1).max() < error
    assert np.abs(area / exact.area - 1).max() < error
    assert np.ndim(closed_totals(Surface(0.8, 0.1, 10.0, 0.5, 1.7), 0.3)[0]) == 0


@pytest.mark.parametrize(
    ("surface", "gap"),
    [
        (Surface(0.4, 1.0, 100.0, 1.0, 3.0), 1.0),
        (Surface(0.8, 1.0, 2000.0, 1.0, 3.0), 1.0),
        (Surface(0.8, 1.0, 100.0, 1.0, 5.0), 1.0),
        (Surface(0.8, 1.0, 100.0, 1.0, 3.0), 2.99),
        (Surface(0.8, 1.0, 100.0, 1.0, 3.0), 3.0),
        (Surface(0.8, 1.0, 100.0, 1.0, 3.0), -3.1),
    ],
)
def test_outside_its_range(surface, gap):
    with pytest.raises(OutOfRangeError):
        closed_totals(surface, gap)


def test_no_number():
    with pytest.raises(InputError):
        closed_totals(Surface(0.8, 1.0, 100.0, 1.0, 3.0), np.nan)
