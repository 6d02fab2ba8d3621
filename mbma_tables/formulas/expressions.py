"""Expressions of the formula file: a small language that numpy and any other language can evaluate.

Numbers, names, ``+ - * / **``, parentheses, and calls of `FUNCTIONS`. The text is parsed by Python's own parser and
checked against a white list; nothing of it is ever executed.
"""

from __future__ import annotations

import ast
import dataclasses
import functools
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import TableFileError

FUNCTIONS = {"exp": 1, "log": 1, "sqrt": 1, "min": 2, "max": 2, "select": 3}  # name: number of arguments
LONGEST = 10_000  # characters of an expression
DEEPEST = 100
CHUNK = 4096  # points evaluated together, so that intermediate values stay in the cache

_OPERATORS: dict[type[ast.operator], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Pow: "**",
}


@dataclasses.dataclass(frozen=True)
class Number:
    """A literal, as written."""

    value: float
    text: str


@dataclasses.dataclass(frozen=True)
class Name:
    """An argument, or an earlier step."""

    name: str


@dataclasses.dataclass(frozen=True)
class Negative:
    """Minus its operand."""

    operand: Node


@dataclasses.dataclass(frozen=True)
class Binary:
    """Two operands and one of ``+ - * / **``."""

    operator: str
    left: Node
    right: Node


@dataclasses.dataclass(frozen=True)
class Call:
    """A function of `FUNCTIONS`; select(c, a, b) is a where c > 0, else b."""

    function: str
    arguments: tuple[Node, ...]


Node = Number | Name | Negative | Binary | Call


@functools.lru_cache(maxsize=1024)
def parse(text: str) -> Node:
    """The tree of an expression.

    Raises
    ------
    TableFileError
        If the text is no expression of this language.
    """
    if len(text) > LONGEST:
        raise TableFileError(f"an expression has {len(text)} characters, at most {LONGEST} are read")
    try:
        body = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as fault:
        raise TableFileError(f"not an expression: {text[:60]!r}") from fault
    return _checked(body, text, DEEPEST)


def _checked(node: ast.expr, text: str, left: int) -> Node:
    """The node as one of ours, or an error."""
    if left == 0:
        raise TableFileError(f"an expression is nested more than {DEEPEST} deep: {text[:60]!r}")
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool):
        value = float(node.value) if abs(node.value) < 1e300 else np.inf
        if np.isfinite(value):
            return Number(value, ast.get_source_segment(text.strip(), node) or repr(value))
    if isinstance(node, ast.Name):
        return Name(node.id)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return Negative(_checked(node.operand, text, left - 1))
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        both = (_checked(side, text, left - 1) for side in (node.left, node.right))
        return Binary(_OPERATORS[type(node.op)], *both)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        name = node.func.id
        if FUNCTIONS.get(name) == len(node.args):
            return Call(name, tuple(_checked(argument, text, left - 1) for argument in node.args))
    raise TableFileError(f"not allowed in an expression: {ast.unparse(node)[:60]!r}; functions are {list(FUNCTIONS)}")


def names_in(node: Node) -> set[str]:
    """Names that an expression uses."""
    if isinstance(node, Name):
        return {node.name}
    if isinstance(node, Negative):
        return names_in(node.operand)
    if isinstance(node, Binary):
        return names_in(node.left) | names_in(node.right)
    if isinstance(node, Call):
        return set().union(*(names_in(argument) for argument in node.arguments))
    return set()


def evaluate(node: Node, values: Mapping[str, FloatArray]) -> FloatArray:
    """The value of an expression at arrays of one shape; overflow and underflow follow IEEE without a warning."""
    if isinstance(node, Number):
        return np.float64(node.value)  # type: ignore[return-value]
    if isinstance(node, Name):
        return values[node.name]
    if isinstance(node, Negative):
        return -evaluate(node.operand, values)
    if isinstance(node, Binary):
        left, right = evaluate(node.left, values), evaluate(node.right, values)
        if node.operator == "+":
            return left + right
        if node.operator == "-":
            return left - right
        if node.operator == "*":
            return left * right
        if node.operator == "/":
            return left / right
        return _power(node, left, right)
    given = [evaluate(argument, values) for argument in node.arguments]
    if node.function == "select":
        return np.where(given[0] > 0, given[1], given[2])
    result: FloatArray = _NUMPY[node.function](*given)
    return result


_NUMPY = {"exp": np.exp, "log": np.log, "sqrt": np.sqrt, "min": np.minimum, "max": np.maximum}


def _power(node: Binary, base: FloatArray, exponent: FloatArray) -> FloatArray:
    """base ** exponent; small whole powers by multiplication, as compilers do."""
    whole = small_power(node)
    if whole is None:
        return base**exponent
    result = base
    for _ in range(whole - 1):
        result = result * base
    return result


def small_power(node: Binary) -> int | None:
    """The exponent where it is a whole number from 1 to 8, which is written and computed as a product."""
    right = node.right
    if isinstance(right, Number) and right.value in range(1, 9):
        return int(right.value)
    return None


Steps = Iterable[Sequence[str]]


def needed(steps: Steps, names: Iterable[str]) -> list[tuple[str, Node]]:
    """The steps, parsed, that some names need, in their order."""
    wanted = set(names)
    kept = []
    for name, text in reversed(list(steps)):
        if name in wanted:
            node = parse(text)
            kept.append((name, node))
            wanted |= names_in(node)
    return kept[::-1]


def evaluate_steps(steps: Steps, given: Mapping[str, FloatArray], names: Iterable[str]) -> dict[str, FloatArray]:
    """Named results of a sequence of steps at flat arrays of one size; steps that nothing needs are left out."""
    wanted = list(names)
    parsed = needed(steps, wanted)
    size = next(iter(given.values())).size
    found = {name: np.empty(size) for name in wanted}
    with np.errstate(all="ignore"):
        for start in range(0, size, CHUNK):
            part = slice(start, start + CHUNK)
            values = {name: array[part] for name, array in given.items()}
            for name, node in parsed:
                values[name] = evaluate(node, values)
            for name in wanted:
                found[name][part] = values[name]
    return found
