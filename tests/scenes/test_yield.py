"""The effect `yield` of a scene."""

import json

import numpy as np
import pytest

from mbma_tables import InputError, Scene, Surface, contact
from mbma_tables.totals.conductance import conductance, mean_conductivity

SURFACE = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0)
KNOWN = {"surface": SURFACE, "pressures": [1.0, 30.0], "E_star": 100e3}


@pytest.mark.parametrize("theory", ["calibrated", "mbma"])
def test_a_scene_yields_as_contact_does(theory):
    effects = ["pressure", "area", "stiffness", "conductance", "validity", "yield"]
    scene = Scene(**KNOWN, effects=effects, hardness=1500.0, theory=theory, conductivities=(16.0, 167.0))
    step = scene.plan().steps[0]
    assert step.why.endswith("yield")
    assert step.error < 1e-4
    found = scene.run()
    known = contact(SURFACE, pressure=KNOWN["pressures"], E_star=100e3, hardness=1500.0, theory=theory)
    for name in ("area", "yielded", "mean_pressure", "plane_separation", "unloading_stiffness"):
        assert found[name].values == pytest.approx(getattr(known, name), rel=1e-6), name
    assert found.attrs["psi"] == pytest.approx(known.psi)
    assert found.stiffness.values == pytest.approx(known.stiffness, rel=1e-6)
    # not by the loading curve's slope
    own = conductance(known.unloading_stiffness, mean_conductivity(16.0, 167.0), 100e3)
    assert found.conductance.values == pytest.approx(own, rel=1e-6)
    assert found.separation_scatter.values == pytest.approx(known.separation_scatter, rel=1e-6)
    assert (found.conductance.values > 1.05 * conductance(known.stiffness, mean_conductivity(16.0, 167.0), 100e3)).all()


def test_what_a_yielding_scene_costs_is_stated():
    prices = [
        Scene(**KNOWN, effects=["area", *more], theory="calibrated", **given).plan().steps[0].seconds
        for more, given in (([], {}), (["yield"], {"hardness": 1500.0}))
    ]
    assert 2 * prices[0] <= prices[1] <= 3 * prices[0]


def test_theories_compared_yield_too():
    asked = {"mean_separations": [0.5, 1.5], "E_star": 100e3, "hardness": 1500.0}
    effects, others = ["pressure", "area", "comparison", "yield"], ["persson", "calibrated"]
    found = Scene(SURFACE, effects, theories=others, **asked).run()
    elastic = Scene(**KNOWN, effects=["area"], theory="calibrated").run()
    known = contact(SURFACE, pressure=1.0, E_star=100e3, theory="calibrated")
    assert elastic.attrs["elastic_hardness"] == pytest.approx(known.elastic_hardness)
    assert f"elastic_hardness {float(known.elastic_hardness):.4g}" in repr(known)
    for name in others:
        known = contact(SURFACE, mean_separation=[0.5, 1.5], E_star=100e3, hardness=1500.0, theory=name)
        for quantity in ("pressure", "area"):
            assert found[f"{name}_{quantity}"].values == pytest.approx(getattr(known, quantity), rel=1e-9)


def test_a_file_may_call_for_it():
    content = {
        "surface": {"hurst": 0.8, "q0": 0.01, "q1": 2.0, "h_rms": 1.0, "h_max": 3.0, "length_unit": "um"},
        "material": {"E_star": "100 GPa"},
        "theory": "calibrated",
        "effects": {"on": ["area", "yield", "conductance"]},
        "yield": {"hardness": "1500 MPa"},
        "conductance": {"k1": "16 W/(m K)", "k2": "167 W/(m K)"},
        "prescribed": {"pressures": ["30 MPa"]},
    }
    found = Scene.from_mapping(content).run()
    known = contact(SURFACE, pressure=30.0, E_star=100e3, hardness=1500.0, theory="calibrated")
    assert found.area.values == pytest.approx([known.area], rel=1e-9)
    assert found.unloading_stiffness.units == "GPa/um"
    assert found.conductance.units == "W/(m^2 K)"
    assert found.conductance.values == pytest.approx([1e6 * known.conductance(16.0, 167.0)], rel=1e-9)


@pytest.mark.parametrize(
    ("more", "match"),
    [
        ({"effects": ["area", "yield"]}, "effect 'yield' needs hardness"),
        ({"hardness": 1500.0}, "hardness given and effect 'yield' is off"),
        ({"effects": ["energy", "yield"], "hardness": 1500.0}, "'energy' is of elastic contacts"),
        ({"effects": ["area", "yield"], "hardness": 1500.0, "without": ["finite_height"]}, "is of elastic contacts"),
        ({"effects": ["area", "yield"], "hardness": 20.0}, "pressures must be at most the hardness"),
        ({"effects": ["area", "yield"], "hardness": -1.0}, "hardness must be a number in"),
    ],
)
def test_what_contradicts(more, match):
    with pytest.raises(InputError, match=match):
        Scene(**KNOWN, **more)


def test_older_conductances_beside():
    scene = Scene(
        **KNOWN,
        effects=["conductance", "comparison", "yield"],
        hardness=1500.0,
        theory="calibrated",
        conductivities=(16.0, 167.0),
        theories=["cooper_mikic_yovanovich", "mikic", "greenwood_williamson"],
    )
    found = scene.run()
    ratio = found.cooper_mikic_yovanovich_conductance / found.conductance
    assert ((ratio > 0.5) & (ratio < 2)).all()
    slope = np.sqrt(2 * SURFACE.m2 / np.pi)
    k_s = mean_conductivity(16.0, 167.0)
    elastic = 1.55 * k_s * slope * (np.sqrt(2) * np.array(KNOWN["pressures"]) / (slope * 100e3)) ** 0.94
    assert found.mikic_conductance.values == pytest.approx(elastic)
    with pytest.raises(InputError, match="needs a hardness"):
        Scene(
            **KNOWN,
            effects=["conductance", "comparison"],
            conductivities=(1.0, 2.0),
            theories=["cooper_mikic_yovanovich"],
        )


def test_a_plan_of_mbma_that_yields_keeps_the_tolerance():
    known = {"surface": SURFACE, "mean_separations": [1.0], "effects": ["pressure", "yield"], "hardness": 0.01}
    for rtol, island_model in ((1e-6, "universal"), (1e-10, "exact")):
        scene = Scene(**known, rtol=rtol)
        assert scene.plan().error <= rtol
        found = scene.run()
        assert found.attrs["error"] <= rtol
        assert json.loads(found.attrs["island_models"]) == {"contact": island_model}
        assert list(json.loads(found.attrs["table_hashes"])) == [island_model] * (island_model == "universal")
    with pytest.raises(InputError, match="the cost of theory 'mbma' is not known"):
        Scene(**known, seconds=10.0).plan()
