from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from mbma_tables.cli.cost import cost_command
from mbma_tables.errors import InputError
from mbma_tables.scenes import costs


@pytest.fixture
def kept(tmp_path, monkeypatch):
    path = tmp_path / "cost.json"
    monkeypatch.setattr(costs, "calibration_path", lambda: path)
    yield path
    costs.shipped_costs.cache_clear()


def answer(*arguments):
    return CliRunner().invoke(cost_command, arguments, catch_exceptions=False)


def test_table_has_a_line_for_each_row(kept):
    lines = answer("--tier", "universal").output.splitlines()
    rows = [row for row in costs.read_costs(costs.cost_file()).measured if row.tier == "universal"]
    assert len(lines) == 2 + len(rows)
    assert "--calibrate" in lines[0]
    assert lines[1].split() == ["tier", "asked", "of", "error", "cost", "seconds", "evaluations"]
    assert all(line.startswith("universal") for line in lines[2:])


def test_json_gives_seconds_of_the_measuring_machine(kept):
    found = json.loads(answer("--json").output)
    assert found["calibrated"] is False
    for row in found["rows"]:
        assert row["seconds"] == pytest.approx(row["cost"] * found["unit_seconds"], rel=1e-12, abs=0)


def test_calibration_is_kept_and_used(kept, monkeypatch):
    before = {(r["tier"], r["variant"], r["quantity"]): r for r in json.loads(answer("--json").output)["rows"]}

    def measured(shipped):
        return costs.Calibration(0.5, {"exact": 2.0}, shipped.data_hash)

    monkeypatch.setattr(costs, "calibrate", measured)
    assert f"exact 2.00; kept in {kept}" in answer("--calibrate").output
    found = json.loads(answer("--json").output)
    assert found["calibrated"] is True
    for row in found["rows"]:
        factor = 2.0 if row["tier"] == "exact" else 1.0
        own = before[row["tier"], row["variant"], row["quantity"]]
        assert row["cost"] == pytest.approx(factor * own["cost"], rel=1e-12, abs=0)
        assert row["seconds"] == pytest.approx(0.5 * row["cost"], rel=1e-12, abs=0)


def test_unknown_tier_is_refused(kept):
    with pytest.raises(InputError, match="--tier must be one of"):
        answer("--tier", "best")
