"""The plan of a scene, its steps from effects and tolerance, and the measured costs of tables/cost.csv.

The plan depends on the scene only: the island model is the universal table where its certificate suffices, else the
exact solver, and many gaps of other theories are evaluated by a contact law. A step whose results amplify the error of
force and area by a factor (`AMPLIFICATION`) has the tolerance over that factor; one half of it is for the islands, the
other for the quadrature.

A cost is a time divided by that of a fixed piece of work timed in the same run; the row "unit" has the seconds
of that work on the machine that measured. `python -m generate cost` measures.
"""

import csv
import dataclasses
import functools
import math
import pathlib
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from mbma_tables.common.errors import InputError
from mbma_tables.common.files import shipped_file
from mbma_tables.scenes.problem import INVERTED, OF_CONTACT, OUTPUTS, REFINEMENTS, Problem
from mbma_tables.theories.mbma.island_models import AnyModel

TABLES = ("universal", "island4d")  # island models that are tables
ISLAND_SHARE = 0.5  # share of a step's tolerance; the rest is for its quadrature
# gaps found from pressures add their error to that of the values; the elastic errors of force and of area at that force
# add up where points yield; p(r) at a point converges later than its integrals
AMPLIFICATION = {"inverse": 2.0, "slopes": 2.0, "yield": 2.0, "profile": 10.0}
MIN_ENERGY_RTOL = 2e-9  # of an integral to 1e-9
MIN_LAW_GAPS, MIN_LAW_RTOL = 150, 1e-9  # gaps from which a law pays where costs were not measured
# of MBMA, over the fixed piece of work: once and for each gap, besides the totals
OF_MBMA = {"inverse": (2.1, 3e-3), "slopes": (0.3, 5e-4), "energy": (7.0, 0.28)}
YIELDING_CALL, YIELDING_GAP = 2.2, 2.6  # over an elastic call, and over one of many elastic gaps (docs/yield.md)
LAST = 0.95  # largest share of h_max at which the error of a theory is looked up
LADDER = (1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1)


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
        by_rtol = sorted((row.rtol or 0.0, row.cost) for row in rows)
        met = [cost for tight, cost in by_rtol if rtol is None or tight <= rtol * (1 + 1e-9)]
        return self.seconds * (met[-1] if met else by_rtol[0][1])


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


@dataclasses.dataclass(frozen=True)
class Step:
    """One step of a plan."""

    name: str
    why: str  # effects that need it
    what: str  # description of its evaluation
    island_model: str | AnyModel | None
    rtol: float | None  # relative tolerance of the totals, the law or the solver
    count: int  # gaps, islands or points evaluated
    error: float  # certified beforehand; NaN if known from the results only
    seconds: float  # by the measured costs, without first use; NaN where nothing was measured
    theory: str | None = None  # name of the scene's theory, in steps that use it

    @property
    def island_model_name(self) -> str | None:
        """The island model's name."""
        return getattr(self.island_model, "name", self.island_model)  # type: ignore[arg-type]


@dataclasses.dataclass(frozen=True)
class Plan:
    """Steps in the order in which they run."""

    steps: tuple[Step, ...]
    left_out: tuple[str, ...]  # effects that were not requested
    switched_off: tuple[str, ...]  # refinements of the model that are off
    rtol: float  # tolerance of the plan
    overhead: float  # seconds that every scene takes
    first_use: float  # seconds that the first scene of a process takes besides; no choice depends on it
    theory: str = "mbma"

    @property
    def seconds(self) -> float:
        """Seconds for all steps and the overhead, without first use."""
        return self.overhead + sum(step.seconds for step in self.steps)

    @property
    def error(self) -> float:
        """Largest error of a step of the scene's theory; those compared state their own."""
        return max((step.error for step in self.steps if step.island_model is not None or step.theory), default=0.0)

    def text(self) -> str:
        """The plan as text, like a query plan of a database."""
        times = f"time={duration(self.seconds)}, first use in a process {duration(self.first_use)} more"
        lines = [f"Scene  (rtol={self.rtol:.1e}, {_bound(self.error)}, {times})", f"  theory: {self.theory}"]
        for step in self.steps:
            source = step.island_model_name or step.theory
            by = "" if source is None else f" by {source}"
            asked = "" if step.rtol is None else f", rtol={step.rtol:.1e}"
            numbers = f"(count={step.count}{asked}, {_bound(step.error)}, time={duration(step.seconds)})"
            lines += [f"  -> {step.name}{by}  {numbers}", f"       {step.what}", f"       for: {step.why}"]
        lines.append(f"  left out: {', '.join(self.left_out) or 'nothing'}")
        if self.switched_off:
            lines.append(f"  switched off: {', '.join(self.switched_off)}")
        return "\n".join(lines) + "\n"


def _bound(error: float) -> str:
    return "error not certified" if math.isnan(error) else f"error={error:.1e}"


def duration(seconds: float) -> str:
    """A time in its unit."""
    if math.isnan(seconds):
        return "not measured"
    unit, size = next(((u, s) for u, s in (("s", 1.0), ("ms", 1e-3)) if seconds >= s), ("us", 1e-6))
    return f"{seconds / size:.3g} {unit}"


def make_plan(problem: Problem) -> Plan:
    """The steps that meet the tolerance, or the tightest tolerance of `LADDER` whose steps fit the time budget."""
    if problem.rtol is not None:
        return _Planner(problem, problem.rtol).plan()
    assert problem.seconds is not None
    least = math.nan
    for rtol in LADDER:
        try:
            plan = _Planner(problem, rtol).plan()
        except InputError:
            continue  # too tight for the energy
        if plan.error > rtol:
            continue  # too tight for the theory
        if math.isnan(plan.seconds):
            step = next(step for step in plan.steps if math.isnan(step.seconds))
            unknown = f"theory {step.theory!r}" if step.theory else f"step {step.name!r}"
            raise InputError(f"the cost of {unknown} is not known: give rtol instead of seconds")
        if plan.seconds <= problem.seconds:
            return plan
        least = plan.seconds
    raise InputError(f"seconds = {problem.seconds:g} is too little: the cheapest plan takes about {least:.3g} s")


def certified_error(island_model: str | AnyModel, asked: float) -> float:
    """Bound on the relative error of islands, for results at `asked`; NaN if it is known afterwards only."""
    if island_model == "universal":
        from mbma_tables.theories.mbma.tables import open_table

        certificate = open_table(island_model).content.attributes
        return max(float(certificate["largest_error_F"]), float(certificate["largest_error_A"]))
    # the exact solver works to a tenth of the requested tolerance
    return {"exact": 0.1 * asked, "rigid": 0.0}.get(_name(island_model), math.nan)


@dataclasses.dataclass(frozen=True)
class _Planner:
    """The plan of one problem at one tolerance."""

    problem: Problem
    rtol: float
    costs: Costs = dataclasses.field(default_factory=shipped_costs)

    @property
    def count(self) -> int:
        return 0 if self.problem.gaps is None else int(self.problem.gaps.size)

    def plan(self) -> Plan:
        problem, outputs, dropped = self.problem, self.problem.outputs, self.problem.dropped
        hertz = "area" in outputs and "subscale_area" in dropped
        wanted = [name for name in OF_CONTACT if name in outputs and not (name == "area" and hertz)]
        if problem.prescribed in INVERTED:
            wanted.append(f"{problem.prescribed} prescribed")
        steps = [self.contact(wanted)] if wanted else []
        if hertz:
            what = "adaptive sum over islands with eta = 1, the Hertz area"
            steps.append(self.summed("hertz area", "area without subscale_area", what, "island4d"))
        if "island_statistics" in outputs:
            what = f"number of islands at {self.count} gaps, {problem.points} islands of the distribution (Eq. 42)"
            steps.append(self.summed("island statistics", "island_statistics", what, "rigid"))
        if "pressure_profile" in outputs:
            islands, asked = int(np.size(problem.deltas)), ISLAND_SHARE * self.rtol / AMPLIFICATION["profile"]
            what, seconds = "the island problem solved with p(r) and d(r)", self.costs.of("exact", "profile", asked)
            steps.append(Step("profiles", "pressure_profile", what, "exact", asked, islands, asked, islands * seconds))
        for name in problem.theories:
            closed = name == "greenwood_williamson"
            error, seconds = 1e-14 if closed else 1e-9, self.costs.of(name if closed else "persson", "gap")
            what = "another theory at the same gaps"
            steps.append(Step(name, "comparison", what, None, None, self.count, error, self.count * seconds))
        left_out = tuple(name for name in OUTPUTS if name not in outputs)
        switched_off = tuple(name for name in REFINEMENTS if name in dropped)
        island_models = {step.island_model for step in steps if isinstance(step.island_model, str)}
        first_use = max((self.costs.of(island_model, "import") for island_model in island_models), default=0.0)
        overhead = self.costs.of("scene", "call")
        return Plan(tuple(steps), left_out, switched_off, self.rtol, overhead, first_use, problem.theory_name)

    def island_model(self, tolerance: float) -> str | AnyModel:
        """The island model for a step with that tolerance."""
        if self.problem.island_model is not None:
            return self.problem.island_model
        if "sphere_deformation" in self.problem.dropped:
            return "rigid"
        share = ISLAND_SHARE * tolerance
        return "universal" if certified_error("universal", share) <= share else "exact"

    def contact(self, why: Sequence[str]) -> Step:
        """One contact at all gaps; of theories other than MBMA a law, if force and area suffice and it costs less."""
        outputs, theory = self.problem.outputs, self.problem.theory_name
        parts = {
            "inverse": self.problem.prescribed in INVERTED,
            "slopes": bool(outputs & {"stiffness", "conductance"}),
            "energy": "energy" in outputs,
            "yield": "yield" in outputs,
        }
        factor = math.prod(by for part, by in AMPLIFICATION.items() if parts.get(part))
        what = f"pressure, area and derived quantities at {self.count} gaps"
        if self.problem.theory == "mbma":
            if parts["energy"] and self.rtol < MIN_ENERGY_RTOL:
                raise InputError(f"rtol = {self.rtol:g} is too tight for energy: {MIN_ENERGY_RTOL:.0e} at best")
            step = self.summed("contact", ", ".join(why), f"sum over islands (Eqs. 48, 49): {what}", None, factor)
            more = [self.costs.seconds * (a + b * self.count) for part, (a, b) in OF_MBMA.items() if parts[part]]
            seconds = math.nan if parts["yield"] else step.seconds + sum(more)
            return dataclasses.replace(step, seconds=seconds, theory=theory)
        name, asked, error = "contact", None, factor * self.own_error() if parts["yield"] else self.own_error()
        call, each = (self.costs.of(theory, of) for of in ("call", "invert" if parts["inverse"] else "gap"))
        each += self.costs.of(theory, "energy") if parts["energy"] else 0.0
        weights = (YIELDING_CALL, YIELDING_GAP) if parts["yield"] else (1.0, 1.0)
        seconds = weights[0] * call + weights[1] * self.count * each
        if outputs & set(OF_CONTACT) <= {"pressure", "area"}:
            rtol = max((1 - ISLAND_SHARE) * self.rtol / AMPLIFICATION["inverse"], MIN_LAW_RTOL)
            found = self.costs.of("law", "lookup") + (self.costs.of("law", "invert") if parts["inverse"] else 0.0)
            by_law = self.costs.of(theory, "law", rtol) + self.count * found
            if self.count >= MIN_LAW_GAPS if math.isnan(seconds) else by_law < seconds:
                name, asked, error, seconds = "law", rtol, factor * (rtol + error), by_law
        return Step(name, ", ".join(why), what, None, asked, self.count, error, seconds, theory)

    def summed(self, name: str, why: str, what: str, priced_as: str | None, factor: float = 1.0) -> Step:
        """A sum over islands at every gap; `priced_as` is an island model whose totals cost about the same."""
        tolerance = self.rtol / factor
        island_model, asked = self.island_model(tolerance), (1 - ISLAND_SHARE) * tolerance
        priced = priced_as or _name(island_model)
        # its islands are answered once, as for a law
        seconds = self.costs.of(priced, "call") + self.count * self.costs.of(priced, "gap", asked)
        seconds = min(seconds, self.costs.of(priced, "law", asked))
        error = factor * (asked + certified_error(island_model, asked))
        return Step(name, why, what, island_model, asked, self.count, error, seconds)

    def own_error(self) -> float:
        """Bound of the scene's theory on its numerical error."""
        from mbma_tables.theories import get_theory

        surface, gaps = self.problem.surface, self.problem.gaps
        h_max, farthest = float(surface.h_max), 0.0
        if self.problem.prescribed not in INVERTED:
            # the farther from the mid-plane, the larger
            farthest = np.max(gaps if self.problem.prescribed == "mean_separations" else (h_max + gaps) / 2)
        u = min(max(farthest, 0.5 * h_max), LAST * h_max)
        return float(get_theory(self.problem.theory, surface).answer(surface, np.asarray(u)).error)


def _name(island_model: Any) -> str:
    """The name of an island model in the table of measured costs, which holds the shipped ones."""
    return island_model if isinstance(island_model, str) else ""
