"""Scenes beyond tables, without contact, with units; contradictions between arguments."""

import dataclasses

import numpy as np
import pytest

from mbma_tables import (
    ConvergenceError,
    OutOfRangeError,
    Scene,
    Surface,
    contact,
    contact_law,
    greenwood_tripp,
    open_table,
)
from mbma_tables.common.errors import InputError
from mbma_tables.models import IslandAnswer
from mbma_tables.scenes.run import run_plan

CONCRETE = Surface.named("concrete")
# its islands at full compression lie beyond X = 41, where the tables end
DEEP = Surface(0.8, 1.0, 200.0, 1.0, 45.0)


def scene_of(surface=CONCRETE, **given):
    return Scene(surface, **({"effects": ("pressure",), "separations": (0.2, 0.5)} | given))


def with_island_model(scene, island_model):
    """The scene's plan with that island model in every step of the model."""
    plan = scene.plan()
    steps = tuple(
        step if step.island_model is None else dataclasses.replace(step, island_model=island_model)
        for step in plan.steps
    )
    return dataclasses.replace(plan, steps=steps)


@pytest.mark.parametrize("island_model", ["universal", "island4d"])
def test_beyond_a_table_totals_are_solved(island_model):
    scene = scene_of(DEEP, separations=(-44.0, 44.0), rtol=1e-3)
    with pytest.raises(OutOfRangeError):
        contact(DEEP, separation=-44.0, island_model=island_model)
    found = run_plan(scene, with_island_model(scene, island_model))
    truth = contact(DEEP, separation=[-44.0, 44.0], island_model="exact", rtol=1e-6).pressure
    np.testing.assert_allclose(found["pressure"], truth, rtol=1e-3, atol=0)


def test_beyond_a_table_a_law_is_made_of_the_solver(monkeypatch):
    made = []

    def law(surface, rtol, island_model, **rest):
        made.append(island_model)
        if island_model != "exact":
            raise OutOfRangeError("islands outside", True)
        # as good, and quicker
        return contact_law(surface, rtol=rtol, island_model="universal", **rest)

    monkeypatch.setattr("mbma_tables.law.make.contact_law", law)
    scene = scene_of(effects=("energy",), rtol=1e-2)
    found = run_plan(scene, with_island_model(scene, "universal"))
    assert made == ["universal", "exact"]
    assert found.attrs["island_models"] == '{"law": "exact"}'
    np.testing.assert_allclose(found["energy"], contact_law(CONCRETE).energy(separation=[0.2, 0.5]), rtol=1e-2, atol=0)


def test_progress_in_blocks():
    calls = []
    gaps = np.linspace(0.2, 1.0, 130)
    scene = scene_of(separations=gaps, rtol=1e-2)
    run_plan(scene, with_island_model(scene, "exact"), lambda *step: calls.append(step))
    assert calls == [("totals", done, 130) for done in (0, 64, 128, 130, 130)]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"without": ("pressure",)}, "is both on and off"),
        ({"without": ("energy",)}, "'energy' is off unless it is asked for"),
        (
            {"effects": ("pressure_profile",), "separations": None, "deltas": (0.1,), "without": ("finite_height",)},
            "does not touch single islands",
        ),
        (
            {"effects": ("pressure", "pressure_profile"), "deltas": (0.1,), "without": ("sphere_deformation",)},
            "pressure_profile is of the deformed sphere",
        ),
        ({"separations": None, "pressures": (-1.0,)}, "no adhesion in the model"),
        ({"effects": ("conductance",), "conductivities": (1.0, 2.0, 3.0)}, "two numbers"),
        ({"effects": ("conductance",), "conductivities": (1.0, -2.0)}, "positive"),
        ({"effects": ("pressure_profile",), "deltas": (0.1,)}, "are not needed by any effect"),
        ({"island_model": "exakt"}, "did you mean 'exact'"),
        ({"island_model": "exact", "without": ("sphere_deformation",)}, "leave island model out"),
        ({"island_model": object(), "seconds": 1.0}, "give rtol instead of seconds"),
        ({"effects": "pressure"}, "list of names"),
        ({"separations": [[0.5]]}, "one number or a list"),
        ({"rtol": 1.0}, "rtol must be"),
        ({"points": 1}, "points must be"),
        ({"surface": Surface([0.5, 0.7], 1.0, 50.0, 0.1, 0.3)}, "not a batch"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_contradictions(given, said):
    with pytest.raises(InputError, match=said):
        scene_of(**given)


def test_an_island_model_of_choice():
    """Given by name it is taken as it is, and a bound above the tolerance is an error."""
    found = scene_of(island_model="island4d", rtol=1e-3).run()
    assert found.attrs["island_models"] == '{"totals": "island4d"}'
    alone = contact(CONCRETE, separation=[0.2, 0.5], island_model="island4d", rtol=5e-4, quantities=["pressure"])
    np.testing.assert_array_equal(found["pressure"], alone.pressure)
    with pytest.raises(ConvergenceError, match=r"above rtol = 1\.00e-06: give a larger rtol"):
        scene_of(island_model="formula", rtol=1e-6).run()


class Hertzian:
    """An island model of one's own: the exact solver, and a bound ten times its."""

    name = "hertzian"

    def answer(self, X, mu):
        solved = greenwood_tripp.solve(X.ravel(), mu.ravel(), rtol=1e-9)
        return IslandAnswer(*(part.reshape(X.shape) for part in (solved.phi_F, solved.phi_A, 10 * solved.error)))


def test_island_models_as_objects():
    effects = ("pressure", "area", "island_statistics")
    scene = scene_of(effects=effects, island_model=Hertzian(), rtol=1e-5)
    assert "by hertzian  (count=2, rtol=5.0e-06, error not certified, time=not measured)" in scene.explain()
    found, truth = scene.run(), scene_of(effects=effects, island_model="exact", rtol=1e-8).run()
    for name in ("pressure", "area", "island_number", "island_force"):
        np.testing.assert_allclose(found[name], truth[name], rtol=1e-5)
    assert found.attrs["island_models"] == '{"totals": "hertzian", "island statistics": "hertzian"}'
    assert found.attrs["table_hashes"] == "{}"
    law = scene_of(effects=("energy",), island_model=Hertzian(), rtol=1e-2).run()
    np.testing.assert_allclose(law["energy"], contact_law(CONCRETE).energy(separation=[0.2, 0.5]), rtol=1e-2)


def test_a_table_as_an_object_is_the_island_model_with_its_name():
    table = open_table("universal")
    found, same = scene_of(island_model=table).run(), scene_of(island_model="universal").run()
    np.testing.assert_array_equal(found["pressure"], same["pressure"])
    assert found.attrs["table_hashes"] == same.attrs["table_hashes"]


def test_no_contact():
    by_area = Scene(CONCRETE, effects=["pressure", "stiffness"], areas=[0.0]).run()
    assert by_area.separation.values == pytest.approx(1.1)
    assert (by_area.pressure.values, by_area.stiffness.values) == (0, 0)
    assert scene_of(effects=("stiffness",), separations=(2 * CONCRETE.h_max,), rtol=1e-4).run()["stiffness"] == 0
    found = scene_of(effects=("pressure", "island_statistics"), separations=(CONCRETE.h_max, 2.0), points=5).run()
    for name in ("pressure", "island_number", "island_density", "island_force", "island_area", "island_delta"):
        assert (found[name] == 0).all(), name
