"""A joint in files for other programs has what its table has: all targets and files, gas, any names and units."""

import ctypes
import dataclasses
import io
import json
import math
import pathlib
import re
import subprocess
import types
import zipfile

import click
import numpy as np
import pytest
from click.testing import CliRunner
from helpers import compiled_law, skip_without_package
from law_points import needs
from test_fields import GETDP, MESH
from test_programs import TOP, calculix, conductance, each, heated

from mbma_tables import Bodies, InputError, Joint, contact
from mbma_tables.cli import main
from mbma_tables.export import registry
from mbma_tables.export.registry import declared_options, targets
from mbma_tables.export.text import number, template

FACE = {"Rq": "0.4 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
METALS = ("steel 4140 hard", "aluminium 6061 hard")
EXAMPLE = pathlib.Path(__file__).parents[2] / "examples" / "joint.toml"
SPAN = ("10 kPa", "100 MPa")  # four decades
OF_LAWS = [name for name, each in targets().items() if name != "c"]


@pytest.fixture(scope="module")
def joint():
    parts = FACE, FACE | {"Rq": "0.7 um"}
    return Joint(
        *parts, bodies=METALS, nominal_area="4 cm^2", friction=0.2, theory="calibrated"
    )


@pytest.fixture(scope="module")
def total(joint):
    """W/(m^2 K) of solid and gas at pressures in MPa, by the joint's own table."""

    def at(pressures):
        table = joint.table(
            [f"{pressure!r} MPa" for pressure in np.asarray(pressures).tolist()]
        )
        return table["total_conductance"].to_numpy()

    return at


@pytest.mark.parametrize("target", OF_LAWS)
def test_every_target_takes_a_joint_with_a_name(joint, target, tmp_path):
    skip_without_package(target)
    kind = targets()[target]
    path = tmp_path / f"bolt{kind.end or '.txt'}"
    options = {"binaries": "none"} if target in ("fmu", "fmu3") else {}
    written = joint.export(
        target, SPAN if kind.rows else None, name="bolt", path=path, **options
    )
    assert written[-1] == path
    assert sorted(written) == sorted(tmp_path.iterdir())
    assert all(each.stat().st_size > 0 for each in written)
    beside = {"c-law": {"bolt.h"}, "fortran-law": {"bolt_c.c"}, "matlab": {"bolt.m"}}
    beside["javascript-law"] = {"bolt.cjs", "bolt.d.mts", "bolt.d.cts"}
    assert {each.name for each in written[:-1]} == beside.get(target, set())
    if target not in (
        "fmu",
        "fmu3",
        "hdf5",
        "netcdf",
        "parquet",
        "xlsx",
        "matlab",
    ):  # which are not text
        assert "bolt" in path.read_text()


ALONE = ("abaqus-gapcon", "calculix-gapcon")


@pytest.mark.slow
@pytest.mark.parametrize("target", OF_LAWS)
def test_every_target_takes_a_joint_about_its_preload(joint, target, tmp_path):
    """Each file states it, or why it has no such law."""
    skip_without_package(target)
    kind = targets()[target]
    preloaded = joint.after("50 MPa")
    path = tmp_path / f"bolt{kind.end or '.txt'}"
    options = {"binaries": "none"} if target in ("fmu", "fmu3") else {}
    span = SPAN if kind.rows else None
    options |= {"rows": 8} if kind.rows else {}

    def written():
        files = preloaded.export(target, span, name="bolt", path=path, **options)
        return b"".join(each.read_bytes() for each in files)

    if target in ALONE:
        with pytest.raises(InputError, match="jumps at the largest pressure: rows"):
            written()
        return
    content = written()
    if target in ("fmu", "fmu3"):
        with zipfile.ZipFile(path) as archive:
            content = b"".join(map(archive.read, archive.namelist()))
    # without line ends and the marks of comments after them
    text = re.sub(rb"\s+(\W{1,3}\s)?", b" ", content)
    assert b"after a largest pressure of 50" in text
    assert b"loading only" not in text


def test_rows_have_the_conductance_of_the_gas_too(joint, total):
    """4,604 W/(m^2 K) of the solid at 1 MPa are 16,194 with air."""
    pressures = np.array([0.1, 1.0, 10.0])
    assert total(pressures)[1] == pytest.approx(16194, rel=1e-3)
    content = json.loads(joint.export("json", SPAN))
    columns = content["columns"]
    assert content["y_unit"] == "mW/(mm K)/mm"
    read = 1000 * np.interp(pressures, columns["pressure"], columns["total_conductance"])
    np.testing.assert_allclose(read, total(pressures), rtol=1.1e-3)
    assert "solid spots and of the gas in the gaps together, air at 300.0 K" in " ".join(
        content["comments"]
    )
    for target in ("abaqus", "calculix"):
        card = joint.export(target, SPAN).split("*GAP CONDUCTANCE")[1].splitlines()[1:]
        k, p = np.array([line.split(",") for line in card], float).T
        stated = float(
            re.search(
                r"conductance: \d+ rows; .*?interpolation (\S+),",
                joint.export(target, SPAN),
            )[1]
        )
        np.testing.assert_allclose(
            1000 * np.interp(pressures, p, k), total(pressures), rtol=1.1 * stated
        )


def test_without_gas_rows_are_of_the_solid(joint):
    vacuum = dataclasses.replace(joint, gas="vacuum")
    content = json.loads(vacuum.export("json", SPAN))
    read = np.interp(
        [1.0, 10.0],
        content["columns"]["pressure"],
        content["columns"]["solid_conductance"],
    )
    solid = joint.table(["1 MPa", "10 MPa"])["solid_conductance"].to_numpy()
    np.testing.assert_allclose(1000 * read, solid, rtol=1.1e-3)
    assert "solid spots alone, without gas" in " ".join(content["comments"])


def test_code_says_what_its_conductances_are(joint):
    text = " ".join(joint.export("c-law", name="bolt").replace(" * ", " ").split())
    for words in (
        "total_conductance (joint conductance) is that of the solid spots",
        "solid_conductance (contact conductance)",
        "gas_conductance (gap conductance)",
        "air at 300.0 K and 101325.0 Pa",
    ):
        assert words in text
    vacuum = dataclasses.replace(joint, gas="vacuum").export("c-law", name="bolt")
    assert "bolt_solid_conductance(double c);" in vacuum
    assert "total_conductance" not in vacuum
    assert "double *stress" in joint.export("abaqus-uinter", heat=False)


PRESSURES = np.array([1e-3, 0.01, 0.1, 1.0, 10.0, 100.0])  # MPa
APART = np.array([1e-6, 1e-4, 3e-3, 0.03, 0.3, 30.0])  # mm beyond the first contact
CONDUCTANCES = ("solid_conductance", "gas_conductance", "total_conductance")


@pytest.fixture(scope="module")
def elastic():
    """A joint whose law every language writes with conductance."""
    return Joint(
        FACE, bodies=("steel 4140", "copper C11000"), nominal_area="4 cm^2",
        theory="calibrated",
    )  # fmt: skip


def assert_conducts(joint, answer):
    """`answer(name, c)` of a file is the joint's own in contact, and the contact's where bodies are apart."""
    asked = joint.at_pressure([f"{p!r} MPa" for p in PRESSURES.tolist()])
    c = 1e-3 * (joint.surface.h_max - np.asarray(asked.mean_separation))
    for name in CONDUCTANCES:
        expected = np.asarray(asked.quantity(name)) / 1000
        np.testing.assert_allclose(answer(name, c), expected, rtol=1e-5)
    apart = contact(
        joint.surface, joint.bodies, mean_separation=joint.surface.h_max + 1e3 * APART
    )
    gas = np.asarray(apart.gap_conductance("air")) / 1000
    np.testing.assert_allclose(answer("total_conductance", -APART), gas, rtol=1e-4)
    assert (answer("solid_conductance", -APART) == 0).all()


@needs("gcc")
@pytest.mark.parametrize("hard", [True, False])
def test_c_conducts_as_solid_and_gas(hard, joint, elastic, tmp_path):
    of = joint if hard else elastic
    of.export("c-law", name="road", path=tmp_path / "road.c")
    options = ("-std=c99", "-Wconversion", "-Wshadow", "-O2")
    assert_conducts(of, compiled_law(tmp_path / "road.c", *options))


@pytest.mark.parametrize("kind", ["elastic", "joint"])
def test_python_conducts_as_solid_and_gas(kind, request):
    """Yielded contacts had no conductance in Python, MATLAB and jax."""
    joint = request.getfixturevalue(kind)
    road = types.ModuleType("road")
    exec(joint.export("python-law", name="road"), road.__dict__)
    assert_conducts(joint, lambda name, c: getattr(road, name)(c))


def test_jax_conducts_as_solid_and_gas(elastic):
    jax = pytest.importorskip("jax")
    road = types.ModuleType("road")
    with jax.enable_x64(True):
        exec(elastic.export("jax-law", name="road"), road.__dict__)
        assert_conducts(elastic, lambda name, c: np.asarray(getattr(road, name)(c)))
        slope = jax.grad(road.total_conductance)
        c = 1e-3
        by = 1e-7
        both = road.total_conductance(np.array([c - by, c + by]))
        assert float(slope(c)) == pytest.approx(
            float(both[1] - both[0]) / 2 / by, rel=1e-4
        )


@needs("node")
def test_javascript_conducts_as_solid_and_gas(joint, tmp_path):
    joint.export("javascript-law", name="road", path=tmp_path / "road.cjs.mjs")
    (tmp_path / "road.mjs").write_text((tmp_path / "road.cjs.mjs").read_text())
    program = "import * as road from './road.mjs'; const [what, c] = JSON.parse(process.argv[2]); "
    program += "console.log(JSON.stringify(c.map(road[what])))"
    (tmp_path / "ask.mjs").write_text(program)

    def answer(name, c):
        asked = json.dumps([name, np.asarray(c).tolist()])
        done = subprocess.run(
            ["node", "ask.mjs", asked], cwd=tmp_path, capture_output=True, text=True, check=True
        )  # fmt: skip
        return np.array(json.loads(done.stdout))

    assert_conducts(joint, answer)


@needs("octave-cli")
@pytest.mark.slow
def test_octave_conducts_as_solid_and_gas(elastic, tmp_path):
    elastic.export("matlab-law", name="road", path=tmp_path / "road.m")

    def answer(name, c):
        np.savetxt(tmp_path / "c.txt", c, "%.17g")
        code = f"law = road(); printf('%.17g\\n', law.{name}(load('c.txt')));"
        words = ["octave-cli", "--no-init-file", "--eval", code]
        done = subprocess.run(
            words, cwd=tmp_path, capture_output=True, text=True, check=True
        )
        return np.array(done.stdout.split(), float)

    assert_conducts(elastic, answer)


@pytest.mark.slow
def test_an_fmu_conducts_as_solid_and_gas(joint, tmp_path):
    fmpy = pytest.importorskip("fmpy")
    path = tmp_path / "road.fmu"
    joint.export("fmu", name="road", path=path, binaries="here")

    def answer(name, c):
        times = np.arange(len(c) + 1.0)
        given = np.array(
            list(zip(times, [*c, c[-1]], strict=True)),
            [("time", float), ("overclosure", float)],
        )
        found = fmpy.simulate_fmu(
            str(path), fmi_type="CoSimulation", input=given, output=[name],
            stop_time=times[-1], step_size=1.0, output_interval=1.0,
        )  # fmt: skip
        return found[name][1:]

    assert_conducts(joint, answer)


def routine(name, joint, folder):
    """The routine of a solver, in C, of the joint's law."""
    text = joint.export(name, name="road")
    if name.startswith("abaqus"):
        text += "void xit_(void) {}\n"  # of Abaqus
    (folder / "road.c").write_text(text)
    library = compiled_law(folder / "road.c", "-std=c99", "-O2").library
    return library[f"road_{name.partition('-')[2]}"]


@needs("gcc")
@pytest.mark.parametrize("target", ["abaqus-gapcon", "calculix-gapcon"])
def test_gapcon_has_the_gas(target, joint, total, tmp_path):
    function = routine(target, joint, tmp_path)

    def asked(clearance, pressure):
        ak = (ctypes.c_double * 5)()
        function(ak, (ctypes.c_double * 2)(clearance, pressure), *[None] * 13)
        return np.array(ak)

    for pressure in PRESSURES.tolist():
        assert 1000 * asked(0.0, pressure)[0] == pytest.approx(
            total([pressure])[0], rel=1e-5
        )
    by = 1e-4
    slope = (asked(0.0, 1 + by)[0] - asked(0.0, 1 - by)[0]) / (2 * by)
    assert asked(0.0, 1.0)[2] == pytest.approx(slope, rel=1e-5)
    # apart: by the clearance from where surfaces touch, h_max above the mean plane
    apart = contact(
        joint.surface, joint.bodies, mean_separation=joint.surface.h_max + 3.0
    )
    assert asked(3e-3, 0.0)[0] == pytest.approx(
        float(apart.gap_conductance("air")) / 1000, rel=1e-5
    )
    slope = (asked(3.01e-3, 0.0)[0] - asked(2.99e-3, 0.0)[0]) / 2e-5
    assert asked(3e-3, 0.0)[1] == pytest.approx(slope, rel=1e-4)


# of UINTER, in the order of the manual
LISTED = template("code/subroutines/uinter.c").partition("#define UINTER_ARGUMENTS")[2]
ARGUMENTS = re.findall(r"\w+", LISTED.partition("#endif")[0])


@needs("gcc")
def test_uinter_has_the_gas(joint, total, tmp_path):
    function = routine("abaqus-uinter", joint, tmp_path)

    def asked(c):
        numbers = {"rdisp": [c, 0.0], "temp": [20.0, 120.0], "ndir": 2, "linper": 0}
        made = {}
        for name in ARGUMENTS:
            given = numbers.get(name, [0.0] * 16)
            whole = isinstance(given, int) or name == "lopenclose"
            kind = ctypes.c_int if whole else ctypes.c_double
            values = [given] if isinstance(given, int) else given
            made[name] = (kind * 16)(*(int(v) if whole else v for v in values))
        function(*made.values())
        return made["flux"][0], made["ddfddt"][0], made["ddfddr"][0], made["stress"][0]

    pressed = joint.at_pressure("10 MPa")
    c = 1e-3 * float(joint.surface.h_max - pressed.mean_separation)
    flux, conductance, slope, stress = asked(c)
    assert stress == pytest.approx(10.0, rel=1e-6)
    assert flux == pytest.approx(total([10.0])[0] / 10, rel=1e-5)
    assert conductance == pytest.approx(flux / 100, rel=1e-14)
    by = 1e-8
    assert slope == pytest.approx(
        (asked(c + by)[0] - asked(c - by)[0]) / 2 / by, rel=1e-5
    )
    apart = contact(
        joint.surface, joint.bodies, mean_separation=joint.surface.h_max + 3.0
    )
    flux, *_, stress = asked(-3e-3)
    assert stress == 0
    assert flux == pytest.approx(float(apart.gap_conductance("air")) / 10, rel=1e-5)
    assert abs(asked(-1e36)[0]) < 1e-30


def test_files_that_need_others_are_written_to_a_path(joint):
    with pytest.raises(InputError, match=r"several files.*give path"):
        joint.export("fortran-law")
    assert joint.export("netcdf", SPAN)[:4] == b"\x89HDF"
    archive = zipfile.ZipFile(
        io.BytesIO(joint.export("fmu", name="bolt", binaries="none"))
    )
    assert "sources/bolt.c" in archive.namelist()


@needs("gfortran", "cc")
def test_fortran_of_a_joint_runs_with_its_own_files(joint, tmp_path):
    joint.export("fortran-law", name="bolt", path=tmp_path / "bolt.f90")
    (tmp_path / "main.f90").write_text(
        "program p\n  use bolt\n  implicit none\n  print '(es24.16)', total_conductance(overclosure(10d0))\nend program\n"
    )
    build = "cc -O1 -c bolt_c.c && gfortran bolt.f90 main.f90 bolt_c.o -lm -o run"
    subprocess.run(build, shell=True, cwd=tmp_path, check=True, capture_output=True)
    ran = subprocess.run(
        ["./run"], cwd=tmp_path, check=True, capture_output=True, text=True
    )
    own = joint.table(["10 MPa"])["total_conductance"].to_numpy()[0]
    assert 1000 * float(ran.stdout) == pytest.approx(own, rel=1e-5)


@pytest.mark.parametrize(("length", "stress"), [("m", "Pa"), ("um", "GPa"), ("mm", "Pa")])
def test_units_are_those_asked_for(joint, total, length, stress):
    metre = {"m": 1, "mm": 1e-3, "um": 1e-6}[length]
    pascal = {"Pa": 1, "GPa": 1e9}[stress]
    content = json.loads(
        joint.export("json", SPAN, length_unit=length, stress_unit=stress, rtol=1e-2)
    )
    assert content["x_unit"] == stress
    assert content["y_unit"] == f"W/({length} K)/{length}"
    x, y = (
        np.array(content["columns"][name]) for name in ("pressure", "total_conductance")
    )
    np.testing.assert_allclose(
        np.interp(1e6 / pascal, x, y) / metre**2, total([1.0])[0], rtol=1.1e-2
    )


def test_each_quantity_has_its_own_number_of_rows_and_error(joint):
    """The header of a card stated the conductance's rows and error alone."""
    card = joint.export("abaqus", SPAN)
    pressure = re.search(
        r"\*\* pressure: (\d+) rows; largest error of linear interpolation (\S+),", card
    )
    heat = re.search(
        r"\*\* total_conductance: (\d+) rows; largest error of linear interpolation (\S+),",
        card,
    )
    closure = card.split("TABULAR\n")[1].split("*FRICTION")[0].splitlines()
    assert int(pressure[1]) == len(closure)
    assert int(heat[1]) == len(card.split("*GAP CONDUCTANCE, PRESSURE\n")[1].splitlines())
    p, c = np.array([line.split(",") for line in closure], float).T
    law = joint.law()
    at = np.geomspace(0.0101, 99, 300)
    exact = 1e-3 * (
        joint.surface.h_max - np.asarray(law.at_pressure(at / 1000).mean_separation)
    )
    error = np.abs(np.interp(exact, c, p) / at - 1).max()
    assert 0.5 * float(pressure[2]) < error < 1.1 * float(pressure[2])


def test_rows_are_as_many_as_a_program_keeps(joint):
    card = joint.export("calculix", SPAN)
    assert len(card.split("*GAP CONDUCTANCE\n")[1].splitlines()) == 20
    twelve = joint.export("calculix", SPAN, rows=12)
    assert len(twelve.split("*GAP CONDUCTANCE\n")[1].splitlines()) == 12
    with pytest.raises(
        InputError, match="needs 27 rows, and the program keeps 20: take a larger rtol"
    ):
        joint.export("calculix", SPAN, rtol=1e-3)
    with pytest.raises(
        InputError, match="20 rows of total_conductance at most here, got 30"
    ):
        joint.export("calculix", SPAN, rows=30)


SEVERAL = ("pressure", "total_conductance", "tangential_stiffness")


def test_several_quantities_in_one_file(joint):
    curves = joint.export("lsdyna", SPAN, quantity=SEVERAL)
    assert re.findall(r"^\*DEFINE_CURVE\n +(\d)", curves, re.M) == ["1", "2", "3"]
    assert "$ curve 3: tangential_stiffness [MPa/mm] against pressure [MPa]" in curves
    blocks = joint.export("moose-function", SPAN, name="bolt", quantity=SEVERAL)
    assert blocks.count("[Functions]") == 1
    assert re.findall(r"\[(bolt_\w+)\]", blocks) == [f"bolt_{name}" for name in SEVERAL]
    for text in (curves, blocks):
        for name in SEVERAL:
            assert re.search(rf"{name}: \d+ rows", text)
    with pytest.raises(InputError, match="one quantity a file"):
        joint.export("csv", SPAN, quantity=SEVERAL)


@needs("getdp")
def test_getdp_reads_several_quantities(joint, total, tmp_path):
    joint.export("getdp", SPAN, name="bolt", quantity=SEVERAL, path=tmp_path / "law.pro")
    found = joint.at_pressure("10 MPa")
    c = 1e-3 * float(joint.surface.h_max - found.mean_separation)
    asked = {"pressure": c, "total_conductance": 10.0, "tangential_stiffness": 10.0}
    prints = "".join(
        f'Print[{{bolt_{name}[{number(x)}]}}, Format "{name} %.17g"];\n'
        for name, x in asked.items()
    )
    (tmp_path / "a.msh").write_text(f"{MESH}$EndElements\n")
    (tmp_path / "a.pro").write_text(GETDP.replace("PRINTS", prints))
    done = subprocess.run(
        ["getdp", "a.pro", "-msh", "a.msh", "-solve", "R"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    read = {
        name: float(re.search(rf"^{name} (\S+)", done.stdout, re.M)[1]) for name in asked
    }
    expected = {
        "pressure": 10.0,
        "total_conductance": total([10.0])[0] / 1000,
        "tangential_stiffness": 1e6 * float(found.tangential().stiffness),
    }
    assert read == pytest.approx(expected, rel=1.2e-3)


@needs("ccx")
@pytest.mark.slow
def test_calculix_conducts_as_solid_and_gas(joint, total, tmp_path):
    card = joint.export("calculix", SPAN, name="ROUGH", heat=True)
    card = re.sub(r"\*FRICTION\n.*\n", "", card)
    c0, p0 = map(float, card.split("EXPONENTIAL\n")[1].splitlines()[0].split(","))
    pressures = np.array([0.05, 1.0, 20.0])
    c = c0 / np.log(100) * np.log(pressures / p0)
    moved = (each(TOP, f"3, 3, {-down:.12e}") for down in c + 20 * pressures / 1e9)
    said, p, flux = calculix(heated(card, moved, 10.0, 1e9), tmp_path)
    assert len(p) == pressures.size, said.stdout[-1000:]
    np.testing.assert_allclose(p, pressures, rtol=2e-2)
    np.testing.assert_allclose(1000 * conductance(flux), total(p), rtol=1e-2)


def run(*words):
    return CliRunner().invoke(main, ["joint", str(EXAMPLE), *words])


def test_the_command_writes_a_joint(tmp_path):
    out = tmp_path / "joint.f90"
    done = run("--export", "fortran-law", "--name", "bolt", "--out", str(out))
    assert done.exit_code == 0, done.output
    assert done.output.split() == [str(tmp_path / "joint_c.c"), str(out)]
    done = run(
        "--export",
        "abaqus",
        "--pressures",
        "10kPa:100MPa",
        "--name",
        "JOINT",
        "--out",
        "-",
    )
    assert done.exit_code == 0, done.output
    assert "*SURFACE INTERACTION, NAME=JOINT\n" in done.output
    assert "mbma joint " in done.output
    assert "sha256" in done.output
    known = Joint.from_toml(EXAMPLE)
    k, p = np.array(
        [
            line.split(",")
            for line in done.output.split("*GAP CONDUCTANCE, PRESSURE\n")[1].splitlines()
        ],
        float,
    ).T
    own = known.table(["1 MPa"])["total_conductance"].to_numpy()[0]
    assert 1000 * np.interp(1.0, p, k) == pytest.approx(own, rel=1.2e-3)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--export", "abaqus", "--pressures", "1MPa:2MPa"), "--export needs --out"),
        (("--export", "abaqus", "--out", "-"), "abaqus needs pressures"),
        (
            ("--export", "abaqus", "--pressures", "1MPa", "--out", "-"),
            "--pressures must be like 0.1:100 or 1MPa:50MPa",
        ),
        (
            ("--export", "abacus", "--out", "-"),
            "no target is named 'abacus'; did you mean 'abaqus'",
        ),
        (
            ("--export", "c-law", "--pressures", "1MPa:2MPa", "--out", "-"),
            "without effect on c-law",
        ),
        (
            ("--export", "c-law", "--rows", "20", "--out", "-"),
            "without effect on c-law: leave --rows out",
        ),
        (
            ("--export", "mbdyn", "--length-unit", "mm", "--out", "-"),
            "mbdyn is written in m and Pa, got mm and Pa",
        ),
        (
            ("--export", "csv", "--pressure", "1MPa", "--out", "-"),
            "--export writes the joint: leave --pressure",
        ),
        (("--rows", "20", "--pressure", "1MPa"), "--rows belong to --export"),
        ((), "pressures or forces are needed"),
    ],
)
def test_what_the_command_refuses(words, message):
    done = run(*words)
    assert done.exit_code != 0
    assert message in str(done.exception) + done.output


def test_export_of_a_joints_file_names_the_command_that_writes_it():
    done = CliRunner().invoke(
        main, ["export", "calculix", "--file", str(EXAMPLE), "--out", "-"]
    )
    assert done.exit_code != 0
    assert f"mbma export TARGET --joint {EXAMPLE}" in str(done.exception) + done.output


@pytest.mark.parametrize(
    ("target", "options", "message"),
    [
        ("c", {}, "'c' is the whole model.*c-law"),
        (None, {}, "target must be the name of one"),
        (["csv"], {}, "target must be the name of one"),
        ("abaqus", {"friction_pressure": 0}, "friction_pressure must be"),
        ("abaqus", {"friction_pressure": [1, 2]}, "friction_pressure must be"),
        ("abaqus", {"rows": 0}, "rows must be a whole number"),
        ("abaqus", {"rtol": 0}, "rtol must be a number in"),
        ("c-law", {"rtol": 0}, "without effect on c-law: leave rtol out"),
        ("abaqus", {"length_unit": ""}, "unit of length"),
        ("csv", {"quantity": 3}, "quantity must be a name or several, got 3"),
        ("csv", {"quantity": []}, "quantity must be a name or several"),
        ("csv", {"quantity": [3]}, "quantity must be a name or several"),
        ("csv", {"quantity": "presure"}, "did you mean 'pressure'"),
        ("getdp", {"quantity": ["pressure"] * 2}, "the same name twice"),
        ("getdp", {"quantity": "film", "leakage": True}, "give quantity='leakage'"),
        (
            "abaqus-uinter",
            {"quantity": "psi"},
            "without effect on abaqus-uinter: leave quantity out",
        ),
        ("c-law", {"quantity": "presure"}, "did you mean 'pressure'"),
        ("csv", {"heat": "no"}, "heat must be True or False, got 'no'"),
        ("csv", {"name": 3}, "a name must be text, got 3"),
        ("csv", {"leakage": math.nan}, "leakage must be True or False, got nan"),
        ("c-law", {"leakage": "no"}, "leakage must be True or False, got 'no'"),
        ("csv", {"made_by": "me"}, "made_by must be lines of text"),
        ("csv", {"made_by": 3}, "made_by must be lines of text"),
        ("csv", {"made_by": (3,)}, "made_by must be lines of text"),
        ("csv", {"path": 3}, "path must be that of a file, got 3"),
        ("calculix-gapcon", {"heat": False}, "is of conductance alone"),
    ],
)
def test_what_an_export_refuses(joint, target, options, message):
    rows = target in targets() and targets()[target].rows if target != ["csv"] else True
    with pytest.raises(InputError, match=message):
        joint.export(target, SPAN if rows else None, **options)


def test_rows_of_leakage_by_the_option_are_those_by_the_quantity(joint):
    options = {"made_by": ("test",), "rtol": 1e-2}
    by_option = joint.export("csv", SPAN, leakage=True, **options)
    assert by_option == joint.export("csv", SPAN, quantity="leakage", **options)
    assert "leakage [mm^3]" in by_option


@pytest.mark.parametrize("target", [name for name in OF_LAWS if "law" in name])
def test_code_leaves_out_what_the_bodies_do_not_know(target, tmp_path):
    """Bodies of a modulus alone: no law was written as code, even without heat."""
    unknown = Joint(
        FACE, bodies=Bodies("100 GPa"), nominal_area="4 cm^2", theory="calibrated"
    )
    path = tmp_path / "bolt.txt"
    unknown.export(target, name="bolt", path=path)
    # comments wrap, and each line begins with a mark
    text = " ".join(re.sub(r"\n *(?:\*|#|!|%|//)", " ", path.read_text()).split())
    assert "without tangential stiffness: tangential stiffness needs nu" in text
    assert "without conductance: the bodies have no thermal conductivity" in text
    assert "tangential_stiffness(" not in text
    with pytest.raises(InputError, match="conductance needs the thermal conductivity"):
        unknown.export(target, path=path, heat=True)


def test_standard_output_names_the_files_that_it_leaves_out():
    done = run("--export", "c-law", "--out", "-")
    assert done.exit_code == 0, done.output
    assert done.stderr == "left out: NAME.h; --out FILE writes all\n"
    surface = ["--surface", "concrete", "--E-star", "13.3MPa", "--theory", "calibrated"]
    for words in (
        ["joint", str(EXAMPLE), "--export", "fortran-law"],
        ["export", "fortran-law", *surface],
    ):
        done = CliRunner().invoke(main, [*words, "--out", "-"])
        assert done.exit_code == 2
        assert "fortran-law is several files" in done.output
        assert done.stdout == ""


def test_both_commands_take_the_same_options_of_files(tmp_path):
    """A name was refused for lsdyna by one command, and a comment by the other."""
    surface = ["--surface", "concrete", "--E-star", "13.3MPa"]
    words = ["export", "lsdyna", *surface, "--name", "ROAD", "--rows", "20", "--out", "-"]
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 0, done.output
    assert "$ name: ROAD\n" in done.output
    two = ["--quantity", "pressure,leakage", "--theory", "calibrated", "--rtol", "0.01"]
    done = CliRunner().invoke(main, ["export", "getdp", *surface, *two, "--out", "-"])
    assert done.exit_code == 0, done.output
    assert "rough_pressure[] =" in done.output
    assert "rough_leakage[] =" in done.output
    shared = []
    for name in ("export", "joint"):
        command = main.commands[name]
        parameters = command.get_params(click.Context(command))
        shared.append({each.name: getattr(each, "help", "") for each in parameters})
    declared = declared_options(*registry.OF_LAWS)
    for name, option in declared.items():
        if name not in ("length_unit", "stress_unit", "made_by"):
            assert {one[name] for one in shared} == {option.metadata["help"]}
    names = declared.keys() & shared[0].keys()
    assert {"pressures", "rows", "quantity", "binaries"} <= names
    file_options = {
        "pressures", "name", "quantity", "rows", "rtol", "friction_pressure", "leakage",
        "peklenik", "binaries",
    }  # fmt: skip
    assert all(shared[0][name] == shared[1][name] for name in file_options)
