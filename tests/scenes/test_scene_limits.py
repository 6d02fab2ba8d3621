"""Scenes whose tables do not reach, whose gaps do not touch, whose units are named; and contradictions told."""

import dataclasses
import math

import numpy as np
import pytest

from mbma_tables import ConvergenceError, OutOfRangeError, Scene, Surface, TableFileError, contact, contact_law
from mbma_tables.errors import InputError
from mbma_tables.scenes import costs as costs_module
from mbma_tables.scenes import plan as plan_module
from mbma_tables.scenes.costs import shipped_costs
from mbma_tables.scenes.plan import make_plan
from mbma_tables.scenes.run import run_scene

CONCRETE = Surface.named("concrete")
# its islands at full compression lie beyond X = 41, where the tables end
DEEP = Surface(0.8, 1.0, 200.0, 1.0, 45.0)


def scene_of(surface=CONCRETE, **given):
    return Scene(surface, **({"effects": ("force",), "separations": (0.2, 0.5)} | given))


def tiered(scene, tier):
    """The scene's plan with that tier in every step of the model."""
    plan = scene.plan()
    steps = tuple(step if step.tier is None else dataclasses.replace(step, tier=tier) for step in plan.steps)
    return dataclasses.replace(plan, steps=steps)


@pytest.mark.parametrize("tier", ["universal", "island4d"])
def test_beyond_a_table_totals_are_solved(tier):
    scene = scene_of(DEEP, separations=(-44.0, 44.0), rtol=1e-3)
    with pytest.raises(OutOfRangeError):
        contact(DEEP, -44.0, tier)
    found = run_scene(scene, tiered(scene, tier))
    truth = contact(DEEP, [-44.0, 44.0], tier="exact", rtol=1e-6).force
    np.testing.assert_allclose(found["force"], truth, rtol=1e-3, atol=0)


def test_beyond_a_table_a_law_is_made_of_the_solver(monkeypatch):
    made = []

    def law(surface, rtol, tier, *rest):
        made.append(tier)
        if tier != "exact":
            raise OutOfRangeError("islands outside", True)
        # as good, and quicker
        return contact_law(surface, rtol, "universal", *rest)

    monkeypatch.setattr("mbma_tables.totals.law.contact_law", law)
    scene = scene_of(effects=("energy",), rtol=1e-2)
    found = run_scene(scene, tiered(scene, "universal"))
    assert made == ["universal", "exact"]
    assert found.attrs["tiers"] == '{"law": "exact"}'
    np.testing.assert_allclose(found["energy"], contact_law(CONCRETE).energy([0.2, 0.5]), rtol=1e-2, atol=0)


@pytest.mark.parametrize("effects", [("force",), ("energy",)])
def test_what_no_solver_answers_stays_an_error(effects, monkeypatch):
    def refuse(*_, **__):
        raise OutOfRangeError("islands outside", True)

    monkeypatch.setattr("mbma_tables.totals.law.contact_law", refuse)
    monkeypatch.setattr("mbma_tables.totals.contact.contact", refuse)
    scene = scene_of(effects=effects, rtol=1e-3)
    with pytest.raises(OutOfRangeError, match="islands outside"):
        run_scene(scene, tiered(scene, "exact"))


def test_a_bound_that_was_not_reached_is_an_error():
    scene = scene_of(rtol=1e-3)
    with pytest.raises(ConvergenceError, match=r"above rtol = 1\.00e-03; ask for more"):
        run_scene(scene, tiered(scene, "rigid"))


def test_gaps_that_do_not_touch_hold_no_islands():
    found = scene_of(effects=("force", "island_statistics"), separations=(CONCRETE.h_max, 2.0), points=5).run()
    for name in ("force", "island_number", "island_density", "island_force", "island_area", "island_delta"):
        assert (found[name] == 0).all(), name


def test_progress_in_blocks():
    told = []
    gaps = np.linspace(0.2, 1.0, 130)
    scene = scene_of(separations=gaps, rtol=1e-2)
    run_scene(scene, tiered(scene, "exact"), lambda *step: told.append(step))
    assert told == [("totals", done, 130) for done in (0, 64, 128, 130, 130)]


@pytest.mark.parametrize(
    ("given", "units"),
    [
        ({}, ("1", "1/length", "length")),
        ({"E_star": 2.0}, ("stress", "stress/length", "stress length")),
        ({"E_star": 2.0, "stress_unit": "MPa", "length_unit": "mm"}, ("MPa", "MPa/mm", "MPa mm")),
    ],
)
def test_units(given, units):
    found = scene_of(effects=("force", "stiffness", "energy"), rtol=1e-3, **given).run()
    assert tuple(found[name].attrs["units"] for name in ("force", "stiffness", "energy")) == units


def test_rigid_spheres_pay_for_what_they_are_not():
    scene = scene_of(separations=(1.095,), rtol=0.1)
    found = run_scene(scene, dataclasses.replace(tiered(scene, "rigid"), rtol=0.5))
    error = plan_module.rigid_error(scene)
    assert 0 < error < found.attrs["error"] < 0.2
    truth = contact(CONCRETE, [1.095], rtol=1e-8).force
    np.testing.assert_allclose(found["force"], truth, rtol=found.attrs["error"], atol=0)


def test_no_contact_needs_no_elasticity():
    assert plan_module.rigid_error(scene_of(separations=(2.0,))) == 0.0
    average = (CONCRETE.h_max + 0.5) / 2
    own = scene_of(separations=None, mean_separations=(average,))
    same = plan_module.rigid_error(scene_of(separations=(0.5,)))
    assert plan_module.rigid_error(own) == pytest.approx(same, rel=1e-9, abs=0)


def test_the_top_of_a_whole_gaussian_by_mean_separations():
    own = scene_of(separations=(0.5,), without=("finite_height",))
    average = scene_of(separations=None, mean_separations=((CONCRETE.h_max + 0.5) / 2,), without=("finite_height",))
    assert plan_module.top_of(average, 1e-6) == pytest.approx(plan_module.top_of(own, 1e-6), rel=1e-14, abs=0)
    tail = (math.sqrt(2 * (10 - math.log(1e-6))) + 1) * float(CONCRETE.s)
    assert plan_module.top_of(own, 1e-6) == pytest.approx(0.5 + tail, rel=1e-14, abs=0)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"without": ("force",)}, "is both on and off"),
        ({"without": ("energy",)}, "'energy' is off unless it is asked for"),
        ({"without": ("subscale_area",)}, "subscale_area changes areas alone"),
        ({"effects": ("finite_height",)}, "no effect is asked for"),
        ({"effects": ("energy",), "without": ("finite_height",)}, "comes from a law"),
        (
            {"effects": ("comparison",), "theories": ("persson",), "without": ("finite_height",)},
            "does not touch other theories",
        ),
        (
            {"effects": ("pressure_profile",), "separations": None, "deltas": (0.1,), "without": ("finite_height",)},
            "does not touch single islands",
        ),
        (
            {"effects": ("force", "pressure_profile"), "deltas": (0.1,), "without": ("sphere_deformation",)},
            "pressure_profile is of the deformed sphere",
        ),
        ({"separations": None, "nominal_pressures": (-1.0,)}, "no adhesion in the model"),
        (
            {"separations": None, "nominal_pressures": (1.0,), "without": ("finite_height",)},
            "nominal_pressures need a law",
        ),
        ({"separations": None, "mean_separations": (-0.1,)}, "where the model ends"),
        ({"conductivities": (1.0, 2.0)}, "conductivities are given and effect 'conductance' is off"),
        ({"effects": ("conductance",), "conductivities": (1.0, 2.0, 3.0)}, "two numbers"),
        ({"effects": ("conductance",), "conductivities": (1.0, -2.0)}, "positive"),
        ({"effects": ("comparison",), "theories": ("person",)}, "did you mean 'persson'"),
        ({"effects": ("comparison",)}, "needs theories"),
        ({"effects": ("pressure_profile",), "deltas": (0.1,)}, "serve nothing that is asked for"),
        ({"separations": None}, "nothing is prescribed"),
        ({"mean_separations": (1.0,)}, "prescribe one of"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_contradictions(given, said):
    with pytest.raises(InputError, match=said):
        scene_of(**given)


def costs_of(tiers):
    """The shipped data without the totals, laws and profiles of other tiers."""
    own = shipped_costs()
    kept = {key: rows for key, rows in own.rows.items() if key[1] not in ("gap", "law") or key[0] in tiers}
    return dataclasses.replace(own, rows=kept)


def test_tiers_without_a_measured_cost_are_not_planned():
    scene = scene_of(rtol=1e-3)
    for tier in ("island4d", "universal", "exact"):
        assert make_plan(scene, costs_of((tier, "exact"))).step("totals").tier == tier


@pytest.mark.parametrize(
    "given",
    [
        {"effects": ("area",), "without": ("subscale_area",)},
        {"effects": ("island_statistics",)},
        {"without": ("finite_height",)},
    ],
    ids=["hertz area", "island statistics", "whole gaussian"],
)
def test_what_no_tier_answers_is_told(given):
    with pytest.raises(InputError, match="is met by none of"):
        make_plan(scene_of(rtol=1e-3, **given), costs_of(()))


def test_a_law_of_unmeasured_cost_is_made_of_300_totals():
    scene = scene_of(effects=("energy",), rtol=1e-3)
    costs = costs_of(("exact",))
    without = dataclasses.replace(costs, rows={key: rows for key, rows in costs.rows.items() if key[1] != "law"})
    (step,) = make_plan(scene, without).steps
    assert (step.name, step.tier) == ("law", "exact")
    least = 300 * without.of("exact", "gap", 0.1 * step.rtol)
    assert least <= step.seconds <= 1.5 * least + without.of("exact", "import")


def test_a_law_cannot_be_that_tight():
    with pytest.raises(InputError, match="is too tight for energy: a law meets"):
        scene_of(effects=("energy",), rtol=1e-9).plan()


def test_more_time_buys_more_accuracy_to_where_no_plan_is_left():
    plans = [scene_of(effects=("energy",), rtol=None, seconds=seconds).plan() for seconds in (10.0, 1e6)]
    assert plans[1].rtol <= plans[0].rtol
    assert plans[1].rtol > 1e-9
    with pytest.raises(InputError, match="is too little: the cheapest plan takes about"):
        scene_of(rtol=None, seconds=1e-7).plan()


def test_another_reading_takes_no_four_number_table():
    found = plan_module.candidates(scene_of(reading="printed"), 1e-3)
    assert "island4d" not in found
    assert "universal" in found
    assert plan_module.candidates(scene_of(without=("sphere_deformation",)), 1e-3).keys() == {"rigid"}


def test_measuring_ends_after_its_rounds(monkeypatch):
    clock = iter(np.arange(0.0, 1e3, 1e-4))
    monkeypatch.setattr(costs_module.time, "perf_counter", lambda: next(clock))
    monkeypatch.setattr(costs_module, "_work_seconds", lambda: 1e-4)
    calls = []
    cost, seconds = costs_module.measure(lambda: calls.append(1), budget=math.inf)
    # each repetition is 20 calls in one tick of the clock
    assert len(calls) == 2 + 20 * costs_module.ROUNDS[1]
    assert cost == pytest.approx(1 / 20, rel=1e-9, abs=0)
    assert seconds == 1e-4


def test_nothing_to_calibrate_by():
    with pytest.raises(TableFileError, match="nothing to calibrate by"):
        costs_module.calibrate(costs_of(()))
