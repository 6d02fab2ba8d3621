"""Laws as source code: equal to the library's law in each language, down to first contact."""

from __future__ import annotations

import ctypes
import math
import pathlib
import subprocess
from collections.abc import Callable

import law_points
import numpy as np
import pytest
from law_points import ASKED, CONDUCTIVITY, needs, points

WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wconversion", "-Wshadow")
HEAT = {"conductivity": CONDUCTIVITY, "conductivity_unit": "mW/(mm K)"}


def run(*command: str, folder: pathlib.Path, **options: object) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False, **options)
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    return done.stdout


def c_function(library: ctypes.CDLL, name: str) -> Callable[[object], np.ndarray]:
    function = library[f"road_{name}"]
    function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double]

    def answer(given: object) -> np.ndarray:
        with np.errstate(invalid="ignore"):
            return np.vectorize(function, otypes=[float])(given)

    return answer


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ctypes.CDLL]:
    folder, found = tmp_path_factory.mktemp("laws"), {}
    for name in ASKED:
        heat = {} if name == "hardened" else HEAT
        (folder / f"{name}.c").write_text(law_points.text("c-law", name, name="road", **heat))
        strict = ("-std=c99", "-O2", "-Wmissing-prototypes", "-Wstrict-prototypes", *WARNINGS)
        run("gcc", *strict, "-shared", "-fPIC", f"{name}.c", "-lm", "-o", f"{name}.so", folder=folder)
        found[name] = ctypes.CDLL(str(folder / f"{name}.so"))
    return found


@needs("gcc")
@pytest.mark.parametrize("name", ASKED)
def test_c(name: str, compiled: dict[str, ctypes.CDLL]) -> None:
    known, library = points(name), compiled[name]
    found = [c_function(library, quantity)(known.c) for quantity in ("pressure", "tangent", "area", "energy")]
    known.assert_equal(*found)
    known.assert_inverse(c_function(library, "overclosure")(known.pressures()))
    both = library.road_with_tangent
    both.restype, both.argtypes = ctypes.c_double, [ctypes.c_double, ctypes.POINTER(ctypes.c_double)]
    slope = ctypes.c_double()
    assert (both(float(known.c[0]), ctypes.byref(slope)), slope.value) == (found[0][0], found[1][0])
    if name != "hardened":
        conductance = c_function(library, "conductance")(known.c)
        np.testing.assert_allclose(conductance, CONDUCTIVITY / 13.3 * found[1], rtol=1e-15)


@needs("gcc")
@pytest.mark.parametrize("name", ASKED)
def test_c_outside_its_range(name: str, compiled: dict[str, ctypes.CDLL]) -> None:
    library, law = compiled[name], points(name).law
    beyond = [math.nan, math.inf, 0.5 * (law.h_max - law.lowest) * (1 + 1e-9)]
    before = [] if math.isinf(law.highest) else [-math.inf, 0.5 * (law.h_max - law.highest) * (1 + 1e-9)]
    for quantity in ("pressure", "tangent", "area", "energy"):
        assert np.isnan(c_function(library, quantity)(beyond + before)).all()
        if not before:
            assert (c_function(library, quantity)([0.0, -0.0, -1.0, -math.inf]) == 0).all()
    most = float(law.force(law.lowest if law.turning_point is None else law.turning_point))
    assert np.isnan(c_function(library, "overclosure")([-1.0, math.nan, math.inf, 1.01 * most])).all()
    if not before:
        assert c_function(library, "overclosure")([0.0]) == 0


@needs("g++")
def test_the_same_file_is_cpp(tmp_path: pathlib.Path) -> None:
    (tmp_path / "road.c").write_text(law_points.text("c-law", "mbma", **HEAT))
    run("g++", "-x", "c++", "-std=c++11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-c", "road.c", folder=tmp_path)


@pytest.mark.parametrize("name", ["mbma", "calibrated"])
def test_c_is_short(name: str) -> None:
    assert len(law_points.text("c-law", name, **HEAT)) <= 20_000
