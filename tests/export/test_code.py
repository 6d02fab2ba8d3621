"""The model as C: what is written and refused, answers as the runtime's under sanitizers; texts that never are code."""

import copy
import csv
import ctypes
import dataclasses
import functools
import io
import math
import pathlib
import re
import subprocess

import numpy as np
import pytest
from law_points import needs

import mbma_tables.core
from mbma_tables import InputError, Surface, __version__
from mbma_tables.export.model import c_code, conformance
from mbma_tables.export.model.c_code import (
    PACKAGE,
    SELFTEST,
    SOURCES,
    check,
    read_report,
    write_code,
)
from mbma_tables.export.rows import data
from mbma_tables.export.rows.law_rows import describe_law
from mbma_tables.export.text import checked_name
from mbma_tables.islands.variants import Variant, get_variant
from mbma_tables.tables.open import universal_model
from mbma_tables.tables.universal import UniversalModel
from mbma_tables.theories.mbma.closed_form_certificates import RANGES

POINTS = 10_000
SURFACES = 60
SHARES = (1e-4, 0.01, 0.2, 0.5, 0.9, 0.99)  # u/h_max
DEPTHS = (1.9, 0.9, 0.4, 0.03)  # (h_max - d)/h_max
TOLERANCES = {"phi": 1e-13, "geometry": 1e-13, "total": 1e-13, "formula": 1e-13}
TOLERANCES |= {"calibrated": 1e-12, "separation": 1e-12}  # whose logarithm is the table's
TOLERANCES |= {
    "joint": 1e-11,
    "joint_separation": 1e-11,
    "unloaded": 1e-11,
    "unloaded_separation": 1e-11,
}  # two of them one after the other
MODEL = [name for name in SOURCES if name != SELFTEST]
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Werror")
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")


def random_islands():
    """X and mu over the table, then over the closed form's range, with the ends of both."""
    rng = np.random.default_rng(2008)
    found = []
    (X, mu), form = universal_model().content.axes, RANGES[conformance.FORM]
    for low, high, least, most in (
        (X.low, X.high, 1e-10, mu.high),
        (*form["X"], 1e-6, form["mu"][1]),
    ):
        found.append(
            rng.uniform(
                [[low], [np.log(least)]], [[high], [np.log(most)]], (2, POINTS // 2)
            )
        )
        found[-1][1] = np.exp(found[-1][1])
        found[-1][:, :4] = (low, low, high, high), (least, most) * 2
    return np.concatenate(found, axis=1)


@functools.cache
def many_points(variant="reported"):
    """A points' file; some surfaces have hurst = 1, where powers vanish, and some the calibrated table lacks."""
    model = universal_model()
    rng = np.random.default_rng(48)
    islands = random_islands()
    lines = [
        *conformance.rows("phi", islands, model.answer(*islands)),
        *conformance.formula_rows(*islands),
    ]
    for hurst in [*np.ones(3), *rng.uniform(0.1, 1.0, SURFACES - 3)]:
        (q0, h_rms), zeta_1 = (
            np.exp(rng.uniform(-8.0, 8.0, 2)),
            np.exp(rng.uniform(np.log(4.0), np.log(1e6))),
        )
        surface = tuple(
            map(float, (hurst, q0, q0 * zeta_1, h_rms, h_rms * rng.uniform(2.0, 6.0)))
        )
        approach = np.exp(
            rng.uniform(np.log(1e-9), np.log(12.0), POINTS // 10 // SURFACES)
        )
        shares = SHARES if zeta_1 < 9.9e4 else ()
        nu, conductivity = rng.uniform(-0.9, 0.5), rng.uniform(0.1, 400.0)
        bodies = ((np.exp(rng.uniform(-5.0, 1.5)), nu, conductivity),)
        lines += conformance.surface_rows(
            surface, get_variant(variant), approach, DEPTHS, shares, 7.5, bodies=bodies
        )
    return "\n".join(lines) + "\n"


def replayed(folder, work, command=None, points=""):
    """The self-test of a folder: its own points, or others; by `check`, or compiled by a command without a warning."""
    path = work / "points.csv" if points else folder / "mbma_conformance.csv"
    if points:
        path.write_text(points, encoding="utf-8")
    if command is None:
        return check(folder, path)
    sources = [f"{folder}/{name}" for name in SOURCES]
    for words in (
        [*command, *WARNINGS, *sources, "-lm", "-o", "selftest"],
        ["./selftest", str(path)],
    ):
        done = subprocess.run(
            words, cwd=work, capture_output=True, text=True, timeout=300, check=False
        )
        assert done.stderr == ""
    return read_report(done.stdout)


def assert_equal_to_runtime(replay):
    assert replay.failed == 0
    lines = many_points().splitlines()
    asked = {
        kind: sum(line.startswith(f"{kind},") for line in lines) for kind in TOLERANCES
    }
    assert {kind: n for kind, n in replay.points.items() if n} == asked
    assert asked["formula"] > POINTS // 2
    assert asked["total"] == 4 * SURFACES
    assert asked["calibrated"] == asked["joint"] > 5 * SURFACES // 2
    for kind, most in TOLERANCES.items():
        assert replay.largest[kind] <= most, (kind, replay.largest[kind])


@pytest.fixture(scope="module")
def c_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("c")
    write_code(folder)
    return folder


def test_every_file_says_what_it_is(tmp_path):
    attributes = universal_model().content.attributes
    written = write_code(tmp_path / "code", variant="printed")
    assert sorted(written) == sorted((tmp_path / "code").iterdir())
    included = {
        name
        for path in written
        for name in re.findall(r'#include "(.*)"', path.read_text())
    }
    assert included | {*SOURCES, *PACKAGE, "mbma_conformance.csv"} == {
        path.name for path in written
    }
    largest = max(attributes["largest_error_F"], attributes["largest_error_A"])
    core = pathlib.Path(mbma_tables.core.__file__).parent
    facts = (
        f"mbma_tables {__version__}",
        "force is per nominal area",
        "BSD-3-Clause",
        "Variant: printed",
    )
    facts += (
        "-6.25 <= X <= 41.0",
        f"{largest:.2g} on",
        "zeta_1 in [3.0, 100000.0]",
        "of the table against the law",
    )
    for path in written:
        text = path.read_text(encoding="utf-8")
        if (core / path.name).is_file():
            assert text == (core / path.name).read_text(encoding="utf-8")
            continue
        # names between @ are filled in by CMake
        assert path.suffix == ".in" or not re.search("@[A-Z_]+@", text)
        head = " ".join(
            word for word in text[:5000].split() if word not in ("*", "#", "!", "//")
        )
        assert attributes["values_sha256"] in head
        for fact in (path.name, *facts) if path.suffix != ".csv" else ():
            assert fact in head, fact


@needs("cc")
def test_a_wrong_number_is_seen(tmp_path, monkeypatch):
    with pytest.raises(InputError, match="does not exist"):
        check(tmp_path)
    write_code(tmp_path)
    table = tmp_path / "mbma_data.c"
    before, variant = table.read_text(encoding="utf-8").split("mbma_variant MBMA_VARIANT")
    assert variant.count(", 0.05, ") == 1
    changed = variant.replace(", 0.05, ", ", 0.0500000001, ")
    table.write_text(f"{before}mbma_variant MBMA_VARIANT{changed}", encoding="utf-8")
    found = check(tmp_path)
    assert found.failed > 0
    assert 1e-11 < found.largest["geometry"] < 1e-7
    assert replayed(tmp_path, tmp_path, points="phi,1e-11,1.0\n").failed == 1
    (tmp_path / "totals.c").write_text("int broken\n", encoding="utf-8")
    with pytest.raises(InputError, match="did not compile"):
        check(tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match="cc is not installed"):
        check(tmp_path)


def test_bad_requests_leave_no_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a_file").write_text("kept", encoding="utf-8")
    cases = (
        ("code", "guessed", "must be one of"),
        ("code", "fitted", "takes their cover"),
        ("a_file", "a_file"),
    )
    for *arguments, message in cases:
        with pytest.raises(InputError, match=message) as caught:
            write_code(*arguments)
        assert len(str(caught.value).splitlines()) == 1
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [
        ("a_file", "kept")
    ]


def test_points_of_a_variant_with_high_floors():
    ratios = [surface[2] / surface[1] for surface in conformance.SURFACES]
    for floor in (3.0, 150.0, 500.0):
        text = conformance.points_text(
            universal_model(), Variant("high floors", floor_u=floor)
        )
        count = sum(line.startswith("total,") for line in text.splitlines())
        assert count == len(conformance.DEPTHS) * sum(
            ratio > floor for ratio in ratios
        ), floor


@needs("cc")
def test_c_replays_its_points(c_folder, tmp_path):
    found = replayed(c_folder, tmp_path)
    assert found.failed == 0
    fixed = {"phi": 64, "geometry": 24, "status": 10}
    fixed |= dict.fromkeys(("total", "calibrated", "separation"), 12)
    fixed |= dict.fromkeys(("joint", "joint_separation"), 36)
    fixed |= {"unloaded": 54, "unloaded_separation": 45}
    assert found.points == fixed | {"formula": found.points["formula"]}
    assert found.points["formula"] > 5


@needs("gcc", "g++")
@pytest.mark.parametrize(
    "command",
    [
        ("gcc", "-std=c11", "-Wpedantic", "-O1", *SANITIZERS),
        ("gcc", "-std=c11", "-Wpedantic", "-O3", "-march=native", "-ffp-contract=fast"),
        ("g++", "-x", "c++", "-std=c++11", "-O1"),
    ],
    ids=["sanitized", "fast", "c++"],
)
def test_c_equals_the_runtime(command, c_folder, tmp_path):
    assert_equal_to_runtime(replayed(c_folder, tmp_path, command, many_points()))


@pytest.mark.slow
@needs("cc")
def test_the_printed_variant(tmp_path):
    write_code(tmp_path, variant="printed")
    assert_equal_to_runtime(replayed(tmp_path, tmp_path, points=many_points("printed")))
    assert replayed(tmp_path, tmp_path, points=many_points()).failed > SURFACES


@needs("gcc", "nm")
def test_nothing_is_allocated_or_kept(c_folder, tmp_path):
    # without tables of addresses that a loader would move
    command = [
        "gcc",
        "-std=c11",
        "-O0",
        "-fno-pie",
        "-c",
        *(str(c_folder / name) for name in MODEL),
    ]
    subprocess.run(command, cwd=tmp_path, check=True)
    objects = [path.name for path in tmp_path.glob("*.o")]
    listed = subprocess.run(
        ["nm", *objects], cwd=tmp_path, capture_output=True, text=True, check=True
    ).stdout
    kinds = [line.split()[-2:] for line in listed.splitlines() if len(line.split()) > 1]
    outside = {
        name for kind, name in kinds if kind == "U" and not name.startswith("mbma_")
    } - {"__stack_chk_fail"}
    mathematics = {
        "asinh",
        "cbrt",
        "copysign",
        "cos",
        "erf",
        "erfc",
        "exp",
        "expm1",
        "fmax",
        "fmin",
        "log",
        "log1p",
        "pow",
        "sin",
        "sqrt",
    }
    assert outside <= {*mathematics, "memcpy", "memset"}
    assert not [name for kind, name in kinds if kind in "BbDdC"]


@needs("gcc")
def test_no_answer_has_a_status_and_nan(c_folder, tmp_path):
    sources = [str(c_folder / name) for name in MODEL]
    command = [
        "gcc",
        "-std=c11",
        "-O2",
        "-shared",
        "-fPIC",
        *sources,
        "-lm",
        "-o",
        str(tmp_path / "model.so"),
    ]
    subprocess.run(command, check=True)
    library = ctypes.CDLL(str(tmp_path / "model.so"))
    library.mbma_message.restype = ctypes.c_char_p

    def total(*numbers):
        """Answers and the meaning of the status, of a surface's numbers, gap, E* and rtol."""
        surface, (gap, *more), answers = (
            np.array(numbers[:5]),
            map(ctypes.c_double, numbers[5:]),
            np.empty(4),
        )
        at, written = (ctypes.c_void_p(array.ctypes.data) for array in (surface, answers))
        return answers, library.mbma_message(
            library.mbma_total_of(at, gap, *more, written)
        )

    good = (0.8, 1.0, 100.0, 1.0, 3.0, 1.0, 1.0, 1e-8)
    nan = math.nan
    inf = math.inf
    wrong = [
        (0, nan),
        (0, 1.1),
        (1, 0.0),
        (2, 3.0),
        (2, 1e9),
        (4, inf),
        (5, nan),
        (5, inf),
        (5, -3.1),
        (6, -1.0),
    ]
    invalid = b"an argument is not finite, or is outside what the model allows"
    cases = [
        ((*good[:k], value, *good[k + 1 :]), invalid)
        for k, value in (*wrong, (7, 0.0), (7, nan))
    ]
    cases.append(((0.5, 1.0, 1e6, 1.0, 30.0, -30.0, 1.0, 1e-8), b"X is above the range"))
    cases.append(((0.1, 1.0, 1e7, 1.0, 3.0, -3.0, 1.0, 1e-8), b"mu is above the range"))
    for numbers, message in cases:
        answers, said = total(*numbers)
        assert said == message
        assert np.isnan(answers).all()

    def joint(function, count, *numbers):
        """Answers and the meaning of the status, of a surface's numbers, bodies and a gap or a force."""
        surface, bodies, answers = (
            np.array(numbers[:5]),
            np.array(numbers[5:9]),
            np.empty(count),
        )
        places = [ctypes.c_void_p(array.ctypes.data) for array in (surface, bodies)]
        written = ctypes.c_void_p(answers.ctypes.data)
        status = function(*places, ctypes.c_double(numbers[9]), written)
        return answers, library.mbma_message(status)

    steel = (0.8, 1.0, 100.0, 1.0, 3.0, 1.0, 0.2, 0.3, 45.0)
    at_gap = functools.partial(joint, library.mbma_joint_of, len(conformance.JOINT))
    at_force = functools.partial(joint, library.mbma_joint_separation_of, 1)
    for function, value in ((at_gap, 0.0), (at_gap, nan), (at_force, -1.0)):
        answers, said = function(*steel, value)
        assert said == invalid
        assert np.isnan(answers).all()
    for hardness in (0.0, -1.0, nan):
        answers, said = at_gap(*steel[:6], hardness, *steel[7:], 1.0)
        assert said == invalid
        assert np.isnan(answers).all()
    # no force reaches the hardness
    answers, said = at_force(*steel, 0.2)
    assert said == b"the table of the theory does not hold such a surface"
    assert np.isnan(answers).all()
    # contacts after a largest force, which is below the hardness; twenty-one numbers
    at_peak = functools.partial(joint, library.mbma_peak_of, 21)
    table = b"the table of the theory does not hold such a surface"
    for largest, message in ((0.2, table), (0.0, invalid), (nan, invalid)):
        answers, said = at_peak(*steel, largest)
        assert said == message
        assert np.isnan(answers).all()
    peak, said = at_peak(*steel, 0.05)
    assert (np.isfinite(peak).all(), said) == (True, b"no error")

    def after(function, count, number, peak=peak):
        """Answers and the meaning of the status of a contact after the largest force."""
        answers, given = np.empty(count), (np.array(steel[:5]), np.array(steel[5:]), peak)
        places = [ctypes.c_void_p(array.ctypes.data) for array in given]
        written = ctypes.c_void_p(answers.ctypes.data)
        status = function(*places, ctypes.c_double(number), written)
        return answers, library.mbma_message(status)

    for number in (0.0, nan, inf):
        answers, said = after(library.mbma_unloaded_of, len(conformance.JOINT), number)
        assert said == invalid
        assert np.isnan(answers).all()
    for number, given in ((-1.0, peak), (nan, peak), (0.01, np.full(21, nan))):
        answers, said = after(library.mbma_unloaded_separation_of, 1, number, given)
        assert said == invalid
        assert np.isnan(answers).all()
    answers, said = after(library.mbma_unloaded_separation_of, 1, 0.2)
    assert (np.isnan(answers).all(), said) == (True, table)
    # what is not known is NaN alone
    answers, said = at_gap(*steel[:7], nan, nan, 1.0)
    missing = [
        name for name, one in zip(conformance.JOINT, answers, strict=True) if one != one
    ]
    assert (missing, said) == (["tangential_stiffness", "solid_conductance"], b"no error")
    assert at_force(*steel, 0.0)[0].tolist() == [3.0]
    for gap in (3.0, 3.5):  # no contact from h_max on
        answers, said = total(*good[:5], gap, *good[6:])
        assert (answers.tolist(), said) == ([0.0] * 4, b"no error")


HOSTILE = (
    "x */ int evil(void); /* \n*INCLUDE, INPUT=evil\r\nsystem('evil') ??/\u2028evil()\x0cevil\x85"
    "@CLOSED_FORMS@ </script><script>evil()//\x00\\"
)


@pytest.fixture(scope="module")
def law():
    return describe_law(
        Surface.named("concrete"), 13.3, length_unit="mm", stress_unit="MPa", rows=5
    )


def test_source_code():
    content = copy.copy(universal_model().content)
    # a certificate's numbers are numbers in any case; the rest is text of the file
    texts = {
        name: HOSTILE
        for name, value in content.attributes.items()
        if isinstance(value, str)
    }
    attributes = content.attributes | texts | {"certificate_points": HOSTILE}
    model = UniversalModel(dataclasses.replace(content, attributes=attributes))
    hostile = model, dataclasses.replace(get_variant("reported"), name=HOSTILE)
    plain = universal_model(), get_variant("reported")

    def live(of):
        text = "\n".join(c_code.source_texts(*of).values())
        assert text.isascii()
        assert ("int evil" in text) == (of is hostile)
        code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL).splitlines()
        points = [
            line
            for line in conformance.points_text(*of).splitlines()
            if not line.startswith("#")
        ]
        return [line for line in code if line.strip()] + points

    assert live(hostile) == live(plain)


def test_a_function_of_matlab_has_no_text_of_a_user_as_code(law):
    def write(one):
        return data.matlab_reader(one, "law").decode()

    words = {
        "comments": (HOSTILE, HOSTILE, *law.comments[2:], HOSTILE),
        "x_unit": HOSTILE,
        "y_unit": HOSTILE,
    }
    live = [
        [line for line in write(one).splitlines() if not line.startswith("%")]
        for one in (law, dataclasses.replace(law, **words))
    ]
    assert live[0] == live[1]


@pytest.mark.parametrize(
    "name",
    ["A\n*INCLUDE, INPUT=evil", "A, B", "", "1", "x'); system('evil", "é", "A" * 81, 3],
)
def test_names_of_cards_and_functions(name, law):
    with pytest.raises(InputError, match="a name must be a letter"):
        data.matlab_reader(law, name)
    assert checked_name("Rough_2", 7) == "Rough_2"


@pytest.mark.parametrize(
    "unit", ["mW/(mm, K)", 'a "quoted" unit', "=HYPERLINK(evil)", "µm"]
)
@pytest.mark.parametrize("name", ["=1+1", "+1", "-1", "@SUM", "\tx"])
def test_csv_cells(name, unit, law):
    changed = dataclasses.replace(
        law,
        x_name=name,
        y_unit=unit,
        comments=(*law.comments, f"in {unit}\n=HYPERLINK(evil)"),
    )
    lines = data.to_csv(changed).decode().splitlines()
    head = len(changed.comments)
    assert all(line.startswith("# ") for line in lines[:head])
    cells = list(csv.reader(io.StringIO("\n".join(lines[head:]))))
    assert cells[0] == [f"'{name} [mm]", f"pressure [{unit}]"]
    assert [[float(cell) for cell in row] for row in cells[1:]] == [
        list(row) for row in zip(law.x, law.y, strict=True)
    ]


@pytest.mark.parametrize("unit", ["W\n*INCLUDE, INPUT=evil", "W\u2028"])
@pytest.mark.parametrize("which", ["length_unit", "stress_unit", "conductivity_unit"])
def test_units_are_printable(which, unit):
    units = {"length_unit": "mm", "stress_unit": "MPa", "conductivity_unit": "mW/K"} | {
        which: unit
    }
    with pytest.raises(InputError, match=r"is no known unit|is not printable"):
        describe_law(
            Surface.named("concrete"),
            13.3,
            quantity="solid_conductance",
            conductivity=1.0,
            rows=5,
            **units,
        )
