"""Expressions and forms printed in other languages: C, Fortran, MATLAB, Python, JavaScript, spreadsheets, LaTeX.

Small whole powers are products everywhere, as in `expressions.evaluate`, so that all languages round alike.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Literal

from mbma_tables.errors import InputError
from mbma_tables.formulas.expressions import Binary, Call, Name, Negative, Node, Number, needed, parse, small_power
from mbma_tables.formulas.file import Form

Target = Literal["c", "fortran", "matlab", "python", "javascript", "spreadsheet"]
TARGETS: tuple[Target, ...] = ("c", "fortran", "matlab", "python", "javascript", "spreadsheet")
FORTRAN_WIDTH = 100

_RANK = {"+": 1, "-": 1, "*": 2, "/": 2, "**": 4}
_NEGATIVE_RANK = 3
_ATOM = 5


@dataclasses.dataclass(frozen=True)
class _Language:
    """How one language writes numbers, powers, calls and names."""

    number: Callable[[Number], str]
    power: Callable[[str, str], str]
    select: str
    functions: dict[str, str]
    name: Callable[[str], str] = str


def _decimal(number: Number) -> str:
    """A literal that reads as a double: 2 becomes 2.0."""
    return number.text if any(mark in number.text for mark in ".eE") else f"{number.text}.0"


def _fortran_number(number: Number) -> str:
    mantissa, _, exponent = _decimal(number).lower().partition("e")
    return f"{mantissa}e{exponent}_real64" if exponent else f"{mantissa}_real64"


def _call(function: str) -> Callable[[str, str], str]:
    return lambda base, exponent: f"{function}({base}, {exponent})"


_PLAIN = {"exp": "exp", "log": "log", "sqrt": "sqrt"}
_LANGUAGES: dict[str, _Language] = {
    "c": _Language(_decimal, _call("pow"), "({0} > 0.0 ? {1} : {2})", _PLAIN | {"min": "fmin", "max": "fmax"}),
    "fortran": _Language(
        _fortran_number,
        lambda base, exponent: f"({base})**({exponent})",
        "merge({1}, {2}, {0} > 0.0_real64)",
        _PLAIN | {"min": "min", "max": "max"},
        lambda name: f"{name}_",
    ),
    "matlab": _Language(
        lambda number: number.text,
        lambda base, exponent: f"({base}).^({exponent})",
        "mbma_select({0}, {1}, {2})",
        _PLAIN | {"min": "min", "max": "max"},
    ),
    "python": _Language(
        lambda number: number.text,
        lambda base, exponent: f"({base})**({exponent})",
        "np.where({0} > 0, {1}, {2})",
        {"exp": "np.exp", "log": "np.log", "sqrt": "np.sqrt", "min": "np.minimum", "max": "np.maximum"},
    ),
    "javascript": _Language(
        lambda number: number.text,
        _call("Math.pow"),
        "({0} > 0 ? {1} : {2})",
        {name: f"Math.{name}" for name in ("exp", "log", "sqrt", "min", "max")},
    ),
    "spreadsheet": _Language(
        lambda number: number.text,
        _call("POWER"),
        "IF({0}>0, {1}, {2})",
        {"exp": "EXP", "log": "LN", "sqrt": "SQRT", "min": "MIN", "max": "MAX"},
        # a name such as u_F or Q1 could be the address of a cell
        lambda name: f"mbma_{name}",
    ),
}
_ELEMENTWISE = {"*": ".*", "/": "./"}


def _rank(node: Node) -> int:
    if isinstance(node, Negative):
        return _NEGATIVE_RANK
    if isinstance(node, Binary):
        if node.operator == "**":
            whole = small_power(node)
            return _ATOM if whole is None or whole == 1 else _RANK["*"]
        return _RANK[node.operator]
    return _ATOM


def print_expression(node: Node | str, target: Target) -> str:
    """An expression in another language.

    Parameters
    ----------
    node : Node or str
        A tree of `expressions.parse`, or its text.
    target : {"c", "fortran", "matlab", "python", "javascript", "spreadsheet"}
        Names become ``mbma_name`` in spreadsheets, where they are to be defined as named cells, and ``name_`` in
        Fortran, which does not tell u from U.

    Raises
    ------
    InputError, TableFileError
    """
    if target not in _LANGUAGES:
        raise InputError(f"target must be one of {TARGETS}, got {target!r}")
    return _print(parse(node) if isinstance(node, str) else node, target)


def _inner(node: Node, target: str, least: int) -> str:
    text = _print(node, target)
    return text if _rank(node) >= least else f"({text})"


def _print(node: Node, target: str) -> str:
    language = _LANGUAGES[target]
    if isinstance(node, Number):
        return language.number(node)
    if isinstance(node, Name):
        return language.name(node.name)
    if isinstance(node, Negative):
        # in parentheses: spreadsheets and Fortran bind a leading minus in ways of their own
        return f"(-{_inner(node.operand, target, _ATOM)})"
    if isinstance(node, Call):
        given = [_print(argument, target) for argument in node.arguments]
        if node.function == "select":
            return language.select.format(*(f"({argument})" for argument in given))
        return f"{language.functions[node.function]}({', '.join(given)})"
    if node.operator == "**":
        whole = small_power(node)
        if whole is not None:
            sign = _sign("*", target)
            return sign.join([_inner(node.left, target, _ATOM)] * whole)
        return language.power(_print(node.left, target), _print(node.right, target))
    rank = _RANK[node.operator]
    left = _inner(node.left, target, rank)
    # a - (b - c), a/(b/c), and a*(b*c) as the tree has it, for the same rounding
    right = _inner(node.right, target, rank + 1)
    return f"{left}{_sign(node.operator, target)}{right}"


def _sign(operator: str, target: str) -> str:
    sign = _ELEMENTWISE.get(operator, operator) if target == "matlab" else operator
    return f" {sign} " if operator in "+-" else sign


def assignments(form: Form, target: Target, results: tuple[str, ...] | None = None) -> list[tuple[str, str]]:
    """(name, expression) of every step that the results need, in that language."""
    wanted = tuple(form.outputs) if results is None else results
    steps = needed(form.steps, [form.outputs[name] for name in wanted])
    name_of = _LANGUAGES[target].name
    return [(name_of(name), print_expression(node, target)) for name, node in steps]


def wrap_fortran(line: str, indent: str = "  ") -> str:
    """A Fortran statement continued over lines that no compiler finds too long."""
    words = line.split(" ")
    lines = [indent + words[0]]
    for word in words[1:]:
        if len(lines[-1]) + len(word) + 1 > FORTRAN_WIDTH:
            lines[-1] += " &"
            lines.append(f"{indent}  {word}")
        else:
            lines[-1] += f" {word}"
    return "\n".join(lines)


_GREEK = {"mu": r"\mu", "zeta_1": r"\zeta_1", "hurst": "H", "phi_F": r"\Phi_F", "phi_A": r"\Phi_A"} | {
    "rigid_F": "R_F",
    "rigid_A": "R_A",
    "log_Q_F": r"\ln Q_F",
    "log_Q_A": r"\ln Q_A",
    "d_over_h_rms": r"\tilde d",
    "h_max_over_h_rms": r"\tilde h",
}


def _latex_name(name: str) -> str:
    if name in _GREEK:
        return _GREEK[name]
    head, _, tail = name.partition("_")
    if not tail:
        return head if len(head) == 1 else rf"\mathrm{{{head}}}"
    foot = tail if len(tail) == 1 else rf"\mathrm{{{tail}}}"
    return f"{head if len(head) == 1 else rf'{chr(92)}mathrm{{{head}}}'}_{{{foot}}}"


def _latex_number(number: Number) -> str:
    mantissa, _, exponent = number.text.lower().partition("e")
    return rf"{mantissa}\cdot 10^{{{int(exponent)}}}" if exponent else mantissa


def latex(node: Node | str) -> str:
    """An expression in LaTeX."""
    tree = parse(node) if isinstance(node, str) else node
    if isinstance(tree, Number):
        return _latex_number(tree)
    if isinstance(tree, Name):
        return _latex_name(tree.name)
    if isinstance(tree, Negative):
        return f"-{_latex_inner(tree.operand, 2)}"
    if isinstance(tree, Call):
        given = [latex(argument) for argument in tree.arguments]
        if tree.function == "sqrt":
            return rf"\sqrt{{{given[0]}}}"
        if tree.function == "select":
            return rf"\begin{{cases}}{given[1]}, & {given[0]} > 0\\{given[2]} & \text{{else}}\end{{cases}}"
        name = {"log": r"\ln", "exp": r"\exp", "min": r"\min", "max": r"\max"}[tree.function]
        return rf"{name}\left({', '.join(given)}\right)"
    if tree.operator == "**":
        base = latex(tree.left)
        # a name with a foot and a fraction need something to stand on
        plain = isinstance(tree.left, Name | Number) and r"\ln" not in base and "^" not in base
        return f"{base if plain else rf'{chr(92)}left({base}{chr(92)}right)'}^{{{latex(tree.right)}}}"
    if tree.operator == "/":
        return rf"\frac{{{latex(tree.left)}}}{{{latex(tree.right)}}}"
    if tree.operator == "*":
        left, right = _latex_inner(tree.left, 2), _latex_inner(tree.right, 2)
        return rf"{left}\,{right}"
    right = _latex_inner(tree.right, 2 if tree.operator == "-" else 1)
    return f"{latex(tree.left)} {tree.operator} {right}"


def _latex_inner(node: Node, least: int) -> str:
    text = latex(node)
    low = isinstance(node, Negative) or (isinstance(node, Binary) and _RANK[node.operator] < least)
    return rf"\left({text}\right)" if low else text


def latex_steps(form: Form, results: tuple[str, ...] | None = None) -> list[str]:
    """One equation a step, in the order in which they are evaluated."""
    wanted = tuple(form.outputs) if results is None else results
    return [
        f"{_latex_name(name)} = {latex(node)}"
        for name, node in needed(form.steps, [form.outputs[name] for name in wanted])
    ]
