"""`mbma cost`."""

import pytest
from click.testing import CliRunner

from mbma_tables.cli import main
from mbma_tables.scenes.costs import UNIT, shipped_costs


def answer(*arguments):
    return CliRunner().invoke(main, ["cost", *arguments])


def test_the_table_has_a_line_for_each_row():
    title, _, header, *lines = answer("--tier", "universal").output.splitlines()
    assert len(lines) == sum(row.tier == "universal" for row in shipped_costs().rows)
    assert "fixed piece of work" in title
    assert header.split() == ["tier", "variant", "quantity", "error", "cost", "seconds", "evaluations"]
    assert all(line.startswith("universal") for line in lines)


def test_seconds_are_costs_times_the_unit():
    _, _, header, *lines = answer().output.splitlines()
    place = header.index("seconds") + len("seconds")
    for row, line in zip([row for row in shipped_costs().rows if row.tier != UNIT], lines, strict=True):
        shown = float(line[:place].split()[-1])
        assert shown == pytest.approx(row.cost * shipped_costs().seconds, rel=1e-5, abs=0)


def test_an_unknown_tier_is_refused():
    result = answer("--tier", "best")
    assert result.exit_code == 2
    assert "--tier must be one of" in result.output
