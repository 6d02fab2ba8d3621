"""Hashes: the same for the same physics, values and configuration, another for anything else."""

import ast
import dataclasses
import hashlib
import json
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_tables import small_table

from generate.tables.configuration import load
from mbma_tables.tablefiles import provenance
from mbma_tables.tablefiles.netcdf import MODULES
from mbma_tables.tablefiles.provenance import code_digest, digest_arrays, digest_json, normal_form, physics_digest
from mbma_tables.tablefiles.schema import ISLAND4D, KINDS, UNIVERSAL

SOURCE = '''"""Module."""

import math

LIMIT: float = 1e-3
TABLE = {"a": (1, 2.5, -3), **{}}

def pressure(d: float, mu: float = 2.0, *rest, deep: bool = False) -> float:
    """Pressure at a gap."""
    if d > LIMIT and not deep:
        return 0.5 * mu * (d - LIMIT) ** 1.5
    parts = [math.exp(-x) for x in rest if x]
    total = sum(parts) or None
    while (step := total) is not None:
        total -= step
        break
    return f"{total:.3e} of {mu}" + "done"
'''
# whatever Python runs this
DIGEST = "38ada74a638760fb947f32ce81174bbf22f7a178794738acc63899274069b853"

SAME = {
    "comments": SOURCE.replace("    if d", "    # why\n    if d  # and more\n").replace("  # and more\n", "", 1),
    "blank lines": SOURCE.replace("\n", "\n\n").replace("\n\n\n\n", "\n\n\n"),
    "printed anew": ast.unparse(ast.parse(SOURCE)),
    "docstrings": SOURCE.replace('"""Pressure at a gap."""', '"""Something else."""').replace('"""Module."""', ""),
    "no docstring": SOURCE.replace('    """Pressure at a gap."""\n', ""),
    "parentheses": SOURCE.replace("0.5 * mu * (d - LIMIT) ** 1.5", "((0.5 * mu) * ((d - LIMIT) ** (1.5)))"),
    "broken lines": SOURCE.replace("0.5 * mu *", "(0.5\n * mu) *").replace("d: float, ", "\n    d: float,\n    "),
    "other annotations": SOURCE.replace("float", "FloatArray").replace(" -> FloatArray", ""),
    "no annotations": SOURCE.replace(": float", "").replace(": bool", "").replace(" -> float", ""),
    "annotated variables": SOURCE.replace("    total = sum", "    total: Any = sum"),
    "declared variables": SOURCE.replace("    total = sum", "    total: Any\n    total = sum"),
    "numbers written otherwise": SOURCE.replace("1e-3", "0.001").replace("1.5", "15e-1"),
    "quotes": SOURCE.replace('{"a"', "{'a'").replace('"done"', "'do' 'ne'"),
    "imports": SOURCE.replace("import math\n", "import math\nfrom typing import Any\n"),
    "tabs and line ends": SOURCE.replace("    ", "\t").replace("\n", "\r\n"),
}
OTHER = {
    "a constant": SOURCE.replace("0.5", "0.5000000000000001"),
    "a module's constant": SOURCE.replace("1e-3", "1.1e-3"),
    "an integer for a float": SOURCE.replace("2.0", "2"),
    "a default": SOURCE.replace("mu: float = 2.0", "mu: float = 3.0"),
    "a sign": SOURCE.replace("math.exp(-x)", "math.exp(x)"),
    "an operator": SOURCE.replace("(d - LIMIT)", "(d + LIMIT)"),
    "operands": SOURCE.replace("(d - LIMIT)", "(LIMIT - d)"),
    "a comparison": SOURCE.replace("d > LIMIT", "d >= LIMIT"),
    "a logical operator": SOURCE.replace("and not", "or not"),
    "grouping": SOURCE.replace("0.5 * mu * (d - LIMIT) ** 1.5", "(0.5 * mu * (d - LIMIT)) ** 1.5"),
    "a function": SOURCE.replace("math.exp", "math.expm1"),
    "a condition less": SOURCE.replace("d > LIMIT and not deep", "d > LIMIT"),
    "a statement less": SOURCE.replace("        total -= step\n", ""),
    "statements swapped": SOURCE.replace(
        "        total -= step\n        break", "        break\n        total -= step"
    ),
    "an entry": SOURCE.replace("2.5, -3", "-3, 2.5"),
    "a decorator": SOURCE.replace("def pressure", "@staticmethod\ndef pressure"),
    "a name": SOURCE.replace("def pressure", "def force"),
}


def test_the_same_under_every_python_and_numpy():
    assert code_digest(SOURCE) == DIGEST


@pytest.mark.parametrize("what", SAME)
def test_formatting_does_not_count(what):
    assert SAME[what] != SOURCE
    assert code_digest(SAME[what]) == code_digest(SOURCE)


@pytest.mark.parametrize("what", OTHER)
def test_what_is_computed_counts(what):
    assert OTHER[what] != SOURCE
    assert code_digest(OTHER[what]) != code_digest(SOURCE)
    assert len({code_digest(source) for source in OTHER.values()}) == len(OTHER)


@given(st.floats(allow_nan=False, allow_infinity=False, min_value=0), st.floats(min_value=0, allow_infinity=False))
def test_every_constant_counts(first, second):
    one, other = (code_digest(f"def f(x: float) -> float:\n    return x * {value!r}\n") for value in (first, second))
    assert (one == other) == (first == second)


def test_the_normal_form_is_plain_json():
    form = normal_form(ast.parse(SOURCE))
    assert json.loads(json.dumps(form)) == form


@pytest.mark.parametrize("kind", KINDS)
def test_every_module_of_the_physics_counts(kind, monkeypatch):
    assert set(MODULES[UNIVERSAL]) < set(MODULES[ISLAND4D])
    own = physics_digest.__wrapped__(MODULES[kind])
    assert own == physics_digest(MODULES[kind])
    read = provenance._source
    for module in MODULES[kind]:
        source = read(module)
        monkeypatch.setattr(provenance, "_source", lambda n, m=module, s=source: s + "\nx = 1\n" if n == m else read(n))
        assert physics_digest.__wrapped__(MODULES[kind]) != own
        printed = ast.unparse(ast.parse(source))
        monkeypatch.setattr(provenance, "_source", lambda n, m=module, s=printed: s if n == m else read(n))
        assert physics_digest.__wrapped__(MODULES[kind]) == own


@pytest.mark.parametrize(
    ("module", "old", "new"),
    [
        ("mbma_tables.islands.greenwood_tripp", "math.pi / 5 * mu", "math.pi / 6 * mu"),
        ("mbma_tables.surfaces.spectrum", "0.8968", "0.8967"),
        ("mbma_tables.islands.four_numbers", "8.0 / 3.0", "8.0 / 3.1"),
    ],
)
def test_a_constant_of_the_physics_counts(module, old, new, monkeypatch):
    own = physics_digest.__wrapped__(MODULES[ISLAND4D])
    read = provenance._source
    source = read(module)
    assert old in source
    monkeypatch.setattr(provenance, "_source", lambda n: source.replace(old, new) if n == module else read(n))
    assert physics_digest.__wrapped__(MODULES[ISLAND4D]) != own


def test_the_same_in_another_process_of_another_hash_seed():
    command = (
        "from mbma_tables.tablefiles.provenance import physics_digest\n"
        f"print([physics_digest(m) for m in {list(MODULES.values())!r}])"
    )
    found = subprocess.run(
        [sys.executable, "-c", command],
        env={**os.environ, "PYTHONHASHSEED": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert found.stdout.strip() == str([physics_digest(modules) for modules in MODULES.values()])


def test_arrays_count_by_name_shape_type_and_bytes():
    x = np.arange(6.0)
    own = digest_arrays({"a": x, "b": x + 1})
    assert own == digest_arrays({"b": x + 1, "a": x})
    assert own == digest_arrays({"a": x.astype(">f8"), "b": np.repeat(x + 1, 2)[::2]})
    others = [
        {"a": x},
        {"b": x, "a": x + 1},
        {"a": x, "c": x + 1},
        {"a": x.reshape(2, 3), "b": x + 1},
        {"a": x.astype("f4"), "b": x + 1},
        {"a": np.nextafter(x, 9.0), "b": x + 1},
        {"a": -x, "b": x + 1},
    ]
    assert len({own, *(digest_arrays(other) for other in others)}) == len(others) + 1
    assert digest_arrays({"a": np.zeros(2)}) != digest_arrays({"a": -np.zeros(2)})
    by_hand = hashlib.sha256(b"a:<f8:(6,);" + x.astype("<f8").tobytes()).hexdigest()
    assert digest_arrays({"a": x}) == by_hand


def test_the_data_version_follows_the_values():
    content = small_table(UNIVERSAL)
    names = content.arrays()
    assert {"X", "mu", "log_ratio_F", "log_ratio_A", "spline_F", "error_A", "conformance_tolerance"} <= set(names)
    own = digest_arrays(names)
    for name, values in names.items():
        changed = values.copy()
        changed.flat[-1] = np.nextafter(changed.flat[-1], np.inf)
        assert digest_arrays({**names, name: changed}) != own, name


def test_json_in_its_canonical_form():
    assert digest_json({"b": [1, 2.5, "é"], "a": None}) == digest_json({"a": None, "b": [1, 2.5, "\u00e9"]})
    assert digest_json({"a": 1}) == hashlib.sha256(b'{"a":1}').hexdigest()
    assert len({digest_json(v) for v in (1, 1.0, "1", [1], {"1": 1}, None, True)}) == 7


@pytest.mark.parametrize("kind", KINDS)
def test_a_configuration_counts_by_what_it_says(kind, tmp_path):
    own = load(kind).digest()
    path = tmp_path / "own.toml"

    path.write_text(f"# nothing new\n\nseed   =  {load(kind).seed}   # as it is\n", encoding="utf-8")
    assert load(kind, path).digest() == own
    numbers = {"seed": 1, "target": 0.0123, "most_nodes": 10**6, "certificate_points": 5001, "reading": "printed"}
    others = [dataclasses.replace(load(kind), **{name: value}) for name, value in numbers.items()]
    for name, axis in load(kind).axes.items():
        for changes in ({"low": 0.25}, {"high": 20.0}, {"offset": 12.0}, {"nodes": 40}):
            axes = {**load(kind).axes, name: dataclasses.replace(axis, **changes)}
            others.append(dataclasses.replace(load(kind), axes=axes))
    assert len({own, *(other.digest() for other in others)}) == len(others) + 1
