"""Scenes by any theory: what they answer, how they ask, what they say of themselves, and what is MBMA's alone."""

import json

import numpy as np
import pytest
from helpers import Springs

from mbma_tables import InputError, Scene, Surface, contact, contact_law
from mbma_tables.theories import THEORIES, Persson

CONCRETE = Surface.named("concrete")
MODULUS = 13.3
PRESSURES = [0.01, 0.1]
QUANTITIES = ("pressure", "area", "stiffness", "energy", "conductance")
each = pytest.mark.parametrize("theory", THEORIES)


def scene_of(theory, **more):
    given = {"effects": ("pressure", "area"), "E_star": MODULUS, "rtol": 1e-4} | more
    return Scene(CONCRETE, theory=theory, **given)


@pytest.mark.parametrize("theory", [*THEORIES, Springs()], ids=lambda t: getattr(t, "name", t))
def test_quantities_at_a_pressure_are_the_contacts(theory):
    found = scene_of(theory, effects=QUANTITIES, pressures=PRESSURES, conductivities=(1.0, 3.0)).run()
    truth = contact(CONCRETE, pressure=PRESSURES, E_star=MODULUS, theory=theory)
    expected = {
        "separation": truth.separation,
        "mean_separation": truth.mean_separation,
        "pressure": PRESSURES,
        "area": truth.area,
        "stiffness": truth.stiffness,
        "energy": truth.energy,
        "conductance": 1.5 / MODULUS * truth.stiffness,
        "nominal_pressure": PRESSURES,
    }
    for name, values in expected.items():
        assert found[name].values == pytest.approx(values, rel=1e-4), name
    assert found.attrs["theory"] == getattr(theory, "name", theory)
    assert (found.attrs["variant"] == "") == (theory != "mbma")


@each
@pytest.mark.parametrize("prescribed", [{"pressures": PRESSURES}, {"mean_separations": np.linspace(0.3, 1.0, 50)}])
def test_time_budgets(theory, prescribed):
    ample = scene_of(theory, rtol=None, seconds=60.0, **prescribed)
    plan = ample.plan()
    assert plan.error <= plan.rtol
    assert plan.seconds <= 60
    assert ample.run().attrs["error"] <= plan.rtol
    # the same scene at the tolerance found states the same cost
    assert scene_of(theory, rtol=plan.rtol, **prescribed).plan().seconds == plan.seconds
    with pytest.raises(InputError, match=r"seconds = 1e-08 is too little: the cheapest plan takes about \d"):
        scene_of(theory, rtol=None, seconds=1e-8, **prescribed).plan()


def test_a_budget_needs_a_measured_cost():
    with pytest.raises(InputError, match="the cost of theory 'springs' is not known: give rtol instead of seconds"):
        scene_of(Springs(), rtol=None, seconds=1.0, mean_separations=[0.5]).plan()


@each
def test_many_gaps_go_through_the_law_where_that_costs_less(theory):
    u = np.linspace(0.3, 1.0, 200_000)
    # a law states the error of its worst gap
    own = contact(CONCRETE, mean_separation=[0.5, 0.99 * CONCRETE.h_max], theory=theory).error.max()
    rtol = max(1e-5, 3 * own)
    some = slice(None, None, 3700)
    truth = contact(CONCRETE, mean_separation=u[some], E_star=MODULUS, theory=theory)
    # between the two counts the measured costs decide
    for asked, by_law, seen in ((u, True, some), (u[some], False, slice(None))):
        scene = scene_of(theory, mean_separations=asked, rtol=rtol)
        (step,) = scene.plan().steps
        assert (step.name == "law") == by_law
        found = scene.run()
        assert found["pressure"].values[seen] == pytest.approx(truth.pressure, rel=rtol)
        assert found["area"].values[seen] == pytest.approx(truth.area, rel=rtol)
    # slopes are asked of the theory itself, or of MBMA's law, which bounds them
    slopes = scene_of(theory, effects=("stiffness",), mean_separations=u[some], rtol=rtol).run()
    assert slopes["stiffness"].values == pytest.approx(truth.stiffness, rel=1e-5)


def test_areas_that_mbma_reaches_within_the_bound_stated():
    law = contact_law(CONCRETE, rtol=1e-9, E_star=MODULUS)
    areas = law.area(separation=np.array([0.9, 0.5, 0.0, -1.0]))
    found = scene_of("mbma", areas=areas, rtol=1e-6).run()
    truth = law.pressure(separation=law.separation(area=areas))
    assert np.abs(found["pressure"].values / truth - 1).max() <= found.attrs["error"] <= 1e-6


@each
def test_a_plan_names_its_theory(theory):
    text = scene_of(theory, pressures=PRESSURES).explain()
    assert f"  theory: {theory}\n" in text
    assert ("by universal" in text) == (theory == "mbma")
    assert (f"-> contact by {theory}" in text) == (theory != "mbma")


@each
def test_validity_is_an_effect(theory):
    # of gaps that are numbers, so that both are asked the same
    u = (CONCRETE.h_max + np.array([0.5, -1.0])) / 2
    found = scene_of(theory, effects=("pressure", "validity"), mean_separations=u).run()
    truth = contact(CONCRETE, mean_separation=u, theory=theory)
    assert found["valid"].values.tolist() == truth.valid.tolist()
    np.testing.assert_array_equal(found["scatter"], truth.scatter)
    np.testing.assert_array_equal(found["area_scatter"], truth.area_scatter)
    assert set(json.loads(found.attrs["reasons"])) == set(truth.reasons)
    assert "valid" not in scene_of(theory, mean_separations=u).run()


def test_theories_beside_one_another():
    found = scene_of("persson", effects=("pressure", "comparison"), theories=("mbma",), separations=[0.2]).run()
    for theory, name in (("persson", "pressure"), ("mbma", "mbma_pressure")):
        assert found[name].item() == pytest.approx(
            contact(CONCRETE, separation=0.2, E_star=MODULUS, theory=theory).pressure
        )


@pytest.mark.parametrize(
    ("more", "match"),
    [
        ({"theory": "person"}, "no theory is named 'person'; did you mean 'persson'"),
        ({"island_model": "exact"}, "island_model: of theory 'mbma', not of 'persson'"),
        ({"variant": "printed"}, "variant: of theory 'mbma'"),
        ({"without": ("sphere_deformation",)}, "without: of theory 'mbma'"),
        ({"effects": ("island_statistics",)}, "effect 'island_statistics': of theory 'mbma'"),
        ({"effects": ("comparison",), "theories": ("persson",)}, "by theory 'persson' itself"),
        ({"areas": [0.1]}, "prescribe one of separations, mean_separations, pressures, areas"),
        ({"separations": None, "areas": [-0.1]}, "areas must be at least 0"),
        ({"theory": 3}, "theory must be one of"),
    ],
)
def test_what_is_refused(more, match):
    with pytest.raises(InputError, match=match):
        scene_of(**({"theory": "persson", "separations": [0.5]} | more)).run()


def test_a_file_and_an_object_ask_the_same():
    content = {
        "theory": "persson",
        "surface": {"name": "concrete"},
        "effects": {"on": ["pressure", "area"]},
        "prescribed": {"areas": [0.01, 0.1]},
    }
    by_file, by_object = Scene.from_mapping(content).run(), scene_of(Persson(), E_star=1.0, areas=[0.01, 0.1]).run()
    assert by_file["pressure"].values.tolist() == by_object["pressure"].values.tolist()
    assert by_file["area"].values == pytest.approx([0.01, 0.1], rel=1e-9)


def test_energies_of_many_gaps_reach_beyond_a_law():
    surface = Surface.named("concrete")
    u = np.linspace(0.8, 0.98, 400) * surface.h_max
    known = {"theory": "greenwood_williamson", "mean_separations": u, "rtol": 1e-5}
    found = Scene(surface, effects=["pressure", "energy"], **known).run()
    expected = contact(surface, mean_separation=u, theory="greenwood_williamson").energy
    assert found.energy.values == pytest.approx(expected, rel=1e-5)
