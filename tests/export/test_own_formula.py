"""Formulas of one's own range: what they find, their errors on fresh surfaces, and that all languages say the same."""

import ctypes
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner

from mbma_tables import InputError, Surface, contact, greenwood_tripp
from mbma_tables.cli import main
from mbma_tables.export.model import own_formula
from mbma_tables.export.model.own_formula import (
    EXAMPLE,
    Range,
    Samples,
    fit_formula,
    read_range,
    written,
)

ISLANDS = Range("islands", {"X": (1.0, 12.0), "mu": (0.1, 100.0)}, groups=80, points=12)
SURFACES = Range(
    "surfaces",
    {
        "hurst": (0.7, 0.9),
        "zeta_1": (30.0, 300.0),
        "h_max_over_h_rms": (3.5, 3.5),
        "area": (1e-3, 0.1),
    },
    "calibrated",
    groups=60,
    points=20,
)


@pytest.fixture(scope="module")
def of_islands():
    return fit_formula(ISLANDS, 8)


@pytest.fixture(scope="module")
def of_surfaces():
    return fit_formula(SURFACES, 8)


def test_errors_of_islands_are_those_of_other_exact_islands(of_islands):
    rng = np.random.default_rng(77)
    X = rng.uniform(1, 12, 2000)
    mu = 10 ** rng.uniform(-1, 2, 2000)
    solved = greenwood_tripp.solve(X, mu, rtol=1e-9)
    for formula, exact in zip(of_islands, (solved.phi_F, solved.phi_A), strict=True):
        error = np.abs(formula(X=X, mu=mu) / exact - 1)
        stated = formula.certificate
        assert stated.coefficients <= 8
        assert 0.5 * stated.median < np.median(error) < 2 * stated.median
        assert error.max() < 2 * stated.largest < 0.2


def test_errors_of_surfaces_are_those_of_other_surfaces(of_surfaces):
    rng = np.random.default_rng(78)
    hurst = rng.uniform(0.7, 0.9, 3000)
    zeta_1 = 30 * 10 ** rng.uniform(0, 1, 3000)
    u = rng.uniform(0.2, 3.0, 3000)
    answer = contact(
        Surface(hurst, 1.0, zeta_1, 1.0, 3.5), mean_separation=u, theory="calibrated"
    )
    inside = (answer.area > 1e-3) & (answer.area < 0.1)
    given = {"u_over_h_rms": u, "zeta_1": zeta_1, "hurst": hurst}
    for formula, exact in zip(of_surfaces, (answer.pressure, answer.area), strict=True):
        # h_max/h_rms is one number, so it is no argument
        assert formula.function.arguments == tuple(given)
        error = np.abs(formula(**given) / exact - 1)[inside]
        assert 0.5 * formula.certificate.median < np.median(error)
        assert np.median(error) < 2 * formula.certificate.median
        assert error.max() < 2 * formula.certificate.largest < 0.3


def test_a_number_in_place_of_a_range_is_no_argument():
    own = Range("islands", {"X": (1.0, 12.0), "mu": (5.0, 5.0)}, groups=40, points=12)
    force, _ = fit_formula(own, 6)
    assert force.function.arguments == ("X",)
    exact = greenwood_tripp.solve(4.0, 5.0).phi_F
    assert abs(force(X=4.0) / exact - 1) < 2 * force.certificate.largest < 0.02
    names = {}
    exec(written(own, [force], "python"), names)
    assert names["phi_F"](4.0) == pytest.approx(float(force(X=4.0)), rel=1e-14)
    one = {**SURFACES.ranges, "hurst": (0.8, 0.8), "zeta_1": (100.0, 100.0)}
    with pytest.raises(InputError, match="terms must be at most 28 for this range"):
        fit_formula(Range("surfaces", one, groups=100), 30)


def test_more_terms_err_less_on_groups_left_out():
    errors = [fit_formula(ISLANDS, terms)[0].cross_validated for terms in (3, 8, 20)]
    assert errors[0] > 2 * errors[1] > 4 * errors[2]


def test_a_sum_of_products_is_found(monkeypatch):
    """ln p = 0.5 + 2 c - 3 g h with the scaled letters, and noise that repeats within a group."""

    def samples(own, count, seed):
        rng = np.random.default_rng(seed)
        shape = (count, own.points)
        groups = np.broadcast_to(np.arange(count)[:, None], shape).ravel()
        hurst = np.repeat(rng.uniform(0.7, 0.9, count), own.points)
        zeta_1 = np.repeat(30 * 10 ** rng.uniform(0, 1, count), own.points)
        u = rng.uniform(0.1, 3.0, shape).ravel()
        given = {"u_over_h_rms": u, "zeta_1": zeta_1, "hurst": hurst}
        c = np.log(1 - u / 3.5)
        product = (u - 1.55) / 1.45 * (hurst - 0.8) / 0.1
        power = 0.5 + 2 * c - 3 * product + 1e-5 * np.sin(37 * zeta_1)
        return Samples(given, {"pressure": np.exp(power)}, groups)

    monkeypatch.setattr(own_formula, "_samples", samples)
    (formula,) = fit_formula(SURFACES, 3)
    assert re.fullmatch(
        r"[-\d.]+ - [\d.]+ \* g \* h \+ [\d.]+ \* c|[-\d.]+ \+ [\d.]+ \* c - [\d.]+ \* g \* h",
        formula.function.steps["log_pressure"],
    )
    assert formula.certificate.largest < 0.01


LATEX_NAMES = {
    r"\frac{u}{h_{\mathrm{rms}}}": "u_over_h_rms",
    r"\zeta_1": "zeta_1",
    r"\mu": "mu",
    r"\left": "",
    r"\right": "",
    r"\ln": "log",
    r"\exp": "exp",
    r"\sqrt": "sqrt",
    r" \times 10^": "e",
    r"\,": "*",
    "^": "**",
}


def braced(text):
    """The contents of the braces that a text begins with, and what follows them."""
    depth = 0
    for place, letter in enumerate(text):
        depth += (letter == "{") - (letter == "}")
        if depth == 0:
            return text[1:place], text[place + 1 :]
    raise AssertionError(text)


def without_fractions(text):
    """The text with quotients in place of fractions."""
    before, fraction, rest = text.partition(r"\frac")
    if not fraction:
        return text
    above, rest = braced(rest)
    below, rest = braced(rest)
    return without_fractions(f"{before}{{{{{above}}}/{{{below}}}}}{rest}")


def of_latex(text, given):
    """The value of the equations of a LaTeX text, read by their own letters."""
    values = vars(np) | given | {"H": given["hurst"]}
    for line in text.partition(r"\begin{align*}")[2].splitlines():
        left, equals, right = line.removesuffix(r" \\").partition(" &= ")
        if not equals:
            continue
        for latex, name in LATEX_NAMES.items():
            right = right.replace(latex, name)
        right = re.sub(r"e\{(-?\d+)\}", r"e\1", right)
        right = without_fractions(right)
        name = left if re.fullmatch("[a-zA-Z]", left) else "last"
        values[name] = eval(right.replace("{", "(").replace("}", ")"), values)
    return values["last"]


@pytest.mark.parametrize("which", ["of_islands", "of_surfaces"])
def test_all_languages_say_the_same(which, request, tmp_path):
    own = ISLANDS if which == "of_islands" else SURFACES
    formulas = request.getfixturevalue(which)
    given = {"X": 3.7, "mu": 11.0, "u_over_h_rms": 1.3, "zeta_1": 77.0, "hurst": 0.83}
    compiler = shutil.which("cc")
    for formula in formulas:
        name = formula.function.result
        arguments = [given[n] for n in formula.function.arguments]
        value = float(formula(**given))
        names = {}
        exec(written(own, [formula], "python"), names)
        assert names[name](*arguments) == pytest.approx(value, rel=1e-14)
        latex = of_latex(written(own, [formula], "latex"), given)
        assert latex == pytest.approx(value, rel=1e-12)
        text = written(own, [formula], "text")
        assert f"largest {formula.certificate.largest:.2g}" in text
        if compiler is None:
            continue
        source = tmp_path / f"{name}.c"
        source.write_text(written(own, [formula], "c"))
        library = tmp_path / f"{name}.so"
        flags = ["-std=c11", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
        subprocess.run([compiler, *flags, source, "-o", library, "-lm"], check=True)
        function = ctypes.CDLL(str(library))[name]
        function.restype = ctypes.c_double
        function.argtypes = [ctypes.c_double] * len(arguments)
        assert function(*arguments) == pytest.approx(value, rel=1e-13)
    with pytest.raises(InputError, match="no language is named 'rust'"):
        written(own, formulas, "rust")


def test_the_example_is_a_range(tmp_path):
    path = tmp_path / "range.toml"
    path.write_text(EXAMPLE)
    own = read_range(path)
    assert own.ranges["zeta_1"] == (20.0, 500.0)
    assert (own.groups, own.points, own.theory) == (300, 30, "mbma")


WRONG = [
    ("", "'range' is a required"),
    ("[range]\nhurst = 0.8", "required"),
    ("groop = 3\n" + EXAMPLE, "unknown key 'groop'; did you mean 'groups'"),
    (EXAMPLE.replace("[0.6, 1.0]", "[1.0, 0.6]"), r"hurst must be .*, got \[1.0, 0.6\]"),
    (EXAMPLE.replace("[20, 500]", "[0.5, 500]"), "zeta_1 must be a number above 1"),
    (EXAMPLE.replace("[20, 500]", "[20, nan]"), "zeta_1 must be a number above 1"),
    (EXAMPLE.replace("[20, 500]", '"wide"'), "zeta_1"),
    (EXAMPLE.replace('"surfaces"', '"seals"'), "seals"),
    (
        EXAMPLE.replace("[1e-3, 0.15]", "[0.98, 0.99]"),
        "0 points of 0 groups lie in the range",
    ),
    (EXAMPLE.replace('"mbma"', '"mbna"'), "mbma"),
]


@pytest.mark.parametrize(("text", "said"), WRONG)
def test_what_is_no_range_is_refused(text, said, tmp_path):
    path = tmp_path / "range.toml"
    path.write_text(text)
    result = CliRunner().invoke(main, ["tables", "formula", "--config", str(path)])
    assert result.exit_code == 2
    assert result.stdout == ""
    assert re.search(said, result.stderr), result.stderr


def test_terms_and_files_are_checked():
    for terms in (1, 61, 2.5):
        with pytest.raises(InputError, match="terms must be a whole number"):
            fit_formula(ISLANDS, terms)
    result = CliRunner().invoke(main, ["tables", "formula"])
    assert result.exit_code == 2
    assert "--example shows" in result.stderr


def test_scikit_learn_is_imported_when_a_formula_is_fitted():
    code = "import sys, mbma_tables.cli, mbma_tables.export.model.own_formula\n"
    code += "assert 'sklearn' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
