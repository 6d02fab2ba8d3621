"""The atlas on a few of its corners: nothing without a number, nothing beyond its bound, no warning."""

import math

import numpy as np
import pytest

from generate.pages import stability as cases
from generate.pages.page import svg
from mbma_tables import InputError


def few(monkeypatch):
    monkeypatch.setattr(cases, "X_CORNERS", np.array([-40.0, -5.0, 0.0, 2.0, 30.0, 1e4]))
    monkeypatch.setattr(cases, "MU_CORNERS", np.array([0.0, 1e-300, 1e-16, 1e-6, 1.0, 1e5]))
    monkeypatch.setattr(cases, "APPROACHES", np.geomspace(1e-12, 30, 6))
    monkeypatch.setattr(cases, "BANDS", np.array([3.0000001, 30.0, 1e8]))
    monkeypatch.setattr(cases, "DEPTHS", (1e-12, 1e-3, 6.0))
    monkeypatch.setattr(cases, "TOTAL_BANDS", (3.0000001, 216.0, 1e6))
    monkeypatch.setattr(cases, "TOTAL_HURSTS", (0.1, 0.8, 1.0))


@pytest.mark.slow
def test_corners(monkeypatch):
    few(monkeypatch)
    islands, island_maps = cases.islands()
    geometry, geometry_maps = cases.island_geometry()
    totals = cases.totals()
    library, direct = geometry
    for tally in [*islands, *totals, library]:
        assert tally.not_finite == tally.warned == tally.beyond == 0, tally
        assert tally.refused < tally.tried
    # the comparison would show it if the formulas as printed were fine
    assert direct.not_finite > 0
    assert library.largest < 1e-13
    assert svg(cases.draw(geometry_maps, island_maps)).startswith(b"<?xml")
    tallies = [*islands, *geometry, *totals]
    assert len(cases.corners(tallies).splitlines()) == len(tallies) + 2


def test_a_tally_counts_what_goes_wrong():
    tally = cases.Tally("some")

    def refuse():
        raise InputError("no")

    answers = [lambda: ([1.0], 0.1), lambda: ([1.5], 0.1), lambda: ([math.nan], 0.1), lambda: ([1 / 0], 0.1), refuse]
    errors = [tally.add(answer, [1.0]) for answer in answers]
    assert errors == pytest.approx([0.0, 0.5, math.nan, math.nan, math.nan], nan_ok=True)
    assert (tally.tried, tally.refused, tally.not_finite, tally.beyond, tally.largest) == (5, 1, 2, 1, 0.5)


def test_rigid_truth_against_the_library():
    from mbma_tables.islands.greenwood_tripp import rigid_sphere

    for X in (-37.0, -3.0, 0.0, 8.5, 1e3):
        force, area = cases.rigid_truth(X)
        own = rigid_sphere(np.array(X), np.array(1.0))
        assert abs(float(own[0] / force) - 1) < 1e-13
        assert abs(float(own[1] / area) - 1) < 1e-13
