"""The costs that plans state, from a file of measurements."""

import math

import pytest

from mbma_tables.common.files import shipped_file
from mbma_tables.scenes.costs import Row, read_costs, shipped_costs
from mbma_tables.theories import THEORIES

HEADER = ",".join(Row._fields)
SOME = f"""# a comment
{HEADER}
unit,seconds,both,,0.002,
universal,gap rtol=1e-02,both,1e-9,4,50
universal,gap rtol=1e-06,both,1e-9,16,60
universal,gap rtol=1e-06,pressure,1e-9,10,60
universal,call,both,,3,
"""


def read(tmp_path, text):
    path = tmp_path / "cost.csv"
    path.write_text(text, encoding="utf-8")
    return read_costs(path)


@pytest.mark.parametrize(
    ("asked", "cost"),
    [
        (("universal", "gap", 1e-2), 4),
        # the loosest measured tolerance that meets the one asked for, beyond all of them the tightest
        (("universal", "gap", 1e-1), 4),
        (("universal", "gap", 1e-4), 16),
        (("universal", "gap", 1e-9), 16),
        (("universal", "gap", 1e-6, "pressure"), 10),
        # area alone was not measured
        (("universal", "gap", 1e-6, "area"), 16),
        (("universal", "call", 1e-6), 3),
        (("universal", "law", 1e-6), math.nan),
    ],
)
def test_costs_are_those_of_the_measured_row(tmp_path, asked, cost):
    assert read(tmp_path, SOME).of(*asked) == pytest.approx(0.002 * cost, rel=1e-12, abs=0, nan_ok=True)


def test_shipped_costs_have_what_plans_need():
    costs = shipped_costs()
    needed = [
        (island_model, what)
        for island_model in ("exact", "universal", "rigid")
        for what in ("gap", "call", "import", "law")
    ]
    needed += [("law", "lookup"), ("law", "invert"), ("exact", "profile"), ("scene", "call")]
    needed += [(name, what) for name in THEORIES[1:] for what in ("gap", "call", "invert", "energy", "law")]
    needed += [("island4d", "gap")]
    for island_model, what in needed:
        assert 0 < costs.of(island_model, what, 1e-4, "pressure") < 10, (island_model, what)
    errors = [row.error for row in costs.rows if row.island_model == "universal" and row.what == "gap"]
    assert 0 < max(errors) <= 1e-8
    assert costs.of("exact", "gap", 1e-8) > 3 * costs.of("universal", "gap", 1e-8)
    assert read_costs(shipped_file("cost.csv")) == costs
