"""How many ideas the library has: its classes, what answers, what is a law, and files that a change takes."""

from __future__ import annotations

import ast
import collections
import pathlib
import re
from collections.abc import Iterator, Mapping

from generate.files import ROOT
from generate.page import table

PACKAGE = ROOT / "mbma_tables"
FORCES = ("pressure", "force", "F_hat", "phi_F")
AREAS = ("area", "A_hat", "phi_A")
OF_LAWS = (*FORCES, *AREAS, "separation", "mean_separation", "stiffness")
RECIPE = re.compile(r"(.+)\n(?:.|\n)*?(\w+) files change")
Classes = Mapping[str, list[tuple[pathlib.Path, ast.ClassDef]]]


def classes(package: pathlib.Path = PACKAGE) -> Classes:
    """Classes of modules by name, with their file."""
    by_name = collections.defaultdict(list)
    for path in sorted(package.rglob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef):
                by_name[node.name].append((path, node))
    return by_name


def _bases(node: ast.ClassDef, known: Classes) -> Iterator[ast.ClassDef]:
    """Bases of a class that the library has."""
    for base in node.bases:
        name = re.split(r"[.\[]", ast.unparse(base))[0]
        for _, other in known.get(name, [])[:1]:
            if other is not node:
                yield other


def members(node: ast.ClassDef, known: Classes) -> dict[str, str]:
    """Whether each name of a class is a value, that is a field or a property, an option of a caller, or a function."""
    kinds: dict[str, str] = {}
    for base in _bases(node, known):
        kinds |= members(base, known)
    for part in node.body:
        if isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name):
            is_option = part.value is not None and ast.unparse(part.value) == "None"
            kinds[part.target.id] = "option" if is_option else "value"
        elif isinstance(part, ast.Assign) and isinstance(part.targets[0], ast.Name):
            # properties and methods that another function makes
            is_value = ast.unparse(part.value).startswith("property(")
            kinds[part.targets[0].id] = "value" if is_value else "function"
        elif isinstance(part, ast.FunctionDef):
            decorators = map(ast.unparse, part.decorator_list)
            is_value = any("property" in decorator for decorator in decorators)
            kinds[part.name] = "value" if is_value else "function"
    return kinds


def of_contacts(known: Classes) -> tuple[list[str], list[str]]:
    """Names of the classes that answer, and of those that are laws.

    An answer has a force or pressure and an area as values; a law has two or more of them,
    of gaps and stiffness as functions.
    """
    answers, laws = [], []
    for name, found in known.items():
        for _, node in found:
            kinds = members(node, known)
            values = [each for each, kind in kinds.items() if kind == "value"]
            functions = [each for each, kind in kinds.items() if kind == "function"]
            if any(each in values for each in FORCES) and any(
                each in values for each in AREAS
            ):
                answers.append(name)
            if sum(each in functions for each in OF_LAWS) > 1:
                laws.append(name)
    return sorted(answers), sorted(laws)


def files_of_recipes() -> dict[str, str]:
    """Files that a change takes, by the headings of CONTRIBUTING.md."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    found = map(RECIPE.match, text.split("\n## "))
    return {recipe[1]: recipe[2].lower() for recipe in found if recipe}


def ideas() -> str:
    """The counts as a table."""
    known = classes()
    answers, laws = of_contacts(known)
    total = sum(map(len, known.values()))
    rows = [
        ("classes", str(total), "all that stand in modules of `mbma_tables`"),
        ("kinds of answers", str(len(answers)), ", ".join(f"`{n}`" for n in answers)),
        ("kinds of laws", str(len(laws)), ", ".join(f"`{n}`" for n in laws)),
    ]
    for heading, count in files_of_recipes().items():
        what = heading[0].lower() + heading[1:]
        rows.append((f"files for {what}", count, "by the recipe of `CONTRIBUTING.md`"))
    return table("what | number | which", rows)
