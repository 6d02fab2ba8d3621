"""The model as C: what is written and refused, answers as the runtime's under sanitizers; texts that never are code."""

import copy
import csv
import ctypes
import dataclasses
import io
import math
import pathlib
import re
import shutil
import subprocess
import sys

import code_points
import numpy as np
import pytest

import mbma_tables.core
from mbma_tables import InputError, Surface, __version__
from mbma_tables.export import c_code, conformance, data, solvers
from mbma_tables.export.c_code import SOURCES, check, read_report, write_code
from mbma_tables.export.law_rows import describe_law
from mbma_tables.export.text import checked_name
from mbma_tables.models.tables import universal_model
from mbma_tables.models.universal import UniversalModel
from mbma_tables.surfaces.variants import Variant, get_variant


def test_every_file_says_what_it_is(tmp_path):
    attributes = universal_model().content.attributes
    written = write_code(tmp_path / "code", variant="printed")
    assert sorted(written) == sorted((tmp_path / "code").iterdir())
    included = {name for path in written for name in re.findall(r'#include "(.*)"', path.read_text())}
    assert included | {*SOURCES, "mbma_conformance.csv"} == {path.name for path in written}
    largest = max(attributes["largest_error_F"], attributes["largest_error_A"])
    core = pathlib.Path(mbma_tables.core.__file__).parent
    of_all = (f"mbma_tables {__version__}", "force is per nominal area", "BSD-3-Clause", "Variant: printed")
    of_tables = ("-6.25 <= X <= 41", f"{largest:.2g} on", "zeta_1 in [3, 1e+05]", "of the table against the law")
    for path in written:
        if (core / path.name).is_file():
            assert path.read_bytes() == (core / path.name).read_bytes()
            continue
        text = path.read_text(encoding="utf-8")
        assert not re.search("@[A-Z_]+@", text)
        head = " ".join(word for word in text[:5000].split() if word not in ("*", "#"))
        assert attributes["values_sha256"] in head
        for fact in (path.name, *of_all, *of_tables) if path.suffix != ".csv" else ():
            assert fact in head, fact


@pytest.mark.skipif(shutil.which("cc") is None, reason="cc is not installed")
def test_a_wrong_number_is_seen(tmp_path):
    write_code(tmp_path)
    table = tmp_path / "mbma_data.c"
    text = table.read_text(encoding="utf-8")
    before, variant = text.split("mbma_variant MBMA_VARIANT")
    assert variant.count(", 0.05, ") == 1
    changed = variant.replace(", 0.05, ", ", 0.0500000001, ")
    table.write_text(f"{before}mbma_variant MBMA_VARIANT{changed}", encoding="utf-8")
    found = check(tmp_path)
    assert found.failed > 0
    assert 1e-11 < found.largest["geometry"] < 1e-7
    (tmp_path / "points.csv").write_text("phi,1e-11,1.0\n", encoding="utf-8")
    assert check(tmp_path, tmp_path / "points.csv").failed == 1
    (tmp_path / "totals.c").write_text("int broken\n", encoding="utf-8")
    with pytest.raises(InputError, match="did not compile"):
        check(tmp_path)


def test_check_names_what_is_missing(tmp_path, monkeypatch):
    with pytest.raises(InputError, match="does not exist"):
        check(tmp_path)
    write_code(tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match="cc is not installed"):
        check(tmp_path)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("code", "guessed"), "variant must be one of"),
        (("code", "fitted"), "takes their cover"),
        (("a_file",), "a_file"),
    ],
)
def test_bad_requests_leave_no_file(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a_file").write_text("kept", encoding="utf-8")
    with pytest.raises(InputError, match=message) as caught:
        write_code(*arguments)
    assert len(str(caught.value).splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["a_file"]
    assert (tmp_path / "a_file").read_text(encoding="utf-8") == "kept"


def test_points_of_a_variant_with_high_floors():
    each = len(conformance.DEPTHS)
    ratios = [surface[2] / surface[1] for surface in conformance.SURFACES]
    for floor in (3.0, 150.0, 500.0):
        text = conformance.points_text(universal_model(), Variant("high floors", floor_u=floor))
        count = sum(line.startswith("total,") for line in text.splitlines())
        assert count == each * sum(ratio > floor for ratio in ratios), floor


WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Werror")
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")


def needs(*programs):
    linux = sys.platform.startswith("linux")
    # elsewhere, gcc and nm may be other programs of those names
    missing = [name for name in programs if shutil.which(name) is None or not (linux or name == "cc")]
    return pytest.mark.skipif(bool(missing), reason=f"not installed: {', '.join(missing)}")


@pytest.fixture(scope="module")
def c_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("c")
    write_code(folder)
    return folder


def build_and_replay(commands, work, points):
    for command in (*commands, ["./selftest", str(points)]):
        done = subprocess.run(command, cwd=work, capture_output=True, text=True, timeout=300, check=False)
        assert done.stderr == ""
    return read_report(done.stdout)


def c_command(compiler, options, folder):
    return [compiler, *options, *WARNINGS, *(f"{folder}/{name}" for name in SOURCES), "-lm"]


@needs("cc")
def test_c_replays_its_points(c_folder):
    found = check(c_folder)
    assert found.failed == 0
    fixed = {"phi": 64, "geometry": 24, "status": 10}
    fixed |= dict.fromkeys(("total", "calibrated", "separation"), 12)
    assert found.points == fixed | {"formula": found.points["formula"]}
    assert found.points["formula"] > 5


@needs("gcc")
@pytest.mark.parametrize(
    "options", [("-O1", *SANITIZERS), ("-O3", "-march=native", "-ffp-contract=fast")], ids=["sanitized", "fast"]
)
def test_c_equals_the_runtime(options, c_folder, tmp_path):
    command = [*c_command("gcc", ("-std=c11", "-Wpedantic", *options), c_folder), "-o", "selftest"]
    found = build_and_replay([command], tmp_path, code_points.write_points(tmp_path))
    code_points.assert_equal_to_runtime(found)


@needs("g++")
def test_cpp_compiles_it(c_folder, tmp_path):
    command = [*c_command("g++", ("-x", "c++", "-std=c++11", "-O1"), c_folder), "-o", "selftest"]
    assert build_and_replay([command], tmp_path, c_folder / "mbma_conformance.csv").failed == 0


@pytest.mark.slow
@needs("cc")
def test_the_printed_variant(tmp_path):
    write_code(tmp_path, variant="printed")
    found = check(tmp_path, code_points.write_points(tmp_path, "printed"))
    code_points.assert_equal_to_runtime(found)
    assert check(tmp_path, code_points.write_points(tmp_path, "reported")).failed > code_points.SURFACES


@needs("gcc", "nm")
def test_nothing_is_allocated_or_kept(c_folder, tmp_path):
    sources = [str(c_folder / name) for name in SOURCES if name != "mbma_selftest.c"]
    # without tables of addresses that a loader would move
    subprocess.run(["gcc", "-std=c11", "-O0", "-fno-pie", "-c", *sources], cwd=tmp_path, check=True)
    objects = [path.name for path in tmp_path.glob("*.o")]
    listed = subprocess.run(["nm", *objects], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    kinds = [line.split()[-2:] for line in listed.splitlines() if len(line.split()) > 1]
    outside = {name for kind, name in kinds if kind == "U" and not name.startswith("mbma_")} - {"__stack_chk_fail"}
    mathematics = {"asinh", "cbrt", "copysign", "cos", "exp", "expm1", "fmax", "fmin", "log", "log1p", "pow", "sqrt"}
    assert outside <= {*mathematics, "memcpy", "memset"}
    assert not [name for kind, name in kinds if kind in "BbDdC"]


class CSurface(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double) for name in ("hurst", "q0", "q1", "h_rms", "h_max")]


@pytest.fixture(scope="module")
def library(c_folder, tmp_path_factory):
    if shutil.which("gcc") is None or not sys.platform.startswith("linux"):
        pytest.skip("not installed: gcc")
    target = tmp_path_factory.mktemp("library") / "model.so"
    options = ("-std=c11", "-O2", "-shared", "-fPIC")
    sources = [str(c_folder / name) for name in SOURCES if name != "mbma_selftest.c"]
    subprocess.run(["gcc", *options, *sources, "-lm", "-o", str(target)], check=True)
    found = ctypes.CDLL(str(target))
    found.mbma_message.restype = ctypes.c_char_p
    return found


def totals(library, surface, gaps, E_star=1.0, rtol=1e-8):
    answers, status = np.empty((gaps.size, 4)), np.empty(gaps.size, dtype=np.int32)
    asked, found, told = (ctypes.c_void_p(array.ctypes.data) for array in (gaps, answers, status))
    numbers = ctypes.c_double(E_star), ctypes.c_double(rtol)
    given = ctypes.byref(CSurface(*surface)), ctypes.c_size_t(gaps.size), asked
    library.mbma_totals_of(*given, *numbers, found, told)
    return answers, status


SOUND = (0.8, 1.0, 100.0, 1.0, 3.0)
INVALID = b"an argument is not finite, or is outside what the model allows"


def test_no_answer_has_a_status_and_nan(library):
    good = (*SOUND, 1.0, 1.0, 1e-8)  # and gap, E*, rtol
    nan, inf = math.nan, math.inf
    wrong = [(0, nan), (0, 1.1), (1, 0.0), (2, 3.0), (2, 1e9), (4, inf), (5, nan), (5, inf), (5, -3.1), (6, -1.0)]
    cases = [((*good[:k], value, *good[k + 1 :]), INVALID) for k, value in (*wrong, (7, 0.0), (7, nan))]
    cases.append(((0.5, 1.0, 1e6, 1.0, 30.0, -30.0, 1.0, 1e-8), b"X is above the range"))
    cases.append(((0.1, 1.0, 1e7, 1.0, 3.0, -3.0, 1.0, 1e-8), b"mu is above the range"))
    for (*surface, gap, E_star, rtol), message in cases:
        answers, status = totals(library, surface, np.array([gap]), E_star, rtol)
        assert library.mbma_message(int(status[0])) == message
        assert np.isnan(answers).all()


def test_no_contact_from_h_max_on(library):
    answers, status = totals(library, SOUND, np.array([3.0, 3.5]))
    assert not status.any()
    assert not answers.any()


HOSTILE = (
    "x */ int evil(void); /* \n*INCLUDE, INPUT=evil\r\nsystem('evil') ??/\u2028evil()\x0cevil\x85"
    "@CLOSED_FORMS@ </script><script>evil()//\x00\\"
)
COMMENT_MARKS = {"calculix": "**", "abaqus": "**", "lsdyna": "$", "optistruct": "$", "comsol": "%", "moose": "#"} | {
    "modelica": "#"
}


@pytest.fixture(scope="module")
def law():
    return describe_law(Surface.named("concrete"), 13.3, length_unit="mm", stress_unit="MPa", rows=5)


def hostile_law(law):
    return dataclasses.replace(law, comments=(HOSTILE, *law.comments[1:], HOSTILE), x_unit=HOSTILE, y_unit=HOSTILE)


def test_source_code():
    content = copy.copy(universal_model().content)
    # a certificate's numbers are numbers in any case; the rest is text of the file
    texts = {name: HOSTILE for name, value in content.attributes.items() if isinstance(value, str)}
    attributes = content.attributes | texts | {"certificate_points": HOSTILE}
    model = UniversalModel(dataclasses.replace(content, attributes=attributes))
    variant = dataclasses.replace(get_variant("reported"), name=HOSTILE)

    def live(texts):
        return [
            line
            for text in texts.values()
            for line in re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL).splitlines()
            if line.strip()
        ]

    found = c_code.source_texts(model, variant)
    assert any("int evil" in text for text in found.values())
    assert live(found) == live(c_code.source_texts(universal_model(), get_variant("reported")))
    assert all(text.isascii() for text in found.values())
    points, plain = (
        [line for line in conformance.points_text(*of).splitlines() if not line.startswith("#")]
        for of in ((model, variant), (universal_model(), get_variant("reported")))
    )
    assert points == plain


@pytest.mark.parametrize("target", COMMENT_MARKS)
def test_solver_decks(target, law):
    def live(text):
        return [line for line in text.splitlines() if not line.startswith(COMMENT_MARKS[target])]

    write = getattr(solvers, target)
    assert live(write(hostile_law(law))) == live(write(law))


@pytest.mark.parametrize("name", ["A\n*INCLUDE, INPUT=evil", "A, B", "", "1", "x'); system('evil", "é", "A" * 81, 3])
def test_names_of_cards_and_functions(name, law):
    writers = (solvers.calculix, solvers.abaqus, solvers.modelica, data.matlab_reader)
    for write in writers:
        with pytest.raises(InputError, match="a name must be a letter"):
            write(law, name)
    assert checked_name("Rough_2", 7) == "Rough_2"


def test_matlab_reader(law):
    lines = data.matlab_reader(hostile_law(law), "law").decode().splitlines()
    changed = dataclasses.replace(law, comments=(law.comments[0], HOSTILE))
    hostile = data.matlab_reader(changed, "law").decode().splitlines()
    assert [line for line in hostile if not line.startswith("%")] == [line for line in lines if line[0] != "%"]


@pytest.mark.parametrize("unit", ["mW/(mm, K)", 'a "quoted" unit', "=HYPERLINK(evil)", "µm"])
def test_csv_cells(unit, law):
    changed = dataclasses.replace(law, y_unit=unit, comments=(*law.comments, f"in {unit}\n=HYPERLINK(evil)"))
    lines = data.to_csv(changed).decode().splitlines()
    head = len(changed.comments)
    assert all(line.startswith("# ") for line in lines[:head])
    cells = list(csv.reader(io.StringIO("\n".join(lines[head:]))))
    assert cells[0] == ["overclosure [mm]", f"pressure [{unit}]"]
    assert [[float(cell) for cell in row] for row in cells[1:]] == [list(row) for row in zip(law.x, law.y, strict=True)]


@pytest.mark.parametrize("name", ["=1+1", "+1", "-1", "@SUM", "\tx"])
def test_csv_cells_are_no_formulas(name, law):
    last = data.to_csv(dataclasses.replace(law, x_name=name)).decode().splitlines()[len(law.comments)]
    assert next(csv.reader([last]))[0] == f"'{name} [mm]"


@pytest.mark.parametrize("unit", ["W\n*INCLUDE, INPUT=evil", "W\u2028"])
@pytest.mark.parametrize("which", ["length_unit", "stress_unit", "conductivity_unit"])
def test_units_are_printable(which, unit):
    units = {"length_unit": "mm", "stress_unit": "MPa", "conductivity_unit": "mW/K"} | {which: unit}
    with pytest.raises(InputError, match=r"is no known unit|is not printable"):
        describe_law(Surface.named("concrete"), 13.3, quantity="conductance", conductivity=1.0, rows=5, **units)
