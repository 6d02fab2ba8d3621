"""Measured costs of the methods, from tables/cost.csv.

A cost is a time divided by that of a fixed piece of work timed in the same run; the row "unit" has the seconds
of that work on the machine that measured. `python -m generate cost` measures.
"""

import csv
import functools
import math
import pathlib
from typing import Any, NamedTuple

from mbma_tables.common.files import shipped_file

UNIT = "unit"
TEXTS = ("island_model", "variant", "quantity", "theory", "way")  # text fields


class Row(NamedTuple):
    """One measurement: method, task, largest relative error found, time and evaluations."""

    island_model: str
    variant: str  # "gap rtol=1e-06", "island", "open"
    quantity: str  # "both", or "pressure" that a law is inverted for
    error: float | None
    cost: float  # time over that of the fixed work; seconds in the row of island model `UNIT`
    evaluations: float | None = None  # islands for a gap, pressures for an exact island, height integrals for a table

    @property
    def what(self) -> str:
        """The variant without its tolerance."""
        return self.variant.partition(" rtol=")[0]

    @property
    def rtol(self) -> float | None:
        """The requested tolerance, if the variant contains one."""
        _, found, text = self.variant.partition(" rtol=")
        return float(text) if found else None


class Costs(NamedTuple):
    """All measurements of a file, and the seconds of the fixed piece of work where they were made."""

    rows: tuple[Row, ...]
    seconds: float

    def of(self, island_model: str, what: str, rtol: float | None = None) -> float:
        """Seconds at the loosest measured tolerance that meets `rtol`, else the tightest; NaN if none was measured."""
        rows = [row for row in self.rows if row.island_model == island_model and row.what == what]
        if not rows:
            return math.nan
        # calls and opening a table have one row, without a tolerance
        met = [row for row in rows if row.rtol is None or rtol is None or row.rtol <= rtol * (1 + 1e-9)]
        row = max(met, key=lambda row: row.rtol or 0.0) if met else min(rows, key=lambda row: row.rtol or 0.0)
        return self.seconds * row.cost


class Distance(NamedTuple):
    """A method for a theory: its cost, and the theory's deviation from boundary elements on held-out surfaces.

    Deviations are root mean squares of ln(theory/simulation), of area at equal force and of force at equal mean
    separation, light at 1-10% contact and deep at 10-97%.
    """

    theory: str
    way: str
    cost: float  # cost of a point, over that of the fixed work
    once: float  # cost of preparing a surface
    area_light: float
    area_deep: float
    force_light: float
    force_deep: float
    reached_light: float  # share of simulated loads that the theory reaches
    reached_deep: float


def _records(kind: Any, path: pathlib.Path) -> tuple[Any, ...]:
    """Rows of a CSV file whose columns are the fields of a kind; an empty cell is no number."""
    with path.open(encoding="utf-8", newline="") as file:
        records = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return tuple(
        kind(**{n: text if n in TEXTS else float(text) if text else None for n, text in record.items()})
        for record in records
    )


@functools.cache
def shipped_distances() -> tuple[Distance, ...]:
    """The distances that ship with the library."""
    return _records(Distance, shipped_file("distance.csv"))


def read_costs(path: pathlib.Path) -> Costs:
    """Costs from a CSV file."""
    rows = _records(Row, path)
    (seconds,) = (row.cost for row in rows if row.island_model == UNIT)
    return Costs(rows, seconds)


@functools.cache
def shipped_costs() -> Costs:
    """The costs that ship with the library."""
    return read_costs(shipped_file("cost.csv"))
