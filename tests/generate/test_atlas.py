"""The atlas on a few of its corners: nothing without a number, nothing beyond its bound, no warning."""

import math

import numpy as np
import pytest

from generate.pages import stability as cases
from generate.pages.page import svg
from mbma_tables import InputError
from mbma_tables.islands.greenwood_tripp import rigid_sphere

FEW = {
    "X_CORNERS": np.array([-40.0, -5.0, 0.0, 2.0, 30.0, 1e4]),
    "MU_CORNERS": np.array([0.0, 1e-300, 1e-16, 1e-6, 1.0, 1e5]),
    "APPROACHES": np.geomspace(1e-12, 30, 6),
    "BANDS": np.array([3.0000001, 30.0, 1e8]),
    "DEPTHS": (1e-12, 1e-3, 6.0),
    "TOTAL_BANDS": (3.0000001, 216.0, 1e6),
    "TOTAL_HURSTS": (0.1, 0.8, 1.0),
}


@pytest.mark.slow
def test_corners(monkeypatch):
    for name, value in FEW.items():
        monkeypatch.setattr(cases, name, value)
    (islands, island_errors), (geometry, geometry_errors) = cases.islands(), cases.island_geometry()
    library, printed = geometry
    for tally in [*islands, *cases.totals(), library]:
        assert tally.not_finite == tally.warned == tally.beyond == 0, tally
        assert tally.refused < tally.tried
    # the comparison would show it if the formulas as printed were fine
    assert printed.not_finite > 0
    assert library.largest < 1e-13
    assert svg(cases.draw(geometry_errors, island_errors)).startswith(b"<?xml")


def test_a_tally_counts_what_goes_wrong():
    tally = cases.Tally("some")

    def refuse():
        raise InputError("no")

    answers = [lambda: ([1.0], 0.1), lambda: ([1.5], 0.1), lambda: ([math.nan], 0.1), lambda: ([1 / 0], 0.1), refuse]
    errors = [tally.add(answer, [1.0]) for answer in answers]
    assert errors == pytest.approx([0.0, 0.5, math.nan, math.nan, math.nan], nan_ok=True)
    assert (tally.tried, tally.refused, tally.not_finite, tally.beyond, tally.largest) == (5, 1, 2, 1, 0.5)


@pytest.mark.parametrize("X", [-37.0, -3.0, 0.0, 8.5, 1e3])
def test_rigid_truth_against_the_library(X):
    own = rigid_sphere(np.array(X), np.array(1.0))
    assert max(abs(float(a / b) - 1) for a, b in zip(own, cases.rigid_truth(X), strict=True)) < 1e-13
