"""Laws as rows: their error against the model, their spacing, their text in every target, and what is refused."""

import dataclasses
import functools
import json
import sys

import numpy as np
import pytest
from helpers import refusals
from law_points import PLAIN

from mbma_tables import Bodies, InputError, MbmaError, Surface, contact, contact_law
from mbma_tables.export import law_table
from mbma_tables.export.registry import targets
from mbma_tables.export.rows import data, solvers
from mbma_tables.export.rows.law_rows import FLOOR, describe_law
from mbma_tables.export.rows.solvers import calculix
from mbma_tables.islands.variants import PRINTED
from mbma_tables.theories import THEORIES, Mbma

UNITS = {"length_unit": "mm", "stress_unit": "MPa"}
HEAT = {
    "quantity": "solid_conductance",
    "conductivity": 50.0,
    "conductivity_unit": "mW/K",
}
LEAKAGE = {"quantity": "leakage", "theory": "calibrated", "rows": None}
CONCRETE = Surface.named("concrete")


def law_of(surface=CONCRETE, **changed):
    return describe_law(
        surface, 13.3, **(UNITS | {"rows": 40, "theory": "mbma"} | changed)
    )


@pytest.mark.parametrize(
    "theory",
    [
        pytest.param(name, marks=pytest.mark.slow if name == "persson" else ())
        for name in THEORIES
    ],
)
def test_rows_of_any_theory(theory):
    law = law_of(theory=theory, rows=50)
    near = (
        CONCRETE.h_max - np.geomspace(max(CONCRETE.h_max - law.x[-1], 1e-9), 0.5, 500)[1:]
    )
    x = np.append(np.random.default_rng(1).uniform(0, 0.99 * law.x[-1], 500), near)
    model = contact(
        CONCRETE, 13.3, mean_separation=CONCRETE.h_max - x, theory=theory
    ).pressure
    kept = model > FLOOR * law.y[-1]
    assert (
        np.abs(np.interp(x, law.x, law.y) / model - 1)[kept].max()
        <= 1.02 * law.largest_error
    )
    assert law.x[0] == law.y[0] == 0
    assert (np.diff(law.x) > 0).all()
    assert (np.diff(law.y) >= 0).all()
    text = "\n".join(law.comments)
    assert law.theory == theory == json.loads(data.to_json(law))["theory"]
    assert ("MBMA model" if theory == "mbma" else f"theory {theory!r}") in law.comments[0]
    assert "of its theory, in pressure and area" in text
    assert "scatter of simulations about the theory" in text
    for of_mbma in ("softening: stiffness falls with compression", "table: data"):
        assert (of_mbma in text) == (theory == "mbma")


@pytest.mark.parametrize("pressures", [(1, 500), (1, 550), None])
def test_the_header_says_from_where_a_law_is_valid(pressures):
    surface = Surface.from_roughness(
        hurst=0.8, h_max=3.5e-3, Rq=1e-3, longest=0.1, shortest=2e-3, unit="mm"
    )
    law = describe_law(
        surface,
        115e3,
        stress_unit="MPa",
        theory="calibrated",
        rows=40,
        pressures=pressures,
    )
    root = contact(surface, 115e3, area=1e-3, theory="calibrated").pressure
    (light,) = (
        line for line in law.comments if line.startswith("not valid") and "0.001" in line
    )
    said = float(light.split("below p = ")[1].split()[0])
    assert root <= said <= root * 1.001
    found = contact(surface, 115e3, pressure=[0.01, said], theory="calibrated")
    assert found.valid.tolist() == [False, True]


def test_the_header_says_up_to_where_a_law_is_valid():
    turning = "\n".join(law_of(Surface(0.35, 1.0, 1e4, 0.1, 0.3)).comments)
    assert "has its maximum" in turning
    (areas,) = (
        line
        for line in law_of().comments
        if line.startswith("not valid") and "areas" in line
    )
    root = contact(CONCRETE, 13.3, area=0.1, theory="mbma").pressure
    said = float(areas.split("above p = ")[1].split()[0])
    assert root * 0.999 <= said <= root
    assert any(
        "scatter" in line and "ln p at a given c" in line for line in law_of().comments
    )
    assert not any("has its maximum" in line for line in law_of().comments)
    own = dataclasses.replace(PRINTED, name="own", beta=0.3)
    assert any(
        "scatter" in line and "not known" in line for line in law_of(variant=own).comments
    )


@pytest.mark.parametrize("name", ["concrete", "asphalt", "challenge"])
@pytest.mark.parametrize("rows", [20, 50, 200])
def test_the_stated_error_and_better_than_even_rows(name, rows):
    surface = Surface.named(name).to("mm")
    law = law_of(surface, rows=rows)
    x = np.random.default_rng(rows).uniform(0, law.x[-1], 2000)
    gaps = np.maximum(surface.h_max - 2 * x, -surface.h_max)
    model = contact(surface, 13.3, separation=gaps, theory=Mbma(rtol=1e-9)).pressure
    kept = model > FLOOR * law.y[-1]
    error = np.abs(np.interp(x, law.x, law.y) / model - 1)[kept].max()
    assert 0.5 * law.largest_error <= error <= 1.02 * law.largest_error
    assert law_of(surface, rows=rows, evenly=True).largest_error >= 5 * law.largest_error


def test_fewest_rows(monkeypatch):
    law = law_of(rows=None, rtol=1e-2)
    assert law.largest_error <= 1e-2
    assert law_of(rows=law.x.size - 1).largest_error > 1e-2
    monkeypatch.setattr(law_table, "MAX_ROWS", 30)
    with pytest.raises(
        InputError, match="needs more than 30 rows under linear interpolation"
    ):
        law_of(rows=None, rtol=1e-6)
    assert law_of(rows=None, rtol=0.2).x.size <= 30


def test_force_and_conductance_in_one_interaction():
    law = law_of(**HEAT, rows=20)
    plain = law_of(rows=20)
    assert law.largest_error < 2e-2
    assert (law.x_name, law.y_name, law.y_unit) == (
        "pressure",
        "solid_conductance",
        "mW/K/mm",
    )
    text = calculix(law, "JOINT")
    abaqus = solvers.abaqus(law, "JOINT")
    assert (
        "*SURFACE INTERACTION, NAME=JOINT\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=EXPONENTIAL\n"
        in text
    )
    assert "TYPE=SURFACE TO SURFACE" in text
    assert (
        abaqus.count("*SURFACE INTERACTION, NAME=JOINT\n")
        == abaqus.count("*SURFACE INTERACTION")
        == 1
    )
    force, heat = abaqus.split("=TABULAR\n")[1].split("*GAP CONDUCTANCE, PRESSURE\n")
    for rows, known in (
        (force, plain),
        (heat, law),
        (text.split("*GAP CONDUCTANCE\n")[1], law),
    ):
        np.testing.assert_allclose(
            [numbers(line)[::-1] for line in rows.splitlines()],
            np.stack([known.x, known.y], 1),
        )


def numbers(line):
    return [float(word) for word in line.replace(",", " ").split()]


def rows_in(target, law):
    """Overclosures and pressures as the target's own reader takes them from the file."""
    kind = targets()[target]
    (curve,) = kind.read(kind.files(law)[""])
    return curve.x, curve.y


@pytest.mark.parametrize("target", PLAIN)
@pytest.mark.parametrize("rows", [20, 21, 50])
def test_text_holds_the_rows(target, rows):
    law = law_of(rows=rows)
    text = solvers.FORMATS[target](law)
    np.testing.assert_allclose(rows_in(target, law), [law.x, law.y], rtol=1e-9)
    for word in (
        "variant 'reported'",
        "E* = 13.3",
        "[MPa]",
        "[mm]",
        "h_max - u",
        "largest error",
        "table: data",
    ):
        assert word in text


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MbmaError, match="pip install pyarrow"):
        data.to_parquet(law_of())


test_refused = refusals(
    lambda changed: law_of(**changed),
    ({"length_unit": ""}, "no known unit of length"),
    ({"stress_unit": None}, "stress_unit is missing"),
    ({"rows": 2}, "rows"),
    ({"rows": 10, "rtol": 1e-3}, "both given"),
    ({"rows": None, "rtol": 1e-9}, "rtol"),
    ({"pressures": ("1 kPa",)}, "pressures must be two rising numbers"),
    ({"pressures": "1:2"}, "pressures must be two rising numbers"),
    (HEAT | {"conductivity_unit": 3}, "conductivity_unit is not printable"),
    ({"quantity": "stifness"}, "did you mean 'stiffness'"),
    ({"quantity": "valid"}, "valid is true or false, and has no rows"),
    ({"quantity": "yielded"}, "yielded has no rows: it is 0"),
    ({"quantity": "separation"}, "separation has no rows: it is negative"),
    ({"quantity": "solid_conductance"}, "conductance needs conductivity"),
    ({"quantity": "conductance"}, "did you mean '[a-z]+_conductance'"),
    (
        {"quantity": "total_conductance"},
        "needs the gas .* or `mbma export TARGET --joint",
    ),
    ({"surface": Surface([0.5, 0.8], 1.0, 100.0, 1.0, 3.0)}, "not of a batch"),
    (
        {
            "surface": Surface(0.8, 1.0, 100.0, 1.0, 1.5),
            "theory": "persson",
            "pressures": (1e-12, 1e-9),
        },
        r"pressures must reach above \S+ MPa, that at c = 0, where rows begin",
    ),
)


test_what_a_solver_does_not_take = refusals(
    lambda target, changed: getattr(solvers, target)(law_of(**changed)),
    ("calculix", {"rows": 201}, "takes 200 rows of pressure at most here, got 201"),
    ("calculix", HEAT | {"rows": 21}, "takes 20 rows of solid_conductance at most"),
    (
        "calculix",
        {"surface": Surface.named("yang-persson"), "length_unit": "m"},
        "closer than 1e-10 m",
    ),
    (
        "ansys",
        {},
        "takes solid_conductance against pressure or .* here, got pressure against",
    ),
    (
        "freecad",
        HEAT
        | {"conductivity_unit": "S/m", "length_unit": "m", "stress_unit": "Pa"}
        | {"rows": 20},
        "takes conductances of heat, .* got one in S/m/m",
    ),
    ("freecad", HEAT, "FreeCAD takes m and Pa here, got mm and MPa"),
    *(
        (name, LEAKAGE | {"rows": 50}, "takes pressure against overclosure")
        for name in ("abaqus", "calculix")
    ),
)


def test_rows_without_a_last_contact_begin_with_one_step():
    surface = Surface(0.8, 1e3, 1e5, 1e-3, 2e-3, unit="mm")
    law = describe_law(surface, "1 MPa", theory="persson")
    known = contact_law(surface, theory="persson")
    assert (law.x[0], law.y[0]) == (0, 0)
    assert law.y[1] == pytest.approx(known.pressure(separation=known.h_max), rel=2e-3)
    assert law.x[1] == pytest.approx(5e-5 * law.x[-1])
    c = np.append(law.x[1], np.geomspace(law.x[1], law.x[-1], 3000)[1:-1])
    found = np.interp(c, law.x, law.y) / known.pressure(known.h_max - c) - 1
    assert np.abs(found).max() <= 1.02 * law.largest_error
    assert "TABULAR" in calculix(law)


def test_rows_of_leakage_without_a_block():
    surface = Surface(0.8, 1.0, 1e3, 1.0, 3.0, unit="mm")  # 26% contact at most
    law = describe_law(surface, "900 MPa", quantity="leakage", rtol=1e-2, theory="mbma")
    known = contact_law(surface, 900.0, theory="mbma")
    assert law.y[-1] == 0
    assert known.leakage.blocked_at == -np.inf
    assert "where contact blocks" not in " ".join(law.comments)
    d = np.linspace(known.lowest, known.h_max, 5000)
    kept = known.leakage(separation=d) > FLOOR * law.y[0]
    np.testing.assert_allclose(
        np.interp(known.pressure(separation=d), law.x, law.y)[kept],
        known.leakage(separation=d)[kept],
        rtol=1.01e-2,
    )


@pytest.mark.parametrize("quantity", ["pressure", "solid_conductance"])
@pytest.mark.parametrize("theory", ["mbma", "calibrated"])
def test_light_loads_are_within_the_error_too(theory, quantity):
    asked = HEAT if quantity == "solid_conductance" else {}
    law = law_of(rows=None, rtol=1e-2, pressures=("10 Pa", 0.1), theory=theory, **asked)
    pressure = np.geomspace(1.001e-5, 0.0999, 400)
    found = contact(CONCRETE, 13.3, pressure=pressure, theory=theory)
    if quantity == "pressure":
        model = pressure
        read = np.interp(CONCRETE.h_max - found.mean_separation, law.x, law.y)
    else:
        model = found.stiffness * 50.0 / 13.3
        read = np.interp(pressure, law.x, law.y)
    assert np.abs(read / model - 1).max() <= 1.05e-2
    assert law.largest_error <= 1e-2
    assert law.x.size < 200


@pytest.mark.parametrize("target", [*PLAIN, "csv"])
@pytest.mark.parametrize("largest", [0.1, 0.1234567890123])
@pytest.mark.parametrize(
    "choice", [{"rows": 20}, {"rows": 33, "evenly": True}, {"rows": None, "rtol": 3e-3}]
)
def test_rows_reach_the_largest_pressure(target, largest, choice):
    law = law_of(theory="calibrated", pressures=(1e-4, largest), **choice)
    c, p = rows_in(target, law)
    assert p[-1] >= largest
    at = (
        CONCRETE.h_max
        - contact(CONCRETE, 13.3, pressure=largest, theory="calibrated").mean_separation
    )
    # the law itself is within 6e-6 of the theory
    assert np.interp(at * (1 + 1e-4), c, p) >= largest
    assert np.interp(at, c, p) == pytest.approx(largest, rel=law.largest_error + 1e-4)


@pytest.mark.parametrize("quantity", ["solid_conductance", "leakage"])
def test_rows_against_pressure_reach_the_largest(quantity):
    heat = quantity == "solid_conductance"
    law = law_of(
        **(
            LEAKAGE
            | (HEAT if heat else {})
            | {"pressures": (1e-4, 0.1234567890123), "rows": 20}
        )
    )
    assert law.x[-1] >= 0.1234567890123
    found = contact(CONCRETE, 13.3, pressure=0.1234567890123, theory="calibrated")
    model = found.stiffness * 50.0 / 13.3 if heat else found.leakage.K
    assert law.y[-1] == pytest.approx(model, rel=law.largest_error + 1e-4)
    if law.behaviour:
        assert law.behaviour.y[-1] >= 0.1234567890123


def test_rows_of_leakage_are_the_contacts_flow_to_the_blocked_pressure():
    law = law_of(**LEAKAGE, rtol=1e-3)
    assert (law.x_unit, law.y_name, law.y_unit) == ("MPa", "leakage", "mm^3")
    assert law.x[0] == law.y[-1] == 0
    assert (np.diff(law.y) < 0).all()
    pressure = np.geomspace(law.x[1], law.x[-2], 400)
    model = contact(CONCRETE, 13.3, pressure=pressure, theory="calibrated")
    error = (
        np.interp(pressure, law.x, law.y)
        / np.where(model.area < 0.3, model.leakage.K, np.nan)
        - 1
    )
    assert np.nanmax(np.abs(error)) < 1.05e-3 + 1e-4
    text = "\n".join(law.comments)
    for fact in (
        "blocked, K = 0, from p = ",
        "viscosity in MPa s: 1e-3 Pa s, as water's, is 1.0e-09 MPa s",
        f"pressure from 0 to {float(law.x[-1])!r} MPa, where contact blocks the gaps",
        "leakage: A/A0 is above 0.3",
        "one standard deviation of ln K",
    ):
        assert fact in text
    with pytest.raises(InputError, match="conductivity"):
        law_of(**(HEAT | LEAKAGE))
    some = law_of(**LEAKAGE, pressures=("1 kPa", "0.1 MPa"), rtol=1e-2)
    assert some.x[-1] == pytest.approx(0.1, rel=1e-6)
    assert some.y[-1] > 0
    steep = Surface(0.8, 1.0, 1e3, 1.0, 1.5, unit="mm")
    falling = describe_law(
        steep, "900 MPa", quantity="leakage", theory="persson", rows=50
    )
    assert (np.diff(falling.y) <= 0).all()


HARD = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0, unit="um")


def test_rows_of_a_law_with_a_hardness():
    joint = functools.partial(
        describe_law, HARD, "100 GPa", stress_unit="MPa", theory="calibrated", rtol=1e-2
    )
    asked = {"hardness": "1500 MPa", "pressures": ("1 MPa", "500 MPa")}
    known = functools.partial(
        contact, HARD, Bodies(100e3, hardness=1500.0), theory="calibrated"
    )
    law = joint(**asked)
    elastic = joint()
    # chords lie about the law by as much as they may miss it
    kept = law.y > 1.0
    assert law.y[kept] == pytest.approx(
        known(mean_separation=3.0 - law.x[kept]).pressure, rel=1e-2
    )
    assert "hardness = 1500.0 MPa, plasticity index 3.61" in " ".join(law.comments)
    assert "elastic: within 5% in area for hardnesses from 4922.0 MPa on" in " ".join(
        elastic.comments
    )
    # conductance is not the slope of loading
    heat = joint(
        **asked,
        quantity="solid_conductance",
        conductivity=20.0,
        conductivity_unit="mW/(mm K)",
    )
    found = known(pressure=heat.x[heat.x > 2.0])
    assert heat.y[heat.x > 2.0] == pytest.approx(
        20.0 / 100e3 * found.unloading_stiffness, rel=1e-2
    )
    assert (np.asarray(found.unloading_stiffness) > 1.1 * found.stiffness).all()


@pytest.mark.parametrize("quantity", ["leakage", "hydraulic_aperture"])
def test_rows_of_a_yielded_seal_end_where_it_blocks(quantity):
    """Yielded contact blocks the gaps at a larger share of the area than elastic contact does."""
    hard = Bodies(100e3, hardness=1500.0)
    law = describe_law(
        HARD, "100 GPa", stress_unit="MPa", hardness="1500 MPa", quantity=quantity,
        theory="calibrated", rtol=1e-2,
    )  # fmt: skip
    elastic = describe_law(
        HARD, "100 GPa", stress_unit="MPa", quantity=quantity, theory="calibrated", rtol=1e-2,
    )  # fmt: skip
    assert law.y[-1] == elastic.y[-1] == 0
    ends = {}
    for name, rows, bodies in (("hard", law, hard), ("elastic", elastic, 100e3)):
        made = contact_law(HARD, bodies, "calibrated")
        end = float(rows.x[-1])
        assert made.leakage(pressure=0.99 * end) > 0
        assert made.leakage(pressure=1.001 * end) == 0
        ends[name] = float(made.at_pressure(end).area)
    assert 0.4 < ends["elastic"] < ends["hard"] < 0.6
    text = " ".join(law.comments)
    assert "where contact blocks the gaps" in text
    assert "blocked, K = 0, from p = " in text
