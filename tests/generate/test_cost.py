"""The study of costs on few islands and surfaces, its clock replaced: errors, counts, and what goes into the files."""

import numpy as np
import pytest
from click.testing import CliRunner

from generate import cost, cost_distances, distances
from generate.boundary_elements.run import GRIDS
from generate.files import ROOT, read_csv
from generate.pages import cost as pages_cost
from generate.timing import measure
from mbma_tables import Bodies, Scene, Surface, contact
from mbma_tables.design.scenes.plan import read_costs, shipped_costs
from mbma_tables.islands import greenwood_tripp
from mbma_tables.theories import THEORIES, Mbma

COST = 2.0
SECONDS = 1e-3


def once(run):
    """In place of `measure`: the call is made, its cost made up."""
    run()
    return COST, SECONDS


def by_variant(rows):
    return {(row.island_model, row.variant, row.quantity): row for row in rows}


def test_references_agree_with_the_solver():
    surface = cost.SURFACES[3]
    truth = cost.reference()[3]
    answer = contact(
        surface,
        separation=cost.gaps_of(surface)[:: cost.EVERY],
        theory=Mbma(island_model="exact", rtol=1e-10),
    )
    for name in ("pressure", "area"):
        assert getattr(answer, name) == pytest.approx(truth[name], rel=1e-10, abs=0)
    answers = list(cost.reference())
    assert cost.largest_error(answers) == 0
    answers[2] = {"area": answers[2]["area"] * 1.001}
    assert cost.largest_error(answers) == pytest.approx(1e-3, rel=1e-9, abs=0)
    islands, phi = cost.held_out(40)
    solved = greenwood_tripp.solve(islands["X"], islands["mu"], rtol=1e-11)
    assert cost.island_error(solved.phi_F, solved.phi_A, phi) < 1e-11
    assert cost.island_error(1.01 * solved.phi_F, solved.phi_A, phi) == pytest.approx(
        0.01, rel=1e-6, abs=0
    )


def test_totals_laws_and_theories(monkeypatch):
    few = {
        "ISLAND_MODELS": ("universal", "rigid"),
        "RTOLS": (1e-1, 1e-2, 1e-4),
        "LAW_RTOLS": (1e-2,),
    }
    few |= {"SLOW_LAW_RTOLS": (1e-1,), "MANY": 5, "measure": once}
    for name, value in few.items():
        monkeypatch.setattr(cost, name, value)
    rows = by_variant([*cost.gap_rows(), *cost.law_rows()])
    assert {name for model, name, _ in rows if model == "rigid" and "gap" in name} == {
        f"gap rtol=1e-0{k}" for k in (1, 2, 4)
    }
    row = rows["universal", "gap rtol=1e-02", "both"]
    assert row.error < 1e-2
    # a call's cost is taken off, and the rest, here nothing, is shared by the gaps
    assert row.cost == pytest.approx(0, abs=1e-15)
    assert 1 < row.evaluations < 10  # gaps share islands
    assert rows["universal", "call", "both"].cost == pytest.approx(
        COST / 6, rel=1e-12, abs=0
    )
    # spheres that do not deform are not the model
    assert rows["rigid", "gap rtol=1e-02", "both"].error > 1
    assert rows["universal", "law rtol=1e-02", "both"].error < 1e-2
    assert rows["law", "lookup", "both"].cost == COST / 10_000
    rows = by_variant(cost.theory_rows())
    assert {model for model, _, _ in rows} == {
        "calibrated",
        "persson",
        "greenwood_williamson",
    }
    assert {row.variant.partition(" rtol=")[0] for row in rows.values()} == {
        "call",
        "gap",
        "law",
    }
    assert rows["persson", "law rtol=1e-05", "both"].cost == COST
    monkeypatch.setattr(cost, "COUNTS", {"energy": 3})
    rows = by_variant(cost.effect_rows())
    assert {theory for theory, _, _ in rows} == {*THEORIES}
    parts = {what.rpartition(" ")[0] for _, what, _ in rows}
    assert parts == {*cost.EFFECTS} - {"base"}
    # where every scene takes as long, no effect costs anything
    assert max(row.cost for row in rows.values()) == 1e-9


SURFACE = Surface(0.8, 0.0126, 0.8, 0.8, 3.2, unit="um")
GAPS_OF_SCENES = {"separation": (0.2, 2.5), "pressure": (1e-4, 1e-2)}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("theory", "count", "by", "quantities"),
    [
        ("mbma", 1000, "pressure", ["area", "yielded"]),
        ("mbma", 1000, "separation", ["leakage"]),
        ("mbma", 20_000, "pressure", ["area", "stiffness"]),
        ("calibrated", 20_000, "separation", ["area", "yielded"]),
        ("calibrated", 1000, "pressure", ["area", "yielded"]),
        ("calibrated", 1, "separation", ["energy"]),
        ("persson", 20_000, "pressure", ["area", "yielded"]),
        ("greenwood_williamson", 20_000, "pressure", ["area", "yielded"]),
        ("greenwood_williamson", 1, "pressure", ["area", "stiffness"]),
    ],
)
def test_a_scene_of_another_surface_costs_what_its_plan_says(
    theory, count, by, quantities
):
    """Within 2, in units of the fixed work: one of many candidates, none of it cached."""
    gaps = np.geomspace(*GAPS_OF_SCENES[by], count)
    bodies = Bodies("100 GPa", hardness="2 GPa" if "yielded" in quantities else None)

    def scene():
        surface = cost.fresh(SURFACE)
        given = {by: gaps, "theory": theory, "rtol": 1e-4}
        return Scene(surface, bodies, quantities=quantities, **given)

    planned = scene().plan().seconds / shipped_costs().seconds
    measured, _ = measure(lambda: scene().run())
    assert 0.5 < measured / planned < 2


def test_a_study_becomes_data(tmp_path, monkeypatch):
    shipped = shipped_costs()
    seconds = iter([3.0, shipped_costs().seconds, *[2.0] * 6])
    own = [cost.Row(**row) for row in shipped.rows if row["island_model"] != "unit"]
    for name in ("island", "scene", "gap", "law", "theory", "effect", "first_use"):
        monkeypatch.setattr(
            cost, f"{name}_rows", lambda name=name: own if name == "island" else []
        )
    monkeypatch.setattr(cost, "measure", lambda run: (1.0, next(seconds)))
    monkeypatch.setattr(cost_distances, "study", lambda: b"")
    monkeypatch.setattr(cost, "ROOT", tmp_path)
    assert CliRunner().invoke(cost.cost, catch_exceptions=False).exit_code == 0
    # the fastest fixed work seen is the unit
    assert read_costs(tmp_path / "tables" / "cost.csv") == shipped


def test_one_island_model_is_measured_anew_beside_the_others(tmp_path, monkeypatch):
    shipped = shipped_costs()
    few = {"RTOLS": (1e-1,), "SLOW_LAW_RTOLS": (1e-2,), "MANY": 5, "measure": once}
    for name, value in few.items():
        monkeypatch.setattr(cost, name, value)
    monkeypatch.setattr(cost_distances, "measure", once)
    (tmp_path / "tables").mkdir()
    for name in ("cost", "distance"):
        content = (ROOT / "tables" / f"{name}.csv").read_bytes()
        (tmp_path / "tables" / f"{name}.csv").write_bytes(content)
    for module in (cost, cost_distances):
        monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr(cost, "first_use_rows", lambda models: [])
    done = CliRunner().invoke(cost.cost, ["--model", "island4d"], catch_exceptions=False)
    assert done.exit_code == 0
    found = read_costs(tmp_path / "tables" / "cost.csv")
    assert found.seconds == shipped.seconds
    changed = {
        (new["island_model"], new["variant"]): new
        for old, new in zip(shipped.rows, found.rows, strict=True)
        if new != old
    }
    assert set(changed) == {
        ("island4d", name)
        for name in ("island", "call", "gap rtol=1e-01", "law rtol=1e-02")
    }
    assert changed["island4d", "law rtol=1e-02"]["cost"] == pytest.approx(
        COST / 6, rel=1e-3
    )
    before, after = (
        read_csv(folder / "tables" / "distance.csv") for folder in (ROOT, tmp_path)
    )
    (row,) = np.flatnonzero(before["cost"] != after["cost"])
    assert after["way"][row] == "island4d"


def test_the_gauge_names_every_theory_and_way_at_its_measured_place():
    known = read_csv(ROOT / "tables" / "distance.csv")
    rows = pages_cost.gauge_rows(known)
    assert set(rows["theory"]) == set(pages_cost.COLOURS)
    law = rows[(rows["theory"] == "calibrated") & (rows["way"] == "law")].iloc[0]
    shipped = next(
        row
        for row in known.itertuples()
        if (row.theory, row.way) == ("calibrated", "law")
    )
    assert law["us"] == pytest.approx(1e6 * shipped.cost * shipped_costs().seconds)
    assert law["area_light"] == pytest.approx(100 * np.expm1(shipped.area_light))
    simulated = rows[rows["theory"] == "simulated, full grid"].iloc[0]
    assert 1e5 < simulated["us"] < 1e7
    assert simulated["force_light"] < 1 < simulated["area_light"] < 3
    for panel, name in zip(
        pages_cost.draw_gauge(rows).axes, pages_cost.GAUGES, strict=True
    ):
        drawn = {line.get_label(): len(line.get_xydata()) for line in panel.lines}
        assert (
            drawn
            == dict.fromkeys(drawn, 0)
            | rows[rows[name].notna()].groupby("theory").size().to_dict()
        )


@pytest.mark.slow
def test_points_of_theories_are_priced(monkeypatch):
    monkeypatch.setattr(cost_distances, "measure", once)
    monkeypatch.setattr(cost_distances, "SLOW_POINTS", 2)
    prices = {
        (label, way): (cost, made) for label, way, _, cost, made in cost_distances.ways()
    }
    assert {label for label, _ in prices} == set(distances.THEORIES)
    assert prices["calibrated", "law"] == (COST / (3 * cost_distances.POINTS), COST / 3)
    assert prices["MBMA reported", "exact"] == (COST / 6, 0)


def test_grids_converge_and_are_told_by_contact():
    rows = {row.way: row for row in cost_distances.grid_rows()}
    by_grid = [rows[f"{grid} x {grid}, cold"] for grid in GRIDS]
    for name in ("force_light", "force_deep"):
        values = [getattr(row, name) for row in by_grid]
        assert values == sorted(values, reverse=True), name
    for name in ("area_light", "area_deep"):
        values = [getattr(row, name) for row in by_grid]
        # two points a shortest wave and more
        assert values[0] > values[1] > 0.1 > 0.03 > max(values[2:]), name
        assert values[-1] < 0.01
    costs = [row.cost for row in by_grid]
    assert costs == sorted(costs)


def test_the_shipped_distances_are_those_of_the_theories():
    known = read_csv(ROOT / "tables" / "distance.csv")
    shipped = {(row.theory, row.way): row for row in known.itertuples()}
    seen = distances.held_out()
    found = distances.distances(seen, distances.THEORIES["G-W"])
    row = shipped["G-W", "quadrature"]
    for quantity in ("area", "force"):
        for ends, kind in zip(cost_distances.RANGES, ("light", "deep"), strict=True):
            expected = distances.summed_up(seen, found[quantity], *ends)[0]
            assert getattr(row, f"{quantity}_{kind}") == pytest.approx(expected, rel=1e-3)
    # island models solve one theory
    island_models = [
        shipped["MBMA reported", way] for way in ("universal", "exact", "law")
    ]
    assert len({(row.area_light, row.force_deep) for row in island_models}) == 1
