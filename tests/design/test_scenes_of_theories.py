"""Scenes by any theory, and with the effect `yield`: what they answer, how they ask, and what is MBMA's alone."""

import json

import numpy as np
import pytest
from helpers import Springs, contact_of, refusals

from mbma_tables import Bodies, InputError, Scene, Surface, contact
from mbma_tables.bodies.adhesion import Adhesion
from mbma_tables.bodies.bodies import mean_conductivity
from mbma_tables.design.scenes.plan import shipped_costs
from mbma_tables.theories import THEORIES, Mbma

CONCRETE = Surface.named("concrete")
MODULUS = 13.3
PRESSURES = [0.01, 0.1]
QUANTITIES = ("pressure", "area", "stiffness", "energy", "solid_conductance")
each = pytest.mark.parametrize("theory", THEORIES)


def scene_of(theory, **more):
    given = {"bodies": MODULUS, "rtol": 1e-4} | more
    return Scene(CONCRETE, theory=theory, **given)


@pytest.mark.parametrize(
    "theory", [*THEORIES, Springs()], ids=lambda t: getattr(t, "name", t)
)
def test_quantities_at_a_pressure_are_the_contacts(theory):
    bodies = Bodies(MODULUS, conductivity=(1.0, 3.0))
    asked = {"quantities": QUANTITIES, "pressure": PRESSURES, "bodies": bodies}
    found = scene_of(theory, **asked).run()
    truth = contact(CONCRETE, MODULUS, pressure=PRESSURES, theory=theory)
    expected = {
        "separation": truth.separation,
        "mean_separation": truth.mean_separation,
        "pressure": PRESSURES,
        "area": truth.area,
        "stiffness": truth.stiffness,
        "energy": truth.energy,
        "solid_conductance": 1.5 / MODULUS * truth.stiffness,
        "nominal_pressure": PRESSURES,
    }
    for name, values in expected.items():
        assert found[name].values == pytest.approx(values, rel=1e-4), name
    assert found.attrs["theory"] == getattr(theory, "name", theory)
    assert (found.attrs["variant"] == "") == (theory != "mbma")


@pytest.mark.parametrize(
    "theory", [name for name in THEORIES if shipped_costs().of(name, "yield once") > 0]
)
@pytest.mark.parametrize(
    "prescribed",
    [{"pressure": PRESSURES}, {"mean_separation": np.linspace(0.3, 1.0, 50)}],
)
def test_time_budgets(theory, prescribed):
    ample = scene_of(theory, rtol=None, seconds=60.0, **prescribed)
    plan = ample.plan()
    assert plan.error <= plan.rtol
    assert plan.seconds <= 60
    assert ample.run().attrs["error"] <= plan.rtol
    # the same scene at the tolerance found states the same cost
    assert scene_of(theory, rtol=plan.rtol, **prescribed).plan().seconds == plan.seconds
    with pytest.raises(
        InputError,
        match=r"seconds = 1e-08 is too little: the cheapest plan takes about \d",
    ):
        scene_of(theory, rtol=None, seconds=1e-8, **prescribed).plan()


@each
def test_many_gaps_go_through_the_law_where_that_costs_less(theory):
    u = np.linspace(0.3, 1.0, 200_000)
    own = contact(
        CONCRETE, mean_separation=[0.5, 0.99 * CONCRETE.h_max], theory=theory
    ).error.max()
    rtol = max(1e-5, 3 * own)
    some = slice(None, None, 3700)
    truth = contact(CONCRETE, MODULUS, mean_separation=u[some], theory=theory)
    for asked, by_law, seen in ((u, True, some), (u[some], False, slice(None))):
        scene = scene_of(theory, mean_separation=asked, rtol=rtol)
        (step,) = scene.plan().steps
        assert (step.name == "law") == (by_law and theory != "mbma")
        found = scene.run()
        assert found["pressure"].values[seen] == pytest.approx(truth.pressure, rel=rtol)
        assert found["area"].values[seen] == pytest.approx(truth.area, rel=rtol)
    # slopes are the theory's own
    slopes = scene_of(
        theory, quantities=("stiffness",), mean_separation=u[some], rtol=rtol
    ).run()
    assert slopes["stiffness"].values == pytest.approx(truth.stiffness, rel=1e-5)


@each
def test_validity_is_a_quantity(theory):
    # of gaps that are numbers, so that both are asked the same
    u = (CONCRETE.h_max + np.array([0.5, -1.0])) / 2
    scene = scene_of(theory, quantities=("pressure", "valid"), mean_separation=u)
    text = scene.explain()
    found = scene.run()
    assert f"  theory: {theory}\n" in text
    assert (
        "-> contact by universal" if theory == "mbma" else f"-> contact by {theory}"
    ) in text
    truth = contact(CONCRETE, mean_separation=u, theory=theory)
    assert found["valid"].values.tolist() == truth.valid.tolist()
    np.testing.assert_array_equal(found["scatter"], truth.scatter)
    np.testing.assert_array_equal(found["area_scatter"], truth.area_scatter)
    assert set(json.loads(found.attrs["reasons"])) == set(truth.reasons)
    assert "valid" not in scene_of(theory, mean_separation=u).run()


test_what_is_refused = refusals(
    lambda more: scene_of(**({"theory": "persson", "separation": [0.5]} | more)).run(),
    ({"theory": "person"}, "no theory is named 'person'; did you mean 'persson'"),
    ({"without": ("sphere_deformation",)}, "without: of theory 'mbma'"),
    ({"points": 64}, "points: of theory 'mbma', not of 'persson'"),
    ({"deltas": [0.1]}, "deltas: of theory 'mbma', not of 'persson'"),
    ({"theories": ("persson",)}, "by theory 'persson' itself"),
    (
        {"area": [0.1]},
        "give exactly one of separation, mean_separation, pressure, area; got ",
    ),
    ({"separation": None, "area": [-0.1]}, "area must be at least 0"),
    ({"theory": 3}, "theory must be one of"),
)


SURFACE = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0)
PRESSED = {"surface": SURFACE, "pressure": [1.0, 30.0]}


@pytest.mark.parametrize("theory", ["calibrated", "mbma"])
def test_a_scene_yields_as_contact_does(theory):
    asked = ["pressure", "area", "stiffness", "solid_conductance", "valid"]
    bodies = Bodies(100e3, hardness=1500.0, conductivity=(16.0, 167.0))
    scene = Scene(**PRESSED, bodies=bodies, quantities=asked, theory=theory)
    step = scene.plan().steps[0]
    assert "hardness" in step.why
    assert step.error < 1e-4
    found = scene.run()
    known = contact(
        SURFACE,
        Bodies(100e3, hardness=1500.0),
        pressure=PRESSED["pressure"],
        theory=theory,
    )
    for name in (
        "area",
        "yielded",
        "mean_pressure",
        "plane_separation",
        "unloading_stiffness",
    ):
        assert found[name].values == pytest.approx(getattr(known, name), rel=1e-6), name
    assert found.attrs["psi"] == pytest.approx(known.psi)
    assert found.stiffness.values == pytest.approx(known.stiffness, rel=1e-6)
    own = mean_conductivity(16.0, 167.0) / 100e3 * known.unloading_stiffness
    assert found.solid_conductance.values == pytest.approx(own, rel=1e-6)
    assert found.separation_scatter.values == pytest.approx(
        known.separation_scatter, rel=1e-6
    )
    assert (
        found.solid_conductance.values
        > 1.05 * mean_conductivity(16.0, 167.0) / 100e3 * known.stiffness
    ).all()


@pytest.mark.parametrize("cap", [{}, {"hardness": 1500.0}], ids=["elastic", "yield"])
def test_theories_beside_one_another(cap):
    others = ["persson", "calibrated"]
    asked = {"mean_separation": [0.5, 1.5], "theories": others, "theory": "mbma"}
    found = Scene(SURFACE, Bodies(100e3, **cap), **asked).run()
    for name in others:
        known = contact_of(SURFACE, 100e3, mean_separation=[0.5, 1.5], theory=name, **cap)
        for quantity in ("pressure", "area"):
            assert found[f"{name}_{quantity}"].values == pytest.approx(
                getattr(known, quantity), rel=1e-9
            )
    elastic = Scene(
        **PRESSED, bodies=100e3, quantities=["area"], theory="calibrated"
    ).run()
    known = contact(SURFACE, 100e3, pressure=1.0, theory="calibrated")
    assert elastic.attrs["elastic_hardness"] == pytest.approx(known.elastic_hardness)
    assert f"elastic_hardness {float(known.elastic_hardness):.4g}" in repr(known)


def test_a_file_may_call_for_it():
    content = {
        "surface": {
            "hurst": 0.8,
            "q0": 0.01,
            "q1": 2.0,
            "h_rms": 1.0,
            "h_max": 3.0,
            "length_unit": "um",
        },
        "bodies": {
            "E_star": "100 GPa",
            "hardness": "1500 MPa",
            "conductivity": ["16 W/(m K)", "167 W/(m K)"],
        },
        "theory": "calibrated",
        "quantities": ["area", "solid_conductance"],
        "pressure": ["30 MPa"],
    }
    found = Scene.from_mapping(content).run()
    known = contact(
        SURFACE,
        Bodies(100e3, hardness=1500.0, conductivity=(16.0, 167.0)),
        pressure=30.0,
        theory="calibrated",
    )
    assert found.area.values == pytest.approx([known.area], rel=1e-9)
    assert found.unloading_stiffness.units == "GPa/um"
    assert found.solid_conductance.units == "W/(m^2 K)"
    assert found.solid_conductance.values == pytest.approx(
        [1e6 * known.solid_conductance], rel=1e-9
    )


test_what_contradicts = refusals(
    lambda more: Scene(**PRESSED, **more),
    (
        {"bodies": Bodies(hardness=50.0), "without": ["finite_height"]},
        "without: of elastic contacts",
    ),
    ({"bodies": Bodies(hardness=50.0), "points": 9}, "points: of elastic contacts"),
    ({"bodies": Bodies(hardness=-1.0)}, "hardness must be positive"),
)


def test_a_plan_of_mbma_that_yields_keeps_the_tolerance():
    known = {
        "surface": SURFACE,
        "mean_separation": [1.0],
        "quantities": ["pressure"],
        "bodies": Bodies(hardness=0.01),
        "theory": "mbma",
    }
    for rtol, island_model in ((1e-6, "universal"), (1e-10, "exact")):
        scene = Scene(**known, rtol=rtol)
        assert scene.plan().error <= rtol
        found = scene.run()
        assert found.attrs["error"] <= rtol
        assert json.loads(found.attrs["island_models"]) == {"contact": island_model}
        assert list(json.loads(found.attrs["table_hashes"])) == [island_model] * (
            island_model == "universal"
        )
    assert Scene(**known, seconds=1.0).plan().seconds <= 1
    with pytest.raises(
        InputError,
        match="the cost of theory 'springs' is not known: give rtol instead of seconds",
    ):
        Scene(**known | {"theory": Springs()}, seconds=10.0).plan()


def test_what_the_plan_chooses_can_be_given_by_the_theory():
    asked = {"separation": [0.5, 0.7], "without": ["subscale_area"]}
    options = {"island_model": "exact", "variant": "printed"}
    found = Scene(CONCRETE, theory=Mbma(**options, rtol=1e-4), **asked).run()
    assert set(json.loads(found.attrs["island_models"]).values()) == {"exact"}
    assert (found.attrs["variant"], found.attrs["rtol"]) == ("printed", 1e-4)
    beside = Scene(CONCRETE, theory=Mbma(**options), **asked, rtol=1e-4).run()
    surface = {"name": "concrete"}
    of_file = Scene.from_mapping({"surface": surface, "rtol": 1e-4} | options | asked)
    for other in (beside, of_file.run()):
        for name in ("theory", "variant", "rtol", "island_models"):
            assert other.attrs[name] == found.attrs[name]
        np.testing.assert_array_equal(other["pressure"], found["pressure"])
    for given, said in (
        ({"theory": Mbma(rtol=1e-4), "rtol": 1e-6}, "rtol and rtol of the theory are"),
        ({"theory": Mbma(outside="nan")}, "outside: a scene solves"),
    ):
        with pytest.raises(InputError, match=said):
            Scene(CONCRETE, **asked, **given)
    with pytest.raises(InputError, match="island_model: options of theory 'mbma' alone"):
        Scene.from_mapping(
            {"surface": surface, "theory": "persson", "island_model": "exact"}
        )


def test_bodies_are_those_of_contacts():
    """A scene took a modulus, a hardness and conductivities by names of its own, and no metals."""
    metals = ("steel 4140 hard", "aluminium 6061 hard")
    surface = Surface(0.8, 0.01, 2.0, 1.0, 3.0, unit="um")
    asked = {"pressure": ["30 MPa"], "theory": "calibrated"}
    quantities = ["area", "solid_conductance", "tangential_stiffness"]
    found = Scene(surface, metals, **asked, quantities=quantities).run()
    known = contact(surface, metals, **asked)
    for name in (*quantities, "yielded", "plane_separation"):
        np.testing.assert_allclose(found[name], known.quantity(name), rtol=1e-9)
        assert found[name].attrs["units"] == known.units[name]


def test_bodies_that_attract_each_other_may_be_pulled():
    """A scene refused every negative pressure."""
    surface = Surface(0.8, 0.1, 2.0, 0.02, 0.07, unit="um")
    sticky = Bodies("1 GPa", adhesion=Adhesion("10 mJ/m^2", "20 nm"))
    known = contact(surface, sticky, pressure="0 MPa", theory="calibrated")
    pulled = [-0.5 * float(known.pull_off)]
    asked = {"pressure": pulled, "theory": "calibrated"}
    found = Scene(surface, sticky, **asked, quantities=["area"]).run()
    truth = contact(surface, sticky, **asked)
    assert found["area"].values == pytest.approx(truth.area, rel=1e-6)
    with pytest.raises(InputError, match="pressure must be at least 0"):
        Scene(surface, "1 GPa", **asked)
