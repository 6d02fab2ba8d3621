"""The atlas on a few of its corners: nothing without a number, nothing beyond its bound, no warning."""

import numpy as np

from generate.pages import stability_cases as cases
from generate.pages.stability import beyond, corners, draw


def few(monkeypatch):
    monkeypatch.setattr(cases, "X_CORNERS", np.array([-40.0, -5.0, 0.0, 2.0, 30.0, 1e4]))
    monkeypatch.setattr(cases, "MU_CORNERS", np.array([0.0, 1e-300, 1e-16, 1e-6, 1.0, 1e5]))
    monkeypatch.setattr(cases, "APPROACHES", np.geomspace(1e-12, 30, 6))
    monkeypatch.setattr(cases, "BANDS", np.array([3.0000001, 30.0, 1e8]))
    monkeypatch.setattr(cases, "REACHES", (1e-12, 1e-3, 6.0))
    monkeypatch.setattr(cases, "TOTAL_BANDS", (3.0000001, 216.0, 1e6))
    monkeypatch.setattr(cases, "TOTAL_HURSTS", (0.1, 0.8, 1.0))


def test_corners(monkeypatch, tmp_path):
    few(monkeypatch)
    islands, island_maps = cases.islands()
    geometry, geometry_maps = cases.island_geometry()
    totals, worst = cases.totals()
    assert worst == []
    direct = [tally for tally in geometry if "as they stand" in tally.name]
    for tally in [*islands, *totals, *(tally for tally in geometry if tally not in direct)]:
        assert tally.not_finite == tally.warned == tally.bound_broken == 0, tally
        assert tally.refused < tally.tried
    # the comparison would show it if the formulas as they stand were fine
    assert direct[0].not_finite > 0
    assert max(tally.largest for tally in geometry if tally not in direct) < 1e-13
    draw(geometry_maps, island_maps, tmp_path / "figures" / "stability.png")
    tallies = [*islands, *geometry, *totals]
    assert len(corners(tallies).splitlines()) == len(tallies) + 2
    assert beyond(worst) == "None."


def test_every_kind_of_argument():
    assert [name for name, held in cases.arguments() if not held] == []


def test_rigid_truth_against_the_library():
    from mbma_tables.islands.greenwood_tripp import rigid_sphere

    for X in (-37.0, -3.0, 0.0, 8.5, 1e3):
        force, area = cases.rigid_truth(X)
        own = rigid_sphere(np.array(X), np.array(1.0))
        assert abs(float(own[0] / force) - 1) < 1e-13
        assert abs(float(own[1] / area) - 1) < 1e-13
