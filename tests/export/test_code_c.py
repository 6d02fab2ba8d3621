"""Exported C: warnings are errors, sanitizers are on, and it answers as the runtime does; C++ compiles it too."""

from __future__ import annotations

import concurrent.futures
import ctypes
import math
import pathlib
import shutil
import subprocess

import code_points
import numpy as np
import pytest

from mbma_tables.export.code import write_code
from mbma_tables.export.conformance import Replay, check, read_report

WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Werror")
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    folder = tmp_path_factory.mktemp("c")
    write_code("c", folder)
    return folder


def build(compiler: str, options: tuple[str, ...], sources: pathlib.Path, target: pathlib.Path) -> pathlib.Path:
    files = [str(sources / name) for name in ("mbma.c", "mbma_selftest.c")]
    command = [compiler, *options, *files, "-lm", "-o", str(target)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr[:2000]
    return target


def replay(program: pathlib.Path, points: pathlib.Path) -> Replay:
    done = subprocess.run([str(program), str(points)], capture_output=True, text=True, timeout=120, check=False)
    assert done.stderr == ""
    return read_report("c", "gcc", done)


@pytest.mark.parametrize(
    "options",
    [("-O1", *SANITIZERS), ("-O3", "-march=native", "-ffp-contract=fast")],
    ids=["sanitized", "fast"],
)
def test_equal_to_the_runtime(options: tuple[str, ...], sources: pathlib.Path, tmp_path: pathlib.Path) -> None:
    program = build("gcc", ("-std=c99", *WARNINGS, *options), sources, tmp_path / "selftest")
    code_points.assert_equal_to_runtime(replay(program, code_points.write_points(tmp_path)))


@pytest.mark.skipif(shutil.which("g++") is None, reason="g++ is not installed")
def test_cpp_compiles_it(sources: pathlib.Path, tmp_path: pathlib.Path) -> None:
    program = build("g++", ("-x", "c++", "-std=c++11", "-O1", *WARNINGS), sources, tmp_path / "selftest")
    found = replay(program, sources / "mbma_conformance.csv")
    assert found.failed == 0
    assert found.points["phi"] == 64


def test_the_printed_reading(tmp_path: pathlib.Path) -> None:
    write_code("c", tmp_path, reading="printed")
    found = check("c", tmp_path, code_points.write_points(tmp_path, "printed"))
    code_points.assert_equal_to_runtime(found)
    # and the points of one reading are refused by the code of another
    assert check("c", tmp_path, code_points.write_points(tmp_path, "reported")).failed > code_points.SURFACES


@pytest.mark.skipif(shutil.which("nm") is None, reason="nm is not installed")
def test_nothing_is_allocated_or_kept(sources: pathlib.Path, tmp_path: pathlib.Path) -> None:
    target = tmp_path / "mbma.o"
    subprocess.run(["gcc", "-std=c99", "-O0", "-c", str(sources / "mbma.c"), "-o", str(target)], check=True)
    symbols = subprocess.run(["nm", str(target)], capture_output=True, text=True, check=True).stdout.split("\n")
    kinds = {line.split()[-2:][1]: line.split()[-2] for line in symbols if line}
    outside = {name for name, kind in kinds.items() if kind == "U"} - {"_GLOBAL_OFFSET_TABLE_", "__stack_chk_fail"}
    # C's own mathematics and block copies
    assert outside <= {
        *("asinh", "cbrt", "exp", "expm1", "log", "log1p", "nan", "pow", "sinh", "sqrt", "memcpy", "memset"),
    }
    assert not [name for name, kind in kinds.items() if kind in "BbDdC"]


class Surface(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double) for name in ("hurst", "q0", "q1", "h_rms", "h_max")]


@pytest.fixture(scope="module")
def library(sources: pathlib.Path, tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    target = tmp_path_factory.mktemp("library") / "mbma.so"
    options = ("-std=c99", "-O2", "-shared", "-fPIC")
    subprocess.run(["gcc", *options, str(sources / "mbma.c"), "-lm", "-o", str(target)], check=True)
    found = ctypes.CDLL(str(target))
    found.mbma_message.restype = ctypes.c_char_p
    return found


def totals(library: ctypes.CDLL, surface: tuple[float, ...], gaps: np.ndarray, E_star: float, rtol: float) -> tuple:
    answers, status = np.empty((gaps.size, 3)), np.empty(gaps.size, dtype=np.int32)
    library.mbma_total_many(
        ctypes.byref(Surface(*surface)),
        ctypes.c_size_t(gaps.size),
        gaps.ctypes.data_as(ctypes.c_void_p),
        ctypes.c_double(E_star),
        ctypes.c_double(rtol),
        answers.ctypes.data_as(ctypes.c_void_p),
        status.ctypes.data_as(ctypes.c_void_p),
    )
    return answers, status


SOUND = (0.8, 1.0, 100.0, 1.0, 3.0)


@pytest.mark.parametrize(
    ("surface", "gap", "E_star", "rtol"),
    [
        ((math.nan, *SOUND[1:]), 1.0, 1.0, 1e-8),
        ((1.1, *SOUND[1:]), 1.0, 1.0, 1e-8),
        ((0.8, 0.0, *SOUND[2:]), 1.0, 1.0, 1e-8),
        ((0.8, 1.0, 3.0, 1.0, 3.0), 1.0, 1.0, 1e-8),
        ((0.8, 1.0, 1e9, 1.0, 3.0), 1.0, 1.0, 1e-8),
        ((*SOUND[:4], math.inf), 1.0, 1.0, 1e-8),
        (SOUND, math.nan, 1.0, 1e-8),
        (SOUND, math.inf, 1.0, 1e-8),
        (SOUND, -3.1, 1.0, 1e-8),
        (SOUND, 1.0, -1.0, 1e-8),
        (SOUND, 1.0, 1.0, 0.0),
        (SOUND, 1.0, 1.0, math.nan),
    ],
)
def test_bad_arguments_have_a_status_and_nan(
    library: ctypes.CDLL, surface: tuple[float, ...], gap: float, E_star: float, rtol: float
) -> None:
    answers, status = totals(library, surface, np.array([gap]), E_star, rtol)
    assert library.mbma_message(int(status[0])) == b"an argument is not finite, or is outside what the model allows"
    assert np.isnan(answers).all()


def test_no_contact_from_h_max_on(library: ctypes.CDLL) -> None:
    answers, status = totals(library, SOUND, np.array([3.0, 3.5]), 1.0, 1e-8)
    assert not status.any()
    assert not answers.any()


@pytest.mark.parametrize(
    ("surface", "message"),
    [
        ((0.5, 1.0, 1e6, 1.0, 30.0), b"X lies above the table"),
        ((0.1, 1.0, 1e7, 1.0, 3.0), b"mu lies above the table"),
    ],
)
def test_an_island_outside_the_table_is_told(surface: tuple[float, ...], message: bytes, library: ctypes.CDLL) -> None:
    answers, status = totals(library, surface, np.array([-surface[4]]), 1.0, 1e-8)
    assert library.mbma_message(int(status[0])) == message
    assert np.isnan(answers).all()


def test_threads_answer_as_one_does(library: ctypes.CDLL) -> None:
    surfaces = code_points.random_surfaces()[:16]

    def answer(surface: tuple[float, ...]) -> np.ndarray:
        return totals(library, surface, surface[4] * np.linspace(-0.9, 0.9, 50), 1.0, 1e-8)[0]

    alone = [answer(surface) for surface in surfaces]
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        together = list(pool.map(answer, surfaces))
    assert np.array_equal(alone, together)
