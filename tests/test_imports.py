"""Nothing imports what is above it, by `benchmarks/import_circles.py`, or asks which theory it has."""

import ast
import pathlib
import tomllib

import pytest

from benchmarks import import_circles
from mbma_tables import theories

ROOT = pathlib.Path(__file__).parents[1]
# a module that imports the one above it
HIDDEN = {
    "in a function": "def ask():\n    from planted import above\n    return above",
    "for types": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import planted.above",
    "by a string": "import importlib\ndef ask():\n    return importlib.import_module('planted.above')",
    "by a relative string": "from importlib import import_module\nMADE = import_module('.above', __package__)",
    "by a built-in function": "def ask():\n    return __import__('planted.above')",
    "by a table of strings": "import importlib\nHOMES = {'Above': 'above'}\n"
    "def ask(name):\n    return importlib.import_module(f'planted.{HOMES[name]}')",
}


@pytest.mark.parametrize("package", ["mbma_tables", "generate"])
def test_no_module_reaches_itself(package):
    assert import_circles.circles(ROOT / package) == []


@pytest.mark.parametrize("how", HIDDEN)
def test_a_hidden_circle_is_found(tmp_path, how):
    package = tmp_path / "planted"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "above.py").write_text("from planted import below\n")
    (package / "below.py").write_text("")
    assert import_circles.circles(package) == []
    (package / "below.py").write_text(HIDDEN[how])
    assert import_circles.circles(package) == [["planted.above", "planted.below"]]


def upward(graph):
    """Imports of a room from one that is above it, by the contract of layers."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    layers = settings["tool"]["importlinter"]["contracts"][0]["layers"]
    floors = {
        room: floor
        for floor, layer in enumerate(reversed(layers))
        for room in layer.split(" : ")
    }
    for name, others in graph.items():
        own = name.split(".")[1]
        for other in others:
            room = other.split(".")[1]
            if floors[room] > floors[own]:
                yield name, other


def test_no_import_runs_upwards_also_where_a_string_hides_it():
    graph, _ = import_circles.import_graph(ROOT / "mbma_tables")
    assert len(graph) > 150
    assert list(upward(graph)) == []
    graph["mbma_tables.theories.base"].add("mbma_tables.contacts.contact")
    planted = ("mbma_tables.theories.base", "mbma_tables.contacts.contact")
    assert list(upward(graph)) == [planted]


NAMES = {repr(name) for name in (*theories.THEORIES, *theories.OF_MAPS)}
CLASSES = {type(theories.resolve(name)).__name__ for name in theories.THEORIES}
CLASSES |= {"Simulated", "BoundaryElements"}


def named(node):
    """Names and literals of an expression, as they are written."""
    for part in ast.walk(node):
        if isinstance(part, ast.Attribute):
            yield part.attr
        elif isinstance(part, ast.Name | ast.Constant):
            yield ast.unparse(part)


def questions(tree):
    """Comparisons and questions for a type that name a theory."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            if not (NAMES | CLASSES).isdisjoint(named(node)):
                yield ast.unparse(node)
        elif isinstance(node, ast.Call):
            asks_type = import_circles.name_of(node.func) in ("isinstance", "issubclass")
            if asks_type and not CLASSES.isdisjoint(named(node.args[1])):
                yield ast.unparse(node)


PLANTED = """
if theory.name == "mbma" or name in ("persson", other):
    pass
if isinstance(theory, (theories.Mbma, Other)) or theory.name == Calibrated.name:
    pass
"""


def test_a_question_for_a_theorys_name_or_type_is_found():
    assert len(list(questions(ast.parse(PLANTED)))) == 4


def test_no_question_for_a_theorys_name_or_type_outside_of_theories():
    asked = {}
    for path in sorted((ROOT / "mbma_tables").rglob("*.py")):
        if "theories" not in path.parts:
            found = list(questions(ast.parse(path.read_text(encoding="utf-8"))))
            if found:
                asked[path.name] = found
    assert asked == {}
