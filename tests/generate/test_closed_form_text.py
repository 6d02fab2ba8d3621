"""The closed forms in the core, in exported C and as sympy expressions: one text, one value."""

import ctypes
import shutil
import subprocess

import numpy as np
import pytest

from generate.formulas import HEADER, MODULE, header_text, module_text, read_functions
from generate.pages.library import expressions
from mbma_tables.export.c_code import SOURCES, write_code
from mbma_tables.models import closed_forms as shipped

NAMES = [f"{form}_{result}" for form, results in shipped.FUNCTIONS.items() for result in results]


def points(form):
    rng = np.random.default_rng(5)
    given = {name: rng.uniform(*ends, 400) for name, ends in shipped.RANGES[form].items() if name != "area"}
    if form == "totals":
        given["d_over_h_rms"] = given["h_max_over_h_rms"] - rng.uniform(0.1, 6, 400)
    else:
        given["mu"] = np.concatenate([[0.0], 10 ** rng.uniform(-9, np.log10(2e3), 399)])
    return list(given.values())


@pytest.fixture(scope="module")
def functions():
    return read_functions(HEADER.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler is installed")
    path = tmp_path_factory.mktemp("forms") / "forms.so"
    write_code(path.parent)
    strict = ["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Wmissing-prototypes", "-Werror"]
    sources = [path.with_name(name) for name in SOURCES if name != "mbma_selftest.c"]
    subprocess.run([compiler, *strict, "-O2", "-shared", "-fPIC", *sources, "-o", path, "-lm"], check=True)
    return ctypes.CDLL(str(path))


def test_the_shipped_text_is_what_the_generator_prints(functions):
    text = HEADER.read_text(encoding="utf-8")
    assert header_text(text, functions) == text
    assert module_text(shipped.CERTIFICATES) == MODULE.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", NAMES)
def test_exported_c_agrees_with_the_core(library, name):
    form, _, result = name.partition("_")
    given = points(form)
    function = getattr(library, f"mbma_{name}")
    function.argtypes, function.restype = [ctypes.c_double] * len(given), ctypes.c_double
    found = np.array([function(*map(float, point)) for point in zip(*given, strict=True)])
    # the logarithm of a total is a sum of terms of up to 1e3, whose rounding is the total's relative error
    rtol = 1e-12 if form == "totals" else 1e-13
    np.testing.assert_allclose(found, shipped.FUNCTIONS[form][result](*given), rtol=rtol)


@pytest.mark.parametrize("name", NAMES)
def test_the_core_agrees_with_sympy_in_30_digits(functions, name):
    form, _, result = name.partition("_")
    given = [values[:2] for values in points(form)]
    function, steps = functions[name], expressions(functions[name])
    found = shipped.FUNCTIONS[form][result](*given)
    for number, point in enumerate(zip(*given, strict=True)):
        values = dict(zip(function.arguments, map(float, point), strict=True))
        for step, expression in steps.items():
            values[step] = expression.evalf(30, subs=values)
        assert found[number] == pytest.approx(float(values[result]), rel=1e-12, abs=0)
