"""Contacts with an attraction: identities, limits, and boundary elements that no constant was fitted to."""

import dataclasses
import functools
import io
import runpy

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy.integrate import quad

from generate import files
from generate.boundary_elements.solve import load_at, prepared
from generate.boundary_elements.surfaces import Recipe, heights
from mbma_tables import (
    Adhesion,
    Bodies,
    Joint,
    Scene,
    Surface,
    contact,
    contact_function,
    contact_law,
    sensitivity,
)
from mbma_tables.common.errors import InputError, MissingError, OutOfRangeError
from mbma_tables.common.units import Units
from mbma_tables.contacts.sticking import sticking
from mbma_tables.theories import gap_law
from mbma_tables.theories.adhesion import MOST_TABOR, THETA
from mbma_tables.theories.gap_law import open_gaps
from mbma_tables.theories.simulated.adhesive import AdhesiveContact

FACE = Surface(hurst=0.8, q0=0.1, q1=1.6, h_rms=0.1, h_max=0.35, unit="um")
WORK, RANGE = "10 mJ/m^2", "10 nm"
STICKY = Bodies("1 GPa", adhesion=Adhesion(WORK, RANGE))
pressed = functools.partial(contact, FACE, theory="calibrated")


def adhesive(work, reach):
    """Bodies of 1 GPa; work [GPa um], range [um]."""
    return Bodies("1 GPa", adhesion=Adhesion(work, reach))


def test_without_work_it_is_the_theory_to_the_last_bit():
    loads = [1e-4, 1e-3, 0.01]
    plain = pressed("1 GPa", pressure=loads)
    none = pressed(Bodies("1 GPa", adhesion=Adhesion(0, RANGE)), pressure=loads)
    for name, variable in plain.variables().items():
        assert np.array_equal(variable.values, none.quantity(name), equal_nan=True), name


@pytest.mark.parametrize("theory", ["calibrated", "persson", "mbma"])
def test_the_net_pressure_is_the_elastic_one_less_the_attraction(theory):
    """Against the elastic contact's own gaps, area and pressure."""
    u = np.array([0.08, 0.15, 0.25])
    elastic = contact(FACE, "1 GPa", mean_separation=u, theory=theory)
    sticky = contact(FACE, STICKY, mean_separation=u, theory=theory)
    strength = 10e-3 / 10e-9 / 1e9  # GPa
    near = elastic.gap_mean(lambda gap: np.exp(-gap / 0.01))
    expected = elastic.pressure - strength * (near + THETA * elastic.area)
    assert sticky.pressure == pytest.approx(expected, rel=1e-9, abs=1e-15)
    assert sticky.area == pytest.approx(elastic.area, rel=1e-12)
    assert sticky.gap_mean(np.abs) == pytest.approx(u, rel=1e-9)
    step = 1e-5
    slope = [contact(FACE, STICKY, mean_separation=x, theory=theory).pressure for x in (u - step, u + step)]  # fmt: skip
    assert sticky.stiffness == pytest.approx((slope[0] - slope[1]) / (2 * step), rel=1e-3)


def test_pressures_are_found_on_the_closest_contact():
    loads = np.array([[0.02, 1e-3], [1e-5, 0.0]])
    found = pressed(STICKY, pressure=loads)
    again = pressed(STICKY, mean_separation=found.mean_separation)
    assert again.pressure == pytest.approx(loads, rel=1e-9, abs=1e-14)
    assert (found.stiffness > 0).all()
    plain = pressed("1 GPa", pressure=loads[0])
    assert (found.area[0] > plain.area).all()
    assert (found.mean_separation[0] < plain.mean_separation).all()
    by_area = pressed(STICKY, area=found.area[0])
    assert by_area.pressure == pytest.approx(loads[0], rel=1e-6)


def test_more_contacts_of_a_pair_of_bodies_need_no_more_gaps(monkeypatch):
    """The mean over gaps, a hundred times an elastic contact, is that of a few contacts for any number of loads."""
    rows = []

    def counted(u, *arguments):
        rows.append(np.size(u))
        return open_gaps(u, *arguments)

    monkeypatch.setattr(gap_law, "open_gaps", counted)
    loads = np.geomspace(1e-4, 0.02, 2000)
    face = dataclasses.replace(FACE)
    first = contact(face, STICKY, pressure=loads, theory="calibrated")
    assert sum(rows) < loads.size
    rows.clear()
    again = contact(face, STICKY, pressure=1.01 * loads[:-1], theory="calibrated")
    other = contact(face, adhesive(4e-6, 0.01), pressure=0.005, theory="calibrated")
    assert not rows
    monkeypatch.undo()
    for found in (first, again, other):
        # the net pressure by the gaps of an elastic contact
        elastic = contact(face, "1 GPa", mean_separation=found.mean_separation, theory="calibrated")  # fmt: skip
        near = elastic.gap_mean(lambda gap: np.exp(-gap / 0.01)) + THETA * elastic.area
        strength = 4e-4 if found is other else 1e-3
        expected = elastic.pressure - strength * near
        assert found.pressure == pytest.approx(expected, rel=1e-8)


def test_the_attraction_is_the_mean_over_gaps_beside_every_bend():
    """Bodies that nearly touch, that are apart, and gaps of a few wavelengths of light."""
    u = [1e-9, 1e-4, 0.33, 0.345, 0.3499999, 0.35, 0.350001, 0.4, 1.1, 3.0]
    for reach in (0.002, 0.01, 1.0):
        bodies = adhesive(1e-5, reach)
        found = pressed(bodies, mean_separation=u)
        share, gap = open_gaps(u, found.area, FACE.alpha, 0.1)
        near = (share * np.exp(-gap / reach)).sum(axis=-1) + THETA * found.area
        np.testing.assert_allclose(found.attraction, 1e-5 / reach * near, rtol=1e-8)
        elastic = pressed("1 GPa", mean_separation=u)
        np.testing.assert_allclose(
            found.pressure, elastic.pressure - 1e-5 / reach * near, rtol=1e-7, atol=1e-25
        )


def test_pull_off_is_the_largest_tension_of_any_gap():
    free = pressed(STICKY, pressure=0.0)
    gaps = np.linspace(0.2, 0.5, 30001)
    tension = -pressed(STICKY, mean_separation=gaps).pressure
    assert float(free.pull_off) == pytest.approx(tension.max(), rel=2e-3)
    assert float(free.pull_off) >= tension.max()
    assert float(free.zero_load_gap) == pytest.approx(float(free.mean_separation))
    assert float(free.zero_load_area) == pytest.approx(float(free.area))
    beyond = gaps > float(free.mean_separation)
    work = np.trapezoid(tension[beyond], gaps[beyond])
    assert float(free.effective_work) == pytest.approx(work, rel=0.02)
    pulled = pressed(STICKY, pressure=-0.9 * float(free.pull_off))
    assert pulled.pressure == pytest.approx(-0.9 * float(free.pull_off), rel=1e-6)
    with pytest.raises(OutOfRangeError, match="part"):
        pressed(STICKY, pressure=-1.01 * float(free.pull_off))


def test_units_do_not_matter():
    one = pressed(STICKY, pressure="1 MPa")
    in_nm = contact(FACE.to("nm"), Bodies("1000 MPa", adhesion=Adhesion("0.01 N/m", "0.01 um")), pressure="1 MPa", theory="calibrated")  # fmt: skip
    assert in_nm.area == pytest.approx(one.area, rel=1e-9)
    assert in_nm.effective_work == pytest.approx(1e6 * one.effective_work, rel=1e-6)
    numbers = contact(FACE, Bodies(1.0, adhesion=Adhesion(1e-5, 0.01)), pressure=1e-3, theory="calibrated")  # fmt: skip
    assert numbers.area == pytest.approx(one.area, rel=1e-9)


def test_tractions_have_the_work_that_is_given():
    for traction in ("exponential", "van der Waals", lambda x: np.exp(-(x**2))):
        shape = Adhesion(1.0, 1.0, traction=traction).shape
        assert quad(lambda x, s=shape: float(s(np.array([x]))[0]), 0, np.inf)[
            0
        ] == pytest.approx(1.0, rel=1e-4)
    own = Bodies("1 GPa", adhesion=Adhesion(WORK, RANGE, traction=lambda x: 3 * np.exp(-x)))  # fmt: skip
    assert pressed(own, pressure="1 MPa").area == pytest.approx(
        pressed(STICKY, pressure="1 MPa").area, rel=1e-4
    )
    # half-spaces at the cutoff attract each other with A/(6 pi D^3)
    waals = Adhesion.of_hamaker("1e-19 J", "0.2 nm")
    metres = Units(length="m", stress="Pa")
    strength = waals.work_in(metres) / 0.2e-9 * float(waals.shape(np.zeros(1))[0])
    assert strength == pytest.approx(1e-19 / (6 * np.pi * 0.2e-9**3), rel=1e-3)
    assert not pressed(Bodies("100 GPa", adhesion=waals), pressure="1 MPa").valid


def test_laws_joints_and_leakage_go_by_the_same_contact():
    one = pressed(STICKY, pressure="2 MPa")
    law = contact_law(FACE, STICKY, "calibrated")
    at = law.at_pressure("2 MPa")
    assert at.area == pytest.approx(one.area, rel=1e-5)
    assert at.mean_separation == pytest.approx(one.mean_separation, rel=1e-6)
    joint = Joint(FACE, bodies=STICKY, theory="calibrated")
    assert joint.at(pressure="2 MPa").area == pytest.approx(one.area, rel=1e-5)
    elastic = pressed("1 GPa", mean_separation=one.mean_separation)
    assert pytest.approx(elastic.leakage.K, rel=1e-9) == one.leakage.K


def rows_of(text):
    """Numbers of a CSV file."""
    return pd.read_csv(io.StringIO(text), comment="#").to_numpy()


@pytest.mark.slow
def test_rows_and_code_are_of_the_contacts_themselves(tmp_path):
    """Against contacts at their pressures, in other units than the surface's."""
    bodies = dataclasses.replace(STICKY, conductivity="45 W/(m K)")
    joint = Joint(FACE, bodies=bodies, theory="calibrated")
    asked = {"pressures": ("0.5 MPa", "20 MPa"), "rtol": 1e-3}
    for quantity, own, factor in (
        ("solid_conductance", "solid_conductance", 1e-3),
        ("area", "area", 1.0),
        ("hydraulic_aperture", "hydraulic_aperture", 1e-3),
    ):
        pressure, value = rows_of(joint.export("csv", quantity=quantity, **asked))[
            :, :2
        ].T
        found = joint.at_pressure([f"{p} MPa" for p in pressure[1:-1:8]])
        expected = np.asarray(found.quantity(own)) * factor
        known = expected > 0
        assert value[1:-1:8][known] == pytest.approx(expected[known], rel=3e-3), quantity
    overclosure, pressure = rows_of(joint.export("csv", quantity="pressure", **asked)).T
    assert overclosure[0] == pressure[0] == 0
    # errors below the smallest pressure asked for are relative to that
    above = pressure > 0.5
    u = [f"{0.35e-3 - c} mm" for c in overclosure[above]]
    net = contact(FACE, bodies, mean_separation=u, theory="calibrated").pressure
    assert pressure[above] == pytest.approx(1e3 * net, rel=1.1e-3)
    file = tmp_path / "law.py"
    file.write_text(joint.export("python-law"))
    law = runpy.run_path(str(file))
    one = pressed(STICKY, pressure="2 MPa")
    c = 0.35e-3 - 1e-3 * float(one.mean_separation)
    assert law["pressure"](c) == pytest.approx(2.0, rel=1e-4)
    assert law["area"](c) == pytest.approx(float(one.area), rel=1e-4)
    text = joint.export("c-law")
    assert "adhesion: work" in text
    assert "pull-off" in text
    with pytest.raises(InputError, match="adhesion"):
        joint.export("csv", quantity="film")


def test_plain_works_and_ranges_keep_their_units_in_exports():
    """Numbers of a surface in um and a modulus in GPa, in files of mm and MPa."""
    plain = Bodies("1 GPa", adhesion=Adhesion(1e-5, 0.01))
    named, numbers = (
        rows_of(joint.export("csv", quantity="pressure", pressures=("1 MPa", "20 MPa")))
        for joint in (
            Joint(FACE, bodies=bodies, theory="calibrated") for bodies in (STICKY, plain)
        )
    )
    np.testing.assert_allclose(numbers, named, rtol=1e-9)


def test_what_is_refused():
    for wrong in (np.nan, np.inf, -1e-3, "5 J", "-5 mJ/m^2", [1.0, -2.0]):
        with pytest.raises((InputError, OutOfRangeError)):
            Adhesion(wrong, RANGE)
    for wrong in (0.0, np.nan, np.inf, "5 J", -1.0):
        with pytest.raises((InputError, OutOfRangeError)):
            Adhesion(WORK, wrong)
    for wrong in ("springs", 3, lambda x: x, lambda x: 1 / (1 + x)):
        with pytest.raises(InputError):
            Adhesion(WORK, RANGE, traction=wrong)
    with pytest.raises(InputError, match="hardness"):
        pressed(
            Bodies("1 GPa", hardness="20 MPa", adhesion=Adhesion(WORK, RANGE)),
            pressure="1 MPa",
        )
    with pytest.raises(InputError, match="unit"):
        contact(Surface(0.8, 0.1, 1.6, 0.1, 0.35), STICKY, pressure="1 MPa")
    with pytest.raises(InputError, match="adhesion"):
        Bodies("1 GPa", adhesion="strong")
    with pytest.raises(MissingError, match="adhesion"):
        _ = pressed("1 GPa", pressure="1 MPa").pull_off
    with pytest.raises(MissingError, match="energy"):
        _ = pressed(STICKY, pressure="1 MPa").energy
    with pytest.raises(OutOfRangeError):
        pressed("1 GPa", pressure="-1 MPa")


def test_valid_ends_with_its_reasons():
    light = pressed(STICKY, pressure="1 MPa")
    assert light.valid
    assert float(light.tabor_number) < MOST_TABOR
    hot = Bodies("1 GPa", adhesion=Adhesion("100 mJ/m^2", RANGE))
    strong = pressed(hot, pressure="1 MPa")
    assert not strong.valid
    assert any("Tabor" in reason for reason in strong.reasons)
    pulled = pressed(STICKY, pressure=-0.5 * float(light.pull_off))
    assert any("tension" in reason for reason in pulled.reasons)
    short = Bodies("1000 GPa", adhesion=Adhesion("1 mJ/m^2", "0.5 nm"))
    assert any("range" in reason for reason in pressed(short, pressure="1 GPa").reasons)


def test_nothing_drops_the_attraction():
    scene = Scene(
        FACE, STICKY, pressure="2 MPa", theories=["persson"], theory="calibrated"
    )
    found = scene.run()
    u = float(found.mean_separation[0])
    other = contact(FACE, STICKY, mean_separation=u, theory="persson")
    assert float(found.persson_pressure[0]) == pytest.approx(other.pressure, rel=1e-6)
    assert float(found.area[0]) == pytest.approx(
        pressed(STICKY, pressure="2 MPa").area, rel=1e-5
    )


def held_out():
    """The contacts of docs/adhesion.md by Tamaas, soft ones that its solver finished."""
    rows = pd.read_csv(files.ROOT / "docs/data/adhesive_held_out.csv", comment="#")
    tabor = np.cbrt(2 * rows.w**2 / (rows.laplacian_rms * rows.rho**3))
    soft = (tabor < MOST_TABOR) & (rows.residual < 1e-3) & (rows.gap_over_h_rms > 0.003)
    return rows[soft]


def test_held_out_simulations_from_numbers_alone():
    """How the attraction changes area and gap, of five surfaces known by their spectra alone.

    Areas of those simulations are shares of points; their ratio to the elastic share is
    free of what that adds.
    """
    rows = held_out()
    growth, gap, over_scatter = [], [], []
    for row in rows.itertuples():
        q0, q1 = 2 * np.pi * row.nl, 2 * np.pi * 256 / row.points
        face = Surface(row.hurst, q0, q1, row.h_rms, 4 * row.h_rms)
        own = functools.partial(contact, face, theory="calibrated")
        bodies = Bodies(1.0, adhesion=Adhesion(row.w, row.rho))
        try:
            sticky = own(bodies, pressure=row.net_pressure)
        except OutOfRangeError:
            # the attraction closes all gaps
            assert row.gap_over_h_rms < 0.02
            continue
        plain = own(pressure=row.net_pressure)
        simulated = row.compressed_area / row.elastic_area
        growth.append(np.log(sticky.area / plain.area / simulated))
        gap.append(np.log(sticky.mean_separation / row.h_rms / row.gap_over_h_rms))
        over_scatter.append(
            (sticky.mean_separation - row.gap_over_h_rms * row.h_rms)
            / sticky.separation_scatter
        )
    assert len(growth) > 80
    # of contacts that are of a kind that was compared
    known = np.array(over_scatter)[np.isfinite(over_scatter)]
    assert known.size > 40
    assert np.mean(np.abs(known) < 2) > 0.92
    assert np.median(np.abs(growth)) < 0.015
    assert np.quantile(np.abs(growth), 0.9) < 0.05
    assert np.median(np.abs(gap)) < 0.06


def test_whether_it_sticks_beside_published_criteria():
    """Numbers of criteria by hand, from powers of the spectrum's wavenumbers."""
    hurst, q, zeta, h = 0.8, 2.0, 4.0, 0.01
    face = Surface(hurst, q0=q, q1=zeta * q, h_rms=h, h_max=0.035, unit="um")

    def mean_power(n):
        """Mean of q^n weighted by height variance."""
        powers = [(zeta ** (k - 2 * hurst) - 1) / (k - 2 * hurst) for k in (n, 0)]
        return q**n * powers[0] / powers[1]

    bodies = Bodies("1 GPa", adhesion=Adhesion("1 mJ/m^2", "10 nm"))
    found = sticking(face, bodies, theory="calibrated")
    length, width = 1e-6, 0.01  # work over E*, range [um]
    robbins, persson, fuller = found.criteria
    # energy of full contact: q h^2/4 of each wave, over w/E*
    full = mean_power(1) * h**2 / 4
    assert persson.number == pytest.approx(full / length, rel=1e-4)
    gradient, laplacian = h * mean_power(2) ** 0.5, h * mean_power(4) ** 0.5
    spots = gradient * width / (2 * length)
    spots *= (gradient * 8 * gradient / laplacian / (4 * width)) ** (2 / 3)
    assert robbins.number == pytest.approx(spots, rel=1e-4)
    radius, height = float(face.summit_radius), float(face.summit_sigma)
    elongation = 0.75 * (np.pi**2 * length**2 * radius) ** (1 / 3)
    assert fuller.number == pytest.approx(height / elongation, rel=1e-6)
    free = contact(face, bodies, pressure=0.0, theory="calibrated")
    assert found.pull_off == pytest.approx(float(free.pull_off))
    # more work sticks by more criteria
    weak, strong = (
        sticking(face, Bodies("1 GPa", adhesion=Adhesion(work, "10 nm")), "calibrated")
        for work in ("0.1 mJ/m^2", "80 mJ/m^2")
    )
    assert sum(one.sticks for one in weak.criteria) == 0
    assert sum(one.sticks for one in strong.criteria) > 0
    assert strong.pull_off > weak.pull_off
    assert "Persson, Tosatti" in str(strong)
    with pytest.raises(InputError, match="adhesion"):
        sticking(face, Bodies("1 GPa"))


@pytest.mark.slow
def test_the_solver_against_tamaas_on_the_same_grid():
    tamaas = pytest.importorskip("tamaas")
    surface, _, _ = prepared(
        heights(Recipe("self_affine", 0.8, 8, 2, 21, 128)), (1.0, 1.0), 4 * np.pi
    )
    surface = np.ascontiguousarray(0.1 * surface)
    rho = 0.2 * surface.std()
    work = 0.02 * 0.1 * rho
    engine = AdhesiveContact(
        surface, (1.0, 1.0), lambda gap: work / rho * np.exp(-gap / rho), 1e-7
    )
    own = engine.press(load_at(0.3, np.inf) * 0.1)
    tamaas.set_log_level(tamaas.LogLevel.error)
    model = tamaas.ModelFactory.createModel(
        tamaas.model_type.basic_2d, [1.0, 1.0], list(surface.shape)
    )
    model.E, model.nu = 1.0, 0.0
    solver = tamaas.PolonskyKeerRey(
        model, surface, 1e-8, tamaas.PolonskyKeerRey.gap, tamaas.PolonskyKeerRey.pressure
    )
    solver.max_iter = 20_000
    attraction = tamaas.ExponentialAdhesionFunctional(surface)
    attraction.parameters = {"rho": rho, "surface_energy": work}
    solver.addFunctionalTerm(attraction)
    solver.solve(own["net_pressure"])
    gap = np.asarray(model.displacement) - surface
    gap -= gap.min()
    assert gap.mean() == pytest.approx(own["mean_separation"], rel=1e-4)
    traction = np.asarray(model.traction)
    # where nothing touches its solver leaves rounding of either sign
    pressed_points = (traction > 1e-5 * traction.max()).mean()
    assert pressed_points == pytest.approx(own["area_compressed"], abs=1e-3)
    assert traction.mean() == pytest.approx(own["net_pressure"], rel=1e-4)


def test_arrays_of_works_and_ranges_are_those_of_each():
    works = np.array([[1e-5], [4e-6], [0.0]])
    ranges = np.array([0.01, 0.02])
    area = pressed(adhesive(works, ranges), pressure=1e-3).area
    parting = pressed(adhesive(works, ranges), pressure=1e-3).pull_off
    assert area.shape == parting.shape == (3, 2)
    for row, work in enumerate(works[:, 0]):
        for column, reach in enumerate(ranges):
            one = pressed(adhesive(work, reach), pressure=1e-3)
            assert area[row, column] == pytest.approx(one.area, rel=1e-13)
            if work:
                assert parting[row, column] == pytest.approx(one.pull_off, rel=1e-9)
    assert (parting[2] == 0).all()
    named = xr.DataArray([1e-5, 4e-6], dims="rubber")
    labelled = pressed(adhesive(named, 0.01), pressure=1e-3).area
    assert labelled.dims == ("rubber",)
    np.testing.assert_allclose(labelled, area[:2, 0], rtol=1e-13)
    with pytest.raises(InputError, match="work must be one number"):
        contact_law(FACE, adhesive(works, 0.01), "calibrated")


def test_derivatives_by_work_and_range_are_slopes_of_contacts():
    by = sensitivity(FACE, adhesive(1e-5, 0.01), pressure=1e-3, theory="calibrated")
    step = 1e-3
    for name, more, less in (
        ("work", (1e-5 * (1 + step), 0.01), (1e-5 * (1 - step), 0.01)),
        ("range", (1e-5, 0.01 * (1 + step)), (1e-5, 0.01 * (1 - step))),
    ):
        ends = [
            float(pressed(adhesive(*each), pressure=1e-3).area) for each in (more, less)
        ]
        slope = (np.log(ends[0]) - np.log(ends[1])) / np.log((1 + step) / (1 - step))
        assert by.slopes[name]["area"] == pytest.approx(slope, rel=1e-4)


def test_derivatives_of_everything_that_attracts_are_differences():
    """By bodies, surface and load, of functions, joints, arrays and batches, against contacts on both sides."""
    names = ("area", "unloading_stiffness", "attraction", "zero_load_area", "tabor_number", "pull_off")  # fmt: skip
    numbers = {"work": 1e-5, "range": 0.01, "h_rms": 0.1, "E_star": 1.0, "pressure": 1e-3}

    def values(work, range, h_rms, E_star, pressure):
        face = dataclasses.replace(FACE, h_rms=h_rms)
        bodies = Bodies(f"{float(E_star)!r} GPa", adhesion=Adhesion(work, range))
        found = contact(face, bodies, pressure=pressure, theory="calibrated")
        return np.array([float(found.quantity(name)) for name in names])

    function = contact_function(FACE, adhesive(1e-5, 0.01), quantities=names, numbers=list(numbers), pressure=1e-3, theory="calibrated")  # fmt: skip
    at = np.array(list(numbers.values()))
    found, jacobian = function.values_and_jacobian(at)
    np.testing.assert_allclose(found, values(*at), rtol=1e-9)
    step = 1e-3
    for column, number in enumerate(at):
        ends = np.array([at, at])
        ends[:, column] = number * (1 + step), number * (1 - step)
        slope = (values(*ends[0]) - values(*ends[1])) / (2 * step * number)
        largest = 1e-6 * np.abs(found / number)
        np.testing.assert_allclose(jacobian[:, column], slope, rtol=2e-3, atol=largest.max() * 1e-3)  # fmt: skip
    joint = Joint(FACE, bodies=adhesive(1e-5, 0.01), theory="calibrated")
    of_joint = joint.function(["area"], ["work", "range"], 1e-3)
    np.testing.assert_allclose(of_joint.jacobian(of_joint.start), jacobian[:1, :2], rtol=1e-5)  # fmt: skip
    asked = {"pressure": 1e-3, "theory": "calibrated"}
    works = sensitivity(FACE, adhesive([1e-5, 4e-6], 0.01), **asked)
    own = [sensitivity(FACE, adhesive(work, 0.01), **asked) for work in (1e-5, 4e-6)]
    for name in ("work", "range", "h_rms"):
        each = [one.derivatives[name]["area"] for one in own]
        np.testing.assert_allclose(works.derivatives[name]["area"], each, rtol=1e-4)
    faces = Surface(hurst=[0.8, 0.7], q0=0.1, q1=1.6, h_rms=0.1, h_max=0.35, unit="um")
    batch = sensitivity(faces, adhesive(1e-5, 0.01), **asked)
    assert batch.slopes["work"]["area"][0] == pytest.approx(own[0].slopes["work"]["area"], rel=1e-4)  # fmt: skip
    # beyond pull-off there is no contact to derive
    with pytest.raises(OutOfRangeError, match="part"):
        sensitivity(FACE, STICKY, pressure=-1.0, theory="calibrated")
    with pytest.raises(InputError, match="work must be an energy"):
        Joint(FACE, bodies=Bodies("1 GPa", adhesion=Adhesion("8..12 mJ/m^2", RANGE)))
