"""One rule chooses the theory where none is given: every route asks the same question of the same theory."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from helpers import contact_of, random_map, run, sensitivity_of

from mbma_tables import (
    InputError,
    Joint,
    Scene,
    Surface,
    contact,
    contact_law,
    flow_factors,
    rough_contact,
    sensitivity,
)
from mbma_tables.cli import main
from mbma_tables.export.exported_law import exported_law
from mbma_tables.export.page.explorer import explorer_page
from mbma_tables.export.rows.law_rows import describe_law
from mbma_tables.theories import Mbma, Persson, resolve

NUMBERS = {"hurst": 0.8, "q0": 0.05, "q1": 1.5, "h_rms": 0.5, "h_max": 1.75}
E_STAR = "100 GPa"
PRESSURE = 0.3  # GPa, about 2% contact of these surfaces
PLACES = {"separation": 0.4, "mean_separation": 1.0, "pressure": PRESSURE, "area": 0.02}


def of_numbers():
    return Surface(**NUMBERS, unit="um")


def of_spectrum():
    known = of_numbers()
    q = np.geomspace(NUMBERS["q0"], NUMBERS["q1"], 40)
    return Surface.from_spectrum(
        q, known.power_spectrum(q), h_max=NUMBERS["h_max"], unit="um"
    )


def of_map():
    return Surface.from_map(heights(), 1.0, periodic=True, unit="um")


def heights():
    """Waves of at least four steps, with the height of the other surfaces."""
    values = random_map(64, 0.03, 0.25)
    return 0.5 * values / np.std(values)


SURFACES = {"calibrated": (of_numbers, of_spectrum), "simulated": (of_map,)}
KINDS = [(expected, make) for expected, makes in SURFACES.items() for make in makes]


@pytest.mark.parametrize(("expected", "make"), KINDS)
def test_the_rule(expected, make):
    surface = make()
    for by in (None, "mean_separation", "pressure", "area"):
        assert resolve(None, surface, by).name == expected
        assert resolve("persson", surface, by).name == "persson"
        printed = Mbma(variant="printed")
        assert resolve(printed, surface, by) is printed
        exact = Mbma(island_model="exact", variant="reported")
        assert resolve(exact, surface, by) is exact
        assert resolve(None, surface, by, {"variant": "printed"}) == printed
        assert resolve("mbma", surface, by, {"island_model": "exact"}) == exact
        with pytest.raises(InputError, match="grid: options of theory 'simulated' alone"):
            resolve("calibrated", surface, by, {"grid": "full"})
    assert resolve(None, surface, "separation").name == "mbma"
    assert resolve("calibrated", surface, "separation").name == "calibrated"


@pytest.mark.parametrize(("expected", "make"), KINDS)
@pytest.mark.parametrize("by", PLACES)
def test_contact_sensitivity_and_scene_of_one_question(expected, make, by):
    surface = make()
    expected = "mbma" if by == "separation" else expected
    place = {by: PLACES[by]}
    found = contact_of(surface, E_STAR, **place)
    assert found.theory == expected
    named = contact_of(surface, E_STAR, **place, theory=expected)
    assert (found.area, found.pressure) == (named.area, named.pressure)

    scene = Scene(
        surface,
        E_STAR,
        quantities=["pressure", "area", "stiffness"],
        **{by: [PLACES[by]]},
    )
    content = scene.run()
    assert content.attrs["theory"] == expected
    np.testing.assert_allclose(content["stiffness"].values, found.stiffness, rtol=1e-6)

    slopes = sensitivity_of(surface, E_STAR, **place)
    assert slopes.answers["stiffness"] == pytest.approx(float(found.stiffness), rel=1e-6)


@pytest.mark.parametrize(("expected", "make"), KINDS)
def test_laws_exports_flow_factors_and_rough_bodies(expected, make):
    surface = make()
    found = contact(surface, E_STAR, pressure=PRESSURE)
    law = contact_law(surface, E_STAR)
    assert law.theory == expected
    assert law.at_pressure(PRESSURE).area == pytest.approx(float(found.area), rel=1e-6)
    exported = exported_law(surface, E_STAR)
    assert (exported.theory.name, exported.law.theory) == (expected, expected)
    rows = describe_law(surface, E_STAR, pressures=("0.1 GPa", "0.5 GPa"))
    assert any(f"theory {expected!r}" in line for line in rows.comments)
    film = flow_factors(surface, found.mean_separation, E_STAR)
    assert film.area[0] == pytest.approx(float(found.area), rel=1e-9)
    ball = rough_contact(surface, "50 mm", E_STAR, force="100 N")
    assert ball.layer.theory == expected


@pytest.mark.parametrize(("expected", "make"), KINDS)
def test_a_joint(expected, make):
    surface = make()
    metals = "steel 4140 hard"
    joint = Joint(surface, bodies=metals)
    found = joint.at_pressure(PRESSURE)
    assert found.theory == expected
    # of maps that are simulated if that converges both names
    assert expected in joint.facts()["theory"]
    assert found.area == contact(surface, joint.bodies, pressure=PRESSURE).area
    assert found.area == contact(surface, metals, pressure=PRESSURE).area
    assert joint.table([PRESSURE]).attrs["theory"] == expected
    card = joint.export("csv", pressures=("100 MPa", "500 MPa"), heat=False)
    assert f"theory {expected!r}" in card


def test_options_by_name_on_the_command_line():
    """Every option of a theory is one of the commands, without a line of its own."""
    surface = Surface.named("concrete")
    words = ("contact", "--surface", "concrete", "-u", "0.6", "--json")
    for theory, option in (
        (Persson("simplified"), "method=simplified"),
        (Mbma(outside="exact"), "outside=exact"),
        (Mbma(rtol=1e-4), "rtol=1e-4"),
    ):
        known = contact(surface, mean_separation=0.6, theory=theory)
        for named in ((), ("--theory", theory.name)):
            found = json.loads(run(*words, *named, "--option", option))
            assert found["theory"] == theory.name
            assert found["columns"]["pressure"] == [float(known.pressure)]


@pytest.mark.parametrize(
    ("expected", "options", "law_by"),
    [
        ("calibrated", ("--file", "numbers.toml"), ()),
        (
            "simulated",
            ("--map", "map.npy", "--dx", "1um", "--periodic", "--length-unit", "um"),
            (),
        ),
        ("mbma", ("--file", "numbers.toml"), ("--variant", "printed")),
    ],
)
def test_the_command_line(expected, options, law_by, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.save("map.npy", heights())
    lines = [f"{name} = {value}" for name, value in NUMBERS.items()]
    (tmp_path / "numbers.toml").write_text(
        "\n".join(["[surface]", *lines, 'length_unit = "um"'])
    )
    joint = (*options, *law_by, "--E-star", "100GPa")

    for by, place in PLACES.items():
        asked = ("--" + by.replace("_", "-"), str(place), *joint, "--json")
        theory = "mbma" if by == "separation" else expected
        found = json.loads(run("contact", *asked))
        assert found["theory"] == theory
        slopes = json.loads(run("sensitivity", *asked))
        assert slopes["theory"] == theory
        assert slopes["answers"]["stiffness"] == pytest.approx(
            found["columns"]["stiffness"][0], rel=1e-6
        )
    assert json.loads(run("curve", *joint, "--json"))["theory"] == expected
    # limits of validity are printed beside the file
    asked = ("export", "csv", *joint, "--pressures", "0.1GPa:0.3GPa", "--out", "law.csv")
    assert CliRunner().invoke(main, asked).exit_code == 0
    made = "variant 'printed'" if law_by else f"theory {expected!r}"
    assert made in (tmp_path / "law.csv").read_text()


def test_a_map_and_its_fit_by_one_theory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.save("map.npy", heights())
    options = ("--dx", "1um", "--periodic", "--length-unit", "um")
    table = json.loads(
        run("fit", "map.npy", "--dx", "1", "--periodic", "--length-unit", "um", "--json")
    )
    assert table["theory"] == "simulated"
    areas = ",".join(map(str, table["columns"]["area"]))
    found = json.loads(
        run("contact", "--map", "map.npy", *options, "--area", areas, "--json")
    )
    assert found["theory"] == "simulated"
    np.testing.assert_allclose(
        found["columns"]["pressure"], table["columns"]["pressure"], rtol=1e-9
    )


def test_parts_of_a_scene_that_only_mbma_has_make_it_mbmas():
    surface = of_numbers()
    for part in ({"points": 64}, {"deltas": [0.1]}, {"without": ["subscale_area"]}):
        scene = Scene(surface, E_STAR, pressure=[PRESSURE], **part)
        assert scene.theory == "mbma"


def test_the_page_starts_with_the_law_of_the_surface_and_does_not_simulate():
    for make in (of_numbers, of_spectrum, of_map):
        assert '"theory": "calibrated"' in explorer_page(make(), 100.0, "GPa")
    assert '"theory": "mbma"' in explorer_page(
        of_numbers(), 100.0, "GPa", variant="printed"
    )
    with pytest.raises(InputError, match="five numbers"):
        explorer_page(of_spectrum(), 100.0, "GPa", variant="printed")


def test_the_sensitivity_of_a_map_is_that_of_its_simulation():
    """Heights and lengths scale exactly, so that slopes follow from those by the pressure."""
    surface = of_map()
    slopes = sensitivity(surface, E_STAR, pressure=PRESSURE).slopes
    step = 1e-3
    loads = PRESSURE * np.exp([-step, step])
    areas = contact(surface, E_STAR, pressure=loads, theory="simulated").area
    by_pressure = np.diff(np.log(areas))[0] / (2 * step)
    assert slopes["pressure"]["area"] == pytest.approx(by_pressure, abs=1e-3)
    # dimensional analysis: area depends on p/(E* slope) alone
    assert slopes["heights"]["area"] == pytest.approx(-by_pressure, abs=1e-3)
    assert slopes["lengths"]["area"] == pytest.approx(by_pressure, abs=1e-3)
    assert set(slopes) == {"heights", "lengths", "E_star", "pressure"}
