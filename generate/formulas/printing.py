"""Closed forms as steps of sympy expressions: written as numpy functions and C99, read back, shown in LaTeX.

`models/closed_form_functions.py` is the one place where the forms are kept. The C text and the equations of
docs/formula.md are printed from its functions, so what is certified is what is printed.
"""

from __future__ import annotations

import ast
import dataclasses
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import sympy
from sympy.codegen.rewriting import create_expand_pow_optimization
from sympy.printing.c import C99CodePrinter
from sympy.printing.numpy import NumPyPrinter
from sympy.printing.precedence import PRECEDENCE

from mbma_tables.arguments import FloatArray

MAX_PRODUCT = 8  # whole powers up to this are written as products: faster than pow, and rounded alike everywhere
WIDTH = 120
MADE_BY = "Made by `python -m generate formulas`; do not edit."

Step = tuple[str, sympy.Expr]

_HEAD = '''"""Closed forms of the island functions and of total force and area, with their certificates.

{made_by}
"""

# numpy's ufuncs return Any
# mypy: disable-error-code="no-any-return"

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from numpy import exp, log, pi, sqrt, where

from mbma_tables.arguments import FloatArray


class Certificate(NamedTuple):
    """Relative errors of one function on points that no fit saw, and its number of fitted coefficients."""

    coefficients: int
    largest: float
    median: float
    points: int
    worst_at: dict[str, float]

'''


@dataclasses.dataclass(frozen=True)
class Function:
    """One closed form of one quantity: each step uses the arguments and earlier steps, the last is the value.

    Examples
    --------
    >>> import numpy as np, sympy
    >>> Function("form_twice", ("X",), "", [("twice", 2 * sympy.Symbol("X"))])(np.array([1.5]))
    array([3.])
    """

    name: str
    arguments: tuple[str, ...]
    title: str
    steps: list[Step]

    @property
    def result(self) -> str:
        """The name of what it returns, phi_F of pocket_phi_F."""
        return self.name.partition("_")[2]

    def __call__(self, *values: FloatArray) -> FloatArray:
        """Evaluate the text of the numpy function, which is what is shipped."""
        names: dict[str, Any] = {name: getattr(np, name) for name in ("exp", "log", "pi", "sqrt", "where")}
        exec(python_text(self), names | {"FloatArray": object}, names)
        with np.errstate(all="ignore"):
            found: FloatArray = names[self.name](*values)
        return found


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


class _C99(C99CodePrinter):  # type: ignore[misc]
    """ISO C99 has no M_PI."""

    def __init__(self) -> None:
        super().__init__({"math_macros": {}})

    def _print_Float(self, number: sympy.Float) -> str:
        return repr(float(number))

    def _print_NumberSymbol(self, number: sympy.NumberSymbol) -> str:
        return repr(float(number))


_expand_powers = create_expand_pow_optimization(MAX_PRODUCT)


def _wrapped(text: str, indent: str) -> str:
    return textwrap.fill(
        text, WIDTH, initial_indent=indent, subsequent_indent=indent + "    ", break_long_words=False,
        break_on_hyphens=False,
    )  # fmt: skip


def python_text(function: Function) -> str:
    """The function in Python."""
    given = ", ".join(f"{name}: FloatArray" for name in function.arguments)
    lines = [f"def {function.name}({given}) -> FloatArray:", f'    """{function.title}"""']
    for name, value in function.steps:
        left = "return" if name == function.result else f"{name} ="
        lines.append(f"    {left} {_Numpy().doprint(_expand_powers(value))}")
    return "\n".join([*lines, ""])


def c_text(functions: Iterable[Function]) -> str:
    """The functions in C99: doubles in, a double out; <math.h> alone, no global data."""
    functions = list(functions)
    heads = {f.name: f"double mbma_{f.name}({', '.join(f'double {name}' for name in f.arguments)})" for f in functions}
    parts = [
        "\n".join(_wrapped(line, " * ") for line in ("Closed forms of the MBMA model.", MADE_BY)),
        " */\n#include <math.h>\n",
        "\n".join(f"{head};" for head in heads.values()),
    ]
    text = "/*\n" + "\n".join(parts) + "\n"
    for function in functions:
        lines = [f"/* {function.title} */", f"{heads[function.name]} {{"]
        for name, value in function.steps:
            left = "return" if name == function.result else f"const double {name} ="
            lines.append(_wrapped(f"{left} {_C99().doprint(_expand_powers(value))};", "    "))
        text += "\n" + "\n".join([*lines, "}", ""])
    return text


def module_text(
    functions: Iterable[Function],
    ranges: dict[str, dict[str, tuple[float, float]]],
    certificates: dict[str, dict[str, Any]],
) -> str:
    """The module of closed forms; `ranges` and `certificates` by form, the latter by result too."""
    text = _HEAD.format(made_by=MADE_BY)
    text += "\n\n".join(python_text(function) for function in functions)
    by_form = ", ".join(
        f"{form!r}: {{{', '.join(f'{result!r}: {form}_{result}' for result in results)}}}"
        for form, results in certificates.items()
    )
    text += f"\n\nFUNCTIONS: dict[str, dict[str, Callable[..., FloatArray]]] = {{{by_form}}}\n"
    text += f"RANGES: dict[str, dict[str, tuple[float, float]]] = {ranges!r}\n"
    text += f"CERTIFICATES: dict[str, dict[str, Certificate]] = {certificates!r}\n"
    command = [sys.executable, "-m", "ruff", "format", "--line-length", str(WIDTH), "-"]
    return subprocess.run(command, input=text, capture_output=True, text=True, check=True).stdout


def read_functions(module: str) -> dict[str, Function]:
    """The functions of a module's text, their right-hand sides as sympy expressions."""
    where: Callable[..., sympy.Expr] = lambda test, yes, no: sympy.Piecewise((yes, test), (no, True))  # noqa: E731
    found = {}
    for node in ast.parse(module).body:
        if isinstance(node, ast.FunctionDef):
            arguments = tuple(argument.arg for argument in node.args.args)
            known: dict[str, Any] = {name: sympy.Symbol(name) for name in arguments} | {"where": where}
            steps = []
            for line in node.body:
                if isinstance(line, ast.Assign | ast.Return) and line.value:
                    name = ast.unparse(line.targets[0]) if isinstance(line, ast.Assign) else node.name.partition("_")[2]
                    steps.append((name, sympy.sympify(ast.unparse(line.value), locals=known)))
                    known[name] = sympy.Symbol(name)
            found[node.name] = Function(node.name, arguments, ast.get_docstring(node) or "", steps)
    return found
