"""A law as an FMU: checked, built and simulated by FMPy."""

import dataclasses
import importlib.util
import io
import re
import zipfile

import numpy as np
import pytest
from helpers import refusals
from law_points import ASKED, CONDUCTIVITY, KAPPA, needs, points

from mbma_tables import InputError
from mbma_tables.contacts.quantities import registry
from mbma_tables.contacts.quantities.declaration import LawFunction
from mbma_tables.export.code import law_code
from mbma_tables.export.code.fmu import fmu

HEAT = {"conductivity": CONDUCTIVITY, "conductivity_unit": "mW/(mm K)"}
QUANTITIES = [
    "pressure",
    "tangent",
    "area",
    "energy",
    "solid_conductance",
    "tangential_stiffness",
    "leakage",
]
SLOPES = QUANTITIES[4:6]
MORE = HEAT | {"kappa": KAPPA, "leakage": True}
KINDS = ("ModelExchange", "CoSimulation")
REFUSED = r"failed with status 3 \(error\)"  # as FMPy says it
DISCARDED = r"failed with status 2 \(discard\)"


def made(law, **options):
    surface, asked = ASKED[law]
    return fmu(
        surface, "13.3 MPa", **({"name": "road", "binaries": "none"} | asked | options)
    )


def built(name, folder):
    validation = pytest.importorskip("fmpy.validation")
    build = pytest.importorskip("fmpy.build")
    (folder / "build").mkdir()
    (folder / "road.fmu").write_bytes(made(name, **MORE))
    assert validation.validate_fmu(str(folder / "road.fmu")) == []
    with zipfile.ZipFile(folder / "road.fmu") as archive:
        archive.extractall(folder / "road")
    strict = {"CMAKE_C_FLAGS:STRING": "-Werror"}
    build.build_platform_binary(
        folder / "road", folder / "build", all_warnings=True, cmake_options=strict
    )
    return str(folder / "road")


def simulated(path, kind, c, logger=None):
    times = np.arange(c.size, dtype=float)
    given = np.array(
        list(zip(times, c, strict=True)), [("time", float), ("overclosure", float)]
    )
    fixed = {
        "stop_time": times[-1],
        "solver": "Euler",
        "step_size": 1.0,
        "output_interval": 1.0,
    }
    asked = {
        "fmi_type": kind,
        "input": given,
        "output": ["overclosure", *QUANTITIES],
        "logger": logger,
    }
    return pytest.importorskip("fmpy").simulate_fmu(path, **asked, **fixed)


@pytest.mark.slow
@needs("cmake", "gcc")
@pytest.mark.parametrize("name", ["mbma", "calibrated", "persson", "turning", "hardened"])
def test_simulation_and_directional_derivatives(name, tmp_path):
    path = built(name, tmp_path)
    known = points(name)
    for kind in KINDS:
        found = simulated(path, kind, np.append(known.c, known.c[-1]))
        # co-simulation answers after a step, by the input before it
        answers = found[: known.c.size] if kind == "ModelExchange" else found[1:]
        assert (answers["overclosure"] == known.c).all()
        known.assert_equal(
            *(answers[quantity] for quantity in QUANTITIES if quantity not in SLOPES)
        )
        known.assert_slopes(*(answers[quantity] for quantity in SLOPES))
        said = []
        with pytest.raises(Exception, match=DISCARDED):
            simulated(
                path,
                kind,
                np.array([0.0, 1e9, 1e9]),
                lambda *words, said=said: said.append(words[-1]),
            )
        assert re.search(r"overclosure = .* must be from", str(said[-1]))
    if name in ("mbma", "calibrated", "persson"):
        assert_directional_derivatives(path, known)


def assert_directional_derivatives(path, known):
    fmpy = pytest.importorskip("fmpy")
    said = []
    # FMPy's own logger may call that of a model before, which is gone
    description = fmpy.read_model_description(path)

    def logger(*words):
        said.append(words[-1])

    model = fmpy.instantiate_fmu(path, description, "CoSimulation", logger=logger)
    model.setupExperiment()
    model.enterInitializationMode()
    model.exitInitializationMode()

    of_name = {each.name: each.valueReference for each in description.modelVariables}
    names = ["pressure", "tangent", "area", "energy"]
    names += ["solid_conductance", "tangential_stiffness", "leakage"]
    answers = [of_name[name] for name in names]
    asked = [of_name["overclosure"]]

    def slopes(c):
        model.setReal(asked, [c])
        return list(model.getDirectionalDerivative(answers, asked, [2.0]))

    c = known.c[far := (known.c > 1e-3) & (known.c < 0.97 * known.law.h_max)]
    by_p, by_tangent, by_area, by_energy, by_conductance, by_shear, by_leakage = (
        np.array([slopes(x) for x in c]).T / 2
    )
    assert (
        np.abs(by_p - known.tangent[far]).max()
        <= 1e-11 * np.abs(known.tangent[far]).max()
    )
    np.testing.assert_allclose(by_energy, known.p[far], rtol=1e-13)
    np.testing.assert_allclose(
        by_conductance, CONDUCTIVITY / 13.3 * by_tangent, rtol=1e-15
    )
    np.testing.assert_allclose(by_shear, by_tangent / KAPPA, rtol=1e-15)
    # those of area, tangent and leakage by differences of the library's law, but where a
    # piece of it ends
    ends = []
    for by in (1e-5, -1e-5):
        d = known.law.h_max - 2 * c * (1 + by)
        found = known.law.values(separation=d)
        ends.append(
            (found.area, found.stiffness, np.asarray(known.law.leakage(separation=d)))
        )
    # the slope of leakage is steep where contact percolates
    sizes = known.area, known.tangent, known.leakage + 1e-3
    for slope, above, below, size in zip(
        (by_area, by_tangent, by_leakage), *ends, sizes, strict=True
    ):
        error = np.abs(slope - (above - below) / (2e-5 * c)) * c / np.abs(size[far])
        assert np.quantile(error, 0.99) < 1e-5
    with pytest.raises(Exception, match=REFUSED):
        model.getDirectionalDerivative([2], [2], [1.0])
    with pytest.raises(Exception, match=DISCARDED):
        slopes(1e9)
    assert "by overclosure alone" in str(said[0])
    assert "overclosure = 1000000000 must be from" in str(said[1])
    model.terminate()
    model.freeInstance()


def test_description():
    fmpy = pytest.importorskip("fmpy")
    read = fmpy.read_model_description(
        io.BytesIO(made("calibrated", **MORE)), validate=True
    )
    inputs = [variable.name for variable in read.modelVariables[:2]]
    outputs = [variable.name for variable in read.modelVariables[2:]]
    assert inputs == ["time", "overclosure"]
    assert sorted(outputs) == sorted(QUANTITIES)
    units = {variable.name: variable.unit for variable in read.modelVariables}
    assert units["tangent"] == "MPa/mm"
    assert units["solid_conductance"] == "mW/(mm K)/mm"
    size = {
        unit.name: unit.baseUnit.factor
        for unit in read.unitDefinitions
        if unit.baseUnit is not None
    }
    expected = {
        "mm": 1e-3,
        "MPa": 1e6,
        "MPa/mm": 1e9,
        "MPa mm": 1e3,
        "mm^3": 1e-9,
        "1": 1.0,
        "s": 1.0,
    }
    assert {unit: float(factor) for unit, factor in size.items()} == pytest.approx(
        expected
    )
    # as quantities are declared, not in texts of the format's own
    said = {variable.name: variable.description for variable in read.modelVariables}
    for name in ("pressure", "area", "solid_conductance", "tangential_stiffness"):
        assert said[name] == registry.get(name).meaning
    assert said["leakage"] == registry.get("flow_coefficient").meaning
    for words in ("theory 'calibrated'", "range:", "within", "scatter"):
        assert words in read.description
    assert read.modelExchange.providesDirectionalDerivative
    assert read.coSimulation.providesDirectionalDerivative
    # a law of its own has a token of its own
    files = (made("calibrated", **options) for options in ({}, {"theory": "mbma"}, HEAT))
    sources = [
        zipfile.ZipFile(io.BytesIO(file)).read("sources/road.c").decode()
        for file in files
    ]
    assert len({text.split('TOKEN[] = "')[1][:38] for text in sources}) == 3


def assert_oldest_glibc(archive, said):
    """The newest version of the C library that a symbol needs, as ELF's version names have it, is old and told."""
    listed = re.findall(rb"GLIBC_(\d+)\.(\d+)", archive.read("binaries/linux64/road.so"))
    major, minor = max((int(major), int(minor)) for major, minor in listed)
    assert (major, minor) <= (2, 17)
    assert f"linux64 (glibc {major}.{minor} and later)" in said


@needs("cc")
def test_an_fmu_runs_as_it_is(tmp_path):
    fmpy = pytest.importorskip("fmpy")
    file = made("mbma", binaries="here", leakage=True)
    law = points("mbma").law
    (tmp_path / "road.fmu").write_bytes(file)
    for c in (0.5, 2.0):
        asked = {
            "start_values": {"overclosure": c},
            "output": [*QUANTITIES[:4], "leakage"],
        }
        found = fmpy.simulate_fmu(str(tmp_path / "road.fmu"), stop_time=1.0, **asked)[-1]
        known = law.values(3 - c)
        expected = [
            known.pressure,
            known.stiffness,
            known.area,
            known.energy,
            law.leakage(3 - c),
        ]
        answers = [found[name] for name in asked["output"]]
        np.testing.assert_allclose(answers, expected, rtol=1e-12)
    said = fmpy.read_model_description(str(tmp_path / "road.fmu")).description
    (folder,) = {
        name.split("/")[1]
        for name in zipfile.ZipFile(io.BytesIO(file)).namelist()
        if "binaries/" in name
    }
    assert f"binaries: {folder}" in said
    if folder == "linux64":
        assert_oldest_glibc(zipfile.ZipFile(io.BytesIO(file)), said)
    assert made("mbma", binaries="here", leakage=True) == file


@needs("cc")
def test_an_fmu_has_every_function_that_laws_are_declared_to_have(tmp_path, monkeypatch):
    """Its C had a case for each of four."""
    fmpy = pytest.importorskip("fmpy")
    of_slope = dataclasses.replace(
        registry.get("area"), law_function=LawFunction("area_slope", "MBMA_AREA_SLOPE")
    )
    declared = registry.law_functions() | {"area_slope": of_slope}
    for module in (registry, law_code):
        monkeypatch.setattr(module, "law_functions", lambda: declared)
    (tmp_path / "road.fmu").write_bytes(made("mbma", binaries="here"))
    given = {"start_values": {"overclosure": 0.5}, "output": ["area_slope"]}
    found = fmpy.simulate_fmu(str(tmp_path / "road.fmu"), stop_time=1.0, **given)[-1]
    law = points("mbma").law
    known = law.area(2.5 - 1e-5) - law.area(2.5 + 1e-5)
    assert found["area_slope"] == pytest.approx(float(known) / 4e-5, rel=1e-6)


@needs("cc")
def test_a_step_outside_the_range_is_discarded_and_can_be_repeated(tmp_path):
    """An implicit tool's trial step beyond the law asks for a smaller one; it does not end the simulation."""
    fmpy = pytest.importorskip("fmpy")
    (tmp_path / "road.fmu").write_bytes(made("calibrated", binaries="here"))
    folder = fmpy.extract(str(tmp_path / "road.fmu"), unzipdir=tmp_path / "road")
    said = []
    description = fmpy.read_model_description(folder)
    model = fmpy.instantiate_fmu(
        folder, description, "CoSimulation", logger=lambda *words: said.append(words[2:])
    )
    model.setupExperiment(startTime=0.0)
    model.enterInitializationMode()
    model.exitInitializationMode()
    model.setReal([1], [0.5])
    model.doStep(0.0, 1.0)
    model.setReal([1], [1e9])
    with pytest.raises(Exception, match=DISCARDED):
        model.doStep(1.0, 1.0)
    with pytest.raises(Exception, match=DISCARDED):
        model.getReal([2])
    status, category, text = said[-1]
    assert (status, category) == (2, b"logStatusDiscard")
    assert b"overclosure = 1000000000 must be from -inf to" in text
    assert model.getRealStatus(2) == 1.0
    assert not model.getBooleanStatus(3)
    # the same model goes on
    model.setReal([1], [0.75])
    model.doStep(1.0, 0.5)
    assert model.getReal([2])[0] == pytest.approx(
        float(points("calibrated").law.pressure(3 - 0.75)), rel=1e-12
    )
    model.terminate()
    model.freeInstance()


@needs("cc")
def test_an_fmu_of_fmi_3_is_the_same_law(tmp_path):
    fmpy = pytest.importorskip("fmpy")
    validation = pytest.importorskip("fmpy.validation")
    path = tmp_path / "road.fmu"
    path.write_bytes(made("calibrated", binaries="here", fmi=3, **MORE))
    assert validation.validate_fmu(str(path)) == []
    law = points("calibrated").law
    for kind in KINDS:
        asked = {"start_values": {"overclosure": 0.75}, "output": QUANTITIES}
        found = fmpy.simulate_fmu(str(path), stop_time=1.0, fmi_type=kind, **asked)[-1]
        known = law.values(3 - 0.75)
        expected = [known.pressure, known.stiffness, known.area, known.energy]
        answers = [found[name] for name in QUANTITIES[:4]]
        np.testing.assert_allclose(answers, expected, rtol=1e-12)
        conductance = CONDUCTIVITY / 13.3 * known.stiffness
        sheared, leaked = known.stiffness / KAPPA, float(law.leakage(3 - 0.75))
        more = [conductance, sheared, leaked]
        np.testing.assert_allclose(list(found)[5:], more, rtol=1e-11)


@needs("cc")
def test_a_step_of_fmi_3_outside_the_range_is_discarded(tmp_path):
    fmpy = pytest.importorskip("fmpy")
    from fmpy.fmi3 import FMU3Slave

    (tmp_path / "road.fmu").write_bytes(made("calibrated", binaries="here", fmi=3))
    folder = fmpy.extract(str(tmp_path / "road.fmu"), unzipdir=tmp_path / "road")
    description = fmpy.read_model_description(folder)
    model = FMU3Slave(
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="road",
    )
    said = []
    model.instantiate(logMessage=lambda *words: said.append(words[1:]))
    model.enterInitializationMode(startTime=0.0)
    model.exitInitializationMode()
    model.setFloat64([1], [0.5])
    assert model.doStep(0.0, 1.0) == (False, False, False, 1.0)
    law = points("calibrated").law
    slope = model.getDirectionalDerivative([2], [1], [2.0])
    assert slope[0] == pytest.approx(2 * float(law.stiffness(separation=2.0)), rel=1e-11)
    model.setFloat64([1], [1e9])
    for ask in (lambda: model.doStep(1.0, 1.0), lambda: model.getFloat64([2])):
        with pytest.raises(Exception, match="failed with status 2"):
            ask()
        status, category, text = said[-1]
        assert (status, category) == (2, b"logStatusDiscard")
        assert b"overclosure = 1000000000 must be from" in text
    # the same model goes on
    model.setFloat64([1], [0.75])
    model.doStep(1.0, 0.5)
    found = model.getFloat64([2])[0]
    assert found == pytest.approx(float(law.pressure(3 - 0.75)), rel=1e-12)
    model.terminate()
    model.freeInstance()


@pytest.mark.slow
@needs("cmake", "gcc")
def test_the_headers_of_fmi_3_agree(tmp_path):
    """All functions of the standard are there, with its arguments, without a warning."""
    pytest.importorskip("fmpy")
    build = pytest.importorskip("fmpy.build")
    (tmp_path / "build").mkdir()
    content = made("mbma", fmi=3, **MORE)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        archive.extractall(tmp_path / "road")
    build.build_platform_binary(
        tmp_path / "road",
        tmp_path / "build",
        all_warnings=True,
        cmake_options={"CMAKE_C_FLAGS:STRING": "-Werror"},
    )
    found = simulated(str(tmp_path / "road"), "CoSimulation", np.array([0.5, 1.0, 1.0]))
    known = np.asarray(points("mbma").law.pressure(3 - np.array([0.5, 1.0])))
    np.testing.assert_allclose(found["pressure"][1:], known, rtol=1e-12)


@pytest.mark.parametrize("fails", [False, True])
def test_an_fmu_without_a_compiler(fails, tmp_path, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    (tmp_path / "cc").write_text("#!/bin/sh\nexit 1\n")
    (tmp_path / "cc").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path / ("" if fails else "none")))
    archive = zipfile.ZipFile(io.BytesIO(made("mbma", binaries="here")))
    assert archive.namelist() == ["modelDescription.xml", "sources/road.c"]
    assert "binaries: none, sources only" in archive.read("modelDescription.xml").decode()
    with pytest.raises(InputError, match="compiled by ziglang: pip install"):
        made("mbma", binaries="all")
    with pytest.raises(InputError, match="binaries must be one of"):
        made("mbma", binaries="linux")


@pytest.mark.slow
@pytest.mark.skipif(
    importlib.util.find_spec("ziglang") is None, reason="not installed: ziglang"
)
def test_an_fmu_for_all_platforms():
    archive = zipfile.ZipFile(io.BytesIO(made("mbma", binaries="all")))
    begins = {
        name.split("/")[1]: archive.read(name)[:2]
        for name in archive.namelist()
        if "binaries/" in name
    }
    assert begins == {"linux64": b"\x7fE", "darwin64": b"\xcf\xfa", "win64": b"MZ"}
    said = archive.read("modelDescription.xml").decode()
    assert "win64 (x86-64); on ARM the importing tool compiles the sources" in said
    assert_oldest_glibc(archive, said)


@pytest.mark.slow
@pytest.mark.skipif(
    importlib.util.find_spec("ziglang") is None, reason="not installed: ziglang"
)
def test_an_fmu_of_fmi_3_has_binaries_for_arm():
    archive = zipfile.ZipFile(io.BytesIO(made("mbma", binaries="all", fmi=3)))
    machines = {}
    for name in archive.namelist():
        if name.startswith("binaries/"):
            content = archive.read(name)
            folder = name.split("/")[1]
            if content[:4] == b"\x7fELF":
                machines[folder] = int.from_bytes(content[18:20], "little")
            elif content[:2] == b"MZ":
                at = int.from_bytes(content[0x3C:0x40], "little")
                machines[folder] = int.from_bytes(content[at + 4 : at + 6], "little")
            else:
                machines[folder] = int.from_bytes(content[4:8], "little")
    # numbers of machines of ELF, Mach-O and PE
    assert machines == {
        "x86_64-linux": 62,
        "aarch64-linux": 183,
        "x86_64-darwin": 0x01000007,
        "aarch64-darwin": 0x0100000C,
        "x86_64-windows": 0x8664,
        "aarch64-windows": 0xAA64,
    }
    said = archive.read("modelDescription.xml").decode()
    for machine in ("x86_64", "aarch64"):
        stated = re.search(rf"{machine}-linux \(glibc (\d+)\.(\d+) and later\)", said)
        assert tuple(map(int, stated.groups())) <= (2, 17)


test_requests_that_are_refused = refusals(
    lambda law, options: made(law, **options),
    ("mbma", {"name": "1 x"}, "a name must be a letter"),
    ("mbma", {"conductivity_unit": "W"}, "conductance needs conductivity"),
)
