"""The atlas on a few of its corners: nothing without a number, nothing beyond its bound, no warning."""

import math

import numpy as np
import pytest

from generate.page import svg
from generate.pages import stability as cases
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
    found = cases.islands() | cases.island_geometry() | cases.totals()
    rows = {name: cases.row(name, outcomes)[1:] for name, outcomes in found.items()}
    # the comparison would show it if the formulas as printed were fine
    assert rows.pop("geometry, the paper's formulas as printed")[2] > 0
    for name, (tried, refused, not_finite, warned, _, beyond) in rows.items():
        assert not_finite == warned == beyond == 0, name
        assert refused < tried
    assert rows["geometry, library"][4] < 1e-13
    assert svg(cases.draw(found)).startswith(b"<?xml")


def test_what_goes_wrong_is_counted():
    def refuse():
        raise InputError("no")

    answers = [lambda: ([1.0], 0.1), lambda: ([1.5], 0.1), lambda: ([math.nan], 0.1), lambda: ([1 / 0], 0.1), refuse]
    found = [cases.outcome(answer, [1.0]) for answer in answers]
    assert [one.error for one in found] == pytest.approx([0.0, 0.5, math.nan, math.nan, math.nan], nan_ok=True)
    assert cases.row("some", found) == ["some", 5, 1, 2, 0, 0.5, 1]


@pytest.mark.parametrize("X", [-37.0, -3.0, 0.0, 8.5, 1e3])
def test_rigid_truth_against_the_library(X):
    own = rigid_sphere(np.array(X), np.array(1.0))
    assert max(abs(float(a / b) - 1) for a, b in zip(own, cases.rigid_truth(X), strict=True)) < 1e-13
