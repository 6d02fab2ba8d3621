"""`mbma cost`."""

import json

import pytest
from helpers import refused, run

from mbma_tables.scenes.costs import Distance, shipped_costs, shipped_distances


def test_the_table_has_a_line_for_each_row():
    title, _, header, *lines = run("cost", "--island-model", "universal").splitlines()
    assert len(lines) == sum(row.island_model == "universal" for row in shipped_costs().rows)
    assert "fixed piece of work" in title
    assert header.split() == ["island_model", "variant", "quantity", "error", "cost", "evaluations", "seconds"]
    assert all(line.startswith("universal") for line in lines)


def test_an_unknown_island_model_is_refused():
    assert "--island-model must be one of" in refused("cost", "--island-model", "best")


def test_distances_are_told_beside_times():
    title, _, header, *lines = run("cost", "--distance").splitlines()
    assert title.endswith("s")
    assert header.split() == [*Distance._fields, "seconds"]
    assert len(lines) == len(shipped_distances())
    # no force is known of an area alone
    assert lines[0].split()[-5:-3] == ["-", "-"]
    found = json.loads(run("cost", "--distance", "--json"))
    for row, expected in zip(found["rows"], shipped_distances(), strict=True):
        assert (row["theory"], row["way"]) == (expected.theory, expected.way)
        assert row["seconds"] == pytest.approx(expected.cost * found["unit_seconds"], rel=1e-12, abs=0)
    assert "leave it or --distance out" in refused("cost", "--distance", "--island-model", "exact")
