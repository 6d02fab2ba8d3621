"""Closed forms as steps of sympy expressions: evaluated, written as numpy functions, read back, shown in LaTeX.

`models/closed_form_functions.py` is the one place where the forms are kept. The exported C and the equations of
docs/formula.md are made from its functions, and `evaluate` runs the same text: what is certified is what is shipped.
"""

from __future__ import annotations

import ast
import dataclasses
import itertools
import pathlib
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
from mbma_tables.models.closed_form_functions import Certificate

PACKAGE = pathlib.Path(mbma_tables.__file__).parent
MODULE = PACKAGE / "models" / "closed_form_functions.py"
MAX_PRODUCT = 8  # whole powers up to this are written as products: faster than pow, and rounded alike everywhere
WIDTH = 120
MADE_BY = "Made by `python -m generate formulas`; do not edit."
NUMPY_NAMES = ("exp", "log", "pi", "sqrt", "where")

Step = tuple[str, sympy.Expr]
Ranges = dict[str, tuple[float, float]]

_HEAD = f'''"""Closed forms of the island functions and of total force and area, with their certificates.

{MADE_BY}
"""

# fmt: off
# numpy's ufuncs return Any
# mypy: disable-error-code="no-any-return"

from __future__ import annotations

from typing import NamedTuple

from numpy import {", ".join(NUMPY_NAMES)}

from mbma_tables.common.arguments import FloatArray


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


@dataclasses.dataclass(frozen=True)
class Form:
    """Fitted functions of one form with their range and certificates."""

    name: str
    ranges: Ranges
    functions: tuple[Function, ...]
    certificates: dict[str, Certificate]


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
    """Values of all steps, by the text of the numpy functions.

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


def _python_function(function: Function) -> str:
    given = ", ".join(f"{name}: FloatArray" for name in function.arguments)
    if len(given) > WIDTH - 40:
        given = f"\n    {given}\n"
    lines = [f"def {function.name}({given}) -> FloatArray:", f'    """{function.title}"""']
    for name, value in function.steps:
        left, right = "return" if name == function.result else f"{name} =", _python(value)
        if len(left) + len(right) > WIDTH - 5:
            right = f"(\n{_wrapped(right, first='        ')}\n    )"
        lines.append(f"    {left} {right}")
    return "\n".join([*lines, "", ""])


def _dictionary(head: str, rows: Mapping[str, str]) -> str:
    lines = [_wrapped(f"{key!r}: {text},").replace("'", '"') for key, text in rows.items()]
    return "\n".join([f"{head} = {{", *lines, "}", ""])


def module_text(functions: Iterable[Function], ranges: dict[str, Ranges], certificates: dict[str, Any]) -> str:
    """The module of closed forms; `ranges` and `certificates` by form, the latter by result too."""
    data = {
        "RANGES: dict[str, dict[str, tuple[float, float]]]": {f: repr(row) for f, row in ranges.items()},
        "CERTIFICATES: dict[str, dict[str, Certificate]]": {f: repr(row) for f, row in certificates.items()},
    }
    return _HEAD + "\n".join([*map(_python_function, functions), *itertools.starmap(_dictionary, data.items())])


def _otherwise(condition: sympy.Expr, value: sympy.Expr, other: sympy.Expr) -> sympy.Expr:
    return sympy.Piecewise((value, condition), (other, True))


def steps_of(assignments: Iterable[tuple[str, str]], arguments: Iterable[str]) -> tuple[Step, ...]:
    """Steps from their text; a name means an argument or an earlier step."""
    known: dict[str, Any] = {name: sympy.Symbol(name) for name in arguments} | {"where": _otherwise}
    steps = []
    for name, text in assignments:
        steps.append((name, sympy.sympify(text, locals=known)))
        known[name] = sympy.Symbol(name)
    return tuple(steps)


def needed(steps: list[Step]) -> tuple[Step, ...]:
    """The steps that the last one needs, in their order."""
    wanted = {steps[-1][0]}
    kept: list[Step] = []
    for name, value in reversed(steps):
        if name in wanted:
            kept.insert(0, (name, value))
            wanted |= {symbol.name for symbol in value.free_symbols}
    return tuple(kept)


def read_functions(module: str) -> dict[str, Function]:
    """The functions of a module's text by name, their right-hand sides as sympy expressions."""
    found = {}
    for node in ast.parse(module).body:
        if isinstance(node, ast.FunctionDef):
            form, _, result = node.name.partition("_")
            arguments = tuple(argument.arg for argument in node.args.args)
            assignments = [
                (ast.unparse(line.targets[0]) if isinstance(line, ast.Assign) else result, ast.unparse(line.value))
                for line in node.body
                if isinstance(line, ast.Assign | ast.Return) and line.value
            ]
            steps = steps_of(assignments, arguments)
            found[node.name] = Function(form, result, arguments, ast.get_docstring(node) or "", steps)
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


def write_forms(forms: Iterable[Form]) -> None:
    """Write the module."""
    forms = list(forms)
    text = module_text(
        [function for form in forms for function in form.functions],
        {form.name: form.ranges for form in forms},
        {form.name: form.certificates for form in forms},
    )
    write_file(MODULE, text.encode())
