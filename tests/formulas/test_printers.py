"""Forms printed in other languages, compiled and run there, against the evaluator."""

import json
import shutil
import subprocess

import numpy as np
import pytest

from mbma_tables import InputError
from mbma_tables.formulas import printers
from mbma_tables.formulas.file import ISLAND_FORMS, TOTALS, get_form
from mbma_tables.formulas.printers import assignments, latex, print_expression, wrap_fortran

POINTS = 400
FORMS = (*ISLAND_FORMS, TOTALS)


def needs(program):
    return pytest.mark.skipif(shutil.which(program) is None, reason=f"{program} is not installed")


def points(form):
    rng = np.random.default_rng(5)
    given = {name: rng.uniform(*form.range[name], POINTS) for name in form.arguments}
    if "mu" in given:
        given["mu"] = 10 ** rng.uniform(-9, 3.3, POINTS)
    else:
        given["d_over_h_rms"] = given["h_max_over_h_rms"] - rng.uniform(0.1, 6, POINTS)
    return given


def agree(form, rows, given):
    expected = form.evaluate(given)
    for number, name in enumerate(form.outputs):
        # the logarithm of a total is a sum of terms up to 1e3, and its error is the total's relative one
        np.testing.assert_allclose(rows[:, number], expected[name], rtol=1e-13 if form.name != TOTALS else 1e-12)


def run(command, given, folder):
    text = "\n".join(" ".join(f"{x:.17g}" for x in row) for row in np.stack(list(given.values()), 1)) + "\n"
    said = subprocess.run(command, input=text, capture_output=True, text=True, check=True, cwd=folder).stdout
    return np.array([[float(word) for word in line.split()] for line in said.split("\n") if line.strip()])


@needs("gcc")
@pytest.mark.parametrize("name", FORMS)
def test_c(name, tmp_path):
    form = get_form(name)
    given = points(form)
    body = "".join(f"const double {step} = {text};\n" for step, text in assignments(form, "c"))
    outputs = ", ".join(form.outputs.values())
    source = (
        "#include <math.h>\n#include <stdio.h>\nint main(void) {\n"
        f"double {', '.join(form.arguments)};\n"
        f'while (scanf("{"%lf" * len(given)}", {", ".join("&" + a for a in form.arguments)}) == {len(given)}) {{\n'
        f'{body}printf("{" ".join(["%.17g"] * len(form.outputs))}\\n", {outputs});\n}}\nreturn 0;\n}}\n'
    )
    (tmp_path / "form.c").write_text(source)
    strict = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    subprocess.run(["gcc", *strict, "form.c", "-o", "form", "-lm"], cwd=tmp_path, check=True)
    agree(form, run(["./form"], given, tmp_path), given)


@needs("gfortran")
@pytest.mark.parametrize("name", FORMS)
def test_fortran(name, tmp_path):
    form = get_form(name)
    given = points(form)
    steps = assignments(form, "fortran")
    arguments = [f"{a}_" for a in form.arguments]
    declared = "\n".join(wrap_fortran(f"real(real64) :: {step}") for step in [*arguments, *(s for s, _ in steps)])
    body = "\n".join(wrap_fortran(f"{step} = {text}") for step, text in steps)
    outputs = ", ".join(f"{step}_" for step in form.outputs.values())
    source = (
        "program form\n  use, intrinsic :: iso_fortran_env, only: real64\n  implicit none\n  integer :: status\n"
        f"{declared}\n  do\n    read (*, *, iostat=status) {', '.join(arguments)}\n    if (status /= 0) exit\n{body}\n"
        f"    write (*, '({len(form.outputs)}(es26.17e3))') {outputs}\n  end do\nend program form\n"
    )
    (tmp_path / "form.f90").write_text(source)
    strict = ["-std=f2008", "-Wall", "-Wextra", "-pedantic", "-Werror"]
    subprocess.run(["gfortran", *strict, "form.f90", "-o", "form"], cwd=tmp_path, check=True)
    agree(form, run(["./form"], given, tmp_path), given)


@needs("node")
@pytest.mark.parametrize("name", FORMS)
def test_javascript(name, tmp_path):
    form = get_form(name)
    given = points(form)
    body = "".join(f"const {step} = {text};\n" for step, text in assignments(form, "javascript"))
    outputs = " + ' ' + ".join(form.outputs.values())
    source = (
        "const lines = require('fs').readFileSync(0, 'utf8').trim().split('\\n');\nfor (const line of lines) {\n"
        f"const [{', '.join(form.arguments)}] = line.split(' ').map(Number);\n{body}console.log({outputs});\n}}\n"
    )
    (tmp_path / "form.js").write_text(source)
    agree(form, run(["node", "form.js"], given, tmp_path), given)


@needs("octave-cli")
@pytest.mark.parametrize("name", FORMS)
def test_octave(name, tmp_path):
    form = get_form(name)
    given = points(form)
    body = "".join(f"{step} = {text};\n" for step, text in assignments(form, "matlab"))
    columns = "".join(f"{name} = all(:, {number + 1});\n" for number, name in enumerate(form.arguments))
    outputs = ", ".join(form.outputs.values())
    source = (
        "1;\nfunction r = mbma_select(c, a, b)\n  r = ifelse_(c > 0, a, b);\nend\n"
        "function r = ifelse_(m, a, b)\n  r = m.*0 + b; a = m.*0 + a; r(m) = a(m);\nend\n"
        f"all = load('points.txt');\n{columns}{body}printf('%.17g %.17g\\n', [{outputs}]');\n"
    )
    (tmp_path / "form.m").write_text(source)
    np.savetxt(tmp_path / "points.txt", np.stack(list(given.values()), 1), fmt="%.17g")
    agree(form, run(["octave-cli", "--no-init-file", "form.m"], given, tmp_path), given)


@pytest.mark.parametrize("name", FORMS)
def test_python(name):
    form = get_form(name)
    given = points(form)
    source = "".join(f"{step} = {text}\n" for step, text in assignments(form, "python"))
    scope = {"np": np} | given
    exec(compile(source, "form", "exec"), scope)
    agree(form, np.stack([scope[step] for step in form.outputs.values()], 1), given)


@pytest.mark.parametrize(
    ("text", "printed"),
    [
        ("-X**2", "(-(mbma_X*mbma_X))"),
        ("2**-X", "POWER(2, (-mbma_X))"),
        ("X - (Y - 1)", "mbma_X - (mbma_Y - 1)"),
        ("select(X, Y, 1)", "IF((mbma_X)>0, (mbma_Y), (1))"),
        ("log(X)/(Y*2)", "LN(mbma_X)/(mbma_Y*2)"),
    ],
)
def test_spreadsheets(text, printed):
    assert print_expression(text, "spreadsheet") == printed


@pytest.mark.parametrize(
    ("text", "printed"),
    [
        ("X/(Y + 1)", r"\frac{X}{Y + 1}"),
        ("X - (Y - 1)", r"X - \left(Y - 1\right)"),
        ("1e-5*u_F**2", r"1\cdot 10^{-5}\,u_{F}^{2}"),
        ("(X + 1)**(1/3)", r"\left(X + 1\right)^{\frac{1}{3}}"),
        ("mu*sqrt(X)", r"\mu\,\sqrt{X}"),
        ("min(a, b)", r"\min\left(a, b\right)"),
        ("select(a, b, c)", r"\begin{cases}b, & a > 0\\c & \text{else}\end{cases}"),
        ("-a*(b + c)", r"\left(-a\right)\,\left(b + c\right)"),
        ("a - (b - c)", r"a - \left(b - c\right)"),
        ("sqrt(a)/exp(b)", r"\frac{\sqrt{a}}{\exp\left(b\right)}"),
        ("(a + b)**2", r"\left(a + b\right)^{2}"),
        ("2.5e-3*a", r"2.5\cdot 10^{-3}\,a"),
    ],
)
def test_latex(text, printed):
    assert latex(text) == printed


def test_unknown_target():
    with pytest.raises(InputError, match="target must be one of"):
        print_expression("X", "cobol")


def test_every_language_has_every_function():
    text = json.dumps([print_expression(f"{f}(X)", t) for f in ("exp", "log", "sqrt") for t in printers.TARGETS])
    assert "KeyError" not in text
