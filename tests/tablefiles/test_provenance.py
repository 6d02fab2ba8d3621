"""Hashes follow values and nothing else; no hash of source text decides what opens."""

import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest

import mbma_tables
from generate.provenance import MODULES, source_digest
from mbma_tables.tablefiles.netcdf import digest_arrays, digest_json
from mbma_tables.tablefiles.schema import ISLAND4D, KINDS, UNIVERSAL

PACKAGE = pathlib.Path(mbma_tables.__file__).parent


def test_the_source_digest_is_that_of_the_files():
    assert set(MODULES[UNIVERSAL]) < set(MODULES[ISLAND4D])
    python, c = ([name for name in MODULES[ISLAND4D] if ("/" in name) == is_c] for is_c in (False, True))
    assert (*c, *python) == MODULES[ISLAND4D]
    files = [PACKAGE.parent / path for path in (*c, *(f"{name.replace('.', '/')}.py" for name in python))]
    joined = b"".join(file.read_bytes() for file in files)
    assert source_digest(MODULES[ISLAND4D]) == hashlib.sha256(joined).hexdigest()
    with pytest.raises(ModuleNotFoundError, match=r"mbma_tables\.nowhere"):
        source_digest(("mbma_tables.nowhere",))


@pytest.mark.slow
def test_renaming_a_local_variable_of_the_solver_changes_nothing_outside(tmp_path):
    for name in ("mbma_tables", "tables"):
        shutil.copytree(PACKAGE.parent / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    solver = tmp_path / "mbma_tables" / "islands" / "greenwood_tripp.py"
    source = solver.read_text(encoding="utf-8")
    renamed, count = re.subn(r"\bdigits\b", "decimal_digits", source)
    assert count > 1
    solver.write_text(renamed, encoding="utf-8")
    command = [sys.executable, "-W", "error", "-m", "mbma_tables", "tables", "verify"]
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    made = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    lines = made.stdout.splitlines()
    assert made.stderr == ""
    assert [line.partition(": ")[0] for line in lines] == [str(tmp_path / "tables" / f"{kind}.nc") for kind in KINDS]
    assert all("hashes match; 64 conformance points" in line for line in lines)


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
    by_hand = hashlib.sha256(b"a:<f8:(6,);" + x.astype("<f8").tobytes()).hexdigest()
    assert digest_arrays({"a": x}) == by_hand


def test_json_in_its_canonical_form():
    assert digest_json({"b": [1, 2.5, "é"], "a": None}) == digest_json({"a": None, "b": [1, 2.5, "\u00e9"]})
    assert digest_json({"a": 1}) == hashlib.sha256(b'{"a":1}').hexdigest()
    assert len({digest_json(v) for v in (1, 1.0, "1", [1], {"1": 1}, None, True)}) == 7
