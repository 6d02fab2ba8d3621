"""Boundary elements of one map as a theory of it, and `contact(...).map()`."""

import math

import numpy as np
import pytest
import scipy.signal
from helpers import random_map
from scipy.special import erf

from generate.boundary_elements.solve import Contact
from generate.machined import makers
from generate.machined.makers import Part
from mbma_tables import Bodies, InputError, OutOfRangeError, Surface, contact, contact_law
from mbma_tables.theories import BoundaryElements, Simulated
from mbma_tables.theories.simulated.boundary_elements import (
    BoundaryElementContact as OwnContact,
)
from mbma_tables.theories.simulated.energy_spline import LoadCurve
from mbma_tables.theories.simulated.own_map import law_loads
from mbma_tables.theories.simulated.reynolds import flow_conductance

pytest.importorskip("tamaas")

FULL = Simulated(grid="full")


def heights(points=64, seed=3):
    return 0.02 * random_map(points, 1.5 / points, 0.2501, 1.5, seed)


@pytest.fixture(scope="module")
def truth():
    return BoundaryElements.of(Surface.from_map(heights(), 1.0, periodic=True, unit="um"))


def test_it_answers_what_was_simulated(truth):
    force, area, u, _ = truth.rows
    found = contact(truth.surface, mean_separation=u, theory=truth)
    np.testing.assert_allclose(found.pressure, force, rtol=1e-9)
    np.testing.assert_allclose(found.area, area, rtol=1e-9)
    # the first and the last load are beyond what was tested
    assert found.valid.tolist() == [False] + [True] * (force.size - 2) + [False]
    assert list(found.reasons) == [
        "A/A0 is below 0.001, the lightest contact that was tested",
        "A/A0 is above 0.9, the heaviest contact that was tested",
    ]
    assert found.theory == "simulated"


@pytest.mark.parametrize("grid", ["full", "quick"])
def test_force_is_the_energys_slope(truth, grid):
    theory = Simulated(grid).of(truth.surface)
    _, _, u, energy = theory.rows
    fine = np.geomspace(u[-1], u[0], 4001)
    force = contact(truth.surface, mean_separation=fine, theory=theory).pressure
    assert (np.diff(force) < 0).all()
    work = np.sum((force[1:] + force[:-1]) / 2 * np.diff(fine))
    assert work == pytest.approx(
        energy[-1] - energy[0], rel=0.01 if grid == "full" else 0.02
    )
    np.testing.assert_allclose(theory.energy(truth.surface, u), energy, rtol=1e-9)
    assert contact(truth.surface, area=0.1, theory=theory).leakage.x > 0


def test_what_was_not_simulated_is_refused(truth):
    plain = Surface(0.8, 0.1, 2.0, 1.0, 3.0)
    for surface, u, theory, match in (
        (plain, 1.0, truth, "is for that map only"),
        (plain, 1.0, "simulated", r"make it by Surface\.from_map"),
    ):
        with pytest.raises(
            OutOfRangeError if theory is truth else InputError, match=match
        ):
            contact(surface, mean_separation=u, theory=theory)


@pytest.mark.parametrize(
    ("row", "changed"),
    [(1, [0.0, 0.1, 0.2, 0.3]), (1, [0.2, 0.1, 0.2, 0.3]), (2, [4.0, 3.0, 3.0, 1.0])],
)
def test_rows_that_make_no_law(truth, row, changed):
    rows = np.array(
        [
            [1e-3, 0.01, 0.02, 0.1],
            [0.01, 0.02, 0.1, 0.2],
            [0.04, 0.03, 0.02, 0.01],
            [1.0, 2.0, 3.0, 4.0],
        ]
    )
    rows[2] *= truth.surface.h_max
    BoundaryElements(truth.surface, rows, 4.0, truth.pressed, "")
    rows[row] = changed
    with pytest.raises(OutOfRangeError, match="is no law up to h_max"):
        BoundaryElements(truth.surface, rows, 4.0, truth.pressed, "")


class TestOfASurface:
    @pytest.fixture(
        scope="class", params=[("honed", 0), ("milled", 2)], ids=["honed", "milled"]
    )
    @staticmethod
    def part(request):
        part = Part(*request.param, 128)
        values = makers.heights(part)
        return (
            values,
            Surface.from_map(values, 1.0, periodic=True, unit="um"),
            part.shortest,
        )

    @pytest.fixture(scope="class")
    @staticmethod
    def exact(part):
        values, surface, _ = part
        engine = Contact(values, (128.0, 128.0))
        rows = []
        flows = []
        for force in law_loads(surface, (0.067, 0.15, 0.39, 0.8)):
            found = engine.press(float(force))
            flows.append(flow_conductance(engine.gap, (128.0, 128.0)))
            further = engine.press(float(1.03 * force))["mean_separation"]
            rows.append(
                (force, found["area"], found["mean_separation"], 0.03 * force, further)
            )
        return np.array(rows).T, np.array(flows).T

    def test_it_is_the_full_simulation_between_its_loads(self, part, exact):
        (force, area, u, more, further), _ = exact
        found = contact(part[1], pressure=force, theory=FULL)
        np.testing.assert_allclose(found.area, area, rtol=0.03)
        steep = more / (u - further)
        np.testing.assert_array_less(
            np.abs(found.mean_separation - u) * steep / force, 0.02
        )
        beside = contact(part[1], pressure=force + more, theory=FULL)
        np.testing.assert_allclose(
            more / (found.mean_separation - beside.mean_separation), steep, rtol=0.05
        )
        assert found.valid.all()
        assert found.theory == "simulated"
        for scatter in (found.scatter, found.area_scatter, found.stiffness_scatter):
            assert ((scatter > 0) & (scatter < 0.03)).all()

    def test_flow_along_both_axes(self, part, exact):
        (force, *_), flows = exact
        leakage = contact(part[1], pressure=force, theory=FULL).leakage
        for own, true in zip((leakage.x, leakage.y), flows, strict=True):
            # at 14% contact the map is close to where it is blocked
            np.testing.assert_allclose(np.log(own[0] / true[0]), 0, atol=0.15)
            assert (own[:2] > 0).all()
            assert (own[-1] > 0) == (true[-1] > 0)
        np.testing.assert_allclose(leakage.K, np.sqrt(leakage.x * leakage.y))
        assert leakage.scatter[0] < 0.1
        assert (leakage.scatter[:3] > 0).all()
        assert leakage.valid[:2].all()
        assert not leakage.valid[3]

    def test_laws_and_other_units(self, part):
        surface = part[1]
        law = contact_law(surface, "1 GPa", theory=FULL)
        point = contact(surface, "1 GPa", pressure="5 MPa", theory=FULL)
        assert law.at_pressure("5 MPa").area == pytest.approx(point.area, rel=0.01)
        assert law.theory == "simulated"
        for axis in ("x", "y"):
            own = law.leakage.along(axis)
            direct = getattr(point.leakage, axis)
            assert own(pressure="5 MPa") == pytest.approx(direct, rel=0.02)
            u = np.linspace(0.02, 1, 300) * law.h_max
            true = getattr(contact(surface, mean_separation=u, theory=FULL).leakage, axis)
            np.testing.assert_allclose(
                own(u), true, rtol=2 * own.error, atol=1e-6 * true.max()
            )
            assert (own(u)[u < own.blocked_at] == 0).all()
        assert law.leakage.along(30.0)(pressure="5 MPa") == pytest.approx(
            point.leakage.along(30.0), rel=0.02
        )
        assert law.leakage(pressure="5 MPa") == pytest.approx(point.leakage.K, rel=0.02)
        other = contact(surface.to("mm"), pressure=0.005, theory=FULL)
        assert other.mean_separation == pytest.approx(
            1e-3 * point.mean_separation, rel=1e-3
        )
        with pytest.raises(InputError, match="this surface has none"):
            contact(surface.combined(surface), pressure=0.01, theory=FULL)


def test_the_energy_gives_a_knot_between_two_loads():
    # u cubic in ln F on either side of the middle between loads, and its exact energy
    x = np.log([0.001, 0.01, 0.1, 1.0])
    rows = np.empty((4, 4))
    rows[0], rows[1] = np.exp(x), erf(np.exp(x) * 1.3)
    cubic = np.polynomial.Polynomial([0.4, -0.25, 0.03, 0.001])
    rows[2] = cubic(x)
    # the integral of u dF from zero is exp(x) (u - u' + u'' - u''')
    work = np.exp(x) * sum(
        (-1) ** n * cubic.deriv(n)(x) if n else cubic(x) for n in range(4)
    )
    rows[3] = work - rows[0] * rows[2]
    curve = LoadCurve(rows, 2 * rows[2, 0])
    between = np.linspace(x[0], x[-1], 50)
    np.testing.assert_allclose(curve.separation(between), cubic(between), rtol=1e-9)
    np.testing.assert_allclose(
        curve.stiffness(between), -np.exp(between) / cubic.deriv()(between), rtol=1e-8
    )
    np.testing.assert_allclose(curve.area(between), erf(np.exp(between) * 1.3), rtol=1e-9)
    np.testing.assert_allclose(curve.log_force(cubic(between)), between, atol=1e-10)
    exact = np.exp(between) * sum(
        (-1) ** n * cubic.deriv(n)(between) if n else 0 for n in range(4)
    )
    np.testing.assert_allclose(curve.energy(between), exact, rtol=1e-9)


def test_loads_far_apart_keep_the_curves_monotone():
    rows = np.array(
        [
            [1e-4, 0.01, 0.5, 1.0],
            [0.001, 0.5, 0.51, 0.99],
            [3.0, 0.02, 0.019, 0.001],
            [1e-5, 0.01, 0.02, 1.0],
        ]
    )
    curve = LoadCurve(rows, 4.0)
    x = np.linspace(*np.log(rows[0, [0, -1]]), 500)
    assert (np.diff(curve.separation(x)) < 0).all()
    assert (np.diff(curve.area(x)) > 0).all()
    assert (curve.stiffness(x) > 0).all()


def worn_track(points=64):
    """Rough ground with a band that is worn flat, on which contact grows from 9% to 34% at nearly one load."""
    rng = np.random.default_rng(1)
    ground = makers.rough(rng, points, 24, 5.0, 0.8)
    flat = np.minimum(ground, np.quantile(ground, 0.3)) - 0.3
    off = np.abs(np.arange(points) - points / 2) - points / 5
    share = 1 / (1 + np.exp(-off / 2))
    return makers.finished(ground * share + flat * (1 - share), 5.0)


@pytest.mark.parametrize("grid", ["full", "quick"])
@pytest.mark.parametrize(
    "values",
    [worn_track(), makers.heights(Part("etched", 1, 64))],
    ids=["track", "etched"],
)
def test_areas_of_neighbouring_loads_differ_little(grid, values):
    surface = Surface.from_map(values, 1.0, periodic=True)
    theory = Simulated(grid).of(surface)
    force, area = theory.rows[:2]
    tested = (area[1:] > 1e-3) & (area[:-1] < 0.9) & (np.diff(np.log(force)) > 0.2)
    assert (area[1:] / area[:-1])[tested].max() <= 2.5
    # and between them the scatter covers
    between = np.exp((np.log(force[1:]) + np.log(force[:-1])) / 2)[
        (area[1:] > 0.02) & (area[:-1] < 0.6)
    ]
    engine = OwnContact(values, values.shape, 1e-6)
    simulated = np.array([engine.press(load)["area"] for load in between.tolist()])
    found = contact(surface, pressure=between, theory=theory)
    deviations = np.abs(np.log(found.area / simulated)) / found.area_scatter
    assert (deviations < 3).all()


def test_the_grids_own_error_is_in_the_scatter_of_the_area():
    part = Part("gaussian", 0, 64)
    coarse, fine = (
        Surface.from_map(makers.heights(Part("gaussian", k, 64)), 1.0, periodic=True)
        for k in (0, 2)
    )
    for surface, points in ((coarse, part.shortest), (fine, 8.0)):
        found = contact(surface, area=0.4, theory=FULL)
        assert found.area_scatter > 0.012 * (4 / points) ** 2 * 0.9


@pytest.mark.parametrize(
    ("family", "number"), [("turned", 0), ("turned", 1), ("ground", 0), ("gaussian", 0)]
)
def test_areas_on_a_finer_grid_are_within_the_scatter(family, number):
    values = makers.heights(Part(family, number, 128))
    fine = scipy.signal.resample(scipy.signal.resample(values, 256), 256, axis=1)
    engine = OwnContact(fine, values.shape, 1e-5)
    area = np.array([0.02, 0.06, 0.15, 0.4])
    surface = Surface.from_map(values, 1.0, periodic=True)
    found = contact(surface, area=area, theory="simulated")
    finer = [engine.press(load)["area"] for load in found.pressure.tolist()]
    deviations = np.abs(np.log(np.array(finer) / area)) / found.area_scatter
    assert (deviations < 2.5).all()


@pytest.mark.parametrize("family", ["turned", "ground"])
def test_leakage_of_the_quick_simulation_is_that_of_the_full_one(family):
    surface = Surface.from_map(makers.heights(Part(family, 1, 64)), 1.0, periodic=True)
    pressure = contact(surface, area=[0.008, 0.015, 0.05], theory=FULL).pressure
    quick, full = (
        contact(surface, pressure=pressure, theory=Simulated(grid)).leakage
        for grid in ("quick", "full")
    )
    np.testing.assert_allclose(quick.x, full.x, rtol=5e-3)
    np.testing.assert_allclose(quick.y, full.y, rtol=5e-3)
    np.testing.assert_array_equal(quick.valid, full.valid)


def test_a_curve_that_is_level_at_its_end_goes_on():
    # the monotone cubic through these loads is level at the last one
    rows = np.array(
        [
            [1e-4, 0.01, 0.5, 1.0],
            [0.001, 0.5, 0.51, 0.99],
            [3.0, 0.02, 0.019, 0.0189],
            [1e-5, 0.01, 0.02, 1.0],
        ]
    )
    curve = LoadCurve(rows, 4.0)
    u = np.array([3.0, 0.02, 0.0189, 0.01, 1e-4])
    assert (np.diff(curve.log_force(u)) > 0).all()


def test_a_hardness_that_no_point_reaches_leaves_the_elastic_contact():
    values = makers.heights(Part("honed", 1, 64))
    surface = Surface.from_map(values, 1.0, periodic=True)
    elastic = contact(surface, pressure=[0.003, 0.02], theory=FULL)
    for hardness in (1e4, 1e30):
        hard = contact(
            surface, Bodies(hardness=hardness), pressure=[0.003, 0.02], theory=FULL
        )
        for name in (
            "unloading_stiffness",
            "stiffness",
            "area",
            "unloading_stiffness_scatter",
            "stiffness_scatter",
            "scatter",
        ):
            np.testing.assert_allclose(
                getattr(hard, name), getattr(elastic, name), rtol=1e-12, err_msg=name
            )
        assert (hard.yielded == 0).all()


@pytest.mark.parametrize("eta", [0.1, 0.4])
def test_a_hardness_is_simulated(eta):
    values = makers.heights(Part("honed", 1, 128))
    cap = eta * makers.GRADIENT
    surface = Surface.from_map(values, 1.0, periodic=True)
    pressure = cap * np.array([0.03, 0.2, 0.5])
    engine = OwnContact(values, (128.0, 128.0), hardness=cap)
    rows = []
    for force in pressure.tolist():
        row = engine.press(force)
        rows.append(
            (
                row["area"],
                row["mean_separation"],
                row["area_yielded"] / row["area"],
                engine.frozen_stiffness(),
            )
        )
    area, u, yielded, frozen = np.array(rows).T
    found = contact(
        surface,
        Bodies(hardness=[cap, cap, cap, np.inf]),
        pressure=[*pressure, pressure[1]],
        theory=FULL,
    )
    np.testing.assert_allclose(found.area[:3], area, rtol=0.03)
    np.testing.assert_allclose(found.mean_separation[:3], u, rtol=0.03)
    np.testing.assert_allclose(found.yielded[:3], yielded, atol=0.03)
    np.testing.assert_allclose(found.unloading_stiffness[:3], frozen, rtol=0.1)
    elastic = contact(surface, pressure=pressure[1], theory=FULL)
    assert (found.area[3], found.yielded[3]) == (pytest.approx(elastic.area), 0.0)
    assert (found.leakage.K[0] < elastic.leakage.K) == (
        found.mean_separation[0] < elastic.mean_separation
    )
    # towards the hardness everywhere
    heavy = contact(
        surface, Bodies(hardness=cap), pressure=cap * np.array([0.95, 0.999]), theory=FULL
    )
    assert (np.diff(heavy.area) > 0).all()
    assert heavy.area[1] == pytest.approx(1, abs=2e-3)
    law = contact_law(surface, Bodies(hardness=cap), theory=FULL)
    assert law.at_pressure(pressure[1]).area == pytest.approx(found.area[1], rel=1e-3)
    with pytest.raises(OutOfRangeError, match="at most the hardness"):
        contact(surface, Bodies(hardness=cap), pressure=1.1 * cap, theory=FULL)


pytest.importorskip("tamaas")


@pytest.fixture(scope="module")
def honed():
    return Surface.from_map(
        makers.heights(Part("honed", 1, 64)), 0.5, 1.0, periodic=True, unit="um"
    )


def test_pressures_gaps_and_contact_fit_each_other(honed):
    found = contact(honed, "2 GPa", pressure="20 MPa", theory=FULL)
    pressed = found.map()
    data = pressed.to_dataset()
    assert data.pressure.mean() == pytest.approx(0.02, rel=1e-3)
    assert (data.pressure.units, data.gap.units, data.x.units) == ("GPa", "um", "um")
    assert data.x[1] == 0.5
    assert data.y[1] == 1.0
    assert not (data.gap.values[data.contact.values] > 0).any()
    assert (data.gap.values[~data.contact.values] > 0).all()
    assert data.gap.mean() == pytest.approx(float(found.mean_separation), rel=0.01)
    # points in contact are more than the area, whose perimeter is corrected
    assert float(found.area) < data.contact.mean() < 1.3 * float(found.area)
    assert data.heights.values[data.contact.values].mean() > data.heights.values.std() / 2
    assert repr(pressed).startswith("ContactMap(points 64 x 64, pressure 0.02")


def test_a_map_that_is_not_periodic_is_cut_out_of_its_mirror_images():
    half = makers.heights(Part("honed", 1, 64))[:40, :48]
    own = Surface.from_map(half, 1.0, detrend="mean")
    images = np.block([[half, half[:, ::-1]], [half[::-1], half[::-1, ::-1]]])
    whole = Surface.from_map(images, 1.0, periodic=True)
    one, other = (contact(s, pressure=0.01, theory=FULL).map() for s in (own, whole))
    assert one.gap.shape == (40, 48)
    np.testing.assert_allclose(one.gap, other.gap[:40, :48], atol=1e-3 * one.gap.max())


def test_its_picture(honed, tmp_path):
    pytest.importorskip("matplotlib")
    contact(honed, pressure=0.01).map().plot(tmp_path / "map.png")
    assert (tmp_path / "map.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_what_has_no_map(honed, tmp_path):
    for found in (
        contact(honed, pressure=[0.01, 0.02]),
        contact(honed, Bodies(hardness=[0.1, 0.2]), pressure=0.01),
        contact(honed, mean_separation=2 * float(honed.h_max)),
        contact(Surface(0.8, 0.1, 2.0, 1.0, 3.0), separation=1.0),
    ):
        with pytest.raises(InputError):
            found.map()
    BoundaryElements.of(honed).to_netcdf(tmp_path / "own.nc")
    own = BoundaryElements.from_netcdf(tmp_path / "own.nc").surface
    with pytest.raises(InputError, match="this surface has none"):
        contact(own, Bodies(hardness=math.inf), pressure=0.01).map()
