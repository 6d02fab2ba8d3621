"""What each way to an answer costs: the shipped measurements, and what they mean on this machine.

Costs are ratios to one fixed piece of work, `fixed_work`, timed in the same run. `python -m generate cost` measures
them and writes `cost.csv`; `calibrate` times the fixed work and a few tiers on the machine at hand.
"""

from __future__ import annotations

import csv
import dataclasses
import functools
import hashlib
import json
import math
import pathlib
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import InputError, TableFileError
from mbma_tables.files import shipped_file, write_file

if TYPE_CHECKING:
    from mbma_tables.surfaces.surface import Surface

COLUMNS = ("tier", "variant", "quantity", "error", "cost")
EVALUATIONS = "evaluations"  # a further column, which a file may lack
QUANTITIES = ("both", "force", "area")
UNIT = "unit"  # the tier of the row whose cost is the seconds of the fixed work where the file was measured
LARGEST_FILE = 2**20
WORK_SIZE = 2**15
ROUNDS = (2, 25)  # of a measurement, fewest and most
CALIBRATED_RTOL = 1e-6
CALIBRATED_TIERS = ("universal", "island4d", "exact", "formula", "rigid")
GAPS = 50  # a surface, of a measured batch of totals
LONGEST_FACTOR = 1e4  # between two machines; beyond it a calibration is no measurement

# H, zeta_1, q0 h_rms, h_max/h_rms of surfaces that no table, formula or fit was made from
HELD_OUT = (
    (0.35, 40.0, 0.05, 3.1),
    (0.52, 1300.0, 0.02, 3.4),
    (0.63, 14.0, 0.30, 2.7),
    (0.74, 330.0, 0.10, 3.0),
    (0.86, 6100.0, 0.18, 3.6),
    (0.97, 90.0, 0.08, 3.8),
)


@dataclasses.dataclass(frozen=True)
class Row:
    """One measurement.

    Attributes
    ----------
    tier, variant : str
        What answered, and what was asked of it: "gap rtol=1e-06", "island", "open".
    quantity : str
        One of `QUANTITIES`.
    error : float or None
        Largest relative error found on held-out surfaces or islands.
    cost : float
        Time over that of the fixed work; seconds in the row of tier `UNIT`.
    evaluations : float or None
        Kernel evaluations: islands of a gap, pressures of a solved island, height integrals of a looked-up one.
    """

    tier: str
    variant: str
    quantity: str
    error: float | None
    cost: float
    evaluations: float | None = None

    @property
    def what(self) -> str:
        """The variant without its tolerance."""
        return self.variant.partition(" rtol=")[0]

    @property
    def rtol(self) -> float | None:
        """The tolerance asked for, where the variant names one."""
        _, found, text = self.variant.partition(" rtol=")
        return float(text) if found else None


def variant(what: str, rtol: float | None = None) -> str:
    """The name of a variant."""
    return what if rtol is None else f"{what} rtol={rtol:.0e}"


@dataclasses.dataclass(frozen=True)
class Calibration:
    """How a machine differs from the one that measured.

    Attributes
    ----------
    seconds : float
        Of the fixed work.
    factors : mapping
        By tier, its cost over the shipped one.
    data_hash : str
        Of the measurements that it belongs to.
    """

    seconds: float
    factors: Mapping[str, float]
    data_hash: str


@dataclasses.dataclass(frozen=True)
class Costs:
    """Costs in units of the fixed piece of work, and the seconds that it takes.

    Attributes
    ----------
    seconds : float
        Of the fixed work, here if calibrated, else where it was measured.
    rows : dict
        (tier, what, quantity) to (log10 of rtol, or NaN where there is none, cost) pairs.
    factors : mapping
        By tier, what a calibration found its cost to be over the measured one.
    measured : tuple of Row
        The file as it is.
    data_hash : str
        SHA-256 of the file's bytes.
    """

    seconds: float
    rows: dict[tuple[str, str, str], tuple[tuple[float, float], ...]]
    factors: Mapping[str, float] = dataclasses.field(default_factory=dict)
    measured: tuple[Row, ...] = ()
    data_hash: str = ""

    def knows(self, tier: str, what: str) -> bool:
        """Whether anything was measured."""
        return any((tier, what, quantity) in self.rows for quantity in QUANTITIES)

    def of(self, tier: str, what: str, rtol: float | None = None, quantity: str = "both") -> float:
        """Predicted seconds on this machine; 0 of what was not measured.

        Between two measured tolerances it is interpolated in the logarithms of both; beyond the loosest and the
        tightest it is the nearest one's. A quantity that was not measured alone costs what both do.
        """
        return self.seconds * self.units(tier, what, rtol, quantity)

    def units(self, tier: str, what: str, rtol: float | None = None, quantity: str = "both") -> float:
        """The same in units of the fixed work."""
        points = self.rows.get((tier, what, quantity)) or self.rows.get((tier, what, "both")) or ()
        if not points:
            return 0.0
        factor = self.factors.get(tier, 1.0)
        if rtol is None or math.isnan(points[0][0]):
            return factor * points[0][1]
        if not (math.isfinite(rtol) and rtol > 0):
            raise InputError(f"rtol must be finite and positive, got {rtol!r}")
        places, costs = zip(*sorted(points), strict=True)
        return factor * math.exp(float(np.interp(math.log10(rtol), places, np.log(costs))))

    def calibrated(self, found: Calibration | None) -> Costs:
        """The same with a calibration, where it is of these measurements."""
        if found is None or found.data_hash != self.data_hash:
            return self
        return dataclasses.replace(self, seconds=found.seconds, factors=found.factors)


def pareto_front(cost: Sequence[float], error: Sequence[float]) -> list[int]:
    """Places that nothing beats in both cost and error, cheapest first."""
    front: list[int] = []
    for place in sorted(range(len(cost)), key=lambda k: (cost[k], error[k])):
        if not front or error[place] < error[front[-1]]:
            front.append(place)
    return front


def _number(record: dict[str, Any], name: str, path: pathlib.Path) -> float | None:
    if not record.get(name):
        return None
    try:
        number = float(record[name])
    except (TypeError, ValueError):
        number = math.nan
    if not (math.isfinite(number) and number >= 0):
        raise TableFileError(f"{path}: {name} must be a number of at least 0, got {record[name]!r}")
    return number


def _row(record: dict[str, Any], path: pathlib.Path) -> Row:
    cost = _number(record, "cost", path)
    if not cost or record["quantity"] not in QUANTITIES or None in record:
        raise TableFileError(f"{path}: no cost above 0 of one of {QUANTITIES} in {list(record.values())}")
    error, evaluations = (_number(record, name, path) for name in ("error", EVALUATIONS))
    row = Row(record["tier"], record["variant"], record["quantity"], error, cost, evaluations)
    try:
        good = row.rtol is None or (math.isfinite(row.rtol) and row.rtol > 0)
    except ValueError:
        good = False
    if not good:
        raise TableFileError(f"{path}: {row.variant!r} names no positive rtol")
    return row


def read_costs(path: pathlib.Path) -> Costs:
    """Costs of a file of `COLUMNS`, as they were measured.

    Raises
    ------
    TableFileError
        Where it cannot be read, is no cost file, or has no row of the fixed work.
    """
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST_FILE + 1)
        text = data.decode("utf-8")
    except (OSError, UnicodeDecodeError) as fault:
        raise TableFileError(f"{path} cannot be read ({fault}); reinstall mbma_tables") from None
    if len(data) > LARGEST_FILE:
        raise TableFileError(f"{path} is larger than {LARGEST_FILE} bytes: no cost data")
    reader = csv.DictReader(line for line in text.splitlines() if line and not line.startswith("#"))
    try:
        if tuple(reader.fieldnames or ()) not in (COLUMNS, (*COLUMNS, EVALUATIONS)):
            raise TableFileError(f"{path}: columns must be {', '.join(COLUMNS)}, got {reader.fieldnames}")
        measured = tuple(_row(record, path) for record in reader)
    except csv.Error as fault:
        raise TableFileError(f"{path} is no CSV: {fault}") from None
    seconds = [row.cost for row in measured if row.tier == UNIT]
    if len(seconds) != 1:
        raise TableFileError(f"{path} has no one row unit,seconds: make it anew with `python -m generate cost`")
    rows: dict[tuple[str, str, str], list[tuple[float, float]]] = {}
    for row in measured:
        place = math.nan if row.rtol is None else math.log10(row.rtol)
        rows.setdefault((row.tier, row.what, row.quantity), []).append((place, row.cost))
    grouped = {key: tuple(points) for key, points in rows.items()}
    return Costs(seconds[0], grouped, {}, measured, hashlib.sha256(data).hexdigest())


def cost_file() -> pathlib.Path:
    """Where the shipped measurements stand."""
    return shipped_file("cost.csv")


@functools.lru_cache(maxsize=4)
def shipped_costs() -> Costs:
    """The shipped costs, with this machine's calibration where there is one of them."""
    return read_costs(cost_file()).calibrated(read_calibration())


@functools.cache
def _work_points() -> FloatArray:
    points: FloatArray = np.linspace(-5.0, 5.0, WORK_SIZE)
    points.flags.writeable = False
    return points


def fixed_work() -> float:
    """The piece of work that costs 1: the sum of erfcx at 32768 points between -5 and 5, by scipy."""
    from scipy.special import erfcx

    return float(erfcx(_work_points()).sum())


def _work_seconds() -> float:
    """The least of three times: what else the machine does can only add."""
    taken = []
    for _ in range(3):
        before = time.perf_counter()
        fixed_work()
        taken.append(time.perf_counter() - before)
    return min(taken)


def measure(run: Callable[[], Any], budget: float = 0.5) -> tuple[float, float]:
    """Cost of one call and the seconds of the fixed work.

    Both are timed in turns, each call against the work before and after it, and the median ratio is taken: a
    machine that slows down for a while slows both.

    Parameters
    ----------
    run : callable
        Its first call is not timed.
    budget : float
        Seconds after which no further round begins, but for the second.
    """
    run()
    fixed_work()
    clock = time.perf_counter
    started = clock()
    run()
    # short runs are repeated until the clock and its calls no longer count
    calls = max(1, math.ceil(2e-3 / max(clock() - started, 1e-7)))
    works, ratios = [_work_seconds()], []
    started = clock()
    for number in range(ROUNDS[1]):
        before = clock()
        for _ in range(calls):
            run()
        spent = (clock() - before) / calls
        works.append(_work_seconds())
        ratios.append(2 * spent / (works[-2] + works[-1]))
        if number + 1 >= ROUNDS[0] and clock() - started > budget:
            break
    return statistics.median(ratios), min(works)


def held_out_surfaces() -> list[Surface]:
    """The surfaces on which totals are measured, with q0 = 1."""
    from mbma_tables.surfaces.surface import Surface

    return [Surface(hurst, 1.0, zeta_1, rough, top * rough) for hurst, zeta_1, rough, top in HELD_OUT]


def measured_gaps(surface: Surface, count: int = GAPS) -> FloatArray:
    """Gaps evenly over [-h_max/2, h_max), the upper end left out."""
    return np.linspace(-0.5, 1.0, count, endpoint=False) * float(surface.h_max)


def gap_batch(tier: str, rtol: float, **options: Any) -> Callable[[], list[Any]]:
    """A batch of totals: `GAPS` gaps of each held-out surface, one call a surface."""
    from mbma_tables.totals.contact import contact

    pairs = [(surface, measured_gaps(surface)) for surface in held_out_surfaces()]
    return lambda: [contact(surface, gap, tier=tier, rtol=rtol, **options) for surface, gap in pairs]


def calibrate(costs: Costs) -> Calibration:
    """Time the fixed work and each tier's totals here, in a few seconds."""
    shipped = dataclasses.replace(costs, factors={})
    factors, least = {}, math.inf
    for tier in CALIBRATED_TIERS:
        if not costs.knows(tier, "gap"):
            continue
        found, seconds = measure(gap_batch(tier, CALIBRATED_RTOL), budget=0.3)
        expected = GAPS * shipped.units(tier, "gap", CALIBRATED_RTOL) + shipped.units(tier, "call")
        factors[tier] = found / (len(HELD_OUT) * expected)
        least = min(least, seconds)
    if not factors:
        raise TableFileError("the cost data hold no tier's gaps: nothing to calibrate by")
    return Calibration(least, factors, costs.data_hash)


def calibration_path() -> pathlib.Path:
    """The user's file for the calibration."""
    import click

    return pathlib.Path(click.get_app_dir("mbma_tables")) / "cost.json"


def write_calibration(calibration: Calibration, path: pathlib.Path | None = None) -> pathlib.Path:
    """Keep a calibration, written whole or not at all; returns where."""
    target = calibration_path() if path is None else path
    content = json.dumps(dataclasses.asdict(calibration), indent=2) + "\n"
    write_file(target, content.encode(), make_folders=True)
    return target


def read_calibration(path: pathlib.Path | None = None) -> Calibration | None:
    """The calibration that was kept; None where there is none or it is not one."""
    target = calibration_path() if path is None else path
    try:
        with target.open(encoding="utf-8") as file:
            held = json.loads(file.read(LARGEST_FILE))
        factors = {str(tier): float(factor) for tier, factor in held["factors"].items()}
        found = Calibration(float(held["seconds"]), factors, str(held["data_hash"]))
    except (OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
        return None
    plausible = all(1 / LONGEST_FACTOR < factor < LONGEST_FACTOR for factor in factors.values())
    return found if plausible and math.isfinite(found.seconds) and found.seconds > 0 else None
