"""The registry of quantities: what is declared once shows everywhere."""

import csv
import inspect
import json
import types
import zipfile

import numpy as np
import pytest
from click.testing import CliRunner
from helpers import compiled_law, needs

from generate.quantities import FILE, properties
from mbma_tables import (
    Bodies,
    InputError,
    Joint,
    Scene,
    Surface,
    contact,
    contact_law,
    sensitivity,
)
from mbma_tables.cli import main
from mbma_tables.common.errors import MissingError
from mbma_tables.common.units import (
    ELECTRICAL_CONDUCTANCE,
    HEAT_CONDUCTANCE,
    Dimension,
    Units,
)
from mbma_tables.contacts.quantities import registry
from mbma_tables.contacts.result import Contact, Setup
from mbma_tables.design.batch import batch
from mbma_tables.export.page.explorer import explorer_page

FACE = Surface(hurst=0.8, q0=0.06, q1=3.0, h_rms=1.0, h_max=3.5, unit="um")
METALS = ("steel 4140 hard", "aluminium 6061 hard")
LAYER = 3.7e3  # heat capacity per area of the layer of `thermal_time` [J/(m^2 K)]


@pytest.fixture
def thermal_time(monkeypatch):
    """A quantity that is declared in a file of its own (`thermal_time.py` beside this one), and listed."""
    monkeypatch.syspath_prepend(__file__.rpartition("/")[0])
    monkeypatch.setattr(registry, "MODULES", [*registry.MODULES, "thermal_time"])


def test_a_declared_quantity_shows_in_contacts_laws_joints_datasets_and_commands(
    thermal_time,
):
    pressures = ["10 MPa", "50 MPa"]
    pressed = contact(FACE, METALS, pressure=pressures, theory="calibrated")
    seconds = LAYER / pressed.solid_conductance
    np.testing.assert_allclose(pressed.thermal_time, seconds, rtol=1e-14)
    assert pressed.units["thermal_time"] == "s"
    np.testing.assert_array_equal(
        pressed.scatter_of("thermal_time"), pressed.unloading_stiffness_scatter
    )
    data = pressed.to_dataset()
    assert data["thermal_time"].attrs["units"] == "s"
    np.testing.assert_array_equal(data["thermal_time"], pressed.thermal_time)

    law = contact_law(FACE, METALS, "calibrated")
    np.testing.assert_allclose(
        law.at(pressure=pressures).thermal_time, seconds, rtol=1e-5
    )
    data = law.to_dataset()
    own = LAYER / data["solid_conductance"]
    np.testing.assert_allclose(data["thermal_time"], own, rtol=1e-14)
    assert data["thermal_time"].attrs["units"] == "s"

    joint = Joint(FACE, bodies=METALS, theory="calibrated")
    np.testing.assert_allclose(
        joint.table(pressures)["thermal_time"], seconds, rtol=1e-12
    )

    words = [
        "contact",
        "--hurst",
        "0.8",
        "--q0",
        "0.06",
        "--q1",
        "3",
        "--h-rms",
        "1",
        "--h-max",
        "3.5",
    ]
    words += [
        "--length-unit",
        "um",
        "--E-star",
        "57.5GPa",
        "--hardness",
        "0.95GPa",
        "--theory",
        "calibrated",
    ]
    words += ["--conductivity", "45W/(m K),167W/(m K)", "-p", "10MPa", "--json"]
    answer = CliRunner().invoke(main, words, catch_exceptions=False)
    assert answer.exit_code == 0, answer.output
    report = json.loads(answer.output)
    conductance = report["columns"]["solid_conductance"][0]
    assert report["columns"]["thermal_time"][0] == pytest.approx(
        LAYER / conductance, rel=1e-12
    )
    assert report["units"]["thermal_time"] == "s"


def test_what_a_quantity_needs_is_named_with_the_remedy(thermal_time):
    pressed = contact(FACE, "100 GPa", pressure="10 MPa", theory="calibrated")
    with pytest.raises(
        InputError,
        match=r"thermal_time needs conductivity.*Bodies\(\.\.\., conductivity=",
    ):
        _ = pressed.thermal_time
    assert "thermal_time" not in pressed.available()


def test_an_unknown_quantity_is_refused_with_the_nearest():
    pressed = contact(FACE, "100 GPa", pressure="10 MPa", theory="calibrated")
    with pytest.raises(InputError, match="did you mean 'stiffness'"):
        pressed.quantity("stifness")
    with pytest.raises(AttributeError):
        _ = pressed.stifness


def test_typed_properties_are_those_of_the_registry():
    assert FILE.read_text(encoding="utf-8") == properties()


@pytest.mark.parametrize(
    ("dimension", "unit"),
    [
        (Dimension(), "1"),
        (Dimension(length=1), "um"),
        (Dimension(stress=1, length=-1), "MPa/um"),
        (Dimension(stress=1, length=1), "MPa um"),
        (Dimension(length=3), "um^3"),
        (HEAT_CONDUCTANCE, "W/(m^2 K)"),
        (ELECTRICAL_CONDUCTANCE, "S/m^2"),
        (Dimension(time=1), "s"),
        (Dimension(stress=1, time=1), "Pa s"),
    ],
)
def test_units_follow_from_powers(dimension, unit):
    assert dimension.unit(Units("um", "MPa")) == unit


def test_bodies_are_what_people_type():
    numbers = contact(FACE, "57.5 GPa", pressure="10 MPa", theory="calibrated")
    same = contact(FACE, Bodies("57.5 GPa"), pressure="10 MPa", theory="calibrated")
    assert numbers.area == same.area
    metals = contact(FACE, METALS, pressure="10 MPa", theory="calibrated")
    same = contact(FACE, Bodies(metals=METALS), pressure="10 MPa", theory="calibrated")
    assert metals.solid_conductance == same.solid_conductance
    with pytest.raises(InputError, match="give one of them"):
        Bodies("100 GPa", metals="silver")


def contacts_of_all_kinds():
    """Without units, of metals, elastic and yielded, of a law and of a joint."""
    plain = Surface(hurst=0.8, q0=0.06, q1=3.0, h_rms=1.0, h_max=3.5)
    face = Surface(hurst=0.8, q0=0.06, q1=3.0, h_rms=1.0, h_max=3.5, unit="um")
    yield contact(plain, pressure=0.001)
    yield contact(face, "steel 4140 hard", pressure="1 MPa")
    yield contact(face, separation=0.4)
    yield contact_law(face, "1 GPa").at(1.0)
    yield Joint(face, bodies="steel 4140 hard").at_pressure("1 MPa")


def test_what_a_contact_lacks_is_no_attribute_of_it():
    """hasattr, getattr with a default and inspect.getmembers ended with an InputError."""
    for pressed in contacts_of_all_kinds():
        assert "area" in dict(inspect.getmembers(pressed))
        for name in registry.registry():
            has = hasattr(pressed, name)
            assert has or getattr(pressed, name, 7) == 7
            assert has == (name in pressed.available())
            if not has:
                with pytest.raises(InputError, match=name):
                    pressed.quantity(name)
    with pytest.raises(AttributeError, match="no_such"):
        _ = pressed.no_such


def test_a_contact_made_of_one_quantity_has_the_others():
    """Those that it was made without returned themselves, without end."""
    whole = contact(
        Surface(hurst=0.8, q0=0.06, q1=3.0, h_rms=1.0, h_max=3.5, unit="um"),
        "100 GPa",
        pressure="10 MPa",
        theory="calibrated",
    )
    names = ("mean_separation", "separation", "pressure", "area", "error", "stiffness")
    setup = Setup(whole.surface, whole.bodies, whole.elastic_theory)
    for one in names:
        made = Contact(setup, {one: whole.quantity(one)})
        for name in names:
            if one in names[:2] or name == one:
                assert made.quantity(name) == pytest.approx(whole.quantity(name), 1e-12)
            else:
                with pytest.raises(InputError, match=f"needs one of.*made with {one}"):
                    made.quantity(name)


def test_a_quantity_made_of_others_needs_what_these_need(thermal_time):
    """What was computed from the energy was shown of yielded contacts, and ended in the energy's error."""
    elastic = contact(FACE, "57.5 GPa", pressure="10 MPa", theory="calibrated")
    assert elastic.energy_depth == elastic.energy / elastic.pressure
    assert "energy_depth" in elastic.variables()
    yielded = contact(FACE, METALS, pressure="10 MPa", theory="calibrated")
    # elastic energy that is larger for unloading gives back less than it took
    assert 0 < yielded.energy_depth == yielded.energy / yielded.pressure
    for name in ("tangential_stiffness", "solid_conductance"):
        assert name not in elastic.available()


def test_what_is_missing_of_a_total_is_named_once(thermal_time):
    joint = Joint(FACE, bodies="57.5 GPa", theory="calibrated")
    with pytest.raises(MissingError) as error:
        _ = joint.at_pressure("10 MPa").total_conductance
    text = str(error.value)
    assert text.count("Bodies(") == 1
    assert text.startswith("total_conductance needs conductivity, which")
    electrical = Bodies("57.5 GPa", conductivity="6e6 S/m")
    joint = Joint(FACE, bodies=electrical, theory="calibrated")
    with pytest.raises(MissingError, match="total_conductance needs thermal cond"):
        _ = joint.at_pressure("10 MPa").total_conductance


def test_available_are_all_quantities_that_a_contact_gives():
    """Those of contacts that yield were left out of elastic ones, which give them, too."""
    for pressed in contacts_of_all_kinds():
        given = []
        for name in registry.registry():
            try:
                pressed.quantity(name)
            except InputError:
                continue
            given.append(name)
        assert pressed.available() == given


RANGE = ("1 MPa", "50 MPa")


def test_a_declared_quantity_has_rows(thermal_time):
    """Rows had a list of their own."""
    joint = Joint(FACE, bodies=METALS, theory="calibrated")
    table = json.loads(joint.export("json", RANGE, quantity="thermal_time"))
    assert table["units"] == {"pressure": "MPa", "thermal_time": "s"}
    pressures = np.geomspace(1, 50, 300)
    rows = table["columns"]
    between = np.interp(pressures, rows["pressure"], rows["thermal_time"])
    own = joint.at(pressure=[f"{p} MPa" for p in pressures]).thermal_time
    np.testing.assert_allclose(between, own, rtol=1.1e-3)
    for target in ("csv", "comsol", "moose", "modelica", "getdp"):
        text = joint.export(target, RANGE, quantity="thermal_time")
        assert "thermal_time [s] against pressure [MPa]" in text
    with pytest.raises(InputError, match=r"CalculiX takes .*got thermal_time"):
        joint.export("calculix", RANGE, quantity="thermal_time")


@pytest.mark.parametrize("metals", [METALS, "silver"])
def test_a_declared_quantity_is_a_function_of_laws_as_code(
    thermal_time, metals, tmp_path
):
    """Functions of code were a list of five; `tests/export/test_languages.py` runs each language."""
    joint = Joint(FACE, bodies=metals, theory="calibrated")
    pressed = joint.at(pressure=[f"{p} MPa" for p in (1.0, 10.0, 50.0)])
    c = 1e-3 * (FACE.h_max - np.asarray(pressed.mean_separation))  # mm
    road = types.ModuleType("road")
    exec(joint.export("python-law", name="road", quantity="thermal_time"), vars(road))
    np.testing.assert_allclose(road.thermal_time(c), pressed.thermal_time, rtol=5e-5)
    # where bodies are apart no heat flows
    assert road.thermal_time(-1.0) == np.inf
    for target, words in {
        "c-law": "double road_thermal_time(double c)",
        "javascript-law": "const thermal_time = (c) =>",
        "matlab-law": "kept.thermal_time = @(c)",
        "modelica-law": "function thermal_time",
    }.items():
        text = joint.export(target, name="road", quantity="thermal_time")
        assert words in text
        assert "thermal_time [s]" in text
        assert "thermal_time is within" in text
    joint.export("fmu", name="road", quantity="thermal_time", path=tmp_path / "road.fmu")
    with zipfile.ZipFile(tmp_path / "road.fmu") as archive:
        assert b'name="thermal_time"' in archive.read("modelDescription.xml")


@needs("gcc")
def test_a_declared_quantity_runs_in_c(thermal_time, tmp_path):
    """Its function stood in files of C that no test compiled."""
    joint = Joint(FACE, bodies=METALS, theory="calibrated")
    pressed = joint.at(pressure=[f"{p} MPa" for p in (1.0, 10.0, 50.0)])
    c = 1e-3 * (FACE.h_max - np.asarray(pressed.mean_separation))  # mm
    source = tmp_path / "road.c"
    joint.export("c-law", name="road", quantity="thermal_time", path=source)
    answer = compiled_law(source)("thermal_time", c)
    np.testing.assert_allclose(answer, pressed.thermal_time, rtol=5e-5)


@needs("cc")
def test_a_declared_quantity_runs_in_an_fmu(thermal_time, tmp_path):
    fmpy = pytest.importorskip("fmpy")
    joint = Joint(FACE, bodies=METALS, theory="calibrated")
    pressed = joint.at(pressure="10 MPa")
    c = 1e-3 * (FACE.h_max - float(pressed.mean_separation))  # mm
    path = tmp_path / "road.fmu"
    asked = {"quantity": "thermal_time", "binaries": "here", "path": path}
    joint.export("fmu", name="road", **asked)
    given = {"start_values": {"overclosure": c}, "output": ["thermal_time"]}
    found = fmpy.simulate_fmu(str(path), stop_time=1.0, **given)[-1]
    assert list(found)[1] == pytest.approx(float(pressed.thermal_time), rel=5e-5)


def test_quantities_without_a_function_are_refused_by_name(thermal_time):
    joint = Joint(FACE, bodies=METALS, theory="calibrated")
    for name, words in {
        "valid": "valid is true or false",
        "scatter": "scatter has no function of the overclosure: it is not known",
    }.items():
        with pytest.raises(InputError, match=words):
            joint.export("c-law", quantity=name)
    elastic = Joint(FACE, bodies="57.5 GPa", theory="calibrated")
    with pytest.raises(
        InputError, match=r"psi has no function .* zero, or not known, at"
    ):
        elastic.export("c-law", quantity="psi")


# quantities without rows: of separations, truth values, and what contacts that yield
# have not, or bodies that do not attract each other
REFUSED = (
    *("pressure", "separation", "valid", "stiffness_scatter", "median_gap"),
    *("attraction", "pull_off", "zero_load_gap", "zero_load_area", "effective_work"),
    "tabor_number",
)


def test_rows_of_every_quantity_are_those_of_the_contact():
    """Each quantity of the registry has rows, or an error that names it."""
    seal = {"gas": "helium", "inlet": "2 bar", "outlet": "1 bar", "width": "2 mm"}
    joint = Joint(FACE, bodies=METALS, theory="calibrated", seal=seal)
    pressed = joint.at(pressure=["3 MPa", "20 MPa"])
    for name in registry.registry():
        if name in REFUSED:
            if name != "pressure":
                with pytest.raises(InputError, match=name):
                    joint.export("json", RANGE, quantity=name)
            continue
        content = joint.export("json", RANGE, quantity=name, length_unit="um")
        table = json.loads(content)
        rows = table["columns"]
        at = np.interp([3, 20], rows["pressure"], rows[name])
        # stresses of the contact are in GPa, of the rows in MPa
        of_stress = pressed.units[name].startswith("GPa")
        own = pressed.quantity(name) * (1000 if of_stress else 1)
        if table["units"][name] == "W/(um K)/um":
            own = own * 1e-12
        # the error of a contact is that of its theory, of rows that of their law
        if name != "error":
            np.testing.assert_allclose(at, own, rtol=1.2e-3)


def test_the_command_writes_rows_of_a_declared_quantity(thermal_time, tmp_path):
    out = tmp_path / "rows.json"
    words = "export json --surface challenge --length-unit mm --E-star 25MPa"
    words += " --conductivity 0.2 --conductivity-unit W/(m_K) --theory calibrated"
    words += f" --pressures 10kPa:100kPa --quantity thermal_time --out {out}"
    # conductivity has a blank in its unit
    asked = [word.replace("m_K", "m K") for word in words.split()]
    answer = CliRunner().invoke(main, asked, catch_exceptions=False)
    assert answer.exit_code == 0, answer.output
    rows = json.loads(out.read_text())["columns"]
    law = contact_law(
        Surface.named("challenge").to("mm"),
        Bodies("25 MPa", conductivity="0.2 W/(m K)"),
        "calibrated",
    )
    own = law.at(pressure="50 kPa").thermal_time
    assert np.interp(0.05, rows["pressure"], rows["thermal_time"]) == pytest.approx(
        own, rel=1.1e-3
    )


@pytest.mark.parametrize("command", ["contact -p 50kPa", "curve --points 5"])
def test_commands_show_a_declared_quantity_and_any_that_is_asked_for(
    thermal_time, command
):
    """Columns of `mbma curve` were a list."""
    words = f"{command} --surface challenge --length-unit mm --E-star 25MPa --json"
    words += " --quantity energy_depth,hydraulic_aperture --theory calibrated"
    asked = [*words.split(), "--conductivity", "0.2 W/(m K)"]
    answer = CliRunner().invoke(main, asked, catch_exceptions=False)
    assert answer.exit_code == 0, answer.output
    report = json.loads(answer.output)
    columns = report["columns"]
    law = contact_law(
        Surface.named("challenge").to("mm"),
        Bodies("25 MPa", conductivity="0.2 W/(m K)"),
        "calibrated",
    )
    u = np.array(columns["mean_separation"])[-2:]
    u = u[u > 0]
    for name in ("thermal_time", "energy_depth", "hydraulic_aperture"):
        own = law.at(u).quantity(name)
        np.testing.assert_allclose(columns[name][-2:][: u.size], own, rtol=1e-5)
        assert report["units"][name] == {"thermal_time": "s"}.get(name, "mm")
    failed = CliRunner().invoke(main, [*asked, "--quantity", "energy_dept"])
    assert failed.exit_code != 0
    assert "did you mean 'energy_depth'" in failed.output
    failed = CliRunner().invoke(
        main, words.replace("energy_depth", "thermal_time").split()
    )
    assert "thermal_time needs conductivity" in failed.output


def test_a_scene_computes_a_declared_quantity(thermal_time, tmp_path):
    """Quantities of scenes were a list of their own."""
    given = {
        "surface": FACE,
        "quantities": [
            "thermal_time",
            "energy_depth",
            "mean_pressure",
            "elastic_hardness",
        ],
        "pressure": ["10 MPa", "50 MPa"],
        "theory": "calibrated",
    }
    metals = ("45 W/(m K)", "167 W/(m K)")
    bodies = Bodies("57.5 GPa", conductivity=metals)
    found = Scene(**given, bodies=bodies).run()
    own = contact(FACE, bodies, pressure=given["pressure"], theory="calibrated")
    for name in given["quantities"]:
        np.testing.assert_allclose(found[name], own.quantity(name), rtol=1e-12)
        assert found[name].attrs["units"] == own.units[name]
    assert "solid_conductance" not in found
    with pytest.raises(InputError, match="thermal_time needs conductivity"):
        Scene(**given, bodies="57.5 GPa")
    file = tmp_path / "scene.toml"
    file.write_text(
        """
        theory = "calibrated"
        bodies = "57.5 GPa"
        pressure = ["10 MPa", "50 MPa"]
        quantities = ["energy_depth"]
        [surface]
        hurst = 0.8
        q0 = 0.06
        q1 = 3.0
        h_rms = 1.0
        h_max = 3.5
        length_unit = "um"
        """
    )
    of_file = Scene.from_toml(file).run()
    np.testing.assert_allclose(of_file["energy_depth"], own.energy_depth, rtol=1e-12)
    with pytest.raises(InputError, match="did you mean 'energy_depth'"):
        Scene(**given | {"quantities": ["energy_dept"]})


def test_a_declared_quantity_has_sensitivities(thermal_time):
    """Sensitivities had a list, whose conductance was that over the conductivity."""
    bodies = Bodies("57.5 GPa", conductivity="45 W/(m K)")
    given = {"pressure": "10 MPa", "theory": "calibrated"}
    found = sensitivity(FACE, bodies, **given)
    pressed = contact(FACE, bodies, **given)
    assert found.answers["thermal_time"] == pytest.approx(pressed.thermal_time, 1e-12)
    assert found.unit("thermal_time") == "s"
    for row in found.slopes.values():
        assert row["thermal_time"] == pytest.approx(-row["solid_conductance"], abs=1e-6)
    asked = sensitivity(FACE, bodies, **given, quantities=["energy_depth", "scatter"])
    assert set(asked.answers) == {"energy_depth", "scatter"}
    up, down = (
        contact(FACE, bodies, pressure=f"{10 * factor} MPa", theory="calibrated")
        for factor in (1.001, 1 / 1.001)
    )
    slope = np.log(up.energy_depth / down.energy_depth) / (2 * np.log(1.001))
    assert asked.slopes["pressure"]["energy_depth"] == pytest.approx(slope, abs=1e-4)
    with pytest.raises(InputError, match="thermal_time needs conductivity"):
        sensitivity(FACE, "57.5 GPa", **given, quantities=["thermal_time"])
    joint = Joint(FACE, bodies=METALS, theory="calibrated")
    answers = joint.sensitivity("10 MPa").answers
    assert {"total_conductance", "gas_conductance", "thermal_time"} <= set(answers)
    own = joint.at_pressure("10 MPa").total_conductance
    assert answers["total_conductance"] == pytest.approx(own, rel=1e-12)


def test_pictures_have_a_declared_quantity(thermal_time):
    """Pictures of contacts, laws and joints had lists."""
    pressures = np.geomspace(1, 50, 7)
    joint = Joint(FACE, bodies=METALS, theory="calibrated")
    pressed = contact(
        FACE, METALS, pressure=[f"{p} MPa" for p in pressures], theory="calibrated"
    )
    law = contact_law(FACE, METALS, "calibrated")
    of_joint = joint.plot(pressures=("1 MPa", "50 MPa"))
    for figure in (of_joint, pressed.plot(), law.plot()):
        labels = [axes.get_ylabel() for axes in figure.axes]
        assert any("time [s]" in label for label in labels), labels


def test_the_explorer_has_the_declaration_of_every_quantity(thermal_time):
    """Unit, meaning and uncertainty of what its page shows have no list of their own."""
    data = explorer_page(FACE, 57.5, "GPa").split('id="data">')[1].split("</script>")[0]
    declarations = json.loads(data)["quantities"]
    assert list(declarations) == list(registry.registry())
    declared = registry.registry()["thermal_time"]
    assert declarations["thermal_time"] == {
        "meaning": declared.meaning,
        "unit": "s",
        "uncertainty": "solid_conductance_scatter",
    }


def test_batches_and_ranges_have_a_declared_quantity(thermal_time, tmp_path):
    designs = tmp_path / "designs.csv"
    designs.write_text("pressure [MPa]\n10\n50\n")
    face = {"Rq": "1 um", "hurst": 0.8, "longest": "105 um", "shortest": "2.1 um"}
    entries = {"nominal_area": "1 cm^2", "theory": "calibrated", "part_a": face}
    metals = entries | {"bodies": list(METALS)}
    out = tmp_path / "answers.csv"
    batch(designs, out, common=metals, quantities=["thermal_time"])
    with out.open() as file:
        rows = list(csv.DictReader(file))
    joint = Joint.from_entries(metals, "joint.toml")
    own = joint.at(pressure=["10 MPa", "50 MPa"]).thermal_time
    found = [float(row["thermal_time [s]"]) for row in rows]
    np.testing.assert_allclose(found, own, rtol=1e-12)
    bodies = {"E_star": "57 GPa", "hardness": "0.9..1.2 GPa"}
    bodies["conductivity"] = ["45 W/(m K)", "167 W/(m K)"]
    ranged = Joint.from_entries(entries | {"bodies": bodies}, "joint.toml")
    drawn = ranged.uncertainty(["10 MPa"], draws=100)
    low, median, high = drawn.quantiles["thermal_time"]
    assert 0 < low < median < high
    assert drawn.units["thermal_time"] == "s"
