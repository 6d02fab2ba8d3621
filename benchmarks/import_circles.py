"""Circles of imports among a package's modules, however they are written.

Imports inside functions and under TYPE_CHECKING count, and so do the modules that a file
with a call of `import_module` or `__import__` names in strings, whether in the call itself
or in a table that the call reads.

`python benchmarks/import_circles.py [package]` prints one line a circle, and ends with 1
where there is one.
"""

import ast
import pathlib
import sys

CALLS = ("import_module", "__import__")


def imports_of(name: str, path: pathlib.Path, known: set[str]) -> set[str]:
    """Modules among the known ones that a file imports anywhere, but for the packages that it lies in."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    found = set()
    strings = set()
    imports_by_name = False
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            inner = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= inner & known or {node.module}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            # absolute, or relative to the package
            strings |= {node.value, f"{package}.{node.value.lstrip('.')}"}
        elif isinstance(node, ast.Call):
            imports_by_name |= name_of(node.func) in CALLS
    if imports_by_name:
        found |= strings
    return {other for other in found & known if other != name}


def name_of(called: ast.expr) -> str:
    """The name of a function, without that of its module."""
    if isinstance(called, ast.Attribute):
        return called.attr
    return called.id if isinstance(called, ast.Name) else ""


def import_graph(
    package: pathlib.Path,
) -> tuple[dict[str, set[str]], dict[str, pathlib.Path]]:
    """What each module imports of the others, and their files; the package itself is left out."""
    names = (
        (path, path.relative_to(package.parent).with_suffix("").parts)
        for path in sorted(package.rglob("*.py"))
    )
    files = {".".join(parts).removesuffix(".__init__"): path for path, parts in names}
    # the package itself, which names all that is public, is asked for its version alone
    del files[package.name]
    return {
        name: imports_of(name, path, set(files)) for name, path in files.items()
    }, files


def circles(package: pathlib.Path) -> list[list[str]]:
    """Groups of modules that reach one another."""
    graph, _ = import_graph(package)
    reached = {name: set(others) for name, others in graph.items()}
    for middle in graph:
        for others in reached.values():
            if middle in others:
                others |= reached[middle]
    groups = {
        tuple(n for n in graph if n in reached[name] and name in reached[n])
        for name in graph
    }
    return [list(group) for group in sorted(groups) if group]


if __name__ == "__main__":
    found = circles(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "mbma_tables"))
    for group in found:
        print(" ".join(group))
    sys.exit(bool(found))
