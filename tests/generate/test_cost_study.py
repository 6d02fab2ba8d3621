"""The study of costs on few islands and surfaces, its clock replaced: errors, counts, and what goes into the page."""

from __future__ import annotations

import itertools
import re

import pytest
from click.testing import CliRunner

from generate.pages import cost, cost_islands, cost_page, cost_totals
from mbma_tables import ConvergenceError
from mbma_tables.scenes.costs import Row, cost_file, read_costs

COST, SECONDS = 2.0, 1e-3


def once(run, budget=0.5):
    """In place of `measure`: the call is made, its cost made up."""
    del budget
    run()
    return COST, SECONDS


def by_variant(rows):
    return {(row.tier, row.variant, row.quantity): row for row in rows}


@pytest.fixture
def few_islands(monkeypatch):
    held = cost_islands.held_out(40)
    small = {
        "held_out": lambda: held,
        "ISLANDS": 40,
        "HARD": 4,
        "PROFILES": 2,
        "MESHES": {25: (1e-2,), 50: (1e-2, 1e-4)},
        "FINEST_MESH": {100: (1e-5,)},
        "NEWTON_RTOLS": (1e-2, 1e-8),
        "NEWTON_NODES": (8, 24),
        "ISLAND4D_SHAPES": ((8, 12, 8, 8), (9, 16, 8, 8)),
        "measure": once,
    }
    for name, value in small.items():
        monkeypatch.setattr(cost_islands, name, value)
    return held


@pytest.mark.parametrize("quick", [True, False])
def test_islands(few_islands, quick):
    rows = by_variant(cost_islands.island_rows(quick))
    assert {tier for tier, _, _ in rows} == {"universal", "island4d", "formula", "rigid", "exact", "classical"}
    for rtol in ("1e-02", "1e-08"):
        row = rows["exact", f"island rtol={rtol}", "both"]
        assert row.error < float(rtol)
        assert row.cost == COST / len(range(0, 40, 10 if quick else 4))
    assert rows["exact", "nodes=24", "both"].error < rows["exact", "nodes=8", "both"].error
    assert rows["exact", "nodes=24", "both"].evaluations > rows["exact", "nodes=8", "both"].evaluations
    assert rows["exact", "profile rtol=1e-04", "both"].cost == COST / 2
    # looked up: the finer the nodes, the smaller the error
    assert rows["universal", "island", "both"].error < 1e-8
    assert rows["island4d", "island", "both"].error < 1e-3
    assert rows["universal", "island", "both"].cost == COST / 40
    coarse = [row for (tier, name, _), row in rows.items() if tier == "universal" and "nodes" in name]
    assert len(coarse) == (2 if quick else 4)
    assert [row.error for row in coarse] == sorted((row.error for row in coarse), reverse=True)
    assert min(row.error for row in coarse) > rows["universal", "island", "both"].error
    linear = [row for (_, name, _), row in rows.items() if "linear" in name]
    assert len(linear) == (2 if quick else 3)
    assert min(row.error for row in linear) > rows["island4d", "island", "both"].error
    # the shipped nodes are the finest
    assert linear[0].error == min(row.error for row in linear)
    forms = [rows["formula", f"island form={name}", "both"].error for name in cost_islands.FORMS]
    assert forms == sorted(forms, reverse=True)
    # a mesh of a quarter the width errs less where the tolerance lets it
    meshes = {name: row for (tier, name, _), row in rows.items() if tier == "classical"}
    assert len(meshes) == (3 if quick else 4)
    assert meshes["rings=50 rtol=1e-04"].error < meshes["rings=25 rtol=1e-02"].error
    assert meshes["rings=50 rtol=1e-04"].cost == COST / 4


def test_a_classical_iteration_that_does_not_end_is_no_row(few_islands, monkeypatch):
    monkeypatch.setattr(cost_islands, "MOST_STEPS", 3)
    with pytest.raises(ConvergenceError, match="on 25 rings did not converge") as caught:
        list(cost_islands.classical_rows(quick=True))
    assert caught.value.mask.any()


@pytest.fixture
def few_totals(monkeypatch):
    small = {
        "TIERS": ("universal", "rigid"),
        "RTOLS": (1e-1, 1e-2, 1e-4),
        "LAW_RTOLS": (1e-2,),
        "SLOW_LAW_RTOLS": (1e-1,),
        "ORDERS": (4, 24),
        "measure": once,
    }
    for name, value in small.items():
        monkeypatch.setattr(cost_totals, name, value)


@pytest.mark.parametrize("quick", [True, False])
def test_totals(few_totals, quick):
    rows = by_variant(cost_totals.gap_rows(quick))
    asked = {float(name.split("=")[1]) for tier, name, what in rows if "rtol" in name and what == "both"}
    assert asked == ({1e-2} if quick else {1e-1, 1e-2, 1e-4})
    for what in ("both", "force", "area"):
        row = rows["universal", "gap rtol=1e-02", what]
        assert row.error < 1e-2
        # a call's cost is taken off, down to next to nothing, and the rest is shared by the gaps
        assert row.cost == pytest.approx(1e-9 / 50, rel=1e-12, abs=0)
        assert row.evaluations > 20
        assert rows["universal", "call", what].cost == pytest.approx(COST / 6, rel=1e-12, abs=0)
        # spheres that do not deform are not the model
        assert rows["rigid", "gap rtol=1e-02", what].error > 1
    both = rows["universal", "gap rtol=1e-02", "both"]
    assert max(rows["universal", "gap rtol=1e-02", what].error for what in ("force", "area")) <= both.error * 1.5


def test_orders_of_the_plain_rule(few_totals):
    low, high = cost_totals.order_rows()
    assert low.variant == "order=4"
    assert high.error < 1e-2 * low.error
    assert high.evaluations == 6 * low.evaluations


@pytest.mark.parametrize("quick", [True, False])
def test_laws(few_totals, quick):
    rows = by_variant(cost_totals.law_rows(quick))
    made = [key for key in rows if key[1].startswith("law rtol")]
    assert [tier for tier, _, _ in made] == (["universal"] if quick else ["universal", "rigid"])
    assert rows["universal", "law rtol=1e-02", "both"].error < 1e-2
    assert rows["law", "lookup", "both"].cost == COST / 10_000
    assert {name for tier, name, _ in rows if tier == "law"} == {"lookup", "invert"}


def test_theories(few_totals):
    rows = list(cost_totals.theory_rows())
    assert [row.tier for row in rows] == ["greenwood_williamson", "persson"]
    assert {row.cost for row in rows} == {COST / 20}


def test_what_a_scene_takes_besides_its_steps(monkeypatch):
    costs = itertools.count(5.0, -3.0)
    monkeypatch.setattr(cost_totals, "measure", lambda run: (run(), (next(costs), SECONDS))[1])
    call, bound = cost_totals.scene_rows()
    # 5 for the run, 2 for its step
    assert (call.variant, call.cost) == ("call", 3.0)
    assert (bound.variant, bound.cost) == ("bound", -1.0)


def test_first_use_is_that_of_the_second_process(few_totals, monkeypatch):
    monkeypatch.setattr(cost_totals, "TIERS", ("rigid",))
    monkeypatch.setattr(cost_totals, "FIRST_USE", "import time; print({{'rigid': 0.25}}[{tier!r}])")
    rows = by_variant(cost_totals.first_use_rows(quick=True))
    assert rows["rigid", "import", "both"].cost == pytest.approx(0.25 / SECONDS, rel=1e-12, abs=0)
    assert {tier for tier, name, _ in rows if name == "open"} == {"universal", "island4d"}


def test_the_study_is_all_of_it(monkeypatch):
    called = []

    def part(name):
        return lambda quick: called.append((name, quick)) or [Row(name, "island", "both", 0.5, 1.0)]

    monkeypatch.setattr(cost_islands, "island_rows", part("exact"))
    for name in ("scene_rows", "order_rows", "theory_rows"):
        monkeypatch.setattr(cost_totals, name, lambda name=name: part(name)(None))
    for name in ("gap_rows", "law_rows", "first_use_rows"):
        monkeypatch.setattr(cost_totals, name, part(name))
    seconds = iter([3.0, 1.5, 2.0])
    monkeypatch.setattr(cost, "measure", lambda run: (1.0, next(seconds)))
    rows = cost.study(quick=True)
    assert rows[0] == Row("unit", "seconds", "both", None, 1.5)
    expected = ["exact", "scene_rows", "gap_rows", "order_rows", "law_rows", "theory_rows", "first_use_rows"]
    assert [row.tier for row in rows[1:8]] == expected
    assert [name for name, _ in called] == expected
    # others' seconds are divided by the fastest fixed work seen
    assert rows[8:] == list(cost_totals.brute_force_rows(1.5))


def test_the_command(tmp_path, monkeypatch):
    shipped = read_costs(cost_file())
    monkeypatch.setattr(cost, "study", lambda quick: list(shipped.measured))
    data, out = tmp_path / "data" / "cost.csv", tmp_path / "docs"
    done = CliRunner().invoke(cost.main, ["--out", str(out), "--data", str(data), "--quick"], catch_exceptions=False)
    assert done.exit_code == 0
    assert read_costs(data).measured == shipped.measured
    assert '"quick": true' in data.read_text(encoding="utf-8")
    text = (out / "cost.md").read_text(encoding="utf-8")
    assert text == cost_page.page(read_costs(data))
    assert (out / "figures" / "cost.png").read_bytes().startswith(b"\x89PNG")
    assert cost_page.readme_table(shipped) in done.output

    # the page alone leaves the data as they are
    monkeypatch.setattr(cost, "study", lambda quick: pytest.fail("measured"))
    (out / "cost.md").unlink()
    before = data.read_bytes()
    done = CliRunner().invoke(cost.main, ["--out", str(out), "--data", str(data), "--page"], catch_exceptions=False)
    assert done.exit_code == 0
    assert data.read_bytes() == before
    assert (out / "cost.md").read_text(encoding="utf-8") == text


def test_the_page_without_others_times_and_without_one_quantity_alone(tmp_path):
    shipped = read_costs(cost_file())
    kept = [row for row in shipped.measured if row.tier != "boundary_elements" and row.quantity == "both"]
    path = tmp_path / "cost.csv"
    path.write_text(cost.to_csv(kept, quick=False), encoding="utf-8")
    costs = read_costs(path)
    assert cost_page.single_table(costs) == ""
    assert cost_page.single_table(shipped) != ""
    figure, beside = cost_page.draw(costs), cost_page.draw(shipped)
    assert figure.startswith(b"\x89PNG")
    assert figure != beside
    assert not re.search(r"\| (force|area) \|", cost_page.page(costs))
