"""Hashes: of values, of a configuration, and of the physics, that is the code and constants that solve.

The physics hash is taken from the syntax trees of the solver's modules, without docstrings, comments, annotations
and imports, so that it changes when an expression or a constant does and not when a line is broken elsewhere.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import importlib.util
import json
import pathlib
from typing import Any

import numpy as np

# what decides Phi_F and Phi_A; island4d adds what its axes mean (its reading's numbers are configuration)
SOLVER = (
    "mbma_tables.islands._height_coefficients",
    "mbma_tables.islands.height_integrals",
    "mbma_tables.islands.spectral",
    "mbma_tables.islands.newton",
    "mbma_tables.islands.greenwood_tripp",
)
GEOMETRY = (
    "mbma_tables.surfaces.spectrum",
    "mbma_tables.islands.geometry",
    "mbma_tables.islands.four_numbers",
)


def _source(module: str) -> str:
    """Source text of a module, found without importing it."""
    spec = importlib.util.find_spec(module)
    if spec is None or spec.origin is None:
        raise ModuleNotFoundError(module)
    return pathlib.Path(spec.origin).read_text(encoding="utf-8")


def _is_silent(node: Any) -> bool:
    """Whether a statement computes nothing: an import, a docstring, an annotation without a value."""
    if isinstance(node, ast.Expr):
        return isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    return isinstance(node, ast.Import | ast.ImportFrom) or (isinstance(node, ast.AnnAssign) and node.value is None)


def normal_form(node: Any) -> Any:
    """A syntax tree as nested lists that do not depend on the Python version or on formatting."""
    if isinstance(node, ast.AnnAssign) and node.value is not None:
        return normal_form(ast.Assign(targets=[node.target], value=node.value))
    if isinstance(node, ast.AST):
        kept = []
        for name, value in sorted(ast.iter_fields(node)):
            # fields that are empty, or that say nothing of what is computed
            if name in ("annotation", "returns", "ctx", "kind", "type_comment", "type_params"):
                continue
            shown = normal_form(value)
            if shown not in (None, []):
                kept.append([name, shown])
        return [type(node).__name__, kept]
    if isinstance(node, list):
        return [normal_form(item) for item in node if not _is_silent(item)]
    if node is None or isinstance(node, str):
        return node
    return f"{type(node).__name__}:{node!r}"


def code_digest(source: str) -> str:
    """SHA-256 of a source text's normal form."""
    return digest_json(normal_form(ast.parse(source)))


@functools.cache
def physics_digest(modules: tuple[str, ...]) -> str:
    """SHA-256 of the physics in these modules as installed now."""
    return digest_json([[name, code_digest(_source(name))] for name in modules])


def digest_json(content: Any) -> str:
    """SHA-256 of a JSON value in its canonical form."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()


def digest_arrays(arrays: dict[str, Any]) -> str:
    """SHA-256 of named arrays: names, shapes, and bytes in little-endian order."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.asarray(arrays[name])
        plain = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("<"))
        digest.update(f"{name}:{plain.dtype.str}:{plain.shape};".encode())
        digest.update(plain.tobytes())
    return digest.hexdigest()
