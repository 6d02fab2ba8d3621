from __future__ import annotations

import dataclasses
import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mbma_tables.errors import InputError, TableFileError
from mbma_tables.scenes import costs as module
from mbma_tables.scenes.costs import (
    COLUMNS,
    Calibration,
    calibrate,
    cost_file,
    fixed_work,
    measure,
    pareto_front,
    read_calibration,
    read_costs,
    variant,
    write_calibration,
)

HEADER = ",".join(COLUMNS)
SOME = f"""# a comment
{HEADER},evaluations
unit,seconds,both,,0.002,
universal,gap rtol=1e-02,both,1e-9,4,50
universal,gap rtol=1e-06,both,1e-9,16,60
universal,gap rtol=1e-06,force,1e-9,10,60
universal,call,both,,3,
"""


def read(tmp_path, text):
    path = tmp_path / "cost.csv"
    path.write_text(text, encoding="utf-8")
    return read_costs(path)


def test_cost_is_seconds_and_between_tolerances_geometric(tmp_path):
    costs = read(tmp_path, SOME)
    assert costs.of("universal", "gap", 1e-2) == pytest.approx(0.008, rel=1e-12, abs=0)
    # half way in both logarithms: sqrt(4 * 16)
    assert costs.of("universal", "gap", 1e-4) == pytest.approx(0.016, rel=1e-12, abs=0)
    assert costs.of("universal", "gap", 1e-9) == costs.of("universal", "gap", 1e-6)
    assert costs.of("universal", "gap", 1e-6, "force") == pytest.approx(0.020, rel=1e-12, abs=0)
    # area alone was not measured
    assert costs.of("universal", "gap", 1e-6, "area") == costs.of("universal", "gap", 1e-6)
    assert costs.of("universal", "call", 1e-6) == pytest.approx(0.006, rel=1e-12, abs=0)
    assert costs.of("universal", "law", 1e-6) == 0.0
    assert costs.knows("universal", "gap")
    assert not costs.knows("exact", "gap")


@pytest.mark.parametrize("rtol", [0.0, -1.0, math.nan, math.inf])
def test_tolerance_without_a_logarithm_is_refused(tmp_path, rtol):
    with pytest.raises(InputError, match="rtol must be finite and positive"):
        read(tmp_path, SOME).of("universal", "gap", rtol)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "tier,cost\nunit,1\n",
        f"{HEADER}\nuniversal,gap,both,,1\n",
        f"{HEADER}\nunit,seconds,both,,1\nunit,seconds,both,,1\n",
        f"{HEADER}\nunit,seconds,both,,nan\n",
        f"{HEADER}\nunit,seconds,both,,0\n",
        f"{HEADER}\nunit,seconds,both,,-1\n",
        f"{HEADER}\nunit,seconds,both,,one\n",
        f"{HEADER}\nunit,seconds,both,inf,1\n",
        f"{HEADER}\nunit,seconds,neither,,1\n",
        f"{HEADER}\nunit,seconds,both,,1,2,3\n",
        f"{HEADER}\nunit,seconds\n",
        f"{HEADER}\nunit,seconds,both,,1\nexact,gap rtol=none,both,,1\n",
        f"{HEADER}\nunit,seconds,both,,1\nexact,gap rtol=-1,both,,1\n",
    ],
)
def test_files_that_are_no_cost_data_are_refused(tmp_path, text):
    with pytest.raises(TableFileError, match=r"cost\.csv"):
        read(tmp_path, text)


def test_a_file_that_is_missing_binary_or_huge_is_refused(tmp_path):
    with pytest.raises(TableFileError, match="cannot be read"):
        read_costs(tmp_path / "none.csv")
    path = tmp_path / "cost.csv"
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(TableFileError, match="cannot be read"):
        read_costs(path)
    path.write_bytes(b"#" * (module.LARGEST_FILE + 1))
    with pytest.raises(TableFileError, match="larger than"):
        read_costs(path)


def test_shipped_data_have_what_plans_need():
    costs = read_costs(cost_file())
    for tier in ("exact", "universal", "island4d", "rigid"):
        for what in ("gap", "call", "import", "island"):
            assert costs.knows(tier, what), (tier, what)
    assert costs.knows("law", "invert")
    assert costs.knows("exact", "profile")
    errors = [row.error for row in costs.measured if row.tier == "universal" and row.what == "gap"]
    assert 0 < max(errors) <= 1e-8
    # an exact total at a tight tolerance is dearer than a looked-up one
    assert costs.of("exact", "gap", 1e-8) > 3 * costs.of("universal", "gap", 1e-8)


@given(st.lists(st.tuples(st.floats(1e-6, 1e6), st.floats(1e-14, 1.0)), min_size=1, max_size=30))
def test_front_is_what_nothing_beats(points):
    cost, error = zip(*points, strict=True)
    front = pareto_front(cost, error)
    for k in front:
        assert not any(c <= cost[k] and e <= error[k] and (c, e) != points[k] for c, e in points)
    for c, e in points:
        assert any(cost[k] <= c and error[k] <= e for k in front)


def test_variants_and_rows_agree_on_names(tmp_path):
    rows = {(row.variant, row.what, row.rtol) for row in read(tmp_path, SOME).measured}
    assert (variant("gap", 1e-6), "gap", 1e-6) in rows
    assert (variant("call"), "call", None) in rows


def test_calibration_scales_its_tier_and_the_fixed_work(tmp_path):
    costs = read(tmp_path, SOME)
    found = Calibration(0.004, {"universal": 1.5}, costs.data_hash)
    here = costs.calibrated(found)
    assert here.of("universal", "gap", 1e-2) == pytest.approx(4 * 1.5 * 0.004, rel=1e-12, abs=0)
    assert costs.calibrated(dataclasses.replace(found, data_hash="another")) is costs
    assert costs.calibrated(None) is costs


def test_calibration_is_kept_and_damage_passed_over(tmp_path):
    path = tmp_path / "deep" / "cost.json"
    assert read_calibration(path) is None
    found = Calibration(0.004, {"universal": 1.5}, "abc")
    assert write_calibration(found, path) == path
    assert read_calibration(path) == found
    assert [p.name for p in path.parent.iterdir()] == ["cost.json"]
    good = json.loads(path.read_text(encoding="utf-8"))
    for damage in ({"seconds": -1}, {"seconds": "x"}, {"factors": {"exact": 1e9}}, {"factors": [1]}):
        path.write_text(json.dumps(good | damage), encoding="utf-8")
        assert read_calibration(path) is None
    path.write_text("[]", encoding="utf-8")
    assert read_calibration(path) is None


def test_calibrate_measures_the_tiers_of_the_data(tmp_path, monkeypatch):
    costs = read(tmp_path, SOME)
    asked = []

    def batch(tier, rtol):
        asked.append(tier)
        return lambda: None

    monkeypatch.setattr(module, "gap_batch", batch)
    # six surfaces, each one call and 50 gaps of 16: a machine that needs just that has factor 1
    monkeypatch.setattr(module, "measure", lambda run, budget: (6 * (50 * 16 + 3), 0.5))
    found = calibrate(costs)
    assert asked == ["universal"]
    assert found == Calibration(0.5, {"universal": pytest.approx(1, rel=1e-12, abs=0)}, costs.data_hash)


def test_measure_counts_the_fixed_work_itself_as_one(monkeypatch):
    clock = [0.0]
    monkeypatch.setattr(module.time, "perf_counter", lambda: clock[0])

    def work():
        clock[0] += 1e-3

    monkeypatch.setattr(module, "fixed_work", work)

    def run():
        clock[0] += 5e-3

    cost, seconds = measure(run)
    assert cost == pytest.approx(5, rel=1e-9, abs=0)
    assert seconds == pytest.approx(1e-3, rel=1e-9, abs=0)


def test_fixed_work_is_the_integral_of_erfcx_over_its_step():
    mpmath = pytest.importorskip("mpmath")
    integral = mpmath.quad(lambda x: mpmath.exp(x * x) * mpmath.erfc(x), [-5, -4, -2, 0, 2, 5])
    ends = mpmath.exp(25) * (mpmath.erfc(5) + mpmath.erfc(-5)) / 2
    step = mpmath.mpf(10) / (module.WORK_SIZE - 1)
    # the trapezoidal rule errs by step^2/12 (f'(5) - f'(-5)), 8e-8 of the sum
    assert fixed_work() == pytest.approx(float(integral / step + ends), rel=1e-6, abs=0)
