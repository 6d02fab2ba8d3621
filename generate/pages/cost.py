"""What accuracy costs: tables/cost.csv, docs/cost.md and its figure, every time a ratio to one fixed piece of work."""

from __future__ import annotations

import csv
import io
import json
import pathlib
import platform
import tempfile
from collections.abc import Sequence
from importlib import metadata

from generate.pages import timing
from generate.pages.cost_islands import island_rows
from generate.pages.cost_page import draw, parts_of
from generate.pages.cost_totals import brute_force_rows, total_rows
from mbma_tables.scenes.costs import COLUMNS, UNIT, Row, read_costs

LIBRARIES = ("numpy", "scipy", "numba")
HEAD = """\
# What accuracy costs, measured by python -m generate pages cost; docs/cost.md says how. Costs are times over that of a
# fixed piece of work in the same run; the row of tier unit has its seconds. Times of boundary_elements are of others'
# machines.
"""


def to_csv(rows: Sequence[Row]) -> str:
    """The rows as text."""
    versions = {name: metadata.version(name) for name in LIBRARIES} | {"python": platform.python_version()}
    text = io.StringIO()
    text.write(HEAD)
    text.write(f"# {json.dumps({'machine': platform.machine()} | versions)}\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in rows:
        numbers = ("" if number is None else f"{number:.4g}" for number in (row.error, row.cost, row.evaluations))
        writer.writerow((row.tier, row.variant, row.quantity, *numbers))
    return text.getvalue()


def study() -> list[Row]:
    """Every measurement, in a few minutes."""
    seconds = [timing.measure(lambda: None)[1]]
    rows = island_rows()
    seconds.append(timing.measure(lambda: None)[1])
    rows += total_rows()
    # the least: what else the machine does can only add
    unit = min(*seconds, timing.measure(lambda: None)[1])
    return [Row(UNIT, "seconds", "both", None, unit), *rows, *brute_force_rows(unit)]


def measure() -> tuple[dict[str, str], dict[str, bytes]]:
    """The measured parts of the page, and its files."""
    content = to_csv(study()).encode()
    # the page shows what the file holds, rounded as it is there
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "cost.csv"
        path.write_bytes(content)
        costs = read_costs(path)
    return parts_of(costs), {"tables/cost.csv": content, "docs/figures/cost.png": draw(costs)}
