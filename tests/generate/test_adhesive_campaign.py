"""The campaign of contacts with an attraction: whole pieces, one a case, from which rows are gathered."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from generate import adhesion
from generate.boundary_elements.surfaces import Recipe

SMALL = adhesion.Case(Recipe("self_affine", 0.8, 4, 2, 5, 32), True, 0.3, 0.2)
CASES = [SMALL, dataclasses.replace(SMALL, range=0.1, fitted=False)]


def test_a_stopped_campaign_leaves_whole_pieces_and_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr(adhesion, "cases", lambda: CASES)
    solve = adhesion.solved

    def stopped(case):
        if case == CASES[1]:
            raise KeyboardInterrupt
        return solve(case)

    pieces, data = tmp_path / "pieces", tmp_path / "rows.csv"
    asked = ["--folder", str(pieces), "--data", str(data)]
    monkeypatch.setattr(adhesion, "solved", stopped)
    assert CliRunner().invoke(adhesion.adhesion, asked).exit_code != 0
    assert [path.name for path in pieces.iterdir()] == [f"{SMALL.name}.npz"]
    assert not data.exists()

    again = []

    def counted(case):
        again.append(case)
        return solve(case)

    monkeypatch.setattr(adhesion, "solved", counted)
    CliRunner().invoke(adhesion.adhesion, asked, catch_exceptions=False)
    assert again == CASES[1:]
    rows = pd.read_csv(data, comment="#")
    assert tuple(rows.columns) == adhesion.COLUMNS
    assert len(rows) == 2 * len(adhesion.AREAS)
    assert rows.fitted.tolist() == [1] * len(adhesion.AREAS) + [0] * len(adhesion.AREAS)


def test_work_and_range_have_the_tabor_number_that_is_asked():
    """By the curvature of the map itself, from its discrete Fourier transform."""
    surface = SMALL.map()
    work, rho = SMALL.lengths(surface)
    q = 2 * np.pi * np.fft.fftfreq(len(surface), 1 / len(surface))
    square = q[:, None] ** 2 + q**2
    laplacian = np.fft.ifft2(-square * np.fft.fft2(surface)).real.std()
    assert rho == pytest.approx(0.3 * surface.std())
    assert np.cbrt(2 * work**2 / (laplacian * rho**3)) == pytest.approx(0.2, rel=0.02)


def test_contacts_in_approach_are_those_in_retreat():
    """Each from the one before it, on a path from the lightest load or from the heaviest."""
    retreat = pd.DataFrame(adhesion.solved(SMALL)).iloc[::-1].reset_index()
    approach = adhesion.approached(SMALL, float(retreat.work[0]))
    assert len(approach) > 4
    for name, atol in (("net_pressure", 1e-6), ("mean_separation", 1e-4), ("area", 1e-3)):
        both = retreat[name][: len(approach)]
        np.testing.assert_allclose(approach[name], both, rtol=1e-4, atol=atol)
