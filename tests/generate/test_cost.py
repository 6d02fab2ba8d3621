from __future__ import annotations

import numpy as np
import pytest

from generate.pages import cost, cost_islands, cost_page, cost_totals
from mbma_tables import contact
from mbma_tables.files import write_file
from mbma_tables.islands import greenwood_tripp
from mbma_tables.models.universal import island4d_model
from mbma_tables.scenes.costs import HELD_OUT, Row, cost_file, held_out_surfaces, read_costs


def test_reference_agrees_with_the_exact_tier():
    found = cost_totals.reference()
    assert len(found) == len(HELD_OUT)
    surface, gap, truth = found[3]
    answer = contact(surface, gap, tier="exact", rtol=1e-10)
    assert np.stack([answer.force, answer.area]) == pytest.approx(truth, rel=1e-10, abs=0)


def test_held_out_islands_agree_with_the_solver():
    held = cost_islands.held_out(40)
    solved = greenwood_tripp.solve(held.islands["X"], held.islands["mu"], rtol=1e-11)
    assert held.error(solved.phi_F, solved.phi_A) < 1e-11
    assert held.error(1.01 * solved.phi_F, solved.phi_A) == pytest.approx(0.01, rel=1e-6, abs=0)


def test_linear_reading_meets_the_nodes_and_lies_between_them():
    content = island4d_model().content
    places = np.array([[3.0, 3.5, 4.0], [20.0, 20.0, 20.0], [2.0, 2.0, 2.0], [5.0, 5.0, 5.0]])
    out = np.empty((2, 3))
    cost_islands._fill_linear(content.log_ratio, places, out)
    left, right = content.log_ratio[3, 20, 2, 5], content.log_ratio[4, 20, 2, 5]
    assert out[:, 0] == pytest.approx(left, rel=1e-13, abs=0)
    assert out[:, 1] == pytest.approx((left + right) / 2, rel=1e-13, abs=0)
    assert out[:, 2] == pytest.approx(right, rel=1e-13, abs=0)


def test_classical_meets_newton_within_its_mesh():
    X, mu = np.array([1.5, 3.0]), np.array([0.5, 2.0])
    exact = greenwood_tripp.solve(X, mu)
    errors = []
    for rings in (50, 100):
        _, converged, force, _ = cost_islands.classical(X, mu, cost_islands.ring_matrix(rings), 1e-9)
        assert converged.all()
        errors.append(np.abs(force / exact.phi_F - 1).max())
    # the meshes are of second order
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.3, abs=0)


def test_single_surface_has_no_error_against_itself():
    answers = [truth for _, _, truth in cost_totals.reference()]
    assert cost_totals.largest_error(answers) == 0
    answers[2] = answers[2] * [[1.0], [1.001]]
    assert cost_totals.largest_error(answers) == pytest.approx(1e-3, rel=1e-9, abs=0)
    assert cost_totals.largest_error([a[:1] for a in answers], slice(0, 1)) == 0


def test_brute_force_times_are_those_of_the_data():
    rows = list(cost_totals.brute_force_rows(0.5))
    assert [row.variant for row in rows[:2]] == ["load force=0.0001", "load force=0.0003"]
    assert rows[0].cost == pytest.approx(0.89 / 0.5, rel=1e-12, abs=0)


def test_rows_come_back_from_the_file(tmp_path):
    rows = [
        Row("unit", "seconds", "both", None, 2.5e-4),
        Row("exact", "gap rtol=1e-03", "force", 1.5e-6, 3.25, 71.0),
    ]
    path = tmp_path / "deep" / "cost.csv"
    write_file(path, cost.to_csv(rows, quick=True).encode(), make_folders=True)
    assert list(read_costs(path).measured) == rows
    assert [p.name for p in path.parent.iterdir()] == ["cost.csv"]


def test_page_figure_and_readme_come_from_the_data_alone():
    costs = read_costs(cost_file())
    text = cost_page.page(costs)
    for row in costs.measured:
        if row.tier != "unit" and row.quantity == "both":
            assert f"| {cost_page.METHODS.get(row.tier, row.tier)} | " in text
    assert "(figures/cost.png)" in text
    assert cost_page.draw(costs)[:8] == b"\x89PNG\r\n\x1a\n"
    assert cost_page.readme_table(costs) in cost_page.readme_table(read_costs(cost_file()))


def test_figure_spans_five_decades_of_time_and_eight_of_error():
    rows = [row for row in read_costs(cost_file()).measured if cost_page.is_island(row)]
    cheapest = min(row.cost for row in rows)
    classical = max(row.cost for row in rows if row.tier == "classical")
    assert classical / cheapest > 1e5
    assert max(row.error for row in rows) / min(row.error for row in rows) > 1e8


def test_surfaces_are_inside_what_every_tier_covers():
    for surface in held_out_surfaces():
        for tier in ("universal", "island4d"):
            assert contact(surface, -0.5 * float(surface.h_max), tier=tier).force > 0
