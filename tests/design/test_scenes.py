"""What scenes plan, compute and leave alone; beyond tables, without contact; contradictions between arguments."""

import dataclasses
import importlib
import itertools
import json
import subprocess
import sys

import numpy as np
import pytest
from helpers import refusals
from scipy.integrate import quad

from mbma_tables import (
    Bodies,
    ConvergenceError,
    OutOfRangeError,
    Scene,
    Surface,
    contact,
    contact_law,
    island,
    open_table,
)
from mbma_tables.contacts.quantities import declaration, registry
from mbma_tables.design.scenes import plan as plans
from mbma_tables.design.scenes import run as runs
from mbma_tables.islands.island_models import RigidModel, answer_islands
from mbma_tables.islands.variants import REPORTED
from mbma_tables.theories import GreenwoodWilliamson, Mbma, Persson
from mbma_tables.theories.mbma.island import scale_area
from mbma_tables.theories.mbma.profile import source_of
from mbma_tables.theories.yielding.theory import Yielding

CONCRETE = Surface.named("concrete")
GAPS = (0.2, 0.5, 0.9)
# what is requested by other arguments than quantities
PARTS = {
    "yield": {"bodies": Bodies(hardness=0.1)},
    "deltas": {"deltas": [0.1]},
    "points": {"points": 64},
    "theories": {"theories": ("greenwood_williamson",)},
}


def arguments_of(requested, more=()):
    quantities = [name for name in requested if name not in PARTS]
    given = {"quantities": quantities, "rtol": 1e-3}
    for name in requested:
        given |= PARTS.get(name, {})
    if "solid_conductance" in requested:
        hardness = 0.1 if "yield" in requested else None
        E_star = more.get("bodies", 1.0) if more else 1.0
        given["bodies"] = Bodies(E_star, hardness=hardness, conductivity=(1.0, 3.0))
    if "yield" in requested and not quantities:
        given["quantities"] = ["pressure"]
    if set(requested) != {"deltas"} and "pressure" not in more:
        given["separation"] = GAPS
    return given


def scene_of(*requested, **more):
    return Scene(CONCRETE, **(arguments_of(requested, more) | {"rtol": 1e-6} | more))


@pytest.mark.parametrize("rtol", [1e-1, 1e-3, 1e-5, 1e-7, 1e-9])
def test_totals_are_within_the_tolerance(rtol):
    found = scene_of("pressure", "area", rtol=rtol).run()
    truth = contact(
        CONCRETE, separation=GAPS, theory=Mbma(island_model="exact", rtol=1e-10)
    )
    np.testing.assert_allclose(found["pressure"], truth.pressure, rtol=rtol)
    np.testing.assert_allclose(found["area"], truth.area, rtol=rtol)
    assert found.attrs["error"] <= rtol


@pytest.mark.parametrize("rtol", [1e-2, 1e-5])
def test_pressures_stiffness_and_energy(rtol):
    exact = contact_law(CONCRETE, 2.0, theory="mbma", rtol=1e-9)
    pressures = exact.pressure(separation=np.array(GAPS))
    bodies = Bodies(2.0, conductivity=(1.0, 3.0))
    more = {"pressure": pressures, "bodies": bodies, "rtol": rtol, "theory": "mbma"}
    found = scene_of(
        "pressure", "area", "stiffness", "energy", "solid_conductance", **more
    ).run()
    np.testing.assert_allclose(
        found["area"], exact.area(separation=np.array(GAPS)), rtol=rtol
    )
    # central differences of fresh totals, with an error of h^2
    h = 1e-4
    ends = [
        contact(
            CONCRETE, 2.0, separation=np.array(GAPS) + s * h, theory=Mbma(rtol=1e-10)
        ).pressure
        for s in (1, -1)
    ]
    slope = (ends[1] - ends[0]) / h  # by u, which moves half as far
    np.testing.assert_allclose(found["stiffness"], slope, rtol=rtol + 2e-6)
    np.testing.assert_allclose(
        found["solid_conductance"], 1.5 / 2 * slope, rtol=rtol + 2e-6
    )
    for gap, energy in zip(GAPS, found["energy"].values, strict=True):
        assert energy == pytest.approx(
            quad(lambda d: exact.pressure(separation=d), gap, exact.h_max, epsrel=1e-9)[0]
            / 2,
            rel=rtol + 1e-8,
            abs=0,
        )


def hertz_area(gap):
    """A/A0 with eta = 1 by scipy's quadrature over the islands of CONCRETE."""
    shape = (
        float(CONCRETE.hurst),
        float(CONCRETE.zeta_1),
        float(CONCRETE.h_max / CONCRETE.h_rms),
    )
    source = source_of(shape, REPORTED)
    depth = float((CONCRETE.h_max - gap) / CONCRETE.h_rms)

    def integrand(x):
        g = source.islands(np.array([x]))
        shift, rate = source.heights(g, x)
        share = (
            scale_area(g) * answer_islands(open_table("universal"), g).phi_A / g["eta"]
        )
        return float(
            (share * source.density(g, x, shift - rate * depth) * source.h_rms)[0]
        )

    edges = [0.0, *sorted(kink for kink in source.breaks if kink < depth), depth]
    return sum(
        quad(integrand, *ends, epsabs=0, epsrel=1e-9)[0]
        for ends in itertools.pairwise(edges)
    )


@pytest.mark.parametrize("surface", [CONCRETE, CONCRETE.sampled()])
def test_hertz_area_is_the_area_over_eta(surface):
    found = Scene(
        surface,
        separation=GAPS,
        quantities=("area",),
        without=("subscale_area",),
        rtol=1e-6,
    ).run()
    np.testing.assert_allclose(
        found["area"], [hertz_area(gap) for gap in GAPS], rtol=1e-6
    )


def test_the_whole_gaussian_adds_force_and_reaches_beyond_h_max():
    gaps = [0.3, 1.0, 1.3]
    whole = scene_of(
        "pressure", separation=gaps, without=("finite_height",), rtol=1e-5
    ).run()
    cut = scene_of("pressure", separation=gaps, rtol=1e-5).run()
    # far below h_max what lies beyond it is less than the table's error
    assert whole["pressure"][0] == pytest.approx(float(cut["pressure"][0]), rel=1e-9)
    assert (whole["pressure"][1:] > cut["pressure"][1:]).all()
    assert cut["pressure"][2] == 0
    higher = Surface(CONCRETE.hurst, CONCRETE.q0, CONCRETE.q1, CONCRETE.h_rms, 4.0)
    truth = contact(higher, separation=gaps, theory=Mbma(island_model="exact", rtol=1e-8))
    np.testing.assert_allclose(whole["pressure"], truth.pressure, rtol=1e-5)


def test_island_statistics_add_up():
    found = scene_of("pressure", points=4000).run()
    delta = found["island_delta"].values
    density = found["island_density"].values
    load = np.trapezoid(density * found["island_force"].values, delta, axis=1)
    np.testing.assert_allclose(load, found["pressure"], rtol=2e-3)
    np.testing.assert_allclose(
        np.trapezoid(density, delta, axis=1), found["island_number"], rtol=2e-2
    )
    found = scene_of("deltas", deltas=[0.1, 0.4], bodies=3.0, rtol=1e-8).run()
    r = found["profile_radius"].values
    p = found["profile_pressure"].values
    load = 2 * np.pi * np.trapezoid(r * p, r, axis=1)
    np.testing.assert_allclose(
        load, island(CONCRETE, [0.1, 0.4], E_star=3.0).force, rtol=5e-2
    )


def test_the_certificate_decides_between_table_and_solver(monkeypatch):
    bound = plans.certified_error("universal", 1.0)
    assert bound == open_table("universal").content.local_error.max()
    for rtol, island_model in ((3.02 * bound, "universal"), (2.98 * bound, "exact")):
        assert (
            scene_of("pressure", rtol=rtol).plan().steps[0].island_model == island_model
        )
    monkeypatch.setattr(plans, "certified_error", lambda *_: 1e-3)
    assert scene_of("pressure", rtol=1e-4).plan().steps[0].island_model == "exact"


@pytest.mark.parametrize("rtol", [2e-10, 3e-10, 4e-10, 5e-10, 1e-9])
def test_a_tolerance_near_the_bound_of_the_table_is_reached(rtol):
    """The plan took the largest error seen for the bound, and such runs were refused."""
    for name in ("concrete", "challenge", "yang-persson"):
        surface = Surface.named(name)
        gaps = np.linspace(0, 0.9, 3) * surface.h_max
        scene = Scene(surface, 1.0, quantities=["pressure"], separation=gaps, rtol=rtol)
        assert scene.run().attrs["error"] <= rtol


HISTORY = """
import sys
import numpy as np
from mbma_tables import Scene, Surface, contact, contact_law, open_table
from mbma_tables.theories import Mbma

concrete = Surface.named("concrete")
if sys.argv[1] == "used":
    open_table("island4d")
    for island_model in ("exact", "universal", "island4d", "formula", "rigid"):
        contact(concrete, separation=[0.1, 0.7], theory=Mbma(island_model, rtol=1e-3))
    contact_law(concrete, theory="mbma", rtol=1e-4)
    Scene(Surface.named("asphalt"), quantities=["pressure", "energy"], separation=[0.1], rtol=0.05).run()
    Scene(concrete, deltas=[0.2]).run()
model = {"quantities": ["pressure"], "without": ["sphere_deformation"], "rtol": 1e-3}
islands = {"quantities": ["area", "stiffness"], "points": 64, "rtol": 1e-3}
for arguments in (*({"rtol": rtol} for rtol in (0.05, 1e-6, 1e-9)), {"seconds": 0.01}, model, islands):
    scene = Scene(concrete, separation=[0.2, 0.5, 0.9], **arguments)
    found = scene.run()
    print(scene.explain(), found.attrs["error"].hex(), found.attrs["island_models"])
    for name in sorted(found.variables):
        print(name, found[name].values.tobytes().hex())
"""


def test_answers_do_not_depend_on_what_ran_before():
    fresh, used = (
        subprocess.run(
            [sys.executable, "-c", HISTORY, history],
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for history in ("fresh", "used")
    )
    assert fresh == used
    assert "pressure" in fresh


def test_a_plan_and_a_result_name_what_they_are_made_of():
    text = scene_of("pressure", "area", without=("subscale_area",)).explain()
    assert text.startswith("Scene  (rtol=1.0e-06, error=")
    steps = (
        "first use in a process",
        "-> contact by universal",
        "-> hertz area by universal",
    )
    for part in (
        *steps,
        "left out: mean_pressure, stiffness, ",
        "switched off: subscale_area\n",
    ):
        assert part in text
    found = scene_of("pressure", rtol=1e-8, theory=Mbma(variant="printed")).run()
    assert found.attrs["variant"] == "printed"
    assert set(json.loads(found.attrs["table_hashes"])) <= set(
        json.loads(found.attrs["island_models"]).values()
    )
    assert found["pressure"].attrs["units"] == "1"
    assert found["separation"].attrs["units"] == "mm"


OF_CONTACT = (
    "pressure",
    "area",
    "stiffness",
    "energy",
    "solid_conductance",
    "leakage",
    "valid",
    "yield",
)
TRIED = (*OF_CONTACT, "points", "deltas", "theories")
COMBINATIONS = [
    names
    for names in [(name,) for name in TRIED] + list(itertools.combinations(TRIED, 2))
    if not ("yield" in names and set(names) & {"energy", "points", "deltas"})
]


@pytest.mark.parametrize("requested", COMBINATIONS, ids="+".join)
def test_kernels_of_what_is_not_requested_are_not_called(requested, monkeypatch):
    calls = {}

    def count(module, name, called):
        real = getattr(module, name)

        def counted(*arguments, **more):
            calls.setdefault(called, []).append(more)
            return real(*arguments, **more)

        monkeypatch.setattr(module, name, counted)

    module = importlib.import_module("mbma_tables.contacts.contact")
    count(module, "contact_of", "contact")
    count(
        importlib.import_module("mbma_tables.contacts.law.make"),
        "contact_law",
        "contact_law",
    )
    count(
        importlib.import_module("mbma_tables.contacts.quantities.leakage"),
        "leakage_of",
        "leakage",
    )
    for name in ("island_statistics", "profiles", "hertz_area"):
        count(runs, name, name)
    for theory in (GreenwoodWilliamson, Persson):
        count(theory, "answer", theory.name)
    count(Yielding, "__init__", "yield")
    given = arguments_of(requested)
    Scene(CONCRETE, **given).run()
    asked = {*requested, *given["quantities"]}
    yields = "yield" in requested
    expected = {
        "contact": int(bool(asked & set(OF_CONTACT))),
        "leakage": int("leakage" in asked),
        "island_statistics": int("points" in asked),
        "profiles": int("deltas" in asked),
        "greenwood_williamson": int("theories" in asked),
    }
    found = {name: len(called) for name, called in calls.items() if name != "yield"}
    if yields and "theories" in asked:
        # the load at which heights yield is solved for
        found["greenwood_williamson"] = min(found["greenwood_williamson"], 1)
    assert found == {name: times for name, times in expected.items() if times}
    assert ("yield" in calls) == yields


@pytest.mark.parametrize("name", ["theories", "deltas"])
def test_tables_are_not_read_where_nothing_looks_up(name, monkeypatch):
    from mbma_tables.tables import open as tabulated

    def refuse(*_):
        raise AssertionError("a table was read")

    monkeypatch.setattr(tabulated, "read_table", refuse)
    tabulated._opened.cache_clear()
    scene_of(name).run()
    scene_of("pressure", "area", without=("sphere_deformation",)).run()


@pytest.mark.parametrize(
    ("surface", "gap", "rtol"),
    [
        (
            Surface(0.48040426141842724, 1.0, 2063.122, 1.0, 3.0118),
            -1.4750136239699654,
            3e-6,
        ),
        (Surface(0.7, 1.0, 64.86, 1.0, 4.128), -1.4336437442709071, 1e-5),
        (Surface(0.7, 1.0, 64.86, 1.0, 4.128), -1.4336437442709071, 1e-2),
    ],
)
def test_stiffness_at_the_end_of_a_laws_piece(surface, gap, rtol):
    found = Scene(surface, quantities=("stiffness",), separation=[gap], rtol=rtol).run()
    truth = contact(surface, separation=gap, theory=Mbma(rtol=1e-11)).stiffness
    assert abs(float(found["stiffness"][0]) / truth - 1) <= found.attrs["error"] <= rtol


# its islands at full compression lie beyond X = 41, where the tables end
DEEP = Surface(0.8, 1.0, 200.0, 1.0, 45.0)


def scene_with(surface=CONCRETE, **given):
    return Scene(
        surface, **({"quantities": ("pressure",), "separation": (0.2, 0.5)} | given)
    )


def with_island_model(scene, island_model):
    plan = scene.plan()
    steps = tuple(
        step
        if step.island_model is None
        else dataclasses.replace(step, island_model=island_model)
        for step in plan.steps
    )
    return dataclasses.replace(plan, steps=steps)


@pytest.mark.parametrize("island_model", ["universal", "island4d"])
def test_beyond_a_table_totals_are_solved(island_model):
    scene = scene_with(DEEP, separation=(-44.0, 44.0), rtol=1e-3)
    with pytest.raises(OutOfRangeError):
        contact(DEEP, separation=-44.0, theory=Mbma(island_model=island_model))
    found = runs.run_plan(scene, with_island_model(scene, island_model))
    truth = contact(
        DEEP, separation=[-44.0, 44.0], theory=Mbma(island_model="exact", rtol=1e-6)
    ).pressure
    np.testing.assert_allclose(found["pressure"], truth, rtol=1e-3, atol=0)


test_contradictions = refusals(
    lambda given: scene_with(**given),
    ({"quantities": ("finite_height",)}, "no quantity is named 'finite_height'"),
    (
        {"without": ("energy",)},
        "no refinement is named 'energy'; known are subscale_area, sphere_deformation",
    ),
    ({"quantities": ()}, "nothing is requested: give quantities"),
    (
        {"deltas": (0.1,), "without": ("sphere_deformation",)},
        "deltas are of profiles of the deformed sphere",
    ),
    ({"bodies": Bodies(conductivity=(1.0, -2.0))}, "positive"),
    ({"quantities": (), "deltas": (0.1,)}, "separation is not needed for profiles"),
    ({"deltas": (0.1, -0.2)}, "deltas must be positive"),
    ({"deltas": (0.1, np.nan)}, "deltas must be finite"),
    ({"pressure": 0.1}, "give exactly one of separation"),
    (
        {"theory": Mbma(island_model="exact"), "without": ("sphere_deformation",)},
        "leave island_model out",
    ),
    (
        {"theory": Mbma(island_model=RigidModel()), "seconds": 1.0},
        "give rtol instead of seconds",
    ),
    ({"quantities": "pressure"}, "list of names"),
    ({"quantities": 5}, "list of names"),
    ({"quantities": (["area"],)}, "quantity"),
    ({"bodies": [57.0, 58.0]}, "a scene has one E_star"),
    ({"bodies": Bodies(hardness=[0.1, 0.2])}, "a scene has one hardness"),
    ({"separation": [[0.5]]}, "one number or a list"),
    ({"points": 1}, "points must be"),
    ({"surface": Surface([0.5, 0.7], 1.0, 50.0, 0.1, 0.3)}, "not a batch"),
)


def test_an_island_model_of_choice():
    found = scene_with(theory=Mbma(island_model="island4d"), rtol=1e-3).run()
    assert found.attrs["island_models"] == '{"contact": "island4d"}'
    alone = contact(
        CONCRETE, separation=[0.2, 0.5], theory=Mbma(island_model="island4d", rtol=5e-4)
    )
    np.testing.assert_array_equal(found["pressure"], alone.pressure)
    with pytest.raises(
        ConvergenceError, match=r"above rtol = 1\.00e-06: give a larger rtol"
    ):
        scene_with(theory=Mbma(island_model="formula"), rtol=1e-6).run()


def test_no_contact():
    by_area = Scene(CONCRETE, quantities=["pressure", "stiffness"], area=[0.0]).run()
    assert by_area.separation.values == pytest.approx(1.1)
    assert (by_area.pressure.values, by_area.stiffness.values) == (0, 0)
    assert (
        scene_with(
            quantities=("stiffness",), separation=(2 * CONCRETE.h_max,), rtol=1e-4
        ).run()["stiffness"]
        == 0
    )
    found = scene_with(
        separation=(CONCRETE.h_max, 2.0),
        points=5,
    ).run()
    for name in (
        "pressure",
        "island_number",
        "island_density",
        "island_force",
        "island_area",
        "island_delta",
    ):
        assert (found[name] == 0).all(), name


def test_validity_and_yield_are_what_the_declarations_of_quantities_say():
    """A quantity declared with an uncertainty of its own is beside `valid` without any list of scenes."""
    bodies = Bodies("13.3 MPa", hardness="0.2 MPa", conductivity="2 W/(m K)")
    asked = ["solid_conductance", "valid"]
    given = {"pressure": [0.05], "theory": "calibrated", "quantities": asked}
    found = Scene(CONCRETE, bodies, **given).run()
    declared = registry.registry()
    uncertainties = {each.uncertainty for each in declared.values()} - {None}
    uncertainties -= {
        name
        for name in uncertainties
        if declared[name].is_listed is declaration.on_request
    }
    of_gas = {"gas_conductance_scatter", "total_conductance_scatter", "leakage_scatter"}
    of_seal = {"leak_rate_scatter"}
    assert uncertainties - of_gas - of_seal <= set(found.variables)
    yielded = {
        name
        for name, declared in registry.registry().items()
        if declared.is_listed is declaration.of_yielding_contacts
    }
    assert {"yielded", "plane_separation", "psi"} <= yielded <= set(found.variables)
