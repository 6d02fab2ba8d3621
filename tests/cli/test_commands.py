import inspect
import json
import os
import pathlib
import re
import signal
import subprocess
import sys

import helpers
import numpy as np
import pytest
from click.testing import CliRunner
from helpers import run, told

from mbma_tables import Bodies, Surface, contact, island
from mbma_tables.bodies.materials import effective_modulus
from mbma_tables.cli import main
from mbma_tables.design.specimen import MAP_OPTIONS, MATERIAL, NUMBERS, schema
from mbma_tables.theories import THEORIES, Mbma

YANG_PERSSON = {
    "hurst": 0.8,
    "q0": 60 * np.pi / 1040,
    "zeta_1": 216.0,
    "h_rms": 1.0,
    "h_max": 3.0,
}
CONCRETE = {"hurst": 0.7, "m0": 0.071, "m2": 0.27, "m4": 62.0, "h_max": 1.1}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(*arguments: str) -> str:
    """What a refusal says; it must be short, and must leave the folder as it was."""
    before = contents()
    said = helpers.refused(*arguments)
    after = contents()
    assert after == before
    return said


def contents():
    return {
        path: path.read_bytes() for path in pathlib.Path().rglob("*") if path.is_file()
    }


def options(numbers: dict[str, float]) -> list[str]:
    return [
        part
        for key, value in numbers.items()
        for part in ("--" + key.replace("_", "-"), repr(value))
    ]


def toml(numbers: dict[str, float], table: str = "surface") -> str:
    return f"[{table}]\n" + "".join(
        f"{key} = {value!r}\n" for key, value in numbers.items()
    )


def table_rows(text: str) -> list[list[str]]:
    return [line.split() for line in text.split("\n\n")[1].splitlines()]


def test_contact_json_is_the_librarys_answer_digit_for_digit():
    arguments = (
        "-d",
        "0.5,-0.2",
        "-d",
        "-1.1",
        "--island-model",
        "rigid",
        "--rtol",
        "1e-6",
        "--E-star",
        "7.5",
    )
    found = json.loads(run("contact", "--surface", "concrete", *arguments, "--json"))
    surface = Surface.named("concrete")
    answer = contact(
        surface,
        7.5,
        separation=[0.5, -0.2, -1.1],
        theory=Mbma(island_model="rigid", rtol=1e-6),
    )
    for name in ("separation", "mean_separation", "pressure", "area", "error"):
        assert found["columns"][name] == getattr(answer, name).tolist()
    assert (found["variant"], found["island_model"], found["rtol"], found["E_star"]) == (
        "reported",
        "rigid",
        1e-6,
        7.5,
    )
    assert (found["units"]["separation"], found["units"]["pressure"]) == ("mm", "stress")
    assert found["surface"]["zeta_1"] == surface.zeta_1


@pytest.mark.parametrize("theory", THEORIES)
def test_contact_by_pressure_and_by_area(theory):
    asked = ("contact", "--surface", "concrete", "--theory", theory, "--json")
    # so large that scatter is known at both
    found = json.loads(run(*asked, "-p", "4e-3,8e-3", "--E-star", "5"))
    answer = contact(Surface.named("concrete"), 5.0, pressure=[4e-3, 8e-3], theory=theory)
    for name in (
        "separation",
        "mean_separation",
        "pressure",
        "area",
        "stiffness",
        "scatter",
        "area_scatter",
    ):
        # JSON has null for a scatter that is not known
        column = np.array(found["columns"][name], dtype=float)
        np.testing.assert_allclose(column, getattr(answer, name), rtol=1e-12)
    assert (found["theory"], found["valid"]) == (theory, answer.valid.tolist())
    assert found["reasons"] == {
        why: np.flatnonzero(mask).tolist() for why, mask in answer.reasons.items()
    }
    by_area = json.loads(run(*asked, "--area", repr(found["columns"]["area"][1])))
    assert by_area["columns"]["pressure"] == pytest.approx([8e-3 / 5], rel=1e-7)


def test_where_an_answer_is_not_valid_is_said_in_one_line():
    arguments = ("contact", "--surface", "concrete", "-u", "0.7,0.01", "--theory", "mbma")
    lines = [
        line for line in run(*arguments).splitlines() if line.startswith("not valid")
    ]
    assert lines == [
        "not valid at 1 of 2: areas of islands are added without overlap, but A/A0 is above 0.1 (1); "
        "stiffness falls with compression here, which no simulation shows (1)"
    ]
    found = json.loads(run(*arguments, "--json"))
    assert found["valid"] == [True, False]
    assert list(found["reasons"].values()) == [[1], [1]]
    expected = contact(
        Surface.named("concrete"), mean_separation=[0.7, 0.01], theory="mbma"
    )
    assert found["scatter"] == pytest.approx(expected.scatter)
    assert any(
        line.startswith("# not valid") for line in run(*arguments, "--csv").splitlines()
    )
    assert "not valid" not in run(
        "contact", "--surface", "concrete", "-u", "0.7", "--theory", "mbma"
    )


def test_every_source_is_the_same_surface(folder):
    band = {key: value for key, value in YANG_PERSSON.items() if key != "zeta_1"}
    band["q1"] = YANG_PERSSON["q0"] * 216
    surface = Surface.named("yang-persson")
    moments = {
        name: float(getattr(surface, name))
        for name in ("hurst", "m0", "m2", "m4", "h_max")
    }
    (folder / "s.toml").write_text(toml(moments) + 'length_unit = "nm"\n')
    numbers = [options(each) for each in (YANG_PERSSON, band, moments)]
    expected = contact(surface, separation=[2.0, 0.5])
    for source in (["--surface", "yang-persson"], *numbers, ["--file", "s.toml"]):
        found = json.loads(run("contact", *source, "-d", "2,0.5", "--json"))
        for name in ("hurst", "q0", "q1", "zeta_1", "h_rms", "h_max", "m4", "alpha"):
            assert found["surface"][name] == pytest.approx(
                getattr(surface, name), rel=1e-11
            ), (source, name)
        assert found["columns"]["pressure"] == pytest.approx(
            expected.pressure.tolist(), rel=2e-8
        )
        assert found["columns"]["area"] == pytest.approx(expected.area.tolist(), rel=2e-8)


def test_options_of_a_surface_are_arguments_of_the_library_and_names_of_scene_files():
    options = {parameter.name for parameter in main.commands["contact"].params}
    surface = set(schema()["properties"]["surface"]["properties"])
    material = set(schema()["$defs"]["material"]["properties"])
    assert set(NUMBERS) | set(MAP_OPTIONS) | set(MATERIAL) <= options
    assert surface - {"name"} <= options
    assert set(NUMBERS) | set(MAP_OPTIONS) <= surface
    assert material == {*MATERIAL, "stress_unit"}
    made_by = (Surface, Surface.from_moments, Surface.from_roughness, Surface.from_map)
    arguments = set().union(*(inspect.signature(make).parameters for make in made_by))
    assert set(NUMBERS) | set(MAP_OPTIONS) <= arguments | {"zeta_1"}


def test_material_from_options_and_from_a_file(folder):
    material = {"E1": 10.0, "nu1": 0.5, "E2": 30000.0, "nu2": 0.0}
    modulus = effective_modulus(*material.values())
    (folder / "s.toml").write_text(toml(CONCRETE) + toml(material, "material"))
    example = os.path.join(
        os.path.dirname(__file__), os.pardir, os.pardir, "examples", "concrete.toml"
    )
    for source, E_star, unit in (
        (
            [
                "--surface",
                "concrete",
                *(f"--{key}={value}" for key, value in material.items()),
            ],
            modulus,
            "mm",
        ),
        (["--file", "s.toml"], modulus, None),
        (["--file", "s.toml", "--E-star", "2"], 2.0, None),
        (["--file", example], effective_modulus(10.0, 0.5, 30000.0, 0.2), "mm"),
    ):
        found = json.loads(run("contact", *source, "-d", "0.3", "--json"))
        expected = float(
            contact(Surface.named("concrete"), E_star, separation=0.3).pressure
        )
        assert (found["E_star"], found["surface"]["length_unit"]) == (E_star, unit)
        assert found["columns"]["pressure"] == pytest.approx([expected], rel=1e-12)


def test_a_curve_and_its_picture_beside_other_theories(folder):
    arguments = (
        "--surface",
        "concrete",
        "--points",
        "7",
        "--plot",
        "c.svg",
        "--E-star",
        "3",
        "--theory",
        "mbma",
    )
    found = json.loads(run("curve", *arguments, "--json"))["columns"]
    surface = Surface.named("concrete")
    area = np.array(found["area"])
    known = contact(surface, 3.0, separation=found["separation"])
    np.testing.assert_array_equal(found["pressure"], known.pressure)
    assert (found["separation"][0], found["separation"][-1]) == (
        surface.h_max,
        -surface.h_max,
    )
    assert area[1] == pytest.approx(1e-4, rel=0.01)
    drawn = (folder / "c.svg").read_text()
    assert all(
        f">{label}<" in drawn for label in ("MBMA, reported", "Calibrated", "Persson")
    )


def test_island_is_the_librarys_answer():
    found = json.loads(
        run("island", "--surface", "asphalt", "--delta", "0.5,2", "--json")
    )
    surface = Surface.named("asphalt")
    answer = island(surface, np.array([0.5, 2.0]), rtol=1e-8)
    for name, values in found["columns"].items():
        assert values == getattr(answer, name).tolist(), name
    names = "delta zeta_d zeta_u R_d R_u D sigma h_d eta X mu force area error"
    assert set(found["columns"]) == set(names.split())
    assert (
        found["units"] | {"D": "1/mm^2", "force": "mm^2", "X": "-", "R_d": "mm"}
        == found["units"]
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (options(YANG_PERSSON | {"h_rms": -1.0}), "mbma: h_rms must be positive, got -1"),
        (options(YANG_PERSSON | {"q1": 10.0}), "got hurst, q0, q1, h_rms, h_max, zeta_1"),
        (["--surface", "granite"], "'granite' is not one of 'yang-persson'"),
        (
            ["--hurst", "0.8"],
            "(or zeta_1 for q1), or hurst, m0, m2, m4, h_max, or roughness (Rq, ...)",
        ),
        (
            ["--hurst", "1", "--h-max", "1", "--Rq", "1"],
            "two of longest, shortest and Rdq (or Sdq, Rsm)",
        ),
        ([], "one surface is needed"),
        (
            ["--surface", "concrete", *options(CONCRETE)],
            "name and numbers (hurst, h_max, m0, m2, m4) are given",
        ),
        (["--surface", "concrete", "--file", "s.toml"], "got file, name"),
        (["--file", "missing.toml"], "missing.toml cannot be read: No such file"),
        (
            ["--surface", "concrete", "--E-star", "1", "--E1", "1"],
            "a material is E_star alone",
        ),
        (["--surface", "concrete", "--json", "--csv"], "--json and --csv"),
        (["--surface", "concrete", "--surfce", "x"], "No such option"),
        (["--surface", "concrete", "--out", "no/such/folder.txt"], "cannot be written"),
    ],
)
def test_bad_input_of_every_command(folder, arguments, message):
    commands = (
        ["contact", "-d", "0.5"],
        ["curve", "--points", "5", "--plot", "c.png"],
        ["island", "--delta", "1"],
    )
    for command in commands:
        assert message in refused(*command, *arguments)


test_bad_input_of_one_command = told(
    lambda arguments: refused(*arguments, "--surface", "concrete"),
    (["contact", "-d", "-1.2"], "separation must be at least -h_max"),
    (["contact", "-d", ""], "separation is empty"),
    (["contact", "-d", "1;2"], "';2' is no known unit of length"),
    (["contact", "-d", "1", "--conductivity", "-1"], "k1 must be positive"),
    (["contact", "-p", "1e5", "--theory", "calibrated"], "pressure must be less"),
    (["plan9"], "No such command 'plan9'"),
    (
        ["contact", "-d1", "--theory", "persson", "--island-model", "exact"],
        "island_model: options of theory",
    ),
    (["contact", "-d1", "--option", "method"], "--option takes NAME=VALUE"),
    (
        ["contact", "-d1", "--theory", "persson", "--option", "methods=full"],
        "methods: options of no theory, not of 'persson', which has method",
    ),
    (["contact", "-d1", "--rtol", "1e-4", "--option", "rtol=1e-5"], "rtol: given twice"),
    (["contact"], "one of --separation, --mean-separation, --pressure and --area"),
    (["curve", "--points", "4"], "--points"),
    (["curve", "--plot", "c.jpg"], ".png, .svg, .pdf"),
    (["curve", "--plot", "c.png", "--out", "c.png"], "same file"),
)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            "[surface]\nname = 'concrete'\nxyz = 1\n",
            "s.toml: [surface]: unknown key 'xyz'; known are name, map",
        ),
        (
            toml(CONCRETE).replace("0.7", "'0.7'"),
            "s.toml: surface.hurst: '0.7' is not of type 'number'",
        ),
    ],
)
def test_bad_files(folder, content, message):
    (folder / "s.toml").write_text(content)
    assert message in refused("contact", "--file", "s.toml", "-d", "0.1")


def test_faults_of_the_system_are_one_line(folder, monkeypatch):
    def fail(*_, **__):
        raise OSError("odd\nfault")

    monkeypatch.setattr("mbma_tables.contacts.contact.contact", fail)
    assert refused("contact", "--surface", "concrete", "-d", "0.1") == "mbma: odd fault\n"


def test_help_has_many_options_in_sections():
    assert run() == run("--help")
    assert run().startswith("Usage: mbma [OPTIONS] [COMMAND]")
    headings = re.findall(r"^(\w.*):$", run("contact", "--help"), re.MULTILINE)
    assert headings == [
        "What is known", "Surface", "Measured map", "Surface in numbers", "Surface by roughness parameters", "Bodies",
        "Theory", "Options",
    ]  # fmt: skip
    headings = re.findall(r"^(\w.*):$", run("joint", "--help"), re.MULTILINE)
    assert headings == [
        "What is known", "Surface in numbers", "Surface by roughness parameters", "Bodies", "Theory", "Options",
    ]  # fmt: skip
    assert re.fullmatch(
        r"mbma \d+\.\d+\.\d+, core (plain|x86_64_v\d)\n", run("--version")
    )


def test_a_dash_is_standard_input_and_output(folder):
    asked = ("contact", "-d", "0.5", "--json")
    expected = run(*asked, "--surface", "concrete")
    given = CliRunner().invoke(
        main,
        [*asked, "--file", "-", "--out", "-"],
        input="[surface]\nname = 'concrete'\n",
    )
    assert json.loads(given.stdout)["columns"] == json.loads(expected)["columns"]
    law = ("export", "calculix", "--surface", "concrete", "--E-star", "13.3MPa", "--out")
    text = run(*law, "-")
    run(*law, "law.inp")
    assert text == (folder / "law.inp").read_text(encoding="utf-8").replace(
        "--out law.inp", "--out -"
    )
    scene = "separation = [0.5]\n[surface]\nname = 'concrete'\n"
    found = CliRunner().invoke(main, ["run", "-", "--out", "-"], input=scene)
    assert (found.exit_code, found.stdout.splitlines()[0][:8]) == (0, "# mbma 0"), (
        found.output
    )
    assert [path.name for path in folder.iterdir()] == ["law.inp"]


COMMAND = """
import time, click
from mbma_tables.cli import main
from mbma_tables.common import progress
progress.PATIENCE = 0.2
@main.command('wait')
def wait():
    time.sleep(1.0)
    progress.echo('done')
main(['wait'])
"""


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals")
def test_a_terminal_sees_that_work_goes_on():
    import pty

    ours, theirs = pty.openpty()
    found = subprocess.run(
        [sys.executable, "-c", COMMAND], stdout=subprocess.PIPE, stderr=theirs, check=True
    )
    os.close(theirs)
    said = os.read(ours, 10_000)
    os.close(ours)
    assert found.stdout == b"done\n"
    assert b"mbma: wait, 0 s (Ctrl-C ends it)" in said
    assert said.endswith(b"\r\x1b[K")


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize("module", ["click", "mbma_tables.islands.greenwood_tripp"])
def test_control_c_ends_it_with_130(folder, module):
    # while modules are imported, and with the last of them in place
    command = [
        sys.executable,
        "-X",
        "importtime",
        "-m",
        "mbma_tables",
        "curve",
        "--surface",
        "concrete",
    ]
    command += ["--island-model", "exact", "--points", "100000"]

    def heeding():
        # where the tests themselves run in the background, SIGINT is ignored, and would be
        # by the program
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "preexec_fn": heeding}
    with subprocess.Popen(command, **pipes) as program:
        try:
            while program.stderr.readline().decode().rpartition("|")[2].strip() != module:
                assert program.poll() is None
            program.send_signal(signal.SIGINT)
            said = program.communicate(timeout=120)
        finally:
            program.kill()
    assert program.returncode == 130
    assert b"Traceback" not in said[1]
    assert said[0] == b""


def test_conductance_of_one_or_two_bodies():
    asked = (
        "contact",
        "--surface",
        "challenge",
        "--length-unit",
        "mm",
        "--E-star",
        "25MPa",
        "-p",
        "100kPa",
        "--json",
    )
    surface = Surface.named("challenge").to("mm")
    for given, unit, conductivities in (
        ("0.3", "conductivity/mm", 0.3),
        ("0.3 W/(m K),0.5 W/(m K)", "W/(m^2 K)", ("0.3 W/(m K)", "0.5 W/(m K)")),
    ):
        answer = json.loads(run(*asked, "--conductivity", given))
        bodies = Bodies("25 MPa", conductivity=conductivities)
        face = contact(surface, bodies, pressure="100 kPa")
        assert answer["columns"]["solid_conductance"] == pytest.approx(
            [face.solid_conductance], rel=1e-9
        )
        assert answer["units"]["solid_conductance"] == unit
    assert "one or two, got 3" in helpers.refused(*asked, "--conductivity", "1,2,3")


def test_missing_matplotlib_leaves_nothing(folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    found = refused(
        "curve",
        "--surface",
        "concrete",
        "--points",
        "5",
        "--plot",
        "c.png",
        "--out",
        "c.txt",
    )
    assert "pip install matplotlib" in found


@pytest.mark.slow
def test_a_terminal_without_the_units_letters(folder):
    name = os.fsdecode(b"caf\xc3\xa9\xff.toml")
    (folder / name).write_text(
        "[surface]\nlength_unit = 'µm'\n" + toml(CONCRETE).partition("\n")[2],
        encoding="utf-8",
    )
    command = [
        sys.executable,
        "-m",
        "mbma_tables",
        "contact",
        "--file",
        name,
        "-d",
        "0.5",
        "--island-model",
        "rigid",
    ]
    environment = os.environ | {"PYTHONIOENCODING": "ascii"}
    found = subprocess.run(command, capture_output=True, check=False, env=environment)
    assert (found.returncode, found.stderr) == (0, b"")
    assert "surface of café�.toml" in found.stdout.decode("utf-8")
    assert "h_max 1.1 um" in found.stdout.decode("utf-8")


@pytest.mark.parametrize("command", ["", "contact", "curve", "island"])
def test_help_answers_without_heavy_imports(command):
    code = (
        "import sys\n"
        "from mbma_tables.cli import main\n"
        "try:\n"
        "    main([*sys.argv[1:], '--help'], prog_name='mbma')\n"
        "except SystemExit as end:\n"
        "    assert end.code == 0\n"
        "heavy = {'scipy', 'matplotlib', 'SurfaceTopography', 'xarray'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    found = subprocess.run(
        [sys.executable, "-c", code, *command.split()],
        capture_output=True,
        text=True,
        check=False,
    )
    assert found.returncode == 0, found.stderr
    assert found.stdout.startswith(f"Usage: mbma {command}".rstrip())


def test_contact_with_a_hardness(tmp_path):
    named = [
        "contact",
        "--hurst",
        "0.8",
        "--q0",
        "0.01/um",
        "--q1",
        "2/um",
        "--h-rms",
        "1um",
        "--h-max",
        "3um",
    ]
    asked = [*named, "--E-star", "100GPa", "-p", "30MPa", "--theory", "calibrated"]
    text = run(*asked, "--hardness", "1500MPa")
    assert "psi 3.61, elastic up to 1.1" in text
    assert "yielded" in text
    assert "elastic: area within 5% for hardnesses from 4.922 GPa on" in run(*asked)
    run(
        "curve",
        *asked[1:-4],
        "--points",
        "5",
        "--hardness",
        "1500MPa",
        "--plot",
        tmp_path / "c.svg",
    )
    assert "hardness 1500MPa<" in (tmp_path / "c.svg").read_text()


def test_leakage_is_a_column_where_it_is_asked_for():
    arguments = ("--surface", "concrete", "--theory", "calibrated")
    found = json.loads(run("contact", *arguments, "-a", "0.1,0.5", "--leakage", "--json"))
    own = contact(Surface.named("concrete"), area=[0.1, 0.5], theory="calibrated").leakage
    assert found["columns"]["leakage"] == own.K.tolist()
    assert found["columns"]["leakage"][1] == 0
    assert found["units"]["leakage"] == "mm^3"
    assert found["columns"]["leakage_valid"] == [bool(valid) for valid in own.valid]
    assert "leakage" not in run("contact", *arguments, "-a", "0.1")
    curve = json.loads(run("curve", *arguments, "--points", "9", "--leakage", "--json"))[
        "columns"
    ]
    assert (np.diff(curve["leakage"]) < 0).all()


def test_contacts_that_yield_say_how_they_are_loaded():
    words = ["contact", "--surface", "challenge", "--E-star", "25MPa"]
    words += ["--length-unit", "mm", "-p", "200kPa,100kPa", "--json"]
    for hardness, expected in ((["--hardness", "5MPa"], True), ([], False)):
        report = json.loads(CliRunner().invoke(main, words + hardness).output)
        assert bool(report["loading"]) == expected
        text = CliRunner().invoke(main, words[:-1] + hardness).output
        assert (f"loading: {report['loading']}" in text) == expected
    assert (
        CliRunner()
        .invoke(main, [*words[:-1], "--hardness", "5MPa"])
        .output.count("no unloading")
    )
