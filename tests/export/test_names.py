"""Names that a user gives: text in comments and messages, never code, and names that the language can read."""

import dataclasses
import functools
import os
import re
import shutil
import subprocess
import sys
import tokenize
import zipfile
from xml.etree import ElementTree

import law_points
import numpy as np
import pytest
from click.testing import CliRunner
from helpers import refusals
from law_points import needs

from mbma_tables import InputError, MbmaError, Surface, contact, contact_law
from mbma_tables.cli import main
from mbma_tables.export import LAWS
from mbma_tables.export.code.fmu import fmu
from mbma_tables.export.code.languages import LANGUAGES
from mbma_tables.export.code.law_code import asked_law, text_of
from mbma_tables.export.rows import data
from mbma_tables.export.rows.law_rows import describe_law
from mbma_tables.export.text import inert
from mbma_tables.islands.variants import get_variant

ROAD = Surface.named("concrete")
# comments and texts of all languages end, encodings and editors' settings begin; a terminal
# is cleared
HOSTILE = (
    'coding:unicode_escape \nraise SystemExit(7) # -*- coding: utf-7 -*- */ vim: set ex: """ \r\x1b[2J'
    " ??/ --> %} ]] </script> ' \" { {{ NAME }} {% if x %} \\"
)


class Renamed:
    """A theory of a user, with a name of theirs."""

    name = HOSTILE

    def answer(self, surface, u):
        """Pressure over E* and area of a made-up bed of springs."""
        compression = np.maximum(1 - u / surface.h_max, 0)
        return compression**2, compression


@functools.cache
def hostile(of):
    """A law whose variant, or whose theory, has such a name."""
    if of == "variant":
        variant = dataclasses.replace(get_variant("reported"), name=HOSTILE)
        return asked_law(ROAD, "13.3 MPa", "road", theory="mbma", variant=variant)
    return asked_law(ROAD, "13.3 MPa", "road", theory=Renamed())


@functools.cache
def plain():
    return asked_law(ROAD, "13.3 MPa", "road", theory="mbma")


def live(target, text):
    """The lines that are no comments."""
    mark = LANGUAGES[target].mark
    code = re.sub(r"\A/\*.*?\*/", "", text, flags=re.DOTALL) if mark == "/*" else text
    return [
        line for line in code.splitlines() if mark == "/*" or not line.startswith(mark)
    ]


@pytest.mark.parametrize(
    "target", [target for target in LAWS if not LANGUAGES[target].subroutine]
)
def test_a_name_changes_comments_alone(target):
    text = text_of(target, hostile("variant"))
    assert live(target, text) == live(target, text_of(target, plain()))
    assert text.isascii()
    assert text.replace("\n", "").isprintable()
    assert "coding:" not in text
    assert "raise SystemExit" in text


RUN = {
    "python-law": (
        "road.py",
        (sys.executable, "-c", "import road; print(road.pressure(0.2))"),
    ),
    "javascript-law": (
        "road.mjs",
        ("node", "-e", "import('./road.mjs').then(r => console.log(r.pressure(0.2)))"),
    ),
    "matlab-law": (
        "road.m",
        (
            "octave-cli",
            "--no-init-file",
            "--eval",
            "r = road(); printf('%.17g', r.pressure(0.2))",
        ),
    ),
    "c-law": (
        "road.c",
        ("sh", "-c", "gcc -Wall -Wextra -Werror road.c ask.c -lm -o ask && ./ask"),
    ),
}


@pytest.mark.parametrize("of", ["variant", "theory"])
@pytest.mark.parametrize("target", RUN)
def test_a_language_reads_a_file_with_such_a_name(target, of, tmp_path):
    file, command = RUN[target]
    program = "gcc" if target == "c-law" else command[0]
    if shutil.which(program) is None:
        pytest.skip(f"not installed: {program}")
    made = hostile(of)
    (tmp_path / file).write_text(text_of(target, made))
    (tmp_path / "ask.c").write_text(
        '#include <stdio.h>\ndouble road_pressure(double);\nint main(void) { printf("%.17g", road_pressure(0.2)); }\n'
    )
    done = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    law = made.exported.law
    assert float(done.stdout) == pytest.approx(
        float(law.pressure(law.h_max - 0.2)), rel=1e-12
    )


@needs("gfortran")
@pytest.mark.parametrize("of", ["variant", "theory"])
def test_fortran_reads_a_file_with_such_a_name(of, tmp_path):
    (tmp_path / "road.f90").write_text(text_of("fortran-law", hostile(of)))
    command = ("gfortran", "-std=f2008", "-Wall", "-Wextra", "-Werror", "-c", "road.f90")
    done = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow
@pytest.mark.parametrize("of", ["variant", "theory"])
def test_modelica_reads_a_file_with_such_a_name(of, tmp_path):
    rumoca = pytest.importorskip("rumoca")
    made = hostile(of)
    ask = (
        "model Ask\n  Real p;\nequation\n  p = road.pressure(0.1 + 0.1*time);\nend Ask;\n"
    )
    (tmp_path / "ask.mo").write_text(text_of("modelica-law", made) + ask)
    found = (
        rumoca.Session()
        .load(str(tmp_path / "ask.mo"), model="Ask")
        .simulate(t=(0, 1), dt=1)
    )
    law = made.exported.law
    assert float(found["p"][-1]) == pytest.approx(
        float(law.pressure(law.h_max - 0.2)), rel=1e-9
    )


def test_an_fmu_with_such_a_name_is_well_formed(tmp_path):
    (tmp_path / "road.fmu").write_bytes(
        fmu(ROAD, "13.3 MPa", name="road", theory=Renamed(), binaries="none")
    )
    with zipfile.ZipFile(tmp_path / "road.fmu") as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    assert "raise SystemExit" in root.get("description")
    assert root.get("description").replace("\n", "").isprintable()


@pytest.mark.parametrize("begin", ["", "# x\n"])
@pytest.mark.parametrize(
    "name",
    [
        "coding:rot13",
        "-*- coding: cp037 -*-",
        "coding = x\ncoding=rot13",
        "encoding=utf_7",
    ],
)
def test_a_comment_sets_no_encoding(name, begin, tmp_path):
    path = tmp_path / "road.py"
    path.write_text(f"{begin}# {inert(name)}\n")
    with open(path, "rb") as stream:
        assert tokenize.detect_encoding(stream.readline)[0] == "utf-8"


# words that some language has for itself, and words that none has
POOL = """
    end import model function class for lambda None Real integer package module h_max dp
    ones place error piece numbers numpy random enum x match while endif int static var
    await print elastic time persistent c_pressure rows road Seal_2 begin subroutine
    program struct delete const
""".split()  # noqa: SIM905


def accepted(target):
    """The names of the pool that a target takes; the others have one kind of error."""
    names = []
    for name in POOL:
        try:
            law_points.text(target, "calibrated", name=name)
        except InputError as fault:
            if f"name must not be '{name}', which {target}" not in str(fault):
                raise
        else:
            names.append(name)
    assert {"road", "Seal_2"} <= set(names)
    return names


@pytest.fixture
def quickly_made(monkeypatch):
    """Laws that differ in their names alone are made once."""
    made = plain()
    monkeypatch.setattr(
        "mbma_tables.export.code.law_code.asked_law",
        lambda *_, name, **__: made._replace(name=name),
    )


@pytest.mark.usefixtures("quickly_made")
def test_python_reads_every_name_that_is_taken(tmp_path):
    names = accepted("python-law")
    assert not {"import", "class", "None", "numpy", "random", "enum"} & set(names)
    for name in names:
        (tmp_path / f"{name}.py").write_text(
            law_points.text("python-law", "mbma", name=name)
        )
    program = "".join(
        f"import {name}\nassert {name}.pressure(0.2) > 0\n" for name in names
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")


@needs("octave-cli")
@pytest.mark.usefixtures("quickly_made")
def test_octave_reads_every_name_that_is_taken(tmp_path):
    names = accepted("matlab-law")
    assert not {"end", "function", "for", "ones", "error"} & set(names)
    for name in names:
        (tmp_path / f"{name}.m").write_text(
            law_points.text("matlab-law", "mbma", name=name)
        )
    program = "".join(
        f"v_ = {name}(); printf('%.3g ', v_.pressure(0.2));" for name in names
    )
    command = ["octave-cli", "--no-init-file", "--eval", program]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, len(done.stdout.split())) == (0, len(names)), done.stderr


@needs("gfortran")
@pytest.mark.usefixtures("quickly_made")
def test_fortran_reads_every_name_that_is_taken(tmp_path):
    names = accepted("fortran-law")
    assert not {"h_max", "dp", "c_pressure"} & set(names)
    for name in names:
        (tmp_path / f"of_{name}.f90").write_text(
            law_points.text("fortran-law", "mbma", name=name)
        )
    files = [f"of_{name}.f90" for name in names]
    done = subprocess.run(
        ["gfortran", "-c", *files], cwd=tmp_path, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")


@needs("gcc")
@pytest.mark.usefixtures("quickly_made")
def test_c_reads_every_name(tmp_path):
    names = accepted("c-law")
    assert names == POOL
    for name in names[::8]:
        (tmp_path / f"{name}.c").write_text(law_points.text("c-law", "mbma", name=name))
    command = ["gcc", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]
    done = subprocess.run(
        [*command, *os.listdir(tmp_path)], cwd=tmp_path, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow
@pytest.mark.usefixtures("quickly_made")
def test_modelica_reads_every_name_that_is_taken(tmp_path):
    rumoca = pytest.importorskip("rumoca")
    names = accepted("modelica-law")
    assert not {
        "end",
        "import",
        "model",
        "package",
        "Real",
        "time",
        "piece",
        "elastic",
    } & set(names)
    for name in names:
        ask = f"model Ask\n  Real p;\nequation\n  p = {name}.pressure(0.1 + 0.1*time);\nend Ask;\n"
        (tmp_path / "ask.mo").write_text(
            law_points.text("modelica-law", "mbma", name=name) + ask
        )
        model = rumoca.Session().load(str(tmp_path / "ask.mo"), model="Ask")
        assert float(model.simulate(t=(0, 1), dt=1)["p"][-1]) > 0


test_names_of_other_files = refusals(
    lambda write, name: write(name),
    *(
        (
            lambda name: fmu(ROAD, "13.3 MPa", name=name, theory="calibrated"),
            name,
            "Windows",
        )
        for name in ("con", "NUL", "lpt1")
    ),
    *(
        (
            lambda name: data.matlab_reader(rows(), name),
            name,
            f"name must not be '{name}', which matlab",
        )
        for name in ("end", "function", "interp1", "x", "rows")
    ),
)


@functools.cache
def rows():
    return describe_law(ROAD, "13.3 MPa", theory="calibrated", rows=5)


def test_messages_move_no_cursor():
    said = []
    for ask in (
        lambda: contact(ROAD, "13.3 MPa", pressure="1 \x1b[2Jkg"),
        lambda: Surface.from_map("no\x1b[31m\x07such\u202emap.csv"),
        lambda: ROAD.to("\x9b31m"),
    ):
        with pytest.raises(MbmaError) as caught:
            ask()
        said.append(str(caught.value))
    said += [
        repr(contact_law(ROAD, "13.3 MPa", Renamed())),
        repr(contact(ROAD, "13.3 MPa", pressure="1 kPa", theory=Renamed())),
        repr(rows()),
    ]
    for text in said:
        assert text.isprintable()
    assert r"\x1b[31m\x07such\u202emap" in said[1]


@pytest.mark.parametrize("form", [[], ["--csv"], ["--json"]])
def test_a_name_of_a_file_stays_on_its_line(form, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    name = "a\n1,2\x1b[31m\u202e.npy"
    np.save(name, np.random.default_rng(3).normal(size=(32, 32)).cumsum(0))
    asked = [
        "--map",
        name,
        "--dx",
        "1um",
        "--E-star",
        "10 GPa",
        "--length-unit",
        "um",
        "--theory",
        "calibrated",
    ]
    found = CliRunner().invoke(main, ["contact", *asked, "-p", "10 MPa", *form])
    assert found.exit_code == 0, found.output
    assert found.output.replace("\n", "").isprintable()
    assert not any(line.startswith("1,2") for line in found.output.splitlines())
    missing = CliRunner().invoke(
        main, ["contact", *asked[:1], "b\n\x1b[2J.npy", *asked[2:], "-p", "10 MPa"]
    )
    assert missing.exit_code == 2
    assert missing.output.replace("\n", "").isprintable()


def test_comments_of_data_stay_comments(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    name = "a\n1,2\x1b[31m.npy"
    np.save(name, np.random.default_rng(3).normal(size=(32, 32)).cumsum(0))
    asked = [
        "--map",
        name,
        "--dx",
        "1um",
        "--E-star",
        "10 GPa",
        "--length-unit",
        "um",
        "--theory",
        "calibrated",
    ]
    assert (
        CliRunner().invoke(main, ["export", "csv", *asked, "--out", "law.csv"]).exit_code
        == 0
    )
    lines = (tmp_path / "law.csv").read_text().splitlines()
    assert not any(line.startswith("1,2") for line in lines)
    assert all(line.isprintable() for line in lines)
