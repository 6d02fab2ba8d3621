"""Exported JavaScript answers as the runtime does."""

from __future__ import annotations

import json
import pathlib
import shutil
import subprocess

import code_points
import pytest

from mbma_tables.export.code import write_code
from mbma_tables.export.conformance import check

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")


@pytest.mark.parametrize("reading", ["reported", "printed"])
def test_equal_to_the_runtime(reading: str, tmp_path: pathlib.Path) -> None:
    write_code("javascript", tmp_path, reading=reading)
    code_points.assert_equal_to_runtime(check("javascript", tmp_path, code_points.write_points(tmp_path, reading)))


def test_what_has_no_answer_has_a_status_and_nan(tmp_path: pathlib.Path) -> None:
    write_code("javascript", tmp_path)
    asks = """
import { STATUS, formula, islandGeometry, phi, phiSlopes, total } from "./mbma.mjs";
const surface = { hurst: 0.8, q0: 1, q1: 100, h_rms: 1, h_max: 3 };
const answers = [
  phi(NaN, 1), phiSlopes(1, -1), phi("1", undefined), islandGeometry(0, 0.8, 100), total(surface, -3.1),
  total({ ...surface, hurst: NaN }, 1), total(surface, 1, 0), total(surface, 1, 1, 1), total(surface, Infinity),
  formula(NaN, 1),
];
console.log(JSON.stringify(answers.map(({ status, ...rest }) => [
  status === STATUS.INVALID, Object.values(rest).length > 0, Object.values(rest).every(Number.isNaN)])));
"""
    (tmp_path / "ask.mjs").write_text(asks, encoding="utf-8")
    done = subprocess.run(["node", "ask.mjs"], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True)
    assert json.loads(done.stdout) == [[True, True, True]] * 10
