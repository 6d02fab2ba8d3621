"""Closed forms as steps of sympy expressions: evaluated, written as C, read back, shown in LaTeX.

`core/closed_forms.h` is the one place where the forms are kept: the core is compiled with it, exports hold its text,
and the equations of docs/formula.md are made from it. `models/closed_form_certificates.py` has ranges and errors.
"""

import ast
import dataclasses
import itertools
import math
import pathlib
import re
import textwrap
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import sympy
from sympy.codegen.rewriting import create_expand_pow_optimization
from sympy.printing.numpy import NumPyPrinter
from sympy.printing.precedence import PRECEDENCE

import mbma_tables
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.files import write_file
from mbma_tables.models import Certificate

PACKAGE = pathlib.Path(mbma_tables.__file__).parent
HEADER = PACKAGE / "core" / "closed_forms.h"
MODULE = PACKAGE / "models" / "closed_form_certificates.py"
MAX_PRODUCT = 8  # whole powers up to this are written as products: faster than pow, and rounded alike everywhere
WIDTH = 120
MADE_BY = "Made by `python -m generate formulas`; do not edit."
NUMPY_NAMES = ("exp", "log", "pi", "sqrt", "where")

Step = tuple[str, sympy.Expr]
Ranges = dict[str, tuple[float, float]]

_HEAD_OF_C = f"""/* Closed forms of the island functions and of total force and area. {MADE_BY}
 *
 * A fitted coefficient that is a whole number is written 23e0, any other whole number 23.0. */
#include <math.h>
"""
_WHERE = "static double where(int condition, double a, double b) { return condition ? a : b; }"
_HEAD = f'''"""Ranges of the closed forms, and their certificates; the forms are in `core/closed_forms.h`.

{MADE_BY}
"""

# fmt: off

from mbma_tables.models import Certificate

'''


@dataclasses.dataclass(frozen=True)
class Function:
    """One closed form of one result: each step uses the arguments and earlier steps, the last is the value."""

    form: str
    result: str
    arguments: tuple[str, ...]
    title: str
    steps: tuple[Step, ...]

    @property
    def name(self) -> str:
        """Its name in Python, and in C after ``mbma_``."""
        return f"{self.form}_{self.result}"


class _Numpy(NumPyPrinter):  # type: ignore[misc]
    """Numpy functions by their bare names, literals in shortest decimals."""

    def __init__(self) -> None:
        super().__init__({"fully_qualified_modules": False})

    def _print_Float(self, number: sympy.Float) -> str:
        return repr(float(number))

    def _print_Pow(self, power: sympy.Pow, rational: bool = False) -> str:
        if power.exp == -1:
            return f"1/{self.parenthesize(power.base, PRECEDENCE['Pow'])}"
        text: str = super()._print_Pow(power, rational)
        return text

    def _print_Piecewise(self, cases: sympy.Piecewise) -> str:
        (first, condition), (second, _) = cases.args
        return f"where({self._print(condition)}, {self._print(first)}, {self._print(second)})"

    def _print_Relational(self, relation: sympy.Rel) -> str:
        return f"{self._print(relation.lhs)} {relation.rel_op} {self._print(relation.rhs)}"


_expand_powers = create_expand_pow_optimization(MAX_PRODUCT)


def _python(value: sympy.Expr) -> str:
    text: str = _Numpy().doprint(_expand_powers(value))
    return text


def evaluate(steps: Iterable[Step], given: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Values of all steps, by numpy functions.

    Examples
    --------
    >>> evaluate([("w", 1 / (sympy.Symbol("X") + 3))], {"X": np.array([1.0, 2.0])})["w"]
    array([0.25, 0.2 ])
    """
    names: dict[str, Any] = {name: getattr(np, name) for name in NUMPY_NAMES} | dict(given)
    with np.errstate(all="ignore"):
        for name, value in steps:
            names[name] = eval(_python(value), names)
    return names


def _wrapped(text: str, first: str = "    ", rest: str = "        ") -> str:
    wrapper = textwrap.TextWrapper(WIDTH, first, rest, break_long_words=False, break_on_hyphens=False)
    return wrapper.fill(text)


class _InC(ast.NodeTransformer):
    """Arithmetic that Python and C read alike: doubles for whole numbers, pow for **."""

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        return ast.Call(ast.Name("pow"), [node.left, node.right], []) if isinstance(node.op, ast.Pow) else node

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        value: Any = node.value
        fitted = isinstance(value, float) and value.is_integer()
        return ast.Name(f"{value:.0f}e0") if fitted else ast.Constant(float(value))

    def visit_Name(self, node: ast.Name) -> ast.AST:
        return ast.Constant(math.pi) if node.id == "pi" else node


def _c_head(function: Function) -> str:
    return f"double mbma_{function.name}({', '.join(f'double {name}' for name in function.arguments)})"


def _c_function(function: Function) -> str:
    lines = [f"/* {function.title} */", f"{_c_head(function)} {{"]
    for name, value in function.steps:
        left = "return" if name == function.result else f"const double {name} ="
        text = ast.unparse(_InC().visit(ast.parse(_python(value), mode="eval")))
        lines += textwrap.wrap(f"{left} {text};", WIDTH, initial_indent="    ", subsequent_indent="        ")
    return "\n".join([*lines, "}\n"])


def header_text(functions: Iterable[Function]) -> str:
    """The header of the closed forms: what it includes, declarations, `where`, and definitions."""
    known = list(functions)
    heads = "".join(f"{_c_head(function)};\n" for function in known)
    return "\n".join([_HEAD_OF_C, heads, f"{_WHERE}\n", *map(_c_function, known)])


def _dictionary(head: str, rows: Mapping[str, str]) -> str:
    lines = [_wrapped(f"{key!r}: {text},").replace("'", '"') for key, text in rows.items()]
    return "\n".join([f"{head} = {{", *lines, "}", ""])


def module_text(ranges: dict[str, Ranges], certificates: dict[str, Any]) -> str:
    """The module of certificates; `ranges` and `certificates` by form, the latter by result too."""
    data = {
        "RANGES: dict[str, dict[str, tuple[float, float]]]": {f: repr(row) for f, row in ranges.items()},
        "CERTIFICATES: dict[str, dict[str, Certificate]]": {f: repr(row) for f, row in certificates.items()},
    }
    return _HEAD + "\n".join(itertools.starmap(_dictionary, data.items()))


def _otherwise(condition: sympy.Expr, value: sympy.Expr, other: sympy.Expr) -> sympy.Expr:
    return sympy.Piecewise((value, condition), (other, True))


def steps_of(assignments: Iterable[tuple[str, str]], arguments: Iterable[str]) -> tuple[Step, ...]:
    """Steps from their text; a name means an argument or an earlier step."""
    known: dict[str, Any] = {name: sympy.Symbol(name) for name in arguments} | {"where": _otherwise, "pow": sympy.Pow}
    steps = []
    for name, text in assignments:
        steps.append((name, sympy.sympify(text, locals=known)))
        known[name] = sympy.Symbol(name)
    return tuple(steps)


def read_functions(header: str) -> dict[str, Function]:
    """The functions of a header's text by name, their right-hand sides as sympy expressions."""
    found = {}
    exact = re.sub(r"\b(\d+)\.0\b", r"\1", header.replace(repr(math.pi), "pi"))
    definition = r"/\* ([^\n]*) \*/\ndouble mbma_(\w+)\(([^\n]*)\) \{\n(.*?)\n\}"
    for title, name, given, body in re.findall(definition, exact, re.DOTALL):
        form, _, result = name.partition("_")
        arguments = tuple(given.replace("double ", "").split(", "))
        lines = [line.split() for line in body.replace("return", f"const double {result} =").split(";")]
        steps = steps_of([(words[2], " ".join(words[4:])) for words in lines if words], arguments)
        found[name] = Function(form, result, arguments, title, steps)
    return found


_LATEX = {
    "hurst": "H",
    "phi_F": r"\Phi_F",
    "phi_A": r"\Phi_A",
    "log_total": r"\ln T",
    "d_over_h_rms": r"\tilde d",
    "h_max_over_h_rms": r"\tilde h",
    **{name: rf"\mathrm{{{name}}}" for name in ("near", "far", "pressure", "area")},
}


def latex_steps(function: Function) -> list[str]:
    """One equation a step, in the order in which they are evaluated; polynomials without Horner's brackets."""
    _, is_island, letter = function.result.partition("phi_")
    own = {"log_Q": rf"\ln Q_{letter}", "rigid": f"R_{letter}"} | {name: f"{name}_{{{letter}}}" for name in "pytzuv"}
    names = {sympy.Symbol(name): text for name, text in (_LATEX | (own if is_island else {})).items()}
    style = {"symbol_names": names, "ln_notation": True, "fold_frac_powers": True}
    lines = []
    for name, value in function.steps:
        shown = value.expand() if len(value.free_symbols) == 1 and value.is_polynomial() else value
        lines.append(f"{sympy.latex(sympy.Symbol(name), **style)} = {sympy.latex(shown, **style)}")
    return lines


def write_forms(
    functions: Iterable[Function], ranges: dict[str, Ranges], certificates: dict[str, dict[str, Certificate]]
) -> None:
    """Write the header and the module."""
    write_file(HEADER, header_text(functions).encode())
    write_file(MODULE, module_text(ranges, certificates).encode())
