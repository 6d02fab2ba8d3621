"""Density of Python code: how much of it a reader has to hold in mind at once, as a table of folders.

python benchmarks/density.py mbma_tables generate

A line of code is one that is neither empty nor a comment nor part of a docstring.
"""

import ast
import dataclasses
import pathlib
import sys
from collections.abc import Iterable, Iterator

# names that hide what a value is
HIDING = frozenset(
    [
        "found",
        "own",
        "known",
        "held",
        "kept",
        "told",
        "asked",
        "looked",
        "given",
    ]
)
Comprehension = ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp
LONGEST = 90  # characters of a line that fits beside another on a screen


@dataclasses.dataclass
class Density:
    """Counts of one or more sources, and the figures that follow from them."""

    lines: int = 0
    nodes: int = 0
    long_lines: int = 0
    comments: int = 0
    nested: int = 0  # comprehensions in others, or with more than one loop
    packed: int = 0  # assignments of several values to several names in one statement
    any_types: int = 0  # occurrences of the text, those in longer names too
    names: int = 0  # assigned
    hiding_names: int = 0

    def __add__(self, other: "Density") -> "Density":
        """Counts of both."""
        total = Density()
        for field in dataclasses.fields(Density):
            setattr(
                total, field.name, getattr(self, field.name) + getattr(other, field.name)
            )
        return total

    def figures(self) -> dict[str, float]:
        """What is compared between projects, by heading."""
        lines = max(self.lines, 1)
        return {
            "nodes/line": self.nodes / lines,
            f"> {LONGEST} [%]": 100 * self.long_lines / lines,
            "comments/100": 100 * self.comments / lines,
            "nested/1000": 1000 * self.nested / lines,
            "packed/1000": 1000 * self.packed / lines,
            "Any/1000": 1000 * self.any_types / lines,
            "hiding [%]": 100 * self.hiding_names / max(self.names, 1),
        }


def docstring_lines(tree: ast.Module) -> set[int]:
    """Numbers of the lines of texts that stand alone as a statement."""
    numbers: set[int] = set()
    for node in ast.walk(tree):
        if not isinstance(node, ast.Expr) or not isinstance(node.value, ast.Constant):
            continue
        if isinstance(node.value.value, str):
            last = node.end_lineno or node.lineno
            numbers.update(range(node.lineno, last + 1))
    return numbers


def is_nested(comprehension: Comprehension) -> bool:
    """Whether a comprehension has several loops, or another one inside."""
    if len(comprehension.generators) > 1:
        return True
    inside = (node for node in ast.walk(comprehension) if node is not comprehension)
    return any(isinstance(node, Comprehension) for node in inside)


def is_packed(node: ast.AST) -> bool:
    """Whether a statement assigns a tuple of values to a tuple of names; swaps count too."""
    if not isinstance(node, ast.Assign):
        return False
    return isinstance(node.targets[0], ast.Tuple) and isinstance(node.value, ast.Tuple)


def density(source: str) -> Density:
    """Counts of one source."""
    tree = ast.parse(source)
    in_docstrings = docstring_lines(tree)
    counts = Density(any_types=source.count("Any"))
    for number, line in enumerate(source.splitlines(), 1):
        if not line.strip() or number in in_docstrings:
            continue
        if line.strip().startswith("#"):
            counts.comments += 1
            continue
        counts.lines += 1
        counts.long_lines += len(line) > LONGEST
    for node in ast.walk(tree):
        counts.nodes += 1
        counts.packed += is_packed(node)
        if isinstance(node, Comprehension):
            counts.nested += is_nested(node)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            counts.names += 1
            counts.hiding_names += node.id in HIDING
    return counts


def sources(folder: pathlib.Path) -> Iterator[str]:
    """Sources of a folder, or the source of a file, without those of tests."""
    files = [folder] if folder.is_file() else folder.rglob("*.py")
    for file in sorted(files):
        # as the shell does, without hidden folders; environments are in them
        parts = file.relative_to(folder).parts
        is_hidden = any(part.startswith(".") for part in parts)
        is_test = any(part.startswith("test") for part in parts)
        if not is_hidden and not is_test:
            yield file.read_text(encoding="utf-8")


def table(folders: Iterable[pathlib.Path]) -> str:
    """A row for each folder."""
    headings = ["code lines", *Density().figures()]
    rows = ["  ".join([f"{'':22}", *headings])]
    for folder in folders:
        total = sum(map(density, sources(folder)), Density())
        cells = [f"{folder.name:22}", f"{total.lines:{len(headings[0])}}"]
        for heading, figure in total.figures().items():
            cells.append(f"{figure:{len(heading)}.1f}")
        rows.append("  ".join(cells))
    return "\n".join(rows)


if __name__ == "__main__":
    print(table(pathlib.Path(argument).resolve() for argument in sys.argv[1:]))
