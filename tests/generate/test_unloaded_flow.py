"""The campaign of flow after unloading: whole pieces, one a surface, from which rows are gathered."""

import pytest
from click.testing import CliRunner

from generate import unloaded_flow
from generate.boundary_elements.surfaces import Recipe
from generate.files import read_csv


def test_a_campaign_that_is_stopped_goes_on_from_whole_pieces(tmp_path, monkeypatch):
    recipes = [Recipe("self_affine", hurst, 4.0, 2, 7, 32) for hurst in (0.8, 0.5)]
    cases = [unloaded_flow.Case(recipe, 0.2, False) for recipe in recipes]
    monkeypatch.setattr(unloaded_flow, "cases", lambda: cases)
    folder, target = tmp_path / "pieces", tmp_path / "rows.csv"
    solved = unloaded_flow.solved
    asked = []

    def stopped(case):
        asked.append(case.name)
        if len(asked) == 2:
            raise KeyboardInterrupt
        return solved(case)

    def call(*options):
        given = [*options, "--folder", str(folder), "--data", str(target)]
        return CliRunner().invoke(unloaded_flow.unloaded_flow, given)

    monkeypatch.setattr(unloaded_flow, "solved", stopped)
    assert call("--simulate").exit_code != 0
    assert [path.stem for path in folder.iterdir()] == [cases[0].name]
    assert call("--simulate").exit_code == 0
    assert asked == [cases[0].name, cases[1].name, cases[1].name]
    assert call("--collect").exit_code == 0
    rows = read_csv(target)
    assert tuple(rows.columns) == unloaded_flow.COLUMNS
    assert rows.hurst.unique().tolist() == [0.8, 0.5]
    # each surface blocks, or has the loads and those after each of the largest
    first = rows[rows.hurst == 0.8]
    assert first.flow_x.iloc[0] == pytest.approx(solved(cases[0])["flow_x"][0], rel=1e-5)
    assert (first.force <= first.largest_force).all()
    assert (first.force < first.largest_force).sum() >= 3
