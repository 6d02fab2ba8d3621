"""Mistreated files: every text format that the library reads is spoilt at random; a typed error or a right file.

MBMA_FUZZ sets how many inputs each format gets; CI takes few.
"""

import copy
import json
import os
import pathlib

import numpy as np
import pytest

from mbma_tables import MbmaError, Scene
from mbma_tables.formulas import file as formula_file
from mbma_tables.scenes.costs import read_costs
from mbma_tables.tablefiles.shipped import shipped_file

INPUTS = int(os.environ.get("MBMA_FUZZ", "300"))
EXAMPLES = pathlib.Path(__file__).parents[1] / "examples"
WORDS = [
    b"",
    b"nan",
    b"inf",
    b"-1",
    b"1e400",
    b"[",
    b"]",
    b"{",
    b"}",
    b"=",
    b",",
    b"\x00",
    b"\xff",
    b"'",
    b'"',
    b"0" * 400,
]
ODD = [None, True, -1, 0, 1e308, "", "x" * 5000, [], {}, [[]], "1e400", "__import__('os')", 10**40]


def spoilt(text, rng):
    """Bytes with a few cut, doubled, swapped or replaced places."""
    data = bytearray(text)
    for _ in range(rng.integers(1, 5)):
        at, to = sorted(rng.integers(0, len(data) + 1, 2))
        kind = rng.integers(5)
        if kind == 0:
            del data[at : min(to, at + 40)]
        elif kind == 1:
            data[at:at] = data[at : min(to, at + 200)]
        elif kind == 2:
            data[at:at] = WORDS[rng.integers(len(WORDS))]
        elif kind == 3 and data:
            data[min(at, len(data) - 1)] = rng.integers(256)
        else:
            data = data[: max(at, 1)]
    return bytes(data)


def places(node, path=()):
    """Every place in a JSON document."""
    yield path
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, child in items:
        yield from places(child, (*path, key))


def replaced(document, path, value):
    """The document with something else at one place."""
    if not path:
        return value
    other = copy.deepcopy(document)
    node = other
    for key in path[:-1]:
        node = node[key]
    if value is None and isinstance(node, dict):
        del node[path[-1]]
    else:
        node[path[-1]] = value
    return other


def refused_or_whole(read):
    """Whether the file was taken; anything but a typed error or an OSError comes through."""
    try:
        read()
    except (MbmaError, OSError):
        return False
    return True


def test_formula_bytes(tmp_path):
    rng = np.random.default_rng(1)
    path, text = tmp_path / "formula.json", shipped_file("formula.json").read_bytes()
    taken = 0
    for _ in range(INPUTS):
        path.write_bytes(spoilt(text, rng))
        taken += refused_or_whole(lambda: formula_file.read(path))
    # the hash notices every change of content
    assert taken <= 0.02 * INPUTS


def test_formula_structure():
    rng = np.random.default_rng(2)
    document = json.loads(shipped_file("formula.json").read_bytes())
    every = list(places(document))
    points = {"X": np.array([1.0]), "mu": np.array([1.0])}
    for _ in range(INPUTS):
        other = replaced(document, every[rng.integers(len(every))], ODD[rng.integers(len(ODD))])
        if isinstance(other, dict):
            try:
                other["data_hash"] = formula_file.data_hash(other)
            except (ValueError, TypeError):
                continue

        def use(other=other):
            found = formula_file.check(other)
            found.forms["pocket"].evaluate(points)

        refused_or_whole(use)


@pytest.mark.parametrize("name", sorted(path.name for path in EXAMPLES.glob("scene_*.toml")))
def test_scene_files(name, tmp_path):
    rng = np.random.default_rng(3)
    path, text = tmp_path / "scene.toml", (EXAMPLES / name).read_bytes()
    for _ in range(INPUTS // 3):
        path.write_bytes(spoilt(text, rng))
        refused_or_whole(lambda: Scene.from_toml(path))


def test_cost_files(tmp_path):
    rng = np.random.default_rng(4)
    path, text = tmp_path / "cost.csv", shipped_file("cost.csv").read_bytes()
    for _ in range(INPUTS):
        path.write_bytes(spoilt(text, rng))
        refused_or_whole(lambda: read_costs(path))
